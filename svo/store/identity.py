"""What a folder of results is of: a configuration and versions of the software, in one JSON file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from svo.store.whole import write_text

_NOT_COMPARED = "machine"  # bit for bit equality is promised on one machine only, and results may go on on another
_LARGEST = 1_000_000  # bytes


@dataclass(frozen=True)
class Identity:
    """What the results depend on.

    Attributes
    ----------
    format : str
        Of the folder.
    configuration : mapping
        Plain data, as JSON gives them back.
    versions : mapping of str to str
        Of the software; that of "machine" is for the record only.
    runs : int or None
        How many there are, so that what is none of them is known; None where it is not said.
    """

    format: str
    configuration: Mapping[str, Any]
    versions: Mapping[str, str]
    runs: int | None = None

    @property
    def digest(self) -> str:
        """What all parts of the results agree on, on any machine."""
        software = {name: version for name, version in self.versions.items() if name != _NOT_COMPARED}
        text = json.dumps([self.format, self.configuration, software], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def write(self, path: Path) -> None:
        write_text(path, json.dumps(asdict(self), indent=2) + "\n")

    @classmethod
    def read(cls, path: Path, format: str) -> Identity:
        """What `write` wrote.

        Raises
        ------
        ValueError
            If the file is something else, or of another format.
        """
        wrong = f"{path} is not that of a study"
        if path.stat().st_size > _LARGEST:
            raise ValueError(f"{wrong}; it has more than {_LARGEST} bytes")
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{wrong}; it is no JSON ({error})") from error
        if not (isinstance(stored, dict) and isinstance(stored.get("configuration"), dict)):
            raise ValueError(f"{wrong}; expected an object with a configuration")
        if stored.get("format") != format:
            raise ValueError(
                f"{path} has the format {stored.get('format')!r:.80}, that of another version of svo; expected "
                f"{format!r}, so start anew in another folder"
            )
        versions = stored.get("versions")
        if not (isinstance(versions, dict) and all(isinstance(value, str) for value in versions.values())):
            raise ValueError(f"{wrong}; versions is no object of texts")
        runs = stored.get("runs")
        if not (runs is None or (isinstance(runs, int) and runs > 0)):
            raise ValueError(f"{wrong}; runs is {runs!r:.80}, expected how many there are")
        return cls(format, stored["configuration"], versions, runs)

    def check_same(self, now: Identity, folder: Path) -> None:
        """Raise a ValueError if a folder's identity (this one) is not that of what is to go on in it."""
        was, new = ({**i.configuration, **i.versions} for i in (self, now))
        different = [
            f"{key} was {was.get(key)!r}, now {new[key]!r}"
            for key in new
            if key != _NOT_COMPARED and was.get(key) != new[key]
        ]
        if different:
            raise ValueError(
                f"{folder} holds another study ({'; '.join(different)}); "
                "resume with the same configuration and versions, or choose another folder"
            )

"""The proofs of the alarms of a run as one packed file, a gzip member a chain: `docs/proof_format.md`."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from svo.isolation import Alarm
from svo.store.packed_lines import is_packed, members_of, packed

FORMAT = "svo-proof-1"


class Chain(NamedTuple):
    """The proof of one alarm.

    Attributes
    ----------
    alarm : Alarm
    steps : list of dict
        As `ProofSteps` has them.
    """

    alarm: Alarm
    steps: list[dict[str, Any]]


class ProofFile:
    """A file that chains are added to as they are proven: one that was interrupted is gone on with.

    What stands in it is proven again and kept if it is the same; nothing in it is believed, and nothing is replaced.

    Parameters
    ----------
    path : Path
    source : mapping
        Of the alarms: plant, noise set and architecture.

    Raises
    ------
    ValueError
        If the file exists and is no proof of alarms of this plant and noise set.
    """

    def __init__(self, path: Path, source: Mapping[str, Any]) -> None:
        self._path = path
        self._head = _text(
            {"format": FORMAT} | {k: source[k] for k in ("plant", "noise", "architecture") if k in source}
        )
        self._kept: list[bytes] = []
        self.chains = 0
        if path.exists():
            self._read()

    def add(self, chain: Chain) -> None:
        """The next chain, on the disk when this returns.

        Raises
        ------
        ValueError
            If another one stands in its place.
        """
        text = b"".join(map(_text, _lines(chain)))
        if self.chains < len(self._kept):
            if self._kept[self.chains] != text:
                raise ValueError(f"{self._path} has another proof of {chain.alarm.observer!r}; give another name")
        else:
            with self._path.open("ab") as file:
                file.write(packed(text) if self.chains or self._kept else packed(self._head) + packed(text))
                file.flush()
                os.fsync(file.fileno())
        self.chains += 1

    def close(self) -> None:
        """Raise ValueError if the file has more chains than were added."""
        if self.chains < len(self._kept):
            raise ValueError(f"{self._path} has proofs of other alarms than these; give another name")

    def _read(self) -> None:
        """The whole members; one that was cut off is dropped."""
        size, found = 0, list[bytes]()
        if not is_packed(self._path):
            raise ValueError(f"{self._path} exists, and is no proof of these alarms; give another name")
        try:
            for raw, content in members_of(self._path):
                size += len(raw)
                found.append(content)
        except (ValueError, zlib.error):
            pass
        if not found or found[0] != self._head:
            raise ValueError(f"{self._path} exists, and is no proof of these alarms; give another name")
        os.truncate(self._path, size)
        self._kept = found[1:]


def _lines(chain: Chain) -> Iterator[dict[str, Any]]:
    alarm = chain.alarm
    yield {"step": "chain", "observer": alarm.observer, "sample": alarm.sample, "time": float(alarm.time).hex()}
    yield from chain.steps


def _text(line: Mapping[str, Any]) -> bytes:
    return (json.dumps(line) + "\n").encode()

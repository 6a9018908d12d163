"""The proofs of the alarms of a run as one packed file, a gzip member a chain: `docs/proof_format.md`."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from svo.isolation import Alarm
from svo.store.packed_lines import members_of, packed

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
        self._whole = 0  # bytes of the members that are
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
                file.truncate(self._whole)
                file.write(packed(text) if self._whole else packed(self._head) + packed(text))
                file.flush()
                os.fsync(file.fileno())
                self._whole = file.tell()
        self.chains += 1

    def close(self) -> None:
        """Raise ValueError if the file has more chains than were added."""
        if self.chains < len(self._kept):
            raise ValueError(f"{self._path} has proofs of other alarms than these; give another name")
        if self._whole < self._path.stat().st_size:
            os.truncate(self._path, self._whole)

    def _read(self) -> None:
        """The whole members; what follows them stays until a chain is proven to stand in its place."""
        if not self._is_begun():
            return
        found = list[bytes]()
        with suppress(ValueError, zlib.error):
            for raw, content in members_of(self._path):
                self._whole += len(raw)
                found.append(content)
        self._kept = found[1:]

    def _is_begun(self) -> bool:
        """Whether the first member is that of these alarms; False if it was cut off.

        No more is unpacked than it takes: the file may be anything.
        """
        head = packed(self._head)
        with self._path.open("rb") as file:
            first = file.read(2 * len(head) + 64)
        if len(first) < len(head) and head.startswith(first):
            return False
        member = zlib.decompressobj(31)
        with suppress(zlib.error):
            if member.decompress(first, len(self._head) + 1) == self._head and member.eof:
                return True
        raise ValueError(f"{self._path} exists, and is no proof of these alarms; give another name")


def _lines(chain: Chain) -> Iterator[dict[str, Any]]:
    alarm = chain.alarm
    yield {"step": "chain", "observer": alarm.observer, "sample": alarm.sample, "time": float(alarm.time).hex()}
    yield from chain.steps


def _text(line: Mapping[str, Any]) -> bytes:
    return (json.dumps(line) + "\n").encode()

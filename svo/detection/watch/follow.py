"""Lines of a file as it grows, followed by its name through everything that rotates logs.

Whether the name stands for the file that was read so far is seen by its number in the file system and by its content:
its first bytes, and the last ones that were read. So a file that was truncated is noticed also where it is longer than
before at once, and one that was written anew with the same beginning goes on where it was.

When the name gets a new file, the old one is read to its end first. What a truncation took away is looked for in the
files beside it whose names begin with the log's (``log.csv.1``), as ``copytruncate`` leaves them.
"""

from __future__ import annotations

import glob
import os
import stat
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Any, BinaryIO

from svo.detection.watch.lines import CHUNK, Line, Lines, Notice, Splitter
from svo.detection.watch.stream import StreamLines
from svo.logs.lines import no_end

POLL_SECONDS = 0.005
_FINGERPRINT = 512  # bytes at the beginning, and as many before the position


@dataclass(frozen=True)
class Position:
    """Where the bytes that were read of a file end, and what they were at both ends."""

    offset: int = 0
    head: bytes = b""
    tail: bytes = b""

    def after(self, chunk: bytes) -> Position:
        """The position behind a chunk that was read here."""
        head = self.head if len(self.head) == _FINGERPRINT else (self.head + chunk)[:_FINGERPRINT]
        return Position(self.offset + len(chunk), head, (self.tail + chunk)[-_FINGERPRINT:])

    def read(self, file: BinaryIO) -> bytes | None:
        """What follows it in a file; None if what was read does not stand in front of it."""
        file.seek(0)
        if file.read(len(self.head)) != self.head:
            return None
        file.seek(self.offset - len(self.tail))
        # In one call, so that nobody can exchange the content in between.
        found = file.read(len(self.tail) + CHUNK)
        return found[len(self.tail) :] if found.startswith(self.tail) else None


class FileLines:
    """Lines of the file that has a name.

    Parameters
    ----------
    path : path
    until_end : bool
        End where the file ends, instead of waiting for more.
    clock, pause : callable
        Seconds that have passed, and waiting for some.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """

    def __init__(
        self,
        path: Path,
        until_end: bool,
        *,
        clock: Callable[[], float] = monotonic,
        pause: Callable[[float], None] = sleep,
    ) -> None:
        self.name = str(path)
        self._path, self._until_end, self._clock, self._pause = path, until_end, clock, pause
        self._splitter = Splitter()
        self._position = Position()
        self._file = _opened(path)
        self._is_beside = False  # a file beside the log's is read, for what the log has lost
        self._is_gone = False
        self._notices: list[Line | Notice] = []
        self._ended = False

    def read(self, wait: float) -> list[Line | Notice] | None:
        """See `svo.detection.watch.lines.Lines`."""
        end = self._clock() + wait
        while not self._ended:
            found = self._advance()
            if self._notices or found:
                found, self._notices = [*self._notices, *(found or [])], []
                return found
            if found is not None:
                continue
            if self._until_end:
                self._ended = True
                half = self._splitter.half
                return [Notice(f"{self.name}: {no_end(half)}")] if half else []
            if self._clock() >= end:
                return []
            self._pause(POLL_SECONDS)
        return None

    def state(self) -> dict[str, Any]:
        """See `svo.detection.watch.lines.Lines`."""
        at = self._position
        where = {"offset": at.offset, "head": at.head.hex(), "tail": at.tail.hex()}
        return where | {"splitter": self._splitter.state()}

    def resume(self, state: Mapping[str, Any]) -> None:
        """See `svo.detection.watch.lines.Lines`; if the file is another one by now, it is read from its beginning."""
        head, tail = (bytes.fromhex(state[key]) for key in ("head", "tail"))
        self._position = Position(int(state["offset"]), head, tail)
        self._splitter.resume(state["splitter"])

    def close(self) -> None:
        self._file.close()

    def _advance(self) -> list[Line | Notice] | None:
        """What can be read now: lines, none because half a line came, or None because nothing did."""
        chunk = self._position.read(self._file)
        if chunk is None:
            return self._go_on_beside() or self._begin("was truncated or written anew")
        if not chunk and self._has_successor():
            # Its writer has begun the new file, so the old one is complete now.
            chunk = self._position.read(self._file)
            if not chunk:
                return self._begin("is a new file")
        if not chunk:
            return None
        self._position = self._position.after(chunk)
        return [*self._splitter.add(chunk)]

    def _has_successor(self) -> bool:
        """Whether the name stands for another file, in which something is written."""
        try:
            now = os.stat(self._path)
        except OSError as error:
            self._wait_for_name(error)
            return False
        self._is_gone = False
        return not os.path.samestat(os.fstat(self._file.fileno()), now) and now.st_size > 0

    def _begin(self, why: str) -> list[Line | Notice] | None:
        """Read what has the name now: on where we were if that has the same content so far, else from its beginning."""
        try:
            file = _opened(self._path)
        except OSError as error:
            self._wait_for_name(error)
            return None
        self._file.close()
        self._file, was_beside, self._is_beside = file, self._is_beside, False
        if not was_beside and self._position.read(file) is not None:
            return []
        half = self._splitter.half
        cut = [Line(half, "", "the file ended in the middle of it")] if half else []
        self._position = Position()
        self._splitter.clear()
        return [*cut, Notice(f"{self.name} {why}; it is read from its beginning", new_file=True)]

    def _wait_for_name(self, error: OSError) -> None:
        if not self._is_gone:
            self._notices.append(Notice(f"{self.name}: {error.strerror}; it is waited for"))
        self._is_gone = True

    def _go_on_beside(self) -> list[Line | Notice] | None:
        """Open a file beside the log's that goes on from what was read of the log."""
        for path in sorted(self._path.parent.glob(f"{glob.escape(self._path.name)}?*")):
            try:
                file = _opened(path)
            except OSError:
                continue
            if self._position.read(file):
                self._file.close()
                self._file, self._is_beside = file, True
                return [Notice(f"{self.name} was truncated or written anew; its rest is read from {path}")]
            file.close()
        return None


def lines_of(log: str, until_end: bool) -> Lines:
    """Standard input for "-", else a CSV file, or a pipe that has a name.

    Raises
    ------
    ValueError
        For a file that cannot be followed line by line.
    OSError
        If it cannot be opened.
    """
    if log == "-":
        return StreamLines()
    path = Path(log)
    if path.suffix.lower() in (".parquet", ".mat"):
        raise ValueError(f"{path} cannot be followed while it is written; expected a CSV file, or - for standard input")
    if path.is_dir():
        raise ValueError(f"{path} is a folder; expected a CSV file, or - for standard input")
    if not stat.S_ISREG(path.stat().st_mode):
        return StreamLines(os.open(path, os.O_RDONLY), str(path))
    return FileLines(path, until_end)


def _opened(path: Path) -> BinaryIO:
    return path.open("rb", buffering=0)

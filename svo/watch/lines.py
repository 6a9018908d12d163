"""Complete lines of a text that grows: a file that another program writes to, or standard input.

A last line that is only half written is kept until the rest of it arrives.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from time import monotonic, sleep
from typing import BinaryIO, Protocol

POLL_SECONDS = 0.005
_CHUNK = 1 << 16


class Lines(Protocol):
    """A source of lines.

    Attributes
    ----------
    name : str
        For messages.
    """

    name: str

    def read(self, wait: float) -> list[str] | None:
        """Lines that are complete, without their ends; none after ``wait`` seconds of silence, None at the end."""
        ...

    def close(self) -> None: ...


class FileLines:
    """Lines of a file as it grows.

    Parameters
    ----------
    path : path
    until_end : bool
        End where the file ends, instead of waiting for more; a last line without an end then counts.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """

    def __init__(self, path: Path, until_end: bool) -> None:
        self.name = str(path)
        self._file: BinaryIO = path.open("rb")
        self._until_end = until_end
        self._splitter = _Splitter(self.name)
        self._ended = False

    def read(self, wait: float) -> list[str] | None:
        """See `Lines`.

        Raises
        ------
        ValueError
            If the file became shorter, or is no UTF-8 text.
        """
        end = monotonic() + wait
        while not self._ended:
            chunk = self._file.read(_CHUNK)
            if chunk:
                lines = self._splitter.add(chunk)
                if lines:
                    return lines
                continue
            if self._until_end:
                self._ended = True
                return self._splitter.rest()
            if os.fstat(self._file.fileno()).st_size < self._file.tell():
                raise ValueError(f"{self.name} became shorter while it was read; start again on the new file")
            if monotonic() >= end:
                return []
            sleep(POLL_SECONDS)
        return None

    def close(self) -> None:
        self._file.close()


class StreamLines:
    """Lines of standard input, or of another open file descriptor; the end of the stream is the end."""

    def __init__(self, descriptor: int | None = None, name: str = "standard input") -> None:
        self.name = name
        self._splitter = _Splitter(name)
        self._chunks: Queue[bytes] = Queue(maxsize=64)
        self._ended = False
        # A thread, so that silence does not keep the view from being drawn; it dies with the program.
        Thread(target=self._pump, args=(sys.stdin.fileno() if descriptor is None else descriptor,), daemon=True).start()

    def read(self, wait: float) -> list[str] | None:
        """See `Lines`.

        Raises
        ------
        ValueError
            If the stream is no UTF-8 text.
        """
        if self._ended:
            return None
        end = monotonic() + wait
        while True:
            try:
                chunk = self._chunks.get(timeout=max(0.0, end - monotonic()))
            except Empty:
                return []
            if not chunk:
                self._ended = True
                return self._splitter.rest()
            lines = self._splitter.add(chunk)
            if lines:
                return lines

    def close(self) -> None:
        """Nothing: the stream belongs to the program."""

    def _pump(self, descriptor: int) -> None:
        chunk = b"?"
        while chunk:
            chunk = os.read(descriptor, _CHUNK)
            self._chunks.put(chunk)


def lines_of(log: str, until_end: bool) -> Lines:
    """Standard input for "-", else a CSV file.

    Raises
    ------
    ValueError
        For a file that cannot be followed line by line.
    """
    if log == "-":
        return StreamLines()
    path = Path(log)
    if path.suffix.lower() in (".parquet", ".mat"):
        raise ValueError(f"{path} cannot be followed while it is written; expected a CSV file, or - for standard input")
    return FileLines(path, until_end)


class _Splitter:
    """Bytes in, complete lines of text out."""

    def __init__(self, name: str) -> None:
        self._name, self._partial, self._count = name, b"", 0

    def add(self, chunk: bytes) -> list[str]:
        *complete, self._partial = (self._partial + chunk).split(b"\n")
        return [self._text(line) for line in complete]

    def rest(self) -> list[str]:
        """The last line, where it has no end."""
        partial, self._partial = self._partial, b""
        return [self._text(partial)] if partial else []

    def _text(self, line: bytes) -> str:
        self._count += 1
        try:
            return line.decode("utf-8-sig" if self._count == 1 else "utf-8").rstrip("\r")
        except UnicodeDecodeError as error:
            raise ValueError(
                f"{self._name}, line {self._count}: not a CSV text file ({error}); expected comma-separated columns in "
                "UTF-8"
            ) from error

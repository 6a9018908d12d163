"""The whole lines of a text file, in blocks of about the same size or one by one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO

from svo.logs.columns import Note

_MARK = b"\xef\xbb\xbf"
_END = re.compile(rb"\r\n|\n|\r")


class Lines(Iterator[str]):
    """Lines with their ends (LF, CR LF or CR), decoded from UTF-8; a last one without its end is left out with a note.

    Parameters
    ----------
    source : str
        Name of the file, for the note.
    file : binary file
    size : int
        Bytes to read at once. Only a line that is longer takes more.
    note : callable
        Told of a line that is left out.

    Attributes
    ----------
    number : int
        Lines given so far.
    """

    def __init__(self, source: str, file: BinaryIO, size: int, note: Note) -> None:
        self._source, self._file, self._size, self._note = source, file, size, note
        self._block, self._at = b"", 0
        self._left = b""  # read, but no whole line yet
        self._is_begun = self._is_over = False
        self.number = 0

    def block(self) -> bytes:
        """The lines that come next, empty at the end of the file; they are not given yet.

        Raises
        ------
        UnicodeDecodeError
            If they are no UTF-8.
        """
        if self.is_between_blocks and not self._is_over:
            self._load()
        return self._block[self._at :] if self._at else self._block

    def take_block(self) -> None:
        """All lines of the present block are given."""
        self.number += count_lines(self.block())
        self._at = len(self._block)

    @property
    def is_between_blocks(self) -> bool:
        """Whether all lines of the present block are given."""
        return self._at == len(self._block)

    def __next__(self) -> str:
        if self.is_between_blocks and not self.block():
            raise StopIteration
        found = _END.search(self._block, self._at)
        begin, self._at = self._at, found.end() if found else len(self._block)
        self.number += 1
        return self._block[begin : self._at].decode()

    def _load(self) -> None:
        """The next lines, or all of a file without any end of a line: a header, whole or not, is no sample."""
        data, end = bytearray(self._left), 0
        while not end and (new := self._read()):
            end = _whole(new) and len(data) + _whole(new)
            data += new
        self._is_over = not end
        if self._is_over and self.number == 0:
            end = len(data)
        elif self._is_over and data.strip():
            self._note(f"{self._source}: {no_end(self.number + 1)}")
        self._block, self._left, self._at = bytes(data[:end]), bytes(data[end:]), 0
        if not self._block.isascii():
            self._block.decode()

    def _read(self) -> bytes:
        start = b"" if self._is_begun else self._file.read(len(_MARK)).removeprefix(_MARK)
        self._is_begun = True
        new = start + self._file.read(self._size)
        return new + self._file.read(1) if new.endswith(b"\r") else new  # its line feed, if it has one


def count_lines(text: bytes) -> int:
    """Ends of lines: LF, CR LF or CR."""
    return text.count(b"\n") + (text.count(b"\r") - text.count(b"\r\n") if b"\r" in text else 0)


def no_end(line: int) -> str:
    """What is said of a last line that may be cut."""
    return (
        f"the last line ({line}) has no end and was left out, since it may be cut; "
        "if it is whole, put a line break behind it"
    )


def _whole(text: bytes) -> int:
    """Bytes up to the end of the last line that has one, 0 if none has."""
    return max(text.rfind(b"\n"), text.rfind(b"\r")) + 1

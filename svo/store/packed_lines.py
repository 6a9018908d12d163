"""Lines of a text file that may be packed as gzip: member after member, each whole, with an end to what they unpack to.

A file of lines that is appended to is a file of members that are: any reader of gzip reads them as one. Bytes decide
whether a file is packed, not its name.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

LONGEST_LINE = 64 * 2**20
"""Bytes of a line: a longer one is no record."""

_BLANK = b"\n" * 10_000
_MAGIC = b"\x1f\x8b"
_CHUNK = 2**16
_AT_LEAST, _MOST_TIMES = 4 * 2**20, 50  # unpacked bytes: text packs 5 to 20 times, zeros a thousand
_MEMBERS, _MEMBER = 1000, 48  # so many are read whatever they hold, more if they have that many bytes on average


def packed(content: bytes) -> bytes:
    """A gzip member, the same for the same content."""
    return gzip.compress(content, 9, mtime=0)


def lines_of(path: str | Path) -> Iterator[bytes]:
    """The lines of a file, packed or not, without their ends.

    Raises
    ------
    ValueError
        If a line is longer than `LONGEST_LINE` or thousands are blank, a member is damaged or holds nothing, or the
        file unpacks to more than such files do.
    """
    parts: list[bytes] = []  # of the line that has not ended
    length = 0
    for chunk in _unpacked(path):
        if _BLANK in chunk:
            raise ValueError(f"{path} has {len(_BLANK)} blank lines and more in a row, which no file of records has")
        *whole, rest = chunk.split(b"\n")
        for line in whole:
            yield b"".join([*parts, line])
            parts, length = [], 0
        parts.append(rest)
        length += len(rest)
        if length > LONGEST_LINE:
            raise ValueError(f"{path} has a line of more than {LONGEST_LINE >> 20} MB, which no record takes")
    if length:
        yield b"".join(parts)


def members_of(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """The members of a packed file: each as it stands there, and what it unpacks to."""
    with path.open("rb") as file:
        waiting = file.read(_CHUNK)
        while waiting:
            member, raw, content = zlib.decompressobj(31), b"", b""
            while waiting and not member.eof:
                raw, content = raw + waiting, content + member.decompress(waiting)
                waiting = member.unused_data or file.read(_CHUNK)
            if not member.eof:
                raise ValueError(f"{path} ends within a gzip member")
            yield raw[: len(raw) - len(member.unused_data)], content


def is_packed(path: str | Path) -> bool:
    """Whether a file is one of gzip, by its first bytes."""
    with open(path, "rb") as file:
        return file.read(2) == _MAGIC


def _unpacked(path: str | Path) -> Iterator[bytes]:
    if not is_packed(path):
        with open(path, "rb") as file:
            while chunk := file.read(_CHUNK):
                yield chunk
        return
    most = max(_AT_LEAST, _MOST_TIMES * Path(path).stat().st_size)
    total = 0
    with open(path, "rb") as file:
        for chunk in _chunks(file, path):
            total += len(chunk)
            if total > most:
                raise ValueError(f"{path} unpacks to more than {most >> 20} MB, {_MOST_TIMES} times its size and more")
            yield chunk


def _chunks(file: IO[bytes], path: str | Path) -> Iterator[bytes]:
    """What members unpack to, in portions."""
    member, produced, members = zlib.decompressobj(31), 0, 1
    waiting = file.read(_CHUNK)
    while waiting:
        if members > _MEMBERS + file.tell() // _MEMBER:
            raise ValueError(f"{path} is no file of records: its gzip members hold next to nothing")
        try:
            chunk = member.decompress(waiting, 16 * _CHUNK)
        except zlib.error as error:
            raise ValueError(f"{path} is damaged: {error}") from None
        produced += len(chunk)
        yield chunk
        waiting = member.unused_data if member.eof else member.unconsumed_tail
        if member.eof and not produced:
            raise ValueError(f"{path} is damaged: a gzip member in it holds nothing")
        waiting = waiting or file.read(_CHUNK)
        if member.eof and waiting:
            member, produced, members = zlib.decompressobj(31), 0, members + 1
    if not member.eof:
        raise ValueError(f"{path} ends within a gzip member; what it holds before that is lost with it")

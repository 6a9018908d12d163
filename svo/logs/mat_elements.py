"""The elements of MAT files of version 5 to 7.2: where each variable stands, and real arrays of numbers.

Only what a real numeric array consists of is read, and every size is compared with the bytes that are there before
anything is made of it, so that a damaged or hostile file is an error. Format: MathWorks, "MAT-File Format", 2019.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MATRIX, _COMPRESSED = 14, 15
_INT8, _INT32, _UINT32 = 1, 5, 6
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC_CLASSES = range(6, 16)
_OTHER_CLASSES = {1: "a cell array", 2: "a struct", 3: "an object", 4: "a text", 5: "a sparse matrix"}
_OTHER_CLASSES |= {16: "a function handle", 17: "an object"}
_OPAQUE = 17  # has no dimensions
_COMPLEX = 0x0800
_HEAD = 8192  # bytes that hold flags, dimensions and name
_MOST_DIMENSIONS = 32
_MOST_COMPRESSED = 1100  # times; Deflate cannot do more than 1032


class Damaged(ValueError):
    """What is wrong in a file."""


@dataclass(frozen=True)
class Element:
    """A variable of a file.

    Attributes
    ----------
    name : str
    kind : str
        "numbers", or in words what else it is.
    shape : tuple of int
    content : bytes
        Of the element, as it stands in the file.
    compressed : bool
    order : {"<", ">"}
    """

    name: str
    kind: str
    shape: tuple[int, ...]
    content: memoryview
    compressed: bool
    order: str

    @property
    def unpacked(self) -> int:
        """Bytes that reading it needs."""
        content = _size(self.content, self.order) if self.compressed else 0
        return content + (8 * math.prod(self.shape) if self.kind == "numbers" else len(self.content))

    def body(self) -> memoryview:
        """The matrix, unpacked, from its tag on."""
        return _inflate_all(self.content, self.order) if self.compressed else self.content

    def read(self) -> NDArray[np.float64]:
        """The array, for an element of numbers."""
        cursor = Cursor(self.body(), self.order)
        cursor.matrix()
        return cursor.numbers(self.shape).astype(float)


def elements(content: memoryview, order: str) -> Iterator[Element]:
    """The named variables of a file, from the end of its header on.

    Raises
    ------
    Damaged
    """
    at = 0
    while at < len(content):
        if len(content) - at < 8:
            raise Damaged("it ends in the middle of a variable")
        kind, size = (int(v) for v in np.frombuffer(content, order + "u4", 2, at))
        element = content[at : at + 8 + size]
        if len(element) < 8 + size:
            raise Damaged("it ends in the middle of a variable")
        if kind not in (_MATRIX, _COMPRESSED):
            raise Damaged(f"something of the unknown type {kind} stands where a variable is expected")
        at += 8 + size
        if size:
            compressed = kind == _COMPRESSED
            body = element[8:] if compressed else element
            found = _head(_inflate(body, _HEAD)[0] if compressed else body, body, compressed, order)
            if found.name:  # what has no name is MATLAB's own
                yield found


class Cursor:
    """Reads the elements inside a matrix, one after the other."""

    def __init__(self, content: memoryview, order: str) -> None:
        self._content, self._order, self._at = content, order, 0

    def matrix(self) -> tuple[int, tuple[int, ...], str]:
        """Flags, shape and name of the matrix that begins here."""
        kind, _ = self._tag()
        if kind != _MATRIX:
            raise Damaged(f"a compressed element of type {kind} is no variable")
        self._at += 8
        flags = int(self._array("flags", _UINT32)[0])
        shape: tuple[int, ...] = ()
        if flags & 0xFF != _OPAQUE:
            dimensions = self._array("dimensions", _INT32)
            if not 2 <= len(dimensions) <= _MOST_DIMENSIONS or (dimensions < 0).any():
                raise Damaged(f"a variable has the dimensions {dimensions.tolist()[:8]}")
            shape = tuple(int(d) for d in dimensions)
        name = self._array("name", _INT8)
        return flags, shape, name.tobytes().decode("latin-1")

    def nested(self) -> memoryview:
        """The matrix that begins here, from its tag on."""
        begin, (kind, size) = self._at, self._tag()
        if kind != _MATRIX:
            raise Damaged(f"an element of type {kind} is no variable")
        self._at = begin + 8 + size + -size % 8
        content = self._content[begin : begin + 8 + size]
        if len(content) < 8 + size:
            raise Damaged("a variable ends too early")
        return content

    def numbers(self, shape: tuple[int, ...]) -> NDArray[Any]:
        """The array of that shape that the next element holds."""
        kind, data = self.element()
        if kind not in _NUMBERS:
            raise Damaged(f"its numbers have the unknown type {kind}")
        dtype = np.dtype(self._order + _NUMBERS[kind])
        if len(data) != math.prod(shape) * dtype.itemsize:
            raise Damaged(f"it has {len(data)} bytes of numbers, which are not those of shape {shape}")
        return np.frombuffer(data, dtype).reshape(shape, order="F")

    def element(self) -> tuple[int, memoryview]:
        """Type and bytes of the next element."""
        kind, size = self._tag()
        if kind >> 16:  # a small one: sixteen bits each for type and size, and up to four bytes
            kind, size = kind & 0xFFFF, kind >> 16
            begin, self._at = self._at + 4, self._at + 8
            if size > 4:
                raise Damaged(f"a small element has {size} bytes")
        else:
            begin = self._at + 8
            self._at = begin + size + -size % 8
        data = self._content[begin : begin + size]
        if len(data) < size:
            raise Damaged("a variable ends too early")
        return kind, data

    def _tag(self) -> tuple[int, int]:
        if len(self._content) < self._at + 8:
            raise Damaged("a variable ends too early")
        kind, size = np.frombuffer(self._content, self._order + "u4", 2, self._at)
        return int(kind), int(size)

    def _array(self, what: str, expected: int) -> NDArray[np.integer]:
        kind, data = self.element()
        dtype = np.dtype(self._order + _NUMBERS[expected])
        if kind != expected or len(data) % dtype.itemsize or (what == "flags" and len(data) != 8):
            raise Damaged(f"the {what} of a variable have the type {kind} and {len(data)} bytes")
        return np.frombuffer(data, dtype)


def kind_of(flags: int) -> str:
    """ "numbers" for real ones, else in words what a matrix is.

    Raises
    ------
    Damaged
    """
    number = flags & 0xFF
    if number in _NUMERIC_CLASSES:
        return "an array of complex numbers" if flags & _COMPLEX else "numbers"
    if number not in _OTHER_CLASSES:
        raise Damaged(f"it is of the unknown class {number}")
    return _OTHER_CLASSES[number]


def _head(head: memoryview, content: memoryview, compressed: bool, order: str) -> Element:
    flags, shape, name = Cursor(head, order).matrix()
    kind = kind_of(flags)
    if flags & 0xFF in _NUMERIC_CLASSES:
        size = _size(content, order) if compressed else len(content)
        if math.prod(shape) > size or size > _MOST_COMPRESSED * len(content):
            raise Damaged(f"variable {name!r:.80} has too few bytes for numbers of shape {shape}")
    return Element(name, kind, shape, content, compressed, order)


def _size(content: memoryview, order: str) -> int:
    """Bytes that a compressed element says it has."""
    head, _ = _inflate(content, 8)
    if len(head) < 8:
        raise Damaged("a variable ends too early")
    return 8 + int(np.frombuffer(head, order + "u4", 1, 4)[0])


def _inflate_all(content: memoryview, order: str) -> memoryview:
    size = _size(content, order)
    data, whole = _inflate(content, size)
    if len(data) < size or not whole:
        raise Damaged("a compressed variable has another size than it says")
    return data


def _inflate(content: memoryview, most: int) -> tuple[memoryview, bool]:
    """The first bytes of what was compressed, and whether that is all of it, with the right checksum."""
    stream = zlib.decompressobj()
    try:
        data = stream.decompress(content, most)
        rest = stream.decompress(stream.unconsumed_tail, 1)
    except zlib.error as error:
        raise Damaged(f"a compressed variable is damaged ({error})") from error
    return memoryview(data), stream.eof and not rest

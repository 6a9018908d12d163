"""Nodes of MAT files of version 5 to 7.2: structures, cells and texts, every size compared with the bytes there are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.logs.dialect.mat_places import NoPlaceError
from svo.logs.mat_elements import Cursor, Damaged, kind_of
from svo.logs.mat_file import MatFile

_INTEGERS = {8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}


@dataclass(frozen=True)
class MatNode:
    """A matrix, from its tag on; what is damaged raises `Damaged`."""

    content: memoryview
    order: str

    @property
    def kind(self) -> str:
        return kind_of(self._flags)

    @property
    def shape(self) -> tuple[int, ...]:
        return self._head[1]

    def names(self) -> list[str]:
        return self._parts[0]

    def inner(self, element: int, name: str | None = None) -> MatNode:
        names, parts = self._parts
        at = element if name is None else element * len(names) + names.index(name)
        return MatNode(parts[at], self.order)

    def array(self) -> NDArray[Any]:
        if len(self.content) == 8:
            return np.zeros((0, 0))
        values = self._cursor().numbers(self.shape)
        return values.astype(_INTEGERS.get(self._flags & 0xFF, "f8"))

    def text(self) -> str:
        if len(self.content) == 8:
            return ""
        kind, data = self._cursor().element()
        if kind not in _ENCODINGS:
            raise Damaged(f"a text has the unknown type {kind}")
        mark = {"<": "-le", ">": "-be"}[self.order] if _ENCODINGS[kind] in ("utf-16", "utf-32") else ""
        return bytes(data).decode(_ENCODINGS[kind] + mark, "replace")

    @property
    def _flags(self) -> int:
        return self._head[0]

    @cached_property
    def _head(self) -> tuple[int, tuple[int, ...]]:
        if len(self.content) == 8:  # a field that nobody has filled
            return 6, (0, 0)
        flags, shape, _ = Cursor(self.content, self.order).matrix()
        return flags, shape

    def _cursor(self) -> Cursor:
        """Behind flags, shape and name."""
        cursor = Cursor(self.content, self.order)
        cursor.matrix()
        return cursor

    @cached_property
    def _parts(self) -> tuple[list[str], list[memoryview]]:
        """Names of the fields, and what the elements of a struct or cell array hold, one after the other."""
        cursor, names = self._cursor(), list[str]()
        if self.kind == "a struct":
            _, width = cursor.element()
            _, data = cursor.element()
            length = int.from_bytes(width, "little" if self.order == "<" else "big")
            if not 0 < length <= 64 or len(data) % length:
                raise Damaged(f"the names of its fields have {len(data)} bytes, {length} each")
            names = [bytes(data[i : i + length]).rstrip(b"\0").decode("latin-1") for i in range(0, len(data), length)]
        each = 1 if self.kind == "a cell array" else len(names)
        count = int(np.prod(self.shape)) * each
        if count * 8 > len(self.content):
            raise Damaged(f"it has too few bytes for {count} parts")
        return names, [cursor.nested() for _ in range(count)]


@dataclass(frozen=True)
class PlainNode:
    """A variable of version 4, or one that only MATLAB can read: numbers, or nothing that is read."""

    kind: str
    values: NDArray[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        return self.values.shape

    def names(self) -> list[str]:
        return []

    def inner(self, element: int, name: str | None = None) -> PlainNode:
        raise NoPlaceError(f"there is nothing inside {self.kind}")

    def array(self) -> NDArray[Any]:
        return self.values

    def text(self) -> str:
        return ""


def mat_nodes(path: Path) -> dict[str, MatNode | PlainNode]:
    """The variables of a file.

    Raises
    ------
    ValueError
        If the file is damaged, or would unpack to more than `svo.store.unpacking` allows.
    """
    file = MatFile.open(path)
    nodes: dict[str, MatNode | PlainNode] = {}
    for name, kind in file.kinds.items():
        matrix = None if kind == "an object" else file.matrix(name)
        if matrix is not None:
            nodes[name] = MatNode(*matrix)
        else:
            nodes[name] = PlainNode(kind, file.read([name])[name] if kind == "numbers" else np.zeros((0, 0)))
    return nodes

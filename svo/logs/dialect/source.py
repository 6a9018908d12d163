"""What a file has to offer so that channels are read from it: columns, and where their cells stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from svo.checks import Array
from svo.logs.dialect.rules import Which

Cells = Sequence[str] | Array


class Source(Protocol):
    """Columns of one file.

    Attributes
    ----------
    source : str
        The file, for messages.
    again : sequence of int
        Lines in which the names stood again.
    notes : sequence of str
    """

    @property
    def source(self) -> str: ...

    @property
    def again(self) -> Sequence[int]: ...

    @property
    def notes(self) -> Sequence[str]: ...

    def column(self, which: Which) -> Cells:
        """Texts, or numbers (K,) where the file has numbers."""
        ...

    def size(self, which: Which) -> int:
        """Rows of a column."""
        ...

    def label(self, which: Which) -> str:
        """How messages call a column."""
        ...

    def place(self, row: int) -> str:
        """Where a row stands, for messages."""
        ...

    def line(self, row: int) -> int:
        """The line that a row begins in, or the sample."""
        ...

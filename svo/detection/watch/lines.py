"""Lines of a text that grows, in linear time and bounded memory; what cannot be read is named as such.

Sources of lines are a file by its name (`svo.detection.watch.follow`) and a stream (`svo.detection.watch.stream`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

LONGEST_LINE = 1 << 20  # bytes; of a longer one nothing is kept
CHUNK = 1 << 14
_END = re.compile(rb"\r\n|\n|\r")


@dataclass(frozen=True)
class Line:
    """A line without its end.

    Attributes
    ----------
    number : int
        In its file, from 1.
    text : str
    fault : str or None
        Why it cannot be read; ``text`` is empty then.
    """

    number: int
    text: str
    fault: str | None = None


@dataclass(frozen=True)
class Notice:
    """Something that a reader of the log should know of.

    Attributes
    ----------
    text : str
    new_file : bool
        Whether the lines after it are those of another file, which may have a header of its own.
    """

    text: str
    new_file: bool = False


class Lines(Protocol):
    """A source of lines.

    Attributes
    ----------
    name : str
        For messages.
    """

    name: str

    def read(self, wait: float) -> Sequence[Line | Notice] | None:
        """What is new and complete; nothing after ``wait`` seconds of silence, None at the end."""
        ...

    def state(self) -> dict[str, Any]:
        """Where the lines that were read end, for JSON."""
        ...

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave; before the first line is read."""
        ...

    def close(self) -> None: ...


class Splitter:
    """Bytes in, complete lines out; a half one waits for its rest. A line ends with LF, CR LF or CR."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget the half line, and count from 1 again."""
        self._half = bytearray()
        self._too_long = self._after_cr = False
        self.count = 0

    def add(self, chunk: bytes) -> list[Line]:
        """The lines that a chunk completes."""
        if self._after_cr and chunk.startswith(b"\n"):
            chunk = chunk[1:]
            self._after_cr = False
        if not chunk:
            return []
        self._after_cr = chunk.endswith(b"\r")
        first, *rest = _END.split(chunk)
        lines = []
        for piece in rest:
            self._keep(first)
            lines.append(self._take())
            first = piece
        self._keep(first)
        return lines

    @property
    def half(self) -> int | None:
        """The number of a line that has no end yet; None if there is none."""
        return self.count + 1 if self._too_long or self._half.strip() else None

    def state(self) -> dict[str, Any]:
        """For JSON."""
        flags = {"too_long": self._too_long, "after_cr": self._after_cr}
        return {"half": self._half.hex(), "count": self.count, **flags}

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from what `state` gave."""
        self._half = bytearray.fromhex(state["half"])
        self._too_long, self._after_cr = bool(state["too_long"]), bool(state["after_cr"])
        self.count = int(state["count"])

    def _keep(self, piece: bytes) -> None:
        self._too_long = self._too_long or len(self._half) + len(piece) > LONGEST_LINE
        if self._too_long:
            self._half.clear()
        else:
            self._half += piece

    def _take(self) -> Line:
        """The half line as a whole one."""
        self.count += 1
        line, too_long = bytes(self._half), self._too_long
        self._half.clear()
        self._too_long = False
        if too_long:
            return Line(self.count, "", f"it is longer than {LONGEST_LINE} bytes")
        if b"\0" in line:
            return Line(self.count, "", "it has NUL bytes in it, which are no text")
        try:
            return Line(self.count, line.decode("utf-8-sig" if self.count == 1 else "utf-8"))
        except UnicodeDecodeError as error:
            return Line(self.count, "", f"it is not UTF-8 text ({error})")

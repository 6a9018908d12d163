"""What a message about a plain log that is none says of how the file seems to be written."""

from __future__ import annotations

from pathlib import Path

from svo.logs.dialect.clues import layout_of, marks_in, text_of

_NAMES = {";": "semicolons", "\t": "tabs", "|": "bars", " ": "blanks", ",": "commas"}


def seems_written(path: Path) -> str:
    """A sentence on the dialect of a file, "" if nothing is seen; for messages, nothing is read with it."""
    try:
        text = text_of(path)
        layout = layout_of(text.lines)
    except (ValueError, OSError):
        return ""
    if layout is None:
        return ""
    seen = [f"in {text.encoding}"] if text.encoding != "utf-8" else []
    if layout.separator != ",":
        seen.append(f"with {_NAMES[layout.separator]} between the cells")
    if marks_in(list(zip(*_of_one_width(layout.rows), strict=True)))[0] == ",":
        seen.append("with decimal commas")
    if layout.header is not None and any(line.strip() for line in text.lines[: layout.header - 1]):
        seen.append(f"with the names in line {layout.header}")
    if not seen:
        return ""
    return (
        f". The file seems to be written {', '.join(seen)}: a [log] table says so, and svo import {path} --guess "
        "proposes one"
    )


def _of_one_width(rows: list[list[str]]) -> list[list[str]]:
    width = max(map(len, rows))
    return [row + [""] * (width - len(row)) for row in rows]

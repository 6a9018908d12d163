"""Clues of how a text is written, from its first and last lines: for proposals, nothing is read with them."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from svo.logs.dialect.numbers import Marks
from svo.logs.dialect.text import check_text, mark_of, wide_encoding

COMMENT = re.compile(r"\s*([#%!]|//)")
SEPARATORS = (";", "\t", "|", ",", " ")
_LOOKED_AT = 1 << 18  # bytes
_POINT, _COMMA = Marks("."), Marks(",")
_BLANKS = " \u00a0\u202f\u2009"
_GROUPS = re.compile(rf"[+-]?\d{{1,3}}([,.'’{_BLANKS}])\d{{3}}(?:\1\d{{3}})*(?:[.,]\d+)?")
_EXPONENT = re.compile(r"([+-]?\d+[.,]?\d*)[dD]([+-]\d{1,3})")


@dataclass(frozen=True)
class Text:
    """The beginning of a file as lines, and its encoding; ``stated`` is what a table has to say of it, if anything."""

    lines: list[str]
    encoding: str
    stated: str


def text_of(path: Path) -> Text:
    """The first lines of a text file.

    Raises
    ------
    ValueError
        If it is empty, or no text.
    OSError
        If it cannot be opened.
    """
    with path.open("rb") as file:
        data = file.read(_LOOKED_AT)
    if not data:
        raise ValueError(f"{path} is empty; expected a log")
    check_text(path, data)
    mark, stated = mark_of(data), ""
    if mark is not None:
        data, encoding = data[len(mark[0]) :], mark[1]
    elif b"\0" in data[:200]:
        encoding = stated = wide_encoding(data)
    else:
        encoding = "utf-8" if _decodes(data, "utf-8") else "cp1252"
        stated = "" if encoding == "utf-8" else encoding
    text = data.decode(encoding, "replace")
    if "\0" in text or sum(not c.isprintable() and not c.isspace() for c in text) > 0.01 * len(text):
        raise ValueError(f"{path} is no text; expected a log, in text or as a MAT or Parquet file")
    return Text(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), encoding, stated)


def _decodes(data: bytes, encoding: str) -> bool:
    try:
        data.decode(encoding)
    except UnicodeDecodeError as error:
        return error.start > len(data) - 4  # a letter may be cut where the look ends
    return True


@dataclass(frozen=True)
class Layout:
    """Which lines are what.

    Attributes
    ----------
    separator : str
    header : int or None
        Line of the names, from 1 on; None if there is none.
    names : list of str
    more : list of int
        Lines of more names or units behind it.
    first_row : int
    rows : list of list of str
        Those that are as wide as most are.
    foreign : list of str
        Lines behind the first row that are no rows.
    """

    separator: str
    header: int | None
    names: list[str]
    more: list[int]
    first_row: int
    rows: list[list[str]]
    foreign: list[str]


def layout_of(lines: Sequence[str], separator: str | None = None, header: int | None = None) -> Layout | None:
    """How the lines of a text are laid out; None if no rows of numbers are found.

    Parameters
    ----------
    lines : sequence of str
    separator : str, optional
        Where it is known.
    header : int, optional
        The line of the names, where it is known.
    """
    separator = separator or max(SEPARATORS, key=lambda mark: _fit(lines, mark))
    split = [cells_of(line, separator) for line in lines]
    widths = Counter(len(cells) for cells in split if _is_data(cells))
    if not widths:
        return None
    width = widths.most_common(1)[0][0]
    data = [i for i, cells in enumerate(split) if _is_data(cells) and len(cells) >= 0.8 * width]
    # A preamble may have numbers too, but is not followed by rows.
    first = next((i for i in data if sum(k in data for k in range(i, i + 6)) >= min(4, len(data))), data[0])
    heads = [header - 1] if header else [i for i in range(first - 4, first) if _is_head(split, i, first, width)]
    names = split[heads[0]] if heads else []
    rows = [split[i] for i in data if i >= first and split[i] != names]
    foreign = [lines[i] for i in range(first, len(lines)) if any(split[i]) and i not in data and split[i] != names]
    head = heads[0] + 1 if heads else None
    return Layout(separator, head, names, [i + 1 for i in heads[1:]], first + 1, rows, foreign)


def _is_head(split: Sequence[Sequence[str]], i: int, first: int, width: int) -> bool:
    """Whether a line may be one of names: as wide as the rows, no row, and nothing blank between it and them."""
    wide = i >= 0 and len(split[i]) >= 0.8 * width and not _is_data(split[i])
    return wide and all(any(split[k]) for k in range(i, first))


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of one line."""
    line = " ".join(line.split()) if separator == " " else line
    try:
        row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell of more than 131,072 letters is none of a log
        return []
    return [cell.strip() for cell in row]


def is_number(cell: str) -> bool:
    """Whether a cell is a number with one of the marks."""
    return number_in(cell) is not None


def number_in(cell: str) -> float | None:
    """What a cell is as a number with either mark, or with groups of thousands; None if it is none."""
    cell = _EXPONENT.sub(r"\1e\2", cell)
    plain = _POINT.plain(cell) or _COMMA.plain(cell)
    if plain is None and (groups := _GROUPS.fullmatch(cell)):
        plain = _POINT.plain(cell.replace(groups[1], "").replace(",", "."))
    return None if plain is None else float(plain)


def has_exponent(cells: Sequence[str]) -> bool:
    """Whether numbers are written as 1.5D+03."""
    return any(map(_EXPONENT.fullmatch, cells))


def marks_in(columns: Sequence[Sequence[str]]) -> tuple[str, str]:
    """Decimal and thousands marks of the numbers in columns; "" of thousands if there are none."""
    cells = [cell for column in columns for cell in column]
    thousands = ""
    for cell in cells:
        groups = _GROUPS.fullmatch(cell)
        if groups is None:
            continue
        marks = [c for c in cell if not c.isdigit() and c not in "+-"]
        mark = " " if groups[1] in _BLANKS else groups[1]
        if len(set(marks)) == 2:
            return marks[-1], mark
        if mark not in ",." or len(marks) > 1:
            thousands = mark
    cells = [_EXPONENT.sub(r"\1e\2", cell) for cell in cells]
    commas = sum("," in cell and _COMMA.plain(cell) is not None for cell in cells)
    points = sum("." in cell and _POINT.plain(cell) is not None for cell in cells)
    decimal = "," if commas > points and thousands != "," else "."
    return ("," if thousands == "." else decimal), thousands


def _fit(lines: Sequence[str], separator: str) -> float:
    """How well a separator splits the lines into rows of one width with numbers in them."""
    split = [cells_of(line, separator) for line in lines if line.strip()]
    widths = Counter(len(cells) for cells in split if len(cells) > 1 and _is_data(cells))
    if not widths:
        return 0.0
    width, count = widths.most_common(1)[0]
    numbers = sum(_numeric(cells) for cells in split if len(cells) == width) / max(count, 1)
    return count / len(split) * (1 + min(numbers, 3))


def _is_data(cells: Sequence[str]) -> bool:
    """A row has a number in it, beside names and units."""
    filled = [cell for cell in cells if cell]
    return len(cells) > 1 and any(map(is_number, filled)) and _numeric(cells) >= 0.2 * len(filled)


def _numeric(cells: Sequence[str]) -> int:
    return sum(map(is_number, cells))


def is_broken(line: str, separator: str) -> bool:
    """Whether a line seems to be a row that was damaged, which is not to be skipped without a word."""
    return line.count('"') % 2 == 1 or all(map(is_number, filter(None, cells_of(line, separator))))


def is_foreign(line: str) -> bool:
    """Whether a line behind the first row has words of its own, beside comments."""
    return bool(line.strip(";,\t| ")) and not COMMENT.match(line)


def escaped(line: str) -> str:
    """A line as a regular expression, without the marks around it."""
    return re.sub(r"([.^$*+?{}\[\]\\|()])", r"\\\1", line.strip(' \t;,"')[:60])

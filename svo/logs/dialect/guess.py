"""A proposal of a `[log]` table for a log (``svo import --guess``): TOML to be checked, nothing is read with it."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Sequence
from datetime import date, timedelta
from difflib import get_close_matches
from itertools import pairwise
from pathlib import Path

import numpy as np

from svo.logs.dialect.clues import (
    COMMENT,
    Layout,
    Text,
    cells_of,
    escaped,
    has_exponent,
    is_broken,
    is_foreign,
    is_number,
    layout_of,
    marks_in,
    number_in,
    text_of,
)
from svo.logs.dialect.dates import suggested
from svo.logs.dialect.mat import places_in
from svo.logs.dialect.signatures import Signature, signature_of
from svo.logs.dialect.stamps import UNITS, is_duration, seconds
from svo.logs.names import Columns

_TIME = re.compile(r"time|zeit|date|datum|stamp|^t$|^t[ _\[(]", re.IGNORECASE)
_VALUE = re.compile(r"^_?(value|val|varvalue|wert|messwert)$", re.IGNORECASE)
_DECIMALS = re.compile(r"[+-]?\d+(?:\.(\d{1,4})|,(\d{1,2}|\d{4}))")
_FLAG = re.compile(r"valid|quality|status|guete|ok$", re.IGNORECASE)
_UNIT = re.compile(r"\[([^\]]+)\]|\(([^)]+)\)")
_SENTINELS = re.compile(r"-?(?:9999?9?|7999|6999|32768|99999?)(?:\.0+)?")
_CLOCK = re.compile(r"\d{1,2}:\d\d")
_EPOCHS = {"1970-01-01": (10957, 32874), "1899-12-30": (36526, 62091)}  # days of the years 2000 to 2060 or 2070
_UNITS_OF_TIME = {"ms": "ms", "msec": "ms", "us": "us", "µs": "us", "ns": "ns", "min": "min"}


def guessed_table(path: str | Path, columns: Columns | None = None, Ts: float | None = None) -> str:
    """A proposal of `[log]` for a file or a folder.

    Parameters
    ----------
    path : path
    columns : Columns, optional
        Of the model, whose inputs and outputs are looked for.
    Ts : float, optional
        Sampling time of the model [s], by which units of stamps are told.

    Raises
    ------
    ValueError
        If no rows of numbers are found.
    OSError
        If the file cannot be opened.
    """
    path = Path(path)
    if path.is_dir():
        return _folder(path, columns, Ts)
    head = f"# A proposal for {path.name}: check each line; what the file leaves open is a comment.\n"
    if path.suffix.lower() == ".mat":
        return head + f"# Numbers are at {places_in(path)}\n" + _mat_table(columns)
    text = text_of(path)
    signature = signature_of(text.lines)
    known = (None, None) if signature is None else (signature.separator, signature.header)
    layout = layout_of(_table_lines(text, signature), *known)
    if layout is None:
        raise ValueError(f"{path}: no rows of numbers are found in its first lines; state [log] by hand (docs/logs.md)")
    return head + "\n".join(_Proposal(text, signature, layout, columns, Ts).lines()) + "\n"


def _table_lines(text: Text, signature: Signature | None) -> list[str]:
    """The lines, those blanked that a signature says are none of the table."""
    lines = [("" if COMMENT.match(line) else line) for line in text.lines]
    if signature is None or signature.header is None:
        return lines
    first = signature.first_row or signature.header + 1
    return ["" if k < first and k != signature.header else line for k, line in enumerate(lines, start=1)]


def _folder(path: Path, columns: Columns | None, Ts: float | None) -> str:
    files = sorted(item.name for item in path.iterdir() if item.is_file())
    if not files:
        raise ValueError(f"{path} is an empty folder; expected the files of a log")
    table = guessed_table(path / files[0], None, Ts)
    channels = ["# The files of the folder: state file for each channel.", *(f"#   {name}" for name in files)]
    wanted = _names(columns) or ["NAME"]
    channels += [f'# {name} = {{ file = {_quoted(files[0])}, column = "..." }}' for name in wanted]
    return table.partition("[log.columns]")[0] + "[log.columns]\n" + "\n".join(channels) + "\n"


def _mat_table(columns: Columns | None) -> str:
    wanted = _names(columns) or ["NAME"]
    channels = "".join(f'# {name} = {{ column = "...", unit = "..." }}\n' for name in wanted)
    return f'[log]\n# time = {{ column = "..." }}\n\n[log.columns]\n{channels}'


class _Proposal:
    """The lines of a table for a text file."""

    def __init__(
        self, text: Text, signature: Signature | None, layout: Layout, columns: Columns | None, Ts: float | None
    ) -> None:
        self._text, self._signature, self._layout, self._wanted, self._Ts = text, signature, layout, columns, Ts
        self._stamps: list[int] = []
        width = max(len(layout.names), *(len(row) for row in layout.rows))
        padded = [row + [""] * (width - len(row)) for row in layout.rows]
        self._cells = [list(column) for column in zip(*padded, strict=True)]
        names = layout.names or self._commented(width)
        self._names = names + [""] * (width - len(names))

    def lines(self) -> list[str]:
        keys = {} if self._signature is None else self._signature.keys
        found = [f"# Written by: {self._signature.called}"] if self._signature else []
        found += ["[log]"]
        if self._text.stated:
            found.append(f"encoding = {_quoted(self._text.stated)}  # not UTF-8; are its letters right?")
        if self._layout.separator != ",":
            found.append(f"separator = {_quoted(self._layout.separator)}")
        found += [f"{key} = {value}" for key, value in keys.items()]
        time = self._time()
        found += [*self._number_marks(keys), *self._rows(keys), *self._missing()]
        long = self._long()
        if long is not None and "long" not in keys:
            found.append(f"long = {{ tag = {self._column(long[0])}, value = {self._column(long[1])} }}")
        return [*found, *time, "", "[log.columns]", *self._channels("long" in keys or long is not None, long)]

    def _commented(self, width: int) -> list[str]:
        """Names in the comment above the first row."""
        line = self._text.lines[self._layout.first_row - 2] if self._layout.first_row > 1 else ""
        mark = COMMENT.match(line)
        names = cells_of(line[mark.end() :].strip(), self._layout.separator) if mark else []
        return names if len(names) == width and not any(map(is_number, names)) else []

    # -- cells -----------------------------------------------------------------------------------

    def _numeric(self) -> list[int]:
        return [i for i, cells in enumerate(self._cells) if _share(cells) > 0.5]

    def _number_marks(self, keys: dict[str, str]) -> list[str]:
        columns = [self._cells[i] for i in self._numeric()]
        decimal, thousands = marks_in(columns)
        found = [f'decimal = "{decimal}"'] if decimal != "." and "decimal" not in keys else []
        found += [f"thousands = {_quoted(thousands)}"] if thousands else []
        return found + ['exponent = "D"'] * any(map(has_exponent, columns))

    def _rows(self, keys: dict[str, str]) -> list[str]:
        layout, found = self._layout, []
        above = self._text.lines[: (layout.header or layout.first_row) - 1]
        preamble = [line for line in above if line.strip() and not COMMENT.match(line)]
        first = (self._signature and self._signature.first_row) or layout.first_row
        if layout.header is None:
            names = [name or f"c{i + 1}" for i, name in enumerate(self._names)]
            remark = "of the comment above the rows" if any(self._names) else "the file has no line of names"
            found.append(f"names = {json.dumps(names, ensure_ascii=False)}  # {remark}")
        elif preamble or (self._signature and self._signature.header):
            found.append(f"header = {layout.header}")
        if first != layout.header + 1 if layout.header else preamble:
            more = f"  # more names or units: line {', '.join(map(str, layout.more))}" if layout.more else ""
            found.append(f"first_row = {first}{more}")
        comments = {mark[1] for line in self._text.lines if (mark := COMMENT.match(line))}
        foreign = [line for line in dict.fromkeys(layout.foreign) if is_foreign(line)]
        broken = [line for line in foreign if is_broken(line, layout.separator)]
        skip = [f"^\\s*{mark}" for mark in sorted(comments)]
        skip += [escaped(line) for line in foreign if line not in broken][:5]
        if skip and "skip" not in keys:
            found.append(f"skip = {json.dumps(skip, ensure_ascii=False)}")
        return found + [f"# a row with cells that are lost? {_quoted(line.strip()[:60])}" for line in broken[:3]]

    def _missing(self) -> list[str]:
        numeric = [self._cells[i] for i in self._numeric() if i not in self._stamps]
        texts = Counter(c for cells in numeric for c in cells if c and not is_number(c) and c.lower() != "nan")
        codes = Counter(c for cells in numeric for c in cells if _SENTINELS.fullmatch(c))
        found = [f"missing = {json.dumps(list(texts), ensure_ascii=False)}"] if texts else []
        found += [f"# sentinels = [{', '.join(codes)}]  # do they mean that there is no reading?"] if codes else []
        flags = [i for i, name in enumerate(self._names) if _FLAG.search(name)]
        found += [
            f"# valid = {{ column = {self._column(i)}, good = [{_sample(self._cells[i])}] }}  # which are good?"
            for i in flags
        ]
        return found

    # -- time ------------------------------------------------------------------------------------

    def _time(self) -> list[str]:
        if self._signature is not None and self._signature.time is not None:
            local = "" if "_time" in self._signature.time else "  # local time: add zone"
            self._stamps = [i for i, name in enumerate(self._names) if f'"{name}"' in self._signature.time]
            return [f"time = {self._signature.time}{local}"]
        dated = [(i, forms) for i, cells in enumerate(self._cells) if (forms := _forms(cells))]
        for i, forms in dated:
            clock = next((k for k in (i + 1, i - 1) if 0 <= k < len(self._cells) and _is_clock(self._cells[k])), None)
            if clock is None or any(_CLOCK.search(cell) for cell in self._cells[i][:5]):
                return self._dated([i], forms) + self._coarse(i)
            joined = list(map(" ".join, zip(self._cells[i], self._cells[clock], strict=True)))
            if together := _forms(joined):
                return self._dated([i, clock], together)
        return self._counted()

    def _counted(self) -> list[str]:
        """Stamps that are numbers."""
        rising = [i for i in self._numeric() if _is_rising(self._of_one_tag(i))]
        found = {i: self._unit_of_stamps(i) for i in rising}
        named = [i for i in rising if _TIME.search(self._names[i])] or [i for i in rising if "unit" in found[i][:8]]
        chosen = max(named, key=lambda i: "unit" in found[i][:8], default=None)
        if chosen is None:
            backward = [i for i in self._numeric() if not rising and _TIME.search(self._names[i])]
            which = " or ".join(map(self._column, rising or backward)) or '"..."'
            remark = "in what unit?" if rising else "no column rises from row to row: or start and step?"
            remark = 'it goes back: also part = 2, or order = "sort"?' if backward else remark
            return [f"# time = {{ column = {which} }}  # {remark}"]
        self._stamps = [chosen]
        return [f"time = {{ column = {self._column(chosen)}{found[chosen]}", *self._epoch(chosen, found[chosen])]

    def _of_one_tag(self, i: int) -> list[str]:
        """The cells of a column; of a long log those of its first tag, whose stamps are its own."""
        tag = (self._long() or (None,))[0]
        if tag is None:
            return self._cells[i]
        return [cell for cell, of in zip(self._cells[i], self._cells[tag], strict=True) if of == self._cells[tag][0]]

    def _epoch(self, i: int, unit: str) -> list[str]:
        """A remark if numbers seem to count from the epoch of computers, or of spreadsheets."""
        first = next((value for cell in self._cells[i] if (value := number_in(cell)) is not None), 0.0)
        stated = re.match(r', unit = "(\w+)"', unit)
        days = first * seconds(UNITS[stated[1] if stated else "s"]) / 86400
        for epoch, (low, high) in _EPOCHS.items():
            if low < days < high:
                return [f"# stamps of {date.fromisoformat(epoch) + timedelta(days)}? then epoch = {epoch} in time"]
        return []

    def _unit_of_stamps(self, i: int) -> str:
        """What follows the column of stamps in the table: by the sampling time, or by its name."""
        numbers = np.unique([value for cell in self._cells[i] if (value := number_in(cell)) is not None])
        step = float(np.median(np.diff(numbers))) if numbers.size > 1 else 0.0
        if self._Ts is not None:
            fits = [f'unit = "{name}"' for name, pico in UNITS.items() if _fits(step * seconds(pico), self._Ts)]
            fits += ['unit = "day", scale = 1e-6'] * _fits(step * 0.0864, self._Ts)
            if fits:
                return f", {fits[0]} }}" + (f"  # or {' or '.join(fits[1:])}" if fits[1:] else "")
        name = self._names[i]
        unit = next((u for w, u in _UNITS_OF_TIME.items() if re.search(rf"(^|[^a-z]){w}($|[^a-z])", name)), None)
        return f', unit = "{unit}" }}' if unit else " }  # in seconds? else state unit"

    def _coarse(self, i: int) -> list[str]:
        """A remark if stamps repeat, and where there are finer ones."""
        if len(set(self._cells[i])) > 0.4 * len(self._cells[i]):
            return []
        finer = [k for k in self._numeric() if k != i and _TIME.search(self._names[k])]
        return [
            f"# its stamps repeat; or: time = {{ column = {self._column(k)}{self._unit_of_stamps(k)}" for k in finer
        ]

    def _dated(self, columns: list[int], forms: Sequence[str]) -> list[str]:
        self._stamps = columns
        named = [self._column(i) for i in columns]
        column = named[0] if len(named) == 1 else f"[{', '.join(named)}]"
        zone = "" if forms[0] == "duration" or self._says_zone() else '  # local time? then add zone = "Europe/Berlin"'
        lines = [f"time = {{ column = {column}, format = {_quoted(form)} }}{zone}" for form in forms]
        if len(lines) == 1:
            return lines
        return ["# day and month are undecided: one of these lines", *(f"# {line}" for line in lines)]

    def _says_zone(self) -> bool:
        return any(re.search(r"\d(Z|[+-]\d\d:?\d\d)$", cell) for cells in self._cells for cell in cells[:5])

    # -- channels --------------------------------------------------------------------------------

    def _long(self) -> tuple[int, int] | None:
        """Columns of tags and values, if the rows are such."""
        values = [i for i, name in enumerate(self._names) if _VALUE.fullmatch(name)]
        rows = len(self._layout.rows)
        tags = [
            i for i, cells in enumerate(self._cells)
            if _share(cells) < 0.1 and 1 < len(set(cells)) <= max(2, rows // 4) and not _forms(cells)
        ]  # fmt: skip
        return (tags[0], values[0]) if values and tags else None

    def _channels(self, is_long: bool, long: tuple[int, int] | None) -> list[str]:
        if is_long:
            at = long[0] if long else next((i for i, name in enumerate(self._names) if name == "_field"), None)
            tags = sorted(set(self._cells[at])) if at is not None else []
            return self._named({tag: "" for tag in tags if tag}, "tag", {})
        units = {} if self._signature is None else self._signature.units
        found = {}
        for i in self._numeric():
            if i not in self._stamps:
                found[self._column(i)] = units.get(i) or _unit_in(self._names[i]) or self._unit_below(i)
        spoken = {self._column(i): " ".join([self._names[i], *self._below(i)]) for i in self._numeric()}
        return self._named(found, "column", spoken) + self._rounded()

    def _rounded(self) -> list[str]:
        """To what the readings are rounded, which can falsify a model whose noise is without it."""
        steps = {self._column(i): _rounding(self._cells[i]) for i in self._numeric() if i not in self._stamps}
        told = ", ".join(f"{step} in {column}" for column, step in steps.items() if step)
        return [f"# written to {told}: state it as resolution, unless n has the rounding in it"] if told else []

    def _named(self, found: dict[str, str], key: str, spoken: dict[str, str]) -> list[str]:
        """A line for each channel of the model that a name is close to, comments for the others."""
        rest, lines = dict(found), []
        for name in _names(self._wanted):
            same = [column for column in rest if column.strip('"').lower() == name.lower()]
            close = same or [column for column in rest if _is_close(name, spoken.get(column, column))]
            if not close:
                lines.append(f'# {name} = {{ {key} = "..." }}  # which one?')
                continue
            line = f"{name} = {{ {key} = {_value(close[0])}{_stated_unit(rest[close[0]])} }}"
            if len(close) > 1:
                line = f"# {line}  # or {' or '.join(close[1:])}? undecided"
            else:
                del rest[close[0]]
            lines.append(line)
        return lines + [f"# NAME = {{ {key} = {_value(name)}{_stated_unit(unit)} }}" for name, unit in rest.items()]

    def _below(self, i: int) -> list[str]:
        """What stands under a name, in the lines of more names or units."""
        lines = [cells_of(self._text.lines[line - 1], self._layout.separator) for line in self._layout.more]
        return [cells[i] for cells in lines if i < len(cells)]

    def _unit_below(self, i: int) -> str:
        units = [text.strip("()[]") for text in self._below(i)]
        return next((unit for unit in reversed(units) if 0 < len(unit) <= 8), "")

    def _column(self, i: int) -> str:
        """A column as TOML: by its name, or its number where that is none or stands twice."""
        name = self._names[i]
        return _quoted(name) if name and self._names.count(name) == 1 else str(i + 1)


def _names(columns: Columns | None) -> list[str]:
    return [] if columns is None else [column.name for column in columns.inputs + columns.outputs]


def _share(cells: Sequence[str]) -> float:
    filled = [cell for cell in cells if cell]
    return sum(map(is_number, filled)) / len(filled) if filled else 0.0


def _rounding(cells: Sequence[str]) -> str:
    """The step of numbers with a few decimals; nothing where the mark may be that of thousands."""
    found = [_DECIMALS.fullmatch(cell) for cell in cells if cell and is_number(cell)]
    if not found or not all(found):
        return ""
    return f"{10.0 ** -max(len(mark[1] or mark[2]) for mark in found if mark):g}"


def _forms(cells: Sequence[str]) -> list[str]:
    """Formats that all the cells have, of those that are dates or durations; whole seconds may be without fraction."""
    filled = [cell for cell in dict.fromkeys(cells) if cell and not is_number(cell)][:200]
    if len(filled) < 0.5 * min(len(set(cells)), 200) or not filled:
        return []
    if all(map(is_duration, filled)):
        return ["duration"]
    every = [{form for form, _ in suggested(cell)} for cell in filled]
    whole = {re.sub(r"[.,:]%f", "", form) for form in set.union(*every)}
    kept = [form for form in whole if all(form in {re.sub(r"[.,:]%f", "", f) for f in forms} for forms in every)]
    longest = {re.sub(r"[.,:]%f", "", form): form for forms in every for form in sorted(forms, key=len)}
    written = {re.sub(r"[.,:]%f", "", form): form for forms in every for form in forms if "%f" in form}
    return sorted({**longest, **written}[form] for form in kept)


def _is_clock(cells: Sequence[str]) -> bool:
    return all(_CLOCK.match(cell) for cell in cells[:5])


def _is_rising(cells: Sequence[str]) -> bool:
    numbers = [value for cell in cells if (value := number_in(cell)) is not None]
    return len(numbers) > 2 and all(a < b for a, b in pairwise(numbers))


def _fits(step: float, Ts: float) -> bool:
    return abs(step - Ts) <= 0.05 * Ts


def _is_close(name: str, spoken: str) -> bool:
    """Whether a channel of the model may be meant by what a file says: one word of it is like the name."""
    words = [word for word in re.split(r"[^a-z0-9]+", spoken.lower()) if len(word) > 2]
    name = name.lower()
    return bool(get_close_matches(name, words, n=1, cutoff=0.8)) or any(name.startswith(word) for word in words)


def _unit_in(name: str) -> str:
    found = _UNIT.search(name)
    return "" if found is None else found[1] or found[2]


def _stated_unit(unit: str) -> str:
    return f", unit = {_quoted(unit)}" if unit else ""


def _value(name: str) -> str:
    """A name that is TOML already, or a tag."""
    return name if re.fullmatch(r'\d+|".*"', name) else _quoted(name)


def _sample(cells: Sequence[str]) -> str:
    common = Counter(cells).most_common(1)[0][0]
    return common if is_number(common) else _quoted(common)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)

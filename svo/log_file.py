"""Logs as CSV files: one named column a channel, one row a sample.

Rules for a log that is read:

- The columns of time, inputs and outputs must be there, under the plant's names and in its units; their
  order is free. State columns are read if all are there. Any other column is ignored.
- An empty or NaN cell of an output means that this sensor is missing at that sample; of a state, that it is
  unknown. In time and inputs it is an error, and so are Inf, text, a ragged row and a file without samples.
- Time increases by the model's sampling time, within 1 % of it, from row to row. A sample that was lost
  must stand in the file as a row whose sensor cells are empty.

Floats are written in their shortest form that reads back to the same bits.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np
from numpy.typing import NDArray

from svo.log import Log

if TYPE_CHECKING:
    from svo.plant import Column, Columns

TIME_TOLERANCE = 0.01


def write_log(path: str | Path, log: Log, columns: Columns) -> None:
    """Write a log with its true states, if it has them, as CSV (UTF-8).

    Raises
    ------
    ValueError
        If the log has another number of channels than there are columns.
    """
    parts = [log.time[:, None], _matched("u", log.u, columns.inputs), _matched("y", log.y, columns.outputs)]
    names = [columns.time, *(c.name for c in columns.inputs + columns.outputs)]
    if log.x is not None:
        parts.append(_matched("x", log.x, columns.states))
        names += [c.name for c in columns.states]
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for row in np.hstack(parts).tolist():
            writer.writerow("" if math.isnan(value) else repr(value) for value in row)


def read_log(path: str | Path, columns: Columns, Ts: float) -> Log:
    """Read a CSV log under the rules of this module.

    Parameters
    ----------
    path : path of a CSV file
    columns : Columns
        Names of the columns, in the model's order.
    Ts : float
        The model's sampling time [s].

    Returns
    -------
    Log
        Without a schedule: the plant's scheduler makes it from y, sample by sample.

    Raises
    ------
    ValueError
        Naming the file, the line and the column, with what was found and what was expected.
    OSError
        If the file cannot be opened.
    """
    path = Path(path)
    with path.open(newline="", encoding="utf-8-sig") as file, _readable(path):
        rows = _rows(file)
        header = [name.strip() for name in next(rows, (0, []))[1]]
        where = _locate(path, header, columns)
        lines, cells = _parse(path, rows, header, where, {c.name for c in columns.outputs + columns.states})
    if not lines:
        raise ValueError(f"{path} has a header but no samples; expected one row a sample")
    _check_time(path, cells[columns.time], lines, columns.time, Ts)
    y, u, x = (_stack(cells, group, len(lines)) for group in (columns.outputs, columns.inputs, columns.states))
    return Log(time=cells[columns.time], u=u, y=y, x=x if columns.states and columns.states[0].name in cells else None)


def _matched(name: str, values: NDArray[np.float64], columns: Sequence[Column]) -> NDArray[np.float64]:
    if values.shape[1] != len(columns):
        raise ValueError(
            f"{name} of the log has {values.shape[1]} channels; expected {len(columns)}, one a column of the plant"
        )
    return values


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(
            f"{path} is not a CSV text file ({error}); expected comma-separated columns in UTF-8"
        ) from error


def _rows(file: TextIO) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and cells of the rows that are not blank."""
    reader = csv.reader(file)
    for row in reader:
        if row:
            yield reader.line_num, row


def _locate(path: Path, header: list[str], columns: Columns) -> dict[str, int]:
    """Position of each column that is to be read."""
    if not header:
        raise ValueError(f"{path} is empty; expected a header line with column names and one row a sample")
    needed = [columns.time, *(c.name for c in columns.inputs + columns.outputs)]
    missing = [name for name in needed if name not in header]
    if missing:
        raise ValueError(
            f"{path} has no column {', '.join(repr(name) for name in missing)}; "
            f"expected the columns {', '.join(needed)}, found {', '.join(header)}"
        )
    states = [c.name for c in columns.states]
    wanted = needed + (states if all(name in header for name in states) else [])
    twice = sorted({name for name in wanted if header.count(name) > 1})
    if twice:
        raise ValueError(f"{path} has more than one column {twice[0]!r}; rename or drop all but one")
    return {name: header.index(name) for name in wanted}


def _parse(
    path: Path,
    rows: Iterator[tuple[int, list[str]]],
    header: list[str],
    where: dict[str, int],
    may_be_missing: set[str],
) -> tuple[list[int], dict[str, NDArray[np.float64]]]:
    lines: list[int] = []
    values: dict[str, list[float]] = {name: [] for name in where}
    for line, row in rows:
        if len(row) != len(header):
            raise ValueError(f"{path}, line {line}: {len(row)} cells; expected {len(header)}, as in the header")
        lines.append(line)
        for name, position in where.items():
            values[name].append(_number(path, line, name, row[position], name in may_be_missing))
    return lines, {name: np.array(column) for name, column in values.items()}


def _number(path: Path, line: int, name: str, cell: str, may_be_missing: bool) -> float:
    text = cell.strip()
    try:
        value = float(text) if text else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value) or "_" in text:
        raise ValueError(f"{path}, line {line}, column {name!r}: {cell!r} is not a finite number")
    if math.isnan(value) and not may_be_missing:
        raise ValueError(
            f"{path}, line {line}, column {name!r}: the cell is empty or NaN; only sensor columns may be missing, "
            "so fill the value in or drop the rows from here on"
        )
    return value


def _check_time(path: Path, time: NDArray[np.float64], lines: list[int], name: str, Ts: float) -> None:
    steps = np.diff(time)
    wrong = np.flatnonzero(~(np.abs(steps - Ts) <= TIME_TOLERANCE * Ts))
    if not wrong.size:
        return
    k = int(wrong[0])
    place = f"{path}, line {lines[k + 1]}, column {name!r}: time goes from {time[k]:.9g} s to {time[k + 1]:.9g} s"
    if steps[k] <= 0:
        raise ValueError(f"{place}; expected increasing times, so sort the rows and drop doubles")
    raise ValueError(
        f"{place}, a step of {steps[k]:.6g} s; expected the model's sampling time {Ts:.6g} s. "
        "Resample the log; a lost sample is a row with empty sensor cells"
    )


def _stack(cells: dict[str, NDArray[np.float64]], group: Sequence[Column], rows: int) -> NDArray[np.float64]:
    present = [cells[c.name] for c in group if c.name in cells]
    return np.column_stack(present) if present else np.zeros((rows, 0))

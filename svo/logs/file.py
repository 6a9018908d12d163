"""Logs as files; the suffix says what the file is: .csv (text), .parquet (pyarrow) or .mat (MATLAB).

The rules for the columns are those of `svo.logs.columns`. In each format floats read back to the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from svo.checks import expect, is_finite_number
from svo.logs.columns import Note, noted
from svo.logs.csv import read_csv, write_csv
from svo.logs.log import Log
from svo.logs.mat import read_mat_log, write_mat
from svo.logs.names import Columns
from svo.logs.parquet import read_parquet, write_parquet
from svo.logs.portions import Rows, joined, portions_of


class _Format(NamedTuple):
    read: Callable[[Path, Columns, Note], Iterator[Rows]]
    write: Callable[..., None]


_FORMATS = {
    ".csv": _Format(read_csv, write_csv),
    ".parquet": _Format(read_parquet, write_parquet),
    ".mat": _Format(read_mat_log, write_mat),
}


def write_log(path: str | Path, log: Log, columns: Columns) -> None:
    """Write a log with its true states, if it has them.

    Raises
    ------
    ValueError
        If the log has another number of channels than there are columns, or the suffix is not known.
    ImportError
        If the format needs a package that is not installed.
    """
    path = Path(path)
    _format(path).write(path, log.to_columns(columns))


def read_log(path: str | Path, columns: Columns, Ts: float | None) -> Log:
    """Read a log under the rules of `svo.logs.columns`.

    Parameters
    ----------
    path : path of a .csv, .parquet or .mat file
    columns : Columns
        Names of the columns, in the model's order.
    Ts : float or None
        The model's sampling time [s]; None for a log that keeps its own times.

    Returns
    -------
    Log
        Without a schedule: the plant's scheduler makes it from y, sample by sample.

    Raises
    ------
    ValueError
        Naming the file, the line or sample and the column, with what was found and what was expected.
    OSError
        If the file cannot be opened.
    ImportError
        If the format needs a package that is not installed.
    """
    return joined(list(read_portions(path, columns, Ts)))


def read_portions(path: str | Path, columns: Columns, Ts: float | None, note: Note = noted) -> Iterator[Log]:
    """A log in portions, one after the other, so that it need not be in memory as a whole; a MAT file is one portion.

    Arguments and errors are those of `read_log`; an error comes when its portion is asked for. ``note`` is told of what
    was read in a way that its reader should know of; by default that is a warning, `svo.logs.columns.LogNote`.
    """
    path = Path(path)
    good = Ts is None or (is_finite_number(Ts) and Ts > 0)
    expect(good, "Ts", Ts, "a positive sampling time in seconds, or None")
    if path.is_dir():
        raise ValueError(f"{path} is a folder; expected a log file, one of {', '.join(_FORMATS)}")
    rows = _format(path).read(path, columns, note)
    yield from (replace(portion, source=path.name) for portion in portions_of(str(path), rows, columns, Ts))


def check_suffix(path: str | Path) -> None:
    """Raise a ValueError if the suffix is not that of a log file."""
    _format(Path(path))


def _format(path: Path) -> _Format:
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise ValueError(f"{path} has the suffix {path.suffix!r}; expected one of {', '.join(_FORMATS)}")
    return found

"""What the columns of a log must be, whatever holds them: a CSV, Parquet or MAT file, a data frame.

- The columns of time, inputs and outputs must be there, under the plant's names and in its units; their
  order is free. State columns are read if all are there. Any other column is ignored.
- NaN (or an empty cell, or null) in an output means that this sensor is missing at that sample; in a state, that
  it is unknown. In time and inputs it is an error, and so is Inf anywhere.
- Time increases by the model's sampling time, within 1 % of it, from row to row. A sample that was lost
  must stand in the log as a row whose sensor cells are empty. A log that keeps its own times has any steps.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.logs.dialect.dates import suggested
from svo.logs.names import Column, Columns

Place = Callable[[int], str]
Note = Callable[[str], None]

# Relative: a step is taken for Ts if |step - Ts| <= 0.01 Ts. The model then reckons with Ts: what the difference does
# to the plant is for the user's bounds to hold, no set is widened by it.
TIME_TOLERANCE = 0.01

_UNITS = {
    "ms": ("milliseconds", 1e-3), "us": ("microseconds", 1e-6), "ns": ("nanoseconds", 1e-9), "min": ("minutes", 60.0),
    "h": ("hours", 3600.0), "day": ("days", 86400.0), "100ns": ("units of 100 ns", 1e-7),
}  # fmt: skip


class LogNote(UserWarning):
    """Something in a log that was read in a way its reader should know of; the command line prints it as a note."""


def noted(text: str) -> None:
    """A `LogNote` that is a warning, of the line outside of this package that had the log read."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("svo."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, LogNote, stacklevel=level)


def wanted_columns(source: str, present: Sequence[str], columns: Columns) -> list[str]:
    """Names of the columns to read: time, inputs, outputs and, if all are there, the states.

    Raises
    ------
    ValueError
        If one that is needed is missing, or is there more than once.
    """
    needed = [columns.time, *(c.name for c in columns.inputs + columns.outputs)]
    missing = [name for name in needed if name not in present]
    if missing:
        raise ValueError(
            f"{source} has no column {', '.join(repr(name) for name in missing)}; "
            f"expected the columns {', '.join(needed)}, found {', '.join(map(str, present))}"
            + _meant(missing[0], columns, [str(name) for name in present if name not in needed])
        )
    states = [c.name for c in columns.states]
    wanted = needed + (states if all(name in present for name in states) else [])
    twice = sorted({name for name in wanted if list(present).count(name) > 1})
    if twice:
        raise ValueError(f"{source} has more than one column {twice[0]!r}; rename or drop all but one")
    return wanted


def _meant(missing: str, columns: Columns, others: Sequence[str]) -> str:
    """The column that may stand there under another spelling, or in another unit."""
    unit = next((c.unit for c in columns.inputs + columns.outputs if c.name == missing), "s")
    bare = {name.partition("[")[0].partition("(")[0].strip().lower(): name for name in others}
    close = get_close_matches(missing.lower(), bare, n=1)
    if not close:
        return ""
    return f". Is {bare[close[0]]!r} meant? Then rename it to {missing!r}, with numbers in {unit or 'its unit'}"


def may_be_missing(columns: Columns) -> frozenset[str]:
    """Columns in which NaN has a meaning."""
    return frozenset(c.name for c in columns.outputs + columns.states)


def not_finite(where: str, cell: object) -> ValueError:
    hint = "; write a decimal point" if isinstance(cell, str) and "," in cell else ""
    dates = suggested(cell) if isinstance(cell, str) else []
    if dates:
        hint = f'; write seconds, or state time = {{ column = ..., format = "{dates[0][0]}" }} in [log]'
    return ValueError(f"{where}: {cell!r} is not a finite number{hint}")


def not_there(where: str) -> ValueError:
    return ValueError(
        f"{where}: the cell is empty or NaN; only sensor columns may be missing, "
        "so fill the value in or drop the rows from here on"
    )


def checked_parts(source: str, cells: Mapping[str, Array], columns: Columns, Ts: float | None) -> dict[str, Any]:
    """`parts` of whole columns of numbers, (K,) each, of which `wanted_columns` are there, once they are checked.

    Raises
    ------
    ValueError
        Naming the source, the sample and the column.
    """
    check_cells(source, cells, columns, lambda k: f"sample {k}")
    return parts(source, cells, columns, Ts, lambda k: f"sample {k}")


def check_cells(source: str, cells: Mapping[str, Array], columns: Columns, place: Place) -> None:
    """Raise a ValueError if a cell is infinite, or missing where that has no meaning."""
    unknown = may_be_missing(columns)
    for name, values in cells.items():
        bad = np.isinf(values) | (np.isnan(values) & (name not in unknown))
        for k in np.flatnonzero(bad)[:1].tolist():
            where = f"{source}, {place(k)}, column {name!r}"
            raise not_there(where) if np.isnan(values[k]) else not_finite(where, float(values[k]))


def parts(source: str, cells: Mapping[str, Array], columns: Columns, Ts: float | None, place: Place) -> dict[str, Any]:
    """The arguments of a `Log`, from columns whose cells have been checked; ``place`` says where a sample stands.

    Without ``Ts`` it keeps its own times.
    """
    time = cells[columns.time]
    if not len(time):
        raise ValueError(f"{source} has a header but no samples; expected one row a sample")
    check_times(time, Ts, lambda k: f"{source}, {place(k)}, column {columns.time!r}")
    y, u, x = (_stack(cells, group, len(time)) for group in (columns.outputs, columns.inputs, columns.states))
    has_states = columns.states and columns.states[0].name in cells
    return {"time": time, "u": u, "y": y, "x": x if has_states else None, "events": True if Ts is None else None}


def check_times(time: Array, Ts: float | None, place: Place) -> None:
    """Raise a ValueError unless time goes by the sampling time; ``place`` says where a sample stands.

    Without ``Ts`` it has to increase.
    """
    with np.errstate(over="ignore"):  # of a damaged clock
        steps = np.diff(time)
    for k in np.flatnonzero(~_is_sampled(steps, Ts))[:1].tolist():
        raise wrong_step(place(k + 1), time[k], time[k + 1], Ts)


def wrong_step(where: str, before: float, after: float, Ts: float | None) -> ValueError:
    """Why time may not go so from one row to the next."""
    before, after = float(before), float(after)  # of Python, which overflow without a warning
    step = f"{where}: time goes from {before:.9g} s to {after:.9g} s"
    if after <= before or Ts is None:
        return ValueError(f"{step}; expected increasing times, so sort the rows and drop doubles")
    found = f"{step}, a step of {after - before:.6g} s; expected the model's sampling time {Ts:.6g} s. "
    for unit, (name, seconds) in _UNITS.items():
        if is_sampled(before * seconds, after * seconds, Ts):
            change = f"divide it by {1 / seconds:g}" if seconds < 1 else f"multiply it by {seconds:g}"
            stated = f'{change}, or state unit = "{unit}" in [log.time]'
            return ValueError(f"{found}The column seems to be in {name}; {stated}")
    return ValueError(
        f"{found}A lost sample is a row with empty sensor cells; a log for a model in continuous time may keep its own "
        'times: times = "events" in [log]'
    )


def is_sampled(before: float, after: float, Ts: float | None) -> bool:
    """Whether a row follows another by one sampling time; without ``Ts``, by any."""
    return bool(_is_sampled(np.array(float(after) - float(before)), Ts))


def _is_sampled(steps: Array, Ts: float | None) -> NDArray[np.bool_]:
    if Ts is None:
        return np.asarray(steps > 0.0)
    return np.abs(steps - Ts) <= TIME_TOLERANCE * Ts


def _stack(cells: Mapping[str, Array], group: Sequence[Column], rows: int) -> Array:
    present = [cells[c.name] for c in group if c.name in cells]
    return np.column_stack(present) if present else np.zeros((rows, 0))

"""What somebody who reads a log should know of it, although it is no error."""

from __future__ import annotations

import re

import numpy as np

from svo.checks import Array
from svo.logs.dialect.rules import Channel
from svo.logs.dialect.series import Series
from svo.logs.dialect.units import conversion
from svo.logs.dialect.values import in_model_units

_ENOUGH = 10  # readings, below which nothing is said of their kind
_FAR = 2.0  # times the range of all others
_NAME = re.compile(r"""column (?:\d+ \()?['"](.*)['"]\)?""")
_UNIT = re.compile(r"\[([^\]]+)\]|\(([^)]+)\)\s*$")


def notes_of(series: Series, rule: Channel, unit: str) -> list[str]:
    """Suspicions about the readings of a sensor, whose model has the ``unit``."""
    found = [_held(series, rule), _far(series, rule, unit)]
    return [note for note in found if note] + unit_notes(series, rule, unit)


def unit_notes(series: Series, rule: Channel, unit: str) -> list[str]:
    """A note if the name of a column has another unit than the one that it is read in."""
    note = _unit(series, rule, unit)
    return [note] if note else []


def _far(series: Series, rule: Channel, unit: str) -> str:
    """One value far from all others may be a code for no reading."""
    distinct = np.unique(series.values)
    if series.values.size < _ENOUGH or distinct.size < 5:
        return ""
    for value, rest in ((distinct[0], distinct[1:]), (distinct[-1], distinct[:-1])):
        if np.abs(rest - value).min() > _FAR * np.ptp(rest):
            i = int(np.flatnonzero(series.values == value)[0])
            factor, offset = in_model_units(rule, unit)
            value, low, high = ((v - offset) / factor for v in (value, rest[0], rest[-1]))
            return (
                f"{series.place(i)}: {value:.9g} is far from all other readings of {series.name} ({low:.6g} to "
                f"{high:.6g}, as written); if it means that there is none, list it in sentinels of [log]"
            )
    return ""


def _held(series: Series, rule: Channel) -> str:
    equal = np.diff(series.values) == 0
    if rule.held is not None or equal.size < _ENOUGH or equal.all() or equal.mean() < 0.4 or _has_runs(equal):
        return ""
    return (
        f"{series.name}: {int(equal.sum())} of {equal.size + 1} readings repeat the one before; a sensor slower than "
        f"the log? Then state its period in [log.columns.{series.name}], such as held = 0.2"
    )


def _has_runs(equal: Array) -> bool:
    """Whether the readings repeat in a few long stretches only, as those of something at rest do."""
    changes = np.flatnonzero(~equal.astype(bool))
    return changes.size < 0.05 * equal.size


def _unit(series: Series, rule: Channel, unit: str) -> str:
    name = _NAME.fullmatch(series.label)
    found = _UNIT.search(name[1]) if name else None
    if not found or rule.scale != 1:
        return ""
    written = (found[1] or found[2]).strip()
    if rule.unit is not None:
        return _other_unit(series, written, rule.unit)
    if written == unit:
        return ""
    return (
        f"{series.label} is read in {unit or 'the unit of the model'}; if it is in {written!r}, state unit in "
        f"[log.columns.{series.name}]"
    )


def _other_unit(series: Series, written: str, stated: str) -> str:
    """A stated unit is taken at its word, but it is told if the column's name has another one of its kind."""
    try:
        factor, offset = conversion(written, stated)
    except (ValueError, ImportError):
        return ""  # no unit, or one that pint does not know, or no pint
    if factor == 1 and offset == 0:
        return ""
    return f"{series.label} is read in {stated!r}, as [log.columns.{series.name}] states, not in {written!r}"

"""Units of a file to those of the model, by pint."""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cache
from typing import Any

from svo.checks import optional_import


@cache
def conversion(source: str, target: str) -> tuple[float, float]:
    """Factor and offset from one unit to another.

    Raises
    ------
    ValueError
        If pint does not know one of them, one is no multiple of the other, or they are of other kinds.
    ImportError
        If pint is not installed.
    """
    if source == target:
        return 1.0, 0.0
    registry = _registry()
    known = [_unit(registry, text) for text in (source, target)]
    if _angles(registry, known[0]) != _angles(registry, known[1]) and known[0].is_compatible_with(known[1]):
        raise ValueError(
            f"{source!r} and the model's {target!r} differ by an angle, which pint takes as a bare number: 1 Hz as 1 "
            "rad/s. State unit rpm or turn/s if turns are counted, or scale without unit"
        )
    try:
        zero, one, two = (float(registry.Quantity(x, known[0]).to(known[1]).magnitude) for x in (0.0, 1.0, 2.0))
    except Exception as error:
        raise ValueError(f"{source!r} cannot be converted to the model's {target!r} ({error})") from error
    if abs((two - one) - (one - zero)) > 1e-9 * abs(one - zero):
        raise ValueError(f"{source!r} is no multiple of the model's {target!r}; convert the column, and drop unit")
    factor = registry.Quantity(1.0, known[0]).m_as(known[1]) if zero == 0 else one - zero
    return float(factor), zero


def _angles(registry: Any, unit: Any) -> float:
    """The power of an angle in a unit."""
    return float(dict(registry.get_root_units(unit, check_nonmult=False)[1]._units).get("radian", 0))


def _unit(registry: Any, text: str) -> Any:
    power = re.sub(r"(?<=[A-Za-z])(-?\d)", r"^\1", text)
    spellings = [text, power, power.lower()] if power.isalpha() and len(power) > 3 else [text, power]
    for spelling in spellings:  # m3 as m^3, and Volts as volts; M and m stay two things
        with suppress(Exception):
            return registry.Unit(spelling)
    raise ValueError(f"pint does not know the unit {text!r}; state scale and offset instead")


@cache
def _registry() -> Any:
    return optional_import("pint", "logs", "units in [log]").UnitRegistry()

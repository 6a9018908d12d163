"""Where the pole g and the static gain h of a first-order system may lie (paper 001, equation (4))."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from math import inf
from typing import Any

import numpy as np

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, real_array


@options_by_name
@dataclass(frozen=True, slots=True)
class GainBounds(Shown):
    """Intervals of g and h in x+ = g x + (1 - g) h u, at one sample or at K samples.

    g lies in ``gc +- min(gr + slope |hc u - xc|, limit)`` with xc the centre of the prediction, and h in hc +- hr. The
    default is the plain interval gc +- gr; slope and limit are kappa_2 and kappa_3 of the paper's section 4.

    Parameters
    ----------
    gc, gr, hc, hr, slope, limit : float or (K,) array
        Radii, slope and limit >= 0. Only the limit may be infinite.

    Raises
    ------
    ValueError
        For NaN, Inf or a negative radius, naming it and its first bad sample.
    """

    gc: float | Array
    gr: float | Array
    hc: float | Array = 1.0
    hr: float | Array = 0.0
    _: KW_ONLY
    slope: float | Array = 0.0
    limit: float | Array = inf
    samples: int | None = field(init=False, repr=False)
    """K, or None if all six are numbers."""

    def __post_init__(self) -> None:
        samples = None
        for name, lowest, highest in _RANGES:
            value = getattr(self, name)
            if isinstance(value, float):  # online, where a sample takes some microseconds
                if not lowest <= value <= highest:
                    raise ValueError(_message(name, value, lowest))
                continue
            checked = _checked(name, value, lowest, highest)
            object.__setattr__(self, name, checked)
            if not isinstance(checked, float):
                if samples not in (None, checked.size):
                    raise ValueError(
                        f"{name} of the gain bounds has {checked.size} samples; expected {samples}, as the others have"
                    )
                samples = checked.size
        object.__setattr__(self, "samples", samples)

    def over(self, samples: int) -> tuple[Array, ...]:
        """gc, gr, hc, hr, slope and limit as arrays (samples,), in this order.

        Raises
        ------
        ValueError
            If they are given for another number of samples.
        """
        if self.samples not in (None, samples):
            raise ValueError(f"the gain bounds have {self.samples} samples; expected {samples}, as the log has")
        return tuple(
            np.ascontiguousarray(np.broadcast_to(getattr(self, name), (samples,)), dtype=float)
            for name, _, _ in _RANGES
        )

    def at(self, sample: int) -> GainBounds:
        """The bounds of one sample, all numbers.

        Raises
        ------
        ValueError
            If they are given for fewer samples.
        """
        if self.samples is None:
            return self
        if sample >= self.samples:
            raise ValueError(f"the gain bounds have {self.samples} samples; expected more, for sample {sample}")
        values = {name: getattr(self, name) for name in ("gc", "gr", "hc", "hr", "slope", "limit")}
        return GainBounds(**{name: v if isinstance(v, float) else float(v[sample]) for name, v in values.items()})


GainLaw = Callable[[Any, Any, Any], GainBounds]
"""Bounds as a function of (u, y, schedule) of the sample that a transition starts from.

It is called with numbers, sample by sample, and with (K,) arrays (schedule: (K, ...)) over a log; arithmetic and numpy
functions serve both. Where a measurement is missing, y is the last one that there was (at the start: the centre of
the initial interval).
"""

_LARGEST = float(np.finfo(float).max)
_RANGES = (
    ("gc", -_LARGEST, _LARGEST),
    ("gr", 0.0, _LARGEST),
    ("hc", -_LARGEST, _LARGEST),
    ("hr", 0.0, _LARGEST),
    ("slope", 0.0, _LARGEST),
    ("limit", 0.0, inf),
)


def _checked(name: str, value: Any, lowest: float, highest: float) -> float | Array:
    array = real_array(f"{name} of the gain bounds", value, (), ("K",), finite=False)
    bad = np.flatnonzero(~((array >= lowest) & (array <= highest)))
    if bad.size:
        where = "" if array.ndim == 0 else f"[{bad[0]}]"
        raise ValueError(_message(name + where, float(array.flat[bad[0]]), lowest))
    return float(array) if array.ndim == 0 else array


def _message(name: str, value: float, lowest: float) -> str:
    expected = "a number >= 0" if lowest == 0 else "a finite number"
    return f"{name} of the gain bounds is {value}; expected {expected}"

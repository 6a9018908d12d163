"""One uncertain scalar of a model, and the directions that it scales."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import finite_array

Schedulable = ArrayLike | Callable[[Any], ArrayLike] | None


@options_by_name
@dataclass(frozen=True, eq=False, kw_only=True)
class Uncertainty(Shown):
    """One Delta and the directions that it scales: any of A, B, a, E (state) and C, D, c, F (output).

    ``bounds`` = (lo, hi) are used as given, never recentred. Each array is constant, a function of the
    schedule, or None (zero). ``name`` is what messages and ``varying`` call it.
    """

    A: Schedulable = None
    B: Schedulable = None
    a: Schedulable = None
    E: Schedulable = None
    C: Schedulable = None
    D: Schedulable = None
    c: Schedulable = None
    F: Schedulable = None
    bounds: tuple[float, float] = (-1.0, 1.0)
    name: str = ""

    def __post_init__(self) -> None:
        ends = finite_array("bounds of the uncertainty", self.bounds, (2,), meaning="(lower, upper)")
        if ends[0] > ends[1]:
            raise ValueError(
                f"bounds of the uncertainty are {self.bounds}; expected (lower, upper) with lower <= upper"
            )
        lo, hi = (float(v) for v in ends)
        object.__setattr__(self, "bounds", (lo, hi))

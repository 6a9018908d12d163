"""Rows over a box: programs in floats choose multipliers, exact arithmetic says what these prove."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from flint import fmpq

from polytopes.exact import ZERO, rational, rational_vector
from polytopes.highs import HighsProgram
from svo.checks import Array
from svo.observers.window.fallback import candidates, is_feasible

Bound = tuple[float, Array]  # about what a form is at most, and the multipliers (m,) that prove as much


_ROUNDED_UP = 1e-12  # of the terms of a sum: more than floats lose in it


@dataclass(frozen=True, eq=False)
class BoxProgram:
    """{z : lower <= z <= upper, least <= rows z - middle <= most}.

    Attributes
    ----------
    lower, upper : (N,) arrays
        Finite.
    rows, middle, least, most : (m, N), (m,), (m,), (m,) arrays
        Bounds of rows may be infinite.
    exact : mapping of row to its N coefficients
        Where those in ``rows`` are rounded.
    """

    lower: Array
    upper: Array
    rows: Array
    middle: Array
    least: Array
    most: Array
    exact: Mapping[int, Sequence[fmpq]] = field(default_factory=dict)

    @cached_property
    def _centre(self) -> tuple[Array, Array]:
        return 0.5 * self.lower + 0.5 * self.upper, 0.5 * self.upper - 0.5 * self.lower

    @cached_property
    def _normal(self) -> tuple[Array, Array, Array]:
        """Rows over [-1, 1] and their bounds."""
        centre, half = self._centre
        known = self.middle - self.rows @ centre
        return self.rows * half, self.least + known, self.most + known

    def maxima(self, forms: Array) -> list[Bound] | None:
        """Bounds of forms (r, N), with room for rounding; None where a program has no answer."""
        (G, lower, upper), (_, half) = self._normal, self._centre
        program, found = HighsProgram(G, upper, row_lower=lower, lower=-1.0, upper=1.0), []
        for form in forms:
            answer = program.maximise(form * half)
            if answer.status != "optimal":
                return None
            multipliers = self._finite(answer.multipliers)
            found.append((self._about(form, multipliers), multipliers))
        return found

    def _about(self, form: Array, multipliers: Array) -> float:
        """What `proven` says, in floats, and more than their rounding."""
        used = multipliers != 0.0
        m, rows = multipliers[used], self.rows[used]
        ends = np.where(m > 0.0, self.most[used], self.least[used]), self.middle[used]
        rest, reach = form - m @ rows, np.maximum(np.abs(self.lower), np.abs(self.upper))
        terms = np.abs(m) @ (np.abs(ends).sum(axis=0) + np.abs(rows) @ reach) + np.abs(form) @ reach
        value = m @ (ends[0] + ends[1]) + np.maximum(rest * self.lower, rest * self.upper).sum()
        return float(value + _ROUNDED_UP * terms)

    def contradiction(self) -> Array | None:
        """Multipliers (m,) that prove that there is no point; None where there is one, or none are found."""
        feasible, ray = is_feasible(*self._normal)
        if feasible is False:
            for multipliers in map(self._finite, candidates(ray)):
                if self.proven([ZERO] * self.lower.size, multipliers) < 0:
                    return multipliers
        return None

    def proven(self, form: Sequence[fmpq], multipliers: Array) -> fmpq:
        """What a form is at most by multipliers, positive on upper bounds, and the box (weak duality)."""
        total, rest = ZERO, list(form)
        for r in np.flatnonzero(multipliers).tolist():
            m = rational(multipliers[r])
            total += m * (rational(self.middle[r]) + rational((self.most if m > 0 else self.least)[r]))
            row = self.exact.get(r) or rational_vector(self.rows[r])
            rest = [c - m * a if a else c for c, a in zip(rest, row, strict=True)]
        for c, low, high in zip(rest, self.lower, self.upper, strict=True):
            if c:
                total += c * rational(high if c > 0 else low)
        return total

    def _finite(self, multipliers: Array) -> Array:
        """Multipliers without those on a bound that is not there."""
        return np.where(np.isfinite(np.where(multipliers > 0.0, self.most, self.least)), multipliers, 0.0)

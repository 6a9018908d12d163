"""The system that a window certificate speaks of, row by row in rational numbers, and an exact judge of it.

States, disturbances and channels are all variables here, the hull of p = Delta s is drawn anew, and HiGHS (on
floats) only proposes: what it says counts once Fractions confirm it. So neither the formulation nor the method nor
the arithmetic is that of the certificate's own check. Multipliers and lines of the certificate are not read. What the
channels leave out of an uncertainty is a variable of each row, bounded over the boxes of what it multiplies.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import WindowSample
from svo.observers.window.left_out import channels_of

Array = NDArray[np.float64]
Row = dict[int, Fraction]
Answer = Literal["empty", "feasible", "close"]


@dataclass(frozen=True)
class TwoSided:
    """lower <= row z <= upper; None where there is no bound."""

    row: Row
    lower: Fraction | None
    upper: Fraction | None


def judge(certificate: WindowCertificate) -> Answer:
    """Whether the certificate's system has a point: proven either way in Fractions, or too close for that."""
    return _System(certificate).judge()


class _System:
    def __init__(self, c: WindowCertificate) -> None:
        self.c = c
        self.n, self.nw, self.nq = c.n, c.samples[0].w_lower.size, len(c.owner)
        self.size = 2 * self.n + self.nw + self.nq + c.samples[0].y.size
        self.rows: list[TwoSided] = []
        self.boxes: dict[int, tuple[Fraction, Fraction]] = {}
        self.factors = [_channels(c, s) for s in c.samples]
        self._arrival()
        for k in range(len(c.samples)):
            self._sample(k)

    # -- variables and rows ----------------------------------------------------------------------

    def _x(self, k: int, j: int) -> int:
        return k * self.size + j

    def _w(self, k: int, j: int) -> int:
        return k * self.size + self.n + j

    def _p(self, k: int, q: int) -> int:
        return k * self.size + self.n + self.nw + q

    def _rest(self, k: int, i: int) -> int:
        return k * self.size + self.n + self.nw + self.nq + i

    def _arrival(self) -> None:
        a = self.c.arrival
        for j in range(self.n):
            self.boxes[self._x(0, j)] = Fraction(a.box_lower[j]), Fraction(a.box_upper[j])
        for coefficients, lower, upper in zip(a.rows, a.lower, a.upper, strict=True):
            self._add({self._x(0, j): Fraction(v) for j, v in enumerate(coefficients)}, lower, upper)

    def _add(self, row: Row, lower: Any, upper: Any) -> None:
        row = {j: v for j, v in row.items() if v}
        self.rows.append(TwoSided(row, *(None if abs(b) == np.inf else Fraction(b) for b in (lower, upper))))

    def _sample(self, k: int) -> None:
        s, newest = self.c.samples[k], k == len(self.c.samples) - 1
        n = self.n
        if not newest or np.any(s.stack[0, n:, n + s.u.size + 1 :]) or np.any(s.stack[1:, n:]):
            self._disturbance(k, s)
            for q, (gain, _) in enumerate(self.factors[k]):
                # a newest one that does not reach the output may have no part yet; its bounds of s are then zero
                if not newest or any(gain[n:]) or s.s_lower[q] or s.s_upper[q]:
                    self._hull(k, q, s)
        for i in range(n + s.y.size):
            row, constant = self._line(k, s, [Fraction(v) for v in s.stack[0, i]])
            for q, (gain, _) in enumerate(self.factors[k]):
                row[self._p(k, q)] = gain[i]
            rest = Fraction(0) if newest and i < n else self._left_out(k, s, i)
            if rest:
                self.boxes[self._rest(k, i)] = -rest, rest
                row[self._rest(k, i)] = Fraction(1)
            row = {j: v for j, v in row.items() if v}
            if i < n and not newest:
                self._next_state(self._x(k + 1, i), row, constant)
            elif i >= n and not np.isnan(s.y[i - n]):
                reach = Fraction(s.noise[i - n]) + Fraction(s.slack[i - n])
                y = Fraction(s.y[i - n]) - constant
                self._add(row, y - reach, y + reach)

    def _line(self, k: int, s: WindowSample, coefficients: list[Fraction]) -> tuple[Row, Fraction]:
        """A functional of (x, u, 1, w) as a row and a constant."""
        n, nu = self.n, s.u.size
        row = {self._x(k, j): coefficients[j] for j in range(n)}
        row |= {self._w(k, j): coefficients[n + nu + 1 + j] for j in range(self.nw)}
        return row, sum((coefficients[n + j] * Fraction(s.u[j]) for j in range(nu)), coefficients[n + nu])

    def _left_out(self, k: int, s: WindowSample, i: int) -> Fraction:
        """Bound of what the channels leave out of row i of the uncertainties."""
        total = Fraction(0)
        for item in range(1, len(s.stack)):
            mine = [q for q in range(self.nq) if self.c.owner[q] == item]
            reach = max((abs(Fraction(d)) for q in mine for d in self.c.delta[q]), default=Fraction(0))
            factors = [self.factors[k][q] for q in mine]
            left = [Fraction(v) - sum(g[i] * f[j] for g, f in factors) for j, v in enumerate(s.stack[item, i])]
            row, _ = self._line(k, s, [abs(v) for v in left])
            known = [*(abs(Fraction(v)) for v in s.u), Fraction(1)]
            constant = sum(abs(v) * u for v, u in zip(left[self.n :], known, strict=False))
            reached = sum(v * max(map(abs, self.boxes[j])) for j, v in row.items() if v)
            total += reach * (constant + reached)
        return total

    def _disturbance(self, k: int, s: WindowSample) -> None:
        for j in range(self.nw):
            self.boxes[self._w(k, j)] = Fraction(s.w_lower[j]), Fraction(s.w_upper[j])
        for coefficients, lower, upper in zip(self.c.w_rows, self.c.w_rows_lower, self.c.w_rows_upper, strict=True):
            self._add({self._w(k, j): Fraction(v) for j, v in enumerate(coefficients)}, lower, upper)

    def _hull(self, k: int, q: int, s: WindowSample) -> None:
        """s within its bounds, and p within the convex hull of {Delta s}: its box and two chords."""
        low, high = Fraction(s.s_lower[q]), Fraction(s.s_upper[q])
        ends = [[Fraction(d) * v for d in self.c.delta[q]] for v in (low, high)]
        self.boxes[self._p(k, q)] = min(map(min, ends)), max(map(max, ends))
        row, constant = self._line(k, s, self.factors[k][q][1])
        self._add(row, low - constant, high - constant)
        if low == high:
            return
        for pick, sign in ((max, 1), (min, -1)):
            slope = (pick(ends[1]) - pick(ends[0])) / (high - low)
            chord = {j: -sign * slope * v for j, v in row.items()} | {self._p(k, q): Fraction(sign)}
            self._add(chord, -np.inf, sign * (slope * (constant - low) + pick(ends[0])))

    def _next_state(self, j: int, row: Row, constant: Fraction) -> None:
        self.boxes[j] = tuple(constant + v for v in self._range(row))  # type: ignore[assignment]
        self._add({j: Fraction(-1)} | row, -constant, -constant)

    def _range(self, row: Row) -> tuple[Fraction, Fraction]:
        """Least and largest value of a row over the boxes."""
        ends = [sorted((v * self.boxes[j][0], v * self.boxes[j][1])) for j, v in row.items()]
        return sum((e[0] for e in ends), Fraction(0)), sum((e[1] for e in ends), Fraction(0))

    # -- answers -----------------------------------------------------------------------------------

    def judge(self) -> Answer:
        if any(lower > upper for lower, upper in self.boxes.values()):
            return "empty"
        point, multipliers = self._propose()
        if self._refutes(multipliers):
            return "empty"
        return "feasible" if self._is_explained_by(point) else "close"

    def _propose(self) -> tuple[Array, list[float]]:
        """Least t for which every inequality, widened by t times its width, has a point; its multipliers a row."""
        variables = sorted(self.boxes)
        place = {j: i for i, j in enumerate(variables)}
        G = np.zeros((len(self.rows), len(place) + 1))
        low, high = np.full(len(G), -np.inf), np.full(len(G), np.inf)
        for i, r in enumerate(self.rows):
            for j, v in r.row.items():
                G[i, place[j]] = v
            low[i] = -np.inf if r.lower is None else float(r.lower)
            high[i] = np.inf if r.upper is None else float(r.upper)
        equal = low == high
        width = np.where(np.isfinite(high - low), np.maximum((high - low) / 2, 1e-6), 1.0)
        above, below = np.isfinite(high) & ~equal, np.isfinite(low) & ~equal
        up, down = G.copy(), -G
        up[:, -1] = down[:, -1] = -width
        first = {self._x(0, j) for j in range(self.n)}
        states = {self._x(k, j) for k in range(1, len(self.c.samples)) for j in range(self.n)} - first
        bounds = [(None, None) if j in states else tuple(map(float, self.boxes[j])) for j in variables]
        found = linprog(
            np.eye(1, G.shape[1], G.shape[1] - 1)[0],
            A_ub=np.vstack([up[above], down[below]]), b_ub=np.concatenate([high[above], -low[below]]),
            A_eq=G[equal], b_eq=high[equal], bounds=[*bounds, (-1.0, None)], method="highs",
        )  # fmt: skip
        point, multipliers = np.zeros(len(self.c.samples) * self.size), np.zeros(len(G))
        if found.status != 0:
            return point, list(multipliers)
        point[variables] = found.x[:-1]
        sides = np.split(found.ineqlin.marginals, [int(above.sum())])
        multipliers[above] -= sides[0]
        multipliers[below] += sides[1]
        multipliers[equal] = -found.eqlin.marginals
        return point, list(multipliers)

    def _refutes(self, multipliers: list[float]) -> bool:
        """Whether the weighted sum of the rows exceeds that of their bounds everywhere in the boxes."""
        total: Row = {}
        bound = Fraction(0)
        for r, value in zip(self.rows, multipliers, strict=True):
            weight, side = Fraction(value), r.upper if value > 0 else r.lower
            if value and side is not None:
                bound += weight * side
                for j, v in r.row.items():
                    total[j] = total.get(j, Fraction(0)) + weight * v
        return self._range(total)[0] > bound

    def _is_explained_by(self, point: Array) -> bool:
        """Whether a trajectory close to a point meets every row exactly, each p being some Delta times its s."""
        exact = {j: min(max(Fraction(point[j]), box[0]), box[1]) for j, box in self.boxes.items()}
        n = self.n
        for k, s in enumerate(self.c.samples):
            for q, (_, functional) in enumerate(self.factors[k]):
                if self._p(k, q) in self.boxes:
                    row, constant = self._line(k, s, functional)
                    value = constant + _value(row, exact)
                    ends = sorted(Fraction(d) * value for d in self.c.delta[q])
                    exact[self._p(k, q)] = min(max(exact[self._p(k, q)], ends[0]), ends[1])
            if k + 1 < len(self.c.samples):
                for i in range(n):
                    row, constant = self._line(k, s, [Fraction(v) for v in s.stack[0, i]])
                    row |= {self._p(k, q): gain[i] for q, (gain, _) in enumerate(self.factors[k])}
                    row |= {self._rest(k, i): Fraction(1)} if self._rest(k, i) in self.boxes else {}
                    exact[self._x(k + 1, i)] = constant + _value(row, exact)
        return all(
            (r.lower is None or r.lower <= _value(r.row, exact))
            and (r.upper is None or _value(r.row, exact) <= r.upper)
            for r in self.rows
        )


def _value(row: Row, point: dict[int, Fraction]) -> Fraction:
    return sum((v * point[j] for j, v in row.items() if v), Fraction(0))


def _channels(c: WindowCertificate, s: WindowSample) -> list[tuple[list[Fraction], list[Fraction]]]:
    """(gain, functional) of every channel. Which ones is the observer's choice: `_left_out` bounds what they miss."""
    found = channels_of(s.stack, c.owner, c.delta, c.units) if s.gain is None else (s.gain, s.functional)
    assert found is not None
    gains, functionals = ([[Fraction(v) for v in row] for row in m] for m in found)
    return list(zip(gains, functionals, strict=True))

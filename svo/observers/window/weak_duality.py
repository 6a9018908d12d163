"""Weak duality over a window, in exact rational arithmetic.

Every float is a rational number, so the window's rows, written with the states as variables, are the model's own
numbers. Given multipliers of the data rows, the multipliers of the state equations follow by the backward
recursion

    pi_k = A_k' pi_(k+1) + C_k' lambda_k + (channel rows),

and the window is empty if the multiplied rows exceed their bounds at every point of the variables' boxes. With a
direction at one sample subtracted, the same sum bounds that direction over the window.
"""

from __future__ import annotations

import numpy as np
from flint import fmpq

from polytopes.exact import ZERO, rational
from svo.checks import Array
from svo.observers.window.evidence import SumRows, WindowEvidence, WindowSample
from svo.observers.window.left_out import Factors, channels_of, factors_of, left_out


def _interval_min(coefficient: fmpq, lower: fmpq, upper: fmpq) -> fmpq:
    return coefficient * (lower if coefficient > 0 else upper)


def _widening(s: WindowSample, o: int) -> fmpq:
    """What is added to the noise of an output, at each sample anew."""
    return rational(s.slack[o]) + (ZERO if s.remainder is None else rational(s.remainder[o]))


class NoProof(Exception):
    """Something in a certificate does not support its claim."""


class DualSum:
    """One exact evaluation of a certificate whose arrays have been checked.

    Raises
    ------
    NoProof
        From `gap`, where a multiplier, a line or a factor is not what the rows need.
    """

    def __init__(self, certificate: WindowEvidence, objective: tuple[int, Array] | None = None) -> None:
        self.c = certificate
        self.objective = objective  # sample of the window and direction of what is subtracted from the rows
        self.total = ZERO  # lower bound of (multiplied rows - multiplied bounds) over the boxes
        self._summed: dict[tuple[int, int], fmpq] = {}  # multipliers of sums, by sample of the window and column

    def gap(self) -> fmpq:
        """Least value of the multiplied rows minus their bounds; positive proves emptiness."""
        c = self.c
        costate = [ZERO] * c.n
        factors = self._factors()
        if c.sums is not None:
            self._sums(c.sums)
        rest = left_out(c, factors) if any(of.rest for of in factors) else None
        for index in range(len(c.samples) - 1, -1, -1):
            newest = index == len(c.samples) - 1
            costate = self._sample(index, costate, newest, factors[index], rest[index] if rest else [])
            if self.objective is not None and self.objective[0] == index:
                costate = [p - rational(d) for p, d in zip(costate, self.objective[1], strict=True)]
        for r, multiplier in enumerate(c.on_arrival):
            if multiplier:
                m = rational(multiplier)
                self._bound(m, c.arrival.lower[r], c.arrival.upper[r])
                costate = [p + m * rational(a) for p, a in zip(costate, c.arrival.rows[r], strict=True)]
        for p, low, high in zip(costate, c.arrival.box_lower, c.arrival.box_upper, strict=True):
            if p:
                self._box(p, low, high)
        return self.total

    def _factors(self) -> list[Factors]:
        """Of every sample; they add up to the uncertainties with what they leave out."""
        known: dict[tuple[bytes, ...], Factors | None] = {}
        found = []
        for s in self.c.samples:
            stated = () if s.gain is None or s.functional is None else (s.gain, s.functional)
            key = tuple(array.tobytes() for array in (s.stack[1:], *stated))
            if key not in known:
                channels = stated or channels_of(s.stack, self.c.owner, self.c.delta, self.c.units)
                known[key] = factors_of(s.stack, self.c.owner, self.c.delta, channels) if channels else None
            of = known[key]
            if of is None:
                raise NoProof
            found.append(of)
        return found

    def _bound(self, multiplier: fmpq, lower: float, upper: float) -> None:
        bound = upper if multiplier > 0 else lower
        if not np.isfinite(bound):
            raise NoProof
        self.total -= multiplier * rational(bound)

    def _box(self, coefficient: fmpq, lower: float, upper: float) -> None:
        self.total += _interval_min(coefficient, rational(lower), rational(upper))

    def _sums(self, sums: SumRows) -> None:
        """Rows that are sums: their bounds count once, and their terms at each sample, as `_sample` finds them."""
        for i, multiplier in enumerate(sums.on_sum):
            if not multiplier:
                continue
            m, column, ny = rational(multiplier), int(sums.column[i]), self.c.samples[0].y.size
            ends = (sums.lower[i], sums.upper[i]) if column >= ny else (-sums.upper[i], -sums.lower[i])  # of -v
            self._bound(m, *ends)
            for index in range(int(sums.first[i]) - self.c.first, int(sums.last[i]) - self.c.first + 1):
                s = self.c.samples[index]
                if column < ny and np.isnan(s.y[column]):  # a term that is not there is at most the noise
                    self.total -= abs(m) * rational(s.noise[column])
                    continue
                if column < ny:
                    self.total -= m * rational(s.y[column]) + abs(m) * _widening(s, column)
                self._summed[index, column] = self._summed.get((index, column), ZERO) + m

    def _sample(self, index: int, after: list[fmpq], newest: bool, of: Factors, rest: list[fmpq]) -> list[fmpq]:
        """Account for one sample; ``after`` is the costate of the next state, the result that of this one."""
        s = self.c.samples[index]
        n, ny, nu = self.c.n, s.y.size, s.u.size
        active = not newest or self.c.late
        # weight of every row of the stack: the next state's costate, then the output multipliers
        weight = list(after) + [ZERO] * ny
        for o, multiplier in enumerate(s.on_output):
            if multiplier:
                weight[n + o] = self._output(s, o, rational(multiplier))
        known: list[fmpq] = [ZERO] * s.stack.shape[2]
        for column in range(ny + s.w_lower.size):
            m = self._summed.get((index, column))
            if m is not None and column < ny:
                weight[n + column] += m
            elif m is not None:
                known[n + nu + 1 + column - ny] = m
        self._combine(known, s.stack[0], weight)
        if active:
            self._channels(s, weight, known, of, newest)
            self.total -= sum((abs(w) * r for w, r in zip(weight, rest, strict=False)), ZERO)
            self._disturbance(s, known[n + nu + 1 :])
        elif any(known[n + nu + 1 :]) or np.any(s.stack[1:, n:]) or np.any(s.on_channel) or np.any(s.on_w):
            raise NoProof
        for value, coefficient in zip(s.u, known[n : n + nu], strict=True):
            if coefficient:
                self.total += coefficient * rational(value)
        self.total += known[n + nu]
        return known[:n]

    def _output(self, s: WindowSample, o: int, m: fmpq) -> fmpq:
        if not np.isfinite(s.y[o]):
            raise NoProof
        reach = rational(s.noise[o]) + _widening(s, o)
        self.total -= m * (rational(s.y[o]) + (reach if m > 0 else -reach))
        return m

    @staticmethod
    def _combine(target: list[fmpq], matrix: Array, weight: list[fmpq]) -> None:
        """target += weight' matrix, over the nonzero entries."""
        for w, row in zip(weight, matrix.tolist(), strict=True):
            if w:
                for j, entry in enumerate(row):
                    if entry:
                        target[j] += w * rational(entry)

    def _channels(self, s: WindowSample, weight: list[fmpq], known: list[fmpq], of: Factors, newest: bool) -> None:
        """Add each channel's p: its box, its two lines over s = functional'(x, u, 1, w), and its effect.

        One of the newest sample that does not reach the output has no part yet, since u there may not be known; its
        bounds of s are then zero.
        """
        for q, (gain, functional) in enumerate(zip(of.gains, of.functionals, strict=True)):
            if newest and not (np.any(gain[self.c.n :]) or s.s_lower[q] or s.s_upper[q]):
                continue
            lo, hi = (rational(v) for v in self.c.delta[q])
            low, high = rational(s.s_lower[q]), rational(s.s_upper[q])
            on_p = sum((w * rational(g) for w, g in zip(weight, gain, strict=True) if w and g), ZERO)
            on_s = ZERO
            for side in range(2):
                multiplier = s.on_channel[q, side]
                if multiplier:
                    m, slope, intercept = (
                        rational(multiplier),
                        rational(s.lines[q, 2 * side]),
                        rational(s.lines[q, 2 * side + 1]),
                    )
                    self._check_line(1 - 2 * side, slope, intercept, (lo, hi), (low, high))
                    if m < 0:
                        raise NoProof
                    sign = 1 - 2 * side
                    on_p += sign * m
                    on_s -= sign * m * slope
                    self.total -= sign * m * intercept
            if on_s:
                for j in np.flatnonzero(functional):
                    known[j] += on_s * rational(functional[j])
            if on_p:
                products = [d * v for d in (lo, hi) for v in (low, high)]
                self.total += _interval_min(on_p, min(products), max(products))
            self._check_known(s, functional, low, high)

    @staticmethod
    def _check_line(side: int, slope: fmpq, intercept: fmpq, delta: tuple[fmpq, fmpq], s: tuple[fmpq, fmpq]) -> None:
        """A line bounds Delta s over [l, r] if it does so at both ends (the bound is convex, or concave)."""
        for end in s:
            worst = max(side * d * end for d in delta)
            if side * (slope * end + intercept) < worst:
                raise NoProof

    def _check_known(self, s: WindowSample, functional: Array, low: fmpq, high: fmpq) -> None:
        """Where s depends on the input alone, its bounds are checked rather than trusted."""
        n, nu = self.c.n, s.u.size
        if np.any(functional[:n]) or np.any(functional[n + nu + 1 :]):
            return
        value = rational(functional[n + nu])
        for j in range(nu):
            if functional[n + j]:
                value += rational(functional[n + j]) * rational(s.u[j])
        if not low <= value <= high:
            raise NoProof

    def _disturbance(self, s: WindowSample, coefficients: list[fmpq]) -> None:
        c = list(coefficients)
        for h, multiplier in enumerate(s.on_w):
            if multiplier:
                m = rational(multiplier)
                self._bound(m, self.c.w_rows_lower[h], self.c.w_rows_upper[h])
                c = [v + m * rational(a) for v, a in zip(c, self.c.w_rows[h], strict=True)]
        for value, low, high in zip(c, s.w_lower, s.w_upper, strict=True):
            if value:
                self._box(value, low, high)

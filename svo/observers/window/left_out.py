"""What the channels of a window leave out of its uncertainties, in exact arithmetic.

Channels are factors in floats, so that their sum may miss the model's own matrix. What it misses,

    R_i = (stack of uncertainty i) - sum of gain functional',

is computed here from the stack, never read, and acts as a disturbance of each row of [x(k+1); y(k)],

    |Delta_i R_i (x, u, 1, w)| <= max |Delta_i| |R_i| (max |x|, |u|, 1, max |w|),

where max |x| is that of the state over the boxes of the window's variables (balls of arb, rounded outward). Products
that are floats leave exactly nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from flint import arb, arb_mat, ctx, fmpq
from numpy.typing import NDArray

from polytopes.exact import ZERO, ball_matrix, rational
from svo.checks import Array
from svo.models import Exponents, power
from svo.observers.window.evidence import WindowEvidence, WindowSample
from svo.observers.window_kernel import channel_factors

Evidence = TypeVar("Evidence", bound=WindowEvidence)


@dataclass(frozen=True, eq=False)
class Factors:
    """Channels of a stack, and what they leave out of it.

    Attributes
    ----------
    gains, functionals : (nq, n + ny), (nq, n + nu + 1 + nw) arrays
        In the units of the stack.
    rest : tuple of (row, column, fmpq)
        The entries of sum max |Delta_i| |R_i| that are not zero.
    """

    gains: Array
    functionals: Array
    rest: tuple[tuple[int, int, fmpq], ...]


def channels_of(
    stack: Array, owner: NDArray[np.int64], delta: Array, units: Exponents | None
) -> tuple[Array, Array] | None:
    """Gains and functionals of the channels that an observer makes of a stack in its units.

    Other units give other factors. None where floats cannot hold them.
    """
    normal = stack if units is None else stack * units.factor
    if not np.isfinite(normal).all():
        return None
    gains, functionals, *_ = channel_factors(normal, owner, delta)
    if units is not None:
        gains, functionals = gains * power(units.rows), functionals * power(-units.columns)
    if not (np.isfinite(gains).all() and np.isfinite(functionals).all()):
        return None
    return gains, functionals


def with_channels(c: Evidence) -> Evidence:
    """The same proof with the factors of its channels, where floats can hold them."""
    known: dict[bytes, tuple[Array, Array] | None] = {}
    samples = []
    for s in c.samples:
        key = s.stack[1:].tobytes()
        if key not in known:
            known[key] = channels_of(s.stack, c.owner, c.delta, c.units)
        gain, functional = known[key] or (None, None)
        samples.append(replace(s, gain=gain, functional=functional))
    return replace(c, samples=tuple(samples))


def factors_of(stack: Array, owner: NDArray[np.int64], delta: Array, channels: tuple[Array, Array]) -> Factors | None:
    """Any channels, and what they leave out: together they add up to the stack.

    None where nothing says how far the Delta of an uncertainty without a channel goes.
    """
    gains, functionals = channels
    entries: dict[tuple[int, int], fmpq] = {}
    for item in range(1, len(stack)):
        mine = np.flatnonzero(owner == item)
        reach = max((abs(rational(end)) for end in delta[mine].ravel()), default=None)
        covered = (np.any(gains[mine], axis=0)[:, None] & np.any(functionals[mine], axis=0)) | (stack[item] != 0.0)
        for i, j in np.argwhere(covered).tolist():
            rest = rational(stack[item, i, j])
            for q in mine:
                if gains[q, i] and functionals[q, j]:
                    rest -= rational(gains[q, i]) * rational(functionals[q, j])
            if rest:
                if reach is None:
                    return None
                entries[i, j] = entries.get((i, j), ZERO) + reach * abs(rest)
    return Factors(gains, functionals, tuple((i, j, value) for (i, j), value in entries.items()))


def left_out(c: WindowEvidence, factors: list[Factors]) -> list[list[fmpq]]:
    """Bounds (n + ny,) of what is left out of [x(k+1); y(k)], for every sample of a window."""
    rows = len(c.samples[0].stack[0])
    with ctx.workprec(128 + 4 * len(c.samples)):
        reach = _Reach(c)
        bounds = []
        for index, (sample, of) in enumerate(zip(c.samples, factors, strict=True)):
            known = reach.known(sample) if of.rest else []
            bound = [ZERO] * rows
            for i, j, value in of.rest:
                bound[i] += value * known[j]
            bounds.append(bound)
            if index + 1 < len(c.samples):
                reach.move(sample, of, bound)
    return bounds


class _Reach:
    """{centre + generators z : |z| <= 1}, which contains every state that the variables' boxes allow at a sample."""

    def __init__(self, c: WindowEvidence) -> None:
        self._delta, self._n = c.delta, c.n
        ends = [_ball(low, high) for low, high in zip(c.arrival.box_lower, c.arrival.box_upper, strict=True)]
        self._centre = arb_mat(c.n, 1, [middle for middle, _ in ends])
        self._generators = _diagonal([half for _, half in ends])

    def known(self, s: WindowSample) -> list[fmpq]:
        """Largest |x|, |u|, 1 and |w|."""
        x = [_upper(abs(row) + size) for row, size in zip(self._centre.entries(), _sums(self._generators), strict=True)]
        u = [abs(rational(value)) for value in s.u]
        w = [max(abs(rational(a)), abs(rational(b))) for a, b in zip(s.w_lower, s.w_upper, strict=True)]
        return [*x, *u, fmpq(1), *w]

    def move(self, s: WindowSample, of: Factors, rest: list[fmpq]) -> None:
        """To the next sample."""
        n, nu = self._n, s.u.size
        states = ball_matrix(s.stack[0, :n, :n])
        w = [_ball(low, high) for low, high in zip(s.w_lower, s.w_upper, strict=True)]
        p = [
            _ball(min(ends), max(ends))
            for (lo, hi), low, high in zip(self._delta, s.s_lower, s.s_upper, strict=True)
            for ends in [[rational(d) * rational(v) for d in (lo, hi) for v in (low, high)]]
        ]
        columns = ball_matrix(np.hstack([s.stack[0, :n, n + nu + 1 :], of.gains[:, :n].T]))
        known = ball_matrix(s.stack[0, :n, n : n + nu + 1])
        inputs = arb_mat(nu + 1, 1, [*(arb(float(v)) for v in s.u), arb(1)])
        self._centre = states * self._centre + known * inputs
        parts = [states * self._generators]
        if w or p:
            middles, halves = zip(*w, *p, strict=True)
            self._centre += columns * arb_mat(len(middles), 1, list(middles))
            parts.append(columns * _diagonal(list(halves)))
        if any(rest[:n]):
            parts.append(_diagonal([arb(value) for value in rest[:n]]))
        rows: list[list[arb]] = [[] for _ in range(n)]
        for part in parts:
            for row, more in zip(rows, part.tolist(), strict=True):
                row += more
        self._generators = arb_mat(rows)


def _ball(lower: float | fmpq, upper: float | fmpq) -> tuple[arb, arb]:
    """Centre and half-width of an interval."""
    low, high = (arb(v) if isinstance(v, fmpq) else arb(float(v)) for v in (lower, upper))
    return (low + high) / 2, (high - low) / 2


def _diagonal(values: list[arb]) -> arb_mat:
    matrix = arb_mat(len(values), len(values))
    for i, value in enumerate(values):
        matrix[i, i] = value
    return matrix


def _sums(matrix: arb_mat) -> list[arb]:
    return [sum((abs(value) for value in row), arb(0)) for row in matrix.tolist()]


def _upper(value: arb) -> fmpq:
    """A rational number that is not smaller."""
    mantissa, exponent = value.abs_upper().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)

"""Integrals over a sample that bound what moves inside it: in ball arithmetic, rounded up to floats.

For dx/dt = A x + f(t) the state after a sample is exp(A Ts) x + int_0^Ts exp(A (Ts - t)) f(t) dt.
"""

from __future__ import annotations

import math

import numpy as np
from flint import arb, arb_mat, ctx

from polytopes.exact import ball_matrix, ball_up
from svo.checks import Array

_FEW_BITS = 128  # of an exponential, twice as many where they lose too much
_BITS = 512  # states in units of 2^-80 to 2^80 keep a float's digits
_MOST_BITS = 8192
_PARTS = 16  # of a sample, more where it is long against the dynamics
_MOST_PARTS = 1024


def exponential(M: Array, Ts: float) -> Array:
    """exp(M Ts), every entry the nearest float, so that units which are powers of two scale it to the bit."""
    bits = _FEW_BITS
    while True:
        with ctx.workprec(bits):
            entries = (ball_matrix(M) * arb(Ts)).exp().tolist()
            if bits >= _MOST_BITS or all(_is_settled(v) for row in entries for v in row):
                return np.array([[float(v.mid()) for v in row] for row in entries])
        bits *= 2


def _is_settled(value: arb) -> bool:
    """Whether a ball is known to far more digits than a float has; zeros of the matrix' structure are exact."""
    return bool(value.rad() == 0) or bool(value.rel_accuracy_bits() > 100)


def carried(A: Array, Ts: float) -> Array:
    """int_0^Ts exp(M t) dt (n, n), rounded up, M being A with the absolute values of its off-diagonal entries.

    It bounds, entry by entry, what a signal between -1 and 1 that enters each state adds to the states within Ts.
    """
    n = len(A)
    with ctx.workprec(_BITS):
        joint = (ball_matrix(np.block([[_metzler(A), np.eye(n)], [np.zeros((n, 2 * n))]])) * arb(Ts)).exp()
        return _rounded_up([[joint[i, n + j] for j in range(n)] for i in range(n)])


def growth(A: Array, Ts: float) -> Array:
    """int_0^Ts exp(M (Ts - t)) t dt (n, n), M being A with the absolute values of its off-diagonal entries.

    |exp(A t)| <= exp(M t) entry by entry, and M keeps what decays (exp(|A| t) does not).
    """
    n = len(A)
    zero, one = np.zeros((n, n)), np.eye(n)
    with ctx.workprec(_BITS):
        # The last block of the first row of the exponential of this extension is the integral.
        joint = (
            ball_matrix(np.block([[_metzler(A), one, zero], [zero, zero, one], [zero, zero, zero]])) * arb(Ts)
        ).exp()
        return _rounded_up([[joint[i, 2 * n + j] for j in range(n)] for i in range(n)])


def departure(A: Array, M: Array, held: Array, Ts: float) -> Array:
    """int_0^Ts |exp(A t) M - held / Ts| dt, entry by entry (n, m).

    It bounds what a signal between -1 and 1 that enters through M adds to the state beside ``held`` times its mean.
    The trapezoids of a convex function lie above it; what exp(A t) M departs from its chord in a part of the sample is
    at most an eighth of the squared length times the largest second derivative there.
    """
    parts = _parts(A, Ts)
    with ctx.workprec(_BITS):
        length = arb(Ts) / parts
        a, mean = ball_matrix(A), ball_matrix(held) / arb(Ts)
        move, grow = (a * length).exp(), (ball_matrix(np.maximum(_metzler(A), 0.0)) * length).exp()
        now, total = ball_matrix(M), arb_mat(*M.shape)
        before = _absolute(now - mean)
        for _ in range(parts):
            bend = grow * _absolute(a * (a * now))
            now = move * now
            after = _absolute(now - mean)
            total += (before + after) * (length / 2) + bend * (length**3 / 12)
            before = after
        return _rounded_up(total.tolist())


def kept(A: Array, M: Array, Ts: float) -> Array:
    """Ts times what exp(A t) M has at least over a sample, with its sign; 0 where the sign changes (n, m).

    With this as ``held`` the set of a signal's mean and its departure is not wider, in any coordinate, than the
    signal itself makes it, and what all coordinates share is still shared. Any other value would be sound too.
    """
    step = exponential(A, Ts / _PARTS)
    values = [M]
    for _ in range(_PARTS):
        values.append(step @ values[-1])
    low, high = np.min(values, axis=0), np.max(values, axis=0)
    return np.asarray(Ts * (np.maximum(low, 0.0) + np.minimum(high, 0.0)))


def _parts(A: Array, Ts: float) -> int:
    """A number that depends on the dynamics and not on the units of the states."""
    radius = float(np.abs(np.linalg.eigvals(np.abs(A))).max())
    return min(_MOST_PARTS, _PARTS * 2 ** max(0, math.ceil(math.log2(1e-300 + radius * Ts))))


def _metzler(A: Array) -> Array:
    return np.where(np.eye(len(A), dtype=bool), A, np.abs(A))


def _absolute(M: arb_mat) -> arb_mat:
    return arb_mat(M.nrows(), M.ncols(), [abs(v) for v in M.entries()])


def _rounded_up(rows: list[list[arb]]) -> Array:
    """Floats that are not below any number of the balls."""
    return np.array([[ball_up(v) for v in row] for row in rows], dtype=float)

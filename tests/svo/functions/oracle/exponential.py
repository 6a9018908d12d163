"""Exponentials of matrices and their integrals in balls: what those of the core are held against."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flint import arb, ctx

from polytopes.exact import ball_matrix, ball_up
from svo.checks import Array

_FEW_BITS = 256  # what a float misses is bounded anyway


class Held(NamedTuple):
    """Floats near exp(J h) and its integral over [0, h], and bounds of what each entry misses; all (n, n)."""

    move: Array
    gain: Array
    move_error: Array
    gain_error: Array


def held(J: Array, h: float) -> Held:
    """What dx/dt = J x + c comes to after h: move x + gain c."""
    n = len(J)
    with ctx.workprec(_FEW_BITS):
        rows = _with_integral(J, h)
        floats = np.array([[float(v.mid()) for v in row] for row in rows])
        pairs = zip(rows, floats.tolist(), strict=True)
        errors = _rounded_up([[abs(v - arb(f)) for v, f in zip(*pair, strict=True)] for pair in pairs])
    return Held(floats[:, :n], floats[:, n:], errors[:, :n], errors[:, n:])


def carried(J: Array, h: float) -> Array:
    """int_0^h exp(M t) dt (n, n), rounded up, M being J with the absolute values of its off-diagonal entries.

    It bounds, entry by entry, what a signal between -1 and 1 that enters each state adds to the states within h.
    """
    with ctx.workprec(_FEW_BITS):
        return _rounded_up([row[len(J) :] for row in _with_integral(_metzler(J), h)])


def _with_integral(M: Array, h: float) -> list[list[arb]]:
    """Rows of exp(M h) and its integral over [0, h], side by side."""
    n = len(M)
    joint = (ball_matrix(np.block([[M, np.eye(n)], [np.zeros((n, 2 * n))]])) * arb(h)).exp()
    return [[joint[i, j] for j in range(2 * n)] for i in range(n)]


def _metzler(A: Array) -> Array:
    return np.where(np.eye(len(A), dtype=bool), A, np.abs(A))


def _rounded_up(rows: list[list[arb]]) -> Array:
    return np.array([[ball_up(v) for v in row] for row in rows], dtype=float)

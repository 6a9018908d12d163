"""The trajectories of an uncertain model as rows of a sparse program, with the states as variables.

Products p = Delta s with s = f'(x, u, 1, w) are bounded by two lines over s: exact where s keeps one sign, the convex
hull over its bounds otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.model import UncertainModel
from svo.sparse_program import Columns, SparseProgram, Terms

Array = NDArray[np.float64]
_LEFT_OVER = 1e-13  # of a stack, relative, that its channels may leave out


@dataclass(frozen=True)
class Channel:
    """p = Delta f'(x, u, 1, w) enters [x(k+1); y(k)] with ``gain``; ``owner`` is the index of its uncertainty."""

    owner: int
    gain: Array
    functional: Array
    lo: float
    hi: float


@dataclass(frozen=True)
class LiftedSample:
    """One sample of one model inside a program.

    Attributes
    ----------
    known : indices of the variables (x, u, 1, w)
    stack : (n + ny, len(known)) array
        [[A B a E], [C D c F]], with every Delta of a single possible value added in.
    channels, p : channels and their variables
    noise : (ny,) array
    """

    x: Columns
    w: Columns
    known: Columns
    stack: Array
    channels: tuple[Channel, ...]
    p: Columns
    noise: Array

    def terms(self, rows: slice) -> Terms:
        """The rows of [x(k+1); y(k)] as terms of a program."""
        gains = np.array([c.gain for c in self.channels]).reshape(-1, len(self.stack)).T
        return [(self.known, self.stack[rows]), (self.p, gains[rows])]


def evaluate(model: UncertainModel, schedule: Any) -> tuple[Array, tuple[Channel, ...]]:
    """The stack at a sample, Deltas of a single value added in, and the channels of the others."""
    stacks = model.stack(schedule)
    total, channels = stacks[0].copy(), []
    for i, (item, uncertainty) in enumerate(zip(stacks[1:], model.uncertainties, strict=True)):
        lo, hi = uncertainty.bounds
        if lo == hi:
            total += lo * item
        else:
            channels += [Channel(i, gain, functional, lo, hi) for gain, functional in _rank_one_terms(item)]
    return total, tuple(channels)


def _rank_one_terms(item: Array) -> list[tuple[Array, Array]]:
    """A matrix as a sum of gain functional', by complete pivoting."""
    rest, terms = item.copy(), []
    largest = np.abs(item).max()
    while np.abs(rest).max() > _LEFT_OVER * largest:
        r, c = np.unravel_index(np.abs(rest).argmax(), rest.shape)
        gain, functional = rest[:, c] / rest[r, c], rest[r].copy()
        rest -= np.outer(gain, functional)
        rest[r], rest[:, c] = 0.0, 0.0
        terms.append((gain, functional))
    return terms


def line_rows(program: SparseProgram, channel: Channel, known: Columns, p: Columns, low: float, high: float) -> bool:
    """Rows of p = Delta s for s in [low, high]; returns whether they are exact.

    Where s keeps one sign only the sign is used, so ``low`` and ``high`` may be infinite then.
    """
    f, lo, hi = channel.functional[None, :], channel.lo, channel.hi
    one = np.ones((1, 1))
    if low >= 0.0 or high <= 0.0:
        above, below = (hi, lo) if low >= 0.0 else (lo, hi)
        program.rows([(p, one), (known, -above * f)], -np.inf, 0.0)
        program.rows([(p, one), (known, -below * f)], 0.0, np.inf)
        return True
    above, below = (hi * high - lo * low) / (high - low), (lo * high - hi * low) / (high - low)
    program.rows([(p, one), (known, -above * f)], -np.inf, (lo - above) * low)
    program.rows([(p, one), (known, -below * f)], (hi - below) * low, np.inf)
    return False


def set_rows(program: SparseProgram, columns: Columns, P: HPolytope) -> None:
    """Rows that keep variables in a polytope."""
    if len(P.b):
        program.rows([(columns, P.A)], -np.inf, P.b)
    if len(P.d):
        program.rows([(columns, P.C)], P.d, P.d)


def bounding_box(name: str, P: HPolytope, dimension: int) -> tuple[Array, Array]:
    """The finite box of a set, or an error that names the argument."""
    if not isinstance(P, HPolytope):
        raise TypeError(f"{name} is {type(P).__name__}; expected an HPolytope, such as HPolytope.box(lower, upper)")
    if P.dim != dimension:
        raise ValueError(f"{name} has dimension {P.dim}; expected {dimension}")
    if P.emptiness().status != "nonempty":
        raise ValueError(f"{name} is empty, or not surely nonempty; expected a bounded set with a point")
    lower, upper = (np.asarray(b, dtype=float) for b in P.bounding_box())
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise ValueError(f"{name} is unbounded; expected a bounded set, such as a box")
    return lower, upper

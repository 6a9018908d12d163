"""The trajectories of an uncertain model as rows of a sparse program, with the states as variables.

Products p = Delta s with s = f'(x, u, 1, w) are bounded by two lines over s: exact where s keeps one sign, the convex
hull over its bounds otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.analysis.sparse_program import Columns, SparseProgram, Terms
from svo.checks import Array
from svo.models import UncertainModel, power
from svo.models.normal_form import Integers
from svo.observers.window_kernel import channel_count, channel_factors


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
    rest, on_rest : variables, and the rows that they enter (n + ny, k)
        Of what the channels leave out of the uncertainties.
    """

    x: Columns
    w: Columns
    known: Columns
    stack: Array
    channels: tuple[Channel, ...]
    p: Columns
    noise: Array
    rest: Columns
    on_rest: Array

    def terms(self, rows: slice) -> Terms:
        """The rows of [x(k+1); y(k)] as terms of a program."""
        gains = np.array([c.gain for c in self.channels]).reshape(-1, len(self.stack)).T
        return [(self.known, self.stack[rows]), (self.p, gains[rows]), (self.rest, self.on_rest[rows])]


def evaluate(
    model: UncertainModel, schedule: Any, shift: tuple[Integers, Integers] | None = None
) -> tuple[Array, tuple[Channel, ...], Array]:
    """The stack at a sample, the channels of its uncertainties, and what the channels leave out.

    Parameters
    ----------
    shift : (rows, columns), optional
        Exponents of the units of [x(k+1); y(k)] and (x, u, 1, w) in which the uncertainties are taken apart, beyond
        those of the model: those of an observer whose channels these shall be. Other units give other channels.

    Returns
    -------
    stack : (n + ny, n + nu + 1 + nw) array
        With the Deltas of a single value added in.
    channels : tuple of Channel
        Of the others.
    left : array like ``stack``
        Bound of what the channels leave out of their uncertainties, times |Delta|, entry by entry.
    """
    stacks = model.stack(schedule)
    rows, columns = (power(e) for e in shift) if shift else (np.ones(size) for size in stacks.shape[1:])
    total, left, channels = stacks[0].copy(), np.zeros_like(stacks[0]), []
    for i, (item, uncertainty) in enumerate(zip(stacks[1:], model.uncertainties, strict=True)):
        lo, hi = uncertainty.bounds
        if lo == hi:
            total += lo * item
            continue
        item = item * columns / rows[:, None]
        owner = np.ones(channel_count(item), dtype=np.int64)
        delta = np.tile([[lo, hi]], (len(owner), 1))
        gains, functionals, rest, _ = channel_factors(np.stack([item, item]), owner, delta)
        gains, functionals, rest = gains * rows, functionals / columns, rest * rows[:, None] / columns
        channels += [Channel(i, gain, functional, lo, hi) for gain, functional in zip(gains, functionals, strict=True)]
        left += rest
    return total, tuple(channels), left


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

"""A trajectory of a model through a log, in balls: the noise that it needs is proven, whatever found it.

Disturbances and Deltas are floats, so the first state decides about all others. Floats cannot hold it closely enough
where the model is unstable: it is corrected by least squares, in as many bits as the model's growth asks for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import NDArray

from polytopes import HPolytope
from polytopes.exact import ball_matrix, ball_up
from svo.checks import Array
from svo.logs.log import Log
from svo.models import NormalForm

_NEAR = 1e-6  # share of the width of a set
_BITS = 128  # besides those that growth asks for


@dataclass(frozen=True)
class Trajectory:
    """About a normal form: disturbances (K, nw) and Deltas (K, ni), and about where the states (K, n) are."""

    x: Array
    w: Array
    deltas: Array


@dataclass(frozen=True)
class Needed:
    """What a trajectory needs: noise (K, ny) in normal form, rounded up, NaN where nothing was measured; and whether
    its first state lies in the set of first states and every state in the model's physical range."""

    noise: Array
    is_within: bool


def needed_by(trajectory: Trajectory, form: NormalForm, log: Log, start: HPolytope) -> Needed:
    """Follow a trajectory from a first state that keeps it next to its states.

    Bounds of w and of the Deltas are the caller's to check: the numbers are taken as they are.
    """
    steps = [_Step(*parts) for parts in _matrices(trajectory, form, log)]
    n = trajectory.x.shape[1]
    growth = sum(np.log2(max(1.0, float(np.abs(step.total[:n, :n]).sum(axis=1).max()))) for step in steps)
    with ctx.workprec(_BITS + int(growth)):
        exact = [_column(row) for row in trajectory.x]
        first = _corrected(exact, steps, _free(start, trajectory.x[0] * form.x))
        within = lies_in(start, [value * arb(float(unit)) for value, unit in zip(first.entries(), form.x, strict=True)])
        noise = np.full((len(log), form.given.n_outputs), np.nan)
        for k, (x, output) in enumerate(_followed(first, steps)):
            within = within and _is_physical(x, form)
            y = form.outputs(log.y[k])
            for i in np.flatnonzero(~np.isnan(y)):
                noise[k, i] = ball_up(abs(arb(float(y[i])) - output[int(i), 0]))
    return Needed(noise, within)


class _Step:
    """[x(k+1); y(k)] = parts (x, u, 1, w) with the Deltas in; exact, as sums of floats are taken in balls."""

    def __init__(self, stacks: Array, deltas: Array, others: Array) -> None:
        self.stacks, self.deltas, self.others = stacks, deltas, others
        self.total = np.tensordot(np.concatenate([[1.0], deltas]), stacks, axes=1)  # about

    def split(self) -> tuple[arb_mat, arb_mat]:
        """The matrix of x, and what is added."""
        total = ball_matrix(self.stacks[0])
        for delta, stack in zip(self.deltas, self.stacks[1:], strict=True):
            total += ball_matrix(stack) * arb(float(delta))
        n = self.total.shape[1] - len(self.others)
        rows = total.tolist()
        return arb_mat([row[:n] for row in rows]), arb_mat([row[n:] for row in rows]) * _column(self.others)


def _matrices(t: Trajectory, form: NormalForm, log: Log) -> Iterator[tuple[Array, Array, Array]]:
    for k, (w, deltas) in enumerate(zip(t.w, t.deltas, strict=True)):
        yield form.model.stack(log.schedule_at(k)), deltas, np.concatenate([form.inputs(log.u[k]), [1.0], w])


def _followed(first: arb_mat, steps: list[_Step]) -> Iterator[tuple[arb_mat, arb_mat]]:
    """States (n, 1) and outputs without noise (ny, 1)."""
    x, n = first, first.nrows()
    for step in steps:
        of_x, added = step.split()
        rows = (of_x * x + added).tolist()
        yield x, arb_mat(rows[n:])
        x = arb_mat(rows[:n])


def _corrected(near: list[arb_mat], steps: list[_Step], free: NDArray[np.intp]) -> arb_mat:
    """The first state, moved along the coordinates that are ``free``, whose trajectory is the nearest."""
    first, n = near[0], near[0].nrows()
    if not len(free):
        return first
    reached = arb_mat(n, len(free), [int(i == j) for i in range(n) for j in free])
    squares, sums = arb_mat(len(free), len(free)), arb_mat(len(free), 1)
    for (x, _), wanted, step in zip(_followed(first, steps), near, steps, strict=True):
        across = reached.transpose()
        squares, sums = squares + across * reached, sums + across * (wanted - x)
        reached = arb_mat(step.split()[0].tolist()[:n]) * reached
    change = squares.solve(sums)
    moved = first.tolist()
    for row, i in enumerate(free.tolist()):
        moved[i][0] = (moved[i][0] + change[row, 0]).mid()
    return arb_mat(moved)


def _free(P: HPolytope, x: Array) -> NDArray[np.intp]:
    """Coordinates in which a point of a set may move a little: those of no row that it is next to."""
    lower, upper = P.bounding_box()
    next_to = P.b - P.A @ x <= _NEAR * np.abs(P.A) @ (upper - lower)
    held = P.A[next_to].any(axis=0) | P.C.any(axis=0)
    return np.flatnonzero(~held & (lower < upper))


def lies_in(P: HPolytope, point: Sequence[arb] | Array) -> bool:
    """Whether a point surely lies in a set."""
    balls = [v if isinstance(v, arb) else arb(float(v)) for v in point]

    def along(row: Array) -> arb:
        return sum((arb(float(c)) * v for c, v in zip(row, balls, strict=True)), arb(0))

    inside = all(along(row) <= arb(float(b)) for row, b in zip(P.A, P.b, strict=True))
    return inside and all((along(row) - arb(float(d))).is_zero() for row, d in zip(P.C, P.d, strict=True))


def _is_physical(x: arb_mat, form: NormalForm) -> bool:
    within = form.model.physical_range
    if within is None:
        return True
    ends = zip(within.lower, within.upper, strict=True)
    return all(arb(float(low)) <= x[i, 0] <= arb(float(high)) for i, (low, high) in enumerate(ends))


def _column(values: Array) -> arb_mat:
    return arb_mat(len(values), 1, [arb(float(v)) for v in values])

"""Primal simplex in rational arithmetic: the judge of programs too close for floats.

The same inequality-form method as the core, without rounding and with Bland's rule after a degenerate step.
It is slow (milliseconds), so it decides only what floats could not: flat sets, sets that touch in one point, sets
thinner than rounding, coefficients that look like zero.
"""

from dataclasses import dataclass

import numpy as np
from flint import fmpq, fmpq_mat

from polytopes.affine import AffineSet
from polytopes.checks import Floats
from polytopes.exact import ZERO, rational_matrix, rational_vector

_MAX_VARIABLES = 40  # above, a rational basis costs too much
_MAX_ENTRIES = 40_000
_MAX_PIVOTS = 400


@dataclass(frozen=True)
class ExactOutcome:
    """Where the rational simplex stopped.

    `status` is "optimal", "unbounded", "reached" (the wanted value) or "limit"; `multipliers` are those of the rows of
    A at an optimum.
    """

    status: str
    point: list[fmpq]
    value: fmpq
    multipliers: dict[int, fmpq]


def affordable(rows: int, variables: int) -> bool:
    """Whether a rational simplex of this size ends in reasonable time."""
    return variables <= _MAX_VARIABLES and rows * variables <= _MAX_ENTRIES


def exact_feasibility(A: Floats, b: Floats, flat: AffineSet, guess: Floats, strictly: bool = False) -> ExactOutcome:
    """Maximise r in ``A x + r <= b`` over the affine set, until r >= 0 (until r > 0 if `strictly`).

    Parameters
    ----------
    A, b : arrays (m, n) and (m,)
    flat : AffineSet
        The equalities; must have a solution.
    guess : array (n,)
        A float point to start from; only its free coordinates are used.

    Returns
    -------
    ExactOutcome
        "reached": `point` satisfies every row exactly (and strictly).  "optimal": `multipliers` prove that no point
        does; with value zero, the rows that carry them hold with equality all over the set.  "limit": undecided.
    """
    x = flat.lift_exactly(rational_vector(guess[flat.free]))
    column = fmpq_mat(len(x), 1, x)
    slack = rational_matrix(b) - rational_matrix(A) * column
    least = min((slack[i, 0] for i in range(len(b))), default=ZERO)
    if least > 0 or (least == 0 and not strictly):
        return ExactOutcome("reached", x, ZERO, {})
    lifted = rational_matrix(np.hstack([A, np.ones((len(b), 1))]))
    fixed = _fixed_rows(flat, extra=1)
    objective = [ZERO] * len(x) + [fmpq(1)]
    result = _ascend(lifted, rational_matrix(b), fixed, [*flat.free, len(x)], objective, [*x, least], strictly)
    return ExactOutcome(result.status, result.point[:-1], result.value, result.multipliers)


def exact_maximum(A: Floats, b: Floats, flat: AffineSet, form: list[fmpq], start: list[fmpq]) -> ExactOutcome:
    """Maximise ``form' x`` from a point that satisfies every row exactly."""
    return _ascend(rational_matrix(A), rational_matrix(b), _fixed_rows(flat, 0), flat.free, form, start, None)


def _fixed_rows(flat: AffineSet, extra: int) -> list[list[fmpq]]:
    """Independent rows of the equalities, in solved form, with `extra` more variables."""
    rows = []
    for k, j in enumerate(flat.pivots):
        row = [ZERO] * (flat.dim + extra)
        row[j] = fmpq(1)
        for q, f in enumerate(flat.free):
            row[f] = flat.solved[k, q]
        rows.append(row)
    return rows


def _ascend(
    A: fmpq_mat,
    b: fmpq_mat,
    fixed: list[list[fmpq]],
    free: list[int],
    objective: list[fmpq],
    start: list[fmpq],
    strictly: bool | None,
) -> ExactOutcome:
    """Exact primal simplex; slots hold the fixed rows, then a row number or None (coordinate `free[...]` held).

    Stops once the value is nonnegative (positive, if `strictly`), unless `strictly` is None.
    """
    n, q = len(start), len(fixed)
    x = fmpq_mat(n, 1, start)
    c = fmpq_mat(1, n, objective)
    slots: list[int | None] = [None] * len(free)
    unit = [[fmpq(int(j == f)) for j in range(n)] for f in free]
    degenerate = False
    for _ in range(_MAX_PIVOTS):
        value = (c * x)[0, 0]
        if strictly is not None and (value > 0 or (value == 0 and not strictly)):
            return ExactOutcome("reached", _column(x), value, {})
        rows = [[A[i, j] for j in range(n)] if i is not None else unit[k] for k, i in enumerate(slots)]
        inverse = fmpq_mat(n, n, [v for row in [*fixed, *rows] for v in row]).inv()
        y = c * inverse
        slot = _release(slots, [y[0, q + k] for k in range(len(slots))], degenerate)
        if slot is None:
            multipliers = {i: y[0, q + k] for k, i in enumerate(slots) if i is not None and y[0, q + k] != 0}
            return ExactOutcome("optimal", _column(x), value, multipliers)
        sign = 1 if slots[slot] is None and y[0, q + slot] > 0 else -1
        edge = fmpq_mat(n, 1, [sign * inverse[j, q + slot] for j in range(n)])
        row, step = _block(A * edge, b - A * x, slots)
        if row is None and strictly is not None:  # the value wanted is reached somewhere along the edge
            x = x + edge * ((1 - value) / (c * edge)[0, 0])
            return ExactOutcome("reached", _column(x), fmpq(1), {})
        if row is None:
            return ExactOutcome("unbounded", _column(x), value, {})
        x, slots[slot], degenerate = x + edge * step, row, step == 0
    return ExactOutcome("limit", _column(x), (c * x)[0, 0], {})


def _release(slots: list[int | None], y: list[fmpq], bland: bool) -> int | None:
    """Slot whose release improves the objective: a held coordinate first, then the most negative multiplier."""
    held = [k for k, i in enumerate(slots) if i is None and y[k] != 0]
    if held:
        return held[0]
    negative = [k for k, i in enumerate(slots) if i is not None and y[k] < 0]
    if not negative:
        return None
    return min(negative, key=lambda k: slots[k] or 0) if bland else min(negative, key=lambda k: y[k])


def _block(rate: fmpq_mat, slack: fmpq_mat, slots: list[int | None]) -> tuple[int | None, fmpq]:
    """First row that stops the move (lowest number among ties), and the step."""
    best, step = None, ZERO
    active = {i for i in slots if i is not None}
    for i in range(rate.nrows()):
        if rate[i, 0] > 0 and i not in active:
            t = slack[i, 0] / rate[i, 0]
            if best is None or t < step:
                best, step = i, t
    return best, step


def _column(x: fmpq_mat) -> list[fmpq]:
    return [x[j, 0] for j in range(x.nrows())]

"""The point of a polyhedron that is nearest in the Euclidean sense: a convex quadratic program by an active set.

Minimise ``|F y - g|^2`` over ``{A y <= b, C y = d}`` from a point inside (Nocedal and Wright 2006, Algorithm 16.3):
steps in the null space of the rows that are held, until one more blocks; where no step is left, the row with the most
negative multiplier is released.  Each point where no step is left is better than the one before, so that the method is
finite.  Floats find the rows that are held; the conditions of Karush, Kuhn and Tucker are then solved and checked in
rationals.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import fmpq, fmpq_mat

from polytopes.checks import Floats
from polytopes.exact import ZERO, rational, rational_matrix, rational_vector
from polytopes.lengths import evened, lengths
from polytopes.rows import Rows

_STILL = 1e-12  # of the size of a point: a step that is none, or a multiplier that is not negative
_STEPS = 20  # per row and coordinate
_REPAIRS = 40
_MAX_UNKNOWNS = 150


@dataclass(frozen=True, eq=False)
class Nearest:
    """A nearest point (N,), the rows of A that it is held by, and the exact square of the distance if it is proved."""

    point: Floats
    held: list[int]
    squared: Fraction | None


def nearest(P: Rows, F: Floats, g: Floats, exactly: bool = True) -> Nearest:
    """A point y of a nonempty set with ``|F y - g|`` least, F (k, N) and g (k,)."""
    y, held = _by_active_set(P, F, g, P.program.interior.point)
    if not exactly or P.dim + len(held) + P.d.size > _MAX_UNKNOWNS:
        return Nearest(y, held, None)
    return _proved(P, F, g, y, held) or Nearest(y, held, None)


def _by_active_set(P: Rows, F: Floats, g: Floats, y: Floats) -> tuple[Floats, list[int]]:
    rows, fixed = np.flatnonzero(P.A.any(axis=1)), P.C.any(axis=1)
    A, b = _of_length_one(P.A[rows], P.b[rows])
    C, _ = _of_length_one(P.C[fixed], P.d[fixed])
    held: list[int] = []
    last = np.inf
    for _ in range(_STEPS * (len(A) + P.dim)):
        size = float(np.abs(y).max()) + float(np.abs(g).max(initial=0.0)) + float(np.abs(b).max(initial=0.0))
        missed = g - F @ y
        step = _step(np.vstack([C, A[held]]), F, missed)
        if np.abs(F @ step).max() <= _STILL * size:
            loose = _release(C, A[held], F.T @ missed, float(np.linalg.norm(missed)) >= last)
            if loose is None:
                break
            last = min(last, float(np.linalg.norm(missed)))
            held.pop(loose)
            continue
        rate, slack = A @ step, np.maximum(b - A @ y, 0.0)
        rate[held] = 0.0
        blocking = rate > _STILL * np.abs(step).max()
        reach = np.where(blocking, slack / np.where(blocking, rate, 1.0), np.inf)
        first = int(reach.argmin()) if reach.size else -1
        if first >= 0 and reach[first] < 1.0:
            y = y + reach[first] * step
            held.append(first)
        else:
            y = y + step
    return y, [int(rows[i]) for i in held]


def _of_length_one(rows: Floats, sides: Floats) -> tuple[Floats, Floats]:
    """Rows and their sides over the lengths of the rows: a rank is then none of their units."""
    even, values = evened(rows, sides)
    sizes = lengths(even)
    return even / sizes[:, None], values / sizes


def _step(rows: Floats, F: Floats, missed: Floats) -> Floats:
    """The least step in the null space of rows that minimises ``|F step - missed|``."""
    n = F.shape[1]
    basis = np.eye(n)
    if len(rows):
        _, sizes, axes = np.linalg.svd(rows)
        basis = axes[int(np.count_nonzero(sizes > 1e-12 * sizes[0])) :].T
    if not basis.shape[1]:
        return np.zeros(n)
    return np.asarray(basis @ np.linalg.lstsq(F @ basis, missed, rcond=1e-12)[0])


def _release(C: Floats, held: Floats, gradient: Floats, first: bool) -> int | None:
    """The held row with the most negative multiplier (the first negative one, after a step that gained nothing)."""
    if not len(held):
        return None
    multipliers = np.linalg.lstsq(np.vstack([C, held]).T, gradient, rcond=1e-13)[0][len(C) :]
    negative = np.flatnonzero(multipliers < -_STILL * max(float(np.linalg.norm(gradient)), 1e-300))
    if not negative.size:
        return None
    return int(negative[0]) if first else int(multipliers.argmin())


def _proved(P: Rows, F: Floats, g: Floats, y: Floats, held: list[int]) -> Nearest | None:
    """The nearest point with exactly these rows held, or with some more or less; None if none is proved."""
    A, b = rational_matrix(P.A), rational_matrix(P.b)
    exact_f, exact_g = rational_matrix(F), rational_matrix(g)
    for _ in range(_REPAIRS):
        solution = _stationary(P, exact_f, exact_g, y, held)
        if solution is None:
            return None
        point, multipliers = solution
        broken = A * point - b
        worst = max(range(P.b.size), key=lambda i: broken[i, 0], default=None)
        negative = [k for k, v in enumerate(multipliers) if v < 0]
        if negative:
            held = [i for k, i in enumerate(held) if k != min(negative, key=lambda k: multipliers[k])]
        elif worst is not None and broken[worst, 0] > 0:
            held = [*held, worst]
        else:
            missed = exact_f * point - exact_g
            squared = sum((v * v for v in missed.entries()), ZERO)
            floats = np.array([int(v.p) / int(v.q) for v in point.entries()])
            return Nearest(floats, held, Fraction(int(squared.p), int(squared.q)))
    return None


def _stationary(P: Rows, F: fmpq_mat, g: fmpq_mat, y: Floats, held: list[int]) -> tuple[fmpq_mat, list[fmpq]] | None:
    """The exact ``F'F y + R'm = F'g``, ``R y = r`` with the held rows R: y and the multipliers of inequalities.

    What the equations leave free of y takes its float value.
    """
    rows, sides = np.vstack([P.A[held], P.C]), np.append(P.b[held], P.d)
    n, k = P.dim, len(rows)
    R, gram, right = rational_matrix(rows), F.transpose() * F, F.transpose() * g
    table = [[fmpq(0)] * (n + k + 1) for _ in range(n + k)]
    for i in range(n):
        # multipliers first, so that coordinates are what is left free
        table[i] = [*(R[q, i] for q in range(k)), *(gram[i, j] for j in range(n)), right[i, 0]]
    for q in range(k):
        table[n + q] = [*([ZERO] * k), *(R[q, j] for j in range(n)), rational(float(sides[q]))]
    reduced, rank = fmpq_mat(n + k, n + k + 1, [v for row in table for v in row]).rref()
    leading = [next(j for j in range(n + k + 1) if reduced[i, j] != 0) for i in range(rank)]
    if n + k in leading:
        return None
    values = [ZERO] * k + rational_vector(y)
    free = [j for j in range(n + k) if j not in leading]
    solution = list(values)
    for i, j in enumerate(leading):
        solution[j] = reduced[i, n + k] - sum((reduced[i, f] * values[f] for f in free), ZERO)
    return fmpq_mat(n, 1, solution[k:]), solution[: len(held)]

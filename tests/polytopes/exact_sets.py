"""The Parma library as an exact oracle for small sets of integers (or any floats)."""

import math

import numpy as np
import ppl
from numpy.typing import NDArray

from polytopes import HPolytope


def polyhedron(P: HPolytope) -> ppl.C_Polyhedron:
    """The same set, its floats taken as rationals."""
    system = ppl.Constraint_System()
    x = [ppl.Variable(j) for j in range(P.dim)]
    system.insert(0 * x[-1] <= 0)
    for rows, rhs, equal in ((P.A, P.b, False), (P.C, P.d, True)):
        for row, value in zip(rows, rhs, strict=True):
            ratios = [v.as_integer_ratio() for v in [*row.tolist(), float(value)]]
            common = max(q for _, q in ratios)  # denominators are powers of two
            *coefficients, constant = [p * (common // q) for p, q in ratios]
            form = sum((c * v for c, v in zip(coefficients, x, strict=True)), 0 * x[0])
            system.insert(form == constant if equal else form <= constant)
    return ppl.C_Polyhedron(system)


def minimal_size(polyhedron: ppl.C_Polyhedron) -> tuple[int, int]:
    """Numbers of inequalities and equalities of a minimal description."""
    rows = polyhedron.minimized_constraints()
    equalities = sum(1 for row in rows if row.is_equality())
    return len(rows) - equalities, equalities


def shadow(P: HPolytope, keep: list[int]) -> ppl.C_Polyhedron:
    """Projection of P on some coordinates."""
    order = keep + [j for j in range(P.dim) if j not in keep]
    copy = polyhedron(HPolytope(P.A[:, order], P.b, P.C[:, order], P.d))
    copy.remove_higher_space_dimensions(len(keep))
    return copy


def supports(polyhedron: ppl.C_Polyhedron, directions: NDArray[np.int64]) -> NDArray[np.float64]:
    """Exact support function in integer directions (k, n), rounded to floats."""
    values = []
    for row in directions:
        if polyhedron.is_empty():
            values.append(-np.inf)
            continue
        form = sum((int(c) * ppl.Variable(j) for j, c in enumerate(row)), 0 * ppl.Variable(len(row) - 1))
        answer = polyhedron.maximize(form)
        values.append(int(answer["sup_n"]) / int(answer["sup_d"]) if answer["bounded"] else np.inf)
    return np.array(values)


def within(inner: ppl.C_Polyhedron, outer: ppl.C_Polyhedron, tol: float, reach: int = 64) -> bool:
    """Whether `inner`, cut at a box, exceeds no row of `outer` by more than a distance `tol`.

    The cut keeps two unbounded sets comparable whose recession directions differ by rounding.
    """
    n = inner.space_dimension()
    cut = ppl.C_Polyhedron(inner)
    for j in range(n):
        cut.add_constraint(ppl.Variable(j) <= reach)
        cut.add_constraint(ppl.Variable(j) >= -reach)
    if cut.is_empty():
        return True
    for row in outer.minimized_constraints():  # a'x + a0 >= 0, or = 0
        form = sum((c * ppl.Variable(j) for j, c in enumerate(row.coefficients())), 0 * ppl.Variable(n - 1))
        length = math.sqrt(sum(int(c) ** 2 for c in row.coefficients()))
        for side in (1, -1) if row.is_equality() else (1,):
            least = cut.minimize(side * (form + row.inhomogeneous_term()))
            if int(least["inf_n"]) / int(least["inf_d"]) < -tol * length:
                return False
    return True

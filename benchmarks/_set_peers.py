"""The operations of each library, from arrays to arrays: what its user types for a set ``A x <= b``.

`METHODS[operation][library]` takes an `Instance`.  Answers are truth values, numbers, a box,
points, and rows ``[A, b]`` or a set that has them (`rows_of`).
A library that is not installed has no methods.
"""

import importlib
import logging
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from benchmarks._set_instances import Floats, Instance
from polytopes import HPolytope, convex_hull

Answer = Any
Method = Callable[[Instance], Answer]


def library(name: str) -> Any:
    """A library, or None if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


logging.getLogger("polytope").setLevel(logging.ERROR)  # it says which solver it did not find
CDD, PPL, POLYTOPE = library("cdd"), library("ppl"), library("polytope")


def rows_of(answer: Answer) -> Floats:
    """Rows ``[A, b]`` of a set of ours (an equality as two) or of polytope's; others give such rows."""
    if isinstance(answer, np.ndarray):
        return answer
    if isinstance(answer, HPolytope):
        answer = answer.intersection(HPolytope(np.vstack([answer.C, -answer.C]), np.append(answer.d, -answer.d)))
    return np.hstack([answer.A, np.reshape(answer.b, (-1, 1))])


# ours


def kept(case: Instance) -> range:
    """The coordinates that a projection keeps."""
    return range(max(1, case.dim - 1))


OURS: dict[str, Method] = {
    "emptiness": lambda s: HPolytope(s.A, s.b).is_empty(),
    "support": lambda s: HPolytope(s.A, s.b).support(s.c),
    "bounding box": lambda s: HPolytope(s.A, s.b).bounding_box(),
    "largest ball": lambda s: HPolytope(s.A, s.b).chebyshev().radius,
    "redundancy": lambda s: HPolytope(s.A, s.b).remove_redundancy(),
    "vertices": lambda s: HPolytope(s.A, s.b).vertices(),
    "rows to vertices to rows": lambda s: HPolytope.from_vertices(HPolytope(s.A, s.b).vertices()),
    "hull of points": lambda s: HPolytope.from_vertices(s.V),
    "hull of a union": lambda s: convex_hull([HPolytope(s.A, s.b), HPolytope(s.A2, s.b2)]),
    "projection": lambda s: HPolytope(s.A, s.b).project(kept(s)),
    "Minkowski sum": lambda s: HPolytope(s.A, s.b).minkowski_sum(HPolytope(s.A2, s.b2)),
    "Pontryagin difference": lambda s: HPolytope(s.A, s.b).pontryagin_difference(HPolytope(s.A2, s.b2)),
    "volume": lambda s: HPolytope(s.A, s.b).volume(),
    "contains a set": lambda s: bool(HPolytope(s.A, s.b).contains(HPolytope(s.A2, s.b2))),
    "equality": lambda s: HPolytope(s.A, s.b) == HPolytope(s.A[::-1], s.b[::-1]),
    "intersection not empty": lambda s: bool(HPolytope(s.A, s.b).intersects(HPolytope(s.A2, s.b2))),
}


# SciPy


def maximum(A: Floats, b: Floats, c: Floats) -> float:
    """``max c'x`` by linprog."""
    return -float(linprog(-c, A_ub=A, b_ub=b, bounds=(None, None)).fun)


def ball(A: Floats, b: Floats) -> tuple[Floats, float]:
    """Centre and radius of a largest ball by linprog."""
    n, norms = A.shape[1], np.linalg.norm(A, axis=1)[:, None]
    bounds = [(None, None)] * n + [(0, None)]
    x = linprog(np.append(np.zeros(n), -1.0), A_ub=np.hstack([A, norms]), b_ub=b, bounds=bounds).x
    return x[:n], float(x[n])


def corners(A: Floats, b: Floats) -> Floats:
    """Vertices by HalfspaceIntersection, around the centre of a largest ball."""
    if A.shape[1] == 1:
        return np.array([[-maximum(A, b, -np.ones(1))], [maximum(A, b, np.ones(1))]])
    return HalfspaceIntersection(np.hstack([A, -b[:, None]]), ball(A, b)[0]).intersections


def hull_rows(V: Floats) -> Floats:
    """Rows of a hull by ConvexHull, those of one facet that it split only once."""
    if V.shape[1] == 1:
        return np.array([[1.0, V.max()], [-1.0, -V.min()]])
    rows = np.unique(ConvexHull(V).equations, axis=0)
    rows[:, -1] *= -1.0
    return rows


def sums(V: Floats, W: Floats) -> Floats:
    """All sums of two points."""
    return (V[:, None] + W).reshape(-1, V.shape[1])


def by_programs(s: Instance) -> tuple[Floats, Floats]:
    """A box by linprog."""
    axes = np.eye(s.dim)
    return -np.array([maximum(s.A, s.b, -e) for e in axes]), np.array([maximum(s.A, s.b, e) for e in axes])


def within(A: Floats, b: Floats, A2: Floats, b2: Floats) -> bool:
    """Whether ``A2 x <= b2`` lies in ``A x <= b``, by a program a row."""
    return all(maximum(A2, b2, row) <= side + 1e-9 for row, side in zip(A, b, strict=True))


def feasible(A: Floats, b: Floats) -> bool:
    """Whether linprog finds a point."""
    return linprog(np.zeros(A.shape[1]), A_ub=A, b_ub=b, bounds=(None, None)).status != 2


def volume_of(V: Floats) -> float:
    """Volume of a hull."""
    return float(np.ptp(V)) if V.shape[1] == 1 else float(ConvexHull(V).volume)


SCIPY: dict[str, Method] = {
    "emptiness": lambda s: not feasible(s.A, s.b),
    "support": lambda s: maximum(s.A, s.b, s.c),
    "bounding box": by_programs,
    "largest ball": lambda s: ball(s.A, s.b)[1],
    "vertices": lambda s: corners(s.A, s.b),
    "rows to vertices to rows": lambda s: hull_rows(corners(s.A, s.b)),
    "hull of points": lambda s: hull_rows(s.V),
    "hull of a union": lambda s: hull_rows(np.vstack([corners(s.A, s.b), corners(s.A2, s.b2)])),
    "projection": lambda s: hull_rows(corners(s.A, s.b)[:, kept(s)]),
    "Minkowski sum": lambda s: hull_rows(sums(corners(s.A, s.b), corners(s.A2, s.b2))),
    "Pontryagin difference": lambda s: np.hstack(
        [s.A, (s.b - [maximum(s.A2, s.b2, row) for row in s.A])[:, None]]
    ),
    "volume": lambda s: volume_of(corners(s.A, s.b)),
    "contains a set": lambda s: within(s.A, s.b, s.A2, s.b2),
    "equality": lambda s: within(s.A, s.b, s.A[::-1], s.b[::-1]) and within(s.A[::-1], s.b[::-1], s.A, s.b),
    "intersection not empty": lambda s: feasible(np.vstack([s.A, s.A2]), np.append(s.b, s.b2)),
}


# cddlib in floats


def cdd_rows(A: Floats, b: Floats) -> Any:
    """A matrix of rows ``b - A x >= 0``."""
    return CDD.matrix_from_array(np.hstack([b[:, None], -A]).tolist(), rep_type=CDD.RepType.INEQUALITY)


def cdd_corners(A: Floats, b: Floats) -> Floats:
    return np.array(CDD.copy_generators(CDD.polyhedron_from_matrix(cdd_rows(A, b))).array)[:, 1:]


def cdd_hull(V: Floats) -> Floats:
    generators = np.hstack([np.ones((len(V), 1)), V]).tolist()
    matrix = CDD.matrix_from_array(generators, rep_type=CDD.RepType.GENERATOR)
    return from_cdd(CDD.copy_inequalities(CDD.polyhedron_from_matrix(matrix)))


def from_cdd(matrix: Any) -> Floats:
    rows = np.array(matrix.array)
    return np.hstack([-rows[:, 1:], rows[:, :1]])


def cdd_maximum(A: Floats, b: Floats, c: Floats, constant: float = 0.0) -> Any:
    """A solved program of cddlib."""
    matrix = cdd_rows(A, b)
    matrix.obj_type, matrix.obj_func = CDD.LPObjType.MAX, [constant, *c.tolist()]
    program = CDD.linprog_from_matrix(matrix)
    CDD.linprog_solve(program)
    return program


def cdd_support(A: Floats, b: Floats, c: Floats) -> float:
    return float(cdd_maximum(A, b, c).obj_value)


def cdd_feasible(A: Floats, b: Floats) -> bool:
    return cdd_maximum(A, b, np.zeros(A.shape[1])).status == CDD.LPStatusType.OPTIMAL


def cdd_ball(s: Instance) -> float:
    norms = np.linalg.norm(s.A, axis=1)[:, None]
    lifted = np.vstack([np.hstack([s.A, norms]), -np.eye(s.dim + 1)[-1:]])
    return cdd_support(lifted, np.append(s.b, 0.0), np.eye(s.dim + 1)[-1])


def cdd_minimal(s: Instance) -> Floats:
    matrix = cdd_rows(s.A, s.b)
    CDD.matrix_canonicalize(matrix)
    return from_cdd(matrix)


def cdd_shadow(s: Instance) -> Floats:
    if s.dim == 1:
        return cdd_minimal(s)
    matrix = CDD.fourier_elimination(cdd_rows(s.A, s.b))
    CDD.matrix_canonicalize(matrix)
    return from_cdd(matrix)


def cdd_within(A: Floats, b: Floats, A2: Floats, b2: Floats) -> bool:
    return all(cdd_support(A2, b2, row) <= side + 1e-9 for row, side in zip(A, b, strict=True))


CDDLIB: dict[str, Method] = {
    "emptiness": lambda s: not cdd_feasible(s.A, s.b),
    "support": lambda s: cdd_support(s.A, s.b, s.c),
    "bounding box": lambda s: (
        -np.array([cdd_support(s.A, s.b, -e) for e in np.eye(s.dim)]),
        np.array([cdd_support(s.A, s.b, e) for e in np.eye(s.dim)]),
    ),
    "largest ball": cdd_ball,
    "redundancy": cdd_minimal,
    "vertices": lambda s: cdd_corners(s.A, s.b),
    "rows to vertices to rows": lambda s: cdd_hull(cdd_corners(s.A, s.b)),
    "hull of points": lambda s: cdd_hull(s.V),
    "hull of a union": lambda s: cdd_hull(np.vstack([cdd_corners(s.A, s.b), cdd_corners(s.A2, s.b2)])),
    "projection": cdd_shadow,
    "Minkowski sum": lambda s: cdd_hull(sums(cdd_corners(s.A, s.b), cdd_corners(s.A2, s.b2))),
    "Pontryagin difference": lambda s: np.hstack(
        [s.A, (s.b - [cdd_support(s.A2, s.b2, row) for row in s.A])[:, None]]
    ),
    "contains a set": lambda s: cdd_within(s.A, s.b, s.A2, s.b2),
    "equality": lambda s: cdd_within(s.A, s.b, s.A[::-1], s.b[::-1]) and cdd_within(s.A[::-1], s.b[::-1], s.A, s.b),
    "intersection not empty": lambda s: cdd_feasible(np.vstack([s.A, s.A2]), np.append(s.b, s.b2)),
}


# the Parma Polyhedra Library: exact, floats as rationals


def ppl_form(row: list[int]) -> Any:
    return sum((v * PPL.Variable(j) for j, v in enumerate(row)), PPL.Linear_Expression(0))


def whole(values: list[float]) -> tuple[list[int], int]:
    """Floats as integers over one denominator, a power of two."""
    ratios = [v.as_integer_ratio() for v in values]
    common = max(q for _, q in ratios)
    return [p * (common // q) for p, q in ratios], common


def ppl_rows(A: Floats, b: Floats) -> Any:
    """A polyhedron of rows."""
    system = PPL.Constraint_System()
    for row in np.hstack([A, b[:, None]]).tolist():
        *normal, side = whole(row)[0]
        system.insert(ppl_form(normal) <= side)
    return PPL.C_Polyhedron(system)


def ppl_points(V: Any) -> Any:
    """A polyhedron of points, of floats or of integers with their denominators."""
    system = PPL.Generator_System()
    for numbers, common in [whole(row) for row in V.tolist()] if isinstance(V, np.ndarray) else V:
        system.insert(PPL.point(ppl_form(numbers), common))
    return PPL.C_Polyhedron(system)


def ppl_exact_corners(P: Any) -> list[tuple[list[int], int]]:
    """Vertices of a polyhedron as integers over a denominator."""
    return [([int(v) for v in g.coefficients()], int(g.divisor())) for g in P.minimized_generators()]


def ppl_corners(P: Any) -> Floats:
    return np.array([[v / q for v in numbers] for numbers, q in ppl_exact_corners(P)])


def ppl_table(P: Any) -> Floats:
    """Minimal rows ``[A, b]``; divided where their integers are no floats."""
    rows = []
    for row in P.minimized_constraints():
        numbers = [-int(v) for v in row.coefficients()] + [int(row.inhomogeneous_term())]
        largest = max(map(abs, numbers))
        rows.append([v / largest for v in numbers])
    return np.array(rows)


def ppl_support(P: Any, c: Floats) -> float:
    numbers, common = whole(c.tolist())
    answer = P.maximize(ppl_form(numbers))
    return int(answer["sup_n"]) / int(answer["sup_d"]) / common


def ppl_hull(s: Instance) -> Any:
    P = ppl_rows(s.A, s.b)
    P.poly_hull_assign(ppl_rows(s.A2, s.b2))
    return P


def ppl_shadow(s: Instance) -> Any:
    P = ppl_rows(s.A, s.b)
    P.remove_higher_space_dimensions(len(kept(s)))
    return P


def ppl_sum(s: Instance) -> Any:
    first, second = (ppl_exact_corners(ppl_rows(A, b)) for A, b in ((s.A, s.b), (s.A2, s.b2)))
    both = [([u * q + v * p for u, v in zip(x, y, strict=True)], p * q) for x, p in first for y, q in second]
    return ppl_points(both)


def ppl_difference(s: Instance) -> Floats:
    Q = ppl_rows(s.A2, s.b2)
    return np.hstack([s.A, (s.b - [ppl_support(Q, row) for row in s.A])[:, None]])


def ppl_box(s: Instance) -> tuple[Floats, Floats]:
    P, axes = ppl_rows(s.A, s.b), np.eye(s.dim)
    return -np.array([ppl_support(P, -e) for e in axes]), np.array([ppl_support(P, e) for e in axes])


PARMA: dict[str, Method] = {
    "emptiness": lambda s: ppl_rows(s.A, s.b).is_empty(),
    "support": lambda s: ppl_support(ppl_rows(s.A, s.b), s.c),
    "bounding box": ppl_box,
    "redundancy": lambda s: ppl_table(ppl_rows(s.A, s.b)),
    "vertices": lambda s: ppl_corners(ppl_rows(s.A, s.b)),
    "rows to vertices to rows": lambda s: ppl_table(ppl_points(ppl_exact_corners(ppl_rows(s.A, s.b)))),
    "hull of points": lambda s: ppl_table(ppl_points(s.V)),
    "hull of a union": lambda s: ppl_table(ppl_hull(s)),
    "projection": lambda s: ppl_table(ppl_shadow(s)),
    "Minkowski sum": lambda s: ppl_table(ppl_sum(s)),
    "Pontryagin difference": ppl_difference,
    "contains a set": lambda s: ppl_rows(s.A, s.b).contains(ppl_rows(s.A2, s.b2)),
    "equality": lambda s: ppl_rows(s.A, s.b) == ppl_rows(s.A[::-1], s.b[::-1]),
    "intersection not empty": lambda s: not ppl_rows(s.A, s.b).is_disjoint_from(ppl_rows(s.A2, s.b2)),
}


# polytope


def tulip(A: Floats, b: Floats) -> Any:
    return POLYTOPE.Polytope(A, b)


def tulip_corners(A: Floats, b: Floats) -> Floats:
    return POLYTOPE.extreme(tulip(A, b))


TULIP: dict[str, Method] = {
    "emptiness": lambda s: POLYTOPE.is_empty(tulip(s.A, s.b)),
    "bounding box": lambda s: tuple(np.ravel(v) for v in POLYTOPE.bounding_box(tulip(s.A, s.b))),
    "largest ball": lambda s: float(POLYTOPE.cheby_ball(tulip(s.A, s.b))[0]),
    "redundancy": lambda s: POLYTOPE.reduce(tulip(s.A, s.b)),
    "vertices": lambda s: tulip_corners(s.A, s.b),
    "rows to vertices to rows": lambda s: POLYTOPE.qhull(tulip_corners(s.A, s.b)),
    "hull of points": lambda s: POLYTOPE.qhull(s.V),
    "hull of a union": lambda s: POLYTOPE.qhull(np.vstack([tulip_corners(s.A, s.b), tulip_corners(s.A2, s.b2)])),
    "projection": lambda s: POLYTOPE.projection(tulip(s.A, s.b), np.array(kept(s)) + 1),
    "Minkowski sum": lambda s: POLYTOPE.qhull(sums(tulip_corners(s.A, s.b), tulip_corners(s.A2, s.b2))),
    "volume": lambda s: float(POLYTOPE.volume(tulip(s.A, s.b))),
    "contains a set": lambda s: POLYTOPE.is_subset(tulip(s.A2, s.b2), tulip(s.A, s.b)),
    "equality": lambda s: tulip(s.A, s.b) == tulip(s.A[::-1], s.b[::-1]),
    "intersection not empty": lambda s: not POLYTOPE.is_empty(tulip(s.A, s.b).intersect(tulip(s.A2, s.b2))),
}

LIBRARIES: dict[str, dict[str, Method]] = {
    "ours": OURS,
    "SciPy": SCIPY,
    "cdd": CDDLIB if CDD else {},
    "Parma": PARMA if PPL else {},
    "polytope": TULIP if POLYTOPE else {},
}
MISSING = [name for name, methods in LIBRARIES.items() if not methods]

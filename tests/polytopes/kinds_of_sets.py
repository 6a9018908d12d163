"""Seeded sets of integers of every kind, made from generators by an exact library, and decimal sets like them."""

import numpy as np
import ppl

from polytopes import HPolytope

KINDS = (
    "empty", "whole space", "half-space", "point", "segment", "flat", "polytope", "simplex", "box", "thin", "ray",
    "line", "cone", "flat cone", "strip", "prism",
)  # fmt: skip


def generated(V: np.ndarray, rays: np.ndarray, lines: np.ndarray) -> ppl.C_Polyhedron:
    """``conv(V) + cone(rays) + span(lines)`` of integers, V not empty."""
    x = [ppl.Variable(j) for j in range(V.shape[1])]
    system = ppl.Generator_System()
    for table, make in ((V, ppl.point), (rays, ppl.ray), (lines, ppl.line)):
        for row in table.tolist():
            if make is ppl.point or any(row):
                system.insert(make(sum((int(c) * v for c, v in zip(row, x, strict=True)), 0 * x[-1])))
    return ppl.C_Polyhedron(system)


def rows_of(exact: ppl.C_Polyhedron) -> HPolytope:
    """The same set by the minimal rows of the exact library."""
    n, rows, equalities = exact.space_dimension(), [], []
    for row in exact.minimized_constraints():  # a'x + a0 >= 0, or = 0
        entries = [-float(c) for c in row.coefficients()] + [0.0] * n
        table = equalities if row.is_equality() else rows
        table.append([*entries[:n], float(row.inhomogeneous_term())])
    inequalities, fixed = np.reshape(rows, (-1, n + 1)), np.reshape(equalities, (-1, n + 1))
    return HPolytope(inequalities[:, :-1], inequalities[:, -1], fixed[:, :-1], fixed[:, -1])


def integer_set(rng: np.random.Generator, kind: str, n: int) -> ppl.C_Polyhedron:
    """One set of a kind in R^n with coordinates from -4 to 4, around a common centre as a rule, so that sets meet."""
    if kind == "empty":
        return ppl.C_Polyhedron(n, "empty")
    if kind == "whole space":
        return ppl.C_Polyhedron(n, "universe")
    nothing = np.zeros((0, n), dtype=int)
    V, directions = rng.integers(-4, 5, (1, n)), rng.integers(-2, 3, (n + 1, n))
    span = directions[: int(rng.integers(1, max(n, 2)))]  # of some lower dimension
    some = rng.integers(0, 3, (int(rng.integers(2, 6)), len(span)))
    match kind:
        case "half-space":
            return generated(V, -np.eye(n, dtype=int)[:1], np.eye(n, dtype=int)[1:])
        case "point":
            return generated(V, nothing, nothing)
        case "segment":
            return generated(np.vstack([V, V + directions[0]]), nothing, nothing)
        case "flat":
            return generated(V + some @ span, nothing, nothing)
        case "polytope":
            return generated(rng.integers(-4, 5, (n + int(rng.integers(1, 5)), n)), nothing, nothing)
        case "simplex":
            return generated(np.vstack([V, V + np.eye(n, dtype=int) * rng.integers(1, 4, n)]), nothing, nothing)
        case "box":
            corners = np.stack(np.meshgrid(*[[0, w] for w in rng.integers(0, 3, n)]), axis=-1).reshape(-1, n)
            return generated(V + corners, nothing, nothing)
        case "thin":
            return generated(np.vstack([V, V + 1000 * directions[:2], V + directions]), nothing, nothing)
        case "ray":
            return generated(V, directions[:1], nothing)
        case "line":
            return generated(V, nothing, directions[:1])
        case "cone":
            return generated(V if rng.random() < 0.5 else 0 * V, directions, nothing)
        case "flat cone":
            return generated(V, span, nothing)
        case "strip":
            return generated(np.vstack([V, V + directions[0]]), nothing, directions[1:n])
    return generated(V + some @ span, directions[-1:], directions[-2:-1] if n > 2 else nothing)


def maximum(exact: ppl.C_Polyhedron, direction: np.ndarray) -> tuple[int, int] | None:
    """Exact support along integers as a fraction; None where it is unbounded."""
    form = sum((int(c) * ppl.Variable(j) for j, c in enumerate(direction)), 0 * ppl.Variable(len(direction) - 1))
    answer = exact.maximize(form)
    return (int(answer["sup_n"]), int(answer["sup_d"])) if answer["bounded"] else None


def mapped(exact: ppl.C_Polyhedron, M: np.ndarray, t: np.ndarray, scale: int = 1) -> ppl.C_Polyhedron:
    """Image under ``(M x + t) / scale`` for integers, by generators."""
    p, n = M.shape
    M, t = M.astype(object), t.astype(object)
    x = [ppl.Variable(j) for j in range(p)]
    if exact.is_empty():
        return ppl.C_Polyhedron(p, "empty")
    system = ppl.Generator_System()
    for g in exact.minimized_generators():
        entries = np.array([int(c) for c in g.coefficients()] + [0] * n, dtype=object)[:n]
        divisor = int(g.divisor()) if g.is_point() else 0
        moved = sum((int(c) * v for c, v in zip(M @ entries + t * divisor, x, strict=True)), 0 * x[-1])
        if g.is_point():
            system.insert(ppl.point(moved, divisor * scale))
        elif (M @ entries).any():
            system.insert(ppl.ray(moved) if g.is_ray() else ppl.line(moved))
    return ppl.C_Polyhedron(system)


def preimage_of(exact: ppl.C_Polyhedron, M: np.ndarray, t: np.ndarray) -> ppl.C_Polyhedron:
    """Preimage under integers, by constraints."""
    n, k = M.shape
    z = [ppl.Variable(j) for j in range(k)]
    system = ppl.Constraint_System()
    system.insert(0 * z[-1] <= 0)
    for row in exact.minimized_constraints():
        entries = np.array([int(c) for c in row.coefficients()] + [0] * n, dtype=object)[:n]
        form = sum((int(c) * v for c, v in zip(entries @ M, z, strict=True)), 0 * z[-1])
        form = form + int(entries @ t) + int(row.inhomogeneous_term())
        system.insert(form == 0 if row.is_equality() else form >= 0)
    return ppl.C_Polyhedron(system)


def total_of(P: ppl.C_Polyhedron, Q: ppl.C_Polyhedron) -> ppl.C_Polyhedron:
    """Minkowski sum."""
    n, both = P.space_dimension(), ppl.C_Polyhedron(P)
    both.concatenate_assign(Q)
    eye = np.eye(n, dtype=int)
    return mapped(both, np.hstack([eye, eye]), np.zeros(n, dtype=int))


def eroded(P: ppl.C_Polyhedron, Q: ppl.C_Polyhedron) -> ppl.C_Polyhedron:
    """Pontryagin difference: every constraint moved inward by the exact support of Q."""
    n = P.space_dimension()
    if Q.is_empty():
        return ppl.C_Polyhedron(n, "universe")
    x = [ppl.Variable(j) for j in range(n)]
    system = ppl.Constraint_System()
    system.insert(0 * x[-1] <= 0)
    for row in P.minimized_constraints():
        entries = ([int(c) for c in row.coefficients()] + [0] * n)[:n]
        for sign in (1, -1) if row.is_equality() else (1,):
            form = sum((sign * c * v for c, v in zip(entries, x, strict=True)), 0 * x[-1])
            lowest = Q.minimize(form)
            if not lowest["bounded"]:
                return ppl.C_Polyhedron(n, "empty")
            constant = sign * int(row.inhomogeneous_term())
            system.insert(int(lowest["inf_d"]) * (form + constant) + int(lowest["inf_n"]) >= 0)
    return ppl.C_Polyhedron(system)

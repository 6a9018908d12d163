"""Sets of generators in integers by rows in floats: exact where they are floats, up to a factor, and else outward.

A row whose integers are floats stays what it is.  Any other becomes a half-space that holds all generators, near the
exact one (see `OutwardNormals`); an equality becomes two.  Where the set is thin, but not flat, its facets in integers
meet at angles below rounding, so that floats near them would bound another set; it is held in a slab instead, cut by
the facets of its shadow along the slab.
"""

import numpy as np
from flint import fmpq_mat, fmpz_mat

from polytopes.checks import Floats
from polytopes.double_description import Integers, null_space, primitive
from polytopes.hull import spread_with
from polytopes.integers import are_floats, as_floats, floats_of_directions, floats_of_points, integer_rows
from polytopes.minkowski_weyl import ExactGenerators, ExactRows, rows_of, shadow, stacked
from polytopes.outward_normals import OutwardNormals
from polytopes.rows import Table


def are_exact(rows: ExactRows) -> bool:
    """Whether `float_rows` rounds none of the minimal rows of a set."""
    return all(map(are_floats, [*_short_basis(rows.equalities), *rows.inequalities.tolist()]))


def float_rows(generators: ExactGenerators, rows: ExactRows | None = None) -> Table:
    """Rows A, b, C, d of a set that contains a nonempty one, and is the same where its rows are floats.

    Raises
    ------
    UndecidedError
        At the limit of the double description.
    """
    rows = rows_of(generators) if rows is None else rows
    equalities = _short_basis(rows.equalities)
    if not all(are_floats(row[:-1]) for row in [*equalities, *rows.inequalities.tolist()]):
        directions = floats_of_directions(stacked(generators.rays, generators.lines))
        across = spread_with(floats_of_points(generators.vertices), directions).across
        if generators.dim - len(across) < generators.affine_dim:
            return _slab(generators, across)
    return _near_rows(generators, rows.inequalities, equalities)


def _near_rows(generators: ExactGenerators, inequalities: Integers, equalities: list[list[int]]) -> Table:
    """Exact rows where they are floats, and outward ones elsewhere."""
    lines = null_space(stacked(inequalities, *(np.array([row], dtype=object) for row in equalities))[:, :-1])[0]
    whole = ExactGenerators(generators.vertices, generators.rays, lines)  # rays may hold lines, as r and -r
    along, flat = _along(inequalities[:, :-1], equalities), all(map(are_floats, equalities))
    normals = OutwardNormals(whole, along)
    exact = [as_floats(row, row[:-1]) for row in equalities if are_floats(row)]
    sides = [[sign * v for v in row[:-1]] for row in equalities if not are_floats(row) for sign in (1, -1)]
    rows = [
        as_floats(row, row[:-1]) if flat and are_floats(row) else normals.row(normal)
        for row, normal in zip(inequalities.tolist(), along, strict=True)
    ]
    return _table(rows + [normals.row(side) for side in sides], exact, generators.dim)


def _along(normals: Integers, equalities: list[list[int]]) -> list[list[int]]:
    """The parts of normals along the subspace of equalities.

    A normal may have any multiple of an equality's in it, even be nearly parallel to it, and then rounding is all that
    is left of its own.
    """
    if not equalities:
        return list(normals.tolist())
    table, m, n = [row[:-1] for row in equalities], len(normals), normals.shape[1]
    C, N = fmpz_mat(table), fmpz_mat(m, n, normals.ravel().tolist())
    across, denominator = (fmpq_mat(C * C.transpose()).inv() * fmpq_mat(C * N.transpose())).numer_denom()
    parts = denominator * N - across.transpose() * C
    whole = np.array([int(v) for v in parts.entries()], dtype=object).reshape(m, n)
    return list(primitive(whole).tolist())


def _table(inequalities: list[Floats], equalities: list[Floats], n: int) -> Table:
    A, C = (np.array(part).reshape(-1, n + 1) for part in (inequalities, equalities))
    return A[:, :-1], A[:, -1], C[:, :-1], C[:, -1]


def _short_basis(rows: Integers) -> list[list[int]]:
    """The same span by rows that are floats where that is easy: the given ones, else those of a reduced lattice."""
    given: list[list[int]] = rows.tolist()
    if all(are_floats(row) for row in given):
        return given
    reduced = fmpz_mat(len(given), len(given[0]), [v for row in given for v in row]).lll()
    return [[int(reduced[i, j]) for j in range(len(given[0]))] for i in range(len(given))]


def _slab(generators: ExactGenerators, across: Floats) -> Table:
    """The rows of the shadow along some coordinates, and two for each normal (q, n) of a subspace it nearly lies in."""
    n = generators.dim
    kept = _other_coordinates(across)
    A, b, C, d = float_rows(shadow(generators, kept))
    facets, fixed = np.zeros((len(A), n)), np.zeros((len(C), n))
    facets[:, kept], fixed[:, kept] = A, C
    normals = OutwardNormals(generators, integer_rows(facets).tolist())
    sides = [normals.row(side) for row in integer_rows(across).tolist() for side in (row, [-v for v in row])]
    slab, _, _, _ = _table(sides, [], n)
    return np.vstack([facets, slab]), np.append(b, [side[-1] for side in sides]), fixed, d


def _other_coordinates(across: Floats) -> list[int]:
    """Coordinates that fix the others in the subspace with normals (q, n), by pivots of largest size."""
    work, solved = across.copy(), []
    for i in range(len(work)):
        j = int(np.abs(work[i]).argmax())
        solved.append(j)
        work[i + 1 :] -= np.outer(work[i + 1 :, j] / work[i, j], work[i])
    return [j for j in range(across.shape[1]) if j not in solved]


def nearest_floats(rows: ExactRows) -> Table:
    """Rows A, b, C, d to the nearest floats."""
    inequalities = [as_floats(row, row[:-1]) for row in rows.inequalities.tolist()]
    equalities = [as_floats(row, row[:-1]) for row in rows.equalities.tolist()]
    return _table(inequalities, equalities, rows.inequalities.shape[1] - 1)

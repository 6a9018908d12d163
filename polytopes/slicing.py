"""Slices and cylinders: some coordinates of a set fixed, or new ones left free."""

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from polytopes.exact_sides import exact_forms, with_sides
from polytopes.fractions_given import hold_fractions
from polytopes.rows import Rows, Table


def slice_at(P: Rows, fixed: Mapping[int, float | Fraction]) -> Table:
    """Rows of ``{x_rest : x in P, x_j = v_j}`` in the other coordinates, in their order: ``A_rest x <= b - A_fixed v``.

    Nothing is projected; right-hand sides that are no floats are rounded up.
    """
    coordinates, given = list(fixed), list(fixed.values())
    some = hold_fractions(given)
    values = [Fraction(v) for v in given] if some else np.array(given, dtype=np.float64)
    rest = [j for j in range(P.dim) if j not in fixed]
    taken = exact_forms(np.vstack([P.A, P.C])[:, coordinates], values)
    sides = [Fraction(v) - part for v, part in zip([*P.b.tolist(), *P.d.tolist()], taken, strict=True)]
    return with_sides(P.A[:, rest], sides[: P.b.size], P.C[:, rest], sides[P.b.size :])


def lifted(P: Rows, n: int, coordinates: Sequence[int]) -> Table:
    """Rows of the cylinder ``{x in R^n : x_coordinates in P}``, nothing rounded."""
    A, C = np.zeros((P.b.size, n)), np.zeros((P.d.size, n))
    A[:, coordinates], C[:, coordinates] = P.A, P.C
    return A, P.b, C, P.d

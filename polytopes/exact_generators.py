"""Which sets are computed with in integers, and their generators.

Short rows, of few bits, come out as floats again.  Longer ones, such as decimals, cost more and are rounded outward in
the end, so they are taken only where floats cannot decide: flat, thin and unbounded sets.
"""

import numpy as np

from polytopes.errors import UndecidedError
from polytopes.general_position import WIDE
from polytopes.integers import Floats, integer_rows
from polytopes.linear_program import Program
from polytopes.minkowski_weyl import ExactGenerators, ExactRows, generators_of
from polytopes.short_sets import SHORT_RAYS

LONG_RAYS = 500
"""The same for longer rows."""
_FEW_RAYS = 200
_LONG_ROWS = 100
_COORDINATES = 16


def exact_generators(
    A: Floats, b: Floats, C: Floats, d: Floats, short: bool, program: Program, known: ExactGenerators | None = None
) -> ExactGenerators | None:
    """Generators of a set ``{x : A x <= b, C x = d}`` in integers, `known` or not; None where it is left to floats."""
    if A.shape[1] > _COORDINATES:
        return None
    if not short and (b.size + d.size > _LONG_ROWS or wide(program)):
        return None
    if known is not None:
        return known
    try:
        return generators_of(integer_form(A, b, C, d), SHORT_RAYS if short else LONG_RAYS)
    except UndecidedError:
        return None


def few_generators(A: Floats, b: Floats, C: Floats, d: Floats, short: bool, program: Program) -> ExactGenerators | None:
    """The same, if there are at most 200; without a program for a set that is not flat or thin."""
    if A.shape[1] > _COORDINATES or b.size + d.size > _LONG_ROWS:
        return None
    if not short and program.fat and not program.flat.pivots:
        return None
    try:
        return generators_of(integer_form(A, b, C, d), _FEW_RAYS)
    except UndecidedError:
        return None


def integer_form(A: Floats, b: Floats, C: Floats, d: Floats) -> ExactRows:
    """Rows ``A x <= b``, ``C x = d`` as primitive integers."""
    return ExactRows(integer_rows(np.hstack([A, b[:, None]])), integer_rows(np.hstack([C, d[:, None]])))


def wide(program: Program) -> bool:
    """Whether floats know the set well: full-dimensional, wide against their rounding, bounded."""
    axes = np.eye(program.flat.dim)
    if program.flat.pivots or not program.fat or program.interior.radius <= WIDE * program.size:
        return False
    return bool(np.isfinite(program.maximise(np.vstack([axes, -axes])).values).all())

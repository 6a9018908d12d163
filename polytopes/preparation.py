"""Rows made ready for linear programs: equalities eliminated, constant rows set aside, the others in even units.

The units are powers of two, so that no unit of the user changes what a solver sees.
"""

import numpy as np

from polytopes import kernel
from polytopes.affine import affine_set
from polytopes.checks import Floats
from polytopes.exact_units import EvenRows
from polytopes.linear_program import Program
from polytopes.rounding import check_rounding

_FARTHEST = 1e150  # distance of a hyperplane from the origin; the squares of coordinates beyond are no floats


def prepare(A: Floats, b: Floats, C: Floats, d: Floats) -> Program:
    """Eliminate the equalities, set constant rows aside and put the others into even units.

    Parameters
    ----------
    A, b, C, d : arrays (m, n), (m,), (q, n), (q,)

    Raises
    ------
    ValueError
        If a hyperplane is too far from the origin, or units that even out the rows leave numbers that are no floats.
    """
    check_rounding()
    units = None
    if d.size:
        row_units, units = kernel.exponents(np.vstack([A, C]), np.append(b, d))
    flat = affine_set(C, d, units=units)
    rows, rhs = flat.restrict(A, b)
    AT, even, norms, row_powers, powers, kept, far, lost = kernel.scaled(rows, rhs)
    _refuse_extremes(A, b, far, lost)
    violated = None
    if kept.size < b.size:
        constant = np.setdiff1d(np.arange(b.size), kept)
        violated = next((int(i) for i in constant if rhs[i] < 0.0), None)
    if units is None:
        units, row_units = powers, row_powers
        if kept.size < b.size:
            row_units = -np.frexp(b)[1].astype(np.int64)
            row_units[kept] = row_powers
    exact = EvenRows(A, b, flat, row_units[: b.size], units)
    return Program(A, b, flat, exact, AT, even, norms, row_powers, powers, kept, violated)


def prepare_as_given(A: Floats, b: Floats) -> Program:
    """Rows whose coordinates are good as they are; only the rows are scaled."""
    flat = affine_set(np.empty((0, A.shape[1])), np.empty(0))
    lengths = np.linalg.norm(A, axis=1)
    kept = np.flatnonzero(lengths)
    row_powers, powers = -np.frexp(lengths)[1].astype(np.int64), np.zeros(A.shape[1], np.int64)
    AT, even = np.ldexp(A[kept], row_powers[kept, None]).T, np.ldexp(b[kept], row_powers[kept])
    norms = np.ldexp(lengths[kept], row_powers[kept])
    violated = next((int(i) for i in np.flatnonzero(lengths == 0.0) if b[i] < 0.0), None)
    exact = EvenRows(A, b, flat, row_powers, powers)
    return Program(A, b, flat, exact, np.ascontiguousarray(AT), even, norms, row_powers[kept], powers, kept, violated)


def _refuse_extremes(A: Floats, b: Floats, far: int, lost: int) -> None:
    if far >= 0:
        raise ValueError(
            f"row {far} of A bounds {A[far].tolist()} x by {b[far]:.3g}, more than {_FARTHEST:g} from the origin; "
            f"expected at most {_FARTHEST:g}. Use other units, or leave out a row that is not to bound."
        )
    if lost >= 0:
        raise ValueError(
            f"row {lost} of A, {A[lost].tolist()}, has entries of so different sizes that no units make floats of them "
            "all. Leave out entries that do not matter."
        )

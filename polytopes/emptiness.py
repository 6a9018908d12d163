"""Is a set of rows empty?  Three answers: a point, a proof, or a reason why neither was found."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from polytopes.certificate import Certificate, HasRows, complete_certificate, exact_certificate
from polytopes.exact import to_floats
from polytopes.exact_simplex import affordable, exact_feasibility
from polytopes.linear_program import Program

Floats = NDArray[np.float64]
_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Emptiness:
    """Answer to "is the set empty?".

    Attributes
    ----------
    status : {"nonempty", "empty", "undecided"}
    witness : array (n,) or None
        With "nonempty": a point of the set, rounded to floats (the exact point satisfies every row exactly).
    certificate : Certificate or None
        With "empty": exact multipliers that prove it.
    reason : str
        How the answer was found, or why there is none.
    """

    status: Literal["nonempty", "empty", "undecided"]
    witness: Floats | None
    certificate: Certificate | None
    reason: str


def decide_emptiness(P: HasRows, program: Program) -> Emptiness:
    """Decide emptiness of the rows of P, exactly on the floats they are.

    A float solution settles clear cases: a point whose slacks exceed their rounding error, or multipliers that can be
    completed to an exact certificate.  Flat and nearly empty sets go to the rational simplex.

    Parameters
    ----------
    P : object with rows
    program : Program
        The same rows, prepared.
    """
    if program.flat.contradiction is not None:
        return _empty(P, Certificate({}, program.flat.contradiction), "the equalities contradict each other")
    if program.violated is not None:
        certificate = exact_certificate(P, np.eye(1, P.b.size, program.violated)[0])
        if certificate is not None:
            return _empty(P, certificate, f"row {program.violated} fails wherever the equalities hold")
    interior = program.interior
    if _strictly_inside(P, interior.point):
        return Emptiness("nonempty", interior.point, None, "a point with slack beyond rounding")
    if interior.radius < 0.0 or not interior.reliable:
        certificate = exact_certificate(P, interior.multipliers)
        if certificate is not None:
            return _empty(P, certificate, "multipliers of the largest ball, completed exactly")
    if not affordable(*P.A.shape):
        return Emptiness("undecided", None, None, _too_close(P, interior.radius))
    return _decide_exactly(P, program)


def _strictly_inside(P: HasRows, x: Floats) -> bool:
    """Whether floats prove ``A x < b`` (no equalities): every slack exceeds the rounding error of its computation."""
    if P.C.shape[0] or not np.isfinite(x).all():
        return False
    slack = P.b - P.A @ x
    error = (x.size + 3) * _EPS * (np.abs(P.A) @ np.abs(x) + np.abs(P.b))
    true_by_itself = ~P.A.any(axis=1) & (P.b >= 0)
    return bool(((slack > error) | true_by_itself).all())


def _decide_exactly(P: HasRows, program: Program) -> Emptiness:
    outcome = exact_feasibility(P.A, P.b, program.flat, program.interior.point)
    if outcome.status == "reached":
        return Emptiness("nonempty", to_floats(outcome.point), None, "a point found in rational arithmetic")
    if outcome.status == "optimal":
        return _empty(P, complete_certificate(P, outcome.multipliers), "rational simplex")
    return Emptiness("undecided", None, None, "the rational simplex reached its pivot limit")


def _empty(P: HasRows, certificate: Certificate, reason: str) -> Emptiness:
    if certificate.verify(P):
        return Emptiness("empty", None, certificate, reason)
    return Emptiness("undecided", None, None, f"a certificate ({reason}) did not check in exact arithmetic")


def _too_close(P: HasRows, radius: float) -> str:
    return (
        f"largest ball of radius {radius:.2g} is too small for floats to decide, and {P.A.shape[0]} rows in "
        f"{P.A.shape[1]} variables are too many for rational arithmetic"
    )

"""Is a set of rows empty?  Three answers: a point, a proof, or a reason why neither was found.

Floats propose, exact arithmetic disposes: a point counts if its slacks exceed what was rounded, multipliers if they can
be completed to exact ones.  Multipliers that combine the rows to ``0 <= 0`` show rows that hold with equality all over
the set; made explicit, they leave a smaller question (facial reduction, Borwein and Wolkowicz 1981).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from flint import fmpq

from polytopes import kernel
from polytopes.certificate import Certificate, HasRows, complete_certificate, exact_combination
from polytopes.checks import Floats
from polytopes.exact import ZERO, Multipliers, combine, to_floats
from polytopes.linear_program import Program
from polytopes.preparation import prepare
from polytopes.shown import Shown


@dataclass(frozen=True, eq=False)
class Emptiness(Shown):
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

    def __post_init__(self) -> None:
        if self.witness is not None:  # the set keeps this answer, and may go on from that point
            witness = self.witness.copy()
            witness.setflags(write=False)
            object.__setattr__(self, "witness", witness)


@dataclass(frozen=True, eq=False)
class _Face:
    """The rows of a set with some of its inequalities as equalities, the last ones."""

    A: Floats
    b: Floats
    C: Floats
    d: Floats


def decide_emptiness(P: HasRows, program: Program) -> Emptiness:
    """Decide emptiness of the rows of P, exactly on the floats they are.

    A float solution settles clear cases: a point whose slacks exceed their rounding error, or multipliers that can be
    completed to an exact certificate.  What is flat is decided on its affine hull, what is thinner than rounding by the
    rational simplex, up to its size (see `affordable`) and its limit of pivots.

    Parameters
    ----------
    P : object with rows
    program : Program
        The same rows, prepared.
    """
    if program.flat.contradiction is not None:
        return _empty(P, Certificate({}, program.flat.contradiction), "the equalities contradict each other")
    if program.violated is not None:
        proof = exact_combination(P, np.eye(1, P.b.size, program.violated)[0], program.exact.rows)
        if proof is not None and combined_value(P, proof) < 0:
            return _empty(P, proof, f"row {program.violated} fails wherever the equalities hold")
    interior = program.interior
    if strictly_inside(program, interior.centre):
        return Emptiness("nonempty", interior.point, None, "a point with slack beyond rounding")
    combination = float_combination(P, program)
    if combination is not None:
        value = combined_value(P, combination)
        if value < 0:
            return _empty(P, combination, "multipliers of the largest ball, completed exactly")
        if value == 0:
            return _decide_on_face(P, combination)
    if not program.exact.affordable:
        return Emptiness("undecided", None, None, _too_close(P, interior.radius))
    return _decide_exactly(P, program)


def strictly_inside(program: Program, z: Floats) -> bool:
    """Whether floats prove that a point z (free,) in the units of a program satisfies every row strictly.

    Every slack must exceed the rounding error of its computation and of the elimination of equalities; rows that are
    constant on the affine set are checked already.
    """
    if program.violated is not None:
        return False
    return kernel.strictly_inside(program.AT, program.rhs, z, program.errors if program.flat.pivots else None)


def float_combination(P: HasRows, program: Program) -> Certificate | None:
    """Exact multipliers with ``lambda'A + mu'C = 0``, lambda >= 0, near those of the largest ball; None if none are."""
    if program.interior.radius > 0.0 and program.interior.reliable and not program.thin:
        return None
    weights, powers = np.zeros(P.b.size), np.zeros(P.b.size, np.int64)
    weights[program.kept], powers[program.kept] = program.interior.multipliers, program.row_powers
    return exact_combination(P, weights, powers)


def combined_value(P: HasRows, combination: Certificate) -> fmpq:
    """``lambda'b + mu'd``, exactly."""
    return combine(P.A, P.b, combination.inequality)[1] + combine(P.C, P.d, combination.equality)[1]


def _decide_on_face(P: HasRows, combination: Certificate) -> Emptiness:
    """Decide with the rows of a combination to ``0 <= 0`` as equalities, which they are all over the set."""
    fixed = sorted(combination.inequality)
    others = np.setdiff1d(np.arange(P.b.size), fixed)
    face = _Face(P.A[others], P.b[others], np.vstack([P.C, P.A[fixed]]), np.append(P.d, P.b[fixed]))
    answer = decide_emptiness(face, prepare(face.A, face.b, face.C, face.d))
    if answer.certificate is None:
        return Emptiness(answer.status, answer.witness, None, f"{answer.reason}, where rows {fixed} hold with equality")
    inequality: Multipliers = {int(others[i]): v for i, v in answer.certificate.inequality.items()}
    equality = {k: v for k, v in answer.certificate.equality.items() if k < P.d.size}
    signed = {i: answer.certificate.equality.get(P.d.size + k, ZERO) for k, i in enumerate(fixed)}
    times = max(max(-v / combination.inequality[i] for i, v in signed.items()), ZERO)
    for i, v in signed.items():
        inequality[i] = v + times * combination.inequality[i]
    for k, v in combination.equality.items():
        equality[k] = equality.get(k, ZERO) + times * v
    proof = Certificate({i: v for i, v in inequality.items() if v != 0}, {k: v for k, v in equality.items() if v != 0})
    return _empty(P, proof, f"{answer.reason}, where rows {fixed} hold with equality")


def _decide_exactly(P: HasRows, program: Program) -> Emptiness:
    outcome = program.exact.feasible(program.interior.point)
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
        f"largest ball of radius {radius:.2g}, in even units, is too small for floats to decide, and {P.A.shape[0]} "
        f"rows in {P.A.shape[1]} variables are too many for rational arithmetic"
    )

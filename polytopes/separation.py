"""Do two sets meet?  A common point, or a hyperplane between them (Minkowski 1911), checked in rationals.

Multipliers that prove ``A_P x <= b_P``, ``A_Q x <= b_Q`` to have no solution fall into two parts (Farkas' lemma): with
``a = A_P'y_P = -A_Q'y_Q``, ``a'x <= y_P'b_P`` on P and ``a'x >= -y_Q'b_Q > y_P'b_P`` on Q; equalities alike.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from polytopes.answers import Answer
from polytopes.certificate import Certificate
from polytopes.checks import Floats
from polytopes.errors import UndecidedError
from polytopes.exact import Multipliers, combine
from polytopes.intersection import rows_in_common
from polytopes.rows import Rows, a_set, same_space
from polytopes.shown import Shown

_EXACT = 2**53  # integers up to here are floats


@dataclass(frozen=True)
class SeparatingPlane(Shown):
    """``normal'x <= below`` on one set and ``normal'x >= above`` on the other, with ``below < above``; exact.

    Attributes
    ----------
    exact_normal : tuple of n Fraction
    below, above : Fraction
    """

    exact_normal: tuple[Fraction, ...]
    below: Fraction
    above: Fraction

    @property
    def normal(self) -> Floats:
        """The normal (n,) in floats: exact where it is a multiple of integers below 2^53, else rounded."""
        return np.array([float(v * self._factor) for v in self.exact_normal])

    @property
    def offset(self) -> float:
        """The middle between the sets along `normal`, rounded."""
        return float((self.below + self.above) / 2 * self._factor)

    @property
    def _factor(self) -> Fraction:
        denominator = lcm(*(v.denominator for v in self.exact_normal))
        divisor = gcd(*(int(v * denominator) for v in self.exact_normal))
        largest = max(abs(v) for v in self.exact_normal)
        factor = Fraction(denominator, divisor)
        return factor if largest * factor <= _EXACT else 1 / largest


@dataclass(frozen=True, eq=False)
class Intersects(Answer):
    """Whether two sets have a common point; true or false in an ``if``.

    Attributes
    ----------
    holds : bool
    point : array (n,) or None
        A common point, rounded to floats, where they meet.
    plane : SeparatingPlane or None
        Where they do not: what is between them; None if one of them is empty.
    certificate : Certificate or None
        The exact multipliers behind it, for the rows of the intersection.
    """

    point: Floats | None = None
    plane: SeparatingPlane | None = None
    certificate: Certificate | None = None

    def verify(self, P: Rows, Q: Rows) -> bool:
        """Whether multipliers prove, in rationals, that P and Q have no common point, and the plane is theirs."""
        both = rows_in_common(a_set(P, "P"), same_space(P, Q))
        if self.certificate is None or not self.certificate.verify(both):
            return False
        return self.plane == _plane(P, Q, self.certificate)


def intersects(P: Rows, Q: Rows) -> Intersects:
    """Whether P and Q have a common point, decided exactly.

    Raises
    ------
    UndecidedError
        If emptiness of the intersection could not be decided.
    """
    both = rows_in_common(P, Q)
    point = both.point_at_once
    if point is not None:
        return Intersects(True, point)
    answer = both.decided
    if answer.status == "nonempty":
        return Intersects(True, answer.witness)
    if answer.certificate is None:
        raise UndecidedError(f"cannot tell whether the sets meet: {answer.reason}")
    return Intersects(False, None, _plane(P, Q, answer.certificate), answer.certificate)


def _plane(P: Rows, Q: Rows, proof: Certificate) -> SeparatingPlane | None:
    """The part of a proof that the rows of P have in it; None if their forms vanish: then one set alone is empty."""
    of_p = {i: v for i, v in proof.inequality.items() if i < P.b.size}
    fixed = {k: v for k, v in proof.equality.items() if k < P.d.size}
    form, below = _combined(P, of_p, fixed)
    if not any(form):
        return None
    of_q = {i - P.b.size: v for i, v in proof.inequality.items() if i >= P.b.size}
    rest = {k - P.d.size: v for k, v in proof.equality.items() if k >= P.d.size}
    return SeparatingPlane(form, below, -_combined(Q, of_q, rest)[1])


def _combined(P: Rows, inequality: Multipliers, equality: Multipliers) -> tuple[tuple[Fraction, ...], Fraction]:
    """What multipliers combine the rows of one set to: ``a'x <= bound``."""
    (rows, bound), (fixed, value) = combine(P.A, P.b, inequality), combine(P.C, P.d, equality)
    exact = [u + v for u, v in zip([*rows, bound], [*fixed, value], strict=True)]
    *form, total = (Fraction(int(v.p), int(v.q)) for v in exact)
    return tuple(form), total

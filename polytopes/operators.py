"""Operators of sets, each a short name of a method."""

from __future__ import annotations

from functools import reduce
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from polytopes.checks import real_array, whole_number
from polytopes.constructions import Constructions
from polytopes.fractions_given import exact_vector, hold_fractions
from polytopes.inclusion import broken_row, has_exact_point, has_point
from polytopes.kept_vertices import moved
from polytopes.rows import Rows, same_space


class Operators(Constructions):
    """Sets with operators.  Arrays, dense and sparse, leave them to the set."""

    __array_ufunc__ = None  # numpy asks the set, instead of going over it as an array of objects
    __pandas_priority__ = 5000  # and so does pandas
    __hash__ = None  # type: ignore[assignment]  # one set has many rows, so no hash of them agrees with ==

    def __and__(self, Q: Rows) -> Self:
        return self.intersection(Q) if isinstance(Q, Rows) else NotImplemented

    def __add__(self, other: Rows | ArrayLike) -> Self:
        return self.minkowski_sum(other) if isinstance(other, Rows) else self.translate(other)

    def __radd__(self, t: ArrayLike) -> Self:
        return self.translate(t)

    def __sub__(self, other: Rows | ArrayLike) -> Self:
        if isinstance(other, Rows):
            return self.pontryagin_difference(other)
        if hold_fractions(other):
            return self.translate([-v for v in exact_vector("t", other, self.dim)])
        return self.translate(-real_array("t", other, (self.dim,)))

    def __rmatmul__(self, M: ArrayLike) -> Self:
        return self.affine_map(M)

    def __matmul__(self, M: ArrayLike) -> Self:
        raise TypeError("P @ M is not defined: M @ P is an image, P.preimage(M) what M takes into the set.")

    def __neg__(self) -> Self:
        return moved(
            self, type(self)(0.0 - self.A, self.b, 0.0 - self.C, self.d), -np.eye(self.dim), np.zeros(self.dim)
        )

    def __mul__(self, s: float) -> Self:
        return NotImplemented if isinstance(s, Rows) else self.scale(s)

    __rmul__ = __mul__

    def __pow__(self, k: int) -> Self:
        times = whole_number("k", k, least=1)
        return reduce(lambda P, Q: P.product(Q), [self] * times)

    def __contains__(self, x: Any) -> bool:
        if isinstance(x, Rows):
            raise TypeError("x is a set; expected a point (n,). Q <= P says whether a set lies in P.")
        if not hold_fractions(x):
            return has_point(self, real_array("x", x, (self.dim,)))
        return has_exact_point(self, exact_vector("x", x, self.dim))

    def __le__(self, Q: Rows) -> bool:
        return broken_row(same_space(self, Q), self) is None if isinstance(Q, Rows) else NotImplemented

    def __ge__(self, Q: Rows) -> bool:
        return broken_row(self, same_space(self, Q)) is None if isinstance(Q, Rows) else NotImplemented

    def __eq__(self, Q: object) -> bool:
        if not isinstance(Q, Rows):
            return NotImplemented
        return self is Q or (self.dim == Q.dim and broken_row(self, Q) is None and broken_row(Q, self) is None)

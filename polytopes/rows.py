"""The rows of an H-polytope: validated once, read-only, with what is derived from them kept beside them."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from polytopes.box import Box, both_ways
from polytopes.checks import Floats, real_array
from polytopes.derived import derived
from polytopes.emptiness import Emptiness, decide_emptiness
from polytopes.exact_generators import exact_generators, wide
from polytopes.fractions_given import hold_fractions, rows_of_floats
from polytopes.general_position import listed_vertices
from polytopes.integers import is_short
from polytopes.lengths import evened, lengths
from polytopes.linear_program import Program
from polytopes.minkowski_weyl import ExactGenerators
from polytopes.native import Address, InCore, Integer, arrays, function
from polytopes.preparation import prepare
from polytopes.prepared import PreparedRows
from polytopes.short_sets import Corners, has_short_rows, short_vertices
from polytopes.value import Value

_FLOAT = np.dtype(np.float64)
_NOT_FINITE, _, _ONE_ENTRY_A_ROW = range(3)  # what rows are at a look
_look = function("fdi_look", *[Integer] * 2, *[Address] * 2, returns=Integer)
Table = tuple[Floats, Floats, Floats, Floats]
"""Rows A, b, C, d: what the operations hand to the constructor of a set."""


@dataclass(frozen=True, eq=False, repr=False)
class Rows(Value):
    """``{x : A x <= b, C x = d}`` as read-only float arrays.

    Parameters
    ----------
    A, b : array_like (m, n) and (m,)
        A and C may be sparse; a row whose b is +inf bounds nothing and is left out.  Fractions are taken exactly.
    C, d : array_like (q, n) and (q,), optional
        Explicit equalities.

    Raises
    ------
    TypeError, ValueError
        If an array is not numeric and finite, or a shape does not fit.
    """

    A: Floats
    b: Floats
    C: Floats
    d: Floats
    in_core: InCore = field(init=False, repr=False)

    def __init__(self, A: ArrayLike, b: ArrayLike, C: ArrayLike | None = None, d: ArrayLike | None = None) -> None:
        rows = _as_they_are(A, b, C, d)
        seen = _NOT_FINITE if rows is None else _look(*rows)
        if rows is None or seen == _NOT_FINITE:
            A, b, fixed, values = _checked(A, b, C, d)
            rows = A.shape[1], b.size, A.tobytes(), b.tobytes()
            seen = _look(*rows)
        else:
            fixed, values = no_equalities(rows[0])
        self._keep(rows, fixed, values)
        self.__dict__["one_entry_a_row"] = seen == _ONE_ENTRY_A_ROW

    def _keep(self, rows: InCore, C: Floats, d: Floats) -> None:
        own = self.__dict__
        own["in_core"], own["C"], own["d"] = rows, C, d

    @classmethod
    def from_core(cls, rows: InCore) -> Self:
        """The set of rows of finite numbers that other sets have, without equalities."""
        made = cls.__new__(cls)
        made._keep(rows, *no_equalities(rows[0]))
        return made

    if not TYPE_CHECKING:  # to a type checker they are fields as any

        def __getattr__(self, name: str) -> Any:
            """A and b, made of what the core has when they are first asked for."""
            if name not in ("A", "b"):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self)
            own = self.__dict__
            own["A"], own["b"] = arrays(self.in_core)
            return own[name]

        def __dir__(self) -> list[str]:
            return [*super().__dir__(), "A", "b"]

    def __reduce__(self) -> tuple[type[Self], Table]:
        return type(self), self.table  # what is derived from them is derived again

    @property
    def table(self) -> Table:
        """The rows A, b, C, d."""
        return self.A, self.b, self.C, self.d

    @property
    def dim(self) -> int:
        """Dimension n of the space."""
        return self.in_core[0]

    @derived
    def one_entry_a_row(self) -> bool:
        """Whether no row of A has more than one entry."""
        return bool(_look(*self.in_core) == _ONE_ENTRY_A_ROW)

    @derived
    def prepared(self) -> PreparedRows | None:
        """The rows prepared by the core, where it settles at once that a ball fits in."""
        return None if self.d.size else PreparedRows.of(self.in_core)

    @derived
    def program(self) -> Program:
        """The rows prepared for linear programs."""
        return prepare(*self.table) if self.prepared is None else self.prepared.program()

    @derived
    def as_box(self) -> Box | None:
        """The rows as a box, if they are one that is not empty."""
        return Box.of(self.in_core) if self.one_entry_a_row and not self.d.size else None

    @property
    def point_at_once(self) -> Floats | None:
        """A point (n,) of a box, or one that floats find with slack beyond rounding; None if it takes longer."""
        if self.as_box is not None:
            point = self.as_box.point
        elif self.prepared is not None:
            point = self.prepared.centre
        else:
            return None
        point.setflags(write=False)  # it is kept, as a witness
        return point

    @derived
    def decided(self) -> Emptiness:
        """Emptiness of the rows, decided once."""
        point = self.point_at_once
        if point is None:
            return decide_emptiness(self, self.program)
        how = "a point between the bounds of a box" if self.as_box else "a point with slack beyond rounding"
        return Emptiness("nonempty", point, None, how)

    @derived
    def even_inequalities(self) -> tuple[Floats, Floats, Floats]:
        """Rows A and b, each times a power of two that brings it near 1, and their lengths."""
        A, b = evened(self.A, self.b)
        return A, b, lengths(A)

    @derived
    def even_equalities(self) -> tuple[Floats, Floats, Floats]:
        """The same of C and d."""
        C, d = evened(self.C, self.d)
        return C, d, lengths(C)

    @derived
    def wide(self) -> bool:
        """Whether floats know the nonempty set well: full-dimensional, wide against their rounding, bounded."""
        if self.prepared is None:
            return wide(self.program)
        along = self.prepared.supports(both_ways(self.dim))
        return wide(self.program) if along is None else bool((along < np.inf).all())

    @derived
    def exact(self) -> ExactGenerators | None:
        """The generators in integers, where the set is computed with in integers; see `exact_generators`."""
        if self.prepared is not None and not self.short and self.wide:
            return None
        return exact_generators(*self.table, self.short, self.program, self.made_of)

    @derived
    def made_of(self) -> ExactGenerators | None:
        """The vertices, exactly, where the set was made from them; see `kept_vertices`."""
        find = self.__dict__.get("finds_vertices")
        return None if find is None else find()

    @derived
    def corners(self) -> Corners | None:
        """The vertices of a bounded full-dimensional set of short rows; see `short_sets`."""
        return short_vertices(self.in_core) if self.short and not self.d.size else None

    @derived
    def short(self) -> bool:
        """Whether all rows are of few bits."""
        return has_short_rows(self.in_core) and (not self.d.size or is_short(self.C, self.d))

    @derived
    def listed(self) -> Floats | None:
        """The vertices (k, n) of a bounded set that floats know well, and whose rows are not short."""
        return None if self.prepared is None or self.short else listed_vertices(self.prepared)

    def with_rows(self, A: ArrayLike, b: ArrayLike) -> Self:
        """The same equalities with other inequalities ``A x <= b``: A (m, n), b (m,)."""
        return type(self)(A, b, self.C, self.d)


def _as_they_are(A: Any, b: Any, C: Any, d: Any) -> InCore | None:
    """Copies of arrays of floats that fit, without equalities, as most sets have; anything else takes a closer look."""
    if type(A) is not np.ndarray or type(b) is not np.ndarray or not A.dtype == b.dtype == _FLOAT or A.ndim != 2:
        return None
    m, n = A.shape
    if b.shape != (m,) or n == 0 or not (C is d is None or _hold_nothing(C, d, n)):
        return None
    return n, m, A.tobytes(), b.tobytes()


def _hold_nothing(C: Any, d: Any, n: int) -> bool:
    """Whether equalities are arrays of none in R^n."""
    return type(C) is np.ndarray and type(d) is np.ndarray and C.shape == (0, n) and d.shape == (0,)


def _checked(A: ArrayLike, b: ArrayLike, C: ArrayLike | None, d: ArrayLike | None) -> Table:
    """What was given as arrays that fit, without the rows that bound nothing."""
    if hold_fractions(A, b):
        A, b = rows_of_floats("Ab", dense(A), b)
    if hold_fractions(C, d):
        C, d = rows_of_floats("Cd", dense(C), d)
    rows = real_array("A", dense(A), ("m", "n"))
    m, n = rows.shape
    if n == 0:
        raise ValueError(f"A has shape {rows.shape}; expected at least one column. Use shape (0, n) for no rows.")
    rhs = real_array("b", b, (m,), meaning="one entry per row of A", finite=False)
    if np.count_nonzero(np.isfinite(rhs)) < m:
        rows, rhs = _bounding(rows, rhs)
    if (C is None) != (d is None):
        raise ValueError("C and d must be given together: the equalities are C x = d.")
    if C is None or d is None:
        return rows, rhs, *no_equalities(n)
    fixed = real_array("C", dense(C), ("q", n), meaning="one column per column of A")
    values = real_array("d", d, (len(fixed),), meaning="one entry per row of C")
    fixed.setflags(write=False)
    values.setflags(write=False)
    return rows, rhs, fixed, values


@lru_cache(256)
def no_equalities(n: int) -> tuple[Floats, Floats]:
    """C and d of a set of R^n without equalities, read-only."""
    C, d = np.empty((0, n)), np.empty(0)
    C.setflags(write=False)
    d.setflags(write=False)
    return C, d


def dense(matrix: Any) -> Any:
    """A sparse matrix of SciPy as an array; anything else as it is."""
    return matrix.toarray() if hasattr(matrix, "toarray") else matrix


def _bounding(A: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The rows that bound something: those whose side is not +inf."""
    if np.isneginf(b).any():
        i = int(np.flatnonzero(np.isneginf(b))[0])
        raise ValueError(f"b[{i}] is -inf, which no point keeps; expected a number, or +inf. Use HPolytope.empty(n).")
    return A[np.isfinite(b)], b[np.isfinite(b)]


def nothing(n: int) -> Table:
    """Rows of the empty set of R^n, ``0'x <= -1``."""
    return np.zeros((1, n)), np.array([-1.0]), np.empty((0, n)), np.empty(0)


def everything(n: int) -> Table:
    """Rows of R^n: none."""
    return np.empty((0, n)), np.empty(0), np.empty((0, n)), np.empty(0)


def a_set(Q: Rows, name: str = "Q") -> Rows:
    """Q itself, if it is a set; TypeError with its name otherwise."""
    if not isinstance(Q, Rows):
        raise TypeError(f"{name} is a {type(Q).__name__}; expected an HPolytope.")
    return Q


def same_space(P: Rows, Q: Rows) -> Rows:
    """Q itself, if it is a set in the space of P; TypeError or ValueError otherwise."""
    if a_set(Q).dim != P.dim:
        raise ValueError(f"Q has dimension {Q.dim}; expected {P.dim}, the dimension of this set.")
    return Q

"""Results that hold a set between two others, or a set in another."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from polytopes.checks import Floats
from polytopes.rows import Rows
from polytopes.shown import Shown

Kind = TypeVar("Kind", bound=Rows)


@dataclass(frozen=True, eq=False)
class Bracketed(Shown, Generic[Kind]):
    """A set between two others.

    Attributes
    ----------
    inner, outer : HPolytope
        The inner one is the hull of points of the set, to rounding; the outer one contains it.
    gap : float
        How far the outer set reaches beyond a facet of the inner one, at most: a distance.
    """

    inner: Kind
    outer: Kind
    gap: float


@dataclass(frozen=True, eq=False)
class Copy(Shown, Generic[Kind]):
    """A copy ``centre + scale Q`` of a set.

    Attributes
    ----------
    set : HPolytope
    centre : array (n,)
    scale : float
    """

    set: Kind
    centre: Floats
    scale: float

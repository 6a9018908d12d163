"""Set algebra of polyhedra ``{x : A x <= b, C x = d}`` with certified emptiness.  Knows nothing of dynamics."""

from polytopes.certificate import Certificate
from polytopes.emptiness import Emptiness
from polytopes.errors import EmptySetError, UnboundedError, UndecidedError
from polytopes.hpolytope import HPolytope
from polytopes.linear_program import warm_up
from polytopes.support import Ball, SupportResult

__all__ = [
    "Ball",
    "Certificate",
    "Emptiness",
    "EmptySetError",
    "HPolytope",
    "SupportResult",
    "UnboundedError",
    "UndecidedError",
    "warm_up",
]

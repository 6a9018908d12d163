"""Set algebra of polyhedra ``{x : A x <= b, C x = d}`` with certified emptiness.  Knows nothing of dynamics."""

from polytopes.certificate import Certificate
from polytopes.containment import Containment
from polytopes.distance import Distance
from polytopes.ellipsoids import Ellipsoid
from polytopes.emptiness import Emptiness
from polytopes.errors import EmptySetError, ProjectionLimitError, UnboundedError, UndecidedError
from polytopes.generators import Generators
from polytopes.hpolytope import HPolytope
from polytopes.incidence import Incidence
from polytopes.linear_program import warm_up
from polytopes.piecewise import Union
from polytopes.rays import Chord
from polytopes.redundancy import KeptRows
from polytopes.separation import Intersects, SeparatingPlane
from polytopes.support import Ball, SupportResult
from polytopes.unions import convex_hull, union_bounds

__all__ = [
    "Ball",
    "Certificate",
    "Chord",
    "Containment",
    "Distance",
    "Ellipsoid",
    "Emptiness",
    "EmptySetError",
    "Generators",
    "HPolytope",
    "Incidence",
    "Intersects",
    "KeptRows",
    "ProjectionLimitError",
    "SeparatingPlane",
    "SupportResult",
    "UnboundedError",
    "UndecidedError",
    "Union",
    "convex_hull",
    "union_bounds",
    "warm_up",
]

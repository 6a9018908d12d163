"""Set algebra of polyhedra ``{x : A x <= b, C x = d}`` with certified emptiness.  Knows nothing of dynamics."""

from polytopes.approximation import Bracketed, Copy
from polytopes.certificate import Certificate
from polytopes.containment import Containment
from polytopes.directions import box_directions, eigenvector_directions, octagon_directions, sphere_directions
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
from polytopes.zonotopes import ConstrainedZonotope

__all__ = [
    "Ball",
    "Bracketed",
    "Certificate",
    "Chord",
    "ConstrainedZonotope",
    "Containment",
    "Copy",
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
    "box_directions",
    "convex_hull",
    "eigenvector_directions",
    "octagon_directions",
    "sphere_directions",
    "union_bounds",
    "warm_up",
]

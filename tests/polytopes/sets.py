"""One set of every kind, for tests that run an operation over all of them."""

import numpy as np

from polytopes import HPolytope

SQUARE = (np.vstack([np.eye(2), -np.eye(2)]), np.ones(4))

CATALOGUE = {
    "square": HPolytope(*SQUARE),
    "triangle": HPolytope([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [1.0, 0.0, 0.0]),
    "empty": HPolytope.empty(2),
    "empty box": HPolytope.box([0.0, 1.0], [1.0, 0.0]),
    "whole space": HPolytope.whole_space(2),
    "half-plane": HPolytope([[1.0, 2.0]], [1.0]),
    "wedge": HPolytope([[-1.0, 0.5], [0.5, -1.0]], [0.0, 0.0]),
    "strip": HPolytope([[1.0, 1.0], [-1.0, -1.0]], [1.0, 0.0]),
    "segment by an equality": HPolytope(*SQUARE, [[1.0, -2.0]], [0.5]),
    "segment by two rows": HPolytope(np.vstack([SQUARE[0], [[1, -2], [-1, 2]]]), np.append(SQUARE[1], [0.5, -0.5])),
    "line": HPolytope(np.empty((0, 2)), [], [[1.0, 3.0]], [1.0]),
    "ray": HPolytope([[-1.0, 0.0]], [0.0], [[1.0, 1.0]], [0.0]),
    "point": HPolytope.box([0.25, -0.75], [0.25, -0.75]),
    "point by equalities": HPolytope(np.empty((0, 2)), [], [[1.0, 1.0], [1.0, -1.0]], [1.0, 0.5]),
    "duplicate rows": HPolytope(np.vstack([SQUARE[0]] * 2), np.ones(8)),
    "scaled rows": HPolytope(SQUARE[0] * [[1e-6], [1e6], [3.0], [0.1]], [1e-6, 1e6, 3.0, 0.1]),
    "zero rows": HPolytope(np.vstack([SQUARE[0], np.zeros((2, 2))]), np.append(SQUARE[1], [0.0, 2.0])),
    "thin": HPolytope.box([0.0, 0.0], [1.0, 2.0**-30]),
    "interval": HPolytope([[2.0], [-1.0], [1.0]], [1.0, 1.0, 5.0]),
    "half-line": HPolytope([[-1.0]], [0.0]),
    "one-dimensional point": HPolytope([[1.0], [-1.0]], [0.5, -0.5]),
    "thin and skew": HPolytope([[1.0, -1.0], [-1.0, 1.0], [1.0, 0.0], [-1.0, 0.0]], [2.0**-30, 0.0, 1.0, 0.0]),
    "touching": HPolytope([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [1.0, -1.0, 3.0], [[1.0, -1.0]], [0.0]),
    "cone": HPolytope([[-1.0, 0.5], [-1.0, -2.0]], [0.0, 0.0]),
    "slice": HPolytope(*SQUARE, [[0.36, 0.48]], [0.3]),
    "cone in space": HPolytope([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, -1.0]], np.zeros(3)),
    "flat cone": HPolytope([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], [0.0, 0.0], [[1.0, 2.0, -1.0]], [0.0]),
    "line in space": HPolytope(np.empty((0, 3)), [], [[1.0, 1.0, 0.0], [0.0, 2.0, -1.0]], [1.0, 0.0]),
    "ray in space": HPolytope([[-3.0, 0.0, 0.0]], [1.0], [[1.0, 1.0, 0.0], [0.0, 2.0, -1.0]], [1.0, 0.0]),
    "decimal ray": HPolytope([[-0.3, 0.1, 0.0]], [0.7], [[0.1, 0.2, 0.3], [0.7, -0.1, 0.0]], [0.3, 0.1]),
    "cube": HPolytope.box([-1.0, -1.0, -1.0], [1.0, 2.0, 3.0]),
}

EMPTY = {"empty", "empty box"}
UNBOUNDED = {
    "whole space", "half-plane", "wedge", "strip", "line", "ray", "half-line", "cone", "cone in space", "flat cone",
    "line in space", "ray in space", "decimal ray",
}  # fmt: skip
DIMENSION = {
    "empty": -1, "empty box": -1, "segment by an equality": 1, "segment by two rows": 1, "line": 1, "ray": 1,
    "point": 0, "point by equalities": 0, "one-dimensional point": 0, "interval": 1, "half-line": 1, "cube": 3,
    "touching": 0, "slice": 1, "cone in space": 3, "flat cone": 2, "line in space": 1, "ray in space": 1,
    "decimal ray": 1,
}  # fmt: skip
FACETS = {  # rows and equalities of a minimal description
    "square": (4, 0), "triangle": (3, 0), "empty": (1, 0), "empty box": (1, 0), "whole space": (0, 0),
    "half-plane": (1, 0), "wedge": (2, 0), "strip": (2, 0), "segment by an equality": (2, 1),
    "segment by two rows": (2, 1), "line": (0, 1), "ray": (1, 1), "point": (0, 2), "point by equalities": (0, 2),
    "duplicate rows": (4, 0), "scaled rows": (4, 0), "zero rows": (4, 0), "thin": (4, 0), "interval": (2, 0),
    "half-line": (1, 0), "one-dimensional point": (0, 1), "cube": (6, 0), "thin and skew": (4, 0), "touching": (0, 2),
    "cone": (2, 0), "slice": (2, 1), "cone in space": (3, 0), "flat cone": (2, 1), "line in space": (0, 2),
    "ray in space": (1, 2), "decimal ray": (1, 2),
}  # fmt: skip
VERTICES = {
    "square": 4, "triangle": 3, "empty": 0, "empty box": 0, "segment by an equality": 2, "segment by two rows": 2,
    "point": 1, "point by equalities": 1, "duplicate rows": 4, "scaled rows": 4, "zero rows": 4, "thin": 4,
    "interval": 2, "one-dimensional point": 1, "cube": 8, "thin and skew": 4, "touching": 1, "slice": 2,
}  # fmt: skip

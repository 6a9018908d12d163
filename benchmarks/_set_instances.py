"""Pairs of bounded sets with seeds on which operations of polytopes are compared: small, decimal, degenerate, uneven.

The first set of a pair answers questions to one set; hulls of points take the vertices that belong to it.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Instance:
    """Sets ``A x <= b`` and ``A2 x <= b2``, points V (k, n) and a direction c (n,)."""

    name: str
    A: Floats
    b: Floats
    A2: Floats
    b2: Floats
    V: Floats
    c: Floats

    @property
    def dim(self) -> int:
        return self.A.shape[1]


def box(lower: list[float], upper: list[float]) -> tuple[Floats, Floats]:
    """Rows of a box."""
    axes = np.eye(len(lower))
    return np.vstack([axes, -axes]), np.concatenate([upper, -np.array(lower)])


def cube(n: int, half: float) -> tuple[Floats, Floats]:
    """``|x_j| <= half``."""
    return box([-half] * n, [half] * n)


def simplex(n: int, size: float) -> tuple[Floats, Floats]:
    """``x >= 0``, the sum at most `size`."""
    return np.vstack([-np.eye(n), np.ones((1, n))]), np.append(np.zeros(n), size)


def cross(n: int, size: float) -> tuple[Floats, Floats]:
    """``|x_1| + ... + |x_n| <= size``."""
    signs = np.array(list(itertools.product([1.0, -1.0], repeat=n)))
    return signs, np.full(len(signs), size)


def random_rows(n: int, rows: int, seed: int, size: float = 1.0) -> tuple[Floats, Floats]:
    """Unit normals at random at distances in [1/2, 3/2] times `size` from the origin."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((rows, n))
    A /= np.linalg.norm(A, axis=1)[:, None]
    return A, size * rng.uniform(0.5, 1.5, rows)


def permutahedron(n: int, size: float) -> tuple[Floats, Floats]:
    """All orders of 1 ... n + 1, less their last coordinate, from the centre: 2^(n + 1) - 2 rows."""
    rows, sides = [], []
    for k in range(1, n + 1):
        for chosen in itertools.combinations(range(n + 1), k):
            row = np.zeros(n + 1)
            row[list(chosen)] = 1.0  # sums of k numbers are at most the k largest
            rows.append(row[:n] - row[n])
            sides.append(size * 0.5 * k * (n + 1 - k))
    return np.array(rows), np.array(sides)


def instance(name: str, first: tuple[Floats, Floats], second: tuple[Floats, Floats], V: Floats) -> Instance:
    """A pair with a direction in which no coordinate is alike."""
    return Instance(name, *first, *second, V, np.arange(1.0, 1.0 + first[0].shape[1]))


def small() -> list[Instance]:
    """Sets that a user types: an interval, a box, a triangle, a cube, a simplex."""
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
    return [
        instance("interval", box([0.0], [1.0]), box([0.25], [0.5]), np.array([[0.0], [1.0], [0.5]])),
        instance("box in R^2", box([0.0, 0.0], [1.0, 2.0]), box([0.25, 0.5], [0.5, 1.0]), 2.0 * triangle),
        instance("triangle", simplex(2, 1.0), simplex(2, 0.5), triangle),
        instance("cube in R^3", cube(3, 1.0), cube(3, 0.5), corners),
        instance("simplex in R^4", simplex(4, 1.0), simplex(4, 0.5), np.vstack([np.zeros(4), np.eye(4)])),
    ]


def decimal() -> list[Instance]:
    """Random rows and points in general position."""
    pairs = [(2, 8), (3, 22), (4, 30)]
    return [
        instance(
            f"{m} rows in R^{n}",
            random_rows(n, m, 3),
            random_rows(n, m, 5, 0.25),
            np.random.default_rng(4).standard_normal((m, n)),
        )
        for n, m in pairs
    ]


def degenerate() -> list[Instance]:
    """Many rows in a vertex, or many vertices in a facet; integers, and not."""
    turn = np.linalg.qr(np.random.default_rng(6).standard_normal((3, 3)))[0]
    turned = [(A @ turn, b) for A, b in (cross(3, 1.0), cube(3, 0.25))]
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3))) @ turn
    orders = np.array(list(itertools.permutations(range(4))))[:, :3] - 1.5
    return [
        instance("turned cross-polytope in R^3", *turned, corners),
        instance("permutahedron in R^3", permutahedron(3, 1.0), permutahedron(3, 0.5), orders),
        instance("cross-polytope in R^4", cross(4, 1.0), cross(4, 0.5), cross(4, 1.0)[0]),
    ]


def uneven() -> list[Instance]:
    """Thin sets and uneven units, in which libraries with fixed tolerances go wrong."""
    units = np.array([1.0, 1e-3, 1e-6, 1e3])
    A, b = random_rows(4, 24, 7)
    A2, b2 = random_rows(4, 24, 8, 0.25)
    thin = box([0.0, 0.0], [1.0, 1e-7]), box([0.25, 0.0], [0.5, 1e-8])
    close = np.vstack([simplex(2, 1.0)[0], np.ones((1, 2))]), np.array([0.0, 0.0, 1.0, 1.0 + 1e-8])
    points = np.random.default_rng(9).standard_normal((24, 4)) / units
    return [
        instance("[0, 1] x [0, 1e-7]", *thin, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1e-7], [1.0, 1e-7]])),
        instance("rows 1e-8 apart", close, simplex(2, 0.5), np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])),
        instance("units from 1e-6 to 1e3 in R^4", (A * units, b), (A2 * units, b2), points),
    ]


def large() -> list[Instance]:
    """One large instance for each of a few operations."""
    rng = np.random.default_rng(0)
    moments = np.arange(-6.0, 6.0)[:, None] ** np.arange(1, 6)
    return [
        instance("26 rows in R^3", random_rows(3, 26, 1), random_rows(3, 26, 2), rng.standard_normal((26, 3))),
        instance("36 rows in R^3", random_rows(3, 36, 2), random_rows(3, 36, 3), rng.standard_normal((36, 3))),
        instance("cube in R^10", cube(10, 1.0), cube(10, 0.5), rng.standard_normal((16, 10))),
        instance("cross-polytope in R^7", cross(7, 1.0), cross(7, 0.5), rng.standard_normal((20, 7))),
        instance("12 points of a cyclic polytope in R^5", cube(5, 1.0), cube(5, 0.5), moments),
        instance("200 rows in R^6", random_rows(6, 200, 0), random_rows(6, 200, 1), rng.standard_normal((20, 6))),
    ]

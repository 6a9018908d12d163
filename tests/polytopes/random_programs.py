"""Seeded random programs of every awkward kind, shared by the tests of the kernel, of emptiness and of redundancy."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
KINDS = ("general", "degenerate", "thin", "scaled", "empty", "unbounded", "integer", "duplicated")


def random_rows(rng: np.random.Generator, kind: str) -> tuple[Floats, Floats]:
    """Rows A (m, n), b (m,) of the given kind, 2 to 6 variables."""
    n = int(rng.integers(2, 7))
    m = int(rng.integers(n + 1, 40))
    A = rng.standard_normal((m, n))
    b = rng.uniform(0.1, 2.0, m) + A @ rng.standard_normal(n)
    if kind == "degenerate":  # many rows through one point
        A, _ = _boxed(A, b)
        corner, sign = rng.integers(-2, 3, n).astype(float), np.sign(A @ rng.standard_normal(n))
        A = A * sign[:, None]  # all rows at the corner leave one side open
        b = A @ corner + np.where(rng.random(A.shape[0]) < 0.7, 0.0, rng.random(A.shape[0]))
    elif kind == "thin":
        A, b = _boxed(A, b)
        normal, width = rng.standard_normal(n), 10.0 ** rng.uniform(-9, -6)
        b = np.abs(b)
        A, b = np.vstack([A, normal, -normal]), np.append(b, [0.01, width - 0.01])
    elif kind == "scaled":
        A, b = _boxed(A, b)
        rows, columns = 10.0 ** rng.uniform(-4, 4, b.size), 10.0 ** rng.uniform(-3, 3, n)
        A, b = A * rows[:, None] * columns, b * rows
    elif kind == "empty":
        weights = rng.random(m)
        A, b = np.vstack([A, -weights @ A]), np.append(b, -weights @ b - 10.0 ** rng.uniform(-6, 1))
    elif kind == "integer":
        A, b = rng.integers(-2, 3, (m, n)).astype(float), rng.integers(0, 4, m) - (rng.random(m) < 0.1)
    elif kind == "duplicated":
        A, b = _boxed(A, b)
        copies = 2.0 ** rng.integers(-3, 4, b.size) * rng.choice([1.0, 3.0], b.size)
        A, b = np.vstack([A, A * copies[:, None], np.zeros((1, n))]), np.concatenate([b, b * copies, [0.0]])
    elif kind == "general":
        A, b = _boxed(A, b)
    return A, b


def _boxed(A: Floats, b: Floats) -> tuple[Floats, Floats]:
    n = A.shape[1]
    return np.vstack([A, np.eye(n), -np.eye(n)]), np.append(b, np.full(2 * n, 3.0))


def many(kind: str, count: int) -> Iterator[tuple[np.random.Generator, Floats, Floats]]:
    """`count` programs with a generator each, the same on every run."""
    for seed in np.random.SeedSequence(KINDS.index(kind)).spawn(count):
        rng = np.random.default_rng(seed)
        yield (rng, *random_rows(rng, kind))

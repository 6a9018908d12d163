"""Seeded small systems of integers, the kinds on which set libraries go wrong, for comparisons with exact rationals."""

from collections.abc import Iterator

import numpy as np

from polytopes import HPolytope

KINDS = ("sparse", "corner", "flat", "boxed", "wide")


def system(rng: np.random.Generator, kind: str, n: int) -> HPolytope:
    """One system in n variables.

    - sparse: entries -1, 0, 1; empty, unbounded, flat or none of these
    - corner: most rows through one point, some of them twice or negative multiples of others
    - flat: equalities, explicit and as pairs of rows, contradictory ones too
    - boxed: bounded, rows that cut or touch the box
    - wide: entries up to 99, so that results are no integers
    """
    m = int(rng.integers(1, n + 6))
    if kind == "sparse":
        return HPolytope(rng.integers(-1, 2, (m, n)), rng.integers(-1, 4, m))
    if kind == "corner":
        A = rng.integers(-2, 3, (m, n))
        A = np.vstack([A, A[rng.integers(0, m, 2)] * rng.choice([-1, 2], 2)[:, None]])
        away = np.where(rng.random(m + 2) < 0.8, 0, rng.integers(-1, 3, m + 2))
        return HPolytope(A, A @ rng.integers(-2, 3, n) + away)
    A = rng.integers(-99, 100, (m, n)) if kind == "wide" else rng.integers(-2, 3, (m, n))
    b = rng.integers(-50, 200, m) if kind == "wide" else rng.integers(-1, 6, m)
    if kind == "flat":
        q = int(rng.integers(0, n))
        C, d = rng.integers(-2, 3, (q, n)), rng.integers(-1, 2, q)
        A, b = np.vstack([A, -A[:1]]), np.append(b, -b[0])
        return HPolytope(A, b, C, d)
    P = HPolytope(A, b)
    if kind == "wide" and rng.random() < 0.5:
        return P
    return P.intersection(HPolytope.box(rng.integers(-3, 0, n), rng.integers(0, 4, n)))


def many(kind: str, count: int, dimensions: tuple[int, ...]) -> Iterator[tuple[str, np.random.Generator, HPolytope]]:
    """`count` systems with a label and a generator each, the same on every run."""
    for k in range(count):
        rng = np.random.default_rng([KINDS.index(kind), k])
        yield f"{kind} {k}", rng, system(rng, kind, int(rng.choice(dimensions)))

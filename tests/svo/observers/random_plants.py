"""Random uncertain plants that use everything an UncertainModel can hold."""

from __future__ import annotations

from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty


def random_uncertainty(rng: np.random.Generator, n: int, nu: int, nw: int, ny: int) -> Uncertainty:
    """A direction of rank one or two, in the state equation, the output or both, with or without x, w and u."""
    shape = (n + ny, n + nu + 1 + nw)
    rank = int(rng.choice([1, 1, 1, 2]))
    stack = 0.2 * rng.normal(size=(shape[0], rank)) @ rng.normal(size=(rank, shape[1]))
    where = rng.choice(["state", "output", "both"])
    if where == "state":
        stack[n:] = 0.0
    elif where == "output":
        stack[:n] = 0.0
    if rng.random() < 0.3:
        stack[:, :n] = 0.0  # s depends on inputs and disturbances only
    if rng.random() < 0.3:
        stack[:, n + nu] += 5.0 * stack.max()  # s tends to keep one sign
    cut = np.split(stack, [n, n + nu, n + nu + 1], axis=1)
    low = rng.uniform(-1.0, 0.5)
    return Uncertainty(
        A=cut[0][:n], B=cut[1][:n] if nu else None, a=cut[2][:n, 0], E=cut[3][:n] if nw else None,
        C=cut[0][n:], D=cut[1][n:] if nu else None, c=cut[2][n:, 0], F=cut[3][n:] if nw else None,
        bounds=(low, low + rng.uniform(0.0, 1.0)),
    )  # fmt: skip


def random_disturbance_set(rng: np.random.Generator, nw: int) -> Any:
    """Half-widths, an asymmetric box with zero widths, or a polytope."""
    kind = rng.choice(["half-width", "box", "polytope"])
    if kind == "half-width":
        return rng.uniform(0.0, 0.5, nw)
    if kind == "polytope" and nw > 1:
        return HPolytope.from_vertices(rng.normal(size=(nw + 4, nw)))
    lower, upper = rng.uniform(-0.5, 0.0, nw), rng.uniform(0.0, 0.5, nw)
    flat = rng.random(nw) < 0.3
    lower[flat] = upper[flat]
    return lower, upper


def random_plant(rng: np.random.Generator, largest: int = 4) -> UncertainModel:
    """A plant with up to `largest` states, stable or not, with shared disturbances and up to two uncertainties."""
    n, nu, nw, ny = (int(rng.integers(low, high)) for low, high in ((1, largest + 1), (0, 3), (0, 4), (1, 4)))
    A = rng.normal(size=(n, n))
    A *= rng.choice([0.5, 0.9, 1.0, 1.05]) / np.abs(np.linalg.eigvals(A)).max()
    optional: dict[str, Any] = {}
    if nw:
        optional |= {"E": rng.normal(size=(n, nw)), "w": random_disturbance_set(rng, nw)}
        if rng.random() < 0.4:
            optional["F"] = 0.3 * rng.normal(size=(ny, nw))
    if nu and rng.random() < 0.3:
        optional["D"] = rng.normal(size=(ny, nu))
    if rng.random() < 0.5:
        optional |= {"a": rng.normal(size=n), "c": rng.normal(size=ny)}
    return UncertainModel(
        A,
        rng.normal(size=(n, nu)) if nu else None,
        rng.normal(size=(ny, n)),
        n=rng.uniform(0.0, 0.5, ny) * (rng.random(ny) < 0.8),
        uncertainties=[random_uncertainty(rng, n, nu, nw, ny) for _ in range(rng.integers(0, 3))],
        **optional,
    )

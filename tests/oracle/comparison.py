"""Answers of two cores to the same questions: where they differ, and by how much of a set's width."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.oracle.cases import Answers

SINGLE, CHAINED = 1e-9, 1e-6  # of the width of a box: rounding of one program, and what a log makes of it
LIMITS = {"program": SINGLE, "chain": CHAINED, "flight": CHAINED, "polytope": SINGLE}


class Difference(NamedTuple):
    """Of one question: what differs, or None; and how far the bounds are apart, as a share of the width."""

    what: str | None
    apart: float


def difference(kind: str, old: Answers, new: Answers) -> Difference:
    """Of the answers to one question; bounds may be narrower, by however much."""
    if old.keys() != new.keys():
        return Difference(f"answers {sorted(new)} instead of {sorted(old)}", np.inf)
    worst = 0.0
    for name, before in old.items():
        after = new[name]
        if before.shape != after.shape or before.dtype.kind != after.dtype.kind:
            return Difference(f"{name} has another shape or type: {after} instead of {before}", np.inf)
        if before.dtype.kind != "f" or name.endswith("facets"):
            if not np.array_equal(before, after):
                return Difference(f"{name}: {after} instead of {before}", np.inf)
        else:
            worst = max(worst, _apart(before, after, name))
    return Difference(f"bounds are {worst:.2g} of the width apart" if worst > LIMITS[kind] else None, worst)


def _apart(before: NDArray, after: NDArray, name: str) -> float:
    """How much wider the new bounds are, as a share of the width."""
    if before.size == 0:
        return 0.0
    if not np.array_equal(np.isfinite(before), np.isfinite(after)):
        return np.inf
    known = np.isfinite(before)
    before, after = np.where(known, before, 0.0), np.where(known, after, 0.0)
    outward, scale = after - before, np.maximum(1.0, np.abs(before))
    if "box" in name or name == "shadow":
        (lower, upper), bounded = np.moveaxis(before, -2, 0), known.all(axis=-2)
        outward[..., 0, :] *= -1.0
        scale = np.stack([np.where(bounded, upper - lower, 1.0)] * 2, axis=-2)
    size = scale + 1e-3 * np.abs(before)  # rounding is relative to size, not width
    shares = np.divide(outward, size, where=known & (size > 0.0), out=np.zeros(before.shape))
    return float(max(shares.max(), 0.0))

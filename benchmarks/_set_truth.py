"""Whether an answer is right: compared with exact rational arithmetic (the Parma library), in coordinates of width one.

Numbers and places may be off by 1e-8 of the set's width, which forgives what any library in floats rounds. There may be
no more vertices than there are, nor rows where they are to be minimal; fewer only where several are one to within that.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import _set_peers as peers
from benchmarks._set_instances import Floats, Instance
from polytopes import HPolytope

_NEAR = 1e-8
_NORMALS = 1e-5  # of rows of one facet, in coordinates of width one

Verdict = Callable[[Any], bool]


def judge(operation: str, case: Instance) -> Verdict:
    """Says of an answer to an operation whether it is right."""
    P, Q = peers.ppl_rows(case.A, case.b), peers.ppl_rows(case.A2, case.b2)
    exact: dict[str, Callable[[], Verdict]] = {
        "emptiness": lambda: _equal(P.is_empty()),
        "support": lambda: _near(peers.ppl_support(P, case.c)),
        "bounding box": lambda: _box(peers.ppl_box(case)),
        "largest ball": lambda: _near(_radius(case)),
        "redundancy": lambda: _rows(P),
        "vertices": lambda: _points(peers.ppl_corners(P)),
        "rows to vertices to rows": lambda: _rows(P),
        "hull of points": lambda: _rows(peers.ppl_points(case.V)),
        "hull of a union": lambda: _rows(peers.ppl_hull(case)),
        "projection": lambda: _rows(peers.ppl_shadow(case)),
        "Minkowski sum": lambda: _rows(peers.ppl_sum(case)),
        "Pontryagin difference": lambda: _rows(_difference(case), minimal=False),
        "volume": lambda: _near(float(HPolytope(case.A, case.b).volume(exact=True))),
        "contains a set": lambda: _equal(P.contains(Q)),
        "equality": lambda: _equal(True),
        "intersection not empty": lambda: _equal(not P.is_disjoint_from(Q)),
    }
    return exact[operation]()


def _equal(truth: bool) -> Verdict:
    return lambda answer: bool(answer) == bool(truth)


def _near(truth: float) -> Verdict:
    return lambda answer: bool(abs(answer - truth) <= _NEAR * abs(truth))


def _box(truth: tuple[Floats, Floats]) -> Verdict:
    width = truth[1] - truth[0]
    return lambda box: all(bool((np.abs(u - v) <= _NEAR * width).all()) for u, v in zip(box, truth, strict=True))


def _radius(case: Instance) -> float:
    """Of a largest ball, the norms of rows rounded."""
    norms = np.linalg.norm(case.A, axis=1)[:, None]
    radius = np.eye(case.dim + 1)[-1:]
    lifted = peers.ppl_rows(np.vstack([np.hstack([case.A, norms]), -radius]), np.append(case.b, 0.0))
    return peers.ppl_support(lifted, radius[0])


def _difference(case: Instance) -> Any:
    rows = peers.ppl_difference(case)
    return peers.ppl_rows(rows[:, :-1], rows[:, -1])


def _points(truth: Floats) -> Verdict:
    width = np.ptp(truth, axis=0)

    def right(points: Floats) -> bool:
        if not 0 < len(points) <= len(truth) or not np.isfinite(points).all():
            return False
        apart = (np.abs(points[:, None] - truth) / width).max(axis=2)
        return bool((apart.min(axis=0) <= _NEAR).all() and (apart.min(axis=1) <= _NEAR).all())

    return right


def _rows(truth: Any, minimal: bool = True) -> Verdict:
    V = peers.ppl_corners(truth)
    centre, width = V.mean(axis=0), np.ptp(V, axis=0)
    V, facets = (V - centre) / width, _scaled(peers.ppl_table(truth), centre, width)

    def right(answer: Any) -> bool:
        rows = peers.rows_of(answer)
        if not len(rows) or not np.isfinite(rows).all() or (minimal and len(rows) > len(facets)):
            return False
        found = _scaled(rows, centre, width)
        beyond = (V @ found[:, :-1].T).max(axis=0) - found[:, -1]
        alike = np.abs(found[:, None] - facets).max(axis=2).min(axis=0) <= _NORMALS
        tight = np.abs(beyond) <= _NEAR if minimal else beyond <= _NEAR
        return bool(tight.all() and alike.all())

    return right


def _scaled(rows: Floats, centre: Floats, width: Floats) -> Floats:
    """Rows of length one in coordinates ``(x - centre) / width``."""
    moved = np.hstack([rows[:, :-1] * width, (rows[:, -1] - rows[:, :-1] @ centre)[:, None]])
    norms = np.linalg.norm(moved[:, :-1], axis=1)
    return moved / np.where(norms > 0.0, norms, 1.0)[:, None]

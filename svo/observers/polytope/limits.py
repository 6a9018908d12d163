"""How far sets of the polytope observer may reach: the physical range, and what floats can tell apart."""

from __future__ import annotations

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.models import UncertainModel
from svo.models.state_range import StateRange
from svo.observers.answers import between
from svo.observers.polytope.sets import Sample
from svo.observers.polytope.vertex_images import limited, reach_of
from svo.observers.window_kernel import LARGEST

FLOATS_TELL_APART = 2.0**40
"""Size of a state from which a set that its programs cannot settle is given up, not refused."""
_READING = 2.0**400  # beyond it a row cannot be given to a polytope


def readable(y: Array) -> Array:
    """A measurement without the values that no set can be told of."""
    return np.where(np.abs(y) < _READING, y, np.nan)


def is_of_use(sample: Sample, u: Array) -> bool:
    """Whether what u and the constants add to state and output is below all bounds."""
    n, nu = sample.stack.shape[1] - sample.y.size, u.size
    with np.errstate(over="ignore"):
        known = np.abs(sample.stack[..., n : n + nu]) @ np.abs(u) + np.abs(sample.stack[..., n + nu])
    return bool((known < LARGEST).all())


def reach_ahead(model: UncertainModel, sample: Sample, joint: HPolytope, u: Array) -> float:
    """More than any |x| of this sample, of x in a set, and of the next one under u."""
    n = model.n_states
    reach = reach_of(joint)[:n]
    delta = np.array([max(abs(b) for b in item.bounds) for item in model.uncertainties])
    size = np.abs(sample.stack[0, :n]) + np.tensordot(delta, np.abs(sample.stack[1:, :n]), axes=1)
    w = np.max(np.abs(sample.w_box), axis=0)
    ahead = size @ np.concatenate([reach, np.abs(u), [1.0], w])
    return float(np.concatenate([reach, ahead]).max())


def cut_to(joint: HPolytope, held: StateRange, max_facets: int | None) -> tuple[HPolytope, bool]:
    """A set of (x, ...) within the physical range, and whether they meet; where they do not, the set as it is."""
    n = held.lower.size
    low, high = (np.asarray(end)[:n] for end in joint.bounding_box())
    above, below = np.flatnonzero(high > held.upper), np.flatnonzero(low < held.lower)
    if not (above.size or below.size):
        return joint, True
    axes = np.eye(n, joint.dim)
    rows = HPolytope(np.vstack([axes[above], -axes[below]]), np.concatenate([held.upper[above], -held.lower[below]]))
    cut = joint.intersection(rows)
    if cut.emptiness().status != "nonempty":
        return joint, False
    return limited(cut, max_facets), True


def within_physical(physical: StateRange | None, P: HPolytope) -> HPolytope:
    """A set of first states, cut to the physical range."""
    if physical is None:
        return P
    cut, meets = cut_to(P, physical, None)
    if not meets:
        raise ValueError("initial and the model's physical range have no common point; expected first states within it")
    return cut


def anywhere(n: int, physical: StateRange | None) -> HPolytope:
    """All states (n,), or those of the physical range."""
    return HPolytope.whole_space(n) if physical is None else between(np.eye(n), physical.lower, physical.upper)

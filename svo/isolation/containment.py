"""Whether a fault's model contains the nominal plant, as Architecture I asks: where a proof to the contrary is at hand.

An impulse of the input, large enough, drowns whatever is bounded: first states, disturbances, noise, affine terms. So a
model contains another only if some Delta at the impulse gives it the other's impulse response: a linear program, where
the uncertainties of the one do not reach A and C.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.models import UncertainModel

_ROUNDING = 1e-9  # of the terms of a response: what a difference must exceed to be one


def excludes(fault: Any, nominal: Any) -> bool:
    """Whether a fault's model surely does not contain a nominal one: no Delta at an impulse gives its response.

    False also where nothing is known: models that are nonlinear or have a schedule, uncertain A or C of the fault, and
    disturbances of the fault that the nominal model does not have, since these may stand for what inputs within their
    range do.
    """
    if not all(isinstance(model, UncertainModel) and not model.is_scheduled for model in (fault, nominal)):
        return False
    if not _same_disturbances(fault, nominal):
        return False
    own = fault.stack()
    n = fault.n_states
    if nominal.n_inputs == 0 or own[1:, :, :n].any():
        return False
    lags = 1 + max(n, nominal.n_states)
    wanted, size = _response(_at_the_middle(nominal), nominal, lags)
    base, own_size = _response(own[0], fault, lags)
    slopes = [_response(np.concatenate([own[0, :, :n], item[:, n:]], axis=1), fault, lags)[0] for item in own[1:]]
    room = _ROUNDING * (size + own_size)
    if (np.abs(wanted - base) <= room).all() and not slopes:
        return False
    return _no_delta(np.array(slopes).reshape(len(slopes), base.size).T, (wanted - base).ravel(), room.ravel(), fault)


def _no_delta(slopes: Array, difference: Array, room: Array, fault: UncertainModel) -> bool:
    if not slopes.shape[1]:
        return True
    limits = np.array([item.bounds for item in fault.uncertainties])
    unit = np.maximum(room, np.finfo(float).tiny)[:, None]
    rows = np.vstack([slopes, -slopes]) / np.vstack([unit, unit])
    ends = np.concatenate([difference + room, room - difference]) / np.concatenate([unit, unit]).ravel()
    box = HPolytope.box(limits[:, 0], limits[:, 1])
    known = np.isfinite(rows).all(axis=1) & np.isfinite(ends)
    return bool(box.intersection(HPolytope(rows[known], ends[known])).emptiness().status == "empty")


def _same_disturbances(fault: UncertainModel, nominal: UncertainModel) -> bool:
    """Whether the fault has no disturbance that the nominal model does not have."""
    if fault.disturbance_polytope is not None or nominal.disturbance_polytope is not None:
        return False
    if (fault.n_states, fault.n_disturbances) != (nominal.n_states, nominal.n_disturbances):
        return False
    first = fault.n_states + fault.n_inputs + 1
    return bool(
        np.array_equal(fault.stack()[0, :, first:], nominal.stack()[0, :, first:])
        and all(np.array_equal(a, b) for a, b in zip(fault.bounds()[:2], nominal.bounds()[:2], strict=True))
    )


def _at_the_middle(model: UncertainModel) -> Array:
    middle = [np.mean(item.bounds) for item in model.uncertainties]
    return np.asarray(np.tensordot([1.0, *middle], model.stack(), axes=1))


def _response(stack: Array, model: UncertainModel, lags: int) -> tuple[Array, Array]:
    """Outputs (lags, ny, nu) after a unit impulse of each input, and the sizes of the terms that they are sums of."""
    n, nu = model.n_states, model.n_inputs
    A, B, C, D = stack[:n, :n], stack[:n, n : n + nu], stack[n:, :n], stack[n:, n : n + nu]
    found, sizes = [D], [np.abs(D)]
    state, size = B, np.abs(B)
    for _ in range(lags):
        found.append(C @ state)
        sizes.append(np.abs(C) @ size)
        state, size = A @ state, np.abs(A) @ size
    return np.array(found), np.array(sizes)

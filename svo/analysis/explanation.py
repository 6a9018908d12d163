"""How much bounds must give way for a trajectory, and the proof that the widened model has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polytopes import HPolytope
from svo.analysis.elastic_bounds import Bound, widened
from svo.analysis.trajectory import Trajectory, lies_in, needed_by
from svo.checks import Array
from svo.logs.log import Log
from svo.models import NormalForm, UncertainModel
from svo.observers.window.observer import WindowObserver

# Of the data, as the observers do: y = fl(C x + n) on a bound need not satisfy it. Theirs is a little wider.
ROUNDING = 1e-9
NEGLIGIBLE = 1e-7  # relative widening that may be the solver's tolerance: the observer is asked whether it is
_PULL = 1e-12  # of the way to the centre of a set: rounding does not lead out of it again
_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Explanation:
    """A model with bounds widened by ``amounts`` (bounds,), in their own units, that has a trajectory through a log."""

    model: UncertainModel
    amounts: Array


def explain(
    form: NormalForm, log: Log, initial: HPolytope, chosen: Sequence[Bound], trajectory: Trajectory
) -> Explanation:
    """Widen the chosen bounds by what a trajectory needs, and prove that it is one of the widened model.

    Floats may not hold a trajectory of sets without an interior (exact sensors, first states on a slanted line); then
    the window observer of full information decides.

    Raises
    ------
    RuntimeError
        If neither shows that the log is explained.
    """
    scales = np.array([bound.scale for bound in chosen])
    for least in (NEGLIGIBLE * scales, 0.0 * scales):  # what only the solver's tolerance asked for may be left out
        found, proven = _widened(form, log, initial, chosen, trajectory, least)
        if proven:
            break
    relative = max(found.amounts / scales, default=0.0)
    if 0.0 < relative <= NEGLIGIBLE and not _is_falsified(form.given, initial, log):
        return Explanation(form.given, np.zeros(len(chosen)))
    if not proven and _is_falsified(found.model, initial, log):
        raise RuntimeError(
            "the trajectory that was found could not be held in floats; widen the set of first states a little, or let "
            "bounds contain 'noise'"
        )
    return found


def _widened(
    form: NormalForm, log: Log, initial: HPolytope, chosen: Sequence[Bound], trajectory: Trajectory, least: Array
) -> tuple[Explanation, bool]:
    """The bounds of w and Delta widened where they need ``least`` (bounds,) or more, those of the noise as far as the
    trajectory within them needs it; and whether it is proven to be one of that model."""
    amounts = np.zeros(len(chosen))
    lower, upper, noise = _bounds_along(form.given, log)
    _give(amounts, chosen, "disturbance", lower, upper, trajectory.w * form.w)
    deltas = np.array([q.bounds for q in form.given.uncertainties]).reshape(-1, 2)
    _give(amounts, chosen, "Delta", deltas[:, 0], deltas[:, 1], trajectory.deltas)
    amounts[amounts < least] = 0.0
    kept = _kept(trajectory, form, log, widened(form.given, chosen, amounts), initial)
    needed = needed_by(kept, form, log, initial)
    size = needed.noise * form.y
    _give(amounts, chosen, "noise", -_with_rounding(noise, log.y), _with_rounding(noise, log.y), size)
    model = widened(form.given, chosen, amounts)
    explained = size <= _with_rounding(_bounds_along(model, log)[2], log.y)
    proven = needed.is_within and bool((explained | np.isnan(size)).all()) and _are_disturbances(kept, form)
    return Explanation(model, amounts), proven


def _is_falsified(model: UncertainModel, initial: HPolytope, log: Log) -> bool:
    return "falsified" in WindowObserver(model, initial, horizon=None).run(log).verdicts


def _bounds_along(model: UncertainModel, log: Log) -> tuple[Array, Array, Array]:
    """Bounds of w (K, nw) twice and of the noise (K, ny), as observers take them."""
    every = [model.bounds(log.schedule_at(k)) for k in range(len(log))]
    lower, upper, noise = (np.array(ends) for ends in zip(*every, strict=True))
    return lower, upper, noise


def _give(amounts: Array, chosen: Sequence[Bound], kind: str, lower: Array, upper: Array, values: Array) -> None:
    """Enter what the values (K, m) need beyond their bounds, so much that sums in floats suffice as well.

    Bounds that are NaN, of readings that are missing, ask for nothing.
    """
    if not values.size:
        return
    beyond = np.fmax.reduce(np.maximum(values - upper, lower - values), axis=0, initial=0.0)
    sizes = np.abs(lower) + np.abs(upper) + beyond
    room = 8 * _EPS * np.fmax.reduce(sizes, axis=0 if lower.ndim > 1 else None)
    for i, bound in enumerate(chosen):
        if bound.kind == kind and beyond[bound.index] > 0.0:
            amounts[i] = beyond[bound.index] + np.broadcast_to(room, beyond.shape)[bound.index]


def _with_rounding(noise: Array, y: Array) -> Array:
    """The noise and what the rounding of the data is allowed, rounded down."""
    return (noise + ROUNDING * (np.abs(y) + noise)) * (1.0 - 4 * _EPS)


def _kept(t: Trajectory, form: NormalForm, log: Log, model: UncertainModel, initial: HPolytope) -> Trajectory:
    """The trajectory with disturbances and Deltas within the bounds of a model, and its first state in a set."""
    lower, upper, _ = _bounds_along(model, log)
    deltas = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
    x, w, P = t.x.copy(), t.w, model.disturbance_polytope
    x[:1] = _pulled(initial, x[:1] * form.x) / form.x
    w = np.clip(w, lower / form.w, upper / form.w) if P is None else _pulled(P, w * form.w) / form.w
    return Trajectory(x, w, np.clip(t.deltas, deltas[:, 0], deltas[:, 1]))


def _pulled(P: HPolytope, points: Array) -> Array:
    """Points (k, n), those outside of a set moved towards its centre until they are inside."""
    lower, upper = P.bounding_box()
    centre, flat = np.asarray(P.chebyshev().centre), lower == upper
    room, beyond = P.b - P.A @ centre, points @ P.A.T - P.b
    rounding = 8 * _EPS * (np.abs(points) @ np.abs(P.A).T + np.abs(P.b))
    outside = (beyond > -rounding) & (room > 0.0)
    share = np.divide(beyond, room + beyond, out=np.zeros_like(beyond), where=outside & (beyond > 0.0))
    pull = np.where(outside.any(axis=1), share.max(axis=1, initial=0.0) + _PULL, 0.0)
    moved = points + pull[:, None] * (centre - points)
    return np.where(flat, lower, moved)


def _are_disturbances(t: Trajectory, form: NormalForm) -> bool:
    P = form.given.disturbance_polytope
    return P is None or all(lies_in(P, w * form.w) for w in t.w)

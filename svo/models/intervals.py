"""Transitions of another length than the sampling time: each is discretised for its own interval."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from svo.checks import Array, positive_number
from svo.logs.columns import TIME_TOLERANCE
from svo.models.model import UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.models.origin import Origin
from svo.models.stack import OUTPUT_BLOCKS, STATE_BLOCKS, may_be_nonzero

_KEPT = 4096  # intervals of which the matrices are remembered
_MODELS = 64  # the same of models at their sampling time
_ROUNDING = 64.0 * float(np.finfo(float).eps)


def interval_of(model: UncertainModel | NonlinearModel, dt: Any) -> float | None:
    """The seconds that a transition takes; None where it takes the sampling time.

    Raises
    ------
    TypeError, ValueError
        If ``dt`` is no number of seconds above zero, or not the sampling time (within 1 %) of a model in discrete time.
    """
    if dt is None or dt is model.Ts:
        return None
    seconds = positive_number("dt", dt, "time from the sample before, in seconds")
    if seconds == model.Ts:
        return None
    why = _no_other_interval(model)
    if why is None:
        return seconds
    if abs(seconds - model.Ts) <= TIME_TOLERANCE * model.Ts:
        return None
    raise ValueError(f"dt is {seconds:g} s; expected the model's sampling time {model.Ts:g} s, within 1 %, since {why}")


def has_own_intervals(model: UncertainModel | NonlinearModel) -> bool:
    """Whether a transition may take any time."""
    return _no_other_interval(model) is None


def _no_other_interval(model: UncertainModel | NonlinearModel) -> str | None:
    """Why a model has no transitions but those of its sampling time; None where it has."""
    if isinstance(model, NonlinearModel):
        return None if model.continuous else "its equations are in discrete time (continuous=False)"
    if model.origin is None:
        return "it is in discrete time; make it by UncertainModel.from_continuous for samples at times of their own"
    if model.origin.overwritten:
        return "it got arrays of discrete time after from_continuous made it"
    return None


def check_splits(model: UncertainModel) -> None:
    """Refuse a model that ties a transition to the measurement before it.

    A window reads a sample before it knows how long the next transition takes, so a Delta whose value at the sample is
    also that of the transition has its factors fixed too early.
    """
    for i, item in enumerate(model.uncertainties):
        if all(may_be_nonzero(*(getattr(item, name) for name in names)) for names in (STATE_BLOCKS, OUTPUT_BLOCKS)):
            name = item.name or f"Delta[{i}]"
            raise ValueError(
                f"dt is given, and the uncertainty {name} is one number in state and output; give from_continuous "
                f"varying=[{name!r}], with which its value at a sample and its mean after it are two"
            )


def transition_rows(model: UncertainModel, dt: float | None) -> Array:
    """The state rows (1 + n_uncertainties, n, n + nu + 1 + nw) of a stack, for a transition that takes ``dt`` seconds.

    Disturbances keep their bounds: where the bound of a remainder depends on the interval, its column is scaled.

    Raises
    ------
    ValueError
        If the remainder is known for the sampling time only.
    """
    if dt is None:
        return model.stack(model.schedule)[:, : model.n_states]
    assert model.origin is not None
    return _rows(model.origin, dt)


@lru_cache(maxsize=_MODELS)
def _own(origin: Origin) -> UncertainModel:
    found: UncertainModel = origin.model()
    return found


@lru_cache(maxsize=_KEPT)
def _rows(origin: Origin, dt: float) -> Array:
    own, other = _own(origin), origin.over(dt)
    rows = other.stack(other.schedule)[:, : own.n_states].copy()
    reach, wanted = (np.maximum(-lower, upper) for lower, upper, _ in (m.bounds(m.schedule) for m in (own, other)))
    E = rows[0, :, rows.shape[2] - reach.size :]
    size = np.abs(E) @ np.minimum(reach, wanted)
    for j in np.flatnonzero(reach != wanted).tolist():  # remainders, whose bounds are symmetric
        if reach[j] > 0.0:
            E[:, j] *= wanted[j] / reach[j] * (1.0 + _ROUNDING)
        elif not (wanted[j] * np.abs(E[:, j]) <= _ROUNDING * size).all():  # else it is what rounds the other columns
            raise ValueError(f"dt is {dt:g} s, with a remainder that transitions of {own.Ts:g} s do not have at all")
    rows.setflags(write=False)
    return rows

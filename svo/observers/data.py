"""What a user hands to an observer: checks of a sample's data and of settings that several observers have."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, finite_array, floats, is_finite_number, real_number
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel


def outputs_of(model: UncertainModel, y: ArrayLike) -> Array:
    """A measurement (ny,), NaN where a sensor is missing."""
    array = floats("y", y, missing=True)
    if array.shape != (model.n_outputs,):
        raise ValueError(f"y has shape {array.shape}; expected ({model.n_outputs},), one value a sensor")
    if math.isinf(math.hypot(*array.tolist())) and np.isinf(array).any():  # short arrays: the first is fastest
        raise ValueError(f"y is {array}; expected finite numbers, or NaN for a missing sensor")
    return array


def inputs_of(model: UncertainModel, name: str, u: ArrayLike | None, needed: bool) -> Array:
    """An input (nu,); zeros where it is not needed."""
    size = model.n_inputs
    if not needed or (u is None and size == 0):
        return np.zeros(size)
    if u is None:
        ways = "D or a D_i, an uncertainty of B, h of a nonlinear model, or jitter"
        why = f", since y depends on it by {ways}" if name != "u" else ""
        raise ValueError(f"{name} is missing; expected shape ({size},){why}")
    array = floats(name, u)
    if array.shape != (size,):
        raise ValueError(f"{name} has shape {array.shape}; expected ({size},), one value an input")
    if not (math.isfinite(math.hypot(*array.tolist())) or np.isfinite(array).all()):
        raise ValueError(f"{name} is {array}; expected finite numbers")
    return array


def inputs_ahead(
    model: UncertainModel | NonlinearModel, given: ArrayLike | None, now: Array
) -> tuple[Array, Array] | None:
    """Bounds (nu,) of the inputs that follow soon, among which is that of ``now``; None if none are given."""
    if given is None:
        return None
    if model.jitter is None:
        raise ValueError("u_range is given, and the stamps of the model's sensors are exact (no jitter): leave it out")
    lower, upper = finite_array("u_range", given, (2, model.n_inputs))
    if not ((lower <= now) & (now <= upper)).all():
        raise ValueError(f"u_range is from {lower} to {upper}; expected bounds that hold the sample's own input, {now}")
    return lower, upper


def check_schedule(model: UncertainModel | NonlinearModel, schedule: Any) -> None:
    """Raise an error if a model needs a schedule and there is none, or takes none and there is one."""
    if schedule is not None and isinstance(model, NonlinearModel):
        raise ValueError("schedule is given; a nonlinear model takes none, since it is linearised at each sample")
    if model.is_scheduled and schedule is None:
        raise ValueError("schedule is missing: the model has arrays that are functions of it, so pass schedule=...")


def check_may_start_by_step(model: UncertainModel) -> None:
    """Raise an error if the first transition needs the matrices of a sample that there was not."""
    if model.is_scheduled:
        raise ValueError(
            "step was called before update, and the model has arrays that are functions of the schedule: the first "
            "transition needs those of the first sample; call update(y0=..., schedule=...) first, with NaN in y0 if "
            "nothing is measured"
        )


def seconds_allowed(deadline: Any) -> float:
    """A deadline [s], not negative and not NaN; infinite is none."""
    return real_number("deadline", deadline, least=0.0, finite=False)


def stack_at(model: UncertainModel, schedule: Any) -> Array:
    """The stack of a model at a sample, all finite."""
    stack = model.stack(schedule)
    if not np.isfinite(stack).all():
        raise ValueError(f"the model's matrices at schedule {schedule!r} contain NaN or Inf; expected finite numbers")
    return stack


def directions_of(directions: ArrayLike, n: int) -> Array:
    """Directions (k, n) of a support."""
    return finite_array("directions", directions, ("k", n))


def relative_slack(eps: Any) -> float:
    """The slack ``eps`` of an observer's measurement rows."""
    if not (is_finite_number(eps) and eps >= 0):
        raise ValueError(f"eps is {eps}; expected a relative slack >= 0, such as 1e-9")
    return float(eps)

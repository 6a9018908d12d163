"""The set of first states that an observer is given: what it must be, and its box."""

from __future__ import annotations

import numpy as np

from polytopes import HPolytope
from svo.checks import Array, bounded_box
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel


def first_box(P: HPolytope, model: UncertainModel | NonlinearModel) -> tuple[Array, Array]:
    """Bounds of a set of first states of a model, within its physical range.

    Raises
    ------
    TypeError, ValueError
        If it is no set of so many states, empty, unbounded, or outside the physical range.
    """
    lower, upper = finite_box(P, model.n_states)
    if model.physical_range is not None:
        lower, upper, meets = model.physical_range.cut(lower, upper)
        if not meets:
            raise ValueError(
                "initial and the model's physical range have no common point; expected first states within it"
            )
    return lower, upper


def finite_box(P: HPolytope, n: int) -> tuple[Array, Array]:
    """Bounds of a set of first states, rounded outward where they had to be computed."""
    lower, upper = bounded_box("initial", P, n)
    given = len(P.C) == 0 and np.isin(P.A, (-1.0, 0.0, 1.0)).all() and (np.count_nonzero(P.A, axis=1) == 1).all()
    room = 0.0 if given else 1e-12 * np.maximum(np.abs(lower), np.abs(upper))
    return lower - room, upper + room

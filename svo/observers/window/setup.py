"""What an observer works out once: its template, its channels, what its output depends on, its set of first states."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from svo.checks import Array, real_array
from svo.models.model import UncertainModel
from svo.models.normal_form import NormalForm
from svo.models.stack import may_be_nonzero
from svo.models.state_range import StateRange
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window_kernel import channel_count


def jitter(size: int) -> Array:
    """Relative changes of the cost between 0.5 and 1 in units of 1e-11, signs mixed; always the same."""
    rng = np.random.default_rng(0)
    return 1e-11 * rng.uniform(0.5, 1.0, size) * rng.choice([-1.0, 1.0], size)


def template_rows(template: str | ArrayLike, n: int) -> Array:
    """Directions (r, n) besides the axes in which arrival sets are bounded."""
    if isinstance(template, str):
        if template != "box":
            raise ValueError(f"template is {template!r}; expected 'box' or an array (rows, {n}) of directions")
        return np.zeros((0, n))
    return real_array("template", template, ("rows", n), meaning="directions")


def channel_owners(model: UncertainModel) -> NDArray[np.int64]:
    """For each channel of a model in normal form, the item of the stack that it belongs to."""
    stack = model.stack(model.schedule)
    owners = [item for item in range(1, len(stack)) for _ in range(channel_count(stack[item]))]
    return np.array(owners, dtype=np.int64)


def output_is_disturbed(model: UncertainModel) -> bool:
    """Whether w or a channel may enter the output, at whatever schedule."""
    return may_be_nonzero(model.F, *(array for u in model.uncertainties for array in (u.C, u.D, u.c, u.F)))


def needs_next_input(model: UncertainModel) -> bool:
    """Whether a step needs u(k+1), for an observer whose output and state share each Delta.

    Where a Delta of B is also one of the output, y(k+1) tells of the Delta that acts on u(k+1).
    """
    shared = (may_be_nonzero(u.B) and may_be_nonzero(u.C, u.c, u.F) for u in model.uncertainties)
    return model.uses_input_in_output or any(shared)


def joint_rows(P: HPolytope) -> tuple[Array, Array, Array]:
    """Rows of a polytope that are no bounds on single variables, two-sided; equalities have both sides equal."""
    rows = np.vstack([P.A, P.C])
    lower = np.concatenate([np.full(len(P.b), -np.inf), P.d])
    upper = np.concatenate([P.b, P.d])
    joint = np.count_nonzero(rows, axis=1) > 1
    return rows[joint], lower[joint], upper[joint]


def disturbance_rows(form: NormalForm) -> tuple[Array, Array, Array]:
    """Rows on several disturbances, in normal form, with their bounds as they are given."""
    polytope = form.given.disturbance_polytope
    if polytope is None:
        return np.zeros((0, form.given.n_disturbances)), np.zeros(0), np.zeros(0)
    rows, lower, upper = joint_rows(polytope)
    return rows * form.w, lower, upper


def check_first_states(P: HPolytope, n: int) -> None:
    """Raise an error unless a set of first states is one, of n states, and not empty."""
    if not isinstance(P, HPolytope):
        raise TypeError(f"initial is {type(P).__name__}; expected an HPolytope, such as HPolytope.box(lower, upper)")
    if P.dim != n:
        raise ValueError(f"initial has dimension {P.dim}; expected {n}, the number of states")
    if P.emptiness().status != "nonempty":
        raise ValueError("initial is empty, or not surely nonempty; expected a bounded set of first states")


def within(physical: StateRange | None, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds of a set of first states, cut to the physical range."""
    if physical is None:
        return lower, upper
    lower, upper, meets = physical.cut(lower, upper)
    if not meets:
        raise ValueError("initial and the model's physical range have no common point; expected first states within it")
    return lower, upper


def first_states(P: HPolytope, model: UncertainModel) -> ArrivalSet:
    """A set of first states of a model: its box, within the physical range, and its rows on several states."""
    return ArrivalSet(*within(model.physical_range, *finite_box(P, model.n_states)), *joint_rows(P))


def finite_box(P: HPolytope, n: int) -> tuple[Array, Array]:
    """Bounds of a set of first states, rounded outward where they had to be computed."""
    check_first_states(P, n)
    lower, upper = (np.asarray(b, dtype=float) for b in P.bounding_box())
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise ValueError(
            "initial is unbounded; expected a bounded set of first states, such as a box as large as they can be: "
            "the measurements shrink it"
        )
    given = len(P.C) == 0 and np.isin(P.A, (-1.0, 0.0, 1.0)).all() and (np.count_nonzero(P.A, axis=1) == 1).all()
    room = 0.0 if given else 1e-12 * np.maximum(np.abs(lower), np.abs(upper))
    return lower - room, upper + room

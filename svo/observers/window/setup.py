"""What an observer works out once: its template, its channels, what its output depends on, its set of first states."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from svo.checks import Array, expect, real_array
from svo.models import NormalForm, UncertainModel, may_be_nonzero
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window_kernel import channel_count


def jitter(size: int) -> Array:
    """Relative changes of the cost between 0.5 and 1 in units of 1e-11, signs mixed; always the same."""
    rng = np.random.default_rng(0)
    return 1e-11 * rng.uniform(0.5, 1.0, size) * rng.choice([-1.0, 1.0], size)


def template_rows(template: str | ArrayLike, n: int) -> Array:
    """Directions (r, n) besides the axes in which arrival sets are bounded."""
    if isinstance(template, str):
        expect(template == "box", "template", template, f"'box' or an array (rows, {n}) of directions")
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


def rows_on_w(model: UncertainModel) -> tuple[Array, Array, Array]:
    """Rows on several disturbances of a model, with their bounds."""
    polytope = model.disturbance_polytope
    if polytope is None:
        return np.zeros((0, model.n_disturbances)), np.zeros(0), np.zeros(0)
    return joint_rows(polytope)


def disturbance_rows(form: NormalForm) -> tuple[Array, Array, Array]:
    """The same in normal form, with their bounds as they are given."""
    rows, lower, upper = rows_on_w(form.given)
    return rows * form.w, lower, upper


def arrival_of(P: HPolytope, lower: Array, upper: Array) -> ArrivalSet:
    """A set of first states: its box, and its rows on several states."""
    return ArrivalSet(lower, upper, *joint_rows(P))

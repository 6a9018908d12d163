"""Bounds of a model that may give way: which are meant, what a widening of one is measured by, the widened model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.models import NormalForm, UncertainModel

Kind = Literal["noise", "disturbance", "Delta"]
_KINDS: dict[str, Kind] = {"noise": "noise", "disturbances": "disturbance", "deltas": "Delta"}


@dataclass(frozen=True)
class Bound:
    """A bound that may be widened at either end, in the given units.

    A widening costs its size relative to ``scale``: the half-width ``half``, or where that is zero the unit of the
    normal form, which comes from the sizes of what the bound adds to and moves along with the user's units.
    """

    kind: Kind
    index: int
    name: str
    half: float
    scale: float


def bounds_of(form: NormalForm, wanted: Sequence[str]) -> tuple[Bound, ...]:
    """The bounds that are meant by kinds ("noise", "disturbances", "deltas") and names ("noise alpha").

    Raises
    ------
    ValueError
        For an unknown name, a disturbance polytope, and a Delta that multiplies states or disturbances.
    """
    model, every = form.given, _every_bound(form)
    for name in wanted:
        if name not in _KINDS and name not in {bound.name for bound in every}:
            known = ", ".join([*_KINDS, *(bound.name for bound in every)])
            raise ValueError(f"bounds contains {name!r}; expected any of {known}")
    chosen = tuple(b for b in every if b.name in wanted or any(_KINDS.get(name) == b.kind for name in wanted))
    if model.disturbance_polytope is not None and any(b.kind == "disturbance" for b in chosen):
        raise ValueError(
            "bounds contains disturbances, but w is a polytope; give it as a box, or leave the disturbances out"
        )
    factors = known_factors(model, model.stack(model.schedule))
    for bound in chosen:
        if bound.kind == "Delta" and not factors[bound.index]:
            raise ValueError(not_linear(bound.name))
    return chosen


def widened(model: UncertainModel, chosen: Sequence[Bound], amounts: Array) -> UncertainModel:
    """The model with bounds widened by amounts (bounds,), in their own units."""
    extra = {(b.kind, b.index): float(a) for b, a in zip(chosen, amounts, strict=True) if a > 0.0}
    changes: dict[str, Any] = {}
    noise = np.array([extra.get(("noise", i), 0.0) for i in range(model.n_outputs)])
    if noise.any():
        changes["n"] = _shifted(model, 2, noise)
    w = np.array([extra.get(("disturbance", j), 0.0) for j in range(model.n_disturbances)])
    if w.any():
        changes["w"] = (_shifted(model, 0, -w), _shifted(model, 1, w))
    if any(kind == "Delta" for kind, _ in extra):
        more = [extra.get(("Delta", i), 0.0) for i in range(len(model.uncertainties))]
        changes["uncertainties"] = [
            replace(q, bounds=(q.bounds[0] - m, q.bounds[1] + m))
            for q, m in zip(model.uncertainties, more, strict=True)
        ]
    return model.replace(**changes)


def _shifted(model: UncertainModel, which: int, shift: Array) -> Array | Callable[[Any], Array]:
    """One of `UncertainModel.bounds`, moved; a function of the schedule if the model is scheduled."""
    if model.is_scheduled:
        return lambda schedule: model.bounds(schedule)[which] + shift
    return model.bounds()[which] + shift


def _every_bound(form: NormalForm) -> list[Bound]:
    model = form.given
    lower, upper, noise = model.bounds(model.schedule)
    deltas = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
    groups: list[tuple[Kind, Sequence[str], Array, Array]] = [
        ("noise", _names(model, "outputs", len(noise)), noise, form.y),
        ("disturbance", _names(model, "disturbances", len(lower)), (upper - lower) / 2, form.w),
        (
            "Delta",
            [q.name or str(i) for i, q in enumerate(model.uncertainties)],
            np.diff(deltas)[:, 0] / 2,
            np.ones(len(deltas)),
        ),
    ]
    return [
        Bound(kind, i, f"{kind} {name}", float(half), float(half or unit))
        for kind, names, halves, units in groups
        for i, (name, half, unit) in enumerate(zip(names, halves, units, strict=True))
    ]


def _names(model: UncertainModel, key: str, size: int) -> Sequence[str]:
    given = (model.names or {}).get(key)
    return given if given is not None else [str(i) for i in range(size)]


def known_factors(model: UncertainModel, stacks: Array) -> NDArray[np.bool_]:
    """Whether each Delta (ni,) multiplies nothing but inputs and constants in these stacks."""
    n, nu = model.n_states, model.n_inputs
    unknown = np.delete(stacks[1:], np.s_[n : n + nu + 1], axis=2) != 0.0
    return np.array([not part.any() for part in unknown], dtype=bool)


def not_linear(name: str, where: str = "") -> str:
    return (
        f"bounds contains {name}, which multiplies states or disturbances{where}: its widening is not a linear "
        "program; leave it out"
    )

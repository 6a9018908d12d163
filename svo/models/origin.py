"""Where a discrete model comes from: the continuous plant behind it, and changes of that plant (faults)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from svo.checks import Array, finite_array
from svo.models.discretisation import (
    Plant,
    bounds_in,
    check_constant,
    largest,
    left_out,
    vary_in,
    wandering,
    zero_order_hold,
)
from svo.models.held import Varying
from svo.models.stack import STATE_BLOCKS
from svo.models.stamps import StampErrors, jitter_of
from svo.models.uncertainty import Uncertainty

Change = Callable[[Plant], Plant]
_ALIKE_IN_BOTH_TIMES = frozenset({"C", "D", "c", "n", "names", "physical", "largest"})


@dataclass(frozen=True, eq=False)
class Origin(Shown):
    """The continuous plant that a discrete model was made from.

    Attributes
    ----------
    plant : svo.UncertainModel
        Its arrays are those of dx/dt = ...; never observed.
    remainder, varying, jitter
        As given to `UncertainModel.from_continuous`.
    overwritten : bool
        Whether the discrete model got arrays of discrete time since.
    """

    plant: Plant
    remainder: Any = None
    varying: str | Sequence[str] = ()
    overwritten: bool = False
    jitter: Any = None

    @cached_property
    def stamps(self) -> StampErrors | None:
        """What the sensors' stamps make of their readings; None if they are exact."""
        jitter = jitter_of(self.jitter, self.plant.n_outputs)
        return None if jitter is None else StampErrors(self.plant, jitter)

    def model(self) -> Plant:
        """The discrete model; raises as `UncertainModel.from_continuous`."""
        check_constant(vars(self.plant))
        return replace(self._discrete(self.plant), origin=self)

    def _discrete(self, plant: Plant) -> Plant:
        vary = vary_in(plant, self.varying)
        return _discretised(plant, self._width(plant, vary), vary, vary.delta | (self.stamps is not None))

    def over(self, dt: float) -> Plant:
        """The discrete model of transitions that take ``dt`` seconds; it has no origin.

        Raises
        ------
        ValueError
            If ``remainder`` is in numbers, which are of the sampling time.
        """
        if self.remainder is not None and not isinstance(self.remainder, Mapping):
            raise ValueError(
                f"dt is {dt:g} s, and remainder is given in numbers, which are of the sampling time "
                f"{self.plant.Ts:g} s; give remainder = {{'states': ..., 'inputs': ...}}, from which it is computed"
            )
        plant = copy(self.plant)  # which has been checked
        object.__setattr__(plant, "Ts", dt)
        return self._discrete(plant)

    def after(self, changes: Mapping[str, Any]) -> Origin:
        """The origin of the discrete model once some of its arguments were replaced."""
        if not changes.keys() <= _ALIKE_IN_BOTH_TIMES:
            if self.stamps is not None:
                raise ValueError(
                    f"{', '.join(sorted(changes.keys() - _ALIKE_IN_BOTH_TIMES))} would be of discrete time, and jitter "
                    "needs the plant in continuous time; change that by in_given_time"
                )
            return replace(self, overwritten=True)
        kept = dict(changes)
        if kept.get("names") is not None:  # the discrete model has more disturbances
            own = {key: v for key, v in (self.plant.names or {}).items() if key == "disturbances"}
            kept["names"] = {key: v for key, v in kept["names"].items() if key != "disturbances"} | own
        return replace(self, plant=self.plant.replace(**kept))

    def changed(self, change: Change, remainder: Any = None) -> Plant:
        """The discrete model of the plant after a change of its continuous arrays.

        Raises
        ------
        ValueError
            If the discrete model got arrays since, or ``remainder`` has to be given anew.
        """
        if self.overwritten:
            raise ValueError(
                "the model was made by from_continuous and then got arrays of discrete time, so a fault could be meant "
                "in either time; give the fault the model as from_continuous made it, or, for a fault whose arrays are "
                "those of discrete time, model.replace(origin=None)"
            )
        plant = change(self.plant)
        if remainder is None:
            self._check_still_bounded(plant)
        return replace(self, plant=plant, remainder=self.remainder if remainder is None else remainder).model()

    def direction(self, item: Uncertainty) -> Uncertainty:
        """What an uncertainty of the plant adds to the next sample per Delta, to first order."""
        return _directions(zero_order_hold(self.plant.block("A"), np.eye(self.plant.n_states), self.plant.Ts)[1], item)

    def _check_still_bounded(self, plant: Plant) -> None:
        """Numbers bound what the arrays leave out that they were given for."""
        if self.remainder is None or isinstance(self.remainder, Mapping):
            return
        vary = vary_in(plant, self.varying)
        needs = [_leaves_something_out(*item) for item in zip(plant.uncertainties, vary.delta, strict=True)]
        known = {id(item) for item in self.plant.uncertainties}
        new = [item for item, need in zip(plant.uncertainties, needs, strict=True) if need and id(item) not in known]
        if new or (any(needs) and plant.A is not self.plant.A):
            raise ValueError(
                "remainder is given in numbers, which bound what the healthy plant's discretisation leaves out and not "
                f"that of {new[0].name or 'the fault' if new else 'another A'}; give remainder = "
                "{'states': ..., 'inputs': ...}, the largest absolute values of states and inputs of the healthy and "
                "the faulty plant, from which it is computed for each"
            )

    def _width(self, plant: Plant, vary: Varying) -> Array | None:
        """Bounds (n,) of what is left out for the uncertainties of a plant; None where nothing is."""
        n, given = plant.n_states, self.remainder
        if isinstance(given, Mapping):
            unknown = given.keys() - {"states", "inputs"}
            if unknown or "states" not in given:
                raise ValueError(f"remainder has the keys {sorted(given)}; expected 'states' and 'inputs'")
            x = largest("remainder['states']", given["states"], n)
            u = largest("remainder['inputs']", given.get("inputs"), plant.n_inputs)
            return left_out(plant, x, u, vary)
        if given is not None:
            width = finite_array("remainder", given)
            if width.shape not in ((), (n,)) or (width < 0).any():
                raise ValueError(f"remainder is {width} of shape {width.shape}; expected bounds >= 0 of shape ({n},)")
            return np.broadcast_to(width, (n,))
        items = zip(plant.uncertainties, vary.delta, strict=True)
        if any(_leaves_something_out(*item) for item in items) or _product_varies(plant, vary):
            raise ValueError(
                f"remainder is missing: give the bound ({n},) of what the first-order discretisation leaves out, or "
                "remainder = {'states': ..., 'inputs': ...}, the largest absolute values of states and inputs, from "
                "which it is computed (svo.models.remainder.remainder_bound)"
            )
        return None


def _leaves_something_out(item: Uncertainty, varies: bool) -> bool:
    """A held Delta without A is exact: what it multiplies is held too."""
    return item.A is not None or (bool(varies) and any(getattr(item, name) is not None for name in STATE_BLOCKS))


def _product_varies(plant: Plant, vary: Varying) -> bool:
    return bool(vary.w.any()) and any(item.E is not None for item in plant.uncertainties)


def _discretised(plant: Plant, width: Array | None, vary: Varying, parted: NDArray[np.bool_]) -> Plant:
    """The discrete model, with |remainder| <= ``width`` (n,); a Delta is ``parted`` between output and state."""
    A, Ts = plant.block("A"), plant.Ts
    step, gamma = zero_order_hold(A, np.eye(len(A)), Ts)
    arrays: dict[str, Any] = {"A": step}
    for name in "BaE":
        if getattr(plant, name) is not None:
            held = zero_order_hold(A, plant.block(name).reshape(len(A), -1), Ts)[1]
            arrays[name] = held[:, 0] if name == "a" else held
    if vary.w.any() and plant.E is not None:
        common, shift, rest = wandering(plant, vary.w)
        arrays["E"] = arrays["E"].copy()
        arrays["E"][:, vary.w] = common
        arrays["a"] = arrays.get("a", 0.0) + shift
        width = rest if width is None else width + rest
    items = [_directions(gamma, item) for item in plant.uncertainties]
    if width is not None:
        arrays, items = _with_more_disturbances(plant, arrays, items, width, vary.w)
    parts = [part for item, two in zip(items, parted, strict=True) for part in _parted(item, bool(two))]
    return replace(plant, **arrays, uncertainties=parts)


def _directions(gamma: Array, item: Uncertainty) -> Uncertainty:
    given = {name: getattr(item, name) for name in STATE_BLOCKS}
    return replace(item, **{k: gamma @ np.asarray(v, dtype=float) for k, v in given.items() if v is not None})


def _parted(item: Uncertainty, two: bool) -> list[Uncertainty]:
    """A Delta that varies has a mean over the sample for the state, and a value at its reading for the output."""
    names = "CDcF"
    if not two or all(getattr(item, name) is None for name in names):
        return [item]
    output = Uncertainty(**{name: getattr(item, name) for name in names}, bounds=item.bounds, name=item.name)
    if all(getattr(item, name) is None for name in STATE_BLOCKS):
        return [item]
    return [output, replace(item, C=None, D=None, c=None, F=None)]


def _with_more_disturbances(
    plant: Plant, arrays: dict[str, Any], items: list[Uncertainty], width: Array, varies: NDArray[np.bool_]
) -> tuple[dict[str, Any], list[Uncertainty]]:
    """The means of those that vary and are measured too, since a mean is no value at a sample; then one a state."""
    n, nw = plant.n_states, plant.n_disturbances
    measured = [bool(np.any(_constant(F))) for F in (plant.F, *(item.F for item in items))]
    parted = np.flatnonzero(varies & any(measured))
    lower, upper, _ = bounds_in(plant)

    def in_state(E: Any, last: Array) -> Array:
        E = np.zeros((n, nw)) if E is None else np.array(E, dtype=float)
        means = E[:, parted].copy()
        E[:, parted] = 0.0
        return np.hstack([E, means, last])

    def in_output(F: Any) -> Any:
        return None if F is None else np.hstack([_constant(F), np.zeros((plant.n_outputs, parted.size + n))])

    more: dict[str, Any] = {
        "E": in_state(arrays.get("E"), np.eye(n)),
        "F": in_output(plant.F),
        "w": (np.concatenate([lower, lower[parted], -width]), np.concatenate([upper, upper[parted], width])),
        "names": _more_names(plant, parted),
    }
    padded = [replace(q, E=None if q.E is None else in_state(q.E, np.zeros((n, n))), F=in_output(q.F)) for q in items]
    return arrays | more, padded


def _constant(F: Any) -> Array:
    if callable(F):
        raise ValueError("F is a function; from_continuous takes a constant F where something is left out")
    return np.zeros((0, 0)) if F is None else np.asarray(F, dtype=float)


def _more_names(plant: Plant, parted: NDArray[np.intp]) -> Any:
    names = plant.names
    if names is None:
        return None
    own = list(names.get("disturbances", [f"w[{j}]" for j in range(plant.n_disturbances)]))
    states = names.get("states", [f"x[{i}]" for i in range(plant.n_states)])
    more = [*own, *(f"mean of {own[j]}" for j in parted), *(f"remainder of {state}" for state in states)]
    return {**names, "disturbances": more}

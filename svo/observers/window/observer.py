"""The moving-horizon set-valued observer: lifted rows, one linear program decides, a smoothed arrival set."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.signatures import options_by_name
from svo.checks import Array, is_count
from svo.models.model import UncertainModel
from svo.models.normal_form import NormalForm
from svo.observers import window_kernel as kernel
from svo.observers.answers import VerdictName
from svo.observers.base import Observer
from svo.observers.data import relative_slack
from svo.observers.first_states import first_box
from svo.observers.given_units import arrival_in
from svo.observers.saved_state import take_exactly
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.restart import RestartingWindow
from svo.observers.window.setup import arrival_of, template_rows
from svo.observers.window.step import WindowStep


class WindowObserver(RestartingWindow, Observer):
    """Set-valued observer over a moving window of N steps (the lifted form of paper 002, section 2).

    The window holds the state at its first sample, every disturbance and every channel of uncertainty since;
    measurements inside it stay valid, and one linear program a sample decides whether anything explains them.
    When the window slides, the new first state is bounded in the template's directions by all data of the
    window. It slides by 2 N // 5 samples at once (at least one), so that it holds at least N steps, and those
    samples share the programs of the arrival set.

    Parameters
    ----------
    model : UncertainModel
    initial : HPolytope
        Bounded set that contains the state at the first sample.
    horizon : int or None
        Steps N >= 1 in the window; None keeps all data since the start (full information, memory O(K^2)).
    template : "box" or (r, n) array
        Directions, besides the axes, in which the arrival set is bounded.
    eps : float
        Every measurement row is widened by eps (|y| + |C||x|max + |D u| + |c| + |F| wmax + n), for the rounding
        of the data.
    sign_split : int
        Largest number of cells, by the signs of s of its channels p = Delta s, that a program is split into where
        the convex hull of p is not exact: with enough of them sets and verdicts of models of rank-one
        uncertainties are exact for the window. 0 keeps the hull. Costs a solution from scratch a cell; steps with
        a deadline keep the hull.

    Notes
    -----
    Guarantees. The true state stays inside `Step.set` and the verdict is never "falsified" while the plant
    keeps to the model; "falsified" comes with a `WindowCertificate` that was checked in exact arithmetic.
    After it the observer stays falsified until `reset`.

    Where exact sensors read the disturbance (F square and invertible, no noise), w leaves the program at samples
    with all sensors, by itself (`svo.observers.window.output_injection`).
    """

    kind = "window"
    takes_deadline = takes_late = saves_state = starts_without_set = True

    @options_by_name
    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        horizon: int | None = 10,
        *,
        template: str | ArrayLike = "box",
        eps: float = 1e-9,
        sign_split: int = 0,
    ) -> None:
        super().__init__(model)
        if horizon is not None and not is_count(horizon, 1):
            raise ValueError(f"horizon is {horizon!r}; expected an integer number of steps >= 1, or None for all data")
        slack = relative_slack(eps)
        if not is_count(sign_split, 0):
            raise ValueError(f"sign_split is {sign_split!r}; expected a number of cells >= 0 (0 = convex hulls)")
        rows = template_rows(template, model.n_states)
        lower, upper = first_box(initial, model)
        form = NormalForm.at(model, lower, upper)
        self._configure(form, horizon, rows * form.x, slack, int(sign_split))
        self._reset(initial, lower, upper)

    @property
    def needs_next_input(self) -> bool:
        return self._wants_next_input

    # -- the hooks -------------------------------------------------------------------------------

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self._begin_first(arrival_in(arrival_of(set, lower, upper), self._form))

    def _update(self, y: Array, u: Array, schedule: Any) -> WindowStep:
        return self._sample(True, np.zeros(self.model.n_inputs), u, y, schedule)

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> WindowStep:
        if self.horizon is None and not self._lost and self._time + 1 >= self._size.N:
            self._grow()
        return self._sample(False, u, u_next, y, schedule, end)

    def _late_update(self, y: Array, sample: int) -> WindowStep:
        return self._said(self._take_late(self._form.outputs(y), sample))

    def _options(self) -> dict[str, Any]:
        rows, horizon, cells = self._template / self._form.x, self.horizon, self.sign_split
        return {"horizon": horizon, "template": rows, "eps": self.eps, "sign_split": cells}

    def _state(self) -> dict[str, NDArray[Any]]:
        settings = np.array([-1.0 if self.horizon is None else self.horizon, self._size.N, self.eps, self.sign_split])
        first = {f"initial.{f.name}": getattr(self._initial, f.name) for f in fields(self._initial)}
        last = dict(zip(("w_old_lower", "w_old_upper"), self._last_bounds or (), strict=False))
        falsified = np.array(float(self._alarm is not None))
        state = {"settings": settings, "falsified": falsified, "template": self._template, **first, **last}
        return state | self._form.state_dict() | self._arrays | self._restart_state()

    def _set_up(self, model: UncertainModel, state: Mapping[str, NDArray[Any]]) -> None:
        horizon, _, eps, cells = (float(v) for v in state["settings"])
        form = NormalForm.from_state_dict(model, state)
        self._configure(form, None if horizon < 0 else int(horizon), state["template"], eps, int(cells))

    def _resume(self, state: Mapping[str, NDArray[Any]]) -> WindowStep | None:
        steps, falsified = int(state["settings"][1]), bool(state["falsified"])
        self._begin_first(ArrivalSet(**{f.name: np.array(state[f"initial.{f.name}"]) for f in fields(ArrivalSet)}))
        self._restore_restart(state, steps)
        take_exactly(self._arrays, state)
        if not self._lost:
            self._number = self._origin + self._time if self._arrays["clock"][kernel.STARTED] else -1
        if "w_old_lower" in state:
            self._last_bounds = (np.array(state["w_old_lower"]), np.array(state["w_old_upper"]))
        self._check_restored(falsified)
        return self._said("falsified") if falsified else None

    def _warm_up(self) -> None:
        other = copy(self)
        other._forget()
        other._begin_first(self._initial)
        y, u = np.full(self.model.n_outputs, np.nan), np.zeros(self.model.n_inputs)
        schedule = self.model.schedule
        other.update(y, u, schedule)
        other.step(u, y, u, schedule).box  # noqa: B018
        other.step(u, y, u, schedule, deadline=0.0)
        other.late_update(y, other.window[0])
        kernel.channel_factors(self._form.model.stack(schedule), self._owner, self._arrays["delta"])

    @property
    def stopped(self) -> int:
        """Programs so far that ended at the limit of pivots or of the basis: their bounds hold, yet could be less."""
        return int(self._arrays["clock"][kernel.STOPS])

    @property
    def directions(self) -> Array:
        """Directions (nt, n) in which the arrival set and `WindowStep.set` are bounded: the axes, then the template."""
        return np.vstack([np.eye(self.model.n_states), self._template / self._form.x])

    def bounds_at(self, sample: int) -> tuple[Array, Array]:
        """Bounds of the state at the newest sample in `directions`; the axes come first."""
        self._check_current(sample)
        unit = np.append(self._form.x, np.ones(len(self._template)))
        lower, upper = self._newest_bounds()
        return lower * unit, upper * unit

    def support_at(self, sample: int, directions: Array) -> Array:
        """Bounds of the state at the newest sample in any directions."""
        self._check_current(sample)
        values = np.full(len(directions), np.inf)
        for i, direction in enumerate(directions if not self._lost else ()):
            self._arrays["query"][:] = direction * self._form.x
            self._solve(kernel.QUERY)
            values[i] = self._arrays["answer"][0]
        physical = self.model.physical_range
        return values if physical is None else np.minimum(values, physical.support(directions))

    # -- inside ----------------------------------------------------------------------------------

    def _sample(
        self, first: bool, u: Array, u_next: Array, y: Array, schedule: Any, end: float | None = None
    ) -> WindowStep:
        form, self._reading = self._form, y
        stack, (*w, noise) = form.model.stack(schedule), form.model.bounds(schedule)
        known = form.inputs(u), form.inputs(u_next), form.outputs(y)
        data = (self._window, self._size, first, *known, stack, noise, *(self._last_bounds or w), *w)
        verdict = self._answer(data, end)
        self._last_bounds = w[0], w[1]
        return self._said(verdict)

    def _said(self, verdict: VerdictName) -> WindowStep:
        reason = self._reason if verdict == "undecided" else None
        return WindowStep(self, verdict=verdict, certificate=self._falsified, reason=reason)

    def _check_current(self, sample: int) -> None:
        if sample != self._number or self._alarm is not None:
            came = "late data" if sample == self._number else f"sample {self._number}"
            raise ValueError(
                f"the set of sample {sample} was not read before {came}; read it right after its step, or use run(log)"
            )

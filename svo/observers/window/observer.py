"""The moving-horizon set-valued observer: lifted rows, one linear program decides, a smoothed arrival set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array, is_count, is_finite_number
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel, expect_model
from svo.models.normal_form import NormalForm
from svo.observers import window_kernel as kernel
from svo.observers.base import VerdictName
from svo.observers.data import (
    check_may_start_by_step,
    check_schedule,
    inputs_shaped,
    outputs_shaped,
    seconds_allowed,
)
from svo.observers.given_units import arrival_in
from svo.observers.saved_state import check_model, check_unchanged, last_schedule, sealed, take_exactly
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.programs import ENTRY_ERRORS
from svo.observers.window.restart import RestartingWindow
from svo.observers.window.setup import first_states, template_rows
from svo.observers.window.step import WindowRecord, WindowStep


class WindowObserver(RestartingWindow):
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

    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        horizon: int | None = 10,
        template: str | ArrayLike = "box",
        eps: float = 1e-9,
        sign_split: int = 0,
    ) -> None:
        expect_model("model", model)
        if horizon is not None and not is_count(horizon, 1):
            raise ValueError(f"horizon is {horizon!r}; expected an integer number of steps >= 1, or None for all data")
        if not (is_finite_number(eps) and eps >= 0):
            raise ValueError(f"eps is {eps}; expected a relative slack >= 0, such as 1e-9")
        if not is_count(sign_split, 0):
            raise ValueError(f"sign_split is {sign_split!r}; expected a number of cells >= 0 (0 = convex hulls)")
        rows = template_rows(template, model.n_states)
        first = first_states(initial, model)
        form = NormalForm.at(model, first.box_lower, first.box_upper)
        self._configure(form, horizon, rows * form.x, eps, int(sign_split))
        self._begin_first(arrival_in(first, form))

    # -- the protocol ----------------------------------------------------------------------------

    def reset(self, set: HPolytope) -> None:
        """Forget all data; the state at the next measurement lies in ``set``.

        Raises
        ------
        ValueError
            If the set is empty, unbounded or of the wrong dimension, or outside the model's physical range.
        """
        self._begin_first(arrival_in(first_states(set, self.model), self._form))

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> WindowStep:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : (ny,) array
            NaN = that sensor is missing.
        u : (nu,) array, optional
            Needed where `step` needs ``u_next``.
        schedule : optional
            Scheduling value at this sample.
        """
        begun = perf_counter()
        if self._started:
            raise ValueError("update was called after the first sample; use step(u, y), or reset(set) to start again")
        y = outputs_shaped(self.model, y0)
        inputs = inputs_shaped(self.model, "u", u, self._wants_next_input)
        stack, (w_lower, w_upper, noise) = self._evaluate(schedule)
        return self._sample(True, np.zeros(self.model.n_inputs), inputs, y, stack, noise, (w_lower, w_upper), begun)

    def step(
        self,
        u: ArrayLike | None,
        y: ArrayLike,
        u_next: ArrayLike | None = None,
        schedule: Any = None,
        deadline: float | None = None,
    ) -> WindowStep:
        """One transition x(k) -> x(k+1) driven by u, then the measurement y at k + 1.

        Parameters
        ----------
        u : (nu,) array
        y : (ny,) array
            NaN = that sensor is missing; all NaN = prediction only.
        u_next : (nu,) array, optional
            u(k+1); needed only if D or a D_i is not zero, or if an uncertainty of B reaches the output: B_i, and C_i,
            c_i or F_i, are not zero for one i.
        schedule : optional
            Scheduling value at the sample of y; it also gives the matrices of the next transition.
        deadline : float, optional
            Seconds >= 0 after which the programs stop where they are: the arrival set is then wider but still
            contains the state, and the verdict is "undecided" if emptiness could not be decided. What is left
            then takes a few microseconds a direction. The exact proof of an alarm, a few milliseconds once, is
            not cut short. Results depend on the machine's speed.

        Raises
        ------
        ValueError
            For a wrong shape, an infinite or missing value, a schedule that gives no finite matrices, or a scheduled
            model whose first call is not `update`. The observer is unchanged.
        """
        begun = perf_counter()
        end = None if deadline is None else begun + seconds_allowed(deadline)
        outputs = outputs_shaped(self.model, y)
        inputs = inputs_shaped(self.model, "u", u, True)
        following = inputs_shaped(self.model, "u_next", u_next, self._wants_next_input)
        if self._falsified is not None:
            return self._step("falsified", begun)
        if not self._started:
            check_may_start_by_step(self.model)
        stack, (w_lower, w_upper, noise) = self._evaluate(schedule)
        if not self._started:
            self.update(np.full(self.model.n_outputs, np.nan), inputs, schedule)
        if self.horizon is None and not self._lost and self._time + 1 >= self._size.N:
            self._grow()
        return self._sample(False, inputs, following, outputs, stack, noise, (w_lower, w_upper), begun, end)

    def late_update(self, y: ArrayLike, sample: int) -> WindowStep:
        """A measurement that arrives after its sample, while that sample is still in the window.

        Its rows stand where they would have stood; the answer is about the newest sample, as that of the last
        `step`, which it replaces. Alarms and their certificates, saved states and sets then include it.

        Parameters
        ----------
        y : (ny,) array
            Measured at ``sample``; NaN for the sensors that did not arrive now.
        sample : int
            Number of that sample (`WindowStep.sample` counts from 0), within `window`.

        Raises
        ------
        ValueError
            For a sample outside the window, a sensor that has been read there already, or a bad ``y``. The
            observer is unchanged.
        """
        begun = perf_counter()
        self.check_late(y, sample)
        if self._falsified is not None:
            return self._step("falsified", begun)
        return self._step(self._take_late(self._form.outputs(outputs_shaped(self.model, y)), sample), begun)

    def check_late(self, y: ArrayLike, sample: int) -> None:
        """Raise what `late_update` would raise; nothing changes."""
        outputs = outputs_shaped(self.model, y)
        if self._falsified is not None:
            return
        first, last = self.window
        if not (isinstance(sample, int | np.integer) and first <= sample <= last):
            raise ValueError(f"sample is {sample!r}; expected one in the window, which holds {first} to {last}")
        if np.isinf(outputs).any():
            raise ValueError(ENTRY_ERRORS[kernel.BAD_OUTPUT].format(y=y))
        read = ~np.isnan(outputs) & ~np.isnan(self._read_at(sample))
        if read.any():
            raise ValueError(f"y has a value of sensor {int(np.argmax(read))}, which was already read at {sample}")

    @property
    def window(self) -> tuple[int, int]:
        """First and last sample that the window holds.

        Raises
        ------
        ValueError
            Before the first sample.
        """
        if not self._started:
            raise ValueError("there is no sample yet; call update(y0), with NaN if there is no measurement")
        return self._oldest, self._number

    @property
    def options(self) -> dict[str, Any]:
        """What besides model and sets decides what the observer answers: it is part of what names a saved state."""
        rows, horizon, cells = self._template / self._form.x, self.horizon, self.sign_split
        return {"kind": "window", "horizon": horizon, "template": rows, "eps": self.eps, "sign_split": cells}

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next steps depend on, as named arrays (for ``numpy.savez``).

        Raises
        ------
        TypeError
            If the schedule of the last sample is no number or array of numbers.
        """
        settings = np.array([-1.0 if self.horizon is None else self.horizon, self._size.N, self.eps, self.sign_split])
        first = {f"initial.{f.name}": getattr(self._initial, f.name) for f in fields(self._initial)}
        last = dict(zip(("w_old_lower", "w_old_upper"), self._last_bounds or (), strict=False))
        falsified = np.array(float(self._falsified is not None))
        state = {"settings": settings, "falsified": falsified, "template": self._template, **first, **last}
        state |= self._form.state_dict() | self._arrays | self._restart_state()
        return sealed(state, self.model, self.options, self._schedule)

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: Mapping[str, Array]) -> WindowObserver:
        """The observer that `state_dict` described, to continue bit for bit with the same model.

        Raises
        ------
        ValueError
            If the state is not that of a window observer of this very model, or was changed since.
        """
        try:
            check_unchanged(state)
            horizon, steps, eps, cells = (float(v) for v in state["settings"])
            initial = ArrivalSet(**{f.name: np.array(state[f"initial.{f.name}"]) for f in fields(ArrivalSet)})
            observer = cls.__new__(cls)
            form = NormalForm.from_state_dict(model, state)
            observer._configure(form, None if horizon < 0 else int(horizon), state["template"], eps, int(cells))
            observer._begin_first(initial)
            observer._restore_restart(state, int(steps))
            take_exactly(observer._arrays, state)
            check_model(state, model, observer.options)
            observer._schedule = last_schedule(state)
            if "w_old_lower" in state:
                observer._last_bounds = (np.array(state["w_old_lower"]), np.array(state["w_old_upper"]))
            observer._check_restored(bool(state["falsified"]))
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"state does not belong to a window observer of this model: {error}") from error
        return observer

    def run(self, log: Log) -> WindowRecord:
        """All samples of a log, with the box of the state at each."""
        steps, boxes = [], []
        for step in drive(self, log):
            steps.append(step)
            boxes.append(step.box)  # it is that of the newest sample only
        bounds = np.array(boxes)
        return WindowRecord(
            verdicts=tuple(s.verdict for s in steps),
            lower=bounds[:, 0],
            upper=bounds[:, 1],
            seconds=np.array([s.seconds for s in steps]),
            certificate=self._falsified,
        )

    def warm_up(self) -> float:
        """Compile everything that a step can call, without touching this observer; returns the seconds it took."""
        begun = perf_counter()
        other = WindowObserver.__new__(WindowObserver)
        other.__dict__.update(self.__dict__)
        other._begin_first(self._initial)
        y, u = np.full(self.model.n_outputs, np.nan), np.zeros(self.model.n_inputs)
        schedule = self.model.schedule
        other.update(y, u, schedule)
        other.step(u, y, u, schedule).box  # noqa: B018
        other.step(u, y, u, schedule, deadline=0.0)
        other.late_update(y, other.window[0])
        kernel.channel_factors(self._form.model.stack(schedule), self._owner, self._arrays["delta"])
        return perf_counter() - begun

    @property
    def stopped(self) -> int:
        """Programs so far that ended at the limit of pivots or of the basis: their bounds hold, yet could be less."""
        return int(self._arrays["clock"][kernel.STOPS])

    @property
    def directions(self) -> Array:
        """Directions (nt, n) in which the arrival set and `WindowStep.set` are bounded: the axes, then the template."""
        return np.vstack([np.eye(self.model.n_states), self._template / self._form.x])

    # -- inside ----------------------------------------------------------------------------------

    def _evaluate(self, schedule: Any) -> tuple[Array, tuple[Array, Array, Array]]:
        """Matrices and bounds of a sample, in normal form."""
        check_schedule(self.model, schedule)
        self._schedule = schedule
        return self._form.model.stack(schedule), self._form.model.bounds(schedule)

    def _sample(
        self,
        first: bool,
        u: Array,
        u_next: Array,
        y: Array,
        stack: Array,
        noise: Array,
        w: tuple[Array, Array],
        begun: float,
        end: float | None = None,
    ) -> WindowStep:
        w_old, form, self._reading = self._last_bounds or w, self._form, y
        known = form.inputs(u), form.inputs(u_next), form.outputs(y)
        data = (self._window, self._size, first, *known, stack, noise, *w_old, *w)
        verdict = self._answer(data, end)
        self._last_bounds = w
        return self._step(verdict, begun)

    def _step(self, verdict: VerdictName, begun: float) -> WindowStep:
        reason = self._reason if verdict == "undecided" else None
        return WindowStep(self, self._number, verdict, self._falsified, perf_counter() - begun, reason)

    def _check_current(self, sample: int) -> None:
        if sample != self._number:
            raise ValueError(
                f"the set of sample {sample} was not read before sample {self._number}; "
                "read it right after its step, or use run(log)"
            )

    def _bounds_at(self, sample: int) -> tuple[Array, Array]:
        """Bounds of the state in the template's directions; the axes come first."""
        self._check_current(sample)
        if self._falsified is not None:
            nothing = np.full(self._size.nt, np.nan)
            return nothing, nothing.copy()
        unit = np.append(self._form.x, np.ones(len(self._template)))
        lower, upper = self._newest_bounds()
        return lower * unit, upper * unit

    def _support_at(self, sample: int, directions: Array) -> Array:
        self._check_current(sample)
        if self._falsified is not None:
            return np.full(len(directions), -np.inf)
        values = np.full(len(directions), np.inf)
        for i, direction in enumerate(directions if not self._lost else ()):
            self._arrays["query"][:] = direction * self._form.x
            self._solve(kernel.QUERY)
            values[i] = self._arrays["answer"][0]
        physical = self.model.physical_range
        return values if physical is None else np.minimum(values, physical.support(directions))

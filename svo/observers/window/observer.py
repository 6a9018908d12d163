"""The moving-horizon set-valued observer: lifted rows, one linear program decides, a smoothed arrival set."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.rounding import check_rounding
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, is_count
from svo.logs.drive import advance_to
from svo.logs.log import Log, expect_log
from svo.models import NormalForm, UncertainModel
from svo.models.intervals import check_splits, transition_rows
from svo.models.nonlinear import Linearisation, NonlinearModel, Span, Undecided
from svo.models.recent_inputs import RecentInputs
from svo.models.state_range import within
from svo.observers.answers import VerdictName
from svo.observers.base import Observer, Seen, Step
from svo.observers.data import relative_slack
from svo.observers.first_states import first_box
from svo.observers.free_start import Reading
from svo.observers.given_units import arrival_in, arrival_out
from svo.observers.readings import NO_SAMPLE, OUTGROWN, Readings
from svo.observers.relinearised_kernel import NOT_MEASURED, NOT_MOVED, Followed, PlantSamples
from svo.observers.saved_state import arrays_of, numbers
from svo.observers.stamped import Stamped
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_samples import LogSamples, log_samples
from svo.observers.window.memory import WindowSettings
from svo.observers.window.relinearised import Relinearised
from svo.observers.window.sample import Outgrown, Sample, check_matrices
from svo.observers.window.setup import arrival_of, needs_next_input, template_rows
from svo.observers.window.step import WindowStep
from svo.observers.window.window import Taken, Window

_BLURRED = 1e-3  # of a reading's own width: the share of its slack by the width of the set from which a restart pays
_BRIEF = 0.05  # seconds of a call of the kernel after which the next may take more samples: Ctrl-C waits for its end
_MOST_AT_ONCE = 1024  # samples
_LONGEST = 10  # samples without a sensor after which its return may call for one, where the window has no end


class WindowObserver(Observer):
    """Set-valued observer over a moving window of N steps (the lifted form of paper 002, section 2).

    The window holds the state at its first sample, every disturbance and every channel of uncertainty since;
    measurements inside it stay valid, and one linear program a sample decides whether anything explains them.
    When the window slides, the new first state is bounded in the template's directions by all data of the
    window. It slides by 2 N // 5 samples at once (at least one), so that it holds at least N steps, and those
    samples share the programs of the arrival set.

    Parameters
    ----------
    model : UncertainModel or NonlinearModel
        A nonlinear one is linearised at each sample over the set that is known there.
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

    _dt: float | None = None  # seconds of the transition that is being taken; None = the model's Ts

    kind = "window"
    takes_deadline = takes_late = saves_state = starts_without_set = takes_intervals = takes_nonlinear = True
    takes_jitter = True

    @options_by_name
    def __init__(
        self,
        model: UncertainModel | NonlinearModel,
        initial: HPolytope,
        horizon: int | None = 10,
        *,
        template: str | ArrayLike = "box",
        eps: float = 1e-9,
        sign_split: int = 0,
    ) -> None:
        super().__init__(model)  # type: ignore[arg-type]  # a nonlinear one answers what is asked of it here
        linear = self._plan_for(model)
        if horizon is not None:
            expect(is_count(horizon, 1), "horizon", horizon, "an integer number of steps >= 1, or None for all data")
        slack = relative_slack(eps)
        expect(is_count(sign_split, 0), "sign_split", sign_split, "a number of cells >= 0 (0 = convex hulls)")
        rows = template_rows(template, model.n_states)
        initial = self._whole(initial)
        lower, upper = first_box(initial, self.model)
        if isinstance(model, NonlinearModel):
            model.check_first(lower, upper)
        form = NormalForm.at(linear, lower, upper)
        steps = None if horizon is None else int(horizon)
        self._configure(WindowSettings(form, steps, rows * form.x, slack, int(sign_split)))
        self._reset(initial, lower, upper)

    def _plan_for(self, model: UncertainModel | NonlinearModel) -> UncertainModel:
        """The linear model of the window, and what makes one of a nonlinear model."""
        self.model, self._plant, self._stamped, self._recent = model, None, None, None  # type: ignore[assignment]
        if model.jitter is not None:
            self._recent = RecentInputs.none(float(model.jitter.max()), model.n_inputs)
        if isinstance(model, UncertainModel):
            if model.origin is not None and model.origin.stamps is not None:
                self._stamped = Stamped(model, model.origin.stamps)
            return model
        self._plant = Relinearised(model)
        carrier: UncertainModel = model.carrier
        return carrier

    def _configure(self, settings: WindowSettings) -> None:
        self._settings, self._form = settings, settings.form
        self.horizon, self.eps, self.sign_split = settings.horizon, settings.eps, settings.sign_split
        self._normal = settings.form.model
        if self._plant is not None:
            self._plant.connect(settings.form)
        self._wants_next_input = (
            needs_next_input(self._normal) or self.model.uses_input_in_output or self._recent is not None
        )
        if self._stamped is not None and settings.injection is not None:
            raise ValueError("jitter is given, and exact sensors read every disturbance; state a noise n above zero")

    @property
    def needs_next_input(self) -> bool:
        return self._wants_next_input

    @property
    def free_since(self) -> int | None:
        """Sample from which on the readings alone bound the state, if the set last started again from them."""
        return self._window.origin if self._window.free else None

    @property
    def linearised(self) -> tuple[Linearisation | None, Linearisation | None]:
        """Of a nonlinear model: the linear models of the sample before the newest one, with the transition from it,
        and of the newest one, which has none yet; None before there are such samples."""
        pair = (None, None) if self._plant is None else (self._plant.before, self._plant.now)
        return tuple(None if at is None else at.copy() for at in pair)  # type: ignore[return-value]

    @property
    def stopped(self) -> int:
        return self._stopped + self._window.stopped

    @property
    def directions(self) -> Array:
        """Directions (nt, n) in which the arrival set and `WindowStep.set` are bounded: the axes, then the template."""
        return np.vstack([np.eye(self.model.n_states), self._settings.template / self._form.x])

    def bounds_at(self, sample: int) -> tuple[Array, Array]:
        """Bounds of the state at the newest sample in `directions`; the axes come first."""
        self._check_current(sample)
        unit = np.append(self._form.x, np.ones(len(self._settings.template)))
        lower, upper = self._newest_bounds(None if self._lost else self._window)
        return lower * unit, upper * unit

    def support_at(self, sample: int, directions: Array) -> Array:
        """Bounds of the state at the newest sample in any directions."""
        self._check_current(sample)
        if self._lost:
            values = np.full(len(directions), np.inf)
        else:
            values = np.array([self._window.support(direction * self._form.x) for direction in directions])
        physical = self.model.physical_range
        return values if physical is None else np.minimum(values, physical.support(directions))

    @property
    def current_window(self) -> Window:
        """The window as it stands."""
        return self._window

    def afresh(self) -> WindowObserver:
        """An observer with these settings and first set, before its first sample."""
        again = copy(self)
        again._plan_for(self.model)
        again._configure(self._settings)
        again._forget()
        again._begin(self._initial)
        return again

    def reset(self, set: HPolytope) -> None:
        if self._plant is not None:
            set = self._whole(set)
            self._plant.model.check_first(*first_box(set, self.model))
        super().reset(set)

    def restart(self, set: HPolytope) -> None:
        super().reset(self._whole(set))

    def _whole(self, set: HPolytope) -> HPolytope:
        """A set of states with the parameters that are some."""
        known = self._plant is not None and isinstance(set, HPolytope)
        return self._plant.model.whole(set) if self._plant is not None and known else set

    # -- the hooks -------------------------------------------------------------------------------

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self._begin(arrival_in(arrival_of(set, lower, upper), self._form))

    def _begin(self, initial: ArrivalSet) -> None:
        """Nothing is known but a set of first states."""
        self._initial, self.first_set = initial, arrival_out(initial, self._form)
        self._lost, self._stopped = False, 0  # programs of windows before the present one
        self._readings: Readings | None = None  # of a set that is lost, or too wide
        self._missing = np.zeros(self._normal.n_outputs, dtype=np.int64)  # samples since each sensor was read
        self._window = Window(self._settings, initial)
        lower, upper = initial.box_lower * self._form.x, initial.box_upper * self._form.x
        if self._plant is not None:
            self._plant.start_from(Span(lower, upper))
        if self._stamped is not None:
            self._stamped.start_from(lower, upper)

    def _lose_set(self) -> None:
        largest = self._normal.start_range
        if largest is None:
            self._lose()
        else:
            self._begin(ArrivalSet.box(largest.lower, largest.upper))
            self.largest_at, self._missing[:] = 0, self._horizon_of_gaps

    def _update(self, y: Array, u: Array, schedule: Any) -> WindowStep:
        recent = None if self._recent is None else RecentInputs.none(self._recent.reach, u.size)
        around = None if recent is None else recent.around(u, self._ahead)
        return self._seen(recent, around, np.zeros(u.size), u, y, schedule, None)

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> WindowStep:
        dt, self._dt = self._dt, None
        recent = None if self._recent is None else self._recent.moved(u, dt or self.Ts)
        around = None if recent is None else recent.around(u_next, self._ahead)
        if self._plant is not None:
            if recent is None and end is None and not self._lost and self._window.takes_at_once:
                return self._said(self._relinearised(self._plant, self._plant.sample(u, u_next, y, dt)))
            self._relinearise(self._plant, u, dt)
        elif self._stamped is not None:
            lower, upper = self._newest_bounds(None if self._lost else self._window)
            n = self.model.n_states
            self._stamped.moved(Span(lower[:n] * self._form.x, upper[:n] * self._form.x), u, dt)
        return self._seen(recent, around, u, u_next, y, schedule, end)

    def _seen(
        self, recent: RecentInputs | None, around: tuple[Array, Array] | None,
        u: Array, u_next: Array, y: Array, schedule: Any, end: float | None,
    ) -> WindowStep:  # fmt: skip
        """The answer at a sample, about which the inputs are within ``around``."""
        verdict = self._take(self._sample(u, u_next, y, schedule, around), end)
        if recent is not None and around is not None:
            assert self.model.jitter is not None
            self._recent = recent.read(float(self.model.jitter[~np.isnan(y)].max(initial=0.0)), around)
        return self._said(verdict)

    def _check_interval(self, dt: float) -> None:
        if self._plant is not None:
            return
        check_splits(self.model)
        if self._settings.injection is not None:
            raise ValueError(
                "dt is given, and exact sensors read every disturbance, which the observer takes out of its program "
                "(output injection) for transitions of Ts only; state a noise n above zero"
            )
        transition_rows(self.model, dt)

    def _set_interval(self, dt: float | None) -> None:
        self._dt = dt
        if self._plant is not None:
            return
        rows = self._form.state_rows(transition_rows(self.model, dt))
        self._window.move_by(rows)
        if self._readings is not None:
            self._readings.move_by(rows)

    @property
    def _oldest(self) -> int:
        if self._lost:
            assert self._readings is not None
            return self._number - len(self._readings.samples) + 1
        return self._window.oldest

    def _read_at(self, sample: int) -> Array:
        if self._lost:
            assert self._readings is not None
            return self._readings.samples[sample - self._oldest].y
        return self._window.read_at(sample)

    def _late_update(self, y: Array, sample: int) -> WindowStep:
        if self._recent is not None:
            raise ValueError(
                "y came late, and its stamp is not exact (jitter): which inputs it had is not known any more"
            )
        known = self._form.outputs(y)
        if self._readings is not None:
            self._readings.add_late(known, self._number - sample)
            if self._lost:
                return self._said(self._start_from(self._readings) or "undecided")
        return self._said(self._window.add_late(known, sample))

    # -- saved states ------------------------------------------------------------------------------------

    def _options(self) -> dict[str, Any]:
        rows, horizon, cells = self._settings.template / self._form.x, self.horizon, self.sign_split
        return {"horizon": horizon, "template": rows, "eps": self.eps, "sign_split": cells}

    def _state(self) -> dict[str, NDArray[Any]]:
        window, lost = self._window, self._lost
        horizon = -1.0 if self.horizon is None else self.horizon
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        lost_at, has_readings = self._number if lost else -1, self._readings is not None
        numbers = [window.origin, window.free, lost, lost_at, largest, has_readings, self._stopped]
        state: dict[str, NDArray[Any]] = {
            "settings": np.array([horizon, window.memory.size.N, self.eps, self.sign_split]),
            "falsified": np.array(float(self._alarm is not None)),
            "template": self._settings.template,
            "restart": np.array(numbers, dtype=np.int64),
            "missing": self._missing,
        }
        state |= arrays_of("initial", self._initial)
        if self._readings is not None:
            state |= self._readings.state()
        if self._plant is not None:
            state |= self._plant.state()
        if self._recent is not None:
            state |= self._recent.state()
        return state | self._form.state_dict() | window.state()

    def _set_up(self, model: UncertainModel | NonlinearModel, state: Mapping[str, NDArray[Any]]) -> None:
        linear = self._plan_for(model)
        horizon, _, eps, cells = (float(v) for v in state["settings"])
        form, steps = NormalForm.from_state_dict(linear, state), None if horizon < 0 else int(horizon)
        template = numbers(state, "template", "r", model.n_states)
        self._configure(WindowSettings(form, steps, template, eps, int(cells)))

    def _resume(self, state: Mapping[str, NDArray[Any]]) -> WindowStep | None:
        origin, free, lost, lost_at, largest, has_readings, self._stopped = (int(v) for v in state["restart"])
        self._initial, anchor = (self._read_arrival(state, name) for name in ("initial", "anchor"))
        falsified = bool(state["falsified"])
        self._window = Window(self._settings, anchor, int(state["settings"][1]), origin, bool(free))
        self._window.resume(state, falsified)
        self._lost, self._number = bool(lost), lost_at if lost else self._window.newest
        self.largest_at = None if largest == NO_SAMPLE else largest
        self._missing = np.array(state["missing"], dtype=np.int64)
        self._readings = None
        if has_readings:
            self._readings = self._new_readings()
            self._readings.restore(state)
        elif lost:
            raise ValueError("it has lost its set, and holds no readings to find one again")
        if self._plant is not None:
            self._plant.resume(state, has_samples=self._number >= 0)
        if self._recent is not None:
            self._recent = RecentInputs.of_state(self._recent.reach, self.model.n_inputs, state)
        if self._stamped is not None:
            self._stamped.start_from(self._initial.box_lower * self._form.x, self._initial.box_upper * self._form.x)
        return self._said("falsified") if falsified else None

    def _read_arrival(self, state: Mapping[str, NDArray[Any]], name: str) -> ArrivalSet:
        """An arrival set from its arrays; ValueError unless they fit together."""
        n, ends = self.model.n_states, len(state[f"{name}.rows"])
        sizes = {"box_lower": n, "box_upper": n, "lower": ends, "upper": ends}
        bounds = {part: numbers(state, f"{name}.{part}", size, infinite=True) for part, size in sizes.items()}
        return ArrivalSet(rows=numbers(state, f"{name}.rows", ends, n), **bounds)

    # -- many samples at once ---------------------------------------------------------------------

    @options_by_name
    def follow(self, log: Log, boxes: Array | None = None, *, start: int = 0) -> Iterator[Seen]:
        expect_log(log)
        k, portion = start, 1
        before = self._number + 1 - start if start else 0  # samples that are not in this log
        while k < len(log):
            check_rounding()
            begun = perf_counter()
            in_step = self._number + 1 == before + k
            samples = self._samples_at_once(log, k, portion) if in_step else None
            if samples is None:
                answers = [self._seen_alone(advance_to(self, log, k, log.schedule_at(k)), k, boxes)]
            else:
                answers = list(self._seen_at_once(log, k, samples, boxes))
                portion = min(2 * portion, _MOST_AT_ONCE) if perf_counter() - begun < _BRIEF else -(-portion // 4)
            for seen in answers:
                k += seen.samples
                yield seen

    def _samples_at_once(self, log: Log, first: int, count: int) -> LogSamples | PlantSamples | None:
        """Samples of a log for one call of the kernel; None where the next one needs more than that."""
        if self._lost or self._alarm is not None or self._recent is not None:
            return None
        last = min(first + min(count, self._window.takes_at_once), len(log))
        if self._plant is not None:
            return self._plant.samples(log, first, last, self._wants_next_input)
        if self._readings is not None or self._missing.any() or self._stamped is not None or log.keeps_its_times:
            return None
        if self._normal.physical_range is not None:
            return None
        return log_samples(self._form, log, first, last, self._wants_next_input)

    def _seen_at_once(
        self, log: Log, first: int, samples: LogSamples | PlantSamples, boxes: Array | None
    ) -> Iterator[Seen]:
        """Those that are consistent, then the one that is not, if there is one."""
        begun, last, stopped = perf_counter(), first + len(samples.y), self.stopped
        own = None if boxes is None else boxes[first:last]
        if isinstance(samples, LogSamples):
            done, told = self._window.take_many(samples, own)
            if own is not None:
                own[:done] *= self._form.x
            conclude = partial(self._concluded, told)
        else:
            assert self._plant is not None
            found = self._window.take_relinearised(self._plant, samples, own)
            done, conclude = found.done, partial(self._of_next, found)
        if done:
            self._number += done
            self._schedule = log.schedule_at(first + done - 1)
            step = self._answered(WindowStep(self, verdict="consistent"), begun, stopped)
            yield Seen(done, replace(step, seconds=step.seconds / done))
        at = first + done
        if at < last:
            step = self._ask(
                perf_counter(), log.schedule_at(at), lambda: self._said(conclude(samples, done, log.y[at]))
            )
            if not done:
                object.__setattr__(step, "stopped", self.stopped - stopped)
            yield self._seen_alone(step, at, boxes)

    def _concluded(self, told: Taken, samples: LogSamples | PlantSamples, i: int, y: Array) -> VerdictName:
        """Of sample i, which the kernel has taken."""
        sample = self._window.handed_over(y)
        return self._outcome(sample, lambda: self._window.concluded(told, y))

    def _of_next(self, found: Followed, samples: PlantSamples, i: int, y: Array) -> VerdictName:
        """Of sample i of a nonlinear plant, which is not simply consistent."""
        if found.end not in (NOT_MOVED, NOT_MEASURED):
            return self._concluded(found.told, samples, i, y)
        if found.why is not None:
            self._start_from_largest(found.why)
        return self._take(self._sample(samples.u[i], samples.u_next[i], y, None, None), None)

    def _relinearised(self, plant: Relinearised, samples: PlantSamples) -> VerdictName:
        """The verdict at the next sample of a nonlinear plant."""
        found = self._window.take_relinearised(plant, samples, None)
        return "consistent" if found.done else self._of_next(found, samples, 0, samples.y[0])

    @staticmethod
    def _seen_alone(step: Step, k: int, boxes: Array | None) -> Seen:
        if boxes is not None:
            boxes[k] = step.box
        return Seen(1, step)

    # -- inside ----------------------------------------------------------------------------------

    def _sample(self, u: Array, u_next: Array, y: Array, schedule: Any, around: tuple[Array, Array] | None) -> Sample:
        """Model and data of a sample, in normal form."""
        form = self._form
        if self._plant is not None:
            schedule, y = self._plant.measured(y, u_next, self._number, around)
        stack, (w_lower, w_upper, noise) = self._normal.stack(schedule), self._normal.bounds(schedule)
        if self._stamped is not None and around is not None:
            stack, noise, y = self._stamped.applied(form, stack, noise, y, around, u_next)
        u_next = form.inputs(u_next) if self._wants_next_input else u_next  # else zeros
        return Sample(form.inputs(u), u_next, form.outputs(y), stack, noise, w_lower, w_upper, y)

    def _take(self, sample: Sample, end: float | None) -> VerdictName:
        if self._lost:
            check_matrices(sample.stack)
            return self._without_set(sample)
        return self._outcome(sample, lambda: self._window.take(sample, end))

    def _outcome(self, sample: Sample, take: Callable[[], VerdictName]) -> VerdictName:
        """What becomes of a sample that the window takes."""
        try:
            verdict = take()
        except Outgrown:
            return self._give_up(sample)
        return verdict if verdict == "falsified" else self._watch(sample, verdict)

    def _relinearise(self, plant: Relinearised, u: Array, dt: float | None) -> None:
        """Hand over the transition from the newest sample; where there is none, the set starts again."""
        n = self.model.n_states
        try:
            if self._lost:
                raise Undecided(OUTGROWN)
            lower, upper = self._newest_bounds(self._window)
            at = plant.moved(Span(lower[:n] * self._form.x, upper[:n] * self._form.x), u, dt)
        except Undecided as error:
            self._start_from_largest(error)
        else:
            self._window.move_by(self._normal.stack(at)[:, :n])

    def _start_from_largest(self, why: Undecided) -> None:
        """Nothing else is known of a sample to which there is no transition."""
        assert self._plant is not None
        box = self._plant.give_up(why, self._number)
        self._adopt(self._new_window(ArrivalSet.box(box.lower / self._form.x, box.upper / self._form.x), self._number))
        self.largest_at = self._number

    def _said(self, verdict: VerdictName) -> WindowStep:
        reason = (OUTGROWN if self._lost else self._window.reason) if verdict == "undecided" else None
        if self._plant is not None and self._plant.reason is not None and verdict != "falsified":
            verdict, reason = "undecided", self._plant.reason
        proof = None if self._window.proof is None else self._window.proof.resting_on(self.largest_at)
        return WindowStep(self, verdict=verdict, certificate=proof, reason=reason)

    def _check_current(self, sample: int) -> None:
        if sample != self._number or self._alarm is not None:
            came = "late data" if sample == self._number else f"sample {self._number}"
            raise ValueError(
                f"the set of sample {sample} was not read before {came}; read it right after its step, or use run(log)"
            )

    def _newest_bounds(self, window: Window | None) -> tuple[Array, Array]:
        """Bounds of the newest state in the template's directions, within the physical range; the axes come first."""
        rows = self._window.memory.arrays["T"]
        if window is None:
            lower, upper = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
        else:
            lower, upper = window.newest_bounds()
        physical = self._normal.physical_range
        if physical is not None:
            lower, upper, _ = physical.along(rows).cut(lower, upper)
        return lower, upper

    # -- the set is gone ---------------------------------------------------------------------------

    def _give_up(self, sample: Sample) -> VerdictName:
        """The set has outgrown all bounds at this sample: it starts again from the largest set, if there is one."""
        largest = self._normal.start_range
        if largest is not None:
            window = self._new_window(ArrivalSet.box(largest.lower, largest.upper), self._number)
            try:
                verdict = window.take(sample)
            except Outgrown:
                pass  # it is itself beyond all bounds
            else:
                self._adopt(window)
                self.largest_at, self._missing[:] = self._number, self._horizon_of_gaps
                return verdict
        self._lose()
        return self._without_set(sample)

    def _lose(self) -> None:
        """There is no set any more."""
        self.largest_at, self._lost, self._readings = None, True, self._new_readings()
        if self._stamped is not None:
            self._stamped.box = None
        self._stopped += self._window.stopped
        self._window = Window(self._settings, self._window.anchor)

    def _without_set(self, sample: Sample) -> VerdictName:
        if self._plant is not None:
            return "undecided"  # until the next sample starts again from the largest set
        assert self._readings is not None
        readings = self._readings.added(sample.u, sample.reading)
        verdict = self._start_from(readings)
        if verdict is None:
            self._readings = readings
        return verdict or "undecided"

    def _new_readings(self) -> Readings:
        return Readings(self._normal, self.eps, self.horizon or 0)

    def _new_window(self, anchor: ArrivalSet, origin: int, free: bool = False) -> Window:
        """Nothing before it is used any more; bounds by readings alone have been proven where they were found."""
        return Window(self._settings, anchor, origin=origin, free=free)

    def _adopt(self, window: Window) -> None:
        """Go on with a window that has started again."""
        self._stopped += self._window.stopped
        self._window = window
        self._lost, self._readings, self.largest_at = False, None, None
        self._missing = np.zeros(self._normal.n_outputs, dtype=np.int64)

    # -- the set is too wide -------------------------------------------------------------------------

    @property
    def _horizon_of_gaps(self) -> int:
        return self.horizon or _LONGEST

    def _watch(self, sample: Sample, verdict: VerdictName) -> VerdictName:
        """Look for readings that bound the state better than a set that a gap has blurred."""
        if self._plant is not None or self._stamped is not None:
            return verdict
        if self._readings is None:
            if not (any(map(math.isnan, sample.y.tolist())) or any(self._missing.tolist())):  # short: fastest so
                return verdict
            absent = np.isnan(sample.y)
            returned = ~absent & (self._missing >= self._horizon_of_gaps)
            self._missing = np.where(absent, self._missing + 1, 0)
            if not (returned.any() and self._is_blurred(returned, sample)):
                return verdict
        readings = (self._readings or self._new_readings()).added(sample.u, sample.reading)
        better = self._start_from(readings)
        if better is None:
            self._readings = None if readings.is_full else readings
        return better or verdict

    def _is_blurred(self, returned: NDArray[np.bool_], sample: Sample) -> bool:
        """Whether the slack of a sensor's row comes from the width of the set more than it should."""
        own = sample.noise + self.eps * np.abs(np.nan_to_num(sample.y))
        return bool((self._window.blur(sample.stack) > _BLURRED * own)[returned].any())

    # -- the set is found ------------------------------------------------------------------------------

    def _start_from(self, readings: Readings) -> VerdictName | None:
        """Start again where readings alone bound the state, if they do and it is the better set."""
        found = readings.start()
        if found is None:
            return None
        samples, lower, upper = found
        lower, upper = within(self._normal.physical_range, lower, upper)
        window = self._new_window(ArrivalSet.box(lower, upper), self._number - len(samples) + 1, free=True)
        try:
            verdict = _repeated(samples, window)
        except Outgrown:
            return None
        if verdict != "falsified" and not self._is_better(window, verdict):
            return None
        self._adopt(window)
        return verdict

    def _is_better(self, window: Window, verdict: VerdictName) -> bool:
        """Whether the set of a new window is nowhere wider than the one before."""
        if verdict != "consistent" or self._lost:
            return verdict == "consistent"
        (lower, upper), (before, above) = self._newest_bounds(window), self._newest_bounds(self._window)
        return bool((upper - lower <= above - before)[: self.model.n_states].all())


def _repeated(samples: list[Reading], window: Window) -> VerdictName:
    """Samples through a new window; the verdict is about the last one."""
    verdict: VerdictName = "undecided"
    for j, s in enumerate(samples):
        window.proof = None  # by fewer readings than bound the first state: no proof
        u = samples[j - 1].u if j else s.u
        verdict = window.take(Sample(u, s.u, s.y, s.stack, s.noise, s.w_lower, s.w_upper, s.y))
    return verdict

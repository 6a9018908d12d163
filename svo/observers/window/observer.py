"""The moving-horizon set-valued observer: lifted rows, one linear program decides, a smoothed arrival set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
from svo.models.nonlinear import Linearisation, NonlinearModel, Undecided
from svo.observers.answers import VerdictName
from svo.observers.base import Observer, Seen, Step
from svo.observers.data import relative_slack
from svo.observers.first_states import first_box
from svo.observers.given_units import arrival_in, arrival_out
from svo.observers.readings import OUTGROWN
from svo.observers.relinearised_kernel import NOT_MEASURED, NOT_MOVED, Followed, PlantSamples
from svo.observers.saved_state import arrays_of, numbers
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_samples import LogSamples
from svo.observers.window.memory import WindowSettings
from svo.observers.window.relinearised import Relinearised
from svo.observers.window.restarting import RestartingWindow, read_arrival
from svo.observers.window.sampler import Instant, Sampler
from svo.observers.window.setup import arrival_of, template_rows
from svo.observers.window.step import WindowStep
from svo.observers.window.window import Taken, Window

_BRIEF = 0.05  # seconds of a call of the kernel after which the next may take more samples: Ctrl-C waits for its end
_MOST_AT_ONCE = 1024  # samples


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
        self.model = model  # type: ignore[assignment]
        self._sampler = Sampler(model)
        if horizon is not None:
            expect(is_count(horizon, 1), "horizon", horizon, "an integer number of steps >= 1, or None for all data")
        slack = relative_slack(eps)
        expect(is_count(sign_split, 0), "sign_split", sign_split, "a number of cells >= 0 (0 = convex hulls)")
        rows = template_rows(template, model.n_states)
        initial = self._whole(initial)
        lower, upper = first_box(initial, self.model)
        if isinstance(model, NonlinearModel):
            model.check_first(lower, upper)
        form = NormalForm.at(self._sampler.linear, lower, upper)
        steps = None if horizon is None else int(horizon)
        self._configure(WindowSettings(form, steps, rows * form.x, slack, int(sign_split)))
        self._reset(initial, lower, upper)

    def _configure(self, settings: WindowSettings) -> None:
        self._settings, self._form = settings, settings.form
        self.horizon, self.eps, self.sign_split = settings.horizon, settings.eps, settings.sign_split
        self._normal = settings.form.model
        self._sampler.connect(settings)

    @property
    def needs_next_input(self) -> bool:
        return self._sampler.needs_next_input

    @property
    def linearised(self) -> tuple[Linearisation | None, Linearisation | None]:
        """Of a nonlinear model: the linear models of the sample before the newest one, with the transition from it,
        and of the newest one, which has none yet; None before there are such samples."""
        plant = self._sampler.plant
        pair = (None, None) if plant is None else (plant.before, plant.now)
        return tuple(None if at is None else at.copy() for at in pair)  # type: ignore[return-value]

    @property
    def largest_at(self) -> int | None:
        """Sample at which the set last started from the model's largest set, if what is known now rests on it."""
        return self._known.largest_at

    @largest_at.setter
    def largest_at(self, sample: int | None) -> None:
        self._known.largest_at = sample

    @property
    def stopped(self) -> int:
        return self._known.stopped

    @property
    def directions(self) -> Array:
        """Directions (nt, n) in which the arrival set and `WindowStep.set` are bounded: the axes, then the template."""
        return np.vstack([np.eye(self.model.n_states), self._settings.template / self._form.x])

    def bounds_at(self, sample: int) -> tuple[Array, Array]:
        """Bounds of the state at the newest sample in `directions`; the axes come first."""
        self._check_current(sample)
        unit = np.append(self._form.x, np.ones(len(self._settings.template)))
        lower, upper = self._known.bounds()
        return lower * unit, upper * unit

    def support_at(self, sample: int, directions: Array) -> Array:
        """Bounds of the state at the newest sample in any directions."""
        self._check_current(sample)
        values = self._known.support(directions * self._form.x)
        physical = self.model.physical_range
        return values if physical is None else np.minimum(values, physical.support(directions))

    @property
    def _window(self) -> Window:
        return self._known.window

    def afresh(self) -> WindowObserver:
        """An observer with these settings and first set, before its first sample."""
        again = copy(self)
        again._sampler = Sampler(self._sampler.model)
        again._configure(self._settings)
        again._begin(self._initial)
        again._forget()
        return again

    def reset(self, set: HPolytope) -> None:
        plant = self._sampler.plant
        if plant is not None:
            set = self._whole(set)
            plant.model.check_first(*first_box(set, self.model))
        super().reset(set)

    def restart(self, set: HPolytope) -> None:
        super().reset(self._whole(set))

    def _whole(self, set: HPolytope) -> HPolytope:
        """A set of states with the parameters that are some."""
        plant = self._sampler.plant
        return plant.model.whole(set) if plant is not None and isinstance(set, HPolytope) else set

    # -- the hooks -------------------------------------------------------------------------------

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self._begin(arrival_in(arrival_of(set, lower, upper), self._form))

    def _begin(self, initial: ArrivalSet) -> None:
        """Nothing is known but a set of first states."""
        self.first_set = arrival_out(initial, self._form)
        self._start_from(initial)

    def _start_from(self, initial: ArrivalSet) -> None:
        self._initial = initial
        finds = self._sampler.plant is None
        compares = finds and self._sampler.stamped is None
        self._known = RestartingWindow(self._settings, initial, finds=finds, compares=compares)
        self._sampler.start_from(initial)

    def _lose_set(self) -> None:
        largest = self._normal.start_range
        if largest is None:
            self._known.lose()
            self._sampler.start_from(None)
        else:
            self._begin(ArrivalSet.box(largest.lower, largest.upper))
            self._known.rest_on_largest(0)

    def _update(self, y: Array, u: Array, schedule: Any) -> WindowStep:
        return self._seen(self._sampler.first_instant(u, self._ahead), np.zeros(u.size), u, y, schedule, None)

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> WindowStep:
        dt, self._dt = self._dt, None
        instant = self._sampler.next_instant(u, u_next, dt, self._ahead)
        plant = self._sampler.plant
        if plant is not None:
            if instant is None and end is None and not self._known.lost and self._window.takes_at_once:
                return self._said(self._relinearised(plant, plant.sample(u, u_next, y, dt)))
            self._relinearise(plant, u, dt)
        elif self._sampler.stamped is not None:
            self._sampler.move_stamped(self._known.bounds(), u, dt)
        return self._seen(instant, u, u_next, y, schedule, end)

    def _seen(
        self, instant: Instant | None, u: Array, u_next: Array, y: Array, schedule: Any, end: float | None
    ) -> WindowStep:
        """The answer at a sample, once it is read."""
        sample = self._sampler.sample(u, u_next, y, schedule, self._number, instant)
        verdict = self._known.take(sample, self._number, end)
        if instant is not None:
            self._sampler.read(instant, y)
        return self._said(verdict)

    def _check_interval(self, dt: float) -> None:
        self._sampler.check_interval(dt)

    def _set_interval(self, dt: float | None) -> None:
        self._dt = dt
        if self._sampler.plant is None:
            self._known.move_by(self._sampler.rows_of(dt))

    @property
    def _oldest(self) -> int:
        return self._known.oldest(self._number)

    def _read_at(self, sample: int) -> Array:
        return self._known.read_at(sample, self._number)

    def _late_update(self, y: Array, sample: int) -> WindowStep:
        if self._sampler.has_jitter:
            raise ValueError(
                "y came late, and its stamp is not exact (jitter): which inputs it had is not known any more"
            )
        return self._said(self._known.add_late(self._form.outputs(y), sample, self._number))

    # -- saved states ------------------------------------------------------------------------------------

    def _options(self) -> dict[str, Any]:
        rows, horizon, cells = self._settings.template / self._form.x, self.horizon, self.sign_split
        return {"horizon": horizon, "template": rows, "eps": self.eps, "sign_split": cells}

    def _state(self) -> dict[str, NDArray[Any]]:
        horizon = -1.0 if self.horizon is None else self.horizon
        state: dict[str, NDArray[Any]] = {
            "settings": np.array([horizon, self._window.memory.size.N, self.eps, self.sign_split]),
            "falsified": np.array(float(self._alarm is not None)),
            "template": self._settings.template,
        }
        state |= arrays_of("initial", self._initial) | self._sampler.state()
        return state | self._form.state_dict() | self._known.state(self._number)

    def _set_up(self, model: UncertainModel | NonlinearModel, state: Mapping[str, NDArray[Any]]) -> None:
        self.model = model  # type: ignore[assignment]
        self._sampler = Sampler(model)
        horizon, _, eps, cells = (float(v) for v in state["settings"])
        form, steps = NormalForm.from_state_dict(self._sampler.linear, state), None if horizon < 0 else int(horizon)
        template = numbers(state, "template", "r", model.n_states)
        self._configure(WindowSettings(form, steps, template, eps, int(cells)))

    def _resume(self, state: Mapping[str, NDArray[Any]]) -> WindowStep | None:
        falsified = bool(state["falsified"])
        self._start_from(read_arrival(state, "initial", self.model.n_states))
        self._number = self._known.resume(state, int(state["settings"][1]), falsified)
        if self._known.lost:
            self._sampler.start_from(None)
        self._sampler.resume(state, has_samples=self._number >= 0)
        return self._said("falsified") if falsified else None

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
        known = self._known
        if known.lost or self._alarm is not None:
            return None
        if self._sampler.plant is None and not (known.is_whole and self._sampler.stamped is None):
            return None
        last = min(first + min(count, self._window.takes_at_once), len(log))
        return self._sampler.of_log(log, first, last)

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
            plant = self._sampler.plant
            assert plant is not None
            found = self._window.take_relinearised(plant, samples, own)
            done, conclude = found.done, partial(self._of_next, plant, found)
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
        return self._known.outcome(sample, self._number, lambda: self._window.concluded(told, y))

    def _of_next(
        self, plant: Relinearised, found: Followed, samples: LogSamples | PlantSamples, i: int, y: Array
    ) -> VerdictName:
        """Of sample i of a nonlinear plant, which is not simply consistent."""
        if found.end not in (NOT_MOVED, NOT_MEASURED):
            return self._concluded(found.told, samples, i, y)
        if found.why is not None:
            self._start_from_largest(plant, found.why)
        sample = self._sampler.sample(samples.u[i], samples.u_next[i], y, None, self._number)
        return self._known.take(sample, self._number, None)

    def _relinearised(self, plant: Relinearised, samples: PlantSamples) -> VerdictName:
        """The verdict at the next sample of a nonlinear plant."""
        found = self._window.take_relinearised(plant, samples, None)
        return "consistent" if found.done else self._of_next(plant, found, samples, 0, samples.y[0])

    @staticmethod
    def _seen_alone(step: Step, k: int, boxes: Array | None) -> Seen:
        if boxes is not None:
            boxes[k] = step.box
        return Seen(1, step)

    # -- inside ----------------------------------------------------------------------------------

    def _relinearise(self, plant: Relinearised, u: Array, dt: float | None) -> None:
        """Hand over the transition from the newest sample; where there is none, the set starts again."""
        try:
            if self._known.lost:
                raise Undecided(OUTGROWN)
            self._window.move_relinearised(plant, u, dt)
        except Undecided as error:
            self._start_from_largest(plant, error)

    def _start_from_largest(self, plant: Relinearised, why: Undecided) -> None:
        """Nothing else is known of a sample to which there is no transition."""
        box = plant.give_up(why, self._number)
        largest = ArrivalSet.box(box.lower / self._form.x, box.upper / self._form.x)
        self._known.start_from_largest(largest, self._number)

    def _said(self, verdict: VerdictName) -> WindowStep:
        reason, plant = self._known.reason if verdict == "undecided" else None, self._sampler.plant
        if plant is not None and plant.reason is not None and verdict != "falsified":
            verdict, reason = "undecided", plant.reason
        proof = None if self._window.proof is None else self._window.proof.resting_on(self.largest_at)
        return WindowStep(self, verdict=verdict, certificate=proof, reason=reason)

    def _check_current(self, sample: int) -> None:
        if sample != self._number or self._alarm is not None:
            came = "late data" if sample == self._number else f"sample {self._number}"
            raise ValueError(
                f"the set of sample {sample} was not read before {came}; read it right after its step, or use run(log)"
            )

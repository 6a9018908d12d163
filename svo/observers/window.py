"""The moving-horizon set-valued observer: lifted rows, one linear program decides, a smoothed arrival set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from svo.log import Log
from svo.model import UncertainModel
from svo.observers import window_kernel as kernel
from svo.observers.fallback import candidates, is_feasible
from svo.observers.output_injection import OutputInjection, can_inject
from svo.observers.proof import ArrivalSet, WindowCertificate, certificate_of
from svo.observers.sign_split import SplitCertificate, SplitPrograms
from svo.observers.step import VerdictName
from svo.observers.window_setup import (
    channel_owners,
    finite_box,
    jitter,
    joint_rows,
    output_is_disturbed,
    template_rows,
)
from svo.observers.window_step import WindowRecord, WindowStep

Array = NDArray[np.float64]
_GROWING_START = 16
_LARGEST_BASIS = 128
_LARGEST_GROWING_BASIS = 256
_PIVOTS_BETWEEN_LOOKS = 8  # at the clock: some 20 microseconds
_ENTRY_ERRORS = {
    kernel.BAD_INPUT: "u is {u}; expected finite numbers",
    kernel.BAD_OUTPUT: "y is {y}; expected finite numbers, or NaN for a missing sensor",
    kernel.BAD_MATRIX: "the model's matrices at this schedule contain NaN or Inf; expected finite numbers",
    kernel.RANK_ROSE: "an uncertainty has a higher rank at this sample than at the model's typical schedule",
}


class WindowObserver:
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
    with all sensors, by itself (`svo.observers.output_injection`).
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
        if not isinstance(model, UncertainModel):
            raise TypeError(f"model is {type(model).__name__}; expected an UncertainModel")
        if horizon is not None and (not isinstance(horizon, int | np.integer) or horizon < 1):
            raise ValueError(f"horizon is {horizon!r}; expected an integer number of steps >= 1, or None for all data")
        if not (np.isfinite(eps) and eps >= 0):
            raise ValueError(f"eps is {eps}; expected a relative slack >= 0, such as 1e-9")
        if not isinstance(sign_split, int | np.integer) or sign_split < 0:
            raise ValueError(f"sign_split is {sign_split!r}; expected a number of cells >= 0 (0 = convex hulls)")
        self._configure(model, horizon, template_rows(template, model.n_states), eps, int(sign_split))
        self.reset(initial)

    # -- the protocol ----------------------------------------------------------------------------

    def reset(self, set: HPolytope) -> None:
        """Forget all data; the state at the next measurement lies in ``set``.

        Raises
        ------
        ValueError
            If the set is empty, unbounded or of the wrong dimension.
        """
        lower, upper = finite_box(set, self.model.n_states)
        self._begin(ArrivalSet(lower, upper, *joint_rows(set)), self._first_steps)

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
        y = self._outputs(y0)
        inputs = self._inputs("u", u, self._wants_next_input)
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
            u(k+1); needed only if D or a D_i is not zero, or if the output depends on w or an uncertainty (F, C_i,
            c_i, F_i) while some B_i is not zero.
        schedule : optional
            Scheduling value at the sample of y; it also gives the matrices of the next transition.
        deadline : float, optional
            Seconds after which the programs stop where they are: the arrival set is then wider but still
            contains the state, and the verdict is "undecided" if emptiness could not be decided. What is left
            then takes a few microseconds a direction. The exact proof of an alarm, a few milliseconds once, is
            not cut short. Results depend on the machine's speed.

        Raises
        ------
        ValueError
            For a wrong shape, an infinite or missing value, or a schedule that gives no finite matrices. The
            observer is unchanged.
        """
        begun = perf_counter()
        if self._falsified is not None:
            return WindowStep(self, self._time, "falsified", self._falsified, perf_counter() - begun)
        outputs = self._outputs(y)
        inputs = self._inputs("u", u, True)
        following = self._inputs("u_next", u_next, self._wants_next_input)
        stack, (w_lower, w_upper, noise) = self._evaluate(schedule)
        if not self._started:
            self.update(np.full(self.model.n_outputs, np.nan), inputs, schedule)
        if self.horizon is None and self._time + 1 >= self._size.N:
            self._grow()
        end = None if deadline is None else begun + deadline
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
        outputs = self._outputs(y)
        if self._falsified is not None:
            return WindowStep(self, self._time, "falsified", self._falsified, perf_counter() - begun)
        first, last = self.window
        if not (isinstance(sample, int | np.integer) and first <= sample <= last):
            raise ValueError(f"sample is {sample!r}; expected one in the window, which holds {first} to {last}")
        if np.isinf(outputs).any():
            raise ValueError(_ENTRY_ERRORS[kernel.BAD_OUTPUT].format(y=y))
        read = ~np.isnan(outputs) & ~np.isnan(self._arrays["y"][sample % (self._size.N + 1)])
        if read.any():
            raise ValueError(f"y has a value of sensor {int(np.argmax(read))}, which was already read at {sample}")
        kernel.add_late(self._window, self._size, sample, outputs, self.eps)
        if self._injection is not None:  # the sample was incomplete, so it is as it was given
            s = sample % (self._size.N + 1)
            self._arrays["given.y"][s], self._arrays["given.slack"][s] = self._arrays["y"][s], self._arrays["slack"][s]
        verdict = self._solve(kernel.ARRIVAL)
        return WindowStep(self, self._time, verdict, self._falsified, perf_counter() - begun)

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
        return int(self._arrays["clock"][kernel.BASE]), self._time

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next steps depend on, as named arrays (for ``numpy.savez``)."""
        settings = np.array([-1.0 if self.horizon is None else self.horizon, self._size.N, self.eps, self.sign_split])
        first = {f"initial.{f.name}": getattr(self._initial, f.name) for f in fields(self._initial)}
        last = dict(zip(("w_old_lower", "w_old_upper"), self._last_bounds or (), strict=False))
        falsified = np.array(float(self._falsified is not None))
        state = {"settings": settings, "falsified": falsified, "template": self._template, **first, **last}
        state |= self._arrays
        return {name: value.copy() for name, value in state.items()}

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: Mapping[str, Array]) -> WindowObserver:
        """The observer that `state_dict` described, to continue bit for bit with the same model.

        Raises
        ------
        ValueError
            If the state is not that of a window observer of such a model.
        """
        try:
            horizon, steps, eps, cells = (float(v) for v in state["settings"])
            initial = ArrivalSet(**{f.name: np.array(state[f"initial.{f.name}"]) for f in fields(ArrivalSet)})
            observer = cls.__new__(cls)
            observer._configure(model, None if horizon < 0 else int(horizon), state["template"], eps, int(cells))
            observer._begin(initial, int(steps))
            for name, array in observer._arrays.items():
                array[...] = state[name]
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"state does not belong to a window observer of this model: {error}") from error
        if "w_old_lower" in state:
            observer._last_bounds = (np.array(state["w_old_lower"]), np.array(state["w_old_upper"]))
        if state["falsified"]:
            observer._prove_again()
        return observer

    def run(self, log: Log) -> WindowRecord:
        """All samples of a log, with the box of the state at each."""
        steps, lower, upper = [], [], []
        for k in range(len(log)):
            following = log.u[k] if self._wants_next_input else None
            schedule = log.schedule_at(k)
            step = (
                self.update(log.y[k], following, schedule)
                if k == 0
                else self.step(log.u[k - 1], log.y[k], following, schedule)
            )
            box = step.box
            steps.append(step)
            lower.append(box[0])
            upper.append(box[1])
        return WindowRecord(
            verdicts=tuple(s.verdict for s in steps),
            lower=np.array(lower),
            upper=np.array(upper),
            seconds=np.array([s.seconds for s in steps]),
            certificate=self._falsified,
        )

    def warm_up(self) -> float:
        """Compile everything that a step can call, without touching this observer; returns the seconds it took."""
        begun = perf_counter()
        other = WindowObserver.__new__(WindowObserver)
        other.__dict__.update(self.__dict__)
        other.reset(HPolytope.box(self._initial.box_lower, self._initial.box_upper))
        y, u = np.full(self.model.n_outputs, np.nan), np.zeros(self.model.n_inputs)
        schedule = self.model.schedule
        other.update(y, u, schedule)
        other.step(u, y, u, schedule).box  # noqa: B018
        other.step(u, y, u, schedule, deadline=0.0)
        other.late_update(y, 0)
        kernel.channel_factors(self.model.stack(schedule), self._owner)
        return perf_counter() - begun

    @property
    def stopped(self) -> int:
        """Programs so far that ended at the limit of pivots or of the basis: their bounds hold, yet could be less."""
        return int(self._arrays["clock"][kernel.STOPS])

    @property
    def directions(self) -> Array:
        """Directions (nt, n) in which the arrival set and `WindowStep.set` are bounded: the axes, then the template."""
        return self._arrays["T"].copy()

    # -- inside ----------------------------------------------------------------------------------

    @property
    def _time(self) -> int:
        return int(self._arrays["clock"][kernel.TIME])

    @property
    def _started(self) -> bool:
        return bool(self._arrays["clock"][kernel.STARTED])

    def _configure(
        self, model: UncertainModel, horizon: int | None, template: Array, eps: float, sign_split: int
    ) -> None:
        self.model = model
        self.sign_split = sign_split
        self.horizon = None if horizon is None else int(horizon)
        self.eps = float(eps)
        self._block = 1 if self.horizon is None else max(1, 2 * self.horizon // 5)
        self._template = template
        self._owner = channel_owners(model)
        self._late = output_is_disturbed(model)
        sizes = model.n_states, model.n_inputs, model.n_disturbances
        self._injection = OutputInjection(*sizes) if can_inject(model) else None
        # Channels that the output may share are bounded at its sample, so what u says of them must be known then.
        driven = any(callable(u.B) or (u.B is not None and bool(np.any(u.B))) for u in model.uncertainties)
        self._wants_next_input = model.uses_input_in_output or (self._late and driven)

    @property
    def _first_steps(self) -> int:
        """Steps that an empty window has room for."""
        return _GROWING_START if self.horizon is None else self.horizon + self._block - 1

    def _begin(self, initial: ArrivalSet, steps: int) -> None:
        """An empty window of so many steps at most, anchored at the first states."""
        self._initial = initial
        self._allocate(steps)
        n, w = self.model.n_states, self._arrays
        w["h_lower"][:n], w["h_upper"][:n] = initial.box_lower, initial.box_upper
        kernel.initialise(self._window, self._size, initial.rows, initial.lower, initial.upper)
        self._falsified: WindowCertificate | SplitCertificate | None = None
        self._last_bounds: tuple[Array, Array] | None = None

    def _allocate(self, steps: int) -> None:
        model, polytope = self.model, self.model.disturbance_polytope
        n = model.n_states
        nw = model.n_disturbances + (0 if self._injection is None else n)
        w_rows = (
            joint_rows(polytope)
            if polytope is not None
            else (np.zeros((0, nw)), np.zeros(0), np.zeros(0))
        )
        nv, nr = nw + len(self._owner), model.n_outputs + len(w_rows[0]) + 2 * len(self._owner)
        na = max(len(self._template), len(self._initial.rows))
        rows, columns = na + (steps + 1) * nr, n + (steps + 1) * nv
        largest = _LARGEST_BASIS if self.horizon is not None else _LARGEST_GROWING_BASIS
        self._size = kernel.Sizes(
            n=n, nu=model.n_inputs, nw=nw, ny=model.n_outputs, nq=len(self._owner), nh=len(w_rows[0]),
            nt=n + len(self._template), na=na, ni=1 + len(model.uncertainties), N=steps, block=self._block,
            K=min(rows, columns, largest) + 2, late=int(self._late),
        )  # fmt: skip
        w = self._arrays = kernel.allocate(self._size)
        w["T"][:n] = np.eye(n)
        w["T"][n:] = self._template
        w["owner"][:] = self._owner
        w["delta"][:] = np.array([model.uncertainties[i - 1].bounds for i in self._owner]).reshape(-1, 2)
        w["w_rows"][:], w["w_rows_lower"][:], w["w_rows_upper"][:] = w_rows
        w["jitter"][:] = jitter(w["jitter"].size)
        self._window = kernel.new_window(dict(w))
        if self._injection is not None:
            w |= self._injection.allocate(self._size)

    def _grow(self) -> None:
        """Twice the room; nothing has wrapped around yet, so every array is a leading block of the larger one."""
        old = self._arrays
        self._allocate(2 * self._size.N)
        for name, small in old.items():
            self._arrays[name][tuple(slice(0, length) for length in small.shape)] = small

    def _evaluate(self, schedule: Any) -> tuple[Array, tuple[Array, Array, Array]]:
        if self.model.is_scheduled and schedule is None:
            raise ValueError("schedule is missing: the model has arrays that are functions of it, so pass schedule=...")
        return self.model.stack(schedule), self.model.bounds(schedule)

    def _outputs(self, y: ArrayLike) -> Array:
        array = np.asarray(y, dtype=float)
        if array.shape != (self.model.n_outputs,):
            raise ValueError(f"y has shape {array.shape}; expected ({self.model.n_outputs},), one value a sensor")
        return array

    def _inputs(self, name: str, u: ArrayLike | None, needed: bool) -> Array:
        size = self.model.n_inputs
        if not needed or (u is None and size == 0):
            return np.zeros(size)
        if u is None:
            raise ValueError(
                f"{name} is missing; expected shape ({size},)"
                + (", since the output shares D, a D_i or a channel with the input" if name != "u" else "")
            )
        array = np.asarray(u, dtype=float)
        if array.shape != (size,):
            raise ValueError(f"{name} has shape {array.shape}; expected ({size},), one value an input")
        return array

    def _arrival(self) -> ArrivalSet:
        if self._arrays["clock"][kernel.BASE] == 0:
            return self._initial
        n, lower, upper = self.model.n_states, self._arrays["h_lower"].copy(), self._arrays["h_upper"].copy()
        return ArrivalSet(lower[:n], upper[:n], self._template, lower[n:], upper[n:])

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
        w_old = self._last_bounds or w
        data = (self._window, self._size, first, u, u_next, y, stack, noise, *w_old, *w)
        if end is None:
            verdict = self._take(data)
        else:
            self._enter(data, end)
            verdict = self._solve_until(end)
        self._last_bounds = w
        return WindowStep(self, self._time, verdict, self._falsified, perf_counter() - begun)

    def _take(self, data: tuple[Any, ...]) -> VerdictName:
        """One sample with all its programs, in one compiled call unless the window seems empty."""
        if self.sign_split or self._injection is not None:
            self._enter(data)
            return self._solve(kernel.ARRIVAL)
        code, verdict, program = kernel.take(*data, self.eps, kernel.PIVOT_LIMIT)
        self._check_entry(code, data)
        if verdict == kernel.CONSISTENT:
            return "consistent"
        return self._conclude(kernel.ARRIVAL, verdict, program)

    def _enter(self, data: tuple[Any, ...], end: float | None = None) -> None:
        """One sample without its programs, but for those of its channels, which stop at the time ``end``."""
        injected, given = False, data
        if self._injection is not None:
            data, injected = self._inject(data)
        code = kernel.enter(*data)
        self._check_entry(code, given)
        w, s = self._arrays, self._time % (self._size.N + 1)
        if self._injection is not None:  # it is for outputs that w enters, where the clock has moved on by now
            w["given.stack"][s], w["given.y"][s], w["given.injected"][s] = given[6], given[5], injected
            w["given.slack"][s] = 0.0
        if end is None:
            self._settle_channels(code == kernel.SIGN_OPEN)
        elif code == kernel.SIGN_OPEN:
            v = self._time % (self._size.N + self._size.late)
            for program in range(2 * self._size.nq):
                if w["s_lower"][v, program // 2] < 0.0 < w["s_upper"][v, program // 2]:
                    self._solve_in_portions(kernel.CHANNELS, program, end)
        if injected:
            self._widen(given)
        kernel.complete(*data[:3], self.eps)
        if self._injection is not None and not injected:
            w["given.slack"][s] = w["slack"][s]

    def _inject(self, data: tuple[Any, ...]) -> tuple[tuple[Any, ...], bool]:
        """A sample's data with w injected where y is complete."""
        assert self._injection is not None
        *head, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper = data
        stack, y, noise, injected = self._injection.transform(stack, y, (w_lower, w_upper))
        none = np.zeros(self.model.n_states)
        bounds = (np.concatenate([b, none]) for b in (w_old_lower, w_old_upper, w_lower, w_upper))
        return (*head, y, stack, noise, *bounds), injected

    def _widen(self, given: tuple[Any, ...]) -> None:
        """Bounds of what the injection leaves to the state and to the box of w, by what is known of the state."""
        assert self._injection is not None
        u, y, stack, w = given[4], given[5], given[6], given[10:12]
        s, v = self._time % (self._size.N + 1), self._time % (self._size.N + self._size.late)
        arrays, nw = self._arrays, self.model.n_disturbances
        d, widening, slack = self._injection.widths(stack, y, u, arrays["mag"][s], w, self.eps)
        arrays["w_lower"][v, nw:], arrays["w_upper"][v, nw:] = -d, d
        arrays["noise"][s] += widening
        arrays["given.slack"][s] = slack

    def _certificate(self, objective: tuple[int, Array] | None = None) -> WindowCertificate:
        """Of the multipliers at hand, about the model and the data as given."""
        if self._injection is not None:
            return self._injection.certificate(self._arrays, self._size, self._arrival(), objective)
        return certificate_of(self._arrays, self._size, self._arrival())

    @staticmethod
    def _check_entry(code: int, data: tuple[Any, ...]) -> None:
        if code in _ENTRY_ERRORS:
            raise ValueError(_ENTRY_ERRORS[code].format(u=data[3], y=data[5]))

    def _settle_channels(self, sign_open: bool) -> None:
        """Tighten the bounds of those s whose sign is open."""
        if sign_open:
            self._solve(kernel.CHANNELS)

    def _solve(self, task: int) -> VerdictName:
        """Solve the programs of a task; an empty window counts only once its certificate is proven."""
        if self.sign_split and task != kernel.CHANNELS:
            split = SplitPrograms(self._arrays, self._window, self._size, self._certificate, self.sign_split)
            if split.is_needed:
                return self._solve_split(split, task)
        verdict, program = kernel.solve(self._window, self._size, task, 0, kernel.ALL, kernel.PIVOT_LIMIT)
        return self._conclude(task, verdict, program)

    def _conclude(self, task: int, verdict: int, program: int) -> VerdictName:
        """What the programs of a task say; those after one that found the window empty have yet to be solved."""
        while verdict == kernel.EMPTY_CANDIDATE:
            if task == kernel.ARRIVAL and self._prove():
                return "falsified"
            after = program + 1
            verdict, program = kernel.solve(self._window, self._size, task, after, kernel.ALL, kernel.PIVOT_LIMIT)
        if verdict == kernel.CONSISTENT:
            return "consistent"
        return self._ask_highs() if task == kernel.ARRIVAL else "undecided"

    def _solve_split(self, split: SplitPrograms, task: int) -> VerdictName:
        """As `_solve`, each program over its cells."""
        w, clock = self._arrays, self._arrays["clock"]
        base, time = int(clock[kernel.BASE]), int(clock[kernel.TIME])
        programs = {
            kernel.ARRIVAL: range(*kernel.arrival_programs.py_func(self._size, base, time)),
            kernel.NEWEST: range(2 * self._size.nt),
            kernel.QUERY: range(1),
        }[task]
        prefix = {kernel.ARRIVAL: "new", kernel.NEWEST: "now"}.get(task)
        has_point = False
        for program in programs:
            sign = 1.0 - 2.0 * (program % 2)
            target = w["answer"] if prefix is None else w[f"{prefix}_{'lower' if program % 2 else 'upper'}"]
            at = 0 if prefix is None else program // 2
            result = split.solve(task, program, lambda t=target, i=at, s=sign: float(s * t[i]))  # type: ignore[misc]
            has_point = has_point or result.has_point
            if result.proof is None:
                target[at] = sign * result.value
            elif task == kernel.ARRIVAL and result.proof.verify():
                self._falsified = result.proof
                return "falsified"
        return "consistent" if has_point else "undecided"

    def _solve_until(self, end: float) -> VerdictName:
        """The arrival programs in small portions of pivots, until a time is reached."""
        clock, decided = self._arrays["clock"], False
        base, time = clock[kernel.BASE], clock[kernel.TIME]
        for program in range(*kernel.arrival_programs.py_func(self._size, base, time)):
            verdict = self._solve_in_portions(kernel.ARRIVAL, program, end)
            if verdict == kernel.EMPTY_CANDIDATE and self._prove():
                return "falsified"
            decided = decided or verdict == kernel.CONSISTENT
        if time - base == self._size.N:
            clock[kernel.PENDING] = 1
        return "consistent" if decided else "undecided"

    def _solve_in_portions(self, task: int, program: int, end: float) -> int:
        """One program, its pivots in portions until it is decided or the time ``end`` is reached."""
        verdict, late, done = kernel.UNDECIDED, False, 0
        while verdict == kernel.UNDECIDED and not late:
            late = perf_counter() >= end or done >= kernel.PIVOT_LIMIT
            portion = 0 if late else _PIVOTS_BETWEEN_LOOKS
            verdict, _ = kernel.solve(self._window, self._size, task, program, program + 1, portion)
            done += portion
        return int(verdict)

    def _prove(self) -> bool:
        """Whether the multipliers at hand prove in exact arithmetic that the window is empty; keeps the proof."""
        certificate = self._certificate()
        if certificate.verify():
            self._falsified = certificate
        return self._falsified is not None

    def _prove_again(self) -> None:
        """The proof of a falsification, from the window alone."""
        if self.sign_split:
            self._solve(kernel.ARRIVAL)
        if self._falsified is None:
            self._falsified = self._certificate()

    def _ask_highs(self) -> VerdictName:
        w = self._arrays
        feasible, ray = is_feasible(w["G"], w["lower"], w["upper"])
        if feasible is False:
            for multipliers in candidates(ray):
                w["farkas"][:] = multipliers
                if self._prove():
                    return "falsified"
        return "consistent" if feasible else "undecided"

    def _check_current(self, sample: int) -> None:
        if sample != self._time:
            raise ValueError(
                f"the set of sample {sample} was not read before sample {self._time}; "
                "read it right after its step, or use run(log)"
            )

    def _bounds_at(self, sample: int) -> tuple[Array, Array]:
        """Bounds of the state in the template's directions; the axes come first."""
        self._check_current(sample)
        if self._falsified is not None:
            nothing = np.full(self._size.nt, np.nan)
            return nothing, nothing.copy()
        self._solve(kernel.NEWEST)
        return self._arrays["now_lower"].copy(), self._arrays["now_upper"].copy()

    def _support_at(self, sample: int, directions: Array) -> Array:
        self._check_current(sample)
        if self._falsified is not None:
            return np.full(len(directions), -np.inf)
        values = np.empty(len(directions))
        for i, direction in enumerate(directions):
            self._arrays["query"][:] = direction
            self._solve(kernel.QUERY)
            values[i] = self._arrays["answer"][0]
        return values

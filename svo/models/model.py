"""Uncertain linear parameter-varying models, the one model type of the package.

    x(k+1) = A x + B u + a + E w + sum_i Delta_i (A_i x + B_i u + a_i + E_i w)
    y(k)   = C x + D u + c + F w + v + sum_i Delta_i (C_i x + D_i u + c_i + F_i w)

with w(k) in a box or a polytope (the same w(k) enters both lines), |v| <= n per sensor, and
Delta_i(k) anywhere in [lo_i, hi_i], free to change at each sample. Rosa and Silvestre, Control
Engineering Practice 21 (2013), equations (1) and (8), are the case without a, c, F and shared Delta.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.shown import Picture, Shown, counted
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_kind, expect_shape, finite_array, listed, positive_number
from svo.logs.log import Log
from svo.models.bounds import Bounds, bounds_of
from svo.models.discretisation import check_constant
from svo.models.draws import draw, draw_mixture
from svo.models.mat import read_model
from svo.models.origin import Origin
from svo.models.responses import picture_of_responses
from svo.models.schedule_table import ScheduleTable
from svo.models.stack import Layout, Stack, may_be_nonzero
from svo.models.state_range import StateRange, start_range, state_range
from svo.models.statespace import state_space
from svo.models.uncertainty import Schedulable, Uncertainty

__all__ = ["UncertainModel", "Uncertainty"]

_TYPICAL = -1.0  # the sample before the first stands for the typical schedule, at which observers choose their rows


@options_by_name
@dataclass(frozen=True, eq=False)
class UncertainModel(Shown):
    """An uncertain linear (parameter-varying) model in discrete time.

    Parameters
    ----------
    A, B, C : (n, n), (n, nu), (ny, n) arrays or functions of the schedule
        ``B=None`` is a model without inputs.
    E : (n, nw), optional
        Disturbance directions; default none.
    w : (lower, upper), a half-width vector (nw,), or an HPolytope in dimension nw
        The disturbance set; needed if E or F has columns. The two bounds may each be a function of the schedule.
    D, F, a, c : (ny, nu), (ny, nw), (n,), (ny,), optional
        Feedthrough, disturbance in the output, and the affine terms.
    n : (ny,) or float, optional
        Half-width of the sensor noise; zero (exact sensors) by default. May be a function of the schedule.
    Ts : float
        Sampling time [s].
    names : mapping, optional
        Any of "states", "inputs", "outputs", "disturbances" to a sequence of names.
    uncertainties : sequence of Uncertainty
    schedule : optional
        A typical scheduling value. Needed if any array or bound is a function: shapes are checked with it.
    origin : optional
        The continuous plant behind the model, which `from_continuous` sets; faults are stated in its time.
    physical : (lower, upper), optional
        The state never leaves this range: a promise about the plant at all times, a number or (n,) each, -inf or inf
        where there is none. Observers cut their sets to it, and every alarm is given it.
    largest : (lower, upper), optional
        Bounded. Holds the state at those samples at which an observer that has lost it starts again, after a gap in
        the measurements; every later alarm is given it, and says so. By default ``physical`` if that is bounded.
        Without either such an observer is undecided until the readings alone bound the state.

    Attributes
    ----------
    physical_range, start_range : StateRange or None
        ``physical``, and where a set starts again: ``largest`` within ``physical``.

    Raises
    ------
    ValueError
        Naming the array, its shape and the expected one; also for NaN and Inf.
    """

    A: Schedulable
    B: Schedulable
    C: Schedulable
    _: KW_ONLY
    D: Schedulable = None
    E: Schedulable = None
    w: Any = None
    F: Schedulable = None
    n: Schedulable = None
    a: Schedulable = None
    c: Schedulable = None
    Ts: float = 1.0
    names: Mapping[str, Sequence[str]] | None = None
    uncertainties: Sequence[Uncertainty] = ()
    schedule: Any = None
    physical: Any = None
    largest: Any = None
    origin: Origin | None = field(default=None, repr=False)
    layout: Layout = field(init=False, repr=False)
    _stack: Stack = field(init=False, repr=False)
    _bounds: Bounds = field(init=False, repr=False)
    physical_range: StateRange | None = field(init=False, repr=False)
    start_range: StateRange | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "uncertainties", tuple(listed("uncertainties", self.uncertainties, Uncertainty)))
        object.__setattr__(self, "Ts", positive_number("Ts", self.Ts, "sampling time in seconds"))
        object.__setattr__(self, "layout", Layout.of(self, self.schedule))
        n = self.layout.n
        object.__setattr__(self, "physical_range", state_range("physical", self.physical, n, bounded=False))
        largest = state_range("largest", self.largest, n, bounded=True)
        object.__setattr__(self, "start_range", start_range(self.physical_range, largest))
        object.__setattr__(self, "_stack", Stack.of(self.layout, self, self.uncertainties, self.schedule))
        object.__setattr__(self, "_bounds", bounds_of(self.w, self.n, self.layout.nw, self.layout.ny))
        if self._bounds.scheduled and self.schedule is None:
            raise ValueError(
                "schedule is missing: w or n is a function of it, so give a typical value to check shapes with"
            )
        self.stack(self.schedule)
        self.bounds(self.schedule)
        self.layout.check_names(self.names)

    # -- sizes ---------------------------------------------------------------------------------

    @property
    def n_states(self) -> int:
        """How many states x there are."""
        return self.layout.n

    @property
    def n_inputs(self) -> int:
        """How many inputs u there are."""
        return self.layout.nu

    @property
    def n_outputs(self) -> int:
        """How many sensors y there are."""
        return self.layout.ny

    @property
    def n_disturbances(self) -> int:
        """How many disturbances w there are."""
        return self.layout.nw

    @property
    def is_scheduled(self) -> bool:
        """Whether any array or bound is a function of the schedule."""
        return bool(self._stack.scheduled) or self._bounds.scheduled

    @property
    def stack_table(self) -> ScheduleTable | None:
        """The stack over a scalar schedule, where all that is scheduled in it are tables over the same points."""
        return self._stack.table

    @property
    def uses_input_in_output(self) -> bool:
        """Whether y(k) depends on u(k), so that a step needs ``u_next``."""
        return may_be_nonzero(self.D, *(u.D for u in self.uncertainties))

    @property
    def jitter(self) -> Array | None:
        """Bounds (ny,) of the errors of the sensors' time stamps [s]; None if they are exact."""
        stamps = None if self.origin is None else self.origin.stamps
        return None if stamps is None else stamps.jitter

    @property
    def disturbance_polytope(self) -> HPolytope | None:
        """The disturbance set, where it was given as a polytope."""
        return self.w if isinstance(self.w, HPolytope) else None

    def __repr__(self) -> str:
        sizes = {"state": self.n_states, "input": self.n_inputs, "output": self.n_outputs}
        sizes |= {"disturbance": self.n_disturbances, "uncertainty": len(self.uncertainties)}
        return f"<UncertainModel of {counted(sizes)}; Ts = {self.Ts:g} s{', scheduled' if self.is_scheduled else ''}>"

    def _picture(self) -> Picture:
        return picture_of_responses(self.stack(self.schedule)[0], self.n_states, self.n_inputs, self.Ts)

    # -- evaluation ----------------------------------------------------------------------------

    def stack(self, schedule: Any = None) -> Array:
        """All matrices at one sample, whose scheduling value is ``schedule``.

        Returns
        -------
        (1 + n_uncertainties, n + ny, n + nu + 1 + nw) array
            Item 0 is [[A B a E], [C D c F]]; item i is the same stack of uncertainty i.
        """
        return self._stack.at(schedule)

    def stack_over(self, schedule: ArrayLike) -> Array:
        """`stack` at many samples.

        A function of the schedule that has a method ``over`` itself, as `ScheduleTable` has, is asked for all
        samples at once; others are called once a sample.

        Parameters
        ----------
        schedule : (K, ...) array
            One value a sample.

        Returns
        -------
        (K, 1 + n_uncertainties, n + ny, n + nu + 1 + nw) array
        """
        return self._stack.over(schedule)

    def bounds(self, schedule: Any = None) -> tuple[Array, Array, Array]:
        """Disturbance bounds (nw,), (nw,) and noise half-width (ny,) at one sample, from its value of the schedule."""
        return self._bounds.at(schedule)

    def bounds_over(self, schedule: ArrayLike) -> tuple[Array, Array, Array]:
        """`bounds` over a schedule (K, ...): (K, nw), (K, nw), (K, ny); functions are asked as by `stack_over`."""
        return self._bounds.over(schedule)

    def along(self, schedule: ArrayLike | None) -> UncertainModel:
        """The same model along one log, the schedule of sample k being the number k.

        Every function of the schedule is evaluated once for all samples and tabulated, which saves their evaluation
        where several observers, or many runs, go over one log. A model without schedule is returned as it is.

        Parameters
        ----------
        schedule : (K, ...) array, or None
            One value a sample, K >= 1. None will do for a model without schedule.

        Raises
        ------
        ValueError
            For a schedule that is missing or not shaped like the typical one, or an array or bound that is not finite.
        """
        if not self.is_scheduled:
            return self
        if schedule is None:
            raise ValueError("schedule is missing: the model has arrays or bounds that are functions of it")
        values: Array = finite_array("schedule", schedule)
        expect_shape(values.ndim and len(values), "schedule", values, "(K, ...), one value a sample")
        typical: Array = finite_array("schedule of the model", self.schedule)
        if typical.shape != values.shape[1:]:
            raise ValueError(f"schedule has shape {values.shape[1:]} at a sample; expected {typical.shape}")
        values = np.concatenate([typical[None], values])
        samples: Array = _TYPICAL + np.arange(float(len(values)))
        own, *others = self._stack.tables(samples, values)
        changes: dict[str, Any] = {**own, "schedule": _TYPICAL}
        if self._bounds.scheduled:
            lower, upper, noise = (ScheduleTable(samples, edge) for edge in self.bounds_over(values))
            changes |= {"n": noise} if self.disturbance_polytope is not None else {"w": (lower, upper), "n": noise}
        tabled = [replace(item, **of) for item, of in zip(self.uncertainties, others, strict=True)]
        return self.replace(**changes, uncertainties=tabled)

    @options_by_name
    def block(self, name: str, schedule: Any = None, *, uncertainty: int | None = None) -> Array:
        """One matrix by its name ("A", "B", ...) at a value of the schedule.

        It is that of the model, or that of an ``uncertainty``, counted from 0.
        """
        rows, cols = self.layout.block(name)
        value = self.stack(schedule)[0 if uncertainty is None else uncertainty + 1, rows, cols]
        return value[:, 0] if name in "ac" else value

    def replace(self, **changes: Any) -> UncertainModel:
        """A copy with ``changes`` of arguments by name, checked again; arrays are those of discrete time."""
        if self.origin is not None:
            changes = {"origin": self.origin.after(changes)} | changes
        return replace(self, **changes)

    def in_given_time(self, change: Callable[[UncertainModel], UncertainModel]) -> UncertainModel:
        """The model after a change of its arrays in the time in which it was given, as faults state it.

        A model of `from_continuous` is changed in continuous time and discretised again, any other as it is.
        """
        return change(self) if self.origin is None else self.origin.changed(change)

    # -- construction from other forms -----------------------------------------------------------

    @classmethod
    @options_by_name
    def from_continuous(
        cls,
        A: ArrayLike,
        B: ArrayLike | None,
        C: ArrayLike,
        *,
        Ts: float,
        remainder: ArrayLike | Mapping[str, ArrayLike] | None = None,
        varying: str | Sequence[str] = (),
        jitter: ArrayLike | None = None,
        **rest: Any,
    ) -> UncertainModel:
        """Discretisation of dx/dt = A x + B u + a + E w + sum_i Delta_i (A_i x + B_i u + a_i + E_i w).

        Inputs are held over a sample, and so is each w and each Delta that ``varying`` does not name: it changes at
        the samples only (a square wave inside a sample breaks that, and a healthy plant may then be falsified). A
        fault begins at a sample too, unless its Delta varies.

        A, B, a and E are discretised exactly (zero-order hold). The exponential of an uncertain matrix is not affine
        in Delta, so each uncertainty keeps the directions Gamma [A_i B_i a_i E_i], Gamma = int_0^Ts exp(A t) dt, as
        if x were held over the sample. What that leaves out, and what varies inside the sample beside its mean there,
        enters as n more disturbances with proven bounds (`svo.models.discretisation`). Where the output depends on a w
        or Delta that varies, its value at the sample and its mean are two numbers.

        Parameters
        ----------
        A, B, C, and in ``rest`` the other arguments of `UncertainModel`
            Those of the state equation in continuous time, and constant.
        Ts : float
            Sampling time [s].
        remainder : {"states": (n,), "inputs": (nu,)} or (n,) array
            Largest |x| at any time and largest |u|, in healthy and faulty operation, from which the bounds of what the
            uncertainties leave out are computed; or these bounds, per sample. Needed if an uncertainty has an A, or
            varies.
        varying : str or sequence of str
            What varies inside a sample, within its bounds: "all", "w" or "Delta" (all of them), "w[0]", "Delta[1]", or
            names of disturbances and uncertainties. "all" and "Delta" hold for the Delta of a fault too.
        jitter : float or (ny,) array, optional
            Bound of the error of the time stamps [s]: a reading may have been taken so much before or after its stamp.
            Inputs change at their stamps. Rows of such sensors are widened by what the output can change meanwhile.

        Raises
        ------
        TypeError, ValueError
            Naming the array, its shape and the expected one, or the ``remainder`` that is missing.
        """
        arrays = {"A": A, "B": B, "C": C, "Ts": Ts} | rest
        check_constant(arrays)
        made: UncertainModel = Origin(cls(**arrays), remainder, varying, jitter=jitter).model()
        return made

    @classmethod
    @options_by_name
    def from_statespace(cls, sys: Any, *, Ts: float | None = None, **rest: Any) -> UncertainModel:
        """From a ``control.StateSpace``, a system of ``scipy.signal``, or an object with A, B, C, D and dt.

        A continuous system (dt = 0; `scipy.signal.lti`) is discretised with ``Ts``; a discrete one keeps its dt, or
        has the sampling time ``Ts`` if its dt is True. One that leaves open which it is (dt = None) is refused.
        A transfer function of scipy is realised first (`to_ss`).

        Parameters
        ----------
        sys : the system
        Ts : float, optional
            Sampling time [s].
        rest
            Further arguments of `UncertainModel`, or of `from_continuous` for a continuous system.
        """
        found = state_space(sys, Ts)
        make = cls.from_continuous if found.is_continuous else cls
        return make(found.A, found.B, found.C, D=found.D, Ts=found.Ts, **rest)

    @classmethod
    @options_by_name
    def from_mat(cls, path: str | Path, *, Ts: float, **rest: Any) -> UncertainModel:
        """From the variables A, B, C, ... of a MAT file; see `svo.models.mat.read_arrays`.

        Parameters
        ----------
        path : path of a MAT file up to version 7.2
            Its matrices are those of discrete time.
        Ts : float
            Sampling time [s].
        rest
            Further arguments, such as ``uncertainties``.
        """
        return cls(**{"B": None} | read_model(path, rest) | rest, Ts=Ts)

    # -- simulation ------------------------------------------------------------------------------

    @options_by_name
    def simulate(
        self,
        x0: ArrayLike,
        u: ArrayLike,
        rng: np.random.Generator,
        *,
        corners: bool = False,
        schedule: ArrayLike | None = None,
    ) -> Log:
        """A run with random w, noise and Delta inside their bounds, for tests and tutorials.

        Parameters
        ----------
        x0 : (n,) array
        u : (K, nu) array
            One row a sample; the log has K samples.
        rng : numpy.random.Generator
        corners : bool
            Draw every w, noise and Delta at an end of its interval instead of uniformly inside.
        schedule : (K, ...) array, optional
            Scheduling value of each sample; needed if an array or a bound is a function of it.

        Raises
        ------
        TypeError
            If rng is no Generator.
        ValueError
            For a wrong shape, NaN or Inf, or a schedule that is missing.
        """
        inputs = finite_array("u", u, ("samples", self.n_inputs))
        x: Array = finite_array("x0", x0, (self.n_states,))
        expect_shape(len(inputs), "u", inputs, f"(samples, {self.n_inputs}), at least one sample")
        expect_kind("rng", rng, np.random.Generator, "a numpy Generator, such as np.random.default_rng(0)")
        values = None if schedule is None else finite_array("schedule", schedule)
        if values is None and self.is_scheduled:
            raise ValueError(
                "schedule is missing: the model has arrays that are functions of it; give one value a sample"
            )
        if values is not None and values.shape[:1] != inputs.shape[:1]:
            raise ValueError(
                f"schedule has shape {values.shape}; expected ({len(inputs)}, ...), one value a sample of u"
            )
        n, states, outputs = self.n_states, [], []
        limits = np.array([q.bounds for q in self.uncertainties]).reshape(-1, 2)
        polytope = self.disturbance_polytope
        vertices = None if polytope is None else polytope.vertices()
        for k, held in enumerate(inputs):
            value = None if values is None else values[k]
            lower, upper, noise = self.bounds(value)
            w = draw(lower, upper, rng, corners) if vertices is None else draw_mixture(vertices, rng, corners)
            deltas = draw(limits[:, 0], limits[:, 1], rng, corners)
            total = np.tensordot(np.concatenate([[1.0], deltas]), self.stack(value), axes=1)
            known = np.concatenate([x, held, [1.0], w])
            states.append(x)
            outputs.append(total[n:] @ known + draw(-noise, noise, rng, corners))
            x = total[:n] @ known
        time: Array = np.arange(len(inputs), dtype=float) * self.Ts
        return Log(time=time, u=inputs, y=np.array(outputs), x=np.array(states), schedule=values)


def expect_model(name: str, value: Any, *, jitter: bool = False) -> None:
    """TypeError unless it is a model; ValueError if its sensors' stamps are off, but where ``jitter`` is taken."""
    expect_kind(name, value, UncertainModel, "an UncertainModel")
    if value.jitter is not None and not jitter:
        raise ValueError(f"{name} has jitter, which only observers take, such as WindowObserver; make it without")

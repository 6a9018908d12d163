"""Uncertain linear parameter-varying models, the one model type of the package.

    x(k+1) = A x + B u + a + E w + sum_i Delta_i (A_i x + B_i u + a_i + E_i w)
    y(k)   = C x + D u + c + F w + v + sum_i Delta_i (C_i x + D_i u + c_i + F_i w)

with w(k) in a box or a polytope (the same w(k) enters both lines), |v| <= n per sensor, and
Delta_i(k) anywhere in [lo_i, hi_i], free to change at each sample. Rosa and Silvestre, Control
Engineering Practice 21 (2013), equations (1) and (8), are the case without a, c, F and shared Delta.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array, finite_array, positive_number
from svo.logs.log import Log
from svo.models.along import along
from svo.models.bounds import Bounds, bounds_of
from svo.models.mat import read_arrays
from svo.models.simulation import simulate
from svo.models.stack import OUTPUT_BLOCKS, STATE_BLOCKS, Layout, ScheduledBlock, Stack, may_be_nonzero
from svo.models.state_range import StateRange, start_range, state_range
from svo.models.statespace import state_space
from svo.models.uncertainty import Schedulable, Uncertainty

if TYPE_CHECKING:
    from svo.models.origin import Origin

__all__ = ["UncertainModel", "Uncertainty"]


@dataclass(frozen=True, eq=False)
class UncertainModel:
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
    E: Schedulable = None
    w: Any = None
    D: Schedulable = None
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
        object.__setattr__(self, "uncertainties", tuple(self.uncertainties))
        object.__setattr__(self, "Ts", positive_number("Ts", self.Ts, "sampling time in seconds"))
        object.__setattr__(self, "layout", self._measure())
        n = self.layout.n
        object.__setattr__(self, "physical_range", state_range("physical", self.physical, n, bounded=False))
        largest = state_range("largest", self.largest, n, bounded=True)
        object.__setattr__(self, "start_range", start_range(self.physical_range, largest))
        object.__setattr__(self, "_stack", self._stacked())
        object.__setattr__(self, "_bounds", bounds_of(self.w, self.n, self.layout.nw, self.layout.ny))
        if self._bounds.scheduled and self.schedule is None:
            raise ValueError(
                "schedule is missing: w or n is a function of it, so give a typical value to check shapes with"
            )
        self.stack(self.schedule)
        self.bounds(self.schedule)
        self._check_names()

    # -- sizes ---------------------------------------------------------------------------------

    @property
    def n_states(self) -> int:
        return self.layout.n

    @property
    def n_inputs(self) -> int:
        return self.layout.nu

    @property
    def n_outputs(self) -> int:
        return self.layout.ny

    @property
    def n_disturbances(self) -> int:
        return self.layout.nw

    @property
    def is_scheduled(self) -> bool:
        """Whether any array or bound is a function of the schedule."""
        return bool(self._stack.scheduled) or self._bounds.scheduled

    @property
    def uses_input_in_output(self) -> bool:
        """Whether y(k) depends on u(k), so that a step needs ``u_next``."""
        return may_be_nonzero(self.D, *(u.D for u in self.uncertainties))

    @property
    def disturbance_polytope(self) -> HPolytope | None:
        """The disturbance set, where it was given as a polytope."""
        return self.w if isinstance(self.w, HPolytope) else None

    # -- evaluation ----------------------------------------------------------------------------

    def stack(self, schedule: Any = None) -> Array:
        """All matrices at one sample.

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
        """Disturbance bounds (nw,), (nw,) and noise half-width (ny,) at one sample."""
        return self._bounds.at(schedule)

    def bounds_over(self, schedule: ArrayLike) -> tuple[Array, Array, Array]:
        """`bounds` at many samples (K, nw), (K, nw), (K, ny); functions are asked as `stack_over` asks them."""
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
        return along(self, schedule)

    def block(self, name: str, schedule: Any = None, uncertainty: int | None = None) -> Array:
        """One matrix by its name ("A", "B", ...), of the model or of one of its uncertainties."""
        rows, cols = self.layout.block(name)
        value = self.stack(schedule)[0 if uncertainty is None else uncertainty + 1, rows, cols]
        return value[:, 0] if name in "ac" else value

    def replace(self, **changes: Any) -> UncertainModel:
        """A copy with some arguments changed, checked again; arrays are those of discrete time."""
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
    def from_continuous(
        cls,
        A: ArrayLike,
        B: ArrayLike | None,
        C: ArrayLike,
        *,
        Ts: float,
        remainder: ArrayLike | Mapping[str, ArrayLike] | None = None,
        varying: str | Sequence[str] = (),
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
        A, B, C, and the other arguments of `UncertainModel`
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

        Raises
        ------
        TypeError, ValueError
            Naming the array, its shape and the expected one, or the ``remainder`` that is missing.
        """
        from svo.models.origin import Origin

        return Origin.of({"A": A, "B": B, "C": C, "Ts": Ts} | rest, remainder, varying).model()

    @classmethod
    def from_statespace(cls, sys: Any, *, Ts: float | None = None, **rest: Any) -> UncertainModel:
        """From a ``control.StateSpace``, a system of ``scipy.signal``, or an object with A, B, C, D and dt.

        A continuous system (dt = 0; `scipy.signal.lti`) is discretised with ``Ts``; a discrete one keeps its dt, or
        has the sampling time ``Ts`` if its dt is True. One that leaves open which it is (dt = None) is refused.
        A transfer function of scipy is realised first (`to_ss`).
        """
        found = state_space(sys)
        feedthrough = found.D if found.D.any() else None
        if found.dt is not True and found.dt != 0:
            if Ts not in (None, found.dt):
                raise ValueError(
                    f"Ts is {Ts} but the system is discrete with dt = {found.dt}; resample it, or leave Ts out"
                )
            return cls(found.A, found.B, found.C, D=feedthrough, Ts=float(found.dt), **rest)
        if Ts is None:
            raise ValueError(f"Ts is missing: the system has dt = {found.dt!r}, so its sampling time must be given")
        if found.dt is True:
            return cls(found.A, found.B, found.C, D=feedthrough, Ts=Ts, **rest)
        return cls.from_continuous(found.A, found.B, found.C, Ts=Ts, D=feedthrough, **rest)

    @classmethod
    def from_mat(cls, path: str | Path, *, Ts: float, **rest: Any) -> UncertainModel:
        """From the variables A, B, C, ... of a MAT file; see `svo.models.mat.read_arrays`.

        ``rest`` are further arguments, such as ``uncertainties``; the matrices are those of discrete time.
        """
        arrays = read_arrays(path)
        for name in arrays.keys() & rest.keys():
            raise ValueError(f"{name} is given and {path} has it too; leave it out")
        for name in {"A", "C"} - {*arrays, *rest}:
            raise ValueError(f"{path} has no variable {name!r}; expected a matrix, or give it as an argument")
        return cls(**{"B": None} | arrays | rest, Ts=Ts)

    # -- simulation ------------------------------------------------------------------------------

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
        return simulate(self, x0, u, rng, corners=corners, schedule=schedule)

    # -- validation ------------------------------------------------------------------------------

    def _value(self, name: str, owner: Any) -> Array | None:
        value = getattr(owner, name)
        if value is None:
            return None
        if callable(value):
            if self.schedule is None:
                raise ValueError(
                    f"schedule is missing: {name} is a function of it, so give a typical value to check shapes with"
                )
            value = value(self.schedule)
        return finite_array(name, value)

    def _measure(self) -> Layout:
        A, B, C, E = (self._value(name, self) for name in "ABCE")
        if A is None or A.ndim != 2 or A.shape[0] != A.shape[1] or A.shape[0] == 0:
            raise ValueError(f"A has shape {None if A is None else A.shape}; expected a square matrix (n, n), n >= 1")
        if C is None or C.ndim != 2 or C.shape[1] != A.shape[0]:
            raise ValueError(f"C has shape {None if C is None else C.shape}; expected (ny, {A.shape[0]})")
        for name, value in (("B", B), ("E", E)):
            if value is not None and (value.ndim != 2 or value.shape[0] != A.shape[0]):
                raise ValueError(f"{name} has shape {value.shape}; expected ({A.shape[0]}, columns)")
        F = self._value("F", self)
        nw = E.shape[1] if E is not None else (F.shape[1] if F is not None and F.ndim == 2 else 0)
        return Layout(n=A.shape[0], nu=0 if B is None else B.shape[1], nw=nw, ny=C.shape[0])

    def _stacked(self) -> Stack:
        constant = np.zeros((1 + len(self.uncertainties), *self.layout.shape))
        scheduled = []
        for item, source in enumerate((self, *self.uncertainties)):
            owner = "" if item == 0 else f" of uncertainty {self.uncertainties[item - 1].name or item - 1}"
            for name in STATE_BLOCKS + OUTPUT_BLOCKS:
                value, array = getattr(source, name), self._value(name, source)
                if array is None:
                    continue
                if array.shape != self.layout.block_shape(name):
                    raise ValueError(self.layout.shape_message(owner, name, array.shape))
                rows, cols = self.layout.block(name)
                where = (item, rows, cols.start if array.ndim == 1 else cols)
                if callable(value):
                    scheduled.append(ScheduledBlock(name, owner, where, array.shape, value))
                else:
                    constant[where] = array
        return Stack(self.layout, constant, tuple(scheduled))

    def _check_names(self) -> None:
        sizes = {
            "states": self.n_states,
            "inputs": self.n_inputs,
            "outputs": self.n_outputs,
            "disturbances": self.n_disturbances,
        }
        if self.names is not None and not isinstance(self.names, Mapping):
            raise TypeError(f"names is {self.names!r:.80}; expected a table from any of {', '.join(sizes)} to names")
        for key, values in (self.names or {}).items():
            if key not in sizes:
                raise ValueError(f"names has the key {key!r}; expected any of {', '.join(sizes)}")
            if isinstance(values, str) or not hasattr(values, "__len__"):
                raise TypeError(f"names[{key!r}] is {values!r:.80}; expected a list of {sizes[key]} names")
            if len(values) != sizes[key]:
                raise ValueError(f"names[{key!r}] has {len(values)} entries; expected {sizes[key]}")

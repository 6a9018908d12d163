"""Nonlinear plants from their equations: dx/dt = f(x, u, w, p), y = h(x, u, w, p) + v."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.shown import Shown, counted
from polytopes.signatures import options_by_name
from polytopes.value import Value
from svo.checks import Array, expect, expect_kind, expect_shape, finite_array, is_count, positive_number, sizes
from svo.functions.operations import Op
from svo.functions.tape import Tape
from svo.functions.text import as_read
from svo.logs.log import Log
from svo.models.draws import draw
from svo.models.nonlinear.arguments import bounds_of, kept_of, names_of, varying_of
from svo.models.nonlinear.carrier import carrier_of
from svo.models.nonlinear.flow import Flow, Span, Undecided
from svo.models.nonlinear.output import LinearOutput, check_output
from svo.models.nonlinear.plant_kernel import PlantKernel
from svo.models.nonlinear.simulation import given_values, simulated
from svo.models.nonlinear.stamps import seen_near, stamped
from svo.models.nonlinear.tracing import Function, OfVectors, Symbols, retraced, traced, with_kept
from svo.models.nonlinear.transition import Transition
from svo.models.stamps import jitter_of
from svo.models.state_range import StateRange, beside, start_range, state_range


@options_by_name
@dataclass(frozen=True, eq=False)
class NonlinearModel(Value, Shown):
    """A plant dx/dt = f(x, u, w, p), y = h(x, u, w, p) + v, |v| <= n, taken by `WindowObserver`.

    f and h are traced once. At each sample the observer linearises the plant over the set that it knows, with a bound
    of what that leaves out which holds for every state of the set, every w and every p (linear forms with remainders,
    rounded outward; steps in time are enclosed before they are taken). How, and how wide, is in `docs/nonlinear.md`.

    Parameters
    ----------
    f, h : functions of vectors, or mappings from states and outputs to text
        Functions are built of ``+ - * / **`` and `svo.functions` and return a list of rows. Arguments named u, w and p
        are inputs, disturbances and parameters; one more, by any name, is the state. They may have those that they
        need, in any order. Text is an expression of the names below, such as ``"(Q - a * sqrt(h1)) / S"``, which is
        parsed and never executed.
    states : sequence of str
        Names, one a row of f.
    inputs, disturbances : sequence of str
        Names. Inputs are known, and constant from one sample to the next.
    outputs : sequence of str, optional
        Names, one a row of h.
    parameters : mapping from names to (lower, upper), or to a number
        Unknown numbers p, free at each sample within their bounds; a number is a constant.
    Ts : float
        Sampling time [s].
    n : (ny,) array or float
        Half-width of the sensors' noise.
    w : (lower, upper), or a half-width vector (nw,)
        Bounds of the disturbances.
    varying : str or sequence of str
        Disturbances and parameters that may change inside a sample: their names, "w" (all disturbances), "p" (all
        parameters) or "all". The others are held from sample to sample.
    constant : bool, str or sequence of str
        Parameters that never change, by name; True for all. Each is one more state, after the others, with zero
        derivative, so that data narrow its bounds: ranges and first sets are given for the states of f alone.
    jitter : float or (ny,) array, optional
        Bound of the error of the time stamps [s]: a reading may have been taken so much before or after its stamp. Only
        of equations in continuous time. Inputs change at their stamps.
    physical : (lower, upper), optional
        The state never leaves this range: a promise about the plant at all times; -inf or inf where there is none.
    valid : (lower, upper), optional
        Where the equations hold. Where the state may leave it, the set starts again from ``largest``, and the verdict
        is "undecided".
    largest : (lower, upper), optional
        Bounded; holds the state where a set starts again, and h holds there. By default ``physical``, which then must
        be bounded.
    continuous : bool
        False for equations in discrete time, x(k+1) = f(x(k), u(k), w(k), p(k)).

    Attributes
    ----------
    physical_range, valid_range, start_range : StateRange or None
        ``physical``, ``valid``, and ``largest`` within ``physical``; bounds of ``kept`` parameters included.
    kept, free : tuple of str
        Parameters that are states, and the others.

    Raises
    ------
    TypeError, ValueError
        Naming the argument or the row of f or h, what it is, and what was expected.
    """

    f: Function
    h: Function
    _: KW_ONLY
    states: Sequence[str]
    inputs: Sequence[str] = ()
    outputs: Sequence[str] | None = None
    disturbances: Sequence[str] = ()
    parameters: Mapping[str, tuple[float, float] | float] = field(default_factory=dict)
    Ts: float = 1.0
    n: Any = 0.0
    w: Any = None
    varying: str | Sequence[str] = ()
    constant: bool | str | Sequence[str] = False
    jitter: Any = None
    physical: Any = None
    valid: Any = None
    largest: Any = None
    continuous: bool = True
    kept: tuple[str, ...] = field(init=False, repr=False)
    free: tuple[str, ...] = field(init=False, repr=False)
    flow: Flow = field(init=False, repr=False)
    reading: Tape = field(init=False, repr=False)
    noise: Array = field(init=False, repr=False)
    physical_range: StateRange | None = field(init=False, repr=False)
    valid_range: StateRange | None = field(init=False, repr=False)
    start_range: StateRange = field(init=False, repr=False)

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        for what in ("states", "inputs", "disturbances"):
            put(what, names_of(what, getattr(self, what)))
        if not self.states:
            raise ValueError("states is empty; expected at least one name, one a row of f")
        put("Ts", positive_number("Ts", self.Ts, "sampling time in seconds"))
        expect_kind("continuous", self.continuous, bool, "True or False")
        span = bounds_of(self.w, self.disturbances, self.parameters)
        all_names = [*map(as_read, [*self.states, *self.inputs, *self.disturbances, *self.parameters])]
        twice = next((name for name in all_names if all_names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"the name {twice!r} stands for two things; expected states, inputs and so on to differ")
        if "pi" in all_names and (isinstance(self.f, Mapping) or isinstance(self.h, Mapping)):
            raise ValueError("the name 'pi' stands for two things, one of them the number; expected another name")
        symbols, n = self.symbols, len(self.states)
        low, high = (end[len(self.disturbances) :] for end in span)
        fixed = np.where(low == high, low, np.nan)
        put("kept", kept_of(self.constant, list(self.parameters), low < high))
        put("free", tuple(name for name in self.parameters if name not in self.kept))
        is_kept = np.isin([*self.disturbances, *self.parameters], self.kept)
        span, known = Span(*(end[~is_kept] for end in span)), Span(*(end[is_kept] for end in span))
        for name in ("physical", "valid"):
            put(f"{name}_range", state_range(name, getattr(self, name), n, bounded=False))
        largest = start_range(self.physical_range, state_range("largest", self.largest, n, bounded=True))
        if largest is None:
            raise ValueError(
                "largest is missing, and physical is not bounded; expected largest=(lower, upper): where the state is "
                "when a set has to start again, which every later alarm then rests on"
            )
        if self.valid_range is not None and not self.valid_range.cut(largest.lower, largest.upper)[2]:
            raise ValueError("largest and valid have no common point; expected sets to start where equations hold")
        put("start_range", beside(largest, known, n))
        put("physical_range", beside(self.physical_range, known, n))
        if self.valid_range is not None:
            put("valid_range", beside(self.valid_range, known, n))
        own = traced("f", self.f, symbols, fixed, self.states, self.kept)
        tape = with_kept(own, n, len(self.kept), self.continuous)
        varies = varying_of(self.varying, self.disturbances, self.free)
        put("flow", Flow(tape, span, varies, (*self.states, *self.kept), self.physical_range, self.valid_range))
        written = tuple(self.h) if isinstance(self.h, Mapping) else None
        outputs = written if self.outputs is None else names_of("outputs", self.outputs)
        put("reading", traced("h", self.h, symbols, fixed, outputs, self.kept))
        ny = len(self.reading.outputs)
        if ny == 0:
            raise ValueError("h has no rows; expected at least one sensor")
        put("outputs", outputs or tuple(f"y[{i}]" for i in range(ny)))
        noise = np.full(ny, self.n) if np.ndim(self.n) == 0 else self.n
        put("noise", sizes("n", noise, ny))
        put("jitter", jitter_of(self.jitter, ny))
        expect(self.continuous or self.jitter is None, "jitter", self.jitter, "None for equations in discrete time")

    def __getstate__(self) -> dict[str, Any]:
        """Functions travel as what they were traced to: a pickle need not know where they were written."""
        pair = zip(("f", "h"), self.equations, strict=True)
        return self.__dict__ | {name: own for name, own in pair if not isinstance(getattr(self, name), Mapping)}

    # -- sizes -----------------------------------------------------------------------------------

    @property
    def symbols(self) -> Symbols:
        """Names of what f and h are of."""
        return Symbols(self.states, self.disturbances, tuple(self.parameters), self.inputs)

    def __repr__(self) -> str:
        sizes = {"state": self.n_states, "input": self.n_inputs, "output": self.n_outputs}
        sizes |= {"disturbance": self.n_disturbances, "parameter": len(self.parameters)}
        return f"<NonlinearModel of {counted(sizes)}; Ts = {self.Ts:g} s>"

    @property
    def n_states(self) -> int:
        """How many states there are: those of f, then the ``kept`` parameters."""
        return len(self.states) + len(self.kept)

    @property
    def n_inputs(self) -> int:
        """How many inputs u there are."""
        return len(self.inputs)

    @property
    def n_outputs(self) -> int:
        """How many sensors y there are."""
        return len(self.noise)

    @property
    def n_disturbances(self) -> int:
        """How many disturbances w there are."""
        return len(self.disturbances)

    @property
    def is_scheduled(self) -> bool:
        """Never: an observer asks for the matrices of a sample itself."""
        return False

    @property
    def uses_input_in_output(self) -> bool:
        """Whether y(k) depends on u(k), so that a step needs ``u_next``."""
        used = self.reading.used
        return bool(used[len(used) - self.n_inputs :].any())

    @property
    def reads(self) -> tuple[int | None, ...]:
        """Of each output, the state that it reads as it is; None where it is anything else."""
        tape = self.reading
        slots = [(int(tape.operands[i, 0]), tape.op[i] == Op.VARIABLE) for i in tape.outputs.tolist()]
        return tuple(j if plain and j < self.n_states else None for j, plain in slots)

    @property
    def names(self) -> Mapping[str, Sequence[str]]:
        """Of states, inputs, outputs and disturbances."""
        every = {"states": (*self.states, *self.kept), "inputs": self.inputs, "outputs": self.outputs or ()}
        return every | {"disturbances": self.disturbances}

    @cached_property
    def carrier(self) -> Any:
        """The `UncertainModel` whose schedule is the `Linearisation` of a sample: what an observer's kernel is given.

        Its disturbances are w, p, and one a state between -1 and 1, whose column is the remainder.
        """
        n, nw = self.n_states, len(self.flow.varying)
        ends = _ends(self.physical_range), _ends(self.start_range)
        is_disturbed = bool((self.reading.used[n : n + nw] & ~self.flow.varying).any())
        return carrier_of(self.flow, self.n_inputs, is_disturbed, self.noise, self.Ts, *ends)

    @cached_property
    def kernel(self) -> PlantKernel:
        """The model in the core."""
        outputs = self.outputs or ()
        return PlantKernel(self.flow, self.reading, self.noise, self.continuous, self.start_range, outputs)

    @property
    def equations(self) -> tuple[OfVectors, OfVectors]:
        """f and h as functions of the vectors x, w, p and u that the model has, by these names: to make others of."""
        symbols = self.symbols
        return retraced("f", self.f, symbols, self.states), retraced("h", self.h, symbols, self.outputs)

    def replace(self, **changes: Any) -> NonlinearModel:
        """A copy with ``changes`` of arguments by name, checked again."""
        return replace(self, **changes)

    def whole(self, set: HPolytope) -> HPolytope:
        """A ``set`` of states with the bounds of constant parameters, where it is one of the states of f alone."""
        if not self.kept or set.dim != len(self.states):
            return set
        n = len(self.states)
        return set.product(HPolytope.box(self.start_range.lower[n:], self.start_range.upper[n:]))

    # -- over a set ------------------------------------------------------------------------------

    @options_by_name
    def transition(
        self, lower: ArrayLike, upper: ArrayLike, u: ArrayLike = (), *, dt: float | None = None
    ) -> Transition:
        """x+ in A x + a + E (w, p) + [-R, R] for all states of a box, all w and all p.

        Parameters
        ----------
        lower, upper : (n,) arrays
            The box.
        u : (nu,) array
            Held over the transition.
        dt : float, optional
            Its length [s]; by default ``Ts``. Only of a continuous model.

        Raises
        ------
        Undecided
            If it is not enclosed, leaves ``valid``, or leaves out more than ``largest`` is wide.
        TypeError, ValueError
            For a wrong shape, NaN or Inf, or a ``dt`` of a model in discrete time.
        """
        start = self._box(lower, upper)
        inputs: Array = finite_array("u", u, (self.n_inputs,))
        T = self.Ts
        if dt is not None:
            expect(self.continuous, "dt", dt, "None for a model in discrete time")
            T = positive_number("dt", dt, "number of seconds")
        return self.kernel.transition(*start, inputs, T)

    def output(self, lower: ArrayLike, upper: ArrayLike, u: ArrayLike = ()) -> LinearOutput:
        """h in C x + c + F (w, p) + [-R, R] for all states of a box, all w and all p; F has only what is held.

        Parameters
        ----------
        lower, upper : (n,) arrays
        u : (nu,) array
            At the sample of the output.

        Raises
        ------
        Undecided
            If it is not enclosed.
        TypeError, ValueError
            For a wrong shape, NaN or Inf.
        """
        inputs = finite_array("u", u, (self.n_inputs,))
        return self.kernel.output(*self._box(lower, upper), inputs)

    def output_near(self, lower: Array, upper: Array, u: Array, around: tuple[Array, Array]) -> LinearOutput:
        """As `output`, for readings within ``jitter`` of a sample.

        Parameters
        ----------
        lower, upper : (n,) arrays
            States at the sample.
        u : (nu,) array
            From the sample on.
        around : (lower, upper) of (nu,) arrays
            Bounds of the inputs of that time.

        Raises
        ------
        Undecided
            If it is not enclosed.
        """
        found = self.output(lower, upper, u)
        if self.jitter is None:
            return found
        return stamped(
            self.flow, self.reading, found, self.jitter, Span(lower, upper), Span(*around), tuple(self.outputs or ())
        )

    def seen_near(self, box: Span, y: Array, around: tuple[Array, Array]) -> Span:
        """What readings y (ny,) within ``jitter`` of a sample leave of a ``box`` of states there; NaN = none.

        ``around`` are bounds of the inputs of that time. A box that holds no state with these readings stays as it is.
        """
        if self.jitter is None:
            return box
        names, inputs = tuple(self.outputs or ()), Span(*around)
        return seen_near(self.flow, self.reading, self.kernel.cut, self.jitter, box, y, inputs, names)

    def check_first(self, lower: Array, upper: Array) -> None:
        """Refuse first states from ``lower`` to ``upper`` (n,) for which the equations do not hold or have no value.

        Raises
        ------
        ValueError
            Naming the state, the row of f or h, and why.
        """
        box, unknown = Span(lower, upper), np.full(self.n_inputs, np.nan)
        try:
            self.flow.check(box, unknown)
            check_output(self.reading, self.flow.w, box, unknown, self.outputs or ())
        except Undecided as error:
            raise ValueError(f"initial: {error}; expected a smaller set, or one elsewhere") from None

    def _box(self, lower: ArrayLike, upper: ArrayLike) -> Span:
        box = Span(*(finite_array(n, v, (self.n_states,)) for n, v in (("lower", lower), ("upper", upper))))
        if not (box.lower <= box.upper).all():
            raise ValueError(f"lower is {box.lower}; expected bounds not above upper = {box.upper}")
        return box

    # -- simulation ------------------------------------------------------------------------------

    @options_by_name
    def first_state(self, x0: ArrayLike, rng: np.random.Generator, *, corners: bool = False) -> Array:
        """The state at the first sample of a run.

        Parameters
        ----------
        x0 : (n,) array
            Or only the states of f: parameters that are constant are then drawn.
        rng : numpy.random.Generator
        corners : bool
            Draw ends of the bounds.

        Raises
        ------
        TypeError, ValueError
            For a wrong shape, NaN or Inf.
        """
        x: Array = finite_array("x0", x0, *dict.fromkeys([(len(self.states),), (self.n_states,)]))
        lower, upper = (end[len(x) :] for end in (self.start_range.lower, self.start_range.upper))
        return np.append(x, draw(lower, upper, rng, corners))

    @options_by_name
    def simulate(
        self,
        x0: ArrayLike,
        u: ArrayLike,
        rng: np.random.Generator,
        *,
        corners: bool = False,
        substeps: int = 20,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> Log:
        """A run with random w, p and noise inside their bounds, for tests and tutorials.

        Equations in continuous time are integrated by Runge and Kutta's method of fourth order; what varies switches
        four times within a sample.

        Parameters
        ----------
        x0 : (n,) array
            Or only the states of f: parameters that are constant are then drawn.
        u : (K, nu) array
            One row a sample; the log has K samples.
        rng : numpy.random.Generator
        corners : bool
            Draw every w, p and noise at an end of its interval instead of uniformly inside.
        substeps : int
            Steps of the integration within a sample, or within a quarter of it where something varies.
        parameters : mapping from names to (K,) arrays, optional
            Values at each sample of parameters that are not drawn; within their bounds.

        Raises
        ------
        TypeError
            If rng is no Generator.
        ValueError
            For a wrong shape, NaN or Inf, or if the run leaves the range where the equations have values.
        """
        inputs = finite_array("u", u, ("samples", self.n_inputs))
        expect_shape(len(inputs), "u", inputs, f"(samples, {self.n_inputs}), at least one sample")
        expect_kind("rng", rng, np.random.Generator, "a numpy Generator, such as np.random.default_rng(0)")
        expect(is_count(substeps, 1), "substeps", substeps, "a number of steps >= 1")
        T, x = self.Ts if self.continuous else None, self.first_state(x0, rng, corners=corners)
        given = given_values(self.flow, self.free, parameters or {}, len(inputs))
        return simulated(self.flow, self.reading, self.noise, self.Ts, x, inputs, rng, corners, T, int(substeps), given)


def _ends(of: StateRange | None) -> tuple[Array, Array] | None:
    return None if of is None else (of.lower, of.upper)

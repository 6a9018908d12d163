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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from polytopes import HPolytope
from svo.log import Log

Array = NDArray[np.float64]
Schedulable = ArrayLike | Callable[[Any], ArrayLike] | None

_STATE_BLOCKS = ("A", "B", "a", "E")
_OUTPUT_BLOCKS = ("C", "D", "c", "F")


@dataclass(frozen=True)
class Uncertainty:
    """One Delta and the directions that it scales: any of A, B, a, E (state) and C, D, c, F (output).

    ``bounds`` = (lo, hi) are used as given, never recentred. Each array is constant, a function of the
    schedule, or None (zero).
    """

    A: Schedulable = None
    B: Schedulable = None
    a: Schedulable = None
    E: Schedulable = None
    C: Schedulable = None
    D: Schedulable = None
    c: Schedulable = None
    F: Schedulable = None
    bounds: tuple[float, float] = (-1.0, 1.0)
    name: str = ""

    def __post_init__(self) -> None:
        lo, hi = (float(v) for v in self.bounds)
        if not (np.isfinite(lo) and np.isfinite(hi) and lo <= hi):
            raise ValueError(f"bounds of the uncertainty are {self.bounds}; expected finite (lower, upper) with lower <= upper")
        object.__setattr__(self, "bounds", (lo, hi))


@dataclass(frozen=True)
class Layout:
    """Where the blocks stand in a stacked sample [[A B a E], [C D c F]]."""

    n: int
    nu: int
    nw: int
    ny: int

    @property
    def shape(self) -> tuple[int, int]:
        return self.n + self.ny, self.n + self.nu + 1 + self.nw

    def block(self, name: str) -> tuple[slice, slice]:
        columns = {
            "A": slice(0, self.n),
            "B": slice(self.n, self.n + self.nu),
            "a": slice(self.n + self.nu, self.n + self.nu + 1),
            "E": slice(self.n + self.nu + 1, self.shape[1]),
        }
        state = name in _STATE_BLOCKS
        rows = slice(0, self.n) if state else slice(self.n, self.n + self.ny)
        return rows, columns[name if state else _STATE_BLOCKS[_OUTPUT_BLOCKS.index(name)]]

    def block_shape(self, name: str) -> tuple[int, ...]:
        rows, cols = self.block(name)
        return (rows.stop - rows.start,) if name in "ac" else (rows.stop - rows.start, cols.stop - cols.start)


class _Scheduled(NamedTuple):
    """An array that is a function of the schedule, and where it stands in the stack."""

    item: int
    name: str
    where: tuple[Any, ...]
    shape: tuple[int, ...]
    function: Callable[[Any], ArrayLike]


@dataclass(frozen=True)
class UncertainModel:
    """An uncertain linear (parameter-varying) model in discrete time.

    Parameters
    ----------
    A, B, C : (n, n), (n, nu), (ny, n) arrays or functions of the schedule
        ``B=None`` is a model without inputs.
    E : (n, nw), optional
        Disturbance directions; default none.
    w : (lower, upper), a half-width vector (nw,), or an HPolytope in dimension nw
        The disturbance set. The two bounds may each be a function of the schedule.
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
        A typical scheduling value. Needed if any array is a function: shapes are checked with it.

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
    layout: Layout = field(init=False, repr=False)
    _constant: Array = field(init=False, repr=False)
    _scheduled: tuple[_Scheduled, ...] = field(init=False, repr=False)
    _bounds: tuple[Any, Any, Any] = field(init=False, repr=False)
    _bounds_scheduled: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "uncertainties", tuple(self.uncertainties))
        if not (np.isfinite(self.Ts) and self.Ts > 0):
            raise ValueError(f"Ts is {self.Ts}; expected a positive sampling time in seconds")
        object.__setattr__(self, "layout", self._measure())
        constant, scheduled = self._split()
        object.__setattr__(self, "_constant", constant)
        object.__setattr__(self, "_scheduled", scheduled)
        object.__setattr__(self, "_bounds", (*self._disturbance_bounds(), self._noise_bound()))
        object.__setattr__(self, "_bounds_scheduled", any(callable(b) for b in self._bounds))
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
        return bool(self._scheduled) or self._bounds_scheduled

    @property
    def uses_input_in_output(self) -> bool:
        """Whether y(k) depends on u(k), so that a step needs ``u_next``."""
        return self.D is not None or any(u.D is not None for u in self.uncertainties)

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
        if not self._scheduled:
            return self._constant
        stack = self._constant.copy()
        for entry in self._scheduled:
            value = np.asarray(entry.function(schedule), dtype=float)
            if value.shape != entry.shape:
                raise ValueError(self._shape_message(entry.item, entry.name, value.shape) + f", at schedule {schedule!r}")
            stack[entry.where] = value
        return stack

    def bounds(self, schedule: Any = None) -> tuple[Array, Array, Array]:
        """Disturbance bounds (nw,), (nw,) and noise half-width (ny,) at one sample."""
        if not self._bounds_scheduled:
            return self._bounds
        lower, upper, noise = (np.asarray(b(schedule), dtype=float) if callable(b) else b for b in self._bounds)
        _check_box(lower, upper, self.layout.nw)
        _check_noise(noise, self.layout.ny)
        return lower, upper, noise

    def block(self, name: str, schedule: Any = None, uncertainty: int | None = None) -> Array:
        """One matrix by its name ("A", "B", ...), of the model or of one of its uncertainties."""
        rows, cols = self.layout.block(name)
        value = self.stack(schedule)[0 if uncertainty is None else uncertainty + 1, rows, cols]
        return value[:, 0] if name in "ac" else value

    def replace(self, **changes: Any) -> UncertainModel:
        """A copy with some arguments changed, checked again."""
        return replace(self, **changes)

    # -- construction from other forms -----------------------------------------------------------

    @classmethod
    def from_continuous(
        cls,
        A: ArrayLike,
        B: ArrayLike | None,
        C: ArrayLike,
        *,
        Ts: float,
        E: ArrayLike | None = None,
        a: ArrayLike | None = None,
        uncertainties: Sequence[Uncertainty] = (),
        remainder: ArrayLike | None = None,
        w: Any = None,
        F: ArrayLike | None = None,
        **rest: Any,
    ) -> UncertainModel:
        """Zero-order-hold discretisation of dx/dt = A x + B u + a + E w, inputs held over a sample.

        A, B, a and E are discretised exactly. The exponential of an uncertain matrix is not affine in
        Delta, so each uncertainty keeps its first-order direction Gamma [A_i B_i a_i E_i], with Gamma =
        int_0^Ts exp(A t) dt; ``remainder`` (n,) bounds what that leaves out, per sample, and enters as a
        disturbance of its own. It is required when an uncertainty touches the state equation.
        """
        A = _array("A", A)
        n = A.shape[0]
        if any(getattr(u, name) is not None for u in uncertainties for name in _STATE_BLOCKS) and remainder is None:
            raise ValueError("remainder is missing: give the bound (n,) of what the first-order discretisation leaves out")
        parts = {"B": B, "a": a, "E": E}
        columns = [(k, np.asarray(v, dtype=float).reshape(n, -1)) for k, v in parts.items() if v is not None]
        step = zero_order_hold(A, np.hstack([v for _, v in columns]) if columns else np.zeros((n, 0)), Ts)
        split = np.split(step[1], np.cumsum([v.shape[1] for _, v in columns])[:-1], axis=1) if columns else []
        out: dict[str, Any] = dict(zip([k for k, _ in columns], split, strict=True))
        if "a" in out:
            out["a"] = out["a"][:, 0]
        gamma = zero_order_hold(A, np.eye(n), Ts)[1]
        discrete = [_discretise_uncertainty(gamma, u) for u in uncertainties]
        if remainder is not None:
            width = np.broadcast_to(np.asarray(remainder, dtype=float), (n,))
            w, out["E"], F, discrete = _append_disturbance(w, out.get("E"), F, discrete, width)
        return cls(step[0], out.get("B"), C, E=out.get("E"), a=out.get("a"), w=w, F=F, Ts=Ts, uncertainties=discrete, **rest)

    @classmethod
    def from_statespace(cls, sys: Any, *, Ts: float | None = None, **rest: Any) -> UncertainModel:
        """From an object with A, B, C, D and dt, such as a ``control.StateSpace``.

        A continuous system (dt = 0) is discretised with ``Ts``; a discrete one keeps its dt.
        """
        D = np.asarray(sys.D, dtype=float)
        D_or_none = D if D.any() else None
        dt = getattr(sys, "dt", None)
        if dt is True or dt is None or dt == 0:
            if Ts is None:
                raise ValueError(f"Ts is missing: the system has dt = {dt!r}, so its sampling time must be given")
            if dt == 0:
                return cls.from_continuous(sys.A, sys.B, sys.C, Ts=Ts, D=D_or_none, **rest)
        elif Ts is not None and Ts != dt:
            raise ValueError(f"Ts is {Ts} but the system is discrete with dt = {dt}; resample it, or leave Ts out")
        return cls(sys.A, sys.B, sys.C, D=D_or_none, Ts=float(dt if Ts is None else Ts), **rest)

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
        """
        inputs = np.asarray(u, dtype=float)
        if inputs.ndim != 2 or inputs.shape[1] != self.n_inputs:
            raise ValueError(f"u has shape {inputs.shape}; expected (samples, {self.n_inputs})")
        x = np.asarray(x0, dtype=float)
        if x.shape != (self.n_states,):
            raise ValueError(f"x0 has shape {x.shape}; expected ({self.n_states},)")
        n, states, outputs = self.n_states, [], []
        for k, uk in enumerate(inputs):
            value = None if schedule is None else np.asarray(schedule)[k]
            lower, upper, noise = self.bounds(value)
            w = self._draw_disturbance(lower, upper, rng, corners)
            deltas = [_draw(np.array([q.bounds[0]]), np.array([q.bounds[1]]), rng, corners)[0] for q in self.uncertainties]
            total = np.tensordot(np.array([1.0, *deltas]), self.stack(value), axes=1)
            known = np.concatenate([x, uk, [1.0], w])
            states.append(x)
            outputs.append(total[n:] @ known + _draw(-noise, noise, rng, corners))
            x = total[:n] @ known
        return Log(
            time=np.arange(len(inputs)) * self.Ts,
            u=inputs,
            y=np.array(outputs),
            x=np.array(states),
            schedule=None if schedule is None else np.asarray(schedule, dtype=float),
        )

    def _draw_disturbance(self, lower: Array, upper: Array, rng: np.random.Generator, corners: bool) -> Array:
        polytope = self.disturbance_polytope
        if polytope is None:
            return _draw(lower, upper, rng, corners)
        vertices = polytope.vertices()
        weights = np.eye(len(vertices))[rng.integers(len(vertices))] if corners else rng.dirichlet(np.ones(len(vertices)))
        return weights @ vertices

    # -- validation ------------------------------------------------------------------------------

    def _value(self, name: str, owner: Any) -> Array | None:
        value = getattr(owner, name)
        if value is None:
            return None
        if callable(value):
            if self.schedule is None:
                raise ValueError(f"{name} is a function of the schedule, so a typical `schedule` value is needed to check shapes")
            value = value(self.schedule)
        return _array(name, value)

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

    def _split(self) -> tuple[Array, tuple[_Scheduled, ...]]:
        constant = np.zeros((1 + len(self.uncertainties), *self.layout.shape))
        scheduled = []
        for item, owner in enumerate((self, *self.uncertainties)):
            for name in _STATE_BLOCKS + _OUTPUT_BLOCKS:
                value = getattr(owner, name)
                if value is None:
                    continue
                array = self._value(name, owner)
                assert array is not None
                if array.shape != self.layout.block_shape(name):
                    raise ValueError(self._shape_message(item, name, array.shape))
                rows, cols = self.layout.block(name)
                where = (item, rows, cols.start if array.ndim == 1 else cols)
                if callable(value):
                    scheduled.append(_Scheduled(item, name, where, array.shape, value))
                else:
                    constant[where] = array
        constant.setflags(write=False)
        return constant, tuple(scheduled)

    def _shape_message(self, item: int, name: str, shape: tuple[int, ...]) -> str:
        owner = "" if item == 0 else f" of uncertainty {self.uncertainties[item - 1].name or item - 1}"
        return f"{name}{owner} has shape {shape}; expected {self.layout.block_shape(name)}"

    def _disturbance_bounds(self) -> tuple[Any, Any]:
        nw, w = self.layout.nw, self.w
        if w is None:
            if nw:
                raise ValueError(f"w is missing: E or F has {nw} columns, so give (lower, upper), a half-width ({nw},) or an HPolytope")
            return np.zeros(0), np.zeros(0)
        if isinstance(w, HPolytope):
            if w.dim != nw:
                raise ValueError(f"w is a polytope of dimension {w.dim}; expected {nw}, the number of columns of E")
            lower, upper = w.bounding_box()
            _check_box(lower, upper, nw)
            return lower, upper
        if isinstance(w, tuple) and len(w) == 2:
            lower, upper = (b if callable(b) else _array("w", b) for b in w)
        else:
            upper = _array("w", w)
            lower = -upper
        if not (callable(lower) or callable(upper)):
            lower, upper = (np.broadcast_to(b, (nw,)).copy() if b.ndim == 0 else b for b in (lower, upper))
            _check_box(lower, upper, nw)
        return lower, upper

    def _noise_bound(self) -> Any:
        if self.n is None:
            return np.zeros(self.layout.ny)
        if callable(self.n):
            return self.n
        noise = _array("n", self.n)
        noise = np.full(self.layout.ny, float(noise)) if noise.ndim == 0 else noise
        _check_noise(noise, self.layout.ny)
        return noise

    def _check_names(self) -> None:
        sizes = {"states": self.n_states, "inputs": self.n_inputs, "outputs": self.n_outputs, "disturbances": self.n_disturbances}
        for key, values in (self.names or {}).items():
            if key not in sizes:
                raise ValueError(f"names has the key {key!r}; expected any of {', '.join(sizes)}")
            if len(values) != sizes[key]:
                raise ValueError(f"names[{key!r}] has {len(values)} entries; expected {sizes[key]}")


def zero_order_hold(A: ArrayLike, B: ArrayLike, Ts: float) -> tuple[Array, Array]:
    """exp(A Ts) and int_0^Ts exp(A t) dt B, from one exponential of [[A B], [0 0]]."""
    A, B = np.asarray(A, dtype=float), np.asarray(B, dtype=float)
    n, m = B.shape
    joint = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * Ts)
    return joint[:n, :n], joint[:n, n:]


def _array(name: str, value: Any) -> Array:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is not numeric: {error}") from error
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or Inf; expected finite numbers")
    array.setflags(write=False)
    return array


def _check_box(lower: Array, upper: Array, nw: int) -> None:
    if lower.shape != (nw,) or upper.shape != (nw,):
        raise ValueError(f"w has bounds of shapes {lower.shape} and {upper.shape}; expected ({nw},) each, the number of columns of E")
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
        raise ValueError("w is unbounded; expected finite bounds for every disturbance")
    if (lower > upper).any():
        bad = int(np.argmax(lower > upper))
        raise ValueError(f"w[{bad}] has lower bound {lower[bad]} above its upper bound {upper[bad]}")


def _check_noise(noise: Array, ny: int) -> None:
    if noise.shape != (ny,):
        raise ValueError(f"n has shape {noise.shape}; expected ({ny},), one half-width a sensor")
    if not np.isfinite(noise).all() or (noise < 0).any():
        raise ValueError(f"n is {noise}; expected finite half-widths >= 0")


def _draw(lower: Array, upper: Array, rng: np.random.Generator, corners: bool) -> Array:
    if corners:
        return np.where(rng.random(lower.shape) < 0.5, lower, upper)
    return rng.uniform(lower, upper)


def _discretise_uncertainty(gamma: Array, u: Uncertainty) -> Uncertainty:
    changed = {}
    for name in _STATE_BLOCKS:
        value = getattr(u, name)
        if callable(value):
            raise ValueError(f"{name} of an uncertainty is a function; from_continuous takes constant arrays")
        if value is not None:
            changed[name] = gamma @ np.asarray(value, dtype=float)
    return replace(u, **changed)


def _append_disturbance(
    w: Any, E: Array | None, F: ArrayLike | None, uncertainties: list[Uncertainty], width: Array
) -> tuple[tuple[Array, Array], Array, Array | None, list[Uncertainty]]:
    """Add one disturbance a state, |w_new| <= width, to arrays that knew nothing of it."""
    n = width.size
    E = np.zeros((n, 0)) if E is None else E
    if isinstance(w, HPolytope):
        raise ValueError("w is a polytope; from_continuous with a remainder takes bounds or half-widths")
    if isinstance(w, tuple):
        lower, upper = (np.broadcast_to(np.asarray(b, dtype=float), (E.shape[1],)) for b in w)
    else:
        upper = np.broadcast_to(np.asarray(0.0 if w is None else w, dtype=float), (E.shape[1],))
        lower = -upper
    bounds = (np.concatenate([lower, -width]), np.concatenate([upper, width]))

    def pad(value: Any) -> Any:
        return None if value is None else np.hstack([value, np.zeros((len(value), n))])

    wider = [replace(u, E=pad(u.E), F=pad(u.F)) for u in uncertainties]
    return bounds, np.hstack([E, np.eye(n)]), pad(None if F is None else np.asarray(F, dtype=float)), wider

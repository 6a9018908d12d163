"""Actuator faults (Marzat et al. 2012, equation (18) and Table 3; Rosa and Silvestre 2013, Table 1)."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, expect_one_of, finite_array, is_count, is_finite_number, positive_number
from svo.faults.blocks import (
    channels,
    only_columns,
    product_of,
    sum_of_columns,
    with_new_columns,
    with_new_disturbances,
    without_columns,
)
from svo.faults.equations import Model, rewritten, unchanged, with_inputs
from svo.faults.profiles import EDGE_TOLERANCE_S, Profile, Step, at_times, check_profile
from svo.models import UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel

ActuatorKind = Literal[
    "loss", "locking", "hard-over", "runaway", "floating", "oscillatory-solid", "oscillatory-liquid", "noise"
]

_NEEDS_TRAVEL = ("locking", "runaway")
_NEEDS_FREQUENCY = ("oscillatory-solid", "oscillatory-liquid")
_WITHOUT_MAGNITUDE = ("locking", "floating")


@dataclass(frozen=True)
class ActuatorLaw(Shown):
    """The achieved deflection of a faulty actuator at given times, from the command and the deflection held.

    achieved = clip(gain command + hold held + offset, lower, upper), where ``held`` is the deflection
    that was achieved when the fault began. All arrays have the shape of the times.
    """

    gain: Array
    hold: Array
    offset: Array
    lower: Array
    upper: Array


@options_by_name
@dataclass(frozen=True)
class ActuatorFault(Shown):
    """A fault of one actuator, or of several that fail together. Inputs are ABSOLUTE (trim included).

    With u the command, p = profile.value(t), h the deflection achieved when the fault began, and
    m = magnitude, the achieved deflection is

    ==================  ===============================  ==================================================
    kind                achieved                         what ``model`` contains
    ==================  ===============================  ==================================================
    loss                (1 - m p) u, 0 < m <= 1          (1 - Delta) u, any Delta in [0, m]
    floating            (1 - p) u                        (1 - Delta) u, any Delta in [0, 1]
    hard-over           (1 - p) u + p m                  (1 - Delta) u + Delta m, any Delta in [0, 1]
    oscillatory-solid   (1 - p) u + p m sin(2 pi f t')   (1 - Delta) u + Delta v, Delta in [0, 1], v in [-m, m]
    oscillatory-liquid  u + p m sin(2 pi f t')           u + v, any v in [-m, m]
    noise               u + p m r, r in [-1, 1]          u + v, any v in [-m, m]
    locking             (1 - p) u + p h                  any deflection within the travel
    runaway             h + m t', stopped at the travel  any deflection within the travel
    ==================  ===============================  ==================================================

    where t' is the time since the start, and r is drawn anew for each sample time from ``seed``: uniform, and the same
    for the same time, so that a run and its samples agree. Delta and v are free to change at each sample. Every model
    contains the healthy actuator; those of locking and runaway do so for commands within the travel (a
    command beyond it is one that no healthy actuator follows). A fault that scales or replaces the
    command adds one Uncertainty (after the nominal ones) whose Delta at a time is ``delta(t)``; if the
    nominal B or D is itself uncertain, each product Delta_i Delta becomes one more free Delta, which
    contains it. Unknown deflections v are disturbances, last in w, one a channel.

    Parameters
    ----------
    where : int or tuple of int
        Input channels; several share one Delta.
    kind : {"loss", "locking", "hard-over", "runaway", "floating", "oscillatory-solid", "oscillatory-liquid", "noise"}
    magnitude : float or None
        Lost fraction (loss), deflection reached (hard-over), rate per second (runaway), amplitude > 0
        (oscillatory, noise); None for locking and floating.
    profile : Profile
        Shape in time. A runaway has a shape of its own and takes a `Step`.
    travel : (lower, upper), optional
        Limits of the deflection, needed by locking and runaway.
    frequency_hz : float, optional
        Needed by the oscillatory kinds.
    seed : int, optional
        Needed by noise.

    Raises
    ------
    ValueError
        Naming the argument that is missing, out of range, or has no meaning for this kind.
    """

    where: int | tuple[int, ...]
    kind: ActuatorKind
    magnitude: float | None
    profile: Profile
    _: KW_ONLY
    travel: tuple[float, float] | None = None
    frequency_hz: float | None = None
    seed: int | None = None

    def __post_init__(self) -> None:
        channels(self.where)
        check_profile(self.profile)
        expect_one_of("kind", self.kind, get_args(ActuatorKind))
        self._check_magnitude()
        self._check_given("travel", _NEEDS_TRAVEL)
        self._check_given("frequency_hz", _NEEDS_FREQUENCY)
        self._check_given("seed", ("noise",))
        expect(self.seed is None or is_count(self.seed, 0), "seed", self.seed, "an integer >= 0")
        if self.travel is not None:
            lower, upper = finite_array("travel", self.travel, (2,), meaning="(lower, upper)")
            expect(lower < upper, "travel", self.travel, "finite (lower, upper) with lower < upper")
        if self.frequency_hz is not None:
            positive_number("frequency_hz", self.frequency_hz, "number")
        if self.kind == "runaway" and not isinstance(self.profile, Step):
            raise ValueError(f"profile is {self.profile}; a runaway moves at its own rate, so give it a Step")

    # -- simulation ------------------------------------------------------------------------------

    def delta(self, t: ArrayLike) -> Array:
        """Delta that the fault has at time t [s] in its own model: the fraction of the command lost or replaced."""
        p = self.profile.value(t)
        return self._size * p if self.kind == "loss" else p

    def law(self, t: ArrayLike) -> ActuatorLaw:
        """The law at times t [s], each array of the shape of t; for simulators that precompute it."""
        p = self.profile.value(t)
        zero, free = np.zeros_like(p), np.full_like(p, np.inf)
        gain, hold, offset, lower, upper = 1.0 - p, zero, zero, -free, free
        if self.kind == "loss":
            gain = 1.0 - self.delta(t)
        elif self.kind == "hard-over":
            offset = p * self._size
        elif self.kind == "locking":
            hold = p
        elif self.kind == "runaway":
            assert self.travel is not None
            hold, offset = p, p * self._size * self._elapsed(t)
            lower, upper = (np.where(p > 0, limit, end) for limit, end in zip(self.travel, (lower, upper), strict=True))
        elif self.kind in _NEEDS_FREQUENCY:
            assert self.frequency_hz is not None
            offset = p * self._size * np.sin(2.0 * np.pi * self.frequency_hz * self._elapsed(t))
            gain = gain if self.kind == "oscillatory-solid" else np.ones_like(p)
        elif self.kind == "noise":
            gain, offset = np.ones_like(p), p * self._size * self._drawn(t)
        return ActuatorLaw(gain=gain, hold=hold, offset=offset, lower=lower, upper=upper)

    def reach(self, commands: tuple[float, float]) -> tuple[float, float]:
        """Least and largest deflection that this fault at any of its sizes makes of commands between two values."""
        lower, upper = commands
        if self.kind in ("oscillatory-liquid", "noise"):
            return lower - self._size, upper + self._size
        ends = {
            "loss": lambda: ((1 - self._size) * lower, (1 - self._size) * upper),
            "floating": lambda: (0.0, 0.0),
            "hard-over": lambda: (self._size, self._size),
            "oscillatory-solid": lambda: (-self._size, self._size),
        }.get(self.kind, lambda: self.travel or commands)()
        return min(lower, *ends), max(upper, *ends)

    def corrupt(self, t: ArrayLike, u: ArrayLike, held: ArrayLike | None = None) -> Array:
        """Achieved deflections from commands.

        Parameters
        ----------
        t : float or (K,) array
            Time [s], increasing.
        u : (nu,) or (K, nu) array
            Commands.
        held : (nu,) array, optional
            Deflections achieved when the fault began, needed by locking and runaway. For a whole run
            (K, nu) it may be left out: the last command before the first faulty sample is taken (the
            first command, if the run starts faulty).

        Returns
        -------
        array of the shape of u
        """
        commands = at_times("u", t, u)
        where = channels(self.where, commands.shape[-1], "channels in u")
        law = self.law(t)
        kept = self._held(t, commands, held)
        for channel in where:
            moved = law.gain * commands[..., channel] + law.hold * kept[channel] + law.offset
            commands[..., channel] = np.clip(moved, law.lower, law.upper)
        return commands

    def _held(self, t: ArrayLike, commands: Array, held: ArrayLike | None) -> Array:
        if self.kind not in _NEEDS_TRAVEL:
            return np.zeros(commands.shape[-1])
        if held is not None:
            return finite_array("held", held, commands.shape[-1:], meaning="one deflection an input")
        if commands.ndim == 1:
            raise ValueError(f"held is missing: a {self.kind} needs the deflection achieved when the fault began")
        faulty = np.flatnonzero(self.profile.value(t) > 0)
        return commands[max(int(faulty[0]) - 1, 0)] if faulty.size else np.zeros(commands.shape[-1])

    def _drawn(self, t: ArrayLike) -> Array:
        """Uniform numbers in [-1, 1], one a time, of the shape of t."""
        assert self.seed is not None
        times = np.rint(finite_array("t", t) / EDGE_TOLERANCE_S).astype(np.int64)
        draws = [np.random.default_rng([self.seed, abs(int(k))]).uniform(-1.0, 1.0) for k in times.ravel()]
        return np.array(draws).reshape(times.shape)

    def _elapsed(self, t: ArrayLike) -> Array:
        return np.maximum(finite_array("t", t) - self.profile.start, 0.0)

    # -- the observer's model ----------------------------------------------------------------------

    def model(self, nominal: Model) -> Model:
        """The observer's model of this fault; it contains ``nominal`` and every intermediate size.

        Delta is a parameter of a nonlinear model, and v a disturbance.
        """
        if isinstance(nominal, NonlinearModel):
            return self._equations(nominal)
        return nominal.in_given_time(self._model)

    def _equations(self, nominal: NonlinearModel) -> NonlinearModel:
        where = channels(self.where, nominal.n_inputs, "inputs in the model")
        called = [f"{self.kind} of {nominal.inputs[i]}" for i in where]
        is_unknown = self.kind in (*_NEEDS_TRAVEL, "oscillatory-liquid", "oscillatory-solid", "noise")
        is_scaled = self.kind in ("loss", "floating", "hard-over", "oscillatory-solid")

        def achieved(u: list[Any], v: Any, d: Any) -> None:
            for count, i in enumerate(where):
                if not is_scaled:
                    u[i] = v[count] + (0.0 if self.kind in _NEEDS_TRAVEL else u[i])
                else:
                    target = v[count] if is_unknown else self._size if self.kind == "hard-over" else 0.0
                    u[i] = u[i] + d[0] * (target - u[i])

        law, ends = with_inputs(achieved), self.travel or (-(self.magnitude or 0.0), self.magnitude or 0.0)
        sizes = {f"share of {self.kind} of {self._called(nominal)}": (0.0, self._size if self.kind == "loss" else 1.0)}
        return rewritten(
            nominal, dynamics=law, outputs=law if nominal.uses_input_in_output else unchanged,
            disturbances=dict.fromkeys(called, ends) if is_unknown else {}, parameters=sizes if is_scaled else {},
        )  # fmt: skip

    def _model(self, nominal: UncertainModel) -> UncertainModel:
        channels(self.where, nominal.n_inputs, "inputs in the model")
        if self.kind in _NEEDS_TRAVEL:
            assert self.travel is not None
            return self._with_unknown_input(nominal, *self.travel, keep_command=False)
        if self.kind in ("oscillatory-liquid", "noise"):
            return self._with_unknown_input(nominal, -self._size, self._size, keep_command=True)
        if self.kind == "oscillatory-solid":
            return self._with_replaced_command(self._with_idle_disturbance(nominal), nominal.n_disturbances)
        return self._with_replaced_command(nominal, None)

    def _with_unknown_input(
        self, nominal: UncertainModel, lower: float, upper: float, *, keep_command: bool
    ) -> UncertainModel:
        """The command of these channels, kept or dropped, plus an unknown input in [lower, upper]."""
        where, nw = channels(self.where), nominal.n_disturbances

        def blocks(owner: UncertainModel | Uncertainty) -> dict[str, Any]:
            changed: dict[str, Any] = {
                "E": with_new_columns(owner.E, owner.B, where, nw),
                "F": with_new_columns(owner.F, owner.D, where, nw),
            }
            if not keep_command:
                changed |= {"B": without_columns(owner.B, where), "D": without_columns(owner.D, where)}
            return changed

        return nominal.replace(
            **blocks(nominal),
            w=with_new_disturbances(nominal, lower, upper, len(where)),
            uncertainties=[replace(u, **blocks(u)) for u in nominal.uncertainties],
            names=self._names(nominal),
        )

    def _with_idle_disturbance(self, nominal: UncertainModel) -> UncertainModel:
        """The nominal model with the oscillation appended to w, entering nowhere yet."""
        where, nw = channels(self.where), nominal.n_disturbances
        idle = only_columns(nominal.B, (), 0.0)
        return nominal.replace(
            E=with_new_columns(nominal.E, idle, where, nw),
            F=with_new_columns(nominal.F, None, where, nw),
            w=with_new_disturbances(nominal, -self._size, self._size, len(where)),
            uncertainties=[
                replace(u, E=with_new_columns(u.E, None, where, nw), F=with_new_columns(u.F, None, where, nw))
                for u in nominal.uncertainties
            ],
            names=self._names(nominal),
        )

    def _with_replaced_command(self, nominal: UncertainModel, target_column: int | None) -> UncertainModel:
        """Delta (target - u) added to the command, the target being a constant or w from ``target_column`` on."""
        where = channels(self.where)
        bounds = (0.0, self._size if self.kind == "loss" else 1.0)

        def blocks(owner: UncertainModel | Uncertainty) -> dict[str, Any]:
            changed: dict[str, Any] = {name: only_columns(getattr(owner, name), where, -1.0) for name in "BD"}
            if self.kind == "hard-over":
                changed["a"] = sum_of_columns(owner.B, where, self._size)
                changed["c"] = sum_of_columns(owner.D, where, self._size)
            if target_column is not None:
                changed |= {
                    "E": with_new_columns(None, owner.B, where, target_column),
                    "F": with_new_columns(None, owner.D, where, target_column),
                }
            return changed

        fault = Uncertainty(**blocks(nominal), bounds=bounds, name=f"{self.kind} of {self._called(nominal)}")
        products = [product_of(u, bounds, self.kind, **blocks(u)) for u in nominal.uncertainties]
        return nominal.replace(uncertainties=[*nominal.uncertainties, fault, *(p for p in products if p is not None)])

    def _names(self, nominal: UncertainModel) -> dict[str, list[str]] | None:
        if nominal.names is None:
            return None
        own = nominal.names.get("disturbances", [f"w[{j}]" for j in range(nominal.n_disturbances)])
        inputs = nominal.names.get("inputs", [f"input {i}" for i in range(nominal.n_inputs)])
        new = [f"{self.kind} of {inputs[channel]}" for channel in channels(self.where)]
        return {**{k: list(v) for k, v in nominal.names.items()}, "disturbances": [*own, *new]}

    def _called(self, nominal: UncertainModel | NonlinearModel) -> str:
        inputs = (nominal.names or {}).get("inputs")
        return f"actuator {self.where}" if inputs is None else ", ".join(inputs[i] for i in channels(self.where))

    # -- validation ------------------------------------------------------------------------------

    @property
    def _size(self) -> float:
        assert self.magnitude is not None
        return self.magnitude

    def _check_magnitude(self) -> None:
        if self.kind in _WITHOUT_MAGNITUDE:
            if self.magnitude is not None:
                raise ValueError(f"magnitude is {self.magnitude} but {self.kind} has none; give None")
            return
        if not is_finite_number(self.magnitude):
            raise ValueError(f"magnitude is {self.magnitude}; {self.kind} needs a finite number")
        if self.kind == "loss":
            expect(0 < self.magnitude <= 1, "magnitude", self.magnitude, "the lost fraction, 0 < magnitude <= 1")
        if self.kind in (*_NEEDS_FREQUENCY, "noise"):
            expect(self.magnitude > 0, "magnitude", self.magnitude, "an amplitude > 0")
        if self.kind == "runaway" and self.magnitude == 0:
            raise ValueError("magnitude is 0; expected the rate of the runaway per second (use locking for none)")

    def _check_given(self, name: str, kinds: tuple[str, ...]) -> None:
        given = getattr(self, name) is not None
        if given != (self.kind in kinds):
            wanted = "takes none" if given else "needs one"
            raise ValueError(f"{name} is {getattr(self, name)}; {self.kind} {wanted}")

"""The missile as a plant of the studies (entry point ``missile``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from aircraft.missile.imu import DELAY, NOISE_SETS, SensorErrors
from aircraft.missile.models import OUTPUTS, SCHEDULING, Block, Embedding, MeasuredSchedule, read_bounds, schedule_of
from aircraft.missile.scenarios import DM, DN, ETA, TS, Fault, Flights, locked, noise_set, thrust_loss
from polytopes import HPolytope
from polytopes.shown import Shown
from svo.checks import Array
from svo.faults import ActuatorFault, SensorFault, Step
from svo.isolation import ArchitectureI, Bank
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.observers.window.observer import WindowObserver
from svo.plant import HEALTHY, AddedStudy, Column, Columns, Distribution, Exhibit, Reference, StatedFault

if TYPE_CHECKING:
    from svo.detectors.detector import Detector

STARTS, ENDS = 25.0, 40.0  # s of the flight that a log covers
FAULT_TIME = 30.0
ABZ = 2  # of the simulator's measurements
ABZ_OUTPUT = OUTPUTS.index(ABZ)
ACCELEROMETER_BIAS = 5.0  # m/s^2
THRUST_LOSS = 0.25
LOCKED_PITCH, LOCKED_YAW = -0.044, -0.004  # rad, mean deflections at the time of the fault
LARGEST_LOSS = 0.5  # that the propulsion observer allows
FAULTS: Mapping[str, str] = MappingProxyType(
    {
        "propulsion": "a quarter of the propulsion rate is lost",
        "pitch_fin": "the pitch fin locks",
        "yaw_fin": "the yaw fin locks",
        "accelerometer": "the normal accelerometer reads 5 m/s^2 too much",
    }
)
PROFILE = "step"

COLUMNS = Columns(
    inputs=(
        *(Column(f"{name}_rad", "rad") for name in ("dl", "dm", "dn")),
        Column("eta", "-"),
        *(Column(f"{name}_rad_s", "rad/s") for name in ("p", "q", "r")),
        Column("z_m", "m"),
        Column("phi_rad", "rad"),
        Column("theta_rad", "rad"),
    ),
    outputs=(
        *(Column(f"{name}_m_s", "m/s") for name in ("vbx", "vby", "vbz")),
        *(Column(f"{name}_m_s2", "m/s2") for name in ("abx", "aby", "abz")),
    ),
    states=tuple(Column(f"true_{name}_m_s", "m/s") for name in ("vbx", "vby", "vbz")),
)
INITIAL = HPolytope.box([300.0, -200.0, -200.0], [900.0, 200.0, 200.0])


@dataclass(frozen=True)
class Missile(Shown):
    """The surface-to-air missile of Marzat et al. (SysTol 2010) in closed loop, from 25 to 40 s of its flight.

    Rows of a log are of the instant two samples before they are received, inputs included. The observers' bounds are
    measured on these flights (`aircraft.missile.mismatch`): they promise nothing for a flight unlike them.

    Parameters
    ----------
    flights : Flights
    horizon : int
        Steps in the observers' windows.
    distribution : {"bounded", "gaussian"}, optional
        Draws every noise set so, with its standard deviation, whatever its own distribution; the observers' bounds
        stay those of the set.
    """

    flights: Flights = field(default_factory=Flights)
    horizon: int = 10
    distribution: Distribution | None = None
    name: str = "missile"
    title: str = "Surface-to-air missile: propulsion, locked fins, accelerometer; residuals by redundancy"
    Ts: float = TS
    fault_time: float = FAULT_TIME
    faults: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: dict.fromkeys(FAULTS, (PROFILE,)))
    noise_sets: tuple[str, ...] = tuple(NOISE_SETS)
    columns: Columns = COLUMNS
    reference: Mapping[tuple[str, str], Reference] = field(default_factory=dict)
    compared_faults: tuple[tuple[str, str], ...] = tuple((name, PROFILE) for name in FAULTS)
    reference_title: str = "Marzat et al., SysTol 2010, gives no times"

    def duration(self, fault: str, profile: str) -> float:
        """Length of a run [s]; ``fault`` may be "none"."""
        _check(fault, profile)
        return ENDS - STARTS

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One run with its true velocity; ``fault`` may be "none".

        The inputs are the computed ones, then the measured rates, height and attitude.
        """
        _check(fault, profile)
        run = self.flights.run(() if fault == HEALTHY else (fault_of(fault),), self._drawn(noise), seed, ENDS)
        rows = slice(round(STARTS / TS), round(ENDS / TS))
        then = slice(rows.start - DELAY, rows.stop - DELAY)
        measured = run.flight.y[rows]
        return Log(
            time=run.time[rows],
            u=np.hstack([run.flight.computed[then], measured[:, list(SCHEDULING)]]),
            y=measured[:, list(OUTPUTS)],
            x=run.flight.x[then, 3:6],
            schedule=schedule_of(measured),
        )

    def models(self, noise: str, shared: bool = True) -> dict[str, UncertainModel]:
        """The observers' models: "nominal", then one for each fault, which contains the healthy missile.

        ``shared`` as `Embedding.model` takes it.
        """
        models = {name: self._healthy(noise, name, shared) for name in ("nominal", *self.faults)}
        return models | {name: _observed(name).model(models[name]) for name in self.faults}

    def stated_faults(self, noise: str, shared: bool = True) -> dict[str, StatedFault]:
        """The missile with each fault at the size of its flights, the fins locked where they are on average at 30 s."""
        models = {name: self._healthy(noise, name, shared) for name in self.faults}
        size, embedding = 1.0 - THRUST_LOSS, self._embedding
        changed = {
            "propulsion": _with_input(models["propulsion"], embedding, ETA, size, 0.0),
            "pitch_fin": _with_input(models["pitch_fin"], embedding, DM, 0.0, LOCKED_PITCH),
            "yaw_fin": _with_input(models["yaw_fin"], embedding, DN, 0.0, LOCKED_YAW),
            "accelerometer": _with_output(models["accelerometer"], embedding, ABZ_OUTPUT, ACCELEROMETER_BIAS),
        }
        return {name: StatedFault(FAULTS[name], model) for name, model in changed.items()}

    def _healthy(self, noise: str, observer: str, shared: bool) -> UncertainModel:
        errors = noise_set(noise)
        return self._embedding.model(errors, read_bounds()[noise][observer], shared)

    @cached_property
    def _embedding(self) -> Embedding:
        return Embedding(self.flights.airframe, self.Ts)

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank of window observers with box templates."""
        observers = {name: WindowObserver(m, INITIAL, horizon=self.horizon) for name, m in self.models(noise).items()}
        return ArchitectureI(observers.pop("nominal"), observers)

    def scheduler(self) -> MeasuredSchedule:
        """A fresh filter: the schedule is what is measured, with the last value of a sensor that is missing."""
        return MeasuredSchedule()

    def with_noise(self, distribution: Distribution) -> Missile:
        """This missile with bounded or Gaussian noise of the same standard deviation; models and bounds are kept."""
        return replace(self, distribution=distribution)

    def detectors(self, noise: str) -> list[Detector]:
        """What ``svo compare missile`` sets side by side; see `aircraft.missile.detectors`."""
        from aircraft.missile.detectors import detectors

        nominal = self.models(noise, shared=False)["nominal"]
        stated = {name: fault.model for name, fault in self.stated_faults(noise, shared=False).items()}
        return detectors(self.models(noise), nominal, stated, INITIAL, self.flights.airframe)

    def added_study(self, runs: int, seed: int, noise: Sequence[str]) -> AddedStudy:
        """The residuals' part of a study: scenarios of Table II over seeds."""
        from aircraft.missile.scenario_study import scenario_study

        return scenario_study(runs, seed, noise, self.flights)

    def exhibits(self, folder: Path, runs: int, seed: int, noise: Sequence[str]) -> list[Exhibit]:
        """Trajectories and residuals of the scenarios of Table II."""
        from aircraft.missile.figures import write_figures

        caption = (
            "A flight with the seed of the study; dashed lines: a fault begins. Tables: scenarios.txt, scenario_*.csv."
        )
        pictures = write_figures(folder, self.flights, seed, noise[0])
        return [Exhibit(path, title, caption) for title, path in pictures.items()]

    def _drawn(self, noise: str) -> SensorErrors:
        errors = noise_set(noise)
        if self.distribution is None:
            return errors
        return replace(errors, distribution="uniform" if self.distribution == "bounded" else "gaussian")


def fault_of(name: str) -> Fault:
    """The fault that a simulated flight has from `FAULT_TIME` on."""
    if name == "propulsion":
        return thrust_loss(THRUST_LOSS, FAULT_TIME)
    if name == "pitch_fin":
        return locked(DM, FAULT_TIME)
    if name == "yaw_fin":
        return locked(DN, FAULT_TIME)
    if name == "accelerometer":
        return SensorFault(ABZ, "bias", ACCELEROMETER_BIAS, Step(FAULT_TIME))
    raise ValueError(f"fault is {name!r}; expected one of {', '.join(FAULTS)}")


def _observed(name: str) -> ActuatorFault | SensorFault:
    """The fault as an observer allows for it: larger, and by the observer's own channels."""
    fault = fault_of(name)
    if isinstance(fault, SensorFault):
        return replace(fault, where=ABZ_OUTPUT)
    return replace(fault, magnitude=LARGEST_LOSS) if fault.where == ETA else fault


def _with_input(
    model: UncertainModel, embedding: Embedding, channel: int, gain: float, offset: float
) -> UncertainModel:
    """The model of an embedding in which an input is achieved as gain u + offset."""
    factor = np.ones(model.n_inputs)
    factor[channel] = gain

    def scaled(block: Array) -> Array:
        return block * factor

    def shifted(constant: Array, block: Array) -> Array:
        return constant + offset * block[..., channel]

    return model.replace(
        B=Block(embedding, ("B",), scaled),
        D=Block(embedding, ("D",), scaled),
        a=Block(embedding, ("a", "B"), shifted),
        c=Block(embedding, ("c", "D"), shifted),
    )


def _with_output(model: UncertainModel, embedding: Embedding, channel: int, offset: float) -> UncertainModel:
    """The model of an embedding in which a sensor reads ``offset`` too much."""
    bias = np.zeros(model.n_outputs)
    bias[channel] = offset
    return model.replace(c=Block(embedding, ("c",), lambda c: c + bias))


def _check(fault: str, profile: str) -> None:
    expected = HEALTHY if fault == HEALTHY else PROFILE
    if profile != expected:
        raise ValueError(f"profile is {profile!r} for fault {fault!r}; expected {expected!r}")


def missile() -> Missile:
    """The plant that is registered."""
    return Missile()

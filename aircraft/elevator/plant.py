"""The elevator servo-loop as a plant of the studies (entry point ``elevator``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from aircraft.elevator.gains import ServoGains
from aircraft.elevator.scenarios import COMMANDS, DURATION, SCENARIOS, TRAVEL, TS, Scenario, SensorNoise
from aircraft.elevator.servo import Servo
from polytopes import HPolytope
from polytopes.shown import Shown
from svo.checks import Array, chosen
from svo.detectors.detector import Detector
from svo.faults import ActuatorFault
from svo.interval import (
    FirstOrderScheduler,
    IntervalDetector,
    IntervalPredictor,
    NoiseCharacterization,
    first_order_model,
    first_order_schedule,
)
from svo.isolation import ArchitectureI, Bank
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.observers.window.observer import WindowObserver
from svo.plant import HEALTHY, Column, Columns, Distribution, Reference

POLES = (0.6, 0.8, 0.9, 0.95, 0.99)
QBAR = 200
SAFETY_FACTOR = 1.2

# Half-width of the sensor noise, in standard deviations. The simulated noise is clipped at it.
NOISE_BOUNDS: Mapping[str, float] = MappingProxyType({"conservative": 6.0, "quiet": 4.0})

COLUMNS = Columns(
    inputs=(Column("command_rad", "rad"),),
    outputs=(Column("position_rad", "rad"),),
    states=(Column("true_position_rad", "rad"),),
)

# Table 1 of the paper [s]: scenario, then one time for each pole.
TABLE_1: Mapping[tuple[str, str], tuple[float, ...]] = MappingProxyType(
    {
        ("runaway", "slow"): (50.05, 50.05, 50.06, 50.06, 50.13),
        ("jam", "moving"): (14.55, 14.56, 14.57, 14.58, 14.65),
        ("jam", "steady"): (68.46, 68.14, 67.35, 66.94, 67.71),
    }
)


def _faults() -> dict[str, tuple[str, ...]]:
    names = dict.fromkeys(fault for fault, _ in SCENARIOS)
    return {name: tuple(profile for fault, profile in SCENARIOS if fault == name) for name in names}


@dataclass(frozen=True)
class Elevator(Shown):
    """The servo-loop of an elevator with runaway, jam, oscillation and loss of effect.

    Two detectors belong to it: the interval detector of the paper, learnt from fault-free records, and a bank of
    set-valued observers of the same first-order model, which needs a bound of the noise instead.

    Parameters
    ----------
    servo : Servo
    sensor : SensorNoise
        Its bound is replaced by that of the noise set, unless ``gaussian``.
    gaussian : bool
        Do not clip the simulated noise.
    horizon : int
        Steps in the set-valued observers' windows.
    """

    servo: Servo = field(default_factory=Servo)
    sensor: SensorNoise = field(default_factory=SensorNoise)
    gaussian: bool = False
    horizon: int = 10
    name: str = "elevator"
    title: str = "elevator servo-loop: runaway, jam, oscillation, loss of effect"
    Ts: float = TS
    fault_time: float = 50.0
    faults: Mapping[str, tuple[str, ...]] = field(default_factory=_faults)
    noise_sets: tuple[str, ...] = tuple(NOISE_BOUNDS)
    columns: Columns = COLUMNS
    reference: Mapping[tuple[str, str], Reference] = field(default_factory=dict)
    reference_title: str = "Combastel et al., IFAC World Congress 2014, Table 1"

    # -- the plant ---------------------------------------------------------------------------------

    def fault_start(self, fault: str, profile: str) -> float:
        """Time of the first faulty sample [s]."""
        return self._scenario(fault, profile).start

    def duration(self, fault: str, profile: str) -> float:
        """Length of a run [s]; ``fault`` may be "none"."""
        if fault != HEALTHY:
            self._scenario(fault, profile)
        return DURATION

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One validation run with its true position; ``fault`` may be "none"."""
        scenario = None if fault == HEALTHY else self._scenario(fault, profile)
        return self._run("validation", noise, seed, scenario)

    def learning_log(self, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One fault-free run of the learning scenario."""
        return self._run("learning", noise, seed, None)

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank of window observers.

        The models of jam and runaway are the same, any position within the travel: they fall or stand together.
        """
        initial = HPolytope.box(*([limit] for limit in TRAVEL))
        observers = {name: WindowObserver(m, initial, horizon=self.horizon) for name, m in self.models(noise).items()}
        return ArchitectureI(observers.pop("nominal"), observers)

    def scheduler(self) -> FirstOrderScheduler:
        """A fresh filter that runs the interval predictor along: bounds of the pole from command and measurement."""
        return FirstOrderScheduler(self.predictor)

    # -- models and detectors ----------------------------------------------------------------------

    def models(self, noise: str) -> dict[str, UncertainModel]:
        """The observers' models: "nominal", then one for each fault, which contains the healthy servo-loop."""
        nominal = first_order_model(self._bound(noise), self.Ts)
        faults = {name: self._scenario(name, profiles[0]).fault for name, profiles in self.faults.items()}
        return {"nominal": nominal} | {name: _beyond_the_stops(f).model(nominal) for name, f in faults.items()}

    def predictor(self, first_command: float) -> IntervalPredictor:
        """Interval predictor of a servo-loop that starts at rest, within 2 mrad of its first command."""
        return ServoGains(self.Ts, self.servo).predictor(first_command)

    def residual(self, log: Log) -> Array:
        """Dead-zone residual of a run that starts at rest, (K,)."""
        return self.predictor(float(log.u[0, 0])).predict(log).residual

    def characterise(self, records: Sequence[Log]) -> NoiseCharacterization:
        """The noise of fault-free records, with the paper's safety factor and a window of 2 s."""
        return NoiseCharacterization.from_records(
            [self.residual(r) for r in records], QBAR, safety_factor=SAFETY_FACTOR
        )

    def interval_detectors(self, noise: NoiseCharacterization, first_command: float) -> dict[str, IntervalDetector]:
        """The paper's detectors, one for each pole of the residual filter, named as in Table 1."""
        return {f"a = {a:g}": IntervalDetector(self.predictor(first_command), noise, a) for a in POLES}

    @property
    def compared_faults(self) -> tuple[tuple[str, str], ...]:
        """The paper's three scenarios, and the oscillation that the loop still follows its command under."""
        return (*TABLE_1, ("oscillation", "liquid"))

    def with_noise(self, distribution: Distribution) -> Elevator:
        """This plant with its noise clipped at the noise set's bound, or Gaussian."""
        return replace(self, gaussian=distribution == "gaussian")

    def detectors(self, noise: str) -> list[Detector]:
        """The detectors to compare, with any noise set; see `aircraft.elevator.detectors`."""
        from aircraft.elevator.detectors import detectors

        self._bound(noise)
        return detectors(self.predictor, POLES, QBAR, self.sensor.sigma, self.Ts)

    @property
    def detection_reference(self) -> dict[tuple[str, str], dict[str, float]]:
        """Detection times of the paper's Table 1 [s], by fault, profile and detector."""
        return {key: {f"a = {a:g}": t for a, t in zip(POLES, times, strict=True)} for key, times in TABLE_1.items()}

    def label(self, fault: str, profile: str) -> str:
        """A scenario in words."""
        return "no fault" if fault == HEALTHY else self._scenario(fault, profile).label

    # -- inside ------------------------------------------------------------------------------------

    def _scenario(self, fault: str, profile: str) -> Scenario:
        if (fault, profile) not in SCENARIOS:
            known = ", ".join(" ".join(key) for key in SCENARIOS)
            raise ValueError(f"fault and profile are {fault!r} and {profile!r}; expected one of {known}")
        return SCENARIOS[fault, profile]

    def _bound(self, noise: str) -> float:
        return chosen("noise", noise, NOISE_BOUNDS) * self.sensor.sigma

    def _run(self, command: str, noise: str, seed: int | np.random.SeedSequence, scenario: Scenario | None) -> Log:
        time = np.arange(round(DURATION / self.Ts), dtype=np.float64) * self.Ts
        u = COMMANDS[command](time)
        laws = {} if scenario is None else {scenario.where: scenario.fault.law(time)}
        x = self.servo.run(u, float(u[0]), self.Ts, **laws)
        sensor = replace(self.sensor, bound=np.inf if self.gaussian else self._bound(noise))
        y = x + sensor.draw(time.size, np.random.default_rng(seed))
        log = Log(time=time, u=u[:, None], y=y[:, None], x=x[:, None])
        scheduled = first_order_schedule(self.predictor(float(u[0])).predict(log))
        return replace(log, schedule=scheduled.schedule)


def _beyond_the_stops(fault: ActuatorFault) -> ActuatorFault:
    """A surface that is driven against its stop arrives at a speed which no command within the travel explains."""
    return fault if fault.travel is None else replace(fault, travel=(1.2 * TRAVEL[0], 1.2 * TRAVEL[1]))


def elevator() -> Elevator:
    """The plant that is registered."""
    return Elevator()

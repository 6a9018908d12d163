"""The Eclipse's longitudinal axis as a plant of the studies (entry point ``eclipse``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import numpy as np

from aircraft.eclipse.autopilot import DESIGN_AIRSPEED, INPUT_LOWER, INPUT_UPPER
from aircraft.eclipse.equations import Equations, nonlinear_models
from aircraft.eclipse.models import MismatchBounds, ScheduledModel, read_bounds
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.scenarios import FAULT_TIME, FAULTS, LARGEST, PROFILES, TS, Fault, Scenarios
from aircraft.eclipse.schedule import AirspeedFilter
from aircraft.eclipse.trim import level_trim
from polytopes import HPolytope
from polytopes.shown import Shown
from svo.checks import Array, expect, expect_one_of
from svo.faults import SensorFault
from svo.isolation import ArchitectureI, ArchitectureII, Bank
from svo.logs.log import Log
from svo.models import ScheduleTable, UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.observers.window.observer import WindowObserver
from svo.plant import Column, Columns, Distribution, Reference, Scheduler, StatedFault, no_schedule

if TYPE_CHECKING:
    from svo.detectors.detector import Detector

REFERENCE: Mapping[tuple[str, str], Reference] = MappingProxyType(
    {
        ("alpha", "step"): Reference("0.01", "0.01"),
        ("elevator", "step"): Reference("0.02", "-"),
        ("dynamics", "step"): Reference("0.02", "-"),
        ("alpha", "hard"): Reference("< 0.5", "-"),
        ("elevator", "hard"): Reference("< 0.5", "-"),
        ("dynamics", "hard"): Reference("< 0.5", "-"),
        ("alpha", "soft"): Reference("< 0.5", "about 3.5"),
        ("elevator", "soft"): Reference("< 0.5", "-"),
        ("dynamics", "soft"): Reference("< 0.5", "-"),
    }
)

COLUMNS = Columns(
    inputs=(Column("elevator_deg", "deg"), Column("thrust_command", "0.983 kN")),
    outputs=(
        Column("airspeed_m_s", "m/s"),
        Column("alpha_rad", "rad"),
        Column("theta_rad", "rad"),
        Column("pitch_rate_rad_s", "rad/s"),
    ),
    states=(
        Column("true_u_m_s", "m/s"),
        Column("true_w_m_s", "m/s"),
        Column("true_theta_rad", "rad"),
        Column("true_q_rad_s", "rad/s"),
    ),
)

# Any state of a flight between 25 and 55 m/s; the first measurement cuts it down to the sensors' bounds.
INITIAL_LOWER = (15.0, -15.0, -0.8, -2.0)
INITIAL_UPPER = (65.0, 25.0, 0.8, 2.0)


COMPARED_FAULTS = tuple((fault, profile) for fault in FAULTS for profile in ("step", "soft"))


def _description(fault: str, size: float) -> str:
    """The step of a fault at a fraction of its size, for people."""
    return {
        "alpha": f"alpha reads {3 * size:g} deg too much",
        "elevator": f"{50 * size:g} % of the elevator's effect is lost",
        "dynamics": f"M_u is {30 * size:g} % larger",
    }[fault]


@dataclass(frozen=True)
class Eclipse(Shown):
    """The Eclipse UAV in closed loop about 37 m/s, with the faults of Rosa and Silvestre (2013), section 6.

    The observers' models are linear and scheduled by airspeed, as in the paper ("lpv"), or have the simulator's own
    equations ("nonlinear"). What the linear ones leave out is measured on these flights (`aircraft.eclipse.mismatch`),
    so that they promise nothing for a flight unlike them; what linearising the equations leaves out is proven.

    Parameters
    ----------
    scenarios : Scenarios
    horizon : int
        Steps in the observers' windows.
    architecture : {"I", "II"}
        Of the bank. Under Architecture II the fault observers start, at the detection, from the set of all
        states of a flight between 25 and 55 m/s.
    model_kind : {"lpv", "nonlinear"}
        Of the observers' models.
    bounds : mapping of noise set to mapping of observer to MismatchBounds
        What the linear models leave out; by default as measured on the flights of ``scenarios``.
    """

    scenarios: Scenarios = field(default_factory=Scenarios)
    horizon: int = 10
    architecture: Literal["I", "II"] = "I"
    model_kind: Literal["lpv", "nonlinear"] = "nonlinear"
    bounds: Mapping[str, Mapping[str, MismatchBounds]] = field(default_factory=read_bounds, repr=False)
    architectures: tuple[str, ...] = ("I", "II")
    model_kinds: tuple[str, ...] = ("nonlinear", "lpv")
    name: str = "eclipse"
    title: str = "Eclipse UAV, longitudinal axis: alpha sensor, elevator and M_u faults"
    Ts: float = TS
    fault_time: float = FAULT_TIME
    faults: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: {name: tuple(PROFILES) for name in FAULTS})
    noise_sets: tuple[str, ...] = tuple(NOISE_SETS)
    columns: Columns = COLUMNS
    input_limits: tuple[Array, Array] = field(default_factory=lambda: (INPUT_LOWER, INPUT_UPPER))
    compared_faults: tuple[tuple[str, str], ...] = COMPARED_FAULTS
    reference: Mapping[tuple[str, str], Reference] = field(default_factory=lambda: REFERENCE)
    reference_title: str = (
        "Rosa and Silvestre, Control Engineering Practice 21 (2013), section 6: "
        "means of 10 runs [s], 5 to 200 ms per observer and sample"
    )

    def __post_init__(self) -> None:
        expect(self.architecture in ("I", "II"), "architecture", self.architecture, "'I' or 'II'")
        expect(self.model_kind in ("lpv", "nonlinear"), "model_kind", self.model_kind, "'lpv' or 'nonlinear'")

    def duration(self, fault: str, profile: str) -> float:
        """Length of a run [s]; ``fault`` may be "none"."""
        return self.scenarios.duration(fault, profile)

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One run with its true states [u, w, theta, q]; ``fault`` may be "none". The inputs are commands."""
        run = self.scenarios.run(fault, profile, noise, seed)
        schedule = run.schedule if self.model_kind == "lpv" else None
        return Log(time=run.time, u=run.flight.u, y=run.flight.y, x=run.flight.x[:, :4], schedule=schedule)

    def models(self, noise: str) -> Mapping[str, UncertainModel] | Mapping[str, NonlinearModel]:
        """The observers' models: "nominal", then one for each fault, which contains the healthy aircraft."""
        return self.lpv_models(noise) if self.model_kind == "lpv" else self.nonlinear_models(noise)

    def lpv_models(self, noise: str) -> dict[str, UncertainModel]:
        """Linear ones, scheduled by airspeed."""
        expect_one_of("noise", noise, NOISE_SETS)
        if noise not in self._lpv_models:
            bounds, scheduled = self.bounds[noise], self.scenarios.model
            models = {"nominal": scheduled.model(noise, bounds["nominal"])}
            models |= {name: f.model(scheduled.model(noise, bounds[name])) for name, f in self._largest.items()}
            self._lpv_models[noise] = models
        return dict(self._lpv_models[noise])

    def nonlinear_models(self, noise: str) -> dict[str, NonlinearModel]:
        """Those with the simulator's equations."""
        expect_one_of("noise", noise, NOISE_SETS)
        if noise not in self._nonlinear_models:
            model = self.scenarios.model
            equations = Equations(model.surrogate, model.derivatives, model.moment_reference)
            initial = (INITIAL_LOWER, INITIAL_UPPER)
            models = nonlinear_models(equations, NOISE_SETS[noise], self._largest, model.Ts, initial)
            self._nonlinear_models[noise] = models
        return dict(self._nonlinear_models[noise])

    @property
    def _largest(self) -> dict[str, Fault]:
        """Each fault at its full size, which its observer must contain."""
        return {name: self.scenarios.fault(name, LARGEST) for name in self.faults}

    @cached_property
    def _lpv_models(self) -> dict[str, dict[str, UncertainModel]]:
        """Those of noise sets that were asked for: every bank of a study has the same."""
        return {}

    @cached_property
    def _nonlinear_models(self) -> dict[str, dict[str, NonlinearModel]]:
        return {}

    def stated_faults(self, noise: str, size: float = 1.0) -> dict[str, StatedFault]:
        """The aircraft with each fault at the size of its step: alpha + 3 deg, half the elevator, 1.3 M_u.

        As a linear model, whatever the bank's are; ``size`` is a fraction of it, in (0, 1].
        """
        models, sized, stated = self.lpv_models(noise), replace(self.scenarios, size=size), {}
        for name in self.faults:
            fault = sized.fault(name, "step")
            if isinstance(fault, SensorFault):
                bias = np.zeros(models["nominal"].n_outputs)
                bias[fault.where] = fault.magnitude
                healthy = self.scenarios.model.model(noise, self.bounds[noise][name])
                model = healthy.replace(c=_shifted(self.scenarios.model.blocks.block("c"), bias))
            else:
                delta = float(fault.delta(FAULT_TIME))
                *others, last = models[name].uncertainties
                model = models[name].replace(uncertainties=[*others, replace(last, bounds=(delta, delta))])
            stated[name] = StatedFault(_description(name, size), model)
        return stated

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank of window observers with box templates."""
        initial = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
        observers = {name: WindowObserver(m, initial, horizon=self.horizon) for name, m in self.models(noise).items()}
        nominal = observers.pop("nominal")
        if self.architecture == "II":
            return ArchitectureII(nominal, observers, global_=initial)
        return ArchitectureI(nominal, observers)

    def with_architecture(self, architecture: Literal["I", "II"]) -> Eclipse:
        """The same plant with the other bank."""
        return replace(self, architecture=architecture)

    def with_models(self, kind: Literal["lpv", "nonlinear"]) -> Eclipse:
        """The same plant with a bank of the other ``kind`` of models."""
        return replace(self, model_kind=kind)

    def with_noise(self, distribution: Distribution) -> Eclipse:
        """This aircraft with bounded or Gaussian noise and gusts of the same rms; models and bounds are unchanged."""
        return replace(self, scenarios=replace(self.scenarios, distribution=distribution))

    def detectors(self, noise: str) -> list[Detector]:
        """What ``svo compare eclipse`` sets side by side; see `aircraft.eclipse.detectors`."""
        from aircraft.eclipse.detectors import detectors

        stated = {name: fault.model for name, fault in self.stated_faults(noise).items()}
        return detectors(self.lpv_models(noise), stated, HPolytope.box(INITIAL_LOWER, INITIAL_UPPER))

    def scheduler(self) -> Scheduler:
        """A fresh causal filter of the measured airspeed (first order, 0.5 s); nonlinear models have no schedule."""
        return AirspeedFilter(self.Ts, DESIGN_AIRSPEED) if self.model_kind == "lpv" else no_schedule


def _shifted(offset: ScheduleTable, shift: Array) -> ScheduleTable:
    return ScheduleTable.of(lambda c: c + shift, offset)


def eclipse(reference: str = "absolute") -> Eclipse:
    """The plant that is registered.

    Parameters
    ----------
    reference : {"absolute", "deviation"}
        Whether the dynamics fault scales M_u times the absolute u, or times its deviation from the trim at
        37 m/s. In regulated flight the second one hardly shows.
    """
    if reference == "absolute":
        return Eclipse()
    if reference == "deviation":
        model = ScheduledModel(TS)
        trim = level_trim(model.surrogate, DESIGN_AIRSPEED)
        return Eclipse(Scenarios(ScheduledModel(TS, moment_reference=float(trim.x[0]))))
    raise ValueError(f"reference is {reference!r}; expected 'absolute' or 'deviation'")

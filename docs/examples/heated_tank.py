"""A plant of one's own, complete: a water tank with a heating jacket and two thermometers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from polytopes import HPolytope
from svo import ArchitectureI, Log, UncertainModel, WindowObserver
from svo.faults import ActuatorFault, Ramp, SensorFault, Step
from svo.plant import HEALTHY, Column, Columns, Reference, Scheduler, no_schedule

TS = 10.0  # s
FAULT_TIME = 600.0  # s
SHAPES = {"step": Step(FAULT_TIME), "ramp": Ramp(FAULT_TIME, 600.0)}
BOUNDS = {"laboratory": (0.02, 0.1), "workshop": (0.1, 0.5)}  # draught [kW], thermometers [K]

COLUMNS = Columns(
    inputs=(Column("power_kW", "kW"),),
    outputs=(Column("jacket_K", "K"), Column("water_K", "K")),
    states=(Column("true_jacket_K", "K"), Column("true_water_K", "K")),
)


def tank(noise: str) -> UncertainModel:
    """Jacket and water [K above the room], driven by the heater's power [kW] and a draught of unknown power."""
    draught, thermometer = BOUNDS[noise]
    return UncertainModel.from_continuous(
        A=[[-0.02, 0.018], [0.003, -0.0035]],
        B=[[0.1], [0.0]],
        C=np.eye(2),
        E=[[0.1], [0.0]],
        w=[draught],
        n=[thermometer, thermometer],
        Ts=TS,
    )


def fault_object(fault: str, profile: str) -> ActuatorFault | SensorFault:
    """What corrupts a simulation; its ``model`` is that of the fault's observer, so the two cannot disagree."""
    if fault == "heater":
        return ActuatorFault(0, "loss", 0.6, SHAPES[profile])
    return SensorFault(1, "bias", 3.0, SHAPES[profile])


@dataclass(frozen=True)
class HeatedTank:
    """See `svo.plant.Plant` for what each of these means."""

    name: str = "heated tank"
    title: str = "Water tank with a heating jacket and two thermometers"
    Ts: float = TS
    fault_time: float = FAULT_TIME
    faults: Mapping[str, tuple[str, ...]] = field(
        default_factory=lambda: {"heater": ("step", "ramp"), "thermometer": ("step", "ramp")}
    )
    noise_sets: tuple[str, ...] = tuple(BOUNDS)
    columns: Columns = COLUMNS
    reference: Mapping[tuple[str, str], Reference] = field(default_factory=dict)
    reference_title: str = ""

    def duration(self, fault: str, profile: str) -> float:
        return 1800.0

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """The heater is on for three minutes of every five; the log has what it was told, not what it did."""
        time = self.Ts * np.arange(round(self.duration(fault, profile) / self.Ts))
        power = np.where(time % 300.0 < 180.0, 2.0, 0.5)[:, None]
        what = None if fault == HEALTHY else fault_object(fault, profile)
        reached = what.corrupt(time, power) if isinstance(what, ActuatorFault) else power
        log = tank(noise).simulate([10.0, 8.0], reached, np.random.default_rng(seed))
        read = what.corrupt(time, log.y) if isinstance(what, SensorFault) else log.y
        return replace(log, u=power, y=read)

    def bank(self, noise: str) -> ArchitectureI:
        """Observers that start anywhere between the room's temperature and 40 K above it."""
        start, nominal = HPolytope.box([0.0, 0.0], [40.0, 40.0]), tank(noise)
        models = {fault: fault_object(fault, "step").model(nominal) for fault in self.faults}
        return ArchitectureI(
            WindowObserver(nominal, start), {fault: WindowObserver(model, start) for fault, model in models.items()}
        )

    def scheduler(self) -> Scheduler:
        """The matrices depend on no schedule."""
        return no_schedule


if __name__ == "__main__":
    from svo.testing import check_plant

    print(f"{len(check_plant(HeatedTank()).kept)} rules hold")

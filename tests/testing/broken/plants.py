"""Plants that are each broken in one way that a user would, and the rule that says so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from docs.examples.heated_tank import HeatedTank, fault_object, tank
from polytopes import HPolytope
from svo import ArchitectureI, Log, WindowObserver
from svo.testing.plant_runs import cut


class TooShort(HeatedTank):
    """Its logs stop one sample early, as with ``range(1, samples)``."""

    def simulate(self, *asked: Any) -> Log:
        log = super().simulate(*asked)
        return cut(log, 0, len(log) - 1)


class ShiftedInput(HeatedTank):
    """Row k has the input that led to sample k, not the one that is held from it on."""

    def simulate(self, *asked: Any) -> Log:
        log = super().simulate(*asked)
        return replace(log, u=np.vstack([log.u[:1], log.u[:-1]]))


class WiderNoise(HeatedTank):
    """Gaussian noise with a third of the bound as its standard deviation, not clipped."""

    def simulate(self, fault: str, profile: str, noise: str, seed: Any) -> Log:
        log = super().simulate(fault, profile, noise, seed)
        added = np.random.default_rng(seed).normal(scale=0.3 * tank(noise).bounds()[2], size=log.y.shape)
        return replace(log, y=log.y + added)


class TwoLogs(HeatedTank):
    """Its random numbers come from one generator for all runs, which a seed does not reset."""

    rng = np.random.default_rng(0)

    def simulate(self, fault: str, profile: str, noise: str, seed: Any) -> Log:
        return super().simulate(fault, profile, noise, int(self.rng.integers(2**32)))


class FaultNotInItsModel(HeatedTank):
    """The thermometer's observer is given the model of a bias that is smaller than the one simulated."""

    def bank(self, noise: str) -> ArchitectureI:
        start, nominal = HPolytope.box([0.0, 0.0], [40.0, 40.0]), tank(noise)
        models = {
            "heater": fault_object("heater", "step").model(nominal),
            "thermometer": replace(fault_object("thermometer", "step"), magnitude=1.0).model(nominal),
        }
        observers = {name: WindowObserver(model, start) for name, model in models.items()}
        return ArchitectureI(WindowObserver(nominal, start), observers)


class ForgetsTheFault(HeatedTank):
    """Every run is a healthy one."""

    def simulate(self, fault: str, profile: str, noise: str, seed: Any) -> Log:
        return super().simulate("none", "none", noise, seed)


class ReadsNothing(HeatedTank):
    """Its logs have a row for every sample, and no reading in any."""

    def simulate(self, *asked: Any) -> Log:
        log = super().simulate(*asked)
        return replace(log, y=np.full_like(log.y, np.nan))


class EndsThePython(HeatedTank):
    """Its simulator is a script that ends with ``sys.exit()``: the caller's tests ended with it, and passed."""

    def simulate(self, *asked: Any) -> Log:
        raise SystemExit(0)


BROKEN_PLANTS = {
    TooShort: "length",
    ShiftedInput: "input of its sample",
    WiderNoise: "stated noise",
    TwoLogs: "one seed",
    FaultNotInItsModel: "own fault",
    ForgetsTheFault: "fault acts",
    ReadsNothing: "channels",
}

"""A plant of one state that offers detectors, small enough to compare in a second."""

from dataclasses import dataclass, field, replace

import numpy as np

from polytopes import HPolytope
from svo import Log, UncertainModel
from svo.baselines import GaussianModel
from svo.detectors.residuals import CUSUMDetector
from svo.detectors.standard import standard_detectors
from svo.detectors.window_bank import WindowBank
from svo.faults import SensorFault, Step
from svo.plant import Columns

TS, BOX = 0.1, HPolytope.box([-2.0, -2.0], [2.0, 2.0])
SAMPLES, FAULT_TIME = 60, 2.0


def model() -> UncertainModel:
    A, C = [[0.9, 0.1], [0.0, 0.8]], [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    return UncertainModel(A, [[0.0], [1.0]], C, E=np.eye(2), w=[0.05, 0.05], n=[0.1, 0.1, 0.1], Ts=TS)


@dataclass(frozen=True)
class SmallPlant:
    distribution: str = "bounded"
    name: str = "small"
    title: str = "Two states, three sensors"
    Ts: float = TS
    fault_time: float = FAULT_TIME
    noise_sets: tuple = ("usual",)
    columns: Columns = field(default_factory=lambda: Columns(inputs=(), outputs=()))
    reference_title: str = ""
    compared_faults: tuple = (("first", "step"), ("second", "step"))

    @property
    def faults(self):
        return {"first": ("step",), "second": ("step",)}

    @property
    def reference(self):
        return {}

    def fault(self, name):
        return SensorFault(("first", "second").index(name), "bias", 0.6, Step(FAULT_TIME))

    def duration(self, fault, profile):
        return SAMPLES * TS

    def simulate(self, fault, profile, noise, seed):
        rng = np.random.default_rng(seed)
        u = rng.uniform(-0.3, 0.3, (SAMPLES, 1))
        if self.distribution == "bounded":
            log = model().simulate([0.0, 0.0], u, rng)
        else:  # the same rms, and twice the bounds to leave them
            log = model().replace(n=[1e-9] * 3).simulate([0.0, 0.0], u, rng)
            log = replace(log, y=log.y + 0.1 / np.sqrt(3) * rng.standard_normal(log.y.shape))
        y = log.y if fault == "none" else self.fault(fault).corrupt(log.time, log.y)
        return Log(log.time, log.u, y, x=log.x)

    def bank(self, noise):
        raise NotImplementedError

    def scheduler(self):
        raise NotImplementedError

    def with_noise(self, distribution):
        return replace(self, distribution=distribution)

    def detectors(self, noise):
        models = {"nominal": model(), **{name: self.fault(name).model(model()) for name in self.faults}}
        nominal = GaussianModel(model(), BOX)
        biased = {name: GaussianModel(model().replace(c=0.6 * np.eye(3)[i]), BOX) for i, name in enumerate(self.faults)}
        return [
            WindowBank(models, BOX, 5, stated=True),
            WindowBank(models, BOX, 5),
            *standard_detectors(nominal, biased),
            CUSUMDetector(nominal),
        ]

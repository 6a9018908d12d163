"""A user's own plant, registered as any other: a water tank with two level gauges.

It proves that studies, reports and the command line know nothing but the protocol, and it is quick.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.isolation.architectures import ArchitectureI, ArchitectureII
from svo.isolation.bank import Bank
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel
from svo.observers.window.observer import WindowObserver
from svo.plant import Column, Columns, Reference

BOUNDS = {"calm": (0.002, 0.01), "rough": (0.004, 0.03)}
LEAK, BIAS = 0.05, 0.4


@dataclass(frozen=True)
class Tank:
    name: str = "tank"
    title: str = "Water tank <with> two gauges"
    Ts: float = 0.1
    fault_time: float = 1.0
    faults: Mapping[str, tuple[str, ...]] = field(
        default_factory=lambda: {"leak": ("step", "ramp"), "gauge": ("step",)}
    )
    noise_sets: tuple[str, ...] = ("calm", "rough")
    columns: Columns = field(
        default_factory=lambda: Columns(
            inputs=(Column("inflow", "l/s"),),
            outputs=(Column("gauge_1", "m"), Column("gauge_2", "m")),
            states=(Column("level", "m"),),
        )
    )
    reference: Mapping[tuple[str, str], Reference] = field(
        default_factory=lambda: {
            ("gauge", "step"): Reference("0.1", "< 0.5"),
            ("leak", "step"): Reference("about 0.3", "-"),
        }
    )
    reference_title: str = "a manual of 1950"

    def duration(self, fault: str, profile: str) -> float:
        return 4.0

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        if fault == os.environ.get("TANK_BURSTS_IN"):
            burst(os.environ["TANK_BURSTS"])
        rng = np.random.default_rng(seed)
        disturbance, error = BOUNDS[noise]
        samples = round(self.duration(fault, profile) / self.Ts)
        time = np.arange(samples) * self.Ts
        after = time >= self.fault_time - 1e-9
        size = after * (np.clip((time - self.fault_time) / 2, 0, 1) if profile == "ramp" else 1.0)
        level, u = [1.0], np.full((samples, 1), 0.4)
        for k in range(samples - 1):
            outflow = 0.02 + (LEAK * size[k] if fault == "leak" else 0.0)
            level.append((1 - outflow) * level[-1] + 0.05 * u[k, 0] + rng.uniform(-disturbance, disturbance))
        x = np.array(level)[:, None]
        y = x + rng.uniform(-error, error, (samples, 2))
        y[:, 0] += BIAS * size if fault == "gauge" else 0.0
        return Log(time=time, u=u, y=y, x=x)

    def bank(self, noise: str) -> ArchitectureI:
        disturbance, error = BOUNDS[noise]
        nominal = UncertainModel(
            [[0.98]], [[0.05]], [[1.0], [1.0]], E=[[1.0]], w=[disturbance], n=[error, error], Ts=self.Ts
        )
        leak = nominal.replace(uncertainties=[Uncertainty(A=[[-LEAK]], bounds=(0, 1))])
        gauge = nominal.replace(n=[error + BIAS, error])

        def observer(model: UncertainModel) -> WindowObserver:
            return WindowObserver(model, initial=HPolytope.box([0.0], [3.0]), horizon=5)

        return ArchitectureI(observer(nominal), {"leak": observer(leak), "gauge": observer(gauge)})

    def scheduler(self) -> Callable[[Any], None]:
        return lambda y: None


def burst(how: str) -> None:
    """What can go wrong in anyone's plant."""
    if how == "exit":
        sys.exit(0)
    if how == "segfault":
        ctypes.string_at(0)
    raise ArithmeticError("the tank burst")


def tank() -> Tank:
    return Tank()


@dataclass(frozen=True)
class TankOfTwoBanks(Tank):
    """The same tank, whose gauge's observer may start at the detection instead, and whose models may be nonlinear."""

    name: str = "tank2"
    architecture: str = "I"
    architectures: tuple[str, ...] = ("I", "II")
    model_kind: str = "lpv"
    model_kinds: tuple[str, ...] = ("lpv", "nonlinear")

    def with_architecture(self, architecture: str) -> TankOfTwoBanks:
        return replace(self, architecture=architecture)

    def with_models(self, kind: str) -> TankOfTwoBanks:
        return replace(self, model_kind=kind)

    def bank(self, noise: str) -> Bank:
        first = super().bank(noise) if self.model_kind == "lpv" else self._nonlinear(noise)
        if self.architecture == "I":
            return first
        faults = {name: first.observers[name] for name in ("leak", "gauge")}
        return ArchitectureII(first.observers["nominal"], faults, HPolytope.box([0.0], [3.0]), class_one=("leak",))

    def _nonlinear(self, noise: str) -> ArchitectureI:
        """The same equations, written down as functions."""
        disturbance, error = BOUNDS[noise]
        nominal = NonlinearModel(
            lambda x, u, w: [0.98 * x[0] + 0.05 * u[0] + w[0]], lambda x: [x[0], x[0]], states=["level"],
            inputs=["inflow"], disturbances=["rain"], w=[disturbance], n=[error, error], Ts=self.Ts,
            largest=([0.0], [3.0]), continuous=False,
        )  # fmt: skip
        leak = nominal.replace(
            f=lambda x, u, w, p: [(0.98 - p[0]) * x[0] + 0.05 * u[0] + w[0]], parameters={"leak": (0, LEAK)}
        )
        models = {"nominal": nominal, "leak": leak, "gauge": nominal.replace(n=[error + BIAS, error])}
        start = HPolytope.box([0.0], [3.0])
        observers = {name: WindowObserver(model, start, horizon=5) for name, model in models.items()}
        return ArchitectureI(observers.pop("nominal"), observers)


def tank_of_two_banks() -> TankOfTwoBanks:
    return TankOfTwoBanks()

"""The elevator's bank of first-order models, whose pole has bounds, beside one with the servo's own equations.

What is known beforehand is the same but for the load: the first-order models bound what it does to the pole, the
equations have it as a function of the position, times an unknown swing within its bounds that may change inside a
sample. The truth is integrated in steps of 20 us, where the plant's own simulator takes 1 ms.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from time import process_time
from typing import Any

import numpy as np
from rich.progress import track

from aircraft.elevator.plant import NOISE_BOUNDS, Elevator
from aircraft.elevator.scenarios import SCENARIOS, TRAVEL, validation_command
from aircraft.elevator.servo import Servo
from benchmarks._observers import arguments, console, table
from polytopes import HPolytope
from svo import ArchitectureI, WindowObserver
from svo.faults import ActuatorFault, ActuatorLaw
from svo.functions import sign, sqrt
from svo.indices import judge_alarm
from svo.isolation import Bank
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel
from svo.plant.scheduling import scheduled

NOISE, SEED = "quiet", 0
FINER = 50  # steps of the simulator a sample, ten substeps each
BEFORE, AFTER = 10.0, 12.0  # seconds of a run around its fault
ROUNDING = 1e-12  # rad: of so many steps; at rest the sets are narrower than that


def servo_model(servo: Servo, n: float, Ts: float) -> NonlinearModel:
    """The servo-loop, with the load's slow swing as a disturbance that may change inside a sample."""

    def f(x: Any, u: Any, w: Any) -> list[Any]:
        e = u[0] - x[0]
        load = (servo.force + servo.force_slope * x[0]) * (1.0 + w[0])
        return [servo.gain * e * sqrt((1.0 - load * sign(e)) / (1.0 + servo.damping * (servo.gain * e) ** 2))]

    return NonlinearModel(
        f, lambda x: [x[0]], states=["position"], inputs=["command"], disturbances=["swing of the load"],
        w=[servo.force_swing], varying="w", n=[n], Ts=Ts, physical=([-servo.stop], [servo.stop]),
    )  # fmt: skip


def bank_of(plant: Elevator) -> Bank:
    """Of the same faults as the plant's own."""
    nominal = servo_model(plant.servo, NOISE_BOUNDS[NOISE] * plant.sensor.sigma, plant.Ts)
    faults = {name: SCENARIOS[name, profiles[0]].fault for name, profiles in plant.faults.items()}
    start = HPolytope.box(*([limit] for limit in TRAVEL))
    observers = {
        name: WindowObserver(fault.model(nominal), start, horizon=plant.horizon) for name, fault in faults.items()
    }
    return ArchitectureI(WindowObserver(nominal, start, horizon=plant.horizon), observers)


def fly(plant: Elevator, fault: str, profile: str, seed: int) -> tuple[Log, int]:
    """A part of a run around its fault, finely integrated, and its first faulty sample."""
    scenario = SCENARIOS[fault, profile]
    first = round((scenario.start - BEFORE) / plant.Ts)
    time = (first + np.arange(round((BEFORE + AFTER) / plant.Ts))) * plant.Ts
    u = validation_command(time)
    laws = {scenario.where: _finely(scenario.fault, time)}
    x = plant.servo.run(np.repeat(u, FINER), float(u[0]), plant.Ts / FINER, **laws)[::FINER]
    bound = NOISE_BOUNDS[NOISE] * plant.sensor.sigma
    y = x + replace(plant.sensor, bound=bound).draw(len(x), np.random.default_rng(seed))
    return Log(time=time, u=u[:, None], y=y[:, None], x=x[:, None]), round(BEFORE / plant.Ts)


def _finely(fault: ActuatorFault, time: np.ndarray) -> ActuatorLaw:
    """The law of each sample, held over it."""
    law = fault.law(time)
    return ActuatorLaw(*(np.repeat(part, FINER) for part in vars(law).values()))


def main(given: list[str] | None = None) -> None:
    """Delays, widths and cost of both banks."""
    parser = arguments("servo_equations", __doc__, out=False)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args([] if given is None else given)
    plant, rows = Elevator(), []
    for fault, profile in track(list(SCENARIOS), description="scenarios", console=console, transient=True):
        for label, make in (("first order", partial(plant.bank, NOISE)), ("equations", partial(bank_of, plant))):
            detected, isolated, widths, seconds, wrong, outside = [], [], [], 0.0, 0, 0
            for seed in range(options.runs):
                log, first = fly(plant, fault, profile, SEED + seed)
                bank = make()
                used = scheduled(plant.scheduler(), log) if label == "first order" else log
                begun = process_time()
                record = bank.run(used)
                seconds += process_time() - begun
                lower, upper = (side[:, 0] for side in record.boxes["nominal"])
                widths.append(np.nanmean((upper - lower)[100:first]))
                beyond = np.maximum(lower - log.x[:, 0], log.x[:, 0] - upper)[:first]
                outside += int((beyond > ROUNDING).sum())
                wrong += sum(d is not None and (d < first or name == fault) for name, d in record.died_at.items())
                detected.append(judge_alarm(record.detected_at, first, plant.Ts).delay)
                isolated.append(
                    judge_alarm(record.isolated_at if record.fault == fault else None, first, plant.Ts).delay
                )
            rows.append([
                fault, profile, label, _shown(detected), _shown(isolated), f"{1e3 * np.mean(widths):.3g}",
                f"{1e6 * seconds / (options.runs * len(log)):.0f}", wrong, outside,
            ])  # fmt: skip
    columns = [
        "fault",
        "profile",
        "models",
        "detect (s)",
        "isolate (s)",
        "width (mrad)",
        "us a sample",
        "wrong",
        "outside",
    ]
    table(f"Elevator, {NOISE} noise, {options.runs} runs: medians", columns, rows)


def _shown(delays: list[float | None]) -> str:
    median = np.median([np.inf if d is None else d for d in delays])
    return f"{median:.3g}" if np.isfinite(median) else "-"


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])

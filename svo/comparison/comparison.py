"""Scenarios x detectors x seeds: tuned on some seeds, judged on others, in as many processes as there are."""

from __future__ import annotations

import functools
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from svo.comparison.detector import Detector, Kind
from svo.comparison.run import ComparedRun, Condition, compare_run
from svo.comparison.tuning import FaultyRun, Tuned, tune
from svo.log import Log
from svo.plant import HEALTHY, ComparesDetectors, Distribution, Plant, fault_start, load_plant

Progress = Callable[[int, int], None]
DISTRIBUTIONS: tuple[Distribution, ...] = ("bounded", "gaussian")
_TRAINING, _JUDGING, _CALIBRATION = 0, 1, 2  # branches of the seed


@dataclass(frozen=True)
class Comparison:
    """What is compared, and how much of it; the results follow from it, times of computation aside.

    Parameters
    ----------
    plant : str
        A registered plant that is a `svo.plant.ComparesDetectors`.
    noise : str
        Its noise set.
    runs : int
        Judged runs of each scenario and distribution.
    seed : int
    rate : float
        False-alarm rate that every tuned detector gets: the share of fault-free runs with an alarm.
    healthy_training, faulty_training : int
        Training runs without a fault, and of each scenario, to learn from and to find inner parameters.
    healthy_calibration : int
        Further training runs without a fault, to set the level at which every detector has the rate.
    healthy_runs : int
        Judged runs without a fault.
    evaluations : int
        Settings that the optimiser may try for each detector.
    distributions : tuple of {"bounded", "gaussian"}
    """

    plant: str
    noise: str
    runs: int = 50
    seed: int = 0
    rate: float = 0.02
    healthy_training: int = 50
    faulty_training: int = 10
    healthy_calibration: int = 300
    healthy_runs: int = 200
    evaluations: int = 15
    distributions: tuple[Distribution, ...] = DISTRIBUTIONS

    def __post_init__(self) -> None:
        training = ("healthy_training", "faulty_training", "healthy_calibration")
        for name in ("runs", *training, "healthy_runs", "evaluations"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; expected at least 1")
        if not 0 <= self.rate < 1:
            raise ValueError(f"rate is {self.rate}; expected a share of fault-free runs in [0, 1)")

    def seeds(self, branch: int, scenario: int, count: int) -> list[int]:
        """Seeds of the runs of one scenario (0 = without a fault), the same for every detector and distribution."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(branch, scenario))
        return [int(s) for s in sequence.generate_state(count, np.uint64)]


@dataclass(frozen=True)
class Compared:
    """The outcome: one tuned setting for each distribution and detector, and one row for each judged run."""

    comparison: Comparison
    kinds: Mapping[str, Kind]
    tuned: dict[tuple[str, str], Tuned] = field(default_factory=dict)
    rows: list[ComparedRun] = field(default_factory=list)


def run_comparison(comparison: Comparison, workers: int = 1, progress: Progress | None = None) -> Compared:
    """Tune every detector on training seeds and judge it on others.

    Raises
    ------
    TypeError
        If the plant offers no comparison.
    ValueError
        If a noise set is unknown, detectors share a name, or ``workers`` is below 1.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; expected at least 1 process")
    detectors = compared_plant(comparison.plant).detectors(comparison.noise)
    names = [detector.name for detector in detectors]
    if len(set(names)) < len(names):
        raise ValueError(f"detectors are named {', '.join(names)}; expected different names")
    tasks = [(distribution, index) for distribution in comparison.distributions for index in range(len(names))]
    outcome: dict[tuple[str, int], tuple[Tuned, list[ComparedRun]]] = {}
    for task, result in _results(comparison, tasks, min(workers, len(tasks))):
        outcome[task] = result
        if progress is not None:
            progress(len(outcome), len(tasks))
    compared = Compared(comparison, {detector.name: detector.kind for detector in detectors})
    for distribution, index in tasks:  # in this order whatever the workers did first
        tuned, rows = outcome[distribution, index]
        compared.tuned[distribution, names[index]] = tuned
        compared.rows.extend(rows)
    return compared


@functools.cache
def compared_plant(name: str) -> ComparesDetectors:
    """The registered plant, which offers a comparison; loaded once a process."""
    plant = load_plant(name)
    if not isinstance(plant, ComparesDetectors):
        raise TypeError(f"plant {name!r} offers no detectors to compare; it is no svo.plant.ComparesDetectors")
    return plant


def compare_detector(comparison: Comparison, distribution: Distribution, index: int) -> tuple[Tuned, list[ComparedRun]]:
    """Tune and judge one detector under one distribution of the noise."""
    offer = compared_plant(comparison.plant)
    plant, detector = offer.with_noise(distribution), offer.detectors(comparison.noise)[index]
    scenarios = ((HEALTHY, HEALTHY), *offer.compared_faults)
    tuned = _tune(comparison, plant, detector, scenarios)
    counts = [comparison.healthy_runs] + [comparison.runs] * len(offer.compared_faults)
    rows = []
    _compile(detector, tuned, plant.simulate(*scenarios[1], comparison.noise, 0))
    for scenario, ((fault, profile), count) in enumerate(zip(scenarios, counts, strict=True)):
        condition = Condition(distribution, fault, profile, fault_start(plant, fault, profile))
        for seed in comparison.seeds(_JUDGING, scenario, count):
            log = plant.simulate(fault, profile, comparison.noise, seed)
            rows.append(compare_run(detector, tuned.setting, log, condition, seed))
    return tuned, rows


def _tune(comparison: Comparison, plant: Plant, detector: Detector, scenarios: Sequence[tuple[str, str]]) -> Tuned:
    if detector.fixed is not None:
        return Tuned(detector.fixed, np.nan, 0)
    healthy, faulty = [], []
    for scenario, (fault, profile) in enumerate(scenarios):
        count = comparison.healthy_training if fault == HEALTHY else comparison.faulty_training
        for seed in comparison.seeds(_TRAINING, scenario, count):
            log = plant.simulate(fault, profile, comparison.noise, seed)
            if fault == HEALTHY:
                healthy.append(detector.prepare(log))
            else:
                first = round((fault_start(plant, fault, profile) - float(log.time[0])) / plant.Ts)
                faulty.append(FaultyRun(f"{fault} {profile}", detector.prepare(log), first))
    calibration = _Prepared(plant, detector, comparison)
    return tune(detector, healthy, faulty, calibration, comparison.rate, comparison.evaluations)


class _Prepared(Sequence[Any]):
    """The calibration runs, simulated as they are asked for: all at once they fill the memory."""

    def __init__(self, plant: Plant, detector: Detector, comparison: Comparison) -> None:
        self._plant, self._detector, self._noise = plant, detector, comparison.noise
        self._seeds = comparison.seeds(_CALIBRATION, 0, comparison.healthy_calibration)

    def __len__(self) -> int:
        return len(self._seeds)

    def __getitem__(self, index: Any) -> Any:
        return self._detector.prepare(self._plant.simulate(HEALTHY, HEALTHY, self._noise, self._seeds[index]))


def _compile(detector: Detector, tuned: Tuned, log: Log) -> None:
    """Run once untimed, so that no judged run pays for compilation."""
    detector.run(tuned.setting, detector.prepare(log))


def _results(
    comparison: Comparison, tasks: list[tuple[Distribution, int]], workers: int
) -> Iterator[tuple[tuple[str, int], tuple[Tuned, list[ComparedRun]]]]:
    if workers == 1:
        for task in tasks:
            yield task, compare_detector(comparison, *task)
        return
    # Spawned, not forked: a fork would copy the locks of threads that run in this process.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(compare_detector, comparison, *task): task for task in tasks}
        for future in as_completed(futures):
            yield futures[future], future.result()

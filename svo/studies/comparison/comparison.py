"""Scenarios x detectors x seeds: tuned on some seeds, judged on others, in as many processes as there are."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from svo.checks import expect
from svo.detectors.detector import Detector, Kind, Setting
from svo.logs.log import Log
from svo.plant import HEALTHY, Distribution, Plant, fault_start, first_faulty_sample
from svo.plant.description.find import plant_to_simulate
from svo.studies.attempt import Failed, attempt
from svo.studies.comparison.offer import ComparesDetectors
from svo.studies.comparison.run import ComparedRun, Condition, compare_run
from svo.studies.comparison.store import TunedRow, comparison_parts
from svo.studies.comparison.tuning import FaultyRun, Tuned, tune
from svo.studies.engine import Place, Progress, complete_parts, within

DISTRIBUTIONS: tuple[Distribution, ...] = ("bounded", "gaussian")
_TRAINING, _JUDGING, _CALIBRATION = 0, 1, 2  # branches of the seed
_RUNS_IN_PART = 20


@dataclass(frozen=True)
class Comparison:
    """What is compared, and how much of it; the results follow from it, times of computation aside.

    Parameters
    ----------
    plant : str
        A registered plant that is a `svo.studies.comparison.offer.ComparesDetectors`.
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
            expect(getattr(self, name) >= 1, name, getattr(self, name), "at least 1")
        expect(0 <= self.rate < 1, "rate", self.rate, "a share of fault-free runs in [0, 1)")

    def to_dict(self) -> dict[str, Any]:
        """A form for JSON; lists instead of tuples."""
        return asdict(self) | {"distributions": list(self.distributions)}

    def parts(self) -> Iterator[Part]:
        """The judged runs, a few of one scenario at a time."""
        scenarios = 1 + len(compared_plant(self.plant).compared_faults)
        for distribution in self.distributions:
            for scenario in range(scenarios):
                seeds = self.seeds(_JUDGING, scenario, self.runs if scenario else self.healthy_runs)
                for first in range(0, len(seeds), _RUNS_IN_PART):
                    yield Part(distribution, scenario, tuple(seeds[first : first + _RUNS_IN_PART]))

    def seeds(self, branch: int, scenario: int, count: int) -> list[int]:
        """Seeds of the runs of one scenario (0 = without a fault), the same for every detector and distribution."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(branch, scenario))
        return [int(s) for s in sequence.generate_state(count, np.uint64)]


@dataclass(frozen=True)
class Part:
    """Some judged runs of one scenario (0 = without a fault)."""

    distribution: Distribution
    scenario: int
    seeds: tuple[int, ...]


@dataclass(frozen=True)
class Compared:
    """The outcome: one tuned setting for each distribution and detector, and one row for each judged run."""

    comparison: Comparison
    kinds: Mapping[str, Kind]
    tuned: dict[tuple[str, str], Tuned] = field(default_factory=dict)
    rows: list[ComparedRun] = field(default_factory=list)

    def settings(self, distribution: Distribution) -> list[Setting]:
        """Of all detectors, in their order."""
        return [tuned.setting for (of, _), tuned in self.tuned.items() if of == distribution]

    def failures(self) -> list[str]:
        """A line for each judged run of a detector that failed: which one, and why."""
        return [
            f"{row.detector} (fault {row.fault}, profile {row.profile}, {row.distribution} noise, seed {row.seed}) "
            f"failed: {row.error}"
            for row in self.rows
            if row.error is not None
        ]


def run_comparison(
    comparison: Comparison,
    workers: int = 1,
    progress: Progress | None = None,
    *,
    out: str | Path | None = None,
    scheduler: str | None = None,
    limit: float | None = None,
    resume: bool = False,
    retry_failed: bool = False,
) -> Compared:
    """Tune every detector on training seeds and judge it on others.

    A detector that cannot be tuned, and a run that fails, are rows with their error, and the comparison goes on.

    Parameters
    ----------
    comparison : Comparison
    workers : int
        Number of processes; 1 without a limit runs in this one.
    progress : callable, optional
        Called with (tasks done, tasks in all).
    out : path, optional
        A folder that keeps what each task gave, so that an interrupted comparison can go on.
    scheduler : str, optional
        Address of a ``dask.distributed`` scheduler, whose workers do the tasks instead.
    limit : float, optional
        Seconds that a task may take: a detector tuned, or up to 20 runs judged; tasks then have a process of their own.
    resume : bool
        Go on with the comparison in ``out``.
    retry_failed : bool
        Do the tasks again in which something failed.

    Raises
    ------
    TypeError
        If the plant offers no comparison.
    ValueError
        If a noise set is unknown, detectors share a name, ``workers`` is below 1, or the folder cannot be used (see
        `svo.studies.comparison.store.comparison_parts`).
    """
    place = Place(workers, scheduler, limit)
    detectors = compared_plant(comparison.plant).detectors(comparison.noise)
    names = [detector.name for detector in detectors]
    if len(set(names)) < len(names):
        raise ValueError(f"detectors are named {', '.join(names)}; expected different names")
    tunings = [(distribution, index) for distribution in comparison.distributions for index in range(len(names))]
    parts = list(comparison.parts())

    told = functools.partial(within, progress, len(tunings) + len(parts))
    with comparison_parts(None if out is None else Path(out), comparison.to_dict(), resume) as keep:
        do = functools.partial(complete_parts, place=place, retry_failed=retry_failed)
        tune_one = functools.partial(_tuned_rows, comparison)
        tuned = do(tune_one, tunings, keep.tuned, lambda _, error: [TunedRow.failed(error)], progress=told(0))
        found = dict(zip(tunings, tuned, strict=True))
        tasks = [(part, [found[part.distribution, index] for index in range(len(names))]) for part in parts]
        judge_one = functools.partial(_judged_rows, comparison)
        fail_one = functools.partial(_failed_rows, comparison)
        rows = do(judge_one, tasks, keep.judged, fail_one, progress=told(len(tunings)))
    order = {(str(distribution), names[index]): place for place, (distribution, index) in enumerate(tunings)}
    rows.sort(key=lambda row: order[row.distribution, row.detector])  # stable: scenarios and seeds keep theirs
    return Compared(
        comparison,
        {detector.name: detector.kind for detector in detectors},
        {key: tuned[place].tuned() for key, place in order.items() if tuned[place].error is None},
        rows,
    )


@functools.cache
def compared_plant(name: str) -> ComparesDetectors:
    """The registered plant, which offers a comparison; loaded once a process."""
    plant = plant_to_simulate(name)
    if not isinstance(plant, ComparesDetectors):
        raise TypeError(f"plant {name!r} offers no detectors to compare; it lacks members of ComparesDetectors")
    return plant


def tune_detector(comparison: Comparison, distribution: Distribution, index: int) -> Tuned:
    """Tune one detector under one distribution of the noise."""
    offer = compared_plant(comparison.plant)
    plant, detector = offer.with_noise(distribution), offer.detectors(comparison.noise)[index]
    return _tune(comparison, plant, detector, ((HEALTHY, HEALTHY), *offer.compared_faults))


def judge(comparison: Comparison, part: Part, settings: Sequence[Setting | Failed]) -> list[ComparedRun]:
    """All detectors over some runs of one scenario: every run is simulated once."""
    offer = compared_plant(comparison.plant)
    plant, detectors = offer.with_noise(part.distribution), offer.detectors(comparison.noise)
    condition = _condition(comparison, part)
    rows = []
    for place, seed in enumerate(part.seeds):
        log = attempt(plant.simulate, condition.fault, condition.profile, comparison.noise, seed)
        for detector, setting in zip(detectors, settings, strict=True):
            if place == 0:
                _judge_one(detector, setting, log, condition, seed)  # untimed: no judged run pays for late imports
            rows.append(_judge_one(detector, setting, log, condition, seed))
    return rows


def _judge_one(
    detector: Detector, setting: Setting | Failed, log: Log | Failed, condition: Condition, seed: int
) -> ComparedRun:
    row: ComparedRun | Failed
    if isinstance(setting, Failed):
        row = setting
    else:
        row = log if isinstance(log, Failed) else attempt(compare_run, detector, setting, log, condition, seed)
    return ComparedRun.failed(condition, detector.name, seed, row.error) if isinstance(row, Failed) else row


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
                first = first_faulty_sample(plant, fault, profile, log.time)
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


def _condition(comparison: Comparison, part: Part) -> Condition:
    offer = compared_plant(comparison.plant)
    fault, profile = ((HEALTHY, HEALTHY), *offer.compared_faults)[part.scenario]
    plant = offer.with_noise(part.distribution)
    return Condition(part.distribution, fault, profile, fault_start(plant, fault, profile))


def _tuned_rows(comparison: Comparison, tuning: tuple[Distribution, int]) -> list[TunedRow]:
    return [TunedRow.of(tune_detector(comparison, *tuning))]


def _judged_rows(comparison: Comparison, task: tuple[Part, Sequence[TunedRow]]) -> list[ComparedRun]:
    part, tuned = task
    settings = [row.tuned().setting if row.error is None else Failed(f"not tuned: {row.error}") for row in tuned]
    return judge(comparison, part, settings)


def _failed_rows(comparison: Comparison, task: tuple[Part, Sequence[TunedRow]], error: str) -> list[ComparedRun]:
    part, _ = task
    condition, detectors = _condition(comparison, part), compared_plant(comparison.plant).detectors(comparison.noise)
    return [ComparedRun.failed(condition, d.name, seed, error) for seed in part.seeds for d in detectors]

"""False alarms and wrong isolations of the Eclipse's isolation bank, counted over many runs.

Run with ``python -m benchmarks.fault_free --runs 200``. Every number in the table's last four columns must be zero:
alarms count any observer that is falsified although its model holds (all four without a fault or before it, the true
fault's observer always). The seeds are spawned from a number that no study of this repository uses; a run that is
listed as bad is repeated with ``svo simulate`` and the seed printed.
"""

from __future__ import annotations

import argparse
import multiprocessing
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from time import perf_counter

from rich.console import Console
from rich.progress import track
from rich.table import Table

from svo.plant import HEALTHY, Plant, first_faulty_sample, load_plant, with_bank
from svo.studies.configuration import Job, StudyConfiguration

PLANT = "eclipse"
SEED = 734_190_006


@dataclass(frozen=True)
class Outcome:
    """What happened in one run.

    Attributes
    ----------
    job : Job
    samples : int
        Samples of the log.
    false_alarms : tuple of str
        Observers falsified although their models hold, with the sample.
    detected, isolated : bool
        The nominal observer was falsified after the fault began; the true fault's observer was left alone.
    wrong_isolation : str or None
        The fault that was isolated, where it is not the true one.
    undecided : int
        Answers of observers that were neither a proof nor a point.
    """

    job: Job
    samples: int
    false_alarms: tuple[str, ...]
    detected: bool
    isolated: bool
    wrong_isolation: str | None
    undecided: int

    @property
    def is_bad(self) -> bool:
        return bool(self.false_alarms or self.wrong_isolation or self.undecided)


def examine(job: Job) -> Outcome:
    """Simulate one run and drive a fresh bank over it."""
    plant = with_bank(_plant(), job.bank)
    log = plant.simulate(job.fault, job.profile, job.noise, job.seed)
    record = plant.bank(job.noise).run(log)
    healthy_until = first_faulty_sample(plant, job.fault, job.profile, log.time)
    false_alarms = tuple(
        f"{name} at sample {died}"
        for name, died in record.died_at.items()
        if died is not None and (died < healthy_until or name == job.fault)
    )
    detected = record.detected_at is not None and record.detected_at >= healthy_until
    isolated_as = record.fault if record.isolated_at is not None else None
    return Outcome(
        job,
        len(log),
        false_alarms,
        detected=detected,
        isolated=isolated_as is not None and isolated_as == job.fault,
        wrong_isolation=isolated_as if isolated_as != job.fault else None,
        undecided=int(record.undecided.sum()),
    )


@cache
def _plant() -> Plant:
    return load_plant(PLANT)


def jobs(plant: Plant, runs: int, faulty_runs: int, models: str) -> list[Job]:
    """Fault-free runs, then runs of every fault and profile, each with every noise set."""
    configure = partial(StudyConfiguration.for_plant, plant, seed=SEED, noise=plant.noise_sets, models=(models,))
    free = configure(runs=runs, faults=(HEALTHY,)).jobs(plant)
    if faulty_runs == 0:
        return free
    return free + configure(runs=faulty_runs, faults=tuple(plant.faults)).jobs(plant)


def tabulate(outcomes: Iterable[Outcome]) -> Table:
    """One row for each noise set, fault and profile."""
    groups: dict[tuple[str, str, str], list[Outcome]] = {}
    for outcome in outcomes:
        job = outcome.job
        groups.setdefault((job.noise, job.fault, job.profile), []).append(outcome)
    table = Table(title="Isolation bank of the Eclipse: runs, and what must be zero")
    for name in ("noise", "fault", "profile"):
        table.add_column(name)
    for name in ("runs", "samples", "detected", "isolated", "false alarms", "true fault falsified",
                 "wrong isolations", "undecided verdicts"):  # fmt: skip
        table.add_column(name, justify="right")
    for (noise, fault, profile), group in groups.items():
        true_died = [any(a.startswith(f"{fault} at") for a in o.false_alarms) for o in group]
        healthy = fault == HEALTHY
        table.add_row(
            noise, fault, profile, str(len(group)), str(sum(o.samples for o in group)),
            "-" if healthy else str(sum(o.detected for o in group)),
            "-" if healthy else str(sum(o.isolated for o in group)),
            str(sum(bool(o.false_alarms) for o in group)),
            "-" if healthy else str(sum(true_died)),
            str(sum(o.wrong_isolation is not None for o in group)),
            str(sum(o.undecided for o in group)),
        )  # fmt: skip
    return table


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fault_free", description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=20, help="fault-free runs of 10 s with each noise set")
    parser.add_argument("--faulty-runs", type=int, default=2, help="runs of each fault and profile, each noise set")
    parser.add_argument("--models", choices=("lpv", "nonlinear"), default="lpv", help="of the bank's observers")
    parser.add_argument("--processes", type=int, default=2)
    return parser.parse_args(arguments)


def _compile(plant: Plant) -> None:
    """Once, so that the processes find everything compiled."""
    noise = plant.noise_sets[0]
    plant.simulate(HEALTHY, HEALTHY, noise, 0)
    plant.bank(noise).warm_up()


def main(arguments: list[str] | None = None) -> None:
    """Run, count and print; without arguments a short form of the full count."""
    options = _parse([] if arguments is None else arguments)
    plant = _plant()
    _compile(plant)
    todo = jobs(plant, options.runs, options.faulty_runs, options.models)
    begun = perf_counter()
    console = Console(width=150)
    with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = pool.map(examine, todo, chunksize=4)
        outcomes = list(track(found, "runs", total=len(todo), console=console, transient=True))
    console.print(tabulate(outcomes))
    for bad in (o for o in outcomes if o.is_bad):
        console.print(
            f"seed {bad.job.seed} ({bad.job.noise}, {bad.job.fault} {bad.job.profile}): "
            f"falsified {', '.join(bad.false_alarms) or 'none'}; isolated as {bad.wrong_isolation or 'nothing wrong'}; "
            f"{bad.undecided} undecided"
        )
    print(f"{len(todo)} runs in {perf_counter() - begun:.0f} s with {options.processes} processes, seed {SEED}")


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])

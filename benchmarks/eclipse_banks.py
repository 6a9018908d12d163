"""The Eclipse's two banks on the same flights: when each detects and isolates, and whether the proven one is wrong.

Flights of every noise set, fault and profile and without a fault, from the studies' seeds; then flights with large
manoeuvres (`aircraft.eclipse.manoeuvres`), healthy and with each fault. Of the bank with the simulator's equations: at
each sample of each observer whose model holds (all of them before the fault, the fault's own after it), true states
outside its box, and alarms. Exit code 1 if there is any, or if it isolates later than the linear bank in the median, by
more than two samples or in more than two cases of 18.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track

from aircraft.eclipse.manoeuvres import manoeuvres
from aircraft.eclipse.plant import Eclipse
from benchmarks._observers import console, table
from benchmarks.nonlinear import stored
from svo.checks import Array
from svo.indices import judge_alarm
from svo.isolation import NOMINAL, Outcome
from svo.logs.log import Log
from svo.plant import HEALTHY, first_faulty_sample
from svo.plant.scheduling import scheduled
from svo.studies.configuration import StudyConfiguration
from svo.studies.statistics import Delays

SEED = 0
PLANTS = {kind: Eclipse().with_models(kind) for kind in ("lpv", "nonlinear")}  # type: ignore[arg-type]
LATER_CASES, LATER_SAMPLES = 2, 2  # isolated later than by the linear bank: so many cases, by so many samples
MANOEUVRES, MANOEUVRES_S = "manoeuvres", 20.0
Found = dict[str, Any]


class Flight(NamedTuple):
    """One flight; the profile of one with large manoeuvres is "manoeuvres", its fault a ramp of a second."""

    noise: str
    fault: str
    profile: str
    seed: int

    def log(self) -> Log:
        """With true states."""
        plant = PLANTS["nonlinear"]
        if self.profile != MANOEUVRES:
            return plant.simulate(self.fault, self.profile, self.noise, self.seed)
        fault = None if self.fault == HEALTHY else plant.scenarios.fault(self.fault, "hard")
        return manoeuvres(MANOEUVRES_S, self.noise, self.seed, fault)


def examine(flight: Flight) -> Found:
    """Delays of both banks, and what they do to what is true."""
    found: Found = flight._asdict()
    given = flight.log()
    for kind, plant in PLANTS.items():
        log, bank = scheduled(plant.scheduler(), given), plant.bank(flight.noise)
        first = first_faulty_sample(plant, flight.fault, "hard", log.time)
        boxes = {name: np.full((len(log), 2, 4), np.nan) for name in bank.names} if kind == "nonlinear" else None
        outcome, begun = Outcome(bank.names), process_time()
        for verdict, samples in bank.follow(log, boxes):
            outcome.add(verdict, samples)
        seconds = process_time() - begun
        rightly = outcome.isolated_at if outcome.fault == flight.fault else None
        delays = [judge_alarm(at, first, plant.Ts).delay for at in (outcome.detected_at, rightly)]
        found[kind] = {"delays": delays, "isolated as": outcome.fault, "seconds": seconds}
        found[kind] |= {"falsified": sum(_fell(outcome, name, _holds(name, flight, log, first)) for name in bank.names)}
        found[kind] |= {"false alarm": _fell(outcome, NOMINAL, first)}
        if boxes is not None:
            of_boxes = (_outside(box, log, _holds(name, flight, log, first)) for name, box in boxes.items())
            counts = np.sum(list(of_boxes), axis=0).tolist()
            found |= dict(zip(("samples", "true", "outside"), counts, strict=True)) | {"undecided": outcome.undecided}
    return found


def _holds(name: str, flight: Flight, log: Log, first: int) -> int:
    """The sample up to which a model holds."""
    return len(log) if name == flight.fault else first


def _fell(outcome: Outcome, name: str, holds: int) -> bool:
    died = outcome.died_at[name]
    return died is not None and died < holds


def _outside(box: Array, log: Log, holds: int) -> tuple[int, int, int]:
    """Samples of an observer, those of them while its model holds, and those with the true state outside its box."""
    assert log.x is not None
    known = ~np.isnan(box[:, 0, 0])
    outside = ~((box[:, 0] <= log.x) & (log.x <= box[:, 1])).all(axis=1)
    return int(known.sum()), int(known[:holds].sum()), int((known & outside)[:holds].sum())


def flights(runs: int, large: int) -> list[Flight]:
    """As many of each kind with each noise set: those of the studies with this seed, and those with manoeuvres."""
    plant = PLANTS["lpv"]
    jobs = StudyConfiguration.for_plant(plant, runs=max(runs, 1), seed=SEED, noise=plant.noise_sets).jobs(plant)
    every = [Flight(job.noise, job.fault, job.profile, job.seed) for job in jobs] if runs else []
    kinds = [(noise, fault) for noise in plant.noise_sets for fault in (HEALTHY, *plant.faults)]
    return every + [Flight(*kind, MANOEUVRES, seed) for kind in kinds for seed in range(large)]


def main() -> None:
    """Examine the flights that are asked for and print what was found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.eclipse_banks", description=__doc__)
    parser.add_argument("--runs", type=int, default=1, help="flights of each noise set, fault and profile")
    parser.add_argument("--manoeuvres", type=int, default=1, help="flights of each noise set and fault with manoeuvres")
    parser.add_argument("--out", type=Path, default=None, help="a file that keeps the flights, and is gone on with")
    chosen = parser.parse_args()
    found = {} if chosen.out is None else {_of(run): run for run in stored(chosen.out)}
    wanted = flights(chosen.runs, chosen.manoeuvres)
    missing = [flight for flight in wanted if flight not in found]
    for flight in track(missing, description="flights", console=console):
        found[flight] = examine(flight)
        if chosen.out is not None:
            with chosen.out.open("a", encoding="utf-8") as file:
                file.write("\n" + json.dumps(found[flight]))
    sys.exit(report([found[flight] for flight in wanted]))


def _of(run: Found) -> Flight:
    return Flight(*(run[name] for name in Flight._fields))


def report(runs: list[Found]) -> bool:
    """Print the tables; whether something is not as it should be."""
    plain, large = ([run for run in runs if (run["profile"] == MANOEUVRES) == is_large] for is_large in (False, True))
    later = list(_print_delays(plain))
    _print_manoeuvres(large)
    for case, samples in later:
        print(f"isolated later by {samples:.3g} samples in the median: {case}")
    if plain:
        print(f"median isolation later than the linear bank's: {len(later)} of {len(list(_cases(plain)))} cases")
    cost = (f"{kind} {1e3 * sum(run[kind]['seconds'] for run in runs) / len(runs):.0f} ms" for kind in PLANTS)
    print(f"CPU of a bank over a flight: {', '.join(cost)}")
    total = {what: sum(run[what] for run in runs) for what in ("samples", "true", "outside", "undecided")}
    wrong = sum(run["nonlinear"]["isolated as"] not in (None, run["fault"]) for run in runs)
    falsified = sum(run["nonlinear"]["falsified"] for run in runs)
    print(f"nonlinear bank: wrong isolations {wrong}; undecided {total['undecided']} of {total['samples']}")
    print(f"samples of models that hold: {total['true']}; outside {total['outside']}; falsified models {falsified}")
    print(f"{total['samples']} cases, {total['outside'] + falsified + wrong} failures")
    is_late = len(later) > LATER_CASES or any(samples > LATER_SAMPLES for _, samples in later)
    return bool(total["outside"] or falsified or wrong or is_late)


def _cases(runs: Iterable[Found]) -> Iterator[tuple[tuple[str, str, str], list[Found]]]:
    """Faulty flights by noise set, fault and profile."""
    faulty = (run for run in runs if run["fault"] != HEALTHY)
    for case, group in groupby(faulty, key=lambda run: (run["noise"], run["fault"], run["profile"])):
        yield case, list(group)


def _print_delays(runs: list[Found]) -> Iterator[tuple[str, float]]:
    """Print medians, and give the cases that the nonlinear bank isolates later, with the samples by which."""
    rows = []
    for case, group in _cases(runs):
        medians = [_median([run[kind]["delays"][event] for run in group]) for event in (0, 1) for kind in PLANTS]
        rows.append([*case, len(group), *(f"{m:.3g}" for m in medians)])
        if medians[3] > medians[2]:
            yield " ".join(case), (medians[3] - medians[2]) / PLANTS["lpv"].Ts
    if not rows:
        return
    events = [f"{event} (s), {kind}" for event in ("detect", "isolate") for kind in PLANTS]
    table("Medians of the Eclipse's two banks", ["noise", "fault", "profile", "flights", *events], rows)


def _median(delays: list[float | None]) -> float:
    median = Delays.of(delays).median
    return np.inf if median is None else median


def _print_manoeuvres(runs: list[Found]) -> None:
    """Print in how many flights with manoeuvres a bank alarms before the fault, and falsifies a model that holds."""
    rows = []
    for case, group in groupby(runs, key=lambda run: (run["noise"], run["fault"])):
        flown = list(group)
        fell = [sum(run[kind][what] > 0 for run in flown) for kind in PLANTS for what in ("false alarm", "falsified")]
        rows.append([*case, len(flown), *fell, sum(run["outside"] for run in flown)])
    counted = [f"{what}, {kind}" for kind in PLANTS for what in ("false alarm", "falsified while it holds")]
    columns = ["noise", "fault", "flights", *counted, "samples outside, nonlinear"]
    if rows:
        table("Flights with large manoeuvres", columns, rows)


if __name__ == "__main__":
    main()

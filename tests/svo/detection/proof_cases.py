"""Proofs as files, and the checker that is not of ours, run as a stranger would."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo import ArchitectureI, ScheduleTable, UncertainModel, Uncertainty, WindowObserver, verify
from svo.detection.bank_alarms import alarms_of
from svo.detection.plant_record import plant_record
from svo.isolation.alarms import write_alarms
from svo.logs.csv import write_csv
from svo.logs.log import Log
from svo.logs.names import Column, Columns
from tests.svo.detection.checkers import CHECK, FOLDER

Files = tuple[Path, Path, Path]  # proof, plant and log


class Made:
    """As much of a plant as proofs ask for: one model, whatever it is."""

    name, noise_sets = "made", ("stated",)
    title = "made for a test"
    kind: Any = WindowObserver

    def __init__(self, model: UncertainModel, schedule: Any = None, horizon: int = 5, **options: Any) -> None:
        self.model, self.Ts, self._schedule = model, model.Ts, schedule
        self._horizon, self._options = horizon, options
        names = (("u", model.n_inputs), ("y", model.n_outputs))
        self.columns = Columns(*(tuple(Column(f"{name}{i}", "") for i in range(size)) for name, size in names))

    def scheduler(self) -> Any:
        values = iter([] if self._schedule is None else self._schedule.tolist())
        return lambda *_: next(values, None)

    def bank(self, noise: str) -> ArchitectureI:
        n = self.model.n_states
        start = HPolytope.box(-np.ones(n), np.ones(n))
        if self.kind is WindowObserver:
            return ArchitectureI(WindowObserver(self.model, start, horizon=self._horizon, **self._options), {})
        return ArchitectureI(self.kind(self.model, start), {})


def random_plant(seed: int) -> tuple[Made, Log]:
    """A plant with uncertainties, or rows on w, or a schedule, and a log whose sensors jump."""
    rng = np.random.default_rng(seed)
    n, nw = int(rng.integers(1, 4)), int(rng.integers(1, 3))
    A = rng.normal(size=(n, n))
    A *= 0.9 / max(np.abs(np.linalg.eigvals(A)).max(), 0.1)
    options: dict[str, Any] = {"E": rng.normal(size=(n, nw)), "w": np.full(nw, 0.1), "n": np.full(2, 0.2), "Ts": 0.5}
    if seed % 3 == 0:
        directions = [0.05 * np.outer(rng.normal(size=n), rng.normal(size=n)) for _ in range(2)]
        options["uncertainties"] = [Uncertainty(A=directions[0]), Uncertainty(A=directions[1], bounds=(0.0, 1.0))]
    if seed % 4 == 1:
        options["uncertainties"] = [Uncertainty(A=0.02 * rng.normal(size=(n, n)))]  # full rank: factors leave something
    if seed % 4 == 2:
        rows = np.vstack([np.eye(nw), -np.eye(nw), np.ones((1, nw))])
        options["w"] = HPolytope(rows, np.append(np.full(2 * nw, 0.1), 0.12))
    if seed % 5 == 0:
        options["physical"] = (np.full(n, -30.0), np.full(n, 30.0))
    schedule = None
    if seed % 2:
        points = np.linspace(0.0, 1.0, 5)
        schedule = rng.uniform(-0.1, 1.1, 60)
        A = ScheduleTable(points, A + 0.01 * rng.normal(size=(5, n, n)))
        options["schedule"] = 0.5
    model = UncertainModel(A, rng.normal(size=(n, 1)), rng.normal(size=(2, n)), **options)
    log = model.simulate(np.zeros(n), rng.normal(size=(60, 1)), rng, schedule=schedule)
    log.y[rng.integers(60, size=6), 0] = np.nan
    log.y[int(rng.integers(20, 40)) :] += 4.0
    plant = Made(model, schedule, template=np.ones((1, n)) if seed % 2 else "box")
    return plant, log


def tiny() -> tuple[Made, Log, int]:
    """A plant of one state and a short proof, its log, and the sample up to which that is healthy."""
    model = UncertainModel(
        [[0.8]], [[1.0]], [[1.0]], E=[[1.0]], w=[0.1], n=[0.2], Ts=0.5, uncertainties=[Uncertainty(A=[[0.1]])]
    )
    log = model.simulate([0.5], np.ones((12, 1)), np.random.default_rng(1))
    log.y[7:] += 3.0
    return Made(model, horizon=2), log, 6


def proven(plant: Any, log: Log, folder: Path, noise: str = "stated") -> Files | None:
    """Proof, model and log of a run's alarms as files; None where nothing was falsified."""
    bank, values = plant.bank(noise), plant.scheduler()
    schedule = [values(y, u) for y, u in zip(log.y, log.u, strict=True)]
    run = log if schedule[0] is None else Log(log.time, log.u, log.y, schedule=np.array(schedule))
    alarms = alarms_of(bank.run(run), run, {"plant": plant.name, "noise": noise}, bank.observers)
    if not alarms:
        return None
    write_alarms(folder / "alarms.jsonl", alarms)
    files = folder / "proof.jsonl.gz", folder / "plant.json", folder / "log.csv"
    found = verify(folder / "alarms.jsonl", Log(log.time, log.u, log.y), full=True, plant=plant, write_proof=files[0])
    assert found.ok, found
    files[1].write_text(json.dumps(plant_record(plant, noise, Log(log.time, log.u, log.y))))
    cells = {"time_s": log.time}
    for group, array in ((plant.columns.inputs, log.u), (plant.columns.outputs, log.y)):
        cells |= {c.name: column for c, column in zip(group, array.T, strict=True)}
    write_csv(files[2], cells)
    return files


def answer(proof: Path, plant: Path, log: Path) -> tuple[int, str]:
    """Exit code of the checker and what it says, in a process without this project on its path."""
    command = [sys.executable, "-I", str(FOLDER / "svo_check.py"), str(proof), "--model", str(plant), "--log", str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout + done.stderr


def claims(files: Files) -> list[tuple[str, int, list[str]]]:
    """What the checker takes as proven, and given what; none if it refuses."""
    plant = json.loads(files[1].read_text())
    try:
        found = CHECK.check(files[0], plant, CHECK.Log(files[2], plant["columns"]))
    except CHECK.REFUSALS:
        return []
    return [(observer, sample, chain.premises) for observer, sample, chain in found]


def steps_of(proof: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in gzip.decompress(proof.read_bytes()).splitlines()]


def with_steps(proof: Path, steps: Sequence[Any]) -> Path:
    path = proof.with_name("changed.jsonl.gz")
    path.write_bytes(gzip.compress("".join(json.dumps(step) + "\n" for step in steps).encode()))
    return path

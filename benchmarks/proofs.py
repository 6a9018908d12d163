"""Whole proofs of alarms: what ``svo verify --full`` and the independent checker take, and how many they prove.

Run with ``python -m benchmarks.proofs --study elevator --flights 10 --out proofs.jsonl``. Flight k has seed k, and the
faults of the plant in turn; each is written to the file when it is done, and the same command goes on after the last.
``--study random`` is a campaign of random plants through each kind of observer, with a drift that is found late.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from polytopes import HPolytope
from svo import (
    ConstrainedZonotopeObserver,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
    detect,
    find_plant,
    verify,
)
from svo.detection.plant_record import plant_record
from svo.logs.csv import write_csv
from svo.logs.log import Log
from svo.observers.base import Observer
from svo.observers.window.chain import prover_of
from svo.observers.window.chain_starts import own_start
from svo.plant.description.simulated import simulated_plant

CHECKER = Path(__file__).parents[1] / "checker" / "svo_check.py"
TANKS = str(Path(__file__).parents[1] / "docs" / "examples" / "two_tanks.toml")
STUDIES = {  # the plant, its models, and a noise set
    "eclipse": ("eclipse", "lpv", "quiet"),
    "eclipse-nonlinear": ("eclipse", "nonlinear", "quiet"),
    "elevator": ("elevator", None, "quiet"),
    "missile": ("missile", None, "bounded"),
    "tanks": (TANKS, None, "stated"),
}
KINDS = {"window": WindowObserver, "zonotope": ConstrainedZonotopeObserver, "polytope": PolytopeObserver}
SAMPLES, FAULT = 80, 40  # of a random plant's run, and the sample from which its first sensor drifts


def flight(study: str, seed: int) -> dict[str, Any]:
    """A flight, its alarms proven and checked."""
    name, models, noise = STUDIES[study]
    plant = find_plant(name, models=models)
    simulated: Any = simulated_plant(name) if name == TANKS else plant
    cases = [(fault, profile) for fault, profiles in simulated.faults.items() for profile in profiles]
    fault, profile = cases[seed % len(cases)]
    log, begun = replace(simulated.simulate(fault, profile, noise, seed), x=None), process_time()
    found = detect(plant, log, noise)
    row = {"fault": fault, "profile": profile, "alarms": len(found.alarms), "run_s": process_time() - begun}
    return row | (_proven(plant, noise, log, found) if found.alarms else {})


def _proven(plant: Any, noise: str, log: Log, found: Any) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        proof, model, readings = folder / "proof.jsonl.gz", folder / "plant.json", folder / "log.csv"
        begun = process_time()
        proven = verify(found, full=True, write_proof=proof)
        full = process_time() - begun
        model.write_text(json.dumps(plant_record(plant, noise, log)))
        write_csv(readings, log.to_columns(replace(plant.columns, states=())))
        command = [sys.executable, "-I", str(CHECKER), str(proof), "--model", str(model), "--log", str(readings)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        answer = subprocess.run(command, capture_output=True, text=True, check=False).stdout
        checker = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        return {
            "full": proven.proven, "checked": answer.count("PROVEN: '") if "NOT PROVEN" not in answer else 0,
            "full_s": full, "checker_s": checker, "bytes": proof.stat().st_size,
            "reasons": [check.reason for check in proven.checks if not check.ok],
        }  # fmt: skip


def random_run(seed: int) -> dict[str, Any]:
    """A run of a random plant through each kind of observer, and where the proofs of their alarms begin."""
    rng = np.random.default_rng(seed)
    model, x0 = _random_plant(rng)
    log = model.simulate(x0, rng.normal(size=(SAMPLES, 1)), rng)
    y = log.y.copy()
    y[FAULT:, 0] += rng.uniform(0.02, 0.3) * np.arange(SAMPLES - FAULT)
    y[rng.random(y.shape) < 0.05] = np.nan
    bad, start = Log(log.time, log.u, y), HPolytope.box(x0 - 1.0, x0 + 1.0)
    row: dict[str, Any] = {}
    for name, kind in KINDS.items():
        observer: Observer = kind(model, start)
        first = observer.first_set
        assert first is not None
        at = observer.run(bad).falsified_at
        if at is not None:
            begun = process_time()
            found = prover_of(observer, first, bad, 0, own_start(None, first)).prove(at)
            row[name] = {"start": None if found is None else found.start.kind, "s": process_time() - begun}
            row[name]["before"] = None if found is None else at - found.start.sample
    return row


def _random_plant(rng: np.random.Generator) -> tuple[UncertainModel, Any]:
    """Of one or two states and outputs, and up to two uncertainties of any rank, with s of both signs."""
    n, nw, ny = int(rng.integers(1, 3)), int(rng.integers(1, 3)), int(rng.integers(1, 3))
    A = rng.normal(size=(n, n))
    A *= rng.choice([0.7, 0.9, 0.98]) / max(np.abs(np.linalg.eigvals(A)).max(), 0.1)
    items = [Uncertainty(A=0.1 * rng.normal(size=(n, n)), bounds=(-0.5, 0.5)) for _ in range(int(rng.integers(0, 3)))]
    model = UncertainModel(
        A, rng.normal(size=(n, 1)), rng.normal(size=(ny, n)), E=rng.normal(size=(n, nw)), w=np.full(nw, 0.1),
        n=np.full(ny, 0.2), uncertainties=items,
    )  # fmt: skip
    return model, rng.uniform(-1.0, 1.0, n)


def main() -> None:
    """Go on with a file of flights until it has as many as were asked for, and print what it says."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proofs", description=__doc__)
    parser.add_argument("--study", choices=(*STUDIES, "random"), default="eclipse")
    parser.add_argument("--flights", type=int, default=2)
    parser.add_argument("--out", type=Path, help="File to write, and to go on with.")
    given = parser.parse_args()
    rows = _read(given.out, given.study) if given.out is not None and given.out.exists() else []
    for seed in range(len(rows), given.flights):
        row = random_run(seed) if given.study == "random" else flight(given.study, seed)
        rows.append({"study": given.study, "seed": seed, **row})
        if given.out is not None:
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    (_show_random if given.study == "random" else _show)(rows[: given.flights])


def _read(path: Path, study: str) -> list[dict[str, Any]]:
    """The flights of a file; a line without its end was cut off, and its flight is done again."""
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    path.write_text(whole, encoding="utf-8")
    rows = [json.loads(line) for line in whole.splitlines()]
    if any(row["study"] != study for row in rows):
        raise SystemExit(f"{path} is of another study; give another file")
    return rows


def _show(rows: list[dict[str, Any]]) -> None:
    table = Table(
        "", "a flight", "at most", title=f"{rows[0]['study']}: {len(rows)} flights, seeds 0 to {len(rows) - 1}"
    )
    found = [row for row in rows if row["alarms"]]
    alarms, full, checked = (sum(row[name] for row in found) for name in ("alarms", "full", "checked"))
    for name, unit in (
        ("run_s", "run of the bank, CPU s"),
        ("full_s", "--full, CPU s"),
        ("checker_s", "checker, CPU s"),
    ):
        values = [row[name] for row in found]
        table.add_row(unit, f"{np.mean(values):.2f}", f"{max(values):.2f}")
    values = [row["bytes"] for row in found]
    table.add_row("proof, bytes", f"{np.mean(values):.0f}", f"{max(values)}")
    Console().print(table)
    print(f"alarms {alarms}, proven by --full {full}, by the checker {checked}")
    for row in found:
        for reason in row["reasons"]:
            print(f"seed {row['seed']}, {row['fault']} {row['profile']}: {reason}")


def _show_random(rows: list[dict[str, Any]]) -> None:
    table = Table("observer", "alarms", "proven", "from readings", "samples back, at most", "CPU s an alarm", "at most")
    for name in KINDS:
        found = [row[name] for row in rows if name in row]
        proven = [row for row in found if row["start"]]
        free, back = (
            sum(row["start"] == "readings" for row in proven),
            max((row["before"] for row in proven), default=0),
        )
        seconds = [row["s"] for row in found] or [0.0]
        counts = (len(found), len(proven), free, back)
        table.add_row(name, *map(str, counts), f"{np.mean(seconds):.2f}", f"{max(seconds):.2f}")
        missing = [row["seed"] for row in rows if name in row and not row[name]["start"]]
        if missing:
            print(f"{name}: not proven, seeds {missing}")
    Console().print(table)


if __name__ == "__main__":
    main()

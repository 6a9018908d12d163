"""What the project itself wrote, after somebody was at it: alarms, saved states, study folders."""

from __future__ import annotations

import hashlib
import io
import json
import shutil
import tempfile
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from svo.detection.chains import PlantModels
from svo.detection.detect import detect
from svo.isolation.alarms import Alarm, read_alarms, verify_alarms, write_alarms
from svo.isolation.bank import Bank
from svo.logs.drive import drive
from svo.logs.file import read_log
from svo.logs.log import Log
from svo.plant.description import read_description
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.runner import run_study
from svo.studies.isolation.store import StudyFolder
from tests.fuzz.bytes_of import damaged
from tests.fuzz.files import CART
from tests.fuzz.outcome import WrongError
from tests.svo.studies.isolation.registered.tank_plant import Tank

NUMBERS = [0, -1, 1.5, 10**30, 10**4000, True, None, "", "0", "0x1p+0", "nan", "inf", [], {}, "9" * 4000]


# -- alarms ----------------------------------------------------------------------------------------------------------


@cache
def _cart() -> tuple[Any, Log, tuple[Alarm, ...], list[str]]:
    plant = read_description(CART)
    log = read_log(CART.with_suffix(".csv"), plant.columns, plant.Ts)
    found = detect(plant, log, "stated").alarms
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "alarms.jsonl"
        write_alarms(path, found)
        return plant, log, found, path.read_text(encoding="utf-8").splitlines()


def alarms(rng: np.random.Generator, folder: Path) -> None:
    """A record with some entries changed and, as a forger would, with a new digest: what is proven must be true."""
    plant, log, right, lines = _cart()
    number = int(rng.integers(len(lines)))
    path = folder / "alarms.jsonl"
    if rng.random() < 0.2:
        path.write_bytes(damaged(lines[number].encode(), rng) + b"\n")
    else:
        record = json.loads(lines[number])
        for _ in range(int(rng.integers(1, 4))):
            _forge(record, rng)
        content = {key: value for key, value in record.items() if key != "sha256"}
        digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        path.write_text(json.dumps(content | {"sha256": digest}) + "\n", encoding="utf-8")
    for check in verify_alarms(path, log, PlantModels(plant, log).difference):
        if check.ok:
            (claim,) = read_alarms(path)
            _must_be_true(claim, right)


def _must_be_true(claim: Alarm, right: tuple[Alarm, ...]) -> None:
    """Its plant, model and data are those of the true alarm of that observer at that sample."""
    true = [a for a in right if (a.observer, a.sample, a.time) == (claim.observer, claim.sample, claim.time)]
    if not true:
        raise WrongError(f"proven: {claim.observer} at sample {claim.sample}, which never fell there")
    mine, its = claim.certificate.samples, true[0].certificate.samples
    own, right_one = claim.certificate, true[0].certificate
    if not (np.array_equal(own.delta, right_one.delta) and np.array_equal(own.w_rows, right_one.w_rows)):  # type: ignore[attr-defined]
        raise WrongError("proven with other bounds of the unknowns")
    if own.sums is not None or claim.premises:  # type: ignore[attr-defined]
        raise WrongError("proven with bounds or promises that the plant does not have")
    for s, t in zip(reversed(mine), reversed(its), strict=False):
        read = ~np.isnan(s.y)
        if not (np.array_equal(s.stack, t.stack) and np.array_equal(s.y[read], t.y[read])):
            raise WrongError("proven with another model or other data")
        if (s.w_lower > t.w_lower).any() or (s.w_upper < t.w_upper).any():
            raise WrongError("proven with less disturbance than the plant's")
        if (s.noise < t.noise).any() or (s.slack < 0).any():
            raise WrongError("proven with less noise than the plant's")


def _forge(record: Any, rng: np.random.Generator) -> None:
    """Change one entry somewhere in a record."""
    parent, key = record, "sha256"
    while True:
        keys = list(range(len(parent))) if isinstance(parent, list) else list(parent)
        if not keys:
            return
        key = keys[int(rng.integers(len(keys)))]
        if not isinstance(parent[key], dict | list) or rng.random() < 0.1:
            break
        parent = parent[key]
    value = parent[key]
    if isinstance(value, str) and " " in value and rng.random() < 0.8:
        words = value.split(" ")
        at = int(rng.integers(len(words)))
        words[at] = str(rng.choice(["0", "nan", "0x1.8p+4", "-0x1.0p-3", words[int(rng.integers(len(words)))], "x"]))
        parent[key] = " ".join(words)
    elif isinstance(parent, dict) and rng.random() < 0.2:
        del parent[key]
    else:
        parent[key] = NUMBERS[int(rng.integers(len(NUMBERS)))]


# -- saved states ----------------------------------------------------------------------------------------------------


@cache
def _bank_state() -> tuple[Log, int, dict[str, Any], list[Any]]:
    """The cart's log, a sample, the bank's state there, and what the bank says of the next samples."""
    plant, log, _, _ = _cart()
    bank, cut = plant.bank("stated"), 25
    _drive(bank, log, 0, cut)
    return log, cut, bank.state_dict(), _drive(bank, log, cut, cut + 3)


def _drive(bank: Bank, log: Log, start: int, stop: int) -> list[Any]:
    verdicts = islice(drive(bank, log, start=start), stop - start)
    return [(v.sample, v.state, v.alive, [v.steps[name].box[0].tobytes() for name in v.alive]) for v in verdicts]


def state(rng: np.random.Generator, folder: Path) -> None:
    """A saved state that was changed is refused, or the bank goes on as it would have."""
    log, cut, right, next_ones = _bank_state()
    changed: dict[str, Any] = dict(right)
    if rng.random() < 0.3:
        file = io.BytesIO()
        np.savez(file, **right)
        path = folder / "state.npz"
        path.write_bytes(damaged(file.getvalue(), rng))
        try:
            with np.load(path, allow_pickle=False) as read:
                changed = {name: read[name] for name in read.files}
        except Exception:
            return  # numpy's own refusal of its own file
    else:
        for _ in range(int(rng.integers(1, 3))):
            _change_array(changed, rng)
    bank = _cart()[0].bank("stated")
    bank.load_state_dict(changed)
    if _drive(bank, log, cut, cut + 3) != next_ones:
        raise WrongError("a changed state was taken, and the bank says something else")


def _change_array(arrays: dict[str, Any], rng: np.random.Generator) -> None:
    name = sorted(arrays)[int(rng.integers(len(arrays)))]
    value = np.array(arrays[name])
    match int(rng.integers(6)):
        case 0:
            del arrays[name]
        case 1:
            arrays[name] = value.astype(complex) if value.dtype.kind in "if" else value.astype(bytes)
        case 2:
            arrays[name] = np.zeros((1, 1)) if value.dtype.kind == "f" else value.reshape(-1)[:0]
        case 3 if value.size and value.dtype.kind == "f":
            value.flat[int(rng.integers(value.size))] = rng.choice([np.nan, np.inf, -1e300, 0.0, 1.0, -7.0])
            arrays[name] = value
        case 4 if value.size and value.dtype.kind == "i":
            value.flat[int(rng.integers(value.size))] = rng.choice([-1, 0, 1, 2**40])
            arrays[name] = value
        case _:
            arrays[name] = np.array(str(value)[:-1]) if value.dtype.kind == "U" else value + 1


# -- study folders ---------------------------------------------------------------------------------------------------


@cache
def _study() -> tuple[Path, list[Any]]:
    """A small finished study and its rows."""
    folder = Path(tempfile.mkdtemp(prefix="fuzzed-study-")) / "study"
    finished = run_study(StudyConfiguration.for_plant(Tank(), runs=1, seed=3, noise=("calm",)), folder)
    return folder, finished.rows()


def study(rng: np.random.Generator, folder: Path) -> None:
    """A study whose files were at a bad disk: its rows are right, or somebody says what is wrong."""
    original, rows = _study()
    copy = folder / "study"
    shutil.copytree(original, copy)
    files = sorted(path for path in copy.rglob("*") if path.is_file())
    for _ in range(int(rng.integers(1, 3))):
        path = files[int(rng.integers(len(files)))]
        match int(rng.integers(5)):
            case 0 | 1:
                path.write_bytes(damaged(path.read_bytes() if path.exists() else b"x", rng))
            case 2:
                path.unlink(missing_ok=True)
            case 3:
                doubled = path.parent / f"{path.stem}-copy{path.suffix}"
                doubled.write_bytes(path.read_bytes() if path.exists() else b"")
            case _:
                stray = str(rng.choice([".DS_Store", "~lock", "notes.txt", "run-x.parquet"]))
                (path.parent / stray).write_bytes(b"abc")
    found = StudyFolder(copy).rows()
    left = list(rows)
    for row in found:
        if row not in left:
            raise WrongError(f"a row that the study never wrote, or twice: {row}")
        left.remove(row)

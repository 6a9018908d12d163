"""A log read in portions has the same verdicts and alarms, to the byte; a longer one takes no more memory."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import ArchitectureI, WindowObserver, detect, find_plant
from svo.cli import app
from svo.detection.findings import Findings
from svo.detection.streamed import detect_streamed
from svo.faults import Step
from svo.isolation import Bank
from svo.isolation.alarms import alarm_line
from svo.logs.file import write_log
from svo.logs.log import Log
from svo.plant import Column, Columns, in_architecture, load_plant
from svo.plant.long_log import LongLog, survey_log
from svo.plant.scheduling import no_schedule
from tests.svo.isolation import small_plant

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"


class Pieces(LongLog):
    """A log in portions of random sizes."""

    def __init__(self, plant: Any, log: Log, rng: np.random.Generator, most: int) -> None:
        super().__init__(Path(str(log.source)), plant, len(log), 0.0, 0.0, np.zeros(0, dtype=np.int64))
        object.__setattr__(self, "cut", (log, rng, most))

    def portions(self) -> Iterator[Log]:
        log, rng, most = self.cut  # type: ignore[attr-defined]
        k = 0
        while k < len(log):
            size = int(rng.integers(1, most + 1))
            yield part(log, k, k + size)
            k += size


def part(log: Log, first: int, last: int) -> Log:
    rows = slice(first, last)
    return replace(log, time=log.time[rows], u=log.u[rows], y=log.y[rows], x=None, schedule=None)


@dataclass
class Own:
    """As much of a plant as a bank needs."""

    bank_of: Callable[[], Bank]
    columns: Columns
    Ts: float = small_plant.TS
    name: str = "small"
    noise_sets: tuple[str, ...] = ("own",)

    def bank(self, noise: str) -> Bank:
        return self.bank_of()

    def scheduler(self) -> Any:
        return no_schedule


def small(seed: int, **options: Any) -> tuple[Own, Log]:
    """A plant with a fault or without, and a log with single readings lost, all of them for a while, and glitches."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    model = small_plant.plant(rng, n)
    faults = small_plant.faults_of(rng, n, Step(1.5))
    fault = [*[None] * len(faults), *faults.values()][int(rng.integers(2 * len(faults)))]
    start = HPolytope.box(np.full(n, -1.0), np.full(n, 1.0))

    def bank() -> ArchitectureI:
        own = {
            name: WindowObserver(fault.model(model), start, horizon=5)
            for name, fault in faults.items()
            if name in ("bias", "loss")
        }
        return ArchitectureI(WindowObserver(model, start, horizon=5), own, **options)

    log = small_plant.fly(model, fault, rng.uniform(-1, 1, n), rng, samples=90)
    y = log.y.copy()
    y[rng.random(y.shape) < 0.1] = np.nan
    if rng.random() < 0.5:
        begin = int(rng.integers(5, 75))
        y[begin : begin + int(rng.integers(1, 15))] = np.nan
    if options or rng.random() < 0.3:  # banks that begin again have something to get over
        y[int(rng.integers(10, 40))] += 5.0
    columns = Columns(inputs=(Column("u", "N"),), outputs=tuple(Column(f"y{i}", "m") for i in range(n)))
    return Own(bank, columns), replace(log, y=y, source="small.csv")


def eclipse(architecture: str, fault: str, seed: int) -> tuple[Any, Log]:
    plant = load_plant("eclipse").with_models("lpv")  # type: ignore[attr-defined]
    log = plant.simulate(fault, "none" if fault == "none" else "step", "quiet", seed)
    y = log.y[:700].copy()
    y[560:565] = np.nan
    return in_architecture(plant, architecture), replace(part(log, 0, 700), y=y, source="flight.csv")


CASES: list[tuple[str, Callable[[], tuple[Any, Log]]]] = [
    *((f"small {seed}", lambda seed=seed: small(seed)) for seed in range(8)),
    *((f"recovery {seed}", lambda seed=seed: small(seed, recovery=6)) for seed in range(3)),
    *((f"timeout {seed}", lambda seed=seed: small(seed, timeout=10)) for seed in range(2)),
    *((f"eclipse {a} {f}", lambda a=a, f=f: eclipse(a, f, 3)) for a in ("I", "II") for f in ("elevator", "none")),
]  # type: ignore[misc]


@cache
def told(name: str) -> Findings:
    """What a case is when its log is one portion."""
    return detect(*dict(CASES)[name]())


def said(found: Findings) -> tuple[str, str, list[str]]:
    return json.dumps(found.to_dict()), str(found), [alarm_line(alarm) for alarm in found.alarms]


@pytest.mark.parametrize(("name", "make"), CASES, ids=[name for name, _ in CASES])
def test_portions_of_any_size_give_the_alarms_and_verdicts_of_the_whole(
    name: str, make: Callable[[], tuple[Any, Log]]
) -> None:
    plant, log = make()
    whole = said(told(name))
    rng = np.random.default_rng(1)
    for most in (1, 30, 400):
        if most == 1 and name.startswith("eclipse"):
            continue  # a sample at a time takes a while there
        assert said(detect_streamed(plant, Pieces(plant, log, rng, most))) == whole


def test_the_cases_have_alarms_isolations_and_banks_that_begin_again() -> None:
    found = [told(name) for name, _ in CASES if not name.startswith("eclipse")]
    assert sum(bool(f.alarms) for f in found) > 5
    assert any(f.isolated_s is not None for f in found)
    assert any(not f.alarms for f in found)
    assert any(len(f.changes) > 3 for f in found)


def test_a_scheduler_is_asked_once_for_each_sample_in_order() -> None:
    asked: list[float] = []

    class Scheduled(Own):
        def scheduler(self) -> Any:
            return lambda y: asked.append(float(y[0]))

    plant, log = small(0)
    log = replace(log, y=np.arange(float(log.y.size)).reshape(log.y.shape))
    own = Scheduled(plant.bank_of, plant.columns)
    detect_streamed(own, Pieces(own, log, np.random.default_rng(0), 7))
    assert asked == log.y[:, 0].tolist()


# -- files -----------------------------------------------------------------------------------------------


def cart_log(samples: int, broken_from: int | None = None) -> Log:
    """The cart under a slow wave of its input; with a sensor that is wrong from a sample on."""
    rng = np.random.default_rng(0)
    x, u, y = np.zeros(2), np.zeros((samples, 1)), np.zeros((samples, 1))
    noise, push = rng.uniform(-0.05, 0.05, samples), rng.uniform(-0.2, 0.2, samples)
    for k in range(samples):
        u[k] = np.sin(0.01 * k) - x[0] - 1.5 * x[1]
        y[k] = x[0] + noise[k] + (0.0 if broken_from is None or k < broken_from else 0.4)
        x = np.array([x[0] + 0.1 * x[1], x[1] + 0.1 * (u[k, 0] + push[k])])
    return Log(np.arange(samples) * 0.1, u, y, source="log.csv")


def svo(*arguments: str | Path) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_log_of_many_portions_is_told_as_one(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("pyarrow", reason="needs pyarrow, which reads long CSV files quickly and Parquet")
    plant, log = find_plant(CART), cart_log(40_000, broken_from=36_000)
    write_log(path := tmp_path / f"log{suffix}", log, plant.columns)
    result = svo("detect", CART, path, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    whole = detect(plant, replace(log, source=path.name))
    assert whole.alarms
    assert json.loads(result.stdout) == whole.to_dict()
    assert (tmp_path / "out" / "alarms.jsonl").read_text() == "".join(map(alarm_line, whole.alarms))
    assert svo("verify", tmp_path / "out" / "alarms.jsonl", "--log", path).exit_code == 0


def test_a_bad_cell_behind_an_alarm_is_told_before_anything_is_written(tmp_path: Path) -> None:
    """All of a log is checked first: no run over a million samples ends on a cell of its last row."""
    plant, log = find_plant(CART), cart_log(30_000, broken_from=100)
    write_log(path := tmp_path / "log.csv", log, plant.columns)
    lines = path.read_text().splitlines(keepends=True)
    lines[29_000] = lines[29_000].replace("\n", "x\n")
    path.write_text("".join(lines))
    result = svo("detect", CART, path, "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert f"error: {path}, line 29001, column 'position'" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_note_on_a_log_is_told_once(tmp_path: Path) -> None:
    plant = find_plant(CART)
    write_log(path := tmp_path / "log.csv", cart_log(50), plant.columns)
    path.write_text(path.read_text() + "5.0,0")
    assert svo("detect", CART, path).stderr.count("the last line (52) has no end") == 1


@pytest.mark.parametrize("change", ["longer", "another", "gone"])
def test_a_file_that_changes_while_it_is_read_is_an_error(tmp_path: Path, change: str) -> None:
    plant = find_plant(CART)
    write_log(path := tmp_path / "log.csv", cart_log(50), plant.columns)
    log = survey_log(path, plant)
    assert (log.samples, log.begin_s, log.end_s, log.missing.tolist()) == (50, 0.0, 49 * 0.1, [0])
    text = path.read_text()
    if change == "gone":
        path.unlink()
        with pytest.raises(FileNotFoundError):
            detect_streamed(plant, log)
        return
    path.write_text(text + "5.0,0,0\n" if change == "longer" else text.replace("0.1,", "0.1,1"))
    with pytest.raises(ValueError, match=r"log\.csv was changed while it was read; svo watch follows a log"):
        detect_streamed(plant, log)


def test_a_log_that_grows_meanwhile_is_an_error_too(tmp_path: Path) -> None:
    plant = find_plant(CART)
    write_log(path := tmp_path / "log.csv", cart_log(50), plant.columns)
    portions = survey_log(path, plant).portions()
    next(portions)
    path.write_text(path.read_text() + "5.0,0,0\n")
    with pytest.raises(ValueError, match="was changed while it was read"):
        list(portions)


PEAK = """
import re, sys
from pathlib import Path
from svo import UncertainModel, WindowObserver, ArchitectureI
from svo.detection.streamed import detect_streamed
from svo.plant import Column, Columns
from svo.plant.long_log import survey_log
from svo.plant.scheduling import no_schedule
from polytopes import HPolytope

class Plant:
    name, Ts, noise_sets = "lag", 0.1, ("own",)
    columns = Columns(inputs=(Column("u", ""),), outputs=(Column("y", ""),))
    def bank(self, noise):
        model = UncertainModel([[0.5]], [[1.0]], [[1.0]], n=[1.0], Ts=0.1)
        return ArchitectureI(WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=2), {})
    def scheduler(self):
        return no_schedule

found = detect_streamed(Plant(), survey_log(sys.argv[1], Plant()))
assert found.state == "nominal" and "pandas" not in sys.modules
# Of this program alone: ru_maxrss would begin with that of the process that started it.
print(found.samples, int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024)
"""


def test_memory_does_not_grow_with_the_log(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="needs pyarrow, which reads long CSV files quickly")
    if not Path("/proc/self/status").exists():
        pytest.skip("needs /proc, which tells the peak of a process")
    peaks = []
    for samples in (60_000, 400_000):
        path = tmp_path / f"log_{samples}.csv"
        rows = "".join(f"{k * 0.1!r},0.25,{0.5 + 0.01 * (k % 7)!r}\n" for k in range(samples))
        path.write_text("time_s,u,y\n" + rows)
        ran = subprocess.run([sys.executable, "-c", PEAK, path], capture_output=True, text=True, check=True)
        counted, peak = ran.stdout.split()
        assert int(counted) == samples
        peaks.append(float(peak))
    assert peaks[1] < peaks[0] + 8.0  # MiB; 13 of floats alone would have come with these samples, were they kept

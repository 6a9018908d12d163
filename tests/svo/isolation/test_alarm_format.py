"""svo-alarm-3: what a record holds, what it proves, and what is refused before any arithmetic."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
import zlib
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pytest
from stored_alarms import same, with_digest

from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, WindowObserver, verify
from svo.detection.bank_alarms import alarms_of
from svo.isolation.alarm_record import Alarm
from svo.isolation.alarms import alarm_line, read_alarms, verify_alarms, write_alarms
from svo.models import ScheduleTable
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet, SumRows, WindowSample
from svo.store.packed_lines import lines_of, members_of, packed

Scheduled = tuple[Any, Any, tuple[Alarm, ...]]
DATA = Path(__file__).parent / "data"
CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"


# -- sums and remainders, by hand -------------------------------------------------------------------------------------


def still(
    readings: list[float],
    multipliers: SumRows | None = None,
    remainder: float = 0.0,
    w: float = 0.0,
    start: float = 0.0,
) -> WindowCertificate:
    """x(k+1) = x(k) + w, |w| <= 1 if there is any, y = x + v, |v| <= 1, from x = start; multipliers of sums alone."""
    nw, empty = int(w > 0), np.zeros(0)
    stack = np.array([[[1.0, 0.0] + [1.0] * nw, [1.0, 0.0] + [0.0] * nw]])
    sample = WindowSample(
        stack=stack, u=empty, y=empty, noise=np.ones(1), slack=np.zeros(1), w_lower=-np.full(nw, w),
        w_upper=np.full(nw, w), s_lower=empty, s_upper=empty, lines=np.zeros((0, 4)), on_output=np.zeros(1),
        on_w=empty, on_channel=np.zeros((0, 2)), gain=np.zeros((0, 2)), functional=np.zeros((0, 2 + nw)),
        remainder=np.array([remainder]),
    )  # fmt: skip
    return WindowCertificate(
        first=0, last=len(readings) - 1, n=1, late=False, delta=np.zeros((0, 2)), owner=np.zeros(0, dtype=np.int64),
        w_rows=np.zeros((0, nw)), w_rows_lower=empty, w_rows_upper=empty, on_arrival=empty,
        arrival=ArrivalSet.box(np.array([start]), np.array([start])), sums=multipliers,
        samples=tuple(replace(sample, y=np.array([y])) for y in readings),
    )  # fmt: skip


def one_sum(column: int, first: int, last: int, bound: float, m: float, lower: float | None = None) -> SumRows:
    ends = [np.array([k], dtype=np.int64) for k in (column, first, last)]
    return SumRows(*ends, np.array([-bound if lower is None else lower]), np.array([bound]), np.array([m]))


@pytest.mark.parametrize(
    ("readings", "bound", "remainder", "proven"),
    [
        ([0.9] * 4, 1.0, 0.0, True),  # 3.6 > 1, though each reading is within its own noise
        ([0.9] * 4, 3.6, 0.0, False),
        ([0.9] * 4, 3.599, 0.0, True),
        ([0.9, np.nan, 0.9, 0.9], 1.0, 0.0, True),  # 2.7 > 1 + 1: a missing one is taken away with its noise
        ([0.9, np.nan, np.nan, 0.9], 1.0, 0.0, False),
        ([0.9] * 4, 1.0, 0.64, True),  # 3.6 > 1 + 4 * 0.64: remainders do not average out
        ([0.9] * 4, 1.0, 0.66, False),
        ([-0.9] * 4, 1.0, 0.64, True),
    ],
)
def test_a_sum_of_readings_proves_what_no_single_one_does(
    readings: list[float], bound: float, remainder: float, proven: bool
) -> None:
    m = -1.0 if np.nansum(readings) > 0 else 1.0  # the output is too small for the readings' lower bound
    alarm = still(readings, one_sum(0, 0, 3, bound, m), remainder)
    assert alarm.verify() is proven
    assert not replace(alarm, sums=None).verify()
    (back,) = through_a_file(alarm)
    assert same(back.certificate, alarm)
    assert back.certificate.verify() is proven


@pytest.mark.parametrize(("bound", "proven"), [(1.0, True), (1.99, True), (2.01, False)])
def test_a_sum_of_disturbances_proves_what_their_box_does_not(bound: float, proven: bool) -> None:
    # three steps of at most 1 reach 3; their sum is at most `bound`; the reading 3 says at least 2
    moved = still([np.nan, np.nan, np.nan, 3.0], one_sum(1, 0, 2, bound, 1.0), w=1.0)
    read = replace(moved.samples[-1], on_output=np.array([-1.0]))
    moved = replace(moved, samples=(*moved.samples[:-1], read))
    assert moved.verify() is proven
    assert not replace(moved, sums=None).verify()
    late = replace(moved, sums=replace(moved.sums, last=np.array([3])))  # type: ignore[type-var]
    assert not late.verify()  # w of the last sample takes no part


@pytest.mark.parametrize(
    "changes",
    [
        {"column": np.array([2])}, {"column": np.array([-1])}, {"first": np.array([-1])}, {"last": np.array([4])},
        {"first": np.array([3]), "last": np.array([2])}, {"lower": np.array([2.0])}, {"upper": np.array([np.nan])},
        {"on_sum": np.array([np.nan])}, {"on_sum": np.zeros(0)}, {"column": np.array([0.0])},
    ],
)  # fmt: skip
def test_sums_that_are_none_prove_nothing(changes: dict[str, Any]) -> None:
    alarm = still([0.9] * 4, one_sum(0, 0, 3, 1.0, -1.0))
    assert alarm.verify()
    assert not replace(alarm, sums=replace(alarm.sums, **changes)).verify()  # type: ignore[type-var]


def test_a_negative_remainder_proves_nothing() -> None:
    assert not still([0.9] * 4, one_sum(0, 0, 3, 1.0, -1.0), remainder=-0.1).verify()


def test_a_sum_of_noise_has_a_lower_and_an_upper_end() -> None:
    # v = y - x: readings of 0.9 about zero are noise of sum 3.6, which its upper end alone excludes
    for lower, upper, proven in ((-9.0, 1.0, True), (-1.0, 9.0, False)):
        assert still([0.9] * 4, one_sum(0, 0, 3, upper, -1.0, lower)).verify() is proven
        assert still([-0.9] * 4, one_sum(0, 0, 3, -lower, 1.0, -upper)).verify() is proven


@pytest.mark.parametrize("seed", range(30))
def test_random_sums_prove_only_what_is_empty(seed: int) -> None:
    """Any multipliers: where they prove it, no noise within both kinds of bounds explains the readings."""
    rng = np.random.default_rng(seed)
    y = np.where(rng.random(5) < 0.2, np.nan, rng.uniform(-2.0, 2.0, 5))
    first, lower, upper = int(rng.integers(0, 3)), float(-rng.uniform(0.2, 2.0)), float(rng.uniform(0.2, 2.0))
    last = int(rng.integers(first + 1, 5))
    row = one_sum(0, first, last, upper, float(rng.normal()), lower)
    alarm = still(y.tolist(), row, start=float(rng.uniform(-1, 1)))
    singles = tuple(replace(s, on_output=rng.normal(0.0, 0.3, 1) * ~np.isnan(s.y)) for s in alarm.samples)
    alarm = replace(alarm, samples=singles)
    if alarm.verify():
        v = y - alarm.arrival.box_lower[0]
        inside = v[first : last + 1]
        missing = np.isnan(inside).sum()
        total = np.nansum(inside)
        assert np.nanmax(np.abs(v)) > 1.0 or total > upper + missing or total < lower - missing


# -- the record ------------------------------------------------------------------------------------------------------


def through_a_file(*proofs: WindowCertificate) -> list[Alarm]:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "alarms.jsonl.gz"
        write_alarms(path, [Alarm("model", 3, 3.0, proof, {}) for proof in proofs])
        return read_alarms(path)


@pytest.fixture(scope="module")
def scheduled() -> Scheduled:
    """A model over a table, its log and its alarm."""
    points = np.linspace(0.0, 10.0, 41)
    A = ScheduleTable(points, 0.9 + 0.01 * np.sin(points)[:, None, None])
    model = UncertainModel(A, [[1.0]], [[1.0]], E=[[1.0]], w=[0.1], n=[0.2], schedule=5.0, physical=([-50.0], [50.0]))
    log = model.simulate([0.0], np.ones((40, 1)), np.random.default_rng(0), schedule=np.linspace(0.3, 9.0, 40))
    log.y[30:] += 4.0
    bank = ArchitectureI(WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=5), {})
    return bank, log, alarms_of(bank.run(log), log, {"plant": "own", "noise": "stated"}, bank.observers)


def test_a_scheduled_model_is_stored_by_its_schedule(scheduled: Scheduled, tmp_path: Path) -> None:
    _, log, (alarm,) = scheduled
    record = json.loads(alarm_line(alarm))
    assert set(record["matrices"]) == {"points", "stacks", "schedule"}
    assert record["matrices"]["schedule"]["shape"] == [len(alarm.certificate.samples)]
    assert record["matrices"]["points"]["shape"][0] < 10  # of 41
    path = tmp_path / "alarms.jsonl"
    write_alarms(path, [alarm])
    (back,) = read_alarms(path)
    assert same(back.certificate, alarm.certificate)
    assert alarm_line(back) == alarm_line(alarm)
    assert verify_alarms(path, log)[0].ok
    assert back.premises["physical"][1] == 50.0


def test_a_scheduled_alarm_does_not_hold_with_other_schedules(scheduled: Scheduled) -> None:
    _, _, (alarm,) = scheduled
    assert alarm.scheduled is not None
    other = replace(alarm.scheduled, schedule=alarm.scheduled.schedule + 1e-3)
    record = json.loads(alarm_line(replace(alarm, scheduled=other)))
    assert set(record["matrices"]) == {"stacks"}  # not what the proof is about, so it is stored in full


def test_matrices_that_are_the_same_stand_once(tmp_path: Path) -> None:
    record = json.loads(alarm_line(Alarm("m", 3, 3.0, still([9.0] * 4), {})))
    assert record["matrices"]["stacks"]["shape"] == [1, 1, 2, 2]
    assert "noise" not in record["certificate"]["samples"][0]


def test_the_format_before_is_read_and_verified() -> None:
    path = DATA / "svo_alarm_2.jsonl"
    (check,) = verify_alarms(path)
    assert check.ok
    assert check.reason == "proven given the arrival set and that its model is the plant's"
    from svo import find_plant, read_log

    plant = find_plant(str(CART))
    assert verify(path, read_log(CART.with_suffix(".csv"), plant), plant=plant).ok
    (alarm,) = read_alarms(path)
    assert json.loads(alarm_line(alarm))["format"] == "svo-alarm-3"


def test_a_packed_file_is_members_that_are_appended(tmp_path: Path, scheduled: Scheduled) -> None:
    _, _, (alarm,) = scheduled
    path, line = tmp_path / "alarms.jsonl.gz", alarm_line(alarm).encode()
    path.write_bytes(packed(line) + packed(line + line))
    assert len(verify_alarms(path)) == 3
    assert len(verify_alarms(tmp_path / "alarms.jsonl")) == 3  # the packed one beside it
    assert gzip.decompress(path.read_bytes()) == 3 * line
    assert [content for _, content in members_of(path)] == [line, line + line]
    assert b"".join(raw for raw, _ in members_of(path)) == path.read_bytes()
    plain = tmp_path / "plain.gz"
    plain.write_bytes(line)  # bytes decide, not the name
    assert len(verify_alarms(plain)) == 1


def test_the_one_line_says_what_was_not_checked(tmp_path: Path) -> None:
    path = DATA / "svo_alarm_2.jsonl"
    text = str(verify(path))
    assert "\n" not in text
    assert "given the set at the start of each window, and that the model in each record is the plant's, in" in text


# -- what is refused -------------------------------------------------------------------------------------------------


def spoiled(alarm: Alarm, name: str, value: Any) -> str:
    record = json.loads(alarm_line(alarm))
    parent: Any = record
    *way, last = name.split(".")
    for key in way:
        parent = parent[int(key) if isinstance(parent, list) else key]
    parent[last] = value
    return with_digest(record)


DEEP = json.loads("[" * 500 + "]" * 500)
ONE = {"shape": [1], "hex": "0"}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sample", 50.7), ("sample", "50"), ("sample", 10**4000), ("time", ""), ("source", DEEP), ("model", None),
        ("premises", {"other": [ONE, ONE]}), ("premises", {"physical": [ONE]}), ("premises", 1),
        ("premises.physical", [ONE, {"shape": [1], "hex": "-0x1.0p+0"}]), ("dt", ONE), ("dt", 1), ("extra", 1),
        ("matrices", {}), ("matrices", ONE), ("matrices.points", ONE), ("matrices.schedule", ONE),
        ("matrices.schedule", {"shape": [2**40, 0], "hex": ""}), ("matrices.stacks", {"shape": [2**50, 0], "hex": ""}),
        ("matrices.more", 1), ("certificate.owner", [1.5]), ("certificate.every_sample.y", ONE),
        ("certificate.every_sample", None), ("certificate.samples", {}), ("certificate.samples.0.noise", ONE),
        ("certificate.samples.0.y.hex", "0x1p+9999"), ("certificate.samples.0.y.hex", "9" * 4000),
    ],
)  # fmt: skip
def test_records_are_read_strictly(tmp_path: Path, scheduled: Scheduled, name: str, value: Any) -> None:
    path = tmp_path / "alarms.jsonl"
    path.write_text(spoiled(scheduled[2][0], name, value))
    (check,) = verify_alarms(path)
    assert not check.ok
    assert check.reason.startswith("incomplete alarm record")
    assert len(check.reason) < 250


def bombs(alarm: Alarm) -> dict[str, bytes]:
    """Small files that would take long, or much memory, if they were taken at their word."""
    line = alarm_line(alarm)
    record = json.loads(line)
    wide = json.loads(line)
    wide["certificate"]["samples"] = [record["certificate"]["samples"][0]] * 2000
    wide["certificate"] |= {"first": 0, "last": 1999}
    huge = "0x1.fffffffffffffp+1000 0x1.fffffffffffffp-1000 0x1.fffffffffffffp+900 0"
    wide["matrices"] = {"stacks": {"shape": [1, 1, 2, 4], "hex": f"{huge} {huge}"}}
    every = wide["certificate"]["every_sample"]
    assert {"noise", "w_lower"} <= set(every)
    zeros = zlib.compressobj(1, wbits=31)
    bomb = b"".join(zeros.compress(b" " * 2**20) for _ in range(128))
    return {
        "exponents": with_digest(wide).encode(),
        "shapes": spoiled(alarm, "certificate.samples.0.y", {"shape": [2**53, 2**53], "hex": "0"}).encode(),
        "digits": spoiled(alarm, "sample", 10**4299).encode(),
        "more digits": line.replace('"sample": ', '"sample": ' + "9" * 10**6, 1).encode(),
        "nesting": b'{"format": ' + b"[" * 10**6,
        "nested tables": b'{"a":' * 10**6 + b"1" + b"}" * 10**6,
        "one long line": bomb + zeros.flush(),
        "one long line of many members": packed(b" " * 2**20) * 1000,
        "blank lines": packed(b"\n" * 2**20) * 1000,
        "empty members": packed(b"") * 10**5,
        "cut member": packed(line.encode())[:-9],
    }


def answer_of(path: Path) -> str:
    """Why the only record of a file is none, or the file none of alarms."""
    try:
        (check,) = verify_alarms(path)
    except ValueError as error:
        return str(error)
    return check.reason


def test_bombs_end_soon_with_one_error(tmp_path: Path, scheduled: Scheduled) -> None:
    alarm = scheduled[2][0]
    for name, content in bombs(alarm).items():
        path = tmp_path / "bomb.jsonl"
        path.write_bytes(content)
        begun = process_time()
        answer = answer_of(path)
        assert not answer.startswith("proven"), name
        assert len(answer) < 400, name
        assert process_time() - begun < 1.0, name  # of the processor


@pytest.mark.slow
def test_bombs_take_little_memory(tmp_path: Path, scheduled: Scheduled) -> None:
    for name, content in bombs(scheduled[2][0]).items():
        (tmp_path / "bomb.jsonl").write_bytes(content)
        program = (
            "import sys, resource; from svo.isolation.alarms import verify_alarms\n"
            "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
            "try: verify_alarms(sys.argv[1])\n"
            "except ValueError: pass\n"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
        )
        done = subprocess.run(
            [sys.executable, "-c", program, str(tmp_path / "bomb.jsonl")], capture_output=True, text=True, check=True
        )
        assert int(done.stdout) < 500_000, name  # kilobytes


def test_lines_of_a_file_are_those_that_stand_there(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    lines = [bytes(rng.integers(65, 90, int(length)).tolist()) for length in rng.integers(0, 3000, 200)]
    content = b"\n".join(lines)
    for name, stored in (("plain", content), ("packed", packed(content[:70_000]) + packed(content[70_000:]))):
        (tmp_path / name).write_bytes(stored)
        assert list(lines_of(tmp_path / name)) == (lines if lines[-1] else lines[:-1])

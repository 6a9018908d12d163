"""Stored alarms: bit for bit, with a digest, and never accepted once proof or data do not stand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stored_alarms import same, stored, with_digest

from polytopes import HPolytope
from svo.isolation.alarms import Alarm, AlarmCheck, read_alarms, verify_alarms, write_alarms
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.observer import WindowObserver


@pytest.fixture(scope="module")
def case() -> tuple[Alarm, Log]:
    """A cart with an uncertain drive whose position sensor fails, first with a gap and then with a bias."""
    model = UncertainModel(
        [[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]], E=[[0.0], [1.0]], w=[0.01], n=[0.05], Ts=0.1,
        uncertainties=[Uncertainty(B=[[0.005], [0.1]], bounds=(-0.1, 0.1)), Uncertainty(A=[[0.0, 0.0], [0.0, 0.02]])],
    )  # fmt: skip
    log = model.simulate([0.0, 0.0], np.ones((30, 1)), np.random.default_rng(0))
    y = log.y.copy()
    y[15:17] = np.nan
    y[20:] += 1.0
    log = replace(log, y=y)
    observer = WindowObserver(model, HPolytope.box([-0.0, -0.1], [0.1, 0.1]), horizon=6)
    run = observer.run(log)
    sample = run.verdicts.index("falsified")
    assert run.certificate is not None
    source = {"plant": "cart – ä", "seed": 3, "noise": 0.1}
    return Alarm("healthy cart", sample, float(log.time[sample]), run.certificate, source), log


def check(path: Path, log: Log | None = None) -> AlarmCheck:
    (only,) = verify_alarms(path, log)
    return only


def test_alarms_come_back_bit_for_bit(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    alarm, _ = case
    odd = np.array([-0.0, 5e-324, np.nextafter(1.0, 2.0), -1.7976931348623157e308])
    strange = replace(alarm, time=0.1 + 0.2, certificate=replace(alarm.certificate, on_arrival=odd))
    path = stored(tmp_path, alarm, strange)
    back = read_alarms(path)
    assert same(tuple(back), (alarm, strange))
    again = tmp_path / "again.jsonl"
    write_alarms(again, back)
    assert again.read_bytes() == path.read_bytes()


def test_an_intact_alarm_is_proven_with_and_without_its_log(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    alarm, log = case
    path = stored(tmp_path, alarm, alarm)
    for checks in (verify_alarms(path), verify_alarms(path, log)):
        assert [c.line for c in checks] == [1, 2]
        assert all(c.ok and c.observer == alarm.observer and c.sample == alarm.sample for c in checks)
    assert "arrival set" in verify_alarms(path)[0].reason
    assert "as in the log" in verify_alarms(path, log)[0].reason
    assert verify_alarms(stored(tmp_path)) == []


def numbers_in(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where every number of a record stands: JSON numbers, and the words of hexadecimal strings."""
    if isinstance(value, dict):
        return [p for key, v in value.items() if key != "sha256" for p in numbers_in(v, (*path, key))]
    if isinstance(value, list):
        return [p for i, v in enumerate(value) for p in numbers_in(v, (*path, i))]
    if isinstance(value, str):
        return [(*path, i) for i in range(len(value.split()))] if path[-1] in ("hex", "time") else []
    return [path]


def test_any_changed_number_fails_the_digest(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    line = stored(tmp_path, case[0]).read_text()
    places = numbers_in(json.loads(line))
    assert len(places) > 200
    changed = []
    for place in places:
        record = json.loads(line)
        way, last = ["record", *place[:-1]], place[-1]
        parent: Any = {"record": record}
        for key in way[:-1]:
            parent = parent[key]
        if isinstance(parent[way[-1]], str):
            words = parent[way[-1]].split()
            words[last] = (float.fromhex(words[last]) + 1.0).hex() if words[last] != "nan" else "0"
            parent[way[-1]] = " ".join(words)
        else:
            parent[way[-1]][last] += 1
        changed.append(json.dumps(record))
    path = tmp_path / "changed.jsonl"
    path.write_text("\n".join(changed))
    checks = verify_alarms(path)
    assert len(checks) == len(places)
    for outcome in checks:
        assert not outcome.ok
        assert "SHA-256" in outcome.reason


def test_a_new_digest_does_not_save_a_broken_proof(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    alarm, log = case
    c = alarm.certificate
    explained = [s.noise + 2.0 for s in c.samples]
    broken = [
        replace(c, samples=tuple(replace(s, noise=n) for s, n in zip(c.samples, explained, strict=True))),
        replace(c, samples=c.samples[1:]),
        replace(c, owner=np.array([1, 1])),
        replace(c, delta=10 * c.delta),
        replace(c, samples=tuple(replace(s, on_output=-s.on_output) for s in c.samples)),
    ]
    checks = verify_alarms(stored(tmp_path, *(replace(alarm, certificate=b) for b in broken)), log)
    assert [(k.ok, k.reason) for k in checks] == [(False, "the proof does not hold")] * len(broken)


def test_data_that_differ_from_the_log_are_named(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    alarm, log = case
    path, last = stored(tmp_path, alarm), alarm.sample
    first = alarm.certificate.first
    assert first > 0
    y, u, gap, late = log.y.copy(), log.u.copy(), log.y.copy(), log.u.copy()
    y[last - 1] = np.nextafter(y[last - 1], 9.0)
    u[first] += 1e-9
    gap[last - 2] = np.nan
    late[last] += 1.0
    early = y.copy()
    early[last - 1] = log.y[last - 1]
    early[first - 1] += 1.0
    assert check(path, replace(log, y=y)).reason == f"y of sample {last - 1} differs from the log"
    assert check(path, replace(log, u=u)).reason == f"u of sample {first} differs from the log"
    assert check(path, replace(log, y=gap)).reason == f"y of sample {last - 2} differs from the log"
    assert not check(path, replace(log, time=log.time + 1e-3)).ok
    assert not check(path, replace(log, y=np.hstack([log.y, log.y]))).ok
    shorter = Log(time=log.time[:last], u=log.u[:last], y=log.y[:last])
    assert "do not belong" in check(path, shorter).reason
    assert not check(stored(tmp_path, replace(alarm, sample=last - 1)), log).ok
    assert not check(stored(tmp_path, replace(alarm, time=np.nan)), log).ok
    # what the window does not speak of: the input after its last sample, readings before its first
    path = stored(tmp_path, alarm)
    assert check(path, replace(log, u=late)).ok
    assert check(path, replace(log, y=early)).ok


def test_an_input_that_the_last_output_depends_on_must_be_that_of_the_log(tmp_path: Path) -> None:
    model = UncertainModel([[0.5]], [[1.0]], [[1.0]], D=[[2.0]], n=[0.1])
    log = Log(time=np.arange(2.0), u=np.array([[0.0], [1.0]]), y=np.array([[0.0], [9.0]]))
    certificate = WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=2).run(log).certificate
    assert certificate is not None
    path = stored(tmp_path, Alarm("m", 1, 1.0, certificate, {}))
    assert check(path, log).ok
    assert check(path, replace(log, u=np.array([[0.0], [2.0]]))).reason == "u of sample 1 differs from the log"


def spoiled(record: dict[str, Any], name: str, value: Any) -> str:
    """The record with a field (dots go inwards) replaced, or removed if the value is None; with a new digest."""
    record = json.loads(json.dumps(record))
    parent: Any = record
    *way, last = name.split(".")
    for key in way:
        parent = parent[int(key) if isinstance(parent, list) else key]
    if value is None:
        del parent[last]
    else:
        parent[last] = value
    return with_digest(record)


FIELDS = [
    ("observer", None), ("sample", None), ("sample", "twelve"), ("sample", []),
    ("time", None), ("time", 1.0), ("time", "noon"), ("time", "0x1p+99999"), ("source", None), ("source", [1]),
    ("certificate", None), ("certificate", []), ("certificate", "x"), ("certificate.first", None),
    ("certificate.owner", None), ("certificate.owner", ["a"]), ("certificate.owner", [10**30]),
    ("certificate.samples", None), ("certificate.samples", 7), ("certificate.samples", [7]),
    ("certificate.samples.0.y", None), ("certificate.samples.0.y", 3.0), ("certificate.samples.0.extra", 3.0),
    ("certificate.samples.0.y.hex", "zero"), ("certificate.samples.0.y.hex", 5), ("certificate.samples.0.y.shape", [9]),
    ("certificate.samples.0.y.shape", "x"), ("certificate.samples.0.y.shape", [10**30]),
    ("certificate.samples.0.y.hex", "0x1p+5000"), ("certificate.arrival", None), ("certificate.arrival", [1]),
    ("certificate.arrival.rows", None), ("certificate.delta", None), ("certificate.extra", {"hex": "0", "shape": [1]}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value"), FIELDS)
def test_an_incomplete_record_is_named_so(tmp_path: Path, case: tuple[Alarm, Log], name: str, value: Any) -> None:
    path = stored(tmp_path, case[0])
    path.write_text(spoiled(json.loads(path.read_text()), name, value))
    assert not check(path).ok
    assert check(path).reason.startswith("incomplete alarm record")


def test_infinity_is_no_json(tmp_path: Path, case: tuple[Alarm, Log]) -> None:
    path = stored(tmp_path, case[0])
    path.write_text(spoiled(json.loads(path.read_text()), "sample", float("inf")))
    assert check(path).reason.startswith("not JSON")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("certificate.n", 5), ("certificate.n", -1), ("certificate.first", 0), ("certificate.samples", []),
        ("certificate.owner", [7, 7]), ("certificate.samples.0.y", {"hex": "0x1p+0", "shape": []}),
        ("certificate.samples.0.u", {"hex": "nan", "shape": [1]}), ("certificate.late", True),
    ],
)  # fmt: skip
def test_a_record_whose_parts_contradict_proves_nothing(
    tmp_path: Path, case: tuple[Alarm, Log], name: str, value: Any
) -> None:
    path = stored(tmp_path, case[0])
    path.write_text(spoiled(json.loads(path.read_text()), name, value))
    assert check(path).reason == "the proof does not hold"


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"what is this", "not JSON"), (b'{"format": ', "not JSON"), (b"\xff\xfe\x00", "not JSON"),
        (b"[" * 100_000, "not JSON"), (b"[1, 2]", "not an alarm record"), (b"null", "not an alarm record"),
        (b"{}", "not an alarm record"), (b'{"format": "svo-alarm-0"}', "not an alarm record"),
        (b'{"format": "svo-alarm-2"}', "SHA-256"), (b'{"format": "svo-alarm-2", "sha256": 5}', "SHA-256"),
    ],
)  # fmt: skip
def test_a_line_that_is_no_record_is_reported_among_good_ones(
    tmp_path: Path, case: tuple[Alarm, Log], line: bytes, reason: str
) -> None:
    path = stored(tmp_path, case[0])
    path.write_bytes(path.read_bytes() + b"\n" + line + b"\n" + path.read_bytes())
    checks = verify_alarms(path)
    assert [(c.line, c.ok) for c in checks] == [(1, True), (3, False), (4, True)]
    assert reason in checks[1].reason
    assert (checks[1].observer, checks[1].sample) == ("?", -1)
    with pytest.raises(ValueError, match=r"alarms\.jsonl, line 3: .*" + reason):
        read_alarms(path)

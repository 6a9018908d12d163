"""Records that a forger gave a right digest: what the plant's own numbers and the log do not say is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from stored_alarms import with_digest

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver, detect, find_plant, read_log, verify
from svo.detection.chains import PlantModels
from svo.isolation.alarms import Alarm, alarm_line, verify_alarms
from svo.logs.log import Log
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from tests.fuzz import records

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
CART, TANKS = EXAMPLES / "cart.toml", EXAMPLES / "two_tanks.toml"
Record = dict[str, Any]


@pytest.fixture(scope="module")
def cart() -> tuple[Any, Any, list[str]]:
    plant = find_plant(str(CART))
    log = read_log(CART.with_suffix(".csv"), plant)
    return plant, log, [alarm_line(alarm) for alarm in detect(plant, log, noise="stated").alarms]


@pytest.fixture(scope="module")
def tanks() -> tuple[Any, Any, list[str]]:
    plant = find_plant(str(TANKS))
    log = read_log(TANKS.with_suffix(".csv"), plant)
    return plant, log, [alarm_line(alarm) for alarm in detect(plant, log, noise="stated").alarms]


def numbers(*values: float) -> dict[str, Any]:
    return {"shape": [len(values)], "hex": " ".join("0" if v == 0 else float(v).hex() for v in values)}


def of_all(name: str, value: Any) -> Callable[[Record], None]:
    """An entry that is the same at every sample, replaced."""
    return lambda record: record["certificate"]["every_sample"].__setitem__(name, value)


def without_outputs(record: Record) -> None:
    """C = 0: no state explains a reading that is not zero."""
    stacks = record["matrices"]["stacks"]
    items, rows, columns = stacks["shape"][1:]
    words = stacks["hex"].split()
    for item in range(items):
        for column in range(columns):
            words[(item * rows + rows - 1) * columns + column] = "0"
    stacks["hex"] = " ".join(words)


def shifted(by: int) -> Callable[[Record], None]:
    def change(record: Record) -> None:
        record["sample"] += by
        record["time"] = float(0.1 * record["sample"]).hex()
        for name in ("first", "last"):
            record["certificate"][name] += by

    return change


def a_sum(record: Record) -> None:
    """A bound of a sum that the plant's noise does not have."""
    c = record["certificate"]
    lists = {"column": [0], "first": [c["first"]], "last": [c["last"]]}
    c["sums"] = lists | {"lower": numbers(-1e-6), "upper": numbers(1e-6), "on_sum": numbers(1e-3)}


def a_row(record: Record) -> None:
    c = record["certificate"]
    c["w_rows"], c["w_rows_lower"], c["w_rows_upper"] = (
        {"shape": [1, 1], "hex": "0x1.0p+0"},
        numbers(-1e-9),
        numbers(1e-9),
    )
    for s in c["samples"]:
        s["on_w"] = numbers(0.0)


FORGED: dict[str, Callable[[Record], Any]] = {
    "no noise": of_all("noise", numbers(0.0)),
    "no disturbance": lambda r: (of_all("w_lower", numbers(0.0))(r), of_all("w_upper", numbers(0.0))(r)),
    "C = 0": without_outputs,
    "no uncertainty": lambda r: r["certificate"]["delta"].__setitem__(
        "hex", " ".join("0" for _ in r["certificate"]["delta"]["hex"].split())
    ),
    "another fault": lambda r: r.__setitem__("observer", "sensor"),
    "no such observer": lambda r: r.__setitem__("observer", "nobody"),
    "a later sample": shifted(1),
    "an earlier sample": shifted(-1),
    "a bound of a sum": a_sum,
    "a row on w": a_row,
    "a range": lambda r: r.__setitem__("premises", {"physical": [numbers(-0.1, -0.1), numbers(0.1, 0.1)]}),
    "another digest": lambda r: r.__setitem__("model", "0" * 64),
    "times of their own": lambda r: r.__setitem__("dt", numbers(*[0.05] * (len(r["certificate"]["samples"]) - 1))),
}


@pytest.mark.parametrize("what", FORGED)
def test_a_forged_record_is_refused_once_the_plant_is_at_hand(
    tmp_path: Path, cart: tuple[Any, Any, list[str]], what: str
) -> None:
    plant, log, lines = cart
    path = tmp_path / "alarms.jsonl"
    for line in lines:
        record = json.loads(line)
        FORGED[what](record)
        path.write_text(with_digest(record))
        (check,) = verify_alarms(path, log, PlantModels(plant, log).difference)
        assert not check.ok, check.reason


def last_halved(name: str) -> Callable[[Record], None]:
    """The last entry of an array, wherever the record has it."""

    def change(record: Record) -> None:
        c = record["certificate"]
        for part in (c["every_sample"], *c["samples"]):
            if name in part:
                *others, last = part[name]["hex"].split()
                part[name]["hex"] = " ".join([*others, (0.5 * float.fromhex(last)).hex()])

    return change


def impossible(record: Record) -> None:
    """A row on w that nothing fulfils: the proof that any reading is false."""
    c = record["certificate"]
    width = c["w_rows"]["shape"][1]
    c["w_rows"] = {"shape": [1, width], "hex": " ".join(["0x1.0p+0", *["0"] * (width - 1)])}
    c["w_rows_lower"], c["w_rows_upper"] = numbers(1e6), numbers(1e6)
    for s in c["samples"]:
        s["on_output"]["hex"] = " ".join("0" for _ in s["on_output"]["hex"].split())
        s["on_w"] = numbers(0.0)
    c["samples"][0]["on_w"] = numbers(-1.0)


AROUND: dict[str, tuple[Callable[[Record], None], str]] = {
    "less noise": (last_halved("noise"), "the noise bound of sample"),
    "half of what a linearisation leaves": (last_halved("w_upper"), "disturbance bound"),
    "a bound of a sum": (a_sum, "bounds of sums are"),
    "a row on w": (impossible, "rows on w are"),
}


@pytest.mark.parametrize("what", AROUND)
def test_what_no_linearisation_chooses_is_the_nonlinear_plants_own(
    tmp_path: Path, tanks: tuple[Any, Any, list[str]], what: str
) -> None:
    plant, log, lines = tanks
    change, reason = AROUND[what]
    path = tmp_path / "alarms.jsonl"
    for line in lines:
        record = json.loads(line)
        change(record)
        path.write_text(with_digest(record))
        (alone,) = verify_alarms(path)
        assert alone.ok, alone.reason  # the proof holds: of what the plant does not promise
        (check,) = verify_alarms(path, log, PlantModels(plant, log).difference)
        assert not check.ok
        assert reason in check.reason


@pytest.mark.parametrize("stated", [None, "jitter"])
def test_what_is_not_checked_of_a_nonlinear_model_is_said_whatever_its_source_says(
    tmp_path: Path, cart: tuple[Any, Any, list[str]], tanks: tuple[Any, Any, list[str]], stated: str | None
) -> None:
    path = tmp_path / "alarms.jsonl"
    for (plant, log, lines), kind in ((tanks, "nonlinear"), (cart, None)):
        record = json.loads(lines[0])
        assert record["source"].pop("model", None) == kind
        if stated == kind:
            continue
        record["source"] |= {} if stated is None else {"model": stated}
        path.write_text(with_digest(record))
        (check,) = verify_alarms(path, log, PlantModels(plant, log).difference)
        assert not check.ok
        assert f"source says 'model': {stated!r}; expected {kind!r}" in check.reason


@pytest.mark.parametrize("is_known", [True, False])
def test_bounds_of_s_that_are_taken_as_given_are_named(tmp_path: Path, is_known: bool) -> None:
    """x0 in [-1, 1], x1 = x0 + w + Delta x0 / 2 explains y1 = 1.7 of noise 0.2, but not with s = 0."""
    model = UncertainModel(
        [[1.0]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.2], Ts=1.0, uncertainties=[Uncertainty(A=[[0.5]])]
    )
    observer = WindowObserver(model, HPolytope.box([-1.0], [1.0]))
    proof = observer.run(Log(np.arange(2.0), np.zeros((2, 0)), np.array([[0.9], [5.0]]))).certificate
    assert isinstance(proof, WindowCertificate)
    zeros = {"s_lower": 1, "s_upper": 1, "lines": (1, 4), "on_channel": (1, 2)}
    nothing = {name: np.zeros(shape) for name, shape in zeros.items()}
    samples = [replace(s, **nothing, y=np.array([y])) for s, y in zip(proof.samples, (0.9, 1.7), strict=True)]
    if not is_known:
        samples = [replace(s, on_output=np.array([m])) for s, m in zip(samples, (1.0, -1.0), strict=True)]
        proof = replace(proof, arrival=ArrivalSet.unknown(1), on_arrival=np.zeros(0))
    log = Log(np.arange(2.0), np.zeros((2, 0)), np.array([s.y for s in samples]))
    forged = Alarm("nominal", 1, 1.0, replace(proof, samples=tuple(samples)), {"plant": "made"})
    (path := tmp_path / "alarms.jsonl").write_text(alarm_line(forged))
    (check,) = verify_alarms(path, log)
    known = "the arrival set" if is_known else "the readings of its window"
    assert check.reason == f"proven given {known} and the bounds of s of its channels, data as in the log"
    given = "given the set at the start of each window and the bounds of s of its channels, and that the model in"
    assert given in verify(path).summary


@pytest.mark.parametrize(("of", "takes"), [("A", True), ("E", True), ("a", False)])
def test_bounds_of_s_are_taken_as_given_where_they_are_of_states_or_disturbances(of: str, takes: bool) -> None:
    delta = Uncertainty(**{of: [0.5] if of == "a" else [[0.5]]})
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.2], Ts=1.0, uncertainties=[delta])
    log = Log(np.arange(2.0), np.zeros((2, 0)), np.array([[0.9], [9.0]]))
    proof = WindowObserver(model, HPolytope.box([-1.0], [1.0])).run(log).certificate
    assert proof is not None
    assert ("the bounds of s" in proof.premise(1)) is takes


def test_the_record_of_one_model_is_no_alarm_of_another(tmp_path: Path, cart: tuple[Any, Any, list[str]]) -> None:
    plant, log, lines = cart
    path, names = tmp_path / "alarms.jsonl", ("nominal", "motor", "sensor")
    for line in lines:
        record = json.loads(line)
        for name in set(names) - {record["observer"]}:
            path.write_text(with_digest(record | {"observer": name}))
            (check,) = verify_alarms(path, log, PlantModels(plant, log).difference)
            assert not check.ok, (record["observer"], name)


def edit(seeds: range, tmp_path: Path) -> None:
    for seed in seeds:
        with suppress(ValueError):  # no file of alarms any more; WrongError is for what is proven and not so
            records.alarms(np.random.default_rng(seed), tmp_path)


def test_random_edits_of_records_prove_nothing_that_is_not_so(tmp_path: Path) -> None:
    edit(range(150), tmp_path)


@pytest.mark.slow
def test_ten_thousand_random_edits_of_records_prove_nothing_that_is_not_so(tmp_path: Path) -> None:
    edit(range(10_000), tmp_path)

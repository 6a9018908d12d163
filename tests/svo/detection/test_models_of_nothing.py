"""Of a model that nothing keeps to any proof would hold, so the checker takes none whose bounds leave no point."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from proof_cases import Files, Made, proven, random_plant, steps_of, tiny, with_steps

from svo import UncertainModel
from svo.detection.plant_record import observer_record, plant_record
from svo.observers.window.evidence import ArrivalSet
from svo.store.values import encode_value
from tests.svo.detection.checkers import CHECK, NONLINEAR
from tests.svo.models.nonlinear_plants import CASES

Record = dict[str, Any]


def array(*values: Any) -> Record:
    return dict(encode_value(np.array(values, dtype=float)))


NONE = {"rows": {"shape": [0, 1], "hex": ""}, "lower": array(), "upper": array()}


def box(low: float, high: float) -> Record:
    return {"box_lower": array(low), "box_upper": array(high)} | NONE


def rows(low: float, high: float) -> Record:
    return {"rows": array([1.0]), "lower": array(low), "upper": array(high)}


def span(low: float, high: float) -> list[Record]:
    return [array(low), array(high)]


def sums(column: int, low: float, high: float) -> list[Record]:
    return [{"column": column, "samples": 2, "ends": array(low, high)}]


NAN, INF = np.nan, np.inf
# x0 in [-1, 1], x+ = (0.8 + 0.1 Delta) x + u + w, |w| <= 0.1, |Delta| <= 1, y = x + v, |v| <= 0.2
NOTHING: dict[str, Record] = {
    "negative noise": {"noise": array([-0.2])},
    "noise that is none": {"noise": array([NAN])},
    "a negative remainder": {"remainder": array([-1.0])},
    "w below itself": {"w_lower": array([0.2])},
    "w that is none": {"w_upper": array([NAN])},
    "w beyond all numbers": {"w_lower": array([INF]), "w_upper": array([INF])},
    "w below itself at one sample": {"w_lower": array(*[[-0.1]] * 11, [0.2])},
    "a row on w below itself": {"w_rows": rows(0.05, 0.0)},
    "a row above w": {"w_rows": rows(0.11, 1.0)},
    "a row below w": {"w_rows": rows(-1.0, -0.11)},
    "Delta below itself": {"delta": array([1.0, -1.0])},
    "a first set below itself": {"first": box(1.0, -1.0)},
    "a first set beyond all numbers": {"first": box(-INF, -INF)},
    "a row of the first set below itself": {"first": box(-1.0, 1.0) | rows(0.1, 0.0)},
    "a row beside the first set": {"first": box(-1.0, 1.0) | rows(1.5, 2.0)},
    "a row above a set without a lower end": {"first": box(-INF, 1.0) | rows(1.5, 2.0)},
    "a physical range below itself": {"physical": span(5.0, -5.0)},
    "a physical range that is none": {"physical": span(NAN, 5.0)},
    "a physical range beside the first set": {"physical": span(1.5, 5.0)},
    "a largest set below itself": {"largest": span(1.0, -1.0)},
    "a largest set beside the physical range": {"physical": span(-5.0, 5.0), "largest": span(6.0, 7.0)},
    "a sum below itself": {"sums": sums(0, 0.1, -0.1)},
    "a sum above all noise": {"sums": sums(0, 0.41, 1.0)},
    "a sum below all w": {"sums": sums(1, -1.0, -0.21)},
}
SOMETHING: dict[str, Record] = {
    "no noise": {"noise": array([0.0])},
    "one w": {"w_lower": array([0.1])},
    "a row that w reaches": {"w_rows": rows(0.1, 1.0)},
    "one Delta": {"delta": array([1.0, 1.0])},
    "one state": {"first": box(1.0, 1.0) | rows(1.0, 1.0)},
    "any state": {"first": box(-INF, INF) | rows(-1.0, 1.0)},
    "ranges that meet": {"physical": span(1.0, INF), "largest": span(-1.0, 1.0)},
    "sums that noise and w reach": {"sums": sums(0, 0.4, 1.0) + sums(1, -1.0, -0.2)},
    "sums that w reaches at times": {"w_upper": array(*[[0.1]] * 11, [0.5]), "sums": sums(1, 0.9, 1.0)},
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    plant, log, _ = tiny()
    found = proven(plant, log, tmp_path_factory.mktemp("tiny"))
    assert found is not None
    return found


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """What the checker says of files that it refuses."""

    def run(proof: Path, plant: Path, log: Path) -> str:
        monkeypatch.setattr(sys, "argv", ["svo_check.py", str(proof), "--model", str(plant), "--log", str(log)])
        assert CHECK.main() == 1
        printed = capsys.readouterr()
        assert printed.err == ""
        assert printed.out.count("\n") == 1
        return printed.out

    return run


def edited(files: Files, change: Callable[[Record], object]) -> Files:
    plant = json.loads(files[1].read_text())
    change(plant["observers"]["nominal"])
    (path := files[1].with_name("changed.json")).write_text(json.dumps(plant))
    return files[0], path, files[2]


@pytest.mark.parametrize("what", NOTHING)
def test_bounds_that_leave_nothing_are_refused(files: Files, said: Callable[..., str], what: str) -> None:
    text = said(*edited(files, lambda record: record.update(NOTHING[what])))
    assert "the model 'nominal' of the model file: nothing is within" in text
    assert "expected lower bounds up to upper ones" in text


@pytest.mark.parametrize("what", SOMETHING)
def test_bounds_that_leave_a_point_are_taken(files: Files, what: str) -> None:
    record = json.loads(files[1].read_text())["observers"]["nominal"]
    CHECK.Model(record | SOMETHING[what])


@pytest.mark.parametrize("ranges", [{"physical": []}, {"physical": span(0.0, 1.0)[:1]}, {"largest": [*span(0, 1), 1]}])
def test_a_range_has_two_ends(files: Files, said: Callable[..., str], ranges: Record) -> None:
    assert "the model 'nominal' of the model file: " in said(*edited(files, lambda record: record.update(ranges)))


@pytest.mark.parametrize(
    ("stated", "physical"),
    [(box(1.0, -1.0), None), (box(-1.0, 1.0) | rows(2.0, 3.0), None), (box(-1.0, 1.0), span(2.0, 3.0))],
)
def test_a_set_that_is_assumed_has_a_point(
    files: Files, said: Callable[..., str], stated: Record, physical: list[Record] | None
) -> None:
    steps = deepcopy(steps_of(files[0]))
    next(s for s in steps if s.get("step") == "start").update({"from": "assumed", "set": stated})
    change = {} if physical is None else {"physical": physical, "first": box(2.0, 3.0)}
    changed = edited(files, lambda record: record.update(change))
    assert "nothing is within the set that is assumed" in said(with_steps(files[0], steps), *changed[1:])


def test_points_of_a_table_are_in_order() -> None:
    plant, log = random_plant(7)
    record = plant_record(plant, "stated", log)["observers"]["nominal"]
    points = [float.fromhex(word) for word in record["matrices"]["points"]["hex"].split(" ")]
    CHECK.Model(record)
    for other in (points[::-1], [points[0], *points[:-1]], points[:-1], [*points, 2.0], [NAN, *points[1:]]):
        with pytest.raises(CHECK.REFUSALS, match="points are out of order"):
            CHECK.Model(record | {"matrices": record["matrices"] | {"points": array(*other)}})


def test_samples_are_apart(tmp_path: Path) -> None:
    log = SimpleNamespace(time=[0.0, 1.0, 0.0])
    CHECK.Log.check_times(log, 1, 1.0, None)
    for intervals, Ts in ((None, 0.0), ([0.0, 0.0], 1.0), ([1.0, -1.0], 1.0), (None, -1.0)):
        with pytest.raises(CHECK.REFUSALS, match="apart"):
            CHECK.Log.check_times(log, 2, Ts, intervals)


# -- nonlinear models --------------------------------------------------------------------------------------------------


def two_ends(low: float, high: float) -> list[Record]:
    return [array(low, low), array(high, high)]


@pytest.mark.parametrize(
    ("equations", "further"),
    [
        ({"valid": []}, {}),
        ({"valid": two_ends(9e3, -9e3)}, {}),
        ({"valid": two_ends(np.nan, 9e3)}, {}),
        ({"valid": two_ends(2.0, 9e3)}, {"physical": two_ends(-9e3, 1.0), "largest": None, "first": None}),
        ({"continuous": "false"}, {}),
        ({"continuous": None}, {}),
        ({}, {"w_upper": array([-9.0] * 4)}),
        ({}, {"noise": array([-0.2])}),
        ({}, {"physical": two_ends(1.0, 0.0)}),
    ],
)
def test_equations_that_hold_nowhere_are_refused(equations: Record, further: Record) -> None:
    case = CASES["cstr"]()
    first = ArrivalSet.box(case.x0 - case.spread, case.x0 + case.spread)
    record, plant = observer_record("made", first, case.model, None), {"Ts": (0.1).hex()}
    if "first" in further:
        none = {"rows": {"shape": [0, 2], "hex": ""}, "lower": array(), "upper": array()}
        further = further | {"first": {"box_lower": array(0.0, 0.0), "box_upper": array(0.5, 0.5)} | none}
    NONLINEAR.Linearised(record, plant, None, 0)
    with pytest.raises(CHECK.REFUSALS, match=r"nothing is within|not enough values|finite|is not in list"):
        NONLINEAR.Linearised(record | further | {"equations": record["equations"] | equations}, plant, None, 0)


def test_what_is_described_leaves_a_point() -> None:
    model = UncertainModel([[0.5]], None, [[1.0]], n=[0.1], Ts=1.0, physical=([0.0], [1.0]), largest=([0.5], [2.0]))
    record = plant_record(Made(model), "stated")["observers"]["nominal"]
    found = CHECK.Model(record)
    assert found.largest.within(found.always).box == [[0.5], [1.0]]

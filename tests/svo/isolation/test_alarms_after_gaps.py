"""Alarms after a gap, from the description and the log to what `svo verify` says of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from svo.detection.chains import verify_chains
from svo.detection.detect import detect
from svo.isolation.alarms import verify_alarms
from svo.logs.log import Log
from svo.plant.description import read_description

DESCRIPTION = """
Ts = 1.0
[columns]
outputs = [{ name = "y", unit = "m" }]
[model]
A = [[2.0]]
C = [[1.0]]
E = [[1.0]]
w = [0.1]
n = [0.05]
PROMISE
[initial]
lower = [-1.0]
upper = [1.0]
"""
IN_THE_GAP = 103


def checked(tmp_path: Path, promise: str, after: list[float]) -> tuple[str, str]:
    """What `verify --log` and `verify --full` say of the alarm of readings after a gap."""
    path = tmp_path / "plant.toml"
    path.write_text(DESCRIPTION.replace("PROMISE", promise), encoding="utf-8")
    plant = read_description(path)
    y = np.array([np.nan] * IN_THE_GAP + after)[:, None]
    log = Log(np.arange(float(len(y))), np.zeros((len(y), 0)), y)
    found = detect(plant, log, "stated")
    assert len(found.alarms) == 1
    found.save(tmp_path / "out")
    alarms = tmp_path / "out" / "alarms.jsonl"
    (plain,), (full,) = verify_alarms(alarms, log), verify_chains(alarms, log, plant)
    assert plain.ok, plain.reason
    assert full.ok, full.reason
    return plain.reason, full.reason


def test_the_largest_set_is_named_with_its_sample(tmp_path: Path) -> None:
    plain, full = checked(tmp_path, "largest = { lower = [-5.0], upper = [5.0] }", [1e4])
    words = "the largest set at sample 101, where the set started again"
    assert f"proven given the arrival set, and {words}" in plain
    assert full.startswith("proven from sample 101")
    assert f"given {words}" in full


@pytest.mark.parametrize("after", [[1e6, 0.0]])
def test_readings_that_contradict_each_other_need_no_set(tmp_path: Path, after: list[float]) -> None:
    plain, full = checked(tmp_path, "", after)
    assert "the readings of its window alone" in plain
    assert full == "proven from the readings since sample 100"


def test_the_physical_range_is_named(tmp_path: Path) -> None:
    _, full = checked(tmp_path, "physical = { lower = [-20.0], upper = [20.0] }", [1e7])
    assert full == "proven from sample 99, given the physical range"
    assert full.endswith("given the physical range")

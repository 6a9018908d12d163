"""What the report's script is given to draw; that it draws it is the matter of test_report_in_browser.py."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from svo.plant import Column, Plant, load_plant
from svo.studies.isolation.exemplar import Exemplar
from svo.studies.isolation.interactive import interactive_section
from svo.studies.isolation.run import RunRow

NAMES = ("nominal", "leak", "gauge")
FALLS = {"nominal": 20, "gauge": 25}


@pytest.fixture
def tank(registered_tank: str) -> Plant:
    plant = load_plant(registered_tank)
    columns = replace(plant.columns, states=(Column("level_m", "m"), Column("flow", "m/s")))
    return replace(plant, columns=columns)  # type: ignore[type-var]


def exemplar(samples: int = 40) -> Exemplar:
    """A run in which the nominal model falls at sample 20 and the gauge's at 25; the leak's knows no upper bound."""
    alive = np.ones((samples, 3), dtype=bool)
    alive[20:, 0] = alive[25:, 2] = False
    lower, upper = np.full((samples, 3, 2), -1.0), np.ones((samples, 3, 2))
    lower[~alive] = upper[~alive] = np.nan
    upper[:, 1, 0] = np.inf
    truth = np.zeros((samples, 2))
    return Exemplar("leak", "step", "calm", NAMES, np.arange(samples) * 0.1, alive, lower, upper, truth, ())


def row(fault: str = "leak", profile: str = "step") -> RunRow:
    return RunRow(0, 7, fault, profile, "calm", None, 0.1, None, None, False, False, "leak, gauge", 9.0, 20.0, 0)


def data_of(section: str) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', section, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


def test_runs_and_the_fall_of_each_model_are_in_the_page(tank: Plant) -> None:
    data = data_of(interactive_section(tank, [row()], [exemplar()]))
    run = data["runs"][0]
    assert (run["seed"], run["detect"], run["isolate"]) == (7, 0.1, None)
    flight = data["flights"][0]
    assert flight["axes"] == ["level [m]", "flow [m/s]"]
    for model in flight["models"]:
        if model["name"] in FALLS:
            assert flight["time"][model["dies"]] == pytest.approx(0.1 * FALLS[model["name"]] - tank.fault_time)
        else:
            assert model["dies"] is None
    leak = flight["models"][1]
    assert leak["upper"][0] == [None, 1.0]  # no bound, and yet alive


def test_a_long_run_is_thinned_but_keeps_the_samples_of_the_falsifications(tank: Plant) -> None:
    long = exemplar(5000)
    flight = data_of(interactive_section(tank, [row()], [replace(long, time=long.time / 100)]))["flights"][0]
    assert len(flight["time"]) < 200
    nominal = flight["models"][0]
    assert flight["time"][nominal["dies"]] == pytest.approx(0.02 - tank.fault_time)
    assert flight["time"][nominal["dies"] - 1] == pytest.approx(0.019 - tank.fault_time)


def test_without_a_fault_there_is_nothing_to_move_in(tank: Plant) -> None:
    assert interactive_section(tank, [row("none", "none")], [replace(exemplar(), fault="none")]) == ""


def test_no_name_ends_the_script_or_the_list(tank: Plant) -> None:
    evil = "</script><b>"
    section = interactive_section(tank, [row(profile=evil)], [replace(exemplar(), profile=evil)])
    assert "<b>" not in section
    assert data_of(section)["runs"][0]["profile"] == evil

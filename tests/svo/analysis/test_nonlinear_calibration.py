"""Bounds of nonlinear models that are too narrow for a healthy log: what is widened suffices, and is not absurd."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import Log, NonlinearModel, WindowObserver, calibrate
from svo.cli import app
from tests.svo.models.nonlinear_plants import CASES, Case, crane, pendulum

TANKS = Path(__file__).parents[3] / "docs" / "examples" / "two_tanks.toml"
SEED = 20_261_202


def first(case: Case) -> HPolytope:
    return HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)


def healthy(case: Case, samples: int = 25, **options: bool) -> Log:
    rng = np.random.default_rng(SEED)
    return case.model.simulate(case.x0, case.inputs(samples), rng, substeps=6, **options)


def is_falsified(model: NonlinearModel, initial: HPolytope, log: Log) -> bool:
    return "falsified" in WindowObserver(model, initial).run(log).verdicts


def test_a_log_inside_the_bounds_needs_no_widening() -> None:
    case = crane()
    found = calibrate(case.model, healthy(case), first(case))
    assert found.widenings == ()
    assert found.smallest
    assert found.chosen == ("noise load", "noise gyro", "disturbance wind")


@pytest.mark.parametrize("name", ["crane", "pendulum", "servo"])
def test_noise_that_is_stated_too_small_is_widened_by_about_what_it_lacks(name: str) -> None:
    case = CASES[name]()
    log = healthy(case, corners=True)
    small = case.model.replace(n=0.6 * case.model.noise)
    assert is_falsified(small, first(case), log)
    found = calibrate(small, log, first(case), bounds=["noise"])
    assert found.widenings
    assert not found.smallest
    assert not is_falsified(found.model, first(case), log)
    assert max(w.relative for w in found.widenings) < 1.0  # 0.667 gives the noise that there was
    for w in found.widenings:
        i = case.model.names["outputs"].index(w.bound.removeprefix("noise "))
        assert found.model.noise[i] == pytest.approx(small.noise[i] + w.amount, rel=1e-12)
        assert 0 <= w.sample < len(log)


def test_one_reading_is_named_with_its_sample() -> None:
    case = crane()
    log = healthy(case)
    y = log.y.copy()
    y[14, 1] += 1.0
    found = calibrate(case.model, replace(log, y=y), first(case))
    (widening,) = found.widenings
    assert widening.bound == "noise gyro"
    assert widening.sample == 14
    assert 0.8 < widening.amount < 1.05


def test_a_parameter_gives_way() -> None:
    case = crane()
    truth = case.model.replace(parameters={"gravity": (9.7, 9.9), "drag": (1.5, 1.6)})
    x0 = np.array([0.2, 3.0])
    start = HPolytope.box(x0 - 0.1, x0 + 0.1)
    log = truth.simulate(x0, case.inputs(25), np.random.default_rng(SEED), substeps=6)
    for bounds in (["parameters"], ["parameter drag"]):
        found = calibrate(case.model, log, start, bounds=bounds)
        assert not is_falsified(found.model, start, log)
        drag = next(w for w in found.widenings if w.bound == "parameter drag")
        low, high = found.model.parameters["drag"]
        assert high == pytest.approx(0.3 + drag.amount)
        assert low == pytest.approx(0.1 - drag.amount)
        assert high > 0.8
        if bounds == ["parameter drag"]:
            assert found.model.parameters["gravity"] == (9.7, 9.9)


def test_what_cannot_be_calibrated_is_one_error() -> None:
    case = crane()
    log = healthy(case, 8)
    with pytest.raises(ValueError, match="bounds contains 'deltas'; expected any of noise, disturbances, parameters, "):
        calibrate(case.model, log, first(case), bounds=["deltas"])
    with pytest.raises(ValueError, match="of which the model has none; expected any of noise y"):
        calibrate(pendulum().model, healthy(pendulum(), 3), first(pendulum()), bounds=["parameters"])
    y = log.y.copy()
    y[4] += 3.0
    with pytest.raises(ValueError, match="no widening of parameter drag explains samples 0 to 4; let bounds contain"):
        calibrate(case.model, replace(log, y=y), first(case), bounds=["parameter drag"])
    narrow = case.model.replace(valid=([-0.35, -0.5], [0.35, 0.5]))
    with pytest.raises(ValueError, match=r"of the log is undecided .outside: at sample .*leave such samples out"):
        calibrate(narrow, healthy(case, 25), first(case))
    with pytest.raises(ValueError, match="u of the log"):
        calibrate(case.model, Log(log.time, np.zeros((8, 0)), log.y), first(case))


def test_the_command_calibrates_a_description(tmp_path: Path) -> None:
    text = TANKS.read_text(encoding="utf-8").replace("n = [0.1, 0.1] ", "n = [0.06, 0.1] ")
    (tmp_path / "tanks.toml").write_text(text, encoding="utf-8")
    lines = TANKS.with_suffix(".csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "log.csv").write_text("".join(lines[:40]), encoding="utf-8")
    done = CliRunner().invoke(app, ["calibrate", str(tmp_path / "tanks.toml"), str(tmp_path / "log.csv")])
    assert done.exit_code == 0, done.output
    assert done.stdout.startswith("A sufficient widening with which the nominal model explains all 39 samples")
    assert "noise level_1: + 0.0" in done.stdout

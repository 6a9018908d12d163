"""The level as an order statistic, the optimiser, the cost, and the critical scale of a window bank."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from compared_plant import BOX, SmallPlant, model

from svo.detectors.detector import Parameter, Setting
from svo.detectors.scaled_bounds import scaled_bounds
from svo.detectors.threshold import ThresholdDetector
from svo.detectors.window_bank import WindowBank
from svo.studies.comparison.tuning import FaultyRun, detection_cost, level_at, tune


@dataclass(frozen=True)
class Scaled(ThresholdDetector):
    """Its score is the data, but for an inner parameter away from 0.3 it is late."""

    name: str = "scaled"
    parameters: dict = field(default_factory=lambda: {"place": Parameter(0.0, 1.0)})

    def prepare(self, log):
        return log

    def scores(self, setting, prepared):
        late = round(20 * abs(setting.parameters.get("place", 0.3) - 0.3))
        return np.concatenate([np.full(late, np.nan), prepared])[: len(prepared)]


def test_level_gives_the_expected_share_of_other_runs():
    rng = np.random.default_rng(0)
    healthy = [rng.random(50) for _ in range(199)]
    for rate, place in ((0.0, 1), (0.02, 4), (0.1, 20)):
        level = level_at(Scaled(), Setting(np.inf), healthy, rate)
        assert level == sorted(run.max() for run in healthy)[-place]
        assert sum(Scaled().run(Setting(level), run).alarm.any() for run in healthy) == place - 1
    shares = []
    for _ in range(400):
        level = level_at(Scaled(), Setting(np.inf), [rng.random(5) for _ in range(19)], 0.1)
        shares.append(1 - level**5)
    assert np.mean(shares) == pytest.approx(0.1, abs=0.01)


def test_optimiser_finds_the_inner_parameter_of_least_delay_and_the_level_comes_from_other_runs():
    rng = np.random.default_rng(1)
    healthy, others = ([rng.random(50) for _ in range(20)] for _ in range(2))
    faulty = [FaultyRun("a", np.r_[np.zeros(10), np.full(40, 2.0)], 10)]
    tuned = tune(Scaled(), healthy, faulty, others, 0.0, 30)
    assert tuned.setting.parameters["place"] == pytest.approx(0.3, abs=0.03)
    assert tuned.setting.level == max(run.max() for run in others)
    assert tuned.cost == 0.0  # ln(1): at the first faulty sample
    assert tuned.evaluations <= 40


def test_cost_weighs_scenarios_alike_and_counts_a_miss_as_the_run():
    runs = [
        FaultyRun("a", np.r_[np.zeros(5), np.full(10, 2.0)], 5),
        FaultyRun("a", np.zeros(15), 5),
        FaultyRun(
            "b", np.r_[np.full(5, 9.0), np.zeros(3), np.full(7, 2.0)], 5
        ),  # what is before the fault is not judged
    ]
    cost = detection_cost(Scaled(), Setting(1.0), runs)
    assert cost == pytest.approx(((np.log(1) + np.log(10)) / 2 + np.log(4)) / 2)


def test_critical_scale_is_where_the_alarm_ends():
    plant = SmallPlant()
    bank = WindowBank({"nominal": model()}, BOX, 5)
    for fault, seed in (("none", 0), ("first", 1)):
        log = plant.simulate(fault, "step", "usual", seed)
        critical = bank.critical_level(Setting(1.0), log, 0.0)
        assert not bank.run(Setting(critical), log).alarm.any()
        assert bank.run(Setting(critical / 1.03), log).alarm.any()
        assert bank.critical_level(Setting(1.0), log, 2 * critical) == 2 * critical
    assert critical > 1.0


def test_bank_stops_only_when_nothing_can_change():
    plant = SmallPlant()
    bank = plant.detectors("usual")[0]
    found = bank.run(Setting(1.0), plant.simulate("first", "step", "usual", 0))
    assert found.alarm[20:].all()
    assert not found.alarm[:20].any()
    assert found.isolated[-1] == bank.faults.index("first")
    assert found.processed < found.alarm.size
    alone = bank.run(Setting(1.0), plant.simulate("first", "step", "usual", 0), isolate=False)
    assert alone.isolated is None
    np.testing.assert_array_equal(alone.alarm, found.alarm)


def test_widths_are_those_of_the_nominal_set():
    log = SmallPlant().simulate("none", "none", "usual", 0)
    narrow = WindowBank({"nominal": model()}, BOX, 5, width_of=[[1.0, 0.0]]).run(Setting(1.0), log).width
    wide = WindowBank({"nominal": model()}, BOX, 5, width_of=[[1.0, 0.0]]).run(Setting(2.0), log).width
    assert narrow.shape == (len(log), 1)
    assert (narrow > 0).all()
    assert (narrow <= 0.2 + 1e-6).all()  # the sensor alone
    assert narrow.mean() < wide.mean()


@pytest.mark.parametrize("scheduled", [False, True])
def test_scaled_bounds(scheduled):
    bounds = {"w": ([-0.1, 0.0], [0.1, 0.4]), "n": [0.1, 0.2, 0.3]}
    if scheduled:
        bounds = {"w": (lambda s: s * np.array([-0.1, 0.0]), lambda s: s * np.array([0.1, 0.4])), "n": [0.1, 0.2, 0.3]}
    lower, upper, noise = scaled_bounds(model().replace(**bounds, schedule=1.0), 2.0).bounds(1.0)
    np.testing.assert_allclose(lower, [-0.2, -0.2])
    np.testing.assert_allclose(upper, [0.2, 0.6])
    np.testing.assert_allclose(noise, [0.2, 0.4, 0.6])
    with pytest.raises(ValueError, match="scale is 0"):
        scaled_bounds(model(), 0.0)


def test_parameters_are_searched_on_their_scale():
    assert Parameter(1.0, 100.0, logarithmic=True).at(0.5) == pytest.approx(10.0)
    assert Parameter(1, 8, integer=True).at(0.49) == 4.0
    with pytest.raises(ValueError, match=r"low is 0 on a logarithmic scale"):
        Parameter(0.0, 1.0, logarithmic=True)
    with pytest.raises(ValueError, match="expected finite numbers, low < high"):
        Parameter(1.0, 1.0)


def test_tuning_refuses_what_it_cannot_use():
    with pytest.raises(ValueError, match="rate is 1"):
        tune(Scaled(), [np.zeros(3)], [FaultyRun("a", np.zeros(3), 0)], [np.zeros(3)], 1.0, 5)
    with pytest.raises(ValueError, match="0 fault-free, 1 faulty and 1 calibration runs"):
        tune(Scaled(), [], [FaultyRun("a", np.zeros(3), 0)], [np.zeros(3)], 0.1, 5)
    with pytest.raises(ValueError, match="models has nothing"):
        WindowBank({}, BOX)

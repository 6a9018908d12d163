"""A whole comparison of a small plant: equal false alarms, proofs that hold, isolation, and the same rows again."""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest
from compared_plant import SmallPlant
from scipy.stats import betabinom

from svo.studies.comparison import comparison as module
from svo.studies.comparison.comparison import Comparison, run_comparison
from svo.studies.comparison.publish import publish_comparison, to_text

HERE = Path(__file__).parent
COMPARISON = Comparison(
    "small",
    "usual",
    runs=12,
    healthy_training=20,
    healthy_calibration=59,
    healthy_runs=40,
    faulty_training=3,
    evaluations=5,
    rate=0.05,
)


@pytest.fixture(scope="module")
def registered():
    """Make the small plant an installed distribution, here and in processes that are started from here."""
    patch = pytest.MonkeyPatch()
    for folder in (HERE, HERE / "registered"):
        patch.syspath_prepend(str(folder))
        patch.setenv("PYTHONPATH", str(folder), prepend=os.pathsep)
    yield
    patch.undo()


@pytest.fixture(scope="module")
def compared(registered):
    return run_comparison(COMPARISON)


@pytest.fixture(scope="module")
def table(compared, tmp_path_factory):
    out = tmp_path_factory.mktemp("compared")
    return out, publish_comparison(out, compared, SmallPlant())


def untimed(row):
    return {**vars(row), "microseconds_per_sample": 0}


def test_no_false_alarm_and_no_wrong_isolation_with_stated_bounds_that_hold(table):
    stated = [row for row in table[1] if row.detector.endswith("stated bounds") and row.distribution == "bounded"]
    assert [row.false_alarms.count for row in stated] == [0, 0]
    assert [row.wrong_isolations.count for row in stated] == [0, 0]


def test_gaussian_noise_falsifies_stated_bounds_and_tuning_widens_them(compared, table):
    rows = {(row.detector, row.distribution): row for row in table[1]}
    assert rows["SVO N = 5, stated bounds", "gaussian"].false_alarms.value > 0.5
    assert rows["SVO N = 5, scaled bounds", "gaussian"].false_alarms.value < 0.3
    assert compared.tuned["gaussian", "SVO N = 5, scaled bounds"].setting.level > 1.2


def test_every_tuned_detector_has_the_rate_and_finds_the_faults(table):
    """The level is the j-th largest of n critical levels, so a new run exceeds it with a probability that is
    Beta(j, n + 1 - j), and the count in m runs is beta-binomial: at most its 99.9 % quantile."""
    n = COMPARISON.healthy_calibration
    j = int(COMPARISON.rate * (n + 1))
    largest = betabinom(COMPARISON.healthy_runs, j, n + 1 - j).ppf(0.999)
    tuned = [row for row in table[1] if not row.detector.endswith("stated bounds")]
    assert len({(row.distribution, row.detector) for row in tuned}) == 2 * 6
    for row in tuned:
        assert row.false_alarms.count <= largest, row.detector
        assert row.detect.reached.count >= COMPARISON.runs - 3  # a run with an alarm before its fault does not count
        assert 0.1 - 1e-9 <= row.detect.median < 1.0
    # Over all of them the rate is neither missed nor left unused.
    counts = {(row.distribution, row.detector): row.false_alarms.count for row in tuned}
    assert 0.3 * COMPARISON.rate < np.mean(list(counts.values())) / COMPARISON.healthy_runs < 2.5 * COMPARISON.rate


def test_isolation_names_the_right_fault(table):
    rows = [row for row in table[1] if "chi" not in row.detector and row.detector != "CUSUM"]
    for row in rows:
        assert row.isolate.reached.count + row.wrong_isolations.count >= 10, row.detector
        assert row.wrong_isolations.count <= 2, row.detector


def test_the_same_comparison_gives_the_same_rows(registered, compared):
    assert module.tune_detector(COMPARISON, "gaussian", 2) == compared.tuned["gaussian", "Kalman, chi-square"]
    part = next(part for part in COMPARISON.parts() if part.distribution == "gaussian" and part.scenario == 1)
    again = module.judge(COMPARISON, part, compared.settings("gaussian"))
    rows = [row for row in compared.rows if row.distribution == "gaussian" and row.seed in part.seeds]
    assert len(again) == 7 * 12
    assert sorted(map(str, map(untimed, rows))) == sorted(map(str, map(untimed, again)))


def test_seeds_of_training_and_judging_differ_and_are_shared_by_detectors(compared):
    seeds = {}
    for row in compared.rows:
        seeds.setdefault((row.distribution, row.detector), []).append(row.seed)
    assert len({tuple(s) for s in seeds.values()}) == 1
    training = [s for i in range(3) for s in COMPARISON.seeds(0, i, 40)]
    assert not set(training) & set(next(iter(seeds.values())))


def test_table_and_picture_are_written(table):
    out, rows = table
    with (out / "comparison.csv").open() as file:
        written = list(csv.DictReader(file))
    assert len(written) == len(rows) == 2 * 7 * 2
    assert all(float(row["false_alarms_low"]) <= float(row["false_alarms_high"]) for row in written)
    assert {"process_noise", "samples"} == set(
        json.loads(next(row["parameters"] for row in written if row["detector"] == "Kalman, chi-square"))
    )
    with (out / "runs.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 2 * 7 * (40 + 2 * 12)
    assert (out / "comparison.png").stat().st_size > 20_000
    assert len(to_text(rows).splitlines()) == 2 + 2 * 7


def test_wrong_arguments_are_named(registered):
    with pytest.raises(ValueError, match="runs is 0"):
        Comparison("small", "usual", runs=0)
    with pytest.raises(ValueError, match="rate is 1"):
        Comparison("small", "usual", rate=1.0)
    with pytest.raises(ValueError, match="workers is 0"):
        run_comparison(COMPARISON, workers=0)


def test_a_plant_without_detectors_is_refused(monkeypatch):
    monkeypatch.setattr(module, "plant_to_simulate", lambda name: object())
    module.compared_plant.cache_clear()
    with pytest.raises(TypeError, match="offers no detectors to compare"):
        module.compared_plant("bare")
    module.compared_plant.cache_clear()


@pytest.mark.slow
def test_the_rows_do_not_depend_on_the_number_of_workers(registered):
    few = {"runs": 2, "healthy_training": 3, "healthy_calibration": 3, "healthy_runs": 2, "faulty_training": 1}
    small = Comparison("small", "usual", **few, evaluations=2)
    one, two = run_comparison(small, 1), run_comparison(small, 2)
    assert [untimed(row) for row in one.rows] == [untimed(row) for row in two.rows]
    for key, tuned in one.tuned.items():
        assert tuned.setting.level == two.tuned[key].setting.level
        np.testing.assert_equal(dict(tuned.setting.learned), dict(two.tuned[key].setting.learned))

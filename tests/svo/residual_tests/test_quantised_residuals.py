"""Residuals as converters make them: on a grid, constant, tied, in any unit.

Batch and online answers are the same to the bit, and no test alarms because a sum was rounded.
"""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.detectors.residuals import SPRTDetector
from svo.detectors.standard import window_sums
from svo.residual_tests import CUSUM, GLR, SPRT, ChiSquare, RandomizedSubsampling, StaticThreshold, StudentT, Whitening

TESTS = [
    StaticThreshold(mean=0.1, sigma=0.1),
    StudentT(mean=0.1, samples=7),
    GLR(mean=0.1, sigma=0.3, samples=7),
    SPRT(mean=0.1, sigma=0.3, change=0.2),
    CUSUM(mean=0.1, change=0.2, threshold=1.0),
    RandomizedSubsampling(mean=0.1, samples=15, subsets=16, least=2),
    ChiSquare(degrees=1, samples=5),
]


@pytest.mark.parametrize("test", TESTS, ids=lambda test: type(test).__name__)
@pytest.mark.parametrize("step", [0.1, 0.3, 1 / 3, 2.0**-7])
def test_batch_and_online_give_the_same_bits(test, step):
    rng = np.random.default_rng(7)
    residual = step * rng.integers(-3, 5, 400)
    residual[rng.random(400) < 0.05] = np.nan
    record, online = test.run(residual), test.start()
    steps = [online.step(r) for r in residual]
    np.testing.assert_array_equal(record.statistic, [s.statistic for s in steps])
    assert record.alarm.tolist() == [s.alarm for s in steps]


@given(st.floats(-1e6, 1e6), st.integers(2, 40), st.integers(-60, 60))
def test_student_is_quiet_at_the_mean_and_alarms_anywhere_else(mean, samples, power):
    mean *= 2.0**power
    test = StudentT(mean=mean, samples=samples)
    assert not test.run(np.full(60, mean)).alarm.any()
    neighbour = np.nextafter(mean, np.inf)  # how a reading of the mean may be rounded
    assert samples > 6 or not test.run(np.full(60, neighbour)).alarm.any()
    assert test.run(np.full(60, mean + max(abs(mean), 2.0**power) * 1e-9)).alarm[samples:].all()


def test_student_at_a_mean_that_has_no_float():
    """0.1 + 0.2 and 0.3 are one number to whoever writes them; so are means of 0.1 over any window."""
    for samples in range(2, 50):
        assert not StudentT(mean=0.3, samples=samples).run(np.full(60, 0.1 + 0.2)).alarm.any()
        assert not StudentT(mean=0.1, samples=samples).run(np.full(60, 0.1)).alarm.any()


def test_a_residual_that_stays_at_its_mean_never_alarms():
    for value in (0.0, 0.1, 1 / 3, -7e-11):
        for test in (
            StaticThreshold(mean=value), GLR(mean=value), SPRT(mean=value), CUSUM(mean=value, change=1.0),
            RandomizedSubsampling(mean=value),
        ):  # fmt: skip
            assert not test.run(np.full(100, value)).alarm.any()


@pytest.mark.parametrize("samples", [3, 7])
@pytest.mark.parametrize("values", [(-1, 1), (-1, 0, 1), (-2, -1, 1, 2), (0,)])
@pytest.mark.parametrize("unit", [1.0, 0.1])
def test_subsampling_keeps_its_rate_on_every_window_of_quantised_residuals(values, samples, unit):
    """All windows of symmetric values, each as likely: the share that alarms is at most 2 L / M."""
    if samples == 7 and len(values) > 3:
        pytest.skip("a million windows")
    windows = unit * np.array(list(product(values, repeat=samples)))
    subsets = samples + 1
    for least in range(1, subsets // 2):
        test = RandomizedSubsampling(samples=samples, subsets=subsets, least=least)
        alarm = test.run(windows.ravel()).alarm[samples - 1 :: samples]
        assert alarm.mean() <= test.false_alarm_rate


@given(st.lists(st.integers(-4, 4), min_size=7, max_size=7), st.sampled_from([0.1, 0.3, 1e-3, 1 / 7]))
def test_signs_of_sums_are_those_of_exact_arithmetic(steps, unit):
    test = RandomizedSubsampling(mean=unit, samples=7, subsets=8)
    window = unit * np.array(steps, dtype=float)
    exact = [
        sum((Fraction(r) - Fraction(unit) for r in window[member].tolist()), Fraction())
        for member in test.membership[1:]
    ]
    count = min(sum(s >= 0 for s in exact), sum(s <= 0 for s in exact))
    assert test.run(window).statistic[-1] == -count


def test_subsampling_still_sees_a_quantised_change():
    residual = 0.1 * np.random.default_rng(1).integers(-2, 3, 300)
    residual[150:] += 0.5
    alarm = RandomizedSubsampling(samples=31, subsets=32).run(residual).alarm
    assert alarm[:150].mean() <= 2 / 32 + 0.05
    assert alarm[185:].all()


@pytest.mark.parametrize("power", [-60, 60])
def test_units_change_no_answer(power):
    unit, residual = 2.0**power, np.random.default_rng(2).normal(0.1, 0.5, 300)
    pairs = [
        (StudentT(mean=0.1), StudentT(mean=0.1 * unit)),
        (GLR(mean=0.1, sigma=0.5), GLR(mean=0.1 * unit, sigma=0.5 * unit)),
        (SPRT(mean=0.1, sigma=0.5, change=0.4), SPRT(mean=0.1 * unit, sigma=0.5 * unit, change=0.4 * unit)),
        (RandomizedSubsampling(mean=0.1), RandomizedSubsampling(mean=0.1 * unit)),
    ]
    for plain, scaled in pairs:
        np.testing.assert_array_equal(plain.run(residual).statistic, scaled.run(residual * unit).statistic)
    plain, scaled = (CUSUM(change=0.4 * by, threshold=3.0 * by).run(residual * by) for by in (1.0, unit))
    np.testing.assert_array_equal(plain.statistic * unit, scaled.statistic)


def test_the_score_of_a_sequential_test_grows_as_long_as_a_fault_lasts():
    """ln L passes 690, at which a threshold of 1e-300 was taken for a decision, and its score fell to zero."""
    white = np.append(np.random.default_rng(0).standard_normal(200), np.full(2000, 3.0))
    scores = SPRTDetector(None).channel_scores({"change": 2.0, "non_detection": 1e-2}, white)
    assert (np.diff(scores[200:]) > 0).all()
    assert scores[-1] > 2000 * 4 - 100
    assert (scores[:200] < 50).all()


def test_window_sums_forget_what_left_the_window():
    squares = np.ones(50)
    squares[10] = 1e20
    assert (window_sums(squares, 5)[15:] == 5.0).all()


@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e-9, 0.0])
def test_nothing_is_learnt_from_a_residual_that_does_not_vary(value):
    with pytest.raises(ValueError, match="do not vary"):
        Whitening.fit([np.full(50, value)], 1)

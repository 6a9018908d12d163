"""Each test's stated false-alarm rate against simulation: it must lie in the confidence interval of the count."""

import numpy as np
import pytest
from scipy import stats

from svo.residual_tests import CUSUM, GLR, SPRT, ChiSquare, RandomizedSubsampling, StaticThreshold, StudentT

CONFIDENCE = 0.999
SIZES = [20_000, pytest.param(1_000_000, marks=pytest.mark.slow)]

WINDOW_TESTS = [
    StaticThreshold(mean=0.3, sigma=2.0, nu=3.0),
    StaticThreshold(nu=1.5),
    StudentT(mean=-1.0, samples=8, confidence=0.95),
    StudentT(samples=20, confidence=0.99),
    GLR(mean=0.5, sigma=0.2, samples=10, false_alarm_rate=0.02),
    GLR(samples=1, false_alarm_rate=0.1),
    RandomizedSubsampling(samples=7, subsets=8, least=1),
    RandomizedSubsampling(samples=15, subsets=16, least=3),
    RandomizedSubsampling(mean=2.0, samples=50, subsets=32, least=1),
]


def interval(count: int, of: int) -> tuple[float, float]:
    found = stats.binomtest(int(count), int(of)).proportion_ci(CONFIDENCE, "exact")
    return float(found.low), float(found.high)


def alarms_of_independent_windows(test, windows: int, rng) -> np.ndarray:
    sigma = getattr(test, "sigma", 1.0)
    residual = rng.normal(test.mean, sigma, windows * test.samples)
    return test.run(residual).alarm[test.samples - 1 :: test.samples]


@pytest.mark.parametrize("windows", SIZES)
@pytest.mark.parametrize("test", WINDOW_TESTS, ids=repr)
def test_measured_rate_of_a_window_test_agrees_with_the_stated_one(test, windows):
    alarms = alarms_of_independent_windows(test, windows, np.random.default_rng(1))
    low, high = interval(alarms.sum(), alarms.size)
    assert low <= test.false_alarm_rate <= high


def test_the_check_notices_a_rate_that_is_wrong_by_a_tenth():
    test = GLR(samples=5, false_alarm_rate=0.1)
    alarms = alarms_of_independent_windows(test, 20_000, np.random.default_rng(1))
    low, high = interval(alarms.sum(), alarms.size)
    assert not low <= 0.11 <= high


def test_subsampling_rate_counts_the_empty_subset():
    """Survey, section 5.6: with 7 sums and L = 1 the rate is 2/8, not 2/7."""
    test = RandomizedSubsampling(samples=7, subsets=8, least=1)
    alarms = alarms_of_independent_windows(test, 40_000, np.random.default_rng(3))
    low, high = interval(alarms.sum(), alarms.size)
    assert low <= 2 / 8 <= high
    assert not low <= 2 / 7 <= high


@pytest.mark.parametrize("shape", ["laplace", "uniform", "scales that change"])
def test_subsampling_rate_holds_without_a_gaussian(shape):
    rng = np.random.default_rng(4)
    test = RandomizedSubsampling(samples=15, subsets=16, least=2)
    size = 20_000 * test.samples
    residual = {
        "laplace": lambda: rng.laplace(size=size),
        "uniform": lambda: rng.uniform(-1, 1, size),
        "scales that change": lambda: rng.standard_normal(size) * 10.0 ** rng.integers(-3, 4, size),
    }[shape]()
    alarms = test.run(residual).alarm[test.samples - 1 :: test.samples]
    low, high = interval(alarms.sum(), alarms.size)
    assert low <= test.false_alarm_rate <= high


@pytest.mark.parametrize("windows", SIZES)
def test_chi_square_of_innovations(windows):
    test = ChiSquare(degrees=4, samples=5, false_alarm_rate=0.05)
    squares = (np.random.default_rng(8).standard_normal((5 * windows, 4)) ** 2).sum(axis=1)
    alarms = test.run(squares).alarm[4::5]
    low, high = interval(alarms.sum(), alarms.size)
    assert low <= test.false_alarm_rate <= high


def sprt_decisions(test: SPRT, residual: np.ndarray) -> np.ndarray:
    statistic = test.run(residual).statistic
    return statistic[(statistic < test.lower) | (statistic > test.upper)] > test.upper


@pytest.mark.parametrize("samples", [300_000, pytest.param(10_000_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("change", [0.3, -0.3, 1.5])
def test_sprt_keeps_its_bound_and_comes_near_to_it_for_small_changes(change, samples):
    test = SPRT(mean=1.0, sigma=2.0, change=change * 2.0, false_alarm=0.05, non_detection=0.1)
    decided = sprt_decisions(test, np.random.default_rng(5).normal(1.0, 2.0, samples))
    low, high = interval(decided.sum(), decided.size)
    assert low <= test.false_alarm_rate
    if abs(change) < 1:  # Wald's value less the overshoot, which exp(-0.583 |change|) describes (Siegmund 1985)
        corrected = test.false_alarm * np.exp(-0.583 * abs(change))
        assert 0.9 * low <= corrected <= 1.1 * high


@pytest.mark.parametrize("runs", [1_000, pytest.param(50_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("change", "threshold"), [(1.0, 3.0), (0.5, 4.0), (2.0, 1.5)])
def test_mean_run_length_of_cusum_agrees_with_the_integral_equation(change, threshold, runs):
    rng, sigma = np.random.default_rng(6), 0.5
    test = CUSUM(mean=-2.0, change=change * sigma, threshold=threshold * sigma)
    stated = test.average_run_length(sigma)
    lengths = run_lengths(test, sigma, runs, rng)
    half = stats.norm.isf((1 - CONFIDENCE) / 2) * lengths.std(ddof=1) / np.sqrt(runs)
    assert abs(lengths.mean() - stated) < half


def run_lengths(test: CUSUM, sigma: float, runs: int, rng: np.random.Generator) -> np.ndarray:
    """Samples to the first alarm of many runs at once, by the recursion as equation (49) writes it."""
    up, down, lengths = np.zeros(runs), np.zeros(runs), np.zeros(runs, dtype=int)
    k = 0
    while (running := lengths == 0).any():
        k += 1
        r = rng.normal(test.mean, sigma, runs) - test.mean
        up = np.maximum(up + r - test.change / 2, 0)
        down = np.maximum(down - r - test.change / 2, 0)
        lengths[running & (np.maximum(up, down) > test.threshold)] = k
    return lengths

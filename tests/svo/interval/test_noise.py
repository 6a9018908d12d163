"""Noise characterisation and thresholds: against brute force, and Proposition 1 and Corollary 2 against filters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from svo.interval import NoiseCharacterization, PowerLaw, filter_bound, first_order_filter, threshold_sequence
from svo.interval.noise import moving_average_extremes
from tests.svo.interval.bound_checks import MUTANTS, SIGNALS, corollary_2, proposition_1, violations


def brute_force(signal: np.ndarray, q: int) -> float:
    return max(abs(float(np.mean(signal[k - q + 1 : k + 1]))) for k in range(q - 1, len(signal)))


@pytest.mark.parametrize("samples", [60, 61, 200])
def test_extremes_are_those_of_brute_force(samples: int) -> None:
    signal = np.random.default_rng(samples).normal(0.3, 1, samples)
    found = moving_average_extremes([signal], 60)
    assert np.allclose(found, [brute_force(signal, q) for q in range(1, 61)], rtol=0, atol=1e-14)


def test_extremes_over_several_blocks_and_records_are_those_of_plain_sums() -> None:
    """Longer than the blocks of the compiled loop, with a large mean, and windows that straddle blocks."""
    rng = np.random.default_rng(7)
    signals = [rng.normal(5, 1, n) for n in (20_000, 8_193, 300)]
    found = moving_average_extremes(signals, 500)
    for q in (1, 2, 17, 300, 301, 500):
        expected = max(np.abs(np.convolve(s, np.ones(q) / q, "valid")).max() for s in signals if s.size >= q)
        assert found[q - 1] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("end", [4000, *range(4094, 4100), 4145, 8193])
def test_a_window_may_end_anywhere_about_the_end_of_a_block(end: int) -> None:
    signal = np.zeros(9_000)
    signal[end - 50 : end] = -1.0
    np.testing.assert_array_equal(moving_average_extremes([signal], 50), np.ones(50))


def test_only_full_windows_count_and_missing_samples_are_left_out() -> None:
    noise = NoiseCharacterization.from_records([[1.0, np.nan, -3.0, 1.0], [2.0, 2.0]], 3, safety_factor=1.5)
    assert noise.bounds == pytest.approx(1.5 * np.array([3.0, 2.0, 1.0 / 3.0]))
    assert (noise.qbar, noise.peak) == (3, pytest.approx(4.5))


def test_variability_is_zero_for_a_constant_and_one_for_what_averages_out() -> None:
    assert NoiseCharacterization(np.full(50, 0.3)).variability == pytest.approx(0.0)
    assert NoiseCharacterization(np.r_[1.0, np.zeros(49)]).variability == pytest.approx(1.0)
    white = np.random.default_rng(0).normal(size=5_000)
    slow = np.convolve(white, np.ones(20) / 20, "valid")
    of = [NoiseCharacterization.from_records(s, 100).variability for s in (white, slow)]
    assert 0.3 < of[0] < 1
    assert 0 < of[1] < 0.5 * of[0]
    assert NoiseCharacterization(np.zeros(3)).variability == 0


def test_the_check_names_the_windows_that_other_records_exceed() -> None:
    noise = NoiseCharacterization(np.array([2.0, 1.0, 0.5, 0.0]))
    check = noise.check([[1.5, 1.5], [0.3, 0.3, 0.0]])
    assert check.violated.tolist() == [2]
    assert not check.holds
    assert check.ratio[:3] == pytest.approx([0.75, 1.5, 0.4])
    assert np.isnan(check.observed[3])
    assert noise.check([0.5, 0.5, 0.0]).holds


def test_the_power_law_is_an_upper_bound_and_the_smallest_of_its_kind() -> None:
    signal = np.random.default_rng(3).normal(size=4_000)
    noise = NoiseCharacterization.from_records(signal, 200)
    law = noise.power_law()
    assert (law.bounds(200) >= noise.bounds).all()
    assert isinstance(law, PowerLaw)
    excess = law.bounds(200) - noise.bounds
    assert excess.min() < 1e-12
    # Oracle: for the same exponent no (alpha, beta) on the constraints' vertices has less mean excess.
    shape = np.arange(1.0, 201) ** law.gamma
    best = np.inf
    for i in range(200):
        for j in range(i + 1, 200):
            alpha = (noise.bounds[i] - noise.bounds[j]) / (shape[i] - shape[j])
            trial = alpha * shape + noise.bounds[i] - alpha * shape[i]
            if alpha >= 0 and (trial >= noise.bounds - 1e-12).all():
                best = min(best, float(np.mean(trial)))
    assert np.mean(law.bounds(200)) == pytest.approx(best, abs=1e-9)
    # A least-squares fit is no bound: this is what it is not.
    fit = np.linalg.lstsq(np.column_stack([shape, np.ones(200)]), noise.bounds, rcond=None)[0]
    assert (fit[0] * shape + fit[1] < noise.bounds).any()


def test_thresholds_of_a_power_law_bound_those_of_the_characterisation() -> None:
    noise = NoiseCharacterization.from_records(np.random.default_rng(4).normal(size=4_000), 200)
    simpler = NoiseCharacterization(noise.power_law().bounds(noise.qbar))
    assert (simpler.thresholds(0.9) >= noise.thresholds(0.9)).all()


def test_power_laws_of_zeros_and_of_one_window() -> None:
    assert NoiseCharacterization(np.zeros(5)).power_law().bounds(5) == pytest.approx(np.zeros(5), abs=1e-14)
    assert NoiseCharacterization(np.array([0.2])).power_law().bounds(1) == pytest.approx([0.2])


@pytest.mark.parametrize("pole", [0.0, 0.3, 0.95, 0.999])
def test_the_sequence_is_the_bound_of_proposition_1_at_each_sample(pole: float) -> None:
    noise = NoiseCharacterization.from_records(np.random.default_rng(6).normal(size=500), 40)
    expected = [filter_bound(noise.bounds, pole, r=k, mu=noise.peak) for k in range(41)]
    assert threshold_sequence(noise.bounds, pole) == pytest.approx(expected)


def test_a_signal_without_variability_has_the_threshold_lambda_1() -> None:
    assert NoiseCharacterization(np.full(30, 0.7)).thresholds(0.9) == pytest.approx(np.full(31, 0.7))


def test_propositions_hold_in_more_than_half_a_million_checks() -> None:
    checks, wrong = violations(samples=600, seeds=8)
    assert checks > 500_000
    assert wrong == 0


@pytest.mark.parametrize("name", MUTANTS)
def test_mutated_indices_are_caught_by_a_constant_signal(name: str) -> None:
    """The checks can fail: with a wrong index in (10) the filter of a constant leaves its bound."""
    signal = SIGNALS["constant"](200, np.random.default_rng(0))
    assert proposition_1(signal, MUTANTS[name])[1] > 0
    assert corollary_2(signal, MUTANTS[name])[1] > 0


@pytest.mark.parametrize("pole", [0.0, 0.6, 0.99])
def test_the_filter_is_its_recursion_and_waits_where_a_sample_is_missing(pole: float) -> None:
    signal = np.random.default_rng(8).normal(size=40)
    signal[[0, 1, 17, 39]] = np.nan
    e, expected = np.nan, []
    for r in signal:
        if not np.isnan(r):
            e = r if np.isnan(e) else pole * e + (1 - pole) * r
        expected.append(e)
    assert first_order_filter(signal, pole) == pytest.approx(np.array(expected), nan_ok=True)
    assert np.isnan(first_order_filter(np.full(3, np.nan), pole)).all()


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: NoiseCharacterization.from_records(np.zeros(5), 6), "qbar is 6 with a longest record of 5"),
        (lambda: NoiseCharacterization.from_records(np.zeros(5), 0), "qbar is 0"),
        (lambda: NoiseCharacterization.from_records(np.zeros(5), 3, safety_factor=1.0), "safety_factor is 1.0"),
        (lambda: NoiseCharacterization.from_records([], 3), "records is empty"),
        (lambda: NoiseCharacterization.from_records([np.zeros(5), [np.nan]], 3), "record 1 is empty"),
        (lambda: NoiseCharacterization.from_records(np.zeros((5, 2, 2)), 3), r"record 0 has shape \(2, 2\)"),
        (lambda: NoiseCharacterization([1.0, -1.0]), "lambda_2 is -1.0"),
        (lambda: NoiseCharacterization([]), r"shape \(0,\)"),
        (lambda: NoiseCharacterization([1.0]).thresholds(1.0), "pole is 1.0"),
        (lambda: filter_bound([1.0], 0.5, r=2, mu=0.0), "r is 2"),
        (lambda: filter_bound([1.0], 0.5, r=1, mu=-1.0), "mu is -1.0"),
        (lambda: NoiseCharacterization([1.0]).power_law([]), "exponents has shape"),
        (lambda: first_order_filter(np.zeros((2, 2)), 0.5), r"signal has shape \(2, 2\)"),
    ],
)
def test_errors_name_what_is_wrong(make: Callable[[], object], match: str) -> None:
    with pytest.raises(ValueError, match=match):
        make()

"""Bounded, band-limited noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import welch

from aircraft.disturbances import RMS_PER_BOUND, BandLimitedNoise


@settings(max_examples=25, deadline=None)
@given(
    bounds=st.lists(st.floats(0, 100), min_size=1, max_size=4),
    cutoff=st.floats(0.2, 45.0),
    samples=st.integers(1, 300),
    seed=st.integers(0, 2**32),
)
def test_no_sample_exceeds_its_bound(bounds, cutoff, samples, seed):
    noise = BandLimitedNoise(bounds, [cutoff] * len(bounds), 0.01)
    drawn = noise.draw(samples, np.random.default_rng(seed))
    assert drawn.shape == (samples, len(bounds))
    assert (np.abs(drawn) <= np.array(bounds)).all()


@pytest.mark.parametrize("cutoff", [0.5, 2.0, 20.0])
def test_rms_is_the_stated_fraction_from_the_first_sample_on(cutoff):
    noise = BandLimitedNoise([3.0], [cutoff], 0.01)
    rng = np.random.default_rng(1)
    whole = noise.draw(400_000, rng)
    assert np.sqrt(np.mean(whole**2)) == pytest.approx(3.0 * RMS_PER_BOUND, rel=0.06)
    first = np.array([noise.draw(1, rng)[0, 0] for _ in range(2000)])
    assert np.sqrt(np.mean(first**2)) == pytest.approx(3.0 * RMS_PER_BOUND, rel=0.06)


def test_spectrum_falls_by_half_at_the_cut_off_and_by_40_db_a_decade():
    drawn = BandLimitedNoise([1.0], [2.0], 0.01).draw(2**19, np.random.default_rng(2))[:, 0]
    frequency, power = welch(drawn, fs=100.0, nperseg=4096)
    level = power[(frequency > 0.1) & (frequency < 0.5)].mean()
    assert power[np.argmin(abs(frequency - 2.0))] / level == pytest.approx(0.5, rel=0.2)
    assert power[np.argmin(abs(frequency - 8.0))] / level < 0.006


def test_longer_run_begins_with_the_shorter_one():
    noise = BandLimitedNoise([1.0, 2.0], [0.5, 20.0], 0.01)
    short, long = (noise.draw(samples, np.random.default_rng(7)) for samples in (300, 500))
    np.testing.assert_array_equal(short, long[:300])


def test_same_seed_same_noise():
    noise = BandLimitedNoise([1.0, 2.0], [0.5, 20.0], 0.01)
    first, second = (noise.draw(500, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize(
    ("bounds", "cutoffs", "Ts", "name"),
    [
        ([1.0, 2.0], [1.0], 0.01, "cutoffs_hz"),
        ([-1.0], [1.0], 0.01, "bounds"),
        ([np.nan], [1.0], 0.01, "bounds"),
        ([1.0], [50.0], 0.01, "cutoffs_hz"),
        ([1.0], [0.0], 0.01, "cutoffs_hz"),
        ([1.0], [1.0], 0.0, "Ts"),
    ],
)
def test_wrong_arguments_are_named(bounds, cutoffs, Ts, name):
    with pytest.raises(ValueError, match=name):
        BandLimitedNoise(bounds, cutoffs, Ts)

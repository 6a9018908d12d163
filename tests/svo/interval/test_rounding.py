"""At equality: what `check` accepts never alarms, in batch or online, however sums, filter and threshold round."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from svo import Log
from svo.interval import (
    GainBounds,
    IntervalDetector,
    IntervalPredictor,
    NoiseCharacterization,
    filter_bound,
    first_order_filter,
)
from svo.interval.noise import moving_average_extremes

POLES = [0.0, 0.1, 0.3, 0.6, 0.8, 0.9, 0.95, 0.99, 0.9999, 1 - 1e-9]


def detector(noise: NoiseCharacterization, pole: float) -> IntervalDetector:
    """Of a plant at rest at zero: its residual is what is measured."""
    return IntervalDetector(IntervalPredictor(GainBounds(0.5, 0.0), (0.0, 0.0)), noise, pole)


def alarms(noise: NoiseCharacterization, pole: float, signal: np.ndarray) -> tuple[bool, bool]:
    log = Log(time=np.arange(float(signal.size)), u=np.zeros((signal.size, 1)), y=signal[:, None])
    record, online = detector(noise, pole).run(log), detector(noise, pole)
    steps = [online.update(signal[0]), *(online.step(0.0, y) for y in signal[1:])]
    np.testing.assert_array_equal(record.filtered, [s.filtered for s in steps])
    np.testing.assert_array_equal(record.threshold, [s.threshold for s in steps])
    return bool(record.exceeded.any()), any(s.exceeded for s in steps)


@pytest.mark.parametrize("pole", POLES)
def test_constant_signals_at_their_bound_are_accepted_and_quiet(pole):
    """The first release alarmed on 68 of 120 such signals."""
    for value in (0.5, 0.1, 1 / 3, 0.7, 1e-3, 2e5, -0.3, np.pi, -1e-30, 3e-310):
        for qbar in (1, 7, 40):
            noise = NoiseCharacterization(np.full(qbar, abs(value)))
            signal = np.full(120, value)
            assert noise.check(signal).holds
            assert alarms(noise, pole, signal) == (False, False)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32), st.sampled_from(POLES), st.sampled_from([1, 2, 5, 30]), st.integers(-60, 60))
def test_a_signal_at_its_own_means_is_quiet(seed, pole, qbar, power):
    rng = np.random.default_rng(seed)
    signal = 2.0**power * np.cumsum(rng.integers(-1, 2, 90)) * rng.choice([0.1, 1.0, 1 / 3])
    signal[rng.random(90) < 0.3] = signal[0] + 0.1
    if not signal.any():
        return
    noise = NoiseCharacterization(moving_average_extremes([signal], qbar))
    assert noise.check(signal).holds
    assert alarms(noise, pole, signal) == (False, False)


def test_the_room_for_rounding_is_small_and_needed():
    for pole in POLES[1:8]:
        for value in (0.5, 0.1, 0.7):
            room = NoiseCharacterization(np.full(40, value)).thresholds(pole) / value - 1
            assert (room > 0).all()
            assert room.max() < (40 + 20) * 2.3e-16 + 5e-16 / (1 - pole)
    values = np.random.default_rng(0).uniform(0.1, 1, 40)
    plain = [
        filter_bound(np.full(40, v), pole, r=40, mu=v) < np.abs(first_order_filter(np.full(200, v), pole)).max()
        for pole in POLES
        for v in values
    ]
    assert sum(plain) > 20  # without the room


@pytest.mark.parametrize("block", ["short", "long"])
def test_means_are_exact_ones_rounded_once(block):
    rng = np.random.default_rng(5)
    signal = rng.normal(3.0, 1e-3, 60) if block == "short" else np.tile([1e8, 0.1, -1e8, 0.1], 2100)
    qbar = 40
    sums, exact = [Fraction(0)], []
    for value in signal.tolist():
        sums.append(sums[-1] + Fraction(value))
    for q in range(1, qbar + 1):
        exact.append(float(max(abs(b - a) for a, b in zip(sums, sums[q:], strict=False)) / q))
    np.testing.assert_allclose(moving_average_extremes([signal], qbar), exact, rtol=2.3e-16, atol=1e-15 * 0.1)


def test_a_constant_that_is_larger_by_one_rounding_is_not_accepted():
    noise = NoiseCharacterization(np.full(9, 0.1))
    assert noise.check(np.full(50, np.nextafter(0.1, 1.0))).violated.tolist() == list(range(1, 10))

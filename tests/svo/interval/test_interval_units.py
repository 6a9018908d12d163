"""Units of the state and of the input that are powers of two scale an interval to the bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from svo import Log
from svo.interval import GainBounds, IntervalPredictor

K = 40


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(-60, 60), st.integers(-60, 60), st.booleans())
def test_powers_of_two_on_state_and_input_scale_the_interval(seed: int, state: int, drive: int, law: bool) -> None:
    """h turns units of u into those of the state; the slope divides by a distance of states."""
    rng = np.random.default_rng(seed)
    gc, gr, hc, hr = rng.uniform(0.3, 0.7, K), rng.uniform(0, 0.1, K), rng.normal(size=K), rng.uniform(0, 0.2, K)
    slope, limit = (rng.uniform(0, 0.1), 0.2) if law else (0.0, np.inf)
    u, y, start = rng.normal(size=K), rng.normal(size=K), (rng.normal(), rng.uniform(0, 1))
    gain = state - drive
    one = GainBounds(gc, gr, hc=hc, hr=hr, slope=slope, limit=limit)
    two = GainBounds(gc, gr, hc=np.ldexp(hc, gain), hr=np.ldexp(hr, gain), slope=np.ldexp(slope, -state), limit=limit)
    log = Log(time=np.arange(float(K)), u=u[:, None], y=y[:, None])
    other = Log(time=log.time, u=np.ldexp(log.u, drive), y=np.ldexp(log.y, state))
    a = IntervalPredictor(one, start).predict(log)
    b = IntervalPredictor(two, tuple(np.ldexp(start, state))).predict(other)
    np.testing.assert_array_equal(np.ldexp(a.center, state), b.center)
    np.testing.assert_array_equal(np.ldexp(a.radius, state), b.radius)

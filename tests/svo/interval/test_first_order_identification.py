from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from svo.interval.identification import identify_first_order
from svo.log import Log


def run_of(g: float, h: float, samples: int, seed: int, noise: float = 0.0) -> Log:
    """A first-order system under a random staircase, simulated step by step."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=samples // 10 + 1), 10)[:samples]
    x = [0.3]
    for k in range(samples - 1):
        x.append(g * x[-1] + (1 - g) * h * u[k])
    y = np.array(x) + noise * rng.uniform(-1.0, 1.0, samples)
    return Log(time=np.arange(samples) * 0.01, u=u[:, None], y=y[:, None])


@pytest.mark.parametrize(("g", "h"), [(0.9, 1.0), (0.3, -2.0), (-0.5, 0.7), (0.0, 1.0)])
def test_what_made_exact_data_is_found(g: float, h: float) -> None:
    fit = identify_first_order(run_of(g, h, 400, 0))
    assert (fit.gains.gc, fit.gains.hc) == pytest.approx((g, h), abs=1e-8)
    assert (fit.gains.gr, fit.gains.hr) == pytest.approx((0.0, 0.0), abs=1e-7)
    assert fit.largest_error < 1e-8
    assert fit.parts.shape == (4, 2)


def test_the_simulation_error_is_least() -> None:
    log = run_of(0.8, 1.2, 500, 1, noise=0.05)

    def errors(p: np.ndarray) -> np.ndarray:
        x = [log.y[0, 0]]
        for k in range(len(log) - 1):
            x.append(p[0] * x[-1] + (1 - p[0]) * p[1] * log.u[k, 0])
        return np.array(x) - log.y[:, 0]

    fit = identify_first_order(log, parts=1)
    independent = least_squares(errors, [0.5, 1.0], xtol=1e-12).x
    assert (fit.gains.gc, fit.gains.hc) == pytest.approx(tuple(independent), abs=1e-6)
    assert fit.largest_error == pytest.approx(np.abs(errors(independent)).max(), rel=1e-4)
    assert (fit.gains.gr, fit.gains.hr) == (0.0, 0.0)


def test_radii_reach_the_fit_of_every_part() -> None:
    fit = identify_first_order([run_of(0.8, 1.0, 300, 2), run_of(0.85, 1.1, 300, 3)], parts=2)
    assert len(fit.parts) == 4
    assert np.all(np.abs(fit.parts - [fit.gains.gc, fit.gains.hc]) <= np.array([fit.gains.gr, fit.gains.hr]) + 1e-15)
    assert 0.8 < fit.gains.gc < 0.85
    assert fit.parts[:, 0] == pytest.approx([0.8, 0.8, 0.85, 0.85], abs=1e-6)


def test_missing_measurements_and_parts_without_motion_are_left_out() -> None:
    log = run_of(0.9, 1.0, 400, 4)
    y = log.y.copy()
    y[:3] = y[50:60] = np.nan
    assert identify_first_order(Log(time=log.time, u=log.u, y=y)).gains.gc == pytest.approx(0.9, abs=1e-7)
    still = Log(
        time=np.arange(800) * 0.01,
        u=np.vstack([log.u, np.zeros((400, 1))]),
        y=np.vstack([log.y, np.zeros((400, 1))]),
    )
    assert len(identify_first_order(still, parts=4).parts) == 2


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        (Log(time=[0.0, 1.0, 2.0, 3.0], u=np.zeros((4, 1)), y=np.zeros((4, 1))), "do not move"),
        (Log(time=[0.0, 1.0, 2.0], u=np.zeros((3, 2)), y=np.zeros((3, 1))), "expected one channel each"),
        (Log(time=[0.0, 1.0, 2.0], u=np.zeros((3, 1)), y=[[np.nan], [1.0], [2.0]]), "2 measurements"),
        ([], "records is empty"),
    ],
)
def test_records_that_say_nothing_are_refused(log: Log | list[Log], expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        identify_first_order(log)


def test_an_unstable_system_is_refused() -> None:
    log = run_of(1.02, 1.0, 300, 5)
    with pytest.raises(ValueError, match="the fitted pole is"):
        identify_first_order(log)

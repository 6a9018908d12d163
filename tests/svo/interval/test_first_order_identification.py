from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from svo.interval.identification import identify_first_order
from svo.logs.log import Log


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
    assert fit.gains.gr > 0.0 < fit.gains.hr  # one part has no distance to itself, but steps and errors of the fit


@pytest.mark.parametrize("kind", ["uniform", "ends", "slow", "pieces"])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_the_bounds_contain_every_g_of_the_record(kind: str, noise: float) -> None:
    """100 records of each kind in the first release: 0 covered by the distances to the fits of parts alone."""
    for seed in range(5):
        for gc in (0.85, 0.5):
            log, g = run_of_changing(gc, 0.05, kind, 600, seed, noise)
            gains = identify_first_order(log).gains
            assert np.abs(g - gains.gc).max() <= gains.gr < 0.4
            assert abs(1.3 - gains.hc) <= gains.hr


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["uniform", "ends", "slow", "pieces"])
@pytest.mark.parametrize(("samples", "parts", "hold"), [(3000, 60, 50), (3000, 4, 10), (600, 4, 10)])
def test_coverage_of_a_hundred_records(kind: str, samples: int, parts: int, hold: int) -> None:
    for seed in range(100):
        log, g = run_of_changing(0.85, 0.05, kind, samples, seed, 0.01, hold)
        fit = identify_first_order(log, parts)
        assert np.abs(g - fit.gains.gc).max() <= fit.gains.gr < 0.3
        assert abs(1.3 - fit.gains.hc) <= fit.gains.hr


def run_of_changing(
    gc: float, gr: float, kind: str, samples: int, seed: int, noise: float, hold: int = 10
) -> tuple[Log, np.ndarray]:
    """A system with h = 1.3 whose g changes within gc +- gr, and that g (samples,)."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=samples // hold + 1), hold)[:samples]
    g = gc + gr * {
        "uniform": rng.uniform(-1, 1, samples),
        "ends": rng.choice([-1.0, 1.0], samples),
        "slow": np.sin(6 * np.pi * np.arange(samples) / samples),
        "pieces": np.repeat(rng.uniform(-1, 1, samples // 50 + 1), 50)[:samples],
    }[kind]  # fmt: skip
    x = [0.3]
    for k in range(samples - 1):
        x.append(g[k] * x[-1] + (1 - g[k]) * 1.3 * u[k])
    y = np.array(x) + noise * rng.uniform(-1.0, 1.0, samples)
    return Log(time=np.arange(samples) * 0.01, u=u[:, None], y=y[:, None]), g


def test_many_parts_that_do_not_move_leave_bounds_that_hold() -> None:
    """60 parts of 50 samples with a constant input each: radii of zero in the first release."""
    log, g = run_of_changing(0.85, 0.05, "uniform", 3000, 0, 0.01, hold=50)
    fit = identify_first_order(log, parts=60)
    assert (fit.still, len(fit.parts)) == (60, 0)
    assert np.abs(g - fit.gains.gc).max() <= fit.gains.gr
    assert abs(1.3 - fit.gains.hc) <= fit.gains.hr


def test_a_part_that_begins_with_missing_measurements_counts() -> None:
    log = run_of(0.8, 1.0, 200, 2)
    other = run_of(0.9, 1.0, 200, 3)
    y = np.vstack([log.y, other.y])
    y[200:205] = np.nan
    fit = identify_first_order(Log(time=np.arange(400) * 0.01, u=np.vstack([log.u, other.u]), y=y), parts=2)
    assert (fit.still, len(fit.parts)) == (0, 2)
    assert fit.parts[1, 0] == pytest.approx(0.9, abs=1e-6)
    assert fit.gains.gr >= fit.parts[1, 0] - fit.gains.gc


@pytest.mark.parametrize("power", [-40, 40])
def test_units_of_input_and_output_change_nothing(power: int) -> None:
    log, _ = run_of_changing(0.85, 0.05, "uniform", 400, 1, 0.01)
    plain = identify_first_order(log)
    scaled = identify_first_order(Log(time=log.time, u=log.u * 2.0**power, y=log.y * 2.0**power))
    for name in ("gc", "gr", "hc", "hr"):
        assert getattr(scaled.gains, name) == pytest.approx(getattr(plain.gains, name), rel=1e-6)


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
    fit = identify_first_order(still, parts=4)
    assert (len(fit.parts), fit.still) == (2, 2)


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

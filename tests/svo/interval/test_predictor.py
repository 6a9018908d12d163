"""The interval predictor: it never loses the state, printed forms do, and its errors say what to do."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from svo import Log
from svo.interval import GainBounds, IntervalPredictor
from tests.svo.interval.first_order_plants import Truth, random_truth


def log_of(u: np.ndarray, y: np.ndarray | None = None, schedule: np.ndarray | None = None) -> Log:
    measured = np.zeros(len(u)) if y is None else y
    return Log(time=np.arange(len(u), dtype=float), u=u[:, None], y=measured[:, None], schedule=schedule)


def lost(truth: Truth) -> int:
    """Samples at which the predictor has lost the state, beyond the rounding of the simulated state itself."""
    p = IntervalPredictor(truth.bounds, (0.0, 1.0)).predict(log_of(truth.u))
    return int(np.sum(np.abs(truth.x - p.center) > p.radius + 1e-12 * (1 + np.abs(truth.x))))


def test_the_state_is_never_lost_in_a_million_samples() -> None:
    assert sum(lost(random_truth(100_000, np.random.default_rng(seed))) for seed in range(10)) == 0


@pytest.mark.parametrize("printed", ["gc for gr", "u for |u|"])
def test_equation_15_as_printed_is_wrong(printed: str) -> None:
    """With u for |u| the state is lost; with gc |xc - hc u| it is kept, if gc > 0, in a far wider interval."""
    truth = random_truth(5_000, np.random.default_rng(2))
    gc, gr, hc, hr, *_ = truth.bounds.over(len(truth.u))
    if printed == "gc for gr":
        gc, gr = np.abs(gc) * 0.9, np.full_like(gr, 0.003)
    p = IntervalPredictor(GainBounds(gc, gr, hc=hc, hr=hr), (0.0, 1.0)).predict(log_of(truth.u))
    radius = np.ones_like(p.radius)
    for k in range(len(radius) - 1):
        away = abs(p.center[k] - hc[k] * truth.u[k])
        signed = truth.u[k] if printed == "u for |u|" else abs(truth.u[k])
        radius[k + 1] = (
            (abs(gc[k]) + gr[k]) * radius[k]
            + (gc[k] if printed == "gc for gr" else gr[k]) * away
            + (abs(1 - gc[k]) + gr[k]) * hr[k] * signed
        )
    if printed == "u for |u|":
        assert np.sum(np.abs(truth.x - p.center) > radius) > 100
    else:
        assert np.median(radius / p.radius) > 2


def test_one_step_holds_in_exact_arithmetic() -> None:
    """From either end of the interval, with g and h at either end of theirs, no rational successor is outside."""
    rng = np.random.default_rng(3)
    for _ in range(500):
        gr, hr, hc, u, center = rng.uniform(0, 0.5), rng.uniform(0, 1), *rng.normal(size=3)
        gc = rng.uniform(-1, 1) * (1 - gr) * 0.99
        predictor = IntervalPredictor(GainBounds(gc, gr, hc=hc, hr=hr), (center, rng.uniform(0, 1)))
        before = predictor.interval
        after = predictor.step(u)
        lower, upper = Fraction(after.lower), Fraction(after.upper)
        for signs in np.ndindex(2, 2, 2):
            s, t, v = (2 * i - 1 for i in signs)
            x = Fraction(before.center) + s * Fraction(before.radius)
            g, h = Fraction(gc) + t * Fraction(gr), Fraction(hc) + v * Fraction(hr)
            assert lower <= g * x + (1 - g) * h * Fraction(u) <= upper


def test_the_interval_is_no_wider_than_it_must_be() -> None:
    """With h known, and x and u of one sign and g positive, both ends are reached: the step is exact."""
    predictor = IntervalPredictor(GainBounds(0.8, 0.1), (2.0, 0.5))
    after = predictor.step(1.0)
    reached = [g * x + (1 - g) for g in (0.7, 0.9) for x in (1.5, 2.5)]
    assert after.upper == pytest.approx(max(reached), abs=1e-12)
    assert after.center == pytest.approx(0.8 * 2 + 0.2)
    assert after.radius == pytest.approx(0.9 * 0.5 + 0.1 * 1.0)


def test_radius_that_grows_with_the_distance_to_the_target_up_to_a_limit() -> None:
    predictor = IntervalPredictor(GainBounds(0.8, 0.01, slope=0.1, limit=0.05), (0.0, 0.0))
    assert predictor.step(0.1).radius == pytest.approx(0.02 * 0.1)
    predictor.reset(0.0, 0.0)
    assert predictor.step(-2.0).radius == pytest.approx(0.05 * 2.0)


def test_steps_are_the_prediction_over_a_log_bit_for_bit() -> None:
    truth = random_truth(300, np.random.default_rng(4))
    predictor = IntervalPredictor(truth.bounds, (0.0, 1.0))
    p = predictor.predict(log_of(truth.u))
    for k in range(299):
        assert (p.center[k], p.radius[k]) == predictor.interval
        predictor.step(float(truth.u[k]))
    assert (p.center[299], p.radius[299]) == predictor.interval
    assert predictor.sample == 299


def test_a_law_sees_input_measurement_and_schedule_of_its_sample() -> None:
    def law(u: float, y: float, schedule: float) -> GainBounds:
        return GainBounds(0.5 + 0.1 * schedule, 0.05 * np.abs(u - y))

    rng = np.random.default_rng(5)
    u, y, schedule = rng.normal(size=50), rng.normal(size=50), rng.uniform(0, 1, 50)
    y[[0, 7, 8]] = np.nan
    predictor = IntervalPredictor(law, (0.3, 0.1))
    p = predictor.predict(log_of(u, y, schedule))
    held = y.copy()
    held[0], held[7:9] = 0.3, y[6]
    assert np.allclose(p.gc, 0.5 + 0.1 * schedule)
    assert np.allclose(p.gr, 0.05 * np.abs(u - held))
    for k in range(49):
        predictor.step(float(u[k]), float(held[k]), float(schedule[k]))
    assert predictor.interval == (p.center[-1], p.radius[-1])


def test_unstable_bounds_are_refused_with_the_sample() -> None:
    gr = np.full(10, 0.1)
    gr[6] = 0.2
    predictor = IntervalPredictor(GainBounds(np.full(10, 0.85), gr), (0.0, 0.1))
    with pytest.raises(ValueError, match=r"sample 6 are 0\.85 \+- 0\.2.*\(17\)"):
        predictor.predict(log_of(np.zeros(10)))
    for _ in range(6):
        predictor.step(0.0)
    before = predictor.interval
    with pytest.raises(ValueError, match="sample 6"):
        predictor.step(0.0)
    assert (predictor.interval, predictor.sample) == (before, 6)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: GainBounds(0.5, -0.1), "gr of the gain bounds is -0.1"),
        (lambda: GainBounds(np.nan, 0.1), "gc of the gain bounds is nan"),
        (lambda: GainBounds(0.5, 0.1, limit=-1.0), "limit"),
        (lambda: GainBounds(np.zeros(3), np.array([0.1, np.inf, 0.1])), r"gr\[1\] of the gain bounds is inf"),
        (lambda: GainBounds(np.zeros(3), np.zeros(4)), "4 samples; expected 3"),
        (lambda: GainBounds(np.zeros((3, 1)), 0.0), r"shape \(3, 1\)"),
        (lambda: IntervalPredictor(0.5, (0.0, 0.1)), "gains is float"),
        (lambda: IntervalPredictor(GainBounds(0.5, 0.1), (0.0, -0.1)), "radius >= 0"),
        (lambda: IntervalPredictor(GainBounds(0.5, 0.1), (0.0, 0.1)).step(np.inf), "u is inf"),
        (lambda: IntervalPredictor(GainBounds(np.zeros(3), 0.1), (0.0, 0.1)).predict(log_of(np.zeros(4))), "3 samples"),
        (lambda: IntervalPredictor(lambda u, y, s: 0.5, (0.0, 0.1)).step(0.0), "gains gave float"),
    ],
)
def test_errors_name_what_is_wrong(make: object, match: str) -> None:
    with pytest.raises((ValueError, TypeError), match=match):
        make()  # type: ignore[operator]


def test_a_log_with_two_inputs_is_refused() -> None:
    log = Log(time=np.arange(3.0), u=np.zeros((3, 2)), y=np.zeros((3, 1)))
    with pytest.raises(ValueError, match=r"u of the log has shape \(3, 2\)"):
        IntervalPredictor(GainBounds(0.5, 0.1), (0.0, 0.1)).predict(log)

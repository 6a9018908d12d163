"""The servo-loop's simulator: against an accurate integrator, end stops, faults, and the sign of the force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from aircraft.elevator.scenarios import DURATION, SCENARIOS, TS, SensorNoise, learning_command, validation_command
from aircraft.elevator.servo import Servo

SERVO = Servo()
TIME = TS * np.arange(round(DURATION / TS))


def gamma(u: float, x: float, t: float, signed: bool = True) -> float:
    """(2) with the constants of the defaults; as printed without the sign of the motion."""
    force = (0.10 + 0.9 * x) * (1 + 0.15 * np.sin(2 * np.pi * t / 70))
    force *= np.sign(u - x) if signed else 1.0
    return float(15 * np.sqrt((1 - force) / (1 + 0.8 * (15 * (u - x)) ** 2)))


def test_the_run_is_that_of_an_accurate_integrator() -> None:
    u = learning_command(TIME[:1_000])
    x = SERVO.run(u, float(u[0]), TS)
    exact = [float(u[0])]
    for k in range(999):
        held = float(u[k])
        found = solve_ivp(
            lambda t, s, held=held: [gamma(held, s[0], t) * (held - s[0])],
            (k * TS, (k + 1) * TS), [exact[-1]], rtol=1e-6, atol=1e-9, max_step=TS,
        )  # fmt: skip
        exact.append(float(found.y[0, -1]))
    assert np.abs(x - exact).max() < 2e-5


def test_the_rate_is_the_formula() -> None:
    for u, x, t in ((0.1, -0.2, 3.0), (-0.3, 0.2, 50.0), (0.05, 0.0499, 90.0)):
        assert SERVO.rate(u, x, t) == pytest.approx(gamma(u, x, t))


def test_the_force_opposes_one_direction_and_assists_the_other() -> None:
    """Without its sign, as printed, a force slows both directions alike: the same servo has one rate for both."""
    assert SERVO.rate(0.21, 0.2, 0.0) < SERVO.unloaded_rate(0.01) < SERVO.rate(0.19, 0.2, 0.0)
    assert gamma(0.21, 0.2, 0.0, signed=False) == pytest.approx(gamma(0.19, 0.2, 0.0, signed=False))


def test_the_surface_stops_at_its_stops_and_comes_back() -> None:
    u = np.r_[np.full(400, 1.0), np.full(400, -1.0), np.full(400, 0.0)]
    x = SERVO.run(u, 0.0, TS)
    assert x.max() == SERVO.stop
    assert x.min() == -SERVO.stop
    assert abs(x[-1]) < 1e-3


def faulty(fault: str, profile: str) -> tuple[np.ndarray, np.ndarray, int]:
    """Position with the fault, without it, and the first faulty sample."""
    scenario = SCENARIOS[fault, profile]
    u = validation_command(TIME)
    x = SERVO.run(u, float(u[0]), TS, **{scenario.where: scenario.fault.law(TIME)})
    return x, SERVO.run(u, float(u[0]), TS), round(scenario.start / TS)


@pytest.mark.parametrize(("fault", "profile"), list(SCENARIOS))
def test_nothing_happens_before_the_fault(fault: str, profile: str) -> None:
    x, healthy, first = faulty(fault, profile)
    assert np.array_equal(x[:first], healthy[:first])
    assert not np.array_equal(x, healthy)


@pytest.mark.parametrize("profile", ["moving", "steady"])
def test_a_jammed_surface_stays_where_it_was(profile: str) -> None:
    x, healthy, first = faulty("jam", profile)
    assert (x[first:] == x[first]).all()
    assert abs(x[first] - healthy[first]) < 1.1 * abs(healthy[first] - healthy[first - 1])


def test_a_runaway_moves_at_its_rate_to_the_stop() -> None:
    x, _, first = faulty("runaway", "slow")
    assert np.diff(x[first : first + 300]) == pytest.approx(np.radians(-5.0) * TS)
    assert (x[-2_000:] == -SERVO.stop).all()


def test_a_solid_oscillation_replaces_the_command_and_a_liquid_one_is_added() -> None:
    solid, healthy, first = faulty("oscillation", "solid")
    liquid, *_ = faulty("oscillation", "liquid")
    period = round(1 / TS)
    late = slice(first + 10 * period, first + 11 * period)
    assert np.mean(solid[late]) == pytest.approx(0.0, abs=1e-4)
    assert np.mean(liquid[late] - healthy[late]) == pytest.approx(0.0, abs=1e-4)
    for run in (solid[late], liquid[late] - healthy[late]):
        assert 0.7 < np.ptp(run) / np.radians(2 * 0.5) < 1.0  # followed, with the loop's lag


def test_a_loss_of_effect_ends_at_a_share_of_the_command() -> None:
    for profile in ("step", "ramp"):
        x, healthy, _ = faulty("loss", profile)
        assert x[-1] == pytest.approx(0.9 * healthy[-1], abs=1e-5)


def test_commands_have_the_values_of_their_formulas() -> None:
    assert validation_command([0.0, 12.0, 50.0, 99.0]) == pytest.approx(
        [-0.02, 0.07 + 0.004 * np.sin(6 * np.pi), -0.11, -0.11 + 8e-4 * 24]
    )
    assert learning_command([31.0, 33.0, 37.0, 99.0]) == pytest.approx([-0.07, 0.07, -0.21, -0.07])


def test_noise_is_coloured_stationary_and_bounded_if_asked() -> None:
    noise = SensorNoise().draw(200_000, np.random.default_rng(0))
    assert noise.std() == pytest.approx(8e-4, rel=0.02)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.4, abs=0.02)
    first = [SensorNoise().draw(1, np.random.default_rng(s))[0] for s in range(2_000)]
    assert np.std(first) == pytest.approx(8e-4, rel=0.1)
    assert np.abs(SensorNoise(bound=1e-3).draw(1_000, np.random.default_rng(0))).max() == 1e-3


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: replace(SERVO, gain=0.0), "gain is 0.0"),
        (lambda: replace(SERVO, damping=-1.0), "damping is -1.0"),
        (lambda: replace(SERVO, force=0.9), "servo stalls"),
        (lambda: replace(SERVO, stop=np.inf), "finite numbers"),
        (lambda: SERVO.run([np.nan], 0.0, TS), "finite commands"),
        (lambda: SERVO.run([0.0], 1.0, TS), "x0 is 1.0"),
        (lambda: SERVO.run([0.0], 0.0, TS, surface=SCENARIOS["jam", "moving"].fault.law(TIME)), "surface has 10000"),
    ],
)
def test_errors_name_what_is_wrong(make: Callable[[], object], match: str) -> None:
    with pytest.raises(ValueError, match=match):
        make()

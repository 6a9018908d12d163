"""Gaussian noise of the three plants, through their public face: its rms is that of the bounded noise, it leaves the
bounds as often as a Gaussian does, and bounded noise never does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import norm

from aircraft.disturbances import RMS_PER_BOUND
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.plant import eclipse
from aircraft.elevator.plant import NOISE_BOUNDS, elevator
from aircraft.missile.imu import NOISE_SETS as MISSILE_NOISE
from aircraft.missile.plant import missile
from svo.plant import Distribution

Array = np.ndarray
RUNS = 12


def eclipse_noise(distribution: Distribution, seed: int) -> Array:
    """Sensor noise and gusts of a flight in units of their bounds, (1000, 7)."""
    run = ECLIPSE.with_noise(distribution).scenarios.run("none", "none", "quiet", seed)
    bounds = NOISE_SETS["quiet"]
    return np.hstack([run.noise / bounds.sensors, run.gusts / bounds.gusts])


def elevator_noise(distribution: Distribution, seed: int) -> Array:
    """Sensor noise of a run in units of its bound, (10000, 1)."""
    log = ELEVATOR.with_noise(distribution).simulate("none", "none", "quiet", seed)
    return (log.y - log.x) / (NOISE_BOUNDS["quiet"] * ELEVATOR.sensor.sigma)


def missile_noise(distribution: Distribution, seed: int) -> Array:
    """Noise of the measured velocity in units of its bound, without the bias of the flight, (1500, 3)."""
    log = MISSILE.with_noise(distribution).simulate("none", "none", "bounded", seed)
    error = log.y[:, :3] - log.x
    return (error - error.mean(axis=0)) / MISSILE_NOISE["bounded"].noise_bound[9:12]


ECLIPSE, ELEVATOR, MISSILE = eclipse().with_models("lpv"), elevator(), missile()
CASES: dict[str, tuple[Callable[[Distribution, int], Array], float]] = {  # noise, and its bound in rms
    "eclipse": (eclipse_noise, 1 / RMS_PER_BOUND),
    "elevator": (elevator_noise, NOISE_BOUNDS["quiet"]),
    "missile": (missile_noise, np.sqrt(3.0)),
}


@pytest.mark.parametrize("plant", CASES)
def test_gaussian_noise_leaves_the_bounds_as_often_as_a_gaussian_does(plant: str) -> None:
    draw, sigmas = CASES[plant]
    noise = [draw("gaussian", seed) for seed in range(RUNS)]
    within(np.array([np.mean(run**2) for run in noise]), 1 / sigmas**2)
    for place in (0.5, 1.0):
        within(np.array([np.mean(np.abs(run) > place) for run in noise]), 2 * norm.sf(place * sigmas))


@pytest.mark.parametrize("plant", CASES)
def test_bounded_noise_of_about_the_same_rms_never_does(plant: str) -> None:
    draw, sigmas = CASES[plant]
    noise = [draw("bounded", seed) for seed in range(3)]
    # The missile's bias is estimated by the mean of the run.
    assert max(np.abs(run).max() for run in noise) <= (1.05 if plant == "missile" else 1.0 + 1e-12)
    rms = np.sqrt(np.mean([np.mean(run**2) for run in noise]))
    assert rms == pytest.approx(1 / sigmas, rel=0.06)


@pytest.mark.parametrize("plant", [ECLIPSE, ELEVATOR, MISSILE])
def test_the_observers_do_not_know_of_it(plant) -> None:  # type: ignore[no-untyped-def]
    noise = plant.noise_sets[0]
    models = [plant.with_noise(distribution).models(noise)["nominal"] for distribution in ("bounded", "gaussian")]
    typical = models[0].schedule
    for bounds in zip(*(model.bounds(typical) for model in models), strict=True):
        np.testing.assert_array_equal(*bounds)


def within(runs: Array, expected: float) -> None:
    """The mean over runs is within 4.5 standard errors, as the runs, which are independent, show them."""
    error = runs.std(ddof=1) / np.sqrt(runs.size)
    assert abs(runs.mean() - expected) <= 4.5 * error, (runs.mean(), expected, error)

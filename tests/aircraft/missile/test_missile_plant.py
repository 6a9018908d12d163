"""The missile as a plant: soundness of the embedding, no false alarm, every fault detected by the right observer."""

from itertools import islice

import numpy as np
import pytest

from aircraft.missile.airframe import Airframe
from aircraft.missile.imu import NOISE_SETS, SensorErrors
from aircraft.missile.mismatch import MARGIN, mismatch
from aircraft.missile.models import OUTPUTS, Embedding, read_bounds
from aircraft.missile.plant import ENDS, FAULTS, Missile, fault_of, missile
from aircraft.missile.scenarios import TS, Flights
from svo.logs.drive import drive
from svo.plant import Plant, load_plant
from svo.studies.added import AddsExhibits, AddsStudy

PLANT = missile()


def test_it_is_registered_and_keeps_the_protocol() -> None:
    plant = load_plant("missile")
    assert isinstance(plant, Plant)
    assert isinstance(plant, AddsExhibits)
    assert isinstance(plant, AddsStudy)
    assert set(read_bounds()) == set(plant.noise_sets)
    assert all(set(b) == {"nominal", *FAULTS} for b in read_bounds().values())


@pytest.mark.parametrize("noise", NOISE_SETS)
@pytest.mark.parametrize("fault", ["none", *FAULTS])
def test_mismatch_stays_within_its_bounds_on_other_flights(noise: str, fault: str) -> None:
    flights, errors = Flights(), NOISE_SETS[noise]
    bounds = read_bounds()[noise]["nominal" if fault == "none" else fault]
    for seed in range(10):
        run = flights.run(() if fault == "none" else (fault_of(fault),), errors, seed, ENDS)
        seen = mismatch(run, Embedding(flights.airframe, TS), errors)
        for name in ("force", "velocity", "output"):
            assert (getattr(seen, name) <= getattr(bounds, name)).all()
    assert MARGIN > 1


def test_embedding_is_exact_on_ideal_measurements() -> None:
    """Force: to rounding. Velocity: what one step of Euler leaves out, far below the bounds that are used."""
    seen = mismatch(Flights().run((), SensorErrors.none(), 0, ENDS), Embedding(Airframe(), TS), SensorErrors.none())
    assert seen.force.max() < 1e-11
    assert seen.velocity.max() < 0.01


@pytest.mark.parametrize(
    ("noise", "seeds"),
    [
        ("bounded", (0,)),
        pytest.param("gaussian", (0,), marks=pytest.mark.slow),
        *(pytest.param(noise, range(1, 26), marks=pytest.mark.slow) for noise in NOISE_SETS),
    ],
)
def test_healthy_flights_falsify_no_observer(noise: str, seeds: tuple[int, ...]) -> None:
    for seed in seeds:
        record = PLANT.bank(noise).run(PLANT.simulate("none", "none", noise, seed))
        assert all(died is None for died in record.died_at.values())


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_detected_and_isolated(fault: str) -> None:
    log = PLANT.simulate(fault, "step", "bounded", 0)
    record = PLANT.bank("bounded").run(log)
    first = round((PLANT.fault_time - log.time[0]) / TS)
    assert record.detected_at is not None
    assert record.detected_at >= first
    assert record.died_at[fault] is None
    assert record.fault == fault
    if fault in ("propulsion", "accelerometer"):
        assert record.isolated_at == first + 2  # the IMU's delay


def test_set_contains_the_true_velocity_throughout() -> None:
    log = PLANT.simulate("pitch_fin", "step", "bounded", 3)
    observer = PLANT.bank("bounded").observers["pitch_fin"]
    for k, step in enumerate(islice(drive(observer, log), 800)):
        if k % 50 == 0:
            lower, upper = step.box
            assert (lower <= log.x[k]).all()
            assert (log.x[k] <= upper).all()


def test_scheduler_gives_the_logs_schedule_and_holds_missing_values() -> None:
    log = PLANT.simulate("none", "none", "bounded", 0)
    schedule = PLANT.scheduler()
    seen = [schedule.with_input(y, u) for y, u in zip(log.y[:20], log.u[:20], strict=True)]
    np.testing.assert_array_equal(seen, log.schedule[:20])
    broken = log.y[20].copy()
    broken[3] = np.nan
    held = schedule.with_input(broken, log.u[20])
    assert held[3] == log.y[19, 3]
    assert (np.delete(held, 3) == np.delete(log.schedule[20], 3)).all()


def test_noise_may_be_drawn_otherwise_than_bounded() -> None:
    """Gaussian noise of the same standard deviation leaves the bounds of the bounded set."""
    bounded, gaussian = Missile(), Missile(distribution="gaussian")
    logs = [plant.simulate("none", "none", "bounded", 0) for plant in (bounded, gaussian)]
    assert not np.array_equal(logs[0].y, logs[1].y)
    used = [plant.models("bounded")["nominal"].bounds()[2] for plant in (bounded, gaussian)]
    np.testing.assert_array_equal(*used)
    assert len(OUTPUTS) == logs[0].y.shape[1]


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="profile is 'hard'"):
        PLANT.simulate("propulsion", "hard", "bounded", 0)
    with pytest.raises(ValueError, match="fault is 'wing'"):
        fault_of("wing")
    with pytest.raises(ValueError, match="noise is 'loud'"):
        PLANT.models("loud")
    with pytest.raises(ValueError, match="12 finite measurements"):
        Embedding(Airframe(), TS).blocks_over(np.zeros(3))

"""What an input can and cannot show of the Eclipse's faults: docs/errata.md."""

import numpy as np
import pytest

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.mismatch import measure_one
from aircraft.eclipse.plant import eclipse
from svo.analysis.isolability import FaultFreeFlight
from svo.analysis.model_pair import ModelPair

PLANT, NOISE, SAMPLES = eclipse(), "quiet", 3


@pytest.fixture(scope="module")
def flight():
    return FaultFreeFlight.of(PLANT, NOISE, 0, SAMPLES)


def separation(flight, fault, observer, offset):
    """Over three samples, with an offset on the elevator [deg]."""
    u = flight.u[:SAMPLES] + np.array([offset, 0.0])
    known, models = flight.known, flight.models
    pair = ModelPair(
        PLANT.stated_faults(NOISE)[fault].model, models[observer], SAMPLES, known["nominal"], known[observer], u,
        flight.schedule,
    )  # fmt: skip
    return pair.solve(SAMPLES, least=-1.0).separation


def test_the_moment_of_the_dynamics_fault_hardly_depends_on_the_airspeed():
    V = np.linspace(25.0, 55.0, 61)
    moment = 0.3 * Derivatives().value("M_u", V) * V
    assert moment.min() > 0.94 * moment.max()


@pytest.mark.parametrize("observer", ["nominal", "alpha"])
def test_no_elevator_shows_the_dynamics_fault_sooner(flight, observer):
    regulated = separation(flight, "dynamics", observer, 0.0)
    for offset in (-15.0, -5.0, 5.0, 15.0):
        assert separation(flight, "dynamics", observer, offset) == pytest.approx(regulated, rel=1e-3)


@pytest.mark.parametrize("observer", ["nominal", "alpha", "dynamics"])
def test_more_elevator_shows_its_loss_and_none_hides_it(flight, observer):
    trim = flight.u[0, 0]
    regulated = separation(flight, "elevator", observer, 0.0)
    assert separation(flight, "elevator", observer, 15.0) > 2.0 * regulated
    assert separation(flight, "elevator", observer, -trim) < 0.0


def test_bounds_are_measured_again_for_excited_flights():
    excitation = np.column_stack([np.full(10, 5.0), np.zeros(10)])
    plain, excited = (measure_one(PLANT.scenarios, NOISE, 2, e) for e in (None, excitation))
    assert plain.keys() == excited.keys() == {"nominal", *PLANT.faults}
    assert (excited["nominal"].state > plain["nominal"].state).all()
    assert excited["nominal"].state[0] > 5.0 * plain["nominal"].state[0]

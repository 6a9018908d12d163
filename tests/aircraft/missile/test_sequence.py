"""Isolation by order in time: scenario 3, sizes that contain the truth, and what it does not claim."""

import numpy as np
import pytest

from aircraft.missile.adaptive import ModelError
from aircraft.missile.airframe import INPUTS
from aircraft.missile.imu import NOISE_SETS
from aircraft.missile.scenarios import DL, DM, DN, SCENARIOS, TS, Flights, Run, locked, thrust_loss
from aircraft.missile.sequence import FaultSequence, SequentialFault, _Search, isolate_in_order
from svo.faults import ActuatorFault, Step

FLIGHTS = Flights()


def _isolate(run: Run) -> FaultSequence:
    return isolate_in_order(run.flight.y, run.aligned_inputs, FLIGHTS.airframe, ModelError(run.errors))


@pytest.mark.parametrize("noise", NOISE_SETS)
@pytest.mark.parametrize("seed", range(3))
def test_scenario_3_is_isolated_in_its_order(noise: str, seed: int) -> None:
    """Together {dl, dn}, {dn, eta}, ... have one signature; one after the other they are told apart."""
    run = FLIGHTS.run(SCENARIOS[3].faults, NOISE_SETS[noise], seed)
    found = _isolate(run)
    assert found.order == ("eta", "dn", "dm")
    assert found.unexplained_at is None
    for fault, (start, _) in zip(found.faults, SCENARIOS[3].events, strict=True):
        assert start <= fault.detected * TS <= fault.isolated * TS
        j, k = INPUTS.index(fault.input), fault.isolated
        achieved, computed = run.flight.achieved[k, j], run.flight.computed[k, j]
        size = achieved if fault.kind == "locking" else achieved / computed
        assert fault.lower <= size <= fault.upper
    assert found.faults[0].isolated * TS == pytest.approx(20.02)
    assert found.faults[0].upper - found.faults[0].lower < 0.05


@pytest.mark.parametrize("fault", [locked(DL, 30.0), locked(DM, 30.0), locked(DN, 30.0), thrust_loss(0.1, 30.0)])
def test_single_faults_are_never_mistaken(fault) -> None:  # type: ignore[no-untyped-def]
    for seed in range(3):
        found = _isolate(FLIGHTS.run((fault,), NOISE_SETS["bounded"], seed, 60.0))
        assert found.order == (INPUTS[fault.where],)


def test_healthy_flights_are_quiet_to_the_intercept() -> None:
    for noise in NOISE_SETS:
        for seed in range(5):
            assert _isolate(FLIGHTS.run((), NOISE_SETS[noise], seed)) == FaultSequence(())


def test_simultaneous_faults_are_left_open_or_unexplained_but_not_named() -> None:
    """dl and eta at once look like dl and dn, or dn and eta: nothing singles one out."""
    run = FLIGHTS.run((locked(DL, 30.0), thrust_loss(0.5, 30.0)), NOISE_SETS["bounded"], 0, 60.0)
    found = _isolate(run)
    assert set(found.order) <= {"dl", "eta"}


def test_a_fault_of_another_kind_is_not_explained() -> None:
    """A propulsion rate that sticks is no loss of effectiveness: no factor fits."""
    stuck = ActuatorFault(3, "hard-over", 1.0, Step(30.0))
    run = FLIGHTS.run((stuck,), NOISE_SETS["bounded"], 0, 60.0)
    found = _isolate(run)
    assert found.unexplained_at is not None or found.faults[0].lower > 1.0
    assert np.isfinite(run.flight.x).all()


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_a_known_fault_is_quiet_wherever_in_its_bounds_the_truth_lies(end: str) -> None:
    """What is left open of a known fault's size is added to the bounds of all residuals."""
    run = FLIGHTS.run((thrust_loss(0.25, 10.0), locked(DN, 10.0)), NOISE_SETS["bounded"], 0, 20.0)
    search = _Search.over(run.flight.y, run.aligned_inputs, FLIGHTS.airframe, ModelError(run.errors))
    position, factor = run.flight.achieved[1500, DN], 0.75
    spread = {"lower": (0.0, 1.0), "upper": (-1.0, 0.0)}[end]
    known = {
        "eta": SequentialFault("eta", "loss", 1002, 1002, factor + 0.2 * spread[0], factor + 0.2 * spread[1]),
        "dn": SequentialFault("dn", "locking", 1002, 1002, position + 0.1 * spread[0], position + 0.1 * spread[1]),
    }
    assert not search.alarms(known)[1010:].any()

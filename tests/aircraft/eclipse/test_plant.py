"""The Eclipse as a registered plant."""

from dataclasses import replace

import numpy as np
import pytest

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER, REFERENCE, Eclipse, eclipse
from aircraft.eclipse.scenarios import Scenarios
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim
from polytopes import HPolytope
from svo.isolation.architectures import ArchitectureII
from svo.logs.drive import drive
from svo.plant import BankChoice, Plant, architecture_of, bank_choice, in_architecture, load_plant, with_bank

PLANT = eclipse()


def test_it_is_registered_and_satisfies_the_protocol():
    plant = load_plant("eclipse")
    assert isinstance(plant, Plant)
    assert isinstance(plant, Eclipse)
    assert (plant.name, plant.Ts, plant.fault_time) == ("eclipse", 0.01, 0.5)
    assert plant.noise_sets == ("quiet", "conservative")
    assert dict(plant.faults) == dict.fromkeys(("alpha", "elevator", "dynamics"), ("step", "hard", "soft"))


@pytest.mark.parametrize(
    ("fault", "profile", "seconds"),
    [("none", "", 10.0), ("alpha", "step", 5.5), ("alpha", "hard", 6.5), ("alpha", "soft", 10.0)],
)
def test_runs_have_the_stated_length(fault, profile, seconds):
    log = PLANT.simulate(fault, profile, "quiet", 0)
    assert PLANT.duration(fault, profile) == seconds
    assert len(log) == round(seconds / PLANT.Ts)
    np.testing.assert_allclose(np.diff(log.time), PLANT.Ts)


def test_log_has_one_column_a_channel_and_the_schedule_of_the_scheduler():
    linear = PLANT.with_models("lpv")
    log, columns = linear.simulate("elevator", "step", "quiet", 1), linear.columns
    for array, names in ((log.u, columns.inputs), (log.y, columns.outputs), (log.x, columns.states)):
        assert array.shape == (len(log), len(names))
    scheduler = linear.scheduler()
    np.testing.assert_array_equal(log.schedule, [scheduler(y) for y in log.y])
    every = [columns.time, *(c.name for c in (*columns.inputs, *columns.outputs, *columns.states))]
    assert len(set(every)) == len(every)


def test_a_run_depends_on_nothing_but_its_seed():
    sequence = np.random.SeedSequence(5, spawn_key=(3,))
    first, second = (PLANT.simulate("dynamics", "soft", "conservative", sequence) for _ in range(2))
    other_plant = eclipse().simulate("dynamics", "soft", "conservative", np.random.SeedSequence(5, spawn_key=(3,)))
    np.testing.assert_array_equal(first.y, second.y)
    np.testing.assert_array_equal(first.y, other_plant.y)


def test_every_fault_and_profile_has_a_reference():
    assert set(REFERENCE) == {(fault, profile) for fault, profiles in PLANT.faults.items() for profile in profiles}
    assert (REFERENCE["alpha", "step"].detect, REFERENCE["alpha", "soft"].isolate) == ("0.01", "about 3.5")


def test_banks_are_fresh_and_named_as_the_faults():
    first, second = PLANT.bank("quiet"), PLANT.bank("quiet")
    assert tuple(first.names) == ("nominal", *PLANT.faults)
    assert first.observers["nominal"] is not second.observers["nominal"]
    assert first.observers["nominal"].model is second.observers["nominal"].model  # a value, made once


def test_initial_set_holds_every_start_between_25_and_55():
    box = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    for V in np.linspace(25, 55, 7):
        assert box.contains(level_trim(Surrogate(), V).x)


@pytest.mark.parametrize("kind", PLANT.model_kinds)
@pytest.mark.parametrize("fault", PLANT.faults)
def test_quiet_step_is_detected_and_isolated_as_the_paper_says(fault, kind):
    plant = PLANT.with_models(kind)
    record = plant.bank("quiet").run(plant.simulate(fault, "step", "quiet", 11))
    first_faulty = round(PLANT.fault_time / PLANT.Ts)
    assert record.detected_at - first_faulty == (0 if fault == "alpha" else 1)
    assert record.fault == fault
    assert record.died_at[fault] is None


def test_under_architecture_two_a_fault_is_detected_at_the_same_sample_and_isolated():
    log = PLANT.simulate("elevator", "step", "quiet", 11)
    one, two = (Eclipse(architecture=number).bank("quiet").run(log) for number in ("I", "II"))
    assert two.detected_at == one.detected_at
    assert (two.fault, two.died_at["elevator"]) == ("elevator", None)
    assert two.isolated_at >= one.isolated_at
    assert np.isnan(two.seconds[: two.detected_at, 1:]).all()


def test_unknown_noise_and_reference_are_refused():
    with pytest.raises(ValueError, match="architecture is 'III'"):
        Eclipse(architecture="III")
    with pytest.raises(ValueError, match="loud"):
        PLANT.models("loud")
    with pytest.raises(ValueError, match="relative"):
        eclipse("relative")


def test_deviation_reference_changes_the_dynamics_fault_only():
    deviation = eclipse("deviation")
    for fault, same in (("elevator", True), ("dynamics", False)):
        ours, theirs = (p.simulate(fault, "step", "quiet", 0).y for p in (PLANT, deviation))
        assert (ours == theirs).all() == same
    assert deviation.lpv_models("quiet")["dynamics"].block("a", 37.0, uncertainty=0)[3] < 0


@pytest.mark.parametrize("kind", PLANT.model_kinds)
def test_dynamics_fault_in_deviation_coordinates_is_explained_by_the_nominal_model(kind):
    deviation = eclipse("deviation").with_models(kind)
    record = deviation.bank("quiet").run(deviation.simulate("dynamics", "step", "quiet", 0))
    assert record.detected_at is None
    assert record.alive.all()


def test_the_bank_of_the_other_architecture_starts_its_fault_observers_at_the_detection():
    plant = in_architecture(PLANT, "II")
    assert (architecture_of(PLANT), architecture_of(plant)) == ("I", "II")
    log = plant.simulate("elevator", "step", "quiet", 3)
    bank = plant.bank("quiet")
    states = [v.state for v in drive(bank, log)]
    record = plant.bank("quiet").run(log)
    assert isinstance(bank, ArchitectureII)
    assert record.fault == "elevator"
    assert states[:50] == ["nominal"] * 50
    assert record.died_at["elevator"] is None


def test_the_bank_of_the_simulators_equations_sees_the_same_flight_without_a_schedule():
    linear, exact = (with_bank(PLANT, BankChoice(models=kind)) for kind in ("lpv", "nonlinear"))
    assert (bank_choice(linear), bank_choice(exact)) == (BankChoice("I", "lpv"), BankChoice("I", "nonlinear"))
    assert bank_choice(PLANT) == bank_choice(exact)
    log = exact.simulate("elevator", "step", "quiet", 11)
    np.testing.assert_array_equal(log.y, linear.simulate("elevator", "step", "quiet", 11).y)
    assert log.schedule is None
    record = exact.bank("quiet").run(replace(log, time=log.time[:60], u=log.u[:60], y=log.y[:60], x=log.x[:60]))
    assert (record.detected_at, record.isolated_at, record.fault) == (51, 51, "elevator")
    assert exact.bank("quiet").observers["nominal"].model is exact.bank("quiet").observers["nominal"].model
    with pytest.raises(ValueError, match="model_kind is 'cubic'; expected 'lpv' or 'nonlinear'"):
        Eclipse(model_kind="cubic")


def test_an_excited_flight_follows_the_input_that_is_superposed():
    excitation = np.column_stack([np.full(20, 3.0), np.zeros(20)])
    plain = PLANT.scenarios.run("none", "none", "quiet", 0)
    excited = PLANT.scenarios.run("none", "none", "quiet", 0, excitation)
    np.testing.assert_array_equal(plain.flight.u[:50], excited.flight.u[:50])
    assert excited.flight.u[50, 0] == pytest.approx(plain.flight.u[50, 0] + 3.0)
    assert excited.flight.x[60, 3] > plain.flight.x[60, 3] + 0.01  # trailing edge up: nose up
    with pytest.raises(ValueError, match=r"excitation has shape \(20, 1\); expected finite numbers"):
        PLANT.scenarios.run("none", "none", "quiet", 0, np.zeros((20, 1)))


def test_faults_come_at_a_fraction_of_their_size():
    small = Scenarios(PLANT.scenarios.model, 0.3)
    for name in PLANT.faults:
        assert small.fault(name, "hard").magnitude == pytest.approx(0.3 * PLANT.scenarios.fault(name, "hard").magnitude)
    assert PLANT.stated_faults("quiet", 0.3)["elevator"].description == "15 % of the elevator's effect is lost"
    assert PLANT.stated_faults("quiet", 0.3)["elevator"].model.uncertainties[-1].bounds == pytest.approx((0.15, 0.15))
    with pytest.raises(ValueError, match=r"size is 0.0; expected a fraction"):
        Scenarios(size=0.0)

"""The bank around the logic, with observers that fall when they are told to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fake_observers import FakeObserver, FakeProof, FakeStep, fake, fake_model, log_of

from polytopes import HPolytope
from svo.isolation.architectures import ArchitectureI
from svo.logs.log import Log

NOTHING = np.array([])


def bank(**options: Any) -> ArchitectureI:
    """y = 1, 2, 3 falsifies nominal, a, b; y = 9 all of them."""
    observers = [FakeObserver(p) for p in (1.0, 2.0, 3.0)]
    return ArchitectureI(observers[0], {"a": observers[1], "b": observers[2]}, **options)


def test_detection_then_isolation_and_the_dead_rest() -> None:
    b = bank()
    assert b.names == ("nominal", "a", "b")
    first = b.update([0.0])
    assert (first.sample, first.state, first.alive) == (0, "nominal", ("nominal", "a", "b"))
    assert set(first.steps) == {"nominal", "a", "b"}
    detected = b.step([1.0], [1.0])
    assert (detected.sample, detected.state, detected.alive, detected.detected_at) == (1, "detected", ("a", "b"), 1)
    assert detected.steps["nominal"].certificate == FakeProof(1.0)
    isolated = b.step([1.0], [3.0])
    assert (isolated.state, isolated.fault, isolated.isolated_at) == ("isolated", "a", 2)
    assert set(isolated.steps) == {"a", "b"}
    last = b.step([1.0], [0.0])
    assert set(last.steps) == {"a"}
    assert len(fake(b, "nominal").calls) == 2
    assert len(fake(b, "b").calls) == 3
    unexplained = b.step([1.0], [2.0])
    assert (unexplained.state, unexplained.alive, unexplained.fault) == ("unexplained", (), None)
    assert b.step([1.0], [0.0]).steps == {}


def test_arguments_reach_every_observer() -> None:
    b = bank()
    b.update([0.0], u=[5.0], schedule=7.0)
    b.step([5.0], [0.5], u_next=[6.0], schedule=8.0)
    for name in b.names:
        assert fake(b, name).calls == [("update", 0.0, 7.0), ("step", 5.0, 0.5, 8.0)]


def test_an_undecided_answer_is_no_alarm() -> None:
    observers = [FakeObserver(1.0, undecided_at=4.0), FakeObserver(2.0)]
    record = ArchitectureI(observers[0], {"a": observers[1]}).run(log_of(0.0, 4.0, 0.0))
    assert record.states == ("nominal",) * 3
    np.testing.assert_array_equal(record.undecided, [[False, False], [True, False], [False, False]])


def test_a_falsification_without_a_certificate_is_refused() -> None:
    b = ArchitectureI(FakeObserver(1.0, certified=False), {"a": FakeObserver(2.0)})
    b.update([0.0])
    with pytest.raises(ValueError, match="observer 'nominal' answered 'falsified' without a certificate"):
        b.step([1.0], [1.0])


def test_the_record_of_a_run() -> None:
    record = bank().run(log_of(0.0, 0.0, 1.0, 0.0, 2.0, 0.0))
    assert record.states == ("nominal", "nominal", "detected", "detected", "isolated", "isolated")
    assert (record.detected_at, record.isolated_at, record.fault) == (2, 4, "b")
    assert record.died_at == {"nominal": 2, "a": 4, "b": None}
    assert record.certificates == {"nominal": FakeProof(1.0), "a": FakeProof(2.0), "b": None}
    np.testing.assert_array_equal(record.alive[:, 0], [True, True, False, False, False, False])
    np.testing.assert_array_equal(record.alive[:, 1], [True] * 4 + [False] * 2)
    np.testing.assert_array_equal(np.isnan(record.seconds[:, 0]), [False] * 3 + [True] * 3)
    assert not record.undecided.any()


def test_a_run_passes_the_schedule_of_each_sample() -> None:
    b, log = bank(), log_of(0.0, 0.0)
    b.run(Log(time=log.time, u=log.u, y=log.y, schedule=np.array([30.0, 31.0])))
    assert fake(b, "a").calls == [("update", 0.0, 30.0), ("step", 1.0, 0.0, 31.0)]


def test_warm_up_adds_the_observers() -> None:
    assert bank().warm_up() == 0.75


def test_reset_revives_everything() -> None:
    b = bank()
    b.run(log_of(0.0, 1.0, 2.0, 3.0))
    b.reset(HPolytope.box([0.0], [4.0]))
    assert fake(b, "nominal").calls[-1] == ("reset", 0.0, 4.0)
    assert b.update([0.0]).alive == b.names


# -- new starts ----------------------------------------------------------------------------------


def test_one_outlier_is_debounced_from_the_survivors_hull() -> None:
    b = bank(debounce=2)
    b.update([0.0], schedule=1.0)
    fake(b, "a").centre, fake(b, "b").centre = 2.0, -3.0
    verdict = b.step([1.0], [1.0], schedule=2.0)
    assert verdict.state == "nominal"
    # a is at 2 + 1 +- 1 and b at -3 + 1 +- 1 after the step.
    assert fake(b, "nominal").calls[-2] == ("reset", -3.0, 4.0)
    name, y, schedule = fake(b, "nominal").calls[-1]
    assert (name, schedule) == ("update", 2.0)
    assert np.isnan(y)
    assert b.step([1.0], [0.0]).state == "nominal"
    assert b.step([1.0], [1.0]).state == "detected"


def poisoned_bank(**options: Any) -> ArchitectureI:
    """One value of y falsifies every model."""
    return ArchitectureI(FakeObserver(9.0), {"a": FakeObserver(9.0), "b": FakeObserver(9.0)}, **options)


def test_an_outlier_that_nothing_explains_is_left_out() -> None:
    b = poisoned_bank(debounce=2)
    b.update([0.0], schedule=1.0)
    fake(b, "a").centre = 2.0
    b.step([0.5], [0.0], schedule=2.0)
    before = len(fake(b, "b").calls)
    verdict = b.step([1.0], [9.0], schedule=3.0)
    assert (verdict.state, verdict.alive) == ("nominal", b.names)
    # Boxes after sample 1: 0.5 +- 1 and 2.5 +- 1; the transition to sample 2 is repeated without y.
    stepped, reset, update, predicted = fake(b, "b").calls[before:]
    assert stepped == ("step", 1.0, 9.0, 3.0)
    assert reset == ("reset", -0.5, 3.5)
    assert (update[0], update[2]) == ("update", 2.0)
    assert (predicted[0], predicted[1], predicted[3]) == ("step", 1.0, 3.0)
    assert np.isnan(update[1])
    assert np.isnan(predicted[2])
    # A second one declares every model dead.
    assert b.step([1.0], [9.0]).state == "unexplained"


def test_two_outliers_in_a_row_move_the_hull_along() -> None:
    b = poisoned_bank(debounce=3)
    b.update([0.0])
    b.step([1.0], [9.0])
    b.step([1.0], [9.0])
    assert fake(b, "a").calls[-3] == ("reset", 0.0, 2.0)
    assert b.step([1.0], [0.0]).steps["a"].box[0] == 2.0


def test_recovery_from_one_outlier_that_nothing_explains() -> None:
    record = poisoned_bank(recovery=2).run(log_of(0.0, 0.0, 9.0, 0.0, 0.0, 0.0))
    assert record.states == ("nominal", "nominal", "unexplained", "unexplained", "nominal", "nominal")
    assert record.died_at == {"nominal": 2, "a": 2, "b": 2}
    assert record.alive[-1].all()


def test_a_fault_that_goes_away_is_declared_over() -> None:
    b = bank(recovery=3)
    record = b.run(log_of(0.0, 1.0, 2.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    assert record.states == ("nominal", "detected", *["isolated"] * 5, "nominal", "nominal")
    assert (record.detected_at, record.isolated_at, record.fault) == (1, 2, "b")
    assert record.alive[-1].all()
    assert ("reset", 6.0, 8.0) in fake(b, "a").calls


def test_timeout_starts_the_dead_again() -> None:
    record = bank(timeout=2).run(log_of(0.0, 1.0, 0.0, 0.0, 1.0))
    assert record.states == ("nominal", "detected", "detected", "nominal", "detected")
    assert record.detected_at == 1


def test_a_first_measurement_that_nothing_explains_has_nowhere_to_go() -> None:
    b = poisoned_bank(debounce=3, recovery=2)
    assert b.update([9.0]).state == "unexplained"
    assert b.step([1.0], [0.0]).state == "unexplained"


def test_boxes_are_not_computed_where_nothing_starts_again() -> None:
    class Touchy(FakeStep):
        def _box(self) -> Any:
            raise AssertionError("the bank read a box")

    class TouchyObserver(FakeObserver):
        answer = Touchy

    ArchitectureI(TouchyObserver(1.0), {"a": TouchyObserver(2.0)}).run(log_of(0.0, 1.0, 0.0))


def test_without_faults_a_bank_detects_only() -> None:
    record = ArchitectureI(FakeObserver(1.0), {}).run(log_of(0.0, 1.0, 0.0))
    assert record.states == ("nominal", "unexplained", "unexplained")
    assert record.detected_at == 1
    assert record.died_at == {"nominal": 1}


def test_without_faults_a_bank_recovers() -> None:
    record = ArchitectureI(FakeObserver(1.0), {}, recovery=2).run(log_of(0.0, 1.0, 0.0, 0.0, 0.0))
    assert record.states == ("nominal", "unexplained", "unexplained", "nominal", "nominal")


# -- refusals ------------------------------------------------------------------------------------


def test_names_and_observers_are_checked() -> None:
    one, two = FakeObserver(1.0), FakeObserver(2.0)
    with pytest.raises(TypeError, match="faults is a list"):
        ArchitectureI(one, [two])  # type: ignore[arg-type]
    for name in ("nominal", "", "  ", 3):
        with pytest.raises(ValueError, match="faults has the name"):
            ArchitectureI(one, {name: two})  # type: ignore[dict-item]
    with pytest.raises(TypeError, match="'a' is a str; expected an observer"):
        ArchitectureI(one, {"a": "b"})  # type: ignore[dict-item]
    with pytest.raises(ValueError, match="'a' and 'nominal' are the same observer"):
        ArchitectureI(one, {"a": one})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_inputs": 2}, "n_inputs = 2; expected 1"),
        ({"n_outputs": 3}, "n_outputs = 3; expected 1"),
        ({"Ts": 0.2}, r"Ts = 0.2; expected 0.1"),
    ],
)
def test_models_must_have_the_same_channels(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ArchitectureI(FakeObserver(1.0), {"a": FakeObserver(2.0, model=fake_model(**change))})


def test_states_must_agree_only_where_observers_start_again() -> None:
    pair = FakeObserver(1.0), {"a": FakeObserver(2.0, model=fake_model(n_states=2))}
    ArchitectureI(*pair)
    with pytest.raises(ValueError, match="n_states = 2; expected 1"):
        ArchitectureI(*pair, recovery=5)


@pytest.mark.parametrize("options", [{"debounce": 0}, {"debounce": None}, {"recovery": 0}, {"timeout": 1.5}])
def test_counts_are_checked(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"expected a number of samples >= 1"):
        bank(**options)


def test_the_order_of_calls_is_checked() -> None:
    b = bank()
    with pytest.raises(ValueError, match="step was called before the first measurement"):
        b.step([1.0], [0.0])
    b.update([0.0])
    with pytest.raises(ValueError, match="update was called after the first sample"):
        b.update([0.0])
    with pytest.raises(ValueError, match="already started"):
        b.run(log_of(0.0))


def test_logs_are_checked() -> None:
    empty = Log(time=NOTHING, u=np.zeros((0, 1)), y=np.zeros((0, 1)))
    with pytest.raises(ValueError, match="log has no samples"):
        bank().run(empty)
    with pytest.raises(ValueError, match=r"log.y has shape \(2, 2\); expected \(samples, 1\)"):
        bank().run(Log(time=np.arange(2.0), u=np.zeros((2, 1)), y=np.zeros((2, 2))))

"""Architecture II around its logic, with observers that fall when they are told to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fake_observers import FakeObserver, FakeProof, fake, fake_model, log_of

from polytopes import HPolytope
from svo.isolation.architectures import ArchitectureII

SET = HPolytope.box([-7.0], [5.0])


def bank(global_: Any = None, **options: Any) -> ArchitectureII:
    """y = 1, 2, 3, 4 falsifies nominal, a (class I), b, c (class II), 5 the global one; 9 everybody."""
    models = {n: FakeObserver((p, 9.0)) for n, p in (("nominal", 1.0), ("a", 2.0), ("b", 3.0), ("c", 4.0))}
    watch = FakeObserver((5.0, 9.0), width=6.0) if global_ is None else global_
    return ArchitectureII(models.pop("nominal"), models, global_=watch, class_one=("a",), **options)


def starts(of: ArchitectureII, name: str) -> list[tuple[float, float]]:
    """Intervals from which an observer was started."""
    return [call[1:] for call in fake(of, name).calls if call[0] == "reset"]


def test_class_two_starts_from_the_global_set_with_the_measurement_of_the_detection() -> None:
    b = bank()
    first = b.update([0.0], schedule=6.0)
    assert (first.state, first.alive) == ("nominal", ("nominal", "a", "b", "c"))
    assert set(first.steps) == {"nominal", "a", "global"}
    detected = b.step([1.0], [1.0], schedule=7.0)
    assert (detected.state, detected.alive, detected.detected_at) == ("detected", ("a", "b", "c"), 1)
    assert set(detected.steps) == {"nominal", "a", "b", "c", "global"}
    # The global set is 0 + 1 +- 6 after the step.
    for name in "bc":
        assert fake(b, name).calls == [("reset", -5.0, 7.0), ("update", 1.0, 7.0)]
        assert detected.steps[name].box[1] == 7.0
    assert starts(b, "a") == starts(b, "nominal") == starts(b, "global") == []
    isolated = b.step([1.0], [2.0], schedule=8.0)
    assert (isolated.state, isolated.alive) == ("detected", ("b", "c"))
    isolated = b.step([1.0], [3.0])
    assert (isolated.state, isolated.fault, isolated.isolated_at) == ("isolated", "c", 3)
    assert set(b.step([1.0], [0.0]).steps) == {"c", "global"}


def test_a_class_two_model_can_fall_at_the_sample_of_the_detection() -> None:
    b = bank()
    fake(b, "c").poison = 1.0
    b.update([0.0])
    detected = b.step([1.0], [1.0])
    assert (detected.state, detected.alive) == ("detected", ("a", "b"))
    assert detected.steps["c"].certificate == FakeProof(1.0)
    record = bank().run(log_of(0.0, 1.0, 2.0, 3.0))
    assert record.died_at == {"nominal": 1, "a": 2, "b": 3, "c": None}
    one_left = bank()
    fake(one_left, "a").poison, fake(one_left, "c").poison = 1.0, 1.0
    record = one_left.run(log_of(0.0, 1.0, 0.0))
    assert (record.detected_at, record.isolated_at, record.fault) == (1, 1, "b")
    assert record.died_at["c"] == 1
    assert record.certificates["c"] == FakeProof(1.0)


def test_a_detection_at_the_first_sample() -> None:
    b = bank()
    assert b.update([1.0]).state == "detected"
    assert fake(b, "b").calls == [("reset", -6.0, 6.0), ("update", 1.0, None)]


def test_a_falsified_global_observer_is_a_result_with_its_certificate() -> None:
    b = bank()
    b.update([0.0])
    verdict = b.step([1.0], [5.0])
    assert (verdict.state, verdict.alive, verdict.fault, verdict.detected_at) == ("unexplained", (), None, 1)
    assert verdict.steps["global"].certificate == FakeProof((5.0, 9.0))
    assert b.step([1.0], [0.0]).steps == {}
    record = bank().run(log_of(0.0, 0.0, 5.0, 0.0))
    assert record.states == ("nominal", "nominal", "unexplained", "unexplained")
    assert record.died_at["global"] == 2
    assert record.certificates["global"] == FakeProof((5.0, 9.0))
    assert record.names == ("nominal", "a", "b", "c")
    np.testing.assert_array_equal(np.isnan(record.global_seconds), [False, False, False, True])


def test_a_first_measurement_that_the_global_model_does_not_explain_has_nowhere_to_go() -> None:
    b = bank(debounce=3, recovery=2)
    assert b.update([5.0]).state == "unexplained"
    assert b.step([1.0], [0.0]).state == "unexplained"


def test_a_constant_set_in_place_of_the_global_observer() -> None:
    b = bank(SET, recovery=2)
    assert set(b.observers) == {"nominal", "a", "b", "c"}
    b.update([0.0])
    assert set(b.step([1.0], [1.0]).steps) == {"nominal", "a", "b", "c"}
    assert starts(b, "nominal") == starts(b, "b") == starts(b, "c") == [(-7.0, 5.0)]
    assert np.isnan(fake(b, "nominal").calls[-1][1])
    assert fake(b, "b").calls[-1] == ("update", 1.0, None)
    assert bank(SET).run(log_of(0.0)).global_seconds is None


# -- new starts ----------------------------------------------------------------------------------


def test_exactly_one_outlier_is_debounced_from_the_global_set() -> None:
    b = bank(debounce=2)
    b.update([0.0])
    verdict = b.step([1.0], [1.0])
    assert (verdict.state, verdict.alive) == ("nominal", b.names)
    assert starts(b, "nominal") == [(-5.0, 7.0)]
    assert np.isnan(fake(b, "nominal").calls[-1][1])
    for _ in range(5):
        assert b.step([1.0], [0.0]).state == "nominal"
    assert fake(b, "b").calls == []
    assert b.step([1.0], [1.0]).state == "detected"


def test_exactly_one_outlier_that_nothing_explains_is_debounced_too() -> None:
    b = bank(debounce=2)
    b.update([0.0], schedule=1.0)
    b.step([0.5], [0.0], schedule=2.0)
    verdict = b.step([1.0], [9.0], schedule=3.0)
    assert (verdict.state, verdict.alive) == ("nominal", b.names)
    # The global set was 0.5 +- 6; the transition is repeated without y, and the others start from there.
    reset, update, predicted = fake(b, "global").calls[-3:]
    assert reset == ("reset", -5.5, 6.5)
    assert (update[0], update[2], predicted[0], predicted[1], predicted[3]) == ("update", 2.0, "step", 1.0, 3.0)
    assert np.isnan([update[1], predicted[2]]).all()
    assert starts(b, "nominal") == starts(b, "a") == [(-4.5, 7.5)]
    assert b.step([1.0], [0.0]).state == "nominal"
    assert b.step([1.0], [9.0]).state == "unexplained"


def test_an_outlier_at_the_start_of_class_two_counts_once() -> None:
    b = bank(debounce=2)
    fake(b, "c").poison = 1.0
    b.update([0.0])
    b.step([1.0], [1.0])
    detected = b.step([1.0], [1.0])
    assert (detected.state, detected.alive) == ("detected", ("a", "b", "c"))
    assert [call[0] for call in fake(b, "c").calls] == ["reset", "update", "reset", "update"]
    assert fake(b, "c").calls[1][1] == 1.0
    assert np.isnan(fake(b, "c").calls[3][1])
    assert b.step([1.0], [1.0]).alive == ("a", "b")


def test_a_fault_that_goes_away_restarts_everybody_from_the_global_set() -> None:
    b = bank(recovery=3)
    record = b.run(log_of(0.0, 1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    assert record.states == ("nominal", "detected", "detected", *["isolated"] * 4, "nominal", "nominal")
    assert (record.detected_at, record.isolated_at, record.fault) == (1, 3, "c")
    assert record.alive[-1].all()
    # At sample 7 the global set is 7 +- 6.
    assert starts(b, "nominal") == [(-5.0, 7.0), (-2.0, 10.0), (1.0, 13.0)]
    assert starts(b, "a") == [(1.0, 13.0)]
    assert starts(b, "c") == [(-5.0, 7.0)]
    assert np.isnan(record.seconds[8, 2:]).all()


def test_a_fall_at_the_start_of_class_two_counts_no_sample_twice() -> None:
    b = bank(recovery=2)
    fake(b, "c").poison = 1.0
    assert b.run(log_of(0.0, 1.0, 0.0, 0.0)).states == ("nominal", "detected", "detected", "nominal")


def test_boxes_can_be_read_at_the_sample_of_the_restart() -> None:
    b = bank(recovery=1)
    b.update([0.0])
    b.step([1.0], [1.0])
    over = b.step([1.0], [0.0])
    assert over.state == "nominal"
    assert over.steps["nominal"].box[0] == -4.0


def test_recovery_from_one_outlier_that_nothing_explains() -> None:
    b = bank(recovery=2)
    record = b.run(log_of(0.0, 0.0, 9.0, 0.0, 0.0, 0.0))
    assert record.states == ("nominal", "nominal", "unexplained", "unexplained", "nominal", "nominal")
    assert record.died_at["global"] == 2
    assert record.alive[-1].all()
    assert starts(b, "b") == [(-4.0, 8.0)]


def test_timeout_restarts_everybody_from_the_global_set() -> None:
    b = bank(timeout=2)
    record = b.run(log_of(0.0, 1.0, 0.0, 0.0, 1.0))
    assert record.states == ("nominal", "detected", "detected", "nominal", "detected")
    assert starts(b, "nominal") == starts(b, "a") == [(-3.0, 9.0)]
    assert starts(b, "b") == [(-5.0, 7.0), (-2.0, 10.0)]


def test_reset_revives_everything() -> None:
    b = bank(recovery=2)
    b.run(log_of(0.0, 1.0, 2.0, 5.0))
    b.reset(HPolytope.box([0.0], [4.0]))
    assert starts(b, "global")[-1] == starts(b, "nominal")[-1] == (0.0, 4.0)
    assert b.update([0.0]).alive == b.names


# -- refusals ------------------------------------------------------------------------------------


def two(**options: Any) -> ArchitectureII:
    return ArchitectureII(FakeObserver(1.0), options.pop("faults", {"a": FakeObserver(2.0)}), **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"faults": {"global": FakeObserver(2.0)}, "global_": SET}, "not 'nominal' or 'global'"),
        ({"global_": SET, "class_one": ("b",)}, "class_one has the name 'b'; expected names among the faults: a"),
        ({"global_": HPolytope.box([0.0, 0.0], [1.0, 1.0])}, "global_ has dimension 2; expected 1"),
        ({"global_": HPolytope.empty(1)}, "global_ is empty"),
        ({"global_": HPolytope.box([0.0], [np.inf])}, "global_ is unbounded"),
        ({"global_": FakeObserver(5.0, model=fake_model(n_states=2))}, "'global' has n_states = 2; expected 1"),
        ({"global_": SET, "debounce": 0}, "debounce is 0; expected a number of samples >= 1"),
    ],
)
def test_bad_arguments_are_refused_by_name(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        two(**options)


def test_class_one_is_not_a_string() -> None:
    with pytest.raises(TypeError, match="class_one is the string 'a'"):
        two(global_=SET, class_one="a")


def test_an_observer_stands_only_once() -> None:
    one = FakeObserver(2.0)
    with pytest.raises(ValueError, match="'global' and 'a' are the same observer"):
        two(faults={"a": one}, global_=one)

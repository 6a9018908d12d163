"""The logic of Architecture II, transition by transition; a is of class I, b and c are of class II."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.isolation.global_logic import GlobalLogic
from svo.isolation.logic import IsolationLogic, LogicState, Tally

NAMES = ("nominal", "a", "b", "c")
EVERYONE = (*NAMES, "global")


def logic(**options: Any) -> GlobalLogic:
    return GlobalLogic(NAMES, class_two=("b", "c"), **options)


def feed(machine: IsolationLogic, *falsified: str) -> list[LogicState]:
    """States after each sample; a sample is written as the falsified names, "" for none, "?a" for a undecided."""
    states, state = [], machine.initial()
    for k, text in enumerate(falsified):
        words = text.split()
        fallen = [w for w in words if not w.startswith("?")]
        assert set(fallen) <= set(state.running), "the test falsifies an observer that does not run"
        state = machine.advance(state, k, fallen, [w[1:] for w in words if w.startswith("?")])
        states.append(state)
    return states


def test_class_two_is_alive_but_waits_while_the_nominal_model_stands() -> None:
    first = logic().initial()
    assert (first.state, first.alive, first.running) == ("nominal", NAMES, ("nominal", "a", "global"))
    assert logic().advance(first, 5, ()) is first


def test_nominal_to_detected_starts_class_two() -> None:
    (state,) = feed(logic(), "nominal")
    assert (state.state, state.alive, state.detected_at) == ("detected", ("a", "b", "c"), 0)
    assert state.running == ("a", "b", "c", "global")
    assert state.restart == ("b", "c")


def test_detected_to_isolated() -> None:
    _, detected, isolated, later = feed(logic(), "nominal", "a", "c", "")
    assert (detected.state, detected.restart) == ("detected", ())
    assert (isolated.state, isolated.fault, isolated.isolated_at) == ("isolated", "b", 2)
    assert isolated.running == ("b", "global")
    assert later is isolated


def test_nominal_to_isolated_when_class_two_falls_as_it_starts() -> None:
    machine = logic()
    (detected,) = feed(machine, "nominal a")
    at_once = machine.advance(detected, 0, ["c"], undecided=EVERYONE)
    assert (at_once.state, at_once.fault, at_once.isolated_at, at_once.restart) == ("isolated", "b", 0, ())


def test_an_early_fall_of_class_one_is_no_detection() -> None:
    early, detected = feed(logic(), "a", "nominal")
    assert (early.state, early.alive) == ("nominal", ("nominal", "b", "c"))
    assert (detected.state, detected.restart) == ("detected", ("b", "c"))


@pytest.mark.parametrize("before", [(), ("nominal",), ("nominal", "a b")], ids=["nominal", "detected", "isolated"])
def test_from_any_state_a_falsified_global_model_leaves_nothing(before: tuple[str, ...]) -> None:
    state = feed(logic(), *before, "global")[-1]
    assert (state.state, state.alive, state.running, state.fault) == ("unexplained", (), (), None)
    assert state.detected_at == 0
    assert logic().advance(state, 9, ()) is state


def test_every_model_falsified_is_unexplained_though_the_global_one_stands() -> None:
    final = feed(logic(), "nominal a", "b c", "")[-1]
    assert (final.state, final.running) == ("unexplained", ())
    trial = feed(logic(recovery=2), "nominal a", "b c nominal")[-1]
    assert (trial.state, trial.running, trial.restart) == ("unexplained", EVERYONE, NAMES)


def test_detected_to_nominal_by_recovery_starts_everybody_afresh() -> None:
    detected, again, calm, over = feed(logic(recovery=2), "nominal", "nominal", "", "")
    assert detected.running == EVERYONE
    assert detected.restart == ("nominal", "b", "c")
    assert (again.restart, calm.restart) == (("nominal",), ())
    assert (over.state, over.alive, over.running) == ("nominal", NAMES, ("nominal", "a", "global"))
    assert over.restart == ("nominal", "a")
    assert over.tallies == (Tally(),) * 5


def test_isolated_to_nominal_by_recovery() -> None:
    *_, isolated, over = feed(logic(recovery=2), "nominal a", "c", "")
    assert (isolated.state, isolated.fault) == ("isolated", "b")
    assert (over.state, over.restart) == ("nominal", ("nominal", "a"))


def test_unexplained_to_nominal_by_recovery() -> None:
    lost, waiting, over = feed(logic(recovery=2), "global", "", "")
    assert (lost.state, lost.running, lost.restart) == ("unexplained", EVERYONE, EVERYONE)
    assert waiting.state == "unexplained"
    assert (over.state, over.restart) == ("nominal", ("nominal", "a"))


def test_unexplained_to_isolated_by_the_fault_that_passes_its_trial() -> None:
    back = feed(logic(recovery=2), "global", "nominal a c", "nominal a c")[-1]
    assert (back.state, back.fault, back.isolated_at, back.running) == ("isolated", "b", 2, ("nominal", "b", "global"))
    assert back.tallies[-1] == Tally()


def test_another_fall_of_the_global_model_starts_the_trial_again() -> None:
    states = feed(logic(recovery=2), "global", "", "global", "", "")
    assert [s.state for s in states] == ["unexplained"] * 4 + ["nominal"]
    assert states[2].restart == EVERYONE


def test_timeout_starts_everybody_afresh() -> None:
    *_, waiting, over = feed(logic(timeout=2), "", "nominal", "", "")
    assert waiting.state == "detected"
    assert (over.state, over.alive, over.running, over.restart) == (
        "nominal", NAMES, ("nominal", "a", "global"), ("nominal", "a"),
    )  # fmt: skip


def test_timeout_does_not_touch_an_isolated_fault() -> None:
    assert feed(logic(timeout=2), "nominal", "a b", "", "", "")[-1].state == "isolated"


def test_debounce_counts_falsifications_after_new_starts() -> None:
    first, between, second = feed(logic(debounce=2), "nominal a", "", "nominal")
    assert (first.state, first.alive, first.restart) == ("nominal", NAMES, ("nominal", "a"))
    assert between.running == ("nominal", "a", "global")
    assert (second.state, second.alive, second.restart) == ("detected", ("a", "b", "c"), ("b", "c"))
    one, two = feed(logic(debounce=2), "nominal", "nominal", "b", "b c")[2:]
    assert (one.alive, one.restart) == (("a", "b", "c"), ("b",))
    assert (two.alive, two.restart) == (("a", "c"), ("c",))


def test_debounce_counts_the_global_models_own_falls() -> None:
    first, second = feed(logic(debounce=2), "global", "global")
    assert (first.state, first.alive, first.restart) == ("nominal", NAMES, ("global",))
    assert (second.state, second.alive, second.running) == ("unexplained", (), ())
    machine = logic(debounce=2, recovery=3)
    assert feed(machine, "global", "", "", "global")[-1].state == "unexplained"
    assert feed(machine, "global", "", "", "", "global")[-1].state == "nominal"


def test_a_constant_set_is_never_stepped() -> None:
    machine = logic(observed=False, recovery=1)
    assert machine.initial().running == ("nominal", "a")
    assert all("global" not in s.running + s.restart for s in feed(machine, "nominal a", "b c nominal", ""))


def test_without_class_two_and_a_set_it_is_the_machine_of_architecture_one() -> None:
    one, two = IsolationLogic(NAMES), GlobalLogic(NAMES, observed=False)
    for events in (["nominal", "b", "c"], ["a b c", "nominal"], ["nominal a b c", ""]):
        assert feed(one, *events) == feed(two, *events)


EVENTS = st.lists(st.tuples(st.sets(st.sampled_from(EVERYONE)), st.sets(st.sampled_from(EVERYONE))), max_size=40)


@given(st.integers(1, 3), st.none() | st.integers(1, 4), st.none() | st.integers(1, 6), st.booleans(), EVENTS)
def test_invariants_of_any_run(
    debounce: int, recovery: int | None, timeout: int | None, observed: bool, events: list[tuple[set[str], set[str]]]
) -> None:
    machine = logic(debounce=debounce, recovery=recovery, timeout=timeout, observed=observed)
    state = machine.initial()
    for k, (fallen, unsure) in enumerate(events):
        before, running = state, set(state.running)
        fallen, unsure = fallen & running, (unsure - fallen) & running
        state = machine.advance(before, k, fallen, unsure)
        nominal = "nominal" in state.alive
        expected = (
            "nominal"
            if nominal
            else ("unexplained", "isolated")[len(state.alive)]
            if len(state.alive) < 2
            else "detected"
        )
        assert state.state == expected
        assert (state.fault is not None) == (state.isolated_at is not None) == (state.state == "isolated")
        assert (state.detected_at is None) == (state.state == "nominal")
        assert list(state.running) == [n for n in EVERYONE if n in state.running]
        assert ("global" in state.running) == (observed and bool(state.running))
        assert {"b", "c"}.isdisjoint(state.running) or not nominal
        waiting = {"b", "c"} if nominal else set()
        assert set(state.alive) - waiting <= set(state.running)
        # Whoever runs next and fell just now, or did not run, starts again.
        assert {n for n in state.running if n in fallen or n not in running} <= set(state.restart) <= set(state.running)

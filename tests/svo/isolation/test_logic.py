"""The isolation logic, transition by transition, without any observer."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.isolation.logic import IsolationLogic, LogicState, Tally

NAMES = ("nominal", "a", "b", "c")


def feed(logic: IsolationLogic, *falsified: str) -> list[LogicState]:
    """States after each sample; a sample is written as the falsified names, "" for none, "?a" for a undecided."""
    states, state = [], logic.initial()
    for k, text in enumerate(falsified):
        words = text.split()
        undecided = [w[1:] for w in words if w.startswith("?")]
        fallen = [w for w in words if not w.startswith("?")]
        assert set(fallen) <= set(state.running), "the test falsifies an observer that does not run"
        state = logic.advance(state, k, fallen, undecided)
        states.append(state)
    return states


def test_nothing_falsified_is_nominal_and_costs_nothing() -> None:
    logic = IsolationLogic(NAMES)
    first = logic.initial()
    assert first.state == "nominal"
    assert first.alive == first.running == NAMES
    assert logic.advance(first, 5, ()) is first


def test_nominal_to_detected_to_isolated() -> None:
    _, detected, still, isolated = feed(IsolationLogic(NAMES), "", "nominal", "b", "c")
    assert (detected.state, detected.alive, detected.fault) == ("detected", ("a", "b", "c"), None)
    assert (detected.detected_at, detected.isolated_at) == (1, None)
    assert (still.state, still.alive) == ("detected", ("a", "c"))
    assert (isolated.state, isolated.alive, isolated.fault) == ("isolated", ("a",), "a")
    assert (isolated.detected_at, isolated.isolated_at) == (1, 3)
    assert isolated.running == ("a",)
    assert all(not s.restart for s in (detected, still, isolated))


def test_detected_and_isolated_at_one_sample() -> None:
    (state,) = feed(IsolationLogic(NAMES), "nominal a b")
    assert (state.state, state.fault, state.detected_at, state.isolated_at) == ("isolated", "c", 0, 0)


def test_fault_observers_may_fall_while_the_nominal_one_stands() -> None:
    early, detected = feed(IsolationLogic(NAMES), "a b", "nominal")
    assert (early.state, early.alive) == ("nominal", ("nominal", "c"))
    assert (detected.state, detected.fault, detected.isolated_at) == ("isolated", "c", 1)
    alone = feed(IsolationLogic(NAMES), "a b c")[0]
    assert (alone.state, alone.alive) == ("nominal", ("nominal",))


def test_isolated_to_unexplained_is_final_without_recovery() -> None:
    *_, isolated, unexplained, later = feed(IsolationLogic(NAMES), "nominal a", "b", "c", "")
    assert isolated.state == "isolated"
    assert (unexplained.state, unexplained.alive, unexplained.running) == ("unexplained", (), ())
    assert (unexplained.fault, unexplained.detected_at, unexplained.isolated_at) == (None, 0, None)
    assert later == unexplained


def test_nominal_to_unexplained() -> None:
    (state,) = feed(IsolationLogic(NAMES), "nominal a b c")
    assert (state.state, state.detected_at) == ("unexplained", 0)


def test_debounce_asks_for_several_falsifications_after_new_starts() -> None:
    first, between, second = feed(IsolationLogic(NAMES, debounce=2), "nominal a", "", "nominal")
    assert (first.state, first.alive, first.restart) == ("nominal", NAMES, ("nominal", "a"))
    assert between.restart == ()
    assert (second.state, second.alive, second.restart) == ("detected", ("a", "b", "c"), ())
    assert second.detected_at == 2


def test_debounce_does_not_forget_without_recovery() -> None:
    states = feed(IsolationLogic(NAMES, debounce=2), "nominal", *[""] * 50, "nominal")
    assert states[-1].state == "detected"


def test_recovery_forgets_falsifications_short_of_the_debounce() -> None:
    logic = IsolationLogic(NAMES, debounce=2, recovery=3)
    assert feed(logic, "nominal", "", "", "nominal")[-1].state == "detected"
    forgiven = feed(logic, "nominal", "", "", "", "nominal")
    assert forgiven[-1].state == "nominal"
    assert forgiven[-2].settled


def test_recovery_puts_the_nominal_model_on_trial_and_ends_the_fault() -> None:
    logic = IsolationLogic(NAMES, recovery=2)
    detected, again, calm, over = feed(logic, "nominal a", "nominal", "", "")
    assert (detected.state, detected.running, detected.restart) == ("detected", ("nominal", "b", "c"), ("nominal",))
    assert detected.alive == ("b", "c")
    assert again.restart == ("nominal",)
    assert calm.restart == ()
    assert (over.state, over.alive, over.running) == ("nominal", NAMES, NAMES)
    assert over.restart == ("a",)
    assert (over.detected_at, over.isolated_at, over.fault) == (None, None, None)
    assert over.tallies == (Tally(),) * 4


def test_an_undecided_sample_does_not_count_as_consistent() -> None:
    logic = IsolationLogic(NAMES, recovery=2)
    assert feed(logic, "nominal", "?nominal", "")[-1].state == "detected"
    assert feed(logic, "nominal", "?nominal", "", "")[-1].state == "nominal"


def test_an_isolated_fault_can_be_over() -> None:
    *_, isolated, over = feed(IsolationLogic(NAMES, recovery=2), "nominal a b", "", "")
    assert isolated.state == "isolated"
    assert (over.state, over.restart) == ("nominal", ("a", "b"))


def test_a_survivor_that_falls_as_the_fault_ends_starts_again() -> None:
    over = feed(IsolationLogic(NAMES, recovery=2), "nominal a b", "", "c")[-1]
    assert (over.state, over.restart) == ("nominal", ("a", "b", "c"))


def test_unexplained_puts_all_on_trial_and_the_nominal_model_wins() -> None:
    states = feed(IsolationLogic(NAMES, recovery=2), "nominal a b c", "", "")
    assert (states[0].state, states[0].alive, states[0].running) == ("unexplained", (), NAMES)
    assert states[0].restart == NAMES
    assert states[1].state == "unexplained"
    assert (states[2].state, states[2].alive, states[2].restart) == ("nominal", NAMES, ())


def test_unexplained_is_left_by_the_faults_that_pass_their_trial() -> None:
    states = feed(IsolationLogic(NAMES, recovery=2), "nominal a b c", "nominal a", "nominal", "nominal")
    assert states[1].restart == ("nominal", "a")
    back = states[2]
    assert (back.state, back.alive, back.running) == ("detected", ("b", "c"), ("nominal", "b", "c"))
    assert (back.detected_at, back.isolated_at) == (2, None)
    assert back.restart == ("nominal",)
    assert back.tallies[2] == Tally()
    alone = feed(IsolationLogic(NAMES, recovery=2), "nominal a b c", "nominal a b", "nominal a b")[-1]
    assert (alone.state, alone.fault, alone.isolated_at) == ("isolated", "c", 2)


def test_timeout_revives_all_models() -> None:
    logic = IsolationLogic(NAMES, timeout=3)
    states = feed(logic, "", "nominal a", "", "", "")
    assert [s.state for s in states] == ["nominal", "detected", "detected", "detected", "nominal"]
    assert states[-1].restart == ("nominal", "a")
    assert states[-1].detected_at is None


def test_timeout_does_not_touch_an_isolated_fault() -> None:
    states = feed(IsolationLogic(NAMES, timeout=3), "nominal", "", "a b", *[""] * 5)
    assert [s.state for s in states[2:]] == ["isolated"] * 6


def test_isolation_at_the_sample_of_the_timeout_counts() -> None:
    assert feed(IsolationLogic(NAMES, timeout=2), "nominal", "", "a b")[-1].state == "isolated"


def test_giving_up_is_final() -> None:
    logic = IsolationLogic(NAMES, recovery=2)
    state = logic.give_up(logic.initial(), 0)
    assert (state.state, state.alive, state.running, state.detected_at) == ("unexplained", (), (), 0)
    assert logic.advance(state, 1, ()) is state


@pytest.mark.parametrize(
    ("options", "expected"), [({}, False), ({"debounce": 2}, True), ({"recovery": 1}, True), ({"timeout": 1}, True)]
)
def test_whether_observers_can_start_again(options: dict[str, int], expected: bool) -> None:
    assert IsolationLogic(NAMES, **options).may_restart is expected


@given(
    debounce=st.integers(1, 3),
    recovery=st.none() | st.integers(1, 4),
    timeout=st.none() | st.integers(1, 6),
    events=st.lists(st.tuples(st.sets(st.sampled_from(NAMES)), st.sets(st.sampled_from(NAMES))), max_size=40),
)
def test_invariants_of_any_run(
    debounce: int, recovery: int | None, timeout: int | None, events: list[tuple[set[str], set[str]]]
) -> None:
    logic = IsolationLogic(NAMES, debounce, recovery, timeout)
    state = logic.initial()
    for k, (fallen, unsure) in enumerate(events):
        before = state
        running = set(before.running)
        fallen, unsure = fallen & running, (unsure - fallen) & running
        state = logic.advance(before, k, fallen, unsure)
        faults = [n for n in state.alive if n != "nominal"]
        expected = {
            "nominal": "nominal" in state.alive,
            "detected": "nominal" not in state.alive and len(faults) > 1,
            "isolated": "nominal" not in state.alive and len(faults) == 1,
            "unexplained": not state.alive,
        }
        assert expected[state.state]
        assert (state.fault is not None) == (state.isolated_at is not None) == (state.state == "isolated")
        assert (state.detected_at is None) == (state.state == "nominal")
        assert list(state.alive) == [n for n in NAMES if n in state.alive]
        assert list(state.running) == [n for n in NAMES if n in state.running]
        assert set(state.alive) <= set(state.running)
        assert set(state.restart) <= set(state.running)
        # Whoever runs next and fell just now, or did not run, starts again; nobody else does.
        assert set(state.restart) == {n for n in state.running if n in fallen or n not in running}
        if not fallen and not unsure:
            assert logic.advance(replace(state, settled=False), k + 1, ()) == logic.advance(state, k + 1, ())

"""Observers that keep every rule pass, and each broken one is caught by its own rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from docs.examples.interval_observer import IntervalObserver
from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, PolytopeObserver, UncertainModel, WindowObserver
from svo.testing import OBSERVER_RULES, ConformanceError, Kind, check_observer
from tests.testing.broken.first_breach import broken_rules
from tests.testing.broken.observers import BROKEN_OBSERVERS, AlarmWithoutProof
from tests.testing.broken.subclasses import broken_subclasses

ROOT = Path(__file__).parents[2]
OWN = (WindowObserver, PolytopeObserver, ConstrainedZonotopeObserver)
NOT_DECLARED = {"deadline", "late at its sample"}


def long_window(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    return WindowObserver(model, initial, horizon=None)


def short_slanted_window(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    return WindowObserver(model, initial, horizon=2, template=np.ones((1, model.n_states)))


@pytest.mark.parametrize("make", [WindowObserver, long_window, short_slanted_window])
def test_the_window_observer_keeps_every_rule(make: Any) -> None:
    found = check_observer(make)
    assert found.kept == tuple(OBSERVER_RULES)
    assert not found.left_out


@pytest.mark.parametrize("make", [PolytopeObserver, ConstrainedZonotopeObserver, IntervalObserver])
def test_the_others_keep_every_rule_of_what_they_declare(make: Any) -> None:
    found = check_observer(make)
    assert set(found.kept) == set(OBSERVER_RULES) - NOT_DECLARED
    assert set(found.left_out) == NOT_DECLARED


# What cannot hold either once a rule is broken.
FOLLOWS = {
    "every possible state": {"healthy plant"},
    "input of its sample": {"every possible state", "healthy plant", "saved state"},
    "box": {"every possible state", "healthy plant"},
    "runs apart": {"reset after falsification"},
    "missing readings": {"undecided is an answer"},
}


@pytest.mark.parametrize("broken", BROKEN_OBSERVERS)
def test_a_broken_observer_is_caught_by_its_own_rule(broken: Any) -> None:
    own, found = BROKEN_OBSERVERS[broken], broken_rules(OBSERVER_RULES, Kind(broken))
    assert found[0] == own
    assert set(found) <= {own} | FOLLOWS.get(own, set())


SUBCLASSES = [
    pytest.param(broken, rule, marks=() if kind is WindowObserver else pytest.mark.slow)
    for kind in OWN
    for broken, rule in broken_subclasses(kind).items()
]


@pytest.mark.parametrize(("broken", "rule"), SUBCLASSES)
def test_an_observer_that_a_subclass_breaks_is_caught(broken: Any, rule: str) -> None:
    with pytest.raises(ConformanceError) as caught:
        check_observer(broken)
    assert caught.value.rule == rule


def test_the_error_says_which_rule_what_was_seen_and_what_to_do() -> None:
    with pytest.raises(ConformanceError) as caught:
        check_observer(AlarmWithoutProof)
    error = caught.value
    assert isinstance(error, AssertionError)
    assert (error.rule, error.found) == ("alarm with proof", "falsified at sample 4 without a certificate")
    assert all(part in str(error) for part in (error.rule, error.found, error.says, error.advice))


class Shrunk:
    """An observer of which one part of each answer is smaller by 1e-9 of its width."""

    def __init__(self, observer: Any, part: str) -> None:
        self._observer, self._part, self.model = observer, part, observer.model

    def __getattr__(self, name: str) -> Any:
        return getattr(self._observer, name)

    def update(self, *given: Any, **named: Any) -> Any:
        return shrunk(self._observer.update(*given, **named), self._part)

    def step(self, *given: Any, **named: Any) -> Any:
        return shrunk(self._observer.step(*given, **named), self._part)


def shrunk(step: Any, part: str) -> Any:
    shown = {name: getattr(step, name) for name in ("verdict", "certificate", "box", "set")}
    shown["support"] = step.support
    if step.verdict == "consistent" and part == "box":
        lower, upper = step.box
        shown["box"] = lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower)
    if step.verdict == "consistent" and part == "support":
        shown["support"] = lambda d: step.support(d) - 1e-9 * (step.support(d) + step.support(-np.asarray(d)))
    if step.verdict == "consistent" and part == "set":
        widths = step.support(step.set.A) + step.support(-step.set.A)
        shown["set"] = HPolytope(step.set.A, step.set.b - 1e-9 * widths)
    return SimpleNamespace(**shown)


@pytest.mark.parametrize("make", [*OWN, long_window, short_slanted_window])
@pytest.mark.parametrize("part", ["box", "support", "set"])
def test_a_part_of_an_answer_that_is_short_by_1e_9_of_its_width_is_seen(make: Any, part: str) -> None:
    rule = OBSERVER_RULES["every possible state"]
    with pytest.raises(ConformanceError, match=f"{part} in direction"):
        rule.check(Kind(lambda model, initial: Shrunk(make(model, initial), part)))


def test_a_kind_that_refuses_models_is_asked_about_the_others() -> None:
    def without_uncertainties(model: UncertainModel, initial: HPolytope) -> IntervalObserver:
        if model.uncertainties or model.is_scheduled:
            raise NotImplementedError("constant and certain matrices only")
        return IntervalObserver(model, initial)

    found = check_observer(without_uncertainties)
    assert found.left_out["models with an uncertain pole"] == "constant and certain matrices only"


def test_a_kind_that_takes_no_model_at_all_breaks_a_rule() -> None:
    def refuses(model: UncertainModel, initial: HPolytope) -> Any:
        raise NotImplementedError("later")

    with pytest.raises(ConformanceError, match="NotImplementedError: later"):
        check_observer(refuses)


def test_the_page_lists_every_rule() -> None:
    page = (ROOT / "docs" / "write_an_observer.md").read_text(encoding="utf-8")
    rows = [f"| {rule.name} | {rule.says} | {rule.advice} |" for rule in OBSERVER_RULES.values()]
    assert "\n".join(rows) in page


def test_what_cannot_be_called_makes_no_observer() -> None:
    with pytest.raises(TypeError, match="make is int; expected a class of observers, or a function"):
        check_observer(3)  # type: ignore[arg-type]


def without(*blocks: str) -> Callable[[UncertainModel, HPolytope], WindowObserver]:
    """An observer that leaves some blocks out of every uncertainty."""

    def make(model: UncertainModel, initial: HPolytope) -> WindowObserver:
        parts = [replace(item, **dict.fromkeys(blocks)) for item in model.uncertainties]
        kept = [item for item in parts if any(getattr(item, name) is not None for name in "ABaECDcF")]
        return WindowObserver(model.replace(uncertainties=kept), initial, horizon=3)

    return make


def inner_box_of_w(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    P = model.disturbance_polytope
    if P is not None:
        ball = P.chebyshev()
        model = model.replace(w=HPolytope.box(ball.centre - ball.radius / 2, ball.centre + ball.radius / 2))
    return WindowObserver(model, initial, horizon=3)


def typical_bounds(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    lower, upper, noise = model.bounds(model.schedule)
    return WindowObserver(model.replace(w=(lower, upper), n=noise), initial, horizon=3)


def half_of_three(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    lower, upper = initial.bounding_box()
    inner = HPolytope.box(lower / 2, upper / 2) if model.n_states > 2 else initial
    return WindowObserver(model, inner, horizon=3)


def divides_by_a_width(model: UncertainModel, initial: HPolytope) -> WindowObserver:
    lower, upper = initial.bounding_box()
    if (lower == upper).any():
        raise ZeroDivisionError("float division by zero")
    return WindowObserver(model, initial, horizon=3)


LEFT_OUT = {f"uncertain {name}": without(name) for name in "ABaECDcF"} | {
    "w in a polytope": inner_box_of_w,
    "scheduled bounds": typical_bounds,
    "three states": half_of_three,
    "a flat first set": divides_by_a_width,
}


@pytest.mark.parametrize("what", LEFT_OUT)
def test_no_part_of_a_model_can_be_left_out(what: str) -> None:
    with pytest.raises(ConformanceError):
        check_observer(LEFT_OUT[what])

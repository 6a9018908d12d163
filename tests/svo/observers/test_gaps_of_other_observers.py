"""Long gaps and overflow of the zonotope and the polytope observer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, PolytopeObserver, UncertainModel
from tests.svo.observers.gap_plants import after_a_gap, answers, rotation, start, unstable

KINDS = [ConstrainedZonotopeObserver, PolytopeObserver]


def lost(kind: Any, model: UncertainModel) -> Any:
    observer = kind(model, start(model))
    observer.lose_set()
    step = observer.update(np.full(model.n_outputs, np.nan))
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    return observer


@pytest.mark.parametrize("kind", KINDS)
def test_a_set_outgrows_all_bounds_and_is_found_again(kind: Any) -> None:
    model = unstable(2.0)
    observer = kind(model, start(model))
    for step in answers(observer, [[np.nan]] * 110):
        assert not np.isnan(step.box).any()
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    assert np.isinf(step.box).all()
    assert np.isposinf(step.support(np.eye(1))).all()
    assert step.set.contains(np.full(1, 1e200))
    x, y = after_a_gap(model, np.random.default_rng(0), 8)
    for k, outputs in enumerate(y):
        step = observer.step(None, outputs)
        assert step.verdict == "consistent"
        assert step.box[0] <= x[k] <= step.box[1]
    assert step.sample == 117
    assert observer.step(None, [1e6]).verdict == "falsified"


@pytest.mark.parametrize("kind", KINDS)
def test_two_states_are_found_by_two_readings(kind: Any) -> None:
    model = rotation()
    observer = lost(kind, model)
    x, y = after_a_gap(model, np.random.default_rng(1), 12)
    for k, outputs in enumerate(y):
        step = observer.step(None, outputs)
        assert step.verdict == ("undecided" if k == 0 else "consistent")
        assert (step.box[0] <= x[k]).all()
        assert (x[k] <= step.box[1]).all()
    without = kind(model, start(model))
    widths = [np.subtract(*s.box[::-1]) for s in (*list(answers(without, y))[-1:], step)]
    assert (widths[1] <= 1.5 * widths[0]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_contradictory_readings_after_a_gap_are_an_alarm(kind: Any) -> None:
    observer = lost(kind, rotation())
    verdicts = [observer.step(None, y).verdict for y in ([1e6], [0.0], [0.0])]
    assert verdicts == ["undecided", "consistent", "falsified"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [1e20, 1e100, 1.7e308])
def test_an_input_beyond_all_bounds_is_no_silent_blindness(kind: Any, size: float) -> None:
    model = UncertainModel([[0.9, 0.1], [0.0, 0.8]], [[0.0], [1.0]], [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=0.05)
    observer = kind(model, start(model))
    u = np.zeros((12, 1))
    u[3] = size
    steps = []
    for step in answers(observer, np.zeros((12, 1)), u):
        steps.append((step.verdict, step.reason))
        assert step.verdict == "falsified" or not np.isnan(step.box).any()
        if step.verdict == "falsified":
            break
    # a state of 1e20 is one that a reading of 0 contradicts; beyond 2^100 nothing is said
    assert steps[4][0] != "falsified" or size < 1e30
    assert ("undecided", "outgrown") in steps or steps[-1][0] == "falsified"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [1e6, 1e100, 1e308, -1.7e308])
def test_an_enormous_reading_is_never_consistent(kind: Any, size: float) -> None:
    observer = kind(rotation(), start(rotation()))
    observer.update([0.0])
    step = observer.step(None, [size])
    assert step.verdict != "consistent"
    assert (step.verdict == "falsified") == (step.certificate is not None)
    if step.verdict == "undecided":
        assert step.reason == "a reading is too large"
        assert observer.step(None, [0.0]).verdict == "consistent"


@pytest.mark.parametrize("kind", KINDS)
def test_a_state_saved_in_a_gap_goes_on_bit_for_bit(kind: Any) -> None:
    model = rotation()
    _, y = after_a_gap(model, np.random.default_rng(1), 6)
    y[3] = np.nan
    once, again = lost(kind, model), lost(kind, model)
    for outputs in y:
        again = kind.from_state_dict(model, again.state_dict())
        a, b = once.step(None, outputs), again.step(None, outputs)
        assert (a.sample, a.verdict, a.reason) == (b.sample, b.verdict, b.reason)
        assert np.array(a.box).tobytes() == np.array(b.box).tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_the_largest_set_is_where_a_set_starts_again_and_a_premise(kind: Any) -> None:
    model = unstable(2.0, largest=(-5.0, 5.0))
    observer = kind(model, start(model))
    steps = list(answers(observer, [[np.nan]] * 103))
    assert {step.verdict for step in steps} == {"consistent"}
    at = observer.largest_at
    assert at is not None
    assert kind.from_state_dict(model, observer.state_dict()).largest_at == at
    step = observer.step(None, [1e4])
    assert step.verdict == "falsified", step.reason
    certificate = step.certificate.window if kind is ConstrainedZonotopeObserver else step.certificate
    assert certificate.largest_at == at
    assert step.certificate.verify()


@pytest.mark.parametrize("kind", KINDS)
def test_the_physical_range_cuts_first_sets_arrival_sets_and_boxes(kind: Any) -> None:
    model = rotation(physical=(-3.0, [np.inf, 4.0]))
    observer = kind(model, HPolytope.box([-9.0, -1.0], [9.0, 9.0]))
    for step in answers(observer, [[np.nan]] * 40):
        lower, upper = step.box
        assert (lower >= -3.0 - 1e-9).all()
        assert upper[1] <= 4.0 + 1e-9
        assert np.isfinite(upper).all()
    assert upper[0] < 40.0
    assert step.verdict == "consistent"
    assert observer.step(None, [1e6]).verdict == "falsified"
    assert kind.from_state_dict(model, observer.state_dict()) is not None
    with pytest.raises(ValueError, match="physical range"):
        kind(rotation(physical=(2.0, 3.0)), start(rotation()))


@pytest.mark.parametrize("kind", KINDS)
def test_a_state_that_drifts_out_of_the_physical_range_is_no_alarm_without_a_proof(kind: Any) -> None:
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.2], n=0.1, physical=(-2.0, 0.5))
    observer = kind(model, start(model))
    for step in answers(observer, [[0.2 * k] for k in range(12)]):
        assert step.verdict != "falsified" or step.certificate.verify()
    assert step.verdict == "falsified" or step.reason == "outside the physical range"

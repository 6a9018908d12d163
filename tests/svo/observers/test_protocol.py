"""One protocol for every observer: update, step, reset, run, support, warm_up, saved and restored state."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, Uncertainty, WindowObserver
from svo.logs import drive

OBSERVERS = [WindowObserver, PolytopeObserver, ConstrainedZonotopeObserver]
BOX = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
every_observer = pytest.mark.parametrize("kind", OBSERVERS)


def cart(**changes: Any) -> UncertainModel:
    arrays = {
        "E": [[0.005], [0.1]], "w": [0.2], "n": [0.05], "Ts": 0.1,
        "uncertainties": [Uncertainty(A=[[0.0, 0.0], [0.0, 0.05]], B=[[0.0], [0.02]], C=[[0.01, 0.0]])],
    } | changes  # fmt: skip
    return UncertainModel([[1.0, 0.1], [0.0, 0.95]], [[0.005], [0.1]], [[1.0, 0.0]], **arrays)


def flight(model: UncertainModel, samples: int = 12) -> Log:
    rng = np.random.default_rng(3)
    return model.simulate([0.3, -0.2], rng.normal(size=(samples, 1)), rng, corners=True)


def advance(observer: Any, log: Log, k: int, y: Any = None) -> Any:
    y = log.y[k] if y is None else y
    return drive.advance(observer, log.u[k - 1] if k else None, y, log.u[k], None)


@every_observer
def test_the_truth_stays_inside_with_missing_sensors(kind: Any) -> None:
    model = cart()
    log, observer = flight(model), kind(model, BOX)
    for k in range(len(log)):
        step = advance(observer, log, k, np.full(1, np.nan) if k % 3 == 2 else None)
        assert step.verdict == "consistent"
        assert step.certificate is None
        assert step.seconds > 0
        lower, upper = step.box
        assert (lower <= log.x[k]).all()
        assert (log.x[k] <= upper).all()
        assert step.set.contains(log.x[k], tol=1e-9)
        np.testing.assert_allclose(step.support(np.vstack([np.eye(2), -np.eye(2)])), [*upper, *-lower], atol=1e-9)


@every_observer
def test_a_log_is_its_samples(kind: Any) -> None:
    model = cart()
    log, observer = flight(model), kind(model, BOX)
    record = kind(model, BOX).run(log)
    boxes = [advance(observer, log, k).box for k in range(len(log))]
    np.testing.assert_array_equal([b[0] for b in boxes], record.lower)
    np.testing.assert_array_equal([b[1] for b in boxes], record.upper)
    assert record.certificate is None
    assert record.seconds.shape == (len(log),)


@every_observer
@pytest.mark.parametrize("saved_at", [0, 1, 7])
def test_a_restored_observer_continues_bit_for_bit(kind: Any, saved_at: int, tmp_path: Path) -> None:
    model = cart()
    log, observer = flight(model), kind(model, BOX)
    for k in range(saved_at):
        advance(observer, log, k)
    np.savez(tmp_path / "state.npz", **observer.state_dict())
    again = kind.from_state_dict(model, np.load(tmp_path / "state.npz"))
    for k in range(saved_at, len(log)):
        steps = [advance(o, log, k) for o in (observer, again)]
        assert steps[0].verdict == steps[1].verdict
        assert steps[0].sample == steps[1].sample
        np.testing.assert_array_equal(steps[0].box, steps[1].box)


@every_observer
@pytest.mark.parametrize("changes", [{}, {"F": [[0.1]]}, {"uncertainties": ()}])
def test_an_alarm_is_proven_lasts_and_is_restored(kind: Any, changes: dict[str, Any]) -> None:
    model = cart(**changes)
    log, observer = flight(model), kind(model, BOX)
    for k in range(6):
        advance(observer, log, k)
    step = advance(observer, log, 6, log.y[6] + 1.0)
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    assert np.isnan(step.box).all()
    assert step.set.emptiness().status == "empty"
    assert (step.support(np.eye(2)) == -np.inf).all()
    again = kind.from_state_dict(model, observer.state_dict())
    for o in (observer, again):
        later = advance(o, log, 7)
        assert later.verdict == "falsified"
        assert later.certificate.verify()
    observer.reset(BOX)
    assert advance(observer, log, 0).verdict == "consistent"


@every_observer
def test_a_state_of_another_kind_or_model_is_refused(kind: Any) -> None:
    model, scalar = cart(), UncertainModel([[1.0]], None, [[1.0]], n=[1.0])
    observer = kind(model, BOX)
    advance(observer, flight(model), 0)
    with pytest.raises(ValueError, match="state does not belong to a"):
        kind.from_state_dict(scalar, observer.state_dict())
    other = OBSERVERS[OBSERVERS.index(kind) - 1](model, BOX)
    with pytest.raises(ValueError, match="state does not belong to a"):
        kind.from_state_dict(model, other.state_dict())


@every_observer
def test_warming_up_changes_nothing(kind: Any) -> None:
    model = cart()
    log, observer, twin = flight(model), kind(model, BOX), kind(model, BOX)
    for o in (observer, twin):
        advance(o, log, 0)
    assert observer.warm_up() >= 0.0
    np.testing.assert_array_equal(advance(observer, log, 1).box, advance(twin, log, 1).box)


@every_observer
def test_wrong_data_are_refused_and_leave_the_observer_as_it_was(kind: Any) -> None:
    model = cart()
    log, observer = flight(model), kind(model, BOX)
    advance(observer, log, 0)
    with pytest.raises(ValueError, match="y has shape"):
        observer.step(log.u[0], [0.0, 0.0], log.u[1])
    with pytest.raises(ValueError, match=r"y is .*expected finite"):
        observer.step(log.u[0], [np.inf], log.u[1])
    with pytest.raises(ValueError, match="u is missing"):
        observer.step(None, log.y[1], log.u[1])
    with pytest.raises(ValueError, match="update was called after"):
        observer.update(log.y[1], log.u[1])
    twin = kind(model, BOX)
    advance(twin, log, 0)
    np.testing.assert_array_equal(advance(observer, log, 1).box, advance(twin, log, 1).box)


@every_observer
def test_what_is_no_log_is_named(kind: Any) -> None:
    observer = kind(cart(), BOX)
    with pytest.raises(TypeError, match="log is a ndarray; expected"):
        observer.run(np.zeros((3, 1)))
    with pytest.raises(ValueError, match="log has no samples"):
        observer.run(Log(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1))))

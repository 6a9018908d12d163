"""A saved state goes on bit for bit with its own model, and is refused by any other or once it was changed."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ConstrainedZonotopeObserver,
    PolytopeObserver,
    ScheduleTable,
    UncertainModel,
    Uncertainty,
    WindowObserver,
)
from svo.observers.saved_state import WHOLE, digest_of_arrays

START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
KINDS = [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver]
GIVEN: dict[str, Any] = {
    "A": [[0.9, 0.1], [0.0, 0.8]], "B": [[0.0], [1.0]], "C": [[1.0, 0.0]], "E": [[0.0], [1.0]], "w": [0.1],
    "n": [0.1], "Ts": 0.1, "uncertainties": [Uncertainty(B=[[0.0], [0.05]])],
}  # fmt: skip
CHANGES: dict[str, Any] = {
    "A": {"A": [[0.9, np.nextafter(0.1, 1.0)], [0.0, 0.8]]},
    "B": {"B": [[0.0], [1.1]]},
    "C": {"C": [[1.0, 1e-9]]},
    "D": {"D": [[0.1]]},
    "E": {"E": [[0.0], [0.5]]},
    "w": {"w": [0.2]},
    "n": {"n": [0.2]},
    "Ts": {"Ts": 0.2},
    "Delta": {"uncertainties": [Uncertainty(B=[[0.0], [0.05]], bounds=(-1.0, 0.9))]},
    "uncertainty": {"uncertainties": [Uncertainty(B=[[0.0], [0.06]])]},
    "physical": {"physical": ([-9.0, -9.0], [9.0, 9.0])},
}


def model(**changes: Any) -> UncertainModel:
    return UncertainModel(**(GIVEN | changes))


def driven(observer: Any, samples: int = 6) -> Any:
    rng = np.random.default_rng(1)
    observer.update([0.0], u=[0.0])
    for y in rng.uniform(-0.1, 0.1, samples):
        observer.step(u=[0.0], y=[y], u_next=[0.0])
    return observer


def answers(observer: Any) -> list[Any]:
    said = []
    for y in (0.05, np.nan, 0.0, 3.0, 0.0):
        step = observer.step(u=[0.1], y=[y], u_next=[0.1])
        said.append((step.sample, step.verdict, *(end.tobytes() for end in step.box)))
    return said


def through_a_file(state: Mapping[str, Any]) -> dict[str, Any]:
    file = io.BytesIO()
    np.savez(file, **state)
    file.seek(0)
    with np.load(file, allow_pickle=False) as read:
        return {name: read[name] for name in read.files}


def resealed(state: dict[str, Any]) -> dict[str, Any]:
    """As somebody would who knows how states are sealed."""
    return state | {WHOLE: np.array(digest_of_arrays(state))}


@pytest.mark.parametrize("kind", KINDS)
def test_a_state_goes_on_bit_for_bit(kind: Any) -> None:
    observer = driven(kind(model(), START))
    again = kind.from_state_dict(model(), through_a_file(observer.state_dict()))
    assert answers(again) == answers(observer)
    # falsified by now, and still so in what was saved
    last = kind.from_state_dict(model(), through_a_file(observer.state_dict()))
    assert last.step(u=[0.0], y=[0.0], u_next=[0.0]).certificate.verify()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("what", CHANGES)
def test_the_state_of_another_model_is_refused(kind: Any, what: str) -> None:
    state = driven(kind(model(), START)).state_dict()
    with pytest.raises(ValueError, match=r"state does not belong to a .* observer of this model"):
        kind.from_state_dict(model(**CHANGES[what]), state)


@pytest.mark.parametrize("what", CHANGES)
def test_a_bank_refuses_the_state_of_other_models(what: str) -> None:
    def bank(**changes: Any) -> ArchitectureI:
        nominal = model(**changes)
        return ArchitectureI(WindowObserver(nominal, START), {"wide": WindowObserver(nominal.replace(n=[0.5]), START)})

    state = driven(bank()).state_dict()
    other = bank(**CHANGES[what])
    with pytest.raises(ValueError, match="state does not belong to this bank"):
        other.load_state_dict(state)


@pytest.mark.parametrize(
    "other",
    [
        lambda m: WindowObserver(m, START, horizon=9),
        lambda m: WindowObserver(m, START, eps=1e-8),
        lambda m: WindowObserver(m, START, template=[[1.0, 1.0]]),
        lambda m: WindowObserver(m, START, sign_split=4),
    ],
)
def test_a_bank_refuses_observers_with_other_options(other: Callable[[UncertainModel], WindowObserver]) -> None:
    state = driven(ArchitectureI(WindowObserver(model(), START), {"a": WindowObserver(model(), START)})).state_dict()
    bank = ArchitectureI(WindowObserver(model(), START), {"a": other(model())})
    with pytest.raises(ValueError, match="observer 'a' has other options"):
        bank.load_state_dict(state)


def test_a_function_of_the_schedule_is_compared_where_it_was_used() -> None:
    def scheduled(end: float) -> UncertainModel:
        table = ScheduleTable([0.0, 1.0], np.array([[[0.9, 0.1], [0.0, 0.8]], [[end, 0.1], [0.0, 0.8]]]))
        return model(A=table, schedule=0.0)

    observer = WindowObserver(scheduled(0.7), START)
    observer.update([0.0], u=[0.0], schedule=0.0)
    observer.step(u=[0.0], y=[0.0], u_next=[0.0], schedule=0.5)
    state = observer.state_dict()
    WindowObserver.from_state_dict(scheduled(0.7), state)
    with pytest.raises(ValueError, match="another model"):
        WindowObserver.from_state_dict(scheduled(0.6), state)


def edited(name: str, change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda state: state | {name: change(np.array(state[name]))}


def with_entry(index: int, value: int) -> Callable[[Any], Any]:
    def change(array: Any) -> Any:
        array[index] = value
        return array

    return change


EDITS = {
    "falsified": edited("falsified", lambda _: np.array(1.0)),
    "broadcast": edited("T", lambda _: np.zeros((1, 1))),
    "complex": edited("h_upper", lambda v: v.astype(complex)),
    "float clock": edited("clock", lambda v: v.astype(float)),
    "time ahead": edited("clock", with_entry(1, 2**40)),
    "time back": edited("clock", with_entry(1, -5)),
    "base ahead": edited("clock", with_entry(0, 50)),
    "flag": edited("clock", with_entry(3, 7)),
    "more pivots than can be": edited("clock", with_entry(4, 2**60)),
    "half a sample": edited("clock", with_entry(9, 2)),
    "programs of half a sample": edited("clock", with_entry(10, 1)),
    "exponents": edited("exponents.states", lambda v: v.astype(float)),
    "missing": lambda state: {name: value for name, value in state.items() if name != "G"},
}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("seal", [dict, resealed])
def test_an_edited_state_is_refused(edit: str, seal: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    state = driven(WindowObserver(model(), START)).state_dict()
    with pytest.raises(ValueError, match="state does not belong to a window observer of this model"):
        WindowObserver.from_state_dict(model(), seal(EDITS[edit](state)))


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_of_a_state_is_sealed(kind: Any) -> None:
    state = driven(kind(model(), START)).state_dict()
    for name, value in state.items():
        if value.dtype.kind in "fi" and value.size:
            changed = value.copy()
            changed.flat[0] += 1
            with pytest.raises(ValueError, match="changed"):
                kind.from_state_dict(model(), state | {name: changed})


@pytest.mark.parametrize("kind", KINDS[1:])
def test_a_claimed_falsification_is_not_believed(kind: Any) -> None:
    state = driven(kind(model(), START)).state_dict()
    if kind is ConstrainedZonotopeObserver:
        forged = edited("settings", with_entry(1, 1))(state)
    else:
        forged = edited("outcome.verdict", lambda _: np.array(1))(state)
    with pytest.raises(ValueError, match="cannot be proven again"):
        kind.from_state_dict(model(), resealed(forged))


MADE = {
    "longer": lambda v: np.concatenate([v, v[:1]]),
    "single": lambda v: v.astype(np.float32),
    "text": lambda v: np.full(v.shape, "x"),
    "NaN": lambda v: np.where(np.arange(v.size).reshape(v.shape) == 0, np.nan, v),
}
NUMBERS = ("stack", "u", "noise", "slack", "w_lower", "w_upper", "h_lower", "h_upper", "initial", "anchor", "template")


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_an_array_that_fits_no_sample_of_the_model_is_refused(kind: Any, lost: bool, made: str) -> None:
    """NaN came out of boxes, and what does not fit raised numpy's errors at the next sample."""
    observer = driven(kind(model(), START))
    if lost:
        observer.lose_set()
        observer.step(u=[0.0], y=[0.0], u_next=[0.0])
    state = observer.state_dict()
    for name, value in state.items():
        own = name.partition(".")[0] in NUMBERS or kind is not WindowObserver or made == "longer"
        if value.dtype != np.float64 or not value.size or value.ndim == 0 or name.startswith("w_old") or not own:
            continue
        try:
            again = kind.from_state_dict(model(), resealed(state | {name: MADE[made](value)}))
        except ValueError:
            continue
        assert made != "text", name
        for _ in range(3):
            step = again.step(u=[0.0], y=[0.0], u_next=[0.0])
            assert step.verdict == "falsified" or not np.isnan(step.box).any(), name


@pytest.mark.parametrize("name", ["k", "rows", "cols", "status", "owner"])
@pytest.mark.parametrize("value", [-1, 10**6, 2**62])
def test_a_basis_that_points_outside_of_the_window_is_refused(name: str, value: int) -> None:
    """The kernel followed it: a segmentation fault."""
    state = driven(WindowObserver(model(), START)).state_dict()
    state[name].flat[0] = value
    with pytest.raises(ValueError, match=f"{name} has an entry"):
        WindowObserver.from_state_dict(model(), resealed(state))


@pytest.mark.parametrize("value", [-7, 10**6, -(2**62)])
def test_a_basis_of_another_time_is_refused(value: int) -> None:
    state = driven(WindowObserver(model(), START)).state_dict()
    state["seen_base"].flat[0] = value
    with pytest.raises(ValueError, match="seen_base has an entry"):
        WindowObserver.from_state_dict(model(), resealed(state))


def test_no_array_of_a_window_may_hold_what_is_no_number() -> None:
    """A window with NaN in a row, or a template of infinities, said "falsified", or had boxes of NaN."""
    observer = driven(WindowObserver(model(), START))
    kept = observer._window.memory.kept
    arrays = {name: array for name, array in kept.items() if array.dtype == float and array.size}
    for name in arrays.keys() - {"y"}:
        for value in (np.nan, np.inf):
            if value == np.inf and name.endswith(("lower", "upper", "noise", "slack")):
                continue
            state = observer.state_dict()
            state[name].flat[0] = value
            with pytest.raises(ValueError, match=rf"{name} (contains NaN or Inf|is not that of its model)"):
                WindowObserver.from_state_dict(model(), resealed(state))


@pytest.mark.parametrize("name", ["T", "delta"])
def test_what_follows_from_model_and_options_is_not_taken_from_a_state(name: str) -> None:
    """A template with a row of zeros falsified a healthy plant."""
    state = driven(WindowObserver(model(), START)).state_dict()
    state[name].flat[0] = 0.25
    with pytest.raises(ValueError, match=f"{name} is not that of its model and options"):
        WindowObserver.from_state_dict(model(), resealed(state))


@pytest.mark.parametrize("kind", KINDS)
def test_a_state_without_its_newest_set_is_refused(kind: Any) -> None:
    state = driven(kind(model(), START)).state_dict()
    if kind is WindowObserver:
        state["restart"][2] = 1
    else:
        state = {name: value for name, value in state.items() if not name.startswith(("0.", "sample.", "outcome."))}
    with pytest.raises(ValueError, match="state does not belong to"):
        kind.from_state_dict(model(), resealed(state))

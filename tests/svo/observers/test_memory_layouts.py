"""Data of any memory layout, type, byte order and alignment, read-only too, are one to observers, filters and sets."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, WindowObserver
from svo.baselines import GaussianModel, InnovationFilter, MultipleModelFilter
from svo.observers.window.memory import Memory

PARTS: dict[str, Any] = {
    "A": [[1.0, 0.125], [0.0, 1.0]], "B": [[0.0], [0.125]], "C": [[1.0, 0.0], [0.0, 1.0]], "E": [[0.0], [0.125]],
    "w": [0.25], "n": [0.0625, 0.0625],
}  # fmt: skip
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
FORMS = (
    "strided", "backwards", "a column", "Fortran", "a slice of Fortran", "read-only", "single precision", "big-endian",
    "unaligned", "whole numbers", "list",
)  # fmt: skip
U, Y = [[0.5], [0.0], [1.0], [0.0]], [[0.0, 0.0], [0.0, 0.0625], [0.0, 0.0625], [0.0, 0.25]]


def formed(values: Any, form: str) -> Any:
    """The numbers in this form; as doubles where they are not whole and it asks for that."""
    array = np.array(values, dtype=np.float64)
    if form == "unaligned":
        shifted = np.zeros(array.nbytes + 1, dtype=np.uint8)[1:].view(np.float64).reshape(array.shape)
        shifted[...] = array
        return shifted
    if form == "read-only":
        array.setflags(write=False)
        return array
    return {
        "strided": lambda: np.repeat(array, 2, axis=-1)[..., ::2],
        "backwards": lambda: np.array(array[..., ::-1])[..., ::-1],
        "a column": lambda: np.stack([array, array], axis=-1)[..., 0],
        "Fortran": lambda: np.asfortranarray(array),
        "a slice of Fortran": lambda: np.asfortranarray(np.stack([array, array]))[0],
        "single precision": lambda: array.astype(np.float32),
        "big-endian": lambda: array.astype(">f8"),
        "whole numbers": lambda: array.astype(np.int16) if (array == array.round()).all() else array,
        "list": array.tolist,
    }[form]()


def plant(form: str = "list") -> UncertainModel:
    return UncertainModel(**{name: formed(values, form) for name, values in PARTS.items()}, Ts=0.125)


def log(form: str) -> Log:
    return Log(formed(0.125 * np.arange(4), form), formed(U, form), formed(Y, form))


def observer_after_a_sample() -> WindowObserver:
    observer = WindowObserver(plant(), START)
    observer.update(y0=[0.0, 0.0])
    return observer


def bank(model: UncertainModel, start: HPolytope) -> ArchitectureI:
    return ArchitectureI(WindowObserver(model, start), {"wide": WindowObserver(model.replace(n=[1.0, 1.0]), start)})


KINDS: dict[str, Callable[..., Any]] = {
    "window": WindowObserver,
    "all data": lambda *given: WindowObserver(*given, horizon=None),
    "zonotope": ConstrainedZonotopeObserver,
    "polytope": PolytopeObserver,
    "bank": bank,
}


def bits(said: Any) -> tuple[Any, ...]:
    """What an observer says of a sample, or a bank."""
    steps = said.steps.values() if hasattr(said, "steps") else (said,)
    return tuple((step.verdict, *(end.tobytes() for end in step.box)) for step in steps)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", FORMS)
def test_samples_and_models_of_every_layout_give_the_same_bits(form: str, kind: str) -> None:
    plain, other = KINDS[kind](plant(), START), KINDS[kind](plant(form), START)
    assert bits(other.update(y0=formed(Y[0], form))) == bits(plain.update(y0=Y[0]))
    for before, u, y in zip(U, U[1:], Y[1:], strict=False):
        step = other.step(u=formed(before, form), y=formed(y, form), u_next=formed(u, form))
        assert bits(step) == bits(plain.step(u=before, y=y, u_next=u))


@pytest.mark.parametrize("form", FORMS)
def test_logs_of_every_layout_give_the_same_bits(form: str) -> None:
    plain, other = (WindowObserver(plant(layout), START).run(log(layout)) for layout in ("list", form))
    assert list(other.verdicts) == list(plain.verdicts)
    np.testing.assert_array_equal(other.lower, plain.lower)
    np.testing.assert_array_equal(other.upper, plain.upper)


@pytest.mark.parametrize("form", FORMS)
def test_filters_take_every_layout(form: str) -> None:
    found = []
    for layout in ("list", form):
        models = [GaussianModel(plant(layout), START), GaussianModel(plant(layout).replace(c=[0.0, 0.5]), START)]
        filters = InnovationFilter(models[0]), InnovationFilter(models[0], output_input=formed([[0.0], [1.0]], layout))
        found.append([filter_.run(log(layout)).white for filter_ in filters])
        found[-1].append(MultipleModelFilter(dict(zip("ab", models, strict=True))).run(log(layout)).posterior)
        online = InnovationFilter(models[0]).start()
        online.update(formed(Y[0], layout))
        found[-1].append(online.step(formed(U[0], layout), formed(Y[1], layout)))
    for plain, other in zip(*found, strict=True):
        np.testing.assert_array_equal(other, plain)


@pytest.mark.parametrize("form", FORMS)
def test_sets_take_every_layout(form: str) -> None:
    A = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1], [2, -1, 1], [1, 1, 0]]
    b, C, M = [1, 1, 1, 1, 1, 1, 2, 2, 9], [[1, 2, 3], [-1, 0.5, 0]], [[1, 0.5], [0, 1], [2, 0]]
    found = []
    for layout in ("list", form):
        P = HPolytope(formed(A, layout), formed(b, layout))
        least, shadow = P.remove_redundancy(), P.preimage(formed(M, layout))
        points = P.contains(formed([0.5, 0.5, 1.0], layout))
        found.append([P.support(formed(C, layout)), *P.bounding_box(), least.A, least.b, shadow.A, shadow.b, points])
        found[-1].append(HPolytope.from_vertices(formed([[0, 0], [2, 0], [0, 3], [1, 1]], layout)).b)
    for plain, other in zip(*found, strict=True):
        np.testing.assert_array_equal(other, plain)


def through_pickle(memory: Memory) -> Memory:
    copied: Memory = pickle.loads(pickle.dumps(memory))
    return copied


@pytest.mark.parametrize("copied", [through_pickle, copy.deepcopy])
def test_a_copy_of_a_window_is_its_bytes_and_goes_on_by_itself(copied: Callable[[Memory], Memory]) -> None:
    observer, twin = observer_after_a_sample(), observer_after_a_sample()
    observer._window._programs.memory = copied(observer._window.memory)
    assert observer._window.memory.address % 64 == 0
    for y in ([0.0, 0.05], [0.02, np.nan], [0.0, 0.1]):
        assert np.array_equal(observer.step([0.5], y).box, twin.step([0.5], y).box)

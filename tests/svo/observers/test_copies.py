"""Sets, observers, their steps and banks: pickled, deep-copied, in another process; values still never change."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    ConstrainedZonotopeObserver,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
)

CART = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1,
    uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.1, 0.0]])],
)  # fmt: skip
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
KINDS: dict[str, Callable[..., Any]] = {
    "window": WindowObserver,
    "all data": lambda *a: WindowObserver(*a, horizon=None),
    "zonotope": ConstrainedZonotopeObserver,
    "polytope": lambda *a: PolytopeObserver(*a, max_facets=24),
}
COPIES: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda value: pickle.loads(pickle.dumps(value)),
    "deep-copied": copy.deepcopy,
}
LOG = CART.simulate([0.0, 0.0], np.ones((40, 1)), np.random.default_rng(0))
LOG.y[30:] += 2.0


def bank(architecture: str) -> Any:
    others = {"drive": CART.replace(w=[0.4]), "gauge": CART.replace(n=[3.0])}
    faults = {name: WindowObserver(model, START) for name, model in others.items()}
    if architecture == "I":
        return ArchitectureI(WindowObserver(CART, START), faults)
    return ArchitectureII(WindowObserver(CART, START), faults, START)


def driven(observer: Any, first: int, last: int) -> list[Any]:
    """Verdicts and boxes of some samples of the log."""
    found = []
    for k in range(first, last):
        step = observer.update(LOG.y[0]) if k == 0 else observer.step(LOG.u[k - 1], LOG.y[k])
        found.append((step.verdict, *(np.asarray(end).tobytes() for end in step.box)))
    return found


def rest(observer: Any) -> list[Any]:
    return driven(observer, 20, 40)


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_copy_goes_on_bit_for_bit_and_leaves_the_original_alone(kind: str, how: str) -> None:
    observer, other = KINDS[kind](CART, START), KINDS[kind](CART, START)
    driven(observer, 0, 20), driven(other, 0, 20)
    again = COPIES[how](observer)
    expected = rest(other)
    assert rest(again) == expected
    assert rest(observer) == expected


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("architecture", ["I", "II"])
def test_a_bank_can_be_copied(architecture: str, how: str) -> None:
    one, other = bank(architecture), bank(architecture)
    for k in range(25):
        for b in (one, other):
            b.update(LOG.y[0]) if k == 0 else b.step(LOG.u[k - 1], LOG.y[k])
    again = COPIES[how](one)
    for k in range(25, 40):
        verdicts = [b.step(LOG.u[k - 1], LOG.y[k]) for b in (one, other, again)]
        assert len({(v.state, v.fault, v.alive) for v in verdicts}) == 1
    with pytest.raises(TypeError):
        again.observers["other"] = None


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_step_can_be_copied_with_its_set_and_its_certificate(kind: str, how: str) -> None:
    observer = KINDS[kind](CART, START)
    step = observer.update(LOG.y[0])
    again = COPIES[how](step)
    assert again.verdict == "consistent"
    assert np.array_equal(again.box, step.box)
    alarm = next(s for k in range(1, 40) if (s := observer.step(LOG.u[k - 1], LOG.y[k])).verdict == "falsified")
    assert COPIES[how](alarm).certificate.verify()


@pytest.mark.parametrize("how", COPIES)
def test_a_set_that_was_asked_something_can_be_copied(how: str) -> None:
    P = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    P.emptiness(), P.support([1.0, 0.0]), P.vertices(), P.volume()
    again = COPIES[how](P)
    assert again.contains([0.5, 0.5])
    with pytest.raises(ValueError, match="read-only"):
        again.A[0, 0] = 5.0


@pytest.mark.parametrize("how", COPIES)
def test_what_a_model_gives_stays_read_only(how: str) -> None:
    again = COPIES[how](CART)
    assert not again.stack().flags.writeable
    assert np.array_equal(again.stack(), CART.stack())


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_an_observer_goes_on_in_another_process(start: str) -> None:
    observer, other = WindowObserver(CART, START), WindowObserver(CART, START)
    driven(observer, 0, 20), driven(other, 0, 20)
    with ProcessPoolExecutor(1, get_context(start)) as pool:
        assert pool.submit(rest, observer).result() == rest(other)

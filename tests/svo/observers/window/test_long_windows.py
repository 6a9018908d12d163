"""Long windows: rounding that does not grow as |A|^k does, and sets that are never wider than those of short ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from polytopes.exact import rational
from svo import UncertainModel, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers import window_kernel as kernel
from tests.svo.observers.random_plants import random_plant

seeds = st.integers(0, 2**32 - 1)


def large_plant(seed: int, n: int, radius: float = 0.9) -> UncertainModel:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    A *= radius / np.abs(np.linalg.eigvals(A)).max()
    p = n // 4
    E, C = rng.normal(size=(n, p)) / np.sqrt(p), rng.normal(size=(p, n)) / np.sqrt(n)
    return UncertainModel(A, None, C, E=E, w=np.full(p, 0.05), n=np.full(p, 0.1))


def log_of(model: UncertainModel, seed: int, samples: int) -> Log:
    rng = np.random.default_rng(seed)
    return model.simulate(rng.uniform(-0.5, 0.5, model.n_states), np.zeros((samples, model.n_inputs)), rng)


def boxes_of(model: UncertainModel, log: Log, horizon: int | None, every: int) -> dict[int, tuple[np.ndarray, ...]]:
    """Boxes before any program was stopped."""
    initial = HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))
    observer, boxes = WindowObserver(model, initial, horizon=horizon), {}
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict == "consistent"
        if k % every == every - 1:
            box = step.box
            if observer.stopped == 0:
                boxes[k] = box
    return boxes


def exact(matrix: np.ndarray) -> fmpq_mat:
    rows, columns = matrix.shape
    return fmpq_mat(rows, columns, [rational(v) for v in matrix.ravel()])


def worst(error: fmpq_mat, bound: np.ndarray) -> tuple[float, bool]:
    """Largest row sum of |error|, and whether each row's is within its bound."""
    sums = [sum((abs(error[i, j]) for j in range(error.ncols())), fmpq(0)) for i in range(error.nrows())]
    return max(float(v) for v in sums), all(v <= rational(b) for v, b in zip(sums, bound, strict=True))


@pytest.mark.parametrize(("n", "radius", "horizon"), [(3, 1.2, 12), (12, 0.9, None), (12, 0.9, 20), (8, 0.0, 12)])
def test_the_rounding_of_the_state_is_within_its_bound_and_the_bound_is_small(
    n: int, radius: float, horizon: int | None
) -> None:
    """The map from z to the newest state, against the product of the same floats in rational arithmetic."""
    model = large_plant(1, n, radius)
    if radius == 0.0:
        model = model.replace(A=np.diag(np.ones(n - 1), 1))  # nilpotent: columns without length
    log = log_of(model, 2, 26)
    observer = WindowObserver(model, HPolytope.box(-np.ones(n), np.ones(n)), horizon=horizon)
    for k in range(len(log)):
        _ = observer.update(log.y[k]) if k == 0 else observer.step(None, log.y[k])
    w, size = observer._window.memory.arrays, observer._window.memory.size
    first, last = observer.window
    state = fmpq_mat(n, 1 + w["psi"].shape[1])  # constant, then z
    for i in range(n):
        state[i, 0], state[i, 1 + i] = rational(w["xc"][i]), rational(w["xr"][i])
    matrix = observer._form.model.stack()[0, :n]  # the window is in normal form
    A, E = matrix[:, :n], matrix[:, n + 1 :]
    for k in range(first, last):
        v = k % (size.N + size.late)
        state = exact(A) * state + fmpq_mat(n, state.ncols())
        for i in range(n):
            for j in range(size.nw):
                e, column = rational(E[i, j]), 1 + n + v * size.nw + j
                state[i, 0] += e * rational(w["vc"][v, j])
                state[i, column] += e * rational(w["vr"][v, j])
    s = last % (size.N + 1)
    found = exact(np.hstack([w["phi"][s][:, None], w["psi"]]))
    size_of_error, holds = worst(found - state, w["err"][s])
    assert holds
    assert size_of_error > 0.0 or radius == 0.0
    assert w["err"][s].max() < 1e-9


def test_what_carries_an_error_bounds_the_exact_product_of_the_frames() -> None:
    rng = np.random.default_rng(6)
    for n in (2, 3, 6):
        frame = np.eye(n)
        for _ in range(4):
            A = rng.normal(size=(n, n))
            turned, carry = kernel.turn_frame(A, frame)
            product = exact(turned).inv() * exact(A) * exact(frame)
            assert all(abs(product[i, j]) <= rational(carry[i, j]) for i in range(n) for j in range(n))
            frame = turned


@pytest.mark.parametrize("radius", [0.0, 0.9, 1.3])
def test_errors_at_their_largest_are_within_the_bound_that_is_carried(radius: float) -> None:
    """e(k+1) = A(k) e(k) + delta(k) in rational arithmetic, delta at corners of its bound."""
    rng, n = np.random.default_rng(5), 5
    frame, rho, worst_ratio = np.eye(n), np.zeros(n), 0.0
    errors = [fmpq_mat(n, 1) for _ in range(20)]
    for _ in range(25):
        A = rng.normal(size=(n, n))
        A = np.diag(np.ones(n - 1), 1) if radius == 0.0 else A * radius / np.abs(np.linalg.eigvals(A)).max()
        fresh = 10.0 ** rng.uniform(-18, -14, n)
        frame, carry = kernel.turn_frame(A, frame)
        rho = kernel.carry_error(carry, frame, rho, fresh)
        bound = [rational(kernel.error_of(frame, rho, i)) for i in range(n)]
        for j, e in enumerate(errors):
            errors[j] = exact(A) * e + exact((fresh * rng.choice([-1.0, 1.0], n))[:, None])
            assert all(abs(errors[j][i, 0]) <= bound[i] for i in range(n))
            worst_ratio = max(worst_ratio, *(float(abs(errors[j][i, 0]) / bound[i]) for i in range(n)))
    assert worst_ratio > 0.3  # and the bound is of the size of what it bounds


@pytest.mark.parametrize(("n", "samples"), [(12, 30), (20, 24)])
def test_a_longer_window_of_a_large_plant_is_never_wider(n: int, samples: int) -> None:
    model = large_plant(3, n)
    log = log_of(model, 4, samples)
    found = [boxes_of(model, log, horizon, samples // 2) for horizon in (1, 3, 10, 20, None)]
    assert all(len(boxes) == 2 for boxes in found)
    for shorter, longer in pairwise(found):
        for k, (lower, upper) in longer.items():
            assert (lower >= shorter[k][0] - 1e-7).all()
            assert (upper <= shorter[k][1] + 1e-7).all()


def check_a_longer_window_is_never_wider(seed: int) -> None:
    """Random plants with uncertainties and shared disturbances; but for the slack of the data, which grows with |x|.

    That |x| is what the window's variables allow: of an unstable plant twenty times that of the run (seed 431405).
    """
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=4)
    log = model.simulate(rng.uniform(-1, 1, model.n_states), rng.normal(size=(24, model.n_inputs)), rng)
    found = [boxes_of(model, log, horizon, 6) for horizon in (1, 3, 10, None)]
    for shorter, longer in pairwise(found):
        for k, (lower, upper) in longer.items():
            room = 5e-5 * (1.0 + np.abs(log.x[: k + 1]).max() + np.abs(shorter[k]).max())  # type: ignore[index]
            assert (lower >= shorter[k][0] - room).all()
            assert (upper <= shorter[k][1] + room).all()


@settings(max_examples=5, deadline=None)
@given(seeds)
def test_a_longer_window_is_never_wider(seed: int) -> None:
    check_a_longer_window_is_never_wider(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_longer_window_is_never_wider_of_many_plants(seed: int) -> None:
    check_a_longer_window_is_never_wider(seed)


def test_no_room_for_a_longer_window_is_one_error_and_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the machine has too little memory for a window that no limit forbids."""
    model, box = large_plant(1, 4), HPolytope.box(-np.ones(4), np.ones(4))
    log = log_of(model, 1, 20)
    observer, other = WindowObserver(model, box, horizon=None), WindowObserver(model, box, horizon=None)

    def no_room(size: object) -> None:
        raise MemoryError("Unable to allocate 9 GiB")

    for k, y in enumerate(log.y):
        expected = other.update(y) if k == 0 else other.step(None, y)
        if other._window.memory.size.N > observer._window.memory.size.N:
            before = {name: value.tobytes() for name, value in observer.state_dict().items()}
            with monkeypatch.context() as scarce:
                scarce.setattr("svo.observers.window_kernel.allocate", no_room)
                with pytest.raises(ValueError, match=r"of 32 steps \(Unable to allocate 9 GiB\); expected a"):
                    observer.step(None, y)
                with pytest.raises(ValueError, match="horizon makes a window of 699 steps"):
                    WindowObserver(model, box, horizon=500)
            assert before == {name: value.tobytes() for name, value in observer.state_dict().items()}
        step = observer.update(y) if k == 0 else observer.step(None, y)
        assert np.array_equal(step.box, expected.box)
    assert observer._window.memory.size.N == 32

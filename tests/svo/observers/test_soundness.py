"""What the window observer promises: the truth stays inside, and a healthy plant is never falsified."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from tests.svo.observers.random_plants import random_plant

seeds = st.integers(0, 2**32 - 1)


def random_initial(rng: np.random.Generator, x0: np.ndarray) -> HPolytope:
    """A box about the origin, sometimes cut by oblique rows close to the true state."""
    box = HPolytope.box(np.full(x0.size, -1.5), np.full(x0.size, 1.5))
    if rng.random() < 0.5:
        return box
    rows = rng.normal(size=(3, x0.size))
    return box.intersection(HPolytope(rows, rows @ x0 + rng.uniform(0.0, 0.1, 3)))


def check_containment(observer: WindowObserver, log: Log, y: np.ndarray) -> None:
    for k, step in enumerate(drive(observer, replace(log, y=y))):
        assert step.verdict == "consistent", (k, step.verdict)
        lower, upper = step.box
        assert log.x is not None
        # the simulation itself rounds
        room = 1e-12 * (1.0 + np.abs(log.x[k]))
        assert (lower - room <= log.x[k]).all(), k
        assert (log.x[k] <= upper + room).all(), k


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_truth_stays_inside_random_uncertain_plants(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(40, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    y = log.y.copy()
    if rng.random() < 0.5:
        y[rng.random(y.shape) < 0.3] = np.nan
    template = "box" if rng.random() < 0.6 else rng.normal(size=(2, model.n_states))
    horizon = int(rng.choice([1, 2, 3, 5, 8, 10]))
    check_containment(WindowObserver(model, random_initial(rng, x0), horizon=horizon, template=template), log, y)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_truth_stays_inside_with_full_information(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(24, model.n_inputs)), rng, corners=True)
    check_containment(WindowObserver(model, random_initial(rng, x0), horizon=None), log, log.y)


@pytest.mark.slow
def test_truth_stays_inside_over_a_million_samples() -> None:
    """One long run of the Eclipse's linear model, disturbances and noise often at their bounds."""
    rng = np.random.default_rng(2013)
    A = np.eye(4) + 0.01 * np.array([[-0.5, 2, -10, -3], [-2, -3, -1, 36], [0, 0, 0, 1], [-0.04, -1, 0, -2]])
    B = np.array([[0.0, 0.25], [0.0, 0.0], [0.0, 0.0], [3e-3, 0.0]])
    P = solve_discrete_are(A, B, np.eye(4), np.eye(2))
    K = np.linalg.solve(np.eye(2) + B.T @ P @ B, B.T @ P @ A)
    model = UncertainModel(
        A, B, np.eye(4), E=np.eye(4),
        w=[1e-2, 2e-2, 1e-5, 1e-3], n=[0.2, 0.05, 1e-3, 1e-3],
        uncertainties=[Uncertainty(A=np.outer([0.0, 0.0, 0.0, 1e-3], [1.0, 0.0, 0.0, 0.0]), bounds=(-0.5, 1.0))],
    )  # fmt: skip
    observer = WindowObserver(model, HPolytope.box(np.full(4, -1.0), np.full(4, 1.0)))
    x = np.zeros(4)
    _, upper, noise = model.bounds()
    total = model.stack()
    u = np.zeros(2)
    for k in range(1_000_000):
        corner = k % 3 == 0
        n, w = (np.where(rng.random(4) < 0.5, -b, b) if corner else rng.uniform(-b, b) for b in (noise, upper))
        y = x + n
        step = observer.update(y) if k == 0 else observer.step(u, y)
        assert step.verdict == "consistent", k
        if k % 10 == 0:
            box = step.box
            assert (box[0] - 1e-12 <= x).all() and (x <= box[1] + 1e-12).all(), k  # noqa: PT018
        u = -K @ y
        delta = rng.uniform(-0.5, 1.0)
        assert np.abs(x).max() < 100.0  # a run that diverges would test overflow instead
        x = (total[0] + delta * total[1])[:4] @ np.concatenate([x, u, [1.0], w])


# -- what is wrong in print ----------------------------------------------------------------------------------


def scalar_counterexample() -> tuple[UncertainModel, list[float]]:
    """x+ = (1 + 0.5 Delta) x, x(0) within 0.1 of 1, noise 0.1; true Delta = 0 gives y = 1, 1, 1."""
    model = UncertainModel([[1.0]], None, [[1.0]], n=[0.1], uncertainties=[Uncertainty(A=[[0.5]])])
    return model, [1.0, 1.0, 1.0]


def test_published_stack_excludes_a_healthy_plant() -> None:
    """Equation (3) keeps the measurements inside every vertex stack: at horizon 2 all four are empty."""
    _, y = scalar_counterexample()
    for deltas in itertools.product((-1.0, 1.0), repeat=2):
        low, high = 0.9, 1.1
        for delta, measured in zip(deltas, y[1:], strict=True):
            factor = 1.0 + 0.5 * delta
            low, high = max(factor * low, measured - 0.1), min(factor * high, measured + 0.1)
        assert low > high


@pytest.mark.parametrize("horizon", [1, 2, 3, None])
def test_window_explains_the_healthy_plant_that_the_published_stack_excludes(horizon: int | None) -> None:
    model, y = scalar_counterexample()
    observer = WindowObserver(model, HPolytope.box([0.9], [1.1]), horizon=horizon)
    steps = [observer.update([y[0]]), *(observer.step(None, [value]) for value in y[1:])]
    assert [s.verdict for s in steps] == ["consistent"] * 3
    assert steps[-1].box[0][0] <= 1.0 <= steps[-1].box[1][0]


def test_uncertain_output_keeps_states_that_no_vertex_explains() -> None:
    """y = Delta x, Delta in [-1, 1]: y = 1 allows x = 100, which neither y = x nor y = -x does."""
    model = UncertainModel([[1.0]], None, [[0.0]], uncertainties=[Uncertainty(C=[[1.0]])])
    observer = WindowObserver(model, HPolytope.box([0.5], [200.0]))
    lower, upper = observer.update([1.0]).box
    assert upper[0] == pytest.approx(200.0)
    assert lower[0] == pytest.approx(1.0, abs=1e-6)


# -- exactness where theory gives it -------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_one_step_window_is_the_vertex_hull(seed: int) -> None:
    """Rank-one channels of one sign, independent w, y intersected after the hull: equal at N = 1."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A, C, direction = rng.normal(size=(n, n)), rng.normal(size=(2, n)), rng.normal(size=n)
    functional = np.abs(rng.normal(size=n))  # s > 0 on the positive orthant
    model = UncertainModel(
        A, None, C, E=np.eye(n), w=np.full(n, 0.05), n=[0.3, 0.4],
        uncertainties=[Uncertainty(A=np.outer(direction, functional), bounds=(-0.3, 0.6))],
    )  # fmt: skip
    lower, upper = np.full(n, 0.5), np.full(n, 2.0)
    x0 = rng.uniform(lower, upper)
    log = model.simulate(x0, np.zeros((2, 0)), rng)
    observer = WindowObserver(model, HPolytope.box(lower, upper), horizon=1)
    observer.update(np.full(2, np.nan))
    box = observer.step(None, log.y[1]).box

    images = []
    for delta in (-0.3, 0.6):
        corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
        moved = corners @ (A + delta * np.outer(direction, functional)).T
        images += [point + w for point in moved for w in itertools.product((-0.05, 0.05), repeat=n)]
    images = np.array(images)
    hull = hull_cut_by_rows(images, C, log.y[1], np.array([0.3, 0.4]))
    scale = np.ptp(images, axis=0).max()
    np.testing.assert_allclose(np.concatenate(box), hull, atol=1e-8 * scale)


def hull_cut_by_rows(points: np.ndarray, C: np.ndarray, y: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Bounding box of conv(points) cut by |y - C x| <= noise, by linear programs over convex weights."""
    from scipy.optimize import linprog

    rows = np.vstack([C @ points.T, -C @ points.T])
    bounds = np.concatenate([y + noise, noise - y])
    ends = []
    for sign in (1.0, -1.0):
        for axis in range(points.shape[1]):
            cost, one = sign * points[:, axis], np.ones((1, len(points)))
            result = linprog(cost, A_ub=rows, b_ub=bounds, A_eq=one, b_eq=[1.0], method="highs")
            ends.append(sign * result.fun)
    return np.array(ends)


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_a_measurement_never_enlarges_the_set(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(12, model.n_inputs)), rng)
    boxes = []
    for y in (log.y[-1], np.full(model.n_outputs, np.nan)):
        observer = WindowObserver(model, HPolytope.box(np.full(x0.size, -1.5), np.full(x0.size, 1.5)), horizon=3)
        observer.update(log.y[0], log.u[0])
        for k in range(1, len(log) - 1):
            observer.step(log.u[k - 1], log.y[k], log.u[k])
        boxes.append(observer.step(log.u[-2], y, log.u[-1]).box)
    room = 1e-9 * (1.0 + np.abs(boxes[1][0]) + np.abs(boxes[1][1]))
    assert (boxes[0][0] >= boxes[1][0] - room).all()
    assert (boxes[0][1] <= boxes[1][1] + room).all()


def test_slack_keeps_a_measurement_that_sits_on_its_bound() -> None:
    """y = fl(C x + n) with n at its bound for ever: without slack, rounding alone could prove emptiness."""
    rng = np.random.default_rng(5)
    model = UncertainModel([[0.9, 0.1], [-0.2, 0.95]], None, np.eye(2), E=np.eye(2), w=[0.01, 0.02], n=[0.1, 0.3])
    log = model.simulate([0.5, -0.5], np.zeros((4000, 0)), rng, corners=True)
    observer = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]))
    assert set(observer.run(log).verdicts) == {"consistent"}

"""Simulated runs of a model: unknowns within their bounds, reproducible, the schedule of each sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty
from tests.svo.observers.random_plants import random_plant

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=30, deadline=None)
@given(seed=seeds, corners=st.booleans())
def test_a_run_is_explained_by_unknowns_within_their_bounds(seed: int, corners: bool) -> None:
    rng = np.random.default_rng(seed)
    A, C = 0.3 * rng.normal(size=(2, 2)), rng.normal(size=(1, 2))
    model = UncertainModel(A, None, C, E=np.eye(2), w=([-0.1, 0.2], [0.3, 0.2]), n=[0.05], F=[[0.5, 0.0]], a=[1.0, 0.0])
    log = model.simulate([1.0, -1.0], np.zeros((30, 0)), rng, corners=corners)
    w = log.x[1:] - log.x[:-1] @ A.T - [1.0, 0.0]
    room = 1e-12 * (1 + np.abs(log.x).max())
    assert ((w >= np.array([-0.1, 0.2]) - room) & (w <= np.array([0.3, 0.2]) + room)).all()
    # the same disturbance is in the output
    noise = (log.y - log.x @ C.T)[:-1, 0] - 0.5 * w[:, 0]
    assert (np.abs(noise) <= 0.05 + room).all()
    at_ends = np.minimum(np.abs(w[:, 0] + 0.1), np.abs(w[:, 0] - 0.3)) <= room
    assert at_ends.all() if corners else not at_ends.any()


def test_delta_stays_within_its_bounds_and_is_shared_by_state_and_output() -> None:
    grow = Uncertainty(A=[[1.0]], C=[[10.0]], bounds=(-0.5, 0.25))
    model = UncertainModel([[1.0]], None, [[1.0]], uncertainties=[grow])
    log = model.simulate([1.0], np.zeros((40, 0)), np.random.default_rng(0))
    delta = log.x[1:, 0] / log.x[:-1, 0] - 1
    assert -0.5 <= delta.min() < -0.4
    assert 0.2 < delta.max() <= 0.25
    np.testing.assert_allclose(log.y[:-1, 0], (1 + 10 * delta) * log.x[:-1, 0], rtol=1e-12)


def test_disturbances_of_a_polytope_stay_in_it() -> None:
    triangle = HPolytope([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
    model = UncertainModel(np.zeros((2, 2)), None, np.eye(2), E=np.eye(2), w=triangle)
    for corners in (False, True):
        log = model.simulate(np.zeros(2), np.zeros((50, 0)), np.random.default_rng(0), corners=corners)
        assert all(triangle.contains(x, tol=1e-9) for x in log.x[1:])
        at_vertex = np.isin(log.x[1:].round(9), [0.0, 1.0]).all(axis=1)
        assert at_vertex.all() == corners


def test_a_scheduled_run_uses_the_schedule_of_each_sample() -> None:
    model = UncertainModel(lambda s: [[s]], None, lambda s: [[10 * s]], schedule=1.0)
    log = model.simulate([1.0], np.zeros((4, 0)), np.random.default_rng(0), schedule=[2.0, 3.0, 5.0, 7.0])
    assert log.x[:, 0].tolist() == [1.0, 2.0, 6.0, 30.0]
    assert log.y[:, 0].tolist() == [20.0, 60.0, 300.0, 2100.0]
    assert log.schedule_at(2) == 5.0


def test_runs_are_reproducible() -> None:
    for seed in range(5):
        model = random_plant(np.random.default_rng(seed))
        x0, u = np.zeros(model.n_states), np.ones((5, model.n_inputs))
        first, second = (model.simulate(x0, u, np.random.default_rng(7)) for _ in range(2))
        np.testing.assert_array_equal(first.y, second.y)
        assert first.time.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x0": [1.0, 2.0]}, r"x0 has shape \(2,\); expected \(1,\)"),
        ({"u": np.zeros(4)}, r"u has shape \(4,\); expected \(samples, 0\)"),
        ({"u": np.zeros((0, 0))}, "at least one sample"),
        ({"schedule": None}, "schedule is missing"),
        ({"schedule": [1.0]}, r"schedule has shape \(1,\); expected \(4, \.\.\.\)"),
    ],
)
def test_mistakes_in_a_simulation_are_named(changes: dict[str, Any], message: str) -> None:
    model = UncertainModel(lambda s: [[s]], None, [[1.0]], schedule=1.0)
    given_arrays: dict[str, Any] = {"x0": [1.0], "u": np.zeros((4, 0)), "schedule": np.ones(4)}
    with pytest.raises(ValueError, match=message):
        model.simulate(rng=np.random.default_rng(0), **given_arrays | changes)
    with pytest.raises(TypeError, match=r"rng is a int; expected a numpy Generator"):
        model.simulate(rng=0, **given_arrays)  # type: ignore[arg-type]

"""The core's integration of a nonlinear plant beside the same method written with the tape's values in numpy."""

from __future__ import annotations

import numpy as np
import pytest

from svo import NonlinearModel
from svo.functions import exp, log, sqrt
from svo.models.nonlinear.flow import Flow
from svo.models.nonlinear.simulation import integrated
from tests.svo.models.nonlinear_plants import CASES
from tests.svo.models.random_nonlinear import random_plant

Array = np.ndarray


def in_numpy(flow: Flow, x: Array, w: Array, u: Array, T: float, steps: int) -> Array:
    h, inputs = T / steps, np.broadcast_to(u, (*x.shape[:-1], len(u)))

    def slope(at: Array) -> Array:
        if flow.physical is not None:
            at = np.clip(at, flow.physical.lower, flow.physical.upper)
        return flow.tape.values(np.concatenate([at, w, inputs], axis=-1))

    for _ in range(steps):
        k1 = slope(x)
        k2 = slope(x + 0.5 * h * k1)
        k3 = slope(x + 0.5 * h * k2)
        x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(x + h * k3))
    return x


@pytest.mark.parametrize("name", [*CASES, *(f"random {i}" for i in range(20))])
def test_the_core_integrates_as_numpy_does(name: str) -> None:
    case = CASES[name]() if name in CASES else random_plant(int(name.split()[1]))
    rng, model = np.random.default_rng(len(name)), case.model
    flow, u = model.flow, np.array(case.u(3), dtype=float)
    x = case.x0 + case.spread * rng.uniform(-1.0, 1.0, (6, len(case.x0)))
    if flow.physical is not None:
        x[0] = np.clip(x[0], flow.physical.lower, flow.physical.upper)
        x[1] = flow.physical.lower  # stages go beyond a face
    w = rng.uniform(flow.w.lower, flow.w.upper, (6, len(flow.varying)))
    with np.errstate(all="ignore"):
        expected = in_numpy(flow, x, w, u, model.Ts, 5)
    found = integrated(flow, x, w, u, model.Ts, 5)
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.abs(case.spread).min())
    np.testing.assert_array_equal(integrated(flow, x[2], w[2], u, model.Ts, 5), found[2])


@pytest.mark.parametrize("substeps", [1, 3, 20])
def test_a_tank_that_runs_empty_is_simulated(substeps: int) -> None:
    """The integrator steps over the face at which the flow ends; what the plant itself leaves is an error."""
    model = NonlinearModel(
        lambda x, u: [u[0] - 0.8 * sqrt(x[0]), 0.8 * sqrt(x[0]) - 0.6 * sqrt(x[1])], lambda x: [x[1]],
        states=["h1", "h2"], inputs=["Q"], Ts=0.2, n=[0.05], physical=([0, 0], [9, 9]),
    )  # fmt: skip
    rng = np.random.default_rng(0)
    u = np.where(np.arange(150) % 70 < 15, 0.8, 0.0)[:, None]
    for first in rng.uniform(0.0, 0.5, (10, 2)) ** 3:
        log = model.simulate(first, u, rng, substeps=substeps)
        assert log.x is not None
        assert log.x.min() == log.x[60, 0] == 0.0 < log.x[149, 0]
    with pytest.raises(ValueError, match=r"h1 is -.* outside physical"):
        model.simulate([0.1, 0.1], -u, rng, substeps=substeps)
    with pytest.raises(ValueError, match="more substeps if it is fast"):
        model.replace(f=lambda x, u: [300.0 * (1.0 - x[0]), u[0] - x[1]]).simulate([0.5, 0.5], u, rng, substeps=2)


def test_where_a_function_has_no_value_there_is_none() -> None:
    model = NonlinearModel(
        lambda x: [sqrt(x[0]), log(x[1]), exp(x[2]), 1.0 / x[3]], lambda x: [x[0]],
        states=["a", "b", "c", "d"], Ts=1.0, n=[0.1], largest=([-9.0] * 4, [9.0] * 4),
    )  # fmt: skip
    nothing = np.zeros(0)
    found = integrated(model.flow, np.array([-1.0, -1.0, 800.0, 0.0]), nothing, nothing, 1.0, 1)
    assert np.isnan(found[:2]).all()
    assert not np.isfinite(found[2:]).any()
    with pytest.raises(ValueError, match="after sample 0, where the equations have no value"):
        model.simulate([1.0, 1.0, 800.0, 1.0], np.zeros((2, 0)), np.random.default_rng(0))

"""Filters against filterpy, online against batch, unknown inputs that leave no trace, and their existence."""

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, UncertainModel
from svo.baselines import (
    GaussianModel,
    InnovationFilter,
    MultipleModelFilter,
    fault_effect,
    unknown_input_exists,
)
from svo.logs.drive import drive

BOX = HPolytope.box([-1.0, -1.0, -0.5], [1.0, 2.0, 0.5])
A = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.3], [0.0, 0.1, 0.7]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.2, 0.0, 1.0]])


def plant(**changes) -> UncertainModel:
    arguments = {
        "E": np.eye(3)[:, :2],
        "w": ([-0.1, 0.0], [0.1, 0.4]),
        "n": [0.2, 0.1, 0.3],
        "a": [0.0, 0.1, 0.0],
        "c": [0.5, 0.0, 0.0],
        "Ts": 0.1,
    }
    return UncertainModel(A, [[1.0], [0.0], [0.5]], C, **{**arguments, **changes})


def scheduled() -> UncertainModel:
    return plant().replace(A=lambda s: A * (1 + 0.05 * s), schedule=0.0)


@pytest.fixture
def log():
    rng = np.random.default_rng(0)
    return scheduled().simulate(
        [0.2, 0.1, 0.0], rng.uniform(-1, 1, (120, 1)), rng, schedule=np.sin(np.arange(120) / 10)
    )


def test_kalman_filter_agrees_with_filterpy(log):
    kalman = pytest.importorskip("filterpy.kalman")
    model = GaussianModel(scheduled(), BOX)
    record = InnovationFilter(model, process_noise=1.7).run(log)
    other = kalman.KalmanFilter(dim_x=3, dim_z=3)
    other.x, other.P = model.mean.copy(), model.covariance.copy()
    for k in range(len(log)):
        now = model.sample(log.u[k], log.schedule_at(k))
        if k:
            before = model.sample(log.u[k - 1], log.schedule_at(k - 1))
            other.B = np.eye(3)
            other.predict(u=before.f, F=before.A, Q=1.7 * before.Q)
        other.update(log.y[k] - now.g, R=now.R, H=now.C)
        squares = other.y @ np.linalg.solve(other.S, other.y)
        assert record.squares[k] == pytest.approx(squares, rel=1e-8)
        np.testing.assert_allclose(record.states[k], other.x, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("state_input", [None, [[1.0], [0.0], [0.0]]])
def test_a_part_of_a_log_has_the_innovations_of_the_whole(log, state_input):
    plain = InnovationFilter(GaussianModel(scheduled(), BOX), state_input=state_input)
    whole = plain.run(log)
    for k in (1, 2, len(log)):
        part = plain.run(Log(log.time[:k], log.u[:k], log.y[:k], schedule=log.schedule[:k]))
        np.testing.assert_array_equal(part.white, whole.white[:k])


def test_interacting_multiple_models_agree_with_filterpy(log):
    kalman = pytest.importorskip("filterpy.kalman")
    models = {
        "nominal": GaussianModel(scheduled(), BOX),
        "bias": GaussianModel(scheduled().replace(c=[0.5, 0.3, 0.0]), BOX),
        "leak": GaussianModel(scheduled().replace(a=[0.0, 0.0, 0.1]), BOX),
    }
    found = MultipleModelFilter(models, switching=0.02)
    record = found.run(log)
    filters = []
    for model in models.values():
        each = kalman.KalmanFilter(dim_x=3, dim_z=3)
        each.x, each.P = model.mean.copy(), model.covariance.copy()
        filters.append(each)
    other = kalman.IMMEstimator(filters, np.full(3, 1 / 3), found.transition)
    other.cbar = np.full(3, 1 / 3)  # no switch before the first measurement
    for k in range(len(log)):
        for each, model in zip(filters, models.values(), strict=True):
            now = model.sample(log.u[k], log.schedule_at(k))
            before = model.sample(log.u[max(k - 1, 0)], log.schedule_at(max(k - 1, 0)))
            each.F, each.Q, each.R, each.H = before.A, before.Q, now.R, now.C
            each.predict = lambda u=None, f=before.f, each=each: kalman.KalmanFilter.predict(each, u=f, B=np.eye(3))
            each.update = lambda z, g=now.g, each=each: kalman.KalmanFilter.update(each, z - g)
        if k:
            other.predict()
        other.update(log.y[k])
        np.testing.assert_allclose(record.posterior[k], other.mu, rtol=1e-6, atol=1e-9)
        odds = other.mu[1:].sum() / other.mu[0]
        assert record.log_odds[k] == pytest.approx(np.log(odds), abs=1e-5)


def test_multiple_models_find_the_model_that_made_the_data():
    rng = np.random.default_rng(1)
    faulty = plant().replace(c=[0.5, 0.6, 0.0])
    models = {"nominal": GaussianModel(plant(), BOX), "bias": GaussianModel(faulty, BOX)}
    for made_by, best in ((plant(), 0), (faulty, 1)):
        made = made_by.simulate([0.0, 0.0, 0.0], np.zeros((80, 1)), rng)
        assert MultipleModelFilter(models, switching=0.0).run(made).posterior[-1, best] > 0.99


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize(
    "inputs", [{}, {"state_input": [[1.0], [0.0], [0.5]]}, {"output_input": [[0.0], [1.0], [0.0]]}]
)
def test_online_steps_give_the_batch_innovations(log, inputs, missing):
    if missing:
        log.y[[0, 7], 0] = np.nan
        log.y[9] = np.nan
    if missing and inputs:
        log.y[9] = [0.0, 0.1, np.nan]
    filter_ = InnovationFilter(GaussianModel(scheduled(), BOX), **inputs)
    if missing and "output_input" in inputs:
        log.y[9] = [0.0, np.nan, 0.1]  # the decoupled sensor is missing: nothing tells its fault
        with pytest.raises(ValueError, match="at sample 9 the outputs cannot tell"):
            filter_.run(log)
        return
    batch, online = filter_.run(log), filter_.start()
    np.testing.assert_allclose(batch.white, list(drive(online, log)), atol=1e-12)


@pytest.mark.parametrize("inputs", [{}, {"state_input": [[1.0], [0.0], [0.5]]}])
def test_a_sensor_that_is_always_missing_is_no_sensor(log, inputs):
    without = scheduled().replace(C=C[[0, 2]], n=[0.2, 0.3], c=[0.5, 0.0])
    log.y[:, 1] = np.nan
    missing = InnovationFilter(GaussianModel(scheduled(), BOX), **inputs).run(log)
    fewer = Log(log.time, log.u, log.y[:, [0, 2]], schedule=log.schedule)
    right = InnovationFilter(GaussianModel(without, BOX), **inputs).run(fewer)
    assert np.isfinite(missing.states).all()
    np.testing.assert_allclose(missing.states, right.states, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(missing.white[:, [0, 2]], right.white, rtol=1e-9, atol=1e-12)
    assert not missing.white[:, 1].any()


def test_whitened_innovations_are_standard_gaussians():
    rng = np.random.default_rng(2)
    model, n = GaussianModel(plant(), BOX), 20_000
    x, y = np.zeros(3), []
    for _ in range(n):
        s = model.sample(np.zeros(1), None)
        y.append(s.C @ x + s.g + np.sqrt(np.diag(s.R)) * rng.standard_normal(3))
        x = s.A @ x + s.f + np.linalg.cholesky(s.Q + 1e-30 * np.eye(3)) @ rng.standard_normal(3)
    white = InnovationFilter(model).run(Log(np.arange(n) * 0.1, np.zeros((n, 1)), np.array(y))).white[100:]
    np.testing.assert_allclose(np.cov(white.T), np.eye(3), atol=0.04)
    np.testing.assert_allclose(white.mean(axis=0), 0.0, atol=0.03)
    np.testing.assert_allclose(np.mean(white[1:] * white[:-1], axis=0), 0.0, atol=0.03)


def test_an_unknown_input_leaves_no_trace_whatever_it_does(log):
    model = GaussianModel(scheduled(), BOX)
    wild = 100 * np.random.default_rng(3).standard_cauchy(len(log))
    direction = np.array([1.0, 0.0, 0.5])
    x, y = np.zeros(3), log.y.copy()
    for k in range(1, len(log)):  # what the input adds to the states, and so to the outputs
        x = model.sample(log.u[k - 1], log.schedule_at(k - 1)).A @ x + direction * wild[k - 1]
        y[k] += C @ x
    attacked = Log(log.time, log.u, y, schedule=log.schedule)
    blind = InnovationFilter(model, state_input=direction[:, None])
    scale = np.abs(wild).max()
    np.testing.assert_allclose(blind.run(attacked).white, blind.run(log).white, atol=1e-9 * scale)
    assert np.abs(InnovationFilter(model).run(attacked).white).max() > 100
    sensor = Log(log.time, log.u, log.y + np.outer(wild, [0, 1, 0]), schedule=log.schedule)
    blind = InnovationFilter(model, output_input=[[0.0], [1.0], [0.0]])
    np.testing.assert_allclose(blind.run(sensor).white, blind.run(log).white, atol=1e-9 * scale)


def test_existence_of_unknown_input_observers():
    unknown_input_exists(A, C, [[1.0], [0.0], [0.5]])
    with pytest.raises(ValueError, match="rank 0 with 1 unknown"):
        unknown_input_exists(A, C[:1], [[0.0], [1.0], [0.0]])
    with pytest.raises(ValueError, match="3 unknown inputs and 3 outputs"):
        unknown_input_exists(A, C, np.eye(3))
    # x1 is measured, and decoupled; what it says of the unstable x2 is lost with it.
    unstable, stable = np.array([[0.5, 1.0], [0.0, 1.2]]), np.array([[0.5, 1.0], [0.0, 0.8]])
    outputs, into_first = np.array([[1.0, 0.0], [1.0, 0.0]]), [[1.0], [0.0]]
    unknown_input_exists(stable, outputs, into_first)
    with pytest.raises(ValueError, match=r"mode at 1\.2 that the decoupled outputs do not see"):
        unknown_input_exists(unstable, outputs, into_first)
    with pytest.raises(ValueError, match="state_input has shape"):
        InnovationFilter(GaussianModel(plant(), BOX), state_input=[1.0, 0.0, 0.0])


def test_modes_that_decay_slowly_or_are_seen_weakly_are_no_obstacle():
    """By 1e-7 a sample, and by 1e-7 of the outputs."""
    into_first, blind = [[1.0], [0.0]], np.array([[1.0, 0.0], [1.0, 0.0]])
    unknown_input_exists(np.array([[0.5, 1.0], [0.0, 1.0 - 1e-7]]), blind, into_first)
    with pytest.raises(ValueError, match="mode at 1 "):
        unknown_input_exists(np.array([[0.5, 1.0], [0.0, 1.0]]), blind, into_first)
    weak = np.array([[1.0, 0.0], [1.0, 1e-7]])
    unknown_input_exists(np.array([[0.5, 1.0], [0.0, 1.2]]), weak, into_first)


def test_effect_of_a_fault_is_what_the_simulations_differ_by(log):
    healthy, faulty = scheduled(), scheduled().replace(B=[[0.5], [0.0], [0.25]], c=[0.5, 0.2, 0.0])
    nominal, other = (GaussianModel(m, BOX).samples(log) for m in (healthy, faulty))
    state, output = fault_effect(nominal, other, log.x)
    np.testing.assert_allclose(state, log.u @ np.array([[-0.5, 0.0, -0.25]]))
    np.testing.assert_allclose(output, np.tile([0.0, 0.2, 0.0], (len(log), 1)))


def test_wrong_arguments_are_named(log):
    model = GaussianModel(scheduled(), BOX)
    with pytest.raises(ValueError, match="process_noise is 0"):
        InnovationFilter(model, process_noise=0.0)
    with pytest.raises(ValueError, match="in its output"):
        GaussianModel(plant(F=np.ones((3, 2))), BOX)
    with pytest.raises(ValueError, match="expected a bounded set"):
        GaussianModel(plant(), HPolytope.whole_space(3))
    with pytest.raises(ValueError, match="log has 1 inputs and 2 outputs"):
        InnovationFilter(model).run(Log(log.time, log.u, log.y[:, :2]))
    with pytest.raises(ValueError, match="models has 1"):
        MultipleModelFilter({"nominal": model})
    with pytest.raises(ValueError, match="call update"):
        InnovationFilter(model).start().step([0.0], log.y[0], schedule=0.0)


@pytest.mark.parametrize("model", [plant(), scheduled(), scheduled().replace(n=lambda s: (1 + s**2) * np.ones(3))])
def test_the_model_along_a_log_is_that_of_each_sample(log, model):
    gaussian = GaussianModel(model, BOX)
    samples = gaussian.samples(log)
    for k in (0, 17, len(log) - 1):
        one = gaussian.sample(log.u[k], log.schedule_at(k))
        for name in one._fields:
            np.testing.assert_allclose(getattr(samples, name)[k], getattr(one, name), rtol=0, atol=1e-14)

"""Parity vectors against the stacked equations written out, and a fault that is explained."""

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, UncertainModel
from svo.baselines import GaussianModel, ParitySpace

A, B, C = np.array([[0.9, 0.3], [-0.2, 0.7]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0], [0.5, 1.0]])
MODEL = GaussianModel(
    UncertainModel(A, B, C, E=[[1.0], [0.5]], w=[0.1], n=[0.2, 0.3], c=[0.1, 0.0], Ts=0.1),
    HPolytope.box([-1, -1], [1, 1]),
)


@pytest.fixture
def log():
    rng = np.random.default_rng(0)
    return MODEL.model.simulate([0.3, 0.0], rng.uniform(-1, 1, (40, 1)), rng)


def stacked(log: Log, k: int, order: int):
    """Outputs less what inputs make, observability matrix, and covariance of the noise, from scratch."""
    Q, R = MODEL.sample(np.zeros(1), None).Q, MODEL.sample(np.zeros(1), None).R
    power = [np.linalg.matrix_power(A, i) for i in range(order + 1)]
    observability = np.vstack([C @ power[i] for i in range(order + 1)])
    noise = np.zeros((2 * (order + 1), 2 * order))
    for i in range(1, order + 1):
        for j in range(i):
            noise[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = C @ power[i - 1 - j]
    window = slice(k - order, k + 1)
    forced = (log.u[k - order : k] @ B.T).ravel()
    rest = (log.y[window] - [0.1, 0.0]).ravel() - noise @ forced
    covariance = noise @ np.kron(np.eye(order), Q) @ noise.T + np.kron(np.eye(order + 1), R)
    return rest, observability, covariance, noise


@pytest.mark.parametrize("order", [1, 3, 6])
def test_squares_are_those_of_the_stacked_equations(log, order):
    record = ParitySpace(MODEL, order=order).run(log)
    assert np.isnan(record.squares[:order]).all()
    for k in range(order, len(log)):
        rest, observability, covariance, _ = stacked(log, k, order)
        left = np.linalg.svd(observability)[0][:, 2:]  # no state makes these
        parity = left.T @ rest
        expected = parity @ np.linalg.solve(left.T @ covariance @ left, parity)
        assert record.squares[k] == pytest.approx(expected, rel=1e-9)
    assert record.degrees == 2 * (order + 1) - 2


def test_a_fault_of_any_size_is_explained_by_its_own_signature(log):
    order, K = 5, len(log)
    bias = np.tile([1.0, 0.0], (K, 1))
    leak = np.tile([0.0, 1.0], (K, 1))
    effects = [(np.zeros((K, 2)), bias), (leak, np.zeros((K, 2)))]
    samples = MODEL.samples(Log(log.time, log.u, log.y + 3.0 * bias))
    healthy, faulty = MODEL.samples(log), ParitySpace(MODEL, order=order).over(samples, effects)
    same = ParitySpace(MODEL, order=order).over(healthy, effects)
    np.testing.assert_allclose(faulty.unexplained[order:, 0], same.unexplained[order:, 0], rtol=1e-6, atol=1e-9)
    assert (faulty.squares[order:] > 30).all()
    assert (faulty.unexplained[order:, 1] > 20).all()
    _, _, _, noise = stacked(log, 10, order)
    rest, observability, covariance, _ = stacked(Log(log.time, log.u, log.y + 3.0 * bias), 10, order)
    design = np.column_stack([observability, noise @ np.tile([0.0, 1.0], order)])
    L = np.linalg.cholesky(covariance)
    squares = np.linalg.lstsq(np.linalg.solve(L, design), np.linalg.solve(L, rest), rcond=None)[1]
    assert faulty.unexplained[10, 1] == pytest.approx(float(squares[0]), rel=1e-9)


def test_a_fault_that_a_state_explains_but_for_a_hundred_thousandth_is_still_seen(log):
    """What an initial state of 1 does to the outputs, and 1e-5 of a bias on top."""
    order, K = 5, 6
    free = np.array([C @ np.linalg.matrix_power(A, k) @ [1.0, -1.0] for k in range(K)])
    bias = 1e-5 * np.array([1.0, 0.0])
    short = Log(log.time[:K], log.u[:K], log.y[:K] + 1e6 * bias)
    record = ParitySpace(MODEL, order=order).over(MODEL.samples(short), [(np.zeros((K, 2)), free + bias)])
    plain = ParitySpace(MODEL, order=order).over(MODEL.samples(short), [(np.zeros((K, 2)), np.tile(bias, (K, 1)))])
    assert record.unexplained[order, 0] == pytest.approx(plain.unexplained[order, 0], rel=1e-4)
    assert record.unexplained[order, 0] < 0.1 * record.squares[order]
    gone = ParitySpace(MODEL, order=order).over(MODEL.samples(short), [(np.zeros((K, 2)), free)])
    assert gone.unexplained[order, 0] == gone.squares[order]


def test_wrong_arguments_are_named(log):
    with pytest.raises(ValueError, match="order is 0"):
        ParitySpace(MODEL, order=0)
    with pytest.raises(ValueError, match="process_noise is -1"):
        ParitySpace(MODEL, process_noise=-1.0)
    one = GaussianModel(MODEL.model.replace(C=[[1.0, 0.0]], n=[0.1], c=[0.0]), MODEL.initial)
    with pytest.raises(ValueError, match=r"\(order \+ 1\) ny is not above n"):
        ParitySpace(one, order=1)
    log.y[3, 0] = np.nan
    with pytest.raises(ValueError, match="missing sensor at sample 3"):
        ParitySpace(MODEL).run(log)

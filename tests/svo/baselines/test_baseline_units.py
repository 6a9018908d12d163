"""Residual generators in other units: powers of two on every state, input, output and disturbance change nothing."""

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, UncertainModel
from svo.baselines import (
    GaussianModel,
    InnovationFilter,
    MultipleModelFilter,
    ParitySpace,
    fault_effect,
    unknown_input_exists,
)

A = np.array([[0.9, 0.2, 0.0], [-0.1, 0.8, 0.3], [0.0, 0.1, 0.7]])
B = np.array([[1.0], [0.0], [0.5]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.2, 0.0, 1.0]])
UNITS = [(seed, span) for seed in range(4) for span in (12, 40)]


class Scaled:
    """The plant with states x / 2^a, outputs y / 2^b, inputs u / 2^c."""

    def __init__(self, seed: int = 0, span: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.x, self.y, self.u = (2.0 ** rng.integers(-span, span + 1, size) for size in (3, 3, 1))

    def model(self, leak: float = 0.0) -> UncertainModel:
        return UncertainModel(
            A / self.x[:, None] * self.x,
            B / self.x[:, None] * self.u,
            C / self.y[:, None] * self.x,
            E=np.eye(3)[:, :2] / self.x[:, None],
            w=([-0.1, 0.0], [0.1, 0.4]),
            n=np.array([0.2, 0.1, 0.3]) / self.y,
            a=np.array([0.0, 0.1, leak]) / self.x,
            Ts=0.1,
        )

    def gaussian(self, leak: float = 0.0) -> GaussianModel:
        middle, half = np.array([0.0, 0.5, 0.0]) / self.x, np.array([1.0, 1.5, 0.5]) / self.x
        return GaussianModel(self.model(leak), HPolytope.box(middle - half, middle + half))

    def log(self) -> Log:
        rng = np.random.default_rng(9)
        plain = Scaled().model(0.3).simulate([0.2, 0.1, 0.0], rng.uniform(-1, 1, (150, 1)), rng)
        return Log(time=plain.time, u=plain.u / self.u, y=plain.y / self.y)


@pytest.mark.parametrize(("seed", "span"), UNITS)
def test_filters_and_parity_space_do_not_depend_on_units(seed, span):
    plain, scaled = Scaled(), Scaled(seed, span)
    answers = []
    for unit in (plain, scaled):
        model, log = unit.gaussian(), unit.log()
        unknown = {"state_input": np.array([[1.0], [0.0], [0.5]]) / unit.x[:, None]}
        samples, faulty = model.samples(log), unit.gaussian(0.3).samples(log)
        states = InnovationFilter(model).over(samples).states
        parity = ParitySpace(model).over(samples, [fault_effect(samples, faulty, states)])
        many = MultipleModelFilter({"nominal": model, "leak": unit.gaussian(0.3)}, switching=1e-3).run(log)
        answers.append(
            [
                InnovationFilter(model).run(log).white,
                InnovationFilter(model, **unknown).run(log).white,
                InnovationFilter(model, output_input=np.eye(3)[:, 1:2] / unit.y[:, None]).run(log).white,
                parity.squares,
                parity.unexplained,
                many.log_odds,
            ]
        )
    for one, other in zip(*answers, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-8)
    assert np.nanmean(answers[0][3] - answers[0][4][:, 0]) > 0.5  # the leak explains some of what it made


@pytest.mark.parametrize("size", [2.0**-40, 1e-7, 1.0, 1e9])
def test_the_size_of_a_fault_does_not_decide_whether_it_is_seen(size):
    unit = Scaled()
    model, log = unit.gaussian(), unit.log()
    samples = model.samples(log)
    state, output = np.tile([0.0, 0.0, 1.0], (len(log), 1)), np.zeros((len(log), 3))
    one, other = (ParitySpace(model).over(samples, [(by * state, output)]).unexplained for by in (1.0, size))
    np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize(("seed", "span"), UNITS)
def test_what_can_be_decoupled_does_not_depend_on_units(seed, span):
    unit = Scaled(seed, span)
    model = unit.model()
    stack = model.stack(None)[0]
    a, c = stack[:3, :3], stack[3:, :3]
    there = np.array([[1.0], [0.0], [0.5]]) / unit.x[:, None]
    unknown_input_exists(a, c, there)
    with pytest.raises(ValueError, match="has rank 1"):
        unknown_input_exists(a, c, np.hstack([there, 3 * there]))
    with pytest.raises(ValueError, match="or no residual is left"):
        unknown_input_exists(a, c, there, D=np.eye(3)[:, :2] / unit.y[:, None])


def test_multiple_models_without_switching_run_on_for_thousands_of_samples():
    """A probability that underflowed was divided by: 220 samples were enough."""
    unit, rng = Scaled(), np.random.default_rng(3)
    log = unit.model().simulate([0.2, 0.1, 0.0], rng.uniform(-1, 1, (6000, 1)), rng)
    models = {"nominal": unit.gaussian(), "leak": unit.gaussian(0.8), "far": unit.gaussian(1e6)}
    record = MultipleModelFilter(models, switching=0.0).run(log)
    assert np.isfinite(record.log_odds).all()
    assert record.posterior[-1].tolist() == [1.0, 0.0, 0.0]
    assert record.log_odds[-1] < -2000 > record.log_odds[3000]
    assert np.polyfit(np.arange(6000), record.log_odds, 1)[0] < -0.5  # falls as long as the data say so
    np.testing.assert_allclose(record.posterior.sum(axis=1), 1.0)


def test_without_switching_the_odds_are_the_likelihoods_of_the_innovations():
    unit = Scaled()
    models, log = {"nominal": unit.gaussian(), "leak": unit.gaussian(0.3)}, unit.log()
    squares = [InnovationFilter(model).run(log).squares for model in models.values()]
    record = MultipleModelFilter(models, switching=0.0).run(log)
    np.testing.assert_allclose(record.log_odds, np.cumsum(squares[0] - squares[1]) / 2, rtol=1e-9, atol=1e-9)


def test_a_sensor_without_noise_of_a_state_known_exactly_is_refused():
    model = UncertainModel([[0.5]], None, [[1.0]], n=0.0, Ts=1.0)
    with pytest.raises(ValueError, match="n is zero for output 0, and initial has no width"):
        GaussianModel(model, HPolytope.box([1.0], [1.0]))
    GaussianModel(model, HPolytope.box([0.0], [1.0]))

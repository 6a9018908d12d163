"""The model type: what it takes, what it refuses and in which words, discretisation, simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal
from scipy.io import savemat

from polytopes import HPolytope
from svo.models.discretisation import zero_order_hold
from svo.models.model import UncertainModel, Uncertainty
from tests.svo.observers.random_plants import random_plant

SHAPES = {"A": (3, 3), "B": (3, 2), "a": (3,), "E": (3, 4), "C": (2, 3), "D": (2, 2), "c": (2,), "F": (2, 4)}
seeds = st.integers(0, 2**32 - 1)


def arguments(seed: int = 0, **changes: Any) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    return (
        {name: rng.normal(size=shape) for name, shape in SHAPES.items()} | {"w": np.ones(4), "n": np.ones(2)} | changes
    )


# -- what a sample looks like -----------------------------------------------------------------------------------


def test_stack_and_block_are_the_arrays_that_were_given() -> None:
    given_arrays, own = arguments(0), {k: v for k, v in arguments(1).items() if k in SHAPES}
    model = UncertainModel(**given_arrays, uncertainties=[Uncertainty(), Uncertainty(**own)])
    assert model.stack().shape == (3, 3 + 2, 3 + 2 + 1 + 4)
    top = np.hstack([given_arrays["A"], given_arrays["B"], given_arrays["a"][:, None], given_arrays["E"]])
    bottom = np.hstack([given_arrays["C"], given_arrays["D"], given_arrays["c"][:, None], given_arrays["F"]])
    np.testing.assert_array_equal(model.stack()[0], np.vstack([top, bottom]))
    for name, shape in SHAPES.items():
        np.testing.assert_array_equal(model.block(name), given_arrays[name])
        np.testing.assert_array_equal(model.block(name, uncertainty=1), own[name])
        np.testing.assert_array_equal(model.block(name, uncertainty=0), np.zeros(shape))


def test_what_is_left_out_is_zero() -> None:
    model = UncertainModel([[0.5]], None, [[1.0], [2.0]])
    assert (model.n_states, model.n_inputs, model.n_outputs, model.n_disturbances) == (1, 0, 2, 0)
    np.testing.assert_array_equal(model.stack(), [[[0.5, 0.0], [1.0, 0.0], [2.0, 0.0]]])
    assert [b.tolist() for b in model.bounds()] == [[], [], [0.0, 0.0]]
    assert not model.is_scheduled
    assert not model.uses_input_in_output
    # a disturbance that enters the output only
    assert UncertainModel([[0.5]], None, [[1.0]], F=[[1.0, 2.0]], w=[1.0, 1.0]).n_disturbances == 2


def test_a_model_does_not_follow_later_changes_of_its_arguments() -> None:
    given_arrays = arguments()
    model = UncertainModel(**given_arrays)
    kept = model.stack().copy()
    for value in given_arrays.values():
        value += 1.0
    np.testing.assert_array_equal(model.stack(), kept)
    np.testing.assert_array_equal(model.bounds()[1], np.ones(4))
    with pytest.raises(ValueError, match="read-only"):
        model.stack()[0, 0, 0] = 9.0


def test_arrays_and_bounds_may_be_functions_of_the_schedule() -> None:
    rng = np.random.default_rng(3)
    slopes = {name: rng.normal(size=shape) for name, shape in SHAPES.items()}
    moving: dict[str, Any] = {name: (lambda s, v=slope: s * v) for name, slope in slopes.items()}
    model = UncertainModel(
        **moving, w=(lambda s: -s * np.ones(4), np.full(4, 2.0)), n=lambda s: [s, 0.0], schedule=1.0,
        uncertainties=[Uncertainty(**moving)],
    )  # fmt: skip
    assert model.is_scheduled
    for name, slope in slopes.items():
        np.testing.assert_array_equal(model.block(name, 0.5), 0.5 * slope)
        np.testing.assert_array_equal(model.block(name, 0.5, uncertainty=0), 0.5 * slope)
    lower, upper, noise = model.bounds(0.5)
    assert (lower.tolist(), upper.tolist(), noise.tolist()) == ([-0.5] * 4, [2.0] * 4, [0.5, 0.0])
    with pytest.raises(ValueError, match=r"n is .*expected finite half-widths >= 0"):
        model.bounds(-1.0)


def test_a_function_that_changes_its_shape_is_named() -> None:
    turned = Uncertainty(B=lambda s: np.ones((3, 2)) if s else np.ones((2, 3)), name="drive")
    model = UncertainModel(**arguments(), schedule=1.0, uncertainties=[turned])
    with pytest.raises(
        ValueError, match=r"B of uncertainty drive has shape \(2, 3\); expected \(3, 2\), at schedule 0"
    ):
        model.stack(0)


# -- what is refused --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHAPES)
def test_a_wrong_shape_names_the_array_and_what_was_expected(name: str) -> None:
    wrong = np.ones((7, 7) if len(SHAPES[name]) == 2 else 7) if name != "A" else np.ones((3, 2))
    with pytest.raises(ValueError, match=rf"^{name} has shape .*; expected "):
        UncertainModel(**arguments(**{name: wrong}))
    expected = str(SHAPES[name]).replace("(", r"\(").replace(")", r"\)")
    with pytest.raises(ValueError, match=rf"^{name} of uncertainty 0 has shape .*; expected {expected}"):
        UncertainModel(**arguments(), uncertainties=[Uncertainty(**{name: wrong})])


@pytest.mark.parametrize("name", [*SHAPES, "w", "n"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_nan_and_inf_are_refused_by_name(name: str, value: float) -> None:
    bad = arguments()[name]
    bad.flat[-1] = value
    with pytest.raises(ValueError, match=rf"^{name} .*(contains|finite)"):
        UncertainModel(**arguments(**{name: bad}))
    if name in SHAPES:
        with pytest.raises(ValueError, match=rf"^{name} contains (NaN|an infinity) at "):
            UncertainModel(**arguments(**{name: lambda s: bad}), schedule=0.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": np.zeros((0, 0))}, r"A has shape \(0, 0\); expected a square"),
        ({"w": None}, "w is missing: E or F has 4 columns"),
        ({"w": np.ones(3)}, r"w has bounds of shapes \(3,\) and \(3,\); expected \(4,\)"),
        ({"w": (np.ones(4), np.zeros(4))}, r"w\[0\] has lower bound 1.0 above its upper bound 0.0"),
        ({"w": -np.ones(4)}, r"w\[0\] has lower bound"),
        ({"w": HPolytope.box([0.0], [1.0])}, "w is a polytope of dimension 1; expected 4"),
        ({"w": HPolytope.whole_space(4)}, "w is .*expected finite bounds"),
        ({"w": HPolytope.empty(4)}, "w is an empty polytope"),
        ({"n": [-0.1, 0.1]}, "n is .*expected finite half-widths >= 0"),
        ({"n": [0.1]}, r"n has shape \(1,\); expected \(2,\)"),
        ({"n": lambda s: [0.1, 0.1]}, "schedule is missing: w or n is a function"),
        ({"A": lambda s: np.eye(3)}, "schedule is missing: A is a function"),
        ({"Ts": 0.0}, "Ts is 0.0; expected a positive"),
        ({"Ts": np.nan}, "Ts is nan; expected a positive"),
        ({"names": {"states": ["x"]}}, r"names\['states'\] has 1 entries; expected 3"),
        ({"names": {"colours": []}}, "names has the key 'colours'; expected any of states, inputs"),
    ],
)
def test_other_mistakes_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        UncertainModel(**arguments(**changes))


@pytest.mark.parametrize("bounds", [(1.0, 0.0), (np.nan, 1.0), (0.0, np.inf), (1.0,), (0.0, 1.0, 2.0), None, 1.0, "ab"])
def test_bounds_of_an_uncertainty_are_two_ordered_numbers(bounds: Any) -> None:
    with pytest.raises((ValueError, TypeError), match="bounds of the uncertainty"):
        Uncertainty(bounds=bounds)
    assert Uncertainty(bounds=(0, 0)).bounds == (0.0, 0.0)


def test_forms_of_the_disturbance_set() -> None:
    for w in (2.0, np.full(4, 2.0), [2.0] * 4, (-2.0, 2.0), (np.full(4, -2.0), 2.0)):
        lower, upper, _ = UncertainModel(**arguments(w=w)).bounds()
        np.testing.assert_array_equal([lower, upper], [[-2.0] * 4, [2.0] * 4])
    ball = HPolytope(np.vstack([np.ones((1, 4)), -np.eye(4)]), [1.0, 0.0, 0.0, 0.0, 0.0])
    model = UncertainModel(**arguments(w=ball))
    assert model.disturbance_polytope is ball
    np.testing.assert_allclose(model.bounds()[1], np.ones(4))


def test_replace_checks_again_and_leaves_the_original() -> None:
    model = UncertainModel(**arguments(), names={"states": ["p", "q", "r"]})
    other = model.replace(A=2 * model.block("A"), n=0.5)
    np.testing.assert_array_equal(other.block("A"), 2 * model.block("A"))
    assert other.bounds()[2].tolist() == [0.5, 0.5]
    assert model.bounds()[2].tolist() == [1.0, 1.0]
    assert other.names == model.names
    with pytest.raises(ValueError, match="C has shape"):
        model.replace(C=np.ones((2, 2)))


# -- continuous time ------------------------------------------------------------------------------------------


def flow(A: np.ndarray, rate: np.ndarray, x: np.ndarray, Ts: float, steps: int = 400) -> np.ndarray:
    """dx/dt = A x + rate by the classical Runge-Kutta method."""
    h = Ts / steps
    for _ in range(steps):
        k1 = A @ x + rate
        k2 = A @ (x + h / 2 * k1) + rate
        k3 = A @ (x + h / 2 * k2) + rate
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + A @ (x + h * k3) + rate)
    return x


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_a_continuous_model_is_discretised_exactly(seed: int) -> None:
    rng, Ts = np.random.default_rng(seed), 0.2
    A, B, a, E = (arguments(seed)[name] for name in "ABaE")
    if rng.random() < 0.3:
        A[:, 0] = 0.0  # singular
    model = UncertainModel.from_continuous(A, B, arguments()["C"], Ts=Ts, E=E, a=a, w=np.ones(4))
    x, u, w = rng.normal(size=3), rng.normal(size=2), rng.normal(size=4)
    ours = model.block("A") @ x + model.block("B") @ u + model.block("a") + model.block("E") @ w
    np.testing.assert_allclose(ours, flow(A, B @ u + a + E @ w, x, Ts), rtol=1e-9, atol=1e-9)
    two_steps = zero_order_hold(A, B, 2 * Ts)[0]
    np.testing.assert_allclose(two_steps, model.block("A") @ model.block("A"), rtol=1e-9, atol=1e-12)


def test_what_the_first_order_leaves_out_is_within_the_remainder() -> None:
    A, change, Ts = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0, 0.0], [-0.1, 0.0]]), 0.01
    remainder = [3e-6, 6e-6]
    model = UncertainModel.from_continuous(
        A, None, np.eye(2), Ts=Ts, E=[[0.0], [1.0]], w=([-0.5], [0.25]), F=[[1.0], [0.0]], remainder=remainder,
        uncertainties=[Uncertainty(A=change, c=[1.0, 0.0])],
    )  # fmt: skip
    lower, upper, _ = model.bounds()
    assert (lower.tolist(), upper.tolist()) == ([-0.5, -3e-6, -6e-6], [0.25, 3e-6, 6e-6])
    np.testing.assert_array_equal(model.block("E")[:, 1:], np.eye(2))
    np.testing.assert_array_equal(model.block("F"), [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(model.block("c", uncertainty=0), [1.0, 0.0])
    for delta in (-1.0, 0.3, 1.0):
        x = np.array([1.0, -1.0])
        ours = (model.block("A") + delta * model.block("A", uncertainty=0)) @ x
        error = np.abs(ours - flow(A + delta * change, np.zeros(2), x, Ts))
        assert (error <= remainder).all()
        assert error.max() > 1e-7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"A": np.ones((2, 3))}, r"A has shape \(2, 3\); expected a square"),
        ({"A": 1.0}, r"A has shape \(\)"),
        ({"B": np.ones((1, 2))}, r"B has shape \(1, 2\); expected \(2, columns\)"),
        ({"a": np.ones((2, 1))}, r"a has shape \(2, 1\); expected \(2,\)"),
        ({"E": [[np.nan], [0.0]]}, "E contains NaN"),
        ({"uncertainties": [Uncertainty(A=np.eye(2))]}, r"remainder is missing: give the bound \(2,\)"),
        (
            {"uncertainties": [Uncertainty(A=np.eye(3), name="q")], "remainder": 0.1},
            r"A of uncertainty q has shape \(3, 3\)",
        ),
        ({"uncertainties": [Uncertainty(A=lambda s: s)], "remainder": 0.1}, "A of an uncertainty is a function"),
        ({"remainder": [0.1, -0.1]}, "remainder is"),
        ({"remainder": [0.1]}, r"remainder is .*expected bounds >= 0 of shape \(2,\)"),
        ({"E": [[1.0], [0.0]], "remainder": 0.1}, "w is missing: E or F has 1 columns"),
        ({"E": [[1.0], [0.0]], "w": HPolytope.box([0.0], [1.0]), "remainder": 0.1}, "w is a polytope or a function"),
        ({"E": [[1.0], [0.0]], "w": [1.0, 2.0], "remainder": 0.1}, r"w has bounds of shapes \(2,\)"),
    ],
)
def test_mistakes_in_continuous_time_are_named(changes: dict[str, Any], message: str) -> None:
    given_arrays: dict[str, Any] = {"A": np.eye(2), "B": None, "C": np.eye(2), "Ts": 0.1}
    with pytest.raises(ValueError, match=message):
        UncertainModel.from_continuous(**given_arrays | changes)


def test_a_state_space_system_of_another_library() -> None:
    control = pytest.importorskip("control")
    rng = np.random.default_rng(0)
    matrices = [rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (2, 2))]
    continuous = control.ss(*matrices)
    expected = control.c2d(continuous, 0.1)
    for model in (
        UncertainModel.from_statespace(continuous, Ts=0.1, n=0.1),
        UncertainModel.from_statespace(expected, n=0.1),
        UncertainModel.from_statespace(control.ss(expected.A, expected.B, expected.C, expected.D, True), Ts=0.1),
    ):
        assert model.Ts == 0.1
        for name in "ABCD":
            np.testing.assert_allclose(model.block(name), getattr(expected, name), rtol=1e-9, atol=1e-12)
    assert not UncertainModel.from_statespace(control.ss(*matrices[:3], 0, 0.1)).uses_input_in_output
    with pytest.raises(ValueError, match="Ts is missing"):
        UncertainModel.from_statespace(continuous)
    with pytest.raises(ValueError, match=r"Ts is 0.2 but the system is discrete with dt = 0.1"):
        UncertainModel.from_statespace(expected, Ts=0.2)
    with pytest.raises(ValueError, match="dt = None"):
        UncertainModel.from_statespace(control.ss(*matrices, None), Ts=0.1)


# -- simulation --------------------------------------------------------------------------------------------------


def test_systems_of_scipy_become_models() -> None:
    matrices = [[0.0, 1.0], [-2.0, -0.3]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.5]]
    expected = UncertainModel.from_continuous(*matrices[:3], Ts=0.1, D=matrices[3])
    for system in (signal.StateSpace(*matrices), signal.lti(*matrices)):
        assert np.array_equal(UncertainModel.from_statespace(system, Ts=0.1).stack(), expected.stack())
    discrete = signal.StateSpace(*(expected.block(name) for name in "ABCD"), dt=0.1)
    model = UncertainModel.from_statespace(discrete, n=0.1)
    assert np.array_equal(model.stack(), expected.stack())
    assert model.Ts == 0.1
    poles = np.linalg.eigvals(UncertainModel.from_statespace(signal.dlti([1.0], [1.0, -0.5, 0.06]), Ts=0.1).block("A"))
    assert sorted(poles.real) == pytest.approx([0.2, 0.3])
    with pytest.raises(ValueError, match="Ts is missing"):
        UncertainModel.from_statespace(signal.StateSpace(*matrices))
    with pytest.raises(TypeError, match="sys is a list; expected a state-space system"):
        UncertainModel.from_statespace([1.0])


def test_a_model_is_read_from_a_mat_file(tmp_path: Path) -> None:
    file = tmp_path / "plant.mat"
    arrays = {"A": [[0.9]], "C": [[1.0]], "E": [[1.0, 0.5]], "w_lower": [[-0.1], [-0.2]], "w_upper": [[0.3], [0.2]]}
    savemat(file, arrays | {"n": 0.05, "c": [[0.4]], "unused": [[1.0, 2.0]]})
    model = UncertainModel.from_mat(file, Ts=0.1, B=[[0.3]])
    assert [b.tolist() for b in model.bounds()] == [[-0.1, -0.2], [0.3, 0.2], [0.05]]
    assert (model.block("c").tolist(), model.block("B").tolist()) == ([0.4], [[0.3]])
    with pytest.raises(ValueError, match=r"A is given and .*plant.mat has it too"):
        UncertainModel.from_mat(file, Ts=0.1, A=[[0.9]])
    for arrays, expected in (
        ({"A": [[0.9]]}, "has no variable 'C'"),
        ({"x": [[0.9]]}, "none of the variables A, B, E, C, D, F, a, c, n, w; found x"),
        ({"A": [[0.9]], "C": [[1.0]], "w_lower": 0.0}, "w_lower with w_upper"),
        (
            {"A": [[0.9]], "C": [[1.0]], "n": [[1.0, 1.0], [1.0, 1.0]]},
            r"variable 'n' has shape \(2, 2\); expected a vector",
        ),
    ):
        savemat(file, arrays)
        with pytest.raises(ValueError, match=expected):
            UncertainModel.from_mat(file, Ts=0.1)


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


def test_promised_ranges_of_the_state() -> None:
    model = UncertainModel([[0.9, 0], [0, 0.8]], None, [[1.0, 0.0]], physical=(0, [np.inf, 4.0]), largest=([-1, 1], 3))
    assert model.physical_range is not None
    assert model.start_range is not None
    assert model.physical_range.upper.tolist() == [np.inf, 4.0]
    assert not model.physical_range.is_bounded
    assert model.start_range.lower.tolist() == [0.0, 1.0]  # within physical
    assert model.replace(Ts=2.0).start_range is not None
    assert model.replace(largest=None).start_range is None  # physical is not bounded
    default = model.replace(largest=None, physical=(-1.0, 1.0)).start_range
    assert default is not None
    assert default.upper.tolist() == [1.0, 1.0]
    continuous = UncertainModel.from_continuous([[-1.0]], None, [[1.0]], Ts=0.1, physical=(-2.0, 2.0))
    assert continuous.start_range is not None


@pytest.mark.parametrize("name", ["physical", "largest"])
@pytest.mark.parametrize("value", [(1, 0), (np.nan, 1), 5, ([0, 0], [1, 1]), (0, "a"), (np.inf, np.inf), (0, 1, 2)])
def test_a_promised_range_that_is_none_is_refused(name: str, value: object) -> None:
    with pytest.raises((TypeError, ValueError), match=rf"^{name}(\[[01]\])? .*expected"):
        UncertainModel([[0.9]], None, [[1.0]], **{name: value})  # type: ignore[arg-type]


def test_the_largest_set_is_bounded_and_meets_the_physical_range() -> None:
    with pytest.raises(ValueError, match="all finite"):
        UncertainModel([[0.9]], None, [[1.0]], largest=(-np.inf, 1.0))
    with pytest.raises(ValueError, match="no common point"):
        UncertainModel([[0.9]], None, [[1.0]], physical=(0.0, 1.0), largest=(2.0, 3.0))


def test_directions_over_a_promised_range_are_bounded_outward() -> None:
    from fractions import Fraction

    from svo.models.state_range import StateRange

    rng = np.random.default_rng(0)
    for _ in range(200):
        n = int(rng.integers(1, 5))
        lower = rng.normal(size=n)
        held = StateRange(lower, lower + rng.random(n))
        d = rng.normal(size=(1, n)) * (rng.random((1, n)) < 0.7)
        corner = np.where(d[0] > 0.0, held.upper, held.lower)
        exact = sum(
            (Fraction(a) * Fraction(b) for a, b in zip(d[0].tolist(), corner.tolist(), strict=True)), Fraction(0)
        )
        assert Fraction(float(held.support(d)[0])) >= exact
    assert StateRange(np.array([-np.inf, 0.0]), np.array([1.0, np.inf])).support(np.eye(2)).tolist() == [1.0, np.inf]


def test_a_matrix_after_C_has_to_be_named() -> None:
    with pytest.raises(TypeError, match=r"UncertainModel takes A, B, C by position; .* D=\.\.\., E=\.\.\."):
        UncertainModel([[0.5]], [[1.0]], [[1.0]], [[0.0]])  # type: ignore[call-arg]


@pytest.mark.parametrize("name", ["physical", "largest"])
@pytest.mark.parametrize(
    "bound",
    [
        np.ma.array([1.0, -9999.0], mask=[False, True]),
        np.array([1.0 + 1.0j, 2.0]),
        np.array([1, 2], dtype="timedelta64[s]"),
        np.array([1, 2], dtype="datetime64[s]"),
        np.array(["1.0", "2.0"]),
        np.array([1.0, 2.0], dtype=object),
        [10**400, 1],
        [np.nan, 1.0],
        [1.0, 2.0, 3.0],
    ],
    ids=lambda bound: str(getattr(bound, "dtype", "list")),
)
def test_a_range_of_the_state_goes_through_the_door_for_numbers(name: str, bound: Any) -> None:
    """A masked end was read as data, and an imaginary part was dropped."""
    with pytest.raises((TypeError, ValueError), match=rf"^{name}\[1\]"):
        UncertainModel(np.eye(2), None, np.eye(2), **{name: ([-9e9, -9e9], bound)})

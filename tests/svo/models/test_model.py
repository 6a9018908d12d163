"""The model type: what it takes, what it refuses and in which words."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty

SHAPES = {"A": (3, 3), "B": (3, 2), "a": (3,), "E": (3, 4), "C": (2, 3), "D": (2, 2), "c": (2,), "F": (2, 4)}


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


def test_a_matrix_after_C_has_to_be_named() -> None:
    with pytest.raises(TypeError, match=r"UncertainModel takes A, B, C by position; .* D=\.\.\., E=\.\.\."):
        UncertainModel([[0.5]], [[1.0]], [[1.0]], [[0.0]])  # type: ignore[call-arg]

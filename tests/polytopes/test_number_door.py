"""Numbers come in exactly or not at all: every kind of array that a user may hold, at every door of the engine."""

import datetime
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.sparse

from polytopes import Certificate, ConstrainedZonotope, HPolytope, conversions, convex_hull, union_bounds
from polytopes.checks import real_array, real_number, whole_number
from polytopes.files import write_ext, write_ine


class WithUnit(np.ndarray):
    """An array that means more than its numbers."""


TAKEN: list[tuple[Any, list]] = [
    ([[1, 2.5], [True, np.float32(0.5)]], [[1.0, 2.5], [1.0, 0.5]]),
    (((1, 2), np.array([3, 4])), [[1.0, 2.0], [3.0, 4.0]]),
    (np.array([1, 2], ">i4"), [1.0, 2.0]),
    (np.array([True, False]), [1.0, 0.0]),
    (np.matrix([[1, 2]]), [[1.0, 2.0]]),
    (np.ma.array([1.0, 2.0], mask=[False, False]), [1.0, 2.0]),
    (np.longdouble("0.5") * np.ones(1), [0.5]),
    ([2**70, -(2**60)], [float(2**70), -float(2**60)]),
    (np.array([2**62, -(2**63)]), [2.0**62, -(2.0**63)]),
    (range(3), [0.0, 1.0, 2.0]),
    (pd.Series([1, 2], dtype="Int64"), [1.0, 2.0]),
    (pd.DataFrame({"a": [1, 2], "b": [0.5, 1.5]}), [[1.0, 0.5], [2.0, 1.5]]),
]


@pytest.mark.parametrize(("value", "expected"), TAKEN)
def test_real_numbers_are_taken_exactly(value: Any, expected: list) -> None:
    array = real_array("A", value)
    assert array.tolist() == expected
    assert type(array) is np.ndarray
    assert array.dtype == np.float64
    assert array.flags.writeable
    assert array.flags.c_contiguous
    assert not np.shares_memory(array, value if isinstance(value, np.ndarray) else np.empty(0))


REFUSED: list[tuple[Any, type[Exception], str]] = [
    ([1 + 0j, 2.0], TypeError, "dtype complex128.*real part"),
    ([np.array([1.0, 2.0]), np.array([1j, 2.0])], TypeError, "complex128"),
    (["1", "2"], TypeError, "dtype <U1.*text"),
    (b"12", TypeError, "text"),
    (None, TypeError, "is a NoneType"),
    ([1.0, None], ValueError, r"missing entry \(None\)"),
    ([1.0, "x"], TypeError, "text"),
    ([1.0, Fraction(1, 3)], TypeError, "holds a fractions.Fraction"),
    (Decimal("0.1"), TypeError, "is a decimal.Decimal"),
    (np.array([1, 2], dtype=object), TypeError, "dtype object"),
    (np.timedelta64(3, "s"), TypeError, "timedelta64.*Divide by a unit"),
    ([np.timedelta64(3, "s"), 1], TypeError, "timedelta64"),
    ([datetime.timedelta(1)], TypeError, "datetime.timedelta"),
    (pd.date_range("2020", periods=2), TypeError, "datetime64.*Subtract a start"),
    (pd.to_timedelta([1, 2], unit="s"), TypeError, "timedelta64"),
    (np.ma.array([1.0, 2.0], mask=[False, True]), ValueError, r"1 masked entries at \[1\]"),
    ([np.ma.array([1, 2], mask=[False, True]), [3, 4]], ValueError, r"NaN at \[0, 1\]"),
    ([np.ma.masked, 1.0], ValueError, "missing entry"),
    (np.ma.masked, ValueError, "masked"),
    ([1.0, np.nan], ValueError, r"NaN at \[1\]"),
    ([1.0, -np.inf], ValueError, r"infinity at \[1\]"),
    ([2**53 + 1], ValueError, "9007199254740993, which no float equals"),
    ([2**53 + 1, 0.5], ValueError, "9007199254740993, which no float equals"),
    (np.array([0, 2**53 + 1]), ValueError, "9007199254740993, which no float equals"),
    (np.array([2**64 - 1], dtype=np.uint64), ValueError, "no float equals"),
    ([10**400], ValueError, "integer of 1329 bits"),
    (np.longdouble("0.1") * np.ones(2), ValueError, "no float equals"),
    ([[1, 2], [3]], ValueError, "rows of one length"),
    (scipy.sparse.eye_array(2), TypeError, r"dense array. Use A.toarray"),
    (np.eye(2).view(WithUnit), TypeError, "WithUnit; expected a plain array"),
    (np.zeros(2, dtype=[("a", float)]), TypeError, "one field"),
    ({1.0, 2.0}, TypeError, "is a set"),
    ((v for v in [1.0]), TypeError, "is a generator"),
    (pd.DataFrame({"a": [1.0], "name": ["x"]}), TypeError, r"A\['name'\] has dtype"),
    (pd.DataFrame({"a": [1, 2**53 + 1], "b": [0.5, 1.0]}), ValueError, r"A\['a'\] contains 9007199254740993"),
    (pd.Series([1, None], dtype="Int64"), ValueError, "NaN|missing"),
]


@pytest.mark.parametrize(("value", "error", "message"), REFUSED)
def test_what_would_lose_its_meaning_is_refused(value: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        real_array("A", value)


def test_a_list_that_holds_itself_is_refused() -> None:
    endless: list = []
    endless.append(endless)
    with pytest.raises(ValueError, match="A is no array"):
        real_array("A", endless)


@pytest.mark.parametrize(
    "value",
    [
        [1.0, np.nan],
        [1, None],
        [1, np.ma.masked],
        np.ma.array([1, -9999], mask=[False, True]),
        pd.Series([1, None], dtype="Int64"),
        pd.Series([1.0, None]),
    ],
)
def test_missing_readings_become_nan_where_they_may_be_missing(value: Any) -> None:
    np.testing.assert_array_equal(real_array("y", value, (2,), missing=True), [1.0, np.nan])


def test_shapes_and_single_numbers() -> None:
    with pytest.raises(ValueError, match=r"b has shape \(3,\); expected \(2,\), one entry per row of A."):
        real_array("b", [1, 2, 3], (2,), meaning="one entry per row of A")
    with pytest.raises(ValueError, match=r"x has shape \(\); expected \(2,\) or \(k, 2\)."):
        real_array("x", 3.0, (2,), ("k", 2))
    assert real_number("tol", np.float32(0.5)) == 0.5
    with pytest.raises(ValueError, match=r"tol has shape \(1,\); expected \(\) \(one number\)"):
        real_number("tol", [0.5])
    with pytest.raises(ValueError, match="tol is nan"):
        real_number("tol", np.nan)
    assert whole_number("n", np.int8(3)) == 3
    for value in (3.0, True, "3", None, np.array([1, 2])):
        with pytest.raises(TypeError, match=r"n is .*; expected an integer"):
            whole_number("n", value)


MASKED = np.ma.array(np.eye(2), mask=[[False, True], [False, False]])
BOX = HPolytope.box([0.0, 0.0], [1.0, 1.0])
BALL = BOX.enclosing_ellipsoid()


@pytest.mark.parametrize(
    "call",
    [
        lambda value: HPolytope(value, [1.0, 1.0]),
        lambda value: HPolytope(np.eye(2), value[0]),
        lambda value: HPolytope(np.eye(2), np.ones(2), value, np.ones(2)),
        lambda value: HPolytope(np.eye(2), np.ones(2), np.eye(2), value[0]),
        lambda value: HPolytope.box(value[0], [1.0, 1.0]),
        lambda value: HPolytope.box([0.0, 0.0], value[0]),
        lambda value: HPolytope.from_vertices(value),
        lambda value: HPolytope.from_vertices(np.eye(2), rays=value),
        lambda value: BOX.support(value),
        lambda value: BOX.support_points(value[0]),
        lambda value: BOX.contains(value),
        lambda value: BOX.affine_map(value),
        lambda value: BOX.affine_map(np.eye(2), value[0]),
        lambda value: BOX.preimage(value),
        lambda value: BOX.preimage(np.eye(2), value[0]),
        lambda value: BOX.outer_template(value),
        lambda value: union_bounds([BOX], directions=value),
        lambda value: BALL.support(value),
        lambda value: BALL.surface(value),
    ],
)
@pytest.mark.parametrize("value", [MASKED, np.eye(2) + 0j, np.eye(2).astype(str), np.eye(2).astype("m8[s]")])
def test_every_door_of_a_set_is_the_same(call: Any, value: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=r"masked|real numbers"):
        call(value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: HPolytope.empty(0),
        lambda: HPolytope.whole_space(2.5),  # type: ignore[arg-type]
        lambda: HPolytope.simplex(-1),
        lambda: BOX.project([0.0]),  # type: ignore[list-item]
        lambda: BOX.project(1),  # type: ignore[arg-type]
        lambda: BOX.project([0, 0]),
        lambda: BOX.project([True]),
        lambda: BOX.outer_reduce(3),
        lambda: BOX.random_points(-1, np.random.default_rng(0)),
        lambda: BOX.random_points(3, 7),  # type: ignore[arg-type]
        lambda: BOX.contains([0.0, 0.0], tol=np.nan),
        lambda: BOX.contains([0.0, 0.0], tol=[0.1, 0.2]),  # type: ignore[arg-type]
        lambda: BOX.plot(dims=(0, 0)),
        lambda: BOX.project({0, 1}),  # type: ignore[arg-type]
        lambda: BOX.lift(3, {0: 1, 1: 2}),  # type: ignore[arg-type]
        lambda: BOX.plot("axes"),
        lambda: BALL.surface([[1.0, 0.0], [0.0, 0.0]]),
        lambda: conversions.from_halfspaces(np.zeros((2, 0))),
        lambda: conversions.from_polytope(3),
        lambda: conversions.from_polytope(BOX),
        lambda: Certificate.from_dict(np.zeros(2)),  # type: ignore[arg-type]
        lambda: convex_hull([]),
        lambda: convex_hull([BOX, np.eye(2)]),  # type: ignore[list-item]
    ],
)
def test_counts_and_coordinates_are_checked(call: Any) -> None:
    with pytest.raises((TypeError, ValueError), match="expected"):
        call()


@pytest.mark.parametrize("value", [None, np.eye(2), "set", BOX.as_box, [BOX]])
@pytest.mark.parametrize(
    "call",
    [
        ConstrainedZonotope.of,
        conversions.to_halfspaces,
        conversions.to_cdd,
        conversions.to_shapely,
        conversions.to_polytope,
        lambda P: write_ine(P, "set.ine"),
        lambda P: write_ext(P, "set.ext"),
        lambda P: BOX.intersects(HPolytope.simplex(2).translate([3.0, 3.0])).verify(P, BOX),
        BOX.intersects,
        BOX.minkowski_sum,
        BOX.hausdorff,
    ],
)
def test_what_is_no_set_is_named(call: Any, value: Any) -> None:
    with pytest.raises(TypeError, match="expected an HPolytope"):
        call(value)


@pytest.mark.parametrize("function", [convex_hull, union_bounds])
def test_sets_come_in_a_sequence_and_in_nothing_else(function: Any) -> None:
    P = HPolytope.box([-1.0], [1.0])
    for given, error, words in (
        ({"a": P}, TypeError, "sets is a dict; expected a sequence of HPolytope"),
        ({0: P}, TypeError, "sets is a dict"),
        (P, TypeError, "sets is a polytopes.hpolytope.HPolytope; expected a sequence"),
        ("text", TypeError, "sets is a str"),
        (None, TypeError, "sets is a NoneType"),
        ([P, 3], TypeError, r"sets\[1\] is a int"),
        ([[P]], TypeError, r"sets\[0\] is a list"),
        (np.array([], dtype=object), ValueError, "sets is empty"),
        ([P, HPolytope.box([-1.0, -1.0], [1.0, 1.0])], ValueError, "dimension 2; expected 1"),
    ):
        with pytest.raises(error, match=words):
            function(given)
    for given in ([P, P], (P,), iter([P, P]), np.array([P, P], dtype=object)):
        assert function(given).equals(P)

"""Tables over a schedule, alone, in models and under faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from svo import ScheduleTable, UncertainModel, Uncertainty
from svo.faults import ActuatorFault, Step

POINTS = np.array([0.0, 0.25, 1.0, 4.0])
RNG = np.random.default_rng(0)
A, B, C, MOMENT = (ScheduleTable(POINTS, RNG.normal(size=(4, *shape))) for shape in ((2, 2), (2, 1), (1, 2), (2, 2)))


def model(wrap: Any = lambda table: table) -> UncertainModel:
    items = [Uncertainty(A=wrap(MOMENT), bounds=(0.0, 1.0))]
    return UncertainModel(wrap(A), wrap(B), wrap(C), a=[0.1, 1.0 / 3.0], n=[0.1], schedule=0.5, uncertainties=items)


@settings(max_examples=50, deadline=None)
@given(st.floats(-1.0, 5.0))
def test_entries_are_interpolated_linearly(at: float) -> None:
    expected = [np.interp(at, POINTS, column) for column in A.values.reshape(4, -1).T]
    np.testing.assert_allclose(A(at).ravel(), expected, atol=1e-14)


def test_points_are_met_exactly() -> None:
    for point, value in zip(POINTS, A.values, strict=True):
        np.testing.assert_array_equal(A(point), value)


@settings(max_examples=50, deadline=None)
@given(st.floats(-1.0, 5.0))
def test_a_model_of_tables_is_the_model_of_their_functions(at: float) -> None:
    one_by_one = model(lambda table: lambda schedule: table(schedule))
    np.testing.assert_array_equal(model().stack(at), one_by_one.stack(at))


@pytest.mark.parametrize("kind", ["loss", "hard-over"])
def test_a_fault_of_tables_is_the_fault_of_their_functions(kind: Any) -> None:
    fault = ActuatorFault(0, kind, 0.5, Step(0.0))
    tables = fault.model(model())
    functions = fault.model(model(lambda table: lambda schedule: table(schedule)))
    assert isinstance(tables.uncertainties[-1].B, ScheduleTable)
    for at in (-1.0, 0.1, 0.7, 3.3):
        np.testing.assert_allclose(tables.stack(at), functions.stack(at), rtol=1e-14)


def test_tables_over_other_points_are_evaluated_one_by_one() -> None:
    other = ScheduleTable([0.0, 4.0], np.zeros((2, 1, 2)))
    np.testing.assert_array_equal(model().replace(C=other).block("C", 1.5), other(1.5))


@pytest.mark.parametrize(
    ("points", "values", "message"),
    [
        ([0.0], [[1.0]], "points has shape"),
        ([0.0, 0.0], [1.0, 2.0], "points has shape"),
        ([0.0, 1.0], [1.0, 2.0, 3.0], r"values has shape \(3,\)"),
        ([0.0, np.nan], [1.0, 2.0], "points contains NaN"),
    ],
)
def test_bad_tables_are_named(points: Any, values: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ScheduleTable(points, values)


@pytest.mark.parametrize("schedule", [np.nan, np.inf])
def test_a_schedule_that_is_no_number_is_refused(schedule: float) -> None:
    with pytest.raises(ValueError, match="schedule is"):
        A(schedule)


class Doubled:
    """A function of the schedule with an ``over`` of its own that is not a table."""

    def __init__(self, table: ScheduleTable) -> None:
        self.table = table

    def __call__(self, schedule: Any) -> np.ndarray:
        return 2 * self.table(schedule)

    def over(self, schedule: Any) -> np.ndarray:
        return 2 * self.table.over(schedule)


@pytest.mark.parametrize("wrap", [lambda table: table, lambda table: lambda schedule: table(schedule), Doubled])
def test_many_samples_at_once_are_the_samples_one_by_one(wrap: Any) -> None:
    schedule = np.concatenate([POINTS, np.linspace(-1.0, 5.0, 41)])
    one_by_one = np.array([model(wrap).stack(at) for at in schedule])
    np.testing.assert_allclose(model(wrap).stack_over(schedule), one_by_one, rtol=0, atol=1e-14)


def test_a_function_of_many_samples_with_a_wrong_shape_is_named() -> None:
    class Wrong(Doubled):
        def over(self, schedule: Any) -> np.ndarray:
            return super().over(schedule)[:, :1]

    with pytest.raises(ValueError, match=r"A has shape \(1, 2\); expected \(2, 2\) at each sample"):
        model(lambda table: Wrong(table) if table is A else Doubled(table)).stack_over(POINTS)


def test_a_table_in_other_units_gives_the_same_bits() -> None:
    rng = np.random.default_rng(12)
    table = ScheduleTable(np.cumsum(rng.uniform(0.1, 1.0, 9)), rng.normal(size=(9, 3, 2)))
    unit = np.ldexp(1.0, rng.integers(-30, 30, (3, 2)))
    at = rng.uniform(-1.0, 10.0, 50)
    for s in at.tolist():
        assert (table.times(unit)(s) == table(s) * unit).all()
    assert (table.times(unit).over(at) == table.over(at) * unit).all()

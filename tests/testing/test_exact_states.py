"""The oracle of the observers' rules: its runs are exact in floats, and its sets are those of another oracle."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from svo.testing.exact_states import exactly, product
from svo.testing.observer_sets import UNITS, inputs
from svo.testing.systems import EXACT, System
from tests.svo.observers.oracle import box

every_system = pytest.mark.parametrize("system", EXACT.values(), ids=EXACT)


@every_system
@pytest.mark.parametrize("unit", UNITS)
def test_a_run_on_the_edge_is_exact_in_floats(system: System, unit: float) -> None:
    one = system.scaled(unit)
    log, model, n = one.edge(inputs(unit, 3), 3), one.model, one.model.n_states
    assert log.x is not None
    rows = model.stack()[0, n:].tolist()
    for x, u, y in zip(log.x.tolist(), log.u.tolist(), log.y.tolist(), strict=True):
        known = exactly([*x, *u, 1.0, *[0.0] * model.n_disturbances])
        errors = [Fraction(value) - product(exactly(row), known) for row, value in zip(rows, y, strict=True)]
        assert [abs(e) for e in errors] == exactly(model.bounds()[2].tolist())


@every_system
def test_the_true_state_is_one_of_the_exact_states(system: System) -> None:
    log = system.edge(inputs(1.0, 4), 4)
    assert log.x is not None
    for states, x in zip(system.states(log), log.x.tolist(), strict=True):
        for row in np.random.default_rng(0).normal(size=(20, len(x))).tolist():
            reached = max(product(exactly(row), vertex) for vertex in states)
            assert product(exactly(row), exactly(x)) <= reached


@every_system
def test_the_exact_states_are_those_of_linear_programs(system: System) -> None:
    """As `tests.svo.observers.oracle` finds them with HiGHS, from rows over all samples at once."""
    log = system.calm(inputs(1.0, 5), 5)
    found = box(system.model, log, *np.array(system.first).T, rounding=0.0)
    ends = np.array([[float(v) for v in vertex] for vertex in system.states(log)[-1]])
    np.testing.assert_allclose([ends.min(axis=0), ends.max(axis=0)], [found.lower, found.upper], atol=1e-8)

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from svo.analysis.sparse_program import SparseProgram


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_optimum_is_that_of_a_dense_solver_and_weak_duality_stays_below_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m, n = (int(v) for v in rng.integers(1, 8, 2))
    A, z = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.7), rng.uniform(-1, 1, n)
    below, above = A @ z - rng.uniform(0, 1, m), A @ z + rng.uniform(0, 1, m)
    below[rng.random(m) < 0.3] = -np.inf
    cost, half = rng.normal(size=n), n // 2
    program = SparseProgram()
    left, right = program.columns(-np.ones(half), np.ones(half)), program.columns(-np.ones(n - half), np.ones(n - half))
    program.rows([(left, A[:, :half]), (right, A[:, half:])], below, above)
    found = program.minimise(cost)
    finite = np.isfinite(below)
    other = linprog(
        cost, A_ub=np.vstack([A, -A[finite]]), b_ub=np.concatenate([above, -below[finite]]), bounds=[(-1, 1)] * n
    )
    assert found is not None
    np.testing.assert_allclose(found.value, other.fun, atol=1e-7)
    np.testing.assert_allclose(program.weak_dual_bound(cost, found.multipliers), other.fun, atol=1e-7)
    guess = rng.normal(size=m)
    assert program.weak_dual_bound(cost, guess) <= other.fun + 1e-9


def test_rows_that_contradict_each_other_have_no_point() -> None:
    program = SparseProgram()
    z = program.columns([0.0], [1.0])
    program.rows([(z, np.ones((1, 1)))], 2.0, np.inf)
    assert program.minimise(np.ones(1)) is None

"""Projections against the exact oracle, between methods, and the traps of elimination."""

import logging

import numpy as np
import pytest
from exact_sets import minimal_size, shadow, supports
from hypothesis import given, settings
from hypothesis import strategies as st
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import HPolytope, ProjectionLimitError, UnboundedError
from polytopes.projection import METHODS


def random_directions(k: int, count: int = 30) -> np.ndarray:
    directions = np.random.default_rng(3).integers(-5, 6, (count, k))
    return np.vstack([directions, np.eye(k, dtype=int), -np.eye(k, dtype=int)])


def degenerate_system(rng: np.random.Generator) -> HPolytope:
    n = int(rng.integers(2, 5))
    A = rng.integers(-1, 2, (int(rng.integers(n, 10)), n)).astype(float)
    b = rng.integers(0, 4, len(A)).astype(float)
    if rng.random() < 0.3:
        return HPolytope(A[1:], b[1:], A[:1], b[:1])
    return HPolytope(A, b)


def test_degenerate_integer_systems_match_the_exact_oracle() -> None:
    rng = np.random.default_rng(0)
    for trial in range(600):
        P = degenerate_system(rng)
        keep = rng.permutation(P.dim)[: int(rng.integers(1, P.dim))].tolist()
        Q, exact = P.project(keep), shadow(P, keep)
        c = random_directions(len(keep))
        np.testing.assert_allclose(Q.support(c), supports(exact, c), atol=1e-9, err_msg=str(trial))
        minimal = Q.remove_redundancy()
        assert (minimal.b.size, minimal.d.size) == (minimal_size(exact) if not exact.is_empty() else (1, 0)), trial


@pytest.mark.parametrize("bounded", [True, False])
def test_sparse_systems_whose_steps_go_unpruned_match_the_exact_oracle(bounded: bool) -> None:
    """Rows of two integers in 5 to 7 coordinates: what elimination returns is the shadow, and minimal as it is."""
    rng = np.random.default_rng(7)
    for trial in range(40):
        n = int(rng.integers(5, 8))
        A = np.zeros((int(rng.integers(n, 3 * n)), n))
        for row in A:
            row[rng.choice(n, 2, replace=False)] = rng.choice([-3, -2, -1, 1, 2, 3], 2)
        P = HPolytope(A, rng.integers(1, 6, len(A)))
        if bounded:
            P = P.intersection(HPolytope.box(np.full(n, -4.0), np.full(n, 4.0)))
        keep = rng.permutation(n)[: int(rng.integers(1, 4))].tolist()
        Q, exact = P.project(keep, method="fourier-motzkin"), shadow(P, keep)
        c = random_directions(len(keep))
        np.testing.assert_allclose(Q.support(c), supports(exact, c), atol=1e-9, err_msg=str(trial))
        assert (Q.b.size, Q.d.size) == minimal_size(exact), trial


def test_pruning_by_programs_is_not_mixed_with_histories_of_rows() -> None:
    table = np.array(
        [[0, 0, -1, 1], [0, 1, 1, 0], [1, 0, 0, 3], [0, 1, -1, 0],
         [-1, -1, -1, 1], [-1, -1, 0, 1], [-1, 0, 0, 3], [-1, -1, 1, 1]], dtype=float
    )  # fmt: skip
    P = HPolytope(table[:, :3], table[:, 3])
    for method in METHODS:
        if method != "vertices":
            lower, upper = P.project([0], method=method).bounding_box()
            assert (lower[0], upper[0]) == pytest.approx((-1.0, 3.0))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", [name for name, P in CATALOGUE.items() if P.dim >= 2])
def test_every_method_on_every_kind_of_set(name: str, method: str) -> None:
    P = CATALOGUE[name]
    for keep in ([0], [1, 0], list(range(P.dim))):
        try:
            Q = P.project(keep, method=method)
        except UnboundedError:
            assert name in UNBOUNDED
            assert method in ("convex-hull", "vertices")
            continue
        assert Q.dim == len(keep)
        c = random_directions(len(keep)).astype(float)
        lifted = np.zeros((len(c), P.dim))
        lifted[:, keep] = c
        np.testing.assert_allclose(Q.support(c), P.support(lifted), atol=1e-12)
        assert (Q.emptiness().status == "empty") == (name in EMPTY)


@pytest.mark.parametrize("sparse", [True, False])
def test_methods_agree(sparse: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        A = rng.standard_normal((20, 5))
        if sparse:
            A *= rng.random(A.shape) < 0.5
        P = HPolytope(np.vstack([A, np.eye(5), -np.eye(5)]), np.append(rng.uniform(0.5, 1.5, 20), np.full(10, 2.0)))
        results = [P.project([0, 2, 4], method=method) for method in METHODS]
        assert len({Q.b.size for Q in results}) == 1
        for Q in results[1:]:
            assert Q.equals(results[0], tol=1e-10)


@pytest.mark.parametrize(("keep", "height"), [(4, 2.0), (3, 2.0), (4, np.inf), (3, np.inf)])
def test_the_choice_of_a_method_does_not_change_the_shadow(keep: int, height: float) -> None:
    """Dense rows: vertices, convex hull, and elimination where the shadow or the set is unbounded."""
    rng = np.random.default_rng(6)
    A = rng.standard_normal((14, 5))
    top = np.append(np.full(4, 2.0), height)
    if keep == 3:
        top[0] = height
    A[:, np.isinf(top)] = -np.abs(A[:, np.isinf(top)])  # no row bounds such a coordinate from above
    P = HPolytope(A, rng.uniform(0.5, 1.5, 14)).intersection(HPolytope.box([-2.0] * 5, top))
    c = rng.standard_normal((60, keep))
    expected = P.support(np.hstack([c, np.zeros((60, 5 - keep))]))
    for limit in (20_000, 10):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("polytopes.projection._CHEAP_ROWS", limit)
            np.testing.assert_allclose(P.project(range(keep)).support(c), expected, atol=1e-9)


def test_equalities_are_used_before_elimination() -> None:
    P = HPolytope(np.vstack([np.eye(3), -np.eye(3)]), np.ones(6), [[1.0, 1.0, 1.0]], [0.5])
    Q = P.project([0, 1])
    assert Q.d.size == 0
    assert Q.contains([0.5, 1.0])
    assert not Q.contains([-0.9, 0.0])
    flat = HPolytope(np.vstack([np.eye(3), -np.eye(3)]), np.ones(6), [[1e-8, 1e-8, 0.0]], [1e-8]).project([0, 1])
    assert flat.d.size == 1
    assert flat.affine_dim() == 1


def test_the_row_limit_raises_with_numbers_or_gives_a_superset(caplog: pytest.LogCaptureFixture) -> None:
    rng = np.random.default_rng(2)
    P = HPolytope(rng.standard_normal((40, 6)), rng.uniform(0.5, 1.5, 40))
    with pytest.raises(ProjectionLimitError, match=r"variable \d of 4 would form \d+ rows from \d+, .*max_rows=100"):
        P.project([0, 1], method="fourier-motzkin", max_rows=100)
    outer, exact = P.project([0, 1], method="fourier-motzkin", max_rows=100, outer=True), P.project([0, 1])
    assert outer.contains(exact)
    assert outer.is_bounded()
    with caplog.at_level(logging.INFO, logger="polytopes"):
        HPolytope.box(-np.ones(3), np.ones(3)).project([0], method="fourier-motzkin")
    assert "eliminated variable 2 of 2" in caplog.text


def test_rounding_of_earlier_steps_makes_no_rows() -> None:
    """Rows in a space of one dimension less, products beyond 2^53: the shadow on a line is the whole line, exactly."""
    tried = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(4, 6))
        A = (rng.integers(-9, 10, (2 * n, n - 1)) @ rng.integers(-99, 100, (n - 1, n))).astype(float)
        b = A @ rng.integers(-9, 10, n) + (rng.random(2 * n) < 0.2) * rng.integers(0, 5, 2 * n)
        P = HPolytope(A, b)
        if P.affine_dim() == n:
            tried += 1
            assert P.project([0], method="fourier-motzkin").equals(HPolytope.whole_space(1)), seed
    assert tried > 15


def test_thin_sets_keep_their_width() -> None:
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((4, 4)))[0]
    slab = HPolytope.box([0.0, -1.0, -1.0, -1.0], [1e-7, 1.0, 1.0, 1.0]).preimage(turn)
    c = np.random.default_rng(5).standard_normal((50, 3))
    for method in METHODS:
        Q = slab.project([0, 1, 2], method=method)
        np.testing.assert_allclose(Q.support(c), slab.support(np.hstack([c, np.zeros((50, 1))])), atol=1e-9)


def test_rows_that_floats_cannot_decide_are_settled_once() -> None:
    """Two strips that are nearly one, met in an observer: pruning found the same four rows doubtful again for ever."""
    rows = [[1, 0.15566095022892046], [-1, -0.15566095022892046], [-1, -0.15566094885653387], [1, 0.15566094885653387]]
    rhs = [-0.19782821955311447, 0.19782821955438643, 0.19782821794751143, -0.19782821794536817]
    turn = np.array([[-0.03758920653456064, -0.083681646668206], [-0.011048152572234335, 0.498280234073437]])
    shift = np.array([-0.11385346772013553, -0.5894296268302525])
    needle = HPolytope(rows, rhs)
    image = needle.affine_map(turn, shift)
    directions = np.vstack([np.eye(2), -np.eye(2)])
    expected = needle.support(directions @ turn) + directions @ shift
    np.testing.assert_allclose(image.support(directions), expected, atol=1e-6)


def test_wrong_arguments_are_refused() -> None:
    P = HPolytope.box([0.0, 0.0], [1.0, 1.0])
    for keep in ([], [0, 0], [2], [-1]):
        with pytest.raises(ValueError, match="keep is"):
            P.project(keep)
    with pytest.raises(ValueError, match="method is 'qhull'"):
        P.project([0], method="qhull")


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_projection_of_an_intersection_lies_in_the_intersection_of_projections(seed: int) -> None:
    rng = np.random.default_rng(seed)
    box = HPolytope.box([-3.0] * 3, [3.0] * 3)
    P, Q = (
        box.intersection(HPolytope(rng.integers(-2, 3, (4, 3)), rng.integers(0, 4, 4).astype(float))) for _ in range(2)
    )
    both = P.project([0, 1]).intersection(Q.project([0, 1]))
    assert both.contains(P.intersection(Q).project([0, 1]))

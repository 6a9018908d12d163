"""Invariance with inputs of ordinary floats, against an exact library: proofs, and predecessors from outside."""

from fractions import Fraction
from math import lcm

import numpy as np
import ppl
import pytest

from polytopes import HPolytope
from svo.analysis.invariant_sets import is_invariant, largest_invariant_set
from svo.analysis.one_step_sets import LinearSystem, predecessor

FEW = pytest.mark.parametrize("count", [6, pytest.param(60, marks=pytest.mark.slow)])


def cube(n: int, half: float) -> HPolytope:
    return HPolytope.box(np.full(n, -half), np.full(n, half))


def form(coefficients: list[Fraction], constant: Fraction) -> ppl.Linear_Expression:
    common = lcm(*(v.denominator for v in (*coefficients, constant)))
    whole = sum((int(v * common) * ppl.Variable(j) for j, v in enumerate(coefficients)), 0 * ppl.Variable(0))
    return whole - int(constant * common)


def fractions(table: np.ndarray) -> list[list[Fraction]]:
    return [[Fraction(v) for v in row] for row in np.atleast_2d(table).tolist()]


def rows(P: HPolytope) -> list[tuple[list[Fraction], Fraction]]:
    tables = ((P.A, P.b), (P.C, P.d), (-P.C, -P.d))
    return [
        (a, Fraction(b)) for A, b in tables for a, b in zip(fractions(A) if len(A) else [], b.tolist(), strict=True)
    ]


def exact_set(P: HPolytope) -> ppl.C_Polyhedron:
    exact = ppl.C_Polyhedron(P.dim, "universe")
    for a, b in rows(P):
        exact.add_constraint(form(a, b) <= 0)
    return exact


def exact_predecessor(target: HPolytope, system: LinearSystem) -> ppl.C_Polyhedron:
    """All of it in rationals: for every corner w of W (a bounded one) a copy of the target, then the shadow."""
    n, nu = system.n_states, system.B.shape[1]
    both = ppl.C_Polyhedron(n + nu, "universe")
    for a, b in [] if system.inputs is None else rows(system.inputs):
        both.add_constraint(form([Fraction(0)] * n + a, b) <= 0)
    step, shift, E = fractions(np.hstack([system.A, system.B])), fractions(system.a)[0], fractions(system.E)
    W = [()] if system.disturbances is None else system.disturbances.vertices(exact=True)
    for w in W:
        moved = [
            t + sum((e * v for e, v in zip(row, w, strict=True)), Fraction(0)) for t, row in zip(shift, E, strict=True)
        ]
        for a, b in rows(target):
            pulled = [sum((u * step[i][j] for i, u in enumerate(a)), Fraction(0)) for j in range(n + nu)]
            both.add_constraint(form(pulled, b - sum((u * v for u, v in zip(a, moved, strict=True)), Fraction(0))) <= 0)
    both.remove_higher_space_dimensions(n)
    return both


def random_system(case: int, unit: float = 1.0) -> tuple[HPolytope, LinearSystem]:
    """A constraint and a system of floats, unstable as a rule; now and then W flat, off centre or by two columns."""
    rng = np.random.default_rng([case, 17])
    n = 1 + case % 3
    nu = 1 + int(rng.integers(2))
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.9, 1.3) / np.abs(np.linalg.eigvals(A)).max()
    E = None if case % 2 else rng.standard_normal((n, 1 + case % 2))
    W = cube(n if E is None else E.shape[1], 0.05 * unit).translate(
        np.full(n if E is None else E.shape[1], 0.01 * unit)
    )
    system = LinearSystem(
        A, rng.standard_normal((n, nu)), a=0.02 * unit * rng.standard_normal(n), E=E, inputs=cube(nu, 0.7 * unit),
        disturbances=W,
    )  # fmt: skip
    return cube(n, unit) & HPolytope(rng.standard_normal((2, n)), unit * np.array([0.9, 1.1])), system


@FEW
@pytest.mark.parametrize("unit", [1.0, 2.0**-40, 2.0**60])
def test_a_set_called_invariant_lies_in_its_exact_predecessor(count: int, unit: float) -> None:
    invariant = 0
    for case in range(count):
        constraint, system = random_system(case, unit)
        found = largest_invariant_set(constraint, system, max_steps=60)
        if found.status == "empty":
            assert found.verify(), case
            continue
        assert (found.status == "invariant") == found.verify(), (case, found.reason)
        if found.status == "invariant":
            invariant += 1
            assert exact_predecessor(found.set, system).contains(exact_set(found.set)), case
            assert found.set <= constraint, case
            wider = found.set.translate(-found.set.chebyshev().centre).scale(1 + 1e-6)
            wider = wider.translate(found.set.chebyshev().centre)
            assert is_invariant(wider, system) == exact_predecessor(wider, system).contains(exact_set(wider)), case
    assert invariant >= 0.6 * count


@FEW
def test_predecessors_of_floats_contain_the_exact_ones_and_hardly_more(count: int) -> None:
    for case in range(count):
        target, system = random_system(case)
        before, exact = predecessor(target, system), exact_predecessor(target, system)
        assert exact_set(before).contains(exact), case
        inner = before.with_rows(before.A, before.b - 1e-11 * np.linalg.norm(before.A, axis=1) * (1 + np.abs(before.b)))
        assert exact.contains(exact_set(inner)), case


def test_sets_that_inputs_keep_just_so() -> None:
    """Nothing to spare: x+ = x + u + w with |u| <= |w|, and with a little less."""
    for half, kept in ((0.1, True), (0.1 - 2.0**-56, False), (0.1 + 2.0**-56, True)):
        system = LinearSystem([[1.0]], [[1.0]], inputs=cube(1, half), disturbances=cube(1, 0.1))
        for P in (cube(1, 1.0), cube(1, 0.3), cube(1, 1e-3)):
            assert is_invariant(P, system) <= kept
    short = LinearSystem([[1.0]], [[1.0]], inputs=cube(1, 0.125), disturbances=cube(1, 0.125))
    assert is_invariant(cube(1, 1.0), short)
    assert not is_invariant(
        cube(1, 1.0), LinearSystem([[1.0]], [[1.0]], inputs=cube(1, 0.125), disturbances=cube(1, 0.25))
    )


def test_unbounded_flat_and_empty_sets_that_inputs_keep() -> None:
    still = LinearSystem(
        [[1.3, 0.1], [0.0, 0.7]], [[1.0], [0.0]], E=[[0.1], [0.0]], inputs=HPolytope.whole_space(1),
        disturbances=cube(1, 1.0),
    )  # fmt: skip
    assert is_invariant(HPolytope.box([-0.3, -np.inf], [0.7, np.inf]), still)
    assert is_invariant(HPolytope.box([-0.3, -0.3], [0.7, 0.9]), still)
    assert is_invariant(HPolytope.empty(2), still)
    assert is_invariant(HPolytope.whole_space(2), still)
    assert is_invariant(HPolytope.box([-0.3, 0.0], [0.7, 0.0]), still)
    assert not is_invariant(HPolytope.box([-0.3, 0.1], [0.7, 0.1]), still)
    assert not is_invariant(HPolytope.box([0.0, 0.0], [0.1, 0.0]), still)  # w alone is wider
    weak = LinearSystem([[1.3, 0.1], [0.0, 1.1]], [[1.0], [0.0]], inputs=cube(1, 1.0))
    assert not is_invariant(HPolytope.box([-0.3, -np.inf], [0.7, np.inf]), weak)
    assert not is_invariant(
        HPolytope([[-1.0, 0.0]], [0.0]), LinearSystem([[-1.0, 0.1], [0.0, 1.0]], [[0.3], [0.0]], inputs=cube(1, 1.0))
    )
    assert is_invariant(
        HPolytope([[-1.0, 0.0]], [0.0]), LinearSystem([[1.1, 0.0], [0.1, 1.0]], [[0.3], [0.0]], inputs=cube(1, 1.0))
    )


@pytest.mark.parametrize("drift", [0.1, -0.1])
def test_both_directions_of_a_line_are_asked_for_an_input(drift: float) -> None:
    strip, start = HPolytope.box([-1.0, -np.inf], [1.0, np.inf]), HPolytope.box([0.0], [np.inf])
    pushed = LinearSystem([[1.0, drift], [0.0, 1.0]], [[1.0], [0.0]], inputs=start)
    assert not is_invariant(strip, pushed)
    assert is_invariant(strip, LinearSystem(pushed.A, pushed.B, inputs=HPolytope.whole_space(1)))

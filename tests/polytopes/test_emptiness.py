"""Emptiness against an exact oracle; certificates that verify and tampered ones that do not."""

import json

import numpy as np
import pytest
from exact_sets import polyhedron
from flint import fmpq
from hypothesis import given, settings
from hypothesis import strategies as st
from random_programs import KINDS, many

from polytopes import Certificate, HPolytope, UndecidedError, kernel
from polytopes.highs import HighsOutcome, HighsProgram
from polytopes.prepared import PreparedRows


def exactly_empty(P: HPolytope) -> bool:
    """The Parma library's answer, on the floats as rationals."""
    return bool(polyhedron(P).is_empty())


@pytest.mark.parametrize("kind", KINDS)
def test_answers_are_those_of_the_exact_oracle(kind: str) -> None:
    for k, (_, A, b) in enumerate(many(kind, 200 if kind in ("integer", "degenerate") else 60)):
        P = HPolytope(A, b)
        answer = P.emptiness()
        assert answer.status == ("empty" if exactly_empty(P) else "nonempty"), f"{kind} {k}"
        if answer.certificate is not None:
            assert answer.certificate.verify(P)
        if answer.witness is not None:
            assert P.contains(answer.witness)


@st.composite
def integer_systems(draw: st.DrawFn) -> HPolytope:
    n, m, q = draw(st.integers(1, 4)), draw(st.integers(0, 9)), draw(st.integers(0, 3))
    entries = st.integers(-2, 2)
    A = draw(st.lists(st.lists(entries, min_size=n, max_size=n), min_size=m, max_size=m))
    C = draw(st.lists(st.lists(entries, min_size=n, max_size=n), min_size=q, max_size=q))
    b = draw(st.lists(st.integers(-1, 2), min_size=m, max_size=m))
    d = draw(st.lists(entries, min_size=q, max_size=q))
    return HPolytope(np.reshape(A, (m, n)), np.array(b, float), np.reshape(C, (q, n)), np.array(d, float))


@settings(max_examples=300, deadline=None)
@given(integer_systems())
def test_integer_systems_with_equalities(P: HPolytope) -> None:
    answer = P.emptiness()
    assert answer.status == ("empty" if exactly_empty(P) else "nonempty")
    assert answer.certificate is None or answer.certificate.verify(P)


@pytest.mark.parametrize("width", [1e-6, 1e-7, 1e-8, 1e-9, 1e-12, 0.0])
def test_thin_sets_are_not_empty(width: float) -> None:
    assert HPolytope.box([0.0, 0.0, 0.0], [1.0, width, 1.0]).emptiness().status == "nonempty"
    skew = HPolytope([[0.3, 0.1], [-0.3, -0.1], [1.0, 0.0], [-1.0, 0.0]], [0.2, width - 0.2, 1.0, 1.0])
    assert skew.emptiness().status == "nonempty"


@pytest.mark.parametrize("overlap", [1e-6, 1e-9, 1e-12, 1e-16])
def test_barely_empty_sets_are_empty_with_a_proof(overlap: float) -> None:
    P = HPolytope([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]], [-overlap, 0.0, 0.0])
    answer = P.emptiness()
    assert answer.status == "empty"
    assert answer.certificate is not None
    assert answer.certificate.verify(P)
    assert answer.certificate.gap(P) == pytest.approx(overlap / 3)


def test_contradictory_and_redundant_equalities() -> None:
    box = np.vstack([np.eye(2), -np.eye(2)]), np.ones(4)
    assert HPolytope(*box, [[1, 1], [2, 2]], [0.5, 1.0]).emptiness().status == "nonempty"
    P = HPolytope(*box, [[1, 1], [2, 2]], [0.5, 1.5])
    certificate = P.emptiness().certificate
    assert certificate is not None
    assert certificate.verify(P)
    assert HPolytope(*box, [[1, 1]], [3.0]).emptiness().status == "empty"
    assert HPolytope(*box, [[1e-8, 0]], [1e-8]).emptiness().status == "nonempty"


def proven_empty() -> tuple[HPolytope, Certificate]:
    P = HPolytope(
        [[0.1, 0.7, 0.3], [0.2, -0.9, 0.1], [-0.4, 0.1, -0.3], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [0.3, 0.2, -3.1, 1.0, 1.0],
        [[0.3, 0.3, -0.7]],
        [0.1],
    )
    certificate = P.emptiness().certificate
    assert certificate is not None
    return P, certificate


def test_every_tampered_number_is_noticed() -> None:
    P, proof = proven_empty()
    assert proof.verify(P)
    tiny = fmpq(1, 10**30)
    for i in proof.inequality:
        assert not Certificate({**proof.inequality, i: proof.inequality[i] + tiny}, proof.equality).verify(P)
        assert not Certificate({**proof.inequality, i: -proof.inequality[i]}, proof.equality).verify(P)
    for k in proof.equality:
        assert not Certificate(proof.inequality, {**proof.equality, k: proof.equality[k] - tiny}).verify(P)
    assert not Certificate({}, {}).verify(P)
    assert not Certificate({**proof.inequality, 17: fmpq(1)}, proof.equality).verify(P)
    assert not Certificate({**proof.inequality, -1: fmpq(0)}, proof.equality).verify(P)


def test_negative_multipliers_prove_nothing() -> None:
    half_line = HPolytope([[1.0], [2.0]], [1.0, 1.0])
    balanced = {0: fmpq(-1, 4), 1: fmpq(1, 8)}  # combines to 0 <= -1/8
    assert not Certificate(balanced, {}).verify(half_line)


def test_a_proof_of_one_set_does_not_hold_for_another() -> None:
    P, proof = proven_empty()
    for i in proof.inequality:
        A = P.A.copy()
        A[i, 0] = np.nextafter(A[i, 0], 2.0)
        assert not proof.verify(HPolytope(A, P.b, P.C, P.d))
    assert not proof.verify(HPolytope(P.A, P.b + 100.0, P.C, P.d))


def test_certificates_survive_json() -> None:
    P, proof = proven_empty()
    copy = Certificate.from_dict(json.loads(json.dumps(proof.to_dict())))
    assert copy == proof
    assert copy.verify(P)


@pytest.mark.parametrize(
    "data",
    [{}, {"inequality": {}}, {"inequality": 3, "equality": {}}, {"inequality": {"0": "0.5"}, "equality": {}},
     {"inequality": {"0": "1/0"}, "equality": {}}, {"inequality": {"x": "1/2"}, "equality": {}}],
)  # fmt: skip
def test_malformed_certificates_are_refused(data: dict) -> None:
    with pytest.raises(ValueError, match="certificate"):
        Certificate.from_dict(data)


def test_a_failed_solver_is_never_an_empty_set(monkeypatch: pytest.MonkeyPatch) -> None:
    interior = kernel.interior

    def failing(*arguments: np.ndarray) -> tuple:
        x, _, _, weights = interior(*arguments)
        return x + 100.0, -1.0, kernel.LIMIT, weights

    def silent(self: HighsProgram, c: np.ndarray) -> HighsOutcome:
        return HighsOutcome("infeasible", float("nan"), np.empty(0), np.empty(0))

    monkeypatch.setattr(PreparedRows, "of", lambda rows: None)
    monkeypatch.setattr(kernel, "interior", failing)
    monkeypatch.setattr(HighsProgram, "maximise", silent)
    skew = HPolytope.box([1.0, 1.0], [2.0, 2.0]).intersection(HPolytope([[1.0, 1.0]], [3.0]))
    assert skew.emptiness().status == "nonempty"  # settled in rationals
    large = HPolytope.box(np.ones(50), np.full(50, 2.0)).intersection(HPolytope(np.ones((1, 50)), [99.0]))
    answer = large.emptiness()
    assert answer.status == "undecided"
    assert "rational arithmetic" in answer.reason
    with pytest.raises(UndecidedError):
        large.support(np.ones(50))


def transport(supply: np.ndarray, demand: np.ndarray, capacity: float = np.inf) -> HPolytope:
    """Flows x_ij >= 0 with given sums of rows and columns, each at most a capacity."""
    n, m = len(supply), len(demand)
    sums = np.vstack([np.kron(np.eye(n), np.ones(m)), np.kron(np.ones(n), np.eye(m))])
    bounds = HPolytope.box(np.zeros(n * m), np.full(n * m, capacity))
    return HPolytope(bounds.A, bounds.b, sums, np.append(supply, demand))


@pytest.mark.parametrize("n", [2, 5, 7, 8, 10, 12])
def test_transport_polytopes_are_decided(n: int) -> None:
    """Full, with rows that must vanish, with decimals, with unequal sums and with too small a capacity."""
    supply = np.arange(1.0, n + 1)
    for P in (transport(supply, supply[::-1]), transport(np.append(0.0, supply[1:]), np.append(supply[1:], 0.0))):
        answer = P.emptiness()
        assert answer.status == "nonempty"
        assert answer.witness is not None
        assert P.contains(answer.witness)
    thirds = transport(np.full(n, 1.0 / 3.0), np.full(n, 1.0 / 3.0)).emptiness()
    assert thirds.status == "nonempty"
    for P in (transport(supply, supply + 1.0), transport(supply, supply[::-1], 0.9)):
        certificate = P.emptiness().certificate
        assert certificate is not None
        assert certificate.verify(P)


def test_integer_equalities_are_decided() -> None:
    """``C x = d``, x >= 0 in more variables than the rational simplex takes: around a sparse solution, or none."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        n, q = int(rng.integers(45, 70)), int(rng.integers(5, 20))
        C, x = rng.integers(-3, 4, (q, n)).astype(float), rng.integers(0, 3, n) * (rng.random(n) < 0.5)
        P = HPolytope(-np.eye(n), np.zeros(n), C, C @ x)
        assert P.emptiness().status == "nonempty"
        C[0], d = np.abs(C[0]) + 1.0, C @ x
        d[0] = -1.0
        Q = HPolytope(-np.eye(n), np.zeros(n), C, d)
        certificate = Q.emptiness().certificate
        assert certificate is not None
        assert certificate.verify(Q)


def test_a_set_that_touches_in_one_point_after_another_is_decided_on_its_faces() -> None:
    """A chain of rows each of which is an equality only once the one before is: proofs come back to the first rows."""
    n = 50
    A = np.vstack([-np.eye(n), np.eye(n) - np.eye(n, k=1)])[: 2 * n - 1]  # x >= 0, x_i <= x_{i+1}
    A = np.vstack([A, np.eye(1, n, n - 1)])  # and the last one <= 0
    P = HPolytope(A, np.zeros(2 * n))
    assert P.emptiness().status == "nonempty"
    assert P.affine_dim() == 0
    b = np.zeros(2 * n)
    b[-1] = -(2.0**-60)
    Q = HPolytope(A, b)
    certificate = Q.emptiness().certificate
    assert certificate is not None
    assert certificate.verify(Q)


@pytest.mark.parametrize("P", [HPolytope.box([0], [1]), HPolytope([[1.0, 0.3]], [1.0]), HPolytope.cross_polytope(3)])
def test_a_witness_cannot_be_written(P: HPolytope) -> None:
    """The set keeps it, and its next answer would be about another point."""
    for point in (P.emptiness().witness, P.intersects(P).point):
        with pytest.raises(ValueError, match="read-only"):
            point[:] = 77.0
    assert P.emptiness().witness in P

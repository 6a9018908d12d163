"""One-step sets and invariant sets: closed forms, proofs in rationals, and long runs that stay inside."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty
from svo.analysis.invariant_sets import InvariantSet, is_invariant, largest_invariant_set, smallest_invariant_set
from svo.analysis.one_step_sets import LinearSystem, predecessor, successor


def interval(half: float) -> HPolytope:
    return HPolytope.box([-half], [half])


def cube(n: int, half: float) -> HPolytope:
    return HPolytope.box(np.full(n, -half), np.full(n, half))


def model(**changes: object) -> UncertainModel:
    given = {"E": np.eye(2), "w": np.full(2, 0.1), "a": [0.0, 0.25], **changes}
    return UncertainModel([[0.5, 0.25], [0.0, 0.5]], None, np.eye(2), **given)


def runs(found: InvariantSet, steps: int = 300) -> None:
    """Corners of w from corners of the set never leave it."""
    rng, system = np.random.default_rng(4), found.system
    W = system.disturbances.vertices()
    for x in found.set.vertices()[:6]:
        for _ in range(steps):
            x = system.A @ x + system.a + system.E @ W[rng.integers(len(W))]
            if found.widened_by is not None:
                x = x + found.widened_by * rng.choice([-1.0, 1.0], len(x))
            assert found.set.contains(x, tol=1e-9)


def test_predecessor_and_successor_in_one_dimension() -> None:
    system = LinearSystem([[1.0]], [[1.0]], inputs=interval(1.0), disturbances=interval(0.1))
    np.testing.assert_allclose(np.ravel(predecessor(interval(1.0), system).bounding_box()), [-1.9, 1.9], rtol=1e-15)
    np.testing.assert_allclose(np.ravel(successor(interval(1.0), system).bounding_box()), [-2.1, 2.1], rtol=1e-15)
    assert predecessor(interval(0.05), system).is_empty()
    assert predecessor(HPolytope.whole_space(1), system) == HPolytope.whole_space(1)
    assert predecessor(HPolytope.empty(1), system).is_empty()
    assert successor(HPolytope.empty(1), system).is_empty()
    still = LinearSystem([[0.0]], a=[0.5])
    assert predecessor(interval(1.0), still) == HPolytope.whole_space(1)
    drifting = LinearSystem([[1.0]], a=[0.5])
    assert predecessor(interval(1.0), drifting) == HPolytope.box([-1.5], [0.5])
    assert successor(interval(1.0), drifting) == HPolytope.box([-0.5], [1.5])
    assert successor(HPolytope.whole_space(1), still) == HPolytope.box([0.5], [0.5])


@pytest.mark.parametrize("seed", range(3))
def test_states_of_the_predecessor_can_be_kept_and_others_cannot(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B, E = rng.integers(-2, 3, (2, 2)) / 2, rng.integers(-2, 3, (2, 1)) / 2, rng.integers(-2, 3, (2, 1)) / 4
    system = LinearSystem(A, B, a=[0.25, 0.0], E=E, inputs=interval(1.0), disturbances=interval(1.0))
    target = HPolytope.from_vertices(rng.integers(-4, 5, (5, 2)))
    before = predecessor(target, system)
    for x in rng.uniform(-4.0, 4.0, (100, 2)):
        u = HPolytope.box([-1.0], [1.0])
        for w in (-1.0, 1.0):
            u = u & target.preimage(B, A @ x + [0.25, 0.0] + E[:, 0] * w)
        assert before.contains(x, tol=1e-9) == (not u.is_empty()) or before.contains(x) != before.contains(x, tol=-0.0)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_largest_set_of_a_contraction(n: int) -> None:
    for w, status, steps in ((0.5, "invariant", 0), (0.50001, "empty", 16)):
        found = largest_invariant_set(cube(n, 1.0), LinearSystem(np.eye(n) / 2, disturbances=cube(n, w)))
        assert (found.status, found.steps) == (status, steps)
        assert found.verify()
        assert (found.set == cube(n, 1.0)) == (status == "invariant")
    assert found.certificate is not None


def test_an_empty_answer_is_proved_of_its_own_set() -> None:
    found = largest_invariant_set(cube(1, 1.0), LinearSystem(np.eye(1) / 2, disturbances=interval(0.50001)))
    assert found.verify()
    assert not replace(found, set=cube(1, 1.0)).verify()
    assert not replace(found, certificate=None).verify()


def test_the_box_that_is_added_counts_in_the_proof() -> None:
    system = LinearSystem([[0.5]], disturbances=interval(0.25))
    assert is_invariant(interval(0.5), system)
    assert is_invariant(interval(1.0), system, np.array([0.25]))
    assert not is_invariant(interval(1.0), system, np.array([0.25 + 2.0**-52]))
    assert not is_invariant(interval(0.5), system, np.array([0.25]))


def test_a_row_that_others_nearly_imply_is_kept() -> None:
    turn = [[0.72, -0.54], [0.54, 0.72]]
    constraint = cube(2, 1.0) & HPolytope([[1.0, 0.0], [0.0, 1.0]], [1.0 - 1e-13, 1.0 - 3e-13])
    found = largest_invariant_set(constraint, LinearSystem(turn, disturbances=cube(2, 0.03)))
    assert found.status == "invariant"
    assert found.set <= constraint


def test_the_largest_set_of_a_rotation_that_shrinks() -> None:
    c, s = 0.9 * np.cos(0.7), 0.9 * np.sin(0.7)
    system = LinearSystem([[c, -s], [s, c]], disturbances=cube(2, 0.03))
    found = largest_invariant_set(cube(2, 1.0), system)
    assert found.status == "invariant"
    assert found.verify()
    assert found.set <= cube(2, 1.0)
    assert not is_invariant(cube(2, 1.0), system)
    runs(found)
    x = np.array([0.99, 0.99])  # in the constraint, not in the set: some disturbance drives it out
    assert not found.set.contains(x)


def test_the_largest_set_with_an_input() -> None:
    system = LinearSystem([[1.0, 1.0], [0.0, 1.0]], [[0.5], [1.0]], inputs=interval(1.0), disturbances=cube(2, 0.125))
    found = largest_invariant_set(cube(2, 4.0), system)
    assert found.status == "invariant"
    assert found.verify()
    assert found.set <= predecessor(found.set, system)
    assert not found.set.is_empty()


def test_a_search_that_does_not_end_says_so() -> None:
    found = largest_invariant_set(cube(1, 1.0), LinearSystem([[0.999]], disturbances=interval(0.0011)), max_steps=5)
    assert found.status == "undecided"
    assert "last outer iterate, and not invariant" in found.reason
    assert not found.verify()
    found = smallest_invariant_set(LinearSystem([[1.01]], disturbances=interval(0.1)), max_steps=20)
    assert found.status == "undecided"
    assert "not invariant" in found.reason


@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_the_smallest_set_is_invariant_and_not_too_large(offset: float) -> None:
    W = cube(2, 0.5).translate([offset, -offset])
    found = smallest_invariant_set(LinearSystem([[0.5, 0.25], [0.0, 0.5]], a=[0.0, 0.25], disturbances=W))
    assert found.status == "invariant"
    assert found.verify()
    runs(found)
    assert 1.0 < found.factor <= (1.0 + 1e-5) / 0.95
    exact = 1.0  # of the second state: |w| / (1 - 1/2)
    _, upper = found.set.bounding_box()
    lower, _ = found.set.bounding_box()
    assert exact * 2.0 <= upper[1] - lower[1] <= 2.0 * exact * found.factor * (1 + 1e-9)


def test_disturbances_without_interior_need_a_box_that_the_result_names() -> None:
    system = LinearSystem([[0.5, 0.25], [0.0, 0.5]], E=[[0.0], [1.0]], disturbances=HPolytope.box([1.0], [2.0]))
    with pytest.raises(ValueError, match=r"E w has no interior; state box="):
        smallest_invariant_set(system)
    found = smallest_invariant_set(system, box=[0.01, 0.01])
    assert found.status == "invariant"
    assert found.widened_by.tolist() == [0.01, 0.01]
    assert found.verify()
    runs(found)


def test_models_are_taken() -> None:
    found = smallest_invariant_set(model())
    assert found.status == "invariant"
    runs(found)
    assert largest_invariant_set(cube(2, 4.0), model()).status == "invariant"
    given = model(w=HPolytope.cross_polytope(2).scale(0.25))
    assert successor(cube(2, 0.0), given) == HPolytope.cross_polytope(2).scale(0.25).translate([0.0, 0.25])
    uncertain = model(uncertainties=[Uncertainty(A=np.eye(2), bounds=(-0.1, 0.1))])
    with pytest.raises(ValueError, match="bound the rest as w"):
        smallest_invariant_set(uncertain)


def test_the_page_runs() -> None:
    page = (Path(__file__).parents[3] / "docs" / "control_sets.md").read_text("utf-8")
    code = "\n".join(line[4:] for line in page.split("\n") if line.startswith("    "))
    names: dict = {}
    exec(code, names)
    assert (names["found"].status, names["found"].steps) == ("empty", 16)
    assert names["least"].verify()


def test_a_model_with_inputs_takes_the_set_of_them() -> None:
    A, B, E = [[1.0, 1.0], [0.0, 1.0]], [[0.5], [1.0]], [[0.0], [1.0]]
    U, W, X = interval(1.0), interval(0.125), cube(2, 2.0)
    pushed = UncertainModel(A, B, np.eye(2), E=E, w=[0.125], n=0.1)
    system = LinearSystem(A, B, E=E, inputs=U, disturbances=W)
    assert predecessor(X, pushed, inputs=U) == predecessor(X, system) != X
    assert successor(X, pushed, inputs=U) == successor(X, system)
    found, same = largest_invariant_set(X, pushed, inputs=U, max_steps=3), largest_invariant_set(X, system, max_steps=3)
    assert (found.status, found.set == same.set) == (same.status, True)
    with pytest.raises(ValueError, match=r"R\^1, the columns of B"):
        predecessor(X, pushed)
    with pytest.raises(ValueError, match="a LinearSystem has the set of its inputs already"):
        predecessor(X, system, inputs=U)
    with pytest.raises(ValueError, match=r"expected a set in R\^2"):
        successor(interval(1.0), system)


def test_wrong_systems_are_refused() -> None:
    with pytest.raises(ValueError, match="expected a square matrix"):
        LinearSystem([[1.0, 2.0]])
    with pytest.raises(ValueError, match=r"R\^1, the columns of B"):
        LinearSystem([[1.0]], [[1.0]])
    with pytest.raises(ValueError, match="inputs is 'empty'"):
        LinearSystem([[1.0]], [[1.0]], inputs=HPolytope.empty(1))
    with pytest.raises(TypeError, match="disturbances is a float"):
        LinearSystem([[1.0]], disturbances=0.1)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a LinearSystem or an UncertainModel"):
        predecessor(interval(1.0), np.eye(1))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"factor is 1\.0"):
        smallest_invariant_set(LinearSystem([[0.5]], disturbances=interval(1.0)), factor=1.0)
    with pytest.raises(ValueError, match="put a feedback into A"):
        smallest_invariant_set(LinearSystem([[0.5]], [[1.0]], inputs=interval(1.0), disturbances=interval(1.0)))

"""The constrained-zonotope observer: every operation contains the exact set, the truth stays inside, proofs hold."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest
from flint import fmpq
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from polytopes.exact import rational, rational_vector
from svo import ConstrainedZonotopeObserver, PolytopeObserver, UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.reduction import reduced, rescaled
from svo.observers.zonotope.zonotope import ConstrainedZonotope
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.test_soundness import random_initial, scalar_counterexample

seeds = st.integers(0, 2**32 - 1)


def random_set(rng: np.random.Generator, n: int = 3, generators: int = 12, constraints: int = 5) -> ConstrainedZonotope:
    """A set with a point well inside, at a scale of its own in every coordinate."""
    xi = rng.uniform(-0.5, 0.5, generators)
    G = rng.normal(size=(n, generators)) * 10.0 ** rng.uniform(-4, 4, (n, 1))
    A = rng.normal(size=(constraints, generators)) * (rng.random((constraints, generators)) < 0.6)
    center, slack = rng.normal(size=n) * 10.0 ** rng.uniform(-4, 4, n), rng.uniform(1e-6, 0.3, constraints)
    return ConstrainedZonotope(center, G, np.zeros(n), A, A @ xi, slack)


def exact_point(Z: ConstrainedZonotope, xi: np.ndarray) -> list[fmpq]:
    """c + G xi in rational arithmetic."""
    weights = rational_vector(xi)
    rows = zip(Z.center, Z.generators, strict=True)
    return [rational(c) + sum((w * rational(g) for w, g in zip(weights, row, strict=True)), fmpq(0)) for c, row in rows]


def points_of(Z: ConstrainedZonotope, rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """xi of points of the set, by a walk from vertex to vertex of random programs."""
    from scipy.optimize import linprog

    rows = np.vstack([Z.constraints, -Z.constraints])
    bounds = np.concatenate([Z.offset + Z.slack, Z.slack - Z.offset]) - 1e-9
    vertices = [
        linprog(rng.normal(size=Z.generators.shape[1]), A_ub=rows, b_ub=bounds, bounds=(-1 + 1e-9, 1 - 1e-9)).x
        for _ in range(count)
    ]
    return vertices + [0.5 * (vertices[0] + v) for v in vertices[1:]]


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(3, 14), st.integers(0, 5))
def test_a_reduction_contains_the_set(seed: int, generators: int, constraints: int) -> None:
    """Points of the set satisfy every outer bound of the reduced set, checked in rational arithmetic."""
    rng = np.random.default_rng(seed)
    Z = random_set(rng)
    small = reduced(Z, generators, constraints)
    assert small.generators.shape[1] <= generators
    assert len(small.offset) <= constraints
    directions = rng.normal(size=(10, 3)) / (np.abs(Z.generators).sum(axis=1))
    for smaller in (small, rescaled(Z)):
        bounds = ZonotopeProgram(smaller).support(directions)
        for xi in points_of(Z, rng, 3):
            x = exact_point(Z, xi)
            for d, bound in zip(directions, bounds, strict=True):
                value = sum((rational(a) * b for a, b in zip(d, x, strict=True)), fmpq(0))
                assert value <= rational(bound)


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_an_affine_map_contains_the_exact_image(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Z, M, t = random_set(rng), rng.normal(size=(2, 3)), rng.normal(size=2)
    image = Z.affine_map(M, t)
    for xi in points_of(Z, rng, 2):
        x, y = exact_point(Z, xi), exact_point(image, xi)
        for row, ti, yi, room in zip(M, t, y, image.room, strict=True):
            exact = sum((rational(a) * b for a, b in zip(row, x, strict=True)), rational(ti))
            assert abs(exact - yi) <= rational(room)


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_supports_are_outer_bounds_close_to_the_optimum(seed: int) -> None:
    from scipy.optimize import linprog

    rng = np.random.default_rng(seed)
    Z = random_set(rng)
    directions = rng.normal(size=(4, 3))
    rows = np.vstack([Z.constraints, -Z.constraints])
    limits = np.concatenate([Z.offset + Z.slack, Z.slack - Z.offset])
    for d, bound in zip(directions, ZonotopeProgram(Z).support(directions), strict=True):
        best = linprog(-d @ Z.generators, A_ub=rows, b_ub=limits, bounds=(-1, 1))
        size = np.abs(d @ Z.generators).sum()
        assert bound == pytest.approx(d @ Z.center - best.fun, abs=1e-6 * size)
        assert bound >= d @ (Z.center + Z.generators @ best.x) - 1e-6 * size


@settings(max_examples=12, deadline=None)
@given(seeds, st.sampled_from([(None, None), (1, 0), (3, 1)]))
def test_truth_stays_inside_random_uncertain_plants(seed: int, limits: tuple[int | None, int | None]) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=6)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(20, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    y = log.y.copy()
    if rng.random() < 0.5:
        y[rng.random(y.shape) < 0.3] = np.nan
    generators, constraints = (None if value is None else value * model.n_states for value in limits)
    observer = ConstrainedZonotopeObserver(
        model, random_initial(rng, x0), max_generators=generators, max_constraints=constraints
    )
    for k, step in enumerate(drive(observer, replace(log, y=y))):
        assert step.verdict == "consistent", k
        room = 1e-12 * (1.0 + np.abs(log.x[k]).max())
        assert (step.box[0] - room <= log.x[k]).all(), k
        assert (log.x[k] <= step.box[1] + room).all(), k


def test_without_reduction_it_is_the_full_information_window() -> None:
    rng = np.random.default_rng(5)
    model = UncertainModel(
        0.6 * rng.normal(size=(3, 3)), rng.normal(size=(3, 1)), rng.normal(size=(2, 3)),
        E=rng.normal(size=(3, 2)), w=[0.1, 0.2], n=[0.1, 0.2], F=0.2 * rng.normal(size=(2, 2)),
    )  # fmt: skip
    log = model.simulate([0.2, 0.1, -0.5], rng.normal(size=(8, 1)), rng)
    box = HPolytope.box(-np.ones(3), np.ones(3))
    full = WindowObserver(model, box, horizon=None).run(log)
    free = ConstrainedZonotopeObserver(model, box, max_generators=1000, max_constraints=1000).run(log)
    np.testing.assert_allclose(free.lower, full.lower, atol=1e-7)
    np.testing.assert_allclose(free.upper, full.upper, atol=1e-7)


@pytest.mark.parametrize("kind", [ConstrainedZonotopeObserver, PolytopeObserver])
def test_it_explains_the_healthy_plant_that_the_published_stack_excludes(kind: type) -> None:
    model, y = scalar_counterexample()
    observer = kind(model, HPolytope.box([0.9], [1.1]))
    steps = [observer.update([y[0]]), *(observer.step(None, [value]) for value in y[1:])]
    assert [s.verdict for s in steps] == ["consistent"] * 3


def test_uncertain_output_keeps_states_that_no_vertex_explains() -> None:
    model = UncertainModel([[1.0]], None, [[0.0]], uncertainties=[Uncertainty(C=[[1.0]])])
    lower, upper = ConstrainedZonotopeObserver(model, HPolytope.box([0.5], [200.0])).update([1.0]).box
    assert upper[0] == pytest.approx(200.0)
    assert lower[0] == pytest.approx(1.0, abs=1e-6)


def test_a_changed_certificate_proves_nothing() -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1])
    observer = ConstrainedZonotopeObserver(model, HPolytope.box([-1.0], [1.0]))
    observer.update([0.0])
    observer.step(None, [0.0])
    certificate = observer.step(None, [3.0]).certificate
    assert certificate.verify()
    window = certificate.window
    other = dataclasses.replace(window.samples[-1], y=np.array([0.1]))
    assert not dataclasses.replace(
        certificate, window=dataclasses.replace(window, samples=(*window.samples[:-1], other))
    ).verify()
    shifted = dataclasses.replace(certificate.arrival, center=certificate.arrival.center + 0.01)
    assert not dataclasses.replace(certificate, arrival=shifted).verify()


def test_wrong_limits_are_named() -> None:
    model, box = UncertainModel([[0.9]], None, [[1.0]], n=[0.1]), HPolytope.box([-1.0], [1.0])
    with pytest.raises(ValueError, match="max_generators is 0; expected an integer of at least 1"):
        ConstrainedZonotopeObserver(model, box, max_generators=0)
    with pytest.raises(ValueError, match="max_constraints is -1"):
        ConstrainedZonotopeObserver(model, box, max_constraints=-1)
    with pytest.raises(ValueError, match="initial is unbounded"):
        ConstrainedZonotopeObserver(model, HPolytope.whole_space(1))


def test_a_set_beyond_floats_is_undecided() -> None:
    model = UncertainModel([[1e200]], None, [[1.0]], n=[0.1])
    observer = ConstrainedZonotopeObserver(model, HPolytope.box([-1.0], [1.0]))
    observer.update([0.0])
    for _ in range(2):
        step = observer.step(None, [np.nan])
    assert (step.verdict, step.reason) == ("undecided", "outgrown")
    assert np.isinf(step.box).all()

"""The polytope observer: soundness, agreement with the window observer where both are exact, its limits and proofs."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope, convex_hull
from svo import ArchitectureI, PolytopeObserver, UncertainModel, Uncertainty, WindowObserver
from svo.faults import SensorFault, Step
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers.polytope import vertex_images
from svo.observers.polytope.vertex_images import FacetLimitError, hull_of_images, transitions
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.test_soundness import hull_cut_by_rows, random_initial, scalar_counterexample

seeds = st.integers(0, 2**32 - 1)


def random_run(seed: int, samples: int) -> tuple[np.random.Generator, UncertainModel, HPolytope, Log, np.ndarray]:
    """A random uncertain plant with a run, whose measurements are sometimes missing."""
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(samples, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    y = log.y.copy()
    if rng.random() < 0.5:
        y[rng.random(y.shape) < 0.3] = np.nan
    return rng, model, random_initial(rng, x0), log, y


def check_containment(observer: PolytopeObserver, log: Log, y: np.ndarray) -> None:
    for k, step in enumerate(drive(observer, replace(log, y=y))):
        assert step.verdict == "consistent", (k, step.verdict)
        assert log.x is not None
        room = 1e-12 * (1.0 + np.abs(log.x[k]).max())
        lower, upper = step.box
        assert (lower - room <= log.x[k]).all(), k
        assert (log.x[k] <= upper + room).all(), k
        assert step.set.contains(log.x[k], tol=100 * room), k


# -- soundness ---------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(seeds, st.sampled_from([1, 1, 3]))
def test_truth_stays_inside_random_uncertain_plants(seed: int, horizon: int) -> None:
    _, model, initial, log, y = random_run(seed, 6)
    check_containment(PolytopeObserver(model, initial, horizon=horizon, max_facets=40), log, y)


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_truth_stays_inside_exact_sets(seed: int) -> None:
    _, model, initial, log, y = random_run(seed, 4)
    with contextlib.suppress(FacetLimitError):
        check_containment(PolytopeObserver(model, initial, max_facets=None), log, y)


def test_truth_stays_inside_a_set_thinner_than_floats_resolve() -> None:
    """An exact sensor and a contraction: nearly parallel rows, over which float optima were wrong by 6e-4."""
    _, model, initial, log, y = random_run(132, 12)
    check_containment(PolytopeObserver(model, initial, max_facets=40), log, y)


@pytest.mark.slow
def test_truth_stays_inside_three_hundred_random_plants() -> None:
    for seed in range(300):
        _, model, initial, log, y = random_run(seed, 12)
        check_containment(PolytopeObserver(model, initial, horizon=1 + seed % 3, max_facets=40), log, y)


@pytest.mark.parametrize("horizon", [1, 2, 3])
@pytest.mark.parametrize("max_facets", [2, None])
def test_published_form_falsifies_a_healthy_plant_and_the_sound_form_does_not(
    horizon: int, max_facets: int | None
) -> None:
    model, y = scalar_counterexample()
    initial = HPolytope.box([0.9], [1.1])
    with pytest.warns(UserWarning, match="exclude the true state"):
        published = PolytopeObserver(model, initial, horizon=horizon, max_facets=max_facets, as_published=True)
    sound = PolytopeObserver(model, initial, horizon=horizon, max_facets=max_facets)
    for observer, verdict in ((published, "falsified"), (sound, "consistent")):
        steps = [observer.update([y[0]]), *(observer.step(None, [value]) for value in y[1:])]
        assert steps[-1].verdict == verdict
    assert steps[-1].box[0][0] <= 1.0 <= steps[-1].box[1][0]


def test_every_stack_of_the_published_form_has_its_proof() -> None:
    model, y = scalar_counterexample()
    with pytest.warns(UserWarning, match="exclude"):
        observer = PolytopeObserver(model, HPolytope.box([0.9], [1.1]), horizon=2, as_published=True)
    record = observer.run(Log(time=np.arange(3.0), u=np.zeros((3, 0)), y=np.array(y)[:, None]))
    assert record.verdicts == ("consistent", "falsified", "falsified")
    assert len(record.certificate.stacks) == 2
    assert record.certificate.verify()
    assert not dataclasses.replace(record.certificate, stacks=()).verify()


def test_uncertain_output_keeps_states_that_no_vertex_explains() -> None:
    model = UncertainModel([[1.0]], None, [[0.0]], uncertainties=[Uncertainty(C=[[1.0]])])
    observer = PolytopeObserver(model, HPolytope.box([0.5], [200.0]))
    lower, upper = observer.update([1.0]).box
    assert upper[0] == pytest.approx(200.0)
    assert lower[0] == pytest.approx(1.0, abs=1e-6)


def test_measurement_says_what_a_shared_disturbance_drives() -> None:
    """x+ = x + w, y = x + w + v: y(k) gives x(k+1) within the noise; without (x, w) kept together the width is 4.2."""
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], F=[[1.0]], w=[1.0], n=[0.1])
    observer = PolytopeObserver(model, HPolytope.box([-3.0], [3.0]), max_facets=None)
    observer.update([0.0])
    lower, upper = observer.step(None, [np.nan]).box
    assert upper[0] - lower[0] == pytest.approx(0.2, rel=1e-6)


# -- exactness where theory gives it -------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(seeds, st.booleans())
def test_without_uncertainty_it_is_the_full_information_window(seed: int, shared: bool) -> None:
    rng = np.random.default_rng(seed)
    n, nw = 2, int(rng.integers(1, 3))
    tables = rng.normal(size=(2, n, n)) * 0.7
    F = 0.3 * rng.normal(size=(1, nw)) if shared else None
    model = UncertainModel(
        lambda s: tables[0] + s * tables[1], rng.normal(size=(n, 1)), rng.normal(size=(1, n)),
        E=rng.normal(size=(n, nw)), w=rng.uniform(0.1, 0.4, nw), n=[0.2], F=F, schedule=0.0,
    )  # fmt: skip
    schedule = rng.uniform(-1.0, 1.0, 5)
    log = model.simulate(rng.uniform(-1.0, 1.0, n), rng.normal(size=(5, 1)), rng, schedule=schedule)
    initial = HPolytope.box(np.full(n, -1.5), np.full(n, 1.5))
    polytope = PolytopeObserver(model, initial, max_facets=None, eps=0.0)
    observers = (polytope, WindowObserver(model, initial, horizon=None, eps=0.0))
    directions = rng.normal(size=(12, n))
    for steps in zip(*(drive(observer, log) for observer in observers), strict=True):
        expected = steps[1].support(directions)
        scale = np.abs(directions).sum(axis=1) * np.abs(steps[1].box).max()
        assert np.abs(steps[0].set.support(directions) - expected).max() <= 1e-9 * scale.max()


@pytest.mark.parametrize("horizon", [1, 3])
def test_without_uncertainty_the_published_form_is_exact(horizon: int) -> None:
    rng = np.random.default_rng(7)
    model = UncertainModel([[0.9, 0.3], [-0.2, 0.8]], None, [[1.0, 0.0]], E=[[0.1], [1.0]], w=[0.2], n=[0.3], c=[0.5])
    log = model.simulate([0.5, 0.5], np.zeros((6, 0)), rng)
    initial = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    with pytest.warns(UserWarning, match="equation"):
        published = PolytopeObserver(model, initial, horizon=horizon, max_facets=None, as_published=True)
    exact = PolytopeObserver(model, initial, max_facets=None)
    for k in range(6):
        sets = [(o.update(log.y[0]) if k == 0 else o.step(None, log.y[k])).set for o in (published, exact)]
        # the rounding slack goes with the set before the measurement
        assert sets[0].equals(sets[1], tol=1e-7)


@settings(max_examples=12, deadline=None)
@given(seeds)
def test_channels_of_one_sign_give_the_window_of_one_step(seed: int) -> None:
    """Rank one, one sign of s, independent w: the hull over vertices is exact, then cut by the measurement."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    A, C, direction = rng.normal(size=(n, n)), rng.normal(size=(2, n)), rng.normal(size=n)
    functional = np.abs(rng.normal(size=n))  # s > 0 on the positive orthant
    uncertain = Uncertainty(A=np.outer(direction, functional), bounds=(-0.3, 0.6))
    model = UncertainModel(A, None, C, E=np.eye(n), w=np.full(n, 0.05), n=[0.3, 0.4], uncertainties=[uncertain])
    lower, upper = np.full(n, 0.5), np.full(n, 2.0)
    log = model.simulate(rng.uniform(lower, upper), np.zeros((2, 0)), rng)
    initial = HPolytope.box(lower, upper)
    boxes = []
    for observer in (PolytopeObserver(model, initial, eps=0.0), WindowObserver(model, initial, horizon=1, eps=0.0)):
        observer.update(np.full(2, np.nan))
        boxes.append(np.concatenate(observer.step(None, log.y[1]).box))
    points = []
    for delta in (-0.3, 0.6):
        corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
        moved = corners @ (A + delta * np.outer(direction, functional)).T
        points += [point + w for point in moved for w in itertools.product((-0.05, 0.05), repeat=n)]
    scale = np.ptp(points, axis=0).max()
    np.testing.assert_allclose(boxes[0], boxes[1], atol=1e-9 * scale)
    np.testing.assert_allclose(
        boxes[0], hull_cut_by_rows(np.array(points), C, log.y[1], np.array([0.3, 0.4])), atol=1e-7 * scale
    )


@settings(max_examples=6, deadline=None)
@given(seeds)
def test_images_of_a_hull_are_the_hull_over_all_vertices(seed: int) -> None:
    """Two steps from 2 + 2 images of hulls: the same set as from the 4 vertices of two samples."""
    rng = np.random.default_rng(seed)
    model = UncertainModel(
        rng.normal(size=(2, 2)), None, np.eye(2), E=rng.normal(size=(2, 1)), w=[0.2],
        uncertainties=[Uncertainty(A=0.3 * rng.normal(size=(2, 2)), E=[[0.1], [0.2]])],
    )  # fmt: skip
    initial, w = HPolytope.box([-1.0, 0.5], [1.0, 0.7]), HPolytope.box([-0.2], [0.2])
    maps = transitions(model.stack(), model, np.zeros(0))
    hull = hull_of_images(hull_of_images(initial.product(w), maps, None).product(w), maps, None)
    firsts = [initial.product(w).affine_map(M, t) for M, t in maps]
    explicit = convex_hull([P.product(w).affine_map(M, t) for P in firsts for M, t in maps])
    directions = rng.normal(size=(20, 2))
    expected = explicit.support(directions)
    np.testing.assert_allclose(hull.support(directions), expected, atol=1e-9 * np.abs(expected).max())
    observer = PolytopeObserver(model, initial, max_facets=None)
    observer.update([0.0, 0.6])
    observer.step(None, [np.nan, np.nan])
    assert hull.contains(observer.step(None, [np.nan, np.nan]).set)  # horizon 1 lies in the image of two steps


# -- budget and limits -----------------------------------------------------------------------------------------


@settings(max_examples=8, deadline=None)
@given(seeds, st.integers(1, 2))
def test_a_budget_gives_a_superset_of_the_exact_set(seed: int, horizon: int) -> None:
    rng = np.random.default_rng(seed)
    model = UncertainModel(
        0.6 * rng.normal(size=(2, 2)), None, rng.normal(size=(1, 2)), E=rng.normal(size=(2, 1)), w=[0.2], n=[0.3],
        uncertainties=[Uncertainty(A=0.2 * rng.normal(size=(2, 2)))],
    )  # fmt: skip
    log = model.simulate([0.5, 0.5], np.zeros((5, 0)), rng)
    initial = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    exact, reduced = (
        PolytopeObserver(model, initial, max_facets=None),
        PolytopeObserver(model, initial, horizon=horizon, max_facets=4),
    )
    for k in range(5):
        steps = [o.update(log.y[0]) if k == 0 else o.step(None, log.y[k]) for o in (exact, reduced)]
        assert len(steps[1].set.b) <= 4
        assert steps[1].set.contains(steps[0].set, tol=1e-9)


def test_exact_mode_stops_at_its_limit_and_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vertex_images, "EXACT_FACETS", 8)
    rng = np.random.default_rng(1)
    model = UncertainModel(
        0.9 * np.linalg.qr(rng.normal(size=(3, 3)))[0], None, np.eye(3), E=np.ones((3, 1)), w=[0.2], n=np.full(3, 2.0)
    )
    observer = PolytopeObserver(model, HPolytope.box(-np.ones(3), np.ones(3)), max_facets=None)
    observer.update(np.zeros(3))
    for _ in range(2):
        with pytest.raises(FacetLimitError, match=r"max_facets=60.*WindowObserver"):
            observer.step(None, np.zeros(3))


# -- proofs and protocol ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("F", "horizon"), [(None, 1), (None, 3), ([[0.1]], 1), ([[0.1]], 3)])
def test_an_alarm_has_a_proof_that_fails_for_other_data(F: list[list[float]] | None, horizon: int) -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1], F=F)
    observer = PolytopeObserver(model, HPolytope.box([-1.0], [1.0]), horizon=horizon)
    assert observer.update([0.0]).certificate is None
    assert observer.step(None, [0.0]).certificate is None
    step = observer.step(None, [3.0])
    assert step.verdict == "falsified"
    assert step.certificate.verify()
    wider = HPolytope(step.certificate.measurement.A, step.certificate.measurement.b + 5.0)
    assert not dataclasses.replace(step.certificate, measurement=wider).verify()
    assert np.isnan(step.box).all()
    assert step.set.emptiness().status == "empty"
    assert observer.step(None, [0.0]).verdict == "falsified"
    observer.reset(HPolytope.box([-1.0], [1.0]))
    assert observer.update([0.0]).verdict == "consistent"


def test_a_bank_of_polytope_observers_isolates_a_sensor() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], E=[[1.0]], w=([-0.1], [0.1]), n=[0.1], Ts=0.1)
    fault = SensorFault(0, "bias", 2.0, Step(0.2))
    log = model.simulate([0.0], np.zeros((4, 1)), np.random.default_rng(0))
    corrupted = dataclasses.replace(log, y=fault.corrupt(log.time, log.y))
    observers = [PolytopeObserver(m, HPolytope.box([-1.0], [1.0])) for m in (model, fault.model(model))]
    bank = ArchitectureI(nominal=observers[0], faults={"sensor": observers[1]})
    bank.warm_up()
    record = bank.run(corrupted)
    assert (record.detected_at, record.isolated_at, record.fault) == (2, 2, "sensor")
    assert record.certificates["nominal"].verify()


def test_a_step_without_an_update_has_no_first_measurement() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], D=[[0.5]], n=[0.1])
    first, second = (PolytopeObserver(model, HPolytope.box([-1.0], [1.0])) for _ in range(2))
    second.update([np.nan], [1.0])
    np.testing.assert_array_equal(first.step([1.0], [0.4], [0.2]).box, second.step([1.0], [0.4], [0.2]).box)


def test_wrong_arguments_are_named() -> None:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], E=[[1.0]], F=[[1.0]], w=[0.1], n=[0.1])
    box = HPolytope.box([-1.0], [1.0])
    with pytest.raises(ValueError, match="max_facets is 3; expected an integer of at least 4"):
        PolytopeObserver(model, box, max_facets=3)
    with pytest.raises(ValueError, match="horizon is 0"):
        PolytopeObserver(model, box, horizon=0)
    with pytest.raises(ValueError, match="neither F nor an uncertain output"):
        PolytopeObserver(model, box, as_published=True)
    with pytest.raises(ValueError, match="initial is unbounded"):
        PolytopeObserver(model, HPolytope.whole_space(1))
    observer = PolytopeObserver(model, box)
    observer.update([0.0])
    with pytest.raises(ValueError, match="update was called after"):
        observer.update([0.0])
    with pytest.raises(ValueError, match="u is missing"):
        observer.step(None, [0.0])
    with pytest.raises(ValueError, match="y has shape"):
        observer.step([0.0], [0.0, 1.0])
    with pytest.raises(ValueError, match="expected finite numbers, or NaN"):
        observer.step([0.0], [np.inf])

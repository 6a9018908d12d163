"""Certificates of empty windows against an exact judge that shares nothing with them, and forgeries against both."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.model import UncertainModel, Uncertainty
from svo.observers.proof import ArrivalSet, WindowCertificate, WindowSample
from svo.observers.window import WindowObserver
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.window_system import judge

SAMPLES, FAULT = 16, 7
seeds = st.integers(0, 2**32 - 1)
Forgery = Callable[[np.random.Generator, WindowCertificate, np.ndarray], WindowCertificate]


# -- falsified plants -----------------------------------------------------------------------------------------


def varied_plant(rng: np.random.Generator) -> UncertainModel:
    """A random plant, sometimes with A, the noise and the disturbances as functions of the schedule."""
    model = random_plant(rng)
    if rng.random() < 0.6:
        return model
    A, slope = np.array(model.A), 0.1 * rng.normal(size=np.shape(model.A))
    lower, upper, noise = model.bounds()
    changes: dict[str, Any] = {"A": lambda s: A + s * slope, "n": lambda s: noise * (1 + s)}
    if model.disturbance_polytope is None and model.n_disturbances:
        changes["w"] = (lambda s: lower * (1 + s), lambda s: upper * (1 + s))
    return model.replace(schedule=0.5, **changes)


def initial_set(rng: np.random.Generator, x0: np.ndarray) -> HPolytope:
    box = HPolytope.box(x0 - rng.uniform(0.2, 2.0, x0.size), x0 + rng.uniform(0.2, 2.0, x0.size))
    rows = rng.normal(size=(2, x0.size))
    return box if rng.random() < 0.5 else box.intersection(HPolytope(rows, rows @ x0 + 0.05))


def corrupted(rng: np.random.Generator, y: np.ndarray) -> np.ndarray:
    """Missing readings, and from the fault on a bias, a ramp or a single outlier."""
    bad, sensor, size = y.copy(), int(rng.integers(y.shape[1])), rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 2)
    kind = rng.choice(["bias", "ramp", "outlier"])
    if kind == "outlier":
        bad[FAULT, sensor] += size
    else:
        bad[FAULT:, sensor] += size * (1.0 if kind == "bias" else np.linspace(0.1, 1.0, len(y) - FAULT))
    bad[rng.random(y.shape) < rng.choice([0.0, 0.2])] = np.nan
    return bad


@cache
def falsified(seed: int) -> tuple[WindowCertificate | None, np.ndarray]:
    """The certificate of a faulty run, if it was falsified, and its readings before the fault was added."""
    rng = np.random.default_rng(seed)
    model = varied_plant(rng)
    x0 = rng.uniform(-1, 1, model.n_states)
    schedule = rng.uniform(0, 1, SAMPLES) if model.is_scheduled else None
    log = model.simulate(x0, rng.normal(size=(SAMPLES, model.n_inputs)), rng, corners=False, schedule=schedule)
    template = "box" if rng.random() < 0.5 else rng.normal(size=(2, model.n_states))
    observer = WindowObserver(model, initial_set(rng, x0), int(rng.integers(1, 11)), template)
    run = observer.run(replace(log, y=corrupted(rng, log.y)))
    return run.certificate, log.y


def some_certificates(count: int) -> list[tuple[WindowCertificate, np.ndarray]]:
    found = (falsified(seed) for seed in range(2 * count))
    return [(c, y) for c, y in found if c is not None][:count]


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_every_falsified_window_is_empty_by_an_independent_proof(seed: int) -> None:
    certificate, _ = falsified(seed)
    if certificate is not None:
        assert certificate.verify() is True
        assert judge(certificate) == "empty"


def test_the_random_plants_cover_what_a_model_can_hold() -> None:
    certificates = [c for c, _ in some_certificates(40)]
    assert len(certificates) == 40
    used = Counter[str]()
    for c in certificates:
        newest = c.samples[-1]
        used.update({
            "slid": c.first > 0,
            "late": c.late,
            "rows on w": bool(len(c.w_rows)),
            "arrival rows": bool(np.any(c.on_arrival)),
            "known s": any(np.any(s.s_lower > 0) or np.any(s.s_upper < 0) for s in c.samples[:-1]),
            "open s": any(np.any((s.s_lower < 0) & (s.s_upper > 0)) for s in c.samples[:-1]),
            "channel multipliers": any(np.any(s.on_channel) for s in c.samples),
            "multipliers on w": any(np.any(s.on_w) for s in c.samples),
            "missing": any(np.isnan(s.y).any() for s in c.samples),
            "rank two": len(set(c.owner)) < len(c.owner),
            "changing": not np.array_equal(c.samples[0].stack, newest.stack),
        })  # fmt: skip
    assert min(used.values()) > 0, used


# -- forgeries: the system is changed, the multipliers stay ---------------------------------------------------


def at_random_sample(change: Callable[[np.random.Generator, WindowSample], WindowSample]) -> Forgery:
    def forge(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
        k = int(rng.integers(len(c.samples)))
        return replace(c, samples=(*c.samples[:k], change(rng, c.samples[k]), *c.samples[k + 1 :]))

    return forge


def at_every_sample(change: Callable[[np.random.Generator, WindowSample], WindowSample]) -> Forgery:
    def forge(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
        return replace(c, samples=tuple(change(rng, s) for s in c.samples))

    return forge


def scale(rng: np.random.Generator) -> float:
    return 10 ** rng.uniform(-2, 4)


def entry_moved(rng: np.random.Generator, array: np.ndarray) -> np.ndarray:
    """One entry changed by a little, a lot, or in its sign."""
    changed = array.copy()
    if changed.size:
        i = int(rng.integers(changed.size))
        kind = rng.integers(3)
        old = changed.flat[i] if np.isfinite(changed.flat[i]) else 0.0
        changed.flat[i] = -old if kind == 0 else old + rng.normal() * 10 ** rng.uniform(-6, 2) * (1.0 + kind * abs(old))
    return changed


def wider(rng: np.random.Generator, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return lower - scale(rng) * rng.random(lower.shape), upper + scale(rng) * rng.random(upper.shape)


def healthy_readings(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    return replace(c, samples=tuple(replace(s, y=y[c.first + i].copy()) for i, s in enumerate(c.samples)))


def wide_arrival(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    a = c.arrival
    box, rows = wider(rng, a.box_lower, a.box_upper), wider(rng, a.lower, a.upper)
    return replace(c, arrival=ArrivalSet(*box, a.rows, *rows))


def wide_delta(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    return replace(c, delta=np.column_stack(wider(rng, *c.delta.T)).reshape(c.delta.shape))


def wide_s(rng: np.random.Generator, s: WindowSample) -> WindowSample:
    lower, upper = wider(rng, s.s_lower, s.s_upper)
    return replace(s, s_lower=lower, s_upper=upper)


def wide_w(rng: np.random.Generator, s: WindowSample) -> WindowSample:
    lower, upper = wider(rng, s.w_lower, s.w_upper)
    return replace(s, w_lower=lower, w_upper=upper)


def fewer_samples(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    if rng.random() < 0.5:
        return replace(c, first=c.first + 1, samples=c.samples[1:])
    return replace(c, last=c.last - 1, samples=c.samples[:-1])


def reordered(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    return replace(c, samples=tuple(c.samples[i] for i in rng.permutation(len(c.samples))))


def any_entry(rng: np.random.Generator, c: WindowCertificate, y: np.ndarray) -> WindowCertificate:
    name = str(rng.choice(["delta", "w_rows", "w_rows_lower", "w_rows_upper", "on_arrival", "arrival"]))
    if name != "arrival":
        return replace(c, **{name: entry_moved(rng, getattr(c, name))})
    part = str(rng.choice([f.name for f in fields(ArrivalSet)]))
    return replace(c, arrival=replace(c.arrival, **{part: entry_moved(rng, getattr(c.arrival, part))}))


def any_sample_entry(rng: np.random.Generator, s: WindowSample) -> WindowSample:
    name = str(rng.choice([f.name for f in fields(WindowSample) if f.name != "stack"]))
    return replace(s, **{name: entry_moved(rng, getattr(s, name))})


def nominal_entry(rng: np.random.Generator, s: WindowSample) -> WindowSample:
    return replace(s, stack=np.concatenate([entry_moved(rng, s.stack[:1]), s.stack[1:]]))


def other_lines(rng: np.random.Generator, s: WindowSample) -> WindowSample:
    """Lines that cut off some of p = Delta s: flat ones, steep ones, or moved inwards."""
    shift = scale(rng) * np.array([0.0, -1.0, 0.0, 1.0])
    return replace(s, lines=s.lines * rng.choice([0.0, 1.0, -1.0]) + shift)


FORGERIES: dict[str, Forgery] = {
    "healthy readings": healthy_readings,
    "noise enlarged": at_every_sample(lambda rng, s: replace(s, noise=s.noise + scale(rng))),
    "slack enlarged": at_every_sample(lambda rng, s: replace(s, slack=s.slack + scale(rng))),
    "arrival enlarged": wide_arrival,
    "delta enlarged": wide_delta,
    "s enlarged": at_every_sample(wide_s),
    "w enlarged": at_every_sample(wide_w),
    "lines moved": at_every_sample(other_lines),
    "all of them": lambda rng, c, y: at_every_sample(lambda r, s: other_lines(r, wide_s(r, wide_w(r, s))))(
        rng, wide_delta(rng, wide_arrival(rng, healthy_readings(rng, c, y), y), y), y
    ),
    "input moved": at_random_sample(lambda rng, s: replace(s, u=entry_moved(rng, s.u))),
    "matrix moved": at_random_sample(nominal_entry),
    "sample lost": fewer_samples,
    "samples reordered": reordered,
    "late turned": lambda rng, c, y: replace(c, late=not c.late),
    "any entry": any_entry,
    "any entry of a sample": at_random_sample(any_sample_entry),
}


@settings(max_examples=400, deadline=None)
@given(seed=st.integers(0, 40), change=seeds, kind=st.sampled_from(sorted(FORGERIES)), twice=st.booleans())
def test_what_verifies_is_empty_whatever_was_changed(seed: int, change: int, kind: str, twice: bool) -> None:
    certificate, y = falsified(seed)
    if certificate is None:
        return
    rng = np.random.default_rng(change)
    forged = FORGERIES[kind](rng, certificate, y)
    if twice:
        forged = FORGERIES["any entry of a sample"](rng, forged, y)
    answer = forged.verify()
    assert isinstance(answer, bool)
    if answer:
        assert judge(forged) != "feasible"


@pytest.mark.parametrize("kind", ["healthy readings", "noise enlarged", "slack enlarged", "all of them"])
def test_a_system_that_became_feasible_has_no_proof(kind: str) -> None:
    rng, feasible = np.random.default_rng(1), 0
    for certificate, y in some_certificates(10):
        forged = FORGERIES[kind](rng, certificate, y)
        if judge(forged) == "feasible":
            feasible += 1
            assert forged.verify() is False
    assert feasible > 1


# -- forgeries by hand: multipliers found for a smaller system are offered for a larger one -------------------


def drift(x_row: float = 0.0, y_row: float = 0.0) -> UncertainModel:
    """x+ = x + w, y = x + noise, both up to Delta x_row x and Delta y_row x."""
    items = [Uncertainty(A=[[x_row]], C=[[y_row]])] if x_row or y_row else []
    return UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1], uncertainties=items)


def certificate_of_jump(model: UncertainModel, readings: tuple[float, ...] = (1.0, 2.0)) -> WindowCertificate:
    observer = WindowObserver(model, HPolytope.box([0.5], [1.5]), horizon=3)
    step = observer.update([readings[0]])
    for y in readings[1:]:
        step = observer.step(None, [y])
    assert step.certificate is not None
    assert step.certificate.verify()
    return step.certificate


@pytest.mark.parametrize(
    ("changes", "readings"),
    [
        ({"noise": [1.0]}, (1.0, 1.43)),
        ({"slack": [1.0]}, (1.0, 1.43)),
        ({"w_lower": [-1.0], "w_upper": [1.0]}, (1.0, 2.0)),
        ({"y": [1.5]}, (1.0, 1.43)),
        ({"delta": [[-2.0, 9.0]]}, (1.0, 1.43)),
        ({"s_lower": [0.0], "s_upper": [3.0], "delta": [[-2.0, 9.0]]}, (1.0, 1.43)),
        ({"box_upper": [5.0]}, (5.0,)),
    ],
)  # fmt: skip
def test_a_bound_that_explains_the_jump_ends_the_proof(changes: dict[str, Any], readings: tuple[float, ...]) -> None:
    forged = certificate_of_jump(drift(0.1), readings)
    for name, value in changes.items():
        where = next(place for field, place, _ in arrays_of(forged) if field == name)
        forged = put(forged, name, where, np.array(value))
    assert judge(forged) == "feasible"
    assert not forged.verify()


def test_rows_on_the_disturbance_take_part_in_the_proof() -> None:
    corner = HPolytope([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 0.1])  # each 0.1 at most, and so their sum
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[1.0, 1.0]], w=corner, n=[0.1])
    certificate = certificate_of_jump(model, (1.0, 1.35))
    assert np.any(certificate.samples[0].on_w)
    assert judge(certificate) == "empty"
    forged = replace(certificate, w_rows_upper=np.array([0.2]))
    assert judge(forged) == "feasible"
    assert not forged.verify()


def with_stacks(c: WindowCertificate, change: Callable[[np.ndarray], np.ndarray]) -> WindowCertificate:
    return replace(c, samples=tuple(replace(s, stack=change(s.stack)) for s in c.samples))


def test_an_uncertainty_without_a_channel_is_not_overlooked() -> None:
    certificate = certificate_of_jump(drift())
    item = drift(x_row=1.0).stack()[1:]  # x may double, so the jump from 1 to 2 is explained
    assert not with_stacks(certificate, lambda stack: np.concatenate([stack, item])).verify()


def test_an_uncertainty_of_two_ranks_needs_two_channels() -> None:
    certificate = certificate_of_jump(drift(x_row=0.1))
    stronger = drift(x_row=0.1).stack()[1:].copy()
    stronger[0, 0, -1] = 20.0  # w may grow by 2 in x, and the output sees a multiple of x of its own
    stronger[0, 1, 0] = 1.0
    assert not with_stacks(certificate, lambda stack: np.concatenate([stack[:1], stronger])).verify()


def test_an_uncertain_output_of_the_newest_sample_is_not_overlooked() -> None:
    certificate = certificate_of_jump(drift(x_row=0.1))
    assert not certificate.late
    stack = drift(x_row=0.1, y_row=2.0).stack()  # there s = 2 x
    forged = sample_changed(certificate, 1, stack=stack, s_lower=np.array([1.0]), s_upper=np.array([3.0]))
    assert judge(forged) == "feasible"
    assert not forged.verify()
    assert not replace(forged, late=True).verify()


def test_a_disturbed_output_of_the_newest_sample_is_not_overlooked() -> None:
    certificate = certificate_of_jump(drift())
    stack = certificate.samples[1].stack.copy()
    stack[0, 1, -1] = 100.0
    forged = sample_changed(certificate, 1, stack=stack, w_lower=np.array([-0.1]), w_upper=np.array([0.1]))
    assert judge(forged) == "feasible"
    assert not forged.verify()
    assert not replace(forged, late=True).verify()


def test_a_line_that_bounds_from_above_does_not_bound_from_below() -> None:
    fixed = [Uncertainty(A=[[0.1]], bounds=(1.0, 1.0))]  # p = s, so x(1) >= 0.9 + 0.09 - 0.1, which the lines prove
    certificate = certificate_of_jump(drift().replace(uncertainties=fixed), (1.0, 0.77))
    above, below = certificate.samples[0].on_channel[0]
    assert below > above
    forged = replace(certificate, delta=np.array([[-1.0, 1.0]]))  # p = -s is possible, too
    forged = sample_changed(
        forged, 0, lines=np.array([[1.0, 0.0, -1.0, 0.0]]), on_channel=np.array([[above - below, 0.0]])
    )
    assert judge(forged) == "feasible"
    assert not forged.verify()


@pytest.mark.parametrize("owner", [[], [0], [2], [-1], [10**9], [1, 1], [1.0], [[1]]])
def test_an_owner_must_be_an_uncertainty_of_the_stack(owner: Any) -> None:
    certificate = certificate_of_jump(drift(x_row=0.1))
    assert not replace(certificate, owner=np.array(owner)).verify()
    stretched = {
        name: np.ones((len(owner), *getattr(certificate.samples[0], name).shape[1:]))
        for name in ("s_lower", "s_upper", "lines", "on_channel")
    }
    samples = tuple(replace(s, **stretched) for s in certificate.samples)
    forged = replace(certificate, owner=np.array(owner), delta=np.ones((len(owner), 2)), samples=samples)
    assert not forged.verify()


def test_each_uncertainty_needs_its_own_channel() -> None:
    items = [Uncertainty(A=[[0.1]]), Uncertainty(A=[[0.2]])]
    certificate = certificate_of_jump(drift().replace(uncertainties=items))
    assert certificate.owner.tolist() == [1, 2]
    assert not replace(certificate, owner=np.array([1, 1])).verify()


def sample_changed(c: WindowCertificate, k: int, **changes: Any) -> WindowCertificate:
    return replace(c, samples=(*c.samples[:k], replace(c.samples[k], **changes), *c.samples[k + 1 :]))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("noise", [-5.0]), ("slack", [-5.0]), ("s_lower", [9.0]), ("s_upper", [-9.0]),
        ("w_lower", [9.0]), ("w_upper", [-9.0]), ("on_channel", [[-1.0, 0.0]]), ("on_channel", [[0.0, -1.0]]),
        ("y", [np.nan]), ("y", [np.inf]), ("lines", [[0.0, -9.0, 0.0, 9.0]]), ("lines", [[-9.0, 0.0, 9.0, 0.0]]),
    ],
)  # fmt: skip
def test_intervals_out_of_order_and_signs_against_the_rule_prove_nothing(name: str, value: list[float]) -> None:
    # x(1) <= 1.1 + 0.11 + 0.1 by the channel's line, but 1.33 at least by its reading
    certificate = certificate_of_jump(drift(x_row=0.1), (1.0, 1.43))
    assert np.any(certificate.samples[0].on_channel)
    assert np.any(certificate.samples[0].on_output)
    assert not sample_changed(certificate, 0, **{name: np.array(value)}).verify()


def test_bounds_of_a_known_s_are_checked() -> None:
    drive = Uncertainty(B=[[1.0]], bounds=(-0.1, 0.1))
    model = UncertainModel([[1.0]], [[1.0]], [[1.0]], n=[0.1], uncertainties=[drive])
    observer = WindowObserver(model, HPolytope.box([0.5], [1.5]), horizon=3)
    observer.update([1.0])
    certificate = observer.step([1.0], [3.0]).certificate
    assert certificate is not None
    forged = sample_changed(certificate, 0, s_lower=np.array([-0.5]), s_upper=np.array([0.5]))
    assert certificate.verify()
    assert not forged.verify()


def arrays_of(c: WindowCertificate) -> list[tuple[str, int | None, np.ndarray]]:
    """Every array of a certificate: its name, the sample that it stands in (-1 the arrival set), its value."""
    own = [(f.name, None, getattr(c, f.name)) for f in fields(c) if isinstance(getattr(c, f.name), np.ndarray)]
    arrival = [(f.name, -1, getattr(c.arrival, f.name)) for f in fields(ArrivalSet)]
    return own + arrival + [(f.name, k, getattr(s, f.name)) for k, s in enumerate(c.samples) for f in fields(s)]


def put(c: WindowCertificate, name: str, where: int | None, value: Any) -> WindowCertificate:
    if where is None:
        return replace(c, **{name: value})
    if where == -1:
        return replace(c, arrival=replace(c.arrival, **{name: value}))
    return sample_changed(c, where, **{name: value})


@pytest.mark.parametrize("seed", [0, 3, 5, 8])
def test_no_array_may_have_another_shape(seed: int) -> None:
    certificate = some_certificates(seed + 1)[-1][0]
    for name, where, array in arrays_of(certificate):
        longer = np.concatenate([array, array[-1:]]) if len(array) else np.zeros((1, *array.shape[1:]), array.dtype)
        for value in (longer, array[..., None], array.astype(complex), array.astype(object), array.tolist(), None):
            assert put(certificate, name, where, value).verify() is False, (name, where)
        if array.size:
            assert put(certificate, name, where, array[..., :-1]).verify() is False, (name, where)


@pytest.mark.parametrize("seed", [0, 3, 5, 8])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_nan_and_inf_prove_nothing(seed: int, value: float) -> None:
    certificate = some_certificates(seed + 1)[-1][0]
    allowed = {"y", "lower", "upper", "w_rows_lower", "w_rows_upper"}  # missing sensors and one-sided rows
    for name, where, array in arrays_of(certificate):
        for i in range(array.size if array.dtype == float else 0):
            changed = array.copy()
            changed.flat[i] = value
            answer = put(certificate, name, where, changed).verify()
            assert answer is False or name in allowed, (name, where)
            if answer:
                assert judge(put(certificate, name, where, changed)) == "empty"


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 40), change=seeds, size=st.sampled_from([1e300, -1e308, 5e-324, 1e-300, 0.0]))
def test_extreme_numbers_do_no_harm(seed: int, change: int, size: float) -> None:
    certificate, _ = falsified(seed)
    if certificate is None:
        return
    rng = np.random.default_rng(change)
    filled = [entry for entry in arrays_of(certificate) if entry[2].size and entry[2].dtype == float]
    name, where, array = filled[int(rng.integers(len(filled)))]
    changed = array.copy()
    changed.flat[int(rng.integers(array.size))] = size
    forged = put(certificate, name, where, changed)
    with np.errstate(over="ignore", invalid="ignore"):
        answer = forged.verify()
    assert isinstance(answer, bool)
    if answer and abs(size) < 1:  # HiGHS cannot propose anything for numbers beyond 1e100
        assert judge(forged) != "feasible"


@pytest.mark.parametrize("changes", [{"n": 2}, {"n": 0}, {"n": -1}, {"first": 1}, {"last": 0}, {"samples": ()}])
def test_sizes_that_contradict_the_arrays_prove_nothing(changes: dict[str, Any]) -> None:
    assert not replace(certificate_of_jump(drift()), **changes).verify()


# -- what the observer must not overlook ---------------------------------------------------------------------


def test_a_disturbance_that_reaches_the_output_only_at_other_schedules() -> None:
    model = UncertainModel([[1.0]], None, [[1.0]], E=[[0.0]], F=lambda s: [[s]], w=[1.0], n=[0.1], schedule=0.0)
    observer = WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=2)
    observer.update([0.0], schedule=0.0)
    for _ in range(4):
        step = observer.step(None, [0.9], schedule=1.0)
        assert step.verdict == "consistent"
        assert step.box[0][0] <= 0.0 <= step.box[1][0]
    assert observer.step(None, [1.5], schedule=1.0).verdict == "falsified"


def test_an_uncertainty_that_vanishes_at_the_typical_schedule_is_an_error() -> None:
    growing = Uncertainty(A=lambda s: [[s]])
    model = UncertainModel([[1.0]], None, [[1.0]], n=[0.1], uncertainties=[growing], schedule=0.0)
    observer = WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=2)
    observer.update([1.0], schedule=1.0)
    with pytest.raises(ValueError, match="higher rank"):
        observer.step(None, [2.0], schedule=1.0)

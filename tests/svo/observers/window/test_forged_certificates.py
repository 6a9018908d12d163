"""Certificates that were changed: whatever verifies is empty, and broken arrays prove nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet, WindowSample
from tests.svo.observers.window.falsified_windows import (
    Forgery,
    arrays_of,
    certificate_of_jump,
    drift,
    falsified,
    put,
    seeds,
    some_certificates,
)
from tests.svo.observers.window.window_system import judge


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
    name = str(rng.choice([f.name for f in fields(s) if f.name != "stack" and getattr(s, f.name) is not None]))
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


@pytest.mark.parametrize("seed", [0, 3, 5, 8])
def test_no_array_may_have_another_shape(seed: int) -> None:
    certificate = some_certificates(seed + 1)[-1][0]
    for name, where, array in arrays_of(certificate):
        longer = np.concatenate([array, array[-1:]]) if len(array) else np.zeros((1, *array.shape[1:]), array.dtype)
        wrong = [longer, array[..., None], array.astype(complex), array.astype(object), array.tolist(), None]
        for value in wrong[: -1 if name in ("gain", "functional") else None]:  # without them it takes its own
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

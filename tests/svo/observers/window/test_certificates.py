"""Certificates of empty windows against an exact judge that shares nothing with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.left_out import channels_of
from svo.observers.window.observer import WindowObserver
from tests.svo.observers.window.falsified_windows import (
    arrays_of,
    certificate_of_jump,
    drift,
    falsified,
    put,
    sample_changed,
    seeds,
)
from tests.svo.observers.window.window_system import judge


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_every_falsified_window_is_empty_by_an_independent_proof(seed: int) -> None:
    certificate, _ = falsified(seed)
    if certificate is not None:
        assert certificate.verify() is True
        # one by readings alone has no arrival set that rows could be made of
        assert certificate.arrival.is_unknown or judge(certificate) == "empty"


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
    stack = drift(x_row=0.1, y_row=2.0).stack()
    found = channels_of(stack, certificate.owner, certificate.delta, certificate.units)
    assert found is not None
    gain, functional = found
    s = functional[:, 0]  # times x
    forged = sample_changed(
        certificate, 1, stack=stack, gain=gain, functional=functional, s_lower=0.5 * s, s_upper=1.5 * s
    )
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
    forged = sample_changed(certificate, 0, s_lower=np.array([-0.1]), s_upper=np.array([0.1]))
    assert certificate.verify()
    assert not forged.verify()


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

"""Units that are powers of two change nothing: verdicts, pivots, proofs and normal memory are the same, sets scale."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.logs.drive import drive
from svo.models.normal_form import NormalForm
from svo.observers.polytope.observer import PolytopeObserver
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import WindowSample
from svo.observers.zonotope.observer import ConstrainedZonotopeObserver
from tests.svo.observers.other_units import Units
from tests.svo.observers.window.falsified_windows import corrupted, varied_plant

seeds = st.integers(0, 2**32 - 1)


def box_about(rng: np.random.Generator, x0: np.ndarray) -> HPolytope:
    """A box, sometimes without width in a coordinate or at zero there."""
    low, high = x0 - rng.uniform(0.2, 2.0, x0.size), x0 + rng.uniform(0.2, 2.0, x0.size)
    flat = rng.random(x0.size) < 0.2
    low[flat] = high[flat] = x0[flat]
    return HPolytope.box(low, high)


def run_of(rng: np.random.Generator, samples: int = 14) -> tuple[UncertainModel, HPolytope, Any]:
    """A plant, its first set, and a log that is healthy or corrupted."""
    model = varied_plant(rng)
    x0 = rng.uniform(-1.0, 1.0, model.n_states) * (rng.random(model.n_states) < 0.8)
    schedule = rng.uniform(0, 1, samples) if model.is_scheduled else None
    u = rng.normal(size=(samples, model.n_inputs))
    log = model.simulate(x0, u, rng, corners=bool(rng.random() < 0.5), schedule=schedule)
    if rng.random() < 0.5:
        log = replace(log, y=corrupted(rng, log.y))
    return model, box_about(rng, x0), log


def normal_proof(c: WindowCertificate) -> list[np.ndarray]:
    """Every number of a proof in normal form."""
    assert c.units is not None
    x, u, y, w = (getattr(c.units, f.name) for f in fields(c.units))
    a, found = c.arrival, [c.delta, c.owner, np.ldexp(c.w_rows, w), c.w_rows_lower, c.w_rows_upper, c.on_arrival]
    found += [np.ldexp(a.box_lower, -x), np.ldexp(a.box_upper, -x), np.ldexp(a.rows, x), a.lower, a.upper]
    inputs = np.concatenate([x, u, [0], w])
    shift = {"gain": -np.concatenate([x, y]), "functional": inputs, "remainder": -y}
    shift |= {"u": -u, "y": -y, "noise": -y, "slack": -y, "w_lower": -w, "w_upper": -w, "on_output": y}
    for s in c.samples:
        found.append(s.stack * c.units.factor)
        for f in fields(WindowSample):
            if f.name != "stack" and getattr(s, f.name) is not None:
                found.append(np.ldexp(getattr(s, f.name), shift.get(f.name, 0)))
    return found


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.tobytes() == b.tobytes()


def memory(observer: Any) -> dict[str, np.ndarray]:
    return {k: v for k, v in observer.state_dict().items() if not k.startswith(("exponents.", "seal."))}


def compare(make: Any, units: Units, model: UncertainModel, start: HPolytope, log: Any) -> Any:
    """Both observers along the log; returns the certificates."""
    one, two = make(model, start, 0), make(units.model(model), units.set("x", start), units.x)
    other = units.log(log)
    for k, (a, b) in enumerate(zip(drive(one, log), drive(two, other), strict=True)):
        assert a.verdict == b.verdict, k
        for end, scaled in zip(a.box, b.box, strict=True):
            assert same(np.ldexp(end, units.x), scaled), k
    left, right = memory(one), memory(two)
    assert left.keys() == right.keys()
    for name, value in left.items():
        assert same(np.asarray(value), np.asarray(right[name])), name
    return a.certificate, b.certificate


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_units_change_nothing_of_a_window(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, start, log = run_of(rng)
    horizon, T = int(rng.integers(1, 9)), rng.normal(size=(int(rng.integers(0, 3)), model.n_states))
    units = Units.random(rng, model)

    def make(model: UncertainModel, start: HPolytope, x: Any) -> WindowObserver:
        return WindowObserver(model, start, horizon=horizon, template=np.ldexp(T, -x))

    one, two = compare(make, units, model, start, log)
    if one is not None:
        assert one.verify()
        assert two.verify()
        for a, b in zip(normal_proof(one), normal_proof(two), strict=True):
            assert same(a, b)


@settings(max_examples=12, deadline=None)
@given(seeds)
def test_units_change_nothing_of_a_zonotope(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, start, log = run_of(rng, samples=9)
    units = Units.random(rng, model)
    one, two = compare(lambda m, P, _: ConstrainedZonotopeObserver(m, P), units, model, start, log)
    if one is not None:
        assert two.verify()
        for a, b in zip(normal_proof(one.window), normal_proof(two.window), strict=True):
            assert same(a, b)


def hydraulics(seed: int) -> tuple[UncertainModel, HPolytope, Any]:
    """A valve's position in m and a pressure in Pa, all unknowns at their corners."""
    model = UncertainModel(
        [[0.6, 2e-10], [-3e8, 0.5]], None, np.eye(2), E=np.diag([1e-4, 1e5]), w=[1.0, 1.0], n=[1e-5, 1e4],
        uncertainties=[Uncertainty(A=[[0, 3e-10], [3e8, 0]])],
    )  # fmt: skip
    rng, size = np.random.default_rng(seed), np.array([1e-3, 1e6])
    log = model.simulate(rng.uniform(-1, 1, 2) * size, np.zeros((30, 0)), rng, corners=True)
    return model, HPolytope.box(-size, size), log


@pytest.mark.parametrize("make", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_a_healthy_plant_in_metres_and_pascals_is_not_falsified(make: Any) -> None:
    for seed in range(3):
        model, start, log = hydraulics(seed)
        run = make(model, start).run(log)
        assert set(run.verdicts) == {"consistent"}
        assert (run.lower <= log.x).all()
        assert (log.x <= run.upper).all()


def test_every_entry_of_a_normal_form_is_the_given_one_times_a_power_of_two() -> None:
    model, start, _ = hydraulics(0)
    form = NormalForm.at(model, *start.bounding_box())
    assert form.exponents.states.tolist() == [-9, 20]
    assert form.exponents.outputs.tolist() == [-16, 14]
    stack = form.model.stack()
    np.testing.assert_array_equal(stack / form.exponents.factor, model.stack())
    assert 0.1 < np.abs(stack[1][stack[1] != 0]).max() < 1.0

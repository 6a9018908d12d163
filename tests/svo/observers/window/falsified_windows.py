"""Windows of random plants that a corrupted measurement falsified, one of a jump, and how to change certificates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.observer import WindowObserver
from tests.svo.observers.random_plants import random_plant

SAMPLES, FAULT = 16, 7
seeds = st.integers(0, 2**32 - 1)
Forgery = Callable[[np.random.Generator, WindowCertificate, np.ndarray], WindowCertificate]


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
    observer = WindowObserver(model, initial_set(rng, x0), horizon=int(rng.integers(1, 11)), template=template)
    run = observer.run(replace(log, y=corrupted(rng, log.y)))
    return run.certificate, log.y


def some_certificates(count: int) -> list[tuple[WindowCertificate, np.ndarray]]:
    found = (falsified(seed) for seed in range(2 * count))
    return [(c, y) for c, y in found if c is not None][:count]


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


def sample_changed(c: WindowCertificate, k: int, **changes: Any) -> WindowCertificate:
    return replace(c, samples=(*c.samples[:k], replace(c.samples[k], **changes), *c.samples[k + 1 :]))


def arrays_of(c: WindowCertificate) -> list[tuple[str, int | None, np.ndarray]]:
    """Every array of a certificate: its name, the sample that it stands in (-1 the arrival set), its value."""
    own = [(f.name, None, getattr(c, f.name)) for f in fields(c) if isinstance(getattr(c, f.name), np.ndarray)]
    arrival = [(f.name, -1, getattr(c.arrival, f.name)) for f in fields(ArrivalSet)]
    entries = ((f.name, k, getattr(s, f.name)) for k, s in enumerate(c.samples) for f in fields(s))
    return own + arrival + [entry for entry in entries if entry[2] is not None]


def put(c: WindowCertificate, name: str, where: int | None, value: Any) -> WindowCertificate:
    if where is None:
        return replace(c, **{name: value})
    if where == -1:
        return replace(c, arrival=replace(c.arrival, **{name: value}))
    return sample_changed(c, where, **{name: value})

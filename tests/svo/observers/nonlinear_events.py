"""Nonlinear plants seen at times of their own: sensors and inputs have clocks, stamps may be off, and w switches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo import Log
from svo.models.draws import draw
from svo.models.nonlinear import NonlinearModel
from svo.models.nonlinear.simulation import integrated
from tests.svo.models.nonlinear_plants import CASES
from tests.svo.observers.event_plants import EventCase, clocks

Array = NDArray[np.float64]
PLANTS = ("tank", "pendulum", "cstr")
STEPS = 10  # of an integration within a sample; these plants are smooth


def nonlinear_case(name: str, rng: np.random.Generator, samples: int, jitter: float = 0.0) -> EventCase:
    """A run of a plant; readings are taken up to ``jitter`` sampling times before or after their stamps."""
    varying = bool(rng.random() < 0.3)
    case = CASES[name](**({"varying": "all"} if varying else {}))
    Ts, corners, steps = case.model.Ts, bool(rng.random() < 0.5), STEPS
    model: NonlinearModel = case.model.replace(jitter=jitter * Ts) if jitter else case.model
    ny, flow = model.n_outputs, model.flow
    own = clocks(rng, ny, samples, Ts, (1.0, 1.0, 2.0))
    times = np.unique(np.concatenate(own))[:samples]
    x = case.x0 + case.spread * rng.uniform(-1.0, 1.0, len(case.x0))
    first = HPolytope.box(np.minimum(case.x0 - case.spread, x), np.maximum(case.x0 + case.spread, x))
    u, known = np.array(case.u(0), dtype=float), model.reading.values(np.concatenate([x, flow.w.lower, case.u(0)]))
    way: list[tuple[float, Array, Array, Array]] = []  # time, x, w, u: constant from then on
    states, inputs, stamped = [], [], []
    for k, time in enumerate(times.tolist()):
        if time in own[-1]:
            u = np.array(case.u(k), dtype=float)
            u = u if case.control is None else u + case.control(known)
        states.append(x)
        inputs.append(u)
        off = Ts * jitter * (rng.choice([-1.0, 1.0], ny) if corners else rng.uniform(-1.0, 1.0, ny))
        stamped.append((time, off, draw(-model.noise, model.noise, rng, corners)))
        end = times[k + 1] if k + 1 < len(times) else time + Ts
        ends, w = np.linspace(time, end, 5 if varying else 2), draw(*flow.w, rng, corners)
        for i, begin in enumerate(ends[:-1]):
            w = draw(*flow.w, rng, corners) if i else w
            way.append((float(begin), x, w, u))
            x = integrated(flow, x, w, u, float(ends[i + 1] - begin), steps // (2 if varying else 1))
        if case.control is not None:
            known = model.reading.values(np.concatenate([x, w, u]))
    begins = [at[0] for at in way]

    def read(time: float, sensor: int) -> float:
        begin, x0, w0, u0 = way[max(0, int(np.searchsorted(begins, time, side="right")) - 1)]
        there = integrated(flow, x0, w0, u0, max(time, begin) - begin, steps) if time > begin else x0
        return float(model.reading.values(np.concatenate([there, w0, u0]))[sensor])

    reads = np.stack([np.isin(times, clock) for clock in own[:ny]], axis=1)
    y = np.full(reads.shape, np.nan)
    for k, i in np.argwhere(reads).tolist():
        time, off, noise = stamped[k]
        y[k, i] = read(max(time + off[i], begins[0]), i) + noise[i]
    log = Log(times, np.array(inputs).reshape(len(times), -1), y, x=np.array(states))
    return EventCase(model, log, first)

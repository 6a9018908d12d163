"""Runs of a nonlinear model with random disturbances, parameters and noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, expect, finite_array
from svo.functions.tape import Tape
from svo.logs.log import Log
from svo.models.draws import draw
from svo.models.nonlinear.flow import Flow

_PIECES = 4  # of a sample, between which what varies may switch


def simulated(
    flow: Flow,
    reading: Tape,
    noise: Array,
    Ts: float,
    x: Array,
    inputs: Array,
    rng: np.random.Generator,
    corners: bool,
    T: float | None,
    substeps: int,
    given: Array,
) -> Log:
    """See `NonlinearModel.simulate`; ``T`` is None in discrete time, ``given`` (K, nw) NaN where w is drawn."""
    states, outputs = [], []
    flow = replace(flow, varying=flow.varying & np.isnan(given).all(axis=0))
    for u, known in zip(inputs, given, strict=True):
        w = np.where(np.isnan(known), draw(flow.w.lower, flow.w.upper, rng, corners), known)
        states.append(x)
        outputs.append(reading.values(np.concatenate([x, w, u])) + draw(-noise, noise, rng, corners))
        x = advanced(flow, x, w, u, rng, corners, T, substeps)
        _check(flow, x, len(states) - 1)
    time: Array = np.arange(len(inputs), dtype=float) * Ts
    return Log(time=time, u=inputs, y=np.array(outputs), x=np.array(states))


def given_values(flow: Flow, names: Sequence[str], parameters: Mapping[str, ArrayLike], samples: int) -> Array:
    """Values (K, nw) that parameters, the last of w, have at each sample; NaN of what is drawn."""
    given = np.full((samples, len(flow.varying)), np.nan)
    first = len(flow.varying) - len(names)
    for name, values in parameters.items():
        expect(name in names, "parameters", name, f"names of any of {', '.join(names) or 'none'}")
        j, own = first + list(names).index(name), finite_array(f"parameters[{name!r}]", values, (samples,))
        low, high = flow.w.lower[j], flow.w.upper[j]
        if not ((own >= low) & (own <= high)).all():
            ends = f"{own.min()} to {own.max()}"
            raise ValueError(f"parameters[{name!r}] is from {ends}; expected within [{low}, {high}]")
        given[:, j] = own
    return given


def advanced(
    flow: Flow, x: Array, w: Array, u: Array, rng: np.random.Generator, corners: bool, T: float | None, substeps: int
) -> Array:
    """The next state; what varies has w at the sample only, and others within it."""
    if T is None:
        return flow.tape.values(np.concatenate([x, w, u]))
    pieces = _PIECES if flow.varying.any() else 1
    for piece in range(pieces):
        if piece:
            w = np.where(flow.varying, draw(flow.w.lower, flow.w.upper, rng, corners), w)
        after = integrated(flow, x, w, u, T / pieces, substeps)
        x = _within_faces(flow, x, after, w, u, T / pieces / substeps)
    return x


def _within_faces(flow: Flow, x: Array, after: Array, w: Array, u: Array, step: float) -> Array:
    """The state after x, on faces of the physical range which the plant does not cross, but the integrator did.

    It may do so by less than a ``step`` [s].
    """
    if flow.physical is None:
        return after
    on = np.clip(after, flow.physical.lower, flow.physical.upper)
    if np.array_equal(on, after, equal_nan=True):
        return after
    before, there = (flow.tape.values(np.concatenate([at, w, u])) for at in (x, on))
    is_step = (np.abs(on - after) <= step * np.abs(before)) & (there * (on - after) >= 0.0)
    return np.where(is_step, on, after)


def integrated(flow: Flow, x: Array, w: Array, u: Array, T: float, substeps: int) -> Array:
    """x(T) by Runge and Kutta's method of fourth order, for states (..., n) with their own w (..., nw)."""
    block, physical = flow.tape.block(0), flow.physical  # a stage may be a rounding beyond a face
    everywhere: Array = np.full(flow.n, np.inf)
    lower, upper = (-everywhere, everywhere) if physical is None else (physical.lower, physical.upper)
    others, moved = np.broadcast_to(w, (*x.shape[:-1], w.shape[-1])), np.empty(x.shape)
    for at in np.ndindex(x.shape[:-1]):
        moved[at] = block.integrated(x[at], np.concatenate([others[at], u]), lower, upper, T, substeps)
    return moved


def _check(flow: Flow, x: Array, sample: int) -> None:
    inside = np.isfinite(x)
    if flow.physical is not None:
        inside &= (x >= flow.physical.lower) & (x <= flow.physical.upper)
    if not inside.all():
        j = int(np.argmin(inside))
        raise ValueError(
            f"{flow.states[j]} is {x[j]} after sample {sample}, where the equations have no value or outside physical; "
            "expected an x0, inputs and bounds of w that keep the plant there, and more substeps if it is fast"
        )

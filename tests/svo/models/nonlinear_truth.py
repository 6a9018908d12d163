"""What a nonlinear plant truly does: the user's own functions called with arrays of numbers, integrated to a tolerance.

Nothing of a tape is used: functions of `svo.functions` take arrays. Columns are plants (n, P) that run side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Any

import numpy as np

from svo.checks import Array
from svo.models.draws import draw
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import Case

FINEST, SLIDING = 2.0**-12, 2.0**-5  # of a sample, or of a part of it
FEW = 4  # steps that were too short to be halved once more: from there on it slides
TOLERANCE = 1e-4  # of the remainder over a small box
PIECES = 4  # of a sample, between which what varies may switch

Function = Callable[[Array, Array, Array], Array]


def called(function: Any, model: NonlinearModel) -> Function:
    """A function of the model as one of x (n, P), w (nw, P: disturbances, then parameters) and u (nu, P)."""
    given = [p.name for p in signature(function).parameters.values() if p.default is Parameter.empty]
    nd = model.n_disturbances

    def value(x: Array, w: Array, u: Array) -> Array:
        known = {"u": u, "w": w[:nd], "p": w[nd:]}
        with np.errstate(all="ignore"):  # of a piece that does not hold
            rows = function(**{name: known.get(name, x) for name in given})
        rows = list(rows) if isinstance(rows, list | tuple | np.ndarray) else [rows]
        return np.stack([np.broadcast_to(row, x.shape[1:]) for row in rows])

    return value


def advanced(model: NonlinearModel, x: Array, w: Array, u: Array, T: Array, room: Array) -> tuple[Array, Array]:
    """x(T) for plants (n, P) with their own times T (P,), and an estimate of the integrator's error.

    Each plant has its own step, halved until two halves agree with the whole to ``room`` (n, 1), so that a kink or a
    jump is located as finely as `FINEST` of T; where a switch slides, `SLIDING` of T is fine enough.
    """
    f = called(model.f, model)
    if not model.continuous:
        return f(x, w, u), np.zeros_like(x)
    x, error, forced = x.copy(), np.zeros_like(x), np.zeros_like(x)
    done, h, times = np.zeros(len(T)), T / 4.0, np.zeros(len(T), dtype=int)
    left = np.flatnonzero(T > 0.0)
    while len(left):
        at, step = (x[:, left], w[:, left], u[:, left]), np.minimum(h[left], T[left] - done[left])
        half = _rk4(model, f, *at, 0.5 * step)
        end, whole = _rk4(model, f, half, *at[1:], 0.5 * step), _rk4(model, f, *at, step)
        lost = np.abs(end - whole)
        fits = (lost <= room + 1e-14 * np.abs(end)).all(axis=0)
        finest = np.where(times[left] > FEW, SLIDING, FINEST) * T[left]
        taken = fits | (step <= finest)
        here = left[taken]
        x[:, here], done[here] = end[:, taken], done[here] + step[taken]
        error[:, here] += np.where(fits, lost / 15.0, 0.0)[:, taken]
        forced[:, here] = np.maximum(forced[:, here], np.where(fits, 0.0, lost)[:, taken])
        times[here] += ~fits[taken]
        h[left] = np.where(fits & (lost <= 0.03 * room).all(axis=0), 2.0, np.where(taken, 1.0, 0.5)) * step
        h[left] = np.maximum(h[left], np.where(taken, finest, 0.0))
        left = left[done[left] < T[left] * (1.0 - 1e-15)]
    return x, error + 2.0 * forced


def _rk4(model: NonlinearModel, f: Function, x: Array, w: Array, u: Array, h: Array) -> Array:
    """A step of Runge and Kutta's method of fourth order."""
    physical = model.physical_range

    def slope(at: Array) -> Array:
        if physical is not None:  # a stage may be a rounding beyond a face
            at = np.clip(at, physical.lower[:, None], physical.upper[:, None])
        return f(at, w, u)

    k1 = slope(x)
    k2 = slope(x + 0.5 * h * k1)
    k3 = slope(x + 0.5 * h * k2)
    return x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(x + h * k3))


def within_sample(
    model: NonlinearModel, x: Array, w: Array, u: Array, T: Array, rng: np.random.Generator, room: Array, moves: Array
) -> tuple[Array, Array]:
    """`advanced`, in which what varies switches at random times between its bounds, of plants that ``moves``."""
    varying = model.flow.varying
    if not (varying.any() and model.continuous):
        return advanced(model, x, w, u, T, room)
    cuts = np.sort(rng.uniform(0.0, 1.0, (PIECES - 1, len(T))), axis=0)
    parts, total = np.diff(cuts, axis=0, prepend=0.0, append=1.0), np.zeros_like(x)
    for piece, part in enumerate(parts):
        if piece:
            w = np.where(varying[:, None] & moves, _drawn(model, len(T), rng, True), w)
        x, error = advanced(model, x, w, u, T * part, room)
        total += error
    return x, total


def _drawn(model: NonlinearModel, count: int, rng: np.random.Generator, corners: bool) -> Array:
    lower, upper = (np.repeat(end[:, None], count, axis=1) for end in model.flow.w)
    return draw(lower, upper, rng, corners)


@dataclass(frozen=True)
class Runs:
    """P runs of K samples side by side.

    Attributes
    ----------
    x, u, w, y : (K, n, P), (K, nu, P), (K, nw, P), (K, ny, P) arrays
    dt : (K, P) array
        From a sample to the next one.
    error : (K, n, P) array
        Estimates of the integrator's error from a sample to the next one.
    """

    x: Array
    u: Array
    w: Array
    y: Array
    dt: Array
    error: Array


def tolerance(case: Case) -> Array:
    """What a step of the integrator may be off (n, 1): a part of R over a thousandth of the first box, or rounding."""
    lower, upper = case.x0 - 1e-3 * case.spread, case.x0 + 1e-3 * case.spread
    if case.model.physical_range is not None:
        lower, upper, _ = case.model.physical_range.cut(lower, upper)
    R = case.model.transition(lower, upper, np.array(case.u(0), dtype=float)).R
    return np.maximum(TOLERANCE * R, 0.1 * rounding(case))[:, None]


def rounding(case: Case) -> Array:
    """What a truth in floats cannot tell (n,): of the size of states in operation."""
    return np.asarray(1e-12 * (np.abs(case.x0) + 20.0 * case.spread))


def simulated(case: Case, samples: int, rng: np.random.Generator, modes: list[str], jitter: float = 0.0) -> Runs:
    """One run a mode, of "corners", "inside" and "constant" w and noise, each from its own first state and clock.

    The time between two samples is Ts times a number within ``jitter`` of one.
    """
    model, count = case.model, len(modes)
    n, nu, shapes = model.n_states, model.n_inputs, (len(model.flow.varying), model.n_outputs)
    inside, still = (np.array([mode == name for mode in modes]) for name in ("inside", "constant"))
    x = case.x0[:, None] + case.spread[:, None] * rng.uniform(-1.0, 1.0, (n, count))
    if model.physical_range is not None:
        x = np.clip(x, model.physical_range.lower[:, None], model.physical_range.upper[:, None])
    shift = rng.integers(0, 1000, count)
    inputs = np.array([[case.u(k + int(s)) for s in shift] for k in range(samples)], dtype=float)
    inputs = np.ascontiguousarray(np.moveaxis(inputs.reshape(samples, count, nu), 1, 2))
    room, h, bound = tolerance(case), called(model.h, model), np.repeat(model.noise[:, None], count, axis=1)
    dt = model.Ts * (1.0 + jitter * rng.uniform(-1.0, 1.0, (samples, count)))
    made = Runs(*(np.zeros((samples, size, count)) for size in (n, nu, *shapes)), dt, np.zeros((samples, n, count)))
    w = _drawn(model, count, rng, True)
    for k in range(samples):
        if k:
            w = np.where(still, w, np.where(inside, _drawn(model, count, rng, False), _drawn(model, count, rng, True)))
        made.x[k], made.w[k], made.u[k] = x, w, inputs[k]
        noise = np.where(inside, draw(-bound, bound, rng, False), draw(-bound, bound, rng, True))
        made.y[k] = h(x, w, inputs[k]) + noise
        if case.control is not None:
            made.u[k] += case.control(made.y[k])
        x, made.error[k] = within_sample(model, x, w, made.u[k], dt[k], rng, room, ~still)
    return made

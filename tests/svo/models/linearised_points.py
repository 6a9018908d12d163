"""Linearisations against points: the forms of f over an enclosure, and transitions and outputs over a box.

f is called with numbers of 64 bits of mantissa, so that its rounding is far below what is looked for.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from svo.checks import Array
from svo.models.nonlinear import Span, Undecided
from svo.models.nonlinear.flow import joint
from tests.svo.models.nonlinear_plants import Case
from tests.svo.models.nonlinear_truth import TOLERANCE, advanced, called

INTEGRATED = 200  # of the points
ROUNDING = 2.0**-60  # of the terms' sizes


def points(lower: Array, upper: Array, count: int, rng: np.random.Generator) -> Array:
    """Corners, points of edges and faces, and inner points of a box, (n, count)."""
    low, high = lower[:, None], upper[:, None]
    at_end = rng.random((len(lower), count)) < rng.choice([1.0, 0.7, 0.3, 0.0], count)
    end = np.where(rng.random((len(lower), count)) < 0.5, low, high)
    return np.where(at_end, end, np.clip(low + rng.random((len(lower), count)) * (high - low), low, high))


def examine_linearisation(case: Case, rng: np.random.Generator, count: int) -> Counter[str]:
    """A random box about a random state of the plant: what is outside of the forms, of A x + a + E w +- R, of h's."""
    model, found = case.model, Counter[str]()
    u = np.array(case.u(int(rng.integers(1000))), dtype=float)
    lower, upper = _box(case, u, rng)
    T = model.Ts * (rng.uniform(0.1, 1.9) if model.continuous else 1.0)
    try:
        move = model.transition(lower, upper, u, **({"dt": T} if model.continuous else {}))
        output = model.output(lower, upper, u)
    except Undecided:
        return Counter({"undecided": 1})
    found["linearisations"] = 1
    x, w = points(lower, upper, count, rng), points(*model.flow.w, count, rng)
    found += _outside_forms(case, move.within, w, u, count, rng)
    inputs = np.repeat(u[:, None], count, axis=1)
    value = called(model.h, model)(*(v.astype(np.longdouble) for v in (x, w, inputs)))
    found["outside the output"] = _outside(value, output.C, output.c, output.F, output.R, x, w)
    few = slice(0, INTEGRATED)
    room = np.maximum(TOLERANCE * move.R, 1e-14 * (np.abs(lower) + np.abs(upper)))[:, None]
    end, error = advanced(model, x[:, few], w[:, few], inputs[:, few], np.full(len(x[0, few]), T), room)
    held = ~model.flow.varying | (not model.continuous)
    if model.continuous:
        part = T * rng.random(len(x[0, few]))
        way, off = advanced(model, x[:, few], w[:, few], inputs[:, few], part, room)
        low, high = (end[:, None] for end in move.within)
        found["outside the enclosure"] = int(((way < low - 2.0 * off) | (way > high + 2.0 * off)).sum())
    found["outside the transition"] = _outside(end, move.A, move.a, move.E * held, move.R, x[:, few], w[:, few], error)
    return found


def _box(case: Case, u: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """About a state that the plant is at after some time; at times with ends at zero, where kinks and roots are."""
    model = case.model
    x = (case.x0 + case.spread * rng.uniform(-1.0, 1.0, len(case.x0)))[:, None]
    w = rng.uniform(*model.flow.w)[:, None]
    T = np.array([model.Ts * rng.integers(0, 30) if model.continuous else 0.0])
    x = advanced(model, x, w, u[:, None], T, 1e-3 * case.spread[:, None])[0][:, 0] if T[0] else x[:, 0]
    spread = case.spread * 10.0 ** rng.uniform(-3.0, 0.5)
    lower, upper = x - spread * rng.random(len(x)), x + spread * rng.random(len(x))
    near = (rng.random(len(x)) < 0.3) & (np.abs(x) < 3.0 * case.spread)
    lower, upper = np.where(near & (x > 0.0), 0.0, lower), np.where(near & (x <= 0.0), 0.0, upper)
    if model.physical_range is not None:
        lower, upper, _ = model.physical_range.cut(lower, upper)
    return lower, np.maximum(lower, upper)


def _outside_forms(
    case: Case, enclosed: Span, w: Array, u: Array, count: int, rng: np.random.Generator
) -> Counter[str]:
    """Points of an enclosure at which f is not in its linear forms, or not in their ranges."""
    model = case.model
    forms = model.flow.tape.forms(*joint(enclosed, model.flow.w, u), free=len(enclosed.lower) + len(w))
    z = points(enclosed.lower, enclosed.upper, count, rng)
    zw = np.concatenate([z, w]).astype(np.longdouble)
    f = called(model.f, model)(zw[: len(z)], zw[len(z) :], np.repeat(u[:, None], count, axis=1).astype(np.longdouble))
    terms = forms.g[:, :, None] * (zw - forms.centre[:, None])[None]
    rest = f - forms.k[:, None] - terms.sum(axis=1)
    room = ROUNDING * (np.abs(f) + np.abs(forms.k)[:, None] + np.abs(terms).sum(axis=1))
    out = (rest < forms.low[:, None] - room) | (rest > forms.high[:, None] + room)
    beyond = (f < forms.lower[:, None] - room) | (f > forms.upper[:, None] + room)
    return Counter({"points": count, "outside the form": int(out.sum()), "outside its range": int(beyond.sum())})


def _outside(
    value: Array, A: Array, a: Array, E: Array, R: Array, x: Array, w: Array, error: Array | float = 0.0
) -> int:
    rest = np.abs(value - A @ x - a[:, None] - E @ w)
    size = np.abs(A) @ np.abs(x) + np.abs(a)[:, None] + np.abs(E) @ np.abs(w) + np.abs(value)
    return int((rest > R[:, None] + 1e-14 * size + 2.0 * error).sum())


OUTSIDE = (
    "outside the enclosure",
    "outside the form",
    "outside its range",
    "outside the output",
    "outside the transition",
)

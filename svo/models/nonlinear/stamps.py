"""Readings whose time stamps are off: an output over all that a nonlinear plant passes through about the stamp."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from svo.checks import Array
from svo.functions.tape import Forms, Tape, Unenclosed
from svo.models.nonlinear.flow import Flow, Span, Undecided
from svo.models.nonlinear.output import LinearOutput
from svo.models.state_range import within

Cut = Callable[[Span, Array, LinearOutput], Span | None]

_EPS = float(np.finfo(np.float64).eps)
_TRIALS = 15  # of ever larger boxes
_ROUNDED_UP = 1e-9


def stamped(
    flow: Flow, reading: Tape, output: LinearOutput, jitter: Array, x: Span, u: Span, names: tuple[str, ...]
) -> LinearOutput:
    """An output for all states of a box, with the rows of the sensors that are read within ``jitter`` (ny,) of then.

    With h(z) in k + g (z - c) + r over all z = (x, w, p) of that time, h(t) is as far from g x as g_w w, r and
    J |g_x f| say, f being dx/dt there. u are bounds of the inputs of that time.

    Raises
    ------
    Undecided
        If that is not enclosed.
    """
    C, c, F, R = (part.copy() for part in output)
    for J in np.unique(jitter[jitter > 0.0]).tolist():
        own = jitter == J
        box = _around(flow, x, u, J)
        flow.check_valid(box)
        found = _output(flow, _forms(reading, flow, box, u, names), box)
        C[own], c[own], F[own] = found.C[own], found.c[own], found.F[own]
        R[own] = (found.R + _moved(flow, found.C, box, u, J))[own] * (1.0 + 4.0 * _EPS)
    return LinearOutput(C, c, F, R)


def seen_near(
    flow: Flow, reading: Tape, cut: Cut, jitter: Array, x: Span, y: Array, u: Span, names: tuple[str, ...]
) -> Span:
    """What readings y (ny,), NaN where there is none, leave of a box of states, each taken within its ``jitter``.

    A reading bounds the state of its own time, and from there the state moves for no longer than the jitter: where a
    box is wide and its states fast, that says more than what moves within the jitter from all of the box.

    Parameters
    ----------
    cut : callable
        Of a box, readings and an output that holds in it: what they leave of it, None where they leave nothing.
    x : Span
    u : Span
        Bounds of the inputs of that time.
    """
    for i in np.flatnonzero((jitter > 0.0) & ~np.isnan(y)).tolist():
        alone = np.where(np.arange(len(y)) == i, y, np.nan)
        try:
            there = _when_read(flow, x, u, float(jitter[i]))
            left = cut(there, alone, _output(flow, _forms(reading, flow, there, u, names), there))
            if left is None:
                continue  # a program decides
            near = _around(flow, left, u, float(jitter[i]))
            flow.check_valid(near)
        except Undecided:
            continue
        lower, upper = np.maximum(x.lower, near.lower), np.minimum(x.upper, near.upper)
        if (lower <= upper).all():
            x = Span(lower, upper)
    return x


def _when_read(flow: Flow, x: Span, u: Span, J: float) -> Span:
    """A box that holds the state while a reading may be taken; Undecided where nothing bounds it."""
    try:
        box = _around(flow, x, u, J)
        flow.check_valid(box)
    except Undecided:
        if flow.physical is None:
            raise
        return Span(flow.physical.lower, flow.physical.upper)
    return box


def _output(flow: Flow, forms: Forms, box: Span) -> LinearOutput:
    """Of the states of a box, whatever w is."""
    n, w = flow.n, flow.w
    C, W, centre = forms.g[:, :n], forms.g[:, n:], forms.centre
    R = 0.5 * (forms.high - forms.low) + np.abs(W) @ (0.5 * w.width)
    size = np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high)
    size += 2.0 * (np.abs(C) @ box.largest + np.abs(W) @ w.largest)
    c = forms.k + 0.5 * (forms.low + forms.high) - C @ centre[:n]
    return LinearOutput(C, c, np.zeros_like(W), R * (1.0 + _ROUNDED_UP) + (len(centre) + 8) * _EPS * size)


def _moved(flow: Flow, C: Array, box: Span, u: Span, J: float) -> Array:
    """Bounds of how far C x moves within J while x is in a box."""
    rate = _forms(flow.tape, flow, box, u, flow.states)
    half = np.concatenate([0.5 * box.width, 0.5 * flow.w.width])
    middle = np.abs(C @ (rate.k + 0.5 * (rate.low + rate.high)))
    slope = middle + np.abs(C @ rate.g) @ half + np.abs(C) @ (0.5 * (rate.high - rate.low))
    speed = np.maximum(np.abs(rate.lower), np.abs(rate.upper))
    moved = J * np.minimum(slope, np.abs(C) @ speed) + 1e-14 * J * (np.abs(C) @ (np.abs(rate.k) + speed))
    return np.asarray(moved * (1.0 + _ROUNDED_UP))


def _around(flow: Flow, x: Span, u: Span, J: float) -> Span:
    """A box that holds x(t) for |t - s| <= J if x(s) is in ``x``; forward and back the same, as `Flow` says."""
    box, inside = x, np.zeros(flow.n, dtype=bool)
    for trial in range(_TRIALS):
        image = _image(flow, x, box, u, J)
        room = (0.02 + 0.1 * trial) * (image.width - x.width) + 1e-9 * image.width + 1e-14 * image.largest + 1e-200
        grown = np.minimum(box.lower, image.lower - room), np.maximum(box.upper, image.upper + room)
        box = Span(*within(flow.physical, *grown))
        image = _image(flow, x, box, u, J)
        low, high = image.lower > box.lower, image.upper < box.upper
        if flow.physical is not None:
            low, high = low | (box.lower <= flow.physical.lower), high | (box.upper >= flow.physical.upper)
        inside = low & high
        if inside.all():
            return Span(np.maximum(box.lower, image.lower), np.minimum(box.upper, image.upper))
    state = flow.states[int(np.argmin(inside))]
    raise Undecided(f"no box was found that the state keeps to within {J:.3g} s of a reading, {state} leaves all")


def _image(flow: Flow, x: Span, box: Span, u: Span, J: float) -> Span:
    try:
        lower, upper = flow.tape.ranges(*_joint(flow, box, u))
    except Unenclosed as error:
        raise Undecided(f"the equation of {flow.states[error.row]} is not enclosed, {error}") from None
    way = J * np.maximum(np.abs(lower), np.abs(upper))
    way = way + 4.0 * _EPS * (x.largest + way) + 1e-300
    return Span(x.lower - way, x.upper + way)


def _forms(tape: Tape, flow: Flow, box: Span, u: Span, names: tuple[str, ...]) -> Forms:
    try:
        return tape.forms(*_joint(flow, box, u), free=flow.n + len(flow.varying))
    except Unenclosed as error:
        raise Undecided(f"the row of {names[error.row]} is not enclosed, {error}") from None


def _joint(flow: Flow, box: Span, u: Span) -> tuple[Array, Array]:
    return np.concatenate([box.lower, flow.w.lower, u.lower]), np.concatenate([box.upper, flow.w.upper, u.upper])

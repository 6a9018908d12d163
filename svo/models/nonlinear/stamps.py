"""Readings whose time stamps are off: an output over all that a nonlinear plant passes through about the stamp."""

from __future__ import annotations

import numpy as np

from svo.checks import Array
from svo.functions.tape import Forms, Tape, Unenclosed
from svo.models.nonlinear.flow import Flow, Span, Undecided
from svo.models.nonlinear.output import LinearOutput
from svo.models.state_range import within

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
        rate, forms = _forms(flow.tape, flow, box, u, flow.states), _forms(reading, flow, box, u, names)
        found = _output(flow, rate, forms, box, J)
        C[own], c[own], F[own], R[own] = found.C[own], found.c[own], found.F[own], found.R[own]
    return LinearOutput(C, c, F, R)


def _output(flow: Flow, rate: Forms, forms: Forms, box: Span, J: float) -> LinearOutput:
    n, w = flow.n, flow.w
    C, W, centre = forms.g[:, :n], forms.g[:, n:], forms.centre
    half = np.concatenate([0.5 * box.width, 0.5 * w.width])
    middle = np.abs(C @ (rate.k + 0.5 * (rate.low + rate.high)))
    slope = middle + np.abs(C @ rate.g) @ half + np.abs(C) @ (0.5 * (rate.high - rate.low))
    speed = np.maximum(np.abs(rate.lower), np.abs(rate.upper))
    moved = J * np.minimum(slope, np.abs(C) @ speed) + 1e-14 * J * (np.abs(C) @ (np.abs(rate.k) + speed))
    R = 0.5 * (forms.high - forms.low) + np.abs(W) @ (0.5 * w.width) + moved
    size = np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high)
    size += 2.0 * (np.abs(C) @ box.largest + np.abs(W) @ w.largest)
    c = forms.k + 0.5 * (forms.low + forms.high) - C @ centre[:n]
    return LinearOutput(C, c, np.zeros_like(W), R * (1.0 + _ROUNDED_UP) + (len(centre) + 8) * _EPS * size)


def _around(flow: Flow, x: Span, u: Span, J: float) -> Span:
    """A box that holds x(t) for |t - s| <= J if x(s) is in ``x``; forward and back the same, as `Flow` says."""
    box = x
    for trial in range(_TRIALS):
        image = _image(flow, x, box, u, J)
        room = (0.02 + 0.1 * trial) * (image.width - x.width) + 1e-9 * image.width + 1e-14 * image.largest + 1e-200
        grown = np.minimum(box.lower, image.lower - room), np.maximum(box.upper, image.upper + room)
        box = Span(*within(flow.physical, *grown))
        image = _image(flow, x, box, u, J)
        low, high = image.lower > box.lower, image.upper < box.upper
        if flow.physical is not None:
            low, high = low | (box.lower <= flow.physical.lower), high | (box.upper >= flow.physical.upper)
        if (low & high).all():
            return Span(np.maximum(box.lower, image.lower), np.minimum(box.upper, image.upper))
    raise Undecided(f"no box was found that the state keeps to within {J:.3g} s of a reading")


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

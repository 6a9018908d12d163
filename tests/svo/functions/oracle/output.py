"""A measurement over a box of states: h(x, u, w, p) in C x + c + F (w, p) + [-R, R]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.models.nonlinear.flow import Span, Undecided
from svo.models.nonlinear.output import LinearOutput
from tests.svo.functions.oracle.evaluation import Evaluation, Unenclosed

_EPS = float(np.finfo(np.float64).eps)


def linear_output(
    tape: Evaluation, w: Span, shared: NDArray[np.bool_], x: Span, u: Array, names: Sequence[str]
) -> LinearOutput:
    """Of the tape of h; the ``shared`` (nw,) of w are those that the state's equation has too."""
    n = len(x.lower)
    try:
        forms = tape.forms(*_joint(x, w, u), free=n + len(w.lower))
    except Unenclosed as error:
        raise _undecided(error, names) from None
    C, every, centre = forms.g[:, :n], forms.g[:, n:], forms.centre
    F = every * shared
    size = np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high)
    size += 2.0 * (np.abs(C) @ x.largest + np.abs(every) @ w.largest)
    R = 0.5 * (forms.high - forms.low) + np.abs(every - F) @ (0.5 * w.width)
    R = R + (n + len(w.lower) + 8) * _EPS * size
    return LinearOutput(C, forms.k + 0.5 * (forms.low + forms.high) - C @ centre[:n] - F @ centre[n:], F, R)


def _joint(x: Span, w: Span, u: Array) -> tuple[Array, Array]:
    return np.concatenate([x.lower, w.lower, u]), np.concatenate([x.upper, w.upper, u])


def _undecided(error: Unenclosed, names: Sequence[str]) -> Undecided:
    return Undecided(f"the output {names[error.row]} is not enclosed, {error}")


def cut(box: Span, y: Array, reading: LinearOutput, w: Span, noise: Array) -> Span | None:
    """A box cut by what was measured, row by row; None where nothing is left, which a program has to decide."""
    lower, upper = box.lower.copy(), box.upper.copy()
    C, F = reading.C, reading.F
    c = reading.c + F @ (0.5 * w.lower + 0.5 * w.upper)
    width = noise + reading.R + np.abs(F) @ (0.5 * w.width)
    size = np.abs(C) @ box.largest + np.abs(reading.c) + np.abs(F) @ w.largest + width
    for i in np.flatnonzero(~np.isnan(y)).tolist():
        room = width[i] + 4.0 * (len(lower) + len(w.lower) + 4) * _EPS * (size[i] + abs(y[i]))
        for j in np.flatnonzero(C[i]).tolist():
            low, high = np.minimum(C[i] * lower, C[i] * upper), np.maximum(C[i] * lower, C[i] * upper)
            least, most = y[i] - c[i] - room - (high.sum() - high[j]), y[i] - c[i] + room - (low.sum() - low[j])
            ends = sorted((least / C[i, j], most / C[i, j]))
            lower[j] = max(lower[j], ends[0] - 4.0 * _EPS * abs(ends[0]))
            upper[j] = min(upper[j], ends[1] + 4.0 * _EPS * abs(ends[1]))
            if lower[j] > upper[j]:
                return None
    return Span(lower, upper)

"""A measurement over a box of states: h(x, u, w, p) in C x + c + F (w, p) + [-R, R]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from svo.checks import Array
from svo.functions.tape import Tape, Unenclosed
from svo.models.nonlinear.flow import Span, Undecided, joint


class LinearOutput(NamedTuple):
    """h in C x + c + F w + [-R, R] for all states of a box: (ny, n), (ny,), (ny, nw), (ny,) arrays.

    w are disturbances and parameters; F is zero for those that vary inside a sample, whose value is in R.
    """

    C: Array
    c: Array
    F: Array
    R: Array


def check_output(tape: Tape, w: Span, x: Span, u: Array, names: Sequence[str]) -> None:
    """Raise Undecided if h is not bounded over a box of states, whatever the inputs are that are NaN."""
    try:
        tape.ranges(*joint(x, w, u))
    except Unenclosed as error:
        raise Undecided(f"the output {names[error.row]} is not enclosed, {error}") from None

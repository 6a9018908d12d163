"""A transition: what a plant does from one sample to the next, as a linear model with a proven remainder."""

from __future__ import annotations

from typing import NamedTuple

from polytopes.shown import brief, in_a_line
from svo.checks import Array
from svo.models.nonlinear.flow import Span


class Transition(NamedTuple):
    """x+ in A x + a + E w + [-R, R] for all x of a box and all w of the model's bounds.

    Attributes
    ----------
    A, a, E, R : (n, n), (n,), (n, nw), (n,) arrays
    box, within : Span
        Bounds of x+, and of the state on its way from x to x+.
    substeps : int
    """

    A: Array
    a: Array
    E: Array
    R: Array
    box: Span
    within: Span
    substeps: int

    def __repr__(self) -> str:
        return in_a_line(f"Transition({', '.join(f'{name}={brief(value)}' for name, value in self._asdict().items())})")

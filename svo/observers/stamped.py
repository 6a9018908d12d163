"""A linear model whose sensors have stamps that may be off: what each sample's rows are widened by.

The widening rests on where the state is before the sample is read: the observer's bounds at the sample before, moved on
by the transition. Everything here is in the user's units, unless it says otherwise.
"""

from __future__ import annotations

import numpy as np

from svo.checks import Array
from svo.models import NormalForm, UncertainModel
from svo.models.intervals import transition_rows
from svo.models.nonlinear import Span
from svo.models.stamps import StampErrors

_ROUNDED_UP = 8.0 * float(np.finfo(float).eps)


class Stamped:
    """What an observer asks about the stamps of a linear model.

    Parameters
    ----------
    model : UncertainModel
        By `UncertainModel.from_continuous`, with ``jitter``.
    errors : StampErrors

    Attributes
    ----------
    box : Span or None
        Known of the newest state before its sample is read; None where nothing is.
    """

    def __init__(self, model: UncertainModel, errors: StampErrors) -> None:
        self.model, self.errors = model, errors
        self.box: Span | None = None

    def start_from(self, lower: Array, upper: Array) -> None:
        """Bounds of the first state."""
        self.box = Span(lower, upper)

    def moved(self, known: Span, u: Array, dt: float | None) -> None:
        """The next state, from what the window knows of the present one; a transition of ``dt`` seconds, None = Ts."""
        rows = transition_rows(self.model, dt)
        self.box = (
            Span(*self.errors.after(self.model, rows, (known.lower, known.upper), u)) if _is_bounded(known) else None
        )

    def measured(self, y: Array, around: tuple[Array, Array], u: Array) -> tuple[Array, Array]:
        """The readings, and what is added to the noise of each output, (ny,) each.

        A sensor has no reading where nothing bounds what its stamp makes of it. ``around`` are bounds of the inputs
        about the sample, from which on they are u.
        """
        physical = self.model.physical_range
        box = self.box if self.box is not None or physical is None else Span(physical.lower, physical.upper)
        if box is None or not _is_bounded(box):
            return np.where(self.errors.is_off, np.nan, y), np.zeros(len(y))
        return y, self.errors.widening((box.lower, box.upper), around, u)

    def applied(
        self, form: NormalForm, stack: Array, noise: Array, y: Array, around: tuple[Array, Array], u: Array
    ) -> tuple[Array, Array, Array]:
        """Stack and noise of a sample, both in normal form, and its readings, as `measured` makes them."""
        y, widening = self.measured(y, around, u)
        stack = self.errors.applied(stack, self.errors.shift / form.y)
        return stack, (noise + widening / form.y) * (1.0 + _ROUNDED_UP), y


def _is_bounded(box: Span) -> bool:
    return bool(np.isfinite(box.lower).all() and np.isfinite(box.upper).all())

"""An a-priori enclosure: a box that x(t) does not leave within a step, and linear forms of dx/dt over it."""

from __future__ import annotations

import numpy as np

from svo.checks import Array
from svo.functions.tape import Forms
from svo.models.nonlinear.flow import Flow as Described
from svo.models.nonlinear.flow import Span, Undecided
from svo.models.state_range import within
from tests.svo.functions.oracle.evaluation import Evaluation, Unenclosed

_EPS = float(np.finfo(np.float64).eps)
_TINY = 2.0**-1022
_TRIALS = 15  # of ever larger boxes
_PASSES = 6  # of narrowing, most of the time one
_WORTHWHILE = 0.95  # of a width that another pass has left


class Flow:
    """dx/dt = f(x, w, u), or x+ = f(x, w, u), as a model describes it."""

    def __init__(self, of: Described) -> None:
        self.w, self.varying, self.states, self.physical, self.valid = (
            of.w,
            of.varying,
            of.states,
            of.physical,
            of.valid,
        )
        self.n, self.tape = of.n, Evaluation(of.tape)

    def ranges(self, x: Span, u: Array) -> Span:
        """Bounds of f over a box of states."""
        try:
            return Span(*self.tape.ranges(*self._joint(x, u)))
        except Unenclosed as error:
            raise self._undecided(error) from None

    def forms(self, x: Span, u: Array) -> Forms:
        """Linear forms of f in (x, w) over a box of states."""
        try:
            return self.tape.forms(*self._joint(x, u), free=self.n + len(self.varying))
        except Unenclosed as error:
            raise self._undecided(error) from None

    def inside(self, x: Span) -> Span:
        """A box of states cut by what is physical."""
        return Span(*within(self.physical, x.lower, x.upper))

    def check_valid(self, x: Span) -> None:
        """Raise Undecided if a box of states reaches beyond where the equations hold."""
        if self.valid is None:
            return
        beyond = (x.lower < self.valid.lower) | (x.upper > self.valid.upper)
        if beyond.any():
            j = int(np.argmax(beyond))
            raise Undecided(
                f"{self.states[j]} may be in [{x.lower[j]:.6g}, {x.upper[j]:.6g}], outside valid = "
                f"[{self.valid.lower[j]:.6g}, {self.valid.upper[j]:.6g}]",
                coordinate=j,
            )

    def _joint(self, x: Span, u: Array) -> tuple[Array, Array]:
        return np.concatenate([x.lower, self.w.lower, u]), np.concatenate([x.upper, self.w.upper, u])

    def _undecided(self, error: Unenclosed) -> Undecided:
        return Undecided(f"the equation of {self.states[error.row]} is not enclosed, {error}")

    # -- within a step -----------------------------------------------------------------------------

    def enclosure(self, start: Span, u: Array, h: float) -> tuple[Span, Forms]:
        """A box that holds x(t) for all t in [0, h] if x(0) is in ``start``, and the forms of f over it.

        A trajectory that keeps to the physical range leaves a box through a face of that range or not at all, if the
        box contains start + [0, h] f(box) in its interior elsewhere: on its first way out it would still have the
        derivatives of the box. Neither a Lipschitz constant nor uniqueness is needed. A coordinate that pulls itself
        back is then enclosed by what its derivative is at its own ends (`_at_faces`).

        Raises
        ------
        Undecided
            If none is found, or f is not bounded over it.
        """
        box = self._strict(start, u, h)
        forms = self.forms(box, u)
        for _ in range(_PASSES):
            image = _image(start, _at_faces(start, forms), h)
            narrower = Span(np.maximum(box.lower, image.lower), np.minimum(box.upper, image.upper))
            helps = bool((narrower.width < _WORTHWHILE * box.width).any())
            box, forms = narrower, self.forms(narrower, u)
            if not helps:
                break
        return box, forms

    def _strict(self, start: Span, u: Array, h: float) -> Span:
        box = _image(start, self.ranges(start, u), h)
        for trial in range(_TRIALS):
            growth = box.width - start.width
            room = (0.02 + 0.1 * trial) * growth + 1e-9 * box.width + 1e-14 * box.largest + 1e-200
            box = self.inside(Span(box.lower - room, box.upper + room))
            image = _image(start, self.ranges(box, u), h)
            inside = self._is_inside(image, box)
            if inside.all():
                return Span(np.maximum(box.lower, image.lower), np.minimum(box.upper, image.upper))
            box = Span(np.minimum(box.lower, image.lower), np.maximum(box.upper, image.upper))
        state = self.states[int(np.argmin(inside))]
        raise Undecided(f"no box was found that the state keeps to within {h:.3g} s, {state} leaves all")

    def _is_inside(self, image: Span, box: Span) -> np.ndarray:
        low, high = image.lower > box.lower, image.upper < box.upper
        if self.physical is not None:
            low, high = low | (box.lower <= self.physical.lower), high | (box.upper >= self.physical.upper)
        return low & high


def _at_faces(start: Span, forms: Forms) -> Span:
    """What f adds at most to how far each coordinate is from ``start``, in place of bounds over the whole box.

    Where f_i falls with x_i, v = x_i - upper_i has v' <= g_ii v + F, F being the form's bound at x_i = upper_i, and
    v <= 0 at first: so v(t) <= t max(F, 0), whatever f_i is at a smaller x_i.
    """
    at, own = rates_at_faces(start, forms), np.diagonal(forms.g)
    return Span(
        np.where(own <= 0.0, np.maximum(at.lower, forms.lower), forms.lower),
        np.where(own <= 0.0, np.minimum(at.upper, forms.upper), forms.upper),
    )


def rates_at_faces(start: Span, forms: Forms) -> Span:
    """Bounds of each f_i where x_i is at the ends of ``start``."""
    n, size = len(start.lower), np.abs(forms.g) @ forms.reach
    own, middle = np.diagonal(forms.g), forms.centre[:n]
    others = size - np.abs(own) * forms.reach[:n]
    lost = (forms.g.shape[1] + 8) * _EPS * (size + np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high))
    upper = forms.k + own * (start.upper - middle) + others + forms.high + lost
    lower = forms.k + own * (start.lower - middle) - others + forms.low - lost
    return Span(lower, upper)


def _image(start: Span, f: Span, h: float) -> Span:
    """start + [0, h] f, rounded outward."""
    down, up = np.minimum(0.0, h * f.lower), np.maximum(0.0, h * f.upper)
    return Span(
        start.lower + down - 2.0 * _EPS * (np.abs(start.lower) - down) - _TINY,
        start.upper + up + 2.0 * _EPS * (np.abs(start.upper) + up) + _TINY,
    )

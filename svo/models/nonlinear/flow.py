"""What moves a plant: its equation as a tape, and bounds of what it depends on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.functions.tape import Tape, Unenclosed
from svo.models.state_range import StateRange


class Undecided(ArithmeticError):
    """A transition that is not enclosed; the argument says why.

    Attributes
    ----------
    coordinate : int or None
        State that may leave the range where the equations hold.
    """

    def __init__(self, why: str, coordinate: int | None = None) -> None:
        super().__init__(why)
        self.coordinate = coordinate


class Span(NamedTuple):
    """A box of vectors: their bounds."""

    lower: Array
    upper: Array

    @property
    def width(self) -> Array:
        return self.upper - self.lower

    @property
    def largest(self) -> Array:
        """Largest absolute values."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))


@dataclass(frozen=True, eq=False)
class Flow:
    """dx/dt = f(x, w, u), or x+ = f(x, w, u), with w (disturbances and parameters) in a box.

    Attributes
    ----------
    tape : Tape
        f of (x, w, u).
    w : Span
    varying : (nw,) bool array
        Which may change inside a sample.
    states : sequence of str
        Names, for messages.
    physical, valid : StateRange or None
    """

    tape: Tape
    w: Span
    varying: NDArray[np.bool_]
    states: tuple[str, ...]
    physical: StateRange | None = None
    valid: StateRange | None = None

    @property
    def n(self) -> int:
        return len(self.states)

    def check(self, x: Span, u: Array) -> None:
        """Refuse first states of a box where the equations do not hold or have no value, whatever u is where it is NaN.

        Raises
        ------
        Undecided
            Naming the state.
        """
        self.check_valid(x)
        try:
            self.tape.ranges(*joint(x, self.w, u))
        except Unenclosed as error:
            raise Undecided(f"the equation of {self.states[error.row]} is not enclosed, {error}") from None

    def check_valid(self, x: Span) -> None:
        """Raise Undecided if a box of states reaches beyond where the equations hold."""
        if self.valid is not None:
            beyond = (x.lower < self.valid.lower) | (x.upper > self.valid.upper)
            if beyond.any():
                j = int(np.argmax(beyond))
                raise self.outside_valid(j, x.lower[j], x.upper[j])

    def outside_valid(self, j: int, lower: float, upper: float) -> Undecided:
        """That state j may be between these bounds."""
        assert self.valid is not None
        least, most = self.valid.lower[j], self.valid.upper[j]
        seen = float(f"{lower:.6g}") < least or float(f"{upper:.6g}") > most
        digits = 6 if seen else 17  # so that the message shows what it says
        where, inside = (f"[{a:.{digits}g}, {b:.{digits}g}]" for a, b in ((lower, upper), (least, most)))
        return Undecided(f"{self.states[j]} may be in {where}, outside valid = {inside}", coordinate=j)


def joint(x: Span, w: Span, u: Array) -> tuple[Array, Array]:
    """Bounds of z = (x, w, u)."""
    return np.concatenate([x.lower, w.lower, u]), np.concatenate([x.upper, w.upper, u])

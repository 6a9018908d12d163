"""What a window is given of one sample, in normal form, and what it may say of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from svo.checks import Array
from svo.observers import window_kernel as kernel
from svo.observers.free_start import Reading

_ENTRY_ERRORS = {
    kernel.BAD_MATRIX: "the model's matrices at this schedule contain NaN or Inf; expected finite numbers",
    kernel.RANK_ROSE: "an uncertainty has a higher rank at this sample than at the model's typical schedule",
}


class Outgrown(Exception):
    """The newest state has no bounds of use: the window is of no more use either."""


class Sample(NamedTuple):
    """What a window is given of one sample.

    Attributes
    ----------
    u, u_next : (nu,) arrays
        What drives the transition to the sample, and its own input; zeros where that is not needed.
    y : (ny,) array
        NaN = that sensor is missing.
    stack, noise, w_lower, w_upper : arrays
        Matrices and bounds, as of the model.
    given : (ny,) array
        The measurement in the user's units, as it was given.
    """

    u: Array
    u_next: Array
    y: Array
    stack: Array
    noise: Array
    w_lower: Array
    w_upper: Array
    given: Array

    @property
    def reading(self) -> Reading:
        """The sample as it is kept without a set."""
        slack = np.zeros(self.y.size)
        return Reading(self.stack, self.u_next.copy(), self.y.copy(), self.noise, slack, self.w_lower, self.w_upper)


def check_matrices(stack: Array) -> None:
    """What the kernel checks of a sample's matrices."""
    if not np.isfinite(stack).all():
        raise ValueError(_ENTRY_ERRORS[kernel.BAD_MATRIX])


def check_entry(code: int) -> None:
    """What the kernel says of a sample; u and y have been checked before."""
    if code in _ENTRY_ERRORS:
        raise ValueError(_ENTRY_ERRORS[code])

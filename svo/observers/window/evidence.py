"""The data of a window's proof: model, measurements and multipliers, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from svo.checks import Array
from svo.models import Exponents


@dataclass(frozen=True, eq=False)
class ArrivalSet(Shown):
    """{x : box_lower <= x <= box_upper, lower <= rows x <= upper}: what was known of the window's first state."""

    box_lower: Array
    box_upper: Array
    rows: Array
    lower: Array
    upper: Array

    @classmethod
    def box(cls, lower: Array, upper: Array) -> ArrivalSet:
        """A box without further rows."""
        return cls(lower, upper, np.zeros((0, lower.size)), np.zeros(0), np.zeros(0))

    @classmethod
    def unknown(cls, n: int) -> ArrivalSet:
        """Nothing known of n states: what follows rests on the window's readings alone."""
        return cls.box(np.full(n, -np.inf), np.full(n, np.inf))

    @property
    def is_unknown(self) -> bool:
        ends = self.box_lower, self.box_upper
        if not all(isinstance(end, np.ndarray) and end.dtype == np.float64 for end in ends):
            return False  # a stored certificate may hold anything
        return bool((ends[0] == -np.inf).all() and (ends[1] == np.inf).all())


@dataclass(frozen=True, eq=False)
class WindowSample(Shown):
    """Model and data of one sample of a window, with the multipliers of its rows.

    Attributes
    ----------
    stack : (1 + n_uncertainties, n + ny, n + nu + 1 + nw)
        As `UncertainModel.stack` gave it.
    u, y, noise, slack : (nu,), (ny,), (ny,), (ny,)
        ``y`` within ``noise + slack`` of the output; NaN where the sensor is missing.
    w_lower, w_upper : (nw,)
    s_lower, s_upper : (nq,)
        Bounds of each channel's s; zero at the newest sample where the channel does not reach the output.
    lines : (nq, 4)
        Slope and intercept of the line above Delta s and of the line below it.
    on_output, on_w, on_channel : (ny,), (nh,), (nq, 2)
        Multipliers; positive on an upper bound, negative on a lower one.
    gain, functional : (nq, n + ny), (nq, n + nu + 1 + nw) or None
        Factors of the channels: s = functional'(x, u, 1, w), and gain Delta s is added to [x(k+1); y(k)]. A choice:
        what they leave out of the stack is bounded. None: those that an observer makes in its units.
    remainder : (ny,) or None
        Added to the noise, and not averaged in sums: what a linearised output leaves out. None = nothing.
    """

    stack: Array
    u: Array
    y: Array
    noise: Array
    slack: Array
    w_lower: Array
    w_upper: Array
    s_lower: Array
    s_upper: Array
    lines: Array
    on_output: Array
    on_w: Array
    on_channel: Array
    gain: Array | None = None
    functional: Array | None = None
    remainder: Array | None = None


@dataclass(frozen=True, eq=False)
class SumRows(Shown):
    """Rows that are sums over samples: of the noise of an output, or of a disturbance.

    Attributes
    ----------
    column : (r,) int
        The output, or ny + the disturbance.
    first, last : (r,) int
        Samples that are summed over, both included, within the window.
    lower, upper : (r,)
        Bounds of the sum over all of them. A reading that is missing is taken away with the bound of its noise; slack
        and remainder of the others are added.
    on_sum : (r,)
        Multipliers, as those of single rows.
    """

    column: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    lower: Array
    upper: Array
    on_sum: Array


@dataclass(frozen=True, eq=False)
class WindowEvidence(Shown):
    """What is known of a window, and the multipliers of its rows.

    Attributes
    ----------
    first, last : int
        Sample numbers of the window.
    n : int
        Number of states.
    delta : (nq, 2)
        Bounds of the Delta of each channel.
    owner : (nq,) int
        Item of the stack that each channel belongs to.
    w_rows, w_rows_lower, w_rows_upper : (nh, nw), (nh,), (nh,)
        Rows on w besides its box.
    arrival : ArrivalSet
    on_arrival : (rows,)
        Multipliers of the arrival rows.
    samples : tuple of WindowSample
    late : bool
        Whether w of the last sample takes part, and its channels that reach the output: where the output may depend on
        any of them.
    largest_at : int or None
        Sample at which the observer's set started again from the model's largest set, a premise of the arrival set.
    units : Exponents or None
        Of the normal form in which uncertainties are factored into channels; None = the units as they are. A choice:
        what any factors leave out is bounded.
    sums : SumRows or None
    """

    first: int
    last: int
    n: int
    late: bool
    delta: Array
    owner: NDArray[np.int64]
    w_rows: Array
    w_rows_lower: Array
    w_rows_upper: Array
    arrival: ArrivalSet
    on_arrival: Array
    samples: tuple[WindowSample, ...]
    largest_at: int | None = None
    units: Exponents | None = None
    sums: SumRows | None = None

"""The last samples of an observer that has no set of states, or one too wide to be of use, until they bound the state.

Kept apart from the observers: each of them starts again from the box that `Readings.start` gives, with the samples
that gave it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from copy import copy
from itertools import dropwhile

import numpy as np

from svo.checks import Array
from svo.models import UncertainModel
from svo.observers.free_start import Reading, state_bounds
from svo.observers.saved_state import numbers, sample_shapes
from svo.observers.window_kernel import LARGEST

OUTGROWN = "outgrown"
OUTSIDE = "outside the physical range"
TOO_LARGE = "a reading is too large"
NO_SAMPLE = -(2**62)  # stands for none in saved states; numbers may be negative after a bank's restart
_ROOM = 1.01  # times the half-width of a start: the set is the start of a window, whose readings shrink it at once
_PREFIX = "readings."  # of the names of their arrays
_EXTRA = 10  # samples more than states, of which the readings are tried


class Readings:
    """Samples whose readings are to bound the state without any set before.

    Parameters
    ----------
    model : UncertainModel
    eps : float
        As the observer's.
    horizon : int
        Steps that the observer looks back, at least so many samples are kept.
    """

    def __init__(self, model: UncertainModel, eps: float, horizon: int = 0) -> None:
        self._n, self._eps, self._shapes = model.n_states, eps, sample_shapes(model)
        self._delta = np.array([u.bounds for u in model.uncertainties]).reshape(-1, 2)
        self.samples: deque[Reading] = deque(maxlen=max(horizon, model.n_states + _EXTRA) + 1)

    @property
    def is_full(self) -> bool:
        return len(self.samples) == self.samples.maxlen

    def added(self, u: Array, reading: Reading) -> Readings:
        """These and the next sample; u drives the transition to it."""
        more = copy(self)
        more.samples = self.samples.copy()
        if more.samples:
            more.samples[-1] = more.samples[-1]._replace(u=u.copy())
        more.samples.append(usable(reading))
        return more

    def add_late(self, y: Array, age: int) -> None:
        """Values of a sample that came ``age`` samples ago, if it is still kept; NaN = not these."""
        if age < len(self.samples):
            old = self.samples[-1 - age]
            self.samples[-1 - age] = usable(old._replace(y=np.where(np.isnan(y), old.y, y)))

    def move_by(self, rows: Array) -> None:
        """Replace the transition from the newest sample by that of state rows (items, n, columns)."""
        if self.samples:
            stack = self.samples[-1].stack.copy()
            stack[:, : self._n] = rows
            self.samples[-1] = self.samples[-1]._replace(stack=stack)

    def start(self) -> tuple[list[Reading], Array, Array] | None:
        """The samples from the first reading on and bounds of the state there, once there are any of use."""
        if not self.samples or np.isnan(self.samples[-1].y).all():
            return None
        used = list(self.samples)
        while used and sum(int((~np.isnan(s.y)).sum()) for s in used) >= self._n:
            used = list(dropwhile(lambda sample: np.isnan(sample.y).all(), used))
            found = state_bounds(used, self._delta, self._eps)
            if found is None:
                return None
            lower, upper = found
            if np.maximum(np.abs(lower), np.abs(upper)).max() < LARGEST:
                middle = 0.5 * lower + 0.5 * upper
                half = _ROOM * np.maximum(upper - middle, middle - lower)
                return used, middle - half, middle + half
            used = used[1:]  # its input or reading is beyond all bounds
        return None

    def state(self) -> dict[str, Array]:
        """The samples as named arrays."""
        names = Reading._fields if self.samples else ()
        return {f"{_PREFIX}{name}": np.array([getattr(s, name) for s in self.samples]) for name in names}

    def restore(self, state: Mapping[str, Array]) -> None:
        """Take back what `state` gave; ValueError unless it is that of samples of this model."""
        if f"{_PREFIX}y" not in state:
            return
        count = len(state[f"{_PREFIX}y"])
        columns = [
            numbers(state, f"{_PREFIX}{name}", count, *self._shapes[name], missing=name == "y")
            for name in Reading._fields
        ]
        self.samples.extend(Reading(*(v.copy() for v in values)) for values in zip(*columns, strict=True))


def usable(reading: Reading) -> Reading:
    """Without the values that are beyond any state that an observer bounds."""
    return reading._replace(y=np.where(np.abs(reading.y) < LARGEST, reading.y, np.nan))

"""A window that starts again where its set is gone, and where readings alone bound the state better than the set does.

All in normal form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.models.state_range import within
from svo.observers.answers import VerdictName
from svo.observers.free_start import Reading
from svo.observers.readings import NO_SAMPLE, OUTGROWN, Readings
from svo.observers.saved_state import numbers
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.memory import WindowSettings
from svo.observers.window.sample import Outgrown, Sample, check_matrices
from svo.observers.window.window import Window

_BLURRED = 1e-3  # of a reading's own width: the share of its slack by the width of the set from which a restart pays
_LONGEST = 10  # samples without a sensor after which its return may call for one, where the window has no end


class RestartingWindow:
    """The window of an observer, and what becomes of a sample that it takes.

    Samples are counted as the observer counts them; ``number`` is always the newest.

    Parameters
    ----------
    settings : WindowSettings
    initial : ArrivalSet
        Contains the first state.
    finds : bool
        Whether the readings alone may bound the state where there is no set.
    compares : bool
        Whether they may where there is one, after a sensor was missing for long.

    Attributes
    ----------
    window : Window
        Of no use while the set is lost.
    lost : bool
        Whether there is no set.
    largest_at : int or None
        As `Observer.largest_at`.
    """

    def __init__(self, settings: WindowSettings, initial: ArrivalSet, *, finds: bool, compares: bool) -> None:
        self._settings, self._model, self._finds, self._compares = settings, settings.form.model, finds, compares
        self.window = Window(settings, initial)
        self.lost = False
        self.largest_at: int | None = None
        self._stopped = 0  # programs of windows before the present one
        self._readings: Readings | None = None  # of a set that is lost, or too wide
        self._missing = np.zeros(self._model.n_outputs, dtype=np.int64)  # samples since each sensor was read

    @property
    def stopped(self) -> int:
        """Programs that ended at a limit."""
        return self._stopped + self.window.stopped

    @property
    def reason(self) -> str | None:
        """Why the newest verdict is "undecided", where that is known."""
        return OUTGROWN if self.lost else self.window.reason

    @property
    def is_whole(self) -> bool:
        """Whether every sensor was read at the newest sample, and the readings alone are not tried."""
        return self._readings is None and not self._missing.any()

    def oldest(self, number: int) -> int:
        """First sample that is still there."""
        if self.lost:
            assert self._readings is not None
            return number - len(self._readings.samples) + 1
        return self.window.oldest

    def read_at(self, sample: int, number: int) -> Array:
        """What was read at a sample that is still there."""
        if self.lost:
            assert self._readings is not None
            return self._readings.samples[sample - self.oldest(number)].y
        return self.window.read_at(sample)

    def bounds(self) -> tuple[Array, Array]:
        """Of the newest state in the template's directions, within the physical range; the axes come first."""
        return self._bounds_of(None if self.lost else self.window)

    def support(self, directions: Array) -> Array:
        """Upper bounds of directions (k, n) of the newest state."""
        if self.lost:
            return np.full(len(directions), np.inf)
        return np.array([self.window.support(direction) for direction in directions])

    # -- samples -----------------------------------------------------------------------------------

    def take(self, sample: Sample, number: int, end: float | None) -> VerdictName:
        """The next sample, by the time ``end`` if there is one."""
        if self.lost:
            check_matrices(sample.stack)
            return self._without_set(sample, number)
        return self.outcome(sample, number, lambda: self.window.take(sample, end))

    def outcome(self, sample: Sample, number: int, take: Callable[[], VerdictName]) -> VerdictName:
        """What becomes of a sample that the window takes by a call of ``take``."""
        try:
            verdict = take()
        except Outgrown:
            return self._give_up(sample, number)
        return verdict if verdict == "falsified" else self._watch(sample, number, verdict)

    def add_late(self, y: Array, sample: int, number: int) -> VerdictName:
        """A measurement of a sample that is still there."""
        if self._readings is not None:
            self._readings.add_late(y, number - sample)
            if self.lost:
                return self._start_from(self._readings, number) or "undecided"
        return self.window.add_late(y, sample)

    def move_by(self, rows: Array) -> None:
        """Replace the transition from the newest sample, as `Window.move_by`."""
        self.window.move_by(rows)
        if self._readings is not None:
            self._readings.move_by(rows)

    # -- the set is gone ---------------------------------------------------------------------------

    def lose(self) -> None:
        """There is no set any more."""
        self.largest_at, self.lost, self._readings = None, True, self._new_readings()
        self._stopped += self.window.stopped
        self.window = Window(self._settings, self.window.anchor)

    def start_from_largest(self, set: ArrivalSet, number: int) -> None:
        """Nothing else is known of the newest sample."""
        self._adopt(self._new_window(set, number))
        self.largest_at = number

    def rest_on_largest(self, number: int) -> None:
        """The set at the newest sample is the largest one: whatever sensor is read may bound it better."""
        self.largest_at, self._missing[:] = number, self._longest_gap

    def _give_up(self, sample: Sample, number: int) -> VerdictName:
        """The set has outgrown all bounds at this sample: it starts again from the largest set, if there is one."""
        largest = self._model.start_range
        if largest is not None:
            window = self._new_window(ArrivalSet.box(largest.lower, largest.upper), number)
            try:
                verdict = window.take(sample)
            except Outgrown:
                pass  # it is itself beyond all bounds
            else:
                self._adopt(window)
                self.rest_on_largest(number)
                return verdict
        self.lose()
        return self._without_set(sample, number)

    def _without_set(self, sample: Sample, number: int) -> VerdictName:
        if not self._finds:
            return "undecided"  # until the next sample starts again from the largest set
        assert self._readings is not None
        readings = self._readings.added(sample.u, sample.reading)
        verdict = self._start_from(readings, number)
        if verdict is None:
            self._readings = readings
        return verdict or "undecided"

    def _new_readings(self) -> Readings:
        return Readings(self._model, self._settings.eps, self._settings.horizon or 0)

    def _new_window(self, anchor: ArrivalSet, origin: int, free: bool = False) -> Window:
        """Nothing before it is used any more; bounds by readings alone have been proven where they were found."""
        return Window(self._settings, anchor, origin=origin, free=free)

    def _adopt(self, window: Window) -> None:
        """Go on with a window that has started again."""
        self._stopped += self.window.stopped
        self.window = window
        self.lost, self._readings, self.largest_at = False, None, None
        self._missing = np.zeros(self._model.n_outputs, dtype=np.int64)

    # -- the set is too wide -----------------------------------------------------------------------

    @property
    def _longest_gap(self) -> int:
        """Samples without a sensor after which the set may be too wide."""
        return self._settings.horizon or _LONGEST

    def _watch(self, sample: Sample, number: int, verdict: VerdictName) -> VerdictName:
        """Look for readings that bound the state better than a set that a gap has blurred."""
        if not self._compares:
            return verdict
        if self._readings is None:
            if not (any(map(math.isnan, sample.y.tolist())) or any(self._missing.tolist())):  # short: fastest so
                return verdict
            absent = np.isnan(sample.y)
            returned = ~absent & (self._missing >= self._longest_gap)
            self._missing = np.where(absent, self._missing + 1, 0)
            if not (returned.any() and self._is_blurred(returned, sample)):
                return verdict
        readings = (self._readings or self._new_readings()).added(sample.u, sample.reading)
        better = self._start_from(readings, number)
        if better is None:
            self._readings = None if readings.is_full else readings
        return better or verdict

    def _is_blurred(self, returned: NDArray[np.bool_], sample: Sample) -> bool:
        """Whether the slack of a sensor's row comes from the width of the set more than it should."""
        own = sample.noise + self._settings.eps * np.abs(np.nan_to_num(sample.y))
        return bool((self.window.blur(sample.stack) > _BLURRED * own)[returned].any())

    # -- the set is found --------------------------------------------------------------------------

    def _start_from(self, readings: Readings, number: int) -> VerdictName | None:
        """Start again where readings alone bound the state, if they do and it is the better set."""
        found = readings.start()
        if found is None:
            return None
        samples, lower, upper = found
        lower, upper = within(self._model.physical_range, lower, upper)
        window = self._new_window(ArrivalSet.box(lower, upper), number - len(samples) + 1, free=True)
        try:
            verdict = _repeated(samples, window)
        except Outgrown:
            return None
        if verdict != "falsified" and not self._is_better(window, verdict):
            return None
        self._adopt(window)
        return verdict

    def _is_better(self, window: Window, verdict: VerdictName) -> bool:
        """Whether the set of a new window is nowhere wider than the one before."""
        if verdict != "consistent" or self.lost:
            return verdict == "consistent"
        (lower, upper), (before, above) = self._bounds_of(window), self.bounds()
        return bool((upper - lower <= above - before)[: self._model.n_states].all())

    def _bounds_of(self, window: Window | None) -> tuple[Array, Array]:
        rows = self.window.memory.arrays["T"]
        if window is None:
            lower, upper = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
        else:
            lower, upper = window.newest_bounds()
        physical = self._model.physical_range
        if physical is not None:
            lower, upper, _ = physical.along(rows).cut(lower, upper)
        return lower, upper

    # -- saved states ------------------------------------------------------------------------------

    def state(self, number: int) -> dict[str, NDArray[Any]]:
        """Everything but settings, as named arrays."""
        window, largest = self.window, NO_SAMPLE if self.largest_at is None else self.largest_at
        lost_at, has_readings = number if self.lost else -1, self._readings is not None
        told = [window.origin, window.free, self.lost, lost_at, largest, has_readings, self._stopped]
        readings = {} if self._readings is None else self._readings.state()
        return {"restart": np.array(told, dtype=np.int64), "missing": self._missing} | readings | window.state()

    def resume(self, state: Mapping[str, NDArray[Any]], steps: int, falsified: bool) -> int:
        """Take back what `state` gave of a window with room for ``steps``; returns the number of the newest sample.

        Raises
        ------
        KeyError, ValueError
            If it is no such state, or its falsification cannot be proven again.
        """
        origin, free, lost, lost_at, largest, has_readings, self._stopped = (int(v) for v in state["restart"])
        anchor = read_arrival(state, "anchor", self._model.n_states)
        self.window = Window(self._settings, anchor, steps, origin, bool(free))
        self.window.resume(state, falsified)
        self.lost = bool(lost)
        self.largest_at = None if largest == NO_SAMPLE else largest
        self._missing = np.array(state["missing"], dtype=np.int64)
        if has_readings:
            self._readings = self._new_readings()
            self._readings.restore(state)
        elif lost:
            raise ValueError("it has lost its set, and holds no readings to find one again")
        return lost_at if lost else self.window.newest


def read_arrival(state: Mapping[str, NDArray[Any]], name: str, n: int) -> ArrivalSet:
    """An arrival set of n states from its arrays; ValueError unless they fit together."""
    ends = len(state[f"{name}.rows"])
    sizes = {"box_lower": n, "box_upper": n, "lower": ends, "upper": ends}
    bounds = {part: numbers(state, f"{name}.{part}", size, infinite=True) for part, size in sizes.items()}
    return ArrivalSet(rows=numbers(state, f"{name}.rows", ends, n), **bounds)


def _repeated(samples: list[Reading], window: Window) -> VerdictName:
    """Samples through a new window; the verdict is about the last one."""
    verdict: VerdictName = "undecided"
    for j, s in enumerate(samples):
        window.forget_proof()  # by fewer readings than bound the first state: no proof
        u = samples[j - 1].u if j else s.u
        verdict = window.take(Sample(u, s.u, s.y, s.stack, s.noise, s.w_lower, s.w_upper, s.y))
    return verdict

"""A window that loses its set, and finds one again: from the largest set, or from the readings alone.

After a long gap in the measurements the set outgrows `LARGEST` and says nothing any more. It is then given up. Where
the model states the largest set it starts again there, a premise of every later alarm. Otherwise, and where the set
is only so wide that its rounding blurs the readings, it starts again from the samples whose readings bound the state
without anything before (`svo.observers.readings`): nothing is promised then. All in normal form.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.observers import window_kernel as kernel
from svo.observers.answers import VerdictName
from svo.observers.free_start import Reading
from svo.observers.readings import NO_SAMPLE, OUTGROWN, OUTSIDE, Readings
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.programs import Outgrown, WindowPrograms, check_matrices

_BLURRED = 1e-3  # of a reading's own width: the share of its slack by the width of the set from which a restart pays
_LONGEST = 10  # samples without a sensor after which its return may call for one, where the window has no end


class RestartingWindow(WindowPrograms):
    """Samples through a window, however long the gaps between their measurements."""

    _number: int
    _reason: str | None
    _readings: Readings | None
    _missing: NDArray[np.int64]

    def _begin_first(self, initial: ArrivalSet) -> None:
        """Forget everything but a set of first states."""
        self._initial = initial
        self.largest_at, self._reason, self._lost, self._readings = None, None, False, None
        self._missing = np.zeros(self._normal.n_outputs, dtype=np.int64)
        self._begin(initial, self._first_steps)

    def _answer(self, data: tuple[Any, ...], end: float | None) -> VerdictName:
        """One sample. The observer is unchanged if it raises an error."""
        if self._lost:
            check_matrices(data[6])
            return self._without_set(data)
        try:
            verdict = self._with_set(data, end)
        except Outgrown:
            return self._give_up(data)
        if verdict != "falsified":
            verdict = self._watch(data, verdict)
        return verdict

    def _with_set(self, data: tuple[Any, ...], end: float | None) -> VerdictName:
        self._reason = None
        if end is None:
            verdict = self._take(data)
        else:
            self._enter(data, end)
            verdict = self._solve_until(end)
        return self._cut_arrival(verdict)

    def _cut_arrival(self, verdict: VerdictName) -> VerdictName:
        """The next arrival set, once it is known, within the physical range."""
        physical, w, n = self._normal.physical_range, self._arrays, self._normal.n_states
        if physical is None or not w["clock"][kernel.PENDING] or verdict == "falsified":
            return verdict
        w["new_lower"][:n], w["new_upper"][:n], meets = physical.cut(w["new_lower"][:n], w["new_upper"][:n])
        if meets:
            return verdict
        self._reason = OUTSIDE  # not proven, so no alarm
        return "undecided"

    # -- measurements that come late -----------------------------------------------------------------

    @property
    def _oldest(self) -> int:
        """First sample that is still at hand."""
        if self._lost:
            assert self._readings is not None
            return self._number - len(self._readings.samples) + 1
        return self._origin + int(self._arrays["clock"][kernel.BASE])

    def _read_at(self, sample: int) -> Array:
        """What was read at a sample of the window."""
        if self._lost:
            assert self._readings is not None
            return self._readings.samples[sample - self._oldest].y
        read: Array = self._arrays["y"][(sample - self._origin) % (self._size.N + 1)]
        return read

    def _take_late(self, y: Array, sample: int) -> VerdictName:
        """A measurement of a sample that is at hand."""
        if self._readings is not None:
            self._readings.add_late(y, self._number - sample)
        if self._lost:
            return self._start_from_readings() or "undecided"
        own = sample - self._origin
        kernel.add_late(self._window, self._size, own, y, self.eps)
        if self._injection is not None:  # the sample was incomplete, so it is as it was given
            s, w = own % (self._size.N + 1), self._arrays
            w["given.y"][s], w["given.slack"][s] = w["y"][s], w["slack"][s]
        return self._cut_arrival(self._solve(kernel.ARRIVAL))

    # -- the set is gone ---------------------------------------------------------------------------

    def _give_up(self, data: tuple[Any, ...]) -> VerdictName:
        """The set has outgrown all bounds at this sample."""
        largest = self._normal.start_range
        if largest is not None:
            self._start(ArrivalSet.box(largest.lower, largest.upper), self._number)
            self.largest_at = self._number
            self._missing[:] = self._horizon_of_gaps
            try:
                return self._with_set((self._window, self._size, True, *data[3:]), None)
            except Outgrown:
                pass  # it is itself beyond all bounds
        self._lose()
        return self._without_set(data)

    def _lose_set(self) -> None:
        largest = self._normal.start_range
        if largest is None:
            self._lose()
        else:
            self._begin_first(ArrivalSet.box(largest.lower, largest.upper))
            self.largest_at, self._missing[:] = 0, self._horizon_of_gaps

    def _lose(self) -> None:
        """There is no set any more."""
        self.largest_at, self._lost = None, True
        self._readings = Readings(self._normal, self.eps, self.horizon or 0)
        self._begin(self._anchor, self._first_steps)

    def _without_set(self, data: tuple[Any, ...]) -> VerdictName:
        assert self._readings is not None
        self._reason = OUTGROWN
        self._readings.add(data[3], _reading_of(data))
        return self._start_from_readings() or "undecided"

    # -- the set is too wide -------------------------------------------------------------------------

    @property
    def _horizon_of_gaps(self) -> int:
        return self.horizon or _LONGEST

    def _watch(self, data: tuple[Any, ...], verdict: VerdictName) -> VerdictName:
        """Look for readings that bound the state better than a set that a gap has blurred."""
        y = data[5]
        if self._readings is None:
            absent = np.isnan(y)
            if not (absent.any() or self._missing.any()):
                return verdict
            returned = ~absent & (self._missing >= self._horizon_of_gaps)
            self._missing = np.where(absent, self._missing + 1, 0)
            if not (returned.any() and self._is_blurred(returned, data)):
                return verdict
            self._readings = Readings(self._normal, self.eps, self.horizon or 0)
        self._readings.add(data[3], _reading_of(data))
        better = self._start_from_readings()
        if better is not None:
            return better
        if self._readings.is_full:
            self._readings = None
        return verdict

    def _is_blurred(self, returned: NDArray[np.bool_], data: tuple[Any, ...]) -> bool:
        """Whether the slack of a sensor's row comes from the width of the set more than it should."""
        y, stack, noise = data[5:8]
        s, n = self._time % (self._size.N + 1), self._normal.n_states
        width = self._arrays["mag"][s] - np.abs(self._arrays["phi"][s])
        blur = self.eps * np.abs(stack[0, n:, :n]) @ np.maximum(width, 0.0)
        own = noise + self.eps * np.abs(np.nan_to_num(y))
        return bool((blur > _BLURRED * own)[returned].any())

    # -- the set is found ------------------------------------------------------------------------------

    def _start_from_readings(self) -> VerdictName | None:
        """Start again where the readings alone bound the state, if they do and it is the better set."""
        assert self._readings is not None
        found = self._readings.start()
        if found is None:
            return None
        samples, lower, upper = found
        kept = self.__dict__.copy()
        physical = self._normal.physical_range
        if physical is not None:
            lower, upper, _ = physical.cut(lower, upper)
        self._start(ArrivalSet.box(lower, upper), self._number - len(samples) + 1, free=True)
        try:
            verdict = self._repeat(samples)
        except Outgrown:
            verdict = "undecided"
        if verdict == "falsified" or self._is_better(kept, verdict):
            return verdict
        self.__dict__.update(kept)
        return None

    def _start(self, arrival: ArrivalSet, number: int, free: bool = False) -> None:
        """A new window whose first sample has this number."""
        self._lost, self._readings, self._reason, self.largest_at = False, None, None, None
        self._missing = np.zeros(self._normal.n_outputs, dtype=np.int64)
        self._begin(arrival, self._first_steps, number, free)

    def _repeat(self, samples: list[Reading]) -> VerdictName:
        """Samples through a new window; the verdict is about the last one."""
        verdict: VerdictName = "undecided"
        for j, s in enumerate(samples):
            self._falsified = None  # by fewer readings than bound the first state: no proof
            if self.horizon is None and self._time + 1 >= self._size.N:
                self._grow()
            u = samples[j - 1].u if j else s.u
            w = s.w_lower, s.w_upper
            data = (self._window, self._size, j == 0, u, s.u, s.y, s.stack, s.noise, *(self._last_bounds or w), *w)
            verdict = self._with_set(data, None)
            self._last_bounds = w
        return verdict

    def _is_better(self, kept: Mapping[str, Any], verdict: VerdictName) -> bool:
        """Whether the new set is nowhere wider than the one before."""
        if kept["_lost"]:
            return verdict == "consistent"
        if verdict != "consistent":
            return False
        found, new = self._newest_bounds(), self.__dict__.copy()
        self.__dict__.update(kept)
        old = self._newest_bounds()
        self.__dict__.update(new)
        n = self._normal.n_states
        return bool((found[1] - found[0] <= old[1] - old[0])[:n].all())

    def _newest_bounds(self) -> tuple[Array, Array]:
        """Bounds of the newest state in the template's directions, within the physical range; the axes come first."""
        physical, rows = self._normal.physical_range, self._arrays["T"]
        if self._lost:
            lower, upper = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
        else:
            self._solve(kernel.NEWEST)
            lower, upper = self._arrays["now_lower"].copy(), self._arrays["now_upper"].copy()
        if physical is not None:
            lower, upper, _ = physical.along(rows).cut(lower, upper)
        return lower, upper

    # -- saved states ------------------------------------------------------------------------------------

    def _restart_state(self) -> dict[str, Array]:
        """What the next samples depend on besides the kernel's memory."""
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        lost_at = self._number if self._lost else -1
        numbers = [self._origin, self._free, self._lost, lost_at, largest, self._readings is not None]
        state: dict[str, Any] = {"restart": np.array(numbers, dtype=np.int64), "missing": self._missing}
        state |= {f"anchor.{f.name}": getattr(self._anchor, f.name) for f in fields(ArrivalSet)}
        if self._readings is not None:
            state |= self._readings.state()
        return state

    def _restore_restart(self, state: Mapping[str, Array], steps: int) -> None:
        """Take back what `_restart_state` gave; the kernel's memory is empty then."""
        origin, free, lost, lost_at, largest, has_readings = (int(v) for v in state["restart"])
        anchor = ArrivalSet(**{f.name: np.array(state[f"anchor.{f.name}"]) for f in fields(ArrivalSet)})
        self._begin(anchor, steps, origin, bool(free))
        self._lost, self._number = bool(lost), lost_at
        self.largest_at = None if largest == NO_SAMPLE else largest
        self._missing = np.array(state["missing"], dtype=np.int64)
        if has_readings:
            self._readings = Readings(self._normal, self.eps, self.horizon or 0)
            self._readings.restore(state)


def _reading_of(data: tuple[Any, ...]) -> Reading:
    """The data of a sample as they are kept."""
    u_next, y, stack, noise = data[4:8]
    return Reading(stack, u_next.copy(), y.copy(), noise, np.zeros(y.size), *data[10:12])

"""The whole chain of a falsification: every bound from the first sample to the alarm, in exact arithmetic.

What a window proves is conditional on its arrival set and on the bounds of its channels' s. Run again over the log
with `ProvingObserver`, each of those bounds is checked when it is made: the multipliers of its program prove, by weak
duality in rational arithmetic, a bound that is no larger. By induction the alarm then follows from the initial set, the
model and the log alone; where the set started again, from the largest set there, or from the readings since.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from flint import fmpq

from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers import window_kernel as kernel
from svo.observers.answers import VerdictName
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.observer import WindowObserver
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.window.weak_duality import exact


@dataclass(frozen=True, eq=False)
class ChainCheck:
    """What `prove_chain` found when it ran a log again.

    Attributes
    ----------
    proven : bool
        Whether every bound up to the falsification was proven, and the falsification itself.
    falsified_at : int or None
        Sample of the falsification; None if the log ends without one.
    bounds : int
        Arrival and channel bounds that were checked.
    unproven : tuple of str
        Those whose proof did not hold: what and at which sample.
    certificate : WindowCertificate or None
        Of the falsification.
    seconds : float
        Time that it took.
    given : tuple of str
        What the proof rests on besides the model, its bounds and the log: where it starts, and the physical range.
    """

    proven: bool
    falsified_at: int | None
    bounds: int
    unproven: tuple[str, ...]
    certificate: WindowCertificate | None
    seconds: float
    given: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LateMeasurement:
    """Outputs y (ny,) of sample ``taken`` that the observer got right after sample ``arrived``; NaN = not these."""

    arrived: int
    taken: int
    y: Array


def prove_chain(observer: WindowObserver, log: Log, late: Iterable[LateMeasurement] = ()) -> ChainCheck:
    """Run a log again through an observer like the given one, and prove every bound up to its falsification.

    Parameters
    ----------
    observer : WindowObserver
        Gives the model, the initial set, the horizon, the template and eps; it is left as it is. Convex hulls are
        used even where it splits by signs, so what needs the split is found later or not at all.
    log : Log
        With NaN where a measurement came late.
    late : iterable of LateMeasurement
        Those that did, in the order of their arrival.

    Returns
    -------
    ChainCheck

    Raises
    ------
    TypeError
        If the observer is no `WindowObserver`: the sets of the others are not proven. If the log is no `svo.Log`.
    ValueError
        If a late measurement arrived after the log's end, or before it was taken; and as `WindowObserver.step` and
        `WindowObserver.late_update` do.
    """
    if not isinstance(observer, WindowObserver):
        raise TypeError(f"observer is a {type(observer).__name__}; expected a WindowObserver, the only kind proven")
    if not isinstance(log, Log):
        raise TypeError(f"log is {type(log).__name__}; expected an svo.Log")
    begun = perf_counter()
    waiting = list(late)
    for i, measurement in enumerate(waiting):
        if not 0 <= measurement.taken <= measurement.arrived < len(log):
            raise ValueError(
                f"late[{i}] was taken at sample {measurement.taken} and arrived after {measurement.arrived}; expected "
                f"0 <= taken <= arrived <= {len(log) - 1}, the last sample of the log"
            )
    again = ProvingObserver.like(observer)
    at = None
    for k, step in enumerate(drive(again, log)):
        for measurement in waiting:
            if measurement.arrived == k and step.verdict != "falsified":
                step = again.late_update(measurement.y, measurement.taken)
        if step.verdict == "falsified":
            at = k
            break
    certificate = again.certificate
    return ChainCheck(
        proven=at is not None and not again.unproven,
        falsified_at=at,
        bounds=again.checked,
        unproven=tuple(again.unproven),
        certificate=certificate,
        seconds=perf_counter() - begun,
        given=(again.start_at(0) or "the first set", *again.promises),
    )


class ProvingObserver(WindowObserver):
    """A window observer that proves each bound that it keeps.

    Attributes
    ----------
    checked : int
        Bounds so far.
    unproven : list of str
        Those whose multipliers do not prove them.
    """

    checked: int
    unproven: list[str]

    @classmethod
    def like(cls, observer: WindowObserver) -> ProvingObserver:
        """One with the settings and the initial set of another, before its first sample."""
        again = cls.__new__(cls)
        again._configure(observer._form, observer.horizon, observer._template, observer.eps, 0)
        again.checked, again.unproven = 0, []
        again._begin_first(observer._initial)
        return again

    def start_at(self, shift: int) -> str | None:
        """Where a set that started again did, its samples counted from ``shift``; None for the set it was given."""
        if self.largest_at is not None:
            return f"the largest set at sample {shift + self.largest_at}, where the set started again"
        if self._free:
            return f"nothing before sample {shift + self._origin}, from which on the readings alone bound the state"
        return None

    @property
    def promises(self) -> tuple[str, ...]:
        """What is promised of the plant at all times, besides its model."""
        return () if self.model.physical_range is None else ("the physical range",)

    @property
    def certificate(self) -> WindowCertificate | None:
        """Of the falsification, once there is one."""
        assert not isinstance(self._falsified, SplitCertificate)  # it keeps the hulls
        return self._falsified

    def _start(self, arrival: ArrivalSet, number: int, free: bool = False) -> None:
        super()._start(arrival, number, free)
        # Nothing before is used any more. Bounds by readings alone have been proven where they were found.
        self.checked, self.unproven = int(free), []

    def _take(self, data: tuple[Any, ...]) -> VerdictName:
        self._enter(data)
        return self._solve(kernel.ARRIVAL)

    def _solve(self, task: int) -> VerdictName:
        if task != kernel.ARRIVAL:
            return super()._solve(task)
        clock, size, decided = self._arrays["clock"], self._size, False
        base, time = int(clock[kernel.BASE]), int(clock[kernel.TIME])
        for program in range(*kernel.arrival_programs.py_func(size, base, time)):
            verdict = self._solve_one(task, program)
            if verdict == kernel.EMPTY_CANDIDATE and self._prove():
                return "falsified"
            decided = decided or verdict == kernel.CONSISTENT
            if time - base > size.N - size.block:
                self._check_arrival(program, base + size.block)
        return "consistent" if decided else self._ask_highs()

    def _settle_channels(self, sign_open: bool, reaching: bool, end: float | None = None) -> None:
        """As the observer does; each bound of s is then proven."""
        size, w = self._size, self._arrays
        if not reaching and self._last_bounds is None:
            return  # no transition leads to the first sample
        v = self._time % (size.N + size.late)
        for q in self._channels(reaching):
            for side in range(2):
                program = 2 * q + side
                is_open = sign_open and w["s_lower"][v, q] < 0.0 < w["s_upper"][v, q]
                if is_open:
                    self._solve_one(kernel.CHANNELS, program)
                self._check_channel(v, q, side, 4 * size.nt + program if is_open else None)

    def _check_arrival(self, program: int, target: int) -> None:
        i, lower = program // 2, program % 2 == 1
        bound = exact(-self._arrays["new_lower"][i] if lower else self._arrays["new_upper"][i])
        direction = -self._arrays["T"][i] if lower else self._arrays["T"][i]
        proven = self._proven(program, target, direction)
        what = f"arrival bound {program} of sample {target + self._origin}"
        self._count(proven is not None and proven <= bound, what)

    def _check_channel(self, v: int, q: int, side: int, basis: int | None) -> None:
        """s = f'(x, u, 1, w) <= s_upper, or -s <= -s_lower, by the program's multipliers or by none at all."""
        w, size = self._arrays, self._size
        time = int(w["clock"][kernel.TIME])
        sign = 1.0 - 2.0 * side
        f = sign * w["functional"][v, q]
        bound = exact(w["s_upper"][v, q] if side == 0 else -w["s_lower"][v, q])
        known = self._known_part(f, time, v)
        bases = [None] if basis is None else [basis, None]
        proofs = [self._proven(b, time, f[: size.n]) for b in bases]
        holds = any(proof is not None and proof + known <= bound for proof in proofs)
        what = f"{'lower' if side else 'upper'} bound of s of channel {q} at sample {time + self._origin}"
        self._count(holds, what)

    def _known_part(self, f: Array, time: int, v: int) -> fmpq:
        """Largest value of what u, the constant and w contribute to f'(x, u, 1, w)."""
        w, n, nu = self._arrays, self._size.n, self._size.nu
        total = exact(f[n + nu])
        for value, u in zip(f[n : n + nu], w["u"][time % (self._size.N + 1)], strict=True):
            total += exact(value) * exact(u)
        for value, low, high in zip(f[n + nu + 1 :], w["w_lower"][v], w["w_upper"][v], strict=True):
            total += exact(value) * exact(high if value > 0 else low)
        return total

    def _proven(self, basis: int | None, sample: int, direction: Array) -> fmpq | None:
        """The bound of a direction (in normal form) at a sample that multipliers prove about the model as it is given.

        They are those of the program solved last, whose basis is given; None: without any. The sample is one of the
        window, as the kernel counts.
        """
        w = self._arrays
        w["farkas"][:] = 0.0
        if basis is not None:
            k = int(w["k"][basis])
            w["farkas"][w["rows"][basis, :k]] = w["nu"][:k]
        found = self._certificate((sample, direction))
        return found.proven_bound(sample + self._origin, direction / self._form.x)

    def _count(self, holds: bool, what: str) -> None:
        self.checked += 1
        if not holds:
            self.unproven.append(what)

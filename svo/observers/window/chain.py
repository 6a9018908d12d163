"""The whole chain of a falsification: every bound from the first sample to the alarm, in exact arithmetic.

What a window proves is conditional on its arrival set and on the bounds of its channels' s. Run again over the log
with a `BoundProver`, each of those bounds is checked when it is made: the multipliers of its program prove, by weak
duality in rational arithmetic, a bound that is no larger. By induction the alarm then follows from the initial set, the
model and the log alone; where the set started again, from the largest set there, or from the readings since.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

from flint import fmpq

from polytopes.exact import rational
from polytopes.shown import Shown
from svo.checks import Array, expect_kind
from svo.logs.drive import drive
from svo.logs.log import Log, expect_log
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.memory import Memory
from svo.observers.window.observer import WindowObserver
from svo.observers.window.proof_steps import ProofSteps
from svo.observers.window.window import Window


@dataclass(frozen=True, eq=False)
class ChainCheck(Shown):
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
class LateMeasurement(Shown):
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
    expect_kind("observer", observer, WindowObserver, "a WindowObserver, the only kind proven")
    expect_log(log)
    begun = perf_counter()
    waiting = list(late)
    for i, measurement in enumerate(waiting):
        if not 0 <= measurement.taken <= measurement.arrived < len(log):
            raise ValueError(
                f"late[{i}] was taken at sample {measurement.taken} and arrived after {measurement.arrived}; expected "
                f"0 <= taken <= arrived <= {len(log) - 1}, the last sample of the log"
            )
    again = proving(observer)
    at = None
    for k, step in enumerate(drive(again, log)):
        for measurement in waiting:
            if measurement.arrived == k and step.verdict != "falsified":
                step = again.late_update(measurement.y, measurement.taken)
        if step.verdict == "falsified":
            at = k
            break
    prover = prover_of(again)
    certificate = step.certificate
    assert certificate is None or isinstance(certificate, WindowCertificate)  # it keeps the hulls
    return ChainCheck(
        proven=at is not None and not prover.unproven,
        falsified_at=at,
        bounds=prover.checked,
        unproven=tuple(prover.unproven),
        certificate=certificate,
        seconds=perf_counter() - begun,
        given=(start_of(again, 0) or "the first set", *promises_of(again)),
    )


def proving(observer: WindowObserver, steps: ProofSteps | None = None) -> WindowObserver:
    """An observer like another, before its first sample, that has each bound proven that it keeps.

    The proofs are collected by ``steps``, if these are given.
    """
    return observer.proving(lambda free: BoundProver(free, steps))


def prover_of(observer: WindowObserver) -> BoundProver:
    """Where an observer that `proving` gave stands."""
    assert isinstance(observer.prover, BoundProver)
    return observer.prover


def start_of(observer: WindowObserver, shift: int) -> str | None:
    """Where a set that started again did, its samples counted from ``shift``; None for the set it was given."""
    if observer.largest_at is not None:
        return f"the largest set at sample {shift + observer.largest_at}, where the set started again"
    if observer.free_since is not None:
        return f"nothing before sample {shift + observer.free_since}, from which on the readings alone bound the state"
    return None


def promises_of(observer: WindowObserver) -> tuple[str, ...]:
    """What is promised of the plant at all times, besides its model."""
    return () if observer.model.physical_range is None else ("the physical range",)


class BoundProver:
    """Proves the bounds of a window by the multipliers of the programs that gave them.

    Parameters
    ----------
    free : bool
        Whether the window's readings gave its first set: that bound has been proven where it was found.
    steps : ProofSteps, optional
        Told of every proof.

    Attributes
    ----------
    checked : int
        Bounds so far.
    unproven : list of str
        Those whose multipliers do not prove them.
    """

    def __init__(self, free: bool, steps: ProofSteps | None = None) -> None:
        self.checked, self.unproven, self._steps = int(free), list[str](), steps

    def arrival(self, window: Window, program: int) -> None:
        """The bound of the next arrival set that a program has just given."""
        arrays, i, lower = window.memory.arrays, program // 2, program % 2 == 1
        target = window.memory.base + window.memory.size.block
        bound = rational(-arrays["new_lower"][i] if lower else arrays["new_upper"][i])
        proof, proven = _proven(window, program, target, -arrays["T"][i] if lower else arrays["T"][i])
        if self._steps is not None:
            self._steps.arrival(window, program, target + window.origin, proof)
        what = f"arrival bound {program} of sample {target + window.origin}"
        self._count(proven is not None and proven <= bound, what)

    def channel(self, window: Window, q: int, side: int, is_open: bool) -> None:
        """s = f'(x, u, 1, w) <= s_upper, or -s <= -s_lower, by the program's multipliers or by none at all."""
        memory, arrays, size = window.memory, window.memory.arrays, window.memory.size
        v, time = memory.variables, memory.time
        f = (1.0 - 2.0 * side) * arrays["functional"][v, q]
        bound, known = (
            rational(arrays["s_upper"][v, q] if side == 0 else -arrays["s_lower"][v, q]),
            _known_part(memory, f),
        )
        bases = [4 * size.nt + 2 * q + side, None] if is_open else [None]
        holds = False
        for basis in bases:
            proof, proven = _proven(window, basis, time, f[: size.n])
            if proven is not None and proven + known <= bound:
                holds = True
                if self._steps is not None:
                    self._steps.channel(window, q, side, float(arrays["s_lower" if side else "s_upper"][v, q]), proof)
                break
        what = f"{'lower' if side else 'upper'} bound of s of channel {q} at sample {time + window.origin}"
        self._count(holds, what)

    def _count(self, holds: bool, what: str) -> None:
        self.checked += 1
        if not holds:
            self.unproven.append(what)


def _known_part(memory: Memory, f: Array) -> fmpq:
    """Largest value of what u, the constant and w of the newest sample contribute to f'(x, u, 1, w)."""
    arrays, n, nu, v = memory.arrays, memory.size.n, memory.size.nu, memory.variables
    total = rational(f[n + nu])
    for value, u in zip(f[n : n + nu], arrays["u"][memory.slot], strict=True):
        total += rational(value) * rational(u)
    for value, low, high in zip(f[n + nu + 1 :], arrays["w_lower"][v], arrays["w_upper"][v], strict=True):
        total += rational(value) * rational(high if value > 0 else low)
    return total


def _proven(window: Window, basis: int | None, sample: int, direction: Array) -> tuple[WindowCertificate, fmpq | None]:
    """The bound of a direction (in normal form) at a sample that multipliers prove about the model as it is given.

    They are those of the program solved last, whose basis is given; None: without any. The sample is one of the
    window, as the kernel counts.
    """
    arrays = window.memory.arrays
    arrays["farkas"][:] = 0.0
    if basis is not None:
        k = int(arrays["k"][basis])
        arrays["farkas"][arrays["rows"][basis, :k]] = arrays["multiplier"][:k]
    found = window.certificate((sample, direction))
    return found, found.proven_bound(sample + window.origin, direction / window.settings.form.x)

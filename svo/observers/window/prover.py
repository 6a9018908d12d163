"""Proves that a model explains no trajectory of a log up to a sample, by a chain of windows of its own choice.

What is claimed is about a model and a log, whoever raised the alarm: the chain need not be the observer's. It begins as
near to the alarm as it can, where the readings alone (`svo.observers.window.chain_starts`) or the physical range bound
the state, and goes back, twice as far each time, until the alarm is proven; at last from the first set. Its cost then
hardly depends on the length of the log. Every bound that a later one rests on is checked when it is made: the
multipliers of its program prove, by weak duality in rational arithmetic, a bound that is no larger.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flint import fmpq

from polytopes.exact import rational
from polytopes.shown import Shown
from svo.checks import Array
from svo.models.state_range import within
from svo.observers.given_units import arrival_in
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.chain_starts import Start, from_readings
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.memory import Memory, WindowSettings
from svo.observers.window.proof_steps import ProofSteps
from svo.observers.window.sample import Outgrown
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.window.window import Window

_EPS = 1e-9  # of the windows: their bounds are that much wider than what is proven of the model
_NEAREST, _FARTHEST = 4, 256  # samples before the alarm at which chains from no set of their own begin
_MOST_CELLS = 256  # of a window that is split by signs
_WHOLE, _HORIZON, _STRIDE = 64, 32, 24  # samples of a window that keeps all; of one that slides, and by how many


@dataclass(frozen=True, eq=False)
class ProvenChain(Shown):
    """A proof from its start to a falsification.

    Attributes
    ----------
    start : Start
    bounds : int
        Bounds of states and channels that it takes.
    certificate : WindowCertificate, SplitCertificate or None
        Of its last window; None where one reading excludes what is known.
    steps : list of dict
        As `docs/proof_format.md` has them.
    given : tuple of str
        What it rests on besides the model, its bounds and the log.
    """

    start: Start
    bounds: int
    certificate: WindowCertificate | SplitCertificate | None
    steps: list[dict[str, Any]]
    given: tuple[str, ...]


class ChainProver:
    """Proves falsifications of one model over one log.

    Parameters
    ----------
    of : ModelOnLog
    since : int
        Sample from which on the model is claimed to hold.
    begun : Start or None
        The set that is known there, or at a later sample, of which the proof may make use at last; None = none.
    template : (r, n) array, optional
        Directions besides the axes in which states are bounded where a window slides.
    """

    def __init__(self, of: ModelOnLog, since: int, begun: Start | None, template: Array | None = None) -> None:
        self._of, self._since, self._begun = of, since, begun
        self._template = np.zeros((0, of.model.n_states)) if template is None else template
        self.unproven: tuple[str, ...] = ()

    @property
    def reason(self) -> str:
        """Why the last claim was not proven."""
        if not self.unproven:
            return "no chain of windows is falsified, over convex hulls or split by signs"
        return f"{len(self.unproven)} bounds are not proven, first: {self.unproven[0]}"

    def prove(self, sample: int) -> ProvenChain | None:
        """The proof that no trajectory explains the readings up to a sample, or None; `reason` says why."""
        return self.over_hulls(sample) or self.by_signs(sample)

    def over_hulls(self, sample: int) -> ProvenChain | None:
        """The same of windows with the convex hull of each p = Delta s."""
        self.unproven = ()
        return self._of_windows(sample, 0)

    def by_signs(self, sample: int) -> ProvenChain | None:
        """The same, with the last window in cells, by the signs of its channels' s."""
        return self._of_windows(sample, _MOST_CELLS) if self._of.model.uncertainties else None

    def _of_windows(self, sample: int, cells: int) -> ProvenChain | None:
        for start in self.starts(sample):
            if self._emptiness(self._window(start, sample, None), sample, cells) is not None:
                found = self._proven(start, sample, cells)
                if found is not None:
                    return found
        return None

    def starts(self, sample: int) -> Iterator[Start]:
        """Starts before a sample, the nearest first."""
        before, physical, own = _NEAREST, self._of.model.physical_range, self._begun
        earliest = self._since if own is None else own.sample
        while before <= _FARTHEST and sample - before > earliest:
            found = from_readings(self._of, sample - before, sample)
            if found is not None:
                yield found
            if physical is not None and physical.is_bounded:
                yield Start("physical", sample - before, ArrivalSet.box(physical.lower, physical.upper))
            before *= 2
        if own is not None:
            yield own
        elif (found := from_readings(self._of, earliest, sample)) is not None:
            yield found

    def _window(self, start: Start, sample: int, prover: BoundProver | None) -> Window:
        form = self._of.form
        slides = sample - start.sample >= _WHOLE
        sizes = (_HORIZON, _STRIDE) if slides else (None, None)
        settings = WindowSettings(form, sizes[0], self._template * form.x, _EPS, 0, sizes[1])
        anchor = arrival_in(start.set, form)
        lower, upper = within(form.model.physical_range, anchor.box_lower, anchor.box_upper)
        anchor = replace(anchor, box_lower=lower, box_upper=upper)
        return Window(settings, anchor, origin=start.sample, prover=prover)

    def _emptiness(self, window: Window, sample: int, cells: int) -> WindowCertificate | SplitCertificate | None:
        """The proof that a window is empty once it has the samples up to one; None if there is none."""
        try:
            for k in range(window.origin, sample + 1):
                if window.take(self._of.sample(k)) == "falsified":
                    return window.proof
        except Outgrown:
            return None
        return window.by_signs(cells) if cells else None

    def _proven(self, start: Start, sample: int, cells: int) -> ProvenChain | None:
        """The same again, program by program, with each bound proven and written down."""
        steps = ProofSteps(start, self._template)
        prover = BoundProver(steps)
        window = self._window(start, sample, prover)
        proof = self._emptiness(window, sample, cells)
        if proof is None:
            return None
        if prover.unproven:
            self.unproven = tuple(prover.unproven)
            return None
        steps.alarm(proof)
        return ProvenChain(start, prover.checked, proof, steps.steps, self.given(start))

    def given(self, start: Start) -> tuple[str, ...]:
        """What a proof from a start on rests on."""
        promises = (start.premise, None if self._of.model.physical_range is None else "the physical range")
        return tuple(promise for promise in promises if promise is not None)


class BoundProver:
    """Proves the bounds of a window by the multipliers of the programs that gave them.

    Parameters
    ----------
    steps : ProofSteps
        Told of every proof.

    Attributes
    ----------
    checked : int
        Bounds so far.
    unproven : list of str
        Those whose multipliers do not prove them.
    """

    def __init__(self, steps: ProofSteps) -> None:
        self.checked, self.unproven, self._steps = 0, list[str](), steps

    def arrival(self, window: Window, program: int) -> None:
        """The bound of the next arrival set that a program has just given."""
        arrays, i, lower = window.memory.arrays, program // 2, program % 2 == 1
        target = window.memory.base + window.memory.size.block
        bound = rational(-arrays["new_lower"][i] if lower else arrays["new_upper"][i])
        proof, proven = proven_bound(window, program, target, -arrays["T"][i] if lower else arrays["T"][i])
        self._steps.arrival(window, program, target + window.origin, proof)
        what = f"arrival bound {program} of sample {target + window.origin}"
        self._count(proven is not None and proven <= bound, what)

    def channel(self, window: Window, q: int, side: int, is_open: bool) -> None:
        """s = f'(x, u, 1, w) <= s_upper, or -s <= -s_lower, by the program's multipliers or by none at all."""
        memory, arrays, size = window.memory, window.memory.arrays, window.memory.size
        v, time = memory.variables, memory.time
        f = (1.0 - 2.0 * side) * arrays["functional"][v, q]
        end = float(arrays["s_lower" if side else "s_upper"][v, q])
        bound, known = rational(-end if side else end), _known_part(memory, f)
        bases = [4 * size.nt + 2 * q + side, None] if is_open else [None]
        holds = False
        for basis in bases:
            proof, proven = proven_bound(window, basis, time, f[: size.n])
            if proven is not None and proven + known <= bound:
                holds = True
                self._steps.channel(q, side, end, proof)
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


def proven_bound(
    window: Window, basis: int | None, sample: int, direction: Array
) -> tuple[WindowCertificate, fmpq | None]:
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

"""What the programs of a window say: whether anything explains its samples, and the bounds that follow.

An empty window counts only once its certificate is proven in exact arithmetic. All in normal form.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np

from svo.checks import Array
from svo.models.normal_form import ENORMOUS
from svo.observers import window_kernel as kernel
from svo.observers.answers import NO_PROOF, OUT_OF_TIME, VerdictName
from svo.observers.given_units import window_out
from svo.observers.window.certificate import WindowCertificate, certificate_of
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.fallback import candidates, is_feasible
from svo.observers.window.memory import Memory, WindowSettings
from svo.observers.window.sign_split import SplitCertificate, SplitPrograms

_PIVOTS_BETWEEN_LOOKS = 8  # at the clock: some 20 microseconds


class Programs:
    """The programs over a window's memory, and what their multipliers prove.

    Parameters
    ----------
    settings : WindowSettings
    memory : Memory
    anchor, origin, free : ArrivalSet, int, bool
        As of `Window`.

    Attributes
    ----------
    memory : Memory
    proof, reason : optional
        As of `Window`.
    given : (ny,) array or None
        The newest measurement in the user's units.
    """

    def __init__(self, settings: WindowSettings, memory: Memory, anchor: ArrivalSet, origin: int, free: bool) -> None:
        self._settings, self.memory, self._anchor, self._origin, self._free = settings, memory, anchor, origin, free
        self.proof: WindowCertificate | SplitCertificate | None = None
        self.reason: str | None = None
        self.given: Array | None = None

    @property
    def stopped(self) -> int:
        """Programs that ended at a limit."""
        return int(self.memory.arrays["clock"][kernel.STOPS])

    # -- solutions ---------------------------------------------------------------------------------

    def solve(self, task: int) -> VerdictName:
        """Solve the programs of a task."""
        memory = self.memory
        if self._settings.sign_split:
            split = SplitPrograms(memory, self.certificate, self._settings.sign_split)
            if split.is_needed:
                return self._solve_split(split, task)
        verdict, program = memory.solve(task, 0, kernel.ALL, kernel.UNLIMITED)
        return self.conclude(task, verdict, program)

    def decide(self, end: float | None, shown: Callable[[int], None] | None = None) -> VerdictName:
        """Whether anything explains the window, and the next arrival set, by the time ``end`` if there is one.

        Each program that gives a bound of that set is ``shown`` right after it.
        """
        if end is None and shown is None:
            return self.solve(kernel.ARRIVAL)
        memory, decided = self.memory, False
        is_full = memory.time - memory.base > memory.size.N - memory.size.block
        for program in kernel.arrival_programs(memory.address):
            verdict = self.solve_one(kernel.ARRIVAL, program, end)
            if verdict == kernel.EMPTY_CANDIDATE and self._prove():
                return "falsified"
            decided = decided or verdict == kernel.CONSISTENT
            if shown is not None and is_full:
                shown(program)
        if end is None:
            return "consistent" if decided else self._ask_highs()
        if memory.time - memory.base == memory.size.N:
            memory.arrays["clock"][kernel.PENDING] = 1
        return "consistent" if decided else self.undecided(OUT_OF_TIME)

    def conclude(self, task: int, verdict: int, program: int) -> VerdictName:
        """What the programs of a task say; those after one that found the window empty have yet to be solved."""
        memory = self.memory
        while verdict == kernel.EMPTY_CANDIDATE:
            if task == kernel.ARRIVAL and self._prove():
                return "falsified"
            after = program + 1
            verdict, program = memory.solve(task, after, kernel.ALL, kernel.UNLIMITED)
        if verdict == kernel.CONSISTENT:
            return "consistent"
        return self._ask_highs() if task == kernel.ARRIVAL else "undecided"

    def solve_one(self, task: int, program: int, end: float | None) -> int:
        """One program, its pivots in portions until it is decided or the time ``end`` is reached, if there is one."""
        memory, stopped = self.memory, self.stopped
        while True:
            over = end is None or perf_counter() >= end
            portion = kernel.UNLIMITED if end is None else 0 if over else _PIVOTS_BETWEEN_LOOKS
            verdict, _ = memory.solve(task, program, program + 1, portion)
            if over or verdict != kernel.UNDECIDED:
                memory.arrays["clock"][kernel.STOPS] = min(self.stopped, stopped + (verdict == kernel.UNDECIDED))
                return int(verdict)

    def _solve_split(self, split: SplitPrograms, task: int) -> VerdictName:
        """As `solve`, each program over its cells."""
        memory = self.memory
        fixed = {kernel.NEWEST: range(2 * memory.size.nt), kernel.QUERY: range(1)}
        prefix = {kernel.ARRIVAL: "new", kernel.NEWEST: "now"}.get(task)
        has_point = False
        for program in fixed.get(task) or kernel.arrival_programs(memory.address):
            sign = 1.0 - 2.0 * (program % 2)
            name = "answer" if prefix is None else f"{prefix}_{'lower' if program % 2 else 'upper'}"
            at = 0 if prefix is None else program // 2
            result = split.solve(task, program, lambda t=name, i=at, s=sign: float(s * memory.arrays[t][i]))  # type: ignore[misc]
            has_point = has_point or result.has_point
            if result.proof is None:
                memory.arrays[name][at] = sign * result.value
            elif task == kernel.ARRIVAL and result.proof.verify():
                self.proof = result.proof
                return "falsified"
        return "consistent" if has_point else self.undecided(NO_PROOF)

    def by_signs(self, cells: int) -> SplitCertificate | None:
        """The proof that the window is empty whatever the signs of its s, in at most so many cells, if found."""
        split, arrays = SplitPrograms(self.memory, self.certificate, cells), self.memory.arrays
        if not split.is_needed:
            return None
        proof = split.solve(kernel.ARRIVAL, 0, lambda: float(arrays["new_upper"][0])).proof
        return proof if proof is not None and proof.verify() else None

    def _ask_highs(self) -> VerdictName:
        arrays = self.memory.arrays
        feasible, ray = is_feasible(arrays["G"], arrays["lower"], arrays["upper"])
        if feasible is False:
            for multipliers in candidates(ray):
                arrays["farkas"][:] = multipliers
                if self._prove():
                    return "falsified"
        return "consistent" if feasible else self.undecided(NO_PROOF)

    def undecided(self, why: str) -> VerdictName:
        """That, with its reason."""
        self.reason = why
        return "undecided"

    # -- proofs --------------------------------------------------------------------------------------

    def certificate(self, objective: tuple[int, Array] | None = None) -> WindowCertificate:
        """Of the multipliers at hand, about the model and the data as given.

        ``objective`` is a sample of the window, as the kernel counts, and a direction, in normal form, whose bound is
        to be proven.
        """
        arrays, size = self.memory.arrays, self.memory.size
        if self._settings.injection is not None:
            found = self._settings.injection.certificate(arrays, size, self._arrival(), objective)
        else:
            found = certificate_of(arrays, size, self._arrival())
        found = replace(found, first=found.first + self._origin, last=found.last + self._origin)
        out, beyond = window_out(found, self._settings.form), np.abs(found.samples[-1].y) == ENORMOUS
        if self.given is None or not beyond.any():
            return out
        newest = replace(out.samples[-1], y=np.where(beyond, self.given, out.samples[-1].y))
        return replace(out, samples=(*out.samples[:-1], newest))

    def _arrival(self) -> ArrivalSet:
        if self.memory.base == 0:
            return self._anchor
        n, arrays = self._settings.form.model.n_states, self.memory.arrays
        lower, upper = arrays["h_lower"].copy(), arrays["h_upper"].copy()
        return ArrivalSet(lower[:n], upper[:n], self._settings.template, lower[n:], upper[n:])

    def _prove(self) -> bool:
        """Whether the multipliers at hand prove in exact arithmetic that the window is empty; keeps the proof."""
        self.proof = next((statement for statement in self._statements() if statement.verify()), None)
        return self.proof is not None

    def prove_again(self) -> None:
        """Prove that the window is empty once it is taken back from a saved state; ValueError if it cannot be."""
        if self._settings.sign_split:
            self.solve(kernel.ARRIVAL)
        self.proof = self.proof or next(self._statements())
        if not self.proof.verify():
            raise ValueError("its falsification cannot be proven again")

    def _statements(self) -> Iterator[WindowCertificate]:
        """What the multipliers may prove: of a window that its readings alone began, first without any arrival set."""
        certificate = self.certificate()
        if self._free and self.memory.base == 0:
            unknown = ArrivalSet.unknown(self._settings.form.model.n_states)
            yield replace(certificate, arrival=unknown, on_arrival=np.zeros(0))
        yield certificate

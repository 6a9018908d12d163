"""Samples that enter a window, and the programs that decide whether it is empty and bound its states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from svo.checks import Array
from svo.observers import window_kernel as kernel
from svo.observers.answers import VerdictName
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.fallback import candidates, is_feasible
from svo.observers.window.memory import WindowMemory
from svo.observers.window.sign_split import SplitPrograms

_PIVOTS_BETWEEN_LOOKS = 8  # at the clock: some 20 microseconds
_ENTRY_ERRORS = {
    kernel.BAD_MATRIX: "the model's matrices at this schedule contain NaN or Inf; expected finite numbers",
    kernel.RANK_ROSE: "an uncertainty has a higher rank at this sample than at the model's typical schedule",
}


class Outgrown(Exception):
    """The newest state has no bounds of use: the window is of no more use either."""


def check_matrices(stack: Array) -> None:
    """What the kernel checks of a sample's matrices."""
    if not np.isfinite(stack).all():
        raise ValueError(_ENTRY_ERRORS[kernel.BAD_MATRIX])


def _check_entry(code: int) -> None:
    """What the kernel says of a sample; u and y have been checked before."""
    if code in _ENTRY_ERRORS:
        raise ValueError(_ENTRY_ERRORS[code])


def _of_one_layout(data: tuple[Any, ...]) -> tuple[Any, ...]:
    """Copies of a sample's arrays, behind window, size and flag: kernels compile anew for each layout they meet."""
    return (*data[:3], *(np.array(array, order="C") for array in data[3:]))


class WindowPrograms(WindowMemory):
    """Verdicts about a window. "Falsified" is kept, with the proof that was checked."""

    def _take(self, data: tuple[Any, ...]) -> VerdictName:
        """One sample with all its programs, in one compiled call unless the window seems empty."""
        if self.sign_split or self._injection is not None:
            self._enter(data)
            return self._solve(kernel.ARRIVAL)
        code, verdict, program = kernel.take(*_of_one_layout(data), self.eps, kernel.PIVOT_LIMIT)
        _check_entry(code)
        if code == kernel.OUTGROWN:
            raise Outgrown
        if verdict == kernel.CONSISTENT:
            return "consistent"
        return self._conclude(kernel.ARRIVAL, verdict, program)

    def _enter(self, data: tuple[Any, ...], end: float | None = None) -> None:
        """One sample without its programs, but for those of its channels, which stop at the time ``end``."""
        injected, given = False, data
        if self._injection is not None:
            data, injected = self._inject(data)
        code = kernel.enter(*_of_one_layout(data))
        _check_entry(code)
        self._settle_channels(code == kernel.SIGN_OPEN, False, end)
        code = kernel.move(*data[:3])
        w, s = self._arrays, self._time % (self._size.N + 1)
        if self._injection is not None:
            w["given.stack"][s], w["given.y"][s], w["given.injected"][s] = given[6], given[5], injected
            w["given.slack"][s] = 0.0
        self._settle_channels(code == kernel.SIGN_OPEN, True, end)
        if injected:
            self._widen(given)
        if not kernel.complete(*data[:2], self.eps):
            raise Outgrown
        if self._injection is not None and not injected:
            w["given.slack"][s] = w["slack"][s]

    def _inject(self, data: tuple[Any, ...]) -> tuple[tuple[Any, ...], bool]:
        """A sample's data with w injected where y is complete."""
        assert self._injection is not None
        *head, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper = data
        stack, y, noise, injected = self._injection.transform(stack, y, (w_lower, w_upper))
        none = np.zeros(self.model.n_states)
        bounds = (np.concatenate([b, none]) for b in (w_old_lower, w_old_upper, w_lower, w_upper))
        return (*head, y, stack, noise, *bounds), injected

    def _widen(self, given: tuple[Any, ...]) -> None:
        """Bounds of what the injection leaves to the state and to the box of w, by what is known of the state."""
        assert self._injection is not None
        u, y, stack, w = given[4], given[5], given[6], given[10:12]
        s, v = self._time % (self._size.N + 1), self._time % (self._size.N + self._size.late)
        arrays, nw = self._arrays, self.model.n_disturbances
        d, widening, slack = self._injection.widths(stack, y, u, arrays["mag"][s], w, self.eps)
        arrays["w_lower"][v, nw:], arrays["w_upper"][v, nw:] = -d, d
        arrays["noise"][s] += widening
        arrays["given.slack"][s] = slack

    def _channels(self, reaching: bool) -> list[int]:
        """Those of the newest sample that reach the output, or those that do not."""
        gain = self._arrays["gain"][self._time % (self._size.N + self._size.late)]
        found: list[int] = np.flatnonzero(gain[:, self._size.n :].any(axis=1) == reaching).tolist()
        return found

    def _settle_channels(self, sign_open: bool, reaching: bool, end: float | None = None) -> None:
        """Tighten the bounds of those s whose sign is open, of the channels that reach the output or of the others."""
        w, v = self._arrays, self._time % (self._size.N + self._size.late)
        for q in self._channels(reaching) if sign_open else ():
            for program in (2 * q, 2 * q + 1):
                if not w["s_lower"][v, q] < 0.0 < w["s_upper"][v, q]:
                    continue
                if end is None:
                    self._solve_one(kernel.CHANNELS, program)
                else:
                    self._solve_in_portions(kernel.CHANNELS, program, end)

    def _solve_one(self, task: int, program: int) -> int:
        """What one program of a task says."""
        return int(kernel.solve(self._window, self._size, task, program, program + 1, kernel.PIVOT_LIMIT)[0])

    def _solve(self, task: int) -> VerdictName:
        """Solve the programs of a task; an empty window counts only once its certificate is proven."""
        if self.sign_split and task != kernel.CHANNELS:
            split = SplitPrograms(self._arrays, self._window, self._size, self._certificate, self.sign_split)
            if split.is_needed:
                return self._solve_split(split, task)
        verdict, program = kernel.solve(self._window, self._size, task, 0, kernel.ALL, kernel.PIVOT_LIMIT)
        return self._conclude(task, verdict, program)

    def _conclude(self, task: int, verdict: int, program: int) -> VerdictName:
        """What the programs of a task say; those after one that found the window empty have yet to be solved."""
        while verdict == kernel.EMPTY_CANDIDATE:
            if task == kernel.ARRIVAL and self._prove():
                return "falsified"
            after = program + 1
            verdict, program = kernel.solve(self._window, self._size, task, after, kernel.ALL, kernel.PIVOT_LIMIT)
        if verdict == kernel.CONSISTENT:
            return "consistent"
        return self._ask_highs() if task == kernel.ARRIVAL else "undecided"

    def _solve_split(self, split: SplitPrograms, task: int) -> VerdictName:
        """As `_solve`, each program over its cells."""
        w, clock = self._arrays, self._arrays["clock"]
        base, time = int(clock[kernel.BASE]), int(clock[kernel.TIME])
        programs = {
            kernel.ARRIVAL: range(*kernel.arrival_programs.py_func(self._size, base, time)),
            kernel.NEWEST: range(2 * self._size.nt),
            kernel.QUERY: range(1),
        }[task]
        prefix = {kernel.ARRIVAL: "new", kernel.NEWEST: "now"}.get(task)
        has_point = False
        for program in programs:
            sign = 1.0 - 2.0 * (program % 2)
            target = w["answer"] if prefix is None else w[f"{prefix}_{'lower' if program % 2 else 'upper'}"]
            at = 0 if prefix is None else program // 2
            result = split.solve(task, program, lambda t=target, i=at, s=sign: float(s * t[i]))  # type: ignore[misc]
            has_point = has_point or result.has_point
            if result.proof is None:
                target[at] = sign * result.value
            elif task == kernel.ARRIVAL and result.proof.verify():
                self._falsified = result.proof
                return "falsified"
        return "consistent" if has_point else "undecided"

    def _solve_until(self, end: float) -> VerdictName:
        """The arrival programs in small portions of pivots, until a time is reached."""
        clock, decided = self._arrays["clock"], False
        base, time = clock[kernel.BASE], clock[kernel.TIME]
        for program in range(*kernel.arrival_programs.py_func(self._size, base, time)):
            verdict = self._solve_in_portions(kernel.ARRIVAL, program, end)
            if verdict == kernel.EMPTY_CANDIDATE and self._prove():
                return "falsified"
            decided = decided or verdict == kernel.CONSISTENT
        if time - base == self._size.N:
            clock[kernel.PENDING] = 1
        return "consistent" if decided else "undecided"

    def _solve_in_portions(self, task: int, program: int, end: float) -> int:
        """One program, its pivots in portions until it is decided or the time ``end`` is reached."""
        verdict, late, done = kernel.UNDECIDED, False, 0
        while verdict == kernel.UNDECIDED and not late:
            late = perf_counter() >= end or done >= kernel.PIVOT_LIMIT
            portion = 0 if late else _PIVOTS_BETWEEN_LOOKS
            verdict, _ = kernel.solve(self._window, self._size, task, program, program + 1, portion)
            done += portion
        return int(verdict)

    def _prove(self) -> bool:
        """Whether the multipliers at hand prove in exact arithmetic that the window is empty; keeps the proof."""
        for certificate in self._statements():
            if certificate.verify():
                self._falsified = certificate
                return True
        return False

    def _statements(self) -> Iterator[WindowCertificate]:
        """What the multipliers may prove: of a window that its readings alone began, first without any arrival set."""
        certificate = replace(self._certificate(), largest_at=self.largest_at)
        if self._free and self._arrays["clock"][kernel.BASE] == 0:
            yield replace(certificate, arrival=ArrivalSet.unknown(self.model.n_states), on_arrival=np.zeros(0))
        yield certificate

    def _prove_again(self) -> None:
        """The proof of a falsification, from the window alone."""
        if self.sign_split:
            self._solve(kernel.ARRIVAL)
        if self._falsified is None:
            self._falsified = next(self._statements())

    def _check_restored(self, falsified: bool) -> None:
        """Raise ValueError if a clock that was read back is none, or its falsification cannot be proven again."""
        clock = self._arrays["clock"]
        base, time, steps = int(clock[kernel.BASE]), int(clock[kernel.TIME]), self._size.N
        flags = clock[[kernel.STARTED, kernel.PENDING]]
        if not (0 <= base <= time <= base + steps and np.isin(flags, (0, 1)).all() and (clock >= 0).all()):
            raise ValueError(f"its window holds samples {base} to {time}; expected at most {steps} steps from 0 on")
        if falsified:
            self._prove_again()
            if self._falsified is None or not self._falsified.verify():
                raise ValueError("its falsification cannot be proven again")

    def _ask_highs(self) -> VerdictName:
        w = self._arrays
        feasible, ray = is_feasible(w["G"], w["lower"], w["upper"])
        if feasible is False:
            for multipliers in candidates(ray):
                w["farkas"][:] = multipliers
                if self._prove():
                    return "falsified"
        return "consistent" if feasible else "undecided"

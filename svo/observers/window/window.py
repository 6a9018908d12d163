"""A window: samples since a set of first states, and the programs that decide whether anything explains them.

Observers drive it, and so do the chains of whole proofs: a window that has a `Prover` shows it every bound that it
keeps. All in normal form.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.observers import window_kernel as kernel
from svo.observers.answers import VerdictName
from svo.observers.readings import OUTSIDE
from svo.observers.relinearised_kernel import BOX_WITHOUT_ROOM, TAKEN, WITHOUT_ROOM, Followed, PlantSamples
from svo.observers.saved_state import arrays_of, take_exactly
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_samples import LogSamples
from svo.observers.window.memory import FIXED, Memory, WindowSettings
from svo.observers.window.programs import Programs
from svo.observers.window.relinearised import Relinearised
from svo.observers.window.sample import Outgrown, Sample, check_entry
from svo.observers.window.sign_split import SplitCertificate

Taken = tuple[int, int, int]
"""What the kernel tells of a sample that it took: code, verdict, program that found the window empty."""

_NO_END = 1 << 30  # samples


class Prover(Protocol):
    """Checks the bounds of a window when they are made."""

    def arrival(self, window: Window, program: int) -> None:
        """The bound of the next arrival set that a program has just given."""
        ...

    def channel(self, window: Window, q: int, side: int, is_open: bool) -> None:
        """The upper (0) or lower (1) bound of s of a channel of the newest sample, by its program if it is open."""
        ...


class Window:
    """Samples in one block of memory, the programs over them, and the proof that nothing explains them.

    Parameters
    ----------
    settings : WindowSettings
    anchor : ArrivalSet
        Contains the state at the first sample.
    steps : int, optional
        That the window has room for.
    origin : int
        Number that the observer gives to the first sample.
    free : bool
        Whether the anchor follows from the window's own readings.
    prover : Prover, optional
        Convex hulls are then kept, and programs solved one by one.
    """

    def __init__(
        self,
        settings: WindowSettings,
        anchor: ArrivalSet,
        steps: int | None = None,
        origin: int = 0,
        free: bool = False,
        prover: Prover | None = None,
    ) -> None:
        self.settings, self.anchor, self.origin, self.free, self.prover = settings, anchor, origin, free, prover
        self._model, self._injection = settings.form.model, settings.injection
        memory = Memory(settings, len(anchor.rows), settings.first_steps if steps is None else steps)
        self._programs = Programs(settings, memory, anchor, origin, free)
        n, arrays = self._model.n_states, self.memory.arrays
        arrays["h_lower"][:n], arrays["h_upper"][:n] = anchor.box_lower, anchor.box_upper
        kernel.initialise(self.memory.address, anchor.rows, anchor.lower, anchor.upper)

    @property
    def memory(self) -> Memory:
        """Its samples, and the state of its programs."""
        return self._programs.memory

    @property
    def proof(self) -> WindowCertificate | SplitCertificate | None:
        """That the window is empty, about the model and the data as given."""
        return self._programs.proof

    def by_signs(self, cells: int) -> SplitCertificate | None:
        """A proof that it is empty whatever the signs of its s, in at most so many cells; None if none was found."""
        return self._programs.by_signs(cells)

    @property
    def reason(self) -> str | None:
        """Why the newest verdict is "undecided", where that is known."""
        return self._programs.reason

    # -- samples -----------------------------------------------------------------------------------

    @property
    def oldest(self) -> int:
        """Number of the first sample that is still there."""
        return self.origin + self.memory.base

    @property
    def newest(self) -> int:
        """Number of the newest sample; -1 before the first."""
        return self.origin + self.memory.time if self.memory.started else -1

    @property
    def stopped(self) -> int:
        """Programs that ended at a limit."""
        return self._programs.stopped

    def take(self, sample: Sample, end: float | None = None) -> VerdictName:
        """The next sample, by the time ``end`` if there is one; the window is unchanged if it raises ValueError.

        Raises
        ------
        ValueError
            For matrices that are not finite, or an uncertainty of a higher rank than at the typical schedule.
        Outgrown
            If the newest state has no bounds of use.
        """
        memory = self._begun()
        if self._room == 0:
            memory = self._grow()
        if self._takes_whole and end is None:
            return self.concluded(memory.take(sample, self.settings.eps), sample.given)
        self._enter(sample, end)
        return self._cut_arrival(self._decided(end))

    def take_many(self, samples: LogSamples, boxes: Array | None) -> tuple[int, Taken]:
        """The next samples, as many as are simply consistent; `concluded` says what became of the one after them.

        Parameters
        ----------
        samples : LogSamples
            No more than `takes_at_once` of them.
        boxes : (k, 2, n) array, optional
            Filled with the boxes of the states at the samples that are consistent.
        """
        memory, eps = self._begun(), self.settings.eps
        done, told = kernel.follow(memory.address, samples, eps, kernel.UNLIMITED, boxes)
        return done, memory.go_on(told, eps)

    def move_relinearised(self, plant: Relinearised, u: Array, dt: float | None) -> None:
        """The transition of a nonlinear plant from the newest sample, as `Relinearised.move`."""
        while not plant.move(self.memory.address, u, dt):
            self.memory.enlarge(2 * self.memory.size.K)

    def take_relinearised(self, plant: Relinearised, samples: PlantSamples, boxes: Array | None) -> Followed:
        """As `take_many`, of a nonlinear plant; the sample after them is not taken where it is not linearised."""
        memory, eps = self._begun(), self.settings.eps
        found, count = plant.follow(memory.address, samples, eps, boxes), len(samples.T)
        while found.end in (WITHOUT_ROOM, BOX_WITHOUT_ROOM):
            memory.enlarge(2 * memory.size.K)
            if found.end == BOX_WITHOUT_ROOM:
                break
            done = found.done
            rest = plant.follow(memory.address, samples.after(done), eps, None if boxes is None else boxes[done:])
            found = rest._replace(done=done + rest.done)
        if found.done < count and found.end == TAKEN:
            found = found._replace(told=memory.go_on(found.told, eps))
        self._programs.given = samples.y[min(found.done, count - 1)]
        return found

    @property
    def takes_at_once(self) -> int:
        """How many samples one call of the kernel may take; 0 where each is more than one."""
        return self._room if self._takes_whole else 0

    def handed_over(self, given: Array) -> Sample:
        """The sample that the kernel was last given, whose measurement was ``given`` in the user's units."""
        names = Sample._fields[:-1]
        return Sample._make([*(self.memory.arrays[f"in_{name}"].copy() for name in names), given])

    def concluded(self, told: Taken, given: Array) -> VerdictName:
        """What the kernel told of a whole sample comes to, whose measurement was ``given`` in the user's units.

        Raises
        ------
        ValueError, Outgrown
            As `take`.
        """
        code, found, program = told
        check_entry(code)
        self._programs.given = given
        if code == kernel.OUTGROWN:
            raise Outgrown
        return self._cut_arrival(self._programs.conclude(kernel.ARRIVAL, found, program))

    @property
    def _takes_whole(self) -> bool:
        """Whether a sample is one call of the kernel."""
        return not self.settings.sign_split and self._injection is None and self.prover is None

    @property
    def _room(self) -> int:
        """Samples until the memory of a window that keeps all of them must grow."""
        memory = self.memory
        if self.settings.horizon is not None:
            return _NO_END
        return memory.size.N - memory.time - 1 if memory.started else memory.size.N

    def move_by(self, rows: Array) -> None:
        """Replace the transition from the newest sample, which is read at the next one, by that of state rows.

        Those (items, n, columns) of uncertainties belong to channels that do not reach the output
        (`svo.models.intervals.check_splits`), or are as they were.
        """
        memory, arrays = self.memory, self.memory.arrays
        if not memory.started:
            return
        stack = arrays["stack"][memory.slot]
        stack[:, : self._model.n_states] = rows
        if memory.size.late and memory.size.nq:
            v = memory.variables
            gain, functional, left, complete = kernel.channel_factors(stack, arrays["owner"], arrays["delta"])
            check_entry(kernel.FINE if complete else kernel.RANK_ROSE)
            arrays["gain"][v], arrays["functional"][v], arrays["left"][v] = gain, functional, left
            arrays["is_left"][v] = left.any()

    def add_late(self, y: Array, sample: int) -> VerdictName:
        """A measurement of a sample that is still there."""
        own, memory, self._programs.reason = sample - self.origin, self.memory, None
        memory.arrays["in_y"][:] = y
        kernel.add_late(memory.address, own, self.settings.eps)
        if self._injection is not None:  # the sample was incomplete, so it is as it was given
            s, arrays = own % (memory.size.N + 1), memory.arrays
            arrays["given.y"][s], arrays["given.slack"][s] = arrays["y"][s], arrays["slack"][s]
        return self._cut_arrival(self._decided(None))

    def read_at(self, sample: int) -> Array:
        """What was read at a sample that is still there."""
        read: Array = self.memory.arrays["y"][(sample - self.origin) % (self.memory.size.N + 1)]
        return read

    def solve(self, task: int) -> VerdictName:
        """Solve the programs of a task."""
        return self._programs.solve(task)

    def certificate(self, objective: tuple[int, Array] | None = None) -> WindowCertificate:
        """As `Programs.certificate`."""
        return self._programs.certificate(objective)

    def forget_proof(self) -> None:
        """Of a falsification that is none of the observer's."""
        self._programs.proof = None

    def newest_bounds(self) -> tuple[Array, Array]:
        """Bounds of the newest state along the axes, then the template."""
        self.solve(kernel.NEWEST)
        return self.memory.arrays["now_lower"].copy(), self.memory.arrays["now_upper"].copy()

    def support(self, direction: Array) -> float:
        """Upper bound of a direction of the newest state."""
        self.memory.arrays["query"][:] = direction
        self.solve(kernel.QUERY)
        return float(self.memory.arrays["answer"][0])

    def blur(self, stack: Array) -> Array:
        """The slack of each row of the newest sample that comes from the width of the set."""
        arrays, s, n = self.memory.arrays, self.memory.slot, self._model.n_states
        width = arrays["mag"][s] - np.abs(arrays["phi"][s])
        blur: Array = self.settings.eps * np.abs(stack[0, n:, :n]) @ np.maximum(width, 0.0)
        return blur

    # -- saved states ----------------------------------------------------------------------------------

    def state(self) -> dict[str, NDArray]:
        """Everything but settings and prover, as named arrays."""
        return arrays_of("anchor", self.anchor) | self.memory.kept

    def resume(self, state: Mapping[str, NDArray], falsified: bool) -> None:
        """Take back the memory that `state` gave; ValueError unless it is one, and its falsification proven again."""
        basis = state["inverse"].shape[-1]
        if basis > self.memory.size.K:
            self.memory.enlarge(basis)
        fixed = {name: self.memory.arrays[name].copy() for name in FIXED}
        take_exactly(self.memory.kept, state)
        self.memory.check_clock()
        for name, array in fixed.items():
            if not np.array_equal(array, self.memory.arrays[name]):
                raise ValueError(f"{name} is not that of its model and options")
        if falsified:
            self._programs.prove_again()

    # -- what a sample comes to --------------------------------------------------------------------------

    def _begun(self) -> Memory:
        """The memory, before it is given the next sample."""
        self._programs.reason = None
        self.memory.check_whole()
        return self.memory

    def _decided(self, end: float | None) -> VerdictName:
        prover = self.prover
        shown = None if prover is None else lambda program: prover.arrival(self, program)
        return self._programs.decide(end, shown)

    def _grow(self) -> Memory:
        smaller = self.memory
        larger = Memory(self.settings, len(self.anchor.rows), 2 * smaller.size.N, least_basis=smaller.size.K)
        larger.copy_from(smaller)
        self._programs.memory = larger
        return larger

    def _hand_over(self, sample: Sample) -> None:
        """Write a sample to where the kernel reads it."""
        arrays, nw = self.memory.arrays, len(sample.w_lower)  # d, where w is injected, has no bounds of the model
        arrays["in_u"][:], arrays["in_u_next"][:], arrays["in_y"][:] = sample.u, sample.u_next, sample.y
        arrays["in_stack"][:], arrays["in_noise"][:] = sample.stack, sample.noise
        arrays["in_w_lower"][:nw], arrays["in_w_upper"][:nw] = sample.w_lower, sample.w_upper

    def _enter(self, sample: Sample, end: float | None) -> None:
        """One sample without its programs, but for those of its channels, which stop at the time ``end``."""
        entered, injected = sample, False
        if self._injection is not None:
            w = sample.w_lower, sample.w_upper
            stack, y, noise, injected = self._injection.transform(sample.stack, sample.y, w)
            entered = sample._replace(stack=stack, y=y, noise=noise)
        memory, is_first = self.memory, not self.memory.started
        self._hand_over(entered)
        code = kernel.enter(memory.address)
        check_entry(code)
        self._programs.given = sample.given
        self._settle_channels(code == kernel.SIGN_OPEN, False, is_first, end)
        code, s = kernel.move(memory.address), memory.slot
        if self._injection is not None:
            arrays = memory.given
            arrays["given.stack"][s], arrays["given.y"][s] = sample.stack, sample.y
            arrays["given.injected"][s], arrays["given.slack"][s] = injected, 0.0
        self._settle_channels(code == kernel.SIGN_OPEN, True, is_first, end)
        if injected:
            self._widen(sample)
        if not kernel.complete(memory.address, self.settings.eps):
            raise Outgrown
        if self._injection is not None and not injected:
            memory.given["given.slack"][s] = memory.arrays["slack"][s]

    def _widen(self, sample: Sample) -> None:
        """Bounds of what the injection leaves to the state and to the box of w, by what is known of the state."""
        assert self._injection is not None
        arrays, s, v, nw = self.memory.arrays, self.memory.slot, self.memory.variables, self._model.n_disturbances
        bounds = sample.w_lower, sample.w_upper
        d, widening, slack = self._injection.widths(
            sample.stack, sample.y, sample.u_next, arrays["mag"][s], bounds, self.settings.eps
        )
        arrays["w_lower"][v, nw:], arrays["w_upper"][v, nw:] = -d, d
        arrays["noise"][s] += widening
        arrays["given.slack"][s] = slack

    def _settle_channels(self, sign_open: bool, reaching: bool, is_first: bool, end: float | None) -> None:
        """Tighten the bounds of those s whose sign is open, of the channels that reach the output or of the others."""
        arrays, v = self.memory.arrays, self.memory.variables
        if not sign_open and (self.prover is None or (is_first and not reaching)):
            return  # no transition leads to the first sample
        gain = arrays["gain"][v][:, self._model.n_states :]
        for q in np.flatnonzero(gain.any(axis=1) == reaching).tolist():
            for side in range(2):
                arrays = self.memory.arrays  # a program may have moved them
                is_open = sign_open and arrays["s_lower"][v, q] < 0.0 < arrays["s_upper"][v, q]
                if is_open:
                    self._programs.solve_one(kernel.CHANNELS, 2 * q + side, end)
                if self.prover is not None:
                    self.prover.channel(self, q, side, is_open)

    def _cut_arrival(self, verdict: VerdictName) -> VerdictName:
        """The next arrival set, once it is known, within the physical range."""
        physical, arrays, n = self._model.physical_range, self.memory.arrays, self._model.n_states
        if physical is None or not arrays["clock"][kernel.PENDING] or verdict == "falsified":
            return verdict
        arrays["new_lower"][:n], arrays["new_upper"][:n], meets = physical.cut(
            arrays["new_lower"][:n], arrays["new_upper"][:n]
        )
        if meets:
            return verdict
        return self._programs.undecided(OUTSIDE)  # not proven, so no alarm

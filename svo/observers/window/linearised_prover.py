"""Proves that a nonlinear model explains no trajectory of a log, by linearisations over boxes that are proven.

At each sample the chain bounds the state by programs over its window; over that box the plant is linearised, and the
transition is handed to the window before the next sample is taken, as the observer does it (`relinearised.py`). What a
linearisation leaves out is bounded by the core, and stated a little larger: whoever checks the step bounds it again by
an arithmetic of his own. Boxes that the state keeps to within each substep are stated as hints, larger too, so that
a checker finds them to contain what the plant makes of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
from flint import fmpq

from polytopes.exact import ZERO, rational, rational_vector, rounded_up
from svo.checks import Array
from svo.logs.log import Log
from svo.models import NormalForm
from svo.models.nonlinear import Linearisation, LinearOutput, NonlinearModel, Span, Transition, Undecided
from svo.models.state_range import within
from svo.observers import window_kernel as kernel
from svo.observers.given_units import arrival_in
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.chain_starts import Start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.hints import PARTS, hinted
from svo.observers.window.memory import WindowSettings
from svo.observers.window.proof_steps import SIDES, multipliers, start_step
from svo.observers.window.prover import ProvenChain, proven_bound
from svo.observers.window.sample import Outgrown, Sample
from svo.observers.window.window import Window
from svo.store.values import encode_value

_EPS = 1e-9  # of the windows: their bounds are that much wider than what is proven of the model
_WIDER = (1.0 / 16.0, 1.0 / 256.0)  # of a remainder: what it is stated larger by, and where no alarm follows
_BLUNT, _WORTHWHILE, _ROUNDS = 1e-3, 0.8, 10  # of outputs, as in the core
_NARROWER = 0.01  # of a width: a bound that takes less off is not worth a step
_HORIZON = 12  # samples of a window
_NEAREST = 8  # samples before the alarm at which the first chain begins that knows the physical range alone


class LinearisedProver:
    """Proves falsifications of one nonlinear model over one log.

    Parameters
    ----------
    model : NonlinearModel
    log : Log
    since : int
        Sample from which on the model is claimed to hold.
    begun : Start or None
        A set that is known there or at a later sample, of which use is made where the physical range does not do.
    """

    def __init__(self, model: NonlinearModel, log: Log, since: int, begun: Start | None) -> None:
        self._model, self._log, self._since, self._begun = model, log, since, begun
        self.reason = "no set is known where it may begin"

    @property
    def unproven(self) -> tuple[str, ...]:
        """Why the last claim was not proven."""
        return (self.reason,)

    def prove(self, sample: int) -> ProvenChain | None:
        """The proof that no trajectory explains the readings up to a sample, or None; `reason` says why."""
        for wider, start in product(_WIDER, list(self._starts(sample))):
            try:
                return _Run(self._model, self._log, start, wider).to(sample)
            except Undecided as error:
                self.reason = str(error)
            except Outgrown:
                self.reason = "its set outgrows all bounds"
        return None

    def _starts(self, sample: int) -> Iterator[Start]:
        physical, before = self._model.physical_range, _NEAREST
        earliest = self._since if self._begun is None else self._begun.sample
        while physical is not None and physical.is_bounded and sample - before > earliest:
            yield Start("physical", sample - before, ArrivalSet.box(physical.lower, physical.upper))
            before *= 4
        if self._begun is not None:
            yield self._begun


class _Run:
    """One chain from its start."""

    def __init__(self, model: NonlinearModel, log: Log, start: Start, wider: float) -> None:
        carrier = model.carrier
        self._model, self._log, self._start, self._wider = model, log, start, wider
        form = NormalForm.at(carrier, start.set.box_lower, start.set.box_upper)
        settings = WindowSettings(form, _HORIZON, np.zeros((0, model.n_states)), _EPS, 0)
        self._form, self._carrier = form, form.model
        self._window = Window(settings, arrival_in(start.set, form), origin=start.sample, prover=self)
        self._known = self._within(Span(start.set.box_lower, start.set.box_upper))
        model.flow.check_valid(self._known)  # what is read of other states nothing is known of
        self._bounds = 0
        self._steps = [start_step(start, np.zeros((0, model.n_states)))]

    def to(self, sample: int) -> ProvenChain:
        """The chain up to a sample, or to an earlier one that is falsified; Undecided if none is."""
        for k in range(self._start.sample, sample + 1):
            at = self._measured(k)
            if at is None or self._window.take(self._normal(k, at)) == "falsified":
                proof = None if at is None else self._window.proof
                assert proof is None or isinstance(proof, WindowCertificate)  # convex hulls are kept
                if proof is not None:
                    self._steps.append({"step": "alarm", **multipliers(proof, 1.0)})
                return ProvenChain(self._start, self._bounds, proof, self._steps, self._given())
            if k < sample:
                self._bound_newest(k)
                self._move(k, at)
        raise Undecided("no chain of windows is falsified")

    def _given(self) -> tuple[str, ...]:
        """What it rests on besides the equations, their bounds and the log."""
        ranges = {"physical": self._model.physical_range, "valid": self._model.valid_range}
        stated = [f"the {name} range" for name, of in ranges.items() if of is not None]
        return tuple(each for each in (self._start.premise, *stated) if each is not None)

    def _within(self, box: Span) -> Span:
        return Span(*(end.copy() for end in within(self._model.physical_range, *box)))

    # -- what a window is given ----------------------------------------------------------------------------

    def _normal(self, k: int, at: Linearisation) -> Sample:
        form, u, y = self._form, self._log.u, self._log.y[k]
        stack, (lower, upper, noise) = self._carrier.stack(at), self._carrier.bounds(at)
        before = u[k - 1] if k else np.zeros(u.shape[1])
        return Sample(form.inputs(before), form.inputs(u[k]), form.outputs(y), stack, noise, lower, upper, y)

    def _measured(self, k: int) -> Linearisation | None:
        """The output of a sample over what is known of the state, and again over what readings leave of it.

        None if that is nothing, which is an alarm.
        """
        model, before = self._model, np.full(self._model.n_outputs, np.inf)
        for _ in range(_ROUNDS):
            found = model.kernel.output(*self._known, self._log.u[k])
            output = found._replace(R=found.R * (1.0 + self._wider))
            parts = zip("CcFR", output, strict=True)
            self._add("output", k, **{name: encode_value(part) for name, part in parts})
            blurs, narrower = _BLUNT * model.noise < found.R, _WORTHWHILE * before > found.R
            if not (blurs & narrower).any():
                break
            bounds, before = self._bounds, found.R
            if not self._cut(k, output):
                return None
            if self._bounds == bounds:
                break
        return Linearisation.before(output, model.noise, model.n_inputs)

    def _cut(self, k: int, output: LinearOutput) -> bool:
        """Cut what is known of the state by each reading; returns whether anything is left."""
        y = self._log.y[k]
        for i in np.flatnonzero(~np.isnan(y)).tolist():
            for j in np.flatnonzero(output.C[i]).tolist():
                for side in (0, 1):
                    sign = 1 - 2 * side
                    multiplier = float(sign / output.C[i, j])
                    value = sign * rounded_up(-self._total(k, output, i, multiplier, (j, sign)))
                    if not self._narrows(j, side, value):
                        continue
                    told = self._of_reading(k, i, multiplier)
                    if self._total(k, output, i, multiplier) > 0:
                        self._steps.append({"step": "alarm", **told})
                        return False
                    self._take_bound(k, j, side, value, told)
        return True

    def _of_reading(self, k: int, i: int, multiplier: float) -> dict[str, Any]:
        on_output = np.zeros((1, self._model.n_outputs))
        on_output[0, i] = multiplier
        rows = len(self._start.set.rows) if k == self._start.sample else 0
        return {"first": k, "last": k, "on_start": encode_value(np.zeros(rows)), "on_output": encode_value(on_output)}

    def _total(
        self, k: int, output: LinearOutput, i: int, multiplier: float, less: tuple[int, int] | None = None
    ) -> fmpq:
        """Exact least value of a reading's row less its bound, and less a state times a sign, within what is known."""
        m, y = rational(multiplier), float(self._log.y[k, i])
        total = m * (rational(output.c[i]) - rational(y))
        total -= abs(m) * (rational(self._model.noise[i]) + rational(output.R[i]))
        slopes = [m * rational(c) for c in output.C[i]]
        if less is not None:
            slopes[less[0]] -= less[1]
        return total + _least(slopes, self._known) + _least([m * rational(f) for f in output.F[i]], self._model.flow.w)

    # -- what is known of a sample ---------------------------------------------------------------------------

    def _narrows(self, row: int, side: int, value: float) -> bool:
        lower, upper = self._known.lower[row], self._known.upper[row]
        gained = value - lower if side else upper - value
        return bool(np.isfinite(value) and gained > _NARROWER * (upper - lower))

    def _leaves(self, row: int, side: int, value: float) -> bool:
        """Whether a bound leaves anything of what is known: if not, the next sample's window tells."""
        return bool(value <= self._known.upper[row] if side else value >= self._known.lower[row])

    def _take_bound(self, k: int, row: int, side: int, value: float, told: dict[str, Any]) -> None:
        self._add("x", k, row=row, side=SIDES[side], value=float(value).hex(), **told)
        self._known[1 - side][row] = value
        self._bounds += 1

    def _bound_newest(self, k: int) -> None:
        """Bound the newest state by all of the window."""
        memory, x = self._window.memory, self._form.x
        for program in range(2 * len(x)):
            row, side = program // 2, program % 2
            memory.solve(kernel.NEWEST, program, program + 1, kernel.UNLIMITED)
            arrays = memory.arrays
            value = float(arrays["now_lower" if side else "now_upper"][row] * x[row])
            if not self._narrows(row, side, value) or not self._leaves(row, side, value):
                continue
            direction = (1.0 - 2.0 * side) * arrays["T"][row]
            proof, proven = proven_bound(self._window, 2 * memory.size.nt + program, memory.time, direction)
            if proven is not None and proven <= rational((1.0 - 2.0 * side) * value / x[row]):
                self._take_bound(k, row, side, value, multipliers(proof, x[row]))

    def _move(self, k: int, at: Linearisation) -> None:
        """The transition from what is known of the newest state."""
        model, u = self._model, self._log.u[k]
        T = self._log.interval_at(k + 1) or model.Ts
        found = model.kernel.transition(*self._known, u, T)
        R = found.R * (1.0 + self._wider)
        more, after = {}, self._within(self._moved_by(found, R))
        if model.continuous:
            shares, boxes = model.kernel.path(*self._known, u, T, found.substeps)
            hints = hinted(model, boxes, u, (T / PARTS * shares).tolist())
            more = {"substeps": shares.tolist(), "boxes": encode_value(hints)}
            after = Span(*within(model.valid_range, *np.clip(after, *hints[-1])))  # both hold what is enclosed
        parts = zip("AaER", (found.A, found.a, found.E, R), strict=True)
        self._add("transition", k, **{name: encode_value(part) for name, part in parts}, **more)
        moved = Linearisation.of(found.A, found.a, np.hstack([found.E, np.diag(R)]), at.C, at.c, at.F, at.n, at.nu)
        self._window.move_by(self._carrier.stack(moved)[:, : model.n_states])
        self._known = after

    def _moved_by(self, found: Transition, R: Array) -> Span:
        """What the stated linear model makes of what is known: exactly, then rounded outward."""
        ends = np.empty((2, len(R)))
        for i, slopes in enumerate(np.hstack([found.A, found.E])):
            for side, sign in enumerate((1, -1)):
                x, w = np.split(sign * slopes, [len(R)])
                least = _least(rational_vector(x), self._known) + _least(rational_vector(w), self._model.flow.w)
                ends[side, i] = sign * -rounded_up(rational(R[i]) - sign * rational(found.a[i]) - least)
        return Span(*ends)

    def _add(self, kind: str, k: int, **entries: Any) -> None:
        self._steps.append({"step": kind, "sample": k, **entries})

    # -- a prover of the window's own bounds --------------------------------------------------------------------

    def arrival(self, window: Window, program: int) -> None:
        """The bound of the next set from which the window goes on."""
        arrays, row, side = window.memory.arrays, program // 2, program % 2
        target, name = window.memory.base + window.memory.size.block, "new_lower" if side else "new_upper"
        sign, x = 1.0 - 2.0 * side, self._form.x[row]
        proof, proven = proven_bound(window, program, target, sign * arrays["T"][row])
        bound = float(arrays[name][row])
        if not np.isfinite(bound):
            return
        if proven is None or proven > rational(sign * bound):
            raise Undecided(f"a bound of sample {target + window.origin} is not proven")
        told = {"row": row, "side": SIDES[side], "value": float(bound * x).hex()}
        self._add("x", target + window.origin, **told, **multipliers(proof, x))
        self._bounds += 1

    def channel(self, window: Window, q: int, side: int, is_open: bool) -> None:
        """There are none: a linearisation has no uncertainties."""


def _least(slopes: list[fmpq], box: Span) -> fmpq:
    """The least value of a linear function over a box."""
    total = ZERO
    for slope, low, high in zip(slopes, box.lower, box.upper, strict=True):
        if slope:
            total += slope * rational(low if slope > 0 else high)
    return total

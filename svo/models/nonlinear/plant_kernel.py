"""A nonlinear model in the core (`core/tape/plant.h`): its transitions and outputs over a box, each in one call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polytopes import native
from polytopes.native import Address, Entries, Given, Integer, Real
from svo.checks import Array
from svo.functions.tape import Tape
from svo.functions.tape_kernel import why_not
from svo.models.nonlinear.carrier import Linearisation
from svo.models.nonlinear.flow import Flow, Span, Undecided
from svo.models.nonlinear.output import LinearOutput
from svo.models.nonlinear.transition import Transition
from svo.models.state_range import StateRange

_room = native.function("fdi_plant_room", Address, returns=Integer)
_transition = native.function(
    "fdi_plant_transition", Address, Address, *[Given] * 3, Real, Entries, Entries, returns=Integer
)
_output = native.function("fdi_plant_output", Address, Address, *[Given] * 3, Entries, Entries, returns=Integer)
_cut = native.function("fdi_plant_cut", Address, Address, *[Entries] * 2, Given, Entries, returns=Integer)
_measured = native.function(
    "fdi_plant_measured", Address, Address, *[Entries] * 2, *[Given] * 2, *[Entries] * 3, returns=Integer
)
_path = native.function("fdi_plant_path", Address, Address, *[Given] * 3, Real, Integer, Entries, returns=Integer)

# As in `core/tape/plant.h`.
_TOO_MANY_SUBSTEPS, _OUTSIDE_VALID, _NOT_PHYSICAL, _TOO_WIDE = range(1, 5)
_NO_BOX = 0
_MOST_SUBSTEPS = 200


class _Outcome(NamedTuple):
    """Why there is no result, as the core tells it."""

    code: int
    why: int
    row: int
    reason: int
    op: int
    low: float
    high: float
    time: float


class PlantKernel:
    """What the core needs of a model, in one block that is only read.

    Parameters
    ----------
    flow : Flow
    reading : Tape
    noise : (ny,) array
    continuous : bool
    largest : StateRange
    outputs : sequence of str
        Names, for messages.

    Attributes
    ----------
    address : int
        Where the block lies.
    room : int
        Doubles of scratch that a call of the core needs.
    """

    def __init__(
        self, flow: Flow, reading: Tape, noise: Array, continuous: bool, largest: StateRange, outputs: Sequence[str]
    ) -> None:
        self._flow, self._outputs = flow, outputs
        n, nw = flow.n, len(flow.varying)
        nu = flow.tape.variables - n - nw
        self._sizes, self._inputs = (n, nw, len(noise)), nu
        bounds = [*_ends(flow.physical, n), *_ends(flow.valid, n), largest.upper - largest.lower, *flow.w]
        head = np.array([n, nw, nu, len(noise), continuous], dtype=np.int64).view(np.float64)
        tapes = [tape.block(n + nw).content for tape in (flow.tape, reading)]
        self._block = np.concatenate([head, *bounds, np.where(flow.varying, 0.0, 1.0), noise, *tapes])
        self._find()

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("_flow", "_outputs", "_sizes", "_inputs", "_block")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self._find()

    def _find(self) -> None:
        """Where the block lies, and how much scratch its calls need."""
        self.address = native.address(self._block)
        self.room: int = _room(self.address)

    def transition(self, lower: Array, upper: Array, u: Array, T: float) -> Transition:
        """Of all states of a box over a time T.

        Raises
        ------
        Undecided
            If it is not enclosed, leaves `valid`, or leaves out more than ``largest`` is wide.
        """
        n, nw, _ = self._sizes
        result, told = np.empty(n * (n + nw + 6)), np.empty(8)
        substeps = _transition(self.address, native.scratch(self.room), lower, upper, u, T, result, told)
        if substeps < 0:
            raise self.undecided(told)
        square, E = result[: n * n].reshape(n, n), result[n * (n + 1) : n * (n + 1 + nw)].reshape(n, nw)
        R, *ends = result[n * (n + 1 + nw) :].reshape(5, n)
        return Transition(square, result[n * n : n * (n + 1)], E, R, Span(*ends[:2]), Span(*ends[2:]), substeps)

    def path(self, lower: Array, upper: Array, u: Array, T: float, substeps: int) -> tuple[NDArray[np.int64], Array]:
        """Of the substeps of a transition: parts in 4096 (substeps,) of its time T, and boxes (substeps, 2, 2, n).

        The state is in the first box of each when the substep begins, and keeps to the second.
        """
        n = self._sizes[0]
        found = np.empty((substeps, 1 + 4 * n))
        if not _path(self.address, native.scratch(self.room), lower, upper, u, T, substeps, found):
            raise ValueError(f"no transition of {substeps} substeps; expected the number of one that there is")
        return found[:, 0].astype(np.int64), found[:, 1:].reshape(substeps, 2, 2, n)

    def output(self, lower: Array, upper: Array, u: Array) -> LinearOutput:
        """Of all states of a box.

        Raises
        ------
        Undecided
            If it is not enclosed.
        """
        result, told = self._result()
        if _output(self.address, native.scratch(self.room), lower, upper, u, result, told):
            raise self.undecided(told, is_output=True)
        return self._linear(result)

    def measured(self, known: Span, y: Array, u: Array) -> tuple[Linearisation, Span]:
        """The output of all states of a box, as a sample that nothing follows yet, and what its readings leave.

        Again over what is left while the remainder blurs the readings y (ny,), NaN where there is none.

        Raises
        ------
        Undecided
            If it is not enclosed.
        """
        found, told = Linearisation.empty(*self._sizes, self._inputs), np.empty(8)
        left = Span(known.lower.copy(), known.upper.copy())
        n = self._sizes[0]
        if _measured(self.address, native.scratch(self.room), *left, y, u, found.rows[n:], found.n, told):
            raise self.undecided(told, is_output=True)
        return found, left

    def cut(self, known: Span, y: Array, output: LinearOutput) -> Span | None:
        """What readings leave of a box for which an output holds; None where nothing is left: a program decides."""
        left, result = Span(known.lower.copy(), known.upper.copy()), np.concatenate([part.ravel() for part in output])
        return left if _cut(self.address, native.scratch(self.room), *left, y, result) else None

    def _result(self) -> tuple[Array, Array]:
        n, nw, ny = self._sizes
        return np.empty(ny * (n + nw + 2)), np.empty(8)

    def _linear(self, result: Array) -> LinearOutput:
        n, nw, ny = self._sizes
        C, F = result[: ny * n].reshape(ny, n), result[ny * (n + 1) : ny * (n + 1 + nw)].reshape(ny, nw)
        return LinearOutput(C, result[ny * n : ny * (n + 1)], F, result[ny * (n + 1 + nw) :])

    # -- why there is none ---------------------------------------------------------------------------

    def undecided(self, told: Array, is_output: bool = False) -> Undecided:
        """What the core tells (8,) of a transition, or of an output, that it has not found."""
        found = _Outcome(*told[:5].view(np.int64).tolist(), *told[5:].tolist())
        row, state = found.row, self._flow.states
        if is_output:
            return Undecided(f"the output {self._outputs[row]} is not enclosed, {why_not(found.reason, found.op)}")
        if found.code == _TOO_MANY_SUBSTEPS:
            return Undecided(f"more than {_MOST_SUBSTEPS} substeps would be needed: {self._of_substep(found)}")
        if found.code == _OUTSIDE_VALID:
            return self._flow.outside_valid(row, found.low, found.high)
        if found.code == _NOT_PHYSICAL:
            return Undecided(f"no {state[row]} of the set stays within the physical range", coordinate=row)
        if found.code == _TOO_WIDE:
            return Undecided(f"the remainder of {state[row]} is wider than largest", coordinate=row)
        return Undecided(self._of_substep(found))

    def _of_substep(self, found: _Outcome) -> str:
        if found.why == _NO_BOX:
            state = self._flow.states[found.row]
            return f"no box was found that the state keeps to within {found.time:.3g} s, {state} leaves all"
        return f"the equation of {self._flow.states[found.row]} is not enclosed, {why_not(found.reason, found.op)}"


def _ends(given: StateRange | None, n: int) -> tuple[Array, Array]:
    return (np.full(n, -np.inf), np.full(n, np.inf)) if given is None else (given.lower, given.upper)

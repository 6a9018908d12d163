"""The core's tapes (`core/tape`): a tape as one block of memory, its ranges and its linear forms over a box.

`svo.functions` and the models use it. A block is only read, and no address is in it; what a call computes on the
way lies in the scratch of its thread.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polytopes import native
from polytopes.native import Address, Entries, Given, Integer, Real
from svo.checks import Array
from svo.functions.operations import Op

Interval = tuple[float, float]
Integers = NDArray[np.int64]

# As in `core/tape/intervals.h`.
_WHY = {
    2: "it divides by a range that contains zero", 3: "its argument may be negative",
    4: "its argument may be zero or negative", 5: "a piece that may hold has no bounded range",
    6: "its range is beyond all floats",
}  # fmt: skip

_interval = native.function("fdi_tape_interval", Integer, Given, Entries, returns=Integer)
_room = native.function("fdi_tape_room", Address, returns=Integer)
_ranges = native.function("fdi_tape_ranges", Address, Address, Given, Given, *[Entries] * 3, returns=Integer)
_forms = native.function("fdi_tape_forms", Address, Address, Given, Given, *[Entries] * 4, returns=Integer)
_integrate_room = native.function("fdi_tape_integrate_room", Address, returns=Integer)
_integrate = native.function("fdi_tape_integrate", Address, Address, Entries, *[Given] * 3, Real, Integer)


class NotEnclosed(ArithmeticError):
    """An operation has no bounded range over its operands: the argument says why."""


def why_not(why: int, op: int) -> str:
    """Why an operation has no bounded range, as the core tells it."""
    return f"in {Op(op).word}: {_WHY[why]}"


class Unenclosed(ArithmeticError):
    """A row of a tape that has no bounded range over a box.

    Attributes
    ----------
    row : int
        The first such output.
    """

    def __init__(self, row: int, why: int, op: int) -> None:
        super().__init__(why_not(why, op))
        self.row = row


def applied(op: Op, *operands: Interval) -> Interval:
    """The range of an operation.

    Raises
    ------
    NotEnclosed
        If it is not bounded by floats.
    """
    given, value = np.zeros((3, 2)), np.empty(2)
    given[: len(operands)] = operands
    why = _interval(op, given, value)
    if why:
        raise NotEnclosed(_WHY[why])
    return float(value[0]), float(value[1])


class Forms(NamedTuple):
    """Rows k + g (z - centre) + [low, high], and their ranges, over a box of the free coordinates z.

    Attributes
    ----------
    centre, reach : (free,) arrays
        Of the box: its centre, and bounds of abs(z - centre).
    k, low, high, lower, upper : (m,) arrays
    g : (m, free) array
    """

    centre: Array
    reach: Array
    k: Array
    g: Array
    low: Array
    high: Array
    lower: Array
    upper: Array


def packed(op: Integers, operands: Integers, constants: Array, outputs: Integers, variables: int, free: int) -> Array:
    """The block of a tape whose forms are linear in its first ``free`` coordinates."""
    columns = _columns(op, operands, free)
    first = np.cumsum([0, *map(len, columns)])
    own = [max(1, Op(code).operands) for code in op.tolist()]
    every = np.where(np.arange(3) < np.array(own).reshape(-1, 1), operands, operands[:, :1])
    sizes = len(op), len(outputs), variables, free, first[-1]
    parts = [sizes, op, every.ravel(), outputs, first, [j for of_slot in columns for j in of_slot]]
    integers = np.concatenate([np.asarray(part, dtype=np.int64) for part in parts])
    return np.concatenate([integers.view(np.float64), constants.ravel()])


def _columns(op: Integers, operands: Integers, free: int) -> list[list[int]]:
    """The coordinates that the form of each slot is linear in: of SELECT, those of its pieces."""
    reads: list[int] = []  # bit j: coordinate j
    for code, of in zip(op.tolist(), operands.tolist(), strict=True):
        if code == Op.VARIABLE:
            reads.append(1 << of[0] if of[0] < free else 0)
        else:
            pieces = of[1:] if code == Op.SELECT else of[: Op(code).operands]
            every = 0
            for slot in pieces:
                every |= reads[slot]
            reads.append(every)
    return [[j for j in range(free) if bits >> j & 1] for bits in reads]


class Block:
    """A tape that the core can evaluate.

    Parameters
    ----------
    content : array
        What `packed` gives.
    rows, free : int
    """

    def __init__(self, content: Array, rows: int, free: int) -> None:
        self.content, self.rows, self.free = content, rows, free
        self._address = native.address(content)
        self._room: int = max(1, _room(self._address), _integrate_room(self._address))

    def __reduce__(self) -> tuple[Callable[..., Block], tuple[Array, int, int]]:
        return Block, (self.content, self.rows, self.free)

    def ranges(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Bounds (rows,) over a box; of what reads a coordinate that is NaN, nothing.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        low, high, told = np.empty(self.rows), np.empty(self.rows), np.empty(3, dtype=np.int64)
        if _ranges(self._address, native.scratch(self._room), lower, upper, low, high, told):
            raise Unenclosed(*told.tolist())
        return low, high

    def forms(self, lower: Array, upper: Array) -> Forms:
        """Linear forms of the rows over a box.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        values, g = np.empty((self.rows, 5)), np.empty((self.rows, self.free))
        box, told = np.empty((2, self.free)), np.empty(3, dtype=np.int64)
        if _forms(self._address, native.scratch(self._room), lower, upper, values, g, box, told):
            raise Unenclosed(*told.tolist())
        centre, reach = box
        k, *ends = values.T.copy()
        return Forms(centre, reach, k, g, *ends)

    def integrated(self, x: Array, held: Array, lower: Array, upper: Array, T: float, steps: int) -> Array:
        """x (rows,) after a time T, by Runge and Kutta's method of fourth order in floats.

        The rows are dx/dt at (x, held), x within the bounds (rows,).
        """
        moved = np.array(x, dtype=np.float64)
        _integrate(self._address, native.scratch(self._room), moved, held, lower, upper, T, steps)
        return moved

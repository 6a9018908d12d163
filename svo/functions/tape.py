"""A tape: functions of z as elementary operations in plain arrays, evaluated in floats, intervals and linear forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes.value import Value
from svo.checks import Array
from svo.functions.expression import Expression, Recorder
from svo.functions.forms import Box, Form
from svo.functions.intervals import Interval, NotEnclosed, applied
from svo.functions.operations import Op

Integers = NDArray[np.int64]


_UNKNOWN = ""  # why a slot has no value that reads a coordinate of which nothing is known


class Unenclosed(ArithmeticError):
    """A row of a tape that has no bounded range over a box.

    Attributes
    ----------
    row : int
        The first such output.
    """

    def __init__(self, row: int, why: str) -> None:
        super().__init__(why)
        self.row = row


@dataclass(frozen=True, eq=False)
class Tape(Value):
    """Slots in an order in which each reads earlier ones only.

    Attributes
    ----------
    op : (T,) integer array
        Codes of `svo.functions.operations.Op`.
    operands : (T, 3) integer array
        Slots that each reads; of a variable the number of its coordinate.
    constants : (T, 2) array
        Ends of each constant; zero elsewhere.
    outputs : (m,) integer array
        Slots of the rows.
    variables : int
        Coordinates of z.
    """

    op: Integers
    operands: Integers
    constants: Array
    outputs: Integers
    variables: int
    _program: list[tuple[Op, tuple[int, ...], Interval]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        rows = zip(self.op.tolist(), self.operands.tolist(), self.constants.tolist(), strict=True)
        program = [(Op(o), tuple(a[: max(1, Op(o).operands)]), (c[0], c[1])) for o, a, c in rows]
        object.__setattr__(self, "_program", program)
        for array in (self.op, self.operands, self.constants, self.outputs):
            array.setflags(write=False)

    @classmethod
    def of(cls, recorder: Recorder, rows: Sequence[Expression], variables: int) -> Tape:
        """The slots that rows need."""
        needed: set[int] = set()
        open_ends = [row.slot for row in rows]
        while open_ends:
            slot = open_ends.pop()
            if slot not in needed:
                needed.add(slot)
                open_ends.extend(recorder.slots[slot][1])
        order = sorted(needed)
        place = {slot: i for i, slot in enumerate(order)}
        operands, constants = np.zeros((len(order), 3), dtype=np.int64), np.zeros((len(order), 2))
        for i, slot in enumerate(order):
            op, of, values = recorder.slots[slot]
            operands[i, : len(of)] = [place[s] for s in of]
            if op is Op.VARIABLE:
                operands[i, 0] = int(values[0])
            elif op is Op.CONSTANT:
                constants[i] = values
        op_codes = np.array([recorder.slots[slot][0] for slot in order], dtype=np.int64)
        return cls(op_codes, operands, constants, np.array([place[r.slot] for r in rows], dtype=np.int64), variables)

    def record(self, z: Sequence[Expression], recorder: Recorder) -> list[Expression]:
        """The rows, of coordinates or constants z (nz,), as a function that is traced gives them."""
        found: list[Expression] = []
        for op, of, values in self._program:
            is_given = op is Op.VARIABLE
            found.append(z[of[0]] if is_given else recorder.again(op, [found[i] for i in of], values))
        return [found[i] for i in self.outputs]

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Which coordinates the rows depend on (nz,)."""
        used = np.zeros(self.variables, dtype=bool)
        used[self.operands[self.op == Op.VARIABLE, 0]] = True
        return used

    def values(self, z: Array) -> Array:
        """The rows in floats, at points (..., nz): (..., m). NaN where a function has no value."""
        found: list[Any] = []
        with np.errstate(all="ignore"):
            for op, of, (low, high) in self._program:
                if op is Op.VARIABLE:
                    found.append(z[..., of[0]])
                elif op is Op.CONSTANT:
                    found.append(0.5 * low + 0.5 * high)
                else:
                    found.append(_IN_FLOATS[op](*(found[i] for i in of)))
        rows = [np.broadcast_to(found[i], z.shape[:-1]) for i in self.outputs]
        return np.stack(rows, axis=-1) if rows else np.zeros((*z.shape[:-1], 0))

    def ranges(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Bounds (m,) of the rows over a box, in intervals.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        low, high = lower.tolist(), upper.tolist()
        ranges = self._rows(lambda j: (low[j], high[j]), lambda values: values, applied)
        ends = np.array(ranges).reshape(len(self.outputs), 2)
        return ends[:, 0].copy(), ends[:, 1].copy()

    def forms(self, lower: Array, upper: Array, free: int) -> Forms:
        """The rows as linear forms in the first ``free`` coordinates over a box (nz,); the others go into remainders.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        low, high = lower.tolist(), upper.tolist()
        own = np.flatnonzero(self.used[:free]).tolist()  # nothing depends on the others
        place = {j: i for i, j in enumerate(own)}
        box = Box.between([low[j] for j in own], [high[j] for j in own])

        def variable(j: int) -> Form:
            return box.coordinate(place[j], low[j], high[j]) if j in place else box.constant((low[j], high[j]))

        rows = self._rows(variable, box.constant, box.applied)
        g = np.zeros((len(rows), free))
        g[:, own] = np.array([row.g for row in rows]).reshape(len(rows), len(own))
        ends = np.array([[*row.rest, *row.range] for row in rows]).reshape(len(rows), 4).T
        centre = 0.5 * lower[:free] + 0.5 * upper[:free]
        reach = np.maximum(upper[:free] - centre, centre - lower[:free]) * (1.0 + 2.0**-50)
        return Forms(centre, reach, np.array([row.k for row in rows], dtype=float), g, *ends.copy())

    def check(self, lower: Array, upper: Array) -> None:
        """Raise Unenclosed if a row has no bounded range, whatever the coordinates are whose ends are NaN."""
        low, high = lower.tolist(), upper.tolist()
        _, why = self._run(lambda j: (low[j], high[j]) if low[j] == low[j] else None, lambda values: values, applied)
        for row, slot in enumerate(self.outputs.tolist()):
            if why.get(slot, _UNKNOWN) != _UNKNOWN:
                raise Unenclosed(row, why[slot])

    def _rows(self, *arithmetic: Any) -> list[Any]:
        """The rows in some arithmetic."""
        found, why = self._run(*arithmetic)
        for row, slot in enumerate(self.outputs.tolist()):
            if found[slot] is None:
                raise Unenclosed(row, why[slot])
        return [found[slot] for slot in self.outputs]

    def _run(
        self, variable: Callable[[int], Any], constant: Callable[[Interval], Any], apply: Callable[..., Any]
    ) -> tuple[list[Any], dict[int, str]]:
        """All slots, and why some have no value; one that a piece reads which does not hold is passed by."""
        found: list[Any] = []
        why: dict[int, str] = {}
        for i, (op, of, values) in enumerate(self._program):
            if op is Op.VARIABLE:
                found.append(variable(of[0]))
                if found[i] is None:
                    why[i] = _UNKNOWN
                continue
            if op is Op.CONSTANT:
                found.append(constant(values))
                continue
            missing = any(found[j] is None for j in of)
            try:
                if missing and (op is not Op.SELECT or found[of[0]] is None):
                    raise NotEnclosed
                found.append(apply(op, *(found[j] for j in of)))
            except NotEnclosed as error:
                found.append(None)
                reasons = [why[j] for j in of if found[j] is None]
                why[i] = next(filter(None, reasons), _UNKNOWN) if reasons else f"in {op.word}: {error}"
        return found, why


@dataclass(frozen=True, eq=False)
class Forms:
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


_IN_FLOATS: dict[Op, Callable[..., Any]] = {
    Op.NEG: np.negative, Op.ADD: np.add, Op.SUB: np.subtract, Op.MUL: np.multiply, Op.SQR: np.square,
    Op.INV: lambda s: np.divide(1.0, s), Op.SQRT: np.sqrt, Op.EXP: np.exp, Op.LOG: np.log, Op.SIN: np.sin,
    Op.COS: np.cos, Op.TANH: np.tanh, Op.ABS: np.abs, Op.SIGN: np.sign,
    Op.SROOT: lambda s: np.sign(s) * np.sqrt(np.abs(s)), Op.MAX: np.maximum, Op.ATAN2: np.arctan2,
    Op.SELECT: lambda t, a, b: np.where(t < 0.0, a, b), Op.DIV: np.divide,
}  # fmt: skip

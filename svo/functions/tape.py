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
from svo.functions.operations import Op
from svo.functions.tape_kernel import Block, Forms, Interval, Unenclosed, packed

Integers = NDArray[np.int64]


__all__ = ["Forms", "Tape", "Unenclosed"]


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
    _blocks: dict[int, Block] = field(init=False, repr=False, default_factory=dict)

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
        """Bounds (m,) of the rows over a box, in intervals; NaN ends are those of a coordinate that may be anything.

        Raises
        ------
        Unenclosed
            If a row has no bounded range, whatever the coordinates are that may be anything.
        """
        return self.block(0).ranges(lower, upper)

    def forms(self, lower: Array, upper: Array, free: int) -> Forms:
        """The rows as linear forms in the first ``free`` coordinates over a box (nz,); the others go into remainders.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        return self.block(free).forms(lower, upper)

    def block(self, free: int) -> Block:
        """What the core evaluates; forms are linear in the first ``free`` coordinates."""
        if free not in self._blocks:
            arrays = self.op, self.operands, self.constants, self.outputs
            self._blocks[free] = Block(packed(*arrays, self.variables, free), len(self.outputs), free)
        return self._blocks[free]


_IN_FLOATS: dict[Op, Callable[..., Any]] = {
    Op.NEG: np.negative, Op.ADD: np.add, Op.SUB: np.subtract, Op.MUL: np.multiply, Op.SQR: np.square,
    Op.INV: lambda s: np.divide(1.0, s), Op.SQRT: np.sqrt, Op.EXP: np.exp, Op.LOG: np.log, Op.SIN: np.sin,
    Op.COS: np.cos, Op.TANH: np.tanh, Op.ABS: np.abs, Op.SIGN: np.sign,
    Op.SROOT: lambda s: np.sign(s) * np.sqrt(np.abs(s)), Op.MAX: np.maximum, Op.ATAN2: np.arctan2,
    Op.SELECT: lambda t, a, b: np.where(t < 0.0, a, b), Op.DIV: np.divide,
}  # fmt: skip

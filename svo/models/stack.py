"""The stacked matrices [[A B a E], [C D c F]] of a model and of its uncertainties, at a sample or at many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array, finite_array, floats
from svo.models.schedule_table import ScheduleTable, values_over

STATE_BLOCKS = ("A", "B", "a", "E")
OUTPUT_BLOCKS = ("C", "D", "c", "F")


def may_be_nonzero(*arrays: Any) -> bool:
    """Whether any of a model's arrays is there and not zero; a function of the schedule may be anything."""
    return any(callable(array) or (array is not None and bool(np.any(array))) for array in arrays)


@dataclass(frozen=True)
class Layout:
    """Where the blocks stand in a stacked sample."""

    n: int
    nu: int
    nw: int
    ny: int

    @property
    def shape(self) -> tuple[int, int]:
        return self.n + self.ny, self.n + self.nu + 1 + self.nw

    def block(self, name: str) -> tuple[slice, slice]:
        columns = {
            "A": slice(0, self.n),
            "B": slice(self.n, self.n + self.nu),
            "a": slice(self.n + self.nu, self.n + self.nu + 1),
            "E": slice(self.n + self.nu + 1, self.shape[1]),
        }
        state = name in STATE_BLOCKS
        rows = slice(0, self.n) if state else slice(self.n, self.n + self.ny)
        return rows, columns[name if state else STATE_BLOCKS[OUTPUT_BLOCKS.index(name)]]

    def block_shape(self, name: str) -> tuple[int, ...]:
        rows, cols = self.block(name)
        return (rows.stop - rows.start,) if name in "ac" else (rows.stop - rows.start, cols.stop - cols.start)

    def shape_message(self, owner: str, name: str, shape: tuple[int, ...]) -> str:
        return f"{name}{owner} has shape {shape}; expected {self.block_shape(name)}"


@dataclass(frozen=True)
class ScheduledBlock:
    """An array that is a function of the schedule, whose it is (for messages), and where it stands in the stack."""

    name: str
    owner: str
    where: tuple[Any, ...]
    shape: tuple[int, ...]
    function: Callable[[Any], ArrayLike]


@dataclass(frozen=True, eq=False)
class Stack:
    """Constant blocks (1 + n_uncertainties, n + ny, n + nu + 1 + nw), zero where the scheduled ones stand."""

    layout: Layout
    constant: Array
    scheduled: tuple[ScheduledBlock, ...]
    table: ScheduleTable | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.constant.setflags(write=False)
        object.__setattr__(self, "table", self._as_table())

    def at(self, schedule: Any) -> Array:
        """See `UncertainModel.stack`."""
        if not self.scheduled:
            return self.constant
        if self.table is not None:
            return self.table(schedule)
        stack = self.constant.copy()
        for block in self.scheduled:
            value = floats(block.name + block.owner, block.function(schedule))
            if value.shape != block.shape:
                message = self.layout.shape_message(block.owner, block.name, value.shape)
                raise ValueError(f"{message}, at schedule {schedule!r}")
            stack[block.where] = value
        return stack

    def over(self, schedule: ArrayLike) -> Array:
        """See `UncertainModel.stack_over`."""
        values = finite_array("schedule", schedule)
        if self.table is not None:
            return self.table.over(values)
        stacks = np.repeat(self.constant[None], len(values), axis=0)
        for block in self.scheduled:
            array = values_over(block.function, values)
            if array.shape != (len(values), *block.shape):
                message = self.layout.shape_message(block.owner, block.name, array.shape[1:])
                raise ValueError(f"{message} at each sample")
            stacks[(slice(None), *block.where)] = array
        return stacks

    def _as_table(self) -> ScheduleTable | None:
        """The whole stack as one table, where every scheduled array is a table over the same points."""
        first = self.scheduled[0].function if self.scheduled else None
        if not isinstance(first, ScheduleTable):
            return None
        stacks = np.repeat(self.constant[None], len(first.points), axis=0)
        for block in self.scheduled:
            table = block.function
            if not (isinstance(table, ScheduleTable) and table.has_points_of(first)):
                return None
            stacks[(slice(None), *block.where)] = table.values
        return ScheduleTable(first.points, stacks)

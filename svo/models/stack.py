"""The stacked matrices [[A B a E], [C D c F]] of a model and of its uncertainties, at a sample or at many."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.value import Value
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

    @classmethod
    def of(cls, owner: Any, schedule: Any) -> Layout:
        """The sizes of a model, from its blocks A, B, C, E and F at a schedule."""
        A, B, C, E, F = (_value(name, owner, schedule) for name in "ABCEF")
        if A is None or A.ndim != 2 or A.shape[0] != A.shape[1] or A.shape[0] == 0:
            raise ValueError(f"A has shape {None if A is None else A.shape}; expected a square matrix (n, n), n >= 1")
        if C is None or C.ndim != 2 or C.shape[1] != A.shape[0]:
            raise ValueError(f"C has shape {None if C is None else C.shape}; expected (ny, {A.shape[0]})")
        for name, value in (("B", B), ("E", E)):
            if value is not None and (value.ndim != 2 or value.shape[0] != A.shape[0]):
                raise ValueError(f"{name} has shape {value.shape}; expected ({A.shape[0]}, columns)")
        nw = E.shape[1] if E is not None else (F.shape[1] if F is not None and F.ndim == 2 else 0)
        return cls(n=A.shape[0], nu=0 if B is None else B.shape[1], nw=nw, ny=C.shape[0])

    def check_names(self, names: Any) -> None:
        """Refuse names that are not one a state, input, output or disturbance."""
        sizes = {"states": self.n, "inputs": self.nu, "outputs": self.ny, "disturbances": self.nw}
        if names is not None and not isinstance(names, Mapping):
            raise TypeError(f"names is {names!r:.80}; expected a table from any of {', '.join(sizes)} to names")
        for key, values in (names or {}).items():
            if key not in sizes:
                raise ValueError(f"names has the key {key!r}; expected any of {', '.join(sizes)}")
            if isinstance(values, str) or not hasattr(values, "__len__"):
                raise TypeError(f"names[{key!r}] is {values!r:.80}; expected a list of {sizes[key]} names")
            if len(values) != sizes[key]:
                raise ValueError(f"names[{key!r}] has {len(values)} entries; expected {sizes[key]}")

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
class Stack(Value):
    """Constant blocks (1 + n_uncertainties, n + ny, n + nu + 1 + nw), zero where the scheduled ones stand."""

    layout: Layout
    constant: Array
    scheduled: tuple[ScheduledBlock, ...]
    table: ScheduleTable | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.constant.setflags(write=False)
        object.__setattr__(self, "table", self._as_table())

    @classmethod
    def of(cls, layout: Layout, model: Any, uncertainties: Sequence[Any], schedule: Any) -> Stack:
        """The blocks of a model and of its uncertainties; those that are functions are checked at a schedule."""
        constant = np.zeros((1 + len(uncertainties), *layout.shape))
        scheduled = []
        for item, source in enumerate((model, *uncertainties)):
            owner = "" if item == 0 else f" of uncertainty {source.name or item - 1}"
            for name in STATE_BLOCKS + OUTPUT_BLOCKS:
                value, array = getattr(source, name), _value(name, source, schedule)
                if array is None:
                    continue
                if array.shape != layout.block_shape(name):
                    raise ValueError(layout.shape_message(owner, name, array.shape))
                rows, cols = layout.block(name)
                where = (item, rows, cols.start if array.ndim == 1 else cols)
                if callable(value):
                    scheduled.append(ScheduledBlock(name, owner, where, array.shape, value))
                else:
                    constant[where] = array
        return cls(layout, constant, tuple(scheduled))

    def tables(self, points: Array, schedule: Array) -> list[dict[str, Any]]:
        """The scheduled blocks by name, of the model and of each uncertainty: tables of their values over a schedule.

        Parameters
        ----------
        points : (K,) array
            What the tables are functions of.
        schedule : (K, ...) array
            Where the blocks are evaluated.
        """
        stacks = self.over(schedule)
        tables: list[dict[str, Any]] = [{} for _ in self.constant]
        for block in self.scheduled:
            tables[block.where[0]][block.name] = ScheduleTable(points, stacks[(slice(None), *block.where)])
        return tables

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


def _value(name: str, owner: Any, schedule: Any) -> Array | None:
    """A block of a model or of an uncertainty, at a schedule where it is a function of it."""
    value = getattr(owner, name)
    if value is None:
        return None
    if callable(value):
        if schedule is None:
            raise ValueError(
                f"schedule is missing: {name} is a function of it, so give a typical value to check shapes with"
            )
        value = value(schedule)
    return finite_array(name, value)

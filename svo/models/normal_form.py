"""Normal form: every state, input, output and disturbance in a power of two that its own bound gives.

x = 2^ex x', u = 2^eu u', y = 2^ey y', w = 2^ew w' turn a model into one about x', u', y' and w', whose numbers are of
the size of one whatever the user's units are. Powers of two round nothing, so the two models say the same to the bit.
Tolerances, pivots and ranks are decided about the normal form only; a change of units by powers of two moves the
exponents along and leaves the normal form as it is, byte for byte.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.shown import Shown
from polytopes.value import Value
from svo.checks import Array
from svo.models.bounds import Bounds
from svo.models.schedule_table import ScheduleTable
from svo.models.stack import Stack
from svo.models.state_range import StateRange

if TYPE_CHECKING:
    from svo.models.model import UncertainModel

Integers = NDArray[np.int64]
_LARGEST = 511  # so that 2^(column - row) is a normal float
ENORMOUS = 2.0**1000  # of an input or a reading in normal form, far beyond all states that observers bound
_SURELY_SCALED = ENORMOUS * 2.0**-_LARGEST


@dataclass(frozen=True, eq=False)
class Exponents(Shown):
    """Of the units 2^e of the states (n,), inputs (nu,), outputs (ny,) and disturbances (nw,)."""

    states: Integers
    inputs: Integers
    outputs: Integers
    disturbances: Integers

    @classmethod
    def zero(cls, n: int, nu: int, ny: int, nw: int) -> Exponents:
        """The units as they are given."""
        return cls(*(np.zeros(size, dtype=np.int64) for size in (n, nu, ny, nw)))

    @property
    def are_usable(self) -> bool:
        """Whether every unit, and every quotient of two, is a normal float."""
        return all(bool(((e >= -_LARGEST) & (e <= _LARGEST)).all()) for e in (self.rows, self.columns))

    @property
    def rows(self) -> Integers:
        """Of the rows [x(k+1); y(k)] of a stack."""
        return np.concatenate([self.states, self.outputs])

    @property
    def columns(self) -> Integers:
        """Of the columns (x, u, 1, w) of a stack."""
        return np.concatenate([self.states, self.inputs, [0], self.disturbances])

    @cached_property
    def factor(self) -> Array:
        """What turns a stack (..., n + ny, n + nu + 1 + nw) into that of the normal form, entry by entry."""
        return power(self.columns[None, :] - self.rows[:, None])


def power(exponents: Integers) -> Array:
    """2^e as floats."""
    return np.ldexp(1.0, exponents)


@dataclass(frozen=True, eq=False)
class NormalForm(Shown):
    """A model in its normal form, and what carries numbers over.

    Attributes
    ----------
    given : UncertainModel
        In the user's units.
    exponents : Exponents
    model : UncertainModel
        Gives stacks and bounds of the normal form at a sample; the arguments it was made of stay the user's.
    x, u, y, w : (n,), (nu,), (ny,), (nw,) arrays
        The units: given = unit * normal.
    """

    given: UncertainModel
    exponents: Exponents
    model: UncertainModel = field(init=False, repr=False)
    x: Array = field(init=False, repr=False)
    u: Array = field(init=False, repr=False)
    y: Array = field(init=False, repr=False)
    w: Array = field(init=False, repr=False)
    _per_u: Array = field(init=False, repr=False)
    _per_y: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        e = self.exponents
        for name, exponents in zip("xuyw", (e.states, e.inputs, e.outputs, e.disturbances), strict=True):
            object.__setattr__(self, name, power(exponents))
        object.__setattr__(self, "_per_u", 1.0 / self.u)
        object.__setattr__(self, "_per_y", 1.0 / self.y)
        model = copy(self.given)
        for name, value in {
            "_stack": _ScaledStack(self.given._stack, e.factor),
            "_bounds": _ScaledBounds(self.given._bounds, 1.0 / self.w, self._per_y),
            "w": set_in(self.given.w, self.w) if isinstance(self.given.w, HPolytope) else self.given.w,
            "physical_range": self._range_in(self.given.physical_range),
            "start_range": self._range_in(self.given.start_range),
        }.items():
            object.__setattr__(model, name, value)
        object.__setattr__(self, "model", model)

    def _range_in(self, of: StateRange | None) -> StateRange | None:
        return None if of is None else StateRange(of.lower / self.x, of.upper / self.x)

    def inputs(self, u: Array) -> Array:
        """An input in normal form."""
        return _scaled(u, self._per_u)

    def outputs(self, y: Array) -> Array:
        """A measurement in normal form."""
        return _scaled(y, self._per_y)

    def state_rows(self, rows: Array) -> Array:
        """The state rows (items, n, columns) of a stack in normal form."""
        return rows * self.exponents.factor[: rows.shape[1]]

    def state_dict(self) -> dict[str, Integers]:
        """The exponents as named arrays."""
        return {f"exponents.{f.name}": getattr(self.exponents, f.name).copy() for f in fields(Exponents)}

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: Mapping[str, NDArray]) -> NormalForm:
        """What `state_dict` described.

        Raises
        ------
        KeyError, ValueError
            If the state holds no exponents, or not those of such a model.
        """
        arrays = [np.array(state[f"exponents.{f.name}"]) for f in fields(Exponents)]
        layout = model.layout
        sizes = [(size,) for size in (layout.n, layout.nu, layout.ny, layout.nw)]
        if [a.shape for a in arrays] != sizes or any(a.dtype != np.int64 for a in arrays):
            raise ValueError(f"its exponents have shapes {[a.shape for a in arrays]}; expected integers of {sizes}")
        exponents = Exponents(*arrays)
        if not exponents.are_usable:
            raise ValueError("its exponents are beyond those of floats")
        return cls(model, exponents)

    @classmethod
    def at(cls, model: UncertainModel, lower: Array, upper: Array) -> NormalForm:
        """That of a model whose first states lie between two bounds (n,)."""
        return cls(model, exponents_of(model, lower, upper))


def _scaled(values: Array, factor: Array) -> Array:
    """values * factor, those beyond `ENORMOUS` at it."""
    if math.hypot(*values.tolist()) < _SURELY_SCALED:
        return values * factor
    with np.errstate(over="ignore"):
        scaled = values * factor
    return np.where(np.isinf(values), values, np.clip(scaled, -ENORMOUS, ENORMOUS))


def set_in(P: HPolytope, unit: Array) -> HPolytope:
    """{x' : unit x' in P}."""
    f, g = lengthened(P.A, unit), lengthened(P.C, unit)
    return HPolytope(P.A * unit * f[:, None], P.b * f, P.C * unit * g[:, None], P.d * g)


def lengthened(rows: Array, unit: Array) -> Array:
    """Powers of two (k,) that make rows * unit about as long as the rows are: +-1 on one variable stays +-1."""
    before, after = (np.abs(matrix).max(axis=1, initial=0.0) for matrix in (rows, rows * unit))
    return power(np.where(after > 0.0, np.frexp(before)[1] - np.frexp(after)[1], 0))


# -- what a model gives at a sample ------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _ScaledStack(Value):
    """A stack that is evaluated in the given units, where its errors speak of the user's numbers; a table has none."""

    given: Stack
    factor: Array
    constant: Array = field(init=False)
    table: ScheduleTable | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "constant", self.given.constant * self.factor)
        self.constant.setflags(write=False)
        table = self.given.table
        object.__setattr__(self, "table", None if table is None else table.times(self.factor))

    @property
    def scheduled(self) -> Any:
        return self.given.scheduled

    def at(self, schedule: Any) -> Array:
        if not self.given.scheduled:
            return self.constant
        return self.given.at(schedule) * self.factor if self.table is None else self.table(schedule)

    def over(self, schedule: ArrayLike) -> Array:
        return self.given.over(schedule) * self.factor if self.table is None else self.table.over(schedule)


@dataclass(frozen=True, eq=False)
class _ScaledBounds:
    """The same for the bounds of disturbances and noise."""

    given: Bounds
    per_w: Array
    per_y: Array
    constant: tuple[Array, Array, Array] | None = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "constant", None if self.given.scheduled else self._scaled(*self.given.edges))

    @property
    def scheduled(self) -> bool:
        return self.given.scheduled

    def at(self, schedule: Any) -> tuple[Array, Array, Array]:
        return self.constant or self._scaled(*self.given.at(schedule))

    def over(self, schedule: ArrayLike) -> tuple[Array, Array, Array]:
        return self._scaled(*self.given.over(schedule))

    def _scaled(self, lower: Array, upper: Array, noise: Array) -> tuple[Array, Array, Array]:
        return lower * self.per_w, upper * self.per_w, noise * self.per_y


# -- the exponents -------------------------------------------------------------------------------------------------


def exponents_of(model: UncertainModel, lower: Array, upper: Array) -> Exponents:
    """The units of a model whose first states lie between two bounds (n,).

    A bound b gives the e with 2^(e-1) <= b < 2^e: of the first states, and of w and the noise at the typical schedule.
    Where it is zero, infinite or absent, the exponents of the entries of the stack decide, in integers: a row takes the
    largest of its terms over the columns that are known; a column then takes what makes its largest term as large as
    the row that it enters. What nothing known reaches stays as it is.
    """
    layout = model.layout
    n, nu, ny = layout.n, layout.nu, layout.ny
    entries = np.abs(model.stack(model.schedule)).max(axis=0)
    size, used = np.frexp(entries)[1].astype(np.int64), entries > 0.0
    w_lower, w_upper, noise = model.bounds(model.schedule)
    bounds = [
        np.maximum(np.abs(lower), np.abs(upper)), np.zeros(nu), np.full(1, 0.5), np.maximum(-w_lower, w_upper), noise,
    ]  # fmt: skip
    largest = np.concatenate(bounds)
    known = np.isfinite(largest) & (largest > 0.0)
    exponent = np.where(known, np.frexp(np.where(known, largest, 1.0))[1], 0).astype(np.int64)
    columns = np.arange(n + nu + 1 + layout.nw)
    rows = np.concatenate([np.arange(n), columns.size + np.arange(ny)])
    while True:
        reached = used & known[columns]
        found = ~known[rows] & reached.any(axis=1)
        if found.any():
            terms = np.where(reached, size + exponent[columns], np.iinfo(np.int64).min)
            exponent[rows[found]] = terms.max(axis=1)[found]
            known[rows[found]] = True
            continue
        entered = used & known[rows][:, None]
        found = ~known[columns] & entered.any(axis=0)
        if not found.any():
            break
        rooms = np.where(entered, exponent[rows][:, None] - size, np.iinfo(np.int64).max)
        exponent[columns[found]] = rooms.min(axis=0)[found]
        known[columns[found]] = True
    exponent = np.clip(exponent, -_LARGEST, _LARGEST)
    states, inputs, _, disturbances, outputs = np.split(exponent, np.cumsum([n, nu, 1, layout.nw]))
    return Exponents(states, inputs, outputs, disturbances)

"""Functions of vectors traced once: each operation on an `Expression` becomes a slot of a recorder."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import reduce
from operator import or_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import is_finite_number
from svo.functions.operations import Op
from svo.functions.tape_kernel import Interval, NotEnclosed, applied

Slot = tuple[Op, tuple[int, ...], Interval]
"""An operation, the slots that it reads, and the ends of a constant (or the number of a variable, twice)."""

_MOST_SLOTS = 100_000
_MOST_FACTORS = 32  # of a product in which a sign and a root are looked for


class NoValue(ValueError):
    """An operation of constants that has no value."""


class Recorder:
    """The slots of functions that are traced; the same operation of the same operands is one slot."""

    def __init__(self) -> None:
        self.slots: list[Slot] = []
        self._known: dict[Slot, int] = {}
        self._reads: list[int] = []  # of each slot, the coordinates that it depends on, as bits

    def variable(self, j: int) -> Expression:
        """Coordinate j of z."""
        return self._slot((Op.VARIABLE, (), (float(j), float(j))))

    def constant(self, value: Any) -> Expression:
        """A number, or an expression as it is."""
        if isinstance(value, Expression):
            if value.recorder is not self:
                raise ValueError("an expression of another function is used; expected the arguments of this one")
            return value
        if not is_finite_number(value):
            raise TypeError(f"{value!r:.80} is used in an expression; expected a finite number or an expression")
        return self.enclosed((float(value), float(value)))

    def put(self, op: Op, *operands: Any) -> Expression:
        """An operation; of constants, an interval that contains its value."""
        of = [self.constant(operand) for operand in operands]
        if all(self.slots[e.slot][0] is Op.CONSTANT for e in of):
            try:
                return self.enclosed(applied(op, *(self.slots[e.slot][2] for e in of)))
            except NotEnclosed as error:
                raise NoValue(f"{op.word} of a constant has no value: {error}") from None
        return self._slot((op, tuple(e.slot for e in of), (0.0, 0.0)))

    def again(self, op: Op, operands: Sequence[Expression], values: Interval) -> Expression:
        """An operation that a tape has, or its constant."""
        if op is Op.CONSTANT:
            return self.enclosed(values)
        make = {Op.MUL: self.product, Op.DIV: self.quotient}.get(op)
        return self.put(op, *operands) if make is None else make(*operands)

    def product(self, a: Any, b: Any) -> Expression:
        """a b; a square where both are one, and sign(e) sqrt(|e|) as the signed root of e."""
        a, b = self.constant(a), self.constant(b)
        if a.slot == b.slot:
            return self.put(Op.SQR, a)
        for one, other in ((a, b), (b, a)):
            root = self._signed_root(one, other)
            if root is not None:
                return root
        return self.put(Op.MUL, a, b)

    def quotient(self, a: Any, b: Any) -> Expression:
        """a / b; a product with 1 / b where one of them is a constant.

        Factors of a that have nothing in common with b stay outside: a quotient is narrow where a and b move together.
        """
        a, b = self.constant(a), self.constant(b)
        if Op.CONSTANT in (self.slots[a.slot][0], self.slots[b.slot][0]):
            return self.product(a, self.put(Op.INV, b))
        factors = [a.slot] if self.slots[a.slot][0] is not Op.MUL else self._factors(a.slot)
        shared = [i for i in factors if self._reads[i] & self._reads[b.slot]]
        if len(shared) in (0, len(factors)):
            return self.put(Op.DIV, a, b)
        apart = [Expression(self, i) for i in factors if i not in shared]
        over = self.put(Op.DIV, reduce(self.product, [Expression(self, i) for i in shared]), b)
        return self.product(reduce(self.product, apart), over)

    def enclosed(self, values: Interval) -> Expression:
        """A constant that an interval contains."""
        return self._slot((Op.CONSTANT, (), (values[0] + 0.0, values[1] + 0.0)))

    def _slot(self, slot: Slot) -> Expression:
        if len(self.slots) >= _MOST_SLOTS:
            raise ValueError(f"the functions have more than {_MOST_SLOTS} operations; expected a smaller model")
        index = self._known.setdefault(slot, len(self.slots))
        if index == len(self.slots):
            self.slots.append(slot)
            op, of, values = slot
            own = 1 << int(values[0]) if op is Op.VARIABLE else 0
            self._reads.append(reduce(or_, (self._reads[i] for i in of), own))
        return Expression(self, index)

    # -- sign(e) sqrt(|e|) ---------------------------------------------------------------------------

    def _signed_root(self, a: Expression, b: Expression) -> Expression | None:
        """a b as a signed root times the rest, where sign(e) is a factor of a and sqrt(c |e|), c > 0, one of b."""
        signs = {self.slots[i][1][0]: i for i in self._factors(a.slot) if self.slots[i][0] is Op.SIGN}
        for root in self._factors(b.slot) if signs else ():
            op, of, _ = self.slots[root]
            found = self._size_of(of[0], signs) if op is Op.SQRT else None
            if found is not None:
                e, scale = found
                inner = Expression(self, e) if scale is None else Expression(self, e) * Expression(self, scale)
                left = [Expression(self, i) for i in self._without(a.slot, signs[e]) + self._without(b.slot, root)]
                return math.prod(left, start=self.put(Op.SROOT, inner))
        return None

    def _size_of(self, slot: int, signs: dict[int, int]) -> tuple[int, int | None] | None:
        """e, and the slot of c > 0 or None for 1, where a slot is c |e| with an e whose sign is at hand."""
        factors = self._factors(slot)
        sizes = [i for i in factors if self.slots[i][0] is Op.ABS and self.slots[i][1][0] in signs]
        if not sizes:
            return None
        rest = self._without(slot, sizes[0])
        if not all(self.slots[i][0] is Op.CONSTANT and self.slots[i][2][0] > 0.0 for i in rest):
            return None
        scale = reduce(self.product, (Expression(self, i) for i in rest)).slot if rest else None
        return self.slots[sizes[0]][1][0], scale

    def _factors(self, slot: int) -> list[int]:
        """The slots that a product comes from; of one with very many, those products that are left."""
        factors = [slot]
        while len(factors) < _MOST_FACTORS:
            product = next((i for i in factors if self.slots[i][0] in (Op.MUL, Op.DIV)), None)
            if product is None:
                break
            factors.remove(product)
            op, (first, second), _ = self.slots[product]
            factors += [first, second if op is Op.MUL else self.put(Op.INV, Expression(self, second)).slot]
        return factors

    def _without(self, slot: int, factor: int) -> list[int]:
        factors = self._factors(slot)
        factors.remove(factor)
        return factors


class Expression:
    """A value that depends on the arguments of the function that is traced.

    It takes ``+ - * / **``, `abs`, numbers and numpy arrays, and the functions of `svo.functions`.
    """

    __slots__ = ("recorder", "slot")

    def __init__(self, recorder: Recorder, slot: int) -> None:
        self.recorder, self.slot = recorder, slot

    def __add__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.put(Op.ADD, self, o))

    def __radd__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.put(Op.ADD, o, self))

    def __sub__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.put(Op.SUB, self, o))

    def __rsub__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.put(Op.SUB, o, self))

    def __mul__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.product(self, o))

    def __rmul__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.product(o, self))

    def __truediv__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.quotient(self, o))

    def __rtruediv__(self, other: Any) -> Any:
        return _spread(other, lambda o: self.recorder.quotient(o, self))

    def __neg__(self) -> Expression:
        return self.recorder.put(Op.NEG, self)

    def __pos__(self) -> Expression:
        return self

    def __abs__(self) -> Expression:
        return self.recorder.put(Op.ABS, self)

    def __pow__(self, power: Any) -> Expression:
        return raised(self, power)

    def __rpow__(self, base: Any) -> Expression:
        return self.recorder.put(Op.EXP, self.recorder.product(self, self.recorder.put(Op.LOG, base)))

    def __bool__(self) -> bool:
        raise TypeError(
            "an expression has no truth value while a function is traced; expected piecewise, min, max, sign or abs of "
            "svo.functions instead of if, and, or, or a comparison"
        )

    def __lt__(self, other: Any) -> bool:
        return bool(self)

    __gt__ = __le__ = __ge__ = __lt__

    def __eq__(self, other: object) -> bool:
        return bool(self)  # False, silently, would take one branch of an if for all states

    __ne__ = __eq__
    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return "<expression>"

    def __float__(self) -> float:
        raise TypeError(
            "an expression is no number while a function is traced; expected the functions of svo.functions, not math"
        )


def raised(base: Expression, power: Any) -> Expression:
    """A power: whole ones by products, halves by a root, others by exp and log."""
    put = base.recorder.put
    if isinstance(power, Expression) or not is_finite_number(power):
        return put(Op.EXP, base.recorder.product(power, put(Op.LOG, base)))
    exponent = float(power)
    whole = int(exponent) if exponent.is_integer() and abs(exponent) <= 64 else None
    if whole is None and (2.0 * exponent).is_integer() and abs(exponent) <= 64:
        root, count = put(Op.SQRT, base), int(abs(exponent))
        return _inverse_if(exponent < 0, root if count == 0 else base.recorder.product(root, _whole(base, count)))
    if whole is None:
        return put(Op.EXP, base.recorder.product(exponent, put(Op.LOG, base)))
    return base.recorder.constant(1.0) if whole == 0 else _inverse_if(whole < 0, _whole(base, abs(whole)))


def _whole(base: Expression, power: int) -> Expression:
    if power == 1:
        return base
    half = _whole(base, power // 2)
    square = half.recorder.put(Op.SQR, half)
    return square if power % 2 == 0 else base.recorder.product(square, base)


def _inverse_if(negative: bool, e: Expression) -> Expression:
    return e.recorder.put(Op.INV, e) if negative else e


def _spread(other: Any, operation: Any) -> Any:
    """An operation with a number or an expression, or with every entry of an array of them."""
    if isinstance(other, np.ndarray) and other.ndim:
        return np.array([operation(o) for o in other.ravel()], dtype=object).reshape(other.shape)
    return operation(other)


def variables(recorder: Recorder, first: int, count: int) -> NDArray[Any]:
    """A vector of variables, so that ``A @ x``, ``x[0]`` and ``p, q = x`` are expressions."""
    vector = np.empty(count, dtype=object)
    for j in range(count):
        vector[j] = recorder.variable(first + j)
    return vector


def rows_of(what: str, value: Any, recorder: Recorder, names: Sequence[str]) -> list[Expression]:
    """What a function returned, as one expression a row."""
    if isinstance(value, Expression):
        value = [value]
    if not isinstance(value, Iterable) or isinstance(value, str | bytes | dict):
        raise TypeError(f"{what} returned a {type(value).__name__}; expected {len(names)} rows: {', '.join(names)}")
    rows = list(value)
    if len(rows) != len(names):
        raise ValueError(f"{what} returned {len(rows)} rows; expected {len(names)}, one each for {', '.join(names)}")
    found = []
    for name, row in zip(names, rows, strict=True):
        try:
            found.append(recorder.constant(row))
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"{what}, row {name}: {error}") from None
    return found

"""Elementary functions of nonlinear models: of numbers, of arrays, and of the expressions of a traced function.

    def f(x, u):
        return [(u[0] - 0.07 * sqrt(1962.0 * x[0])) / 15.5]

`NonlinearModel` traces such a function once into a tape of elementary operations, which it evaluates in floats, in
intervals and in linear forms with proven remainders.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from svo.checks import real_number
from svo.functions.expression import Expression, Recorder
from svo.functions.operations import Op

__all__ = [
    "abs",
    "atan2",
    "cos",
    "exp",
    "log",
    "max",
    "min",
    "piecewise",
    "sign",
    "sin",
    "sqrt",
    "sroot",
    "table",
    "tanh",
]

Value = Any  # a number, an array of numbers, or an Expression


def sqrt(v: Value) -> Value:
    """The square root of ``v``; the equations say nothing of negative ``v``."""
    return _applied(Op.SQRT, np.sqrt, v)


def exp(v: Value) -> Value:
    """The exponential of ``v``."""
    return _applied(Op.EXP, np.exp, v)


def log(v: Value) -> Value:
    """The natural logarithm of ``v``; the equations say nothing of ``v`` at or below zero."""
    return _applied(Op.LOG, np.log, v)


def sin(v: Value) -> Value:
    """The sine of ``v`` [rad]."""
    return _applied(Op.SIN, np.sin, v)


def cos(v: Value) -> Value:
    """The cosine of ``v`` [rad]."""
    return _applied(Op.COS, np.cos, v)


def tanh(v: Value) -> Value:
    """The hyperbolic tangent of ``v``."""
    return _applied(Op.TANH, np.tanh, v)


def abs(v: Value) -> Value:
    """The absolute value of ``v``."""
    return _applied(Op.ABS, np.abs, v)


def sign(v: Value) -> Value:
    """-1, 0 or 1 as ``v`` is; an enclosure that meets zero takes all between (a switch may slide there)."""
    return _applied(Op.SIGN, np.sign, v)


def sroot(v: Value) -> Value:
    """The signed root sign(v) sqrt(|v|), as of a flow between two levels.

    ``sign(v) * sqrt(abs(v))`` is recognised and becomes it: the remainder of the product is 4 to 6.5 times as wide.
    """
    return _applied(Op.SROOT, lambda s: np.sign(s) * np.sqrt(np.abs(s)), v)


def max(first: Value, second: Value) -> Value:
    """The larger one of ``first`` and ``second``."""
    return _applied(Op.MAX, np.maximum, first, second)


def min(first: Value, second: Value) -> Value:
    """The smaller one of ``first`` and ``second``."""
    return -max(-first, -second)


def atan2(y: Value, x: Value) -> Value:
    """The angle [rad] of the point (``x``, ``y``); at its cut, the negative x axis, anything from -pi to pi."""
    return _applied(Op.ATAN2, np.arctan2, y, x)


def piecewise(v: Value, breaks: Sequence[float], pieces: Sequence[Value]) -> Value:
    """The first of ``pieces`` below the first break of ``v``, the next one from there to the next, and so on.

    Parameters
    ----------
    v : number, array or expression
    breaks : sequence of float
        Increasing.
    pieces : sequence of numbers or expressions
        One more than breaks. A piece need be defined only where it holds.

    Raises
    ------
    ValueError
        For breaks that do not increase, or another number of pieces.
    """
    ends = [float(b) for b in breaks]
    if len(pieces) != len(ends) + 1 or not all(a < b for a, b in pairwise(ends)):
        raise ValueError(f"piecewise has breaks {ends} and {len(pieces)} pieces; expected increasing ones and one more")
    value = pieces[-1]
    for end, piece in zip(reversed(ends), reversed(pieces[:-1]), strict=True):
        value = _applied(Op.SELECT, lambda s, a, b: np.where(s < 0.0, a, b), v - end, piece, value)
    return value


def table(v: Value, points: Sequence[float], values: Sequence[float]) -> Value:
    """A table of ``v`` that is linear between its points, and constant before the first and after the last one.

    Its slope over any range is between the least and the largest of the pieces there; over a piece, and at a point, it
    is exact. Monotone or not.

    Parameters
    ----------
    v : number, array or expression
    points : sequence of float
        Increasing, at least two.
    values : sequence of float
        One a point.

    Raises
    ------
    TypeError, ValueError
        For numbers that are not finite, points that do not increase, or another number of values.
    """
    at, of = (_numbers(name, given) for name, given in (("points", points), ("values", values)))
    if len(at) < 2 or len(of) != len(at) or not all(a < b for a, b in pairwise(at)):
        raise ValueError(
            f"table has {len(at)} points and {len(of)} values; expected at least two increasing points, a value each"
        )
    if isinstance(v, np.ndarray) and v.dtype == object:
        return np.array([table(one, at, of) for one in v.ravel()], dtype=object).reshape(v.shape)
    if not isinstance(v, Expression):
        return np.interp(v, at, of)
    exact = v.recorder.constant  # what rounds is then enclosed
    x, y = [exact(point) for point in at], [exact(value) for value in of]
    slopes = [(y[i + 1] - y[i]) / (x[i + 1] - x[i]) for i in range(len(x) - 1)]
    value, before = y[0], exact(0.0)
    for point, slope in zip(x, [*slopes, exact(0.0)], strict=True):
        value, before = value + (slope - before) * max(v - point, 0.0), slope
    return value


def _numbers(name: str, given: Any) -> list[float]:
    if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray):
        raise TypeError(f"{name} is {given!r:.60}; expected a list of numbers")
    return [real_number(f"{name}[{i}]", number) for i, number in enumerate(given)]


def _applied(op: Op, of_numbers: Callable[..., Any], *operands: Value) -> Value:
    """An operation of expressions, if any operand is one, else of numbers."""
    if any(isinstance(v, np.ndarray) and v.dtype == object for v in operands):
        arrays = np.broadcast_arrays(*operands)
        found = np.empty(arrays[0].shape, dtype=object)
        for index in np.ndindex(found.shape):
            found[index] = _applied(op, of_numbers, *(array[index] for array in arrays))
        return found
    recorder: Recorder | None = next((v.recorder for v in operands if isinstance(v, Expression)), None)
    return of_numbers(*operands) if recorder is None else recorder.put(op, *operands)

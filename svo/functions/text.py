"""Expressions as text: read by Python's own grammar, of which a few nodes are allowed; nothing is ever executed."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from keyword import iskeyword
from typing import Any
from unicodedata import normalize

from svo import functions
from svo.functions.expression import Expression, NoValue, Recorder

CONSTANTS = {"pi": math.pi}
_LONGEST = 20_000  # characters
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}  # fmt: skip
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}
_OF_LISTS = {"piecewise": "piecewise(h, [0, 1], [0, h, 1])", "table": "table(h, [0, 1, 2], [0, 5, 6])"}
_FUNCTIONS = {name: getattr(functions, name) for name in functions.__all__ if name not in _OF_LISTS}
_OPERANDS = {"atan2": 2, "max": 2, "min": 2}


def parsed(where: str, text: str, recorder: Recorder, symbols: Mapping[str, Expression]) -> Expression:
    """An expression of symbols, numbers, ``+ - * / **``, and the functions of `svo.functions`.

    Parameters
    ----------
    where : str
        What the text is, for messages, such as "dynamics of h1".
    text : str
    recorder : Recorder
    symbols : mapping from names to expressions

    Raises
    ------
    TypeError
        If it is no text.
    ValueError
        Naming the symbol, or what else is not allowed, and its place.
    """
    if not isinstance(text, str):
        raise TypeError(f"{where} is a {type(text).__name__}; expected an expression as text, such as 'u - a * h'")
    if len(text) > _LONGEST:
        raise ValueError(f"{where} has {len(text)} characters; expected at most {_LONGEST}")
    known = {as_read(name): symbol for name, symbol in symbols.items()}
    flat = text.replace("\n", " ").strip()
    if not flat:
        raise ValueError(f"{where}: invalid syntax, it is empty; expected an expression, such as 'u - a * h'")
    try:
        tree = ast.parse(flat, mode="eval").body
        return recorder.constant(_Reader(where, flat, recorder, known).value(tree))
    except SyntaxError as error:
        at = f" at column {error.offset}" if error.offset else ""
        what = "a number has too many digits" if "integer string conversion" in error.msg else error.msg
        raise ValueError(f"{where}: {what}{at} of {flat!r:.200}{_unwritable(known)}") from None
    except (RecursionError, MemoryError):
        raise ValueError(f"{where} is nested too deeply; expected a simpler expression") from None


def as_read(name: str) -> str:
    """A name as Python's grammar reads it: a micro sign is a mu."""
    return normalize("NFKC", name)


def _unwritable(names: Iterable[str]) -> str:
    """Which of some names no expression can have, for messages."""
    wrong = next((name for name in names if not name.isidentifier() or iskeyword(name)), None)
    if wrong is None:
        return ""
    return f"; no expression can have the name {wrong!r:.60}: expected letters, digits and _, no word of Python"


class _Reader:
    """What the nodes of one expression stand for."""

    def __init__(self, where: str, text: str, recorder: Recorder, symbols: Mapping[str, Expression]) -> None:
        self.where, self.text, self.recorder, self.symbols = where, text, recorder, symbols

    def value(self, node: ast.expr) -> Expression:
        """The expression of a node."""
        try:
            if isinstance(node, ast.Constant):
                return self._number(node)
            if isinstance(node, ast.Name):
                return self._symbol(node)
            if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
                return self._of(_UNARY[type(node.op)](self.value(node.operand)))
            if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
                return self._binary(node)
            if isinstance(node, ast.Call):
                return self._call(node)
        except (NoValue, TypeError) as error:
            raise self._error(node, str(error)) from None
        shown = f"{ast.unparse(node)!r:.60}"
        is_power = isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor)
        known = "** for a power" if is_power else "numbers, symbols, + - * / ** and functions"
        raise self._error(node, f"{shown} is not allowed; expected {known}")

    def _of(self, value: Any) -> Expression:
        return self.recorder.constant(value)

    def _number(self, node: ast.Constant) -> Expression:
        if isinstance(node.value, bool) or not isinstance(node.value, int | float):
            raise self._error(node, f"{node.value!r:.60} is no number")
        try:
            return self._of(float(node.value))
        except (OverflowError, TypeError):
            raise self._error(node, "a number is too large") from None

    def _symbol(self, node: ast.Name) -> Expression:
        if node.id in self.symbols:
            return self.symbols[node.id]
        if node.id in CONSTANTS:
            return self._of(CONSTANTS[node.id])
        if node.id in _FUNCTIONS or node.id in _OF_LISTS:
            raise self._error(node, f"unknown symbol {node.id!r}; it is a function: expected {node.id}(...)")
        every = _unwritable(self.symbols)
        known = [name for name in (*self.symbols, *CONSTANTS) if not _unwritable([name])]
        close = get_close_matches(node.id, known, 1)
        hint = f"did you mean {close[0]!r}?" if close else f"expected one of {', '.join(known)}"
        raise self._error(node, f"unknown symbol {node.id!r:.60}; {hint}{every}")

    def _binary(self, node: ast.BinOp) -> Expression:
        left = self.value(node.left)
        if isinstance(node.op, ast.Pow):
            power = _constant(node.right)
            return self._of(left ** (self.value(node.right) if power is None else power))
        return self._of(_BINARY[type(node.op)](left, self.value(node.right)))

    def _call(self, node: ast.Call) -> Expression:
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        if name in _OF_LISTS:
            return self._of_lists(node, name)
        if name not in _FUNCTIONS:
            close = get_close_matches(name, _FUNCTIONS, 1)
            hint = f", such as {close[0]}" if close else ""
            every = ", ".join([*_FUNCTIONS, *_OF_LISTS])
            raise self._error(node, f"unknown function {name!r:.60}; expected one of {every}{hint}")
        count = _OPERANDS.get(name, 1)
        if node.keywords or len(node.args) != count:
            raise self._error(node, f"{name} takes {count} argument{'s' * (count > 1)}, each an expression")
        return self._of(_FUNCTIONS[name](*(self.value(argument) for argument in node.args)))

    def _of_lists(self, node: ast.Call, name: str) -> Expression:
        """piecewise(e, [breaks], [pieces]) and table(e, [points], [values])."""
        lists = node.args[1:]
        if node.keywords or len(node.args) != 3 or not all(isinstance(given, ast.List) for given in lists):
            raise self._error(node, f"{name} takes an expression and two lists, such as {_OF_LISTS[name]}")
        first, second = (given.elts for given in lists if isinstance(given, ast.List))
        numbers = [self._fixed(item) for item in first]
        try:
            if name == "table":
                return self._of(functions.table(self.value(node.args[0]), numbers, [self._fixed(i) for i in second]))
            pieces = [self.value(item) for item in second]
            return self._of(functions.piecewise(self.value(node.args[0]), numbers, pieces))
        except NoValue:
            raise
        except ValueError as error:
            raise error if str(error).startswith(self.where) else self._error(node, str(error)) from None

    def _fixed(self, node: ast.expr) -> float:
        number = _constant(node)
        if number is None:
            raise self._error(node, f"{ast.unparse(node)!r:.60} is no number, which stands in a list of them")
        return number

    def _error(self, node: ast.expr, what: str) -> ValueError:
        return ValueError(f"{self.where}: {what} (column {node.col_offset + 1} of {self.text!r:.200})")


def _constant(node: ast.expr) -> float | None:
    """A number with its sign, so that x**-2 and x**0.5 are the powers that they look like."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _constant(node.operand)
        return None if value is None else -value
    number = node.value if isinstance(node, ast.Constant) else None
    plain = isinstance(number, int | float) and not isinstance(number, bool) and abs(number) < 1e300
    return float(number) if plain else None  # type: ignore[arg-type]

"""The elementary operations of a tape: their codes, which a C interpreter shares, and how many operands each has."""

from __future__ import annotations

from enum import IntEnum


class Op(IntEnum):
    """Codes of operations; the order is that of the stored arrays and does not change."""

    VARIABLE = 0
    CONSTANT = 1
    NEG = 2
    ADD = 3
    SUB = 4
    MUL = 5
    SQR = 6
    INV = 7  # 1 / s
    SQRT = 8
    EXP = 9
    LOG = 10
    SIN = 11
    COS = 12
    TANH = 13
    ABS = 14
    SIGN = 15
    SROOT = 16  # sign(s) sqrt(|s|)
    MAX = 17
    ATAN2 = 18
    SELECT = 19  # the second operand where the first is below zero, else the third
    DIV = 20

    @property
    def operands(self) -> int:
        """How many slots it reads."""
        return _OPERANDS.get(self, 1)

    @property
    def word(self) -> str:
        """What a message calls it."""
        words = {Op.INV: "1 / (...)", Op.MUL: "product", Op.SQR: "square", Op.DIV: "quotient"}
        return words.get(self, self.name.lower())


_OPERANDS = {
    Op.VARIABLE: 0, Op.CONSTANT: 0, Op.ADD: 2, Op.SUB: 2, Op.MUL: 2, Op.MAX: 2, Op.ATAN2: 2, Op.SELECT: 3,
    Op.DIV: 2,
}  # fmt: skip

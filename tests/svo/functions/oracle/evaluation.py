"""A tape in Python's own intervals and linear forms: what the core's answers are held against."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from svo.checks import Array
from svo.functions.operations import Op
from svo.functions.tape import Forms, Tape
from tests.svo.functions.oracle.forms import Box, Form
from tests.svo.functions.oracle.intervals import Interval, NotEnclosed, applied

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


class Evaluation:
    """Of one tape."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        rows = zip(tape.op.tolist(), tape.operands.tolist(), tape.constants.tolist(), strict=True)
        self._program = [(Op(o), tuple(a[: max(1, Op(o).operands)]), (c[0], c[1])) for o, a, c in rows]

    def ranges(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Bounds (m,) of the rows over a box, in intervals.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        low, high = lower.tolist(), upper.tolist()
        ranges = self._rows(lambda j: (low[j], high[j]), lambda values: values, applied)
        ends = np.array(ranges).reshape(len(self.tape.outputs), 2)
        return ends[:, 0].copy(), ends[:, 1].copy()

    def forms(self, lower: Array, upper: Array, free: int) -> Forms:
        """The rows as linear forms in the first ``free`` coordinates over a box (nz,); the others go into remainders.

        Raises
        ------
        Unenclosed
            If a row has no bounded range.
        """
        low, high = lower.tolist(), upper.tolist()
        own = np.flatnonzero(self.tape.used[:free]).tolist()  # nothing depends on the others
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
        for row, slot in enumerate(self.tape.outputs.tolist()):
            if why.get(slot, _UNKNOWN) != _UNKNOWN:
                raise Unenclosed(row, why[slot])

    def _rows(self, *arithmetic: Any) -> list[Any]:
        """The rows in some arithmetic."""
        found, why = self._run(*arithmetic)
        for row, slot in enumerate(self.tape.outputs.tolist()):
            if found[slot] is None:
                raise Unenclosed(row, why[slot])
        return [found[slot] for slot in self.tape.outputs]

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

"""Answers with a reason: true or false in an ``if``, with what proves them beside it."""

from dataclasses import dataclass

import numpy as np

from polytopes.shown import Shown


@dataclass(frozen=True, eq=False)
class Answer(Shown):
    """Base of answers that are true or false, in an ``if`` and when they are compared with a truth value.

    Attributes
    ----------
    holds : bool
    """

    holds: bool

    def __bool__(self) -> bool:
        return self.holds

    def __eq__(self, other: object) -> bool:
        return self.holds == bool(other) if isinstance(other, bool | np.bool_) else self is other

    def __hash__(self) -> int:
        return id(self)

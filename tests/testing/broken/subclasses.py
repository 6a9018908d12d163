"""The project's own observers, each broken in public methods that a subclass overrides, and the rule that says so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np


def broken_subclasses(kind: Any) -> dict[Any, str]:
    """Subclasses of one kind of observer."""

    class AlarmWithoutProof(kind):
        def step(self, *given: Any, **named: Any) -> Any:
            return replace(super().step(*given, **named), certificate=None)

    class MissingAsTheLastReading(kind):
        def update(self, y0: Any, **named: Any) -> Any:
            self._reading = np.nan_to_num(y0)
            return super().update(y0, **named)

        def step(self, u: Any, y: Any, **named: Any) -> Any:
            self._reading = np.where(np.isnan(y), self._reading, y)
            return super().step(u, self._reading, **named)

    class NextInputFirst(kind):
        def step(self, u: Any, y: Any, u_next: Any = None, **named: Any) -> Any:
            return super().step(u_next, y, u_next=u_next, **named)

    class LastInputInTheOutput(kind):
        def step(self, u: Any, y: Any, u_next: Any = None, **named: Any) -> Any:
            return super().step(u, y, u_next=u, **named)

    class RaisesForUndecided(kind):
        def step(self, *given: Any, **named: Any) -> Any:
            answer = super().step(*given, **named)
            if answer.verdict == "undecided":
                raise RuntimeError("the solver failed")
            return answer

    class FalsifiedForGood(kind):
        _dead: Any = None

        def update(self, *given: Any, **named: Any) -> Any:
            return self._dead or super().update(*given, **named)

        def step(self, *given: Any, **named: Any) -> Any:
            answer = super().step(*given, **named)
            self._dead = answer if answer.verdict == "falsified" else self._dead
            return self._dead or answer

    class MeanOfAllFirstReadings(kind):
        first: list[Any] = []  # noqa: RUF012 - one list for all observers, as is the mistake

        def update(self, y0: Any, **named: Any) -> Any:
            self.first.append(y0[0])
            return super().update([np.mean(self.first), *y0[1:]], **named)

    return {
        AlarmWithoutProof: "alarm with proof",
        MissingAsTheLastReading: "missing readings",
        NextInputFirst: "input of its sample",
        LastInputInTheOutput: "input of its sample",
        RaisesForUndecided: "undecided is an answer",
        FalsifiedForGood: "reset after falsification",
        MeanOfAllFirstReadings: "runs apart",
    }

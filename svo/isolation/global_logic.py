"""What Architecture II concludes: the machine of Architecture I with models that wait, and with a global one.

    nominal ---> detected ---> isolated          detection: the nominal model is falsified; class II models start
       ^           |  |            |             isolation: exactly one fault model is left
       +-----------+--|------------+             back: timeout, or the nominal model holds again
       ^              v            v
       +-------- unexplained <-----+             every model is falsified, or (from any state) the global one

(Rosa and Silvestre 2013, section 4.2, Remark 5 and the conclusion.)
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from svo.isolation.logic import GLOBAL, NOMINAL, IsolationLogic, LogicState, Tally


@dataclass(frozen=True)
class GlobalLogic(IsolationLogic):
    """Transitions of Architecture II.

    Parameters
    ----------
    names, debounce, recovery, timeout
        As for Architecture I; the global model is none of the names.
    class_two : tuple of str
        Faults whose models need not contain the nominal plant: they run only while the nominal model is
        falsified.
    observed : bool
        Whether an observer, which can be falsified, gives the global set. It runs as long as any other does.
    """

    class_two: tuple[str, ...] = ()
    observed: bool = True

    @property
    def _counted(self) -> tuple[str, ...]:
        return (*self.names, GLOBAL) if self.observed else self.names

    def _to_run(self, alive: tuple[str, ...]) -> tuple[str, ...]:
        running = super()._to_run(alive)
        if NOMINAL in alive:
            running = tuple(n for n in running if n not in self.class_two)
        return (*running, GLOBAL) if running and self.observed else running

    def _to_restart(self, before: LogicState, after: LogicState, falsified: Collection[str]) -> tuple[str, ...]:
        over = before.state != "nominal" and after.state == "nominal"
        lost = after.state == "unexplained" and GLOBAL in falsified
        if over or lost:
            # What the others know rests on a model that was not the plant's, or on a set that is gone.
            return tuple(n for n in after.running if n != GLOBAL or n in falsified)
        return super()._to_restart(before, after, falsified)

    def _conclude(self, state: LogicState, sample: int, falsified: Collection[str]) -> LogicState:
        if GLOBAL in falsified and state.tallies[-1].falsified >= self.debounce:
            # The global model contains every other one, so they all are falsified with it.
            models = tuple(Tally(max(t.falsified, 1), 0) for t in state.tallies[:-1])
            return self._unexplained(replace(state, tallies=(*models, state.tallies[-1])), sample)
        return super()._conclude(state, sample, falsified)

"""What a bank concludes from falsified models: a state machine that knows nothing of observers.

    nominal ---> detected ---> isolated          detection: the nominal model is falsified
       ^           |  |            |             isolation: exactly one fault model is left
       +-----------+--|------------+             back: timeout, or the nominal model holds again
       ^              v            v
       +-------- unexplained <-----+             every model is falsified

(Rosa and Silvestre 2013, section 4.1, Architecture I, with the debounce of Remark 5.)
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Literal

NOMINAL = "nominal"
GLOBAL = "global"

StateName = Literal["nominal", "detected", "isolated", "unexplained"]


@dataclass(frozen=True)
class Tally:
    """Certified falsifications of one observer, and consistent samples since the last of them."""

    falsified: int = 0
    consistent: int = 0


@dataclass(frozen=True)
class LogicState:
    """The conclusion at a sample, and what to do before the next one.

    Attributes
    ----------
    state : {"nominal", "detected", "isolated", "unexplained"}
    alive : tuple of str
        Models that are not declared falsified.
    running : tuple of str
        Observers to step at the next sample: the alive ones and those on trial.
    restart : tuple of str
        Of these, the ones to initialise again before it.
    fault : str or None
        The fault that is isolated.
    detected_at, isolated_at : int or None
        Sample of the transition that led here.
    tallies : tuple of Tally
        One an observer, in the order of the names.
    settled : bool
        Whether the next sample changes nothing if nothing is falsified.
    """

    state: StateName
    alive: tuple[str, ...]
    running: tuple[str, ...]
    restart: tuple[str, ...] = ()
    fault: str | None = None
    detected_at: int | None = None
    isolated_at: int | None = None
    tallies: tuple[Tally, ...] = field(default=(), repr=False)
    settled: bool = True


@dataclass(frozen=True)
class IsolationLogic:
    """Transitions of Architecture I.

    Parameters
    ----------
    names : tuple of str
        "nominal" first, then the faults.
    debounce : int
        Certified falsifications, each after a new initialisation, that declare a model falsified.
    recovery : int or None
        Consistent samples since its last falsification after which an observer's earlier falsifications
        are forgotten. A falsified nominal model stays on trial, and when it has been consistent for so
        long the fault is over: all models are alive again. When every model is falsified all of them are
        put on trial. None: a declared falsification is final, and earlier ones are never forgotten.
    timeout : int or None
        Samples from detection without isolation after which all models are alive again.
    """

    names: tuple[str, ...]
    debounce: int = 1
    recovery: int | None = None
    timeout: int | None = None

    @property
    def may_restart(self) -> bool:
        """Whether any observer can be asked to initialise again."""
        return self.debounce > 1 or self.recovery is not None or self.timeout is not None

    def initial(self) -> LogicState:
        """Every model alive."""
        return LogicState("nominal", self.names, self._to_run(self.names), tallies=(Tally(),) * len(self._counted))

    def advance(
        self, before: LogicState, sample: int, falsified: Collection[str], undecided: Collection[str] = ()
    ) -> LogicState:
        """The state after a sample at which these of the running observers were falsified, with certificates."""
        if not falsified and before.settled:
            return before
        tallies = self._count(before, falsified, undecided)
        after = self._conclude(replace(before, tallies=tallies), sample, falsified)
        after = replace(after, restart=self._to_restart(before, after, falsified))
        return replace(after, settled=self._is_settled(after))

    def give_up(self, before: LogicState, sample: int) -> LogicState:
        """Every model is falsified and there is no set to start again from."""
        return replace(
            before, state="unexplained", alive=(), running=(), restart=(), fault=None, isolated_at=None,
            detected_at=sample if before.detected_at is None else before.detected_at, settled=True,
        )  # fmt: skip

    # -- which observers ---------------------------------------------------------------------------

    @property
    def _counted(self) -> tuple[str, ...]:
        """Observers that have a tally."""
        return self.names

    def _to_run(self, alive: tuple[str, ...]) -> tuple[str, ...]:
        """Observers to step while these models are alive: they, and those on trial."""
        if NOMINAL in alive or self.recovery is None:
            return alive
        return (NOMINAL, *alive) if alive else self.names

    def _to_restart(self, before: LogicState, after: LogicState, falsified: Collection[str]) -> tuple[str, ...]:
        """Whoever runs next and fell just now, or did not run."""
        return tuple(n for n in after.running if n in falsified or n not in before.running)

    # -- one sample --------------------------------------------------------------------------------

    def _count(self, before: LogicState, falsified: Collection[str], undecided: Collection[str]) -> tuple[Tally, ...]:
        tallies = []
        for name, tally in zip(self._counted, before.tallies, strict=True):
            if name in falsified:
                tally = Tally(tally.falsified + 1, 0)
            elif self._counts(tally) and name in before.running and name not in undecided:
                tally = Tally(tally.falsified, tally.consistent + 1)
                if self._has_recovered(tally) and (name in before.alive or name not in self.names):
                    tally = Tally()
            tallies.append(tally)
        return tuple(tallies)

    def _conclude(self, state: LogicState, sample: int, falsified: Collection[str]) -> LogicState:
        tally = dict(zip(self._counted, state.tallies, strict=True))
        on_trial = [n for n in self.names if n in state.running and n not in state.alive]
        recovered = tuple(n for n in on_trial if self._has_recovered(tally[n]))
        if NOMINAL in recovered:
            return self.initial()
        if state.state == "unexplained":
            return self._declare(self._afresh(state, recovered), sample, recovered) if recovered else state
        alive = tuple(n for n in state.alive if n not in falsified or tally[n].falsified < self.debounce)
        if not alive:
            return self._unexplained(state, sample)
        after = self._declare(state, sample, alive)
        return self.initial() if after.state == "detected" and self._is_late(after, sample) else after

    def _declare(self, state: LogicState, sample: int, alive: tuple[str, ...]) -> LogicState:
        """The state that follows from the models that are left."""
        running = self._to_run(alive)
        if NOMINAL in alive:
            return replace(state, state="nominal", alive=alive, running=running)
        detected_at = sample if state.detected_at is None else state.detected_at
        isolated = len(alive) == 1
        return replace(
            state,
            state="isolated" if isolated else "detected",
            alive=alive,
            running=running,
            fault=alive[0] if isolated else None,
            detected_at=detected_at,
            isolated_at=(sample if state.isolated_at is None else state.isolated_at) if isolated else None,
        )

    def _unexplained(self, state: LogicState, sample: int) -> LogicState:
        return replace(self.give_up(state, sample), running=self._to_run(()))

    def _afresh(self, state: LogicState, recovered: tuple[str, ...]) -> LogicState:
        """A new diagnosis by the models that passed their trial."""
        tallies = zip(self._counted, state.tallies, strict=True)
        return replace(state, detected_at=None, tallies=tuple(Tally() if n in recovered else t for n, t in tallies))

    def _has_recovered(self, tally: Tally) -> bool:
        return self.recovery is not None and tally.falsified > 0 and tally.consistent >= self.recovery

    def _counts(self, tally: Tally) -> bool:
        return self.recovery is not None and tally.falsified > 0

    def _is_late(self, state: LogicState, sample: int) -> bool:
        assert state.detected_at is not None
        return self.timeout is not None and sample - state.detected_at >= self.timeout

    def _is_settled(self, state: LogicState) -> bool:
        counting = any(self._counts(t) for t in state.tallies)
        return not state.restart and not counting and not (state.state == "detected" and self.timeout is not None)

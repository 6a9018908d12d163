"""What a bank says at a sample, and over a whole log."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Picture, Shown, in_a_line
from polytopes.signatures import options_by_name
from svo.checks import Array, optional_import
from svo.isolation.logic import NOMINAL, StateName
from svo.logs.log import Log
from svo.models import Labels
from svo.observers.base import Certificate, Step
from svo.observers.record import panels_of, runs
from svo.pictures.sets import picture_of_sets
from svo.pictures.style import INK, colours, in_seconds
from svo.pictures.timeline import Lane, Span, Timeline

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_SHOWN = 20_000  # samples: a notebook that shows a longer record does not wait for boxes that nobody asked for
_STATES = {"nominal": "#8A929B", "detected": "#E69F00", "isolated": "#D55E00", "unexplained": INK}


@dataclass(frozen=True, slots=True)
class Verdict(Shown):
    """The bank's conclusion at one sample.

    Attributes
    ----------
    sample : int
        Counted from the first measurement, which is sample 0.
    state : {"nominal", "detected", "isolated", "unexplained"}
    fault : str or None
        The fault that is isolated, None otherwise.
    alive : tuple of str
        Models that are not declared falsified.
    detected_at, isolated_at : int or None
        Sample at which the present fault was detected, and isolated.
    steps : mapping of str to Step
        Answers of the observers that were stepped or started, "global" among them if the bank has a global
        observer. Boxes and sets must be read before the next sample; those of an observer that was falsified
        and starts again have nothing to read.
    """

    sample: int
    state: StateName
    fault: str | None
    alive: tuple[str, ...]
    detected_at: int | None
    isolated_at: int | None
    steps: Mapping[str, Step]

    @property
    def stopped(self) -> int:
        """Programs of its steps that ended at a limit, as `Observer.stopped`."""
        return sum(step.stopped for step in self.steps.values())

    def __repr__(self) -> str:
        fault = f", {self.fault}" if self.fault else ""
        since = {"detected": self.detected_at, "isolated": self.isolated_at}
        when = "".join(f"; {what} at {at}" for what, at in since.items() if at is not None)
        alive = ", ".join(self.alive) or "no model"
        return in_a_line(f"<Verdict at sample {self.sample}: {self.state}{fault}; alive: {alive}{when}>")

    def _picture(self) -> Picture | None:
        sets = {name: step.set for name, step in self.steps.items() if step.verdict != "falsified"}
        n = max((step.n for step in self.steps.values()), default=0)
        return picture_of_sets(sets, list(self.steps), [f"x[{i}]" for i in range(n)][:2])


@dataclass(frozen=True, eq=False, repr=False)
class BankRecord(Shown):
    """A run of a bank over a log of K samples; columns in the order of ``names``.

    Attributes
    ----------
    names : tuple of str
        "nominal", then the faults.
    states : tuple of str
        State of the bank at each sample.
    alive : (K, n_observers) array of bool
        Models not declared falsified, after each sample.
    seconds : (K, n_observers) array
        Wall time of each observer's step; NaN where it was not stepped.
    undecided : (K, n_observers) array of bool
        Answers that were neither a proof nor a point.
    stopped : (K, n_observers) array of int
        Programs that ended at a limit, as `Observer.stopped`; of samples taken at once, at the last.
    died_at : mapping of str to int or None
        First sample at which a model was declared falsified; "global" is there if its observer was.
    certificates : mapping of str to Certificate or None
        Proof of that falsification.
    detected_at, isolated_at : int or None
        FIRST sample of the run at which a fault was detected, and at which one was isolated.
    fault : str or None
        The fault that was isolated then.
    verdict : Verdict
        The bank's conclusion at the last sample, without steps.
    log : Log
    labels : Labels
        Names of states and outputs.
    replay : Replay
        What computes `boxes`.
    global_seconds : (K,) array or None
        Wall time of the global observer's step, NaN where it was not stepped; None if the bank has none.
    reason : str or None
        Of the first undecided answer that has one: the observer, the sample, and why.
    """

    names: tuple[str, ...]
    states: tuple[StateName, ...]
    alive: NDArray[np.bool_]
    seconds: NDArray[np.float64]
    undecided: NDArray[np.bool_]
    stopped: NDArray[np.int64]
    died_at: Mapping[str, int | None]
    certificates: Mapping[str, Certificate | None]
    detected_at: int | None
    isolated_at: int | None
    fault: str | None
    verdict: Verdict
    log: Log
    labels: Labels
    replay: Replay
    global_seconds: NDArray[np.float64] | None = None
    reason: str | None = None

    @property
    def time(self) -> Array:
        """The log's own times (K,) [s]."""
        return self.log.time

    @property
    def falsified_at(self) -> int | None:
        """Sample at which the nominal model was declared falsified; None if it never was."""
        return self.died_at[NOMINAL]

    @property
    def boxes(self) -> Mapping[str, tuple[Array, Array]]:
        """Bounds (lower, upper), each (K, n), of the state by each model; "global" is there if the bank has one.

        Infinite while a set is outgrown, NaN where a model was falsified or not running. They are computed when they
        are first asked for, by running the bank over the log again.

        Raises
        ------
        ValueError
            If the bank could not be copied before the run, or the record was pickled before the boxes were asked for.
        """
        return self.replay.boxes

    @options_by_name
    def plot(self, ax: Axes | None = None, *, channels: Sequence[str] | None = None) -> list[Artist]:
        """Draw what the bank concluded and which models were alive, above their bounds of each state and the readings.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Drawn in its place; a new figure if absent.
        channels : sequence of str, optional
            Names of the states and outputs to draw; all by default.

        Returns
        -------
        list of Artist
        """
        return self.timeline(channels).draw(ax)

    def timeline(self, channels: Sequence[str] | None = None) -> Timeline:
        """What `plot` draws, with ``channels`` as there: to be drawn in parts, or written into files.

        Raises
        ------
        ValueError
            For a channel of another name, and as `boxes`.
        """
        return self._timeline(channels, self.boxes)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame`, a row a sample: time, state of the bank, readings; of each model life and bounds."""
        cells: dict[str, Any] = {"time_s": self.time, "state": list(self.states)}
        cells |= dict(zip(self.labels.outputs, self.log.y.T, strict=True))
        for i, name in enumerate(self.names):
            cells[f"{name}_alive"] = self.alive[:, i]
            lower, upper = self.boxes[name]
            for state, label in enumerate(self.labels.states):
                cells |= {f"{name}_{label}_lower": lower[:, state], f"{name}_{label}_upper": upper[:, state]}
        return optional_import("pandas", "study", "data frames").DataFrame(cells)

    def __repr__(self) -> str:
        alive = ", ".join(self.verdict.alive)
        found = "; ".join(self._marks().values()) or "no fault"
        return in_a_line(f"<BankRecord of {len(self.states)} samples: {found}; alive: {alive:.120}>")

    def _picture(self) -> Picture:
        known = len(self.time) <= _SHOWN or self.replay.known
        timeline = self._timeline(None, self.boxes if known else {})
        return Picture(timeline.draw, timeline.width, timeline.height)

    def _timeline(self, channels: Sequence[str] | None, boxes: Mapping[str, tuple[Array, Array]]) -> Timeline:
        tone = colours(self.names)
        bounds = {tone[name]: boxes[name] for name in self.names if name in boxes}
        panels = panels_of(self.log, self.labels, bounds, channels)
        return Timeline(self.time, list(self._lanes(tone)), panels, self._marks())

    def _marks(self) -> dict[int, str]:
        marks: dict[int, list[str]] = {}
        for what, at in (("detected", self.detected_at), (f"isolated: {self.fault}", self.isolated_at)):
            if at is not None:
                marks.setdefault(at, []).append(what)
        return {
            at: f"{', '.join(what):.80} at {in_seconds(self.time[at], self.labels.Ts)}" for at, what in marks.items()
        }

    def _lanes(self, tone: Mapping[str, str]) -> Iterator[Lane]:
        yield Lane("bank", INK, tuple(Span(a, b, _STATES[state], state) for state, a, b in runs(self.states)))
        for i, name in enumerate(self.names):
            answers = list(zip(self.alive[:, i].tolist(), self.undecided[:, i].tolist(), strict=True))
            spans = [Span(a, b, tone[name], open=open) for (alive, open), a, b in runs(answers) if alive]
            falls = np.flatnonzero(self.alive[:-1, i] & ~self.alive[1:, i]) + 1
            first = [] if self.alive[0, i] else [0]
            yield Lane(name, tone[name], tuple(spans), (*first, *falls.tolist()))


class Replay:
    """Boxes of a run, by running a copy of its bank again when they are asked for."""

    def __init__(self, boxes: Callable[[], Mapping[str, tuple[Array, Array]]]) -> None:
        self._compute: Callable[[], Mapping[str, tuple[Array, Array]]] | None = boxes

    @property
    def known(self) -> bool:
        """Whether they were asked for before."""
        return "boxes" in self.__dict__

    @cached_property
    def boxes(self) -> Mapping[str, tuple[Array, Array]]:
        """By the name of each observer."""
        if self._compute is None:
            raise ValueError("the boxes were not asked for before the record was pickled; ask for record.boxes first")
        return self._compute()

    def __getstate__(self) -> dict[str, Any]:
        # what would run again holds models, whose functions cannot always be pickled
        return {**self.__dict__, "_compute": None}

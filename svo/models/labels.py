"""What the channels of a model are called in pictures and tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import expect
from svo.logs.names import Column, Columns
from svo.models.model import UncertainModel
from svo.models.nonlinear import NonlinearModel


@dataclass(frozen=True)
class Labels(Shown):
    """Names of states and outputs.

    Attributes
    ----------
    states, outputs : tuple of str
    reads : tuple of int or None
        Of each output, the state that it reads as it is; None where it is anything else.
    Ts : float
        Sampling time [s].
    units : tuple of str
        Of the states, then of the outputs; empty where they are not known.
    """

    states: tuple[str, ...]
    outputs: tuple[str, ...]
    reads: tuple[int | None, ...]
    Ts: float
    units: tuple[str, ...] = ()

    @classmethod
    def of(cls, model: UncertainModel | NonlinearModel) -> Labels:
        """Those of a model; x[0] and the like where it has no names."""
        names = dict(model.names or {})
        states = names.get("states", [f"x[{i}]" for i in range(model.n_states)])
        outputs = names.get("outputs", [f"y[{j}]" for j in range(model.n_outputs)])
        return cls(tuple(states), tuple(outputs), _reads(model), model.Ts)

    def in_columns(self, columns: Columns) -> Labels:
        """With the names and units of a log's columns; states keep theirs where the columns have none."""
        known = len(columns.states) == len(self.states)
        states = tuple(c.name for c in columns.states) if known else self.states
        units = [c.unit for c in columns.states] if known else [""] * len(states)
        outputs = tuple(c.name for c in columns.outputs)
        return replace(self, states=states, outputs=outputs, units=(*units, *(c.unit for c in columns.outputs)))

    @property
    def state_titles(self) -> tuple[str, ...]:
        """States as their bounds are shown, with units where they are known."""
        return tuple(Column(*named).bounded for named in zip(self.states, self._units(0), strict=False))

    @property
    def output_titles(self) -> tuple[str, ...]:
        """Outputs, with units where they are known."""
        return tuple(Column(*named).label for named in zip(self.outputs, self._units(len(self.states)), strict=False))

    def _units(self, first: int) -> tuple[str, ...]:
        return (self.units or ("",) * len(self.states + self.outputs))[first:]

    def chosen(self, channels: Sequence[str] | None) -> tuple[list[int], list[int]]:
        """Numbers of the states and of the outputs of some names; of all that are not read as a state by default.

        Raises
        ------
        ValueError
            For a name that is none of them.
        """
        if channels is None:
            return list(range(len(self.states))), [j for j, i in enumerate(self.reads) if i is None]
        every = self.states + self.outputs
        titles = [*zip(every, (*self.state_titles, *self.output_titles), strict=True)]
        meant = {title.partition(" [")[0]: name for name, title in reversed(titles)}  # a state, where both have it
        asked = [channels] if isinstance(channels, str) else list(channels)
        wanted = [name if name in every else meant.get(name, name) for name in asked]
        for name in wanted:
            expect(name in every, "channels", name, f"any of {', '.join(every)}")
        states = [i for i, name in enumerate(self.states) if name in wanted]
        return states, [j for j, name in enumerate(self.outputs) if name in wanted and self.reads[j] not in states]

    def reading_of(self, state: int) -> int | None:
        """The output that reads a state as it is."""
        return self.reads.index(state) if state in self.reads else None


def _reads(model: UncertainModel | NonlinearModel) -> tuple[int | None, ...]:
    """Only what is constant and exact counts: a row of the identity, and no other term."""
    if isinstance(model, NonlinearModel):
        return model.reads
    if any(callable(value) for value in (model.C, model.D, model.c)):
        return (None,) * model.n_outputs
    stack: Any = model.stack(model.schedule)[:, model.n_states :]
    n, nw = model.n_states, model.n_disturbances
    told = np.abs(stack[1:]).sum(axis=(0, 2)) + np.abs(stack[0, :, n : stack.shape[2] - nw]).sum(axis=1)
    rows = stack[0, :, :n]
    return tuple(
        int(np.argmax(row)) if not other and np.count_nonzero(row) == 1 and row.max() == 1.0 else None
        for row, other in zip(rows, told, strict=True)
    )

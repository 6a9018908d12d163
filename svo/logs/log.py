"""Recorded or simulated data of a plant, one row a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from polytopes.shown import Picture, Shown, counted, in_a_line
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_kind, expect_shape, readings, real_array, sizes
from svo.logs import frames
from svo.logs.columns import TIME_TOLERANCE, checked_parts
from svo.logs.names import Columns
from svo.pictures.timeline import Panel, Timeline


@options_by_name
@dataclass(frozen=True, eq=False)
class Log(Shown):
    """Samples of one run; row k holds what is known of time ``time[k]``.

    Attributes
    ----------
    time : (K,) array
        Seconds, strictly increasing.
    u : (K, nu) array
        ``u[k]`` is held from sample k to sample k + 1.
    y : (K, ny) array
        Measurements; NaN marks a sensor that is missing at that sample.
    x : (K, n) array, optional
        True states, known in simulation only.
    schedule : (K, ...) array, optional
        Scheduling value at each sample; None for plants without one.
    source : str, optional
        Where it comes from, such as the name of its file: stored with the alarms that it raises.
    events : bool, optional
        Whether each transition takes the time between its stamps (True), or the model's sampling time (False). By
        default the former where the steps differ so much that no sampling time is within 1 % of all of them.
    widening : (ny,) array, optional
        By what the bound of each sensor's noise is wider on this log than in the model, half-widths in its unit: the
        price of readings that were moved in time, and of numbers that were rounded. `svo.detect` adds it.
    """

    time: Array
    u: Array
    y: Array
    _: KW_ONLY
    x: Array | None = None
    schedule: Array | None = None
    source: str | None = None
    events: bool | None = None
    widening: Array | None = None

    def __post_init__(self) -> None:
        time = real_array("time", self.time, ("K",), finite=False)
        later = np.append(True, time[1:] > time[:-1])[: time.size]
        wrong = np.flatnonzero(~(np.isfinite(time) & later))
        if wrong.size:
            raise ValueError(f"time[{wrong[0]}] is {time[wrong[0]]}; expected finite, strictly increasing seconds")
        object.__setattr__(self, "time", time)
        for name in ("u", "y", "x", "schedule"):
            value = getattr(self, name)
            if value is None and name in ("x", "schedule"):
                continue
            array = readings(name, value) if name in ("y", "x") else real_array(name, value)
            fits = array.shape[:1] == time.shape and (name == "schedule" or array.ndim == 2)
            expect_shape(fits, name, array, f"({time.size}, channels), one row a sample of time")
            object.__setattr__(self, name, array)
        if self.widening is not None:
            object.__setattr__(self, "widening", sizes("widening", self.widening, self.y.shape[1]))

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        span = f", {self.time[0]:g} to {self.time[-1]:g} s" if len(self) else ""
        counts = counted({"input": self.u.shape[1], "output": self.y.shape[1]})
        others = "".join(f", {name}" for name in ("x", "schedule") if getattr(self, name) is not None)
        source = f"; from {self.source!r}" if self.source else ""
        return in_a_line(f"<Log of {len(self)} samples{span}: {counts}{others}{source}>")

    def _picture(self) -> Picture | None:
        if len(self) == 0:
            return None
        panels = [Panel(f"{name}[{i}]", truth=u) for name, us in (("u", self.u),) for i, u in enumerate(us.T)]
        timeline = Timeline(self.time, [], panels + [Panel(f"y[{i}]", readings=y) for i, y in enumerate(self.y.T)])
        return Picture(timeline.draw, timeline.width, timeline.height)

    def schedule_at(self, k: int) -> float | Array | None:
        """Scheduling value of sample k, or None where the log has none."""
        if self.schedule is None:
            return None
        value = self.schedule[k]
        return float(value) if value.ndim == 0 else value

    @cached_property
    def keeps_its_times(self) -> bool:
        """Whether a transition takes the time between its stamps instead of the model's sampling time."""
        if self.events is None:
            steps = np.diff(self.time)
            least, most = steps.min(initial=np.inf), steps.max(initial=0.0)
            return bool(most * (1 - TIME_TOLERANCE) > least * (1 + TIME_TOLERANCE))
        return self.events

    def interval_at(self, k: int) -> float | None:
        """Seconds from sample k - 1 to k; None where that is the sampling time, or k the first sample."""
        return float(self.time[k] - self.time[k - 1]) if k > 0 and self.keeps_its_times else None

    # -- other forms -----------------------------------------------------------------------------

    def to_columns(self, columns: Columns) -> dict[str, Array]:
        """The columns (K,) by name: time, inputs, outputs and, if the log has them, true states.

        Parameters
        ----------
        columns : Columns
            The names, in the order of the channels.

        Raises
        ------
        ValueError
            If the log has another number of channels than there are columns.
        """
        groups = (("u", self.u, columns.inputs), ("y", self.y, columns.outputs), ("x", self.x, columns.states))
        cells = {columns.time: self.time}
        for name, values, group in groups:
            if values is None:
                continue
            if values.shape[1] != len(group):
                wanted = f"{len(group)}, one a column of the plant"
                raise ValueError(f"{name} of the log has {values.shape[1]} channels; expected {wanted}")
            cells |= {c.name: values[:, i] for i, c in enumerate(group)}
        return cells

    @classmethod
    def from_columns(cls, source: str, cells: Mapping[str, Array], columns: Columns, Ts: float) -> Log:
        """From whole columns (K,) of numbers by name, under the rules of `svo.logs.columns`.

        Parameters
        ----------
        source : str
            Where they come from, for messages.
        cells : mapping of str to (K,) array
            Time, inputs, outputs and, if all are there, states.
        columns : Columns
            The names, in the order of the channels.
        Ts : float
            The model's sampling time [s].

        Raises
        ------
        ValueError
            Naming the source, the sample and the column.
        """
        return cls(**checked_parts(source, cells, columns, Ts))

    def to_dataframe(self, columns: Columns) -> Any:
        """A `pandas.DataFrame`, one column a channel (time included), in the order of a log file.

        The units are in ``frame.attrs["units"]``, by the names of ``columns``.
        """
        return frames.dataframe(self.to_columns(columns), columns)

    @classmethod
    def from_dataframe(cls, frame: Any, columns: Columns, Ts: float) -> Log:
        """From a `pandas.DataFrame`, under the rules of `svo.logs.columns`.

        Parameters
        ----------
        frame : pandas.DataFrame
            Time is a column, or the index if that has the name of the time column.
        columns : Columns
            The names, in the order of the channels.
        Ts : float
            The model's sampling time [s].

        Raises
        ------
        TypeError, ValueError
            Naming the sample and the column.
        """
        return cls.from_columns("the data frame", frames.cells_of_dataframe(frame, columns), columns, Ts)

    def to_xarray(self, columns: Columns) -> Any:
        """An `xarray.Dataset` over the time of the log: a variable a channel of ``columns``, with its unit."""
        return frames.dataset(self.to_columns(columns), columns)

    @classmethod
    def from_xarray(cls, dataset: Any, columns: Columns, Ts: float) -> Log:
        """From an `xarray.Dataset` whose variables are the columns, each over one dimension.

        Parameters
        ----------
        dataset : xarray.Dataset
        columns : Columns
            The names, in the order of the channels.
        Ts : float
            The model's sampling time [s].

        Raises
        ------
        TypeError, ValueError
            Naming the sample and the variable.
        """
        return cls.from_columns("the data set", frames.cells_of_dataset(dataset, columns), columns, Ts)


def expect_log(log: Any) -> None:
    """Refuse what is no log, or has no samples."""
    expect_kind("log", log, Log, "an svo.Log, such as svo.read_log gives")
    if len(log) == 0:
        raise ValueError("log has no samples; expected at least one")

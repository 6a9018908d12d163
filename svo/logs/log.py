"""Recorded or simulated data of a plant, one row a sample."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.checks import Array, readings, real_array

if TYPE_CHECKING:
    from svo.logs.names import Columns


@dataclass(frozen=True, eq=False)
class Log:
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
    """

    time: Array
    u: Array
    y: Array
    x: Array | None = None
    schedule: Array | None = field(default=None)

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
            if array.shape[:1] != time.shape or (name != "schedule" and array.ndim != 2):
                raise ValueError(
                    f"{name} has shape {array.shape}; expected ({time.size}, channels), one row a sample of time"
                )
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return int(self.time.size)

    def schedule_at(self, k: int) -> float | Array | None:
        """Scheduling value of sample k, or None where the log has none."""
        if self.schedule is None:
            return None
        value = self.schedule[k]
        return float(value) if value.ndim == 0 else value

    # -- other forms -----------------------------------------------------------------------------

    def to_dataframe(self, columns: Columns) -> Any:
        """A `pandas.DataFrame`; see `svo.logs.frames.to_dataframe`."""
        from svo.logs.frames import to_dataframe

        return to_dataframe(self, columns)

    @classmethod
    def from_dataframe(cls, frame: Any, columns: Columns, Ts: float) -> Log:
        """From a `pandas.DataFrame`; see `svo.logs.frames.from_dataframe`."""
        from svo.logs.frames import from_dataframe

        return from_dataframe(frame, columns, Ts)

    def to_xarray(self, columns: Columns) -> Any:
        """An `xarray.Dataset`; see `svo.logs.frames.to_xarray`."""
        from svo.logs.frames import to_xarray

        return to_xarray(self, columns)

    @classmethod
    def from_xarray(cls, dataset: Any, columns: Columns, Ts: float) -> Log:
        """From an `xarray.Dataset`; see `svo.logs.frames.from_xarray`."""
        from svo.logs.frames import from_xarray

        return from_xarray(dataset, columns, Ts)

"""What a comparison knows of a detector: a protocol, and the small objects that go in and out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from svo.logs.log import Log

Kind = Literal["falsification", "threshold"]
NOBODY = -1  # in `Detection.isolated`: no fault is named


@dataclass(frozen=True)
class Parameter(Shown):
    """The range in which the optimiser looks for an inner parameter.

    Attributes
    ----------
    low, high : float
        Both included; low < high.
    integer : bool
        Rounded to the nearest whole number.
    logarithmic : bool
        Searched on a logarithmic scale; low is then positive.
    """

    low: float
    high: float
    integer: bool = False
    logarithmic: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and self.low < self.high):
            raise ValueError(f"low is {self.low} and high is {self.high}; expected finite numbers, low < high")
        if self.logarithmic and self.low <= 0:
            raise ValueError(f"low is {self.low:g} on a logarithmic scale; expected a positive number")

    def at(self, fraction: float) -> float:
        """The value at a fraction in [0, 1] of the range."""
        if self.logarithmic:
            value = float(self.low * (self.high / self.low) ** fraction)
        else:
            value = float(self.low + fraction * (self.high - self.low))
        return float(round(value)) if self.integer else value


@dataclass(frozen=True)
class Setting(Shown):
    """Everything that tuning decides about a detector; plain numbers and arrays, so it travels between processes.

    Attributes
    ----------
    level : float
        The one knob that trades false alarms for delay. Raising it never adds an alarm: a threshold, or the
        factor on the bounds of a set-membership model (1 = the bounds as stated).
    parameters : mapping of str to float
        Inner parameters, found by the optimiser.
    learned : mapping of str to array
        What the detector learnt from fault-free training logs, such as the standard deviation of its residuals.
    """

    level: float
    parameters: Mapping[str, float] = field(default_factory=dict)
    learned: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@dataclass(frozen=True)
class Detection(Shown):
    """What a detector says over a log of K samples.

    Attributes
    ----------
    alarm : (K,) array of bool
        The decision at each sample. Falsifications last: a falsified model stays so.
    isolated : (K,) array of int, or None
        Index into the detector's ``faults`` of the fault that it names at each sample, -1 where it names none;
        None for a detector that cannot isolate.
    processed : int
        Samples that were worked on: a bank may stop when nothing can change its verdict any more.
    width : (K, m) array, or None
        Width of the detector's bounds on the plant's quantities of interest, NaN where it has none; None for
        detectors without sets.
    """

    alarm: NDArray[np.bool_]
    isolated: NDArray[np.intp] | None = None
    processed: int = field(default=-1)
    width: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if self.alarm.ndim != 1 or self.alarm.dtype != np.bool_:
            raise ValueError(f"alarm has shape {self.alarm.shape} and type {self.alarm.dtype}; expected (K,) of bool")
        if self.isolated is not None and self.isolated.shape != self.alarm.shape:
            raise ValueError(f"isolated has shape {self.isolated.shape}; expected {self.alarm.shape}, as alarm has")
        if self.width is not None and self.width.shape[:1] != self.alarm.shape:
            raise ValueError(f"width has shape {self.width.shape}; expected ({self.alarm.size}, m), one row a sample")
        if self.processed < 0:
            object.__setattr__(self, "processed", self.alarm.size)


@runtime_checkable
class Detector(Protocol):
    """A detector in a comparison. It keeps no data between calls: all it knows comes with the arguments.

    Attributes
    ----------
    name : str
        For the table and the picture.
    kind : {"falsification", "threshold"}
        Whether an alarm is a proof that the model's bounds do not hold, or the crossing of a tuned threshold.
    faults : tuple of str
        Names of the faults that it can tell apart; empty if it only detects.
    parameters : mapping of str to Parameter
        Inner parameters for the optimiser; may be empty.
    fixed : Setting or None
        A setting that is not to be tuned (bounds as stated); None for a detector that is tuned.
    """

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> Kind: ...

    @property
    def faults(self) -> tuple[str, ...]: ...

    @property
    def parameters(self) -> Mapping[str, Parameter]: ...

    @property
    def fixed(self) -> Setting | None: ...

    def prepare(self, log: Log) -> Any:
        """Whatever of a log's evaluation depends on no setting; computed once while tuning tries many."""
        ...

    def learn(self, parameters: Mapping[str, float], healthy: Sequence[Any]) -> Mapping[str, NDArray[np.float64]]:
        """What is to be learnt from prepared fault-free logs with these inner parameters; may be empty."""
        ...

    def critical_level(self, setting: Setting, prepared: Any, floor: float) -> float:
        """The smallest level that gives no alarm on a prepared log; ``floor`` where it is not above that.

        The level of the setting is not looked at. An answer that is searched for is rounded up.
        """
        ...

    def run(self, setting: Setting, prepared: Any, isolate: bool = True) -> Detection:
        """Alarms over a prepared log and, where it can and is asked to, the isolated fault."""
        ...

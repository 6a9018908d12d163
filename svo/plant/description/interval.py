"""The table [interval_detector]: the 1-D detector that runs beside the observers, and what its noise is learnt from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polytopes.shown import Shown
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization
from svo.logs.log import Log
from svo.logs.names import Columns
from svo.plant.description.table import Table

_KNOWN = (
    "input", "output", "g", "h", "slope", "limit", "initial_radius", "pole", "qbar", "safety_factor", "records",
    "learn_until_s",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class IntervalSettings(Shown):
    """An interval detector for one input and one output of a plant.

    Attributes
    ----------
    u, y : int
        The channels.
    gains : GainBounds
    initial_radius : float
        Of the interval of the first state, about the first measurement.
    pole, qbar, safety_factor
        See `svo.interval`.
    records : tuple of path
        Fault-free logs to learn the noise from.
    learn_until_s : float or None
        Without records: the log itself is taken as fault-free up to this time [s], and judged from there on.
    """

    u: int
    y: int
    gains: GainBounds
    initial_radius: float
    pole: float
    qbar: int
    safety_factor: float
    records: tuple[Path, ...]
    learn_until_s: float | None

    def detector(self, log: Log, read: Callable[[Path], Log]) -> tuple[IntervalDetector, Log]:
        """The detector with its learnt noise, and the part of the log that it is to judge; ``read`` reads the records.

        Raises
        ------
        ValueError
            If there is too little to learn from, or nothing to judge.
        OSError
            If a record cannot be opened.
        """
        if self.learn_until_s is None:
            learning, judged = [self._channel(read(path)) for path in self.records], self._channel(log)
        else:
            begin = int(np.searchsorted(log.time, self.learn_until_s))
            if not 0 < begin < len(log):
                raise ValueError(
                    f"learn_until_s is {self.learn_until_s:g} s, but the log goes from {log.time[0]:g} s to "
                    f"{log.time[-1]:g} s; expected a time inside it"
                )
            learning, judged = [self._channel(log, slice(0, begin))], self._channel(log, slice(begin, None))
        residuals = [self._predictor(record).predict(record).residual for record in learning]
        noise = NoiseCharacterization.from_records(residuals, self.qbar, safety_factor=self.safety_factor)
        return IntervalDetector(self._predictor(judged), noise, self.pole), judged

    def _predictor(self, log: Log) -> IntervalPredictor:
        known = log.y[~np.isnan(log.y[:, 0]), 0]
        if not known.size:
            raise ValueError("the output of the interval detector is missing in the whole log; expected measurements")
        return IntervalPredictor(self.gains, (float(known[0]), self.initial_radius))

    def _channel(self, log: Log, samples: slice = slice(None)) -> Log:
        u, y = log.u[samples, self.u : self.u + 1], log.y[samples, self.y : self.y + 1]
        return Log(time=log.time[samples], u=u, y=y)


def interval_settings(top: Table, columns: Columns) -> IntervalSettings | None:
    """The settings of [interval_detector]; None if it is not there."""
    if "interval_detector" not in top:
        return None
    table = top.table("interval_detector", _KNOWN)
    g, h = _ball(table, "g"), _ball(table, "h")
    if ("records" in table) == ("learn_until_s" in table):
        raise table.error(None, "needs something to learn from: either records or learn_until_s")
    options = {key: table.number(key) for key in ("slope", "limit") if key in table}
    with table.errors():
        gains = GainBounds(gc=g[0], gr=g[1], hc=h[0], hr=h[1], **options)
    widest = max(min(g[1], options.get("limit", np.inf)), options.get("limit", 0.0) if options.get("slope") else 0.0)
    if not abs(g[0]) + widest < 1:
        found = f"is {list(g)}, so |g| may be {abs(g[0]) + widest:g}"
        raise table.error("g", f"{found}; expected less than 1, by a smaller radius or a limit")
    pole, radius, factor = table.number("pole"), table.number("initial_radius"), table.number("safety_factor", 1.2)
    for key, value, holds, expected in (
        ("pole", pole, 0 <= pole < 1, "0 <= pole < 1"),
        ("initial_radius", radius, radius >= 0, "a number >= 0"),
        ("safety_factor", factor, factor > 1, "a number > 1, such as 1.2"),
    ):
        if not holds:
            raise table.error(key, f"is {value:g}; expected {expected}")
    return IntervalSettings(
        u=_position(table, "input", [c.name for c in columns.inputs]),
        y=_position(table, "output", [c.name for c in columns.outputs]),
        gains=gains,
        initial_radius=radius,
        pole=pole,
        qbar=table.count("qbar", 200),
        safety_factor=factor,
        records=tuple(table.path.parent / table.file_beside("records", name) for name in _names(table, "records")),
        learn_until_s=table.number("learn_until_s") if "learn_until_s" in table else None,
    )


def _ball(table: Table, key: str) -> tuple[float, float]:
    """[centre, radius]."""
    value = table.array(key)
    if value.shape != (2,) or value[1] < 0:
        raise table.error(key, f"is {value.tolist()}; expected [centre, radius] with a radius >= 0")
    return float(value[0]), float(value[1])


def _position(table: Table, key: str, names: Sequence[str]) -> int:
    """Position of the column that a key names; it may be left out where there is one only."""
    name = table.text(key, names[0] if len(names) == 1 else None)
    if name not in names:
        raise table.error(key, f"is {name!r}; expected one of the columns {', '.join(names)}")
    return names.index(name)


def _names(table: Table, key: str) -> list[str]:
    value = table.content.get(key, [])
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value) or (key in table and not value):
        raise table.error(key, f'is {value!r}; expected names of files such as ["healthy.csv"]')
    return value

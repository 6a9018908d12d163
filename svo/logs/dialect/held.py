"""Sensors that are slower than their log, which writes their reading again until the next."""

from __future__ import annotations

import numpy as np

from svo.logs.dialect.series import Series


def without_repeats(series: Series, period: float) -> Series:
    """The readings of a sensor with a period [s]: the first of each, also where it equals the one before.

    By equality a true reading that repeats would be lost; the period says which readings are new, and the rows at which
    the numbers change say where it begins.

    Raises
    ------
    ValueError
        If the period is no multiple of the step of the log, or readings change at other times.
    """
    origin = series.block.time[0]
    rows = np.array([(stamp - origin) * 1e-12 for stamp in series.block.time])
    steps = np.diff(rows)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else period
    every = min(round(period / step), 10**12)  # longer than any log
    if every < 1 or abs(period / step - round(period / step)) > 0.01 * period / step:
        raise ValueError(
            f"{series.place(0)}: held = {period:g}, but there is a row each {step:.6g} s; expected a multiple of that"
        )
    index = np.round(series.time(origin) / step).astype(int)
    changed = np.flatnonzero((np.diff(series.values) != 0) & (np.diff(index) == 1)) + 1
    phases = index[changed] % every
    phase = int(phases[0]) if phases.size else int(index[0]) % every
    other = changed[phases != phase]
    if other.size:
        first, second = int(changed[0]), int(other[0])
        raise ValueError(
            f"{series.place(second)}: {series.name} changes at {(index[first] * step):.9g} s and at "
            f"{(index[second] * step):.9g} s of the log, so it is not held for {period:g} s"
        )
    return series.taken(index % every == phase)

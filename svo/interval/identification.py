"""Identification of a first-order system from fault-free records, with bounds for its pole and gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from svo.interval.bounds import GainBounds
from svo.log import Log

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FirstOrderFit:
    """A pole g and a static gain h with bounds, x+ = g x + (1 - g) h u.

    Attributes
    ----------
    gains : GainBounds
        Centres: the fit to all records. Radii: the largest distance from them of a fit to one part.
    parts : (n_parts, 2) array
        (g, h) of each part that moved.
    largest_error : float
        Largest difference of y from the simulated y of the centre model, over all records.
    """

    gains: GainBounds
    parts: Array
    largest_error: float


def identify_first_order(records: Log | Sequence[Log], parts: int = 4) -> FirstOrderFit:
    """Least squares of the simulation error, over all records and over each of their parts.

    The predictor simulates, so the fit minimises ``|y - x|`` for x simulated from each record's first measurement by
    inputs alone, not the error of one step ahead.

    Parameters
    ----------
    records : Log or sequence of Log
        Fault-free, one input and one output each; missing measurements are left out.
    parts : int
        Pieces of equal length into which each record is cut for the radii. One piece gives radii of zero if there is
        one record.

    Raises
    ------
    ValueError
        For records with other channels, too short or without motion, or a fit with ``|g| >= 1``.
    """
    every = [records] if isinstance(records, Log) else list(records)
    if not every:
        raise ValueError("records is empty; expected at least one fault-free log")
    if parts < 1:
        raise ValueError(f"parts is {parts}; expected a number of pieces >= 1")
    whole = [_channels(log) for log in every]
    pieces = [piece for u, y in whole for piece in zip(np.array_split(u, parts), np.array_split(y, parts), strict=True)]
    centre = _fit(whole)
    fits = np.array([_fit([piece]) for piece in pieces if _moves(*piece)]).reshape(-1, 2)
    radii = np.abs(fits - centre).max(axis=0, initial=0.0)
    gains = GainBounds(gc=float(centre[0]), gr=float(radii[0]), hc=float(centre[1]), hr=float(radii[1]))
    error = max(float(np.nanmax(np.abs(_simulation_error(u, y, *centre)))) for u, y in whole)
    return FirstOrderFit(gains, fits, error)


def _channels(log: Log) -> tuple[Array, Array]:
    if log.u.shape[1:] != (1,) or log.y.shape[1:] != (1,):
        raise ValueError(f"log has u {log.u.shape} and y {log.y.shape}; expected one channel each")
    known = np.flatnonzero(~np.isnan(log.y[:, 0]))
    if len(known) < 3:
        raise ValueError(f"log has {len(known)} measurements; expected at least three")
    return log.u[known[0] :, 0], log.y[known[0] :, 0]


def _moves(u: Array, y: Array) -> bool:
    """Whether a part says anything of the pole."""
    known = y[~np.isnan(y)]
    return bool(known.size > 2 and not np.isnan(y[0]) and np.ptp(known) > 0 and np.ptp(u) > 0)


def _fit(records: Sequence[tuple[Array, Array]]) -> Array:
    from scipy.optimize import least_squares

    start = _one_step_fit(records)

    def errors(p: Array) -> Array:
        found = np.concatenate([_simulation_error(u, y, *p) for u, y in records])
        return found[~np.isnan(found)]

    fit = least_squares(errors, start, bounds=([-1.0, -np.inf], [1.0, np.inf]), x_scale=[0.01, 0.01], xtol=1e-12)
    if not abs(fit.x[0]) < 1 - 1e-9:
        raise ValueError(
            f"the fitted pole is {fit.x[0]:g}; expected |g| < 1: is the input column the command of the output?"
        )
    return np.asarray(fit.x, dtype=float)


def _one_step_fit(records: Sequence[tuple[Array, Array]]) -> Array:
    """Equation error, y(k+1) = g y(k) + b u(k): a start for the search."""
    known = np.concatenate([np.column_stack([y[:-1], u[:-1], y[1:]]) for u, y in records])
    known = known[~np.isnan(known).any(axis=1)]
    (g, b), _, rank, _ = np.linalg.lstsq(known[:, :2], known[:, 2], rcond=None)
    if rank < 2:
        raise ValueError("the records do not move: input and output are constant; expected records with motion")
    g = float(np.clip(g, -0.99, 0.99))
    return np.array([g, b / (1.0 - g)])


def _simulation_error(u: Array, y: Array, g: float, h: float) -> Array:
    from scipy.signal import lfilter

    return np.asarray(lfilter([0.0, (1.0 - g) * h], [1.0, -g], u, zi=[y[0]])[0] - y)

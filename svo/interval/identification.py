"""Identification of a first-order system from fault-free records, with bounds for its pole and gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array, expect
from svo.interval.bounds import GainBounds
from svo.logs.log import Log

_SHORTEST = 0.01  # of a record, in time constants of the fit: nothing tells a longer one from no decay at all
_BLOCKS = 8  # pieces over which the scores of the fit are summed for its standard errors
_STANDARD_ERRORS = 6.0  # beyond 99.9 % of a t distribution of 7 degrees
_FAR = 20.0  # as often as the noise is a sample away from its target that tells the pole to 1 / 20
_LEAST = 50  # samples, the farthest, if fewer are that far


@dataclass(frozen=True, eq=False)
class FirstOrderFit(Shown):
    """A pole g and a static gain h with bounds, x+ = g x + (1 - g) h u.

    Attributes
    ----------
    gains : GainBounds
        Centres: the fit to all records. Radii: see `identify_first_order`.
    parts : (n_parts, 2) array
        (g, h) of each part that moved.
    still : int
        Number of parts that did not move, or had less than three measurements: they say nothing, and are left out.
    largest_error : float
        Largest difference of y from the simulated y of the centre model, over all records.
    """

    gains: GainBounds
    parts: Array
    still: int
    largest_error: float


def identify_first_order(records: Log | Sequence[Log], parts: int = 4, *, safety_factor: float = 1.2) -> FirstOrderFit:
    """Least squares of the simulation error, with radii that contain what g and h did in the records.

    The predictor simulates, so the fit minimises ``|y - x|`` for x simulated from each record's first measurement by
    inputs alone, not the error of one step ahead.

    Parameters
    ----------
    records : Log or sequence of Log
        Fault-free, one input and one output each; missing measurements are left out.
    parts : int
        Pieces of equal length into which each record is cut, to see g and h change slowly.
    safety_factor : float
        >= 1, of the radius of g: room for what the records did not show.

    Raises
    ------
    ValueError
        For records with other channels, too short or without motion, or a fit with ``|g| >= 1``, or so near
        to it that a hundred records would not show the decay.

    Notes
    -----
    Each radius is the distance to the farthest fit of a part, and six standard errors of the fit (robust to
    correlated errors) besides. That of g is at least the safety factor times the largest deviation of a single step's
    pole (y(k+1) - h u) / (y(k) - h u), over the fifty samples at which y is farthest from h u, and all others at which
    it is twenty times as far as what samples at rest leave unexplained. It contains every change of g from sample to
    sample there, and a share of the noise besides: bounds that hold are wide where noise is large against the motion,
    and |gc| + gr may then reach 1, which `IntervalPredictor` refuses. That of h has the distance to the fit of one
    step ahead added, which errs otherwise; a gain that changes from sample to sample counts as a change of g. As all
    that is learnt from records the bounds say what was seen, and no record proves the future.
    """
    every = [records] if isinstance(records, Log) else list(records)
    if not every:
        raise ValueError("records is empty; expected at least one fault-free log")
    expect(parts >= 1, "parts", parts, "a number of pieces >= 1")
    expect(1 <= safety_factor < np.inf, "safety_factor", safety_factor, "a number >= 1, such as 1.2")
    whole = [_channels(log) for log in every]
    u_unit, y_unit = (_power_of_two(max(float(np.nanmax(np.abs(r[i]))) for r in whole)) for i in (0, 1))
    whole = [(u / u_unit, y / y_unit) for u, y in whole]
    units = np.array([1.0, y_unit / u_unit])  # of g and h
    pieces = [
        _from_first_measurement(*piece)
        for u, y in whole
        for piece in zip(np.array_split(u, parts), np.array_split(y, parts), strict=True)
    ]
    centre, errors = _fit(whole)
    fits = np.array([_fit([piece])[0] for piece in pieces if _moves(*piece)]).reshape(-1, 2)
    radii = np.abs(fits - centre).max(axis=0, initial=0.0) + _STANDARD_ERRORS * errors
    radii[0] = max(radii[0], safety_factor * _largest_step_deviation(whole, *centre))
    radii[1] += abs(_one_step_fit(whole)[1] - centre[1])
    error = max(float(np.nanmax(np.abs(_simulation_error(u, y, *centre)))) for u, y in whole)
    (gc, hc), (gr, hr) = (units * centre).tolist(), (units * radii).tolist()
    return FirstOrderFit(GainBounds(gc, gr, hc=hc, hr=hr), units * fits, len(pieces) - len(fits), y_unit * error)


def _power_of_two(size: float) -> float:
    """The power of two next above a size, as the unit in which the fit is made; 1 for zero."""
    return float(2.0 ** np.frexp(size)[1])


def _largest_step_deviation(records: Sequence[tuple[Array, Array]], g: float, h: float) -> float:
    """Of the pole of a single step from g, over the samples that are far enough from their target."""
    away = np.concatenate([(y - h * u)[:-1] for u, y in records])
    left = np.concatenate([y[1:] - h * u[:-1] - g * (y - h * u)[:-1] for u, y in records])
    known = ~np.isnan(left)
    distance, error = np.abs(away[known]), np.abs(left[known])
    if not distance.size:
        return 0.0
    at_rest = error[distance <= np.quantile(distance, 0.25)].max()
    least = np.sort(distance)[-min(_LEAST, distance.size)]
    rounding = np.finfo(float).eps * max(float(np.nanmax(np.abs(y))) for _, y in records)
    far = (distance >= min(_FAR * at_rest, least)) & (distance > _FAR * rounding)
    return float(np.max(error[far] / distance[far], initial=0.0))


def _channels(log: Log) -> tuple[Array, Array]:
    if log.u.shape[1:] != (1,) or log.y.shape[1:] != (1,):
        raise ValueError(f"log has u {log.u.shape} and y {log.y.shape}; expected one channel each")
    measured = int(np.sum(~np.isnan(log.y)))
    if measured < 3:
        raise ValueError(f"log has {measured} measurements; expected at least three")
    return _from_first_measurement(log.u[:, 0], log.y[:, 0])


def _from_first_measurement(u: Array, y: Array) -> tuple[Array, Array]:
    """A record without the samples before its first measurement, from which a simulation can start."""
    first = int(np.argmax(~np.isnan(y)))
    return u[first:], y[first:]


def _moves(u: Array, y: Array) -> bool:
    """Whether a part says anything of the pole."""
    known = y[~np.isnan(y)]
    return bool(known.size > 2 and np.ptp(known) > 0 and np.ptp(u) > 0)


def _fit(records: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """g and h (2,), and their standard errors (2,)."""
    from scipy.optimize import least_squares

    start = _one_step_fit(records)

    def errors(p: Array) -> Array:
        found = np.concatenate([_simulation_error(u, y, *p) for u, y in records])
        return found[~np.isnan(found)]

    fit = least_squares(errors, start, bounds=([-1.0, -np.inf], [1.0, np.inf]), x_scale=[0.01, 0.01], xtol=1e-12)
    if not (1 - abs(fit.x[0])) * max(u.size for u, _ in records) > _SHORTEST:
        raise ValueError(
            f"the fitted pole is {fit.x[0]:g}; expected |g| < 1: is the input column the command of the output?"
        )
    return np.asarray(fit.x, dtype=float), _standard_errors(fit.jac, fit.fun)


def _standard_errors(jacobian: Array, errors: Array) -> Array:
    """Of a least-squares fit whose errors are correlated within blocks of samples."""
    blocks = zip(np.array_split(jacobian, _BLOCKS), np.array_split(errors, _BLOCKS), strict=True)
    scores = np.array([J.T @ e for J, e in blocks])
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    return np.asarray(np.sqrt(np.diag(inverse @ scores.T @ scores @ inverse)))


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

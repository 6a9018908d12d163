"""Filters over samples: the face of `core/filters`."""

from __future__ import annotations

import numpy as np

from polytopes.native import Address, Entries, Given, Integer, floats, function, scratch
from svo.checks import Array

_filter = function("fdi_filter", *[Integer] * 5, *[Entries] * 2, *[Given] * 9, *[Entries] * 2, Address, returns=Integer)
_filter_room = function("fdi_filter_room", *[Integer] * 3, returns=Integer)
_models = function("fdi_models", *[Integer] * 5, *[Entries] * 3, *[Given] * 8, *[Entries] * 2, Address, returns=Integer)
_models_room = function("fdi_models_room", *[Integer] * 3, returns=Integer)


def filter_samples(
    x: Array, P: Array, first: bool, A: Array, f: Array, Q: Array, C: Array, g: Array, R: Array, y: Array, E: Array,
    D: Array, states: Array, white: Array,
) -> int:  # fmt: skip
    """Kalman filter over samples, with unknown inputs decoupled (Kitanidis 1987) where E and D have columns.

    x (n,) and P (n, n) are the estimate after the sample before (or, if ``first``, before the first measurement) and
    are overwritten by that after the last one. A, f, Q (K, ...) and E (K, n, nd) are of the sample BEFORE each
    measurement; C, g, R and D (K, ny, nd) are of its own. Writes states (K, n) and white (K, ny): the innovations,
    whitened, less what the unknown inputs can explain. Returns the first sample at which an unknown input cannot be
    told from y, or -1.
    """
    (K, ny), (n, nd) = y.shape, E.shape[1:]
    given = [floats(array) for array in (A, f, Q, C, g, R, y, E, D)]
    return _checked(_filter(K, n, ny, nd, first, x, P, *given, states, white, scratch(_filter_room(n, ny, nd))))


def multiple_models(
    xs: Array, Ps: Array, log_mu: Array, first: bool, log_transition: Array, A: Array, f: Array, Q: Array, C: Array,
    g: Array, R: Array, y: Array, log_odds: Array, posterior: Array,
) -> None:  # fmt: skip
    """Interacting multiple models (Blom and Bar-Shalom 1988) over samples.

    xs (m, n), Ps (m, n, n) and log_mu (m,) as x and P in `filter_samples`; the arrays of the models are (m, K, ...).
    Probabilities are kept as logarithms (-inf in log_transition: never), for without switching that of a wrong
    model falls without end. Writes posterior (K, m) and log_odds (K,): ln of the odds of all models but the first.
    """
    (m, n), (K, ny) = xs.shape, y.shape
    given = [floats(array) for array in (log_transition, A, f, Q, C, g, R, y)]
    _checked(_models(m, K, n, ny, first, xs, Ps, log_mu, *given, log_odds, posterior, scratch(_models_room(m, n, ny))))


def _checked(ended: int) -> int:
    """The sample at which a run ended, or -1."""
    if ended < -1:
        raise np.linalg.LinAlgError("the covariance of an innovation is not positive definite")
    return ended

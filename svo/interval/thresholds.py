"""Thresholds of a filtered signal from the bounds of its moving averages (paper 001, equations (10)-(13))."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from polytopes.signatures import options_by_name
from svo.checks import Array, expect, expect_shape, real_array
from svo.interval.residual import check_pole

_EPS, _SMALLEST = float(np.finfo(float).eps), float(np.finfo(float).smallest_subnormal)


@options_by_name
def filter_bound(
    bounds: ArrayLike, pole: float, *, r: int, mu: float, gain: float | None = None, output_gain: float = 1.0
) -> float:
    """Bound of y_k for x_k = a x_(k-1) + b u_k, y_k = c x_k, from the last r samples (Proposition 1, (10))::

        |y_k| <= c a^r mu + c b r a^(r-1) lambda_r + c b sum_(q<r) q (a^(q-1) - a^q) lambda_q

    Parameters
    ----------
    bounds : (qbar,) array
        lambda_q, bounds of u's moving averages.
    pole : float
        a, 0 <= a < 1.
    r : int
        Number of past samples, 0 <= r <= qbar; with 0 the bound is c mu.
    mu : float
        Bound of the size of x_(k-r).
    gain, output_gain : float
        b and c, not negative; b is 1 - a by default (static gain one).
    """
    lam = checked_bounds(bounds)
    check_pole(pole)
    expect(0 <= r <= lam.size, "r", r, f"0 <= r <= {lam.size}, the longest window of the characterisation")
    b = 1 - pole if gain is None else gain
    for name, value in (("mu", mu), ("gain", b), ("output_gain", output_gain)):
        expect(np.isfinite(value) and value >= 0, name, value, "a finite number >= 0")
    if r == 0:
        return float(output_gain * mu)
    q = np.arange(1, r)
    inner = q * (pole ** (q - 1) - pole**q) @ lam[: r - 1]
    return float(output_gain * (pole**r * mu + b * (r * pole ** (r - 1) * lam[r - 1] + inner)))


def threshold_sequence(bounds: ArrayLike, pole: float) -> Array:
    """tau_k for k = 0..qbar, (qbar + 1,): the bound of a filter of static gain one that starts at its first input.

    Corollary 2: `filter_bound` with b = 1 - a, c = 1, r = k and mu = lambda_1; the bounds are lambda_q (qbar,), the
    pole is a. From k = qbar on it is constant (13).

    Rounded outward: a signal of floats whose means are at most lambda_q, as `NoiseCharacterization.check` finds them,
    stays at or below it in `first_order_filter`, which computes in floats too. For that each tau_k is larger by at most
    (k + 16) eps of itself and 2 eps lambda_1 / (1 - a), eps = 2.2e-16.
    """
    lam = checked_bounds(bounds)
    check_pole(pole)
    q = np.arange(1, lam.size + 1)
    powers = float(pole) ** np.arange(lam.size + 1)  # a^0 .. a^qbar
    inner = np.concatenate([[0.0], np.cumsum(q * (powers[:-1] * (1 - pole)) * lam)])
    tau = powers * lam[0]
    tau[1:] += (1 - pole) * (q * powers[:-1] * lam + inner[:-1])
    # All terms are positive: products of five factors, a sum of k, and means that a check rounds once.
    relative = (np.arange(lam.size + 1) + 16) * _EPS
    # A step of the filter errs by at most 3/2 eps of the largest of its terms, and forgets with 1 - a.
    return np.asarray(tau * (1 + relative) + (2 * _EPS * lam[0] + _SMALLEST * (q.size + 4)) / (1 - pole))


def checked_bounds(bounds: ArrayLike) -> Array:
    """Bounds lambda_q as a read-only array (qbar,), finite and not negative; ValueError otherwise."""
    array = real_array("bounds", bounds, finite=False)
    expect_shape(array.ndim == 1 and array.size, "bounds", array, "(qbar,), one bound a window length")
    wrong = np.flatnonzero(~(np.isfinite(array) & (array >= 0)))
    if wrong.size:
        raise ValueError(f"lambda_{wrong[0] + 1} is {array[wrong[0]]}; expected a finite bound >= 0")
    array.setflags(write=False)
    return array

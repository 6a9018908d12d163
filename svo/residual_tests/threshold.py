"""Fixed thresholds: so many standard deviations, or the worst case of bounded disturbances (section 5.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect_shape, finite_array, readings
from svo.residual_tests.interface import (
    DecisionRecord,
    WindowTest,
    above,
    check_finite,
    check_positive,
)

_ROUNDING = 1e-12


@options_by_name
@dataclass(frozen=True, kw_only=True)
class StaticThreshold(WindowTest):
    """H1 where the residual is more than nu standard deviations away from its mean.

    The statistic is ``|r - mean| / sigma``. False-alarm rate: for a Gaussian residual 2 (1 - Phi(nu)) per sample,
    0.0027 for nu = 3, exactly, whether or not the samples are independent.

    Parameters
    ----------
    mean, sigma : float
        Of the residual without a fault.
    nu : float
        The survey takes 3 or more.

    Raises
    ------
    ValueError
        For numbers that are not finite, or sigma or nu not positive.
    """

    mean: float = 0.0
    sigma: float = 1.0
    nu: float = 3.0

    def __post_init__(self) -> None:
        check_finite(mean=self.mean)
        check_positive(sigma=self.sigma, nu=self.nu)

    @property
    def samples(self) -> int:  # type: ignore[override]
        return 1

    @property
    def threshold(self) -> float:
        return self.nu

    @property
    def false_alarm_rate(self) -> float:
        """Probability of an alarm at a sample without a fault."""
        return float(2 * norm.sf(self.nu))

    def _statistics(self, windows: Array) -> Array:
        return np.asarray(np.abs(windows[:, 0] - self.mean) / self.sigma)


@dataclass(frozen=True)
class BoundedThreshold(Shown):
    """H1 where the residual leaves the bounds that no fault-free run can leave.

    The statistic is how far the residual is outside, in its own units, negative inside. False-alarm rate: zero as
    long as the disturbances keep to the bounds that were propagated (`propagated_bounds`); nothing is promised beyond.
    The bounds belong to samples, so there is a batch run only.

    Parameters
    ----------
    lower, upper : (K,) arrays or float

    Raises
    ------
    ValueError
        If the bounds are not finite, or a lower one is above its upper one.
    """

    lower: ArrayLike
    upper: ArrayLike

    def __post_init__(self) -> None:
        lower, upper = finite_array("lower", self.lower), finite_array("upper", self.upper)
        if lower.shape != upper.shape or lower.ndim > 1:
            raise ValueError(f"lower has shape {lower.shape} and upper {upper.shape}; expected one shape, (K,) or ()")
        if (lower > upper).any():
            raise ValueError("lower is above upper at some sample; expected lower <= upper")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)

    def run(self, residual: ArrayLike) -> DecisionRecord:
        """All samples at once; a residual that is NaN gives no alarm.

        Raises
        ------
        ValueError
            If the residual is not (K,), K the length of the bounds.
        """
        r, lower, upper = readings("residual", residual), np.asarray(self.lower), np.asarray(self.upper)
        if r.ndim != 1 or (lower.ndim and r.shape != lower.shape):
            expected = lower.shape if lower.ndim else "(K,)"
            raise ValueError(f"residual has shape {r.shape}; expected {expected}, one value a sample")
        outside = np.maximum(lower - r, r - upper)
        return DecisionRecord(outside, above(outside, 0.0))


def propagated_bounds(
    A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike, lower: ArrayLike, upper: ArrayLike, samples: int
) -> tuple[Array, Array]:
    """Least and largest residual that bounded disturbances can make of a linear residual generator at rest.

    z(k+1) = A z(k) + B w(k), r(k) = C z(k) + D w(k), z(0) = 0, lower <= w(k) <= upper. The bounds are attained:
    r(k) = sum_j H_j w(k-j), and each w(k-j) can be at the end that the sign of H_j asks for. They are widened by 1e-12
    of ``sum_j |H_j| |w|``, for the rounding of the residual.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, nw), (nr, n), (nr, nw) arrays
    lower, upper : (nw,) arrays
    samples : int

    Returns
    -------
    lower, upper : (samples, nr) arrays

    Raises
    ------
    ValueError
        If shapes do not fit or bounds are out of order.
    """
    matrices = {name: finite_array(name, value) for name, value in (("A", A), ("B", B), ("C", C), ("D", D))}
    low, high = finite_array("lower", lower), finite_array("upper", upper)
    n, nw = matrices["B"].shape if matrices["B"].ndim == 2 else (-1, -1)
    nr = len(matrices["C"])
    for name, shape in (("A", (n, n)), ("C", (nr, n)), ("D", (nr, nw))):
        expect_shape(matrices[name].shape == shape, name, matrices[name], f"{shape}, to fit B {(n, nw)}")
    if low.shape != (nw,) or high.shape != (nw,) or (low > high).any():
        raise ValueError(f"lower is {low} and upper {high}; expected ({nw},) each, lower <= upper")
    least, largest = np.empty((samples, nr)), np.empty((samples, nr))
    below, over, slack, response = np.zeros(nr), np.zeros(nr), np.zeros(nr), matrices["D"]
    power, size = matrices["B"], _ROUNDING * np.maximum(np.abs(low), np.abs(high))
    for k in range(samples):
        positive, negative = np.maximum(response, 0.0), np.minimum(response, 0.0)
        below, over = below + positive @ low + negative @ high, over + positive @ high + negative @ low
        slack = slack + np.abs(response) @ size
        least[k], largest[k] = below - slack, over + slack
        response, power = matrices["C"] @ power, matrices["A"] @ power
    return least, largest

"""Mean run length of Page's one-sided cumulative sum of independent Gaussian residuals, as a logarithm.

In units of sigma the sum moves by steps of N(-k, 1), k half the change, from 0 until it is above h. Cut where it is
set back to zero, a run is a number of independent cycles, each a walk from 0 that ends at or below 0, or above h (Page
1954): L = E[steps of a cycle] / P(a cycle ends above h). That probability can be exp(-10,000), and Page's integral
equation for L, whose solution is as large as its inverse, is hopeless in floats. Wald's change of measure turns the
drift round, P = exp(-2 k h) E'[exp(-2 k (S - h)); S > h] with steps of N(k, 1), and both expectations are now solutions
of integral equations whose every number is of ordinary size.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded
from scipy.special import erfcx

from svo.checks import Array

LARGEST_DRIFT, LARGEST_THRESHOLD = 40.0, 1e4  # k and h up to which the equations are solved
_PANEL, _NODES = 2.0, 12  # a Gaussian times a smooth function, integrated to 1e-15
_REACH = 9.0  # steps beyond have probability 1e-18


def log_run_length(k: float, h: float) -> float:
    """ln L of the one-sided sum, for 0 < k <= `LARGEST_DRIFT` and 0 < h <= `LARGEST_THRESHOLD`."""
    panels = int(np.ceil(h / _PANEL))
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    half = h / panels / 2
    x = ((2 * np.arange(panels)[:, None] + 1 + nodes) * half).ravel()
    weight = np.tile(half * weights, panels)
    steps = _solution_at_zero(x, weight, -k, np.ones(x.size), 1.0)
    ends_above = _solution_at_zero(x, weight, k, _above(h - x, k), float(_above(h, k)))
    return 2 * k * h + float(np.log(steps) - np.log(ends_above))


def _above(away: Array | float, k: float) -> Array:
    """E'[exp(-2 k (S - h)); S > h] of the first step, from ``away`` below h."""
    return np.asarray(erfcx((away + k) / np.sqrt(2)) * np.exp(-((away - k) ** 2) / 2) / 2)


def _solution_at_zero(x: Array, weight: Array, drift: float, at_nodes: Array, at_zero: float) -> float:
    """f(0) of f(z) = g(z) + integral of f(x) phi(x - z - drift), g given at the nodes x and at 0."""
    panel = x[_NODES - 1] + x[0]
    reach = _REACH + abs(drift) / 2  # the steps of a cycle that ends above h share the way: none is k / 2 longer
    below, above = (
        min(_NODES * (1 + int(np.ceil(max(reach + way, 0.0) / panel))), x.size - 1) for way in (-drift, drift)
    )
    rows = np.arange(x.size) + np.arange(-above, below + 1)[:, None]  # of each column, as LAPACK wants its bands
    inside = (rows >= 0) & (rows < x.size)
    kernel = np.where(inside, _density(x - x[rows.clip(0, x.size - 1)] - drift), 0.0) * weight
    f = solve_banded((below, above), np.where(rows == np.arange(x.size), 1.0, 0.0) - kernel, at_nodes)
    return at_zero + float(np.sum(weight * _density(x - drift) * f))


def _density(z: Array) -> Array:
    return np.asarray(np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi))

"""Adaptive bounds of the residuals: Delta(eps1, eps2, u_a, y) of section III-C (Marzat et al., SysTol 2010).

The true airframe's coefficients are c (1 + eps), |eps| <= a known bound, the measurements are off by a known bound
each, and the achieved inputs lie within their travel. Then

    e = G (u_a - u_c) + d,   d_i = (error of a_i) + (error of the rest of f_i) + sum_k (error of g_ik) u_ak,

with G as computed from the measurements, and |lambda d| <= sum_i |lambda_i| |d_i|. A residual beyond this bound proves
that an input on which it depends is faulty: the others' effects have weight (lambda G)_l = 0 exactly, and what the
errors of G let through is in d, whatever the faulty inputs do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from aircraft.missile.airframe import Airframe
from aircraft.missile.imu import SensorErrors
from aircraft.missile.redundancy import DL, DM, DN, TRAVEL, ForceBalance
from aircraft.missile.simulator import ACCELERATION, VELOCITY, dynamic_pressure, force_coefficients
from svo.checks import Array, expect


@dataclass(frozen=True)
class ModelError:
    """What may be wrong besides the actuators.

    Parameters
    ----------
    errors : SensorErrors
    coefficients : float
        Largest relative error of each force coefficient, >= 0.
    """

    errors: SensorErrors
    coefficients: float = 0.0

    def __post_init__(self) -> None:
        expect(0 <= self.coefficients < np.inf, "coefficients", self.coefficients, "a relative error >= 0")

    def imbalance_bounds(self, y: ArrayLike, airframe: Airframe, travel: ArrayLike = TRAVEL) -> Array:
        """Bounds (K, 3) of |d_i| [m/s^2], from measurements (K, 15).

        ``travel`` (4,) bounds |u_a|. Infinite where the measured forward speed may be zero.
        """
        measured, largest = np.asarray(y, dtype=float), np.asarray(travel, dtype=float)
        off = self.errors.bound(measured)
        terms = _Terms.of(measured, off, airframe, self.coefficients)
        fins = [terms.product(terms.force[name]) * largest[j] for name, j in (("xl", DL), ("xm", DM), ("xn", DN))]
        axial = terms.product(terms.force["x"]) + sum(fins)
        lateral = (
            terms.product(terms.force["y"])
            + terms.product(terms.force["yl"]) * largest[DL]
            + terms.product(terms.force["yn"]) * largest[DN]
        )
        normal = terms.product(terms.force["z"]) + terms.product(terms.force["zm"]) * largest[DM]
        bounds = off[:, ACCELERATION] + np.column_stack([axial, lateral, normal])
        bounds[measured[:, 9] - off[:, 9] <= 0] = np.inf
        return bounds

    def residual_bounds(self, y: ArrayLike, airframe: Airframe, names: Sequence[str]) -> Array:
        """Bounds (K, R) of the residuals' error terms; NaN where a residual is invalid."""
        weights = ForceBalance.of(y, airframe).weights(names)
        return np.einsum("kri,ki->kr", np.abs(weights), self.imbalance_bounds(y, airframe))


@dataclass(frozen=True)
class _Terms:
    """Coefficients as computed with bounds of their errors, and S = Q s_ref / m with that of its relative error."""

    S: Array
    relative: Array
    force: dict[str, tuple[Array, Array]] = field(repr=False)

    def product(self, term: tuple[Array, Array]) -> Array:
        """Bound of |S c - S^ c^| for |S / S^ - 1| <= relative and |c - c^| <= error, c^ being what is computed."""
        computed, error = term
        return self.S * ((1.0 + self.relative) * (np.abs(computed) + error) - np.abs(computed))

    @classmethod
    def of(cls, y: Array, off: Array, airframe: Airframe, eps: float) -> _Terms:
        vx, vy, vz = y[:, VELOCITY].T
        alpha, d_alpha = _incidence(vz, vx, off[:, 11], off[:, 9])
        beta, d_beta = _incidence(vy, vx, off[:, 10], off[:, 9])
        p = airframe.packed()
        S = dynamic_pressure(y[:, 8], vx, vy, vz, p) * airframe.reference_area / airframe.mass
        squared = np.sum(y[:, VELOCITY] ** 2, axis=1)
        speed = np.sum(2 * np.abs(y[:, VELOCITY]) * off[:, VELOCITY] + off[:, VELOCITY] ** 2, axis=1) / squared
        relative = np.exp(off[:, 8] / airframe.scale_height) * (1.0 + speed) - 1.0
        cx, cx_l, cx_m, cx_n, cy, cy_l, cy_n, cz, cz_m = force_coefficients(alpha, beta, p)
        square = 2 * np.abs(alpha) * d_alpha + d_alpha**2
        k0, k2 = abs(airframe.cx_zero), abs(airframe.cx_alpha_squared)
        zero = np.zeros_like(S)
        axial = eps * (k0 + k2 * alpha**2) + (1 + eps) * k2 * square

        def affine(value: Array, slope: float, error: Array) -> tuple[Array, Array]:
            return value, eps * np.abs(value) + (1 + eps) * abs(slope) * error

        def odd(value: Array, k1: float, k2: float, angle: Array, error: Array) -> tuple[Array, Array]:
            spread = abs(k1) * error + abs(k2) * (2 * np.abs(angle) * error + error**2)
            size = abs(k1) * np.abs(angle) + abs(k2) * angle**2
            return value, eps * size + (1 + eps) * spread

        force = {
            "x": (cx, axial),
            "xl": affine(cx_l + zero, 0.0, zero),
            "xm": affine(cx_m, airframe.cx_dm, d_alpha),
            "xn": affine(cx_n, airframe.cx_dn, d_beta),
            "y": odd(cy, airframe.cy_beta, airframe.cy_beta_abs, beta, d_beta),
            "yl": affine(cy_l + zero, 0.0, zero),
            "yn": affine(cy_n + zero, 0.0, zero),
            "z": odd(cz, airframe.cz_alpha, airframe.cz_alpha_abs, alpha, d_alpha),
            "zm": affine(cz_m + zero, 0.0, zero),
        }
        return cls(S, relative, force)


def _incidence(across: Array, along: Array, d_across: Array, d_along: Array) -> tuple[Array, Array]:
    """atan(across / along) and its largest error; the arctangent has its extremes at corners while along > 0."""
    angle = np.arctan2(across, along)
    corners = [np.arctan2(across + i * d_across, along + j * d_along) for i in (-1, 1) for j in (-1, 1)]
    return angle, np.max(np.abs(np.array(corners) - angle), axis=0)

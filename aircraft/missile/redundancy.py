"""Residuals by control-induced redundancy (Marzat et al., SysTol 2010, section III).

The force equations are affine in the inputs. Solved for what the IMU and the INS measure, they read

    f = G u_a,   f1 = abx + S (cx0 + cx_alpha alpha) - f_min / m,   S = Q s_ref / m,
                 f2 = aby - S cy_beta beta,
                 f3 = abz + S cz_alpha alpha,

        | g11  g12  g13  g14 |    g1j = -S cx_dj,   g14 = (f_max - f_min) / m,
    G = | g21   0   g23   0  |    g21 = +S cy_dl,   g23 = +S cy_dn  (equation (5) prints minus),
        |  0   g32   0    0  |    g32 = -S cz_dm.

Every residual of the paper is one equation i solved for one input j, in which some inputs k are replaced by what
another equation s gives for them. With the imbalance e = f - G u_c that is

    direct        r_ij = (f_i - sum_{k != j} g_ik u_kc) / g_ij - u_jc                     = e_i / g_ij
    substituted   u_kc -> (f_s - sum_{l != k} g_sl u_lc) / g_sk = u_kc + e_s / g_sk, so
                  r = (e_i - sum_{(k, s)} g_ik e_s / g_sk) / g_ij,

which holds for k = j too. So each residual is a row lambda(G) applied to e, and e = G (u_a - u_c) on ideal
measurements: the residual depends on the fault of input l exactly where (lambda G)_l is not zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aircraft.missile.airframe import INPUT_LOWER, INPUT_UPPER, INPUTS, Airframe
from aircraft.missile.simulator import ACCELERATION, VELOCITY, dynamic_pressure, force_coefficients
from svo.checks import Array, chosen, expect_shape, real_array

DL, DM, DN, ETA = range(4)
TRAVEL = np.maximum(np.abs(INPUT_LOWER), np.abs(INPUT_UPPER))
# An input that cannot move the acceleration by this much over its whole travel [m/s^2] is not solved for: ten times
# the accelerometer's noise. Own choice; the paper asks for a check without a figure.
LEAST_AUTHORITY = 0.5


@dataclass(frozen=True)
class Residual:
    """One equation solved for one input, with substitutions.

    Attributes
    ----------
    equation : int
        0, 1, 2 for the axial, lateral and normal force.
    target : int
        The input that it is solved for.
    substituted : tuple of (input, equation)
        Inputs replaced by what another equation gives for them.
    """

    equation: int
    target: int
    substituted: tuple[tuple[int, int], ...] = ()

    def weights(self, G: Any) -> list[Any]:
        """The row lambda(G), three entries; G is indexed as G[i][j] by numbers of any kind, arrays included."""
        i, solved = self.equation, G[self.equation][self.target]
        row = [0 * solved, 0 * solved, 0 * solved]
        row[i] = row[i] + 1 / solved
        for k, s in self.substituted:
            row[s] = row[s] - G[i][k] / (solved * G[s][k])
        return row

    @property
    def denominators(self) -> tuple[tuple[int, int], ...]:
        """(equation, input) of each entry of G that it divides by."""
        return ((self.equation, self.target), *((s, k) for k, s in self.substituted))


_SUBSTITUTIONS: Mapping[str, tuple[tuple[int, int], ...]] = MappingProxyType(
    {
        "r1_": ((DM, 2),),
        "r2_": ((DL, 1),),
        "r3_": ((DN, 1),),
        "r4_": ((DL, 1), (DM, 2)),
        "r5_": ((DN, 1), (DM, 2)),
    }
)
RESIDUALS: Mapping[str, Residual] = MappingProxyType(
    {
        **{f"r1{j + 1}": Residual(0, j) for j in range(4)},
        "r21": Residual(1, DL),
        "r23": Residual(1, DN),
        "r32": Residual(2, DM),
        **{f"{kind}1{j + 1}": Residual(0, j, s) for kind, s in _SUBSTITUTIONS.items() for j in range(4)},
    }
)
TABLE_1 = ("r11", "r12", "r13", "r14", "r21", "r23", "r32", "r1_11", "r2_11", "r3_11", "r4_11", "r5_11")


@dataclass(frozen=True)
class ForceBalance:
    """f (K, 3) and G (K, 3, 4) of equation (5) along measurements."""

    f: Array
    G: Array

    @classmethod
    def of(cls, y: ArrayLike, airframe: Airframe) -> ForceBalance:
        """From measurements (K, 15)."""
        measured = real_array("y", y, ("K", 15), meaning="one row a sample", finite=False, missing=True)
        vx, vy, vz = measured[:, VELOCITY].T
        p = airframe.packed()
        alpha, beta = np.arctan2(vz, vx), np.arctan2(vy, vx)
        cx, cx_l, cx_m, cx_n, cy, cy_l, cy_n, cz, cz_m = force_coefficients(alpha, beta, p)
        S = dynamic_pressure(measured[:, 8], vx, vy, vz, p) * airframe.reference_area / airframe.mass
        f = measured[:, ACCELERATION] + np.column_stack([S * cx - airframe.thrust_min / airframe.mass, -S * cy, S * cz])
        G = np.zeros((len(measured), 3, 4))
        G[:, 0] = np.column_stack(
            [
                -S * cx_l,
                -S * cx_m,
                -S * cx_n,
                np.full_like(S, (airframe.thrust_max - airframe.thrust_min) / airframe.mass),
            ]
        )
        G[:, 1, DL], G[:, 1, DN], G[:, 2, DM] = S * cy_l, S * cy_n, -S * cz_m
        return cls(f, G)

    def imbalance(self, u: Array) -> Array:
        """e = f - G u (K, 3) [m/s^2]; u (K, 4) are the computed inputs of the instants that the rows are of."""
        expect_shape(u.shape == (len(self.f), 4), "u", u, f"{(len(self.f), 4)}, one row a measurement")
        return self.f - np.einsum("kij,kj->ki", self.G, u)

    def weights(self, names: Sequence[str]) -> Array:
        """Rows lambda(G), (K, R, 3); NaN where a denominator is too close to zero (`LEAST_AUTHORITY`)."""
        rows = np.full((len(self.f), len(names), 3), np.nan)
        for column, name in enumerate(names):
            residual = known_residual(name)
            authority = [np.abs(self.G[:, i, j]) * TRAVEL[j] for i, j in residual.denominators]
            valid = (np.array(authority) >= LEAST_AUTHORITY).all(axis=0)
            entries = residual.weights(np.moveaxis(self.G[valid], 0, -1))
            rows[valid, column] = np.column_stack(entries)
        return rows


@dataclass(frozen=True)
class ResidualLog:
    """Residuals over time.

    Attributes
    ----------
    names : tuple of str
    values : (K, R) array
        In rad, or fractions of the full propulsion for those solved for eta; NaN where invalid: a denominator too
        close to zero, or no computed input yet for the instant of the measurement.
    """

    names: tuple[str, ...]
    values: Array

    @property
    def valid(self) -> NDArray[np.bool_]:
        return np.isfinite(self.values)

    def __getitem__(self, name: str) -> Array:
        return self.values[:, self.names.index(name)]


def residuals(y: ArrayLike, u: ArrayLike, airframe: Airframe, names: Sequence[str] = TABLE_1) -> ResidualLog:
    """Residuals from measurements and computed inputs.

    Parameters
    ----------
    y : (K, 15) array
        Measurements.
    u : (K, 4) array
        Computed inputs of the instants that the rows of y are of: delayed as the measurements are
        (`aircraft.missile.scenarios.Run.aligned_inputs`). NaN where there is none.
    airframe : Airframe
        What is believed of the missile.
    names : sequence of str
        Any of `RESIDUALS`.
    """
    balance = ForceBalance.of(y, airframe)
    imbalance = balance.imbalance(np.asarray(u, dtype=float))
    return ResidualLog(tuple(names), np.einsum("kri,ki->kr", balance.weights(names), imbalance))


def moving_mean(values: Array, samples: int) -> Array:
    """Mean of the last so many rows of (K, R) values; NaN while there are too few, and where one of them is."""
    padded = np.vstack([np.full((samples - 1, values.shape[1]), np.nan), values])
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, samples, axis=0).mean(axis=-1))


def known_residual(name: str) -> Residual:
    """The residual of that name; ValueError if there is none."""
    return chosen("residual", name, RESIDUALS)


def signature_matrix(airframe: Airframe, names: Sequence[str] = TABLE_1) -> NDArray[np.bool_]:
    """Which residual depends on which input's fault, (R, 4): where (lambda G)_l is not zero, in exact arithmetic.

    G is taken at incidences that are not special, as the rational numbers that its floats are.
    """
    y = np.zeros((1, 15))
    y[0, 8], y[0, VELOCITY] = -5000.0, (600.0, 13.0, -29.0)
    G = [[Fraction(float(g)) for g in row] for row in ForceBalance.of(y, airframe).G[0]]
    signature = np.zeros((len(names), len(INPUTS)), dtype=bool)
    for r, name in enumerate(names):
        residual = known_residual(name)
        if any(G[i][j] == 0 for i, j in residual.denominators):
            raise ValueError(f"{name} divides by zero on this airframe; leave it out of names")
        row = residual.weights(G)
        for column in range(len(INPUTS)):
            signature[r, column] = sum((row[i] * G[i][column] for i in range(3)), Fraction(0)) != 0
    return signature

"""The Eclipse's stability and control derivatives as functions of airspeed.

Rosa and Silvestre, Control Engineering Practice 21 (2013), equations (15) and (16): dx/dt = A(V) x +
B(V) delta with x = [u, w, theta, q] (m/s, m/s, rad, rad/s) and delta = [eta, tau] (elevator in degrees,
trailing edge up positive; thrust command in units of about 983 N). The printed polynomials stand here as
published; each correction has a name and can be left out. The pitch row has the effect of dw/dt on the
moment embedded (M_theta / Z_theta is one constant at every airspeed).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array

Polynomial = tuple[float, float, float]

MASS = 39.7  # kg
WING_AREA = 2.365  # m^2
CHORD = 1.34  # m
PITCH_INERTIA = 10.43  # kg m^2
AIR_DENSITY = 1.225  # kg/m^3
GRAVITY = 9.81  # m/s^2

VALID_AIRSPEED = (25.0, 55.0)  # m/s; above 60 m/s the fitted quadratics turn over

PRINTED_M_U = "0.2.6146V^2 - 0.003426V - 0.1425"

PUBLISHED: Mapping[str, Polynomial] = MappingProxyType(
    {  # (V^2, V, 1), V in m/s
        "X_u": (0.0, -0.00102, -0.009115),
        "X_w": (0.00018, 0.025, -1.0499),
        "X_theta": (0.0, 0.0, -9.67),
        "X_q": (-0.00166, 0.2308, -10.037),
        "X_eta": (0.0, 0.0, 0.026),
        "X_tau": (0.0, 0.0, 24.76),
        "Z_u": (-8.66e-5, 0.01249, -0.5699),
        "Z_w": (0.0, -0.08199, -0.10375),
        "Z_theta": (-0.001358, 0.1679, -5.4519),
        "Z_q": (0.0, 1.012, -0.77),
        "Z_eta": (0.0001159, 4.04e-5, -0.001415),
        # The leading coefficient is illegible in print (PRINTED_M_U); this is its only reading of the right size.
        "M_u": (2.6146e-5, -0.003426, -0.1425),
        "M_w": (0.0, -0.02817, 0.001135),
        "M_theta": (-0.0001475, 0.01824, -0.5922),
        "M_q": (0.0, 0.04614, -0.08368),
        "M_eta": (0.00021, -0.00015, 0.005065),
        "M_tau": (0.0, 0.0, -0.294),
    }
)

CORRECTIONS: Mapping[str, tuple[str, Polynomial]] = MappingProxyType(
    {
        "M_u": ("M_u", (2.6146e-5, -0.003426, 0.1425)),
        "X_w": ("X_w", (-0.00018, 0.025, -1.0499)),
    }
)

_STATE_ENTRIES = {
    (0, 0): "X_u", (0, 1): "X_w", (0, 2): "X_theta", (0, 3): "X_q",
    (1, 0): "Z_u", (1, 1): "Z_w", (1, 2): "Z_theta", (1, 3): "Z_q",
    (3, 0): "M_u", (3, 1): "M_w", (3, 2): "M_theta", (3, 3): "M_q",
}  # fmt: skip
_INPUT_ENTRIES = {(0, 0): "X_eta", (0, 1): "X_tau", (1, 0): "Z_eta", (3, 0): "M_eta", (3, 1): "M_tau"}


@dataclass(frozen=True)
class Derivatives:
    """The matrices A(V) and B(V) of equation (16).

    Parameters
    ----------
    corrections : iterable of str
        Names of `CORRECTIONS` that are applied; all of them by default, ``()`` for the text as printed.

    Raises
    ------
    ValueError
        If a name is not a known correction.
    """

    corrections: Iterable[str] = tuple(CORRECTIONS)
    polynomials: Mapping[str, Polynomial] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        names = tuple(self.corrections)
        unknown = [name for name in names if name not in CORRECTIONS]
        if unknown:
            raise ValueError(f"corrections contains {unknown}; expected any of {', '.join(CORRECTIONS)}")
        object.__setattr__(self, "corrections", names)
        object.__setattr__(self, "polynomials", MappingProxyType({**PUBLISHED, **dict(CORRECTIONS[n] for n in names)}))

    def value(self, name: str, airspeed: ArrayLike) -> Array:
        """One derivative, such as "M_u", at airspeeds V [m/s] of any shape."""
        return np.polyval(self.polynomials[name], np.asarray(airspeed, dtype=float))

    def A(self, airspeed: ArrayLike) -> Array:
        """State matrix at V [m/s]: (..., 4, 4)."""
        return self._fill(airspeed, 4, _STATE_ENTRIES, kinematic=True)

    def B(self, airspeed: ArrayLike) -> Array:
        """Input matrix at V [m/s]: (..., 4, 2)."""
        return self._fill(airspeed, 2, _INPUT_ENTRIES, kinematic=False)

    def _fill(
        self, airspeed: ArrayLike, columns: int, entries: Mapping[tuple[int, int], str], kinematic: bool
    ) -> Array:
        V = np.asarray(airspeed, dtype=float)
        matrix = np.zeros((*V.shape, 4, columns))
        for (row, column), name in entries.items():
            matrix[..., row, column] = self.value(name, V)
        if kinematic:
            matrix[..., 2, 3] = 1.0
        return matrix

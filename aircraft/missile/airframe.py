"""Airframe, propulsion and atmosphere of the missile benchmark (Marzat et al., SysTol 2010, section II).

The paper prints the structure of the aerodynamic coefficients but no numbers. Those here are fitted to a public
surface-to-air missile deck at Mach 2, except where a comment says "own choice". Per radian; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from svo.checks import Array, expect

GRAVITY = 9.81
DEFLECTION_LIMIT = float(np.radians(28.0))
INPUT_LOWER = np.array([-DEFLECTION_LIMIT, -DEFLECTION_LIMIT, -DEFLECTION_LIMIT, 0.0])
INPUT_UPPER = np.array([DEFLECTION_LIMIT, DEFLECTION_LIMIT, DEFLECTION_LIMIT, 1.0])
INPUTS = ("dl", "dm", "dn", "eta")
STATES = ("x", "y", "z", "vbx", "vby", "vbz", "p", "q", "r", "phi", "theta", "psi")

# What section III-C calls epsilon acts on these: forces only, since the moments are not in the residuals.
FORCE_COEFFICIENTS = (
    "cx_zero",
    "cx_alpha_squared",
    "cx_dl",
    "cx_dm",
    "cx_dn",
    "cy_beta",
    "cy_beta_abs",
    "cy_dl",
    "cy_dn",
    "cz_alpha",
    "cz_alpha_abs",
    "cz_dm",
)


@dataclass(frozen=True)
class Airframe:
    """Constants of the missile.

    The coefficients of the paper are, with alpha and beta in rad,

        cx0 + cx_alpha alpha = cx_zero + cx_alpha_squared alpha^2,
        cx_dm = cx_dm (1 + alpha),  cx_dn = cx_dn (1 + beta),
        cy_beta = cy_beta + cy_beta_abs |beta|,  cz_alpha = cz_alpha + cz_alpha_abs |alpha|,
        cm_alpha = cm_alpha + cm_alpha_abs |alpha|,  cn_beta = cn_beta + cn_beta_abs |beta|;

    cy0, cz0, cl0, cm0 and cn0 are zero.
    """

    cx_zero: float = 0.531
    cx_alpha_squared: float = -0.27
    cx_dl: float = 0.40  # own choice; zero on a symmetric missile
    cx_dm: float = 0.50  # own choice; zero on a symmetric missile
    cx_dn: float = 0.50  # own choice; zero on a symmetric missile
    cy_beta: float = -12.44
    cy_beta_abs: float = -37.8
    cy_dl: float = 0.35  # own choice; zero on a symmetric missile
    cy_dn: float = 3.48
    cz_alpha: float = 12.44
    cz_alpha_abs: float = 37.8
    cz_dm: float = 3.48
    cl_beta: float = 0.64
    cl_dl: float = 4.96
    cl_dn: float = 0.50  # own choice
    cl_p: float = -4.67
    cm_alpha: float = -38.0
    cm_alpha_abs: float = 54.9
    cm_dm: float = -25.0
    cm_q: float = -966.0
    cn_beta: float = 38.0
    cn_beta_abs: float = -54.9
    cn_dl: float = -2.5  # own choice
    cn_dn: float = -25.0
    cn_r: float = -966.0
    mass: float = 190.0
    roll_inertia: float = 2.02
    pitch_inertia: float = 212.0
    reference_area: float = 0.0491
    reference_length: float = 0.25
    thrust_min: float = 1000.0  # own choice
    thrust_max: float = 9000.0  # own choice
    density: float = 1.225  # own choice of the atmosphere: density exp(-h / scale_height)
    scale_height: float = 9300.0
    gravity: float = GRAVITY

    def __post_init__(self) -> None:
        values = self.packed()
        if not np.isfinite(values).all():
            raise ValueError(f"{fields(self)[int(np.argmin(np.isfinite(values)))].name} is not a finite number")
        for name in ("mass", "roll_inertia", "pitch_inertia", "reference_area", "reference_length", "scale_height"):
            expect(getattr(self, name) > 0, name, getattr(self, name), "a positive number")
        if not 0 <= self.thrust_min < self.thrust_max:
            raise ValueError(
                f"thrust is from {self.thrust_min} to {self.thrust_max}; expected 0 <= thrust_min < thrust_max"
            )

    def packed(self) -> Array:
        """Everything that the core's functions need, in the order of the fields."""
        return np.array([getattr(self, field.name) for field in fields(self)], dtype=float)

    def perturbed(self, relative: float, rng: np.random.Generator) -> Airframe:
        """Another airframe: each force coefficient times 1 + e, the e independent and uniform in [-relative, relative].

        Raises
        ------
        ValueError
            If ``relative`` is not in [0, 1).
        """
        expect(0 <= relative < 1, "relative", relative, "a bound on the relative error, 0 <= relative < 1")
        errors = rng.uniform(-relative, relative, len(FORCE_COEFFICIENTS))
        changed = {n: getattr(self, n) * (1.0 + float(e)) for n, e in zip(FORCE_COEFFICIENTS, errors, strict=True)}
        return replace(self, **changed)

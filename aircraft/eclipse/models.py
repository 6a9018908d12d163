"""The models of the Eclipse's observers: nominal, and one for each fault.

    x(k+1) = A_d x + B_d u + a + E d + e,   a = x_t - A_d x_t - B_d u_t,   |d| <= gusts, |e| <= mismatch
    y(k)   = C x + c + v,                   c = h(x_t) - C x_t,            |v| <= noise + linearisation

in ABSOLUTE x and u (in deviations, a moving trim would shift the state), with the corrected published
A(V), B(V) discretised exactly, and the simulator's level trim (x_t, u_t), all at the scheduled airspeed.
The mismatch bounds are measured (`aircraft.eclipse.mismatch`), for each noise set and observer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from aircraft import bounds_file
from aircraft.eclipse.derivatives import VALID_AIRSPEED, Derivatives
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.schedule import ScheduledBlocks
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import gust_directions, level_trim, output_matrix
from svo.checks import Array, sizes
from svo.models import UncertainModel, Uncertainty, zero_order_hold

SPACING = 0.25  # of the table [m/s]; the interpolation error counts into the measured mismatch
NAMES = {
    "states": ("u", "w", "theta", "q"),
    "inputs": ("eta", "tau"),
    "outputs": ("V", "alpha", "theta", "q"),
    "disturbances": ("gust u", "gust w", "gust q", "mismatch u", "mismatch w", "mismatch theta", "mismatch q"),
}
SPEED_MOMENT_INCREASE = 0.3  # of M_u at the full dynamics fault


@dataclass(frozen=True)
class MismatchBounds:
    """Half-widths of what the scheduled model leaves out.

    Attributes
    ----------
    state : (4,) array
        Of x(k+1), per sample [m/s, m/s, rad, rad/s].
    output : (4,) array
        Of [V, alpha, theta, q], from linearising the outputs [m/s, rad, 0, 0].
    """

    state: Array
    output: Array

    def __post_init__(self) -> None:
        for name in ("state", "output"):
            object.__setattr__(self, name, sizes(name, getattr(self, name), 4))


def read_bounds() -> Mapping[str, Mapping[str, MismatchBounds]]:
    """The measured bounds that ship with the package: noise set -> observer ("nominal" or a fault) -> bounds."""
    return bounds_file.read("aircraft.eclipse", MismatchBounds)


@dataclass(frozen=True)
class ScheduledModel:
    """The scheduled matrices that all observers share.

    Parameters
    ----------
    Ts : float
        Sampling time [s].
    surrogate, derivatives
        Where the trim and A(V), B(V) come from.
    moment_reference : float
        u [m/s] at which the dynamics fault has no effect: zero for the absolute form.
    """

    Ts: float
    surrogate: Surrogate = field(default_factory=Surrogate)
    derivatives: Derivatives = field(default_factory=Derivatives)
    moment_reference: float = 0.0

    @cached_property
    def blocks(self) -> ScheduledBlocks:
        """A, B, a, E, C, c, and the direction of the dynamics fault, over 25 to 55 m/s."""
        low, high = VALID_AIRSPEED
        airspeeds = np.linspace(low, high, round((high - low) / SPACING) + 1)
        return ScheduledBlocks(low, SPACING, self._tables(airspeeds))

    def _tables(self, airspeeds: Array) -> dict[str, Array]:
        """Each block (points, ...) at airspeeds (points,)."""
        trim, points = level_trim(self.surrogate, airspeeds), len(airspeeds)
        speed_moment = np.zeros((points, 4, 1))
        speed_moment[:, 3, 0] = SPEED_MOMENT_INCREASE * self.derivatives.value("M_u", airspeeds)
        gusts = np.broadcast_to(gust_directions(self.surrogate), (points, 4, 3))
        columns = np.concatenate([self.derivatives.B(airspeeds), gusts, speed_moment], axis=-1)
        continuous = zip(self.derivatives.A(airspeeds), columns, strict=True)
        A, held = map(np.array, zip(*(zero_order_hold(*pair, self.Ts) for pair in continuous), strict=True))
        C, B, channel = output_matrix(trim), held[..., :2], held[..., 5]
        x, u = trim.x[..., None], trim.u[..., None]
        return {
            "A": A,
            "B": B,
            "a": (x - A @ x - B @ u)[..., 0],
            "E": np.concatenate([held[..., 2:5], np.broadcast_to(np.eye(4), (points, 4, 4))], axis=-1),
            "C": C,
            "c": trim.y - (C @ x)[..., 0],
            "moment": channel[..., None] * [1.0, 0.0, 0.0, 0.0],
            "moment_offset": -channel * self.moment_reference,
        }

    @property
    def speed_moment(self) -> Uncertainty:
        """Direction of the dynamics fault: 0.3 M_u (u - reference) on dq/dt, at Delta = 1.

        The exponential of an uncertain matrix is not affine in Delta; this is its first-order direction
        Gamma e_q, and what that leaves out is part of the measured mismatch.
        """
        offset = self.blocks.block("moment_offset") if self.moment_reference else None
        return Uncertainty(A=self.blocks.block("moment"), a=offset, bounds=(0.0, 1.0), name="M_u")

    def model(self, noise: str, mismatch: MismatchBounds) -> UncertainModel:
        """The model without faults, for one noise set and one set of mismatch bounds."""
        bounds = NOISE_SETS[noise]
        block = self.blocks.block
        return UncertainModel(
            block("A"),
            block("B"),
            block("C"),
            E=block("E"),
            a=block("a"),
            c=block("c"),
            w=np.concatenate([bounds.gusts, mismatch.state]),
            n=np.asarray(bounds.sensors) + mismatch.output,
            Ts=self.Ts,
            names=NAMES,
            schedule=0.5 * sum(VALID_AIRSPEED),
        )

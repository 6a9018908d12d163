"""The Eclipse's observers with its own equations: nominal, and one model for each fault.

The right-hand side is that of `simulator.c`, so that nothing about the aircraft is measured: at each sample an
observer linearises it over the set that it knows, with a proven bound of what that leaves out. Gusts, inputs and
faults are held over a sample, as the simulator holds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.models import NAMES, SPEED_MOMENT_INCREASE
from aircraft.eclipse.noise import NoiseSet
from aircraft.eclipse.scenarios import Fault
from aircraft.eclipse.simulator import Surrogate
from svo.faults import ParameterFault, PlantFault
from svo.functions import atan2, cos, sin, sqrt
from svo.models.nonlinear import NonlinearModel

# [u, w, theta, q]: beyond it nothing is said of a flight. It holds what follows within a sample of any `initial` state.
VALID = ((5.0, -40.0, -1.5, -6.0), (90.0, 50.0, 1.5, 6.0))

Rows = list[Any]


@dataclass(frozen=True)
class Equations:
    """dx/dt of [u, w, theta, q] and the measurements [V, alpha, theta, q], for `NonlinearModel`.

    Parameters
    ----------
    surrogate, derivatives
        Coefficients, and the polynomial M_u(V) of the dynamics fault.
    moment_reference : float
        u [m/s] at which the dynamics fault has no effect.
    """

    surrogate: Surrogate = field(default_factory=Surrogate)
    derivatives: Derivatives = field(default_factory=Derivatives)
    moment_reference: float = 0.0

    def healthy(self, x: Any, u: Any, w: Any) -> Rows:
        """The aircraft without faults, w being the gusts."""
        s, (eta, tau) = self.surrogate, u
        *_, force, torque, half_chord, gravity, thrust, thrust_moment = s.packed().tolist()
        along, across, theta, q = x
        squared = along**2 + across**2
        speed, alpha = sqrt(squared), atan2(across, along)
        lift = s.CL0 + s.CLa * alpha + s.CLe * eta
        drag = s.CD0 + s.k * lift**2 + s.CDe * eta
        aero_x, aero_z = speed * (lift * across - drag * along), speed * (lift * along + drag * across)
        du = force * aero_x + thrust * tau - s.k_r * along - gravity * sin(theta) - q * across + w[0]
        dw = gravity * cos(theta) - force * aero_z + s.normal_coupling * q * along + w[1]
        moment = squared * (s.Cma * alpha + s.Cme * eta) + s.Cmq * half_chord * (speed * q)
        return [du, dw, q, torque * moment + thrust_moment * tau + s.M_wdot * dw + w[2]]

    def dynamics(self, x: Any, u: Any, w: Any, p: Any) -> Rows:
        """With M_u increased by p[0] times 30 %."""
        M = self.derivatives.polynomials["M_u"]
        squared = x[0] ** 2 + x[1] ** 2
        of_speed = (M[0] * squared + M[1] * sqrt(squared) + M[2]) * (x[0] - self.moment_reference)
        *others, rate = self.healthy(x, u, w)
        return [*others, rate + p[0] * (SPEED_MOMENT_INCREASE * of_speed)]

    @staticmethod
    def measured(x: Any) -> Rows:
        """[V, alpha, theta, q]."""
        return [sqrt(x[0] ** 2 + x[1] ** 2), atan2(x[1], x[0]), x[2], x[3]]


def nonlinear_models(
    equations: Equations, noise: NoiseSet, faults: Mapping[str, Fault], Ts: float, initial: tuple[ArrayLike, ArrayLike]
) -> dict[str, NonlinearModel]:
    """The observers' models: "nominal", then one for each fault at any size up to its own, the healthy aircraft too.

    Parameters
    ----------
    equations : Equations
    noise : NoiseSet
    faults : mapping of str to SensorFault, ActuatorFault or PlantFault
        A bias of a sensor, a loss of the elevator, or an increase of M_u.
    Ts : float
        Sampling time [s].
    initial : (lower, upper)
        Any state of a flight, where a set starts: at first, and again where it is lost.
    """
    states, inputs, outputs, disturbances = (NAMES[what] for what in ("states", "inputs", "outputs", "disturbances"))
    nominal = NonlinearModel(
        equations.healthy, equations.measured, states=states, inputs=inputs, outputs=outputs,
        disturbances=disturbances[:3], Ts=Ts, n=noise.sensors, w=np.array(noise.gusts), valid=VALID, largest=initial,
    )  # fmt: skip
    return {"nominal": nominal} | {name: _with(fault, nominal, equations) for name, fault in faults.items()}


def _with(fault: Fault, nominal: NonlinearModel, equations: Equations) -> NonlinearModel:
    """The aircraft with a fault of any size up to its own."""
    if not isinstance(fault, PlantFault):
        return fault.model(nominal)
    return ParameterFault("increase of M_u", fault.magnitude, fault.profile, f=equations.dynamics).model(nominal)

"""Nonlinear plants that the field knows, with kinks, cuts and saturations, and the aircraft's equations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from aircraft.eclipse.equations import Equations, nonlinear_models
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER
from aircraft.eclipse.scenarios import TS
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim
from aircraft.missile.airframe import Airframe
from svo.functions import abs, atan2, cos, exp, log, max, min, sign, sin, tanh
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import Case, cstr


def two_link_arm(**changes: Any) -> Case:
    """Two links of 1 kg and 0.5 m in a vertical plane, viscous friction, both angles measured."""

    def f(x, u, w):
        q1, q2, v1, v2 = x
        c2, s2 = 0.25 * cos(q2), 0.25 * sin(q2)
        m11, m12, m22 = 0.67 + 2.0 * c2, 0.17 + c2, 0.17
        g2 = 2.45 * cos(q1 + q2)
        t1 = u[0] + w[0] + s2 * v2 * (2.0 * v1 + v2) - 0.4 * v1 - 7.36 * cos(q1) - g2
        t2 = u[1] + w[1] - s2 * v1**2 - 0.4 * v2 - g2
        det = m11 * m22 - m12**2
        return [v1, v2, (m22 * t1 - m12 * t2) / det, (m11 * t2 - m12 * t1) / det]

    model = NonlinearModel(
        f, lambda x: [x[0], x[1]], states=["q1", "q2", "v1", "v2"], inputs=["t1", "t2"], disturbances=["d1", "d2"],
        Ts=0.01, n=0.002, w=[0.1, 0.1], largest=([-20, -20, -30, -40], [20, 20, 30, 40]), **changes,
    )  # fmt: skip
    u = lambda k: [9.0 + 2.0 * np.sin(0.05 * k), 2.3 + np.cos(0.09 * k)]  # noqa: E731
    return Case(model, np.array([0.3, 0.2, 0.0, 0.0]), np.array([0.02, 0.02, 0.1, 0.1]), u)


def bioreactor(**changes: Any) -> Case:
    """Continuous culture with Monod's growth; biomass measured; g/l, h."""

    def f(x, u, w, p):
        growth = p[0] * x[1] / (0.2 + x[1]) * x[0]
        return [growth - u[0] * x[0], u[0] * (5.0 + w[0] - x[1]) - 2.0 * growth]

    model = NonlinearModel(
        f, lambda x: [x[0]], states=["biomass", "substrate"], inputs=["dilution"], disturbances=["feed"],
        parameters={"mu": (0.48, 0.52)}, Ts=0.2, n=0.02, w=[0.1], physical=([0, 0], [4, 8]), **changes,
    )  # fmt: skip
    return Case(model, np.array([2.3, 0.3]), np.array([0.05, 0.05]), lambda k: [0.3 + 0.05 * np.sin(0.06 * k)])


def van_der_pol(**changes: Any) -> Case:
    model = NonlinearModel(
        lambda x, w: [x[1], 2.0 * (1.0 - x[0] ** 2) * x[1] - x[0] + w[0]], lambda x: [x[0]], states=["x", "v"],
        disturbances=["w"], Ts=0.05, n=0.02, w=[0.05], largest=([-4, -8], [4, 8]), **changes,
    )  # fmt: skip
    return Case(model, np.array([1.0, 0.5]), np.array([0.05, 0.1]), lambda k: [])


def quadrotor(**changes: Any) -> Case:
    """Attitude of a quadrotor: Euler angles and rates, the moments as inputs."""

    def f(x, u, w):
        phi, theta, p, q, r = x
        turn = q * sin(phi) + r * cos(phi)
        return [
            p + turn * sin(theta) / cos(theta), q * cos(phi) - r * sin(phi),
            (u[0] + w[0] - 0.008 * q * r - 0.002 * p) / 0.01, (u[1] + w[1] + 0.008 * p * r - 0.002 * q) / 0.01,
            (u[2] - 0.002 * r) / 0.018,
        ]  # fmt: skip

    model = NonlinearModel(
        f, lambda x: [x[0], x[1], x[4]], states=["phi", "theta", "p", "q", "r"], inputs=["L", "M", "N"],
        disturbances=["gust L", "gust M"], Ts=0.01, n=[0.005, 0.005, 0.02], w=[1e-3, 1e-3],
        largest=([-7, -1.4, -20, -20, -20], [7, 1.4, 20, 20, 20]), **changes,
    )  # fmt: skip
    u = lambda k: [0.02 * np.cos(0.2 * k), 0.02 * np.cos(0.2 * k + 1.0), 0.005 * np.cos(0.15 * k)]  # noqa: E731
    control = lambda y: np.stack([-0.04 * y[0], -0.04 * y[1], 0.0 * y[2]])  # noqa: E731
    return Case(model, np.array([0.1, 0.1, 0.0, 0.0, 0.3]), np.array([0.02, 0.02, 0.1, 0.1, 0.05]), u, control=control)


def bicycle(**changes: Any) -> Case:
    """Single-track car: slip angles by atan2, tyres that saturate; yaw rate and lateral acceleration measured."""

    def tyres(x, u):
        vx, vy, r = x
        front, rear = u[0] - atan2(vy + 1.2 * r, vx), -atan2(vy - 1.4 * r, vx)
        return 6000.0 * tanh(12.0 * front), 6000.0 * tanh(14.0 * rear)

    def f(x, u, w):
        front, rear = tyres(x, u)
        vx, vy, r = x
        return [
            u[1] - 0.0004 * vx * abs(vx) - front * sin(u[0]) / 1500.0 + vy * r + w[0],
            (front * cos(u[0]) + rear) / 1500.0 - vx * r + w[1],
            (1.2 * front * cos(u[0]) - 1.4 * rear) / 2500.0,
        ]

    def h(x, u):
        front, rear = tyres(x, u)
        return [x[0], x[2], (front * cos(u[0]) + rear) / 1500.0]

    model = NonlinearModel(
        f, h, states=["vx", "vy", "r"], inputs=["steer", "drive"], disturbances=["slope", "wind"], Ts=0.02,
        n=[0.1, 0.005, 0.1], w=[0.1, 0.2], valid=([2, -15, -4], [60, 15, 4]), largest=([5, -8, -2], [40, 8, 2]),
        **changes,
    )  # fmt: skip
    u = lambda k: [0.03 * np.sin(0.06 * k), 0.3 + 0.3 * np.sin(0.021 * k)]  # noqa: E731
    return Case(model, np.array([20.0, 0.0, 0.0]), np.array([0.2, 0.05, 0.02]), u)


def heat_exchanger(**changes: Any) -> Case:
    """Two streams, the heat by the logarithmic mean of the differences at both ends; K, s."""

    def f(x, u, w):
        one, other = u[2] - x[1], x[0] - u[3]
        heat = 0.8 * (one - other) / log(one / other)
        return [(u[0] * (u[2] - x[0]) - heat) / 20.0 + w[0], (u[1] * (u[3] - x[1]) + heat) / 25.0 + w[1]]

    model = NonlinearModel(
        f, lambda x: x, states=["hot out", "cold out"], inputs=["hot flow", "cold flow", "hot in", "cold in"],
        disturbances=["w1", "w2"], Ts=2.0, n=0.2, w=[0.02, 0.02], largest=([310, 295], [350, 340]), **changes,
    )  # fmt: skip
    u = lambda k: [1.0 + 0.2 * np.sin(0.1 * k), 1.6 + 0.2 * np.cos(0.07 * k), 360.0, 290.0]  # noqa: E731
    return Case(model, np.array([335.0, 305.0]), np.array([0.5, 0.5]), u)


def battery(**changes: Any) -> Case:
    """State of charge and a relaxation voltage; the open-circuit voltage has an exponential; current in A, voltage."""

    def f(x, u, p):
        return [-u[0] / p[0], -x[1] / 30.0 + u[0] / 1000.0]

    def h(x, u, p):
        return [3.4 + 0.5 * x[0] - 0.4 * exp(-25.0 * x[0]) - x[1] - p[1] * u[0]]

    model = NonlinearModel(
        f, h, states=["charge", "relaxation"], inputs=["current"],
        parameters={"capacity": (8900.0, 9100.0), "R0": (0.019, 0.021)}, Ts=10.0, n=0.005,
        physical=([0, -1], [1, 1]), **changes,
    )  # fmt: skip
    u = lambda k: [1.0 + 4.0 * np.sign(np.sin(0.2 * k))]  # noqa: E731
    return Case(model, np.array([0.5, 0.0]), np.array([0.1, 0.005]), u)


def dc_motor(**changes: Any) -> Case:
    """A DC motor that reverses against Coulomb friction: current and speed."""

    def f(x, u, w):
        current, speed = x
        return [(u[0] - 0.5 * current - 0.05 * speed) / 0.01, (0.05 * current - 0.02 * sign(speed) + w[0]) / 0.002]

    model = NonlinearModel(
        f, lambda x: [x[0], x[1]], states=["current", "speed"], inputs=["voltage"], disturbances=["load"], Ts=0.005,
        n=[0.02, 0.5], w=[0.002], largest=([-60, -300], [60, 300]), **changes,
    )  # fmt: skip
    return Case(model, np.array([0.5, 3.0]), np.array([0.1, 1.0]), lambda k: [1.5 * np.sin(0.05 * k)], smooth=False)


def lotka_volterra(**changes: Any) -> Case:
    model = NonlinearModel(
        lambda x, w: [x[0] * (1.0 - 0.5 * x[1]) + w[0], x[1] * (0.4 * x[0] - 0.8) + w[1]], lambda x: [x[0]],
        states=["prey", "predator"], disturbances=["w1", "w2"], Ts=0.1, n=0.05, w=[0.01, 0.01],
        largest=([-1, -1], [20, 20]), **changes,
    )  # fmt: skip
    return Case(model, np.array([2.5, 1.5]), np.array([0.1, 0.1]), lambda k: [])


def predator(**changes: Any) -> Case:
    """A predator that is sated: min and max of the prey; the harvest is limited too."""

    def f(x, u, w):
        eaten = min(0.6 * x[0], 1.2) * x[1]
        harvest = max(min(u[0], 0.5 * x[1]), 0.0)
        return [x[0] * (1.2 - 0.15 * x[0]) - eaten + w[0], 0.5 * eaten - 0.4 * x[1] - harvest]

    model = NonlinearModel(
        f, lambda x: [x[0]], states=["prey", "predator"], inputs=["harvest"], disturbances=["w"], Ts=0.1, n=0.05,
        w=[0.02], physical=([0, 0], [12, 12]), **changes,
    )  # fmt: skip
    u = lambda k: [0.1 + 0.3 * np.sin(0.05 * k)]  # noqa: E731
    return Case(model, np.array([2.0, 1.0]), np.array([0.1, 0.1]), u, smooth=False)


def missile(**changes: Any) -> Case:
    """Force equations of `aircraft.missile`: the velocity in body axes; coefficients off by 5 %, rates by the gyros."""
    a = Airframe()

    def force(x, u, p):
        vx, vy, vz = x
        alpha, beta = atan2(vz, vx), atan2(vy, vx)
        squared = vx**2 + vy**2 + vz**2
        scale = 0.5 * a.density * exp(u[4] / a.scale_height) * squared * (a.reference_area / a.mass)
        cx = a.cx_zero + a.cx_alpha_squared * alpha**2
        cx = cx + a.cx_dl * u[0] + a.cx_dm * (1.0 + alpha) * u[1] + a.cx_dn * (1.0 + beta) * u[2]
        cy = (a.cy_beta + a.cy_beta_abs * abs(beta)) * beta + a.cy_dl * u[0] + a.cy_dn * u[2]
        cz = (a.cz_alpha + a.cz_alpha_abs * abs(alpha)) * alpha + a.cz_dm * u[1]
        thrust = (a.thrust_min + (a.thrust_max - a.thrust_min) * u[3]) / a.mass
        return [-scale * cx * (1.0 + p[0]) + thrust, scale * cy * (1.0 + p[1]), -scale * cz * (1.0 + p[2])]

    def f(x, u, w, p):
        fx, fy, fz = force(x, u, p)
        vx, vy, vz = x
        turn_p, turn_q, turn_r = u[5] + w[0], u[6] + w[1], u[7] + w[2]
        g = a.gravity
        return [
            fx - g * sin(u[9]) - (turn_q * vz - turn_r * vy),
            fy + g * cos(u[9]) * sin(u[8]) - (turn_r * vx - turn_p * vz),
            fz + g * cos(u[9]) * cos(u[8]) - (turn_p * vy - turn_q * vx),
        ]

    model = NonlinearModel(
        f, lambda x, u, p: [*force(x, u, p), x[0], x[1], x[2]], states=["vx", "vy", "vz"],
        inputs=["dl", "dm", "dn", "eta", "z", "p", "q", "r", "phi", "theta"],
        disturbances=["gyro p", "gyro q", "gyro r"], outputs=["ax", "ay", "az", "vx", "vy", "vz"],
        parameters=dict.fromkeys(("cx", "cy", "cz"), (-0.05, 0.05)),
        Ts=0.01, n=[0.1, 0.1, 0.1, 2.0, 2.0, 2.0], w=[0.001] * 3, valid=([50, -400, -400], [1500, 400, 400]),
        largest=([300, -150, -150], [900, 150, 150]), **({"varying": "w"} | changes),
    )  # fmt: skip

    def u(k: int) -> list[float]:
        return [
            0.01 * np.sin(0.11 * k), 0.1 * np.sin(0.05 * k), 0.1 * np.cos(0.04 * k), 0.35, -4000.0 - 0.1 * k,
            0.05 * np.sin(0.1 * k), 0.2 * np.sin(0.06 * k), 0.2 * np.cos(0.05 * k), 0.1 * np.sin(0.03 * k), 0.05,
        ]  # fmt: skip

    return Case(model, np.array([600.0, 5.0, 10.0]), np.array([5.0, 5.0, 5.0]), u, smooth=False)


def eclipse(**changes: Any) -> Case:
    """The Eclipse in gusts, controls that move about level trim at 37 m/s."""
    trim = level_trim(Surrogate(), 37.0)
    models = nonlinear_models(Equations(), NOISE_SETS["quiet"], {}, TS, (INITIAL_LOWER, INITIAL_UPPER))
    u = lambda k: (trim.u + np.array([np.sin(0.23 * k), 0.05 * np.sin(0.07 * k)])).tolist()  # noqa: E731
    spread = np.array([0.5, 0.3, 0.02, 0.05])
    return Case(models["nominal"].replace(**changes), trim.x, spread, u)


def ignition(**changes: Any) -> Case:
    """The reactor of `cstr` without its controller: it ignites or goes out."""
    return replace(cstr(**changes), control=None)


FIELD = {
    "two-link arm": two_link_arm, "bioreactor": bioreactor, "van der pol": van_der_pol, "quadrotor": quadrotor,
    "bicycle": bicycle, "heat exchanger": heat_exchanger, "battery": battery, "dc motor": dc_motor,
    "lotka-volterra": lotka_volterra, "predator": predator,
}  # fmt: skip
AIRCRAFT = {"missile": missile, "eclipse": eclipse}

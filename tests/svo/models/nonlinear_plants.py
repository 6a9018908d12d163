"""Nonlinear plants with first states, inputs and noise: what tests of transitions and of observers share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from svo import UncertainModel
from svo.checks import Array
from svo.functions import cos, exp, max, sign, sin, sqrt, sroot
from svo.models.nonlinear import NonlinearModel


@dataclass(frozen=True)
class Case:
    """A plant, where it starts, the input at sample k, and what a controller adds to it, if there is one.

    ``normal`` bounds the states of normal operation: beyond it a run has run away.
    """

    model: NonlinearModel
    x0: Array
    spread: Array
    u: Callable[[int], list[float]]
    smooth: bool = True
    control: Callable[[Array], Array] | None = None
    normal: tuple[Array, Array] | None = None

    def inputs(self, samples: int) -> Array:
        return np.array([self.u(k) for k in range(samples)], dtype=float).reshape(samples, self.model.n_inputs)


def cstr(**changes: Any) -> Case:
    """Stirred tank reactor of Henson and Seborg at its unstable set-point; minutes."""

    def f(x, w, u):
        k = 7.2e10 * (exp(-8750.0 / x[1]) * x[0])
        return [1.0 - x[0] - k + w[0], 350.0 - x[1] + 209.2 * k + 2.092 * (u[0] - x[1]) + w[1]]

    model = NonlinearModel(
        f, lambda x: [x[1]], states=["Ca", "T"], inputs=["Tc"], disturbances=["w1", "w2"], Ts=0.05, n=[0.2],
        w=[0.005, 0.5], physical=([0, 250], [1.1, 600]), largest=([0, 290], [1.05, 480]), **changes,
    )  # fmt: skip
    return Case(
        model, np.array([0.5, 350.0]), np.array([0.01, 2.0]), lambda k: [300.0],
        control=lambda y: 4.0 * (350.0 - y), normal=(np.array([0.0, 300.0]), np.array([1.1, 400.0])),
    )  # fmt: skip


def tank(**changes: Any) -> Case:
    """Quadruple tank of Johansson: cm, s, V."""
    A, a = (28.0, 32.0, 28.0, 32.0), (0.071, 0.057, 0.071, 0.057)

    def f(h, u, w):
        q = [a[i] * sqrt(1962.0 * h[i]) for i in range(4)]
        v = [3.33 * u[0] * (1 + w[0]), 3.35 * u[1] * (1 + w[1])]
        return [
            (q[2] - q[0] + 0.7 * v[0]) / A[0], (q[3] - q[1] + 0.6 * v[1]) / A[1],
            (0.4 * v[1] - q[2]) / A[2], (0.3 * v[0] - q[3]) / A[3],
        ]  # fmt: skip

    model = NonlinearModel(
        f, lambda h: [h[0], h[1]], states=["h1", "h2", "h3", "h4"], inputs=["v1", "v2"], disturbances=["w1", "w2"],
        Ts=2.0, n=[0.05, 0.05], w=[0.01, 0.01], physical=([0] * 4, [25] * 4), **changes,
    )  # fmt: skip
    u = lambda k: [3.0 + 0.4 * np.sin(0.11 * k), 3.0 - 0.4 * np.cos(0.07 * k)]  # noqa: E731
    return Case(model, np.array([12.3, 12.8, 1.7, 1.4]), np.array([0.3, 0.3, 0.2, 0.2]), u)


def pendulum(**changes: Any) -> Case:
    """A pendulum with a torque, its angle measured; also over the top."""
    model = NonlinearModel(
        lambda x, u, w: [x[1], -9.81 * sin(x[0]) - 0.3 * x[1] + u[0] + w[0]], lambda x: [x[0]],
        states=["angle", "rate"], inputs=["torque"], disturbances=["push"], Ts=0.05, n=0.01, w=[0.05],
        largest=([-30, -20], [30, 20]), **changes,
    )  # fmt: skip
    u = lambda k: [6.0 * np.sin(0.09 * k)]  # noqa: E731
    return Case(model, np.array([0.4, 0.0]), np.array([0.05, 0.1]), u)


def lorenz(**changes: Any) -> Case:
    model = NonlinearModel(
        lambda x, w: [10.0 * (x[1] - x[0]) + w[0], x[0] * (28.0 - x[2]) - x[1], x[0] * x[1] - 8.0 / 3.0 * x[2]],
        lambda x: [x[0]], states=["x", "y", "z"], disturbances=["w"], Ts=0.02, n=0.1, w=[0.1],
        largest=([-40, -50, -10], [40, 50, 80]), **changes,
    )  # fmt: skip
    return Case(model, np.array([1.0, 2.0, 20.0]), np.array([0.2, 0.2, 0.5]), lambda k: [])


def three_tanks(**changes: Any) -> Case:
    """Three tanks in a row whose levels cross: signed roots."""

    def f(h, u, w):
        q13, q32 = 0.23 * sroot(1962.0 * (h[0] - h[2])), 0.225 * sroot(1962.0 * (h[2] - h[1]))
        q20 = 0.3 * sqrt(1962.0 * h[1])
        return [(u[0] - q13) / 154.0 + w[0], (u[1] + q32 - q20) / 154.0 + w[1], (q13 - q32) / 154.0 + w[2]]

    model = NonlinearModel(
        f, lambda h: h, states=["h1", "h2", "h3"], inputs=["Q1", "Q2"], disturbances=["w1", "w2", "w3"], Ts=5.0,
        n=[0.2] * 3, w=[0.003] * 3, physical=([0] * 3, [62] * 3), **changes,
    )  # fmt: skip
    u = lambda k: [30.0 + 28.0 * np.sin(0.1 * k), 30.0 + 28.0 * np.sin(0.073 * k + 2.0)]  # noqa: E731
    return Case(model, np.array([20.0, 18.0, 19.0]), np.array([0.5, 0.5, 0.5]), u, smooth=False)


def servo(**changes: Any) -> Case:
    """An actuator with a sign inside a root."""

    def f(x, u, w):
        e = u[0] - x[0]
        return [15.0 * e * sqrt((1.0 - (0.10 + 0.9 * x[0]) * (1.0 + w[0]) * sign(e)) / (1.0 + 180.0 * e**2))]

    model = NonlinearModel(
        f, lambda x: x, states=["deflection"], inputs=["command"], disturbances=["hinge"], Ts=0.02, n=0.002, w=[0.15],
        physical=([-0.7], [0.7]), **({"varying": "w"} | changes),
    )  # fmt: skip
    return Case(model, np.array([0.0]), np.array([0.01]), lambda k: [0.3 * np.sign(np.sin(0.05 * k))], smooth=False)


def crane(**changes: Any) -> Case:
    """Parameters, products of two kinds, an output that is nonlinear and reads the input, and a one-way stop."""

    def f(x, u, w, p):
        return [
            x[1],
            u[0] * cos(x[0]) - p[0] * sin(x[0]) - p[1] * x[1] * abs(x[1]) - 20.0 * max(x[0] - 0.6, 0.0) + w[0],
        ]

    model = NonlinearModel(
        f, lambda x, u, p, w: [p[0] * sin(x[0]) / 9.8 + 0.1 * u[0], x[1] + 0.01 * w[0]],
        states=["angle", "rate"], inputs=["force"],
        outputs=["load", "gyro"], disturbances=["wind"], parameters={"gravity": (9.7, 9.9), "drag": (0.1, 0.3)},
        Ts=0.04, n=[0.01, 0.05], w=[0.1], largest=([-1.5, -8], [1.5, 8]),
        **({"varying": ["wind", "drag"]} | changes),
    )  # fmt: skip
    return Case(model, np.array([0.2, 0.0]), np.array([0.1, 0.1]), lambda k: [3.0 * np.sin(0.21 * k)], smooth=False)


def friction(**changes: Any) -> Case:
    """A mass on a rough floor: the sign of its rate jumps, and slides while it sticks."""
    model = NonlinearModel(
        lambda x, u, w: [x[1], u[0] - sign(x[1]) - 0.2 * x[1] + w[0]], lambda x: [x[0]], states=["position", "rate"],
        inputs=["force"], disturbances=["push"], Ts=0.02, n=0.002, w=[0.05], largest=([-50, -20], [50, 20]), **changes,
    )  # fmt: skip
    return Case(model, np.array([0.0, 0.3]), np.array([0.01, 0.05]), lambda k: [2.0 * np.sin(0.07 * k)], smooth=False)


def oscillator() -> tuple[UncertainModel, NonlinearModel]:
    """A linear plant, as matrices and as equations."""
    A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [1.0]])
    common = {"Ts": 0.1, "n": [0.02], "w": [0.3]}
    linear = UncertainModel.from_continuous(A, B, [[1.0, 0.0]], E=B, **common)
    nonlinear = NonlinearModel(
        lambda x, u, w: A @ x + B @ (u + w), lambda x: [x[0]], states=["s", "v"], inputs=["u"], disturbances=["w"],
        largest=([-9, -9], [9, 9]), **common,
    )  # fmt: skip
    return linear, nonlinear


CASES = {
    "cstr": cstr, "tank": tank, "pendulum": pendulum, "lorenz": lorenz, "three tanks": three_tanks, "servo": servo,
    "crane": crane, "friction": friction,
}  # fmt: skip

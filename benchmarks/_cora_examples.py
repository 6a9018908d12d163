"""Nonlinear examples of CORA's repository (TUMcps/CORA) whose results are printed in its unit tests, as models of ours.

Commit b7c1ffcc of unitTests/contDynamics and of models/Cora. The equations are those of CORA's files, also where a
factor k is left out (the second tank in discrete time).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from polytopes import HPolytope
from svo import NonlinearModel
from svo.checks import Array
from svo.functions import sqrt

Box = tuple[Array, Array]

ROOT = float(np.sqrt(2 * 9.81))
TANKS = [f"x{i}" for i in range(1, 7)]
LEVELS = np.array([2.0, 4.0, 4.0, 2.0, 10.0, 4.0])


@dataclass(frozen=True)
class Example:
    """A model, its first set, what is known of each sample, and the boxes that CORA prints of the last one."""

    source: str
    model: NonlinearModel
    first: Box
    inputs: Array
    readings: Array
    horizons: tuple[int, ...]
    printed: Mapping[str, Box] = field(default_factory=dict)

    @property
    def initial(self) -> HPolytope:
        return HPolytope.box(*self.first)


def _box(low: list[float], high: list[float]) -> Box:
    return np.array(low), np.array(high)


def _around(centre: Array, radius: float) -> Box:
    return centre - radius, centre + radius


def _unread(samples: int, outputs: int) -> Array:
    return np.full((samples, outputs), np.nan)


def observed_tanks() -> Example:
    """Six tanks in discrete time, three of them measured, over 20 samples: a guaranteed state estimation."""

    def f(x, u, w):
        s, h, k = [sqrt(level) for level in x], 0.5, 0.015
        return [
            x[0] + h * (u[0] - k * ROOT * s[0]) + w[0],
            x[1] + h * ROOT * (s[0] - s[1]) + w[1],
            x[2] + h * k * ROOT * (s[1] - s[2]) + w[2],
            x[3] + h * k * ROOT * (s[2] - s[3] + u[1]) + w[3],
            x[4] + h * k * ROOT * (s[3] - s[4] + u[2]) + w[4],
            x[5] + h * k * ROOT * (s[4] - s[5]) + w[5],
        ]

    model = NonlinearModel(
        f, lambda x: [x[1], x[3], x[4]], states=TANKS, inputs=["u1", "u2", "u3"], n=0.2,
        disturbances=[f"w{i}" for i in range(1, 7)], w=[0.001] * 6, Ts=0.5, physical=([0] * 6, [100] * 6),
        continuous=False,
    )  # fmt: skip
    rise = np.maximum(0.0, np.arange(20) - 2.0)
    inputs = 0.1 + rise[:, None] * [0.0025, 0.0025, 0.005]
    return Example(
        "nonlinearSysDT/test_nonlinearSysDT_observe_01_tank.m", model, _around(np.full(6, 20.0), 4.0), inputs,
        np.array(READINGS).T, (1, 5, 10, 19), FRAD,
    )  # fmt: skip


def _tanks(x, v, k):
    s = [sqrt(level) for level in x]
    return [v + 0.1 + 0.01 * (4.0 - x[5]) - k * ROOT * s[0], *(k * ROOT * (s[i] - s[i + 1]) for i in range(5))]


def _six_tanks(f, **more) -> NonlinearModel:
    return NonlinearModel(
        f, lambda x: x, states=TANKS, disturbances=["v"], w=[0.005], n=1.0, physical=([0] * 6, [100] * 6), **more
    )


def tanks_one_step() -> Example:
    """Six tanks with a disturbed inflow: one transition of 4 s."""
    model = _six_tanks(lambda x, w: _tanks(x, w[0], 0.015), Ts=4.0, varying="w")
    return Example(
        "nonlinearSys/test_nonlinearSys_initReach.m (commit 95d2473c)", model, _around(LEVELS, 0.2),
        np.empty((2, 0)), _unread(2, 6), (1,), {"linearised": ONE_STEP},
    )  # fmt: skip


def tanks_in_continuous_time() -> Example:
    """The same over 400 s, nothing measured."""
    return Example(
        "nonlinearSys/test_nonlinearSys_reach_01_tank.m", tanks_one_step().model, _around(LEVELS, 0.2),
        np.empty((101, 0)), _unread(101, 6), (5, 20), {"linearised, 396 to 400 s": TANKS_400},
    )  # fmt: skip


def tanks_of_uncertain_outflow() -> Example:
    """The same, the outflows' coefficient within 0.0148 .. 0.015."""
    model = _six_tanks(lambda x, w, p: _tanks(x, w[0], p[0]), Ts=4.0, varying="all", parameters={"k": (0.0148, 0.015)})
    return Example(
        "nonlinParamSys/testLong_nonlinParamSys_reach_01_tank.m", model, _around(LEVELS, 0.2), np.empty((101, 0)),
        _unread(101, 6), (5, 20), {"linearised, 399 to 400 s": UNCERTAIN_400},
    )  # fmt: skip


def tanks_in_discrete_time() -> Example:
    """Its Euler steps of 0.5 s, 200 of them, nothing measured."""

    def f(x, w):
        slope = _tanks(x, w[0], 0.015)
        slope[1] = ROOT * (sqrt(x[0]) - sqrt(x[1]))  # as in CORA's file
        return [level + 0.5 * change for level, change in zip(x, slope, strict=True)]

    model = _six_tanks(f, Ts=0.5, continuous=False)
    return Example(
        "nonlinearSysDT/test_nonlinearSysDT_reach_02_tank.m", model, _around(LEVELS, 0.2), np.empty((201, 0)),
        _unread(201, 6), (5, 200), {"linearised, order 450": TANKS_DISCRETE},
    )  # fmt: skip


def laub_loomis() -> Example:
    """Enzymes of Laub and Loomis from a large set, over 0.2 s, nothing measured."""

    def f(x):
        return [
            1.4 * x[2] - 0.9 * x[0], 2.5 * x[4] - 1.5 * x[1], 0.6 * x[6] - 0.8 * x[2] * x[1],
            2.0 - 1.3 * x[3] * x[2], 0.7 * x[0] - x[3] * x[4], 0.3 * x[0] - 3.1 * x[5], 1.8 * x[5] - 1.5 * x[6] * x[1],
        ]  # fmt: skip

    model = NonlinearModel(
        f, lambda x: x, states=[f"x{i}" for i in range(1, 8)], n=1.0, Ts=0.01, largest=([-20] * 7, [20] * 7)
    )
    centre = np.array([1.2, 1.05, 1.5, 2.4, 1.0, 0.1, 0.45])
    return Example(
        "nonlinearSys/test_nonlinearSys_reach_04_laubLoomis_polyZonotope.m", model, _around(centre, 0.3),
        np.empty((21, 0)), _unread(21, 7), (5, 20), {"polynomial zonotopes, 0.19 to 0.20 s": LAUB_LOOMIS},
    )  # fmt: skip


READINGS = (
    (18.587107801413037, 19.284508642234258, 19.804172917266072, 19.984844940204784, 20.278953550132702,
     20.483743290472002, 20.674406205375988, 20.564287471887262, 20.524616208625844, 20.390858909530351,
     20.579505841851283, 20.499347774002867, 20.334643962630423, 20.272233256206864, 20.167743326619661,
     20.169739624168546, 20.104461580569449, 20.060900527281170, 19.937554706454481, 19.834875810069285),
    (20.225990245627816, 20.158180661305583, 20.171464843998834, 20.327437617339143, 20.153618747112297,
     20.380068720276380, 20.376688700844845, 20.299247293957542, 20.243419253755508, 20.277306209637565,
     20.290071755637200, 20.468834597540557, 20.270783553258500, 20.223394465701581, 20.467148457713510,
     20.201977670029528, 20.431607252968249, 20.481135248015988, 20.487405103697650, 20.410091165821306),
    (19.112251238495777, 18.973762663726877, 18.948170824104380, 18.992192949983256, 19.001881958518979,
     19.150117548502443, 18.975701530881086, 19.088283489795671, 18.991871883700380, 19.066458349897363,
     18.943805866972866, 19.214278885933556, 18.957978956507624, 19.084269923675965, 19.183361721875762,
     19.081041506305120, 19.118244206333170, 19.284683679863136, 19.156503106336739, 19.215720898675404),
)  # fmt: skip

FRAD = {
    "FRad-A": _box([19.297672, 19.613997, 14.244668, 20.089269, 18.958192, 16.172626],
                   [19.787667, 20.103531, 30.168877, 20.722427, 19.378883, 23.713175]),
    "FRad-B": _box([19.271259, 19.591369, 14.205693, 20.098077, 18.958739, 16.152918],
                   [19.790097, 20.102908, 30.454331, 20.726856, 19.378999, 23.726816]),
    "FRad-C": _box([19.288282, 19.604910, 14.137555, 20.068370, 18.955200, 16.171583],
                   [19.803499, 20.118976, 30.181451, 20.740829, 19.377226, 23.713232]),
}  # fmt: skip
ONE_STEP = _box([1.805794, 3.643302, 3.794026, 1.951955, 9.340994, 4.092865],
                [2.228836, 4.057288, 4.196072, 2.345142, 9.763060, 4.486280])  # fmt: skip
TANKS_400 = _box([2.293963, 2.170961, 2.016037, 1.847641, 1.641650, 1.297064],
                 [3.837481, 3.673985, 3.433644, 3.191510, 3.061060, 3.247187])  # fmt: skip
UNCERTAIN_400 = _box([2.295156, 2.163466, 2.000171, 1.838296, 1.635708, 1.307034],
                     [3.892891, 3.730049, 3.490919, 3.237719, 3.102935, 3.276827])  # fmt: skip
TANKS_DISCRETE = _box([1.402908, 1.383723, 1.683900, 2.109824, 3.706387, 4.988413],
                      [1.956370, 1.975530, 2.295302, 2.670546, 4.311625, 5.486806])  # fmt: skip
LAUB_LOOMIS = _box([1.014907, 0.800824, 0.926007, 1.609688, 0.493165, -0.069671, 0.004173],
                   [1.699422, 1.510059, 1.682652, 2.418234, 1.102351, 0.292486, 0.709959])  # fmt: skip
"""CORA's boxes, rounded outward to six decimals."""

EXAMPLES: Mapping[str, Callable[[], Example]] = {
    "six tanks, three levels read": observed_tanks,
    "six tanks, one transition": tanks_one_step,
    "six tanks, 400 s": tanks_in_continuous_time,
    "six tanks, uncertain outflow, 400 s": tanks_of_uncertain_outflow,
    "six tanks in discrete time, 100 s": tanks_in_discrete_time,
    "Laub and Loomis, 0.2 s": laub_loomis,
}

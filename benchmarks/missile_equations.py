"""What the missile's own equations would leave out of a sample, proven, beside the measured bounds of its embedding.

The force equations need the angular rates inside a sample, so the moment equations and the attitude belong to them:
nine states. Each is linearised over what the sensors alone say (velocity, rates, attitude, height with their biases),
along a fault-free flight.
"""

from __future__ import annotations

from time import process_time
from typing import Any

import numpy as np

from aircraft.missile.airframe import INPUTS, Airframe
from aircraft.missile.imu import DELAY, NOISE_SETS
from aircraft.missile.models import OUTPUTS, SCHEDULING, read_bounds, schedule_of
from aircraft.missile.plant import FAULT_TIME, fault_of, missile
from aircraft.missile.scenarios import Flights
from benchmarks._observers import arguments, console, table
from polytopes import HPolytope
from svo import WindowObserver
from svo.functions import abs as size
from svo.functions import atan2, cos, exp, sin, sqrt
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel

NOISE, TS, SEED = "bounded", 0.01, 0
BEFORE, AFTER = 1.0, 3.0  # seconds of a flight around its fault
STATES = ("vbx", "vby", "vbz", "p", "q", "r", "phi", "theta", "z")
OF_FLIGHT = [3, 4, 5, 6, 7, 8, 9, 10, 2]  # these among the twelve states of the simulator
OF_SENSORS = [9, 10, 11, 3, 4, 5, 12, 13, 8]  # and among the fifteen measurements
ACCELERATIONS = [0, 1, 2]


def missile_model(airframe: Airframe) -> NonlinearModel:
    """Force and moment equations, attitude and height, of the simulator."""
    p = airframe

    def specific_force(x: Any, u: Any) -> tuple[Any, list[Any]]:
        alpha, beta = atan2(x[2], x[0]), atan2(x[1], x[0])
        pressure = 0.5 * p.density * (exp(x[8] / p.scale_height) * (x[0] ** 2 + x[1] ** 2 + x[2] ** 2))
        scale, thrust = p.reference_area / p.mass, (p.thrust_min + (p.thrust_max - p.thrust_min) * u[3]) / p.mass
        cx = p.cx_zero + p.cx_alpha_squared * alpha**2 + p.cx_dl * u[0]
        cx = cx + p.cx_dm * u[1] * (1.0 + alpha) + p.cx_dn * u[2] * (1.0 + beta)
        cy = (p.cy_beta + p.cy_beta_abs * size(beta)) * beta + p.cy_dl * u[0] + p.cy_dn * u[2]
        cz = (p.cz_alpha + p.cz_alpha_abs * size(alpha)) * alpha + p.cz_dm * u[1]
        return pressure, [thrust - scale * pressure * cx, scale * pressure * cy, -(scale * pressure * cz)]

    def f(x: Any, u: Any) -> list[Any]:
        vx, vy, vz, wp, wq, wr, phi, theta, _ = x
        pressure, (ax, ay, az) = specific_force(x, u)
        alpha, beta = atan2(vz, vx), atan2(vy, vx)
        damping = p.reference_length / sqrt(vx**2 + vy**2 + vz**2)
        torque = pressure * (p.reference_area * p.reference_length)
        roll = p.cl_beta * beta + p.cl_dl * u[0] + p.cl_dn * u[2] + p.cl_p * damping * wp
        pitch = (p.cm_alpha + p.cm_alpha_abs * size(alpha)) * alpha + p.cm_dm * u[1] + p.cm_q * damping * wq
        yaw = (p.cn_beta + p.cn_beta_abs * size(beta)) * beta + p.cn_dl * u[0] + p.cn_dn * u[2] + p.cn_r * damping * wr
        a, b = p.roll_inertia, p.pitch_inertia
        turn = sin(phi) * wq + cos(phi) * wr
        down = -sin(theta), cos(theta) * sin(phi), cos(theta) * cos(phi)
        return [
            ax + p.gravity * down[0] - (wq * vz - wr * vy),
            ay + p.gravity * down[1] - (wr * vx - wp * vz),
            az + p.gravity * down[2] - (wp * vy - wq * vx),
            torque * roll / a,
            (torque * pitch - (a - b) * wp * wr) / b,
            (torque * yaw - (b - a) * wp * wq) / b,
            wp + turn * (sin(theta) / cos(theta)),
            cos(phi) * wq - sin(phi) * wr,
            down[0] * vx + down[1] * vy + down[2] * vz,
        ]

    def h(x: Any, u: Any) -> list[Any]:
        return [*x, *specific_force(x, u)[1]]

    far = np.array([1500.0, 600.0, 600.0, 20.0, 20.0, 20.0, 3.0, 1.5, 20000.0])
    return NonlinearModel(f, h, states=STATES, inputs=INPUTS, Ts=TS, largest=(np.where(far == 1500, 50, -far), far))


def remainders(samples: int) -> None:
    """Print what is left out along a flight without a fault."""
    flight = Flights().run((), NOISE_SETS[NOISE], SEED).flight
    model, errors = missile_model(Airframe()), NOISE_SETS[NOISE]
    radius = (errors.bias + errors.noise_bound)[OF_SENSORS]
    move, read, begun = [], [], process_time()
    for k in np.linspace(2500, 4000, samples).astype(int):
        x, u = flight.x[k, OF_FLIGHT], flight.achieved[k]
        move.append(model.transition(x - radius, x + radius, u).R[:3])
        read.append(model.output(x - radius, x + radius, u).R[len(OF_SENSORS) :])
    cost = 1e6 * (process_time() - begun) / samples
    bounds = read_bounds()[NOISE]["nominal"]
    measured = TS * bounds.force + bounds.velocity, bounds.force + bounds.output
    rows = [
        [
            axis,
            *(f"{v[i]:.2g}" for of, known in zip((move, read), measured, strict=True) for v in (np.max(of, 0), known)),
        ]
        for i, axis in enumerate("xyz")
    ]
    columns = [f"{what}, {how}" for what in ("velocity (m/s)", "force (m/s^2)") for how in ("proven", "measured")]
    table("Left out of a sample, at most", ["axis", *columns], rows)
    console.print(f"{cost:.0f} us a sample of linearisation")


def delays(runs: int) -> None:
    """Print when the nominal observer of each kind detects the plant's faults."""
    plant, rows = missile(), []
    errors, model = NOISE_SETS[NOISE], missile_model(Airframe())
    part = slice(round((FAULT_TIME - BEFORE) / TS), round((FAULT_TIME + AFTER) / TS))
    then, first = slice(part.start - DELAY, part.stop - DELAY), round(BEFORE / TS) + DELAY
    for fault in plant.faults:
        found: dict[str, list[float]] = {"embedding": [], "equations": []}
        seconds, outside = dict.fromkeys(found, 0.0), 0
        for seed in range(runs):
            flight = plant.flights.run((fault_of(fault),), errors, seed, FAULT_TIME + AFTER).flight
            measured, columns = flight.y[part], [*OF_SENSORS, *ACCELERATIONS]
            n = errors.bound(np.abs(measured).max(axis=0))[columns]
            log = Log(plant.Ts * np.arange(len(measured)), flight.computed[then], measured[:, columns])
            start = HPolytope.box(log.y[0, :9] - n[:9], log.y[0, :9] + n[:9])
            observer = WindowObserver(model.replace(n=n), start, horizon=plant.horizon)
            linear = plant.bank(NOISE).observers["nominal"]
            inputs = np.hstack([log.u, measured[:, list(SCHEDULING)]])
            embedded = Log(log.time, inputs, measured[:, list(OUTPUTS)], schedule=schedule_of(measured))
            for name, watched, given in (("embedding", linear, embedded), ("equations", observer, log)):
                begun, at = process_time(), np.inf
                for k, step in enumerate(drive(watched, given)):
                    if step.verdict == "falsified":
                        at = k
                        break
                    lower, upper = (end[:3] for end in step.box)
                    v = flight.x[then][k, 3:6]
                    outside += name == "equations" and k < first and not ((lower <= v) & (v <= upper)).all()
                seconds[name] += (process_time() - begun) / (k + 1)
                found[name].append((at - first + 1) * TS if at >= first else np.nan)
        shown = [f"{np.median(found[name]):.3g}" for name in found] + [
            f"{1e6 * s / runs:.0f}" for s in seconds.values()
        ]
        rows.append([fault, *shown, int(outside)])
    columns = [f"{what}, {name}" for what in ("detect (s)", "us a sample") for name in ("embedding", "equations")]
    table(f"Nominal observers, {runs} flights each: medians", ["fault", *columns, "outside, equations"], rows)


def main(given: list[str] | None = None) -> None:
    """Remainders and delays of both kinds."""
    parser = arguments("missile_equations", __doc__, out=False)
    parser.add_argument("--samples", type=int, default=60, help="linearised, from 25 to 40 s of a flight")
    parser.add_argument("--runs", type=int, default=3, help="flights of each fault")
    options = parser.parse_args([] if given is None else given)
    remainders(options.samples)
    delays(options.runs)


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])

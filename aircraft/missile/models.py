"""The models of the missile's set-valued observers: the force equations as an embedding in the measurements.

With the state v_b, the velocity in body axes, equation (1) is linear once the incidences, the dynamic pressure, the
angular rate and the attitude are taken from the measurements (the schedule):

    v(k+1) = A v + Ts (h + G u + g_b + d) + e,   A = I - Ts W + Ts^2 W^2 / 2,   W v = omega x v
    INS velocity = v + noise,   accelerometers = h + G u + d + noise,

h being the part of f_aero / m without inputs, and g_b gravity in body axes. d (3) is what errors of the measurements
and of the coefficients make of the force, e (3) what errors of rate and attitude and the discretisation make of the
velocity. Both are bounded as measured (`aircraft.missile.mismatch`). d enters state and output alike.

Rates, height and attitude are inputs beside the computed ones: they act through the schedule only, and their columns
of B and D are zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aircraft import bounds_file
from aircraft.missile.airframe import INPUTS, Airframe
from aircraft.missile.imu import SensorErrors
from aircraft.missile.redundancy import ForceBalance
from svo.checks import Array, expect, sizes
from svo.models import UncertainModel

OUTPUTS = (9, 10, 11, 0, 1, 2)  # of the 15 measurements: velocity, acceleration
SCHEDULING = (3, 4, 5, 8, 12, 13)  # rates, z, phi, theta; the schedule of a sample is all twelve, in this order
N_INPUTS = len(INPUTS) + len(SCHEDULING)
NAMES = {
    "states": ("vbx", "vby", "vbz"),
    "inputs": (*INPUTS, "p", "q", "r", "z", "phi", "theta"),
    "outputs": ("vbx", "vby", "vbz", "abx", "aby", "abz"),
    "disturbances": ("force x", "force y", "force z", "mismatch vbx", "mismatch vby", "mismatch vbz"),
}
TYPICAL = np.array([600.0, 0.0, 20.0, 3.0, 0.0, -10.0, 0.0, 0.01, 0.0, -5000.0, 0.0, 0.07])


@dataclass(frozen=True)
class MismatchBounds:
    """Half-widths of what the embedding leaves out.

    Attributes
    ----------
    force : (3,) array
        Of the non-gravitational acceleration [m/s^2].
    velocity : (3,) array
        Of v(k+1), per sample [m/s].
    output : (3,) array
        Of the accelerometers' readings, from their scale factors [m/s^2].
    """

    force: Array
    velocity: Array
    output: Array

    def __post_init__(self) -> None:
        for name in ("force", "velocity", "output"):
            object.__setattr__(self, name, sizes(name, getattr(self, name), 3))


def read_bounds() -> Mapping[str, Mapping[str, MismatchBounds]]:
    """The measured bounds that ship with the package: noise set -> observer ("nominal" or a fault) -> bounds."""
    return bounds_file.read("aircraft.missile", MismatchBounds)


def schedule_of(y: Array) -> Array:
    """Schedules (K, 12) from measurements (K, 15)."""
    return y[:, [*OUTPUTS, *SCHEDULING]]


def measurement_of(schedule: ArrayLike) -> Array:
    """Measurements (K, 15) from schedules (K, 12); what the observers do not use is zero."""
    given = np.atleast_2d(np.asarray(schedule, dtype=float))
    y = np.zeros((len(given), 15))
    y[:, [*OUTPUTS, *SCHEDULING]] = given
    return y


class MeasuredSchedule:
    """The schedule from each sample's output and input; a missing sensor keeps its last value."""

    def __init__(self) -> None:
        self._last = np.full(len(OUTPUTS) + len(SCHEDULING), np.nan)

    def with_input(self, y: Array, u: Array) -> Array:
        """Schedule (12,) of a sample with output y (6,) and input u (10,)."""
        now = np.concatenate([y, u[len(INPUTS) :]])
        self._last = np.where(np.isnan(now), self._last, now)
        return self._last

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next samples depend on (`svo.plant.SavesSchedule`)."""
        return {"last": self._last}

    def load_state_dict(self, state: Mapping[str, Array]) -> None:
        """Go on from what `state_dict` gave."""
        self._last = np.array(state["last"])


@dataclass(frozen=True)
class Embedding:
    """The scheduled matrices that all observers share; the schedule of a sample is `schedule_of` its measurement.

    Parameters
    ----------
    airframe : Airframe
        What is believed of the missile.
    Ts : float
        Sampling time [s].
    """

    airframe: Airframe
    Ts: float
    _last: list[tuple[bytes, dict[str, Array]]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_last", [(b"", {})])

    def over(self, schedule: ArrayLike) -> dict[str, Array]:
        """A, h, G and gravity at many samples: (K, 3, 3), (K, 3), (K, 3, 4), (K, 3)."""
        y = measurement_of(schedule)
        balance = ForceBalance.of(y, self.airframe)
        # f = a - h by its definition, so that the readings cancel in h.
        h = y[:, :3] - balance.f
        W = np.zeros((len(y), 3, 3))
        p, q, r = y[:, 3:6].T
        W[:, 0, 1], W[:, 0, 2], W[:, 1, 2] = -r, q, -p
        W[:, 1, 0], W[:, 2, 0], W[:, 2, 1] = r, -q, p
        A = np.eye(3) - self.Ts * W + 0.5 * self.Ts**2 * W @ W
        phi, theta = y[:, 12], y[:, 13]  # the last row of equation (4), the inertial vertical in body axes
        down = np.column_stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
        return {"A": A, "h": h, "G": balance.G, "gravity": self.airframe.gravity * down}

    def blocks_over(self, schedule: ArrayLike) -> dict[str, Array]:
        """The model's blocks A, B, a, D and c at many samples, (K, ...) each, read-only.

        Those of the last schedule are kept: the blocks of a model, and the observers of a bank, ask for the same.
        """
        values = np.atleast_2d(np.asarray(schedule, dtype=float))
        key = values.tobytes()
        remembered, blocks = self._last[0]
        if key != remembered:
            blocks = self._blocks(values)
            self._last[0] = (key, blocks)  # one assignment: safe where observers run in threads
        return blocks

    def _blocks(self, schedule: Array) -> dict[str, Array]:
        fits = schedule.shape[1:] == TYPICAL.shape and np.isfinite(schedule).all()
        expect(fits, "schedule", schedule, f"{TYPICAL.size} finite measurements a sample")
        parts = self.over(schedule)
        D, c = np.zeros((len(schedule), len(OUTPUTS), N_INPUTS)), np.zeros((len(schedule), len(OUTPUTS)))
        D[:, 3:, : len(INPUTS)], c[:, 3:] = parts["G"], parts["h"]
        a = self.Ts * (parts["h"] + parts["gravity"])
        blocks = {"A": parts["A"], "B": self.Ts * D[:, 3:], "a": a, "D": D, "c": c}
        for block in blocks.values():
            block.setflags(write=False)
        return blocks

    def block(self, name: str) -> Block:
        """One block as a function of the schedule."""
        return Block(self, (name,))

    def model(self, errors: SensorErrors, mismatch: MismatchBounds, shared: bool = True) -> UncertainModel:
        """The model without faults, for one set of sensor errors and of mismatch bounds.

        ``shared`` is False where a method can't use that d enters velocity and accelerometers alike: the
        accelerometers' noise then has the width of d added instead.
        """
        C, F = np.zeros((len(OUTPUTS), 3)), np.zeros((len(OUTPUTS), 6))
        C[:3], F[3:, :3] = np.eye(3), np.eye(3)
        noise = (errors.bias + errors.noise_bound)[list(OUTPUTS)]
        noise[3:] += mismatch.output if shared else mismatch.output + mismatch.force
        return UncertainModel(
            self.block("A"),
            self.block("B"),
            C,
            E=np.hstack([self.Ts * np.eye(3), np.eye(3)]),
            D=self.block("D"),
            F=F if shared else None,
            a=self.block("a"),
            c=self.block("c"),
            w=np.concatenate([mismatch.force, mismatch.velocity]),
            n=noise,
            Ts=self.Ts,
            names=NAMES,
            schedule=TYPICAL,
        )


@dataclass(frozen=True)
class Block:
    """A function of blocks of the embedding, at one schedule or, by ``over``, at many.

    Parameters
    ----------
    embedding : Embedding
    names : tuple of str
        The blocks that it is a function of.
    change : function of arrays
        Of the blocks, alike with and without samples in front.
    """

    embedding: Embedding
    names: tuple[str, ...]
    change: Callable[..., Array] = np.asarray

    def __call__(self, schedule: Any) -> Array:
        blocks = self.embedding.blocks_over(schedule)
        return self.change(*(blocks[name][0] for name in self.names))

    def over(self, schedule: ArrayLike) -> Array:
        """At many schedules (K, 12): (K, ...)."""
        blocks = self.embedding.blocks_over(schedule)
        return self.change(*(blocks[name] for name in self.names))

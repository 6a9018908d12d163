"""Random plants in continuous time, seen at times of their own: the true state is known at any instant.

The truth is an exponential of each piece of time over which inputs, disturbances and uncertain scalars are constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from polytopes import HPolytope
from svo import Log, UncertainModel, Uncertainty

Array = NDArray[np.float64]
STATE, OUTPUT = ("A", "B", "a", "E"), ("C", "D", "c", "F")
PIECES = 4  # of an interval, between which what varies switches
INSIDE = 4  # points of a piece, at which the reach of the state is taken
SPREAD = 0.9  # of an interval, about its mean


@dataclass(frozen=True)
class EventCase:
    """A model, a log of a healthy plant with the truth in it, and a set of first states."""

    model: Any  # UncertainModel or NonlinearModel
    log: Log
    first: HPolytope


@dataclass(frozen=True)
class Signals:
    """Input, disturbance and uncertain scalars, constant for a while from ``time`` on, and the state there."""

    time: float
    u: Array
    w: Array
    delta: Array
    x: Array


def clocks(rng: np.random.Generator, ny: int, samples: int, Ts: float, rates: tuple[float, ...]) -> list[Array]:
    """Times at which each of ny sensors is read, and those at which the input changes; all the same in some runs."""
    steps = lambda mean: np.cumsum(mean * rng.uniform(1.0 - SPREAD, 1.0 + SPREAD, samples))  # noqa: E731
    if rng.random() < 0.3:
        return [steps(Ts)] * (ny + 1)
    return [steps(Ts * rng.choice(rates)) for _ in range(ny + 1)]


class EventPlant:
    """dx/dt = A x + B u + a + E w + Delta_i (...), y = C x + D u + c + F w + Delta_i (...) + noise."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, n, self.ny = rng, int(rng.integers(1, 4)), int(rng.integers(1, 4))
        self.n, self.nu, self.nw = n, int(rng.integers(1, 3)), int(rng.integers(0, 3))
        self.shapes = {"A": (n, n), "B": (n, self.nu), "a": (n,), "E": (n, self.nw)}
        self.shapes |= {"C": (self.ny, n), "D": (self.ny, self.nu), "c": (self.ny,), "F": (self.ny, self.nw)}
        nominal = {name: rng.normal(size=self.shapes[name]) * rng.choice([0.0, 1.0], p=[0.2, 0.8]) for name in "BaE"}
        nominal["A"] = rng.normal(size=(n, n)) * rng.choice([0.3, 2.0]) - rng.choice([0.5, 3.0]) * np.eye(n)
        nominal |= {"C": rng.normal(size=self.shapes["C"]), "c": rng.normal(size=self.ny)}
        nominal |= {name: rng.normal(size=self.shapes[name]) * rng.choice([0.0, 0.5]) for name in "DF"}
        self.parts = [nominal, *(self._item() for _ in range(int(rng.integers(0, 3))))]
        self.bounds = np.sort(rng.uniform(-0.5, 0.5, (len(self.parts) - 1, 2)), axis=1)
        self.w = rng.uniform(-0.5, 0.0, self.nw), rng.uniform(0.0, 0.5, self.nw)
        self.noise = rng.uniform(0.0, 0.1, self.ny)
        self.varying: tuple[str, ...] = (("all",), ("w",), (), ())[int(rng.integers(4))]
        self.corners = bool(rng.random() < 0.5)

    def _item(self) -> dict[str, Array]:
        """Of state or of output: one number in both is not read at times of its own."""
        rng, names = self.rng, STATE if self.rng.random() < 0.6 else OUTPUT
        chosen = [name for name in names if rng.random() < 0.5] or [names[0]]
        column, rows = rng.normal(size=self.shapes[names[0]][0]), {}
        if names is OUTPUT:  # one sensor's: with jitter they are read at times of their own
            column[np.arange(self.ny) != rng.integers(self.ny)] = 0.0
        for name in chosen:  # rank one, or any
            shape = self.shapes[name]
            of_rank_one = np.multiply.outer(column, rng.normal(size=shape[1:]))
            is_any = names is STATE and rng.random() < 0.3
            rows[name] = 0.3 * (rng.normal(size=shape) if is_any else of_rank_one)
        return rows

    def draw(self, low: Array, high: Array) -> Array:
        rng = self.rng
        return np.where(rng.random(low.size) < 0.5, low, high) if self.corners else rng.uniform(low, high)

    # -- the truth ---------------------------------------------------------------------------------

    def total(self, delta: Array, names: tuple[str, ...]) -> list[Array]:
        """Matrices at values of Delta."""
        found = []
        for name in names:
            zero = np.zeros(self.shapes[name])
            items = [d * part.get(name, zero) for d, part in zip(delta, self.parts[1:], strict=True)]
            found.append(self.parts[0].get(name, zero) + sum(items, zero))
        return found

    def state(self, at: Signals, time: float) -> Array:
        """The state at a time until which the signals stay as they are."""
        moved = expm(self._rates(at) * (time - at.time))
        return np.asarray(moved[: self.n, : self.n] @ at.x + moved[: self.n, self.n])

    def _rates(self, at: Signals) -> Array:
        """dx/dt = the first rows times (x, 1)."""
        A, B, a, E = self.total(at.delta, STATE)
        joint = np.zeros((self.n + 1, self.n + 1))
        joint[: self.n, : self.n], joint[: self.n, self.n] = A, B @ at.u + a + E @ at.w
        return joint

    def output(self, way: list[Signals], time: float) -> Array:
        """What the sensors would read without noise."""
        at = way[max(0, int(np.searchsorted([s.time for s in way], time, side="right")) - 1)]
        C, D, c, F = self.total(at.delta, OUTPUT)
        return np.asarray(C @ self.state(at, time) + D @ at.u + c + F @ at.w)

    def way(self, times: Array, inputs: Array) -> list[Signals]:
        """The signals of every piece of every interval, and those after the last one."""
        w_moves, delta_moves = bool({"all", "w"} & set(self.varying)), "all" in self.varying
        found, x = [], self.rng.uniform(-1.0, 1.0, self.n)
        for k, u in enumerate(inputs):
            end = times[k + 1] if k + 1 < len(times) else times[k] + 1.0
            w, delta = self.draw(*self.w), self.draw(*self.bounds.T)
            ends = np.linspace(times[k], end, PIECES + 1)
            for piece, time in enumerate(ends[:-1]):
                if piece and w_moves:
                    w = self.draw(*self.w)
                if piece and delta_moves:
                    delta = self.draw(*self.bounds.T)
                found.append(Signals(float(time), u, w, delta, x))
                x = self.state(found[-1], float(ends[piece + 1]))
        return found

    # -- what is observed --------------------------------------------------------------------------

    def case(self, samples: int, Ts: float, jitter: float = 0.0) -> EventCase:
        """A run whose sensors and inputs have clocks of their own, or are all read at once.

        Readings are taken up to ``jitter`` seconds before or after their stamps.
        """
        own = clocks(self.rng, self.ny, samples, Ts, (1.0, 2.0, 5.0))
        times = np.unique(np.concatenate(own))[:samples]
        reads = np.stack([np.isin(times, clock) for clock in own[: self.ny]], axis=1)
        changes = np.isin(times, own[-1])
        inputs = np.array([self.rng.normal(size=self.nu) for _ in times])
        for k in range(1, len(times)):
            inputs[k] = inputs[k] if changes[k] else inputs[k - 1]
        way = self.way(times, inputs)
        y = np.array([self._reading(way, float(t), jitter, now) for t, now in zip(times, reads, strict=True)])
        x = np.array([s.x for s in way[::PIECES]])
        first = HPolytope.box(x[0] - self.rng.uniform(0.0, 1.0, self.n), x[0] + self.rng.uniform(0.0, 1.0, self.n))
        log = Log(times, inputs, y, x=x)
        more = {"jitter": jitter} if jitter else {}
        return EventCase(self.model(Ts, self._reach(way), np.abs(inputs).max(axis=0), **more), log, first)

    def _reading(self, way: list[Signals], stamp: float, jitter: float, now: NDArray[np.bool_]) -> Array:
        """Each sensor that is read at a time of its own; NaN of the others."""
        off = self.draw(np.full(self.ny, -jitter), np.full(self.ny, jitter))
        noise, found = self.draw(-self.noise, self.noise), np.full(self.ny, np.nan)
        for i in np.flatnonzero(now).tolist():
            found[i] = self.output(way, max(stamp + float(off[i]), way[0].time))[i] + noise[i]
        return found

    def _reach(self, way: list[Signals]) -> Array:
        """Bounds of |x| at the ends of all pieces and inside, with some room."""
        joint, x = np.array([self._rates(at) for at in way[:-1]]), np.array([at.x for at in way])
        parts = np.array([b.time - a.time for a, b in pairwise(way)])[:, None, None] / INSIDE
        moved, found = expm(joint * parts), [np.abs(x).max(axis=0)]
        for _ in range(INSIDE):
            x[:-1] = np.einsum("kij,kj->ki", moved[:, : self.n, : self.n], x[:-1]) + moved[:, : self.n, self.n]
            found.append(np.abs(x).max(axis=0))
        return np.asarray(1.05 * np.max(found, axis=0))

    def model(self, Ts: float, reach: Array, inputs: Array, **more: Any) -> UncertainModel:
        nominal, *items = ({k: v for k, v in part.items() if v.any() or k in "AC"} for part in self.parts)
        uncertainties = [Uncertainty(**v, bounds=tuple(b)) for v, b in zip(items, self.bounds.tolist(), strict=True)]
        if self.nw and not {"E", "F"} & nominal.keys():
            nominal["E"] = np.zeros(self.shapes["E"])
        nominal.setdefault("B", np.zeros(self.shapes["B"]))
        return UncertainModel.from_continuous(
            **nominal, Ts=Ts, w=self.w if self.nw else None, n=self.noise, varying=self.varying,
            remainder={"states": reach, "inputs": inputs}, uncertainties=uncertainties, **more,
        )  # fmt: skip

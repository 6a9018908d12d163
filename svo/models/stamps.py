"""Readings whose time stamps are off: what they may differ by from those of their stamps, for linear plants.

A sensor with the stamp s is read at a time t with |t - s| <= J. With dx/dt = f, and d = x(t) - x(s),

    |d| <= int_0^J exp(M tau) dtau |f|,        M = |A| + sum max|Delta_i| |A_i|, |f| over what is known of x(s),
    |C d| <= J |C f|,                          |f| over all x that are so near,

whatever u, w and Delta do meanwhile within their bounds, before the stamp or after it. Where w enters the output, the
reading has that of its own time: its row then has no w, but its range.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array, sizes
from svo.models.discretisation import Plant, bounds_in
from svo.models.inside_sample import carried

_ROUNDED_UP = 1e-9  # relative: more than what sums of fewer than a million terms lose to rounding


def jitter_of(jitter: Any, ny: int) -> Array | None:
    """Bounds (ny,) of the errors of the sensors' stamps [s]; None where there is none.

    Raises
    ------
    TypeError, ValueError
        Unless it is a number >= 0, or one a sensor.
    """
    if jitter is None:
        return None
    found = sizes("jitter", np.full(ny, jitter) if np.ndim(jitter) == 0 else jitter, ny)
    return found if found.any() else None


@dataclass(frozen=True, eq=False)
class StampErrors:
    """What the stamps of a plant's sensors make of its readings.

    Attributes
    ----------
    plant : UncertainModel
        Its arrays, all constant, are those of continuous time.
    jitter : (ny,) array
    shift : (ny,) array
        What stands for w in the rows of such sensors: the middle of F w.
    """

    plant: Plant
    jitter: Array
    _stack: Array = field(init=False, repr=False)
    _delta: Array = field(init=False, repr=False)
    _w: tuple[Array, Array] = field(init=False, repr=False)
    _growth: dict[float, Array] = field(init=False, repr=False)
    shift: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        plant, put = self.plant, lambda name, value: object.__setattr__(self, name, value)
        for name in "CDcF":
            if any(callable(getattr(item, name)) for item in (plant, *plant.uncertainties)):
                raise ValueError(f"{name} is a function of the schedule, and jitter takes constant outputs")
        n = plant.n_states
        for i, item in enumerate(plant.uncertainties):
            rows = plant.stack(plant.schedule)[i + 1, n:].any(axis=1)
            if rows.sum() > 1 and self.jitter[rows].any():
                raise ValueError(
                    f"the uncertainty {item.name or f'Delta[{i}]'} is one number in {rows.sum()} outputs, which are "
                    "read at times of their own (jitter); expected one uncertainty an output"
                )
        stack, ends = plant.stack(plant.schedule), np.array([q.bounds for q in plant.uncertainties]).reshape(-1, 2)
        put("_stack", stack)
        put("_delta", np.abs(ends).max(axis=1, initial=0.0))
        lower, upper, _ = bounds_in(plant)
        put("_w", (lower, upper))
        put("shift", np.where(self.is_off, stack[0, n:, n + plant.n_inputs + 1 :] @ (0.5 * lower + 0.5 * upper), 0.0))
        rate = np.abs(stack[0, :n, :n]) + np.tensordot(self._delta, np.abs(stack[1:, :n, :n]), axes=1)
        put("_growth", {J: carried(rate, J) for J in np.unique(self.jitter).tolist()})

    @property
    def is_off(self) -> NDArray[np.bool_]:
        """Which sensors have stamps that may be off."""
        return self.jitter > 0.0

    def widening(self, x: tuple[Array, Array], u: tuple[Array, Array], now: Array) -> Array:
        """What is added to the noise of each output (ny,), whose row is that of `applied`.

        Parameters
        ----------
        x : bounds of the state at the stamp, (n,) each
        u : bounds of the input within the jitter of it, (nu,) each
        now : (nu,) array
            The input from the stamp on, which the rows have.
        """
        n, nu, plant = self.plant.n_states, self.plant.n_inputs, self.plant
        widening = np.zeros(plant.n_outputs)
        lower, upper = (np.concatenate([x[i], u[i], [1.0], self._w[i]]) for i in (0, 1))
        speed = self._largest(self._stack[:, :n], lower, upper)
        for i in np.flatnonzero(self.is_off).tolist():
            J, rows = float(self.jitter[i]), self._stack[:, n + i]
            away = np.concatenate([self._growth[J] @ speed, np.zeros(lower.size - n)])
            near = lower - away, upper + away
            slope = np.zeros((len(self._stack), 1, lower.size))
            slope[:, 0] = rows[0, :n] @ self._stack[:, :n]
            rate = self._largest(slope, *near)[0]
            rate += self._delta @ np.abs(rows[1:, :n]) @ self._largest(self._stack[:, :n], *near)
            through = np.abs(rows[0, n : n + nu]) + self._delta @ np.abs(rows[1:, n : n + nu])
            w, (least, most) = rows[:, n + nu + 1 :], self._w
            own = np.abs(w[0]) @ (0.5 * (most - least)) + self._delta @ np.abs(w[1:]) @ np.maximum(-least, most)
            change = np.maximum(np.abs(u[0] - now), np.abs(u[1] - now))
            rounding = np.abs(w[0]) @ np.maximum(np.abs(least), np.abs(most))
            widening[i] = (J * rate + through @ change + own) * (1.0 + _ROUNDED_UP) + 1e-15 * rounding
        return widening

    def applied(self, stack: Array, shift: Array) -> Array:
        """A stack whose rows of sensors with such stamps have no w any more; ``shift`` is that of its units."""
        n, nu = self.plant.n_states, self.plant.n_inputs
        off = n + np.flatnonzero(self.is_off)
        found = stack.copy()
        found[:, off, n + nu + 1 :] = 0.0
        found[0, n:, n + nu] += shift
        return found

    def after(self, model: Plant, rows: Array, x: tuple[Array, Array], u: Array) -> tuple[Array, Array]:
        """Bounds of the next state by the state rows (items, n, columns) of the discrete ``model``."""
        w = model.bounds(model.schedule)
        lower, upper = (np.concatenate([x[i], u, [1.0], w[i]]) for i in (0, 1))
        middle, most = 0.5 * lower + 0.5 * upper, np.maximum(np.abs(lower), np.abs(upper))
        ends = np.array([q.bounds for q in model.uncertainties]).reshape(-1, 2)
        delta = np.abs(ends).max(axis=1, initial=0.0)
        half = np.abs(rows[0]) @ (0.5 * (upper - lower)) + np.tensordot(delta, np.abs(rows[1:]) @ most, axes=1)
        half = half * (1.0 + _ROUNDED_UP) + 1e-14 * np.abs(rows[0]) @ most
        return rows[0] @ middle - half, rows[0] @ middle + half

    def _largest(self, rows: Array, lower: Array, upper: Array) -> Array:
        """Bounds of |rows (x, u, 1, w)| over a box, for rows (items, m, columns) of the plant and of each Delta."""
        middle, half = 0.5 * lower + 0.5 * upper, 0.5 * (upper - lower)
        most = np.maximum(np.abs(lower), np.abs(upper))
        found = np.abs(rows[0] @ middle) + np.abs(rows[0]) @ half
        found += np.tensordot(self._delta, np.abs(rows[1:]) @ most, axes=1)
        return np.asarray(found + 1e-14 * np.abs(rows[0]) @ most)

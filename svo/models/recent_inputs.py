"""The inputs of the last moments: what drove the plant while a reading with an uncertain stamp may have been taken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from svo.checks import Array

_PREFIX = "recent."  # of their names in saved states


@dataclass(frozen=True, eq=False)
class RecentInputs:
    """Inputs that may have been there when a reading was taken, and readings whose time may be yet to come.

    Readings are taken within ``reach`` seconds of their stamps; inputs change at theirs.

    Attributes
    ----------
    reach : float
    ages : (m,) array
        Seconds since each input ended.
    inputs : (m, nu) array
    since : (p,) array
        Seconds since each reading, all below its own jitter.
    left : (p,) array
        That jitter.
    lower, upper : (p, nu) arrays
        The inputs that the reading was taken for.
    """

    reach: float
    ages: Array
    inputs: Array
    since: Array
    left: Array
    lower: Array
    upper: Array

    @classmethod
    def none(cls, reach: float, nu: int) -> Self:
        """Before the first sample."""
        nothing, rows = np.zeros(0), np.zeros((0, nu))
        return cls(reach, nothing, rows, nothing, nothing, rows, rows)

    def moved(self, u: Array, dt: float) -> Self:
        """After a transition that u (nu,) drove for ``dt`` seconds."""
        ages, since = np.append(self.ages + dt, 0.0), self.since + dt
        near, open_ = ages <= self.reach, since < self.left
        inputs = np.vstack([self.inputs, u])[near]
        left, lower, upper = self.left[open_], self.lower[open_], self.upper[open_]
        return type(self)(self.reach, ages[near], inputs, since[open_], left, lower, upper)

    def around(self, u: Array, ahead: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """Bounds of the inputs about a sample from which on it is u (nu,), and soon within the bounds ``ahead``.

        Raises
        ------
        ValueError
            If it changes so soon after a reading that this may have been taken later.
        """
        beyond = ((u < self.lower) | (u > self.upper)).any(axis=1)
        if beyond.any():
            i = int(np.argmax(beyond))
            raise ValueError(
                f"the input changes {self.since[i]:.6g} s after a reading whose stamp is known to {self.left[i]:.6g} "
                "s, and it may have been taken later still; leave such a reading out (NaN), or say with u_range=... "
                "what the input may be by then, as run(log) does"
            )
        every = np.vstack([self.inputs, u, *(ahead or ())])
        return every.min(axis=0), every.max(axis=0)

    def read(self, jitter: float, u: tuple[Array, Array]) -> Self:
        """After a sample whose readings have stamps known to ``jitter`` seconds, about which the input was within u."""
        if jitter == 0.0:
            return self
        lower, upper = np.vstack([self.lower, u[0]]), np.vstack([self.upper, u[1]])
        since, left = np.append(self.since, 0.0), np.append(self.left, jitter)
        return type(self)(self.reach, self.ages, self.inputs, since, left, lower, upper)

    def state(self) -> dict[str, Array]:
        """As named arrays."""
        names = ("ages", "inputs", "since", "left", "lower", "upper")
        return {_PREFIX + name: getattr(self, name).copy() for name in names}

    @classmethod
    def of_state(cls, reach: float, nu: int, state: Mapping[str, Array]) -> Self:
        """What `state` gave; ValueError unless it is that of so many inputs."""
        m, p = len(np.atleast_1d(state[_PREFIX + "ages"])), len(np.atleast_1d(state[_PREFIX + "since"]))
        shapes = {"ages": (m,), "inputs": (m, nu), "since": (p,), "left": (p,), "lower": (p, nu), "upper": (p, nu)}
        found = {name: np.array(state[_PREFIX + name]) for name in shapes}
        for name, shape in shapes.items():
            if found[name].shape != shape or found[name].dtype != np.float64 or not np.isfinite(found[name]).all():
                raise ValueError(f"{_PREFIX}{name} has shape {found[name].shape}; expected finite numbers of {shape}")
        return cls(reach, **found)

"""What carries a nonlinear model through an observer of linear ones: its linearisation of a sample as the schedule."""

from __future__ import annotations

from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from svo.checks import Array
from svo.models.bounds import Bounds
from svo.models.model import UncertainModel
from svo.models.nonlinear.flow import Flow
from svo.models.nonlinear.output import LinearOutput
from svo.models.stack import Stack


class Linearisation(NamedTuple):
    """The matrices of a sample: its measurement, and the transition from it once that is known.

    Attributes
    ----------
    rows : (n + ny, n + nu + 1 + nw + n) array
        [[A, 0, a, E], [C, 0, c, F]], as they stand in a stack; the last n columns of E are the remainder of each state.
    n : (ny,) array
    nu : int
        What the inputs do is in a and c, so their columns are zero.
    """

    rows: Array
    n: Array
    nu: int

    @classmethod
    def of(cls, A: Array, a: Array, E: Array, C: Array, c: Array, F: Array, n: Array, nu: int) -> Linearisation:
        """From its blocks: (n, n), (n,), (n, nw + n), (ny, n), (ny,), (ny, nw + n) and (ny,) arrays."""
        parts = zip((A, a, E), (C, c, F), strict=True)
        first, constant, rest = (np.concatenate(pair) for pair in parts)
        return cls(np.hstack([first, np.zeros((len(first), nu)), constant[:, None], rest]), n, nu)

    @classmethod
    def empty(cls, n: int, nw: int, ny: int, nu: int) -> Linearisation:
        """Of a sample from which no transition is known, and of which nothing is measured."""
        rows = np.zeros((n + ny, 2 * n + nu + 1 + nw))
        rows[:n, :n].flat[:: n + 1] = 1.0
        return cls(rows, np.zeros(ny), nu)

    @classmethod
    def measured(cls, C: Array, c: Array, F: Array, n: Array, nu: int) -> Linearisation:
        """Of a sample of which only the measurement is known."""
        size = C.shape[1]
        return cls.of(np.eye(size), np.zeros(size), np.zeros((size, F.shape[1])), C, c, F, n, nu)

    @classmethod
    def before(cls, output: LinearOutput, noise: Array, nu: int) -> Linearisation:
        """Of a sample from which no transition is known yet."""
        F = np.hstack([output.F, np.zeros_like(output.C)])
        return cls.measured(output.C, output.c, F, (noise + output.R) * (1.0 + 2.0**-50), nu)

    def copy(self) -> Linearisation:
        """One that stays as it is."""
        return Linearisation(self.rows.copy(), self.n.copy(), self.nu)

    @property
    def stack(self) -> Array:
        """The rows as a stack, (1, n + ny, n + nu + 1 + nw + n)."""
        return self.rows[None]

    @property
    def _states(self) -> int:
        return len(self.rows) - len(self.n)

    @property
    def A(self) -> Array:
        return self.rows[: self._states, : self._states]

    @property
    def a(self) -> Array:
        return self.rows[: self._states, self._states + self.nu]

    @property
    def E(self) -> Array:
        return self.rows[: self._states, self._states + self.nu + 1 :]

    @property
    def C(self) -> Array:
        return self.rows[self._states :, : self._states]

    @property
    def c(self) -> Array:
        return self.rows[self._states :, self._states + self.nu]

    @property
    def F(self) -> Array:
        return self.rows[self._states :, self._states + self.nu + 1 :]


class _LinearisedStack(Stack):
    """A stack that a linearisation has ready."""

    def at(self, schedule: Any) -> Array:
        return schedule.stack


class _LinearisedBounds(Bounds):
    """Bounds of which only the noise is the linearisation's."""

    def at(self, schedule: Any) -> tuple[Array, Array, Array]:
        return self.lower, self.upper, schedule.n


def carrier_of(
    flow: Flow, nu: int, is_disturbed: bool, noise: Array, Ts: float, physical: Any, largest: Any
) -> UncertainModel:
    """A linear model scheduled by the `Linearisation` of each sample; its typical one has no zeros.

    Its B is zero: what the inputs do is in a, and a certificate keeps them only to be compared with a log.
    """
    n, ny, columns = flow.n, len(noise), len(flow.varying) + flow.n
    state, output = (np.ones((n, n)), np.ones(n), np.ones((n, columns))), (np.ones((ny, n)), np.ones(ny))
    typical = Linearisation.of(*state, *output, np.ones((ny, columns)), noise, nu)
    unit = np.ones(n)
    found = UncertainModel(
        attrgetter("A"), np.zeros((n, nu)), attrgetter("C"), a=attrgetter("a"), E=attrgetter("E"), c=attrgetter("c"),
        F=attrgetter("F") if is_disturbed else None,
        n=attrgetter("n"), w=(np.concatenate([flow.w.lower, -unit]), np.concatenate([flow.w.upper, unit])), Ts=Ts,
        physical=physical, largest=largest, schedule=typical,
    )  # fmt: skip
    stack, bounds = found._stack, found._bounds
    object.__setattr__(found, "_stack", _LinearisedStack(stack.layout, stack.constant, stack.scheduled))
    object.__setattr__(found, "_bounds", _LinearisedBounds(*bounds.edges, bounds.nw, bounds.ny))
    return found

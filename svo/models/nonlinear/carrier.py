"""What carries a nonlinear model through an observer of linear ones: its linearisation of a sample as the schedule."""

from __future__ import annotations

from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from svo.checks import Array
from svo.models.model import UncertainModel
from svo.models.nonlinear.flow import Flow
from svo.models.nonlinear.output import LinearOutput
from svo.models.nonlinear.transition import Transition


class Linearisation(NamedTuple):
    """The matrices of a sample: its measurement, and the transition from it once that is known.

    Attributes
    ----------
    A, a, E : (n, n), (n,), (n, nw + n) arrays
        The last n columns of E are the remainder of each state.
    C, c, F, n : (ny, n), (ny,), (ny, nw + n), (ny,) arrays
    """

    A: Array
    a: Array
    E: Array
    C: Array
    c: Array
    F: Array
    n: Array

    @classmethod
    def before(cls, reading: LinearOutput, noise: Array) -> Linearisation:
        """Of a sample from which no transition is known yet."""
        width = (noise + reading.R) * (1.0 + 4.0 * np.finfo(float).eps)
        return cls.measured(reading.C, reading.c, np.hstack([reading.F, np.zeros(reading.C.shape)]), width)

    @classmethod
    def measured(cls, C: Array, c: Array, F: Array, n: Array) -> Linearisation:
        """Of a sample of which only the measurement is known."""
        size = C.shape[1]
        return cls(np.eye(size), np.zeros(size), np.zeros((size, F.shape[1])), C, c, F, n)

    def moved(self, found: Transition) -> Linearisation:
        """The same sample with the transition from it."""
        return self._replace(A=found.A, a=found.a, E=np.hstack([found.E, np.diag(found.R)]))


def carrier_of(
    flow: Flow, nu: int, is_disturbed: bool, noise: Array, Ts: float, physical: Any, largest: Any
) -> UncertainModel:
    """A linear model scheduled by the `Linearisation` of each sample; its typical one has no zeros.

    Its B is zero: what the inputs do is in a, and a certificate keeps them only to be compared with a log.
    """
    n, ny, columns = flow.n, len(noise), len(flow.varying) + flow.n
    state, output = (np.ones((n, n)), np.ones(n), np.ones((n, columns))), (np.ones((ny, n)), np.ones(ny))
    typical = Linearisation(*state, *output, np.ones((ny, columns)), noise)
    unit = np.ones(n)
    return UncertainModel(
        attrgetter("A"), np.zeros((n, nu)), attrgetter("C"), a=attrgetter("a"), E=attrgetter("E"), c=attrgetter("c"),
        F=attrgetter("F") if is_disturbed else None,
        n=attrgetter("n"), w=(np.concatenate([flow.w.lower, -unit]), np.concatenate([flow.w.upper, unit])), Ts=Ts,
        physical=physical, largest=largest, schedule=typical,
    )  # fmt: skip

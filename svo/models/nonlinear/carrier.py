"""What carries a nonlinear model through an observer of linear ones: its linearisation of a sample as the schedule."""

from __future__ import annotations

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
        (ny, n), nw = reading.C.shape, reading.F.shape[1]
        width = (noise + reading.R) * (1.0 + 4.0 * np.finfo(float).eps)
        F = np.hstack([reading.F, np.zeros((ny, n))])
        return cls(np.eye(n), np.zeros(n), np.zeros((n, nw + n)), reading.C, reading.c, F, width)

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
        lambda at: at.A, np.zeros((n, nu)), lambda at: at.C, a=lambda at: at.a, E=lambda at: at.E, c=lambda at: at.c,
        F=(lambda at: at.F) if is_disturbed else None,
        n=lambda at: at.n, w=(np.concatenate([flow.w.lower, -unit]), np.concatenate([flow.w.upper, unit])), Ts=Ts,
        physical=physical, largest=largest, schedule=typical,
    )  # fmt: skip

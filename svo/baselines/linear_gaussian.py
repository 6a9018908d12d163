"""The linear Gaussian model that stands for an uncertain one: bounds become variances, uncertainties their middle."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from polytopes import HPolytope
from polytopes.shown import Shown
from svo.checks import Array, bounded_box
from svo.logs.log import Log
from svo.models import UncertainModel

VARIANCE_OF_BOUND = 1.0 / 3.0  # of a uniform variable on [-1, 1]


class Sample(NamedTuple):
    """x(k+1) = A x + f + noise of covariance Q;  y(k) = C x + g + noise of covariance R, at one sample."""

    A: Array
    f: Array
    Q: Array
    C: Array
    g: Array
    R: Array


@dataclass(frozen=True)
class GaussianSamples(Shown):
    """The model along a log of K samples: A (K, n, n), f (K, n), Q (K, n, n), C (K, ny, n), g (K, ny), R (K, ny, ny),
    and the measurements y (K, ny)."""

    A: Array
    f: Array
    Q: Array
    C: Array
    g: Array
    R: Array
    y: Array

    def __len__(self) -> int:
        return len(self.y)

    def arrays(self) -> tuple[Array, ...]:
        """All of them, in this order."""
        return tuple(getattr(self, f.name) for f in fields(self))


@dataclass(frozen=True)
class GaussianModel(Shown):
    """A linear (parameter-varying) model with Gaussian noise.

    Variances are those of uniform variables within the bounds of the uncertain model, disturbances have the mean
    in the middle of their bounds, and each uncertainty keeps to the middle of its interval.

    Parameters
    ----------
    model : UncertainModel
    initial : HPolytope
        Bounded set of the state at the first sample; its bounding box gives mean and variance there.

    Raises
    ------
    ValueError
        If disturbances enter the output (F, F_i), the initial set is unbounded or empty, or the first measurement is
        known beforehand without any uncertainty.
    """

    model: UncertainModel
    initial: HPolytope
    mean: Array = field(init=False, repr=False)
    covariance: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.model.n_disturbances and np.any(self._at(self.model.schedule, "F")):
            raise ValueError("model has disturbances in its output (F); expected them in the state equation only")
        lower, upper = bounded_box("initial", self.initial, self.model.n_states)
        object.__setattr__(self, "mean", (lower + upper) / 2)
        object.__setattr__(self, "covariance", np.diag(VARIANCE_OF_BOUND * ((upper - lower) / 2) ** 2))
        self._check_innovation()

    def _check_innovation(self) -> None:
        """Refuse a first measurement without a density: a noise-free sensor of a state that is known exactly."""
        first = self.sample(np.zeros(self.model.n_inputs), self.model.schedule)
        silent = np.flatnonzero(np.diag(first.C @ self.covariance @ first.C.T + first.R) <= 0)
        if silent.size:
            raise ValueError(
                f"n is zero for output {silent[0]}, and initial has no width in what it measures; expected noise in "
                "every output, or a first set that is not flat, for a filter weighs one against the other"
            )

    def sample(self, u: Array, schedule: Any) -> Sample:
        """The model at one sample, driven by u (nu,), at its value of the schedule or None."""
        bounds = tuple(bound[None] for bound in self.model.bounds(schedule))
        return Sample(*(part[0] for part in self._over(u[None], self.model.stack(schedule)[None], bounds)))

    def samples(self, log: Log) -> GaussianSamples:
        """The model along a log.

        Raises
        ------
        ValueError
            If the log has other channels than the model, or no schedule where the model needs one.
        """
        wanted = (self.model.n_inputs, self.model.n_outputs)
        if (log.u.shape[1], log.y.shape[1]) != wanted:
            raise ValueError(f"log has {log.u.shape[1]} inputs and {log.y.shape[1]} outputs; expected {wanted}")
        if log.schedule is None and self.model.is_scheduled:
            raise ValueError("log has no schedule; the model has arrays or bounds that are functions of it")
        schedule = np.zeros(len(log)) if log.schedule is None else log.schedule
        stacks, bounds = self.model.stack_over(schedule), self.model.bounds_over(schedule)
        return GaussianSamples(*self._over(log.u, stacks, bounds), log.y)

    def _over(self, u: Array, stacks: Array, bounds: tuple[Array, ...]) -> Sample:
        """All arrays of a `Sample` with K in front, from inputs (K, nu), stacks of the model and its bounds."""
        layout = self.model.layout
        middle = [sum(uncertainty.bounds) / 2 for uncertainty in self.model.uncertainties]
        total = np.einsum("i,kirc->krc", np.array([1.0, *middle]), stacks)
        lower, upper, noise = bounds
        state, output = total[:, : layout.n], total[:, layout.n :]
        known, constant = slice(layout.n, layout.n + layout.nu), layout.n + layout.nu
        E = total[(slice(None), *layout.block("E"))]
        spread = E * (VARIANCE_OF_BOUND * ((upper - lower) / 2) ** 2)[:, None]
        driven = np.einsum("kij,kj->ki", E, (lower + upper) / 2)
        return Sample(
            A=np.ascontiguousarray(state[:, :, : layout.n]),
            f=np.einsum("kij,kj->ki", state[:, :, known], u) + state[:, :, constant] + driven,
            Q=spread @ E.transpose(0, 2, 1),
            C=np.ascontiguousarray(output[:, :, : layout.n]),
            g=np.einsum("kij,kj->ki", output[:, :, known], u) + output[:, :, constant],
            R=VARIANCE_OF_BOUND * noise[:, :, None] ** 2 * np.eye(layout.ny),
        )

    def _at(self, schedule: Any, name: str) -> Array:
        return np.asarray(self.model.stack(schedule)[(slice(None), *self.model.layout.block(name))])


def fault_effect(nominal: GaussianSamples, faulty: GaussianSamples, x: Array) -> tuple[Array, Array]:
    """What ``faulty`` adds to ``nominal`` in the next state (K, n) and in the output (K, ny), at states x (K, n)."""
    state = np.einsum("kij,kj->ki", faulty.A - nominal.A, x) + faulty.f - nominal.f
    output = np.einsum("kij,kj->ki", faulty.C - nominal.C, x) + faulty.g - nominal.g
    return state, output

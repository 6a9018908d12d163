"""What a polytope observer answers, at a sample and over a log, and its proof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import Certificate, HPolytope
from svo.observers.data import directions_of
from svo.observers.step import VerdictName
from svo.observers.vertex_images import outer_support

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PolytopeCertificate:
    """Proof that explicit rows have no common point, checked in exact rational arithmetic.

    The proof is conditional: it takes ``before``, the set that was computed in floats from all earlier samples
    (rounded outward), as given, and the measurement rows as they were widened.

    Attributes
    ----------
    sample : int
    before : tuple of HPolytope
        Sets that hold before the measurement of the sample.
    measurement : HPolytope
        Its rows.
    multipliers : Certificate
        For the rows of all of these, in this order.
    """

    sample: int
    before: tuple[HPolytope, ...]
    measurement: HPolytope
    multipliers: Certificate

    def verify(self) -> bool:
        """Whether the multipliers prove that the sets and the measurement exclude each other."""
        return self.multipliers.verify(intersection([*self.before, self.measurement]))


@dataclass(frozen=True)
class PublishedCertificate:
    """Proof that every vertex stack of equation (3) is empty: no proof against the model, where A is uncertain."""

    sample: int
    stacks: tuple[PolytopeCertificate, ...]

    def verify(self) -> bool:
        """Whether each stack is proved empty."""
        return bool(self.stacks) and all(stack.verify() for stack in self.stacks)


AnyCertificate = PolytopeCertificate | PublishedCertificate


@dataclass(frozen=True, slots=True)
class PolytopeStep:
    """Answer of a `PolytopeObserver` at one sample; see `svo.observers.step.Step`.

    Attributes
    ----------
    sample : int
    verdict : {"consistent", "falsified", "undecided"}
    certificate : PolytopeCertificate, PublishedCertificate or None
    seconds : float
    joint : HPolytope
        Contains the state at this sample and, behind it, the disturbance w of the same sample where the output
        depends on w.
    n : int
        Number of states.
    """

    sample: int
    verdict: VerdictName
    certificate: AnyCertificate | None
    seconds: float
    joint: HPolytope
    n: int

    @property
    def set(self) -> HPolytope:
        """Contains the state at this sample; empty once the model is falsified."""
        if self.verdict == "falsified":
            return HPolytope.empty(self.n)
        return self.joint if self.joint.dim == self.n else self.joint.project(range(self.n))

    @property
    def box(self) -> tuple[Array, Array]:
        """Bounds (lower, upper), each (n,), of the state at this sample; NaN once the model is falsified."""
        if self.verdict == "falsified":
            return np.full(self.n, np.nan), np.full(self.n, np.nan)
        axes = np.eye(self.n, self.joint.dim)
        ends = outer_support(self.joint, np.vstack([axes, -axes]))
        return -ends[self.n :], ends[: self.n]

    def support(self, directions: ArrayLike) -> Array:
        """Outer bounds of d'x over the states at this sample, in any directions.

        Parameters
        ----------
        directions : (k, n) array

        Returns
        -------
        (k,) array
            -inf once the model is falsified.
        """
        rows = directions_of(directions, self.n)
        if self.verdict == "falsified":
            return np.full(len(rows), -np.inf)
        return outer_support(self.joint, np.hstack([rows, np.zeros((len(rows), self.joint.dim - self.n))]))


@dataclass(frozen=True)
class PolytopeRecord:
    """A log seen by one observer: verdicts, boxes (K, n), facets (K,), seconds (K,), certificate if falsified."""

    verdicts: tuple[VerdictName, ...]
    lower: Array
    upper: Array
    facets: NDArray[np.int64]
    seconds: Array
    certificate: AnyCertificate | None


def intersection(sets: list[HPolytope]) -> HPolytope:
    """Points in all sets: the rows of all, in order."""
    total = sets[0]
    for P in sets[1:]:
        total = total.intersection(P)
    return total

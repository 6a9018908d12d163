"""What a constrained-zonotope observer answers, at a sample and over a log."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from svo.observers.constrained_zonotope import ConstrainedZonotope
from svo.observers.data import directions_of
from svo.observers.step import VerdictName
from svo.observers.zonotope_program import ZonotopeProgram
from svo.observers.zonotope_proof import ZonotopeCertificate
from svo.state_range import StateRange

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ZonotopeStep:
    """Answer of a `ConstrainedZonotopeObserver` at one sample; see `svo.observers.step.Step`.

    Attributes
    ----------
    sample : int
    verdict : {"consistent", "falsified", "undecided"}
    certificate : ZonotopeCertificate or None
    seconds : float
    joint : ConstrainedZonotope or None
        Contains the state at this sample and, behind it, w and the channels where the output depends on them. None
        while the set is outgrown.
    n : int
        Number of states.
    reason : str or None
    physical : StateRange or None
        The range that the model promises; box, set and support are cut to it.
    """

    sample: int
    verdict: VerdictName
    certificate: ZonotopeCertificate | None
    seconds: float
    joint: ConstrainedZonotope | None
    n: int
    reason: str | None = None
    physical: StateRange | None = None
    _bounds: list[tuple[Array, Array]] = field(default_factory=list, repr=False)

    @property
    def box(self) -> tuple[Array, Array]:
        """Outer bounds (lower, upper), each (n,), of the state at this sample; NaN once the model is falsified."""
        if self.verdict == "falsified":
            return np.full(self.n, np.nan), np.full(self.n, np.nan)
        if not self._bounds:
            axes = np.eye(self.n)
            ends = self._support(np.vstack([axes, -axes]))
            lower, upper = -ends[self.n :], ends[: self.n]
            if self.physical is not None:
                lower, upper, _ = self.physical.cut(lower, upper)
            self._bounds.append((lower, upper))
        lower, upper = self._bounds[0]
        return lower.copy(), upper.copy()

    @property
    def set(self) -> HPolytope:
        """The box of the state as a polytope; empty once the model is falsified. See `joint` for the whole set."""
        if self.verdict == "falsified":
            return HPolytope.empty(self.n)
        lower, upper = self.box
        bounds = np.concatenate([upper, -lower])
        known = np.isfinite(bounds)
        return HPolytope(np.vstack([np.eye(self.n), -np.eye(self.n)])[known], bounds[known])

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
        values = self._support(rows)
        return values if self.physical is None else np.minimum(values, self.physical.support(rows))

    def _support(self, rows: Array) -> Array:
        if self.joint is None:
            return np.full(len(rows), np.inf)
        wide = np.hstack([rows, np.zeros((len(rows), self.joint.dim - self.n))])
        return ZonotopeProgram(self.joint).support(wide)


@dataclass(frozen=True, eq=False)
class ZonotopeRecord:
    """A log seen by one observer: verdicts, boxes (K, n) and seconds (K,), and the certificate if it was falsified."""

    verdicts: tuple[VerdictName, ...]
    lower: Array
    upper: Array
    seconds: Array
    certificate: ZonotopeCertificate | None

"""What a constrained-zonotope observer answers, at a sample and over a log."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array
from svo.models.normal_form import NormalForm
from svo.observers.base import VerdictName
from svo.observers.data import directions_of
from svo.observers.given_units import zonotope_out
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.zonotope import ConstrainedZonotope


@dataclass(frozen=True, slots=True)
class ZonotopeStep:
    """Answer of a `ConstrainedZonotopeObserver` at one sample; see `svo.observers.base.Step`.

    Attributes
    ----------
    sample : int
    verdict : {"consistent", "falsified", "undecided"}
    certificate : ZonotopeCertificate or None
    seconds : float
    reason : str or None
        Why the verdict is "undecided", where that is known; see `svo.observers.base.Step`.

    Box, set and support are cut to the range of states that the model promises.
    """

    sample: int
    verdict: VerdictName
    certificate: ZonotopeCertificate | None
    seconds: float
    _joint: ConstrainedZonotope | None
    _form: NormalForm
    reason: str | None = None
    _bounds: list[tuple[Array, Array]] = field(default_factory=list, repr=False)

    @property
    def n(self) -> int:
        """Number of states."""
        return self._form.given.n_states

    @property
    def joint(self) -> ConstrainedZonotope | None:
        """Contains the state at this sample and, behind it, w and the channels where the output depends on them.

        None while the set is outgrown.
        """
        if self._joint is None:
            return None
        unit = np.concatenate([self._form.x, self._form.w, np.ones(self._joint.dim)])[: self._joint.dim]
        return zonotope_out(self._joint, unit)

    @property
    def box(self) -> tuple[Array, Array]:
        """Outer bounds (lower, upper), each (n,), of the state at this sample; NaN once the model is falsified."""
        if self.verdict == "falsified":
            return np.full(self.n, np.nan), np.full(self.n, np.nan)
        if not self._bounds:
            axes = np.eye(self.n)
            ends = self._support(np.vstack([axes, -axes]))
            lower, upper = -ends[self.n :], ends[: self.n]
            physical = self._form.given.physical_range
            if physical is not None:
                lower, upper, _ = physical.cut(lower, upper)
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
        values, physical = self._support(rows), self._form.given.physical_range
        return values if physical is None else np.minimum(values, physical.support(rows))

    def _support(self, rows: Array) -> Array:
        if self._joint is None:
            return np.full(len(rows), np.inf)
        wide = np.hstack([rows * self._form.x, np.zeros((len(rows), self._joint.dim - self.n))])
        return ZonotopeProgram(self._joint).support(wide)


@dataclass(frozen=True, eq=False)
class ZonotopeRecord:
    """A log seen by one observer: verdicts, boxes (K, n) and seconds (K,), and the certificate if it was falsified."""

    verdicts: tuple[VerdictName, ...]
    lower: Array
    upper: Array
    seconds: Array
    certificate: ZonotopeCertificate | None

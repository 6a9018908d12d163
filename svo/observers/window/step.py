"""What a window observer answers: at a sample, and over a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.checks import Array
from svo.observers.base import VerdictName
from svo.observers.data import directions_of
from svo.observers.window.evidence import WindowCertificate
from svo.observers.window.sign_split import SplitCertificate


class _Window(Protocol):
    """What an answer asks of the observer that gave it."""

    model: Any

    @property
    def directions(self) -> Array: ...

    def _bounds_at(self, sample: int) -> tuple[Array, Array]: ...

    def _support_at(self, sample: int, directions: Array) -> Array: ...


@dataclass(frozen=True, slots=True)
class WindowStep:
    """Answer of a `WindowObserver` at one sample; see `svo.observers.base.Step`.

    `box` and `set` are computed when they are read, which must be before the observer's next sample.
    """

    observer: _Window
    sample: int
    verdict: VerdictName
    certificate: WindowCertificate | SplitCertificate | None
    seconds: float
    reason: str | None = None

    @property
    def box(self) -> tuple[Array, Array]:
        """Outer bounds (lower, upper), each (n,), of the state at this sample; NaN once the model is falsified."""
        lower, upper = self.observer._bounds_at(self.sample)
        n = self.observer.model.n_states
        return lower[:n], upper[:n]

    @property
    def set(self) -> HPolytope:
        """Outer polytope of the state in the template's directions; empty once the model is falsified."""
        lower, upper = self.observer._bounds_at(self.sample)
        rows = self.observer.directions
        if np.isnan(lower).any():
            return HPolytope.empty(rows.shape[1])
        bounds = np.concatenate([upper, -lower])
        known = np.isfinite(bounds)
        return HPolytope(np.vstack([rows, -rows])[known], bounds[known])

    def support(self, directions: ArrayLike) -> Array:
        """Outer bounds of d'x over the states that the window allows, in any directions.

        Parameters
        ----------
        directions : (k, n) array

        Returns
        -------
        (k,) array
            -inf once the model is falsified.
        """
        rows = directions_of(directions, self.observer.model.n_states)
        return self.observer._support_at(self.sample, rows)


@dataclass(frozen=True, eq=False)
class WindowRecord:
    """A log seen by one observer: verdicts, boxes (K, n) and seconds (K,), and the certificate if it was falsified."""

    verdicts: tuple[VerdictName, ...]
    lower: Array
    upper: Array
    seconds: Array
    certificate: WindowCertificate | SplitCertificate | None

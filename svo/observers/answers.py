"""What an observer answers: at a sample, and over a log."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.shown import Picture, Shown, in_a_line
from svo.checks import Array
from svo.observers.certificate import Certificate
from svo.observers.data import directions_of
from svo.pictures.sets import picture_of_sets

OUT_OF_TIME, NO_PROOF = "out of time", "no proof"  # why a verdict is "undecided"

VerdictName = Literal["consistent", "falsified", "undecided"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Step(Shown, ABC):
    """The answer of an observer at one sample; a frozen dataclass.

    A kind of its own defines `n` and `_box`, and `_set` or `_support` where it knows more than a box.

    Attributes
    ----------
    verdict : {"consistent", "falsified", "undecided"}
        "falsified" only with a certificate that has been checked in exact arithmetic.
    certificate : Certificate or None
        Proof of the falsification.
    reason : str or None
        Why a verdict is "undecided"; observers of the library always say so. "outgrown": the set has grown beyond all
        bounds of use in a gap of the measurements, and what came back does not yet bound the state. "outside the
        physical range": of all that the data allow, without a proof. "a reading is too large": for a polytope, which
        then goes on without it. "outside: at sample ...": a nonlinear model is not linearised there, for the cause that
        follows; its set starts again from ``largest``. "out of time": the deadline ended the programs. "no proof": they
        found neither a state that explains the data nor a proof that there is none.
    sample : int
        Counted from the first measurement, which is 0; the observer fills it in. After a falsification it is that of
        the falsification until the observer is reset.
    seconds : float
        Wall time of the call; the observer fills it in.
    stopped : int
        Programs of this answer that ended at a limit, as `Observer.stopped`; the observer fills it in.
    """

    verdict: VerdictName
    certificate: Certificate | None = None
    reason: str | None = None
    sample: int = 0
    seconds: float = 0.0
    stopped: int = 0

    @property
    @abstractmethod
    def n(self) -> int:
        """Number of states."""

    def __repr__(self) -> str:
        why = f", {self.reason}" if self.reason else ""
        return in_a_line(f"<{type(self).__name__} at sample {self.sample}: {self.verdict}{why}>")

    def _picture(self) -> Picture | None:
        if self.verdict == "falsified":
            return None if self.certificate is None else self.certificate._picture()
        return picture_of_sets({"set": self.set}, ["set"], [f"x[{i}]" for i in range(self.n)][:2])

    @property
    def box(self) -> tuple[Array, Array]:
        """Outer bounds (lower, upper), each (n,), of the state at this sample.

        Infinite while the set is outgrown, NaN once the model is falsified.
        """
        if self.verdict == "falsified":
            return np.full(self.n, np.nan), np.full(self.n, np.nan)
        return self._box()

    @property
    def set(self) -> HPolytope:
        """Contains the state at this sample; empty once the model is falsified."""
        return HPolytope.empty(self.n) if self.verdict == "falsified" else self._set()

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
        return np.full(len(rows), -np.inf) if self.verdict == "falsified" else self._support(rows)

    @abstractmethod
    def _box(self) -> tuple[Array, Array]:
        """As `box`, of a model that is not falsified."""

    def _set(self) -> HPolytope:
        """As `set`, of a model that is not falsified; the box, unless a kind knows better."""
        return between(np.eye(self.n), *self._box())

    def _support(self, rows: Array) -> Array:
        """As `support`, of a model that is not falsified; that of `_set`, unless a kind knows better."""
        return np.asarray(self._set().support(rows), dtype=np.float64)


def between(rows: Array, lower: Array, upper: Array) -> HPolytope:
    """{x : lower <= rows x <= upper}, without the bounds that are infinite."""
    bounds = np.concatenate([upper, -lower])
    known = np.isfinite(bounds)
    return HPolytope(np.vstack([rows, -rows])[known], bounds[known])


class Seen(NamedTuple):
    """Samples of a log that an observer has just seen: one, or many at once that are all consistent.

    Attributes
    ----------
    samples : int
    step : Step
        The answer at the last of them; its ``seconds`` are those of each, on average.
    """

    samples: int
    step: Step

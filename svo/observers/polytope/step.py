"""What a polytope observer answers, at a sample and over a log, and its proof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import Certificate, HPolytope
from polytopes.exact import ZERO, rational
from svo.checks import Array
from svo.models.normal_form import NormalForm, set_in
from svo.observers.base import VerdictName
from svo.observers.data import directions_of
from svo.observers.polytope.vertex_images import outer_support
from svo.observers.readings import OUTGROWN


@dataclass(frozen=True, eq=False)
class MeasuredOutput:
    """Model and data of the sample whose measurement rows stand in a certificate.

    Attributes
    ----------
    stack : (1 + nd, n + ny, n + nu + 1 + nw) array
        [[A B a E], [C D c F]] and the same of each uncertainty.
    u, y, noise : (nu,), (ny,), (ny,) arrays
        NaN in y = that sensor is missing.
    """

    stack: Array
    u: Array
    y: Array
    noise: Array

    def explains(self, rows: HPolytope) -> bool | None:
        """Whether rows over x, or (x, w), follow from |y - C x - D u - c - F w| <= noise, checked exactly.

        None where an uncertainty enters the output: its rows rest on bounds of s that were computed in floats.
        """
        ny = self.y.size
        if self.stack.ndim != 3 or self.noise.shape != (ny,) or self.u.ndim != 1 or len(rows.C):
            return False
        if not all(np.isfinite(v).all() for v in (self.stack, self.u, self.noise, rows.b)) or np.isinf(self.y).any():
            return False
        n, nu = self.stack.shape[1] - ny, self.u.size
        if n < 1 or self.stack.shape[2] < n + nu + 1 or not (self.noise >= 0).all():
            return False
        if self.stack[1:, n:].any():
            return None
        outputs = self.stack[0, n:]
        free = np.delete(outputs, np.s_[n : n + nu + 1], axis=1)
        if rows.dim == n and not free[:, n:].any():
            free = free[:, :n]
        used = np.flatnonzero(~np.isnan(self.y))
        if rows.A.shape != (2 * used.size, free.shape[1]):
            return False
        for i, o in enumerate(used):
            known = sum((rational(c) * rational(v) for c, v in zip(outputs[o, n : n + nu], self.u, strict=True)), ZERO)
            middle, noise = rational(self.y[o]) - known - rational(outputs[o, n + nu]), rational(self.noise[o])
            for sign, row, bound in zip((1, -1), rows.A[2 * i : 2 * i + 2], rows.b[2 * i : 2 * i + 2], strict=True):
                if not np.array_equal(row, sign * free[o]) or rational(bound) < sign * middle + noise:
                    return False
        return True


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
    data : MeasuredOutput or None
        What the measurement rows come from; None in a stack of equation (3), whose rows are not a measurement's only.
    largest_at : int or None
        Sample at which the observer's set started again from the model's largest set, a premise of ``before``.
    """

    sample: int
    before: tuple[HPolytope, ...]
    measurement: HPolytope
    multipliers: Certificate
    data: MeasuredOutput | None = None
    largest_at: int | None = None

    def verify(self) -> bool:
        """Whether the multipliers prove that sets and measurement exclude each other, and the data give its rows."""
        if self.data is not None and self.data.explains(self.measurement) is False:
            return False
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
    """Answer of a `PolytopeObserver` at one sample; see `svo.observers.base.Step`.

    Attributes
    ----------
    sample : int
    verdict : {"consistent", "falsified", "undecided"}
    certificate : PolytopeCertificate, PublishedCertificate or None
    seconds : float
    reason : str or None
        Why the verdict is "undecided", where that is known; see `svo.observers.base.Step`.
    """

    sample: int
    verdict: VerdictName
    certificate: AnyCertificate | None
    seconds: float
    _joint: HPolytope
    _form: NormalForm
    reason: str | None = None

    @property
    def n(self) -> int:
        """Number of states."""
        return self._form.given.n_states

    @property
    def joint(self) -> HPolytope:
        """Contains the state at this sample and, behind it, w of the same sample where the output depends on it."""
        return set_in(self._joint, 1.0 / np.concatenate([self._form.x, self._form.w])[: self._joint.dim])

    @property
    def set(self) -> HPolytope:
        """Contains the state at this sample; empty once the model is falsified."""
        if self.verdict == "falsified":
            return HPolytope.empty(self.n)
        states = self._joint if self._joint.dim == self.n else self._joint.project(range(self.n))
        return set_in(states, 1.0 / self._form.x)

    @property
    def box(self) -> tuple[Array, Array]:
        """Bounds (lower, upper), each (n,), of the state at this sample; NaN once the model is falsified."""
        if self.verdict == "falsified":
            return np.full(self.n, np.nan), np.full(self.n, np.nan)
        unit = self._form.x
        if self.reason == OUTGROWN:
            lower, upper = self._joint.bounding_box()
            return lower * unit, upper * unit
        axes = np.eye(self.n, self._joint.dim)
        ends = outer_support(self._joint, np.vstack([axes, -axes]))
        return -ends[self.n :] * unit, ends[: self.n] * unit

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
        normal = rows * self._form.x
        if self.reason == OUTGROWN:
            return np.asarray(self._joint.support(normal), dtype=np.float64)
        return outer_support(self._joint, np.hstack([normal, np.zeros((len(rows), self._joint.dim - self.n))]))


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

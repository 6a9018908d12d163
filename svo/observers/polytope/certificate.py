"""Why sets of a polytope observer and a measurement exclude each other, in exact rational arithmetic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from polytopes import Certificate as Multipliers
from polytopes import HPolytope
from polytopes.exact import ZERO, rational
from polytopes.shown import Picture
from svo.checks import Array
from svo.observers.certificate import Certificate, started_again


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
        if self.stack.ndim != 3 or not self.y.shape == self.noise.shape == (ny,) or self.u.ndim != 1 or len(rows.C):
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
class PolytopeCertificate(Certificate):
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
    multipliers : polytopes.Certificate
        For the rows of all of these, in this order.
    data : MeasuredOutput or None
        What the measurement rows come from; None in a stack of equation (3), whose rows are not a measurement's only.
    largest_at : int or None
        Sample at which the observer's set started again from the model's largest set, a premise of ``before``.
    """

    kind = "polytope"

    sample: int
    before: tuple[HPolytope, ...]
    measurement: HPolytope
    multipliers: Multipliers
    data: MeasuredOutput | None = None
    largest_at: int | None = None

    def verify(self) -> bool:
        """Whether the multipliers prove that sets and measurement exclude each other, and the data give its rows."""
        if self.data is not None and self.data.explains(self.measurement) is False:
            return False
        return self.multipliers.verify(intersection([*self.before, self.measurement]))

    @property
    def samples(self) -> tuple[MeasuredOutput, ...]:
        """The measured sample."""
        return () if self.data is None else (self.data,)

    def premise(self, sample: int) -> str:
        explained = self.data is None or self.data.explains(self.measurement)
        rows = "" if explained else ", and the bounds of the uncertain output"
        return f"the set before the measurement{rows}" + started_again(self.largest_at, self.sample, sample)

    def _picture(self) -> Picture:
        return self.multipliers._picture()

    def to_dict(self) -> dict[str, Any]:
        if self.data is None:
            raise TypeError("certificate is that of a vertex stack of equation (3), which proves nothing of the model")
        return super().to_dict()

    @classmethod
    def from_dict(cls, record: Any) -> Self:
        certificate = super().from_dict(record)
        if certificate.data is None:
            raise ValueError("data are missing: nothing says where the measurement's rows come from")
        return certificate


@dataclass(frozen=True)
class PublishedCertificate(Certificate):
    """Proof that every vertex stack of equation (3) is empty: no proof against the model, where A is uncertain."""

    kind = "polytope, as published"
    samples = ()

    sample: int
    stacks: tuple[PolytopeCertificate, ...]

    def verify(self) -> bool:
        """Whether each stack is proved empty."""
        return bool(self.stacks) and all(stack.verify() for stack in self.stacks)

    def premise(self, sample: int) -> str:
        return "equation (3) as published, which does not hold where A is uncertain"

    def to_dict(self) -> dict[str, Any]:
        raise TypeError("certificate is that of equation (3) as published, which no alarm can store")


AnyCertificate = PolytopeCertificate | PublishedCertificate


def intersection(sets: list[HPolytope]) -> HPolytope:
    """Points in all sets: the rows of all, in order."""
    total = sets[0]
    for P in sets[1:]:
        total = total.intersection(P)
    return total

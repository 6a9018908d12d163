"""Why a constrained zonotope and the newest measurements exclude each other, in exact rational arithmetic.

The proof is that of a window of one step: the model's own numbers, and of the arrival set one half-space d'x <= h. That
the zonotope lies in the half-space follows from multipliers mu of its constraints,

    d'x = d'c + (G'd - A'mu)'xi + d'v + mu'A xi <= d'c + |G'd - A'mu|_1 + |d|'room + mu'b + |mu|'slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import fmpq

from polytopes.exact import ZERO, rational
from svo.checks import Array
from svo.observers.window.certificate import OnWindow, WindowCertificate
from svo.observers.zonotope.zonotope import ConstrainedZonotope


@dataclass(frozen=True, eq=False)
class ZonotopeCertificate(OnWindow):
    """Proof that no state of a constrained zonotope explains the measurements of the last two samples.

    Conditional, as that of a window: on the arrival set, which was computed in floats and rounded outward, and on the
    bounds of s of each channel.

    Attributes
    ----------
    arrival : ConstrainedZonotope
        Contains the state at the window's first sample.
    multipliers : (nc,) array
        Of its constraints; they prove the window's arrival half-space.
    window : WindowCertificate
        Its arrival set is one half-space, and the interval hull of the zonotope.
    """

    kind = "constrained zonotope"

    arrival: ConstrainedZonotope
    multipliers: Array
    window: WindowCertificate

    @property
    def sample(self) -> int:
        """Sample of the falsification."""
        return self.window.last

    def verify(self) -> bool:
        """Whether the proof holds in exact rational arithmetic.

        False, and no error, also for a negative room or slack.
        """
        known, Z = self.window.arrival, self.arrival
        if not self.window.verify() or not self._is_well_formed():
            return False
        if len(known.rows) != 1 or not (known.lower == -np.inf).all() or not np.isfinite(known.upper).all():
            return False
        nothing = np.zeros(Z.offset.size)
        hull = [
            (sign * axis, sign * bound, nothing)
            for sign, bounds in ((1.0, known.box_upper), (-1.0, known.box_lower))
            for axis, bound in zip(np.eye(Z.dim), bounds, strict=True)
        ]
        rows = [(known.rows[0], known.upper[0], self.multipliers), *hull]
        return all(proven_support(Z, d, mu) <= rational(h) for d, h, mu in rows)

    def about(self) -> WindowCertificate:
        return self.window

    def _is_well_formed(self) -> bool:
        Z, n = self.arrival, self.window.n
        ng, nc = np.size(Z.generators) // n, np.size(Z.offset)
        expected = [
            (Z.center, (n,)), (Z.generators, (n, ng)), (Z.room, (n,)), (Z.constraints, (nc, ng)), (Z.offset, (nc,)),
            (Z.slack, (nc,)), (self.multipliers, (nc,)),
        ]  # fmt: skip
        if not all(a.dtype == np.float64 and a.shape == shape and np.isfinite(a).all() for a, shape in expected):
            return False
        return bool((Z.room >= 0.0).all() and (Z.slack >= 0.0).all())


def proven_support(Z: ConstrainedZonotope, direction: Array, multipliers: Array) -> fmpq:
    """The bound of direction'x over a constrained zonotope that multipliers of its constraints prove."""
    total, on_xi = ZERO, [ZERO] * Z.generators.shape[1]
    for i in np.flatnonzero(direction):
        d = rational(direction[i])
        total += d * rational(Z.center[i]) + abs(d) * rational(Z.room[i])
        _add(on_xi, d, Z.generators[i])
    for r in np.flatnonzero(multipliers):
        mu = rational(multipliers[r])
        total += mu * rational(Z.offset[r]) + abs(mu) * rational(Z.slack[r])
        _add(on_xi, -mu, Z.constraints[r])
    return total + sum((abs(v) for v in on_xi), ZERO)


def _add(target: list[fmpq], factor: fmpq, row: Array) -> None:
    for j in np.flatnonzero(row):
        target[j] += factor * rational(row[j])

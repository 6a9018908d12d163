"""One sample of a proof by hulls: what is known of x and w there, and what follows of the next state.

In normal form. Uncertainties enter the next state at the vertices of Delta; each that reaches an output does so by a
channel of that output alone, p = Delta s, between chords of Delta s over the bounds of s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from flint import fmpq

from polytopes import HPolytope
from polytopes.exact import ZERO, rational, rounded_up
from svo.checks import Array
from svo.models.normal_form import ENORMOUS, power
from svo.observers.polytope.box_program import Bound, BoxProgram
from svo.observers.polytope.vertex_images import hull_of_images, limited, transitions
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.proof_steps import SIDES
from svo.observers.window.setup import disturbance_rows
from svo.store.values import encode_value


class Unproven(Exception):
    """A program has no answer, or its multipliers do not prove it."""


@dataclass(frozen=True, eq=False)
class StateBound:
    """A direction (n,) of the next state is at most a value, by the multipliers of each vertex of Delta."""

    direction: Array
    value: float
    multipliers: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class _Channel:
    """Of an item in an output: s = functional'z within ends, by their multipliers; lines above and below Delta s."""

    owner: int
    output: int
    functional: Array
    delta: tuple[float, float]
    ends: tuple[float, float]
    multipliers: tuple[Array, Array]

    @cached_property
    def lines(self) -> tuple[tuple[float, float], ...]:
        """Slope and intercept of each."""
        found = []
        low, high = self.ends
        for sign in (1.0, -1.0):
            at = [max(sign * d * s for d in self.delta) for s in self.ends]
            slope = (at[1] - at[0]) / (high - low) if high > low else 0.0
            gaps = [
                rational(sign * d) * rational(s) - rational(slope) * rational(s) for d in self.delta for s in self.ends
            ]
            found.append((sign * slope, sign * rounded_up(max(gaps))))
        return tuple(found)

    @property
    def box(self) -> tuple[float, float]:
        """Of p."""
        products = [d * s for d in self.delta for s in self.ends]
        return float(np.nextafter(min(products), -np.inf)), float(np.nextafter(max(products), np.inf))


class ProofSample:
    """What a set, a reading and the bounds of w say of a sample.

    Parameters
    ----------
    of : ModelOnLog
    k : int
    known : ArrivalSet
        Of the state before the reading, its box finite.

    Raises
    ------
    Unproven
    """

    def __init__(self, of: ModelOnLog, k: int, known: ArrivalSet) -> None:
        self.k, self.known, self._form, self._s, self._delta = k, known, of.form, of.sample(k), of.delta.tolist()
        s, self._n = self._s, of.form.x.size
        if not np.array_equal(s.u_next * of.form.u, of.log.u[k]):
            raise Unproven  # an input beyond all bounds
        self._used = np.abs(s.y) < ENORMOUS
        on_w, w_lower, w_upper = disturbance_rows(of.form)
        columns = s.stack.shape[2]
        rows = np.zeros((len(known.rows) + len(on_w), columns))
        rows[: len(known.rows), : self._n], rows[len(known.rows) :, columns - s.w_lower.size :] = known.rows, on_w
        self._before = BoxProgram(
            np.concatenate([known.box_lower, s.u_next, [1.0], s.w_lower]),
            np.concatenate([known.box_upper, s.u_next, [1.0], s.w_upper]),
            rows, np.zeros(len(rows)),
            np.concatenate([known.lower, w_lower]), np.concatenate([known.upper, w_upper]),
        )  # fmt: skip
        self._channels = [
            self._channel(i, int(o))
            for i, item in enumerate(s.stack[1:], start=1)
            for o in np.flatnonzero(item[self._n :].any(axis=1) & self._used)
        ]

    def _channel(self, owner: int, output: int) -> _Channel:
        f = self._s.stack[owner, self._n + output]
        (high, above), (low, below) = _maxima(self._before, np.array([f, -f]))
        ends = -low, high
        return _Channel(owner, output, f, tuple(self._delta[owner - 1]), ends, (above, below))

    @cached_property
    def _program(self) -> BoxProgram:
        """Over z and p of each channel: rows before the reading, of the outputs, of lines above and below."""
        before, s, channels = self._before, self._s, self._channels
        ny, nq, size = s.y.size, len(channels), before.lower.size
        outputs = np.hstack([s.stack[0, self._n :], np.zeros((ny, nq))])
        lines, exact, intercepts = np.zeros((2 * nq, size + nq)), {}, []
        for q, channel in enumerate(channels):
            outputs[channel.output, size + q] = 1.0
        for side in range(2):
            sign = 1 - 2 * side
            for q, channel in enumerate(channels):
                slope, intercept = channel.lines[side]
                row = [-sign * rational(slope) * rational(f) for f in channel.functional]
                row += [fmpq(sign * (q == r)) for r in range(nq)]
                lines[side * nq + q] = [*(-sign * slope * channel.functional), *(float(v) for v in row[size:])]
                exact[len(before.rows) + ny + side * nq + q] = row
                intercepts.append(sign * intercept)
        width = np.where(self._used, s.noise, np.inf)
        p_lower, p_upper = np.array([channel.box for channel in channels]).reshape(-1, 2).T
        return BoxProgram(
            np.concatenate([before.lower, p_lower]), np.concatenate([before.upper, p_upper]),
            np.vstack([np.pad(before.rows, ((0, 0), (0, nq))), outputs, lines]),
            np.concatenate([before.middle, np.where(self._used, s.y, 0.0), intercepts]),
            np.concatenate([before.least, -width, np.full(2 * nq, -np.inf)]),
            np.concatenate([before.most, width, np.zeros(2 * nq)]), exact,
        )  # fmt: skip

    # -- what follows ----------------------------------------------------------------------------------

    def contradiction(self) -> Array | None:
        """Multipliers that prove exactly that nothing explains the reading; None if there are none."""
        return self._program.contradiction()

    def bounds(self, directions: Array) -> list[StateBound]:
        """Of the next state, in directions (r, n)."""
        forms = np.array([directions @ self._rows_at(vertex) for vertex in self._vertices])
        forms = np.pad(forms, ((0, 0), (0, 0), (0, len(self._channels))))
        at_vertices = [_maxima(self._program, of) for of in forms]
        found = []
        for d, answers in zip(directions, zip(*at_vertices, strict=True), strict=True):
            found.append(StateBound(d, max(value for value, _ in answers), tuple(m for _, m in answers)))
        return found

    def facets(self, max_facets: int | None) -> Array:
        """Normals (r, n) of about the set of the next state."""
        n, s, program = self._n, self._s, self._program
        free = np.r_[:n, n + s.u_next.size + 1 : self._before.lower.size]
        rows, least, most = [*self._before.rows], [*self._before.least], [*self._before.most]
        for o in np.flatnonzero(self._used):
            for side in range(2):  # y - noise below the lines above, and y + noise above those below
                row, known = s.stack[0, n + o].copy(), s.y[o]
                for channel in self._channels:
                    if channel.output == o:
                        row, known = row + channel.lines[side][0] * channel.functional, known - channel.lines[side][1]
                rows.append(row)
                least.append(known - s.noise[o] if side == 0 else -np.inf)
                most.append(np.inf if side == 0 else known + s.noise[o])
        A, low, high = np.array(rows).reshape(-1, self._before.lower.size), np.array(least), np.array(most)
        fixed = A @ np.where(np.isin(np.arange(A.shape[1]), free), 0.0, self._before.lower)
        above, below, axes = np.isfinite(high), np.isfinite(low), np.eye(free.size)
        joint = HPolytope(
            np.vstack([A[above][:, free], -A[below][:, free], axes, -axes]),
            np.concatenate([(high - fixed)[above], (fixed - low)[below], program.upper[free], -program.lower[free]]),
        )
        hull = limited(hull_of_images(joint, transitions(s.stack, self._form.model, s.u_next), max_facets), max_facets)
        return np.vstack([hull.A, hull.C, -hull.C])

    def holds(self, bound: StateBound) -> bool:
        """Whether the multipliers of a bound of the next state prove it, in exact arithmetic."""
        d = [rational(v) for v in bound.direction]
        known = [[sum((a * rational(b) for a, b in zip(d, column, strict=True) if b), ZERO) for column in item.T]
                 for item in self._s.stack[:, : self._n]]  # fmt: skip
        for vertex, multipliers in zip(self._vertices, bound.multipliers, strict=True):
            scales = [fmpq(1), *map(rational, vertex)]
            columns = zip(*known, strict=True)
            form = [sum((e * v for e, v in zip(scales, column, strict=True)), ZERO) for column in columns]
            if self._program.proven(form + [ZERO] * len(self._channels), multipliers) > rational(bound.value):
                return False
        return True

    @property
    def channel_multipliers(self) -> list[Array]:
        """Those of the bounds of every s."""
        return [multipliers for channel in self._channels for multipliers in channel.multipliers]

    def channels_hold(self) -> bool:
        """Whether the bounds of every s are proven, in exact arithmetic."""
        return all(
            self._before.proven([rational(sign * v) for v in channel.functional], multipliers) <= rational(sign * end)
            for channel in self._channels
            for sign, end, multipliers in zip((1.0, -1.0), channel.ends[::-1], channel.multipliers, strict=True)
        )

    @cached_property
    def _vertices(self) -> list[tuple[float, ...]]:
        """Of Delta: the lower end of what does not enter the state."""
        moved: list[bool] = self._s.stack[1:, : self._n].any(axis=(1, 2)).tolist()  # type: ignore[assignment]
        return [*product(*(ends[: 1 + m] for ends, m in zip(self._delta, moved, strict=True)))]

    def _rows_at(self, vertex: Sequence[float]) -> Array:
        stack = self._s.stack[:, : self._n]
        return np.asarray(stack[0] + np.tensordot(np.array(vertex), stack[1:], axes=1))

    # -- steps of the file, in the user's units --------------------------------------------------------

    def channel_steps(self, kept: list[int]) -> list[dict[str, Any]]:
        """The channels and bounds of their s; of the set's rows only those kept are known."""
        if not self._channels:
            return []
        e, channels = self._form.exponents, self._channels
        gain = np.zeros((len(channels), len(e.rows)))
        gain[np.arange(len(channels)), [self._n + channel.output for channel in channels]] = 1.0
        functional = np.array([channel.functional for channel in channels])
        found: list[dict[str, Any]] = [{
            "step": "channels", "sample": self.k, "owner": [channel.owner for channel in channels],
            "gain": encode_value(gain * power(e.rows)), "functional": encode_value(functional * power(-e.columns)),
        }]  # fmt: skip
        for q, channel in enumerate(channels):
            for side, (value, multipliers) in enumerate(zip(channel.ends[::-1], channel.multipliers, strict=True)):
                told = {"step": "s", "sample": self.k, "channel": q, "side": SIDES[side], "value": float(value).hex()}
                found.append(told | self.entries(self.k, multipliers, kept))
        return found

    def state_step(self, bound: StateBound, row: int, side: int, kept: list[int]) -> dict[str, Any]:
        """A bound of the next state, in a row that is an axis or a direction of its own."""
        unit = float(self._form.x[row]) if row < self._n else 1.0
        value, last = bound.value * unit * (1.0 - 2.0 * side), self.k + 1
        cases = [self.entries(last, unit * multipliers, kept) for multipliers in bound.multipliers]
        told = {"step": "x", "sample": last, "row": row, "side": SIDES[side], "value": float(value).hex()}
        return told | {"vertices": cases}

    def entries(self, last: int, multipliers: Array, kept: list[int]) -> dict[str, Any]:
        """Multipliers of a window from this sample on."""
        s, nq, length = self._s, len(self._channels), last - self.k + 1
        sizes = [len(self.known.rows), len(self._before.rows) - len(self.known.rows), s.y.size, nq, nq]
        padded = np.concatenate([multipliers, np.zeros(sum(sizes) - len(multipliers))])
        on_start, on_w, on_output, above, below = np.split(padded, np.cumsum(sizes)[:-1])
        outputs, disturbances = np.zeros((length, s.y.size)), np.zeros((length, on_w.size))
        outputs[0], disturbances[0] = on_output / self._form.y, on_w
        found: dict[str, Any] = {"first": self.k, "last": last, "on_start": encode_value(on_start[kept]),
                                 "on_output": encode_value(outputs)}  # fmt: skip
        if on_w.size:
            found["on_w"] = encode_value(disturbances)
        lines = [(q, side, m) for side, ms in enumerate((above, below)) for q, m in enumerate(ms.tolist()) if m]
        if lines:
            found["on_line"] = [[0, q, side] for q, side, _ in lines]
            found["line"] = encode_value(np.array([[m, *self._channels[q].lines[side]] for q, side, m in lines]))
        return found


def _maxima(program: BoxProgram, forms: Array) -> list[Bound]:
    found = program.maxima(forms)
    if found is None:
        raise Unproven
    return found

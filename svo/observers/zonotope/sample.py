"""One sample of the constrained-zonotope observer: what w, the channels and a measurement add to the set of the state.

All in normal form, but for the certificates.

An uncertainty enters as p = Delta s over the bounds [l, r] of s: the two lines of `WindowObserver`, as constraints over
a generator of p. The same w and p enter the next state and the output. A p that the output does not have enters with
the transition, once its input is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polytopes.exact import rounded_up
from svo.checks import Array
from svo.models import NormalForm
from svo.observers.given_units import zonotope_proof_out
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet, WindowSample
from svo.observers.window.setup import channel_owners, disturbance_rows, output_is_disturbed
from svo.observers.window_kernel import channel_factors
from svo.observers.zonotope.certificate import ZonotopeCertificate, proven_support
from svo.observers.zonotope.program import ZonotopeProgram
from svo.observers.zonotope.zonotope import EPS, ConstrainedZonotope, unit

NO_ROW = -1


@dataclass(frozen=True, eq=False)
class Stage:
    """A sample and all that is known at it.

    Attributes
    ----------
    arrival : ConstrainedZonotope
        Of the state, before the measurement of the sample.
    joint : ConstrainedZonotope
        Of x, then w and p as far as they have entered.
    data : WindowSample
        Multipliers are zero.
    gains, functionals : (nq, n + ny), (nq, n + nu + 1 + nw) arrays
    left : (n + ny, n + nu + 1 + nw) array
        Bound of what the channels leave out of the uncertainties.
    on_output, on_w : (ny,), (nh,) arrays of int
        Constraints of ``joint`` that are the rows of the outputs and of w; -1 where there is none.
    on_p : tuple of int
        Generators of those p that constraints bound.
    is_open : bool
        Whether w has entered.
    channels : tuple of int
        Those whose p has entered, in that order.
    """

    arrival: ConstrainedZonotope
    joint: ConstrainedZonotope
    data: WindowSample
    gains: Array
    functionals: Array
    left: Array
    on_output: NDArray[np.int64]
    on_w: NDArray[np.int64]
    on_p: tuple[int, ...] = ()
    is_open: bool = False
    channels: tuple[int, ...] = ()


class StageBuilder:
    """Makes stages of one model.

    Attributes
    ----------
    form : NormalForm
    model : UncertainModel
        That of the normal form.
    is_late : bool
        Whether the output depends on w or a channel, which then enter before the measurement.
    """

    def __init__(self, form: NormalForm, eps: float) -> None:
        self.form, self.model, self.eps = form, form.model, eps
        model = form.model
        self.is_late = output_is_disturbed(model)
        self._owner = channel_owners(model)
        self._delta = np.array([model.uncertainties[i - 1].bounds for i in self._owner]).reshape(-1, 2)
        self._w_rows = disturbance_rows(form)

    def first_set(self, first: ArrivalSet) -> ConstrainedZonotope:
        """The set of first states."""
        return ConstrainedZonotope.box(first.box_lower, first.box_upper).cut(first.rows, first.lower, first.upper)

    def data(self, stack: Array, bounds: tuple[Array, Array, Array], u: Array, y: Array) -> WindowSample:
        """What is known of a sample before the set is."""
        w_lower, w_upper, noise = bounds
        nq, nh, ny = len(self._owner), len(self._w_rows[1]), self.model.n_outputs
        return WindowSample(
            stack=stack, u=u, y=y, noise=noise, slack=np.zeros(ny), w_lower=w_lower, w_upper=w_upper,
            s_lower=np.zeros(nq), s_upper=np.zeros(nq), lines=np.zeros((nq, 4)),
            on_output=np.zeros(ny), on_w=np.zeros(nh), on_channel=np.zeros((nq, 2)),
        )  # fmt: skip

    def measured(self, states: ConstrainedZonotope, data: WindowSample) -> Stage:
        """A set of states and the measurement of its sample."""
        gains, functionals, left = self._factors(data.stack)
        nowhere = np.full(self.model.n_outputs, NO_ROW)
        stage = Stage(states, states, data, gains, functionals, left, nowhere, np.full(len(data.on_w), NO_ROW))
        if not self.is_late:
            return self._measure(stage)
        reaching = np.any(gains[:, self.model.n_states :], axis=1)
        return self._measure(self._with_channels(self._with_disturbance(stage), reaching))

    def moved(self, stage: Stage, rows: Array) -> Stage:
        """A stage whose state rows (items, n, columns) are others: nothing of the measurement depends on them."""
        stack = stage.data.stack.copy()
        stack[:, : self.model.n_states] = rows
        gains, functionals, left = self._factors(stack)
        return replace(stage, data=replace(stage.data, stack=stack), gains=gains, functionals=functionals, left=left)

    def _factors(self, stack: Array) -> tuple[Array, Array, Array]:
        gains, functionals, left, complete = channel_factors(stack, self._owner, self._delta)
        if not complete:
            raise ValueError("an uncertainty has a higher rank at this sample than at the model's typical schedule")
        return gains, functionals, left

    def _with_disturbance(self, stage: Stage) -> Stage:
        """With w of the sample."""
        joint = stage.joint.product_box(stage.data.w_lower, stage.data.w_upper)
        first = len(joint.offset)
        rows, lower, upper = self._w_rows
        joint = joint.cut(np.hstack([np.zeros((len(rows), self.model.n_states)), rows]), lower, upper)
        return replace(stage, joint=joint, on_w=np.arange(first, len(joint.offset)), is_open=True)

    def _with_channels(self, stage: Stage, chosen: NDArray[np.bool_]) -> Stage:
        """With some channels of the sample, whose input is known as far as they depend on it."""
        which, u, joint = np.flatnonzero(chosen), stage.data.u, stage.joint
        if not which.size:
            return stage
        functionals = stage.functionals[which]
        f, known = functionals[:, self._columns()], self._known(functionals, u)
        terms = self._known(np.abs(functionals), np.abs(u))
        over = np.hstack([f, np.zeros((len(which), joint.dim - f.shape[1]))])
        low, high = joint.range_of(over, known)
        is_unsure = (low < 0.0) & (high > 0.0) & f.any(axis=1)
        if is_unsure.any():
            ends = ZonotopeProgram(joint).support(np.vstack([over[is_unsure], -over[is_unsure]]))
            half = len(ends) // 2
            low[is_unsure] = np.maximum(low[is_unsure], known[is_unsure] - ends[half:])
            high[is_unsure] = np.minimum(high[is_unsure], known[is_unsure] + ends[:half])
        rounding = unit(len(u)) * (terms + np.abs(low) + np.abs(high))
        low, high = low - rounding, high + rounding
        lines = np.array([_lines(*ends) for ends in zip(self._delta[which], low, high, strict=True)]).reshape(-1, 4)
        on_p = list(stage.on_p)
        for i, q in enumerate(which.tolist()):
            bounded = bool(f[i].any())
            if bounded:
                on_p.append(joint.generators.shape[1])
            joint = self._with_channel(joint, q, f[i], (known[i], terms[i]), (low[i], high[i]), lines[i], bounded)
        data = replace(
            stage.data,
            s_lower=_put(stage.data.s_lower, which, low),
            s_upper=_put(stage.data.s_upper, which, high),
            lines=_put(stage.data.lines, which, lines),
        )
        channels = (*stage.channels, *which.tolist())
        return replace(stage, joint=joint, data=data, on_p=tuple(on_p), channels=channels)

    def predicted(self, stage: Stage, u: Array) -> tuple[Stage, ConstrainedZonotope]:
        """The stage with all that drives the next state, and the set of the next state."""
        stage = replace(stage, data=replace(stage.data, u=u))
        waiting = np.ones(len(self._owner), dtype=bool)
        waiting[list(stage.channels)] = False
        stage = self._with_channels(stage if stage.is_open else self._with_disturbance(stage), waiting)
        n = self.model.n_states
        M = np.hstack([stage.data.stack[0, :n][:, self._columns()], stage.gains[list(stage.channels), :n].T])
        known = self._known(stage.data.stack[0, :n], u)
        size = self._known(np.abs(stage.data.stack[0, :n]), np.abs(u))
        return stage, stage.joint.affine_map(M, known).grown(unit(len(u)) * size + self._left_out(stage, slice(0, n)))

    def certificate(self, stages: tuple[Stage, ...], multipliers: Array, last: int) -> ZonotopeCertificate | None:
        """The certificate that multipliers of the last stage's constraints amount to; None if it proves nothing."""
        n, arrival = self.model.n_states, stages[0].arrival
        multipliers = multipliers / max(float(np.abs(multipliers).max(initial=0.0)), np.finfo(float).tiny)
        costate, samples = np.zeros(n), []
        for stage in reversed(stages):
            on_output = _at(multipliers, stage.on_output)
            on_w = _at(multipliers, stage.on_w)
            on_w = np.where(np.isfinite(np.where(on_w > 0, self._w_rows[2], self._w_rows[1])), on_w, 0.0)
            weight = np.concatenate([costate, on_output])
            known, on_channel = weight @ stage.data.stack[0], np.zeros((len(self._owner), 2))
            if stage.is_open:
                on_p = stage.gains @ weight
                # p lies between its lines, the one or the other by the sign of its weight
                on_channel = np.maximum(np.stack([-on_p, on_p], axis=1), 0.0)
                slopes = on_channel[:, 1] * stage.data.lines[:, 2] - on_channel[:, 0] * stage.data.lines[:, 0]
                known = known + slopes @ stage.functionals
            samples.append(replace(stage.data, on_output=on_output, on_w=on_w, on_channel=on_channel))
            costate = known[:n]
        on_arrival = multipliers[: len(arrival.offset)]
        window = WindowCertificate(
            first=last - len(stages) + 1, last=last, n=n, late=self.is_late, delta=self._delta, owner=self._owner,
            w_rows=self._w_rows[0], w_rows_lower=self._w_rows[1], w_rows_upper=self._w_rows[2],
            arrival=_half_space(arrival, -costate, on_arrival), on_arrival=np.ones(1), samples=tuple(samples[::-1]),
        )  # fmt: skip
        certificate = zonotope_proof_out(ZonotopeCertificate(arrival, on_arrival, window), self.form)
        return certificate if certificate.verify() else None

    # -- inside ------------------------------------------------------------------------------------

    def _columns(self) -> NDArray[np.int64]:
        """Columns of x and w in a stack."""
        layout = self.model.layout
        return np.concatenate([np.arange(layout.n), np.arange(layout.n + layout.nu + 1, layout.shape[1])])

    def _known(self, rows: Array, u: Array) -> Array:
        """What the input and the constant contribute to rows over (x, u, 1, w)."""
        n, nu = self.model.n_states, self.model.n_inputs
        return rows[:, n : n + nu] @ u + rows[:, n + nu]

    def _left_out(self, stage: Stage, rows: slice) -> Array:
        """Bound of what the channels leave out of rows of [x(k+1); y(k)]."""
        left = stage.left[rows]
        if not left.any():
            return np.zeros(len(left))
        lower, upper = stage.joint.interval_hull()
        reach, n = np.maximum(np.abs(lower), np.abs(upper)), self.model.n_states
        w = reach[n : n + self.model.n_disturbances]
        total = left @ np.concatenate([reach[:n], np.abs(stage.data.u), [1.0], w])
        return total * (1.0 + unit(left.shape[1]))

    def _with_channel(
        self,
        joint: ConstrainedZonotope,
        q: int,
        f: Array,
        known: tuple[float, float],
        s: tuple[float, float],
        lines: Array,
        bounded: bool,
    ) -> ConstrainedZonotope:
        """One p more: Delta's middle times s, a generator, and the two lines as constraints."""
        lo, hi = self._delta[q]
        middle = 0.5 * lo + 0.5 * hi
        half = max(hi - middle, middle - lo) * max(abs(s[0]), abs(s[1]))
        row = np.zeros((1, joint.dim))
        row[0, : f.size] = middle * f
        center = middle * known[0]
        rounding = unit(self.model.n_inputs) * (abs(middle) * known[1] + half)
        p = ConstrainedZonotope.box(np.array([-half]), np.array([half])).affine_map(np.eye(1), np.array([center]))
        joint = joint.extended(row, p.grown(np.array([rounding])))
        if not bounded:
            return joint
        rows = np.zeros((2, joint.dim))
        rows[:, : f.size] = -lines[[0, 2], None] * f
        rows[:, -1] = 1.0
        size = np.abs(lines[[0, 2]]) * known[1] + np.abs(lines[[1, 3]])
        above, below = lines[[1, 3]] + lines[[0, 2]] * known[0] + np.array([1.0, -1.0]) * unit(len(f)) * size
        return joint.cut(rows, np.array([-np.inf, below]), np.array([above, np.inf]))

    def _measure(self, stage: Stage) -> Stage:
        data, n = stage.data, self.model.n_states
        chosen = np.flatnonzero(~np.isnan(data.y))
        columns = self._columns() if stage.is_open else np.arange(n)
        rows = data.stack[0, n:][:, columns]
        if stage.is_open:
            rows = np.hstack([rows, stage.gains[list(stage.channels), n:].T])
        known = self._known(data.stack[0, n:], data.u)
        lower, upper = stage.joint.interval_hull()
        size = np.abs(rows) @ np.maximum(np.abs(lower), np.abs(upper))
        size += self._known(np.abs(data.stack[0, n:]), np.abs(data.u))
        slack = self.eps * (np.abs(np.nan_to_num(data.y)) + size + data.noise)
        slack[np.isnan(data.y)] = 0.0
        rounding = unit(len(data.u)) * (np.abs(data.y) + size)
        width = data.noise + slack + rounding
        if stage.is_open:
            width += self._left_out(stage, slice(n, None))
        joint = stage.joint.cut(rows[chosen], (data.y - known - width)[chosen], (data.y - known + width)[chosen])
        on_output = stage.on_output.copy()
        on_output[chosen] = np.arange(len(stage.joint.offset), len(joint.offset))
        return replace(stage, joint=joint, data=replace(data, slack=slack), on_output=on_output)


def _put(values: Array, where: NDArray[np.int64], new: Array) -> Array:
    """The values, with new ones at some places."""
    changed = values.copy()
    changed[where] = new
    return changed


def _at(values: Array, where: NDArray[np.int64]) -> Array:
    """Values at some places, zero where there is none."""
    return np.append(values, 0.0)[where]


def _half_space(arrival: ConstrainedZonotope, direction: Array, multipliers: Array) -> ArrivalSet:
    """Of an arrival set, its interval hull and the half-space in one direction that multipliers prove."""
    axes, nothing = np.eye(arrival.dim), np.zeros(arrival.offset.size)
    upper = np.array([rounded_up(proven_support(arrival, axis, nothing)) for axis in axes])
    lower = -np.array([rounded_up(proven_support(arrival, -axis, nothing)) for axis in axes])
    bound = rounded_up(proven_support(arrival, direction, multipliers))
    return ArrivalSet(lower, upper, direction[None, :].copy(), np.array([-np.inf]), np.array([bound]))


def _lines(delta: Array, low: float, high: float) -> tuple[float, float, float, float]:
    """Slope and intercept of the lines above and below Delta s over [low, high], rounded outward."""
    lo, hi = (float(v) for v in delta)
    if low >= 0.0:
        return hi, 0.0, lo, 0.0
    if high <= 0.0:
        return lo, 0.0, hi, 0.0
    above, below = (hi * high - lo * low) / (high - low), (lo * high - hi * low) / (high - low)
    reach = 8.0 * EPS * max(high, -low) * (abs(lo) + abs(hi) + np.array([abs(above), abs(below)]))
    return (
        above, float(max((lo - above) * low, (hi - above) * high) + reach[0]),
        below, float(min((hi - below) * low, (lo - below) * high) - reach[1]),
    )  # fmt: skip

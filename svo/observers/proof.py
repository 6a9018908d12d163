"""Why a window is empty: a Farkas certificate that checks in exact rational arithmetic.

Every float is a rational number, so the window's rows, written with the states as variables, are the model's own
numbers. Given multipliers of the data rows, the multipliers of the state equations follow by the backward
recursion

    pi_k = A_k' pi_(k+1) + C_k' lambda_k + (channel rows),

and the window is empty if the multiplied rows exceed their bounds at every point of the variables' boxes. What a
window proves is conditional on its arrival set and on the stated bounds of each channel's s; both are outer
bounds that the observer computed before. An uncertainty enters as the sum of its channels, which is the model's
own matrix but for the rounding of that factorisation (`FACTOR_TOLERANCE`, checked).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from svo.observers.window_kernel import BASE, TIME, Sizes, channel_factors

Array = NDArray[np.float64]
ZERO = fmpq(0)
FACTOR_TOLERANCE = 2e-12  # relative; the observer takes a stack whose channels leave out less than 1e-12


def exact(value: float) -> fmpq:
    """The rational number that a finite float is."""
    return fmpq(*float(value).as_integer_ratio())


def _interval_min(coefficient: fmpq, lower: fmpq, upper: fmpq) -> fmpq:
    return coefficient * (lower if coefficient > 0 else upper)


@dataclass(frozen=True, eq=False)
class ArrivalSet:
    """{x : box_lower <= x <= box_upper, lower <= rows x <= upper}: what was known of the window's first state."""

    box_lower: Array
    box_upper: Array
    rows: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, eq=False)
class WindowSample:
    """Model and data of one sample of a window, with the multipliers of its rows.

    Attributes
    ----------
    stack : (1 + n_uncertainties, n + ny, n + nu + 1 + nw)
        As `UncertainModel.stack` gave it.
    u, y, noise, slack : (nu,), (ny,), (ny,), (ny,)
        ``y`` within ``noise + slack`` of the output; NaN where the sensor is missing.
    w_lower, w_upper : (nw,)
    s_lower, s_upper : (nq,)
        Bounds of each channel's s.
    lines : (nq, 4)
        Slope and intercept of the line above Delta s and of the line below it.
    on_output, on_w, on_channel : (ny,), (nh,), (nq, 2)
        Multipliers; positive on an upper bound, negative on a lower one.
    """

    stack: Array
    u: Array
    y: Array
    noise: Array
    slack: Array
    w_lower: Array
    w_upper: Array
    s_lower: Array
    s_upper: Array
    lines: Array
    on_output: Array
    on_w: Array
    on_channel: Array


@dataclass(frozen=True, eq=False)
class WindowCertificate:
    """Proof that no x, w, noise and Delta within their bounds explain the data of a window.

    Attributes
    ----------
    first, last : int
        Sample numbers of the window.
    n : int
        Number of states.
    delta : (nq, 2)
        Bounds of the Delta of each channel.
    owner : (nq,) int
        Item of the stack that each channel belongs to.
    w_rows, w_rows_lower, w_rows_upper : (nh, nw), (nh,), (nh,)
        Rows on w besides its box.
    arrival : ArrivalSet
    on_arrival : (rows,)
        Multipliers of the arrival rows.
    samples : tuple of WindowSample
    late : bool
        Whether w and the channels of the last sample take part (they do where the output depends on them).
    """

    first: int
    last: int
    n: int
    late: bool
    delta: Array
    owner: NDArray[np.int64]
    w_rows: Array
    w_rows_lower: Array
    w_rows_upper: Array
    arrival: ArrivalSet
    on_arrival: Array
    samples: tuple[WindowSample, ...]

    def verify(self) -> bool:
        """Check the proof in exact rational arithmetic; True only if it proves that the window is empty.

        False, and no error, for arrays of wrong shapes, for NaN or Inf out of place and for intervals whose ends are
        in the wrong order: a stored certificate may hold anything.
        """
        if not _is_well_formed(self):
            return False
        try:
            return _Check(self).gap() > 0
        except _NoProof:
            return False

    def proven_bound(self, sample: int, direction: Array) -> fmpq | None:
        """Upper bound of direction'x at a sample of the window that the multipliers prove (weak duality).

        Parameters
        ----------
        sample : int
            Between `first` and `last`.
        direction : (n,) array

        Returns
        -------
        fmpq or None
            None where the multipliers prove nothing.
        """
        if not _is_well_formed(self):
            return None
        try:
            return -_Check(self, (sample - self.first, direction)).gap()
        except _NoProof:
            return None


def _is_well_formed(c: WindowCertificate) -> bool:
    """Whether every array has its shape and finite numbers, and every interval its ends in order."""
    if not (isinstance(c.n, int) and c.n > 0 and c.samples and len(c.samples) == c.last - c.first + 1):
        return False
    if not all(_holds(value, shape, kind, bounded) for value, shape, kind, bounded in _expected_arrays(c)):
        return False
    intervals: list[tuple[Array, Array]] = [
        (c.delta[:, 0], c.delta[:, 1]),
        (c.w_rows_lower, c.w_rows_upper),
        (c.arrival.box_lower, c.arrival.box_upper),
        (c.arrival.lower, c.arrival.upper),
        *((s.w_lower, s.w_upper) for s in c.samples),
        *((s.s_lower, s.s_upper) for s in c.samples),
        *((-s.noise, s.noise) for s in c.samples),
        *((-s.slack, s.slack) for s in c.samples),
    ]
    if not all(np.all(lower <= upper) for lower, upper in intervals) or any(np.isinf(s.y).any() for s in c.samples):
        return False
    return bool(np.all((c.owner > 0) & (c.owner < len(c.samples[0].stack))))


def _holds(value: Any, shape: tuple[int, ...], kind: type, bounded: bool) -> bool:
    if not (isinstance(value, np.ndarray) and value.dtype == kind and value.shape == shape):
        return False
    return not bounded or bool(np.isfinite(value).all())


def _expected_arrays(c: WindowCertificate) -> Iterator[tuple[Any, tuple[int, ...], type, bool]]:
    """Every array of a certificate with its shape, its type, and whether it must be finite.

    What may be infinite (bounds of rows) or NaN (a missing sensor) is looked at where it is used.
    """
    head, real = c.samples[0], np.float64
    n, nu, ny, nw = c.n, np.size(head.u), np.size(head.y), np.size(head.w_lower)
    nq, nh, na = np.size(c.owner), np.size(c.w_rows_lower), np.size(c.on_arrival)
    rows, columns = n + ny, n + nu + 1 + nw
    yield c.owner, (nq,), np.int64, True
    yield c.delta, (nq, 2), real, True
    yield c.w_rows, (nh, nw), real, True
    yield from ((v, (nh,), real, False) for v in (c.w_rows_lower, c.w_rows_upper))
    yield from ((v, (n,), real, True) for v in (c.arrival.box_lower, c.arrival.box_upper))
    yield c.arrival.rows, (na, n), real, True
    yield from ((v, (na,), real, False) for v in (c.arrival.lower, c.arrival.upper))
    yield c.on_arrival, (na,), real, True
    for s in c.samples:
        yield s.stack, (np.size(head.stack) // (rows * columns), rows, columns), real, True
        yield s.u, (nu,), real, True
        yield s.y, (ny,), real, False
        yield from ((v, (ny,), real, True) for v in (s.noise, s.slack, s.on_output))
        yield from ((v, (nw,), real, True) for v in (s.w_lower, s.w_upper))
        yield from ((v, (nq,), real, True) for v in (s.s_lower, s.s_upper))
        yield s.lines, (nq, 4), real, True
        yield s.on_w, (nh,), real, True
        yield s.on_channel, (nq, 2), real, True


class _NoProof(Exception):
    """Something in a certificate does not support its claim."""


class _Check:
    """One exact evaluation of a certificate."""

    def __init__(self, certificate: WindowCertificate, objective: tuple[int, Array] | None = None) -> None:
        self.c = certificate
        self.objective = objective  # sample of the window and direction of what is subtracted from the rows
        self.total = ZERO  # lower bound of (multiplied rows - multiplied bounds) over the boxes

    def gap(self) -> fmpq:
        """Least value of the multiplied rows minus their bounds; positive proves emptiness."""
        c = self.c
        costate = [ZERO] * c.n
        for index in range(len(c.samples) - 1, -1, -1):
            costate = self._sample(c.samples[index], costate, index == len(c.samples) - 1)
            if self.objective is not None and self.objective[0] == index:
                costate = [p - exact(d) for p, d in zip(costate, self.objective[1], strict=True)]
        for r, multiplier in enumerate(c.on_arrival):
            if multiplier:
                m = exact(multiplier)
                self._bound(m, c.arrival.lower[r], c.arrival.upper[r])
                costate = [p + m * exact(a) for p, a in zip(costate, c.arrival.rows[r], strict=True)]
        for p, low, high in zip(costate, c.arrival.box_lower, c.arrival.box_upper, strict=True):
            if p:
                self._box(p, low, high)
        return self.total

    def _bound(self, multiplier: fmpq, lower: float, upper: float) -> None:
        bound = upper if multiplier > 0 else lower
        if not np.isfinite(bound):
            raise _NoProof
        self.total -= multiplier * exact(bound)

    def _box(self, coefficient: fmpq, lower: float, upper: float) -> None:
        self.total += _interval_min(coefficient, exact(lower), exact(upper))

    def _sample(self, s: WindowSample, after: list[fmpq], newest: bool) -> list[fmpq]:
        """Account for one sample; ``after`` is the costate of the next state, the result that of this one."""
        n, ny, nu = self.c.n, s.y.size, s.u.size
        active = not newest or self.c.late
        # weight of every row of the stack: the next state's costate, then the output multipliers
        weight = list(after) + [ZERO] * ny
        for o, multiplier in enumerate(s.on_output):
            if multiplier:
                weight[n + o] = self._output(s, o, exact(multiplier))
        known: list[fmpq] = [ZERO] * s.stack.shape[2]
        self._combine(known, s.stack[0], weight)
        if active:
            self._channels(s, weight, known)
            self._disturbance(s, known[n + nu + 1 :])
        elif any(known[n + nu + 1 :]) or np.any(s.stack[1:, n:]) or np.any(s.on_channel) or np.any(s.on_w):
            raise _NoProof
        for value, coefficient in zip(s.u, known[n : n + nu], strict=True):
            if coefficient:
                self.total += coefficient * exact(value)
        self.total += known[n + nu]
        return known[:n]

    def _output(self, s: WindowSample, o: int, m: fmpq) -> fmpq:
        if not np.isfinite(s.y[o]):
            raise _NoProof
        reach = exact(s.noise[o]) + exact(s.slack[o])
        self.total -= m * (exact(s.y[o]) + (reach if m > 0 else -reach))
        return m

    @staticmethod
    def _combine(target: list[fmpq], matrix: Array, weight: list[fmpq]) -> None:
        """target += weight' matrix, over the nonzero entries."""
        for i, w in enumerate(weight):
            if w:
                for j in np.flatnonzero(matrix[i]):
                    target[j] += w * exact(matrix[i, j])

    def _channels(self, s: WindowSample, weight: list[fmpq], known: list[fmpq]) -> None:
        """Add each channel's p: its box, its two lines over s = functional'(x, u, 1, w), and its effect."""
        gains, functionals = channel_factors(s.stack, self.c.owner)
        self._check_factors(s.stack, gains, functionals)
        for q, (gain, functional) in enumerate(zip(gains, functionals, strict=True)):
            lo, hi = (exact(v) for v in self.c.delta[q])
            low, high = exact(s.s_lower[q]), exact(s.s_upper[q])
            on_p = sum((w * exact(g) for w, g in zip(weight, gain, strict=True) if w and g), ZERO)
            on_s = ZERO
            for side in range(2):
                multiplier = s.on_channel[q, side]
                if multiplier:
                    m, slope, intercept = (
                        exact(multiplier),
                        exact(s.lines[q, 2 * side]),
                        exact(s.lines[q, 2 * side + 1]),
                    )
                    self._check_line(1 - 2 * side, slope, intercept, (lo, hi), (low, high))
                    if m < 0:
                        raise _NoProof
                    sign = 1 - 2 * side
                    on_p += sign * m
                    on_s -= sign * m * slope
                    self.total -= sign * m * intercept
            if on_s:
                for j in np.flatnonzero(functional):
                    known[j] += on_s * exact(functional[j])
            if on_p:
                products = [d * v for d in (lo, hi) for v in (low, high)]
                self.total += _interval_min(on_p, min(products), max(products))
            self._check_known(s, functional, low, high)

    def _check_factors(self, stack: Array, gains: Array, functionals: Array) -> None:
        """The channels of an uncertainty add up to its matrices: none is left out, none counted twice."""
        for item in range(1, len(stack)):
            mine = self.c.owner == item
            rest = np.abs(stack[item] - gains[mine].T @ functionals[mine]).max()
            if not rest <= FACTOR_TOLERANCE * np.abs(stack[item]).max():
                raise _NoProof

    @staticmethod
    def _check_line(side: int, slope: fmpq, intercept: fmpq, delta: tuple[fmpq, fmpq], s: tuple[fmpq, fmpq]) -> None:
        """A line bounds Delta s over [l, r] if it does so at both ends (the bound is convex, or concave)."""
        for end in s:
            worst = max(side * d * end for d in delta)
            if side * (slope * end + intercept) < worst:
                raise _NoProof

    def _check_known(self, s: WindowSample, functional: Array, low: fmpq, high: fmpq) -> None:
        """Where s depends on the input alone, its bounds are checked rather than trusted."""
        n, nu = self.c.n, s.u.size
        if np.any(functional[:n]) or np.any(functional[n + nu + 1 :]):
            return
        value = exact(functional[n + nu])
        for j in range(nu):
            if functional[n + j]:
                value += exact(functional[n + j]) * exact(s.u[j])
        if not low <= value <= high:
            raise _NoProof

    def _disturbance(self, s: WindowSample, coefficients: list[fmpq]) -> None:
        c = list(coefficients)
        for h, multiplier in enumerate(s.on_w):
            if multiplier:
                m = exact(multiplier)
                self._bound(m, self.c.w_rows_lower[h], self.c.w_rows_upper[h])
                c = [v + m * exact(a) for v, a in zip(c, self.c.w_rows[h], strict=True)]
        for value, low, high in zip(c, s.w_lower, s.w_upper, strict=True):
            if value:
                self._box(value, low, high)


def certificate_of(window: dict[str, Any], size: Sizes, arrival: ArrivalSet) -> WindowCertificate:
    """Read the certificate of an empty window from the kernel's memory, multipliers unscaled."""
    return certificate_from(window, size, arrival, None, size.nw)


def certificate_from(
    window: dict[str, Any], size: Sizes, arrival: ArrivalSet, outputs: dict[int, Array] | None, nw: int
) -> WindowCertificate:
    """`certificate_of`, where the kernel may have other data than were given.

    Parameters
    ----------
    outputs : dict of sample to (ny,) array, or None
        Multipliers of the measurements, where those of the kernel's rows are not; stack, y and slack are then taken
        from ``window["given.*"]`` and the noise is none.
    nw : int
        How many of the kernel's disturbances are the model's.
    """
    base, time = int(window["clock"][BASE]), int(window["clock"][TIME])
    multiplier = window["farkas"] * window["scale"]
    nr = size.ny + size.nh + 2 * size.nq
    prefix = "" if outputs is None else "given."
    samples = []
    for k in range(base, time + 1):
        s, v = k % (size.N + 1), k % (size.N + size.late)
        rows = multiplier[size.na + s * nr :][:nr].copy()
        on_channel = rows[size.ny + size.nh :].reshape(size.nq, 2)
        samples.append(
            WindowSample(
                stack=window[prefix + "stack"][s].copy(),
                u=window["u"][s].copy(),
                y=window[prefix + "y"][s].copy(),
                noise=window["noise"][s].copy() if outputs is None else np.zeros(size.ny),
                slack=window[prefix + "slack"][s].copy(),
                w_lower=window["w_lower"][v][:nw].copy(),
                w_upper=window["w_upper"][v][:nw].copy(),
                s_lower=window["s_lower"][v].copy(),
                s_upper=window["s_upper"][v].copy(),
                lines=window["lines"][v].copy(),
                on_output=rows[: size.ny] if outputs is None else outputs[k],
                on_w=_with_bounds(rows[size.ny : size.ny + size.nh], window["w_rows_lower"], window["w_rows_upper"]),
                on_channel=np.maximum(on_channel, 0.0),
            )
        )
    return WindowCertificate(
        first=base,
        last=time,
        n=size.n,
        late=bool(size.late),
        delta=window["delta"].copy(),
        owner=window["owner"].copy(),
        w_rows=window["w_rows"][:, :nw].copy(),
        w_rows_lower=window["w_rows_lower"].copy(),
        w_rows_upper=window["w_rows_upper"].copy(),
        arrival=arrival,
        on_arrival=_with_bounds(multiplier[: len(arrival.rows)], arrival.lower, arrival.upper),
        samples=tuple(samples),
    )


def _with_bounds(multipliers: Array, lower: Array, upper: Array) -> Array:
    """Multipliers without those on an infinite bound: rounding leaves such of the order of 1e-18."""
    return np.where(np.isfinite(np.where(multipliers > 0, upper, lower)), multipliers, 0.0)

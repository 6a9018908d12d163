"""Why a window is empty: a Farkas certificate that checks in exact rational arithmetic (see `weak_duality`).

What a window proves is conditional on its arrival set and on the stated bounds of each channel's s; both are outer
bounds that the observer computed before. An uncertainty enters as the sum of its channels; what that leaves out of the
model's own matrix is a disturbance with a bound, entry by entry (`svo.observers.window.left_out`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flint import fmpq

from svo.checks import Array
from svo.logs.log import Log
from svo.models import Exponents, ModelSample, power
from svo.observers.certificate import Certificate, started_again
from svo.observers.free_start import Reading, state_bounds
from svo.observers.window.evidence import ArrivalSet, SumRows, WindowEvidence, WindowSample
from svo.observers.window.weak_duality import DualSum, NoProof
from svo.observers.window_kernel import BASE, TIME, Sizes

BOUNDS_OF_S = "the bounds of s of its channels"
"""What a proof takes as given besides, in words."""

_BITS = 53  # of a float
_MOST_WORK = 1.5e9  # products of bits: a second; windows of 200 samples of an aircraft take a tenth of it


@dataclass(frozen=True, eq=False)
class WindowCertificate(WindowEvidence, Certificate):
    """Proof that no x, w, noise and Delta within their bounds explain the data of a window."""

    kind = "window"

    def verify(self) -> bool:
        """Check the proof in exact rational arithmetic; True only if it proves that the window is empty.

        An arrival set of which nothing is known is bounded first, by the readings of the window
        (`svo.observers.free_start`).

        False, and no error, also for intervals whose ends are in the wrong order.
        """
        if not _is_well_formed(self):
            return False
        try:
            return any(DualSum(stated).gap() > 0 for stated in _with_known_start(self))
        except NoProof:
            return False

    def resting_on(self, largest_at: int | None) -> WindowCertificate:
        """The same proof, whose arrival set rests on the largest set at a sample."""
        return replace(self, largest_at=largest_at)

    def premise(self, sample: int) -> str:
        known, alone = ("the readings of its window", " alone") if self.arrival.is_unknown else ("the arrival set", "")
        known += f" and {BOUNDS_OF_S}" if self._takes_bounds_of_s() else alone
        return known + started_again(self.largest_at, self.last, sample)

    def _takes_bounds_of_s(self) -> bool:
        """Whether bounds of s are taken as given: where they are known from the input they are checked."""
        of = self.samples if self.late else self.samples[:-1]
        return bool(self.owner.size) and any(_depends_on_x_or_w(s, self.n) for s in of)

    def model_data(self) -> tuple[ModelSample, ...]:
        """w of the last sample is no part of a window unless it enters the output there."""
        return tuple(
            ModelSample(s.stack, s.noise, (s.w_lower, s.w_upper) if self.late or k < self.last else None)
            for k, s in enumerate(self.samples, start=self.first)
        )

    def _newest_input_counts(self) -> bool:
        """Whether it enters the output, or an uncertainty that it drives does."""
        newest, n = self.samples[-1], self.n
        on_u, on_y = newest.stack[:, :, n : n + newest.u.size], newest.stack[1:, n:]
        shared = on_u[1:].any(axis=(1, 2)) & on_y.any(axis=(1, 2))
        return bool(on_u[:, n:].any() or shared.any())

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
        if not _is_well_formed(self) or self.arrival.is_unknown:
            return None
        try:
            return -DualSum(self, (sample - self.first, direction)).gap()
        except NoProof:
            return None


class OnWindow(Certificate):
    """A proof that rests on that of a window: it is about the same samples, under the same premise."""

    @abstractmethod
    def about(self) -> WindowCertificate:
        """The proof that this one rests on."""

    @property
    def samples(self) -> tuple[WindowSample, ...]:
        """Model and data of the window."""
        return self.about().samples

    def premise(self, sample: int) -> str:
        return self.about().premise(sample)

    def model_data(self) -> tuple[ModelSample, ...]:
        return self.about().model_data()

    def difference(self, last: int, log: Log) -> str | None:
        return self.about().difference(last, log)


def _depends_on_x_or_w(s: WindowSample, n: int) -> bool:
    """Whether the s of a channel does; without factors, whether an uncertainty is of anything else than the input."""
    of = s.stack[1:] if s.functional is None else s.functional
    return bool(of[..., :n].any() or of[..., n + s.u.size + 1 :].any())


def _with_known_start(c: WindowCertificate) -> Iterator[WindowCertificate]:
    """The certificate; without anything known of its arrival set, with what its first few, or more, readings say."""
    if not c.arrival.is_unknown:
        yield c
        return
    items = range(1, len(c.samples[0].stack))
    owned = [c.delta[c.owner == item] for item in items]
    if any(len(d) == 0 and s.stack[i].any() for i, d in zip(items, owned, strict=True) for s in c.samples):
        return  # nothing says how far its Delta goes
    delta = np.array([d[0] if len(d) else (0.0, 0.0) for d in owned]).reshape(-1, 2)
    units = c.units or Exponents.zero(
        c.n, *(np.size(v) for v in (c.samples[0].u, c.samples[0].y, c.samples[0].w_lower))
    )
    readings = [_normal_reading(s, units) for s in c.samples]
    for count in range(1, len(readings) + 1):
        found = state_bounds(readings[:count], delta, 0.0)
        if found is not None:
            lower, upper = (end * power(units.states) for end in found)
            if np.isfinite((lower, upper)).all():
                yield replace(c, arrival=ArrivalSet.box(lower, upper))


def _normal_reading(s: WindowSample, units: Exponents) -> Reading:
    """Model and data of a sample in normal form, in which the choice of an inverse does not depend on units."""
    u, y, w = (power(-e) for e in (units.inputs, units.outputs, units.disturbances))
    ends = s.w_lower * w, s.w_upper * w
    return Reading(s.stack * units.factor, s.u * u, s.y * y, s.noise * y, s.slack * y, *ends)


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
    if c.arrival.is_unknown and len(c.on_arrival):
        return False
    if c.units is not None and not c.units.are_usable:
        return False
    if any(s.remainder is not None and not (s.remainder >= 0.0).all() for s in c.samples):
        return False
    if not (c.sums is None or _sums_are_within(c, c.sums)) or _work(c) > _MOST_WORK:
        return False
    return bool(np.all((c.owner > 0) & (c.owner < len(c.samples[0].stack))))


def _holds(value: Any, shape: tuple[int, ...], kind: type, bounded: bool) -> bool:
    if not (isinstance(value, np.ndarray) and value.dtype == kind and value.shape == shape):
        return False
    return not bounded or bool(np.isfinite(value).all())


def _sum_bounds(sums: SumRows) -> list[tuple[Any, bool]]:
    return [(sums.lower, False), (sums.upper, False), (sums.on_sum, True)]


def _sums_are_within(c: WindowCertificate, sums: SumRows) -> bool:
    """Whether sums are over samples of the window that take part, of columns that there are, with bounds in order."""
    ny, nw = c.samples[0].y.size, c.samples[0].w_lower.size
    last = np.where(sums.column < ny, c.last, c.last - (not c.late))
    inside = (sums.column >= 0) & (sums.column < ny + nw) & (c.first <= sums.first) & (sums.first <= sums.last)
    return bool((inside & (sums.last <= last) & (sums.lower <= sums.upper)).all())


def _work(c: WindowCertificate) -> float:
    """About how many products of bits the exact sum takes, whose numbers grow with every sample."""
    bits = work = 0.0
    for s in reversed(c.samples):
        exponents = np.frexp(s.stack[s.stack != 0.0])[1]
        bits += _BITS + (float(exponents.max() - exponents.min()) if exponents.size else 0.0)
        work += bits * s.stack.size
    return work


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
    known = not c.arrival.is_unknown
    yield from ((v, (n,), real, known) for v in (c.arrival.box_lower, c.arrival.box_upper))
    yield c.arrival.rows, (na, n), real, True
    yield from ((v, (na,), real, False) for v in (c.arrival.lower, c.arrival.upper))
    yield c.on_arrival, (na,), real, True
    if c.units is not None:
        sizes = (("states", n), ("inputs", nu), ("outputs", ny), ("disturbances", nw))
        yield from ((getattr(c.units, name), (size,), np.int64, True) for name, size in sizes)
    if c.sums is not None:
        r = np.size(c.sums.on_sum)
        yield from ((v, (r,), np.int64, True) for v in (c.sums.column, c.sums.first, c.sums.last))
        yield from ((v, (r,), real, bounded) for v, bounded in _sum_bounds(c.sums))
    for s in c.samples:
        yield from (
            (v, (nq, length), real, True) for v, length in ((s.gain, rows), (s.functional, columns)) if v is not None
        )
        yield from ((v, (ny,), real, True) for v in (s.remainder,) if v is not None)
        yield s.stack, (np.size(head.stack) // (rows * columns), rows, columns), real, True
        yield s.u, (nu,), real, True
        yield s.y, (ny,), real, False
        yield from ((v, (ny,), real, True) for v in (s.noise, s.slack, s.on_output))
        yield from ((v, (nw,), real, True) for v in (s.w_lower, s.w_upper))
        yield from ((v, (nq,), real, True) for v in (s.s_lower, s.s_upper))
        yield s.lines, (nq, 4), real, True
        yield s.on_w, (nh,), real, True
        yield s.on_channel, (nq, 2), real, True


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

"""An uncertainty as a sum of channels gain functional', and a bound of what they leave out of it, entry by entry.

Complete pivoting, about a stack in its normal form. The pivot's row is divided by the largest odd number that divides
its entries, so that a product of rank one whose entries are floats comes out with factors that give it exactly.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from svo.observers.window_kernel.memory import UNIT
from svo.observers.window_kernel.short_rows import copy, fill
from svo.observers.window_kernel.sources import SOURCES

_LEFT_OVER = 1e-13  # of the largest entry: what is smaller gets no channel; it is bounded as a disturbance
_TOO_MUCH = 1e-12  # of the largest entry: left out by the channels of the typical schedule, it is an error
_SPLIT = 134217729.0  # 2^27 + 1


@njit(error_model="numpy")
def _pivot_of(rest):
    best, r, c = -1.0, 0, 0
    for i in range(rest.shape[0]):
        for j in range(rest.shape[1]):
            if abs(rest[i, j]) > best:
                best, r, c = abs(rest[i, j]), i, j
    return r, c


@njit(error_model="numpy")
def _odd_divisor(row):
    """The largest odd number that divides every entry of a row, times the power of two that puts it into [1, 2)."""
    divisor = np.int64(0)
    for value in row:
        if value == 0.0 or divisor == 1 or not np.isfinite(value):
            continue
        mantissa, _ = math.frexp(abs(value))
        other = np.int64(mantissa * 9007199254740992.0)
        while other % 2 == 0:
            other //= 2
        while other != 0:
            divisor, other = other, divisor % other
    mantissa, _ = math.frexp(float(divisor))
    return 2.0 * mantissa


@njit(error_model="numpy")
def _peel(rest, r, c, gain, functional):
    """One term more: its gain and functional; what is left, but for the pivot's row and column, where it is small."""
    unit = _odd_divisor(rest[r])
    for j in range(rest.shape[1]):
        functional[j] = rest[r, j] / unit
    for i in range(rest.shape[0]):
        gain[i] = rest[i, c] / functional[c]
    for i in range(rest.shape[0]):
        for j in range(rest.shape[1]):
            rest[i, j] = 0.0 if i == r or j == c else rest[i, j] - gain[i] * functional[j]


@njit(error_model="numpy")
def _factor(stacked, gain, functional):
    """Write a matrix as a sum of gain functional', one term a row of the two."""
    rest = stacked.copy()
    r, c = _pivot_of(rest)
    largest = abs(rest[r, c])
    for q in range(gain.shape[0]):
        fill(gain[q], 0.0)
        fill(functional[q], 0.0)
        if abs(rest[r, c]) > _LEFT_OVER * largest:
            _peel(rest, r, c, gain[q], functional[q])
            r, c = _pivot_of(rest)


@njit(error_model="numpy")
def _rounding_of_product(a, b, product):
    """a b - product, exactly (Dekker 1971)."""
    t = _SPLIT * a
    high_a = t - (t - a)
    t = _SPLIT * b
    high_b = t - (t - b)
    low_a, low_b = a - high_a, b - high_b
    return low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b)


@njit(error_model="numpy")
def _bound_rest(stacked, gain, functional, reach, left):
    """left += reach |stacked - sum of gain functional'|, rounded up; returns the largest entry of that difference.

    Each product and sum comes with its own rounding error, so that the difference is zero where it is exactly zero.
    """
    worst = 0.0
    for i in range(stacked.shape[0]):
        for j in range(stacked.shape[1]):
            total, errors, size = stacked[i, j], 0.0, 0.0
            for q in range(gain.shape[0]):
                product = gain[q, i] * functional[q, j]
                if product == 0.0:
                    continue
                rounding = _rounding_of_product(gain[q, i], functional[q, j], product)
                after = total - product
                part = after - total
                error = (total - (after - part)) - (product + part)
                total = after
                errors += error - rounding
                size += abs(error) + abs(rounding)
            rest = (abs(total + errors) + 8.0 * (gain.shape[0] + 1) * UNIT * size) * (1.0 + 8.0 * UNIT)
            worst = max(worst, rest)
            if rest > 0.0:
                left[i, j] = (left[i, j] + reach * rest) * (1.0 + 8.0 * UNIT)
    return worst


@njit(error_model="numpy")
def _largest_of(matrix):
    largest = 0.0
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            largest = max(largest, abs(matrix[i, j]))
    return largest


def _compile_factor_all(sources):
    @njit(cache=True, error_model="numpy")
    def factor_all(stack, owner, delta, gain, functional, left):
        """Channels of every uncertainty of a stack, and what they leave out of all, times |Delta|, entry by entry.

        False if an uncertainty has more rank than channels.
        """
        sources  # noqa: B018 - in the closure, so part of the cache's key
        for item in range(1, stack.shape[0]):
            if not np.any(owner == item) and np.any(stack[item]):
                return False
        for i in range(left.shape[0]):
            fill(left[i], 0.0)
        q = 0
        while q < owner.shape[0]:
            last = q
            while last < owner.shape[0] and owner[last] == owner[q]:
                last += 1
            item = stack[owner[q]]
            _factor(item, gain[q:last], functional[q:last])
            reach = max(abs(delta[q, 0]), abs(delta[q, 1]))
            worst = _bound_rest(item, gain[q:last], functional[q:last], reach, left)
            if not worst <= _TOO_MUCH * _largest_of(item):
                return False
            q = last
        return True

    return factor_all


factor_all = _compile_factor_all(SOURCES)


@njit(error_model="numpy")
def _repeats(stack, before):
    for item in range(1, stack.shape[0]):
        for i in range(stack.shape[1]):
            for j in range(stack.shape[2]):
                if stack[item, i, j] != before[item, i, j]:
                    return False
    return True


@njit(error_model="numpy")
def factor_sample(w, size, k):
    """The channels of sample k, those of the sample before where the stack is the same; False as `factor_all`."""
    s, v = k % (size.N + 1), k % (size.N + size.late)
    if k > 0 and _repeats(w.stack[s], w.stack[(k - 1) % (size.N + 1)]):
        then = (k - 1) % (size.N + size.late)
        for q in range(size.nq):
            copy(w.gain[v, q], w.gain[then, q])
            copy(w.functional[v, q], w.functional[then, q])
        for i in range(w.left.shape[1]):
            copy(w.left[v, i], w.left[then, i])
        w.is_left[v] = w.is_left[then]
        return True
    if not factor_all(w.stack[s], w.owner, w.delta, w.gain[v], w.functional[v], w.left[v]):
        return False
    w.is_left[v] = 1.0 if np.any(w.left[v]) else 0.0
    return True


@njit(error_model="numpy")
def left_out(w, size, k, row):
    """Bound of what the channels leave out of a row of [x(k+1); y(k)], over the present bounds of (x, u, 1, w)."""
    s, v = k % (size.N + 1), k % (size.N + size.late)
    if w.is_left[v] == 0.0:
        return 0.0
    left, n, nu = w.left[v, row], size.n, size.nu
    total = left[n + nu]
    for j in range(n):
        total += left[j] * w.mag[s, j]
    for j in range(nu):
        total += left[n + j] * abs(w.u[s, j])
    for j in range(size.nw):
        total += left[n + nu + 1 + j] * max(abs(w.w_lower[v, j]), abs(w.w_upper[v, j]))
    return total * (1.0 + 2.0 * (n + nu + size.nw + 8) * UNIT)


def channel_factors(stack, owner, delta):
    """Channels of the uncertainties of a stack in normal form, as the window uses them.

    Returns
    -------
    gain, functional : (nq, n + ny), (nq, n + nu + 1 + nw) arrays
    left : (n + ny, n + nu + 1 + nw) array
        Bound of what the channels leave out of all uncertainties together, times |Delta|, entry by entry.
    complete : bool
        Whether that is next to nothing.
    """
    gain = np.zeros((len(owner), stack.shape[1]))
    functional = np.zeros((len(owner), stack.shape[2]))
    left = np.zeros(stack.shape[1:])
    complete = factor_all(stack, owner, delta, gain, functional, left)
    return gain, functional, left, bool(complete)


def channel_count(item):
    """How many channels an uncertainty (n + ny, n + nu + 1 + nw) takes."""
    most = min(item.shape)
    stack, owner = np.stack([item, item]), np.ones(most, dtype=np.int64)
    gain, *_ = channel_factors(stack, owner, np.ones((most, 2)))
    return int(np.count_nonzero(gain.any(axis=1)))

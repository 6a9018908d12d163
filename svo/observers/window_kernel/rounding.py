"""How far the rounding of one sample reaches into later states, without the growth of powers of |A|.

The error of the state obeys e(k+1) = A e(k) + delta(k). Bounded entry by entry it grows as |A|^k does, which for a
stable plant of 20 states was 6e12 after 29 samples. So it is kept in turned coordinates besides, e = Q r with
|r| <= rho: the QR factorisation of A Q gives the next Q, and its triangle carries rho (Lohner's method, as in
Nedialkov, Jackson and Corliss, Applied Mathematics and Computation 105, 1999, section 6). The smaller bound holds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.memory import UNIT

_UP = 1.0 + 1e-12  # more than sums of nonnegative terms round


@njit(error_model="numpy")
def orthogonality(n):
    """More than a Householder factorisation misses by, relative to each column (Higham 2002, section 19.3)."""
    return 32.0 * (n + 8) ** 2 * UNIT


@njit(error_model="numpy")
def turn_frame(A, frame, turned, carry):
    """The next frame: ``turned`` is Q' and ``carry`` bounds |Q'^-1 A Q| for the present frame Q."""
    n = A.shape[0]
    tolerance = orthogonality(n)
    R = np.empty((n, n))
    length = np.zeros(n)
    for j in range(n):
        for i in range(n):
            value = 0.0
            for r in range(n):
                value += A[i, r] * frame[r, j]
            R[i, j] = value
            for r in range(n):
                length[j] += abs(A[i, r] * frame[r, j])
            turned[i, j] = 1.0 if i == j else 0.0
    v = np.empty(n)
    for j in range(n - 1):
        size = 0.0
        for i in range(j, n):
            size = max(size, abs(R[i, j]))
        if size == 0.0 or not np.isfinite(size):
            continue
        square = 0.0
        for i in range(j, n):
            v[i] = R[i, j] / size
            square += v[i] * v[i]
        norm = np.sqrt(square)
        square += norm * abs(v[j])
        v[j] += norm if v[j] >= 0.0 else -norm
        for c in range(j, n):
            value = 0.0
            for i in range(j, n):
                value += v[i] * R[i, c]
            value /= square
            for i in range(j, n):
                R[i, c] -= value * v[i]
        for i in range(n):
            value = 0.0
            for c in range(j, n):
                value += turned[i, c] * v[c]
            value /= square
            for c in range(j, n):
                turned[i, c] -= value * v[c]
    for i in range(n):
        for j in range(n):
            carry[i, j] = ((abs(R[i, j]) if i <= j else 0.0) + tolerance * length[j]) * _UP


@njit(error_model="numpy")
def carry_error(carry, turned, rho, fresh, rho_next):
    """Bounds of the next error in its frame, from those of the present one and the rounding ``fresh`` (n,)."""
    n = rho.shape[0]
    everything = 0.0
    for i in range(n):
        everything += fresh[i]
    for a in range(n):
        value = orthogonality(n) * everything
        for j in range(n):
            value += carry[a, j] * rho[j] + abs(turned[j, a]) * fresh[j]
        rho_next[a] = value * _UP


@njit(error_model="numpy")
def error_of(turned, rho, i):
    """Bound of entry i of the error."""
    value = 0.0
    for a in range(rho.shape[0]):
        value += abs(turned[i, a]) * rho[a]
    return value * _UP

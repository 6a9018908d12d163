"""Loops over short vectors, written out so that they compile quickly and vectorise."""

from __future__ import annotations

from numba import njit

from svo.observers.window_kernel.memory import FAST


@njit(fastmath=FAST, error_model="numpy")
def fill(target, value):
    for j in range(target.shape[0]):
        target[j] = value


@njit(fastmath=FAST, error_model="numpy")
def copy(target, source):
    for j in range(target.shape[0]):
        target[j] = source[j]


@njit(fastmath=FAST, error_model="numpy")
def add_rows(target, matrix, index, factor, count):
    """target += sum_q factor[q] matrix[index[q]], four rows a pass."""
    m = target.shape[0]
    q = 0
    while q + 3 < count:
        fa, fb, fc, fd = factor[q], factor[q + 1], factor[q + 2], factor[q + 3]
        ra, rb, rc, rd = matrix[index[q]], matrix[index[q + 1]], matrix[index[q + 2]], matrix[index[q + 3]]
        for j in range(m):
            target[j] += fa * ra[j] + fb * rb[j] + fc * rc[j] + fd * rd[j]
        q += 4
    while q < count:
        fa = factor[q]
        ra = matrix[index[q]]
        for j in range(m):
            target[j] += fa * ra[j]
        q += 1

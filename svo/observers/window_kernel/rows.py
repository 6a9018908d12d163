"""Rows of the window: scaled, with the states eliminated, widened by what the elimination can round."""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.factors import left_out
from svo.observers.window_kernel.memory import BASE, UNIT
from svo.observers.window_kernel.short_rows import copy, fill


@njit(error_model="numpy")
def midpoint(lower, upper):
    """Centre and half-width of an interval; the half-width is rounded up."""
    centre = 0.5 * lower + 0.5 * upper
    return centre, max(upper - centre, centre - lower) * (1.0 + 4.0 * UNIT)


@njit(error_model="numpy")
def place_row(w, i, s):
    """Bounds of row i of the sample in slot s, about the free response and widened by the rounding of its state."""
    row_v, row_c, xc, row_x, phi, mag, err = w.row_v, w.row_c, w.xc, w.row_x, w.phi, w.mag, w.err
    magnitude, lower, raw_lower, upper, raw_upper = w.magnitude, w.lower, w.raw_lower, w.upper, w.raw_upper
    offset, size, rounding = 0.0, row_v[i] + row_c[i], 0.0
    n = xc.shape[0]
    for j in range(n):
        c = row_x[i, j]
        offset += c * phi[s, j]
        size += abs(c) * mag[s, j]
        rounding += abs(c) * err[s, j]
    rounding += 2.0 * UNIT * (n + 8) * size
    magnitude[i] = 2.0 * size + 1.0
    lower[i] = max(raw_lower[i] - offset - rounding, -size - 1.0)
    upper[i] = min(raw_upper[i] - offset + rounding, size + 1.0)


@njit(error_model="numpy")
def clear_row(w, i):
    """A row that says nothing."""
    GT = w.GT
    fill(w.G[i], 0.0)
    for j in range(GT.shape[0]):
        GT[j, i] = 0.0
    fill(w.row_x[i], 0.0)
    w.row_v[i] = 0.0
    w.row_c[i] = 0.0
    w.raw_lower[i] = -np.inf
    w.raw_upper[i] = np.inf
    w.scale[i] = 0.0
    w.magnitude[i] = 1.0
    w.lower[i] = -1.0
    w.upper[i] = 1.0


@njit(error_model="numpy")
def set_row(w, psi, i, s, first, nv, floor):
    """Finish row i of the sample in slot s, whose state is psi z about its free response: the row's own variables
    stand in G[i, first:first+nv] as coefficients of the unscaled row; row_x, row_c and the raw bounds are set.
    Scales the row and eliminates the state."""
    g = w.G[i]
    n, Z = psi.shape
    w.row_v[i] = 0.0
    for j in range(first, first + nv):
        w.row_v[i] += abs(g[j])
    size = w.row_v[i]
    for j in range(n):
        size += abs(w.row_x[i, j]) * w.mag[s, j]
    scale = 1.0 / max(floor, 1e-6 * size, 1e-300)
    w.scale[i] = scale
    w.row_v[i] *= scale
    w.row_c[i] *= scale
    w.raw_lower[i] *= scale
    w.raw_upper[i] *= scale
    for j in range(first, first + nv):
        g[j] *= scale
    for r in range(n):
        w.row_x[i, r] *= scale
        c = w.row_x[i, r]
        if c != 0.0:
            for j in range(Z):
                g[j] += c * psi[r, j]
    for j in range(Z):
        w.GT[j, i] = g[j]
    place_row(w, i, s)


@njit(error_model="numpy")
def measure(w, size, k, eps):
    """The rows of all sensors at the newest sample k; NaN = missing."""
    for o in range(size.ny):
        measure_sensor(w, w.psi, size, k, o, eps)


@njit(error_model="numpy")
def measure_sensor(w, psi, size, k, o, eps):
    """Row C x + D u + c + F w + channels within the noise about y(k), widened by the slack; psi as in `set_row`."""
    n, nu, nw, ny, nq = size.n, size.nu, size.nw, size.ny, size.nq
    nv, nr = nw + nq, ny + size.nh + 2 * nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    m = w.stack[s, 0]
    i = size.na + s * nr + o
    clear_row(w, i)
    y, noise = w.y[s, o], w.noise[s, o]
    w.slack[s, o] = 0.0
    if np.isnan(y):
        return
    r = n + o
    known, magnitude = m[r, n + nu], abs(m[r, n + nu]) + abs(y) + noise
    for j in range(n):
        w.row_x[i, j] = m[r, j]
        magnitude += abs(m[r, j]) * w.mag[s, j]
    for j in range(nu):
        if m[r, n + j] != 0.0:
            known += m[r, n + j] * w.u[s, j]
            magnitude += abs(m[r, n + j] * w.u[s, j])
    if size.late == 1:
        for j in range(nw):
            coefficient = m[r, n + nu + 1 + j]
            w.G[i, first + j] = coefficient * w.vr[v, j]
            known += coefficient * w.vc[v, j]
            magnitude += abs(coefficient) * (abs(w.vc[v, j]) + w.vr[v, j])
        for q in range(nq):
            coefficient = w.gain[v, q, r]
            w.G[i, first + nw + q] = coefficient * w.vr[v, nw + q]
            known += coefficient * w.vc[v, nw + q]
            magnitude += abs(coefficient) * (abs(w.vc[v, nw + q]) + w.vr[v, nw + q])
    slack = eps * magnitude
    w.slack[s, o] = slack
    width = noise + slack + (left_out(w, size, k, r) if size.late == 1 else 0.0)
    w.raw_lower[i] = y - known - width
    w.raw_upper[i] = y - known + width
    w.row_c[i] = magnitude
    set_row(w, psi, i, s, first, nv if size.late == 1 else 0, noise + slack)


@njit(error_model="numpy")
def arrival_rows(w, size):
    """Rows of the template beyond the box on the state at the base."""
    s = w.clock[BASE] % (size.N + 1)
    n = size.n
    for i in range(size.na):
        clear_row(w, i)
        if i < size.nt - n:
            copy(w.row_x[i], w.T[n + i])
            w.raw_lower[i] = w.h_lower[n + i]
            w.raw_upper[i] = w.h_upper[n + i]
            w.row_c[i] = abs(w.raw_lower[i]) + abs(w.raw_upper[i])
            scale_arrival_row(w, i, s)


@njit(error_model="numpy")
def scale_arrival_row(w, i, s):
    """Scale an arrival row by its spread over the box of the base state, which is the row's own state."""
    n = w.xc.shape[0]
    spread, size = 0.0, 0.0
    for j in range(n):
        spread += abs(w.row_x[i, j]) * w.xr[j]
        size += abs(w.row_x[i, j]) * w.mag[s, j]
    scale = 1.0 / max(spread, 1e-6 * size, 1e-300)
    w.scale[i] = scale
    w.row_c[i] *= scale
    w.raw_lower[i] *= scale
    w.raw_upper[i] *= scale
    for j in range(n):
        w.row_x[i, j] *= scale
        w.G[i, j] = w.row_x[i, j] * w.xr[j]
        w.GT[j, i] = w.G[i, j]
    place_row(w, i, s)

"""How the window moves: the newest state advances, the base slides to its arrival set."""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.factors import left_out
from svo.observers.window_kernel.memory import BASE, FLOOR, PENDING, TIME, UNIT
from svo.observers.window_kernel.rounding import carry_error, error_of, turn_frame
from svo.observers.window_kernel.rows import arrival_rows, clear_row, midpoint, place_row
from svo.observers.window_kernel.short_rows import copy


@njit(error_model="numpy")
def _load_transition(w, size, k):
    """The maps of x(k) -> x(k+1) at the centres of v(k)."""
    n, nu, nw, nq = size.n, size.nu, size.nw, size.nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    m = w.stack[s, 0]
    for i in range(n):
        value, magnitude = m[i, n + nu], abs(m[i, n + nu])
        for j in range(n):
            w.A[s, i, j] = m[i, j]
        for j in range(nu):
            value += m[i, n + j] * w.u[s, j]
            magnitude += abs(m[i, n + j] * w.u[s, j])
        for j in range(nw):
            e = m[i, n + nu + 1 + j]
            value += e * w.vc[v, j]
            magnitude += abs(e) * (abs(w.vc[v, j]) + w.vr[v, j])
            w.inputs[s, i, j] = e * w.vr[v, j]
        for q in range(nq):
            g = w.gain[v, q, i]
            value += g * w.vc[v, nw + q]
            magnitude += abs(g) * (abs(w.vc[v, nw + q]) + w.vr[v, nw + q])
            w.inputs[s, i, nw + q] = g * w.vr[v, nw + q]
        w.drift[s, i] = value
        w.drift_mag[s, i] = magnitude


@njit(error_model="numpy")
def _respond(w, size, k):
    """Free response, magnitude and bound of the error of x(k+1), by rounding and by channels, from those of x(k)."""
    n = size.n
    s, t = k % (size.N + 1), (k + 1) % (size.N + 1)
    gamma = 2.0 * UNIT * (n + size.nu + size.nw + size.nq + 8)
    fresh = np.empty(n)
    for i in range(n):
        value, magnitude, error = w.drift[s, i], w.drift_mag[s, i], 0.0
        for j in range(n):
            a = w.A[s, i, j]
            value += a * w.phi[s, j]
            magnitude += abs(a) * w.mag[s, j]
            error += abs(a) * w.err[s, j]
        w.phi[t, i] = value
        w.mag[t, i] = magnitude
        w.terms[t, i] = magnitude
        fresh[i] = gamma * magnitude + left_out(w, size, k, i) + FLOOR
        w.err[t, i] = (error + fresh[i]) * (1.0 + 1e-12)
    carry_error(w.carry[s], w.frame[t], w.rho[s], fresh, w.rho[t])
    for i in range(n):
        error = error_of(w.frame[t], w.rho[t], i)
        if error < w.err[t, i]:
            w.err[t, i] = error


@njit(error_model="numpy")
def _limit_magnitude(w, t, i, spread):
    """|x_i| by its spread over the box, which does not grow as |A|^k does."""
    reach = (abs(w.phi[t, i]) + w.err[t, i] + spread) * (1.0 + 1e-12)
    if reach < w.mag[t, i]:
        w.mag[t, i] = reach


@njit(error_model="numpy")
def advance(w, size, k):
    """The newest state moves from k to k + 1."""
    n, nv = size.n, size.nw + size.nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    t = (k + 1) % (size.N + 1)
    _load_transition(w, size, k)
    turn_frame(w.A[s], w.frame[s], w.frame[t], w.carry[s])
    _respond(w, size, k)
    first = n + v * nv
    A, psi = w.A[s], w.psi
    column = np.empty(n)
    for j in range(psi.shape[1]):
        for i in range(n):
            value = 0.0
            for r in range(n):
                value += A[i, r] * psi[r, j]
            column[i] = value
        for i in range(n):
            psi[i, j] = column[i]
    for i in range(n):
        for j in range(nv):
            psi[i, first + j] += w.inputs[s, i, j]
    for i in range(n):
        spread = 0.0
        for j in range(n, psi.shape[1]):
            spread += abs(psi[i, j])
        w.from_v[t, i] = spread * (1.0 + 1e-12)
        for j in range(n):
            spread += abs(psi[i, j])
        _limit_magnitude(w, t, i, spread)


@njit(error_model="numpy")
def anchor(w, size):
    """Centre the base state in its box."""
    s = w.clock[BASE] % (size.N + 1)
    for j in range(size.n):
        w.xc[j], w.xr[j] = midpoint(w.h_lower[j], w.h_upper[j])
        w.phi[s, j] = w.xc[j]
        w.mag[s, j] = abs(w.xc[j]) + w.xr[j]
        w.terms[s, j] = w.mag[s, j]
        w.err[s, j] = 0.0
        w.rho[s, j] = 0.0


@njit(error_model="numpy")
def slide(w, size):
    """Drop the oldest samples: the state at base + block is what the arrival bounds say."""
    n, nv = size.n, size.nw + size.nq
    nr = size.ny + size.nh + 2 * size.nq
    base = w.clock[BASE]
    for k in range(base, base + size.block):
        _drop_columns(w, n + (k % (size.N + size.late)) * nv, nv)
        start = size.na + (k % (size.N + 1)) * nr
        for i in range(start, start + nr):
            clear_row(w, i)
    for i in range(size.nt):
        w.h_lower[i] = min(w.new_lower[i], w.new_upper[i])
        w.h_upper[i] = max(w.new_lower[i], w.new_upper[i])
    w.clock[BASE] = base + size.block
    w.clock[PENDING] = 0
    anchor(w, size)
    _rebuild(w, size)
    arrival_rows(w, size)


@njit(error_model="numpy")
def _drop_columns(w, first, count):
    G, GT, psi = w.G, w.GT, w.psi
    for j in range(first, first + count):
        for i in range(G.shape[0]):
            GT[j, i] = 0.0
            G[i, j] = 0.0
        for i in range(psi.shape[0]):
            psi[i, j] = 0.0


@njit(error_model="numpy")
def _rebuild(w, size):
    """Columns of the base state and bounds of all rows, after the base has moved."""
    clock, xr, scale, row_x, G, GT, A, psi = w.clock, w.xr, w.scale, w.row_x, w.G, w.GT, w.A, w.psi
    n = size.n
    nr = size.ny + size.nh + 2 * size.nq
    base, time = clock[BASE], clock[TIME]
    response = np.zeros((n, n))
    moved = np.zeros((n, n))
    for j in range(n):
        response[j, j] = xr[j]
    for k in range(base, time + 1):
        s = k % (size.N + 1)
        start = size.na + s * nr
        for i in range(start, start + nr):
            if scale[i] != 0.0:
                for j in range(n):
                    value = 0.0
                    for r in range(n):
                        value += row_x[i, r] * response[r, j]
                    G[i, j] = value
                    GT[j, i] = value
                place_row(w, i, s)
        if k < time:
            _respond(w, size, k)
            for i in range(n):
                for j in range(n):
                    value = 0.0
                    for r in range(n):
                        value += A[s, i, r] * response[r, j]
                    moved[i, j] = value
            t = (k + 1) % (size.N + 1)
            for i in range(n):
                copy(response[i], moved[i])
                spread = w.from_v[t, i]
                for j in range(n):
                    spread += abs(response[i, j])
                _limit_magnitude(w, t, i, spread)
    for i in range(n):
        for j in range(n):
            psi[i, j] = response[i, j]

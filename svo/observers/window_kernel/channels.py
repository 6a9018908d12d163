"""Channels of uncertainty: p = Delta s with s = f'(x, u, 1, w), bounded by two lines over s.

The lines are exact where s keeps one sign, and the exact convex hull over [l, r] where it does not.

A channel that reaches the output opens with its sample, any other with the transition from it, once u(k) is known.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.memory import UNIT
from svo.observers.window_kernel.rows import clear_row, midpoint, set_row
from svo.observers.window_kernel.short_rows import fill


@njit(error_model="numpy")
def reaches_output(w, size, k, q):
    """Whether channel q of sample k enters y(k)."""
    return np.any(w.gain[k % (size.N + size.late), q, size.n :])


@njit(error_model="numpy")
def known_part(w, size, k, q):
    """What u, the constant and w say of s = f'(x, u, 1, w): value without w, magnitude, centre and spread with it."""
    n, nu, nw = size.n, size.nu, size.nw
    s, v = k % (size.N + 1), k % (size.N + size.late)
    f = w.functional[v, q]
    known, magnitude, spread = f[n + nu], abs(f[n + nu]), 0.0
    for j in range(nu):
        known += f[n + j] * w.u[s, j]
        magnitude += abs(f[n + j] * w.u[s, j])
    centre = known
    for j in range(nw):
        fw = f[n + nu + 1 + j]
        if fw != 0.0:
            middle, half = midpoint(w.w_lower[v, j], w.w_upper[v, j])
            centre += fw * middle
            spread += abs(fw) * half
            magnitude += abs(fw) * (abs(middle) + half)
    return known, magnitude, centre, spread


@njit(error_model="numpy")
def bound_channels(w, size, k, reaching):
    """Bounds of s at sample k over the box of the variables; True if one leaves the sign of its s open.

    Of the channels that reach the output, the others having no part in the window yet; or of those others.
    """
    n, Z = w.psi.shape
    s, v = k % (size.N + 1), k % (size.N + size.late)
    some_open = False
    for q in range(size.nq):
        if reaches_output(w, size, k, q) != reaching:
            if reaching:
                w.s_lower[v, q], w.s_upper[v, q] = 0.0, 0.0
                fill(w.lines[v, q], 0.0)
            continue
        f = w.functional[v, q]
        _, magnitude, centre, spread = known_part(w, size, k, q)
        rounding, radius = 0.0, 0.0
        for j in range(n):
            centre += f[j] * w.phi[s, j]
            magnitude += abs(f[j]) * w.mag[s, j]
            rounding += abs(f[j]) * w.err[s, j]
        for j in range(Z):
            value = 0.0
            for r in range(n):
                value += f[r] * w.psi[r, j]
            radius += abs(value)
        rounding += 2.0 * UNIT * (Z + n + size.nu + size.nw + 8) * magnitude
        w.s_lower[v, q] = centre - spread - radius - rounding
        w.s_upper[v, q] = centre + spread + radius + rounding
        some_open = some_open or (radius > 0.0 and w.s_lower[v, q] < 0.0 < w.s_upper[v, q])
    return some_open


@njit(error_model="numpy")
def open_channels(w, size, k, reaching):
    """Variables and rows of the channels that reach the output at the newest sample k, or of the others."""
    for q in range(size.nq):
        if reaches_output(w, size, k, q) == reaching:
            _open_channel(w, size, k, q)


@njit(error_model="numpy")
def _open_channel(w, size, k, q):
    """Variable p = Delta s of channel q at the newest sample k: its box and, where s is not known, its two rows."""
    v = k % (size.N + size.late)
    lo, hi = w.delta[q, 0], w.delta[q, 1]
    low, high = w.s_lower[v, q], w.s_upper[v, q]
    p_low = min(min(lo * low, lo * high), min(hi * low, hi * high))
    p_high = max(max(lo * low, lo * high), max(hi * low, hi * high))
    widen = 2.0 * UNIT * max(abs(p_low), abs(p_high))
    w.vc[v, size.nw + q], w.vr[v, size.nw + q] = midpoint(p_low - widen, p_high + widen)
    channel_rows(w, w.psi, size, k, q)


@njit(error_model="numpy")
def channel_rows(w, psi, size, k, q):
    """The two rows of channel q at sample k over the present bounds of its s; psi as in `set_row`."""
    n, nu, nw = size.n, size.nu, size.nw
    nv, nr = nw + size.nq, size.ny + size.nh + 2 * size.nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    f = w.functional[v, q]
    known, magnitude, _, spread = known_part(w, size, k, q)
    unknown = spread > 0.0
    for j in range(n):
        unknown = unknown or f[j] != 0.0
    _draw_lines(w, v, q)
    for side in range(2):
        i = size.na + s * nr + size.ny + size.nh + 2 * q + side
        clear_row(w, i)
        if not unknown:
            continue
        sign = 1.0 - 2.0 * side
        slope, intercept = w.lines[v, q, 2 * side], w.lines[v, q, 2 * side + 1]
        bound = sign * (intercept + slope * known - w.vc[v, nw + q])
        for j in range(n):
            w.row_x[i, j] = -sign * slope * f[j]
        for j in range(nw):
            fw = f[n + nu + 1 + j]
            w.G[i, first + j] = -sign * slope * fw * w.vr[v, j]
            bound += sign * slope * fw * w.vc[v, j]
        w.G[i, first + nw + q] = sign * w.vr[v, nw + q]
        w.raw_upper[i] = bound
        w.row_c[i] = abs(intercept) + abs(slope) * magnitude + abs(w.vc[v, nw + q])
        set_row(w, psi, i, s, first, nv, w.vr[v, nw + q])


@njit(error_model="numpy")
def _draw_lines(w, v, q):
    """Lines over s in [l, r] that bound Delta s from above and below, exact where s has one sign."""
    lo, hi = w.delta[q, 0], w.delta[q, 1]
    low, high = w.s_lower[v, q], w.s_upper[v, q]
    line = w.lines[v, q]
    if low >= 0.0:
        line[0], line[1], line[2], line[3] = hi, 0.0, lo, 0.0
    elif high <= 0.0:
        line[0], line[1], line[2], line[3] = lo, 0.0, hi, 0.0
    else:
        slope = (hi * high - lo * low) / (high - low)
        rounding = 8.0 * UNIT * (abs(lo) + abs(hi) + abs(slope)) * max(high, -low)
        line[0], line[1] = slope, max(lo * low - slope * low, hi * high - slope * high) + rounding
        slope = (lo * high - hi * low) / (high - low)
        rounding = 8.0 * UNIT * (abs(lo) + abs(hi) + abs(slope)) * max(high, -low)
        line[2], line[3] = slope, min(hi * low - slope * low, lo * high - slope * high) - rounding

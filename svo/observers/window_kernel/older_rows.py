"""Rows of samples that are not the newest: a measurement that arrives late, a channel whose s is bounded anew."""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.channels import channel_rows
from svo.observers.window_kernel.memory import BASE
from svo.observers.window_kernel.rows import measure_sensor
from svo.observers.window_kernel.sources import SOURCES


@njit(error_model="numpy")
def _response(w, size, k):
    """The state at sample k over z, as `w.psi` is that of the newest."""
    n, nv = size.n, size.nw + size.nq
    psi = np.zeros(w.psi.shape)
    column = np.empty(n)
    for j in range(n):
        psi[j, j] = w.xr[j]
    for at in range(w.clock[BASE], k):
        s, first = at % (size.N + 1), n + (at % (size.N + size.late)) * nv
        A = w.A[s]
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
    return psi


def _compile_add_late(sources):
    @njit(cache=True, error_model="numpy")
    def add_late(w, size, k, y, eps):
        """Rows of the sensors in y that are not NaN, at sample k of the window; they must have been missing."""
        sources  # noqa: B018 - in the closure, so part of the cache's key
        psi, s = _response(w, size, k), k % (size.N + 1)
        for o in range(size.ny):
            if not np.isnan(y[o]):
                w.y[s, o] = y[o]
                measure_sensor(w, psi, size, k, o, eps)

    return add_late


add_late = _compile_add_late(SOURCES)


def _compile_redraw_channel(sources):
    @njit(cache=True, error_model="numpy")
    def redraw_channel(w, size, k, q, low, high):
        """The rows of channel q at sample k for s in [low, high], within its bounds; the box of p stays."""
        sources  # noqa: B018 - in the closure, so part of the cache's key
        v = k % (size.N + size.late)
        w.s_lower[v, q], w.s_upper[v, q] = low, high
        channel_rows(w, _response(w, size, k), size, k, q)

    return redraw_channel


redraw_channel = _compile_redraw_channel(SOURCES)

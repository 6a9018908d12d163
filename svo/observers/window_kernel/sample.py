"""One sample of data through the window: take it, open its variables, write its rows."""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.models.normal_form import ENORMOUS
from svo.observers.window_kernel.channels import bound_channels, open_channels, reaches_output
from svo.observers.window_kernel.factors import factor_sample
from svo.observers.window_kernel.memory import LARGEST, PENDING, STARTED, TIME, UNDECIDED
from svo.observers.window_kernel.motion import advance, anchor, slide
from svo.observers.window_kernel.programs import ALL, ARRIVAL, CHANNELS, solve_programs
from svo.observers.window_kernel.rows import clear_row, measure, midpoint, scale_arrival_row, set_row
from svo.observers.window_kernel.short_rows import copy, fill
from svo.observers.window_kernel.sources import SOURCES

FINE, SIGN_OPEN, BAD_INPUT, BAD_OUTPUT, BAD_MATRIX, RANK_ROSE, OUTGROWN = range(7)


@njit(error_model="numpy")
def _check_numbers(u, u_next, y, stack):
    """NaN and Inf have no place here, but for NaN in y (a missing sensor)."""
    for j in range(u.shape[0]):
        if not (np.isfinite(u[j]) and np.isfinite(u_next[j])):
            return BAD_INPUT
    for value in y:
        if np.isinf(value):
            return BAD_OUTPUT
    for item in range(stack.shape[0]):
        for row in range(stack.shape[1]):
            for value in stack[item, row]:
                if not np.isfinite(value):
                    return BAD_MATRIX
    return FINE


@njit(error_model="numpy")
def _store_sample(w, size, k, u, y, stack, noise):
    s = k % (size.N + 1)
    for item in range(size.ni):
        for row in range(stack.shape[1]):
            copy(w.stack[s, item, row], stack[item, row])
    copy(w.u[s], u)
    copy(w.y[s], y)
    copy(w.noise[s], noise)


@njit(error_model="numpy")
def _bound_disturbance(w, size, k, lower, upper):
    v = k % (size.N + size.late)
    copy(w.w_lower[v], lower)
    copy(w.w_upper[v], upper)


@njit(error_model="numpy")
def _open_disturbance(w, size, k):
    """Variables w(k) with their bounds, and the rows among them."""
    n, nw, ny, nq, nh = size.n, size.nw, size.ny, size.nq, size.nh
    nv, nr = nw + nq, ny + nh + 2 * nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    for j in range(nw):
        w.vc[v, j], w.vr[v, j] = midpoint(w.w_lower[v, j], w.w_upper[v, j])
    for h in range(nh):
        i = size.na + s * nr + ny + h
        clear_row(w, i)
        shift = 0.0
        for j in range(nw):
            w.G[i, first + j] = w.w_rows[h, j] * w.vr[v, j]
            shift += w.w_rows[h, j] * w.vc[v, j]
            w.row_c[i] += abs(w.w_rows[h, j] * w.vc[v, j])
        w.raw_lower[i] = w.w_rows_lower[h] - shift
        w.raw_upper[i] = w.w_rows_upper[h] - shift
        set_row(w, w.psi, i, s, first, nv, 0.0)


@njit(error_model="numpy")
def _enter(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper):
    error = _check_numbers(u, u_next, y, stack)
    if error != FINE:
        return error
    if w.clock[PENDING] == 1:
        slide(w, size)
    k = w.clock[TIME]
    new = k if first else k + 1
    opened = new if size.late == 1 else k
    if size.late == 1:
        _store_sample(w, size, new, u_next, y, stack, noise)
        _bound_disturbance(w, size, new, w_lower, w_upper)
    elif not first:
        _bound_disturbance(w, size, k, w_old_lower, w_old_upper)
    opens = size.late == 1 or not first
    if opens and not factor_sample(w, size, opened):
        return RANK_ROSE
    if size.late == 0:
        _store_sample(w, size, new, u_next, y, stack, noise)
    if first:
        return FINE
    copy(w.u[k % (size.N + 1)], u)
    return SIGN_OPEN if bound_channels(w, size, k, False) else FINE


@njit(error_model="numpy")
def _move(w, size, first):
    k = w.clock[TIME]
    if not first:
        if size.late == 0:
            _open_disturbance(w, size, k)
        open_channels(w, size, k, False)
        advance(w, size, k)
        k += 1
        w.clock[TIME] = k
    return SIGN_OPEN if size.late == 1 and bound_channels(w, size, k, True) else FINE


@njit(error_model="numpy")
def _settle(w, size, reaching, limit):
    """Tighten the bounds of those s whose sign is open."""
    k = w.clock[TIME]
    v = k % (size.N + size.late)
    for q in range(size.nq):
        if reaches_output(w, size, k, q) == reaching and w.s_lower[v, q] < 0.0 < w.s_upper[v, q]:
            for program in range(2 * q, 2 * q + 2):
                solve_programs(w, size, CHANNELS, program, program + 1, limit)


@njit(error_model="numpy")
def _is_bounded(w, size, k):
    """Whether the newest state, its inputs and the slack of its readings have bounds of use: no NaN, no infinity."""
    s, before = k % (size.N + 1), (k - 1) % (size.N + 1)
    for j in range(size.nu):
        if abs(w.u[s, j]) >= ENORMOUS or (k > 0 and abs(w.u[before, j]) >= ENORMOUS):
            return False
    for j in range(size.n):
        if not w.mag[s, j] < LARGEST:
            return False
    slack = 0.0
    for o in range(size.ny):
        slack += w.slack[s, o]
    return np.isfinite(slack)


@njit(error_model="numpy")
def _complete(w, size, eps):
    """False if the window has outgrown all bounds, and is of no more use."""
    k = w.clock[TIME]
    if size.late == 1:
        _open_disturbance(w, size, k)
        open_channels(w, size, k, True)
    measure(w, size, k, eps)
    w.clock[STARTED] = 1
    return _is_bounded(w, size, k)


def _compile_enter(sources):
    @njit(cache=True, error_model="numpy")
    def enter(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper):
        """Take the data of a sample: its transition from the newest one under u, and its measurement y.

        w_old bounds the disturbance of the transition; w that of the new sample, used where the output has it.
        Returns FINE, SIGN_OPEN (solve CHANNELS, of those that do not reach the output, before `move`), or an error
        that leaves the window as it was.
        """
        sources  # noqa: B018 - in the closure, so part of the cache's key
        return _enter(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper)

    return enter


enter = _compile_enter(SOURCES)


def _compile_move(sources):
    @njit(cache=True, error_model="numpy")
    def move(w, size, first):
        """The transition to the sample that `enter` took, with all that drives it.

        Returns FINE or SIGN_OPEN (solve CHANNELS, of those that reach the output, before `complete`).
        """
        sources  # noqa: B018 - in the closure, so part of the cache's key
        return _move(w, size, first)

    return move


move = _compile_move(SOURCES)


def _compile_complete(sources):
    @njit(cache=True, error_model="numpy")
    def complete(w, size, eps):
        """Write the rows of the sample that `move` went to; False if the window has outgrown all bounds."""
        sources  # noqa: B018 - in the closure, so part of the cache's key
        return _complete(w, size, eps)

    return complete


complete = _compile_complete(SOURCES)


def _compile_take(sources):
    @njit(cache=True, error_model="numpy")
    def take(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper, eps, limit):
        """A whole sample in one call: `enter`, `move`, `complete`, CHANNELS where signs are open, and ARRIVAL.

        Returns (what `enter` returns, or OUTGROWN; verdict; program that found the window empty or -1).
        """
        sources  # noqa: B018 - in the closure, so part of the cache's key
        code = _enter(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper)
        if code == SIGN_OPEN:
            _settle(w, size, False, limit)
        elif code != FINE:
            return code, UNDECIDED, -1
        if _move(w, size, first) == SIGN_OPEN:
            _settle(w, size, True, limit)
        if not _complete(w, size, eps):
            return OUTGROWN, UNDECIDED, -1
        verdict, program = solve_programs(w, size, ARRIVAL, 0, ALL, limit)
        return code, verdict, program

    return take


take = _compile_take(SOURCES)


def _compile_initialise(sources):
    @njit(cache=True, error_model="numpy")
    def initialise(w, size, rows, rows_lower, rows_upper):
        """Anchor an empty window at the arrival bounds h, with extra rows on the first state."""
        sources  # noqa: B018 - in the closure, so part of the cache's key
        fill(w.seen_base, -1)
        for r in range(w.G.shape[0]):
            clear_row(w, r)
        anchor(w, size)
        for j in range(size.n):
            w.psi[j, j] = w.xr[j]
            w.frame[0, j, j] = 1.0
        for r in range(rows.shape[0]):
            copy(w.row_x[r], rows[r])
            w.raw_lower[r] = rows_lower[r]
            w.raw_upper[r] = rows_upper[r]
            for b in (rows_lower[r], rows_upper[r]):
                w.row_c[r] += abs(b) if np.isfinite(b) else 0.0
            scale_arrival_row(w, r, 0)

    return initialise


initialise = _compile_initialise(SOURCES)

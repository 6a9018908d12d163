"""The programs that a window is asked: is it empty, what bounds the arrival state, the newest state, a channel."""

from __future__ import annotations

import numpy as np
from numba import njit

from svo.observers.window_kernel.channels import known_part
from svo.observers.window_kernel.dual_simplex import maximise
from svo.observers.window_kernel.memory import (
    BASE,
    CONSISTENT,
    EMPTY,
    EMPTY_CANDIDATE,
    OPTIMAL,
    PENDING,
    TIME,
    UNDECIDED,
    UNIT,
)
from svo.observers.window_kernel.short_rows import copy, fill
from svo.observers.window_kernel.sources import SOURCES

ARRIVAL, NEWEST, CHANNELS, QUERY = range(4)
ALL = 1 << 60  # programs: more than any task has


@njit(error_model="numpy")
def _arrival_cost(w, size, i, sign):
    """Objective sign T_i x(base + block) over z; returns its value at z = 0 and the rounding of both.

    Of a window that is not full yet, the newest state if it comes before.
    """
    n, nv = size.n, size.nw + size.nq
    base = w.clock[BASE]
    target = min(base + size.block, w.clock[TIME])
    t = target % (size.N + 1)
    costate, moved = np.zeros(n), np.zeros(n)
    constant, rounding = 0.0, 0.0
    for r in range(n):
        costate[r] = sign * w.T[i, r]
        constant += costate[r] * w.phi[t, r]
        rounding += abs(costate[r]) * w.err[t, r]
    fill(w.cost, 0.0)
    for k in range(target - 1, base - 1, -1):
        s, first = k % (size.N + 1), n + (k % (size.N + size.late)) * nv
        for r in range(n):
            rounding += 2.0 * UNIT * (n + 8) * abs(costate[r]) * w.terms[(k + 1) % (size.N + 1), r]
        A, inputs = w.A[s], w.inputs[s]
        for j in range(nv):
            for r in range(n):
                w.cost[first + j] += costate[r] * inputs[r, j]
        for j in range(n):
            moved[j] = 0.0
            for r in range(n):
                moved[j] += costate[r] * A[r, j]
        copy(costate, moved)
    for j in range(n):
        w.cost[j] = costate[j] * w.xr[j]
    return constant, rounding


@njit(error_model="numpy")
def _channel_cost(w, size, q, sign):
    """Objective sign s of channel q over the state; returns its value at z = 0 with w's share, and the rounding."""
    n, Z = w.psi.shape
    k = w.clock[TIME]
    s, v = k % (size.N + 1), k % (size.N + size.late)
    f = w.functional[v, q]
    _, magnitude, centre, spread = known_part(w, size, k, q)
    constant, rounding = sign * centre + spread, 0.0
    for r in range(n):
        constant += sign * f[r] * w.phi[s, r]
        magnitude += abs(f[r]) * w.mag[s, r]
        rounding += abs(f[r]) * w.err[s, r]
    for j in range(Z):
        value = 0.0
        for r in range(n):
            value += f[r] * w.psi[r, j]
        w.cost[j] = sign * value
    return constant, rounding + 2.0 * UNIT * (n + size.nu + size.nw + 8) * magnitude


@njit(error_model="numpy")
def _newest_cost(w, size, direction, sign):
    """Objective sign direction'x of the newest state; returns its value at z = 0 and the rounding."""
    s = w.clock[TIME] % (size.N + 1)
    psi, cost = w.psi, w.cost
    fill(cost, 0.0)
    constant, rounding = 0.0, 0.0
    for i in range(size.n):
        weight = sign * direction[i]
        if weight != 0.0:
            constant += weight * w.phi[s, i]
            rounding += abs(weight) * (w.err[s, i] + 2.0 * UNIT * (size.n + 8) * w.mag[s, i])
            for j in range(psi.shape[1]):
                cost[j] += weight * psi[i, j]
    return constant, rounding


@njit(error_model="numpy")
def _store_bound(lower, upper, i, side, bound):
    """Keep an outer bound of the pair (upper by side 0, lower by side 1)."""
    if side == 0:
        upper[i] = bound
    else:
        lower[i] = -bound


@njit(error_model="numpy")
def arrival_programs(size, base, time):
    """First and last (excluded) arrival program of a sample.

    The 2 nt supports of the state at base + block are spread over the last `block` samples before the slide; each
    is an outer bound by the data of its own sample. Before those, one program decides emptiness.
    """
    turn = time - base - (size.N - size.block + 1)
    if turn < 0:
        return 0, 1
    share = -(-2 * size.nt // size.block)
    first = min(turn * share, 2 * size.nt - 1)  # at least one program: every sample is decided
    return first, min(first + share, 2 * size.nt)


@njit(error_model="numpy")
def solve_programs(w, size, task, start, stop, limit):
    """See `solve`; for compiled callers."""
    base, time = w.clock[BASE], w.clock[TIME]
    verdict = UNDECIDED
    basis, begin, count = 0, 0, 0
    if task == ARRIVAL:
        begin, count = arrival_programs(size, base, time)
    elif task == NEWEST:
        basis, count = 2 * size.nt, 2 * size.nt
    elif task == CHANNELS:
        basis, count = 4 * size.nt, 2 * size.nq
    elif task == QUERY:
        basis, count = 4 * size.nt + 2 * size.nq, 1
    bounds_arrival = time - base > size.N - size.block
    v = time % (size.N + size.late)
    is_open = False
    for program in range(max(begin, start), min(stop, count)):
        i, side = program // 2, program % 2
        sign = 1.0 - 2.0 * side
        if task == CHANNELS:
            if side == 0 or program == start:  # both ends of an s that was open: its sign is a convention
                is_open = w.s_lower[v, i] < 0.0 and (side == 1 or w.s_upper[v, i] > 0.0)
            if not is_open:
                continue
        if task == NEWEST:
            constant, rounding = _newest_cost(w, size, w.T[i], sign)
        elif task == QUERY:
            constant, rounding = _newest_cost(w, size, w.query, sign)
        elif task == CHANNELS:
            constant, rounding = _channel_cost(w, size, i, sign)
        elif time > base:
            constant, rounding = _arrival_cost(w, size, i, sign)
        else:
            fill(w.cost, 0.0)
            w.cost[0] = 1.0
            constant, rounding = 0.0, 0.0
        outcome, value = maximise(w, size, basis + program, limit)
        bound = constant + value + rounding + 4.0 * UNIT * (abs(constant) + abs(value))
        if task == NEWEST:
            _store_bound(w.now_lower, w.now_upper, i, side, bound)
        elif task == QUERY:
            w.answer[0] = bound
        elif task == CHANNELS:
            known = w.s_upper[v, i] if side == 0 else -w.s_lower[v, i]
            _store_bound(w.s_lower[v], w.s_upper[v], i, side, min(bound, known))
        elif bounds_arrival:
            _store_bound(w.new_lower, w.new_upper, i, side, bound)
        if outcome == EMPTY:  # its bound is stored all the same: the proof may not hold
            return EMPTY_CANDIDATE, program
        if outcome == OPTIMAL:
            verdict = CONSISTENT
    if task == ARRIVAL and time - base == size.N and stop >= count:
        w.clock[PENDING] = 1
    return verdict, -1


def _compile_solve(sources):
    @njit(cache=True, error_model="numpy")
    def solve(w, size, task, start, stop, limit):
        """The programs of a task, numbers `start` to `stop` - 1: two a direction, upper bound first.

        ARRIVAL decides emptiness and, before a slide, bounds the state at base + block; NEWEST bounds the newest
        state in the template's directions, QUERY in the one that was asked for; CHANNELS tightens the bounds of s
        that leave its sign open. Returns (verdict, program that found the window empty or -1).
        """
        sources  # noqa: B018 - in the closure, so part of the cache's key
        return solve_programs(w, size, task, start, stop, limit)

    return solve


solve = _compile_solve(SOURCES)

"""Bounded dual simplex: maximise c'z over -1 <= z <= 1, lower <= G z <= upper.

Everything being boxed, any nonsingular basis is dual feasible after flipping bounds: there is no phase 1, and an
empty program shows itself with the multipliers that prove it. Whatever the pivots did, the value that leaves is
the weak-duality sum of the multipliers, rounded outward, hence an outer bound.
"""

from __future__ import annotations

from numba import njit

from svo.observers.window_kernel.basis import change_basis, cold, eliminate, prepare
from svo.observers.window_kernel.memory import (
    AT_CENTRE,
    AT_LOWER,
    AT_UPPER,
    BASIC,
    EMPTY,
    FAST,
    FEASIBILITY,
    GAP,
    LARGE_JITTER,
    LONG,
    OPTIMAL,
    PIVOTS,
    PROGRAMS,
    REFACTOR,
    REFACTORED,
    STOPPED,
    STOPS,
    UNIT,
)
from svo.observers.window_kernel.ratio_test import avoid_small_pivot, choose_entering, collect_breakpoints
from svo.observers.window_kernel.short_rows import add_rows, copy, fill


@njit(fastmath=FAST, error_model="numpy")
def _price_out(w, q, k):
    """Multipliers and reduced costs of the basis; nonbasic variables go to the bound that they like."""
    rows, cols, status, inverse, nu, d, c = w.rows[q], w.cols[q], w.status[q], w.inverse[q], w.nu, w.d, w.cost
    wk, G, at_upper = w.wk, w.G, w.at_upper
    for a in range(k):
        nu[a] = 0.0
    for b in range(k):
        cb = c[cols[b]]
        if cb != 0.0:
            for a in range(k):
                nu[a] += cb * inverse[b, a]
    copy(d, c)
    for a in range(k):
        wk[a] = -nu[a]
    add_rows(d, G, rows, wk, k)
    for b in range(k):
        d[cols[b]] = 0.0
    for a in range(k):
        at_upper[a] = 1 if nu[a] >= 0.0 else 0
    for j in range(d.shape[0]):
        if status[j] != BASIC:
            if d[j] > 0.0:
                status[j] = AT_UPPER
            elif d[j] < 0.0:
                status[j] = AT_LOWER


@njit(fastmath=FAST, error_model="numpy")
def _primal_point(w, q, k):
    """z and the row activities of the basis."""
    rows, cols, status, inverse, z, act = w.rows[q], w.cols[q], w.status[q], w.inverse[q], w.z, w.act
    candidate, move, GT, wk, upper, at_upper, lower = w.candidate, w.move, w.GT, w.wk, w.upper, w.at_upper, w.lower
    uk = w.uk
    m = 0
    for j in range(z.shape[0]):
        s = status[j]
        z[j] = -1.0 if s == AT_LOWER else (1.0 if s == AT_UPPER else 0.0)
        if z[j] != 0.0:
            candidate[m] = j
            move[m] = z[j]
            m += 1
    fill(act, 0.0)
    add_rows(act, GT, candidate, move, m)
    for a in range(k):
        i = rows[a]
        wk[a] = (upper[i] if at_upper[a] == 1 else lower[i]) - act[i]
    for b in range(k):
        value = 0.0
        for a in range(k):
            value += inverse[b, a] * wk[a]
        z[cols[b]] = value
        uk[b] = value
    add_rows(act, GT, cols, uk, k)


@njit(fastmath=FAST, error_model="numpy")
def _choose_leaving(w, q, k):
    """Largest violation in the exact steepest-edge norm, among rows within half of the worst.

    Returns (row or -1, basic position or -1, side, violation); side is +1 above the upper bound.
    """
    rows, cols, inverse, act, vio, lower, upper = w.rows[q], w.cols[q], w.inverse[q], w.act, w.vio, w.lower, w.upper
    G, wk, z = w.G, w.wk, w.z
    worst = 0.0
    for i in range(act.shape[0]):
        vio[i] = max(act[i] - upper[i], lower[i] - act[i])
    for a in range(k):
        vio[rows[a]] = 0.0
    for i in range(act.shape[0]):
        worst = max(worst, vio[i])
    best, leave_row, leave_col = 0.0, -1, -1
    if worst > FEASIBILITY:
        threshold = max(FEASIBILITY, 0.5 * worst)
        for i in range(act.shape[0]):
            v = vio[i]
            if v >= threshold:
                g = G[i]
                for a in range(k):
                    wk[a] = 0.0
                for b in range(k):
                    f = g[cols[b]]
                    if f != 0.0:
                        for a in range(k):
                            wk[a] += f * inverse[b, a]
                norm = 1.0
                for a in range(k):
                    norm += wk[a] * wk[a]
                if v * v > best * norm:
                    best = v * v / norm
                    leave_row = i
    for b in range(k):
        v = abs(z[cols[b]]) - 1.0
        if v > FEASIBILITY:
            norm = 0.0
            for a in range(k):
                norm += inverse[b, a] * inverse[b, a]
            if v * v > best * norm:
                best = v * v / norm
                leave_col = b
    if leave_col >= 0:
        value = z[cols[leave_col]]
        return -1, leave_col, (1.0 if value > 0.0 else -1.0), abs(value) - 1.0
    if leave_row >= 0:
        return leave_row, -1, (1.0 if act[leave_row] > upper[leave_row] else -1.0), vio[leave_row]
    return -1, -1, 1.0, 0.0


@njit(fastmath=FAST, error_model="numpy")
def _tableau_row(w, q, k, leave_row, leave_col):
    """alpha = row of the tableau over z, wk = the same over the active rows' bounds."""
    rows, cols, inverse, alpha, wk, G, uk = w.rows[q], w.cols[q], w.inverse[q], w.alpha, w.wk, w.G, w.uk
    if leave_col >= 0:
        for a in range(k):
            wk[a] = inverse[leave_col, a]
        fill(alpha, 0.0)
    else:
        for a in range(k):
            wk[a] = 0.0
        copy(alpha, G[leave_row])
        for b in range(k):
            f = G[leave_row, cols[b]]
            if f != 0.0:
                for a in range(k):
                    wk[a] += f * inverse[b, a]
    for a in range(k):
        uk[a] = -wk[a]
    add_rows(alpha, G, rows, uk, k)


@njit(fastmath=FAST, error_model="numpy")
def _move_point(w, q, k, flips, left, side):
    """Carry out the flips and the entering move on z, the activities and the bounds of active rows."""
    rows, cols, status, inverse, z, act, move = w.rows[q], w.cols[q], w.status[q], w.inverse[q], w.z, w.act, w.move
    moved, shift, candidate, alpha, GT, wk, at_upper = w.chosen, w.uk, w.candidate, w.alpha, w.GT, w.wk, w.at_upper
    lower, upper = w.lower, w.upper
    Z = z.shape[0]
    for a in range(k):
        shift[a] = 0.0
    m = 0
    for f in range(flips + 1):
        who = candidate[f]
        if who < Z:
            if f == flips:
                dz = -side * left / alpha[who]
            elif status[who] == AT_CENTRE:
                dz = -1.0 if side * alpha[who] > 0.0 else 1.0
                status[who] = AT_LOWER if dz < 0.0 else AT_UPPER
            elif status[who] == AT_UPPER:
                dz = -2.0
                status[who] = AT_LOWER
            else:
                dz = 2.0
                status[who] = AT_UPPER
            z[who] += dz
            moved[m] = who
            move[m] = dz
            m += 1
            g = GT[who]
            for a in range(k):
                shift[a] -= dz * g[rows[a]]
        else:
            a = who - Z
            i = rows[a]
            if f == flips:
                shift[a] += -side * left / wk[a]
            elif at_upper[a] == 1:
                shift[a] += lower[i] - upper[i]
                at_upper[a] = 0
            else:
                shift[a] += upper[i] - lower[i]
                at_upper[a] = 1
    for b in range(k):
        value = 0.0
        for a in range(k):
            value += inverse[b, a] * shift[a]
        z[cols[b]] += value
        moved[m] = cols[b]
        move[m] = value
        m += 1
    add_rows(act, GT, moved, move, m)


@njit(fastmath=FAST, error_model="numpy")
def _store_farkas(w, q, k, leave_row, side):
    """Multipliers of the rows that no point of the box satisfies together."""
    fill(w.farkas, 0.0)
    for a in range(k):
        w.farkas[w.rows[q, a]] = -side * w.wk[a]
    if leave_row >= 0:
        w.farkas[leave_row] = side


@njit(fastmath=FAST, error_model="numpy")
def _optimise(w, q, limit):
    """Bounded dual simplex from the basis of direction q; w.cost is maximised. Returns OPTIMAL, EMPTY or STOPPED."""
    d, alpha, nu, wk = w.d, w.alpha, w.nu, w.wk
    k = w.k[q]
    capacity = nu.shape[0]
    _price_out(w, q, k)
    _primal_point(w, q, k)
    since = 0
    pivots = 0
    outcome = STOPPED
    while True:
        if since >= REFACTOR:
            since = 0
            k = eliminate(w, q, k, k, 1e-11)
            _price_out(w, q, k)
            _primal_point(w, q, k)
        leave_row, leave_col, side, violation = _choose_leaving(w, q, k)
        if leave_row < 0 and leave_col < 0:
            outcome = OPTIMAL
            break
        if pivots >= limit or k + 1 >= capacity:
            break
        _tableau_row(w, q, k, leave_row, leave_col)
        m = collect_breakpoints(w, q, k, side)
        flips, left = choose_entering(w, m, violation)
        if flips < 0:
            _store_farkas(w, q, k, leave_row, side)
            outcome = EMPTY
            break
        flips, left = avoid_small_pivot(w, m, flips, left)
        pivots += 1
        since += 1
        enter = w.candidate[flips]
        theta = w.ratio[flips]
        _move_point(w, q, k, flips, left, side)
        if theta != 0.0:
            change = theta * side
            for j in range(d.shape[0]):
                d[j] -= change * alpha[j]
            for a in range(k):
                nu[a] -= change * wk[a]
        k = change_basis(w, q, k, leave_row, leave_col, enter, side, theta)
    w.k[q] = k
    w.clock[PIVOTS] += pivots
    w.clock[PROGRAMS] += 1
    return outcome


@njit(fastmath={"contract"}, error_model="numpy")
def _outer_value(w, q, k):
    """Weak-duality bound of max cost'z for the multipliers nu of the active rows, and a bound of its rounding."""
    rows, d, cost, nu, upper, lower, magnitude = w.rows[q], w.alpha, w.cost, w.nu, w.upper, w.lower, w.magnitude
    wk, G = w.wk, w.G
    copy(d, cost)
    size, value = 0.0, 0.0
    for j in range(d.shape[0]):
        size += abs(d[j])
    for a in range(k):
        i, m = rows[a], nu[a]
        value += m * (upper[i] if m > 0.0 else lower[i])
        size += abs(m) * magnitude[i]
        wk[a] = -m
    add_rows(d, G, rows, wk, k)
    for j in range(d.shape[0]):
        value += abs(d[j])
    return value, 2.0 * UNIT * (d.shape[0] + k + 8) * size


@njit(fastmath=FAST, error_model="numpy")
def _primal_value(w):
    """c'z of the basis that was last priced."""
    cost, z = w.cost, w.z
    value = 0.0
    for j in range(z.shape[0]):
        value += cost[j] * z[j]
    return value


@njit(fastmath={"contract"}, error_model="numpy")
def _farkas_gap(w):
    """How far the Farkas multipliers are from a proof, in floats: negative proves, up to rounding."""
    total, farkas, upper, lower, magnitude, G = w.alpha, w.farkas, w.upper, w.lower, w.magnitude, w.G
    fill(total, 0.0)
    value, size = 0.0, 0.0
    for i in range(farkas.shape[0]):
        f = farkas[i]
        if f != 0.0:
            value += f * (upper[i] if f > 0.0 else lower[i])
            size += abs(f) * magnitude[i]
            g = G[i]
            for j in range(total.shape[0]):
                total[j] += f * g[j]
    for j in range(total.shape[0]):
        value += abs(total[j])
    return value + UNIT * size


@njit(error_model="numpy")
def _largest_cost(w):
    scale = 0.0
    for j in range(w.true_cost.shape[0]):
        scale = max(scale, abs(w.true_cost[j]))
    return scale


@njit(error_model="numpy")
def _disturb_cost(w, factor):
    """The true cost, disturbed by so many times the jitter."""
    scale = _largest_cost(w)
    for j in range(w.true_cost.shape[0]):
        w.cost[j] = w.true_cost[j] + factor * scale * w.jitter[j]


@njit(error_model="numpy")
def _optimise_patiently(w, q, limit):
    """`_optimise`; what takes long goes on with a cost that is disturbed far more, and from there to the end.

    In a long window the cost of most variables is next to nothing, so most steps are short: large disturbances save
    three pivots of four. Any basis being dual feasible, the way back takes no phase of its own.
    """
    _disturb_cost(w, 1.0)
    begun = w.clock[PIVOTS]
    outcome = _optimise(w, q, min(limit, LONG))
    if outcome != STOPPED or limit <= LONG:
        return outcome
    _disturb_cost(w, LARGE_JITTER)
    outcome = _optimise(w, q, limit - LONG)
    if outcome != EMPTY:
        _disturb_cost(w, 1.0)
        outcome = _optimise(w, q, max(limit - (w.clock[PIVOTS] - begun), 0))
    return outcome


@njit(error_model="numpy")
def maximise(w, size, q, limit):
    """Outer bound of max cost'z over the window, from the basis of direction q. Returns (outcome, bound)."""
    prepare(w, size, q)
    copy(w.true_cost, w.cost)
    outcome = _optimise_patiently(w, q, limit)
    if outcome == EMPTY and _farkas_gap(w) >= 0.0:
        w.clock[REFACTORED] += 1
        w.k[q] = eliminate(w, q, w.k[q], w.k[q], 1e-6)
        outcome = _optimise_patiently(w, q, limit)
        if outcome == EMPTY and _farkas_gap(w) >= 0.0:
            cold(w, q)
            outcome = _optimise_patiently(w, q, limit)
            if outcome == EMPTY and _farkas_gap(w) >= 0.0:
                outcome = STOPPED
    if outcome == STOPPED:
        w.clock[STOPS] += 1
    copy(w.cost, w.true_cost)
    value, rounding = _outer_value(w, q, w.k[q])
    if outcome == OPTIMAL and value - _primal_value(w) > GAP * _largest_cost(w):
        # Breakpoints that the ratio test passed over as small, and multipliers that have drifted, cost the bound
        # something where rows are long and their bounds wide: the same basis, factored and priced anew.
        w.clock[REFACTORED] += 1
        w.k[q] = eliminate(w, q, w.k[q], w.k[q], 1e-11)
        if _optimise(w, q, min(limit, REFACTOR)) == OPTIMAL:
            again, again_rounding = _outer_value(w, q, w.k[q])
            if again + again_rounding < value + rounding:
                value, rounding = again, again_rounding
    return outcome, value + rounding

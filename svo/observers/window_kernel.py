"""Compiled kernel of the moving-horizon window: its rows, and the bounded dual simplex that decides them.

A window holds the samples base .. t. Its variables are the state at the base and v(k) = (w(k), p(k)) of
every sample, p being one scalar a channel of uncertainty; later states are eliminated. All variables are
scaled to [-1, 1] about their centres, so the program is always

    maximise c'z   subject to   -1 <= z <= 1,   lower <= G z <= upper.

Everything being boxed, any nonsingular basis is dual feasible after flipping bounds: there is no phase 1, and
an empty window shows itself with the multipliers that prove it. Whatever the pivots did, the value that leaves
is the weak-duality sum of the multipliers, rounded outward, hence an outer bound.

One file on purpose: a cached compiled caller does not notice a change of a callee in another file.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np
from numba import njit, types
from numba.experimental import structref

FAST = {"nnan", "nsz", "reassoc", "contract"}
UNIT = 1.1102230246251565e-16  # unit roundoff
FEASIBILITY = 1e-9  # violation of a scaled row or variable that counts as none
SMALL_PIVOT = 1e-6
REFACTOR = 60  # pivots between refactorisations
PIVOT_LIMIT = 2000

AT_LOWER, AT_UPPER, BASIC, AT_CENTRE = 0, 1, 2, 3
OPTIMAL, EMPTY, STOPPED = 0, 1, 2
CONSISTENT, EMPTY_CANDIDATE, UNDECIDED = 0, 1, 2

# -- memory ------------------------------------------------------------------------------------------------

# sizes: n states, nu inputs, nw disturbances, ny sensors, nq channels, nh rows on w, nt template directions,
# na rows on the arrival state besides its box, ni items of a stack, N steps that the window holds at most, of which
# it drops `block` at once, K largest basis, late = 1 if the output depends on w or a channel
Sizes = namedtuple("Sizes", "n nu nw ny nq nh nt na ni N block K late")

CLOCK = ("base", "time", "pending", "started", "pivots", "stops", "programs", "refactored")
BASE, TIME, PENDING, STARTED, PIVOTS, STOPS, PROGRAMS, REFACTORED = range(8)

# Every array of a window: its shape by the letters of `_lengths` (S samples, V slots of variables, Z variables,
# R rows, Q directions, X rows and P columns of a stack, v variables of a slot, J = Z + K).
FLOATS = {
    # the program, and the bound of sum |G| + |bound| of a row
    "G": "RZ", "GT": "ZR", "lower": "R", "upper": "R", "magnitude": "R",
    # rows as they entered, scaled: coefficients of the own state, sum of |own variables|, of |terms in the bounds|,
    # bounds before the state
    "row_x": "Rn", "row_v": "R", "row_c": "R", "raw_lower": "R", "raw_upper": "R", "scale": "R",
    # newest state over z; per sample: state at z = 0, bound of |x|, bound of the rounding error
    "psi": "nZ", "phi": "Sn", "mag": "Sn", "err": "Sn",
    # per sample: A, the drift at the centres and its magnitude, the columns [E, channels] scaled
    "A": "Snn", "drift": "Sn", "drift_mag": "Sn", "inputs": "Snv",
    # centres and half-widths of v and of the arrival state
    "vc": "Vv", "vr": "Vv", "xc": "n", "xr": "n",
    # template, arrival bounds of T x at the base, the next ones (at base + block) that wait for the slide, box of the newest state
    "T": "tn", "h_lower": "t", "h_upper": "t", "new_lower": "t", "new_upper": "t", "box_lower": "n", "box_upper": "n",
    # data as given, for proofs
    "stack": "SiXP", "u": "Su", "y": "Sy", "noise": "Sy", "slack": "Sy", "w_lower": "Vw", "w_upper": "Vw",
    # channels: stacked uncertainty = gain functional', what was known of s, and the two lines over s that bound p
    # (slope, intercept; above, then below)
    "gain": "VqX", "functional": "VqP", "s_lower": "Vq", "s_upper": "Vq", "lines": "Vq4",
    # fixed: Delta bounds of the channels, rows on w
    "delta": "q2", "w_rows": "hw", "w_rows_lower": "h", "w_rows_upper": "h",
    # one basis inverse a direction; multipliers of an empty window
    "inverse": "QKK", "farkas": "R",
    # tiny fixed change of the cost, against cycling
    "jitter": "Z",
    # scratch of the simplex
    "nu": "K", "d": "Z", "z": "Z", "act": "R", "vio": "R", "alpha": "Z", "wk": "K", "uk": "K", "cost": "Z", "true_cost": "Z",
    "ratio": "J", "pivot": "J", "drop": "J", "move": "J", "M": "KL", "T2": "KK",
}  # fmt: skip
INTEGERS = {
    "clock": "8", "rows": "QK", "cols": "QK", "k": "Q", "seen_base": "Q", "status": "QZ",
    "candidate": "J", "chosen": "J", "at_upper": "K", "owner": "q",
}  # fmt: skip


def _lengths(size: Sizes) -> dict[str, int]:
    v, r = size.nw + size.nq, size.ny + size.nh + 2 * size.nq
    S, V = size.N + 1, size.N + size.late
    Z, X = size.n + V * v, size.n + size.ny
    return {
        "n": size.n, "u": size.nu, "w": size.nw, "y": size.ny, "q": size.nq, "h": size.nh, "t": size.nt, "i": size.ni,
        "v": v, "S": S, "V": V, "Z": Z, "R": size.na + S * r, "Q": 2 * size.nt + 2 * size.n + 2 * size.nq, "X": X,
        "P": X - size.ny + size.nu + 1 + size.nw, "K": size.K, "L": size.K + size.n, "J": Z + size.K,
        "2": 2, "4": 4, "8": 8,
    }  # fmt: skip


def allocate(size: Sizes) -> dict[str, Any]:
    """Zeroed arrays of a window, by name."""
    length = _lengths(size)
    tables = ((FLOATS, np.float64), (INTEGERS, np.int64))
    return {k: np.zeros([length[c] for c in shape], dtype=kind) for table, kind in tables for k, shape in table.items()}


@structref.register
class WindowType(types.StructRef):
    """Numba's type of a window: one pointer to named arrays."""


class Window(structref.StructRefProxy):
    """The arrays of a window, as compiled code takes them."""


def _array_type(kind: Any, shape: str) -> Any:
    return types.Array(kind, len(shape), "C")


structref.define_boxing(WindowType, Window)
WINDOW = WindowType(
    [(k, _array_type(types.float64, s)) for k, s in FLOATS.items()]
    + [(k, _array_type(types.int64, s)) for k, s in INTEGERS.items()]
)

def _constructor_text() -> str:
    """Source of the compiled constructor: it must name every array, so it is written from the tables."""
    names = [*FLOATS, *INTEGERS]
    lines = [f"def _construct({', '.join(names)}):", "    w = structref.new(WINDOW)", *(f"    w.{k} = {k}" for k in names)]
    return "\n".join([*lines, "    return w"])


# under this file's name and in its globals, so that Numba caches it with the rest
exec(compile(_constructor_text(), __file__, "exec"), globals())
_construct = njit(cache=True)(globals()["_construct"])


# -- linear algebra on short rows --------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST)
def _fill(target, value):
    for j in range(target.shape[0]):
        target[j] = value


@njit(cache=True, fastmath=FAST)
def _copy(target, source):
    for j in range(target.shape[0]):
        target[j] = source[j]


@njit(cache=True, fastmath=FAST)
def _add_rows(target, matrix, index, factor, count):
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


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _eliminate(w, q, p, c, threshold):
    """Basis inverse of direction q from p candidate rows and c candidate columns, as many as pivot.

    Arrival-state columns stand in where columns are short. What does not pivot leaves the basis.
    """
    rows, cols, status, inverse, M, T = w.rows[q], w.cols[q], w.status[q], w.inverse[q], w.M, w.T2
    row_of, used, xc, G = w.candidate, w.chosen, w.xc, w.G
    n = xc.shape[0]
    nc = c
    if p > c:
        for j in range(n):
            if status[j] != BASIC:
                cols[nc] = j
                nc += 1
    for a in range(p):
        g = G[rows[a]]
        for b in range(nc):
            M[a, b] = g[cols[b]]
        for b in range(p):
            T[a, b] = 0.0
        T[a, a] = 1.0
    for a in range(p):
        used[a] = 0
    k = 0
    for b in range(nc):
        row_of[b] = -1
        if k == p:
            continue
        r, best = -1, threshold
        for a in range(p):
            if used[a] == 0 and abs(M[a, b]) > best:
                r, best = a, abs(M[a, b])
        if r < 0:
            continue
        used[r] = 1
        row_of[b] = r
        k += 1
        scale = 1.0 / M[r, b]
        for j in range(b, nc):
            M[r, j] *= scale
        for j in range(p):
            T[r, j] *= scale
        for a in range(p):
            factor = M[a, b]
            if a != r and factor != 0.0:
                for j in range(b, nc):
                    M[a, j] -= factor * M[r, j]
                for j in range(p):
                    T[a, j] -= factor * T[r, j]
    for b in range(nc):
        if row_of[b] >= 0:
            status[cols[b]] = BASIC
        elif status[cols[b]] == BASIC:
            status[cols[b]] = AT_CENTRE
    kept = 0
    for b in range(nc):
        r = row_of[b]
        if r >= 0:
            at = 0
            for a in range(p):
                if used[a] == 1:
                    inverse[kept, at] = T[r, a]
                    at += 1
            cols[kept] = cols[b]
            kept += 1
    at = 0
    for a in range(p):
        if used[a] == 1:
            rows[at] = rows[a]
            at += 1
    return k


# -- bounded dual simplex ----------------------------------------------------------------------------------


@njit(cache=True, fastmath=FAST, error_model="numpy")
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
    _copy(d, c)
    for a in range(k):
        wk[a] = -nu[a]
    _add_rows(d, G, rows, wk, k)
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


@njit(cache=True, fastmath=FAST, error_model="numpy")
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
    _fill(act, 0.0)
    _add_rows(act, GT, candidate, move, m)
    for a in range(k):
        i = rows[a]
        wk[a] = (upper[i] if at_upper[a] == 1 else lower[i]) - act[i]
    for b in range(k):
        value = 0.0
        for a in range(k):
            value += inverse[b, a] * wk[a]
        z[cols[b]] = value
        uk[b] = value
    _add_rows(act, GT, cols, uk, k)


@njit(cache=True, fastmath=FAST, error_model="numpy")
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


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _tableau_row(w, q, k, leave_row, leave_col):
    """alpha = row of the tableau over z, wk = the same over the active rows' bounds."""
    rows, cols, inverse, alpha, wk, G, uk = w.rows[q], w.cols[q], w.inverse[q], w.alpha, w.wk, w.G, w.uk
    if leave_col >= 0:
        for a in range(k):
            wk[a] = inverse[leave_col, a]
        _fill(alpha, 0.0)
    else:
        for a in range(k):
            wk[a] = 0.0
        _copy(alpha, G[leave_row])
        for b in range(k):
            f = G[leave_row, cols[b]]
            if f != 0.0:
                for a in range(k):
                    wk[a] += f * inverse[b, a]
    for a in range(k):
        uk[a] = -wk[a]
    _add_rows(alpha, G, rows, uk, k)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _collect_breakpoints(w, q, k, side):
    """Breakpoints of the dual step: where a reduced cost or a multiplier changes its sign."""
    status, rows, z, alpha, candidate, ratio = w.status[q], w.rows[q], w.z, w.alpha, w.candidate, w.ratio
    pivot, drop, d, wk, at_upper, nu, upper, lower = w.pivot, w.drop, w.d, w.wk, w.at_upper, w.nu, w.upper, w.lower
    Z = z.shape[0]
    m = 0
    for j in range(Z):
        x = side * alpha[j]
        if abs(x) > 1e-9:
            s = status[j]
            if s == AT_CENTRE:
                candidate[m], ratio[m], pivot[m], drop[m] = j, 0.0, abs(x), abs(x)
                m += 1
            elif s != BASIC and (x > 0.0) == (s == AT_UPPER):
                candidate[m], ratio[m], pivot[m], drop[m] = j, max(d[j] / x, 0.0), abs(x), 2.0 * abs(x)
                m += 1
    for a in range(k):
        x = side * wk[a]
        if abs(x) > 1e-9 and (x > 0.0) == (at_upper[a] == 1):
            i = rows[a]
            candidate[m], ratio[m], pivot[m] = Z + a, max(nu[a] / x, 0.0), abs(x)
            drop[m] = abs(x) * (upper[i] - lower[i])
            m += 1
    return m


@njit(cache=True, fastmath=FAST)
def _swap(w, a, b):
    w.candidate[a], w.candidate[b] = w.candidate[b], w.candidate[a]
    w.ratio[a], w.ratio[b] = w.ratio[b], w.ratio[a]
    w.pivot[a], w.pivot[b] = w.pivot[b], w.pivot[a]
    w.drop[a], w.drop[b] = w.drop[b], w.drop[a]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _choose_entering(w, m, violation):
    """Bound-flipping ratio test: pass breakpoints while the violation stays positive.

    Weighted quickselect over the ratios; ties go to the largest pivot. Returns (flips, violation left at the
    entering breakpoint); candidates [0, flips) flip and candidate[flips] enters. flips = -1: nothing stops the
    step, so the program is empty.
    """
    drop, ratio, pivot = w.drop, w.ratio, w.pivot
    total = 0.0
    for j in range(m):
        total += drop[j]
    if total < violation:
        return -1, violation - total
    first, last = 0, m
    left = violation
    while last - first > 1:
        mid = (first + last) >> 1
        x1, x2, x3 = ratio[first], ratio[mid], ratio[last - 1]
        cut = max(min(x1, x2), min(max(x1, x2), x3))
        below, here, above = first, first, last
        sum_below, sum_equal = 0.0, 0.0
        while here < above:
            r = ratio[here]
            if r < cut:
                sum_below += drop[here]
                if below != here:
                    _swap(w, below, here)
                below += 1
                here += 1
            elif r > cut:
                above -= 1
                _swap(w, here, above)
            else:
                sum_equal += drop[here]
                here += 1
        if sum_below > left:
            last = below
        elif sum_below + sum_equal >= left:
            left -= sum_below
            first, last = below, above
            break
        else:
            left -= sum_below + sum_equal
            first = above
    while True:
        if first >= last:  # rounding of the sums: the last breakpoint enters
            first = last - 1
            left = min(left + drop[first], drop[first])
            return first, max(left, 0.0)
        big = first
        for j in range(first + 1, last):
            if pivot[j] > pivot[big]:
                big = j
        if big != first:
            _swap(w, first, big)
        if drop[first] >= left:
            return first, max(left, 0.0)
        left -= drop[first]
        first += 1


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _avoid_small_pivot(w, m, flips, left):
    """Where the entering pivot is tiny, take a larger one with nearly the same ratio.

    The reduced costs that this leaves slightly infeasible are repaired by flips at the next pricing.
    """
    pivot, ratio, drop = w.pivot, w.ratio, w.drop
    if pivot[flips] >= SMALL_PIVOT:
        return flips, left
    reach = ratio[flips] + 1e-9
    best = -1
    for j in range(flips + 1, m):
        if ratio[j] <= reach and pivot[j] > SMALL_PIVOT and (best < 0 or pivot[j] > pivot[best]):
            best = j
    if best >= 0:
        _swap(w, flips, best)
        return flips, left
    floor = ratio[flips] - 1e-9
    for j in range(flips):
        if ratio[j] >= floor and pivot[j] > SMALL_PIVOT and (best < 0 or pivot[j] > pivot[best]):
            best = j
    if best >= 0:
        left += drop[best]
        _swap(w, best, flips - 1)
        return flips - 1, left
    return flips, left


@njit(cache=True, fastmath=FAST, error_model="numpy")
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
    _add_rows(act, GT, moved, move, m)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _change_basis(w, q, k, leave_row, leave_col, enter, side, theta):
    """Border, shrink, or exchange a row or a column of the basis inverse; returns its new size."""
    rows, cols, status, K, wk, uk, z, GT = w.rows[q], w.cols[q], w.status[q], w.inverse[q], w.wk, w.uk, w.z, w.GT
    alpha, nu, at_upper, d = w.alpha, w.nu, w.at_upper, w.d
    Z = z.shape[0]
    if enter < Z:
        g = GT[enter]
        for b in range(k):
            value = 0.0
            for a in range(k):
                value += K[b, a] * g[rows[a]]
            uk[b] = value
    if leave_col < 0 and enter < Z:
        inv = 1.0 / alpha[enter]
        for b in range(k):
            f = uk[b] * inv
            for a in range(k):
                K[b, a] += f * wk[a]
            K[b, k] = -f
        for a in range(k):
            K[k, a] = -wk[a] * inv
        K[k, k] = inv
        rows[k], cols[k], nu[k] = leave_row, enter, theta * side
        at_upper[k] = 1 if side > 0.0 else 0
        d[enter] = 0.0
        status[enter] = BASIC
        return k + 1
    if leave_col < 0:
        at = enter - Z
        inv = 1.0 / wk[at]
        for b in range(k):
            f = K[b, at] * inv
            for a in range(k):
                K[b, a] -= f * wk[a]
            K[b, at] = f
        rows[at], nu[at] = leave_row, theta * side
        at_upper[at] = 1 if side > 0.0 else 0
        return k
    left = cols[leave_col]
    if enter < Z:
        inv = 1.0 / uk[leave_col]
        for a in range(k):
            K[leave_col, a] *= inv
        for b in range(k):
            f = uk[b]
            if b != leave_col and f != 0.0:
                for a in range(k):
                    K[b, a] -= f * K[leave_col, a]
        cols[leave_col] = enter
        d[enter] = 0.0
        status[enter] = BASIC
    else:
        at = enter - Z
        inv = 1.0 / K[leave_col, at]
        for b in range(k):
            f = K[b, at] * inv
            if b != leave_col and f != 0.0:
                for a in range(k):
                    K[b, a] -= f * K[leave_col, a]
        k -= 1
        if leave_col != k:
            for a in range(k + 1):
                K[leave_col, a] = K[k, a]
            cols[leave_col] = cols[k]
        if at != k:
            for b in range(k):
                K[b, at] = K[b, k]
            rows[at] = rows[k]
            nu[at] = nu[k]
            at_upper[at] = at_upper[k]
    status[left] = AT_UPPER if side > 0.0 else AT_LOWER
    d[left] = theta * side
    z[left] = side
    return k


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _store_farkas(w, q, k, leave_row, side):
    """Multipliers of the rows that no point of the box satisfies together."""
    _fill(w.farkas, 0.0)
    for a in range(k):
        w.farkas[w.rows[q, a]] = -side * w.wk[a]
    if leave_row >= 0:
        w.farkas[leave_row] = side


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _solve(w, q, limit):
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
            k = _eliminate(w, q, k, k, 1e-11)
            _price_out(w, q, k)
            _primal_point(w, q, k)
        leave_row, leave_col, side, violation = _choose_leaving(w, q, k)
        if leave_row < 0 and leave_col < 0:
            outcome = OPTIMAL
            break
        if pivots >= limit or k + 1 >= capacity:
            break
        _tableau_row(w, q, k, leave_row, leave_col)
        m = _collect_breakpoints(w, q, k, side)
        flips, left = _choose_entering(w, m, violation)
        if flips < 0:
            _store_farkas(w, q, k, leave_row, side)
            outcome = EMPTY
            break
        flips, left = _avoid_small_pivot(w, m, flips, left)
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
        k = _change_basis(w, q, k, leave_row, leave_col, enter, side, theta)
    w.k[q] = k
    w.clock[PIVOTS] += pivots
    w.clock[PROGRAMS] += 1
    return outcome


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _outer_value(w, q, k):
    """Weak-duality bound of max cost'z for the multipliers nu of the active rows, rounded outward."""
    rows, d, cost, nu, upper, lower, magnitude = w.rows[q], w.alpha, w.cost, w.nu, w.upper, w.lower, w.magnitude
    wk, G = w.wk, w.G
    _copy(d, cost)
    size, value = 0.0, 0.0
    for j in range(d.shape[0]):
        size += abs(d[j])
    for a in range(k):
        i, m = rows[a], nu[a]
        value += m * (upper[i] if m > 0.0 else lower[i])
        size += abs(m) * magnitude[i]
        wk[a] = -m
    _add_rows(d, G, rows, wk, k)
    for j in range(d.shape[0]):
        value += abs(d[j])
    return value + 2.0 * UNIT * (d.shape[0] + k + 8) * size


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _farkas_gap(w):
    """How far the Farkas multipliers are from a proof, in floats: negative proves, up to rounding."""
    total, farkas, upper, lower, magnitude, G = w.alpha, w.farkas, w.upper, w.lower, w.magnitude, w.G
    _fill(total, 0.0)
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


# -- rows of the window ------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _centre(lower, upper):
    """Centre and half-width of an interval; the half-width is rounded up."""
    centre = 0.5 * lower + 0.5 * upper
    return centre, max(upper - centre, centre - lower) * (1.0 + 4.0 * UNIT)


@njit(cache=True, error_model="numpy")
def _place_row(w, i, s):
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


@njit(cache=True, error_model="numpy")
def _clear_row(w, i):
    """A row that says nothing."""
    GT = w.GT
    _fill(w.G[i], 0.0)
    for j in range(GT.shape[0]):
        GT[j, i] = 0.0
    _fill(w.row_x[i], 0.0)
    w.row_v[i] = 0.0
    w.row_c[i] = 0.0
    w.raw_lower[i] = -np.inf
    w.raw_upper[i] = np.inf
    w.scale[i] = 0.0
    w.magnitude[i] = 1.0
    w.lower[i] = -1.0
    w.upper[i] = 1.0


@njit(cache=True, error_model="numpy")
def _set_row(w, i, s, first, nv, floor):
    """Finish row i of the sample in slot s: its own variables stand in G[i, first:first+nv] as coefficients of
    the unscaled row; row_x, row_c and the raw bounds are set. Scales the row and eliminates the state."""
    g = w.G[i]
    n, Z = w.psi.shape
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
                g[j] += c * w.psi[r, j]
    for j in range(Z):
        w.GT[j, i] = g[j]
    _place_row(w, i, s)


@njit(cache=True, error_model="numpy")
def _pivot_of(rest):
    best, r, c = -1.0, 0, 0
    for i in range(rest.shape[0]):
        for j in range(rest.shape[1]):
            if abs(rest[i, j]) > best:
                best, r, c = abs(rest[i, j]), i, j
    return r, c


@njit(cache=True, error_model="numpy")
def _peel(rest, r, c, gain, functional):
    """Subtract gain functional' and clear the pivot's row and column, which it cancels exactly."""
    for i in range(rest.shape[0]):
        for j in range(rest.shape[1]):
            rest[i, j] = 0.0 if i == r or j == c else rest[i, j] - gain[i] * functional[j]


@njit(cache=True, error_model="numpy")
def _factor(stacked, gain, functional):
    """Write a matrix as a sum of gain functional', one term a row of the two; returns what is left over, relatively."""
    rest = stacked.copy()
    r, c = _pivot_of(rest)
    largest = abs(rest[r, c])
    for q in range(gain.shape[0]):
        _fill(gain[q], 0.0)
        _fill(functional[q], 0.0)
        if abs(rest[r, c]) > 1e-13 * largest:
            for a in range(rest.shape[0]):
                gain[q, a] = rest[a, c] / rest[r, c]
            _copy(functional[q], rest[r])
            _peel(rest, r, c, gain[q], functional[q])
            r, c = _pivot_of(rest)
    return abs(rest[r, c]) / largest if largest > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _factor_all(stack, owner, gain, functional):
    """Channels of every uncertainty of a stack; False if one has more rank than channels."""
    q = 0
    while q < owner.shape[0]:
        last = q
        while last < owner.shape[0] and owner[last] == owner[q]:
            last += 1
        if _factor(stack[owner[q]], gain[q:last], functional[q:last]) > 1e-12:
            return False
        q = last
    return True


def channel_factors(stack, owner):
    """Gains (nq, n + ny) and functionals (nq, n + nu + 1 + nw) of the channels, as the window uses them."""
    gain = np.zeros((len(owner), stack.shape[1]))
    functional = np.zeros((len(owner), stack.shape[2]))
    _factor_all(stack, owner, gain, functional)
    return gain, functional


@njit(cache=True, error_model="numpy")
def _open_slot(w, size, k):
    """Variables v(k) = (w(k), p(k)) with their bounds, and the rows among v(k) and x(k)."""
    n, nu, nw, ny, nq, nh = size.n, size.nu, size.nw, size.ny, size.nq, size.nh
    nv, nr = nw + nq, ny + nh + 2 * nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    for j in range(nw):
        w.vc[v, j], w.vr[v, j] = _centre(w.w_lower[v, j], w.w_upper[v, j])
    for h in range(nh):
        i = size.na + s * nr + ny + h
        _clear_row(w, i)
        shift = 0.0
        for j in range(nw):
            w.G[i, first + j] = w.w_rows[h, j] * w.vr[v, j]
            shift += w.w_rows[h, j] * w.vc[v, j]
            w.row_c[i] += abs(w.w_rows[h, j] * w.vc[v, j])
        w.raw_lower[i] = w.w_rows_lower[h] - shift
        w.raw_upper[i] = w.w_rows_upper[h] - shift
        _set_row(w, i, s, first, nv, 0.0)
    for q in range(nq):
        _open_channel(w, size, k, q)


@njit(cache=True, error_model="numpy")
def _known_part(w, size, k, q):
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
            middle, half = _centre(w.w_lower[v, j], w.w_upper[v, j])
            centre += fw * middle
            spread += abs(fw) * half
            magnitude += abs(fw) * (abs(middle) + half)
    return known, magnitude, centre, spread


@njit(cache=True, error_model="numpy")
def _bound_channels(w, size, k):
    """Bounds of every s at sample k over the box of the variables; True if one leaves the sign of its s open."""
    n, Z = w.psi.shape
    s, v = k % (size.N + 1), k % (size.N + size.late)
    some_open = False
    for q in range(size.nq):
        f = w.functional[v, q]
        _, magnitude, centre, spread = _known_part(w, size, k, q)
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


@njit(cache=True, error_model="numpy")
def _open_channel(w, size, k, q):
    """Variable p = Delta s of channel q at sample k: its box and, where s is not known, its two rows."""
    n, nu, nw = size.n, size.nu, size.nw
    nv, nr = nw + size.nq, size.ny + size.nh + 2 * size.nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    f = w.functional[v, q]
    known, magnitude, _, spread = _known_part(w, size, k, q)
    unknown = spread > 0.0
    for j in range(n):
        unknown = unknown or f[j] != 0.0
    _draw_lines(w, v, q)
    lo, hi = w.delta[q, 0], w.delta[q, 1]
    low, high = w.s_lower[v, q], w.s_upper[v, q]
    p_low = min(min(lo * low, lo * high), min(hi * low, hi * high))
    p_high = max(max(lo * low, lo * high), max(hi * low, hi * high))
    widen = 2.0 * UNIT * max(abs(p_low), abs(p_high))
    w.vc[v, nw + q], w.vr[v, nw + q] = _centre(p_low - widen, p_high + widen)
    for side in range(2):
        i = size.na + s * nr + size.ny + size.nh + 2 * q + side
        _clear_row(w, i)
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
        _set_row(w, i, s, first, nv, w.vr[v, nw + q])


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _respond(w, size, k):
    """Free response, magnitude and rounding bound of x(k+1) from those of x(k)."""
    n = size.n
    s, t = k % (size.N + 1), (k + 1) % (size.N + 1)
    gamma = 2.0 * UNIT * (n + size.nu + size.nw + size.nq + 8)
    for i in range(n):
        value, magnitude, error = w.drift[s, i], w.drift_mag[s, i], 0.0
        for j in range(n):
            a = w.A[s, i, j]
            value += a * w.phi[s, j]
            magnitude += abs(a) * w.mag[s, j]
            error += abs(a) * w.err[s, j]
        w.phi[t, i] = value
        w.mag[t, i] = magnitude
        w.err[t, i] = (error + gamma * magnitude) * (1.0 + 1e-12)


@njit(cache=True, error_model="numpy")
def _advance(w, size, k):
    """The newest state moves from k to k + 1."""
    n, nv = size.n, size.nw + size.nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    _load_transition(w, size, k)
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


@njit(cache=True, error_model="numpy")
def _measure(w, size, k, eps):
    """Rows C x + D u + c + F w + channels within the noise about y(k), widened by the slack; NaN = missing."""
    n, nu, nw, ny, nq = size.n, size.nu, size.nw, size.ny, size.nq
    nv, nr = nw + nq, ny + size.nh + 2 * nq
    s, v = k % (size.N + 1), k % (size.N + size.late)
    first = n + v * nv
    m = w.stack[s, 0]
    for o in range(ny):
        i = size.na + s * nr + o
        _clear_row(w, i)
        y, noise = w.y[s, o], w.noise[s, o]
        w.slack[s, o] = 0.0
        if np.isnan(y):
            continue
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
        w.raw_lower[i] = y - known - noise - slack
        w.raw_upper[i] = y - known + noise + slack
        w.row_c[i] = magnitude
        _set_row(w, i, s, first, nv if size.late == 1 else 0, noise + slack)


@njit(cache=True, error_model="numpy")
def _arrival_rows(w, size):
    """Rows of the template beyond the box on the state at the base."""
    s = w.clock[BASE] % (size.N + 1)
    n = size.n
    for i in range(size.na):
        _clear_row(w, i)
        if i < size.nt - n:
            _copy(w.row_x[i], w.T[n + i])
            w.raw_lower[i] = w.h_lower[n + i]
            w.raw_upper[i] = w.h_upper[n + i]
            w.row_c[i] = abs(w.raw_lower[i]) + abs(w.raw_upper[i])
            _scale_arrival_row(w, i, s)


@njit(cache=True, error_model="numpy")
def _scale_arrival_row(w, i, s):
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
    _place_row(w, i, s)


@njit(cache=True, error_model="numpy")
def _anchor(w, size):
    """Centre the base state in its box."""
    s = w.clock[BASE] % (size.N + 1)
    for j in range(size.n):
        w.xc[j], w.xr[j] = _centre(w.h_lower[j], w.h_upper[j])
        w.phi[s, j] = w.xc[j]
        w.mag[s, j] = abs(w.xc[j]) + w.xr[j]
        w.err[s, j] = 0.0


@njit(cache=True, error_model="numpy")
def _slide(w, size):
    """Drop the oldest samples: the state at base + block is what the arrival bounds say."""
    n, nv = size.n, size.nw + size.nq
    nr = size.ny + size.nh + 2 * size.nq
    base = w.clock[BASE]
    for k in range(base, base + size.block):
        _drop_columns(w, n + (k % (size.N + size.late)) * nv, nv)
        start = size.na + (k % (size.N + 1)) * nr
        for i in range(start, start + nr):
            _clear_row(w, i)
    for i in range(size.nt):
        w.h_lower[i] = min(w.new_lower[i], w.new_upper[i])
        w.h_upper[i] = max(w.new_lower[i], w.new_upper[i])
    w.clock[BASE] = base + size.block
    w.clock[PENDING] = 0
    _anchor(w, size)
    _rebuild(w, size)
    _arrival_rows(w, size)


@njit(cache=True, error_model="numpy")
def _drop_columns(w, first, count):
    G, GT, psi = w.G, w.GT, w.psi
    for j in range(first, first + count):
        for i in range(G.shape[0]):
            GT[j, i] = 0.0
            G[i, j] = 0.0
        for i in range(psi.shape[0]):
            psi[i, j] = 0.0


@njit(cache=True, error_model="numpy")
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
                _place_row(w, i, s)
        if k < time:
            _respond(w, size, k)
            for i in range(n):
                for j in range(n):
                    value = 0.0
                    for r in range(n):
                        value += A[s, i, r] * response[r, j]
                    moved[i, j] = value
            for i in range(n):
                _copy(response[i], moved[i])
    for i in range(n):
        for j in range(n):
            psi[i, j] = response[i, j]


# -- programs over the window ------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _cold(w, q):
    w.k[q] = 0
    _fill(w.status[q], AT_CENTRE)


@njit(cache=True, error_model="numpy")
def _prepare(w, size, q):
    """Carry the basis of direction q over to the present window: what was dropped since leaves it."""
    base, base_then = w.clock[BASE], w.seen_base[q]
    w.seen_base[q] = base
    if base == base_then:
        return
    if base_then < 0:
        _cold(w, q)
        return
    n, nv = size.n, size.nw + size.nq
    nr = size.ny + size.nh + 2 * size.nq
    S, V = size.N + 1, size.N + size.late
    dropped = base - base_then
    status, rows, cols = w.status[q], w.rows[q], w.cols[q]
    p, c = 0, 0
    touched = False
    for a in range(w.k[q]):
        i = rows[a]
        age = ((i - size.na) // nr - base_then) % S  # samples since base_then, for rows of samples
        if i >= size.na and age < dropped:
            touched = True
        else:
            touched = touched or i < size.na
            rows[p] = i
            p += 1
    for b in range(w.k[q]):
        j = cols[b]
        if j >= n and ((j - n) // nv - base_then) % V < dropped:
            touched = True
        else:
            touched = touched or j < n
            cols[c] = j
            c += 1
    for j in range(n, status.shape[0]):
        if ((j - n) // nv - base_then) % V < dropped:
            status[j] = AT_CENTRE
    if touched:
        w.k[q] = _eliminate(w, q, p, c, 1e-6)


@njit(cache=True, error_model="numpy")
def maximise(w, size, q, limit):
    """Outer bound of max cost'z over the window, from the basis of direction q. Returns (outcome, bound)."""
    cost, jitter = w.cost, w.jitter
    _prepare(w, size, q)
    scale = 0.0
    for j in range(cost.shape[0]):
        scale = max(scale, abs(cost[j]))
    for j in range(cost.shape[0]):
        w.true_cost[j] = cost[j]
        cost[j] += scale * jitter[j]
    outcome = _solve(w, q, limit)
    if outcome == EMPTY and _farkas_gap(w) >= 0.0:
        w.clock[REFACTORED] += 1
        w.k[q] = _eliminate(w, q, w.k[q], w.k[q], 1e-6)
        outcome = _solve(w, q, limit)
        if outcome == EMPTY and _farkas_gap(w) >= 0.0:
            _cold(w, q)
            outcome = _solve(w, q, limit)
            if outcome == EMPTY and _farkas_gap(w) >= 0.0:
                outcome = STOPPED
    if outcome == STOPPED:
        w.clock[STOPS] += 1
    _copy(cost, w.true_cost)
    return outcome, _outer_value(w, q, w.k[q])


@njit(cache=True, error_model="numpy")
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
        rounding += abs(costate[r]) * (w.err[t, r] + 2.0 * UNIT * (size.block * (n + 8)) * w.mag[t, r])
    _fill(w.cost, 0.0)
    for k in range(target - 1, base - 1, -1):
        s, first = k % (size.N + 1), n + (k % (size.N + size.late)) * nv
        A, inputs = w.A[s], w.inputs[s]
        for j in range(nv):
            for r in range(n):
                w.cost[first + j] += costate[r] * inputs[r, j]
        for j in range(n):
            moved[j] = 0.0
            for r in range(n):
                moved[j] += costate[r] * A[r, j]
        _copy(costate, moved)
    for j in range(n):
        w.cost[j] = costate[j] * w.xr[j]
    return constant, rounding


@njit(cache=True, error_model="numpy")
def _channel_cost(w, size, q, sign):
    """Objective sign s of channel q over the state; returns its value at z = 0 with w's share, and the rounding."""
    n, Z = w.psi.shape
    k = w.clock[TIME]
    s, v = k % (size.N + 1), k % (size.N + size.late)
    f = w.functional[v, q]
    _, magnitude, centre, spread = _known_part(w, size, k, q)
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


@njit(cache=True, error_model="numpy")
def _newest_cost(w, size, i, sign):
    """Objective sign x_i of the newest state; returns its value at z = 0 and the rounding."""
    s = w.clock[TIME] % (size.N + 1)
    for j in range(w.psi.shape[1]):
        w.cost[j] = sign * w.psi[i, j]
    return sign * w.phi[s, i], w.err[s, i] + 2.0 * UNIT * (size.n + 8) * w.mag[s, i]


@njit(cache=True, error_model="numpy")
def _store_bound(lower, upper, i, side, bound):
    """Keep an outer bound of the pair (upper by side 0, lower by side 1)."""
    if side == 0:
        upper[i] = bound
    else:
        lower[i] = -bound


ARRIVAL, NEWEST, CHANNELS = range(3)


@njit(cache=True, error_model="numpy")
def solve(w, size, task, start, limit):
    """The programs of a task, from number `start` on: two a direction, upper bound first.

    ARRIVAL decides emptiness and, once the window is full, bounds the state at base + block; NEWEST bounds the newest
    state; CHANNELS tightens the bounds of s that leave its sign open. Returns (verdict, program that found the
    window empty or -1).
    """
    base, time = w.clock[BASE], w.clock[TIME]
    full = time - base == size.N
    verdict = UNDECIDED
    first, count = 0, 2 * size.nt if full else 1
    if task == NEWEST:
        first, count = 2 * size.nt, 2 * size.n
    elif task == CHANNELS:
        first, count = 2 * size.nt + 2 * size.n, 2 * size.nq
    v = time % (size.N + size.late)
    for program in range(start, count):
        i, side = program // 2, program % 2
        sign = 1.0 - 2.0 * side
        if task == CHANNELS and not (w.s_lower[v, i] < 0.0 < w.s_upper[v, i]):
            continue
        if task == NEWEST:
            constant, rounding = _newest_cost(w, size, i, sign)
        elif task == CHANNELS:
            constant, rounding = _channel_cost(w, size, i, sign)
        elif time > base:
            constant, rounding = _arrival_cost(w, size, i, sign)
        else:
            _fill(w.cost, 0.0)
            w.cost[0] = 1.0
            constant, rounding = 0.0, 0.0
        outcome, value = maximise(w, size, first + program, limit)
        if outcome == EMPTY:
            return EMPTY_CANDIDATE, program
        if outcome == OPTIMAL:
            verdict = CONSISTENT
        bound = constant + value + rounding + 4.0 * UNIT * (abs(constant) + abs(value))
        if task == NEWEST:
            _store_bound(w.box_lower, w.box_upper, i, side, bound)
        elif task == CHANNELS:
            _store_bound(w.s_lower[v], w.s_upper[v], i, side, min(bound, w.s_upper[v, i] if side == 0 else -w.s_lower[v, i]))
        elif full:
            _store_bound(w.new_lower, w.new_upper, i, side, bound)
    if task == ARRIVAL and full:
        w.clock[PENDING] = 1
    return verdict, -1


# -- one sample --------------------------------------------------------------------------------------------

FINE, SIGN_OPEN, BAD_INPUT, BAD_OUTPUT, BAD_MATRIX, RANK_ROSE = range(6)


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _store_sample(w, size, k, u, y, stack, noise):
    s = k % (size.N + 1)
    for item in range(size.ni):
        for row in range(stack.shape[1]):
            _copy(w.stack[s, item, row], stack[item, row])
    _copy(w.u[s], u)
    _copy(w.y[s], y)
    _copy(w.noise[s], noise)


@njit(cache=True, error_model="numpy")
def _bound_disturbance(w, size, k, lower, upper):
    v = k % (size.N + size.late)
    _copy(w.w_lower[v], lower)
    _copy(w.w_upper[v], upper)


@njit(cache=True, error_model="numpy")
def enter(w, size, first, u, u_next, y, stack, noise, w_old_lower, w_old_upper, w_lower, w_upper):
    """Take the data of a sample: its transition from the newest one under u, and its measurement y.

    w_old bounds the disturbance of the transition; w that of the new sample, used where the output has it.
    Returns FINE, SIGN_OPEN (solve CHANNELS before `complete`), or an error that leaves the window as it was.
    """
    error = _check_numbers(u, u_next, y, stack)
    if error != FINE:
        return error
    if w.clock[PENDING] == 1:
        _slide(w, size)
    k = w.clock[TIME]
    new = k if first else k + 1
    if not first:
        _copy(w.u[k % (size.N + 1)], u)
    opened = new if size.late == 1 else k
    if size.late == 1:
        _store_sample(w, size, new, u_next, y, stack, noise)
        _bound_disturbance(w, size, new, w_lower, w_upper)
    elif not first:
        _bound_disturbance(w, size, k, w_old_lower, w_old_upper)
    v = opened % (size.N + size.late)
    if size.late == 1 or not first:
        if not _factor_all(w.stack[opened % (size.N + 1)], w.owner, w.gain[v], w.functional[v]):
            return RANK_ROSE
    if size.late == 0:
        _store_sample(w, size, new, u_next, y, stack, noise)
    elif not first:
        _advance(w, size, k)
        w.clock[TIME] = new
    if size.late == 0 and first:
        return FINE
    return SIGN_OPEN if _bound_channels(w, size, opened) else FINE


@njit(cache=True, error_model="numpy")
def complete(w, size, first, eps):
    """Write the rows of the sample that `enter` took."""
    k = w.clock[TIME]
    if size.late == 1:
        _open_slot(w, size, k)
    elif not first:
        _open_slot(w, size, k)
        _advance(w, size, k)
        k += 1
        w.clock[TIME] = k
    _measure(w, size, k, eps)
    w.clock[STARTED] = 1


@njit(cache=True, error_model="numpy")
def initialise(w, size, rows, rows_lower, rows_upper):
    """Anchor an empty window at the arrival bounds h, with extra rows on the first state."""
    _fill(w.seen_base, -1)
    for r in range(w.G.shape[0]):
        _clear_row(w, r)
    _anchor(w, size)
    for j in range(size.n):
        w.psi[j, j] = w.xr[j]
    for r in range(rows.shape[0]):
        _copy(w.row_x[r], rows[r])
        w.raw_lower[r] = rows_lower[r]
        w.raw_upper[r] = rows_upper[r]
        for b in (rows_lower[r], rows_upper[r]):
            w.row_c[r] += abs(b) if np.isfinite(b) else 0.0
        _scale_arrival_row(w, r, 0)


def new_window(arrays: dict[str, Any]) -> Any:
    """A window that compiled code can take, over the arrays of `allocate`."""
    return _construct(*arrays.values())

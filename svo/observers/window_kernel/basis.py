"""The basis of a program: active rows I, basic columns J and the dense inverse of G[I, J].

It stays as small as the number of rows that matter (5 on average for a window of 10 steps on the Eclipse).
"""

from __future__ import annotations

from numba import njit

from svo.observers.window_kernel.memory import AT_CENTRE, AT_LOWER, AT_UPPER, BASE, BASIC, FAST
from svo.observers.window_kernel.short_rows import fill


@njit(fastmath=FAST, error_model="numpy")
def eliminate(w, q, p, c, threshold):
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


@njit(fastmath=FAST, error_model="numpy")
def change_basis(w, q, k, leave_row, leave_col, enter, side, theta):
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


@njit(error_model="numpy")
def cold(w, q):
    w.k[q] = 0
    fill(w.status[q], AT_CENTRE)


@njit(error_model="numpy")
def prepare(w, size, q):
    """Carry the basis of direction q over to the present window: what was dropped since leaves it."""
    base, base_then = w.clock[BASE], w.seen_base[q]
    w.seen_base[q] = base
    if base == base_then:
        return
    if base_then < 0:
        cold(w, q)
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
        w.k[q] = eliminate(w, q, p, c, 1e-6)

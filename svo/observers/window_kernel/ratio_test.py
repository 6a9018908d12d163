"""The bound-flipping ratio test: how far the dual step goes, which variables flip and which one enters."""

from __future__ import annotations

from numba import njit

from svo.observers.window_kernel.memory import AT_CENTRE, AT_UPPER, BASIC, FAST, SMALL_PIVOT


@njit(fastmath=FAST, error_model="numpy")
def collect_breakpoints(w, q, k, side):
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


@njit(fastmath=FAST, error_model="numpy")
def _swap(candidate, ratio, pivot, drop, a, b):
    candidate[a], candidate[b] = candidate[b], candidate[a]
    ratio[a], ratio[b] = ratio[b], ratio[a]
    pivot[a], pivot[b] = pivot[b], pivot[a]
    drop[a], drop[b] = drop[b], drop[a]


@njit(fastmath=FAST, error_model="numpy")
def choose_entering(w, m, violation):
    """Bound-flipping ratio test: pass breakpoints while the violation stays positive.

    Weighted quickselect over the ratios; ties go to the largest pivot. Returns (flips, violation left at the
    entering breakpoint); candidates [0, flips) flip and candidate[flips] enters. flips = -1: nothing stops the
    step, so the program is empty.
    """
    candidate, drop, ratio, pivot = w.candidate, w.drop, w.ratio, w.pivot
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
                    _swap(candidate, ratio, pivot, drop, below, here)
                below += 1
                here += 1
            elif r > cut:
                above -= 1
                _swap(candidate, ratio, pivot, drop, here, above)
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
            _swap(candidate, ratio, pivot, drop, first, big)
        if drop[first] >= left:
            return first, max(left, 0.0)
        left -= drop[first]
        first += 1


@njit(fastmath=FAST, error_model="numpy")
def avoid_small_pivot(w, m, flips, left):
    """Where the entering pivot is tiny, take a larger one with nearly the same ratio.

    The reduced costs that this leaves slightly infeasible are repaired by flips at the next pricing.
    """
    candidate, pivot, ratio, drop = w.candidate, w.pivot, w.ratio, w.drop
    if pivot[flips] >= SMALL_PIVOT:
        return flips, left
    reach = ratio[flips] + 1e-9
    best = -1
    for j in range(flips + 1, m):
        if ratio[j] <= reach and pivot[j] > SMALL_PIVOT and (best < 0 or pivot[j] > pivot[best]):
            best = j
    if best >= 0:
        _swap(candidate, ratio, pivot, drop, flips, best)
        return flips, left
    floor = ratio[flips] - 1e-9
    for j in range(flips):
        if ratio[j] >= floor and pivot[j] > SMALL_PIVOT and (best < 0 or pivot[j] > pivot[best]):
            best = j
    if best >= 0:
        left += drop[best]
        _swap(candidate, ratio, pivot, drop, best, flips - 1)
        return flips - 1, left
    return flips, left

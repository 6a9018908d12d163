/* The bound-flipping ratio test: how far the dual step goes, which variables flip and which one enters. */
#include "window.h"

#define SMALL_PIVOT 1e-6
#define NO_PIVOT 1e-9 /* entries of the tableau that count as zero */
#define SAME 1e-9     /* ratios that far apart count as equal where a pivot is small */

/* Breakpoints of the dual step: where a reduced cost or a multiplier changes its sign; their number. */
integer collect_breakpoints(const window *w, integer q, integer k, double side)
{
    const integer Z = w->Z, *restrict status = w->status + q * Z, *restrict rows = w->rows + q * w->K;
    const double *restrict alpha = w->alpha, *restrict d = w->d, *restrict wk = w->wk;
    integer *restrict candidate = w->candidate, m = 0;
    double *restrict ratio = w->ratio, *restrict pivot = w->pivot, *restrict drop = w->drop;
    for (integer j = 0; j < Z; j++) {
        const double x = side * alpha[j], size = fabs(x);
        if (!(size > NO_PIVOT) || status[j] == BASIC) continue;
        const integer is_centre = status[j] == AT_CENTRE;
        if (!is_centre && (x > 0.0) != (status[j] == AT_UPPER)) continue;
        candidate[m] = j;
        ratio[m] = is_centre ? 0.0 : larger(d[j] / x, 0.0);
        pivot[m] = size;
        drop[m] = is_centre ? size : 2.0 * size;
        m++;
    }
    for (integer a = 0; a < k; a++) {
        const double x = side * wk[a], size = fabs(x);
        if (!(size > NO_PIVOT) || (x > 0.0) != (w->at_upper[a] == 1)) continue;
        candidate[m] = Z + a;
        ratio[m] = larger(w->multiplier[a] / x, 0.0);
        pivot[m] = size;
        drop[m] = size * (w->upper[rows[a]] - w->lower[rows[a]]);
        m++;
    }
    return m;
}

static void swap(const window *w, integer a, integer b)
{
    const integer candidate = w->candidate[a];
    const double ratio = w->ratio[a], pivot = w->pivot[a], drop = w->drop[a];
    w->candidate[a] = w->candidate[b];
    w->ratio[a] = w->ratio[b];
    w->pivot[a] = w->pivot[b];
    w->drop[a] = w->drop[b];
    w->candidate[b] = candidate;
    w->ratio[b] = ratio;
    w->pivot[b] = pivot;
    w->drop[b] = drop;
}

/* Bound-flipping ratio test: pass breakpoints while the violation stays positive, ties by the largest pivot first.
 *
 * Returns the number of flips and the violation left at the entering breakpoint; candidates [0, flips) flip and
 * candidate[flips] enters. flips = -1: nothing stops the step, so the program is empty. */
entering choose_entering(const window *w, integer m, double violation)
{
    const double *ratio = w->ratio, *pivot = w->pivot, *drop = w->drop;
    double total = 0.0, left = violation;
    for (integer j = 0; j < m; j++) total += drop[j];
    if (m == 0 || total < violation) return (entering){-1, violation - total};
    for (integer first = 0; first < m;) {
        double nearest = INFINITY;
        for (integer j = first; j < m; j++) nearest = smaller(ratio[j], nearest);
        integer last = first;
        for (integer j = first; j < m; j++)
            if (ratio[j] <= nearest) swap(w, last++, j);
        if (last == first) break; /* no ratio is a number */
        for (; first < last; first++) {
            integer best = first;
            for (integer j = first + 1; j < last; j++)
                if (pivot[j] > pivot[best]) best = j;
            swap(w, first, best);
            if (drop[first] >= left) return (entering){first, larger(left, 0.0)};
            left -= drop[first];
        }
    }
    left = smaller(left + drop[m - 1], drop[m - 1]); /* rounding of the sums: the last breakpoint enters */
    return (entering){m - 1, larger(left, 0.0)};
}

/* Where the entering pivot is tiny, take a larger one with nearly the same ratio.
 *
 * The reduced costs that this leaves slightly infeasible are repaired by flips at the next pricing. */
entering avoid_small_pivot(const window *w, integer m, entering chosen)
{
    const double *ratio = w->ratio, *pivot = w->pivot;
    const integer flips = chosen.flips;
    if (pivot[flips] >= SMALL_PIVOT) return chosen;
    integer best = -1;
    for (integer j = flips + 1; j < m; j++)
        if (ratio[j] <= ratio[flips] + SAME && pivot[j] > SMALL_PIVOT && (best < 0 || pivot[j] > pivot[best])) best = j;
    if (best >= 0) {
        swap(w, flips, best);
        return chosen;
    }
    for (integer j = 0; j < flips; j++)
        if (ratio[j] >= ratio[flips] - SAME && pivot[j] > SMALL_PIVOT && (best < 0 || pivot[j] > pivot[best])) best = j;
    if (best < 0) return chosen;
    const double left = chosen.left + w->drop[best];
    swap(w, best, flips - 1);
    return (entering){flips - 1, left};
}

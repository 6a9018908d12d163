/* The bound-flipping ratio test: how far the dual step goes, which variables flip and which one enters. */
#include <string.h>

#include "window.h"

#define SMALL_PIVOT 1e-6
#define NO_PIVOT 1e-9 /* entries of the tableau that count as zero */
#define SAME 1e-9     /* ratios that far apart count as equal where a pivot is small */

/* The places of nonbasic variables that the step makes dual infeasible, in w->candidate; their number.
 *
 * Such a variable is at 1 with a falling reduced cost, at -1 with a rising one, or at its centre. */
static integer blocking_variables(const window *w, double side)
{
    const double *restrict alpha = w->alpha, *restrict z = w->z;
    integer *restrict candidate = w->candidate, m = 0;
    for (integer j = 0; j < w->Z; j++) {
        candidate[m] = j;
        m += (side * alpha[j] * z[j] > NO_PIVOT) | ((z[j] == 0.0) & (fabs(alpha[j]) > NO_PIVOT));
    }
    return m;
}

/* Breakpoints of the dual step, where a reduced cost or a multiplier changes its sign; their number.
 *
 * A flip that takes all of the violation ends the step, so those beyond are left out, but for ratios that count as the
 * same. */
integer collect_breakpoints(const window *w, integer q, integer k, leaving out)
{
    const integer *rows = w->rows + q * w->K, count = blocking_variables(w, out.side);
    breakpoint *points = w->points;
    double end = INFINITY;
    integer m = 0;
    for (integer i = 0; i < count; i++) {
        const integer j = w->candidate[i];
        const double z = w->z[j], size = fabs(w->alpha[j]), drop = (1.0 + fabs(z)) * size;
        const double ratio = larger(w->d[j] * z, 0.0) / size;
        points[m] = (breakpoint){ratio, size, drop, j};
        m += ratio <= end + SAME;
        if (drop >= out.violation) end = smaller(ratio, end);
    }
    for (integer a = 0; a < k; a++) {
        const double x = out.side * w->wk[a], size = fabs(x);
        if (!(size > NO_PIVOT) || (x > 0.0) != (w->at_upper[a] == 1)) continue;
        const double ratio = larger(w->multiplier[a] / x, 0.0), drop = size * (w->upper[rows[a]] - w->lower[rows[a]]);
        points[m] = (breakpoint){ratio, size, drop, w->Z + a};
        m += ratio <= end + SAME;
        if (drop >= out.violation) end = smaller(ratio, end);
    }
    integer kept = 0;
    for (integer i = 0; i < m; i++) {
        points[kept] = points[i];
        kept += points[i].ratio <= end + SAME;
    }
    return kept;
}

static void swap(breakpoint *a, breakpoint *b)
{
    const breakpoint other = *a;
    *a = *b;
    *b = other;
}

/* The bits of a number >= 0, which are in the order of such numbers: integers are compared without a branch. */
static integer key_of(double ratio)
{
    integer key;
    memcpy(&key, &ratio, sizeof key);
    return key;
}

/* The nearest of the points from `first` on, the largest among equals. */
static integer nearest(const breakpoint *points, integer first, integer m)
{
    integer best = first, least_key = key_of(points[first].ratio);
    for (integer j = first + 1; j < m; j++) {
        const integer key = key_of(points[j].ratio);
        best = key < least_key ? j : best;
        least_key = key < least_key ? key : least_key;
    }
    for (integer j = best + 1; j < m; j++)
        if (key_of(points[j].ratio) == least_key && points[j].size > points[best].size) best = j;
    return best;
}

/* Bound-flipping ratio test: pass breakpoints while the violation stays positive, ties by the largest pivot first.
 *
 * Returns the number of flips and the violation left at the entering breakpoint; points [0, flips) flip and
 * points[flips] enters. flips = -1: nothing stops the step, so the program is empty. */
entering choose_entering(const window *w, integer m, double violation)
{
    breakpoint *points = w->points;
    double total = 0.0, left = violation;
    for (integer j = 0; j < m; j++) total += points[j].drop;
    if (m == 0 || total < violation) return (entering){-1, violation - total};
    for (integer first = 0; first < m; first++) {
        swap(points + first, points + nearest(points, first, m));
        if (points[first].drop >= left) return (entering){first, larger(left, 0.0)};
        left -= points[first].drop;
    }
    left = smaller(left + points[m - 1].drop, points[m - 1].drop); /* rounding of the sums: the last one enters */
    return (entering){m - 1, larger(left, 0.0)};
}

/* Where the entering pivot is tiny, take a larger one with nearly the same ratio.
 *
 * The reduced costs that this leaves slightly infeasible are repaired by flips at the next pricing. */
entering avoid_small_pivot(const window *w, integer m, entering chosen)
{
    breakpoint *points = w->points;
    const integer flips = chosen.flips;
    const double ratio = points[flips].ratio;
    if (points[flips].size >= SMALL_PIVOT) return chosen;
    integer best = flips;
    for (integer j = flips + 1; j < m; j++)
        if (points[j].ratio <= ratio + SAME && points[j].size > larger(points[best].size, SMALL_PIVOT)) best = j;
    if (best > flips) {
        swap(points + flips, points + best);
        return chosen;
    }
    for (integer j = 0; j < flips; j++)
        if (points[j].ratio >= ratio - SAME && points[j].size > larger(points[best].size, SMALL_PIVOT)) best = j;
    if (best == flips) return chosen;
    const double left = chosen.left + points[best].drop;
    swap(points + best, points + flips - 1);
    return (entering){flips - 1, left};
}

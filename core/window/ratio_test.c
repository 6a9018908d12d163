/* The bound-flipping ratio test: how far the dual step goes, which variables flip and which one enters. */
#include <string.h>

#include "window.h"

#define SMALL_PIVOT 1e-6
#define NO_PIVOT 1e-9 /* entries of the tableau that count as zero */
#define SAME 1e-9     /* ratios that far apart count as equal where a pivot is small */

/* The ratio of each variable whose reduced cost changes its sign on the way, in w->move, NaN for the others; returns the
 * least one of those whose flip takes all of the violation.
 *
 * Such a variable is nonbasic, at 1 with a falling reduced cost, at -1 with a rising one, or at its centre. */
WIDE static double ratios_of_variables(const window *w, leaving out)
{
    const integer Z = w->Z;
    const double *restrict alpha = w->alpha, *restrict z = w->z, *restrict d = w->d;
    const double side = out.side, violation = out.violation;
    double *restrict ratio = w->move, *restrict whole = w->whole;
    for (integer j = 0; j < Z; j++) {
        const double size = fabs(alpha[j]), slope = z[j] == 0.0 ? size : side * alpha[j] * z[j];
        const double own = larger(d[j] * z[j], 0.0) / size, drop = (1.0 + fabs(z[j])) * size;
        ratio[j] = slope > NO_PIVOT ? own : NAN;
        whole[j] = drop >= violation ? ratio[j] : NAN;
    }
    return least_of(whole, Z);
}

/* The same of the active rows, whose multipliers change their signs, behind those of the variables. */
static double ratios_of_rows(const window *w, integer q, integer k, leaving out)
{
    const integer *rows = w->rows + q * w->K;
    double *ratio = w->move + w->Z, end = INFINITY;
    for (integer a = 0; a < k; a++) {
        const double x = out.side * w->wk[a], size = fabs(x);
        const int is_one = size > NO_PIVOT && (x > 0.0) == (w->at_upper[a] == 1);
        ratio[a] = is_one ? larger(w->multiplier[a] / x, 0.0) : NAN;
        if (is_one && size * (w->upper[rows[a]] - w->lower[rows[a]]) >= out.violation) end = smaller(ratio[a], end);
    }
    return end;
}

/* Breakpoints of the dual step, where a reduced cost or a multiplier changes its sign; their number.
 *
 * A flip that takes all of the violation ends the step, so those beyond are left out, but for ratios that count as the
 * same. */
integer collect_breakpoints(const window *w, integer q, integer k, leaving out)
{
    const integer *rows = w->rows + q * w->K, Z = w->Z;
    const double of_rows = ratios_of_rows(w, q, k, out), end = smaller(ratios_of_variables(w, out), of_rows) + SAME;
    const double *ratio = w->move;
    integer *candidate = w->candidate, m = 0;
    for (integer j = 0; j < Z + k; j++) {
        candidate[m] = j;
        m += ratio[j] <= end;
    }
    for (integer i = 0; i < m; i++) {
        const integer who = candidate[i], a = who - Z;
        const double size = fabs(a < 0 ? w->alpha[who] : w->wk[a]);
        const double width = a < 0 ? 1.0 + fabs(w->z[who]) : w->upper[rows[a]] - w->lower[rows[a]];
        w->points[i] = (breakpoint){ratio[who], size, width * size, who};
    }
    return m;
}

static void swap(breakpoint *a, breakpoint *b)
{
    const breakpoint other = *a;
    *a = *b;
    *b = other;
}

/* Whether a point comes before another: the nearer one, the larger pivot, the first. Numbers >= 0 are in the order of
 * their bits. */
static int is_before(const breakpoint *a, const breakpoint *b)
{
    integer first, second;
    memcpy(&first, &a->ratio, sizeof first);
    memcpy(&second, &b->ratio, sizeof second);
    if (first != second) return first < second;
    return a->size > b->size || (a->size == b->size && a->who < b->who);
}

/* A heap of the last `count` of the points, root[0], root[-1], root[-2] and so on: the one at `at` sinks to its place. */
static void sink(breakpoint *root, integer count, integer at)
{
    const breakpoint sinking = root[-at];
    for (;;) {
        integer child = 2 * at + 1;
        if (child >= count) break;
        if (child + 1 < count && is_before(root - child - 1, root - child)) child++;
        if (is_before(&sinking, root - child)) break;
        root[-at] = root[-child];
        at = child;
    }
    root[-at] = sinking;
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
    for (integer at = m / 2; at-- > 0;) sink(points + m - 1, m, at);
    for (integer first = 0; first < m; first++) {
        swap(points + first, points + m - 1); /* the root and the last leaf */
        sink(points + m - 1, m - first - 1, 0);
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

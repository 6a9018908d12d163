/* Bounds of the optima of linear programs that hold whatever was rounded: weak duality in twice the working precision.
 *
 * For x with A x <= b and multipliers y >= 0, c'x <= y'b + |c - A'y|'|x|. The multipliers of a basis are refined by one
 * Newton step and kept as sums of two floats; both terms come as upper bounds of their exact values. Where nothing is
 * rounded on the way (integers, short fractions) nothing is added: the bound is the optimum.
 */
#include "polytopes/polytopes.h"
#include "polytopes/sums.h"
#include "vectors.h"

/* Multipliers in two floats: those of the basis that are positive, and what a Newton step on c = A'y adds. */
static void refine(const Rows *rows, const double *c, State *at, double *high, double *low, double *off)
{
    const integer d = rows->d;
    for (integer k = 0; k < d; k++) {
        high[k] = at->W[k] >= 0 && at->y[k] > 0.0 ? at->y[k] : 0.0;
        low[k] = 0.0;
    }
    for (integer j = 0; j < d; j++) {
        Sum sum = {c[j], 0.0, 0.0};
        for (integer k = 0; k < d; k++)
            if (at->W[k] >= 0) add_product(&sum, -high[k], rows->at[j * rows->stride + at->W[k]]);
        off[j] = sum.total + sum.lost;
    }
    for (integer k = 0; k < d; k++) {
        if (at->W[k] >= 0) {
            low[k] = dot(at->Q + k * d, off, d);
            if (high[k] + low[k] <= 0.0) high[k] = low[k] = 0.0;
            const Pair moved = two_sum(high[k], low[k]);
            high[k] = moved.value, low[k] = moved.rest;
        }
        at->y[k] = high[k];
    }
}

/* Upper bound of y'b with refined multipliers, and in `spare` by how much at least it is one.
 *
 * Leaves upper bounds of |c - A'y| in `beside` (d,); work is (3 d,).
 */
double dual_bound(const Rows *rows, const double *c, State *at, double *beside, double *spare, double *work)
{
    const integer d = rows->d;
    double *high = work, *low = work + d, *off = work + 2 * d, unused;
    refine(rows, c, at, high, low, off);
    Sum bound = {0.0, 0.0, 0.0};
    for (integer k = 0; k < d; k++) {
        if (at->W[k] < 0) continue;
        add_product(&bound, high[k], rows->b[at->W[k]]);
        add_product(&bound, low[k], rows->b[at->W[k]]);
    }
    for (integer j = 0; j < d; j++) {
        Sum sum = {c[j], 0.0, 0.0};
        for (integer k = 0; k < d; k++) {
            if (at->W[k] < 0) continue;
            add_product(&sum, -high[k], rows->at[j * rows->stride + at->W[k]]);
            add_product(&sum, -low[k], rows->at[j * rows->stride + at->W[k]]);
        }
        const Sum negative = {-sum.total, -sum.lost, sum.error};
        beside[j] = larger(larger(upper(sum, &unused), upper(negative, &unused)), 0.0);
    }
    return upper(bound, spare);
}

/* How near upper bounds of k forms over a set are to their values at points, where |x| <= reach (d,) all over it.
 *
 * forms, points (k, d); c'x <= bounds - spare + beside'|x| for each, arrays (k,), (k,) and (k, d). Leaves in `found`
 * the bounds of c'x (k,), how far they are above the values (k,), and the sizes of the terms of both (k,).
 */
EXPORTED void fdi_gaps(integer d, integer k, const double *forms, const double *points, const double *bounds,
                       const double *spare, const double *beside, const double *reach, double *found)
{
    for (integer q = 0; q < k; q++) {
        double more = 0.0, value = 0.0, size = 0.0, bound = bounds[q];
        for (integer j = 0; j < d; j++) {
            const double part = forms[q * d + j] * points[q * d + j], off = beside[q * d + j];
            value += part;
            size += fabs(part);
            if (off > 0.0) more += off * reach[j];
        }
        more *= 1.0 + (double)(d + 4) * EPS;
        if (more > spare[q]) bound = isfinite(bound + more) ? next_up(bound + more) : INFINITY;
        found[q] = bound, found[k + q] = bound - value, found[2 * k + q] = size + fabs(bound);
    }
}

/* Sums of products as if in twice the working precision, and upper bounds of them; for numbers of about one.
 *
 * The order of operations is part of the proof: built without reordering and without fused products.
 */
#ifndef POLYTOPES_SUMS_H
#define POLYTOPES_SUMS_H

#include "core.h"
#include "pairs.h"
#include "powers.h"

static const double UNDERFLOW_BELOW = 1e-290; /* products below may lose what rounding left */
static const double TINY = 1e-300;

static const double SMALL = 1e-140, LARGE = 1e140; /* numbers between: their products, halved, are floats */

static inline int moderate(double value) { return value == 0.0 || (fabs(value) > SMALL && fabs(value) < LARGE); }

typedef struct {
    double total, lost; /* what is summed so far is total + lost, */
    double error;       /* up to this */
} Sum;

/* Adds u v (Ogita, Rump and Oishi 2005). */
static inline void add_product(Sum *sum, double u, double v)
{
    if (u == 0.0 || v == 0.0) return;
    const Pair product = two_product(u, v), moved = two_sum(sum->total, product.value);
    const double rest = product.rest + moved.rest;
    sum->total = moved.value;
    if (rest != 0.0) {
        sum->lost += rest;
        sum->error += 2.0 * EPS * (fabs(rest) + fabs(sum->lost));
    }
    if (fabs(product.value) < UNDERFLOW_BELOW) sum->error += TINY;
}

/* A float that is at least the sum, `total` where nothing was lost; `spare`: by how much at least. */
static inline double upper(Sum sum, double *spare)
{
    *spare = 0.0;
    if (sum.lost == 0.0 && sum.error == 0.0) return sum.total;
    const Pair moved = two_sum(sum.total, sum.lost);
    const double over = moved.rest + sum.error * (1.0 + 4.0 * EPS);
    if (over <= 0.0) {
        *spare = -over;
        return moved.value;
    }
    return next_up(moved.value + over);
}

#endif

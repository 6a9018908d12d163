/* Bounds of the optima of linear programs that hold whatever was rounded: weak duality in twice the working precision.
 *
 * For x with A x <= b and multipliers y >= 0, c'x <= y'b + |c - A'y|'|x|. The multipliers of a basis are refined by one
 * Newton step and kept as sums of two floats; both terms come as upper bounds of their exact values. Where nothing is
 * rounded on the way (integers, short fractions) nothing is added: the bound is the optimum.
 *
 * The order of operations is part of the proof: built without reordering and without fused products.
 */
#include "polytopes/polytopes.h"
#include "powers.h"
#include "vectors.h"

static const double SPLIT = 134217729.0; /* 2^27 + 1, halves a float (Dekker 1971) */
static const double UNDERFLOW_BELOW = 1e-290; /* products below may lose what rounding left; numbers come scaled to about one */
static const double TINY = 1e-300;

typedef struct {
    double total, lost; /* what is summed so far is total + lost, */
    double error;       /* up to this */
} Sum;

typedef struct {
    double value, rest;
} Pair;

/* The sum as a float, and what was rounded off (Knuth). */
static Pair two_sum(double u, double v)
{
    const double total = u + v, part = total - u;
    return (Pair){total, (u - (total - part)) + (v - part)};
}

/* The product as a float, and what was rounded off (Dekker). */
static Pair two_product(double u, double v)
{
    const double product = u * v, big_u = SPLIT * u, big_v = SPLIT * v;
    const double u1 = big_u - (big_u - u), v1 = big_v - (big_v - v), u2 = u - u1, v2 = v - v1;
    return (Pair){product, u2 * v2 - (((product - u1 * v1) - u2 * v1) - u1 * v2)};
}

/* Adds u v (Ogita, Rump and Oishi 2005). */
static void add_product(Sum *sum, double u, double v)
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
static double upper(Sum sum, double *spare)
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

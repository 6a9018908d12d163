/* Unevaluated sums of two doubles: a value and what rounding took from it.
 *
 * The order of operations is part of the proofs: built without reordering and without fused products.
 */
#ifndef PAIRS_H
#define PAIRS_H

#include <float.h>

#include "core.h"

#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD == 2 || FLT_EVAL_METHOD < 0)
#error "these sums are exact only where doubles are computed in double precision"
#endif

typedef struct {
    double value, rest;
} Pair;

static const double SPLIT = 134217729.0; /* 2^27 + 1, halves a float (Dekker 1971) */

/* The sum as a float, and what was rounded off (Knuth). */
static inline Pair two_sum(double u, double v)
{
    const double total = u + v, part = total - u;
    return (Pair){total, (u - (total - part)) + (v - part)};
}

/* The product as a float, and what was rounded off (Dekker). */
static inline Pair two_product(double u, double v)
{
    const double product = u * v, big_u = SPLIT * u, big_v = SPLIT * v;
    const double u1 = big_u - (big_u - u), v1 = big_v - (big_v - v), u2 = u - u1, v2 = v - v1;
    return (Pair){product, u2 * v2 - (((product - u1 * v1) - u2 * v1) - u1 * v2)};
}

/* A product within 2^-100 of its size. */
static inline Pair pair_times(Pair a, Pair b)
{
    const Pair product = two_product(a.value, b.value);
    return two_sum(product.value, product.rest + (a.value * b.rest + a.rest * b.value));
}

/* A quotient within 2^-98 of |a.value / b.value|. */
static inline Pair pair_over(Pair a, Pair b)
{
    const double first = a.value / b.value;
    const Pair back = two_product(first, b.value);
    const double left = ((a.value - back.value) - back.rest) + (a.rest - first * b.rest);
    return two_sum(first, left / b.value);
}

#endif

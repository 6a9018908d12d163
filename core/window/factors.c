/* An uncertainty as a sum of channels gain functional', and a bound of what they leave out of it, entry by entry.
 *
 * Complete pivoting, about a stack in its normal form. The pivot's row is divided by the largest odd number that
 * divides its entries, so that a product of rank one whose entries are floats comes out with factors that give it
 * exactly.
 */
#include <string.h>

#include "window.h"

#define LEFT_OVER 1e-13   /* of the largest entry: what is smaller gets no channel; it is bounded as a disturbance */
#define TOO_MUCH 1e-12    /* of the largest entry: left out by the channels of the typical schedule, it is an error */
#define SPLIT 134217729.0 /* 2^27 + 1 */

/* The entry of the largest magnitude, which is returned; -1 where there is none. */
static double pivot_of(const double *rest, integer count, integer *at)
{
    double best = -1.0;
    *at = 0;
    for (integer i = 0; i < count; i++)
        if (fabs(rest[i]) > best) {
            best = fabs(rest[i]);
            *at = i;
        }
    return best;
}

/* The odd number m of |value| = m 2^e, of a finite value that is not zero. */
static integer odd_part(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    integer mantissa = (integer)(bits & 0xfffffffffffff);
    if (bits >> 52 & 0x7ff) mantissa |= (integer)1 << 52; /* but for subnormal numbers */
    while (mantissa % 2 == 0) mantissa /= 2;
    return mantissa;
}

/* The largest odd number that divides every entry of a row, times the power of two that puts it into [1, 2). */
static double odd_divisor(const double *row, integer P)
{
    integer divisor = 0;
    for (integer j = 0; j < P; j++) {
        if (row[j] == 0.0 || divisor == 1 || !isfinite(row[j])) continue;
        integer other = odd_part(row[j]);
        while (other != 0) {
            const integer remainder = divisor % other;
            divisor = other;
            other = remainder;
        }
    }
    double unit = (double)divisor;
    while (unit >= 2.0) unit *= 0.5;
    return unit;
}

/* One term more: its gain and functional; what is left, but for the pivot's row and column, where it is nothing. */
static void peel(double *rest, integer X, integer P, integer r, integer c, double *gain, double *functional)
{
    const double unit = odd_divisor(rest + r * P, P);
    for (integer j = 0; j < P; j++) functional[j] = rest[r * P + j] / unit;
    for (integer i = 0; i < X; i++) gain[i] = rest[i * P + c] / functional[c];
    for (integer i = 0; i < X; i++)
        for (integer j = 0; j < P; j++)
            rest[i * P + j] = i == r || j == c ? 0.0 : rest[i * P + j] - gain[i] * functional[j];
}

/* Write a matrix (X, P) as a sum of nq terms gain functional'. */
static void factor(const double *stacked, integer X, integer P, integer nq, double *gain, double *functional,
                   double *rest)
{
    integer at;
    copy(rest, stacked, X * P);
    double pivot = pivot_of(rest, X * P, &at);
    const double largest = pivot;
    fill(gain, 0.0, nq * X);
    fill(functional, 0.0, nq * P);
    for (integer q = 0; q < nq; q++)
        if (pivot > LEFT_OVER * largest) {
            peel(rest, X, P, at / P, at % P, gain + q * X, functional + q * P);
            pivot = pivot_of(rest, X * P, &at);
        }
}

/* a b - product, exactly (Dekker 1971). */
static double rounding_of_product(double a, double b, double product)
{
    double t = SPLIT * a;
    const double high_a = t - (t - a);
    t = SPLIT * b;
    const double high_b = t - (t - b), low_a = a - high_a, low_b = b - high_b;
    return low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b);
}

/* |value - sum over q of gain[q, i] functional[q, j]|, rounded up. Each product and sum comes with its own rounding
 * error, so that the difference is zero where it is exactly zero. */
static double rest_of(double value, const double *gain, const double *functional, integer X, integer P, integer nq)
{
    double total = value, errors = 0.0, size = 0.0;
    for (integer q = 0; q < nq; q++) {
        const double g = gain[q * X], f = functional[q * P], product = g * f;
        if (product == 0.0) continue;
        const double rounding = rounding_of_product(g, f, product);
        const double after = total - product, part = after - total;
        const double error = (total - (after - part)) - (product + part);
        total = after;
        errors += error - rounding;
        size += fabs(error) + fabs(rounding);
    }
    return (fabs(total + errors) + 8.0 * (double)(nq + 1) * UNIT * size) * (1.0 + 8.0 * UNIT);
}

/* left += reach |stacked - sum of gain functional'|, rounded up; returns the largest entry of that difference. */
static double bound_rest(const double *stacked, const double *gain, const double *functional, integer X, integer P,
                         integer nq, double reach, double *left)
{
    double worst = 0.0;
    for (integer i = 0; i < X; i++)
        for (integer j = 0; j < P; j++) {
            const double rest = rest_of(stacked[i * P + j], gain + i, functional + j, X, P, nq);
            worst = larger(rest, worst);
            if (rest > 0.0) left[i * P + j] = (left[i * P + j] + reach * rest) * (1.0 + 8.0 * UNIT);
        }
    return worst;
}

static integer any(const double *values, integer count)
{
    for (integer i = 0; i < count; i++)
        if (values[i] != 0.0) return 1;
    return 0;
}

static integer is_owned(const integer *owner, integer nq, integer item)
{
    for (integer q = 0; q < nq; q++)
        if (owner[q] == item) return 1;
    return 0;
}

/* Channels of every uncertainty of a stack (ni, X, P), and what they leave out of all, times |Delta|, entry by entry.
 *
 * owner (nq,) is the item of each channel, those of an item together; delta (nq, 2). Gives gain (nq, X),
 * functional (nq, P) and left (X, P); rest (X, P) is scratch. 0 if an uncertainty has more rank than channels. */
integer factor_stack(integer ni, integer X, integer P, integer nq, const double *stack, const integer *owner,
                     const double *delta, double *gain, double *functional, double *left, double *rest)
{
    for (integer item = 1; item < ni; item++)
        if (!is_owned(owner, nq, item) && any(stack + item * X * P, X * P)) return 0;
    fill(left, 0.0, X * P);
    for (integer q = 0, last; q < nq; q = last) {
        for (last = q; last < nq && owner[last] == owner[q];) last++;
        const double *item = stack + owner[q] * X * P;
        double *gains = gain + q * X, *functionals = functional + q * P;
        factor(item, X, P, last - q, gains, functionals, rest);
        const double reach = larger(fabs(delta[2 * q + 1]), fabs(delta[2 * q]));
        const double worst = bound_rest(item, gains, functionals, X, P, last - q, reach, left);
        if (!(worst <= TOO_MUCH * largest_magnitude(item, X * P))) return 0;
    }
    return 1;
}

EXPORTED integer fdi_channel_factors(integer ni, integer X, integer P, integer nq, const double *stack,
                                     const integer *owner, const double *delta, double *gain, double *functional,
                                     double *left, double *rest)
{
    return factor_stack(ni, X, P, nq, stack, owner, delta, gain, functional, left, rest);
}

static integer repeats(const double *a, const double *b, integer count)
{
    for (integer i = 0; i < count; i++)
        if (a[i] != b[i]) return 0;
    return 1;
}

/* The channels of sample k, those of the sample before where the stack is the same; 0 as `factor_stack`. */
integer factor_sample(const window *w, integer k)
{
    const integer nq = w->nq, X = w->X, P = w->P, entry = X * P, item = w->ni * entry;
    const integer v = variables(w, k), then = variables(w, k - 1);
    const double *stack = w->stack + slot(w, k) * item, *before = w->stack + slot(w, k - 1) * item;
    if (k > 0 && repeats(stack + entry, before + entry, item - entry)) {
        if (then == v) return 1;
        copy(w->gain + v * nq * X, w->gain + then * nq * X, nq * X);
        copy(w->functional + v * nq * P, w->functional + then * nq * P, nq * P);
        copy(w->left + v * entry, w->left + then * entry, entry);
        w->is_left[v] = w->is_left[then];
        return 1;
    }
    if (!factor_stack(w->ni, X, P, nq, stack, w->owner, w->delta, w->gain + v * nq * X, w->functional + v * nq * P,
                      w->left + v * entry, w->rest))
        return 0;
    w->is_left[v] = any(w->left + v * entry, entry) ? 1.0 : 0.0;
    return 1;
}

/* Bound of what the channels leave out of a row of [x(k+1); y(k)], over the present bounds of (x, u, 1, w). */
double left_out(const window *w, integer k, integer row)
{
    const integer n = w->n, nu = w->nu, nw = w->nw, s = slot(w, k), v = variables(w, k);
    if (w->is_left[v] == 0.0) return 0.0;
    const double *left = w->left + (v * w->X + row) * w->P;
    double total = left[n + nu];
    for (integer j = 0; j < n; j++) total += left[j] * w->mag[s * n + j];
    for (integer j = 0; j < nu; j++) total += left[n + j] * fabs(w->u[s * nu + j]);
    for (integer j = 0; j < nw; j++)
        total += left[n + nu + 1 + j] * larger(fabs(w->w_upper[v * nw + j]), fabs(w->w_lower[v * nw + j]));
    return total * (1.0 + 2.0 * (double)(n + nu + nw + 8) * UNIT);
}

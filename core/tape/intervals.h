/* Intervals of doubles that contain every value of an operation of their members.
 *
 * Sums, products, quotients and square roots are rounded to nearest, so the double next to a result is a bound; of a
 * sum, what rounding took is known exactly, and decides. No rounding mode is touched. Operands are finite; a result
 * that overflows has an infinite end or none, and `is_bounded` says so.
 */
#ifndef TAPE_INTERVALS_H
#define TAPE_INTERVALS_H

#include <string.h>

#include "core.h"
#include "tape/elementary.h"

/* What no value of an operation can be bounded for. Python has the words (svo/functions/tape.py). */
enum { BOUNDED, UNKNOWN, DIVIDES_BY_ZERO, ROOT_OF_NEGATIVE, LOG_OF_ZERO, NO_PIECE, BEYOND_FLOATS };

static const integer OUTWARD = 1; /* doubles between a rounded result and its bound */

static inline double above(double value) /* the next double; infinity and NaN stay */
{
    int64_t bits;
    if (!(value < INFINITY)) return value;
    if (value == 0.0) value = 0.0; /* minus zero is below */
    memcpy(&bits, &value, sizeof bits);
    bits += bits >= 0 ? OUTWARD : -OUTWARD;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline double below(double value) { return -above(-value); }

static inline fdi_interval interval(double low, double high) { return (fdi_interval){low, high}; }
static inline fdi_interval at(double value) { return (fdi_interval){value, value}; }
static inline double middle(fdi_interval a) { return 0.5 * a.low + 0.5 * a.high; }
static inline double width(fdi_interval a) { return a.high - a.low; }
static inline double magnitude(fdi_interval a) { return larger(fabs(a.low), fabs(a.high)); }

static inline int is_bounded(fdi_interval a) { return -INFINITY < a.low && a.low <= a.high && a.high < INFINITY; }

static inline int is_point(fdi_interval a, double value) { return a.low == value && a.high == value; }

static inline int has_zero(fdi_interval a) { return a.low <= 0.0 && 0.0 <= a.high; }

static inline fdi_interval opposite(fdi_interval a) { return interval(-a.high, -a.low); }

static inline double sum_below(double x, double y) /* exact where a double is: Knuth's two-sum tells what was lost */
{
    const double total = x + y, part = total - x, lost = (x - (total - part)) + (y - part);
    return lost >= 0.0 ? total : below(total);
}

static inline fdi_interval sum(fdi_interval a, fdi_interval b)
{
    return interval(sum_below(a.low, b.low), -sum_below(-a.high, -b.high));
}

static inline fdi_interval difference(fdi_interval a, fdi_interval b) { return sum(a, opposite(b)); }

/* A product with an exact zero is exact; one that vanishes by underflow is not. */
static inline fdi_interval product(fdi_interval a, fdi_interval b)
{
    const double p = a.low * b.low, q = a.low * b.high, r = a.high * b.low, s = a.high * b.high;
    const double low = smaller(smaller(p, q), smaller(r, s)), high = larger(larger(p, q), larger(r, s));
    if (low != 0.0 && high != 0.0) return interval(below(low), above(high));
    const int is_zero = is_point(a, 0.0) || is_point(b, 0.0);
    const int is_positive = (a.low >= 0.0 && b.low >= 0.0) || (a.high <= 0.0 && b.high <= 0.0);
    const int is_negative = (a.low >= 0.0 && b.high <= 0.0) || (a.high <= 0.0 && b.low >= 0.0);
    return interval(low == 0.0 && (is_zero || is_positive) ? 0.0 : below(low),
                    high == 0.0 && (is_zero || is_negative) ? 0.0 : above(high));
}

static inline fdi_interval magnitudes(fdi_interval a)
{
    const double low = fabs(a.low), high = fabs(a.high);
    return interval(a.low <= 0.0 && 0.0 <= a.high ? 0.0 : smaller(low, high), larger(low, high));
}

static inline double at_least_zero(double value) { return larger(0.0, value); }

static inline fdi_interval square(fdi_interval a)
{
    const fdi_interval m = magnitudes(a);
    return interval(m.low > 0.0 ? at_least_zero(below(m.low * m.low)) : 0.0,
                    m.high > 0.0 ? above(m.high * m.high) : 0.0);
}

/* Of an interval without zero. */
static inline fdi_interval inverse(fdi_interval a) { return interval(below(1.0 / a.high), above(1.0 / a.low)); }

/* Of an interval without negative numbers. */
static inline fdi_interval root(fdi_interval a)
{
    return interval(a.low > 0.0 ? at_least_zero(below(sqrt(a.low))) : 0.0, a.high > 0.0 ? above(sqrt(a.high)) : 0.0);
}

static inline fdi_interval signed_root_at(double s)
{
    return s < 0.0 ? opposite(root(at(-s))) : root(at(s));
}

static inline fdi_interval signed_root(fdi_interval a)
{
    return interval(signed_root_at(a.low).low, signed_root_at(a.high).high);
}

/* The range of an operation, `svo.functions.operations.Op`; a piece of SELECT without a range is NULL.
 * Returns BOUNDED, or why it has none. */
int fdi_interval_applied(integer op, const fdi_interval *a, const fdi_interval *b, const fdi_interval *c,
                         fdi_interval *value);

#endif

/* From a pair whose error is known to the doubles around the exact value. */
#ifndef TAPE_AROUND_H
#define TAPE_AROUND_H

#include "pairs.h"
#include "powers.h"
#include "tape/elementary.h"

static const fdi_interval WHOLE_LINE = {-INFINITY, INFINITY};

/* Of an exact value within `error` (relative, at most 2^-55) of value + rest: the double next to it on either side, or,
 * where the error leaves open on which side of value + rest's nearest double it is, that double's two neighbours. */
static inline fdi_interval around(double value, double rest, double error)
{
    const Pair sum = two_sum(value, rest);
    const double miss = error * fabs(sum.value);
    return (fdi_interval){sum.rest >= miss ? sum.value : next_down(sum.value),
                          sum.rest <= -miss ? sum.value : next_up(sum.value)};
}

/* Of an odd function with x - x^3 / 3 <= value <= x for x >= 0, below 2^-26. */
static inline fdi_interval just_below(double x)
{
    return (fdi_interval){x > 0.0 ? next_down(x) : x, x < 0.0 ? next_up(x) : x};
}

static inline fdi_interval opposite_of(fdi_interval a) { return (fdi_interval){-a.high, -a.low}; }

static inline fdi_interval within(fdi_interval a, double low, double high)
{
    return (fdi_interval){larger(a.low, low), smaller(a.high, high)};
}

#endif

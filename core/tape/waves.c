/* sin and cos: after quarter turns, |r| = j/8 + d with |d| <= 1/16, and the sum formulas with a table of j/8. */
#include <float.h>

#include "tape/around.h"
#include "tape/quarter_turns.h"

static const double WAVE_ERROR = 0x1p-57;
static const double STRAIGHT = 0x1p-27;
static const double NO_TURN = 6.28; /* less than a turn */

static const Pair TABLE[][2] = {
    /* sin and cos of j/8, j = 0 .. 6 */
    {{0.0, 0.0}, {1.0, 0.0}},
    {{0x1.feaaeee86ee36p-4, -0x1.afcb2bcc6f03bp-59}, {0x1.fc015527d5bd3p-1, 0x1.b68f35094efb8p-55}},
    {{0x1.faaeed4f31577p-3, -0x1.15d88508e32b8p-57}, {0x1.f01549f7deea1p-1, 0x1.d3c1e99e5cafdp-55}},
    {{0x1.7710255764214p-2, -0x1.6ead7314bb6cep-57}, {0x1.dc6b7eb995912p-1, 0x1.4b364776dcd35p-58}},
    {{0x1.eaee8744b05f0p-2, -0x1.789b43c9b027dp-58}, {0x1.c1528065b7d50p-1, -0x1.892111312e828p-55}},
    {{0x1.2b91dea88421ep-1, -0x1.fa371db216ab0p-55}, {0x1.9f368ed912f85p-1, -0x1.1d200c5791606p-55}},
    {{0x1.5cffc16bf8f0dp-1, 0x1.96cb370eb578ap-55}, {0x1.769fec655211fp-1, -0x1.827d5cf8c68c5p-57}},
};

static double beyond_sine(double d, double z) /* sin d - d, Taylor in z = d d */
{
    return -(d * z) * (1.0 / 6.0 - z * (1.0 / 120.0 - z * (1.0 / 5040.0 - z / 362880.0)));
}

static double beyond_cosine(double z) /* cos d - 1 */
{
    return -z * (1.0 / 2.0 - z * (1.0 / 24.0 - z * (1.0 / 720.0 - z * (1.0 / 40320.0 - z / 3628800.0))));
}

/* sin r or cos r, for 0 <= r <= pi/4: first cos d + second sin d. */
static fdi_interval in_first_octant(Pair r, int cosine)
{
    const integer j = (integer)(8.0 * r.value + 0.5);
    Pair d = two_sum(r.value, -0.125 * (double)j);
    d.rest += r.rest;
    const double z = d.value * d.value;
    const Pair first = TABLE[j][cosine], other = TABLE[j][!cosine];
    const Pair second = cosine ? (Pair){-other.value, -other.rest} : other;
    const Pair linear = two_product(second.value, d.value), sum = two_sum(first.value, linear.value);
    const double slope = second.value - first.value * d.value;
    const double small = sum.rest + linear.rest + first.rest + second.rest * d.value + slope * d.rest;
    const double curved = first.value * beyond_cosine(z) + second.value * beyond_sine(d.value, z);
    return around(sum.value, small + curved, WAVE_ERROR);
}

/* sin(x + ahead pi/2). */
static fdi_interval wave(double x, Turned turned, integer ahead)
{
    if (ahead == 0 && fabs(x) < STRAIGHT) return just_below(x);
    if (x == 0.0) return (fdi_interval){1.0, 1.0};
    const integer quarter = (turned.quarter + ahead) & 3;
    const int mirrored = turned.rest.value < 0.0, cosine = quarter & 1;
    const Pair r = mirrored ? (Pair){-turned.rest.value, -turned.rest.rest} : turned.rest;
    const fdi_interval value = within(in_first_octant(r, cosine), 0.0, 1.0);
    return (quarter >= 2) != (mirrored && !cosine) ? opposite_of(value) : value;
}

static fdi_interval wave_at(double x, integer ahead)
{
    return fabs(x) <= DBL_MAX ? wave(x, in_quarter_turns(x), ahead) : (fdi_interval){-1.0, 1.0};
}

static integer whole_quarters(Turned turned) { return turned.quarter - (turned.rest.value < 0.0); }

/* Whole quarters in between are extremes: of sin the odd ones. */
static fdi_interval wave_over(fdi_interval x, integer ahead)
{
    const double width = x.high - x.low;
    if (width == 0.0) return wave_at(x.low, ahead);
    if (!(width <= NO_TURN)) return (fdi_interval){-1.0, 1.0};
    const Turned first = in_quarter_turns(x.low), last = in_quarter_turns(x.high);
    const fdi_interval begin = wave(x.low, first, ahead), end = wave(x.high, last, ahead);
    fdi_interval all = {smaller(begin.low, end.low), larger(begin.high, end.high)};
    const integer from = whole_quarters(first) + ahead, passed = (whole_quarters(last) + ahead - from) & 3;
    const integer between = passed == 0 && width > 3.0 ? 4 : passed;
    for (integer i = 1; i <= between; i++) {
        const integer quarter = (from + i) & 3;
        if (quarter == 1) all.high = 1.0;
        if (quarter == 3) all.low = -1.0;
    }
    return all;
}

fdi_interval fdi_sin_at(double x) { return wave_at(x, 0); }

fdi_interval fdi_cos_at(double x) { return wave_at(x, 1); }

fdi_interval fdi_sin_over(fdi_interval x) { return wave_over(x, 0); }

fdi_interval fdi_cos_over(fdi_interval x) { return wave_over(x, 1); }

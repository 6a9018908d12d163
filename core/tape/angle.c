/* atan2: the quotient a/b <= 1 of the smaller and the larger of |x|, |y|; atan(a/b) = atan(j/8) + atan t with
 * t = (a - b j/8) / (b + a j/8), |t| <= 1/16; then its mirror images. */
#include <float.h>

#include "tape/around.h"

static const double ANGLE_ERROR = 0x1p-59;
static const double STRAIGHT = 0x1p-27;
static const Pair HALF_TURN = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
static const Pair QUARTER_TURN = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
static const fdi_interval WHOLE_TURN = {-0x1.921fb54442d19p+1, 0x1.921fb54442d19p+1};

static const Pair TABLE[] = {
    /* atan(j/8), j = 0 .. 8 */
    {0.0, 0.0},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

static double beyond_linear(double t, double z) /* atan t - t, Taylor in z = t t */
{
    const double high = 1.0 / 9.0 - z * (1.0 / 11.0 - z * (1.0 / 13.0 - z / 15.0));
    return -(t * z) * (1.0 / 3.0 - z * (1.0 / 5.0 - z * (1.0 / 7.0 - z * high)));
}

/* t; for j = 0 the quotient itself. */
static Pair turned_back(double a, double b, double eighths)
{
    if (eighths == 0.0) return pair_over((Pair){a, 0.0}, (Pair){b, 0.0});
    const Pair cb = two_product(eighths, b), ca = two_product(eighths, a);
    Pair above = two_sum(a, -cb.value), below = two_sum(b, ca.value);
    above.rest -= cb.rest;
    below.rest += ca.rest;
    return pair_over(above, below);
}

/* atan(a/b) for 2^-27 <= a/b <= 1. */
static Pair arctangent(double a, double b)
{
    const double scale = b > 0x1p900 ? 0x1p-200 : b < 0x1p-700 ? 0x1p300 : 1.0;
    const integer j = (integer)(8.0 * (a / b) + 0.5);
    const Pair t = turned_back(a * scale, b * scale, 0.125 * (double)j), known = TABLE[j];
    const double z = t.value * t.value;
    const Pair sum = two_sum(known.value, t.value);
    const double small = sum.rest + (known.rest + (t.rest - t.rest * z));
    return two_sum(sum.value, small + beyond_linear(t.value, z));
}

static fdi_interval from(Pair corner, double sign, Pair v) /* corner + sign v */
{
    const Pair sum = two_sum(corner.value, sign * v.value);
    return around(sum.value, sum.rest + (corner.rest + sign * v.rest), ANGLE_ERROR);
}

static fdi_interval in_upper_half(double y, double x) /* y >= 0, not the origin */
{
    const int steep = y > fabs(x);
    const double a = smaller(y, fabs(x)), b = larger(y, fabs(x)), quotient = a / b;
    const int straight = quotient < STRAIGHT;
    if (straight && !steep && x > 0.0)
        return y == 0.0 ? (fdi_interval){0.0, 0.0}
                        : (fdi_interval){larger(0.0, next_down(next_down(quotient))), next_up(quotient)};
    const Pair v = straight ? (Pair){quotient, 0.0} : arctangent(a, b);
    if (steep) return from(QUARTER_TURN, x < 0.0 ? 1.0 : -1.0, v);
    return x < 0.0 ? from(HALF_TURN, -1.0, v) : from((Pair){0.0, 0.0}, 1.0, v);
}

fdi_interval fdi_atan2_at(double y, double x)
{
    if (!(fabs(x) <= DBL_MAX && fabs(y) <= DBL_MAX) || (x == 0.0 && y == 0.0)) return WHOLE_TURN;
    return y < 0.0 ? opposite_of(in_upper_half(-y, x)) : in_upper_half(y, x);
}

/* The least or the largest angle: it falls with x where y >= 0, rises with x below, and rises with y where x >= 0. */
static fdi_interval extreme(fdi_interval y, fdi_interval x, int largest)
{
    const int across = y.low < 0.0 && y.high >= 0.0; /* then x > 0, and the angle is of y's sign */
    const double u = across || (y.low >= 0.0) == largest ? x.low : x.high;
    return fdi_atan2_at((u >= 0.0) == largest ? y.high : y.low, u);
}

fdi_interval fdi_atan2_over(fdi_interval y, fdi_interval x)
{
    const int has_zero = y.low <= 0.0 && y.high >= 0.0;
    const int over_cut = x.low < 0.0 && y.low < 0.0 && y.high >= 0.0;
    if (over_cut || (has_zero && x.low <= 0.0 && x.high >= 0.0)) return WHOLE_TURN;
    return (fdi_interval){extreme(y, x, 0).low, extreme(y, x, 1).high};
}

fdi_interval fdi_pi(void) { return around(HALF_TURN.value, HALF_TURN.rest, ANGLE_ERROR); }

/* log: x = 2^power m, m within sqrt(1/2) .. sqrt(2), and log m = 2 atanh s, s = (m - 1) / (m + 1), |s| < 0.1716. */
#include <float.h>

#include "tape/around.h"

static const double LOG_ERROR = 0x1p-56;
static const double LN2_HIGH = 0x1.62e42fefa3800p-1; /* 42 bits: products with a power are exact */
static const double LN2_LOW = 0x1.ef35793c76000p-45; /* 40 bits; their sum is within 2^-86 of ln 2 */
static const double SQRT2 = 0x1.6a09e667f3bcdp+0;

static double mantissa_of(double x, integer *power) /* in [1, 2); of a positive double */
{
    int64_t bits;
    *power = x < DBL_MIN ? -1023 - 54 : -1023;
    if (x < DBL_MIN) x *= 0x1p54;
    memcpy(&bits, &x, sizeof bits);
    *power += bits >> 52;
    bits = (bits & 0xfffffffffffff) | (int64_t)1023 << 52;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static double beyond_linear(double s, double z) /* 2 atanh s - 2 s, Taylor in z = s s */
{
    const double high = 1.0 / 15.0 + z * (1.0 / 17.0 + z * (1.0 / 19.0 + z * (1.0 / 21.0 + z / 23.0)));
    const double low = 1.0 / 7.0 + z * (1.0 / 9.0 + z * (1.0 / 11.0 + z * (1.0 / 13.0 + z * high)));
    return 2.0 * s * z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * low));
}

fdi_interval fdi_log_at(double x)
{
    if (!(x > 0.0 && x <= DBL_MAX)) return WHOLE_LINE;
    integer power;
    double m = mantissa_of(x, &power);
    if (m > SQRT2) m *= 0.5, power++;
    const Pair s = pair_over((Pair){m - 1.0, 0.0}, two_sum(m, 1.0));
    const double k = (double)power, z = s.value * s.value;
    const Pair sum = two_sum(k * LN2_HIGH, 2.0 * s.value);
    const double rest = sum.rest + (k * LN2_LOW + 2.0 * (s.rest + s.rest * z));
    return around(sum.value, rest + beyond_linear(s.value, z), LOG_ERROR);
}

fdi_interval fdi_log_over(fdi_interval x)
{
    return x.low > 0.0 ? (fdi_interval){fdi_log_at(x.low).low, fdi_log_at(x.high).high} : WHOLE_LINE;
}

/* Powers of two: exponents of floats, and products with powers, exact but for underflow. */
#ifndef POWERS_H
#define POWERS_H

#include <string.h>

#include "core.h"

/* e with |value| in [2^(e-1), 2^e); 0 for 0. */
static inline integer exponent_of(double value)
{
    int64_t bits;
    memcpy(&bits, &value, sizeof bits);
    const integer biased = (bits >> 52) & 2047;
    if (biased != 0 && biased != 2047) return biased - 1022;
    int exponent;
    frexp(value, &exponent);
    return exponent;
}

/* value 2^power, rounded once. */
static inline double times_power(double value, integer power)
{
    if (power < -1022 || power > 1023) return ldexp(value, (int)most(least(power, 10000), -10000));
    const int64_t bits = (int64_t)(power + 1023) << 52;
    double factor;
    memcpy(&factor, &bits, sizeof factor);
    return value * factor;
}

/* The next float above a finite one. */
static inline double next_up(double value)
{
    int64_t bits;
    if (value == 0.0) value = 0.0; /* minus zero is below */
    memcpy(&bits, &value, sizeof bits);
    bits += bits >= 0 ? 1 : -1;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The next float below a finite one. */
static inline double next_down(double value) { return -next_up(-value); }

static inline double power_of_two(integer power) { return times_power(1.0, power); }

static const double MOST_UNITS = 0x1p51; /* beyond, a number has no digits to drop */

/* The largest power of two that is at most a step; 0 where that is none, or anything. */
static inline double unit_within(double step)
{
    return step > 0.0 && step < INFINITY ? power_of_two(exponent_of(step) - 1) : 0.0;
}

/* Of a number >= 0 the least multiple of a unit that is not below it; the number itself without a unit. */
static inline double multiple_above(double value, double unit)
{
    const double units = value / unit;
    return units < MOST_UNITS ? ceil(units) * unit : value;
}

/* Of any number the nearest multiple of a unit, or one as near. */
static inline double multiple_near(double value, double unit)
{
    const double units = value / unit;
    return fabs(units) < MOST_UNITS ? floor(units + 0.5) * unit : value;
}

/* A number >= 0 rounded up to 14 binary digits. */
static inline double short_above(double value) { return multiple_above(value, unit_within(0x1p-13 * value)); }

#endif

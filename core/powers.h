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

#endif

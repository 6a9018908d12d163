/* exp and tanh.
 *
 * x = power ln 2 + j/8 + d, |d| <= 1/16, and e^x = 2^power (e^(j/8) + e^(j/8) (e^d - 1)): the first of a table, the
 * second a small correction. tanh x = t / (t + 2), t = e^2x - 1.
 */
#include <float.h>

#include "tape/around.h"

static const double EXP_ERROR = 0x1p-59;
static const double TANH_ERROR = 0x1p-55;
static const double PER_LN2 = 0x1.71547652b82fep+0;
static const double LN2_HIGH = 0x1.62e42fefa3800p-1; /* 42 bits: products with a power are exact */
static const double LN2_LOW = 0x1.ef35793c76000p-45; /* 40 bits; their sum is within 2^-86 of ln 2 */
static const double LARGEST = 0x1.62e42fefa39efp+9;  /* the last double whose exponential is one */
static const double SMALLEST = -745.2;               /* below, it is less than every double above zero */
static const double FLAT = 19.0;                     /* from here on 1 - tanh < 2^-53 */
static const double STRAIGHT = 0x1p-27;

static const Pair TABLE[] = {
    /* e^(j/8), j = -3 .. 3 */
    {0x1.5fe4615e98e8fp-1, -0x1.5613923fd9eeep-55},
    {0x1.8ebef9eac820bp-1, -0x1.797d4686c5393p-57},
    {0x1.c3d6a24ed8222p-1, -0x1.e1e0a76cb0685p-55},
    {1.0, 0.0},
    {0x1.2216045b6f5cdp+0, -0x1.8c4a5df1ec7e5p-58},
    {0x1.48b5e3c3e8186p+0, 0x1.9d9ef0eda6eabp-54},
    {0x1.747a513dbef6ap+0, 0x1.88d1e2d966c25p-54},
};

typedef struct {
    integer power;
    Pair base, linear; /* e^(j/8), and its product with d */
    double curved;     /* base (e^d - 1 - d), the only term whose rounding counts */
} Exponential;         /* 2^power (base + linear + curved) */

static integer nearest(double x) { return (integer)(x + (x < 0.0 ? -0.5 : 0.5)); }

static double beyond_linear(double d) /* e^d - 1 - d, Taylor */
{
    const double high = 1.0 / 5040.0 + d * (1.0 / 40320.0 + d * (1.0 / 362880.0 + d / 3628800.0));
    return (d * d) * (1.0 / 2.0 + d * (1.0 / 6.0 + d * (1.0 / 24.0 + d * (1.0 / 120.0 + d * (1.0 / 720.0 + d * high)))));
}

static Exponential exponential(double x)
{
    const integer power = nearest(x * PER_LN2);
    const double k = (double)power;
    const Pair r = two_sum(x - k * LN2_HIGH, -(k * LN2_LOW));
    const integer j = nearest(8.0 * r.value);
    Pair d = two_sum(r.value, -0.125 * (double)j);
    d.rest += r.rest;
    const Pair base = TABLE[j + 3];
    Pair linear = two_product(base.value, d.value);
    linear.rest += base.rest * d.value + base.value * (d.rest + d.rest * d.value);
    return (Exponential){power, base, linear, base.value * beyond_linear(d.value)};
}

/* first + what is beyond the base's value, in units of 2^power. */
static Pair total(Pair first, Exponential e)
{
    const Pair sum = two_sum(first.value, e.linear.value);
    return (Pair){sum.value, (sum.rest + (first.rest + e.linear.rest)) + e.curved};
}

static fdi_interval scaled(fdi_interval a, integer power)
{
    if (power > 1023) a.low *= 2.0, a.high *= 2.0, power--;
    if (power >= -1021) return (fdi_interval){times_power(a.low, power), times_power(a.high, power)};
    const double half = power_of_two(power + 600), rest = 0x1p-600; /* rounds to a subnormal */
    return (fdi_interval){larger(0.0, next_down(a.low * half * rest)), next_up(a.high * half * rest)};
}

fdi_interval fdi_exp_at(double x)
{
    if (x != x) return WHOLE_LINE;
    if (x == 0.0) return (fdi_interval){1.0, 1.0};
    if (x > LARGEST) return (fdi_interval){DBL_MAX, INFINITY};
    if (x < SMALLEST) return (fdi_interval){0.0, next_up(0.0)};
    const Exponential e = exponential(x);
    const Pair sum = total(e.base, e);
    return scaled(around(sum.value, sum.rest, EXP_ERROR), e.power);
}

static fdi_interval tanh_of_positive(double x)
{
    if (x >= FLAT) return (fdi_interval){next_down(1.0), 1.0};
    const Exponential e = exponential(2.0 * x);
    const double unit = power_of_two(-e.power);
    Pair first = two_sum(e.base.value, -unit);
    first.rest += e.base.rest;
    const Pair sum = total(first, e), t = two_sum(sum.value, sum.rest);
    Pair below = two_sum(t.value, 2.0 * unit);
    below.rest += t.rest;
    const Pair quotient = pair_over(t, below);
    return within(around(quotient.value, quotient.rest, TANH_ERROR), 0.0, 1.0);
}

fdi_interval fdi_tanh_at(double x)
{
    if (x != x) return (fdi_interval){-1.0, 1.0};
    if (fabs(x) < STRAIGHT) return just_below(x);
    return x > 0.0 ? tanh_of_positive(x) : opposite_of(tanh_of_positive(-x));
}

fdi_interval fdi_exp_over(fdi_interval x) { return (fdi_interval){fdi_exp_at(x.low).low, fdi_exp_at(x.high).high}; }

fdi_interval fdi_tanh_over(fdi_interval x) { return (fdi_interval){fdi_tanh_at(x.low).low, fdi_tanh_at(x.high).high}; }

/* What every program here needs: checks that say where they failed, and numbers from a seed. */
#ifndef CHECK_H
#define CHECK_H

#include <stdio.h>

#include "core.h"

static int failures = 0;
static uint64_t seed = 1;

static inline void check(int holds, const char *what, const char *file, int line)
{
    if (holds) return;
    fprintf(stderr, "%s:%d: %s\n", file, line, what);
    failures++;
}

#define CHECK(condition) check((condition), #condition, __FILE__, __LINE__)

/* In [-1, 1), by Vigna's splitmix64. */
static inline double uniform(void)
{
    uint64_t bits = seed += 0x9e3779b97f4a7c15u;
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return (double)((bits ^ bits >> 31) >> 11) * 0x1p-52 - 1.0;
}

static inline integer whole(integer lower, integer upper) /* lower <= . <= upper */
{
    return lower + (integer)((uniform() + 1.0) * 0.5 * (double)(upper - lower + 1));
}

static inline void draw(double *target, integer count)
{
    for (integer j = 0; j < count; j++) target[j] = uniform();
}

static inline int near(double a, double b, double tolerance) { return fabs(a - b) <= tolerance * (1.0 + fabs(b)); }

#endif

/* What methods in machine integers share. */
#ifndef POLYTOPES_INTEGERS_H
#define POLYTOPES_INTEGERS_H

#include "core.h"

enum { OVERFLOWS = -1, TOO_MANY_RAYS = -2, NO_ROOM_FOR_RAYS = -3 }; /* why there are no rays */

static const double MACHINE = 4.611686018427387904e18; /* 2^62: sums below do not overflow, with room for rounding */

static inline double magnitude(const integer *vector, integer d)
{
    double largest = 0.0;
    for (integer j = 0; j < d; j++) largest = larger(fabs((double)vector[j]), largest);
    return largest;
}

static inline integer bits(uint64_t word)
{
    word -= (word >> 1) & 0x5555555555555555u;
    word = (word & 0x3333333333333333u) + ((word >> 2) & 0x3333333333333333u);
    word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return (integer)((word * 0x0101010101010101u) >> 56);
}

static inline integer common_divisor(integer a, integer b)
{
    while (b) {
        const integer rest = a % b;
        a = b, b = rest;
    }
    return a < 0 ? -a : a;
}

/* A vector over the common divisor of its entries. */
static inline void make_primitive(integer *vector, integer d)
{
    integer common = 0;
    for (integer j = 0; j < d && common != 1; j++) common = common_divisor(common, vector[j]);
    for (integer j = 0; common > 1 && j < d; j++) vector[j] /= common;
}

#endif

/* Reduction of any double by multiples of pi/2, in integers (Payne and Hanek 1983).
 *
 * x = M 2^E with M < 2^53. Of the product of x with 2/pi = sum of words 2^-32i, the words whose products with M are
 * multiples of 4 do not count, and those from the seventh of the others on are below 2^-138.
 */
#include "tape/quarter_turns.h"

#include <string.h>

enum { WORDS = 7 };

static const uint32_t TWO_OVER_PI[] = {
    /* two words of zeros, then the bits after the point */
    0x00000000, 0x00000000, 0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041,
    0xfe5163ab, 0xdebbc561, 0xb7246e3a, 0x424dd2e0, 0x06492eea, 0x09d1921c, 0xfe1deb1c, 0xb129a73e,
    0xe88235f5, 0x2ebb4484, 0xe99c7026, 0xb45f7e41, 0x3991d639, 0x835339f4, 0x9c845f8b, 0xbdf9283b,
    0x1ff897ff, 0xde05980f, 0xef2f118b, 0x5a0a6d1f, 0x6d367ecf, 0x27cb09b7, 0x4f463f66, 0x9e5fea2d,
    0x7527bac7, 0xebe5f17b, 0x3d0739f7, 0x8a5292ea, 0x6bfb5fb1, 0x1f8d5d08, 0x56033046,
};
static const Pair HALF_PI = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
static const double WITHIN_A_QUARTER = 0.785; /* below pi/4 */

/* |x| 2/pi modulo 4, in units of 2^-222, lowest word first. */
static void quarters(uint32_t words[WORDS], double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    const integer exponent = (integer)(bits >> 52 & 2047) - 1075 + 62;
    const uint64_t whole = (bits & 0xfffffffffffff) | (uint64_t)1 << 52;
    const uint32_t *first = TWO_OVER_PI + exponent / 32;
    const unsigned shift = (unsigned)(exponent % 32);
    const uint64_t shifted = whole << shift;
    const uint32_t M[3] = {(uint32_t)shifted, (uint32_t)(shifted >> 32), (uint32_t)(whole >> 32 >> (32 - shift))};
    memset(words, 0, WORDS * sizeof *words);
    for (int k = 0; k < 3; k++) {
        uint64_t carry = 0;
        for (int i = 0; i + k < WORDS; i++) {
            carry += (uint64_t)first[WORDS - 1 - i] * M[k] + words[i + k];
            words[i + k] = (uint32_t)carry;
            carry >>= 32;
        }
    }
}

/* The leading four words that are not zero: at most one is, since no double is within 2^-62 of whole quarters. */
static Pair leading(const uint32_t words[WORDS])
{
    const int top = words[WORDS - 1] ? WORDS - 1 : WORDS - 2;
    const double unit = top == WORDS - 1 ? 0x1p-62 : 0x1p-94;
    const Pair sum = two_sum(0x1p32 * words[top], words[top - 1]);
    const double rest = sum.rest + (0x1p-32 * words[top - 2] + 0x1p-64 * words[top - 3]);
    return two_sum(unit * sum.value, unit * rest);
}

Turned in_quarter_turns(double x)
{
    if (fabs(x) <= WITHIN_A_QUARTER) return (Turned){0, {x, 0.0}};
    uint32_t words[WORDS];
    quarters(words, x);
    const int up = words[WORDS - 1] >> 29 & 1; /* the nearest whole number is the next one */
    integer quarter = (integer)(words[WORDS - 1] >> 30) + up;
    if (up) /* from there on, downwards; one unit less than exactly */
        for (int i = 0; i < WORDS; i++) words[i] = ~words[i];
    words[WORDS - 1] &= 0x3fffffff;
    Pair rest = pair_times(leading(words), HALF_PI);
    if (x < 0.0) quarter = -quarter;
    if (up != (x < 0.0)) rest = (Pair){-rest.value, -rest.rest};
    return (Turned){quarter & 3, rest};
}

/* What every file of the core shares: types, the mark of an exported function, units of rounding.
 *
 * Arrays are C-contiguous doubles or int64; sizes and indices are int64. Nothing here allocates: whoever calls gives
 * results and scratch. Sums run in the order in which they are written, so that every build gives the same bits.
 */
#ifndef CORE_H
#define CORE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

/* A function of long loops: built for wider vectors too, and chosen when the library is loaded. The same bits. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

typedef int64_t integer;

#define UNIT 1.1102230246251565e-16 /* unit roundoff */
#define EPS 2.220446049250313e-16   /* distance from 1 to the next double */

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double clipped(double value, double lower, double upper) /* NaN stays */
{
    return value < lower ? lower : value > upper ? upper : value;
}
static inline integer least(integer a, integer b) { return a < b ? a : b; }
static inline integer most(integer a, integer b) { return a > b ? a : b; }

#endif

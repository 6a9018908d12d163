/* Largest size of the sums of q consecutive samples, for q = 1..qbar, in two floats each. */
#include "core.h"

static const integer BLOCK = 4096; /* samples whose partial sums are made at once: in the cache, and rounding little */

EXPORTED integer fdi_extreme_sums_room(integer qbar) { return 2 * (BLOCK + qbar); }

/* Partial sums of u (m,) backwards: that of the first i samples is sums[m - i] + rest[m - i] (Knuth's TwoSum). */
static void partial_sums(const double *restrict u, integer m, double *restrict sums, double *restrict rest)
{
    sums[m] = rest[m] = 0.0;
    for (integer i = 0; i < m; i++) {
        const double a = sums[m - i], b = u[i], total = a + b, part = total - a;
        sums[m - i - 1] = total;
        rest[m - i - 1] = rest[m - i] + ((a - (total - part)) + (b - part));
    }
}

/* Raise best[q] + low[q] to the size of (now + fine) - (before[q] + finer[q]), where that is larger. */
WIDE static void raise_extremes(double now, double fine, const double *restrict before, const double *restrict finer,
                       integer count, double *restrict best, double *restrict low)
{
    for (integer q = 0; q < count; q++) {
        const double b = -before[q], total = now + b, part = total - now;
        const double signed_error = ((now - (total - part)) + (b - part)) + (fine - finer[q]);
        const double size = fabs(total), opposite = -signed_error;
        const double of_zero = signed_error > 0.0 ? signed_error : opposite;
        const double error = total > 0.0 ? signed_error : total < 0.0 ? opposite : of_zero;
        const int exceeds = size - best[q] + (error - low[q]) > 0.0;
        best[q] = exceeds ? size : best[q];
        low[q] = exceeds ? error : low[q];
    }
}

/* Raise best[q - 1] + low[q - 1] to the largest size of a sum of q consecutive samples of u (n,), full windows only.
 *
 * best, low (qbar,). The partial sums of a block and of the qbar samples before it stand backwards, so that the inner
 * loop walks arrays side by side.
 */
EXPORTED void fdi_extreme_sums(integer n, integer qbar, const double *u, double *best, double *low, double *block)
{
    double *sums = block, *rest = sums + BLOCK + qbar;
    for (integer start = 0; start < n; start += BLOCK) {
        const integer first = most(0, start - qbar + 1), m = least(start + BLOCK, n) - first;
        partial_sums(u + first, m, sums, rest);
        for (integer j = start - first + 1; j <= m; j++) {
            const integer before = m - j + 1;
            raise_extremes(sums[before - 1], rest[before - 1], sums + before, rest + before, least(qbar, j), best, low);
        }
    }
}

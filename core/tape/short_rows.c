/* A linear bound in fewer digits: of r(x, w) in A x + E w + a + [-R, R] over a box, in numbers that records can hold.
 *
 * Digits that move the row over the box by less than a part of R are dropped. What they did at the middle of the box
 * joins a, and the rest R. A row whose R is of the size of rounding keeps them all.
 */
#include "tape/plant.h"

#include "powers.h"
#include "vectors.h"

static const double DROPPED = 0x1p-6; /* of R, by which the row may be moved */

/* Shorter coefficients (m) of what lies in a box: what that does at its middle is added, with the size of its terms, and
 * what it does besides is returned. */
static double shorten(double *g, const double *low, const double *high, integer m, double most, double *at_middle,
                      double *size)
{
    double rest = 0.0;
    for (integer j = 0; j < m; j++) {
        const double c = 0.5 * low[j] + 0.5 * high[j], reach = larger(high[j] - c, c - low[j]);
        const double found = multiple_near(g[j], unit_within(2.0 * most / reach)), lost = g[j] - found; /* exact */
        g[j] = found;
        rest += fabs(lost) * reach;
        *at_middle += lost * c;
        *size += fabs(lost * c);
    }
    return rest;
}

static double size_of(const double *g, const double *low, const double *high, integer m)
{
    double size = 0.0;
    for (integer j = 0; j < m; j++) size += fabs(g[j]) * larger(fabs(low[j]), fabs(high[j]));
    return size;
}

void shorten_row(const plant *p, span x, double *A, double *E, double *a, double *R)
{
    const integer n = p->n, nw = p->nw;
    const double most = DROPPED * *R / (double)(n + nw + 1), rounding = 2.0 * (double)(n + nw + 8) * ROUNDING;
    const double all = fabs(*a) + size_of(A, x.low, x.high, n) + size_of(E, p->w_low, p->w_high, nw);
    if (most > rounding * all) {
        double at_middle = *a, size = fabs(*a);
        double rest = shorten(A, x.low, x.high, n, most, &at_middle, &size);
        rest += shorten(E, p->w_low, p->w_high, nw, most, &at_middle, &size);
        *a = multiple_near(at_middle, unit_within(2.0 * most));
        rest += fabs(at_middle - *a) + rounding * (size + rest + *R) + TINIEST;
        *R = (*R + rest) * (1.0 + 2.0 * ROUNDING);
    }
    *R = multiple_above(*R, unit_within(0x1p-8 * *R));
}

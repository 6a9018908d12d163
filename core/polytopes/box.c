/* Boxes: rows with one entry each. Their bounds, a point, and their supports need no program.
 *
 * And what rows are at a look: every set asks for it as it is made.
 */
#include "polytopes/polytopes.h"
#include "polytopes/sums.h"
#include "vectors.h"

static const double FARTHEST = 1e150; /* bound of a coordinate; beyond, the general path refuses it */

typedef struct {
    double below, above; /* neighbours of the exact quotient, or it itself twice */
} Quotient;

static Quotient quotient(double b, double a)
{
    const double q = b / a + 0.0;
    if (fabs(a) == 1.0) return (Quotient){q, q};
    const Pair product = two_product(q, a);
    const double rest = ((b - product.value) - product.rest) * a; /* of the sign of b / a - q */
    return (Quotient){rest < 0.0 ? -next_up(-q) : q, rest > 0.0 ? next_up(q) : q};
}

/* One row: the bounds outward and inward of its coordinate; 0 if it is none of a box. */
static int take_row(const double *row, double b, integer n, double *lower, double *upper, double *least_upper,
                    double *most_lower)
{
    integer j = -1;
    for (integer k = 0; k < n; k++) {
        if (row[k] == 0.0) continue;
        if (j >= 0) return 0;
        j = k;
    }
    if (j < 0) return b >= 0.0;
    const double a = row[j];
    if (fabs(a) != 1.0 && !(moderate(a) && moderate(b))) return 0;
    const Quotient q = quotient(b, a);
    if (fabs(q.below) > FARTHEST || fabs(q.above) > FARTHEST) return 0;
    if (a > 0.0) {
        upper[j] = smaller(q.above, upper[j]);
        least_upper[j] = smaller(q.below, least_upper[j]);
    } else {
        lower[j] = larger(q.below, lower[j]);
        most_lower[j] = larger(q.above, most_lower[j]);
    }
    return 1;
}

/* Rows A (m, n), b (m,) at a look: 0 if a number is not finite, 1 if a row has two entries or more, else 2. */
EXPORTED integer fdi_look(integer n, integer m, const double *A, const double *b)
{
    integer found = 2;
    for (integer i = 0; i < m; i++) {
        integer entries = 0;
        for (integer j = 0; j < n; j++) {
            if (!isfinite(A[i * n + j])) return 0;
            entries += A[i * n + j] != 0.0;
        }
        if (!isfinite(b[i])) return 0;
        if (entries > 1) found = 1;
    }
    return found;
}

enum { NO_BOX, SOME_BOX, KNOWN_BOX, WIDE_BOX };

/* Whether rows A (m, n), b (m,) are those of a box that is not empty: known if it is bounded and no corner was rounded, and
 * wide if it is not flat either.
 *
 * If so, bounds holds its lower and upper corner, rounded outward, infinite where there is none, and a point that
 * satisfies every row exactly: (3, n), and 2 n more to work in.
 */
EXPORTED integer fdi_box(integer n, integer m, const double *A, const double *b, double *bounds)
{
    double *lower = bounds, *upper = lower + n, *point = upper + n, *most_lower = point + n;
    double *least_upper = most_lower + n;
    fill(lower, -INFINITY, n);
    fill(most_lower, -INFINITY, n);
    fill(upper, INFINITY, n);
    fill(least_upper, INFINITY, n);
    for (integer i = 0; i < m; i++)
        if (!take_row(A + i * n, b[i], n, lower, upper, least_upper, most_lower)) return NO_BOX;
    int known = 1, wide = 1;
    for (integer j = 0; j < n; j++) {
        if (most_lower[j] > least_upper[j]) return NO_BOX;
        const double middle = 0.5 * most_lower[j] + 0.5 * least_upper[j];
        const int bounded = most_lower[j] > -INFINITY && least_upper[j] < INFINITY;
        point[j] = clipped(bounded ? middle : 0.0, most_lower[j], least_upper[j]);
        known &= bounded && lower[j] == most_lower[j] && upper[j] == least_upper[j], wide &= lower[j] < upper[j];
    }
    return !known ? SOME_BOX : !wide ? KNOWN_BOX : WIDE_BOX;
}

/* Upper bounds (k,) of the supports of a box along directions (k, n); 0 if its numbers are too uneven for that.
 *
 * bounds (2, n): lower and upper corner. The bounds are the supports where nothing is rounded.
 */
EXPORTED integer fdi_box_supports(integer n, integer k, const double *bounds, const double *directions, double *values)
{
    for (integer q = 0; q < k; q++) {
        const double *c = directions + q * n;
        Sum sum = {0.0, 0.0, 0.0};
        double spare;
        int open = 0;
        for (integer j = 0; j < n; j++) {
            if (c[j] == 0.0) continue;
            const double bound = c[j] > 0.0 ? bounds[n + j] : bounds[j];
            if (fabs(bound) == INFINITY) {
                open = 1;
                continue;
            }
            if (!moderate(c[j]) || !moderate(bound)) return 0;
            add_product(&sum, c[j], bound);
        }
        values[q] = open ? INFINITY : upper(sum, &spare);
    }
    return 1;
}

/* Rows moved inward by a set of known vertices: the sides of a Pontryagin difference. */
#include "polytopes/polytopes.h"
#include "polytopes/sums.h"

/* Sides (m,) of rows A (m, n), b (m,): the least of b - A v over points V (k, n), rounded up, and so where anything is
 * rounded. 0 if the numbers are of too different sizes.
 */
EXPORTED integer fdi_moved_rows(integer n, integer m, const double *A, const double *b, integer k, const double *V,
                                double *sides)
{
    for (integer i = 0; i < m; i++) {
        sides[i] = INFINITY;
        for (integer v = 0; v < k; v++) {
            Sum sum = {b[i], 0.0, 0.0};
            double spare;
            if (!moderate(b[i])) return 0;
            for (integer j = 0; j < n; j++) {
                if (!moderate(A[i * n + j]) || !moderate(V[v * n + j])) return 0;
                add_product(&sum, -A[i * n + j], V[v * n + j]);
            }
            sides[i] = smaller(upper(sum, &spare), sides[i]);
        }
    }
    return 1;
}

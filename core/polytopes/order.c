/* Points in lexicographic order, so that a list of them does not tell how it was found. */
#include "polytopes/polytopes.h"
#include "vectors.h"

static int comes_before(const double *first, const double *second, integer n)
{
    for (integer j = 0; j < n; j++)
        if (first[j] != second[j]) return first[j] < second[j];
    return 0;
}

/* Sorts points (k, n) by merging; as much room to work in. */
void put_in_order(integer n, integer k, double *points, double *work)
{
    double *from = points, *to = work;
    for (integer width = 1; width < k; width *= 2) {
        for (integer low = 0; low < k; low += 2 * width) {
            const integer middle = least(low + width, k), high = least(low + 2 * width, k);
            integer p = low, q = middle;
            for (integer r = low; r < high; r++) {
                const int second = p == middle || (q < high && comes_before(from + q * n, from + p * n, n));
                copy(to + r * n, from + (second ? q++ : p++) * n, n);
            }
        }
        double *sorted = to;
        to = from, from = sorted;
    }
    if (from != points) copy(points, from, k * n);
}

/* Interval recursions contain every trajectory of their gains; moving sums have the extremes of the plainest loop. */
#include "interval/interval.h"

#include <stdlib.h>

#include "check.h"

Moved fdi_interval_move(double center, double radius, double u, double gc, double gr, double hc, double hr,
                        double slope, double limit);
integer fdi_extreme_sums_room(integer qbar);
void fdi_extreme_sums(integer n, integer qbar, const double *u, double *best, double *low, double *block);

enum { LONG = 9000, QBAR = 7 };

/* x(k+1) = g x + (1 - g) h u for any g and h that the gains allow. */
static void transitions(void)
{
    const double gc = 0.5 * uniform(), gr = 0.2 * fabs(uniform()), hc = uniform(), hr = 0.1 * fabs(uniform());
    const double center = 3.0 * uniform(), radius = fabs(uniform()), u = 2.0 * uniform();
    const Moved moved = fdi_interval_move(center, radius, u, gc, gr, hc, hr, 0.0, 1.0);
    CHECK(moved.used == gr);
    for (integer corner = 0; corner < 8; corner++) {
        const long double g = gc + (corner & 1 ? gr : -gr), h = hc + (corner & 2 ? hr : -hr);
        const long double x = center + (corner & 4 ? radius : -radius), next = g * x + (1.0L - g) * h * u;
        CHECK(fabsl(next - moved.center) <= moved.radius);
    }
}

static void extremes(integer n)
{
    double *u = malloc(sizeof(double) * LONG), best[QBAR], low[QBAR];
    double *block = malloc(sizeof(double) * (size_t)fdi_extreme_sums_room(QBAR));
    for (integer q = 0; q < QBAR; q++) best[q] = low[q] = 0.0;
    for (integer i = 0; i < n; i++) u[i] = i > 4090 && i < 4100 ? 1.0 : uniform(); /* across the end of a block */
    fdi_extreme_sums(n, QBAR, u, best, low, block);
    for (integer q = 1; q <= QBAR; q++) {
        long double largest = 0.0L;
        for (integer i = 0; i + q <= n; i++) {
            long double sum = 0.0L;
            for (integer j = i; j < i + q; j++) sum += u[j];
            if (fabsl(sum) > largest) largest = fabsl(sum);
        }
        CHECK(near(best[q - 1] + low[q - 1], (double)largest, 1e-15));
    }
    free(block);
    free(u);
}

int main(void)
{
    for (integer i = 0; i < 1000; i++) transitions();
    for (integer n = 0; n < 12; n++) extremes(n);
    for (integer n = 4090; n < 4105; n += 3) extremes(n);
    extremes(LONG);
    return failures > 0;
}

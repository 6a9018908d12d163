/* Boxes: corners outward, a point inside, supports; what is none. */
#include "check.h"
#include "polytopes/sums.h"
#include "vectors.h"

integer fdi_box(integer n, integer m, const double *A, const double *b, double *bounds);
integer fdi_box_supports(integer n, integer k, const double *bounds, const double *directions, double *values);

enum { N = 3 };

/* Rows in any order and of any length, against quotients in long doubles. */
static void corners(void)
{
    double A[2 * N * N] = {0.0}, b[2 * N], bounds[5 * N];
    for (integer i = 0; i < 2 * N; i++) {
        A[i * N + i / 2] = (i % 2 ? -1.0 : 1.0) * (0.1 + fabs(uniform()));
        b[i] = fabs(uniform());
    }
    CHECK(fdi_box(N, 2 * N, A, b, bounds) == 1);
    for (integer j = 0; j < N; j++) {
        const long double high = (long double)b[2 * j] / A[2 * j * N + j];
        const long double low = (long double)b[2 * j + 1] / A[(2 * j + 1) * N + j];
        CHECK(bounds[N + j] >= high && bounds[N + j] <= nextafter((double)high, INFINITY));
        CHECK(bounds[j] <= low && bounds[j] >= nextafter((double)low, -INFINITY));
    }
    for (integer i = 0; i < 2 * N; i++) CHECK((long double)A[i * N + i / 2] * bounds[2 * N + i / 2] <= b[i]);
}

static void supports_of_a_box(void)
{
    double bounds[2 * N], directions[4 * N], values[4];
    for (integer j = 0; j < N; j++) bounds[j] = -fabs(uniform()), bounds[N + j] = fabs(uniform());
    draw(directions, 4 * N);
    CHECK(fdi_box_supports(N, 4, bounds, directions, values) == 1);
    for (integer q = 0; q < 4; q++) {
        long double exact = 0.0L;
        for (integer j = 0; j < N; j++) {
            const double c = directions[q * N + j];
            exact += (long double)c * (c > 0.0 ? bounds[N + j] : bounds[j]);
        }
        CHECK(values[q] >= exact - 1e-19L && near(values[q], (double)exact, 1e-15));
    }
}

static void what_is_none(void)
{
    const double askew[] = {1.0, 1.0}, twice[] = {1.0, -1.0}, apart[] = {-1.0, -1.0}, touching[] = {1.0, -1.0};
    const double both[] = {2.0, -1.0};
    const double far[] = {1e200}, one[] = {1.0}, third[] = {3.0}, zero[] = {0.0}, minus[] = {-1.0};
    double bounds[10];
    CHECK(fdi_box(2, 1, askew, one, bounds) == 0);
    CHECK(fdi_box(1, 2, twice, apart, bounds) == 0);   /* empty */
    CHECK(fdi_box(1, 2, twice, touching, bounds) == 2); /* a point */
    CHECK(bounds[0] == 1.0 && bounds[1] == 1.0 && bounds[2] == 1.0);
    CHECK(fdi_box(1, 2, twice, both, bounds) == 3 && bounds[0] == 1.0 && bounds[1] == 2.0);
    CHECK(fdi_box(1, 1, one, far, bounds) == 0);
    CHECK(fdi_box(1, 1, zero, minus, bounds) == 0);
    CHECK(fdi_box(1, 1, zero, one, bounds) == 1); /* everything */
    CHECK(bounds[0] == -INFINITY && bounds[1] == INFINITY && bounds[2] == 0.0);
    CHECK(fdi_box(1, 1, third, one, bounds) == 1 && bounds[1] > 1.0 / 3.0 && bounds[2] <= 1.0 / 3.0);
}

/* A sum of products with what rounding took from it: an upper bound, by less than one unit. */
static void sums_are_outward(void)
{
    for (integer i = 0; i < 1000; i++) {
        Sum sum = {0.0, 0.0, 0.0};
        long double exact = 0.0L;
        double spare;
        for (integer j = 0; j < 5; j++) {
            const double u = (double)(float)uniform(), v = (double)(float)uniform(); /* products are exact */
            add_product(&sum, u, v);
            exact += (long double)u * v;
        }
        const double value = upper(sum, &spare);
        CHECK(value >= exact && value - exact <= 4.0L * EPS && spare >= 0.0);
    }
}

int main(void)
{
    for (integer i = 0; i < 200; i++) {
        corners();
        supports_of_a_box();
    }
    what_is_none();
    sums_are_outward();
    return failures > 0;
}

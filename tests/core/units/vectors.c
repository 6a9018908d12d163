/* Loops over short vectors of every length, against the plainest loop; powers of two against the C library. */
#include "vectors.h"

#include <float.h>

#include "check.h"
#include "powers.h"

enum { LONGEST = 19 };

static void reductions(integer m)
{
    double a[LONGEST + 1], b[LONGEST + 1];
    draw(a, LONGEST + 1);
    draw(b, LONGEST + 1);
    double product = 0.0, squares = 0.0, largest = 0.0, above = 0.0, below = 0.0;
    for (integer j = 0; j < m; j++) {
        product += a[j] * b[j];
        squares += a[j] * a[j];
        largest = larger(fabs(a[j]), largest);
        above = larger(a[j], above);
        below = smaller(a[j], below);
    }
    a[m] = b[m] = 1e9; /* one too many would show */
    CHECK(near(dot(a, b, m), product, 1e-15));
    CHECK(near(sum_of_squares(a, m), squares, 1e-15));
    CHECK(largest_magnitude(a, m) == largest);
    CHECK(largest_above(a, m) == above);
    a[m] = -1e9;
    CHECK(smallest_below(a, m) == below);
}

static void rows_that_are_added(integer count, integer m)
{
    double matrix[LONGEST * LONGEST], factor[LONGEST], target[LONGEST], expected[LONGEST];
    integer index[LONGEST];
    draw(matrix, LONGEST * LONGEST);
    draw(factor, LONGEST);
    draw(target, LONGEST);
    copy(expected, target, LONGEST);
    for (integer q = 0; q < count; q++) {
        index[q] = whole(0, LONGEST - 1);
        for (integer j = 0; j < m; j++) expected[j] += factor[q] * matrix[index[q] * m + j];
    }
    add_rows(target, matrix, index, factor, count, m);
    for (integer j = 0; j < LONGEST; j++) CHECK(near(target[j], expected[j], 1e-15));
}

static void powers(void)
{
    const double values[] = {0.0, 1.0, -0.75, DBL_MIN, DBL_MAX, 0x1p-1074, -0x1.8p-1060, 3.0, 0x1p1000};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        int exponent;
        frexp(values[i], &exponent);
        CHECK(exponent_of(values[i]) == exponent);
        for (integer power = -2200; power <= 2200; power += 11)
            CHECK(times_power(values[i], power) == ldexp(values[i], (int)power));
        CHECK(next_up(values[i]) == nextafter(values[i], INFINITY));
        CHECK(next_up(-values[i]) == nextafter(-values[i], INFINITY));
    }
    CHECK(times_power(1.0, INT64_MAX) == INFINITY);
    CHECK(times_power(1.0, INT64_MIN) == 0.0);
    CHECK(power_of_two(-1074) == 0x1p-1074);
}

static void comparisons_with_nothing(void)
{
    CHECK(larger(NAN, 1.0) == 1.0); /* the second where the first is no number */
    CHECK(smaller(NAN, 1.0) == 1.0);
    CHECK(isnan(clipped(NAN, 0.0, 1.0)));
    CHECK(clipped(2.0, 0.0, 1.0) == 1.0);
    CHECK(clipped(-2.0, 0.0, 1.0) == 0.0);
}

int main(void)
{
    for (integer m = 0; m < LONGEST; m++) {
        reductions(m);
        for (integer count = 0; count < LONGEST; count++) rows_that_are_added(count, m);
    }
    powers();
    comparisons_with_nothing();
    return failures > 0;
}

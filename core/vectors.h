/* Loops over short vectors. Sums have four parts, so that they vectorise in an order that no compiler may change. */
#ifndef VECTORS_H
#define VECTORS_H

#include "core.h"

static inline void fill(double *restrict target, double value, integer m)
{
    for (integer j = 0; j < m; j++) target[j] = value;
}

static inline void copy(double *restrict target, const double *restrict source, integer m)
{
    for (integer j = 0; j < m; j++) target[j] = source[j];
}

/* target += factor * source. */
static inline void add_multiple(double *restrict target, double factor, const double *restrict source, integer m)
{
    for (integer j = 0; j < m; j++) target[j] += factor * source[j];
}

static inline double dot(const double *restrict a, const double *restrict b, integer m)
{
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    integer j = 0;
    for (; j + 4 <= m; j += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] += a[j + lane] * b[j + lane];
    for (; j < m; j++) part[0] += a[j] * b[j];
    return (part[0] + part[1]) + (part[2] + part[3]);
}

static inline double sum_of_squares(const double *restrict a, integer m)
{
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    integer j = 0;
    for (; j + 4 <= m; j += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] += a[j + lane] * a[j + lane];
    for (; j < m; j++) part[0] += a[j] * a[j];
    return (part[0] + part[1]) + (part[2] + part[3]);
}

static inline double largest_magnitude(const double *restrict a, integer m)
{
    double largest = 0.0;
    for (integer j = 0; j < m; j++) largest = larger(fabs(a[j]), largest);
    return largest;
}

/* The largest entry, or zero. */
static inline double largest_above(const double *restrict a, integer m)
{
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    integer j = 0;
    for (; j + 4 <= m; j += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] = larger(a[j + lane], part[lane]);
    for (; j < m; j++) part[0] = larger(a[j], part[0]);
    return larger(larger(part[0], part[1]), larger(part[2], part[3]));
}

/* The least entry that is a number; infinity if there is none. */
static inline double least_of(const double *restrict a, integer m)
{
    double part[4] = {INFINITY, INFINITY, INFINITY, INFINITY};
    integer j = 0;
    for (; j + 4 <= m; j += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] = smaller(a[j + lane], part[lane]);
    for (; j < m; j++) part[0] = smaller(a[j], part[0]);
    return smaller(smaller(part[0], part[1]), smaller(part[2], part[3]));
}

/* The smallest entry, or zero. */
static inline double smallest_below(const double *restrict a, integer m)
{
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    integer j = 0;
    for (; j + 4 <= m; j += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] = smaller(a[j + lane], part[lane]);
    for (; j < m; j++) part[0] = smaller(a[j], part[0]);
    return smaller(smaller(part[0], part[1]), smaller(part[2], part[3]));
}

/* target += sum over q of factor[q] row index[q] of a matrix of m columns, four rows a pass. */
static inline void add_rows(double *restrict target, const double *restrict matrix, const integer *restrict index,
                            const double *restrict factor, integer count, integer m)
{
    integer q = 0;
    for (; q + 4 <= count; q += 4) {
        const double fa = factor[q], fb = factor[q + 1], fc = factor[q + 2], fd = factor[q + 3];
        const double *restrict ra = matrix + index[q] * m, *restrict rb = matrix + index[q + 1] * m;
        const double *restrict rc = matrix + index[q + 2] * m, *restrict rd = matrix + index[q + 3] * m;
        for (integer j = 0; j < m; j++) target[j] += (fa * ra[j] + fb * rb[j]) + (fc * rc[j] + fd * rd[j]);
    }
    for (; q < count; q++) add_multiple(target, factor[q], matrix + index[q] * m, m);
}

#endif

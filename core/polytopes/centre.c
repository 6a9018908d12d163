/* A point strictly inside, and the rows seen from it: without duplicates, each axis and each slack about one. */
#include "polytopes/polytopes.h"
#include "polytopes/sums.h"
#include "powers.h"
#include "vectors.h"

static const double ROUNDED_SLACK = 1e-14; /* of a slack: rounding beyond is computed */

/* Whether every slack of a point z (d,) exceeds what is rounded in it, and in its row.
 *
 * at (d, m), b (m,): rows; of_rows (m, d) and of_rhs (m,): bounds of what was rounded in them, or both NULL; room (2 m,).
 */
EXPORTED integer fdi_strictly_inside(integer d, integer m, const double *at, const double *b, const double *z,
                                     const double *of_rows, const double *of_rhs, double *room)
{
    const double unit = (double)(d + 3) * EPS;
    double *slack = room, *error = room + m;
    for (integer i = 0; i < m; i++) slack[i] = b[i], error[i] = unit * fabs(b[i]);
    for (integer j = 0; j < d; j++) {
        const double *a = at + j * m, size = fabs(z[j]), part = unit * size;
        for (integer i = 0; i < m; i++) slack[i] -= a[i] * z[j], error[i] += part * fabs(a[i]);
        for (integer i = 0; of_rows && i < m; i++) error[i] += size * of_rows[i * d + j] * (1.0 + unit);
    }
    if (of_rhs) add_multiple(error, 1.0 + unit, of_rhs, m);
    integer inside = 1;
    for (integer i = 0; i < m; i++) inside &= slack[i] > error[i];
    return inside;
}

/* b_i - a_i'x as if in twice the precision (Ogita, Rump and Oishi 2005). */
static double precise_slack(const Rows *rows, const double *x, integer i)
{
    double total = rows->b[i], lost = 0.0;
    for (integer j = 0; j < rows->d; j++) {
        const Pair product = two_product(-rows->at[j * rows->stride + i], x[j]), moved = two_sum(total, product.value);
        lost += product.rest;
        lost += moved.rest;
        total = moved.value;
    }
    return total + lost;
}

integer centred_room(integer k) { return 3 * k; }

/* The k chosen rows seen from x0: at (d, k), b (k,). 0 if x0 is not strictly inside.
 *
 * Slacks come in twice the working precision; rows are scaled so that the origin's slack is about one, coordinates so
 * that the steepest entry is; all by powers of two.
 */
int centred(const Rows *rows, const integer *chosen, integer k, const double *x0, double *at, double *b, Memory memory)
{
    const integer d = rows->d;
    double *value = doubles(&memory, k), *terms = doubles(&memory, k), *factor = doubles(&memory, k);
    for (integer q = 0; q < k; q++) value[q] = rows->b[chosen[q]], terms[q] = fabs(value[q]);
    for (integer j = 0; j < d; j++) {
        for (integer q = 0; q < k; q++) {
            at[j * k + q] = rows->at[j * rows->stride + chosen[q]];
            const double part = at[j * k + q] * x0[j];
            value[q] -= part;
            terms[q] += fabs(part);
        }
    }
    for (integer q = 0; q < k; q++) {
        if ((double)(d + 2) * EPS * terms[q] > ROUNDED_SLACK * value[q]) value[q] = precise_slack(rows, x0, chosen[q]);
        if (!(value[q] > 0.0)) return 0;
        const integer exponent = exponent_of(value[q]);
        b[q] = times_power(value[q], -exponent);
        factor[q] = power_of_two(-exponent);
    }
    for (integer j = 0; j < d; j++) {
        double *entries = at + j * k;
        for (integer q = 0; q < k; q++) entries[q] *= factor[q];
        const double steepest = largest_magnitude(entries, k);
        if (!(steepest > 0.0)) continue;
        const double even = power_of_two(-exponent_of(steepest));
        for (integer q = 0; q < k; q++) entries[q] *= even;
    }
    return 1;
}

EXPORTED integer fdi_centred_room(integer m) { return m + centred_room(m); }

/* The same of rows at (d, m), b (m,), all of them. */
EXPORTED integer fdi_centred(integer d, integer m, const double *at, const double *b, const double *x0,
                             double *centred_at, double *centred_b, double *block)
{
    Memory memory = {block, 0};
    const Rows rows = {d, m, m, at, b};
    integer *chosen = integers(&memory, m);
    for (integer i = 0; i < m; i++) chosen[i] = i;
    return centred(&rows, chosen, m, x0, centred_at, centred_b, memory);
}

/* A power of two, at least twice m. */
static integer table_size(integer m)
{
    integer size = 2;
    while (size < 2 * m) size *= 2;
    return size;
}

integer distinct_room(integer d, integer m) { return m * (d + 5) + table_size(m); }

static integer place_of(double key, integer size)
{
    uint64_t bits;
    memcpy(&bits, &key, sizeof bits);
    return (integer)((bits * 0x9E3779B97F4A7C15u) >> 20) & (size - 1);
}

/* Normals over powers of two, largest entry in [1/2, 1), row by row; with them a number that equal normals share. */
static void common_scale(const Rows *rows, double *normals, double *rhs, double *key, double *factor)
{
    const integer d = rows->d, m = rows->m;
    fill(factor, 0.0, m);
    fill(key, 0.0, m);
    for (integer j = 0; j < d; j++)
        for (integer i = 0; i < m; i++) factor[i] = larger(fabs(rows->at[j * rows->stride + i]), factor[i]);
    for (integer i = 0; i < m; i++) {
        factor[i] = power_of_two(-exponent_of(factor[i]));
        rhs[i] = rows->b[i] * factor[i];
    }
    for (integer j = 0; j < d; j++) {
        const double weight = sqrt((double)(j + 2));
        for (integer i = 0; i < m; i++) {
            const double entry = rows->at[j * rows->stride + i] * factor[i];
            normals[i * d + j] = entry;
            key[i] += entry * weight;
        }
    }
}

static int same(const double *u, const double *v, integer d)
{
    for (integer j = 0; j < d; j++)
        if (u[j] != v[j]) return 0;
    return 1;
}

/* Of rows whose normals are the same up to a power of two, the tightest; how many there are. */
integer distinct(const Rows *rows, integer *chosen, Memory memory)
{
    const integer d = rows->d, m = rows->m, size = table_size(m);
    double *normals = doubles(&memory, m * d), *rhs = doubles(&memory, m), *key = doubles(&memory, m);
    double *factor = doubles(&memory, m);
    integer *next = integers(&memory, m), *keep = integers(&memory, m), *first = integers(&memory, size), count = 0;
    common_scale(rows, normals, rhs, key, factor);
    for (integer q = 0; q < size; q++) first[q] = -1;
    for (integer i = 0; i < m; i++) {
        const integer place = place_of(key[i], size);
        keep[i] = 1;
        for (integer other = first[place]; other >= 0; other = next[other]) {
            if (!keep[other] || key[other] != key[i] || !same(normals + i * d, normals + other * d, d)) continue;
            keep[rhs[i] < rhs[other] ? other : i] = 0; /* of equal ones the first stays */
            break;
        }
        next[i] = first[place], first[place] = i;
    }
    for (integer i = 0; i < m; i++)
        if (keep[i]) chosen[count++] = i;
    return count;
}

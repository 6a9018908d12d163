/* Vertices of rows and rows of points by the double description in integers, from floats to floats.
 *
 * The set {x : A x <= b} is the slice t = 1 of the cone a'y <= b t, t >= 0, and the rows that hold on all points are a
 * cone too. Only what is exact throughout is answered: rows of few bits, bounded full-dimensional sets, results that are
 * quotients of floats.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"
#include "powers.h"

enum { BITS_OF_FLOATS = 53, BITS_OF_ENTRIES = 32 };

static const double FLOATS = 9007199254740992.0; /* 2^53: integers up to here are floats */

/* Exponent of the last bit of a number that is not zero. */
static integer last_bit(double value)
{
    const integer top = exponent_of(value);
    const uint64_t whole = (uint64_t)times_power(fabs(value), BITS_OF_FLOATS - top);
    return top - BITS_OF_FLOATS + bits((whole & (~whole + 1)) - 1);
}

/* A row of floats [a, b] (d,), b apart, as primitive integers below 2^most; 0 if they are not. */
static int integer_row(const double *a, double b, integer d, integer most_bits, integer *to)
{
    integer low = 10000, high = -10000;
    for (integer j = 0; j < d; j++) {
        const double value = j < d - 1 ? a[j] : b;
        if (value == 0.0) continue;
        low = least(last_bit(value), low), high = most(exponent_of(value), high);
    }
    if (high - low > 62) return 0;
    for (integer j = 0; j < d; j++) {
        const double value = j < d - 1 ? a[j] : b;
        to[j] = value == 0.0 ? 0 : (integer)times_power(value, -low);
    }
    make_primitive(to, d);
    return magnitude(to, d) < times_power(1.0, most_bits);
}

/* Rows (m, d) of floats as primitive integers below 2^62; 0 if one is not. */
EXPORTED integer fdi_integer_rows(integer m, integer d, const double *table, integer *rows)
{
    for (integer i = 0; i < m; i++)
        if (!integer_row(table + i * d, table[i * d + d - 1], d, 62, rows + i * d)) return 0;
    return 1;
}

/* Whether row i follows from another with the same normal, or the same row comes earlier. */
static int is_implied(integer n, integer m, const double *A, const double *b, integer i)
{
    for (integer k = 0; k < m; k++) {
        if (k == i || b[k] > b[i] || (b[k] == b[i] && k > i)) continue;
        integer j = 0;
        while (j < n && A[k * n + j] == A[i * n + j]) j++;
        if (j == n) return 1;
    }
    return 0;
}

/* Whether rows A (m, n), b (m,) are short, of integers below 2^32, but for some that follow from others with the same
 * normals; for points, whose b is one, without it. (n + 1,) to work in. */
EXPORTED integer fdi_short(integer n, integer m, const double *A, const double *b, double *block)
{
    Memory memory = {block, 0};
    integer *row = integers(&memory, n + 1);
    for (integer i = 0; i < m; i++)
        if (!integer_row(A + i * n, b ? b[i] : 1.0, n + 1, BITS_OF_ENTRIES, row) && !(b && is_implied(n, m, A, b, i)))
            return 0;
    return 1;
}

/* The exponent of a power of two of which all of some numbers are multiples, up to 2^32 times; 0 where they are so far
 * apart that there is none, or about one. */
EXPORTED integer fdi_short_unit(integer count, const double *values)
{
    integer low = 10000, high = -10000;
    for (integer i = 0; i < count; i++) {
        if (values[i] == 0.0) continue;
        low = least(last_bit(values[i]), low), high = most(exponent_of(values[i]), high);
        if (high - low > BITS_OF_ENTRIES) return 0;
    }
    return low >= -BITS_OF_ENTRIES && high <= BITS_OF_ENTRIES ? 0 : high > low ? low : 0;
}

EXPORTED integer fdi_exact_set_room(integer n, integer m, integer room)
{
    return (n + 1) * (m + 1) + (n + 1) * room + fdi_pointed_cone_room(n + 1, m + 1, room);
}

EXPORTED integer fdi_exact_vertices_room(integer n, integer m, integer room)
{
    return fdi_exact_set_room(n, m, room) + volume_room(n, m + 1, room);
}

typedef struct {
    integer *rows, *rays; /* (m + 1, n + 1), (room, n + 1) */
    double *rest;
} Work;

static Work lay_out(double *block, integer n, integer m, integer room)
{
    Memory memory = {block, 0};
    Work work = {integers(&memory, (n + 1) * (m + 1)), integers(&memory, (n + 1) * room), NULL};
    work.rest = block + memory.used;
    return work;
}

/* Vertices (room, n) of a bounded set A x <= b, rows (m, n) and (m,), to the nearest floats, in lexicographic order: their
 * number, or why not.
 *
 * said (2,): whether they are floats, so that nothing was rounded; and, unless it is zero before, the volume of their
 * hull, -1 if it has too many simplices.
 */
EXPORTED integer fdi_exact_vertices(integer n, integer m, const double *A, const double *b, integer most_rays,
                                    integer room, double *points, double *said, double *block)
{
    const integer d = n + 1;
    const Work work = lay_out(block, n, m, room);
    integer k = 0;
    for (integer i = 0; i < m; i++) {
        integer *row = work.rows + k * d;
        if (!integer_row(A + i * n, b[i], d, BITS_OF_ENTRIES, row)) {
            if (!is_implied(n, m, A, b, i)) return OVERFLOWS;
            continue;
        }
        row[n] = -row[n], k++;
    }
    for (integer j = 0; j < d; j++) work.rows[k * d + j] = j == n ? -1 : 0;
    const integer count = fdi_pointed_cone(d, k + 1, work.rows, most_rays, room, work.rays, work.rest);
    said[0] = 1.0;
    for (integer r = 0; r < count; r++) {
        const integer *ray = work.rays + r * d;
        if (ray[n] & (ray[n] - 1)) said[0] = 0.0; /* primitive: quotients are floats if that is a power of two */
        if (ray[n] <= 0 || magnitude(ray, d) > FLOATS) return OVERFLOWS; /* empty or unbounded, or not this exact */
        for (integer j = 0; j < n; j++) points[r * n + j] = (double)ray[j] / (double)ray[n];
    }
    if (count > 0 && said[1] != 0.0) {
        const uint64_t *on = rows_of_rays(d, k + 1, room, work.rest);
        said[1] = volume_of(n, k + 1, count, points, on, (k + 64) / 64, block + fdi_exact_set_room(n, m, room));
    }
    if (count > 0) put_in_order(n, count, points, (double *)(void *)work.rays);
    return count == 0 ? OVERFLOWS : count;
}

/* Rows [A, b] (room, n + 1) of the hull of points (k, n) that span the space, exact: their number, or why not. */
EXPORTED integer fdi_exact_hull(integer n, integer k, const double *points, integer most_rays, integer room, double *rows,
                                double *block)
{
    const integer d = n + 1;
    const Work work = lay_out(block, n, k, room);
    for (integer i = 0; i < k; i++) {
        integer *row = work.rows + i * d; /* (-t, x) with x in reverse: rows that are alike but for b are so in order */
        if (!integer_row(points + i * n, 1.0, d, BITS_OF_ENTRIES, row)) return OVERFLOWS;
        for (integer p = 0, q = d - 1; p < q; p++, q--) {
            const integer kept = row[p];
            row[p] = row[q], row[q] = kept;
        }
        row[0] = -row[0];
    }
    const integer found = fdi_pointed_cone(d, k, work.rows, most_rays, room, work.rays, work.rest);
    integer count = 0;
    for (integer r = 0; r < found; r++) {
        const integer *ray = work.rays + r * d;
        const double largest = magnitude(ray + 1, n);
        if (largest == 0.0) continue; /* 0 <= 1 */
        if (magnitude(ray, d) > FLOATS) return OVERFLOWS;
        const integer size = exponent_of(largest), power = size > BITS_OF_ENTRIES ? -size : 0;
        for (integer j = 0; j < d; j++) rows[count * d + j] = times_power((double)ray[d - 1 - j], power);
        count++;
    }
    return found < 0 ? found : count;
}

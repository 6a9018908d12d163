/* Where the double description of {y : G y <= 0} begins: the order of its rows, independent ones, and their rays.
 *
 * Short rows come first, those of one length by their entries: facets of symmetric cones so make the fewest rays. All in
 * machine integers, rows divided by the common divisor of their entries after each step; before a product could leave 62
 * bits it stops.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"

static const double SUMMED = 7.2e16; /* entries below: 2^6 of them have a sum of 62 bits */

typedef struct {
    integer d, m;
    integer *rows;          /* (m, d) in order */
    integer *order, *other; /* (m,) */
    integer *length;        /* (m,) sums of magnitudes */
    integer *echelon;       /* (d, 2 d) */
    integer *start, *pivot; /* (d,) */
    integer *simplex;       /* (d, d) */
    double *rest;
} Start;

static integer lay_out(Start *cone, double *block, integer d, integer m, integer room)
{
    Memory memory = {block, 0};
    cone->d = d, cone->m = m;
    cone->rows = integers(&memory, m * d), cone->order = integers(&memory, m), cone->other = integers(&memory, m);
    cone->length = integers(&memory, m), cone->echelon = integers(&memory, 2 * d * d);
    cone->start = integers(&memory, d), cone->pivot = integers(&memory, d), cone->simplex = integers(&memory, d * d);
    cone->rest = doubles(&memory, fdi_double_description_room(d, m, room));
    return memory.used;
}

EXPORTED integer fdi_pointed_cone_room(integer d, integer m, integer room)
{
    Start cone;
    return lay_out(&cone, NULL, d, m, room);
}

static int comes_after(const Start *cone, const integer *rows, integer p, integer q)
{
    if (cone->length[p] != cone->length[q]) return cone->length[p] > cone->length[q];
    for (integer j = 0; j < cone->d; j++)
        if (rows[p * cone->d + j] != rows[q * cone->d + j]) return rows[p * cone->d + j] > rows[q * cone->d + j];
    return p > q;
}

/* Numbers of the rows in order, by merging. */
static void sort(Start *cone, const integer *rows)
{
    const integer m = cone->m;
    for (integer i = 0; i < m; i++) cone->order[i] = i;
    for (integer width = 1; width < m; width *= 2) {
        for (integer low = 0; low < m; low += 2 * width) {
            const integer middle = least(low + width, m), high = least(low + 2 * width, m);
            integer p = low, q = middle;
            for (integer to = low; to < high; to++) {
                const int second =
                    p == middle || (q < high && comes_after(cone, rows, cone->order[p], cone->order[q]));
                cone->other[to] = second ? cone->order[q++] : cone->order[p++];
            }
        }
        integer *sorted = cone->other;
        cone->other = cone->order, cone->order = sorted;
    }
}

/* row = row e[p] - e row[p], primitive; 0 if it could overflow. */
static int without(integer *row, const integer *e, integer p, integer width)
{
    if (row[p] == 0) return 1;
    const integer common = common_divisor(row[p], e[p]), up = e[p] / common, down = row[p] / common;
    if (magnitude(row, width) * fabs((double)up) + magnitude(e, width) * fabs((double)down) >= MACHINE) return 0;
    for (integer j = 0; j < width; j++) row[j] = row[j] * up - e[j] * down;
    make_primitive(row, width);
    return 1;
}

static integer first_entry(const integer *row, integer d)
{
    integer j = 0;
    while (j < d && row[j] == 0) j++;
    return j;
}

/* The first rows that form a basis, and in `echelon` their multiples of the unit vectors beside what combines them: row i
 * says echelon[i][p] y_p = sum over k of echelon[i][d + k] (G y)_k, p its pivot. 0: none, or it could overflow. */
static int find_basis(Start *cone)
{
    const integer d = cone->d, width = 2 * d;
    integer rank = 0;
    for (integer i = 0; i < cone->m && rank < d; i++) {
        integer *row = cone->echelon + rank * width;
        for (integer j = 0; j < d; j++) row[j] = cone->rows[i * d + j], row[d + j] = j == rank;
        for (integer q = 0; q < rank; q++)
            if (!without(row, cone->echelon + q * width, cone->pivot[q], width)) return 0;
        const integer p = first_entry(row, d);
        if (p == d) continue;
        for (integer q = 0; q < rank; q++)
            if (!without(cone->echelon + q * width, row, p, width)) return 0;
        cone->pivot[rank] = p, cone->start[rank++] = i;
    }
    return rank == d;
}

/* Ray k lies on all rows of the basis but row k: minus column k of the inverse, primitive. 0 if it could overflow. */
static int find_simplex(Start *cone)
{
    const integer d = cone->d, width = 2 * d;
    integer multiple = 1;
    for (integer q = 0; q < d; q++) {
        const integer pivot = cone->echelon[q * width + cone->pivot[q]];
        const integer factor = pivot / common_divisor(multiple, pivot);
        if (fabs((double)multiple) * fabs((double)factor) >= MACHINE) return 0;
        multiple *= factor < 0 ? -factor : factor;
    }
    for (integer q = 0; q < d; q++) {
        const integer factor = multiple / cone->echelon[q * width + cone->pivot[q]];
        if (magnitude(cone->echelon + q * width + d, d) * fabs((double)factor) >= MACHINE) return 0;
        for (integer k = 0; k < d; k++)
            cone->simplex[k * d + cone->pivot[q]] = -cone->echelon[q * width + d + k] * factor;
    }
    for (integer k = 0; k < d; k++) make_primitive(cone->simplex + k * d, d);
    return 1;
}

/* Rays (room, d) of the pointed cone of rows (m, d) in any order: their number, or why not; OVERFLOWS also where the rows
 * do not have full rank. */
EXPORTED integer fdi_pointed_cone(integer d, integer m, const integer *rows, integer most_rays, integer room,
                                  integer *rays, double *block)
{
    Start cone;
    lay_out(&cone, block, d, m, room);
    for (integer i = 0; i < m; i++) {
        if (magnitude(rows + i * d, d) >= SUMMED || d > 64) return OVERFLOWS;
        cone.length[i] = 0;
        for (integer j = 0; j < d; j++) cone.length[i] += rows[i * d + j] < 0 ? -rows[i * d + j] : rows[i * d + j];
    }
    sort(&cone, rows);
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < d; j++) cone.rows[i * d + j] = rows[cone.order[i] * d + j];
    if (!find_basis(&cone) || !find_simplex(&cone)) return OVERFLOWS;
    return fdi_double_description(d, m, cone.rows, cone.start, cone.simplex, most_rays, room, rays, cone.rest);
}

/* After that: the rows that each ray lies on, as bits (rays, words) in the order in which they were taken. */
const uint64_t *rows_of_rays(integer d, integer m, integer room, double *block)
{
    Start cone;
    lay_out(&cone, block, d, m, room);
    return (const uint64_t *)(const void *)cone.rest;
}

/* Vertices and volumes of bounded sets of rows, and rows of the hulls of points, in floats.
 *
 * In general position all are proven (cone.c); elsewhere every sign is told by a bound or there is no answer
 * (near_cone.c). Rows of a hull only take their normals from that: their sides hold on all points, whatever was rounded.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"
#include "polytopes/prepared.h"
#include "powers.h"
#include "vectors.h"

enum { UNKNOWN = -1, MOST_NEAR = 2000 }; /* rays of a cone that is not in general position */

static const double NARROW = 1e-10; /* of an axis: a width beside the size of the points below which it may be rounding */
static const double STEEP = 1e4;    /* how far a facet of a hull may move with its points: it is right to so many roundings */
static const integer UNEVEN = 300;  /* exponents of the widths of two axes differ by less */

typedef struct {
    integer d, m, words, room;
    double *at;      /* (d, m) */
    double *inner;   /* (d,) */
    double *rays;    /* (room, d) */
    integer *active; /* (room, d - 1) */
    uint64_t *on;    /* (room, words) */
    double *rest;
} Cone;

static integer lay_out(Cone *cone, double *block, integer d, integer m, integer room)
{
    Memory memory = {block, 0};
    cone->d = d, cone->m = m, cone->words = (m + 63) / 64, cone->room = room;
    cone->at = doubles(&memory, d * m), cone->inner = doubles(&memory, d), cone->rays = doubles(&memory, room * d);
    cone->active = integers(&memory, room * (d - 1));
    cone->on = (uint64_t *)(void *)integers(&memory, room * cone->words);
    cone->rest = doubles(&memory, 0);
    const integer near = room <= MOST_NEAR ? near_cone_room(d, m, room) : 0;
    return memory.used + most(fdi_cone_rays_room(d, m, room), near);
}

/* The rays of the cone, and on which rows they lie: their number, or why not. apart: the distance of a ray from a row
 * above which it is surely beside it. */
static integer solve(Cone *cone, int bounded, double apart)
{
    const integer d = cone->d, m = cone->m;
    double slack[2] = {0.0, 0.0};
    const integer count =
        fdi_cone_rays(d, m, cone->at, cone->inner, bounded, cone->room, cone->rays, cone->active, slack, cone->rest);
    if (count == TOO_MANY_RAYS) return NO_ROOM_FOR_RAYS;
    if (count >= 0 && slack[0] > apart && (bounded || slack[1] < STEEP)) {
        for (integer q = 0; q < count * cone->words; q++) cone->on[q] = 0;
        for (integer r = 0; r < count; r++)
            for (integer q = 0; q < d - 1; q++) {
                const integer row = cone->active[r * (d - 1) + q];
                cone->on[r * cone->words + row / 64] |= (uint64_t)1 << (row % 64);
            }
        return count;
    }
    if (cone->room > MOST_NEAR) return UNKNOWN;
    if (bounded) return near_points(d, m, cone->at, cone->inner, cone->room, cone->rays, cone->on, cone->rest);
    return near_cone(d, m, cone->at, cone->room, cone->rays, cone->on, cone->rest);
}

EXPORTED integer fdi_prepared_vertices_room(integer d, integer m, integer room)
{
    Cone cone;
    return lay_out(&cone, NULL, d + 1, m + 1, room) + volume_room(d, m, room);
}

/* The cone over a prepared set, {(x, t) : A x <= b t, t >= 0}. */
static void homogenise(Cone *cone, const Prepared *set)
{
    const integer d = cone->d - 1, m = cone->m - 1;
    for (integer j = 0; j < d; j++) {
        copy(cone->at + j * (m + 1), set->at + j * m, m);
        cone->at[j * (m + 1) + m] = 0.0;
    }
    for (integer i = 0; i < m; i++) cone->at[d * (m + 1) + i] = -set->b[i];
    cone->at[d * (m + 1) + m] = -1.0;
    copy(cone->inner, set->centre, d);
    cone->inner[d] = 1.0;
}

/* Vertices (room, d) of a prepared set that is bounded, in lexicographic order: their number, or why not. wide, apart:
 * as fractions of the size of b, the radius of a largest ball and the distance of a vertex from a row from which
 * rounding does not matter. volume: of the set, -1 if it has too many simplices; or NULL, if nobody asks.
 */
EXPORTED integer fdi_prepared_vertices(integer d, integer m, double *prepared, double wide, double apart, integer room,
                                       double *points, double *volume, double *block)
{
    Prepared set;
    Cone cone;
    lay_out_prepared(&set, prepared, d, m);
    double *rest = block + lay_out(&cone, block, d + 1, m + 1, room);
    if (!(*set.radius > wide * *set.size)) return UNKNOWN;
    homogenise(&cone, &set);
    const integer count = solve(&cone, 1, apart * *set.size);
    for (integer r = 0; r < count; r++) copy(points + r * d, cone.rays + r * (d + 1), d);
    if (volume && count > 0) {
        *volume = volume_of(d, m, count, points, cone.on, cone.words, rest);
        for (integer j = 0; j < d; j++) *volume = times_power(*volume, set.s[j]);
    }
    for (integer r = 0; r < count; r++)
        for (integer j = 0; j < d; j++) points[r * d + j] = times_power(points[r * d + j], set.s[j]);
    if (count > 0) put_in_order(d, count, points, cone.rays);
    return count;
}

EXPORTED integer fdi_point_hull_room(integer n, integer k, integer room)
{
    Cone cone;
    return 3 * n + lay_out(&cone, NULL, n + 1, k, room);
}

/* Where points (k, n) lie: their middle, their sizes (n,) and powers of two near their widths; 0 if one may be rounding. */
static int measure(integer n, integer k, const double *points, double *middle, double *size, integer *power)
{
    double largest = 0.0;
    for (integer j = 0; j < n; j++) {
        double low = points[j], high = points[j], sum = 0.0;
        for (integer i = 0; i < k; i++) {
            const double value = points[i * n + j];
            low = smaller(value, low), high = larger(value, high), sum += value / (double)k;
        }
        middle[j] = sum, size[j] = larger(fabs(low), fabs(high)), largest = larger(largest, size[j]);
        if (!(high - low > NARROW * size[j] && high - low < INFINITY)) return 0;
        power[j] = exponent_of(high - low);
        if (power[j] > UNEVEN || power[j] < -UNEVEN) return 0;
    }
    return 1;
}

/* The half-space of a ray in the user's units, its normal of length one and its side beyond all points. */
static void half_space(integer n, integer k, const double *points, const double *ray, const double *size,
                       const integer *power, double *row)
{
    integer top = -10000;
    for (integer j = 0; j < n; j++)
        if (ray[j] != 0.0) top = most(top, exponent_of(ray[j]) - power[j]);
    for (integer j = 0; j < n; j++) row[j] = times_power(ray[j], -power[j] - top);
    const double length = 1.0 / sqrt(sum_of_squares(row, n));
    double side = -INFINITY, terms = 0.0;
    for (integer j = 0; j < n; j++) row[j] *= length, terms += fabs(row[j]) * size[j];
    for (integer i = 0; i < k; i++) side = larger(dot(points + i * n, row, n), side);
    row[n] = side + (double)(n + 2) * EPS * terms;
}

/* Rows [A, b] (room, n + 1) of a set that contains points (k, n): one for each facet of their hull. Their number, or why
 * not. */
EXPORTED integer fdi_point_hull(integer n, integer k, const double *points, double apart, integer room, double *rows,
                                double *block)
{
    Memory memory = {block, 0};
    Cone cone;
    double *middle = doubles(&memory, n), *size = doubles(&memory, n);
    integer *power = integers(&memory, n);
    lay_out(&cone, block + memory.used, n + 1, k, room);
    if (!measure(n, k, points, middle, size, power)) return UNKNOWN;
    for (integer j = 0; j < n; j++)
        for (integer i = 0; i < k; i++)
            cone.at[j * k + i] = times_power(points[i * n + j] - middle[j], -power[j]);
    fill(cone.at + n * k, -1.0, k);
    fill(cone.inner, 0.0, n);
    cone.inner[n] = 1.0;
    const integer count = solve(&cone, 0, apart);
    for (integer r = 0; r < count; r++)
        half_space(n, k, points, cone.rays + r * (n + 1), size, power, rows + r * (n + 1));
    return count;
}

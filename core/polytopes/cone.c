/* Extreme rays of a pointed cone {y : G y <= 0} in general position, each with the d - 1 rows that it lies on.
 *
 * From one ray the others are found along the edges between them. Of what is found nothing is believed before it is
 * proven: the rows that a ray is to lie on are inverted, what the inverse leaves of the unit matrix bounds the distance
 * to the exact ray, and there every other row has to be negative by more than that and what is rounded. A ray so proven
 * has d - 1 neighbours, one for each row that it leaves, and all of them are in the list. Since the graph of the rays of a
 * pointed cone is connected (Balinski 1961), the list is then complete. Where a ray lies on more rows, or nearly so, the
 * proof fails, and nothing is said.
 */
#include "polytopes/polytopes.h"
#include "polytopes/sums.h"
#include "vectors.h"

enum { UNPROVEN = -1, TOO_MANY_RAYS = -2 };

enum { STEPS = 4 };
static const double DEPENDENT = 1e-13; /* pivot, of rows of length about one */

typedef struct {
    integer d, m;
    const double *at;   /* (d, m) rows, transposed */
    double *length;     /* (m,) Euclidean norms, rounded up */
    double *column;     /* (d, m) rows times the columns of the inverse */
    double *size;       /* (m,) sums of their magnitudes */
    double *factor;     /* (m,) 1 / G r, zero for the rows of the ray */
    double *shut;       /* (m,) zero, minus infinity for the rows of the ray */
    double *ratio;      /* (m,) */
    double *inverse;    /* (d, d) column k is what row k of the ray leaves by; the last is the ray */
    double *work;       /* (d, 2 d) */
    double *total;      /* (d,) */
    double steepest;    /* largest length of a column of an inverse: how much a ray moves with its rows */
    integer *fresh;     /* (d - 1,) rows of a neighbour */
    integer *place;     /* (size of the table,) number of a ray, or -1 */
    integer places;
} Cone;

static integer places_for(integer most_rays)
{
    integer places = 16;
    while (places < 2 * most_rays) places *= 2;
    return places;
}

static void lay_out(Cone *cone, Memory *memory, integer d, integer m, integer most_rays)
{
    cone->d = d, cone->m = m, cone->places = places_for(most_rays);
    cone->length = doubles(memory, m), cone->column = doubles(memory, d * m), cone->size = doubles(memory, m);
    cone->factor = doubles(memory, m), cone->shut = doubles(memory, m), cone->ratio = doubles(memory, m);
    cone->inverse = doubles(memory, d * d), cone->work = doubles(memory, 2 * d * d);
    cone->total = doubles(memory, d), cone->fresh = integers(memory, d);
    cone->place = integers(memory, cone->places);
}

EXPORTED integer fdi_cone_rays_room(integer d, integer m, integer most_rays)
{
    Memory memory = {NULL, 0};
    Cone cone;
    lay_out(&cone, &memory, d, m, most_rays);
    return memory.used;
}

/* target (m,) = G y. */
WIDE static void products(const Cone *cone, const double *restrict y, double *restrict target)
{
    const integer m = cone->m;
    fill(target, 0.0, m);
    for (integer j = 0; j < cone->d; j++)
        if (y[j] != 0.0) add_multiple(target, y[j], cone->at + j * m, m);
}

static void to_unit_length(double *y, integer d)
{
    const double inverse = 1.0 / sqrt(sum_of_squares(y, d));
    for (integer j = 0; j < d; j++) y[j] *= inverse;
}

/* The inverse of the rows of a ray and of the ray itself. 0 if there is none. */
static int invert_ray(const Cone *cone, const integer *rows, const double *ray)
{
    const integer d = cone->d;
    for (integer k = 0; k < d; k++)
        for (integer j = 0; j < d; j++)
            cone->work[k * 2 * d + j] = k < d - 1 ? cone->at[j * cone->m + rows[k]] : ray[j];
    return invert(cone->work, d, DEPENDENT, cone->inverse);
}

/* Whether the exact ray on d - 1 rows is negative on all others; leaves what the ratio test needs.
 *
 * With M the rows and the ray, R the inverse that was computed and F = M R - I, the exact ray is R (e + z), where e is
 * the last unit vector and |z| <= |F e| / (1 - |F|) in the largest norm. On row j it is (G R)_j e up to |z| times the sum
 * of |(G R)_j|. `rounded` bounds what an entry of G R loses.
 */
static int proven(Cone *cone, const integer *rows, const double *ray)
{
    const integer d = cone->d, m = cone->m;
    double *last = cone->column + (d - 1) * m, largest = 0.0, missed = 0.0, off = 0.0;
    fill(cone->size, 0.0, m);
    fill(cone->total, 0.0, d);
    for (integer k = 0; k < d; k++) {
        const double *edge = cone->inverse + k * d;
        double *column = cone->column + k * m;
        products(cone, edge, column);
        for (integer i = 0; i < m; i++) cone->size[i] += fabs(column[i]);
        const double rounded = (double)(d + 4) * EPS * sqrt(sum_of_squares(edge, d));
        for (integer l = 0; l < d; l++) {
            const double value = l < d - 1 ? column[rows[l]] : dot(ray, edge, d);
            const double length = l < d - 1 ? cone->length[rows[l]] : 1.0 + 1e-9;
            const double part = fabs(value - (k == l ? 1.0 : 0.0)) + rounded * length;
            cone->total[l] += part;
            if (k == d - 1) missed = larger(missed, part);
        }
        largest = larger(largest, rounded);
    }
    cone->steepest = larger(cone->steepest, largest / ((double)(d + 4) * EPS));
    for (integer l = 0; l < d; l++) off = larger(off, cone->total[l]);
    if (!(off < 0.5)) return 0;
    const double z = 2.5 * missed; /* 1 / (1 - |F|) is at most 2, up to what is rounded in it */
    for (integer i = 0; i < m; i++) cone->factor[i] = 1.0 / last[i], cone->shut[i] = 0.0;
    for (integer l = 0; l < d - 1; l++) {
        cone->factor[rows[l]] = 0.0, cone->shut[rows[l]] = -HUGE_VAL;
        last[rows[l]] = -HUGE_VAL;
    }
    int all = 1;
    for (integer i = 0; i < m; i++) {
        const double lost = largest * cone->length[i];
        all &= last[i] + 2.0 * (lost + z * (cone->size[i] + (double)d * lost)) + TINY < 0.0;
    }
    return all;
}

/* The number of the row on which the edge from a ray that leaves row k ends; its place is where y = ratio r - edge. */
WIDE static integer end_of_edge(const Cone *cone, const double *restrict column, double *ratio)
{
    const double *restrict factor = cone->factor, *restrict shut = cone->shut;
    double *restrict at = cone->ratio;
    for (integer i = 0; i < cone->m; i++) at[i] = column[i] * factor[i] + shut[i];
    integer best = 0;
    for (integer i = 1; i < cone->m; i++)
        if (at[i] > at[best]) best = i;
    *ratio = at[best];
    return best;
}

/* The rows of a neighbour, in order: row k goes, another comes. */
static void exchanged(const integer *rows, integer count, integer k, integer added, integer *fresh)
{
    integer put = 0;
    int placed = 0;
    for (integer q = 0; q < count; q++) {
        if (q == k) continue;
        if (!placed && rows[q] > added) fresh[put++] = added, placed = 1;
        fresh[put++] = rows[q];
    }
    if (!placed) fresh[put] = added;
}

/* Where a ray with these rows stands in the table, or should. */
static integer *found(const Cone *cone, const integer *active, const integer *rows)
{
    const integer count = cone->d - 1;
    uint64_t hash = 1469598103934665603u;
    for (integer q = 0; q < count; q++) hash = (hash ^ (uint64_t)rows[q]) * 1099511628211u;
    integer place = (integer)((hash ^ (hash >> 29)) & (uint64_t)(cone->places - 1));
    for (; cone->place[place] >= 0; place = (place + 1) & (cone->places - 1)) {
        const integer *other = active + cone->place[place] * count;
        integer q = 0;
        while (q < count && other[q] == rows[q]) q++;
        if (q == count) break;
    }
    return cone->place + place;
}

/* From a point inside down to a ray, one row at a time: rows in order, and the ray. 0 if no row is met. */
static int first_ray(Cone *cone, const double *inner, integer *rows, double *ray)
{
    const integer d = cone->d, m = cone->m;
    double *normal = cone->work, *direction = cone->total, *value = cone->size, *rate = cone->ratio, draw = 0.5;
    copy(ray, inner, d);
    for (integer count = 0; count < d - 1; count++) {
        for (integer j = 0; j < d; j++) {
            draw += 0.6180339887498949;
            draw -= floor(draw);
            direction[j] = draw - 0.5;
        }
        for (int twice = 0; twice < 2; twice++)
            for (integer q = 0; q < count; q++)
                add_multiple(direction, -dot(normal + q * d, direction, d), normal + q * d, d);
        products(cone, ray, value);
        products(cone, direction, rate);
        integer best = -1;
        double steepest = -HUGE_VAL;
        for (integer i = 0; i < m; i++) {
            int taken = 0;
            for (integer q = 0; q < count; q++) taken |= rows[q] == i;
            if (taken || !(value[i] < 0.0)) continue;
            if (rate[i] / -value[i] > steepest) best = i, steepest = rate[i] / -value[i];
        }
        if (best < 0) return 0;
        for (integer j = 0; j < d; j++) ray[j] = steepest * ray[j] + direction[j];
        double *fresh = normal + count * d;
        for (integer j = 0; j < d; j++) fresh[j] = cone->at[j * m + best];
        for (int twice = 0; twice < 2; twice++)
            for (integer q = 0; q < count; q++) add_multiple(fresh, -dot(normal + q * d, fresh, d), normal + q * d, d);
        to_unit_length(fresh, d);
        for (integer q = 0; q <= count; q++) add_multiple(ray, -dot(normal + q * d, ray, d), normal + q * d, d);
        to_unit_length(ray, d);
        integer q = count;
        for (; q > 0 && rows[q - 1] > best; q--) rows[q] = rows[q - 1];
        rows[q] = best;
    }
    return 1;
}

/* A point x (d - 1,) that rows a'x <= b, given as (a, -b), meet in: Newton steps with residuals in twice the precision.
 * at (d, m) rows, inverse (d, d) of those (d - 1,) and the ray, step (d,). */
void to_point(integer d, integer m, const double *at, const integer *rows, const double *inverse, double *step,
              double *ray)
{
    for (integer j = 0; j < d - 1; j++) ray[j] /= ray[d - 1];
    ray[d - 1] = 1.0;
    for (int turn = 0; turn < STEPS; turn++) {
        fill(step, 0.0, d);
        for (integer k = 0; k < d - 1; k++) {
            Sum value = {0.0, 0.0, 0.0};
            for (integer j = 0; j < d; j++) add_product(&value, at[j * m + rows[k]], ray[j]);
            add_multiple(step, value.total + value.lost, inverse + k * d, d);
        }
        double moved = 0.0, size = 0.0;
        for (integer j = 0; j < d - 1; j++) {
            const double part = step[j] - step[d - 1] * ray[j];
            ray[j] -= part;
            moved = larger(moved, fabs(part)), size = larger(size, fabs(ray[j]));
        }
        if (moved <= 1e3 * EPS * size) return; /* what is left of it is rounding */
    }
}

/* A ray of length one on rows (d - 1,): a Newton step with residuals in twice the precision. */
static void to_ray(const Cone *cone, const integer *rows, double *ray)
{
    const integer d = cone->d;
    fill(cone->total, 0.0, d);
    for (integer k = 0; k < d - 1; k++) {
        Sum value = {0.0, 0.0, 0.0};
        for (integer j = 0; j < d; j++) add_product(&value, cone->at[j * cone->m + rows[k]], ray[j]);
        add_multiple(cone->total, value.total + value.lost, cone->inverse + k * d, d);
    }
    for (integer j = 0; j < d; j++) ray[j] -= cone->total[j];
    to_unit_length(ray, d);
}

/* Rays of a cone: their number, or why there is no answer.
 *
 * at (d, m): rows of length about one, transposed; inner (d,): a point where all of them are negative; bounded: the last
 * row is -y_(d-1) <= 0, no ray may lie on it, and rays come as points with y_(d-1) = 1. rays (most_rays, d), active
 * (most_rays, d - 1): numbers of rows in order; slack (2,): the least distance, in rows, of a ray from a row that it is not on, and
 * how far a ray moves at most with its rows.
 */
EXPORTED integer fdi_cone_rays(integer d, integer m, const double *at, const double *inner, integer bounded,
                               integer most_rays, double *rays, integer *active, double *slack, double *block)
{
    Memory memory = {block, 0};
    Cone cone;
    const integer n = d - 1;
    lay_out(&cone, &memory, d, m, most_rays);
    cone.at = at;
    for (integer i = 0; i < cone.places; i++) cone.place[i] = -1;
    fill(cone.length, 0.0, m);
    for (integer j = 0; j < d; j++)
        for (integer i = 0; i < m; i++) cone.length[i] += at[j * m + i] * at[j * m + i];
    for (integer i = 0; i < m; i++) cone.length[i] = sqrt(cone.length[i]) * (1.0 + (double)(d + 4) * EPS);
    if (most_rays < 1 || m < d || !first_ray(&cone, inner, active, rays)) return UNPROVEN;
    *found(&cone, active, active) = 0;
    slack[0] = HUGE_VAL, cone.steepest = 0.0;
    integer count = 1;
    for (integer r = 0; r < count; r++) {
        const integer *rows = active + r * n;
        double *ray = rays + r * d;
        if (bounded && rows[n - 1] == m - 1) return UNPROVEN;
        if (!invert_ray(&cone, rows, ray) || !proven(&cone, rows, ray)) return UNPROVEN;
        for (integer k = 0; k < n; k++) {
            double ratio;
            const integer added = end_of_edge(&cone, cone.column + k * m, &ratio);
            exchanged(rows, n, k, added, cone.fresh);
            integer *place = found(&cone, active, cone.fresh);
            if (*place >= 0) continue;
            if (count == most_rays) return TOO_MANY_RAYS;
            double *other = rays + count * d;
            for (integer j = 0; j < d; j++) other[j] = ratio * ray[j] - cone.inverse[k * d + j];
            to_unit_length(other, d);
            for (integer q = 0; q < n; q++) active[count * n + q] = cone.fresh[q];
            *place = count++;
        }
        const double scale = bounded ? 1.0 / ray[n] : 1.0, *last = cone.column + n * m;
        for (integer i = 0; i < m - (bounded ? 1 : 0); i++) slack[0] = smaller(slack[0], -last[i] * scale);
        slack[1] = cone.steepest;
        if (bounded) to_point(d, m, at, rows, cone.inverse, cone.total, ray);
        else to_ray(&cone, rows, ray);
    }
    return count;
}

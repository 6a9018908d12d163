/* Extreme rays of a pointed cone {y : G y <= 0} in floats: the double description with every sign told by a bound.
 *
 * As in double_description.c, but each ray is solved for afresh from rows that it lies on, so that no error is passed on:
 * with M the rows of a basis and the ray, R their inverse, what M R leaves of the unit matrix bounds how far the ray is
 * from the exact one. A ray lies on a row if it misses it by less than `ON`, and is beside it by `BESIDE` or more; what
 * is between, or a bound that is not well below `ON`, ends it without an answer. So rows that rounding has moved off a
 * common ray are taken to lie on it, and no other is.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"
#include "vectors.h"

enum { UNCERTAIN = -1 };

static const double ON = 1e-11;         /* a ray's value on a row that it lies on, both of length about one */
static const double BESIDE = 1e-9;      /* and on one that it does not lie on */
static const double SURE = 0.25;        /* of ON: the bound of a ray that is known well enough */
static const double INDEPENDENT = 1e-7; /* a row beside others: what is left of it across them */
static const double SINGULAR = 1e-13;   /* pivot of rows that are dependent */
static const double MOVED = 1e-10;      /* of a point: how far it may be from where rows that it lies on meet */

typedef struct {
    integer d, m, words, room, count;
    double *rows;             /* (m, d) of length about one */
    double *rays;             /* (room, d) of length one */
    double *value;            /* (room,) of each ray on the row that is taken */
    uint64_t *on, *common;    /* (room, words) a bit for each row taken that the ray lies on; (words,) */
    integer *beyond, *inside; /* (room,) */
    integer *order, *taken, *basis; /* (m,), (m,), (d,) */
    double *left;             /* (m, d) rows across those of the basis */
    double *work, *inverse;   /* (d, 2 d), (d, d) */
} Cone;

static integer lay_out(Cone *cone, double *block, integer d, integer m, integer room)
{
    Memory memory = {block, 0};
    cone->d = d, cone->m = m, cone->words = (m + 63) / 64, cone->room = room;
    cone->common = (uint64_t *)(void *)integers(&memory, cone->words);
    cone->rows = doubles(&memory, m * d), cone->left = doubles(&memory, m * d), cone->value = doubles(&memory, room);
    cone->beyond = integers(&memory, room), cone->inside = integers(&memory, room);
    cone->order = integers(&memory, m), cone->taken = integers(&memory, m), cone->basis = integers(&memory, d);
    cone->work = doubles(&memory, 2 * d * d), cone->inverse = doubles(&memory, d * d);
    return memory.used;
}

integer near_cone_room(integer d, integer m, integer room)
{
    Cone cone;
    return lay_out(&cone, NULL, d, m, room) + d;
}

static int lies_on(const uint64_t *on, integer row) { return on[row / 64] >> (row % 64) & 1; }

static void mark(uint64_t *on, integer row) { on[row / 64] |= (uint64_t)1 << (row % 64); }

/* Numbers of `many` independent rows out of some (all, if NULL): one after the other the one that is farthest from the
 * span of those before. 0 if there are not as many. */
static int choose(Cone *cone, const uint64_t *among, integer many)
{
    const integer d = cone->d;
    integer some = 0;
    for (integer i = 0; i < cone->m; i++) {
        if (among && !lies_on(among, i)) continue;
        copy(cone->left + some * d, cone->rows + i * d, d);
        cone->order[some++] = i;
    }
    for (integer k = 0; k < many; k++) {
        integer best = -1;
        double farthest = INDEPENDENT * INDEPENDENT;
        for (integer i = k; i < some; i++) {
            const double square = sum_of_squares(cone->left + i * d, d);
            if (square > farthest) best = i, farthest = square;
        }
        if (best < 0) return 0;
        double *axis = cone->left + k * d, *other = cone->left + best * d;
        const integer number = cone->order[best];
        cone->order[best] = cone->order[k], cone->order[k] = number, cone->basis[k] = number;
        const double inverse = 1.0 / sqrt(farthest);
        for (integer j = 0; j < d; j++) {
            const double chosen = other[j] * inverse;
            other[j] = axis[j], axis[j] = chosen; /* in this order: they may be one */
        }
        for (integer i = k + 1; i < some; i++) {
            add_multiple(cone->left + i * d, -dot(axis, cone->left + i * d, d), axis, d);
        }
    }
    return 1;
}

/* The ray on d - 1 rows of the basis, near a guess: corrected, of length one. 0 if its bound is not well below ON. */
static int solved(Cone *cone, double *ray)
{
    const integer d = cone->d;
    for (int turn = 0; turn < 2; turn++) {
        for (integer k = 0; k < d; k++) {
            const double *row = k < d - 1 ? cone->rows + cone->basis[k] * d : ray;
            copy(cone->work + k * 2 * d, row, d);
        }
        if (!turn && !invert(cone->work, d, SINGULAR, cone->inverse)) return 0;
        for (integer k = 0; k < d - 1 && !turn; k++) {
            const double missed = dot(cone->rows + cone->basis[k] * d, ray, d);
            add_multiple(ray, -missed, cone->inverse + k * d, d);
        }
        const double length = 1.0 / sqrt(sum_of_squares(ray, d));
        for (integer j = 0; j < d; j++) ray[j] *= length;
    }
    double moved = 0.0, off = 0.0;
    for (integer l = 0; l < d; l++) {
        const double *row = l < d - 1 ? cone->rows + cone->basis[l] * d : ray;
        const double length = sqrt(sum_of_squares(row, d));
        double total = 0.0;
        for (integer k = 0; k < d; k++) {
            const double *edge = cone->inverse + k * d, size = sqrt(sum_of_squares(edge, d));
            total += fabs(dot(row, edge, d) - (k == l ? 1.0 : 0.0)) + (double)(d + 2) * UNIT * length * size;
            if (k == l && l < d - 1) moved += size * (fabs(dot(row, ray, d)) + (double)(d + 2) * UNIT * length);
        }
        off = larger(off, total);
    }
    return off < 0.5 && 2.0 * moved < SURE * ON;
}

/* The rays of the basis; ray k lies on all its rows but row k. */
static int begin_cone(Cone *cone)
{
    const integer d = cone->d;
    if (!choose(cone, NULL, d)) return 0;
    for (integer k = 0; k < d; k++)
        for (integer j = 0; j < d; j++) cone->work[k * 2 * d + j] = cone->rows[cone->basis[k] * d + j];
    if (!invert(cone->work, d, SINGULAR, cone->inverse)) return 0;
    integer *all = cone->beyond; /* the basis: `solved` takes it without one row */
    for (integer k = 0; k < d; k++) all[k] = cone->basis[k];
    for (integer k = 0; k < d; k++)
        for (integer j = 0; j < d; j++) cone->rays[k * d + j] = -cone->inverse[k * d + j];
    for (integer q = 0; q < d * cone->words; q++) cone->on[q] = 0;
    for (integer k = 0; k < d; k++) {
        integer put = 0;
        for (integer q = 0; q < d; q++)
            if (q != k) cone->basis[put++] = all[q], mark(cone->on + k * cone->words, all[q]);
        const double length = 1.0 / sqrt(sum_of_squares(cone->rays + k * d, d));
        for (integer j = 0; j < d; j++) cone->rays[k * d + j] *= length;
        if (!solved(cone, cone->rays + k * d)) return 0;
    }
    for (integer k = 0; k < d; k++) cone->basis[k] = all[k];
    cone->count = d;
    return 1;
}

static int holds(const uint64_t *on, const uint64_t *common, integer words)
{
    for (integer w = 0; w < words; w++)
        if ((on[w] & common[w]) != common[w]) return 0;
    return 1;
}

/* Whether only two rays lie on all rows that both lie on; `blocker` is a third one, if it was met before. */
static int adjacent(const Cone *cone, integer p, integer q, integer *blocker)
{
    const integer words = cone->words;
    const uint64_t *first = cone->on + p * words, *second = cone->on + q * words;
    uint64_t *common = cone->common;
    integer many = 0;
    for (integer w = 0; w < words; w++) common[w] = first[w] & second[w], many += bits(common[w]);
    if (many < cone->d - 2) return 0;
    if (*blocker >= 0 && *blocker != p && *blocker != q && holds(cone->on + *blocker * words, common, words)) return 0;
    for (integer r = 0; r < cone->count; r++) {
        if (r == p || r == q || !holds(cone->on + r * words, common, words)) continue;
        *blocker = r;
        return 0;
    }
    return 1;
}

/* Whether a ray is surely inside all rows that were taken but those that it lies on. */
static int beside_others(const Cone *cone, const double *ray, const uint64_t *on)
{
    for (integer i = 0; i < cone->m; i++)
        if (cone->taken[i] && !lies_on(on, i) && !(dot(cone->rows + i * cone->d, ray, cone->d) <= -BESIDE)) return 0;
    return 1;
}

/* Where the edge between two rays meets a row: a ray of its own. 0 if it is not certain. */
static int joined(Cone *cone, integer p, integer q, integer row, integer to)
{
    const integer d = cone->d, words = cone->words;
    const double *first = cone->rays + p * d, *second = cone->rays + q * d;
    const double above = cone->value[p], below = -cone->value[q];
    double *fresh = cone->rays + to * d;
    uint64_t *on = cone->on + to * words;
    for (integer j = 0; j < d; j++) fresh[j] = above * second[j] + below * first[j];
    const double square = sum_of_squares(fresh, d);
    if (!(square > 1e-24)) return 0;
    const double length = 1.0 / sqrt(square);
    for (integer j = 0; j < d; j++) fresh[j] *= length;
    for (integer w = 0; w < words; w++) on[w] = cone->common[w];
    mark(on, row);
    return choose(cone, on, d - 1) && solved(cone, fresh) && beside_others(cone, fresh, on);
}

static void move(Cone *cone, integer from, integer to)
{
    if (from == to) return;
    copy(cone->rays + to * cone->d, cone->rays + from * cone->d, cone->d);
    for (integer w = 0; w < cone->words; w++) cone->on[to * cone->words + w] = cone->on[from * cone->words + w];
}

/* The cone after a row is taken: its rays, or why not. */
static integer cut(Cone *cone, integer row)
{
    const integer count = cone->count, d = cone->d;
    integer beyond = 0, inside = 0, total = count, blocker = -1, put = 0;
    for (integer r = 0; r < count; r++) {
        const double value = cone->value[r] = dot(cone->rows + row * d, cone->rays + r * d, d);
        if (fabs(value) < ON) mark(cone->on + r * cone->words, row);
        else if (!(fabs(value) >= BESIDE)) return UNCERTAIN;
        else if (value > 0.0) cone->beyond[beyond++] = r;
        else cone->inside[inside++] = r;
    }
    if (!beyond) return count;
    for (integer b = 0; b < beyond; b++)
        for (integer i = 0; i < inside; i++) {
            if (!adjacent(cone, cone->beyond[b], cone->inside[i], &blocker)) continue;
            if (total == cone->room) return NO_ROOM_FOR_RAYS;
            if (!joined(cone, cone->beyond[b], cone->inside[i], row, total)) return UNCERTAIN;
            total++;
        }
    for (integer r = 0; r < total; r++) {
        const int fresh = r >= count, stays = fresh || fabs(cone->value[r]) < ON || cone->value[r] < 0.0;
        if (stays) move(cone, r, put++);
    }
    return cone->count = put;
}

/* Rays (room, d) of length one of the cone of rows (m, d) of length about one; and the rows that each lies on, as bits
 * (room, words). Their number, or why not. */
static integer describe(Cone *cone)
{
    if (cone->room < cone->d) return NO_ROOM_FOR_RAYS;
    if (!begin_cone(cone)) return UNCERTAIN;
    for (integer i = 0; i < cone->m; i++) cone->taken[i] = 0;
    for (integer k = 0; k < cone->d; k++) cone->taken[cone->basis[k]] = 1;
    for (integer i = 0; i < cone->m; i++) {
        if (cone->taken[i]) continue;
        const integer found = cut(cone, i);
        if (found < 0) return found;
        cone->taken[i] = 1;
    }
    return cone->count;
}

/* Rays (room, d) of the cone of rows at (d, m), transposed, of length about one. */
integer near_cone(integer d, integer m, const double *at, integer room, double *rays, uint64_t *on, double *block)
{
    Cone cone;
    lay_out(&cone, block, d, m, room);
    cone.rays = rays, cone.on = on;
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < d; j++) cone.rows[i * d + j] = at[j * m + i];
    return describe(&cone);
}

/* The rows a'x <= b t, given as (a, -b), seen from a point inside, each over its slack there, along axes whose units
 * make the steepest entries about one; the last row is t >= 0. 0 if the point is not inside. */
static int centred_rows(const Cone *cone, const double *at, const double *centre, double *unit)
{
    const integer d = cone->d, m = cone->m;
    fill(unit, 0.0, d);
    for (integer i = 0; i < m; i++) {
        double *row = cone->rows + i * d, slack = i < m - 1 ? -at[(d - 1) * m + i] : 1.0;
        for (integer j = 0; j < d - 1; j++) slack -= at[j * m + i] * centre[j];
        if (!(slack > 0.0)) return 0;
        for (integer j = 0; j < d - 1; j++) row[j] = at[j * m + i] / slack, unit[j] = larger(fabs(row[j]), unit[j]);
        row[d - 1] = -1.0;
    }
    for (integer j = 0; j < d - 1; j++) unit[j] = 1.0 / unit[j];
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < d - 1; j++) cone->rows[i * d + j] *= unit[j];
    return 1;
}

/* Points (room, d) of a bounded set, their last entry one, as rays of its cone; at as above, centre (d,) inside. */
integer near_points(integer d, integer m, const double *at, const double *centre, integer room, double *rays,
                    uint64_t *on, double *block)
{
    Cone cone;
    double *unit = block + lay_out(&cone, block, d, m, room), *before = cone.left; /* whose rows are chosen by then */
    cone.rays = rays, cone.on = on;
    if (!centred_rows(&cone, at, centre, unit)) return UNCERTAIN;
    const integer count = describe(&cone);
    for (integer r = 0; r < count; r++) {
        double *ray = rays + r * d;
        if (lies_on(on + r * cone.words, m - 1) || !choose(&cone, on + r * cone.words, d - 1)) return UNCERTAIN;
        const double t = ray[d - 1];
        for (integer j = 0; j < d - 1; j++) before[j] = ray[j] = centre[j] + unit[j] * ray[j] / t;
        ray[d - 1] = 1.0;
        for (integer k = 0; k < d; k++)
            for (integer j = 0; j < d; j++)
                cone.work[k * 2 * d + j] = k < d - 1 ? at[j * m + cone.basis[k]] : ray[j];
        if (!invert(cone.work, d, SINGULAR, cone.inverse)) return UNCERTAIN;
        to_point(d, m, at, cone.basis, cone.inverse, cone.work, ray);
        for (integer j = 0; j < d - 1; j++)
            if (!(fabs(ray[j] - before[j]) <= MOVED * unit[j] / t)) return UNCERTAIN;
    }
    return count;
}

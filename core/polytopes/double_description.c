/* Extreme rays of a pointed cone {y : G y <= 0} in machine integers: the double description method (Motzkin et al. 1953).
 *
 * The cone begins with a simplex, as many independent rows as it has dimensions, and takes the other rows one by one: the
 * rays beyond a row go, and each ray inside is joined with each adjacent ray beyond where the edge between them meets the
 * row. Two rays are adjacent if no third one lies on all rows that both lie on (Fukuda and Prodon 1996). Nothing is
 * rounded: before a product could leave 63 bits the method stops, and larger integers have to go on.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"

typedef struct {
    integer d, m, words, room, count;
    const integer *rows; /* (m, d) */
    integer *rays;       /* (room, d) */
    uint64_t *on;        /* (room, words) a bit for each row taken that the ray lies on */
    double *size;        /* (room,) largest magnitude of each ray */
    integer *value;      /* (room,) of each ray on the row that is taken */
    integer *beyond, *inside; /* numbers of rays */
} Description;

static void mark(Description *cone, integer ray, integer row)
{
    cone->on[ray * cone->words + row / 64] |= (uint64_t)1 << (row % 64);
}

/* Values of all rays on a row; 0 if they could overflow. */
static int evaluate(Description *cone, integer row)
{
    const integer d = cone->d, *a = cone->rows + row * d;
    const double largest = magnitude(a, d) * (double)d;
    for (integer r = 0; r < cone->count; r++) {
        if (largest * cone->size[r] >= MACHINE) return 0;
        const integer *ray = cone->rays + r * d;
        integer total = 0;
        for (integer j = 0; j < d; j++) total += a[j] * ray[j];
        cone->value[r] = total;
    }
    return 1;
}

static int holds(const uint64_t *on, const uint64_t *common, integer words)
{
    for (integer w = 0; w < words; w++)
        if ((on[w] & common[w]) != common[w]) return 0;
    return 1;
}

/* Whether only two rays lie on all rows that both lie on; `blocker` is a third one, if it was met before. */
static int adjacent(const Description *cone, integer p, integer q, uint64_t *common, integer *blocker)
{
    const integer words = cone->words;
    const uint64_t *first = cone->on + p * words, *second = cone->on + q * words;
    integer many = 0;
    for (integer w = 0; w < words; w++) common[w] = first[w] & second[w], many += bits(common[w]);
    if (many < cone->d - 2) return 0; /* rows on a common edge have at least this rank */
    if (*blocker >= 0 && *blocker != p && *blocker != q && holds(cone->on + *blocker * words, common, words)) return 0;
    for (integer r = 0; r < cone->count; r++) {
        if (r == p || r == q || !holds(cone->on + r * words, common, words)) continue;
        *blocker = r;
        return 0;
    }
    return 1;
}

/* The ray where the edge between two meets the row: primitive; 0 if it could overflow. */
static int joined(Description *cone, integer p, integer q, integer *fresh)
{
    const integer d = cone->d, divisor = common_divisor(cone->value[p], cone->value[q]);
    const integer above = cone->value[p] / divisor, below = -cone->value[q] / divisor;
    const integer *first = cone->rays + p * d, *second = cone->rays + q * d;
    if ((double)below * cone->size[p] + (double)above * cone->size[q] >= MACHINE) return 0;
    integer common = 0;
    for (integer j = 0; j < d; j++) {
        fresh[j] = first[j] * below + second[j] * above;
        if (common != 1) common = common_divisor(common, fresh[j]);
    }
    for (integer j = 0; common > 1 && j < d; j++) fresh[j] /= common;
    return 1;
}

static void move(Description *cone, integer from, integer to)
{
    if (from == to) return;
    for (integer j = 0; j < cone->d; j++) cone->rays[to * cone->d + j] = cone->rays[from * cone->d + j];
    for (integer w = 0; w < cone->words; w++) cone->on[to * cone->words + w] = cone->on[from * cone->words + w];
    cone->size[to] = cone->size[from];
}

/* The cone after a row is taken: its rays, or why not. */
static integer cut(Description *cone, integer row, uint64_t *common)
{
    if (!evaluate(cone, row)) return OVERFLOWS;
    const integer count = cone->count, d = cone->d;
    integer beyond = 0, inside = 0, total = count, blocker = -1, put = 0;
    for (integer r = 0; r < count; r++) {
        if (cone->value[r] > 0) cone->beyond[beyond++] = r;
        else if (cone->value[r] < 0) cone->inside[inside++] = r;
        else mark(cone, r, row);
    }
    if (!beyond) return count;
    for (integer b = 0; b < beyond; b++)
        for (integer i = 0; i < inside; i++) {
            const integer p = cone->beyond[b], q = cone->inside[i];
            if (!adjacent(cone, p, q, common, &blocker)) continue;
            if (total == cone->room) return NO_ROOM_FOR_RAYS;
            if (!joined(cone, p, q, cone->rays + total * d)) return OVERFLOWS;
            for (integer w = 0; w < cone->words; w++) cone->on[total * cone->words + w] = common[w];
            cone->size[total] = magnitude(cone->rays + total * d, d);
            mark(cone, total++, row);
        }
    for (integer r = 0; r < total; r++)
        if (r >= count || cone->value[r] <= 0) move(cone, r, put++);
    return cone->count = put;
}

static void lay_out(Description *cone, Memory *memory, integer d, integer m, integer room)
{
    cone->d = d, cone->m = m, cone->words = (m + 63) / 64, cone->room = room;
    cone->on = (uint64_t *)(void *)integers(memory, room * cone->words);
    cone->size = doubles(memory, room), cone->value = integers(memory, room);
    cone->beyond = integers(memory, room), cone->inside = integers(memory, room);
}

EXPORTED integer fdi_double_description_room(integer d, integer m, integer room)
{
    Memory memory = {NULL, 0};
    Description cone;
    lay_out(&cone, &memory, d, m, room);
    return memory.used + cone.words;
}

/* Rays (room, d) of the cone of rows (m, d), from those (d, d) of the rows `start` (d,): their number, or why not. */
EXPORTED integer fdi_double_description(integer d, integer m, const integer *rows, const integer *start,
                                        const integer *simplex, integer most_rays, integer room, integer *rays,
                                        double *block)
{
    Memory memory = {block, 0};
    Description cone;
    lay_out(&cone, &memory, d, m, room);
    uint64_t *common = (uint64_t *)(void *)integers(&memory, cone.words);
    if (room < d) return NO_ROOM_FOR_RAYS;
    cone.rows = rows, cone.rays = rays, cone.count = d;
    for (integer q = 0; q < d * cone.words; q++) cone.on[q] = 0;
    for (integer r = 0; r < d; r++) {
        for (integer j = 0; j < d; j++) rays[r * d + j] = simplex[r * d + j];
        cone.size[r] = magnitude(rays + r * d, d);
        for (integer k = 0; k < d; k++)
            if (k != r) mark(&cone, r, start[k]);
    }
    for (integer row = 0; row < m; row++) {
        int taken = 0;
        for (integer k = 0; k < d; k++) taken |= start[k] == row;
        if (taken) continue;
        const integer found = cut(&cone, row, common);
        if (found < 0) return found;
        if (found > most_rays) return TOO_MANY_RAYS;
    }
    return cone.count;
}

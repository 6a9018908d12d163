/* Redundancy by programs over known facets alone: a violation finds a new facet by a ray (Clarkson 1994).
 *
 * Each program begins at the vertex, of those where earlier ones ended, that is farthest along its row.
 */
#include "polytopes/polytopes.h"
#include "vectors.h"

static const double TOGETHER = 1e-9; /* of the distance along a ray: two rows met this near each other */
static const integer CORNERS = 256;  /* vertices at which later programs may begin; more cost more than they save */
static const integer FRESH = 4;      /* programs that may pass a basis on before its inverse is computed anew */

enum { UNSETTLED, KEPT, REDUNDANT };

/* Vertices where programs ended, each with its basis and the inverse. */
typedef struct {
    integer d, count, room;
    double *points, *inverses;
    integer *bases, *ages;
} Corners;

typedef struct {
    integer n;           /* facets known so far: */
    double *at, *b;      /* (d, m) of which n columns are used, and (m,) */
    integer *state;      /* (m,) */
    double *c, *reach, *rate;
    Corners corners;
    State at_vertex;
} Search;

static void lay_out_search(Search *search, Memory *memory, integer d, integer m)
{
    Corners *corners = &search->corners;
    search->n = 0, search->at = doubles(memory, d * m), search->b = doubles(memory, m);
    search->state = integers(memory, m), search->c = doubles(memory, d);
    search->reach = doubles(memory, m), search->rate = doubles(memory, m);
    corners->d = d, corners->count = 0, corners->room = least(m, CORNERS);
    corners->points = doubles(memory, corners->room * d), corners->inverses = doubles(memory, corners->room * d * d);
    corners->bases = integers(memory, corners->room * d), corners->ages = integers(memory, corners->room);
    lay_out_state(&search->at_vertex, memory, d, m);
}

integer clarkson_room(integer d, integer m)
{
    Search search;
    Memory memory = {NULL, 0};
    lay_out_search(&search, &memory, d, m);
    return memory.used;
}

WIDE static void scale_entries(double *restrict a, const double *restrict factor, integer m)
{
    for (integer i = 0; i < m; i++) a[i] *= factor[i];
}

WIDE static integer count_from(const double *restrict a, integer m, double least)
{
    integer count = 0;
    for (integer i = 0; i < m; i++) count += a[i] >= least;
    return count;
}

/* Row that the ray from the origin along p meets first (-1: none), and whether another is met about there.
 *
 * reach (m,) holds the reciprocals of the slacks; rate (m,) is overwritten.
 */
static integer first_hit(const Rows *rows, const double *reach, const double *p, double *rate, int *tie)
{
    const integer m = rows->m;
    combine(rows, p, rate);
    scale_entries(rate, reach, m);
    const double steepest = largest_above(rate, m);
    *tie = 1;
    if (!(steepest > 0.0)) return -1;
    *tie = count_from(rate, m, steepest * (1.0 - TOGETHER)) > 1;
    integer row = 0;
    while (rate[row] != steepest) row++;
    return row;
}

/* The stored vertex that is farthest along c (-1: none is farther than the origin). */
static integer best_corner(const Corners *corners, const double *c)
{
    integer best = -1;
    double farthest = 0.0;
    for (integer k = 0; k < corners->count; k++) {
        const double value = dot(corners->points + k * corners->d, c, corners->d);
        if (value > farthest) best = k, farthest = value;
    }
    return best;
}

static void load(const Corners *corners, integer k, State *to)
{
    const integer d = corners->d;
    copy(to->x, corners->points + k * d, d);
    copy(to->Q, corners->inverses + k * d * d, d * d);
    for (integer j = 0; j < d; j++) to->W[j] = corners->bases[k * d + j];
}

static void store(Corners *corners, integer k, const double *x, const integer *W, const double *Q, integer age)
{
    const integer d = corners->d;
    copy(corners->points + k * d, x, d);
    copy(corners->inverses + k * d * d, Q, d * d);
    for (integer j = 0; j < d; j++) corners->bases[k * d + j] = W[j];
    corners->ages[k] = age;
}

/* Vertices beyond a new facet are none: the last ones take their places. */
static void drop_beyond(Corners *corners, const double *row, double slack)
{
    const integer d = corners->d;
    for (integer k = corners->count - 1; k >= 0; k--) {
        if (!(dot(corners->points + k * d, row, d) > slack)) continue;
        const integer last = --corners->count;
        if (k != last)
            store(corners, k, corners->points + last * d, corners->bases + last * d, corners->inverses + last * d * d,
                  corners->ages[last]);
    }
}

/* Keep the vertex where a program ended, unless it began there; its inverse is renewed now and then. */
static void remember(const Rows *facets, Corners *corners, integer begun, State *at)
{
    const integer d = corners->d;
    integer moved = begun < 0;
    for (integer k = 0; k < d && !moved; k++) moved = corners->bases[begun * d + k] != at->W[k];
    if (corners->count == corners->room || !moved) return;
    integer age = begun < 0 ? 1 : corners->ages[begun] + 1;
    if (age > FRESH) {
        if (!invert_basis(facets, at->W, at->Q, at->work)) return;
        age = 0;
    }
    store(corners, corners->count++, at->x, at->W, at->Q, age);
}

static void add_facet(Search *search, const Rows *rows, integer row)
{
    for (integer j = 0; j < rows->d; j++) search->at[j * rows->m + search->n] = rows->at[j * rows->stride + row];
    search->b[search->n++] = rows->b[row];
    search->state[row] = KEPT;
}

/* Facets by rays along the rows, which are worth their while as long as most of them find one. */
static void shoot(Search *search, const Rows *rows)
{
    integer tries = 2 * rows->d;
    int tie;
    for (integer i = 0; i < rows->m && tries > 0; i++) {
        if (search->state[i] != UNSETTLED) continue;
        put_column(search->c, rows, i);
        const integer row = first_hit(rows, search->reach, search->c, search->rate, &tie);
        if (tie || search->state[row] != UNSETTLED) {
            tries--;
        } else {
            search->state[row] = KEPT;
            tries++;
        }
    }
    for (integer i = 0; i < rows->m; i++)
        if (search->state[i] == KEPT) add_facet(search, rows, i);
}

/* Programs until row i is settled; each that finds it violated settles it or another row. */
static void settle_row(Search *search, const Rows *rows, integer i, integer *doubtful)
{
    State *at = &search->at_vertex;
    Corners *corners = &search->corners;
    while (search->state[i] == UNSETTLED) {
        const Rows facets = {rows->d, search->n, rows->m, search->at, search->b};
        put_column(search->c, rows, i);
        const integer begun = best_corner(corners, search->c);
        if (begun < 0)
            begin_at_origin(&facets, at);
        else
            load(corners, begun, at);
        const int answer = exceeds(&facets, search->c, rows->b[i], at);
        if (answer == NO) {
            search->state[i] = REDUNDANT;
            remember(&facets, corners, begun, at);
            return;
        }
        integer row = i;
        int tie = 1;
        if (answer == YES) row = first_hit(rows, search->reach, at->x, search->rate, &tie);
        if (tie || row < 0 || search->state[row] != UNSETTLED) {
            row = i;
            doubtful[i] = 1;
        }
        add_facet(search, rows, row);
        put_column(search->c, rows, row);
        drop_beyond(corners, search->c, rows->b[row]);
    }
}

/* keep (m,): whether a row of the centred set is a facet; asked (m,): 0 where that is sure beforehand.
 *
 * Doubtful rows were not proved to be facets: a ray met several rows at once, or a program did not settle it.
 */
void clarkson(const Rows *rows, const integer *asked, integer *keep, integer *doubtful, Memory memory)
{
    const integer m = rows->m;
    Search search;
    lay_out_search(&search, &memory, rows->d, m);
    for (integer i = 0; i < m; i++) {
        search.state[i] = asked[i] ? UNSETTLED : KEPT;
        search.reach[i] = 1.0 / rows->b[i];
        doubtful[i] = 0;
    }
    shoot(&search, rows);
    for (integer i = 0; i < m; i++) settle_row(&search, rows, i, doubtful);
    for (integer i = 0; i < m; i++) keep[i] = search.state[i] == KEPT;
}

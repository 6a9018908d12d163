/* Which rows of a full-dimensional set are facets: one program per row, or Clarkson's method.
 *
 * The set is looked at from a point strictly inside (centre.c), so a set with axes of different scales needs no
 * tolerance of its own. A row is redundant if the others keep it below 1 + 1e-12 times its slack: what is dropped lets
 * the set grow by a factor of 1 + 1e-12 about that point, whatever its shape. Each optimum comes with a bound of its
 * rounding error; rows that it leaves open are doubtful.
 */
#include "polytopes/polytopes.h"
#include "vectors.h"

static const double TOLERANCE = 1e-12; /* of a row's slack at the inner point: growth that counts as none */
static const double CLEAR = 1e-9;  /* of the slack: beyond, no vertex need be found (Harris' tolerance is 1e-11) */
static const double BELOW = 1e-10; /* violation, of the slack, that a point clearly outside a row may have of others */
static const double FLAT_ROW = 1e-6; /* steepest entry of a row, of one elsewhere, below which a ray may be rounding */
static const double RELAXED = 1.0;   /* a row's own right-hand side in its program, beyond its slack */
static const double AWAY = 1e3;      /* right-hand side of a row that was dropped */
static const integer CLARKSON_FROM = 24; /* rows; below, one program per row is faster */

/* Bound of the rounding error of the optimum c'x: that of each active row times its multiplier, and its own. */
static double rounding(const Rows *rows, const double *c, const State *at)
{
    const integer d = rows->d;
    double total = 0.0;
    for (integer j = 0; j < d; j++) total += fabs(c[j] * at->x[j]);
    for (integer k = 0; k < d; k++) {
        const integer i = at->W[k];
        if (i < 0) continue;
        double terms = rows->b[i];
        for (integer j = 0; j < d; j++) terms += fabs(rows->at[j * rows->stride + i] * at->x[j]);
        total += fabs(at->y[k]) * terms;
    }
    return 4.0 * (double)(d + 2) * EPS * total;
}

/* Whether no row of the centred set is much flatter than others: no set far longer than it is wide. */
static int even(const Rows *rows)
{
    for (integer i = 0; i < rows->m; i++) {
        double steepest = 0.0;
        for (integer j = 0; j < rows->d; j++) steepest = larger(fabs(rows->at[j * rows->stride + i]), steepest);
        if (steepest < FLAT_ROW) return 0;
    }
    return 1;
}

/* The answer from an optimum: by its multipliers, else by the vertex found exactly. */
static int exceeds_at_optimum(const Rows *rows, const double *c, double slack, State *at)
{
    const integer d = rows->d;
    const double value = dot(c, at->x, d);
    double bound = 0.0;
    for (integer k = 0; k < d; k++)
        if (at->W[k] >= 0) bound += at->y[k] * rows->b[at->W[k]];
    if (fabs(bound - value) < CLEAR * slack && bound + rounding(rows, c, at) < slack * (1.0 - 2.0 * CLEAR)) return NO;
    if (repair(rows, at, 1.0) != OPTIMAL) return DOUBT;
    double over = -slack * (1.0 + TOLERANCE);
    for (integer j = 0; j < d; j++) over += c[j] * at->x[j];
    const double error = rounding(rows, c, at) + (double)(d + 2) * EPS * slack;
    return over > error ? YES : over < -error ? NO : DOUBT;
}

/* Whether c'x exceeds (1 + 1e-12) slack in the centred set.
 *
 * The ascent begins at the basis W with inverse Q and its point x, and leaves those where it ended: a point that does
 * exceed it, or an optimum.
 */
int exceeds(const Rows *rows, const double *c, double slack, State *at)
{
    const integer d = rows->d, m = rows->m;
    slacks(rows, at->x, at->s);
    for (integer k = 0; k < d; k++)
        if (at->W[k] >= 0) at->s[at->W[k]] = 0.0;
    const integer status = ascend(rows, c, at, 1.0, slack * (1.0 + CLEAR));
    if (status == OPTIMAL) return exceeds_at_optimum(rows, c, slack, at);
    if (status == STOPPED) { /* a row whose rate was masked may lie behind */
        double worst = INFINITY;
        for (integer i = 0; i < m; i++) worst = smaller(at->s[i], worst);
        return worst > -BELOW ? YES : DOUBT;
    }
    if (status != UNBOUNDED) return DOUBT;
    copy(at->x, c, d);
    return even(rows) ? YES : DOUBT;
}

void put_column(double *c, const Rows *rows, integer i)
{
    for (integer j = 0; j < rows->d; j++) c[j] = rows->at[j * rows->stride + i];
}

typedef struct {
    double *b, *c;
    State state;
} Single;

static void lay_out_single(Single *single, Memory *memory, integer d, integer m)
{
    single->b = doubles(memory, m), single->c = doubles(memory, d);
    lay_out_state(&single->state, memory, d, m);
}

/* One program per row that is asked for, against all rows still kept, that row relaxed. */
static void one_by_one(const Rows *rows, const integer *asked, integer *keep, integer *doubtful, Memory memory)
{
    const integer m = rows->m;
    Single single;
    lay_out_single(&single, &memory, rows->d, m);
    const Rows relaxed = {rows->d, m, rows->stride, rows->at, single.b};
    copy(single.b, rows->b, m);
    for (integer i = 0; i < m; i++) {
        keep[i] = 1, doubtful[i] = 0;
        if (!asked[i]) continue;
        single.b[i] = rows->b[i] + RELAXED;
        put_column(single.c, rows, i);
        begin_at_origin(&relaxed, &single.state);
        const int answer = exceeds(&relaxed, single.c, rows->b[i], &single.state);
        single.b[i] = answer == NO ? AWAY : rows->b[i];
        keep[i] = answer != NO;
        doubtful[i] = answer == DOUBT;
    }
}

typedef struct {
    double *at, *b;
    integer *asked, *keep;
} Facets;

static void lay_out_facets(Facets *facets, Memory *memory, integer d, integer m)
{
    facets->at = doubles(memory, d * m), facets->b = doubles(memory, m);
    facets->asked = integers(memory, m), facets->keep = integers(memory, m);
}

integer irredundant_room(integer d, integer m)
{
    Facets facets;
    Single single;
    Memory own = {NULL, 0}, one = {NULL, 0};
    lay_out_facets(&facets, &own, d, m);
    lay_out_single(&single, &one, d, m);
    return own.used + most(most(distinct_room(d, m), centred_room(m)), most(one.used, clarkson_room(d, m)));
}

/* Leaves the rows that are kept, of k, and what belongs to them; how many they are. */
static integer compact(Facets *facets, integer d, integer k, integer *chosen, integer *doubtful)
{
    integer n = 0;
    for (integer q = 0; q < k; q++) {
        if (!facets->keep[q]) continue;
        chosen[n] = chosen[q], doubtful[n] = doubtful[q], facets->b[n] = facets->b[q];
        n++;
    }
    for (integer j = 0, to = 0; j < d; j++)
        for (integer q = 0; q < k; q++)
            if (facets->keep[q]) facets->at[to++] = facets->at[j * k + q];
    return n;
}

/* Numbers of a minimal set of rows, and for each whether it is doubtful: kept, and perhaps redundant; how many.
 *
 * rows: none of zeros; x0 (d,): a point strictly inside (if rounding cannot tell that it is, every row is doubtful);
 * known (m,): 1 for rows that are facets for sure. Room for m numbers in `chosen` and `doubtful`.
 */
integer irredundant(const Rows *rows, const double *x0, const integer *known, integer *chosen, integer *doubtful,
                    Memory memory)
{
    const integer d = rows->d;
    Facets facets;
    lay_out_facets(&facets, &memory, d, rows->m);
    integer k = distinct(rows, chosen, memory), open = 0;
    if (!centred(rows, chosen, k, x0, facets.at, facets.b, memory)) {
        for (integer q = 0; q < k; q++) doubtful[q] = 1;
        return k;
    }
    for (integer q = 0; q < k; q++) facets.asked[q] = !known[chosen[q]];
    if (k >= CLARKSON_FROM) {
        const Rows all = {d, k, k, facets.at, facets.b};
        clarkson(&all, facets.asked, facets.keep, doubtful, memory);
        k = compact(&facets, d, k, chosen, doubtful);
        for (integer q = 0; q < k; q++) open += doubtful[q];
        if (open == 0) return k;
        for (integer q = 0; q < k; q++) facets.asked[q] = doubtful[q];
    }
    const Rows left = {d, k, k, facets.at, facets.b};
    one_by_one(&left, facets.asked, facets.keep, doubtful, memory);
    return compact(&facets, d, k, chosen, doubtful);
}

EXPORTED integer fdi_irredundant_room(integer d, integer m) { return m + irredundant_room(d, m); }

/* The same of rows at (d, m), b (m,) of which nothing is known. */
EXPORTED integer fdi_irredundant(integer d, integer m, const double *at, const double *b, const double *x0,
                                 integer *chosen, integer *doubtful, double *block)
{
    Memory memory = {block, 0};
    const Rows rows = {d, m, m, at, b};
    integer *known = integers(&memory, m);
    for (integer i = 0; i < m; i++) known[i] = 0;
    return irredundant(&rows, x0, known, chosen, doubtful, memory);
}

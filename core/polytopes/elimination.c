/* Fourier-Motzkin elimination: the pairs in which a coordinate cancels, and the facets among them, step by step.
 *
 * Rows stand as [A, b], one after the other, (rows, dim + 1); the table shrinks and grows in the caller's room.
 */
#include "polytopes/polytopes.h"
#include "powers.h"
#include "vectors.h"

static const integer LONG = 1000; /* rows formed: such a step takes milliseconds, and Python hears of it at once */
/* A step that forms at most so many times the rows that the last pruning left needs no pruning first: programs after
 * several such steps are fewer, and have fewer variables (3 to 30 % less time on sparse rows, none on dense ones). */
static const double GROWTH = 1.5;
/* A sum this small beside its two terms is zero: rounding errors of earlier steps would make it a row of noise. */
static const double CANCELLED = 64.0 * EPS;
static const integer HIGHEST = 1000; /* exponent of a factor: that of a row of tiny numbers must be a float */

enum { ROWS, DIM, COLUMNS, LEAST, STEPS, AFTER_LONG, FORMED, PROGRESS }; /* progress, kept by the caller */

typedef struct {
    double *table, *other;    /* (room, dim + 1) each */
    integer *known;           /* (room,) 1 for rows that are facets for sure */
    integer *left, *columns;  /* (dim,) names of the coordinates, (columns,) those to eliminate */
    double *inner;            /* (dim,) a point strictly inside */
    integer *doubtful;        /* (room,) */
    integer *trace;           /* (steps, 2) rows formed and kept */
    integer *progress;
    double *block;
} Elimination;

/* Every row over a power of two, so that no product of two coefficients leaves the range of floats. */
static void scale_row(double *row, integer dim)
{
    const double largest = largest_magnitude(row, dim);
    const double factor = power_of_two(least(-exponent_of(largest), HIGHEST));
    for (integer j = 0; j <= dim; j++) row[j] *= factor;
}

static int among(integer name, const integer *names, integer count)
{
    for (integer k = 0; k < count; k++)
        if (names[k] == name) return 1;
    return 0;
}

/* Which of the columns makes the fewest rows when it is eliminated (the first of several), and how many; -1: none. */
static integer cheapest(const Elimination *of, integer *formed)
{
    const integer rows = of->progress[ROWS], dim = of->progress[DIM];
    integer best = -1;
    for (integer j = 0; j < dim; j++) {
        if (!among(of->left[j], of->columns, of->progress[COLUMNS])) continue;
        integer up = 0, down = 0;
        for (integer i = 0; i < rows; i++) {
            up += of->table[i * (dim + 1) + j] > 0.0;
            down += of->table[i * (dim + 1) + j] < 0.0;
        }
        const integer count = rows - up - down + up * down;
        if (best < 0 || count < *formed) best = j, *formed = count;
    }
    return best;
}

/* Rows that the step after the next will form, if the rows are dense: half of those that stay go with the others.
 *
 * The share that stays was measured on random rows; it grows with the dimension that is left.
 */
static double foreseen(integer formed, integer dim)
{
    const double share = dim > 4 ? 0.65 : dim == 4 ? 0.45 : 0.2, half = 0.5 * share * (double)formed;
    return half * half;
}

/* Row `up` and row `down` added so that x_j cancels, without it; whether anything but zeros is left of A. */
static int add_pair(double *to, const double *up, const double *down, integer j, integer dim)
{
    const double times_up = -down[j], times_down = up[j];
    double largest = 0.0;
    for (integer q = 0, k = 0; q <= dim; q++) {
        if (q == j) continue;
        const double above = up[q] * times_up, below = down[q] * times_down, sum = above + below;
        to[k] = fabs(sum) <= CANCELLED * (fabs(above) + fabs(below)) ? 0.0 : sum;
        if (q < dim) largest = larger(fabs(to[k]), largest);
        k++;
    }
    return largest > 0.0;
}

static int leave_out(double *to, const double *row, integer j, integer dim)
{
    copy(to, row, j);
    copy(to + j, row + j + 1, dim - j);
    return largest_magnitude(to, dim - 1) > 0.0;
}

/* All rows without x_j and all pairs in which it cancels, scaled by powers of two; no zero rows. How many.
 *
 * A facet parallel to x_j stays one: a point that violates it alone does so in the shadow too.
 */
static integer combined(Elimination *of, integer j, integer *falling, integer *known)
{
    const integer rows = of->progress[ROWS], dim = of->progress[DIM], width = dim + 1;
    integer count = 0, down = 0;
    for (integer i = 0; i < rows; i++)
        if (of->table[i * width + j] < 0.0) falling[down++] = i;
    for (integer i = 0; i < rows; i++) {
        const double *row = of->table + i * width;
        if (row[j] < 0.0) continue;
        for (integer q = 0; q < (row[j] > 0.0 ? down : 1); q++) {
            double *to = of->other + count * dim;
            const int bounds = row[j] > 0.0 ? add_pair(to, row, of->table + falling[q] * width, j, dim)
                                            : leave_out(to, row, j, dim);
            if (!bounds) continue;
            scale_row(to, dim - 1);
            known[count++] = row[j] > 0.0 ? 0 : of->known[i];
        }
    }
    return count;
}

typedef struct {
    integer *chosen, *known;
    double *at, *b;
    Memory rest;
} Scratch;

static integer lay_out_scratch(Scratch *scratch, double *block, integer dim, integer room)
{
    scratch->rest = (Memory){block, 0};
    scratch->chosen = integers(&scratch->rest, room), scratch->known = integers(&scratch->rest, room);
    scratch->at = doubles(&scratch->rest, dim * room), scratch->b = doubles(&scratch->rest, room);
    return scratch->rest.used + irredundant_room(dim, room);
}

EXPORTED integer fdi_eliminate_room(integer dim, integer room)
{
    Scratch scratch;
    return lay_out_scratch(&scratch, NULL, dim, room);
}

/* Only the facets stay; how many of them are doubtful. */
static integer prune(Elimination *of)
{
    const integer rows = of->progress[ROWS], dim = of->progress[DIM], width = dim + 1;
    Scratch scratch;
    integer open = 0;
    lay_out_scratch(&scratch, of->block, dim, rows);
    for (integer i = 0; i < rows; i++) {
        for (integer j = 0; j < dim; j++) scratch.at[j * rows + i] = of->table[i * width + j];
        scratch.b[i] = of->table[i * width + dim];
    }
    const Rows all = {dim, rows, rows, scratch.at, scratch.b};
    const integer kept = irredundant(&all, of->inner, of->known, scratch.chosen, of->doubtful, scratch.rest);
    for (integer q = 0; q < kept; q++) {
        if (scratch.chosen[q] != q) copy(of->table + q * width, of->table + scratch.chosen[q] * width, width);
        of->known[q] = 1;
        open += of->doubtful[q];
    }
    of->progress[ROWS] = of->progress[LEAST] = kept;
    if (of->progress[STEPS] > 0) of->trace[2 * of->progress[STEPS] - 1] = kept;
    return open;
}

/* One coordinate less. */
static void take_step(Elimination *of, integer j, integer formed)
{
    integer *progress = of->progress, n = 0;
    Scratch scratch;
    lay_out_scratch(&scratch, of->block, progress[DIM], most(formed, progress[ROWS]));
    progress[ROWS] = combined(of, j, scratch.chosen, scratch.known);
    for (integer i = 0; i < progress[ROWS]; i++) of->known[i] = scratch.known[i];
    double *table = of->table;
    of->table = of->other, of->other = table;
    for (integer k = 0; k < progress[COLUMNS]; k++)
        if (of->columns[k] != of->left[j]) of->columns[n++] = of->columns[k];
    progress[COLUMNS] = n;
    progress[DIM]--;
    for (integer k = j; k < progress[DIM]; k++) of->left[k] = of->left[k + 1], of->inner[k] = of->inner[k + 1];
    integer *trace = of->trace + 2 * progress[STEPS]++;
    trace[0] = formed, trace[1] = progress[ROWS];
    progress[AFTER_LONG] = formed > LONG;
}

static integer run(Elimination *of, integer room, integer max_rows, integer cautious)
{
    integer *progress = of->progress;
    for (;;) {
        integer formed = 0, all_known = 1;
        const integer j = cheapest(of, &formed);
        const int far = cautious && progress[COLUMNS] > 1 && foreseen(formed, progress[DIM] - 1) > (double)max_rows;
        const int over = j >= 0 && (formed > max_rows || far);
        for (integer i = 0; i < progress[ROWS]; i++) all_known &= of->known[i] != 0;
        progress[FORMED] = formed;
        if (!all_known && (j < 0 || over || (double)formed > GROWTH * (double)progress[LEAST])) {
            if (prune(of) > 0) return OPEN;
            if (progress[AFTER_LONG]) return PAUSED;
            continue;
        }
        if (j < 0) return FINISHED;
        if (over) return TOO_MANY;
        if (formed > room) return NO_ROOM;
        take_step(of, j, formed);
    }
}

/* Eliminate coordinates, the one that makes the fewest pairs first, until the caller has to decide.
 *
 * Rows are pruned at the end, and before a step whenever it would form many more than the last pruning left. All arrays
 * are changed in place, sizes as above; `room` rows fit into table and other, (room, dim + 1), known and doubtful;
 * progress holds rows, dim, columns, rows that the last pruning left, steps, whether the last one was long, and the
 * rows that the next step would form. max_rows limits those; cautious: stop already where the step after the next is
 * foreseen to form more. Returns FINISHED, TOO_MANY, OPEN (rows are doubtful), PAUSED (after a long step), or NO_ROOM
 * (for the next step: go on with more).
 */
EXPORTED integer fdi_eliminate(integer room, integer max_rows, integer cautious, double *table, double *other,
                               integer *known, integer *left, integer *columns, double *inner, integer *doubtful,
                               integer *trace, integer *progress, double *block)
{
    Elimination of = {table, other, known, left, columns, inner, doubtful, trace, progress, block};
    if (progress[STEPS] == 0)
        for (integer i = 0; i < progress[ROWS]; i++) scale_row(table + i * (progress[DIM] + 1), progress[DIM]);
    const integer state = run(&of, room, max_rows, cautious);
    if (of.table != table) copy(table, of.table, progress[ROWS] * (progress[DIM] + 1));
    return state;
}

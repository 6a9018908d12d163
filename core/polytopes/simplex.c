/* Primal simplex method for max c'x subject to A x <= b with x free (the inequality form): few variables, many rows.
 *
 * A slot of the basis may hold an artificial row "x_j free", which leaves as soon as it has a price. Pricing is exact
 * steepest edge; the ratio test is Harris' (two passes, largest pivot), with Bland's rule after a run of degenerate
 * steps. A finished vertex is recomputed from its active rows, and small infeasibilities left by the Harris tolerance
 * are removed by dual simplex steps, so that an optimum is a true vertex, not one displaced by a tolerance.
 */
#include "polytopes/polytopes.h"
#include "vectors.h"

static const double PIVOT = 1e-9;    /* rates below are masked before the ratio test */
static const double RAY = 1e-13;     /* no rate above this: the edge is a ray */
static const double PRICE = 1e-14;   /* relative reduced cost that still counts as zero */
static const double CERTAIN = 1e-11; /* relative reduced cost below which a ray may be an effect of rounding */
static const double HARRIS = 1e-11;  /* ratio-test tolerance, relative to the size of b */
static const double DEGENERATE = 1e-13; /* step, relative to the size of b, that counts as none */
static const double FREE_FIRST = 1e6;   /* merit of an artificial row beside that of others */
static const integer REFACTOR = 40;     /* pivots between two fresh inverses */

/* Multipliers y of the active rows, and the slot to release (-1: optimal). */
static integer price(const double *c, double size, State *at, integer d, int bland)
{
    integer slot = -1, first = INT64_MAX;
    double best = 0.0;
    for (integer k = 0; k < d; k++) {
        const double y = dot(c, at->Q + k * d, d), square = sum_of_squares(at->Q + k * d, d);
        const int artificial = at->W[k] < 0;
        const double gain = artificial ? fabs(y) : -y;
        at->y[k] = y;
        if (!(gain > PRICE * size * sqrt(square))) continue;
        const double merit = gain * gain / square * (artificial ? FREE_FIRST : 1.0);
        if (bland ? at->W[k] < first : merit > best) slot = k, first = at->W[k], best = merit;
    }
    return slot;
}

/* p along the edge that the slot opens, of length one; how long the edge was. */
static double open_edge(State *at, integer slot, integer d)
{
    const double *edge = at->Q + slot * d;
    const double length = sqrt(sum_of_squares(edge, d));
    const double factor = (at->W[slot] < 0 && at->y[slot] > 0.0 ? 1.0 : -1.0) / length;
    for (integer j = 0; j < d; j++) at->p[j] = factor * edge[j];
    return length;
}

/* Reciprocals of the steps that bring each slack to -tolerance; zero where the rate is masked. */
WIDE static void steepness(const double *restrict s, const double *restrict rate, integer m, double tolerance,
                           double *restrict ratio)
{
    for (integer i = 0; i < m; i++) {
        const double masked = rate[i] > PIVOT ? rate[i] : 0.0;
        ratio[i] = masked / (larger(s[i], 0.0) + tolerance);
    }
}

/* Rates of the rows that are met within a step, zero for the others. */
WIDE static void pivots_within(const double *restrict s, const double *restrict rate, integer m, double step,
                               double *restrict pivot)
{
    for (integer i = 0; i < m; i++) pivot[i] = s[i] <= step * rate[i] ? rate[i] : 0.0;
}

/* Row that stops a move at the rates of the state (-1: none with a pivot above the mask). */
static integer blocking_row(State *at, integer m, double tolerance, int bland)
{
    const double *s = at->s, *rate = at->rate;
    steepness(s, rate, m, tolerance, at->ratio);
    const double steepest = largest_above(at->ratio, m);
    if (!(steepest > 0.0)) return -1;
    const double step = 1.0 / steepest;
    pivots_within(s, rate, m, step, at->ratio);
    const double pivot = bland ? 0.0 : largest_above(at->ratio, m);
    for (integer i = 0; i < m; i++)
        if (bland ? at->ratio[i] > PIVOT : at->ratio[i] == pivot) return i;
    return -1;
}

/* Move to the blocking row and take it into the slot. */
static void pivot_on(const Rows *rows, State *at, integer slot, integer row, double step)
{
    const integer d = rows->d, left = at->W[slot];
    add_multiple(at->x, step, at->p, d);
    add_multiple(at->s, -step, at->rate, rows->m);
    at->s[row] = 0.0;
    coordinates(rows, row, at->Q, at->alpha);
    exchange(at->Q, at->alpha, slot, d);
    at->W[slot] = row;
    if (left < 0) return;
    double slack = rows->b[left];
    for (integer j = 0; j < d; j++) slack -= rows->at[j * rows->stride + left] * at->x[j];
    at->s[left] = larger(slack, 0.0);
}

/* From the feasible state (x, s, W, Q), until c'x exceeds `stop`; leaves the multipliers in y. */
integer ascend(const Rows *rows, const double *c, State *at, double scale, double stop)
{
    const integer d = rows->d, m = rows->m;
    const double size = sqrt(sum_of_squares(c, d));
    integer degenerate = 0, age = 0;
    for (integer pivots = 0; pivots < 50 * (d + 1) + m; pivots++) {
        if (dot(c, at->x, d) > stop) return STOPPED;
        const int bland = degenerate > 3 * d;
        const integer slot = price(c, size, at, d, bland);
        if (slot < 0) return OPTIMAL;
        const double length = open_edge(at, slot, d);
        combine(rows, at->p, at->rate);
        for (integer k = 0; k < d; k++)
            if (at->W[k] >= 0) at->rate[at->W[k]] = 0.0;
        const integer row = blocking_row(at, m, HARRIS * scale, bland);
        if (row < 0) {
            const int certain = fabs(at->y[slot]) > CERTAIN * size * length;
            return largest_above(at->rate, m) <= RAY && certain ? UNBOUNDED : AMBIGUOUS;
        }
        const double step = larger(at->s[row], 0.0) / at->rate[row];
        degenerate = step <= DEGENERATE * scale ? degenerate + 1 : 0;
        pivot_on(rows, at, slot, row, step);
        if (++age < REFACTOR) continue;
        age = 0;
        if (!invert_basis(rows, at->W, at->Q, at->work)) return LIMIT;
        settle(rows, at);
    }
    return LIMIT;
}

/* The slot that a violated row takes, the one whose multiplier falls to zero first (-1: none). */
static integer leaving_slot(const State *at, integer d)
{
    integer slot = -1;
    double ratio = INFINITY;
    for (integer k = 0; k < d; k++) {
        if (at->W[k] < 0) {
            if (fabs(at->alpha[k]) > PIVOT) slot = k, ratio = -1.0;
        } else if (at->alpha[k] > PIVOT && larger(at->y[k], 0.0) < ratio * at->alpha[k]) {
            slot = k, ratio = larger(at->y[k], 0.0) / at->alpha[k];
        }
    }
    return slot;
}

/* Dual simplex steps from an optimal basis whose vertex is infeasible by about the Harris tolerance. */
integer repair(const Rows *rows, State *at, double scale)
{
    const integer d = rows->d;
    for (integer attempt = 0; attempt < 2 * d + 10; attempt++) {
        settle(rows, at);
        const double worst = smallest_below(at->s, rows->m);
        if (!(worst < -64.0 * EPS * larger(largest_magnitude(at->x, d), scale))) return OPTIMAL;
        if (attempt == d && !invert_basis(rows, at->W, at->Q, at->work)) return LIMIT;
        integer row = 0;
        while (at->s[row] != worst) row++;
        coordinates(rows, row, at->Q, at->alpha);
        const integer slot = leaving_slot(at, d);
        if (slot < 0) return AMBIGUOUS;
        const double theta = at->y[slot] / at->alpha[slot];
        add_multiple(at->y, -theta, at->alpha, d);
        at->y[slot] = theta;
        exchange(at->Q, at->alpha, slot, d);
        at->W[slot] = row;
    }
    return LIMIT;
}

/* Ascend, put the vertex exactly on its rows, remove the Harris slack. */
integer optimise(const Rows *rows, const double *c, State *at, double scale)
{
    const integer status = ascend(rows, c, at, scale, INFINITY);
    return status == OPTIMAL ? repair(rows, at, scale) : status;
}

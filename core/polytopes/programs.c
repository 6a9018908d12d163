/* The two programs of one set of rows: a largest ball, and support points in many directions. */
#include "polytopes/polytopes.h"
#include "vectors.h"

static const double BEYOND = 0.99;  /* of the limit of a radius: from there on it has none */
static const integer CHAINED = 128; /* directions; more are taken in their order */

/* Rows of the largest ball in (x, r): a_i'x + |a_i| r <= b_i, and r <= cap last. */
typedef struct {
    double *at, *b, *start, *c;
    State state;
} Ball;

static integer lay_out_ball(Ball *ball, double *block, integer d, integer m)
{
    Memory memory = {block, 0};
    ball->at = doubles(&memory, (d + 1) * (m + 1)), ball->b = doubles(&memory, m + 1);
    ball->start = doubles(&memory, d + 1), ball->c = doubles(&memory, d + 1);
    lay_out_state(&ball->state, &memory, d + 1, m + 1);
    return memory.used;
}

EXPORTED integer fdi_interior_room(integer d, integer m)
{
    Ball ball;
    return lay_out_ball(&ball, NULL, d, m);
}

static void lift(Ball *ball, integer d, integer m, const double *at, const double *b, const double *norms, double cap)
{
    for (integer j = 0; j < d; j++) {
        copy(ball->at + j * (m + 1), at + j * m, m);
        ball->at[j * (m + 1) + m] = 0.0;
    }
    copy(ball->at + d * (m + 1), norms, m);
    ball->at[d * (m + 1) + m] = 1.0;
    copy(ball->b, b, m);
    ball->b[m] = cap;
}

/* Largest ball a_i'x + |a_i| r <= b_i with r at most so many times the largest |b_i|, which keeps the program bounded.
 *
 * at (d, m), b (m,): scaled rows; norms (m,): their lengths; x0 (d,): any point, it need not be feasible.
 * Leaves in `found` the centre (d,), the radius (negative if the rows have no common point, infinite near its limit), and
 * multipliers of the rows (m,): with a negative radius they combine the rows to 0'x <= r (Farkas). Returns the status.
 */
EXPORTED integer fdi_interior(integer d, integer m, const double *at, const double *b, const double *norms,
                              const double *x0, double times, double *found, double *block)
{
    Ball ball;
    lay_out_ball(&ball, block, d, m);
    const Rows given = {d, m, m, at, b}, rows = {d + 1, m + 1, m + 1, ball.at, ball.b};
    const double scale = scale_of(&given), cap = times * scale;
    lift(&ball, d, m, at, b, norms, cap);
    State *state = &ball.state;
    slacks(&given, x0, state->s);
    double radius = cap;
    for (integer i = 0; i < m; i++) radius = smaller(state->s[i] / norms[i], radius);
    copy(ball.start, x0, d);
    ball.start[d] = radius;
    begin(&rows, ball.start, state);
    fill(ball.c, 0.0, d);
    ball.c[d] = 1.0;
    fill(state->y, 0.0, d + 1);
    const integer status = optimise(&rows, ball.c, state, scale);
    double *weights = found + d + 1;
    copy(found, state->x, d + 1);
    if (found[d] >= BEYOND * cap) found[d] = INFINITY;
    fill(weights, 0.0, m);
    for (integer k = 0; k <= d; k++)
        if (state->W[k] >= 0 && state->W[k] < m) weights[state->W[k]] = state->y[k];
    return status;
}

/* Greedy chain through k directions by angle, so that neighbours share most of their basis; units is (k, d). */
static void nearest_order(const double *directions, integer k, integer d, integer *order, double *units)
{
    for (integer i = 0; i < k; i++) order[i] = i;
    if (k > CHAINED) return;
    for (integer i = 0; i < k; i++) {
        const double square = sum_of_squares(directions + i * d, d);
        const double inverse = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
        for (integer j = 0; j < d; j++) units[i * d + j] = directions[i * d + j] * inverse;
    }
    for (integer i = 1; i < k; i++) {
        integer best = i;
        double cosine = -2.0;
        for (integer q = i; q < k; q++) {
            const double found = dot(units + order[i - 1] * d, units + order[q] * d, d);
            if (found > cosine) best = q, cosine = found;
        }
        const integer kept = order[i];
        order[i] = order[best], order[best] = kept;
    }
}

typedef struct {
    integer *order;
    double *units, *work;
    State state;
} Chain;

static integer lay_out_chain(Chain *chain, double *block, integer d, integer m, integer k)
{
    Memory memory = {block, 0};
    chain->order = integers(&memory, k), chain->units = doubles(&memory, k > CHAINED ? 0 : k * d);
    chain->work = doubles(&memory, 3 * d);
    lay_out_state(&chain->state, &memory, d, m);
    return memory.used;
}

EXPORTED integer fdi_supports_room(integer d, integer m, integer k)
{
    Chain chain;
    return lay_out_chain(&chain, NULL, d, m, k);
}

/* Support points in k directions (k, d), each program started from the vertex of its neighbour.
 *
 * at (d, m), b (m,): scaled rows; x0 (d,): a feasible point. Results: found holds points (k, d), multipliers (k, d),
 * beside (k, d), bounds (k,) and spare (k,), one after the other; codes holds active rows (k, d) and statuses (k,).
 * All but the status mean something only where it is OPTIMAL: then c'x <= bounds - spare + beside'|x| for all x of the
 * set (see dual_bound). weights (k, m), zero before, or NULL: the multipliers again, by their rows.
 */
EXPORTED void fdi_supports(integer d, integer m, integer k, const double *at, const double *b, const double *x0,
                           const double *directions, double *found, integer *codes, double *weights, double *block)
{
    Chain chain;
    lay_out_chain(&chain, block, d, m, k);
    const Rows rows = {d, m, m, at, b};
    const double scale = scale_of(&rows);
    double *points = found, *multipliers = points + k * d, *beside = multipliers + k * d;
    double *bounds = beside + k * d, *spare = bounds + k;
    integer *status = codes + k * d;
    State *state = &chain.state;
    fill(multipliers, 0.0, 2 * k * d + 2 * k);
    begin(&rows, x0, state);
    nearest_order(directions, k, d, chain.order, chain.units);
    for (integer i = 0; i < k; i++) {
        const integer q = chain.order[i];
        const double *c = directions + q * d;
        state->y = multipliers + q * d;
        status[q] = optimise(&rows, c, state, scale);
        copy(points + q * d, state->x, d);
        if (status[q] == OPTIMAL) bounds[q] = dual_bound(&rows, c, state, beside + q * d, spare + q, chain.work);
        for (integer j = 0; j < d; j++) {
            const integer row = codes[q * d + j] = state->W[j];
            if (row >= 0 && weights) weights[q * m + row] = state->y[j];
        }
        if (status[q] == LIMIT || status[q] == AMBIGUOUS) begin(&rows, x0, state);
    }
}

/* A window over samples of x(k+1) = x(k) + w(k), y = x: its answers are intervals that two lines of arithmetic give. */
#include "window_of.h"

void fdi_window_initialise(void *block, integer count, const double *rows, const double *lower, const double *upper);
integer fdi_window_take(void *block, double eps, integer limit);
integer fdi_window_solve(void *block, integer task, integer start, integer stop, integer limit);

enum { LIMIT = 1000, VERDICTS = 4 };

static const double START = 4.0, NOISE = 0.5, DRIFT = 0.25;

static void *block_of(const window *w) /* the sizes stand before the arrays, the clock first */
{
    return (char *)w->clock - 128;
}

static window walk(integer steps, void **room)
{
    /* n, nu, nw, ny, nq, nh, nt, na, ni, N, block, K, late */
    const integer size[] = {1, 0, 1, 1, 0, 0, 1, 1, 1, steps, most(2 * steps / 5, 1), 3 * steps + 5, 0};
    window w = window_of(size, room);
    w.h_lower[0] = -START, w.h_upper[0] = START;
    w.T[0] = 1.0;
    for (integer j = 0; j < w.Z; j++) w.jitter[j] = 1e-13 * uniform();
    fdi_window_initialise(block_of(&w), 0, NULL, NULL, NULL);
    w.in_stack[0] = w.in_stack[2] = w.in_stack[3] = 1.0; /* [A, c, E; C, c, F], without inputs */
    w.in_noise[0] = NOISE;
    w.in_w_lower[0] = -DRIFT, w.in_w_upper[0] = DRIFT;
    return w;
}

/* The interval of the state after a walk with readings, some of them missing, that a window of N steps bounds outward,
 * and exactly while nothing has been dropped. */
static void bounds_of_a_walk(integer steps)
{
    void *room;
    const window w = walk(steps, &room);
    double x = uniform() * START, low = -START, high = START;
    for (integer k = 0; k < 30; k++) {
        if (k > 0) {
            x += DRIFT * uniform();
            low -= DRIFT;
            high += DRIFT;
        }
        w.in_y[0] = k % 4 == 3 ? NAN : x + NOISE * uniform();
        if (!isnan(w.in_y[0])) {
            low = larger(low, w.in_y[0] - NOISE);
            high = smaller(high, w.in_y[0] + NOISE);
        }
        const integer found = fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT);
        CHECK(found % 8 == FINE);
        CHECK(found / 8 % VERDICTS == CONSISTENT);
        CHECK(fdi_window_solve(block_of(&w), NEWEST, 0, 2, LIMIT) % VERDICTS == CONSISTENT);
        CHECK(w.now_lower[0] <= low && w.now_upper[0] >= high);
        CHECK(near(w.now_lower[0], low, 1e-12) && near(w.now_upper[0], high, 1e-12)); /* intervals lose nothing */
    }
    CHECK(w.clock[TIME] == 29);
    CHECK(w.clock[BASE] > 0);
    CHECK(w.clock[STAGE] == IDLE);
    free(room);
}

/* A reading that no walk explains: the multipliers of the rows say so. */
static void a_jump(integer steps)
{
    void *room;
    const window w = walk(steps, &room);
    for (integer k = 0; k < 7; k++) {
        w.in_y[0] = 0.0;
        CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) / 8 % VERDICTS == CONSISTENT);
    }
    w.in_y[0] = 2.0 * NOISE + DRIFT + 1e-6;
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) / 8 % VERDICTS == EMPTY_CANDIDATE);
    double value = 0.0;
    for (integer i = 0; i < w.R; i++)
        value += w.farkas[i] > 0.0 ? w.farkas[i] * w.upper[i] : w.farkas[i] < 0.0 ? w.farkas[i] * w.lower[i] : 0.0;
    for (integer j = 0; j < w.Z; j++) {
        double total = 0.0;
        for (integer i = 0; i < w.R; i++) total += w.farkas[i] * w.G[i * w.Z + j];
        value += fabs(total);
    }
    CHECK(value < 0.0);
    free(room);
}

/* What is no number is refused before anything has changed. */
static void what_is_refused(void)
{
    void *room;
    const window w = walk(4, &room);
    w.in_y[0] = INFINITY;
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) % 8 == BAD_OUTPUT);
    w.in_y[0] = 0.0;
    w.in_stack[1] = NAN;
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) % 8 == BAD_MATRIX);
    CHECK(w.clock[STARTED] == 0 && w.clock[STAGE] == IDLE);
    w.in_stack[1] = 0.0;
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) % 8 == FINE);
    w.in_stack[0] = 1e40; /* leads from this sample to the next */
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) % 8 == FINE);
    CHECK(fdi_window_take(block_of(&w), 4.0 * EPS, LIMIT) % 8 == OUTGROWN);
    free(room);
}

int main(void)
{
    for (integer steps = 2; steps < 9; steps++) {
        bounds_of_a_walk(steps);
        a_jump(steps);
    }
    what_is_refused();
    return failures > 0;
}

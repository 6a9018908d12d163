/* Samples that are given with the call: one, or those of a log, one after the other. */
#include "window.h"

typedef struct { /* of the samples that are at hand; a schedule that changes nothing gives one row for all of them */
    const double *u, *u_next, *y, *stack, *noise, *w_lower, *w_upper;
    integer is_scheduled;
} samples;

static void give(const window *w, const samples *given, integer i)
{
    const integer at = given->is_scheduled ? i : 0, size = w->ni * w->X * w->P;
    copy(w->in_u, given->u + i * w->nu, w->nu);
    copy(w->in_u_next, given->u_next + i * w->nu, w->nu);
    copy(w->in_y, given->y + i * w->ny, w->ny);
    copy(w->in_stack, given->stack + at * size, size);
    copy(w->in_noise, given->noise + at * w->ny, w->ny);
    copy(w->in_w_lower, given->w_lower + at * w->nw, w->nw);
    copy(w->in_w_upper, given->w_upper + at * w->nw, w->nw);
}

/* `fdi_window_take` of a sample in normal form: u, u_next (nu,), y (ny,), stack (ni, X, P), noise, w_lower, w_upper. */
EXPORTED integer fdi_window_take_sample(void *block, const double *u, const double *u_next, const double *y,
                                        const double *stack, const double *noise, const double *w_lower,
                                        const double *w_upper, double eps, integer limit)
{
    window w;
    window_open(&w, block);
    answer found;
    const samples given = {u, u_next, y, stack, noise, w_lower, w_upper, 0};
    give(&w, &given, 0);
    const integer code = take(&w, eps, limit, &found);
    return told(code, found);
}

/* Bounds of the newest state along the axes, to row i of the boxes (count, 2, n); 0 if a basis has no room. */
static integer store_box(const window *w, double *boxes, integer i, integer limit)
{
    answer found = {EMPTY_CANDIDATE, -1};
    while (found.verdict == EMPTY_CANDIDATE) /* of what no multipliers have proven empty every bound is asked for */
        found = solve_programs(w, NEWEST, found.program + 1, 2 * w->n, limit);
    copy(boxes + 2 * i * w->n, w->now_lower, w->n);
    copy(boxes + (2 * i + 1) * w->n, w->now_upper, w->n);
    return found.verdict != FULL;
}

/* Take samples 0, 1, ... < count until one is not simply consistent, of which the caller concludes the rest.
 *
 * Arrays in normal form: u, u_next (count, nu), y (count, ny), stack (count or 1, ni, X, P), noise, w_lower, w_upper by
 * sample or once; boxes (count, 2, n) or NULL, filled for the samples that are consistent. Returns how many those
 * are; *result is what `fdi_window_take` says of the last one taken, which may need more room, or its box may. */
EXPORTED integer fdi_window_follow(void *block, integer count, integer is_scheduled, const double *u,
                                   const double *u_next, const double *y, const double *stack, const double *noise,
                                   const double *w_lower, const double *w_upper, double eps, integer limit,
                                   double *boxes, integer *result)
{
    window w;
    window_open(&w, block);
    answer found;
    const samples given = {u, u_next, y, stack, noise, w_lower, w_upper, is_scheduled};
    for (integer i = 0; i < count; i++) {
        give(&w, &given, i);
        const integer code = take(&w, eps, limit, &found);
        *result = told(code, found);
        if ((code != FINE && code != SIGN_OPEN) || found.verdict != CONSISTENT) return i;
        if (boxes && !store_box(&w, boxes, i, limit)) return i;
    }
    return count;
}

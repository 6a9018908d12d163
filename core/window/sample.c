/* One sample of data through the window: take it, open its variables, write its rows. */
#include "window.h"

static integer all_finite(const double *values, integer count)
{
    for (integer j = 0; j < count; j++)
        if (!isfinite(values[j])) return 0;
    return 1;
}

/* NaN and Inf have no place here, but for NaN in y (a missing sensor). */
static integer check_numbers(const window *w)
{
    if (!all_finite(w->in_u, w->nu) || !all_finite(w->in_u_next, w->nu)) return BAD_INPUT;
    for (integer o = 0; o < w->ny; o++)
        if (isinf(w->in_y[o])) return BAD_OUTPUT;
    return all_finite(w->in_stack, w->ni * w->X * w->P) ? FINE : BAD_MATRIX;
}

static void store_sample(const window *w, integer k, const double *u)
{
    const integer s = slot(w, k), stack = w->ni * w->X * w->P;
    copy(w->stack + s * stack, w->in_stack, stack);
    copy(w->u + s * w->nu, u, w->nu);
    copy(w->y + s * w->ny, w->in_y, w->ny);
    copy(w->noise + s * w->ny, w->in_noise, w->ny);
}

static void bound_disturbance(const window *w, integer k, const double *lower, const double *upper)
{
    const integer v = variables(w, k);
    copy(w->w_lower + v * w->nw, lower, w->nw);
    copy(w->w_upper + v * w->nw, upper, w->nw);
}

/* Variables w(k) with their bounds, and the rows among them. */
static void open_disturbance(const window *w, integer k)
{
    const integer nw = w->nw, nv = w->nv, s = slot(w, k), v = variables(w, k), first = w->n + v * nv;
    double *vc = w->vc + v * nv, *vr = w->vr + v * nv;
    for (integer j = 0; j < nw; j++) midpoint(w->w_lower[v * nw + j], w->w_upper[v * nw + j], &vc[j], &vr[j]);
    for (integer h = 0; h < w->nh; h++) {
        const integer i = w->na + s * w->nr + w->ny + h;
        const double *row = w->w_rows + h * nw;
        double shift = 0.0;
        clear_row(w, i);
        for (integer j = 0; j < nw; j++) {
            w->G[i * w->Z + first + j] = row[j] * vr[j];
            shift += row[j] * vc[j];
            w->row_c[i] += fabs(row[j] * vc[j]);
        }
        w->raw_lower[i] = w->w_rows_lower[h] - shift;
        w->raw_upper[i] = w->w_rows_upper[h] - shift;
        set_row(w, w->psi, i, s, first, nv, 0.0);
    }
}

/* Take the data of a sample: its transition from the newest one, and its measurement.
 *
 * in_w bounds the disturbance of the new sample; it is used with it where the output has it, with the transition from
 * it otherwise. Returns FINE, SIGN_OPEN (solve CHANNELS, of those that do not reach the output, before `move`), or an
 * error that leaves the window as it was. */
static integer enter(const window *w)
{
    const integer is_first = !w->clock[STARTED], error = check_numbers(w);
    if (error != FINE) return error;
    if (w->clock[PENDING]) slide(w);
    const integer k = w->clock[TIME], new = is_first ? k : k + 1;
    if (w->late) {
        store_sample(w, new, w->in_u_next);
        bound_disturbance(w, new, w->in_w_lower, w->in_w_upper);
    } else if (!is_first) {
        bound_disturbance(w, k, w->newest_w_lower, w->newest_w_upper);
    }
    if ((w->late || !is_first) && !factor_sample(w, w->late ? new : k)) return RANK_ROSE;
    if (!w->late) store_sample(w, new, w->in_u_next);
    copy(w->newest_w_lower, w->in_w_lower, w->nw);
    copy(w->newest_w_upper, w->in_w_upper, w->nw);
    if (is_first) return FINE;
    copy(w->u + slot(w, k) * w->nu, w->in_u, w->nu);
    return bound_channels(w, k, 0) ? SIGN_OPEN : FINE;
}

/* The transition to the sample that `enter` took, with all that drives it.
 *
 * Returns FINE or SIGN_OPEN (solve CHANNELS, of those that reach the output, before `complete`). */
static integer move(const window *w)
{
    integer k = w->clock[TIME];
    if (w->clock[STARTED]) {
        if (!w->late) open_disturbance(w, k);
        open_channels(w, k, 0);
        advance(w, k);
        w->clock[TIME] = ++k;
    }
    return w->late && bound_channels(w, k, 1) ? SIGN_OPEN : FINE;
}

/* Whether the newest state, its inputs and the slack of its readings have bounds of use: no NaN, no infinity. */
static integer is_bounded(const window *w, integer k)
{
    const integer n = w->n, nu = w->nu, ny = w->ny, s = slot(w, k), before = slot(w, k - 1);
    for (integer j = 0; j < nu; j++)
        if (fabs(w->u[s * nu + j]) >= ENORMOUS || (k > 0 && fabs(w->u[before * nu + j]) >= ENORMOUS)) return 0;
    for (integer j = 0; j < n; j++)
        if (!(w->mag[s * n + j] < LARGEST)) return 0;
    return all_finite(w->slack + s * ny, ny);
}

/* Write the rows of the sample that `move` went to; 0 if the window has outgrown all bounds, and is of no more use. */
static integer complete(const window *w, double eps)
{
    const integer k = w->clock[TIME];
    if (w->late) {
        open_disturbance(w, k);
        open_channels(w, k, 1);
    }
    measure(w, k, eps);
    w->clock[STARTED] = 1;
    return is_bounded(w, k);
}

/* Tighten the bounds of those s whose sign is open, from program clock[NEXT] on; 0 if one needs a larger basis. */
static integer settle(const window *w, integer reaching, integer limit)
{
    const integer v = variables(w, w->clock[TIME]) * w->nq;
    for (integer *next = &w->clock[NEXT]; *next < 2 * w->nq; ++*next) {
        const integer q = *next / 2, is_open = w->s_lower[v + q] < 0.0 && 0.0 < w->s_upper[v + q];
        if (*next % 2 == 0 && (reaches_output(w, w->clock[TIME], q) != reaching || !is_open)) {
            ++*next; /* both programs of a channel, or none */
            continue;
        }
        if (solve_programs(w, CHANNELS, *next, *next + 1, limit).verdict == FULL) return 0;
    }
    w->clock[NEXT] = 0;
    return 1;
}

EXPORTED integer fdi_window_enter(void *block)
{
    window w;
    window_open(&w, block);
    return enter(&w);
}

EXPORTED integer fdi_window_move(void *block)
{
    window w;
    window_open(&w, block);
    return move(&w);
}

EXPORTED integer fdi_window_complete(void *block, double eps)
{
    window w;
    window_open(&w, block);
    return complete(&w, eps);
}

/* `fdi_window_take`, from the stage at which the window waits for room; found is what ARRIVAL says. */
integer take(const window *w, double eps, integer limit, answer *found)
{
    const answer full = {FULL, -1};
    integer *stage = &w->clock[STAGE], code = FINE;
    *found = (answer){UNDECIDED, -1};
    if (*stage == IDLE) {
        code = enter(w);
        if (code != FINE && code != SIGN_OPEN) return code;
        *stage = ENTERED;
        w->clock[NEXT] = code == SIGN_OPEN ? 0 : 2 * w->nq;
    }
    if (*stage == ENTERED) {
        if (!settle(w, 0, limit)) {
            *found = full;
            return FINE;
        }
        code = move(w);
        *stage = MOVED;
        w->clock[NEXT] = code == SIGN_OPEN ? 0 : 2 * w->nq;
    }
    if (*stage == MOVED) {
        if (!settle(w, 1, limit)) {
            *found = full;
            return FINE;
        }
        *stage = COMPLETED;
        if (!complete(w, eps)) return OUTGROWN;
    }
    *found = solve_programs(w, ARRIVAL, 0, 2 * w->nt, limit);
    if (found->verdict != FULL) *stage = IDLE;
    return code;
}

integer told(integer code, answer found) { return code + 8 * (found.verdict + 4 * (found.program + 1)); }

/* A whole sample in one call: `enter`, `move`, `complete`, CHANNELS where signs are open, and ARRIVAL.
 *
 * Returns what `enter` returns, or OUTGROWN, + 8 (verdict + 4 (program + 1)), as `fdi_window_solve`. If the verdict is
 * FULL the sample is half done: call again once the window has moved to a block with a larger K. */
EXPORTED integer fdi_window_take(void *block, double eps, integer limit)
{
    window w;
    window_open(&w, block);
    answer found;
    const integer code = take(&w, eps, limit, &found);
    return told(code, found);
}

/* Anchor an empty window at the arrival bounds h, with `count` extra rows (count, n) on the first state. */
EXPORTED void fdi_window_initialise(void *block, integer count, const double *rows, const double *lower,
                                    const double *upper)
{
    window w;
    window_open(&w, block);
    const integer n = w.n;
    for (integer q = 0; q < w.Q; q++) w.seen_base[q] = -1;
    for (integer i = 0; i < w.R; i++) clear_row(&w, i);
    anchor(&w);
    for (integer j = 0; j < n; j++) {
        w.psi[j * w.Z + j] = w.xr[j];
        w.frame[j * n + j] = 1.0;
    }
    for (integer r = 0; r < count; r++) {
        copy(w.row_x + r * n, rows + r * n, n);
        w.raw_lower[r] = lower[r];
        w.raw_upper[r] = upper[r];
        w.row_c[r] += isfinite(lower[r]) ? fabs(lower[r]) : 0.0;
        w.row_c[r] += isfinite(upper[r]) ? fabs(upper[r]) : 0.0;
        scale_arrival_row(&w, r, 0);
    }
}

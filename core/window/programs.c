/* The programs that a window is asked: is it empty, what bounds the arrival state, the newest state, a channel. */
#include "window.h"

enum { VERDICTS = 4 }; /* an answer in one number: verdict + VERDICTS (program + 1) */

/* Objective sign T_i x(base + block) over z; of a window that is not full yet, the newest state if it comes before. */
static objective arrival_cost(const window *w, integer i, double sign)
{
    const integer n = w->n, nv = w->nv, base = w->clock[BASE], target = least(base + w->block, w->clock[TIME]);
    const integer t = slot(w, target);
    double *costate = w->costate, *moved = w->column;
    objective at = {0.0, 0.0};
    for (integer r = 0; r < n; r++) {
        costate[r] = sign * w->T[i * n + r];
        at.constant += costate[r] * w->phi[t * n + r];
        at.rounding += fabs(costate[r]) * w->err[t * n + r];
    }
    fill(w->cost, 0.0, w->Z);
    for (integer k = target - 1; k >= base; k--) {
        const integer s = slot(w, k);
        const double *terms = w->terms + slot(w, k + 1) * n;
        double *cost = w->cost + n + variables(w, k) * nv;
        fill(moved, 0.0, n);
        for (integer r = 0; r < n; r++) {
            at.rounding += 2.0 * UNIT * (double)(n + 8) * fabs(costate[r]) * terms[r];
            add_multiple(cost, costate[r], w->inputs + (s * n + r) * nv, nv);
            add_multiple(moved, costate[r], w->A + (s * n + r) * n, n);
        }
        copy(costate, moved, n);
    }
    for (integer j = 0; j < n; j++) w->cost[j] = costate[j] * w->xr[j];
    return at;
}

/* Objective sign s of channel q over the state; the value at z = 0 has w's share. */
static objective channel_cost(const window *w, integer q, double sign)
{
    const integer n = w->n, k = w->clock[TIME], s = slot(w, k);
    const double *f = w->functional + (variables(w, k) * w->nq + q) * w->P;
    const known_terms part = known_part(w, k, q);
    objective at = {sign * part.centre + part.spread, 0.0};
    double magnitude = part.magnitude;
    fill(w->cost, 0.0, w->Z);
    for (integer r = 0; r < n; r++) {
        at.constant += sign * f[r] * w->phi[s * n + r];
        magnitude += fabs(f[r]) * w->mag[s * n + r];
        at.rounding += fabs(f[r]) * w->err[s * n + r];
        add_multiple(w->cost, sign * f[r], w->psi + r * w->Z, w->Z);
    }
    at.rounding += 2.0 * UNIT * (double)(n + w->nu + w->nw + 8) * magnitude;
    return at;
}

/* Objective sign direction'x of the newest state. */
static objective newest_cost(const window *w, const double *direction, double sign)
{
    const integer n = w->n, s = slot(w, w->clock[TIME]);
    objective at = {0.0, 0.0};
    fill(w->cost, 0.0, w->Z);
    for (integer i = 0; i < n; i++) {
        const double weight = sign * direction[i];
        if (weight == 0.0) continue;
        at.constant += weight * w->phi[s * n + i];
        at.rounding += fabs(weight) * (w->err[s * n + i] + 2.0 * UNIT * (double)(n + 8) * w->mag[s * n + i]);
        add_multiple(w->cost, weight, w->psi + i * w->Z, w->Z);
    }
    return at;
}

/* Any objective will do for a window of one sample, which is only asked whether it is empty. */
static objective no_cost(const window *w)
{
    fill(w->cost, 0.0, w->Z);
    w->cost[0] = 1.0;
    return (objective){0.0, 0.0};
}

static objective cost_of(const window *w, integer task, integer i, double sign)
{
    if (task == NEWEST) return newest_cost(w, w->T + i * w->n, sign);
    if (task == QUERY) return newest_cost(w, w->query, sign);
    if (task == CHANNELS) return channel_cost(w, i, sign);
    return w->clock[TIME] > w->clock[BASE] ? arrival_cost(w, i, sign) : no_cost(w);
}

/* First and last (excluded) arrival program of a sample.
 *
 * The 2 nt supports of the state at base + block are spread over the last `block` samples before the slide; each is an
 * outer bound by the data of its own sample. Before those, one program decides emptiness. */
static void arrival_programs(const window *w, integer *first, integer *last)
{
    const integer turn = w->clock[TIME] - w->clock[BASE] - (w->N - w->block + 1), count = 2 * w->nt;
    const integer share = (count + w->block - 1) / w->block;
    *first = turn < 0 ? 0 : least(turn * share, count - 1); /* at least one program: every sample is decided */
    *last = turn < 0 ? 1 : least(*first + share, count);
}

/* Keep an outer bound of the pair i (upper by side 0, lower by side 1). */
static void store_pair(double *lower, double *upper, integer i, integer side, double bound)
{
    if (side == 0)
        upper[i] = bound;
    else
        lower[i] = -bound;
}

static void store_bound(const window *w, integer task, integer program, double bound)
{
    const integer i = program / 2, side = program % 2;
    if (task == NEWEST) {
        store_pair(w->now_lower, w->now_upper, i, side, bound);
    } else if (task == QUERY) {
        w->answer[0] = bound;
    } else if (task == CHANNELS) {
        const integer at = variables(w, w->clock[TIME]) * w->nq + i;
        const double known = side == 0 ? w->s_upper[at] : -w->s_lower[at];
        store_pair(w->s_lower, w->s_upper, at, side, smaller(known, bound));
    } else if (w->clock[TIME] - w->clock[BASE] > w->N - w->block) {
        store_pair(w->new_lower, w->new_upper, i, side, bound);
    }
}

/* One program of a task, its bases numbered from `basis`; returns the outcome. */
static integer solve_program(const window *w, integer task, integer basis, integer program, integer limit)
{
    double value;
    const objective at = cost_of(w, task, program / 2, program % 2 == 0 ? 1.0 : -1.0);
    const integer outcome = maximise(w, basis + program, limit, &value);
    const double rounding = 4.0 * UNIT * (fabs(at.constant) + fabs(value));
    if (outcome != OVERFULL) store_bound(w, task, program, at.constant + value + at.rounding + rounding);
    return outcome;
}

/* The programs of a task go on from one that has to have a larger basis: those before it are not solved again, so that
 * the bits of an answer do not depend on when there was room. */
static void wait_for_room(const window *w, integer task, integer program, answer found)
{
    w->clock[WAITING] = task + 1;
    w->clock[PROGRAM] = program;
    w->clock[HAS_POINT] = found.verdict == CONSISTENT;
}

static void resume(const window *w, integer task, integer *start, answer *found)
{
    if (w->clock[WAITING] == task + 1) {
        *start = most(*start, w->clock[PROGRAM]);
        if (w->clock[HAS_POINT]) found->verdict = CONSISTENT;
    }
    w->clock[WAITING] = 0;
}

/* The programs of a task, numbers `start` to `stop` - 1: two a direction, upper bound first.
 *
 * ARRIVAL decides emptiness and, before a slide, bounds the state at base + block; NEWEST bounds the newest state in
 * the template's directions, QUERY in the one that was asked for; CHANNELS tightens the bounds of s that leave its
 * sign open. A program that is found empty ends them; its bound is stored all the same, for the proof may not hold.
 * One that needs a larger basis ends them too, and the same call goes on from it. */
answer solve_programs(const window *w, integer task, integer start, integer stop, integer limit)
{
    const integer v = variables(w, w->clock[TIME]) * w->nq, nt = w->nt, nq = w->nq;
    const integer bases[] = {0, 2 * nt, 4 * nt, 4 * nt + 2 * nq}, counts[] = {0, 2 * nt, 2 * nq, 1};
    integer begin = 0, count = counts[task], is_open = 0;
    answer found = {UNDECIDED, -1};
    if (task == ARRIVAL) arrival_programs(w, &begin, &count);
    resume(w, task, &start, &found);
    for (integer program = most(begin, start); program < least(stop, count); program++) {
        const integer i = program / 2, side = program % 2;
        if (task == CHANNELS) {
            if (side == 0 || program == start) /* both ends of an s that was open: its sign is a convention */
                is_open = w->s_lower[v + i] < 0.0 && (side == 1 || w->s_upper[v + i] > 0.0);
            if (!is_open) continue;
        }
        const integer outcome = solve_program(w, task, bases[task], program, limit);
        if (outcome == EMPTY) return (answer){EMPTY_CANDIDATE, program};
        if (outcome == OVERFULL) {
            wait_for_room(w, task, program, found);
            return (answer){FULL, program};
        }
        if (outcome == OPTIMAL) found.verdict = CONSISTENT;
    }
    if (task == ARRIVAL && w->clock[TIME] - w->clock[BASE] == w->N && stop >= count) w->clock[PENDING] = 1;
    return found;
}

/* `solve_programs`; returns verdict + 4 (program + 1). */
EXPORTED integer fdi_window_solve(void *block, integer task, integer start, integer stop, integer limit)
{
    window w;
    window_open(&w, block);
    const answer found = solve_programs(&w, task, start, stop, limit);
    return found.verdict + VERDICTS * (found.program + 1);
}

/* First and last (excluded) of the arrival programs that the newest sample calls for. */
EXPORTED void fdi_window_arrival_programs(void *block, integer *range)
{
    window w;
    window_open(&w, block);
    arrival_programs(&w, &range[0], &range[1]);
}

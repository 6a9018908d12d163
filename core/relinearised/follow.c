/* Samples of a nonlinear plant in a window, each linearised over the set that is known there.
 *
 * A window gives the set of a sample once it has read the sample, so the transition from it is written where the window
 * reads it at the next one. A box of the newest state is carried along: what the transition to it and its readings
 * leave. The window's programs bound the state besides, where that is worth their time. All about the plant is in the
 * user's units, all about the window in normal form; units, powers of two, lead from one to the other.
 */
#include "tape/plant.h"
#include "window/window.h"

/* Of a window: units of states, of the entries of a stack, of what is given of inputs and outputs; bounds of w and of
 * the state at all times, in normal form. */
#define UNITS(Y)                                                                                                     \
    Y(x, n) Y(stack, X *P) Y(per_u, nu) Y(per_y, ny) Y(w_low, nw) Y(w_high, nw) Y(physical_low, n) Y(physical_high, n)

/* The box of the newest state; rows and noise of its sample's linearisation, whose transition is not known yet, and of
 * the sample before. Scratch: what the window knows; what may come after the box and after the sample before. */
#define CARRIED(Y)                                                                                                   \
    Y(low, n) Y(high, n) Y(now, X *P) Y(now_noise, ny) Y(before, X *P) Y(before_noise, ny) Y(known_low, n)           \
    Y(known_high, n) Y(next_low, n) Y(next_high, n) Y(next, X *P)

static const double SMALL = 0x1p-6; /* of the noise, of what moves a state: such a remainder is worth no programs */

/* How samples end: the one after them is taken; it has no room for a basis of its transition, or of its box, which is
 * all that it lacks then; or there is no transition to it, or none but that, its output being not linearised. */
enum { TAKEN, WITHOUT_ROOM, BOX_WITHOUT_ROOM, NOT_MOVED, NOT_MEASURED };

typedef struct {
#define GIVEN(name, length) const double *name;
#define OWN(name, length) double *name;
    UNITS(GIVEN)
    CARRIED(OWN)
    const double *plant;
    double *scratch;
    integer limit;
} relinearised;

static relinearised opened(const window *w, const double *plant, const double *units, double *carried, double *scratch,
                           integer limit)
{
    const integer n = w->n, nu = w->nu, ny = w->ny, nw = w->nw, X = w->X, P = w->P;
    relinearised r = {.plant = plant, .scratch = scratch, .limit = limit};
#define PLACE_UNITS(name, length) r.name = units, units += length;
#define PLACE_CARRIED(name, length) r.name = carried, carried += length;
    UNITS(PLACE_UNITS)
    CARRIED(PLACE_CARRIED)
    return r;
}

/* Bounds of the newest state along the axes, within what is physical where they meet; 0 if a basis has no room. */
static int bound_newest(const window *w, const relinearised *r, double *low, double *high)
{
    answer found = {EMPTY_CANDIDATE, -1};
    while (found.verdict == EMPTY_CANDIDATE) /* of what no multipliers have proven empty every bound is asked for */
        found = solve_programs(w, NEWEST, found.program + 1, 2 * w->n, r->limit);
    if (found.verdict == FULL) return 0;
    for (integer j = 0; j < w->n; j++) {
        const double lower = larger(w->now_lower[j], r->physical_low[j]);
        const double upper = smaller(w->now_upper[j], r->physical_high[j]);
        const int meets = lower <= upper;
        low[j] = (meets ? lower : w->now_lower[j]) * r->x[j];
        high[j] = (meets ? upper : w->now_upper[j]) * r->x[j];
    }
    return 1;
}

/* The same for the transition from it. What was asked for at samples that had none of these programs leaves no trace:
 * bases go on from those of the sample before, or from nothing. */
static int bound_for_transition(const window *w, const relinearised *r)
{
    const integer time = w->clock[TIME];
    if (w->clock[LINEARISED] != time)
        for (integer q = 0; q < 2 * w->n; q++) forget_basis(w, 2 * w->nt + q);
    w->clock[LINEARISED] = time;
    if (!bound_newest(w, r, r->known_low, r->known_high)) return 0;
    w->clock[LINEARISED] = time + 1;
    return 1;
}

/* Whether what the transition from sample k leaves out is small beside all else that moves the state. */
static int is_transition_sharp(const window *w, const relinearised *r, integer k)
{
    const integer n = w->n, nw = w->nw;
    const double *row = w->stack + slot(w, k) * w->X * w->P + n + w->nu + 1;
    int is = 1;
    for (integer i = 0; i < n; i++, row += w->P) {
        double moved = 0.0;
        for (integer j = 0; j < nw; j++) moved += fabs(row[j]) * (r->w_high[j] - r->w_low[j]);
        const integer own = nw - n + i;
        is &= fabs(row[own]) * (r->w_high[own] - r->w_low[own]) <= SMALL * moved;
    }
    return is;
}

/* The same of the newest sample's output beside its noise. */
static int is_output_sharp(const window *w, const relinearised *r)
{
    int is = 1;
    plant p;
    plant_open(&p, r->plant, (Memory){r->scratch, 0});
    for (integer j = 0; j < w->ny; j++) is &= r->now_noise[j] <= (1.0 + SMALL) * p.noise[j];
    return is;
}

/* The transition from what is known of the newest sample; whether there is one. */
static int is_moved(const window *w, const relinearised *r, const double *u, double T, outcome *why)
{
    const integer size = w->X * w->P;
    copy(r->next_low, r->low, w->n);
    copy(r->next_high, r->high, w->n);
    copy(r->next, r->now, size);
    if (fdi_plant_moved(r->plant, r->scratch, r->known_low, r->known_high, r->next_low, r->next_high, u, T, r->next, why))
        return 0;
    double *stack = w->stack + slot(w, w->clock[TIME]) * size;
    for (integer j = 0; j < w->n * w->P; j++) stack[j] = r->next[j] * r->stack[j];
    return 1;
}

/* The same without programs; whether it is there and sharp, so that they would leave the window's sets as they are.
 *
 * It is tried where the last one was: not where readings tell of w more than its bounds do. */
static int is_moved_sharply(const window *w, const relinearised *r, const double *u, double T, outcome *why)
{
    const integer time = w->clock[TIME];
    copy(r->known_low, r->low, w->n);
    copy(r->known_high, r->high, w->n);
    return !w->late && time > w->clock[BASE] && is_transition_sharp(w, r, time - 1) && is_output_sharp(w, r) &&
           is_moved(w, r, u, T, why) && is_transition_sharp(w, r, time);
}

/* The transition from the newest sample, over a time T, where the window reads it. */
static integer move(const window *w, const relinearised *r, const double *u, double T, outcome *why)
{
    const integer n = w->n;
    if (!is_moved_sharply(w, r, u, T, why)) {
        if (!bound_for_transition(w, r)) return WITHOUT_ROOM;
        if (!is_moved(w, r, u, T, why)) return NOT_MOVED;
    }
    copy(r->low, r->next_low, n);
    copy(r->high, r->next_high, n);
    copy(r->before, r->next, w->X * w->P);
    copy(r->before_noise, r->now_noise, w->ny);
    return TAKEN;
}

static double in_normal_form(double value, double per_unit)
{
    return clipped(value * per_unit, -ENORMOUS, ENORMOUS);
}

/* The sample that `now` is of, where the window reads it. */
static void hand_over(const window *w, const relinearised *r, const double *u, const double *u_next, const double *y)
{
    for (integer j = 0; j < w->nu; j++) {
        w->in_u[j] = in_normal_form(u[j], r->per_u[j]);
        w->in_u_next[j] = in_normal_form(u_next[j], r->per_u[j]);
    }
    for (integer j = 0; j < w->ny; j++) {
        w->in_y[j] = in_normal_form(y[j], r->per_y[j]);
        w->in_noise[j] = r->now_noise[j] * r->per_y[j];
    }
    for (integer j = 0; j < w->X * w->P; j++) w->in_stack[j] = r->now[j] * r->stack[j];
    copy(w->in_w_lower, r->w_low, w->nw);
    copy(w->in_w_upper, r->w_high, w->nw);
}

/* The output of the next sample, and all of it where the window reads it. */
static integer read(const window *w, const relinearised *r, const double *u, const double *u_next, const double *y,
                    outcome *why)
{
    copy(r->next_low, r->low, w->n);
    copy(r->next_high, r->high, w->n);
    if (fdi_plant_measured(r->plant, r->scratch, r->next_low, r->next_high, y, u_next, r->now + w->n * w->P,
                           r->now_noise, why))
        return NOT_MEASURED;
    copy(r->low, r->next_low, w->n);
    copy(r->high, r->next_high, w->n);
    hand_over(w, r, u, u_next, y);
    return TAKEN;
}

/* The next arrival set, once it is known, within what is physical; 0 where they have nothing in common. */
static int cut_arrival(const window *w, const relinearised *r)
{
    if (!w->clock[PENDING]) return 1;
    for (integer j = 0; j < w->n; j++)
        if (!(larger(w->new_lower[j], r->physical_low[j]) <= smaller(w->new_upper[j], r->physical_high[j]))) return 0;
    for (integer j = 0; j < w->n; j++) {
        w->new_lower[j] = larger(w->new_lower[j], r->physical_low[j]);
        w->new_upper[j] = smaller(w->new_upper[j], r->physical_high[j]);
    }
    return 1;
}

/* `move`, of a sample that a caller takes by himself; u (nu,) in the user's units. */
EXPORTED integer fdi_relinearised_move(void *block, const double *plant, const double *units, double *carried,
                                       double *scratch, const double *u, double T, integer limit, outcome *why)
{
    window w;
    window_open(&w, block);
    const relinearised r = opened(&w, plant, units, carried, scratch, limit);
    return move(&w, &r, u, T, why);
}

/* Take samples 0, 1, ... < count until one is not simply consistent, of which the caller concludes the rest.
 *
 * In the user's units: u (count, nu), what drives the transition to each sample, which takes T (count,) seconds, u_next
 * its own input, y (count, ny); boxes (count, 2, n) or NULL, filled for the samples that are consistent. Returns how
 * many those are. result: how they end, and what `fdi_window_take` says of the sample after them, if it is taken, which
 * may need more room; why that sample is not linearised, if it is not. */
EXPORTED integer fdi_relinearised_follow(void *block, const double *plant, const double *units, double *carried,
                                         double *scratch, integer count, const double *u, const double *u_next,
                                         const double *y, const double *T, double eps, integer limit, double *boxes,
                                         integer *result, outcome *why)
{
    window w;
    window_open(&w, block);
    const integer n = w.n, nu = w.nu;
    const relinearised r = opened(&w, plant, units, carried, scratch, limit);
    answer found;
    for (integer i = 0; i < count; i++) {
        result[0] = move(&w, &r, u + i * nu, T[i], why);
        if (result[0] == TAKEN) result[0] = read(&w, &r, u + i * nu, u_next + i * nu, y + i * w.ny, why);
        if (result[0] != TAKEN) return i;
        const integer code = take(&w, eps, limit, &found);
        result[1] = told(code, found);
        if ((code != FINE && code != SIGN_OPEN) || found.verdict != CONSISTENT || !cut_arrival(&w, &r)) return i;
        if (boxes && !bound_newest(&w, &r, boxes + 2 * i * n, boxes + (2 * i + 1) * n)) {
            result[0] = BOX_WITHOUT_ROOM;
            return i;
        }
    }
    return count;
}

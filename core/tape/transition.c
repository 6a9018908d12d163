/* A transition: from dx/dt = f(x, w, u) over a box of states to x(T) in A x + a + E w + [-R, R].
 *
 * Conservative linearisation (Althoff, Stursberg and Buss, CDC 2008) with secants for Jacobians: substep by substep an
 * enclosure, linear forms over it, an enclosed exponential, and the remainder carried through the integral of exp(M t).
 *
 * A state whose slope is too steep for the shortest substep (a root near zero, a fast lag) has no line: x_i is anywhere
 * in its bounds at the end, and what it adds to the others is in their remainder.
 */
#include "tape/matrix_exponential.h"
#include "tape/plant.h"

#include "powers.h"
#include "vectors.h"

static const integer FINEST = 4096; /* substeps are multiples of so small a part of the sample, in proofs too */
static const integer MOST_SUBSTEPS = 200;
static const integer BEFORE_FLAT = 16;  /* substeps that states have which no number of substeps would give lines */
static const double WORTH_ANOTHER = 0.1; /* of the width of the set: a remainder beyond it is worth a second substep */

static transition transition_in(Memory *memory, const plant *p)
{
    const integer n = p->n;
    transition t = {doubles(memory, n * n), doubles(memory, n), doubles(memory, n * p->nw), doubles(memory, n),
                    span_in(memory, n), span_in(memory, n), span_in(memory, n), 0};
    return t;
}

/* The dynamics within a substep, x in `start`: dx/dt in J x + W w + q + [-drive, drive], and bounds of what it has; for
 * states whose `steep` is 0, the others having none. */
typedef struct { double *J, *gain_w, *q, *drive, *most, *unit, *steep; } local;

static local local_in(Memory *memory, const plant *p)
{
    const integer n = p->n;
    local d;
    double **parts[] = {&d.J, &d.gain_w, &d.q, &d.drive, &d.most, &d.unit, &d.steep};
    const integer lengths[] = {n * n, n * p->nw, n, n, n, n, n};
    for (int i = 0; i < 7; i++) *parts[i] = doubles(memory, lengths[i]);
    return d;
}

static double largest_w(const plant *p, integer j) { return larger(fabs(p->w_low[j]), fabs(p->w_high[j])); }
static double width_w(const plant *p, integer j) { return p->w_high[j] - p->w_low[j]; }
static double rounding_of(const plant *p) { return (double)(p->n + p->nw + 8) * ROUNDING; }

static double power_near(double value) /* 2^round(log2 value) */
{
    const integer e = exponent_of(value);
    return power_of_two(times_power(value, -e) < 0.70710678118654757 ? e - 1 : e);
}

/* The sum of row i of |D^-1 J D| h, D being the units. */
static double scaled_row(const local *d, integer i, integer n, double h)
{
    double total = 0.0;
    for (integer j = 0; j < n; j++) total += fabs(d->J[i * n + j]) * d->unit[j] / d->unit[i];
    return total * h;
}

/* Sets J and units, powers of two near what the box and J move within h, and which states are steep. */
static void take_slopes(const plant *p, double h, double *moved, local *d)
{
    const integer n = p->n;
    double *reach = d->q;
    for (integer i = 0; i < n; i++) {
        copy(d->J + i * n, row_of(&p->f, i)->g, n);
        reach[i] = p->z.high[i] - p->z.low[i] + 1e-12 * largest_of(p->z, i) + 1e-100;
    }
    for (integer i = 0; i < n; i++) {
        double total = 0.0;
        for (integer j = 0; j < n; j++) total += fabs(d->J[i * n + j]) * reach[j];
        moved[i] = 4.0 * h * total;
    }
    for (integer i = 0; i < n; i++) {
        double total = 0.0;
        for (integer j = 0; j < n; j++) total += fabs(d->J[i * n + j]) * moved[j];
        d->unit[i] = power_near(reach[i] + moved[i] + 2.0 * h * total);
    }
    for (integer i = 0; i < n; i++) d->steep[i] = scaled_row(d, i, n, h) <= 1.0 ? 0.0 : 1.0;
}

/* Whether lines over a substep of such a size are worth no shorter one: no state is steep, or those that are would be in
 * any of MOST_SUBSTEPS. */
static int is_short_enough(const plant *p, const local *d, double T, integer size)
{
    int is = 1;
    for (integer i = 0; i < p->n; i++) {
        const int pulls = d->J[i * p->n + i] * T < -(double)MOST_SUBSTEPS && FINEST / size >= BEFORE_FLAT;
        is &= d->steep[i] == 0.0 || pulls || FINEST / size > MOST_SUBSTEPS;
    }
    return is;
}

/* Leaves what steep states are, and what they add to others, out of J; returns the norm of the rest, at most 1. */
static double flatten(const plant *p, double h, local *d)
{
    const integer n = p->n;
    double norm = 0.0;
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++)
            if (d->steep[i] != 0.0 || d->steep[j] != 0.0) d->J[i * n + j] = 0.0;
    for (integer i = 0; i < n; i++) norm = larger(scaled_row(d, i, n, h), norm);
    return norm;
}

/* How many units the largest state is away from zero. */
static double reach_in_units(const plant *p, const local *d)
{
    double reach = 0.0;
    for (integer i = 0; i < p->n; i++) reach = larger(largest_of(p->z, i) / d->unit[i], reach);
    return reach;
}

static void take_local(const plant *p, local *d)
{
    const integer n = p->n, nw = p->nw;
    const double *c = p->f.centre, rounding = rounding_of(p);
    for (integer i = 0; i < n; i++) {
        const form *f = row_of(&p->f, i);
        const double half = 0.5 * (f->rest.low + f->rest.high), rest = 0.5 * (f->rest.high - f->rest.low);
        double size = fabs(f->k) + fabs(f->rest.low) + fabs(f->rest.high), q = f->k + half, moving = 0.0, most = 0.0;
        if (d->steep[i] != 0.0) {
            d->q[i] = d->drive[i] = d->most[i] = 0.0;
            continue;
        }
        for (integer j = 0; j < n; j++) {
            size += fabs(f->g[j] * c[j]);
            if (d->steep[j] != 0.0)
                moving += fabs(f->g[j]) * (0.5 * (p->z.high[j] - p->z.low[j]) * (1.0 + EPS));
            else
                q -= f->g[j] * c[j];
        }
        for (integer j = 0; j < nw; j++) {
            const double g = f->g[n + j];
            q -= g * c[n + j] * p->held[j]; /* what varies stays about its centre */
            size += fabs(g * c[n + j]);
            moving += fabs(g) * ((1.0 - p->held[j]) * width_w(p, j) * 0.5 * (1.0 + EPS));
            most += fabs(g) * largest_w(p, j);
        }
        d->q[i] = q, d->drive[i] = rest + rounding * size + moving, d->most[i] = most + size;
    }
}

/* Bounds of x+: what a transition says, what is known besides (in its box), and what is physical. */
static int take_newest(const plant *p, transition *t, outcome *found)
{
    const integer n = p->n, nw = p->nw;
    for (integer i = 0; i < n; i++) {
        double y = t->a[i], spread = t->R[i], terms = fabs(t->a[i]);
        for (integer j = 0; j < n; j++) {
            const double A = t->A[i * n + j], low = t->start.low[j], high = t->start.high[j];
            y += A * (0.5 * low + 0.5 * high);
            spread += fabs(A) * (0.5 * (high - low));
            terms += fabs(A) * largest_of(t->start, j);
        }
        for (integer j = 0; j < nw; j++) {
            const double E = t->E[i * nw + j];
            y += E * (0.5 * p->w_low[j] + 0.5 * p->w_high[j]);
            spread += fabs(E) * (0.5 * width_w(p, j));
            terms += fabs(E) * largest_w(p, j);
        }
        spread += 2.0 * rounding_of(p) * (terms + spread);
        t->box.low[i] = larger(y - spread, t->box.low[i]);
        t->box.high[i] = smaller(y + spread, t->box.high[i]);
    }
    cut_by_physical(p, t->box);
    for (integer i = 0; i < n; i++)
        if (!(t->box.low[i] <= t->box.high[i])) {
            *found = (outcome){.code = NOT_PHYSICAL, .row = i};
            return 0;
        }
    return 1;
}

/* How far a state whose slope is `own` moves within h at most, where it is moved by `rate` at its own end: v(h) for
 * v' <= own v + rate and v(0) <= 0, with 1 - exp(-s) between s / (1 + s) and 1 for s = -own h. */
static double pulled_back(double own, double rate, double h)
{
    const double s = -own * h;
    if (!(s > 0.0)) return INFINITY;
    return rate > 0.0 ? rate * smaller(h, 1.0 / -own) : rate * (h / (1.0 + s));
}

/* A state that has no line: anywhere in its bounds at the end of a substep, which began in p->before. */
static void take_anywhere(const plant *p, double h, integer i, transition *t)
{
    const ends at = rates_at_faces(p, i);
    const double own = row_of(&p->f, i)->g[i], low = p->before.low[i], high = p->before.high[i];
    const double up = high + pulled_back(own, at.high, h), down = low - pulled_back(own, -at.low, h);
    const double room_up = 4.0 * ROUNDING * (fabs(high) + fabs(up - high)) + TINIEST;
    const double room_down = 4.0 * ROUNDING * (fabs(low) + fabs(low - down)) + TINIEST;
    t->box.high[i] = smaller(up + room_up, smaller(t->box.high[i], p->z.high[i]));
    t->box.low[i] = larger(down - room_down, larger(t->box.low[i], p->z.low[i]));
    fill(t->A + i * p->n, 0.0, p->n);
    fill(t->E + i * p->nw, 0.0, p->nw);
    t->a[i] = 0.5 * t->box.low[i] + 0.5 * t->box.high[i];
    t->R[i] = 0.5 * (t->box.high[i] - t->box.low[i]) + 2.0 * ROUNDING * largest_of(t->box, i) + TINIEST;
}

/* The transition before, `old`, and one more substep over which the state stays in z. */
static int advance(const plant *p, const transition *old, const local *d, const exponential *e, double h,
                   transition *t, outcome *found)
{
    const integer n = p->n, nw = p->nw;
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < nw; j++)
            d->gain_w[i * nw + j] = d->steep[i] != 0.0 ? 0.0 : row_of(&p->f, i)->g[n + j] * p->held[j];
    for (integer i = 0; i < n; i++) {
        double *A = t->A + i * n, *E = t->E + i * nw, a = 0.0, R = 0.0, terms = 0.0;
        fill(A, 0.0, n);
        fill(E, 0.0, nw);
        for (integer j = 0; j < n; j++) {
            const integer ij = i * n + j;
            const double move = e->move[ij], gain = e->gain[ij];
            double size = fabs(old->a[j]);
            for (integer l = 0; l < n; l++) size += fabs(old->A[j * n + l]) * largest_of(old->start, l);
            for (integer l = 0; l < nw; l++) size += fabs(old->E[j * nw + l]) * largest_w(p, l);
            add_multiple(A, move, old->A + j * n, n);
            add_multiple(E, move, old->E + j * nw, nw);
            add_multiple(E, gain, d->gain_w + j * nw, nw);
            a += move * old->a[j] + gain * d->q[j];
            R += fabs(move) * old->R[j] + e->carried[ij] * d->drive[j];
            R += e->move_error[ij] * largest_of(p->z, j) + e->gain_error[ij] * d->most[j];
            terms += fabs(move) * size + fabs(gain) * d->most[j];
        }
        t->a[i] = a, t->R[i] = R + 2.0 * rounding_of(p) * (terms + R) + TINIEST;
    }
    for (integer i = 0; i < n; i++) {
        const double low = p->rate.low[i], high = p->rate.high[i];
        const double room = 2.0 * ROUNDING * (largest_of(p->z, i) + h * larger(fabs(low), fabs(high)));
        t->box.low[i] = old->box.low[i] + h * low - room;
        t->box.high[i] = old->box.high[i] + h * high + room;
        t->within.low[i] = smaller(old->within.low[i], p->z.low[i]);
        t->within.high[i] = larger(old->within.high[i], p->z.high[i]);
        if (d->steep[i] != 0.0) take_anywhere(p, h, i, t);
    }
    t->start = old->start, t->substeps = old->substeps + 1;
    return take_newest(p, t, found);
}

static int is_valid(const plant *p, span x, outcome *found)
{
    for (integer i = 0; i < p->n; i++)
        if (!(x.low[i] >= p->valid_low[i] && x.high[i] <= p->valid_high[i])) {
            *found = (outcome){.code = OUTSIDE_VALID, .row = i, .low = x.low[i], .high = x.high[i]};
            return 0;
        }
    return 1;
}

static void stand_still(const plant *p, transition *t)
{
    const integer n = p->n;
    fill(t->A, 0.0, n * n), fill(t->a, 0.0, n), fill(t->E, 0.0, n * p->nw), fill(t->R, 0.0, n);
    for (integer i = 0; i < n; i++) t->A[i * n + i] = 1.0;
    span_copy(t->box, t->start, n);
    span_copy(t->within, t->start, n);
    t->substeps = 0;
}

/* The substep that is the next of a path: its size, the box that it begins in, and the one that it keeps to. */
static void note_substep(const plant *p, integer at, integer size)
{
    if (at >= p->room) return;
    const double *ends[] = {p->before.low, p->before.high, p->z.low, p->z.high};
    double *noted = p->path + at * (1 + 4 * p->n);
    *noted++ = (double)size;
    for (int i = 0; i < 4; i++) copy(noted + i * p->n, ends[i], p->n);
}

/* Over a time T, in at least so many substeps (a power of two), from t->start; `other` is room for another. */
static int move(plant *p, double T, integer least_substeps, transition *t, transition *other, Memory scratch,
                outcome *found)
{
    local d = local_in(&scratch, p);
    exponential e = exponential_in(&scratch, p->n);
    integer done = 0, size = FINEST / least_substeps;
    transition *now = t, *next = other;
    outcome why = {.code = NOT_ENCLOSED};
    stand_still(p, now);
    while (done < FINEST) {
        const double h = T * ((double)size / (double)FINEST); /* exact: a power of two */
        span_copy(p->before, now->box, p->n);
        const int is_enclosed = plant_enclose(p, h, &why);
        if (is_enclosed) take_slopes(p, h, d.drive, &d);
        if (is_enclosed && is_short_enough(p, &d, T, size)) {
            if (!is_valid(p, p->z, found)) return 0;
            const double norm = flatten(p, h, &d);
            take_local(p, &d);
            exponential_take(p->n, d.J, h, d.unit, norm, reach_in_units(p, &d), scratch, &e);
            note_substep(p, now->substeps, size);
            if (!advance(p, now, &d, &e, h, next, found)) return 0;
            transition *last = now;
            now = next, next = last, done += size;
        } else if (size == 1 || (FINEST - done) / size > MOST_SUBSTEPS) {
            *found = why;
            found->code = TOO_MANY_SUBSTEPS;
            return 0;
        } else {
            size /= 2;
        }
    }
    if (now != t) {
        const transition swap = *t;
        *t = *other, *other = swap;
    }
    return 1;
}

static int is_worth_another(const plant *p, const transition *t)
{
    int is = 0;
    for (integer i = 0; i < p->n; i++) is |= t->R[i] > WORTH_ANOTHER * (t->box.high[i] - t->box.low[i]);
    return is && t->substeps == 1;
}

static int is_nowhere_wider(const plant *p, const transition *t, const transition *than)
{
    int is = 1;
    for (integer i = 0; i < p->n; i++) is &= t->R[i] <= than->R[i];
    return is;
}

/* Of a plant in discrete time, x+ = f(x, w, u). */
static int map(plant *p, transition *t, outcome *found)
{
    const integer n = p->n, nw = p->nw;
    if (!is_valid(p, t->start, found)) return 0;
    span_copy(p->z, t->start, n);
    if (!plant_forms(p, found)) return 0;
    const double *c = p->f.centre;
    for (integer i = 0; i < n; i++) {
        const form *f = row_of(&p->f, i);
        double a = f->k + 0.5 * (f->rest.low + f->rest.high);
        double size = fabs(f->k) + fabs(f->rest.low) + fabs(f->rest.high);
        for (integer j = 0; j < n + nw; j++) a -= f->g[j] * c[j], size += 2.0 * fabs(f->g[j] * c[j]);
        copy(t->A + i * n, f->g, n);
        copy(t->E + i * nw, f->g + n, nw);
        t->a[i] = a;
        t->R[i] = 0.5 * (f->rest.high - f->rest.low) + rounding_of(p) * size + TINIEST;
        t->box.low[i] = f->range.low, t->box.high[i] = f->range.high;
    }
    span_copy(t->within, t->start, n);
    t->substeps = 1;
    return take_newest(p, t, found);
}

/* The narrower one of one substep and two, where the remainder of one is large. */
static int move_well(plant *p, double T, transition *t, transition *other, transition *finer, Memory scratch,
                     outcome *found)
{
    outcome ignored;
    if (!move(p, T, 1, t, other, scratch, found)) return 0;
    if (!is_worth_another(p, t)) return 1;
    finer->start = t->start;
    if (move(p, T, 2, finer, other, scratch, &ignored) && is_nowhere_wider(p, finer, t)) {
        const transition swap = *t;
        *t = *finer, *finer = swap;
    }
    return 1;
}

static void give(const plant *p, const transition *t, double *result)
{
    const integer n = p->n;
    const double *parts[] = {t->A, t->a, t->E, t->R, t->box.low, t->box.high, t->within.low, t->within.high};
    const integer lengths[] = {n * n, n, n * p->nw, n, n, n, n, n};
    for (int i = 0; i < 8; i++) {
        copy(result, parts[i], lengths[i]);
        result += lengths[i];
    }
}

static transition all_in(plant *p, transition *other, transition *finer)
{
    transition t = transition_in(&p->rest, p);
    *other = transition_in(&p->rest, p);
    *finer = transition_in(&p->rest, p);
    return t;
}

/* Doubles of scratch that the calls on a plant need. */
EXPORTED integer fdi_plant_room(const double *block)
{
    plant p;
    transition other, finer;
    plant_open(&p, block, (Memory){NULL, 0});
    all_in(&p, &other, &finer);
    local_in(&p.rest, &p);
    exponential_in(&p.rest, p.n);
    return p.rest.used + fdi_exponential_room(p.n) + p.ny * (p.n + p.nw + 3); /* the last, what a measurement needs */
}

/* Over a time T from t->start, in the way that the plant has; as what `move` returns. */
static int take(plant *p, double T, transition *t, transition *other, transition *finer, outcome *found)
{
    cut_by_physical(p, t->start);
    if (!(p->continuous ? move_well(p, T, t, other, finer, p->rest, found) : map(p, t, found))) return 0;
    for (integer i = 0; i < p->n; i++)
        if (!(t->R[i] <= p->largest[i])) {
            *found = (outcome){.code = TOO_WIDE, .row = i};
            return 0;
        }
    return 1;
}

/* Into the rows [A, 0, a, E, diag R] of a sample's linearisation, whose zeros are there, in few digits. */
static void give_rows(const plant *p, const transition *t, double *rows)
{
    const integer n = p->n, nw = p->nw, at = n + p->nu;
    for (integer i = 0; i < n; i++, rows += at + 1 + nw + n) {
        shorten_row(p, t->start, t->A + i * n, t->E + i * nw, t->a + i, t->R + i);
        copy(rows, t->A + i * n, n);
        rows[at] = t->a[i];
        copy(rows + at + 1, t->E + i * nw, nw);
        rows[at + 1 + nw + i] = t->R[i];
    }
}

/* The transition over a time T of all states between low and high (n): A, a, E, R, the bounds of x+ and of the state on
 * its way in `result`, in this order. Returns its substeps, or minus the code of what came of it. */
EXPORTED integer fdi_plant_transition(const double *block, double *scratch, const double *low, const double *high,
                                      const double *u, double T, double *result, outcome *found)
{
    plant p;
    transition other, finer;
    plant_open(&p, block, (Memory){scratch, 0});
    transition t = all_in(&p, &other, &finer);
    plant_hold(&p, u);
    copy(t.start.low, low, p.n);
    copy(t.start.high, high, p.n);
    if (!take(&p, T, &t, &other, &finer, found)) return -found->code;
    give(&p, &t, result);
    return t.substeps;
}

/* The substeps of the transition of these states that has so many: parts of FINEST of the sample, and the boxes (2, n) that
 * each begins in and keeps to, as rows of `path`. Returns whether there is one. */
EXPORTED integer fdi_plant_path(const double *block, double *scratch, const double *low, const double *high,
                                const double *u, double T, integer substeps, double *path)
{
    plant p;
    transition other, finer;
    outcome ignored;
    plant_open(&p, block, (Memory){scratch, 0});
    transition t = all_in(&p, &other, &finer);
    plant_hold(&p, u);
    p.path = path, p.room = substeps;
    for (integer least = 1; least <= 2; least++) {
        copy(t.start.low, low, p.n);
        copy(t.start.high, high, p.n);
        cut_by_physical(&p, t.start);
        if (move(&p, T, least, &t, &other, p.rest, &ignored) && t.substeps == substeps) return 1;
    }
    return 0;
}

/* The same from the states that are known (n) in two ways, where these have a common one, else from the first: only the
 * window's programs raise an alarm. The state's rows of a linearisation (n, n + nu + 1 + nw + n), and bounds of x+ in the place
 * of the second. Returns 0, or the code of what came of it. */
EXPORTED integer fdi_plant_moved(const double *block, double *scratch, const double *known_low,
                                 const double *known_high, double *low, double *high, const double *u, double T,
                                 double *rows, outcome *found)
{
    plant p;
    transition other, finer;
    plant_open(&p, block, (Memory){scratch, 0});
    transition t = all_in(&p, &other, &finer);
    int meets = 1;
    plant_hold(&p, u);
    for (integer i = 0; i < p.n; i++) {
        t.start.low[i] = larger(known_low[i], low[i]), t.start.high[i] = smaller(known_high[i], high[i]);
        meets &= t.start.low[i] <= t.start.high[i];
    }
    if (!meets) {
        copy(t.start.low, known_low, p.n);
        copy(t.start.high, known_high, p.n);
    }
    if (!take(&p, T, &t, &other, &finer, found)) return found->code;
    give_rows(&p, &t, rows);
    copy(low, t.box.low, p.n);
    copy(high, t.box.high, p.n);
    return 0;
}

/* A measurement over a box of states: h(x, w, u) in C x + c + F w + [-R, R], and what it leaves of the box. */
#include "tape/plant.h"

#include "powers.h"
#include "vectors.h"

static const double BLUNT = 1e-3;     /* of the noise: a remainder beyond is worth a linearisation over what is left */
static const double WORTHWHILE = 0.8; /* of a remainder that one more leaves, and yet another is worth it */
static const integer CUTS = 10;

typedef struct { double *C, *c, *F, *R; } output;

static output output_at(const plant *p, double *result)
{
    output o = {result, NULL, NULL, NULL};
    o.c = o.C + p->ny * p->n;
    o.F = o.c + p->ny;
    o.R = o.F + p->ny * p->nw;
    return o;
}

/* Over the states in z; F has only what is held: what varies need not be the state's w. */
static int take_output(plant *p, output *o, outcome *found)
{
    const integer n = p->n, nw = p->nw;
    refusal why;
    if (!tape_forms(&p->h, p->z.low, p->z.high, &why)) {
        *found = (outcome){.code = NOT_ENCLOSED, .why = NO_RANGE, .row = why.row, .reason = why.why, .op = why.op};
        return 0;
    }
    for (integer i = 0; i < p->ny; i++) {
        const form *f = row_of(&p->h, i);
        double size = fabs(f->k) + fabs(f->rest.low) + fabs(f->rest.high), c = f->k + middle(f->rest);
        double R = 0.5 * (f->rest.high - f->rest.low);
        for (integer j = 0; j < n; j++) {
            o->C[i * n + j] = f->g[j];
            c -= f->g[j] * p->h.centre[j];
            size += 2.0 * fabs(f->g[j]) * largest_of(p->z, j);
        }
        for (integer j = 0; j < nw; j++) {
            const double g = f->g[n + j], F = g * p->held[j];
            o->F[i * nw + j] = F;
            c -= F * p->h.centre[n + j];
            size += 2.0 * fabs(g) * larger(fabs(p->w_low[j]), fabs(p->w_high[j]));
            R += fabs(g - F) * (0.5 * (p->w_high[j] - p->w_low[j]));
        }
        o->c[i] = c, o->R[i] = R + (double)(n + nw + 8) * ROUNDING * size;
    }
    return 1;
}

/* Cuts coordinate j of the box z by low <= C x <= high. */
static int cut_coordinate(const plant *p, const double *C, integer j, double low, double high)
{
    for (integer l = 0; l < p->n; l++) {
        const double first = C[l] * p->z.low[l], last = C[l] * p->z.high[l];
        if (l != j) low -= larger(first, last), high -= smaller(first, last);
    }
    const double first = smaller(low / C[j], high / C[j]), last = larger(low / C[j], high / C[j]);
    p->z.low[j] = larger(first - 4.0 * ROUNDING * fabs(first), p->z.low[j]);
    p->z.high[j] = smaller(last + 4.0 * ROUNDING * fabs(last), p->z.high[j]);
    return p->z.low[j] <= p->z.high[j];
}

/* Cuts the box z by one reading; 0 where nothing is left, which a program has to decide. */
static int cut_by_row(const plant *p, const output *o, integer i, double y)
{
    const integer n = p->n, nw = p->nw;
    const double *C = o->C + i * n, *F = o->F + i * nw;
    double c = o->c[i], room = p->noise[i] + o->R[i], size = fabs(c);
    for (integer j = 0; j < nw; j++) {
        c += F[j] * (0.5 * p->w_low[j] + 0.5 * p->w_high[j]);
        room += fabs(F[j]) * (0.5 * (p->w_high[j] - p->w_low[j]));
        size += fabs(F[j]) * larger(fabs(p->w_low[j]), fabs(p->w_high[j]));
    }
    for (integer j = 0; j < n; j++) size += fabs(C[j]) * largest_of(p->z, j);
    room += 4.0 * (double)(n + nw + 4) * ROUNDING * (size + room + fabs(y));
    for (integer j = 0; j < n; j++)
        if (C[j] != 0.0 && !cut_coordinate(p, C, j, y - c - room, y - c + room)) return 0;
    return 1;
}

static int cut_by_readings(const plant *p, const output *o, const double *y)
{
    for (integer i = 0; i < p->ny; i++)
        if (y[i] == y[i] && !cut_by_row(p, o, i, y[i])) return 0;
    return 1;
}

/* Whether the remainder blurs a reading, and is less than the one before, which it becomes. */
static int is_worth_another(const plant *p, const output *o, double *before)
{
    int is = 0;
    for (integer i = 0; i < p->ny; i++) {
        is |= o->R[i] > BLUNT * p->noise[i] && o->R[i] < WORTHWHILE * before[i];
        before[i] = o->R[i];
    }
    return is;
}

/* h over the states between low and high (n): C, c, F and R in `result`, in this order. Returns whether it has none. */
EXPORTED integer fdi_plant_output(const double *block, double *scratch, const double *low, const double *high,
                                  const double *u, double *result, outcome *found)
{
    plant p;
    plant_open(&p, block, (Memory){scratch, 0});
    output o = output_at(&p, result);
    plant_hold(&p, u);
    copy(p.z.low, low, p.n);
    copy(p.z.high, high, p.n);
    return !take_output(&p, &o, found);
}

/* What readings y (ny, NaN where there is none) leave of the states between low and high, by an output that holds for
 * them. Returns whether anything is left; if not, they stay. */
EXPORTED integer fdi_plant_cut(const double *block, double *scratch, double *low, double *high, const double *y,
                               double *result)
{
    plant p;
    plant_open(&p, block, (Memory){scratch, 0});
    const output o = output_at(&p, result);
    const span known = {low, high};
    span_copy(p.z, known, p.n);
    if (!cut_by_readings(&p, &o, y)) return 0;
    span_copy(known, p.z, p.n);
    return 1;
}

/* Into the rows [C, 0, c, F, 0] of a sample's linearisation, whose zeros are there, of an output over the box x in few
 * digits; and the noise with the remainder. */
static void give_rows(const plant *p, const output *o, span x, double *rows, double *noise)
{
    const integer n = p->n, nw = p->nw, at = n + p->nu;
    for (integer i = 0; i < p->ny; i++, rows += at + 1 + nw + n) {
        shorten_row(p, x, o->C + i * n, o->F + i * nw, o->c + i, o->R + i);
        copy(rows, o->C + i * n, n);
        rows[at] = o->c[i];
        copy(rows + at + 1, o->F + i * nw, nw);
        noise[i] = multiple_above((p->noise[i] + o->R[i]) * (1.0 + 4.0 * ROUNDING), unit_within(0x1p-8 * o->R[i]));
    }
}

/* An output over the set that is known, which the readings y cut: low and high are given back. Again over what is left
 * while the remainder blurs the readings. The rows (ny, n + nu + 1 + nw + n) of a linearisation, and its noise (ny). Returns
 * whether h has no form. */
EXPORTED integer fdi_plant_measured(const double *block, double *scratch, double *low, double *high, const double *y,
                                    const double *u, double *rows, double *noise, outcome *found)
{
    plant p;
    plant_open(&p, block, (Memory){scratch, 0});
    output o = output_at(&p, doubles(&p.rest, p.ny * (p.n + p.nw + 2)));
    double *before = doubles(&p.rest, p.ny);
    const span known = {low, high};
    plant_hold(&p, u);
    span_copy(p.z, known, p.n);
    fill(before, INFINITY, p.ny);
    for (integer again = 0; again < CUTS; again++) {
        if (!take_output(&p, &o, found)) return 1;
        span_copy(p.before, p.z, p.n);
        if (!cut_by_readings(&p, &o, y)) break;
        span_copy(known, p.z, p.n);
        if (!is_worth_another(&p, &o, before)) break;
    }
    give_rows(&p, &o, p.before, rows, noise);
    return 0;
}

/* A plant dx/dt = f(x, w, u) or x+ = f(x, w, u), y = h(x, w, u) + noise, with w (disturbances and parameters) in a box.
 *
 * Its block holds sizes, bounds and the tapes of f and h, functions of z = (x, w, u) whose forms are linear in (x, w);
 * it is only read. `physical` is what the state never leaves, `valid` where the equations hold, `largest` how wide the
 * set is where one starts again; `held` is 1 for what is constant within a sample, 0 for what varies.
 */
#ifndef TAPE_PLANT_H
#define TAPE_PLANT_H

#include "tape/tape.h"

static const double ROUNDING = 1.0 * EPS;  /* of a term: two roundings, so that bounds of rounding may be rounded too */
static const double TINIEST = 0x1p-1000;   /* more than underflow takes */

/* What came of a call, and why another substep would have been needed. */
enum { DONE, TOO_MANY_SUBSTEPS, OUTSIDE_VALID, NOT_PHYSICAL, TOO_WIDE, NOT_ENCLOSED };
enum { NO_BOX, NO_RANGE };

/* The row of a function or the coordinate of the state, the reason and operation of a refusal; ends of a range, a time. */
typedef struct { integer code, why, row, reason, op; double low, high, time; } outcome;

typedef struct { double *low, *high; } span;

#define PLANT_SIZES(Y) Y(n) Y(nw) Y(nu) Y(ny) Y(continuous)
#define PLANT_BOUNDS(Y)                                                                                              \
    Y(physical_low, n) Y(physical_high, n) Y(valid_low, n) Y(valid_high, n) Y(largest, n) Y(w_low, nw) Y(w_high, nw) \
    Y(held, nw) Y(noise, ny)

/* x+ in A x + a + E w + [-R, R] for all x in start, x+ in box, and the state on its way in `within`. */
typedef struct { double *A, *a, *E, *R; span start, box, within; integer substeps; } transition;

typedef struct {
#define SIZE(name) integer name;
#define BOUND(name, length) const double *name;
    PLANT_SIZES(SIZE)
    PLANT_BOUNDS(BOUND)
#undef SIZE
#undef BOUND
    tape f, h;
    span z, rate, before, image; /* scratch: (x, w, u), f, and of a step where it began and what f makes of it */
    Memory rest;                 /* of the scratch */
    double *path;                /* NULL, or room for the size and boxes of so many substeps, (1 + 4 n) each */
    integer room;
} plant;

void plant_open(plant *p, const double *block, Memory scratch);

span span_in(Memory *memory, integer n);
void span_copy(span target, span source, integer n);
static inline double largest_of(span x, integer i) { return larger(fabs(x.low[i]), fabs(x.high[i])); }

/* w and u for the calls that follow. */
void plant_hold(plant *p, const double *u);

/* The ranges of f, or its forms, over the states in z; 0 if a row has none. */
int plant_rates(plant *p, outcome *found);
int plant_forms(plant *p, outcome *found);

/* Cut by what is physical; where nothing is left, as it is. */
void cut_by_physical(const plant *p, span x);

/* Bounds of f_i where x_i is at the ends that it had in p->before: in a row whose own slope is not above zero, those of
 * how it moves away from them. */
typedef struct { double low, high; } ends;
ends rates_at_faces(const plant *p, integer i);

/* A row A x + E w + a within R over a box of states and w, in fewer digits. */
void shorten_row(const plant *p, span x, double *A, double *E, double *a, double *R);

/* A box (in z) that holds x(t) within a time h from `before` on, and the forms of f over it; 0 if none is found. */
int plant_enclose(plant *p, double h, outcome *found);

/* transition.c and output.c, where they are described: what a sample of an observer needs. */
EXPORTED integer fdi_plant_moved(const double *block, double *scratch, const double *known_low,
                                 const double *known_high, double *low, double *high, const double *u, double T,
                                 double *rows, outcome *found);
EXPORTED integer fdi_plant_measured(const double *block, double *scratch, double *low, double *high, const double *y,
                                    const double *u, double *rows, double *noise, outcome *found);

#endif

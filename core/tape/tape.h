/* A tape: functions of z as elementary operations in an order in which each reads earlier ones only.
 *
 * Over a box of z each slot has an interval that contains its values, and a linear form: v(z) in k + g (z - c) + rest
 * for all z of the box, whose centre is c. k and g are doubles and exact by definition: what rounding took from them is
 * in the rest. Each cuts the other. Python is the oracle: tests/svo/functions/oracle holds the same rules, by balls.
 *
 * A tape lies in one block that is only read, its sizes before its arrays (TAPE_SIZES, TAPE_ARRAYS); what a call
 * computes lies in scratch that it is given, so that threads share a tape. There is no pointer in the block.
 */
#ifndef TAPE_H
#define TAPE_H

#include "memory.h"
#include "tape/intervals.h"

enum { VARIABLE, CONSTANT, NEG, ADD, SUB, MUL, SQR, INV, SQRT, EXP, LOG, SIN, COS, TANH, ABS, SIGN, SROOT, MAX, ATAN2,
       SELECT, DIV }; /* as svo.functions.operations.Op */

/* phi(s) - slope s in rest. */
typedef struct { double slope; fdi_interval rest; } secant;

/* reach bounds |g (z - c)| up to rounding. */
typedef struct { double k, reach; fdi_interval rest, range; double *g; } form;

enum { SPARE = 6 }; /* forms that an operation needs on its way */

/* What forms are about: half-widths of z - c, more than underflow takes, and the coordinates that this slot reads. */
typedef struct { const double *radius; double tiny; const integer *column; integer count; } support;

/* Slots, rows, coordinates of z, those of them that forms are linear in (the first), and columns in all. */
#define TAPE_SIZES(Y) Y(slots) Y(rows) Y(variables) Y(free) Y(listed)

typedef struct {
    integer slots, rows, variables, free, listed;
    const integer *op, *operand, *output, *first, *column; /* operand (slots, 3), the first where there is no other;
                                                            * columns of slot i from first[i] on */
    const double *constant;                                /* ends (slots, 2) */
    fdi_interval *range;                                   /* (slots) */
    form *form;                                            /* (slots) */
    double *g, *centre, *radius;                           /* (slots + SPARE, free), (free), (free) */
    integer *why, *where; /* why a slot has no value, and the slot where it began */
} tape;

/* Where no row is bounded: which, why, and the operation. */
typedef struct { integer row, why, op; } refusal;

/* Returns the end of the tape's block. */
const double *tape_open(tape *t, const double *block, Memory *scratch);

/* Ranges of all slots over a box (variables); a coordinate that is NaN is unknown, and so is what reads it. Returns 0
 * if a row has no bounded range, unless it is unknown and may be. */
int tape_ranges(const tape *t, const double *lower, const double *upper, int may_be_unknown, refusal *refused);

/* Forms of all slots; returns 0 if a row has none. */
int tape_forms(const tape *t, const double *lower, const double *upper, refusal *refused);

static inline const form *row_of(const tape *t, integer row) { return t->form + t->output[row]; }
static inline fdi_interval range_of_row(const tape *t, integer row) { return t->range[t->output[row]]; }

secant tape_secant(integer op, fdi_interval a, fdi_interval values);

/* The form of an operation whose range is known; returns 0 if it is not bounded by doubles. `spare` has SPARE forms. */
int form_applied(integer op, const form *a, const form *b, const form *c, fdi_interval values, const support *s,
                 form *spare, form *found);
void form_of_coordinate(form *f, double centre, double radius, fdi_interval values, integer column);
void form_of_constant(form *f, fdi_interval values, const support *s);

/* Pieces of which the forms of operations are made (forms.c); each writes found->g in the support's columns. */
void form_cut(form *f, const support *s);
void form_sum(const form *a, const form *b, double sign, fdi_interval values, const support *s, form *found);
void form_sloped(const form *a, double slope, fdi_interval rest, fdi_interval values, const support *s, form *found);
void form_within(form *f, fdi_interval values, const support *s);
void form_angle(const form *y, const form *x, fdi_interval values, const support *s, form *spare, form *found);

#endif

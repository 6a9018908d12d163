/* A set of m rows in d coordinates in even units, as it is kept between questions (see questions.c). */
#ifndef POLYTOPES_PREPARED_H
#define POLYTOPES_PREPARED_H

#include "memory.h"

typedef struct {
    double *radius, *size;        /* of a largest ball, of the largest entry of b */
    double *point;                /* (d,) its centre as the user sees it */
    double *at, *b, *norms;       /* (d, m), (m,), (m,) */
    double *centre, *multipliers; /* (d,), (m,) of the largest ball */
    double *reach;                /* (d,) |x| is at most so much; NaN first: not asked for yet */
    integer *s, *r, *rest;        /* (d,), (m,) exponents of columns and rows, (m + 2,) what else the scaling says */
} Prepared;

static inline integer lay_out_prepared(Prepared *set, double *block, integer d, integer m)
{
    Memory memory = {block, 0};
    set->radius = doubles(&memory, 1), set->size = doubles(&memory, 1);
    set->point = doubles(&memory, d);
    set->at = doubles(&memory, d * m), set->b = doubles(&memory, m), set->norms = doubles(&memory, m);
    set->centre = doubles(&memory, d + 1), set->multipliers = doubles(&memory, m), set->reach = doubles(&memory, d);
    set->s = integers(&memory, d), set->r = integers(&memory, m), set->rest = integers(&memory, m + 2);
    return memory.used;
}

#endif

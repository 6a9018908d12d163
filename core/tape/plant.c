/* The block of a plant, and f over a box of states. */
#include "tape/plant.h"

#include "vectors.h"

#define READ(name) p->name = *size++;
#define PLACE(name, length) p->name = at, at += p->length;

span span_in(Memory *memory, integer n)
{
    double *low = doubles(memory, n), *high = doubles(memory, n);
    return (span){low, high};
}

void span_copy(span target, span source, integer n)
{
    copy(target.low, source.low, n);
    copy(target.high, source.high, n);
}

void plant_open(plant *p, const double *block, Memory scratch)
{
    const integer *size = (const integer *)(const void *)block;
    PLANT_SIZES(READ)
    const double *at = (const double *)(const void *)size;
    PLANT_BOUNDS(PLACE)
    at = tape_open(&p->f, at, &scratch);
    tape_open(&p->h, at, &scratch);
    p->z = span_in(&scratch, p->n + p->nw + p->nu);
    p->rate = span_in(&scratch, p->n);
    p->before = span_in(&scratch, p->n);
    p->image = span_in(&scratch, p->n);
    p->rest = scratch;
    p->path = NULL, p->room = 0;
}

void plant_hold(plant *p, const double *u)
{
    const integer n = p->n, nw = p->nw;
    copy(p->z.low + n, p->w_low, nw);
    copy(p->z.high + n, p->w_high, nw);
    copy(p->z.low + n + nw, u, p->nu);
    copy(p->z.high + n + nw, u, p->nu);
}

static int refused(outcome *found, refusal why)
{
    *found = (outcome){.code = NOT_ENCLOSED, .why = NO_RANGE, .row = why.row, .reason = why.why, .op = why.op};
    return 0;
}

int plant_rates(plant *p, outcome *found)
{
    refusal why;
    if (!tape_ranges(&p->f, p->z.low, p->z.high, 0, &why)) return refused(found, why);
    for (integer i = 0; i < p->n; i++) {
        const fdi_interval range = range_of_row(&p->f, i);
        p->rate.low[i] = range.low, p->rate.high[i] = range.high;
    }
    return 1;
}

int plant_forms(plant *p, outcome *found)
{
    refusal why;
    if (!tape_forms(&p->f, p->z.low, p->z.high, &why)) return refused(found, why);
    for (integer i = 0; i < p->n; i++) {
        const fdi_interval range = row_of(&p->f, i)->range;
        p->rate.low[i] = range.low, p->rate.high[i] = range.high;
    }
    return 1;
}

void cut_by_physical(const plant *p, span x)
{
    for (integer i = 0; i < p->n; i++) {
        const double low = larger(x.low[i], p->physical_low[i]), high = smaller(x.high[i], p->physical_high[i]);
        if (low <= high) x.low[i] = low, x.high[i] = high;
    }
}

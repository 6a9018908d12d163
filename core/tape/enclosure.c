/* A box that a state does not leave within a step.
 *
 * A trajectory that keeps to the physical range leaves a box through a face of that range or not at all, if the box
 * contains start + [0, h] f(box) in its interior elsewhere: on its first way out it would still have the derivatives of
 * the box. Neither a Lipschitz constant nor uniqueness is needed. A coordinate that pulls itself back is then enclosed
 * by what its derivative is at its own ends.
 */
#include "tape/plant.h"

static const integer TRIALS = 15;       /* of ever larger boxes */
static const integer PASSES = 6;        /* of narrowing, most of the time one */
static const double WORTHWHILE = 0.95;  /* of a width that another pass has left */

/* before + [0, h] f, rounded outward. */
static void take_image(const plant *p, double h)
{
    for (integer i = 0; i < p->n; i++) {
        const double down = smaller(0.0, h * p->rate.low[i]), up = larger(0.0, h * p->rate.high[i]);
        const double low = p->before.low[i], high = p->before.high[i];
        p->image.low[i] = low + down - 2.0 * ROUNDING * (fabs(low) - down) - 0x1p-1022;
        p->image.high[i] = high + up + 2.0 * ROUNDING * (fabs(high) + up) + 0x1p-1022;
    }
}

static void grow(const plant *p, integer trial)
{
    const span box = p->z;
    for (integer i = 0; i < p->n; i++) {
        const double wide = box.high[i] - box.low[i], growth = wide - (p->before.high[i] - p->before.low[i]);
        const double room =
            (0.02 + 0.1 * (double)trial) * growth + 1e-9 * wide + 1e-14 * largest_of(box, i) + 1e-200;
        box.low[i] -= room;
        box.high[i] += room;
    }
    cut_by_physical(p, box);
}

/* The first coordinate in which the image is not strictly inside, but for faces of the physical range; n if there is none. */
static integer first_outside(const plant *p)
{
    integer i = 0;
    while (i < p->n && (p->image.low[i] > p->z.low[i] || p->z.low[i] <= p->physical_low[i])
           && (p->image.high[i] < p->z.high[i] || p->z.high[i] >= p->physical_high[i]))
        i++;
    return i;
}

/* Returns whether that narrows it by more than a little. */
static int cut_by_image(const plant *p)
{
    int helps = 0;
    for (integer i = 0; i < p->n; i++) {
        const double wide = p->z.high[i] - p->z.low[i];
        p->z.low[i] = larger(p->z.low[i], p->image.low[i]);
        p->z.high[i] = smaller(p->z.high[i], p->image.high[i]);
        helps |= p->z.high[i] - p->z.low[i] < WORTHWHILE * wide;
    }
    return helps;
}

static void join_image(const plant *p)
{
    for (integer i = 0; i < p->n; i++) {
        p->z.low[i] = smaller(p->z.low[i], p->image.low[i]);
        p->z.high[i] = larger(p->z.high[i], p->image.high[i]);
    }
}

/* What f adds at most to how far each coordinate is from where it began, in place of bounds over the whole box: where
 * f_i falls with x_i, v = x_i - high_i has v' <= g_ii v + F, F being the form's bound at x_i = high_i, and v <= 0 at
 * first: so v(t) <= t max(F, 0), whatever f_i is at a smaller x_i. */
ends rates_at_faces(const plant *p, integer i)
{
    const integer count = p->n + p->nw;
    const double *c = p->f.centre, *radius = p->f.radius;
    const form *f = row_of(&p->f, i);
    const double own = f->g[i];
    double others = 0.0;
    for (integer j = 0; j < count; j++)
        if (j != i) others += fabs(f->g[j]) * radius[j];
    const double size = others + fabs(own) * radius[i] + fabs(f->k) + fabs(f->rest.low) + fabs(f->rest.high);
    const double lost = (double)(count + 8) * ROUNDING * size;
    return (ends){.low = f->k + own * (p->before.low[i] - c[i]) - others + f->rest.low - lost,
                  .high = f->k + own * (p->before.high[i] - c[i]) + others + f->rest.high + lost};
}

static void hold_at_faces(const plant *p)
{
    for (integer i = 0; i < p->n; i++) {
        if (row_of(&p->f, i)->g[i] > 0.0) continue;
        const ends at = rates_at_faces(p, i);
        p->rate.low[i] = larger(at.low, p->rate.low[i]);
        p->rate.high[i] = smaller(at.high, p->rate.high[i]);
    }
}

static int find_box(plant *p, double h, outcome *found)
{
    span_copy(p->z, p->before, p->n);
    if (!plant_rates(p, found)) return 0;
    take_image(p, h);
    span_copy(p->z, p->image, p->n);
    integer leaves = 0;
    for (integer trial = 0; trial < TRIALS; trial++) {
        grow(p, trial);
        if (!plant_rates(p, found)) return 0;
        take_image(p, h);
        leaves = first_outside(p);
        if (leaves == p->n) {
            cut_by_image(p);
            return 1;
        }
        join_image(p);
    }
    *found = (outcome){.code = NOT_ENCLOSED, .why = NO_BOX, .row = leaves, .time = h};
    return 0;
}

int plant_enclose(plant *p, double h, outcome *found)
{
    if (!find_box(p, h, found) || !plant_forms(p, found)) return 0;
    for (integer pass = 0; pass < PASSES; pass++) {
        hold_at_faces(p);
        take_image(p, h);
        const int helps = cut_by_image(p);
        if (!plant_forms(p, found)) return 0;
        if (!helps) break;
    }
    return 1;
}

/* Kalman filter over samples, with unknown inputs decoupled (Kitanidis 1987) where there are any.
 *
 * The unknown inputs are estimated from the innovation and take all of it that they can explain: with the whitened
 * effect G of each, M = (G'G)^-1 G' is their estimate, and (I - G M) w what is left of the whitened innovation w.
 */
#include "filters/filters.h"
#include "powers.h"
#include "vectors.h"

static const double SMALLEST = 1e-300; /* largest entry of an effect: less is none */

typedef struct {
    integer count;
    double *on_state, *on_output; /* (n, nd), (ny, nd): G */
    double *normal, *estimate;    /* (nd, nd), (nd, ny): M */
    double *left, *size;          /* (n, nd), (nd,) */
} Unknown;

static void lay_out_unknown(Unknown *unknown, Memory *memory, integer n, integer ny, integer nd)
{
    unknown->count = nd;
    unknown->on_state = doubles(memory, n * nd), unknown->on_output = doubles(memory, ny * nd);
    unknown->normal = doubles(memory, nd * nd), unknown->estimate = doubles(memory, nd * ny);
    unknown->left = doubles(memory, n * nd), unknown->size = doubles(memory, nd);
}

EXPORTED integer fdi_filter_room(integer n, integer ny, integer nd)
{
    Filter filter;
    Unknown unknown;
    Memory memory = {NULL, 0};
    lay_out_filter(&filter, &memory, n, ny);
    lay_out_unknown(&unknown, &memory, n, ny, nd);
    return memory.used;
}

/* The size of an unknown input is free, so each becomes one that is seen alike: a power of two times as large. */
static void even_out(Unknown *unknown, integer n, integer ny)
{
    const integer nd = unknown->count;
    for (integer j = 0; j < nd; j++) {
        double largest = SMALLEST;
        for (integer i = 0; i < ny; i++) largest = larger(fabs(unknown->on_output[i * nd + j]), largest);
        const double scale = power_of_two(1 - exponent_of(largest));
        for (integer i = 0; i < ny; i++) unknown->on_output[i * nd + j] *= scale;
        for (integer i = 0; i < n; i++) unknown->on_state[i * nd + j] *= scale;
    }
}

/* How the unknown inputs enter the state (E, not before the first sample) and the whitened output (C E and D). */
static void set_effects(Unknown *unknown, const Filter *filter, const Sample *at, const double *E, const double *D,
                        int first)
{
    const integer n = filter->n, ny = filter->ny, nd = unknown->count;
    if (first)
        fill(unknown->on_state, 0.0, n * nd);
    else
        copy(unknown->on_state, E, n * nd);
    multiply(filter->C, unknown->on_state, ny, n, nd, unknown->on_output);
    for (integer i = 0; i < ny; i++)
        if (at->y[i] == at->y[i]) add_multiple(unknown->on_output + i * nd, 1.0, D + i * nd, nd);
    solve_lower(filter->L, ny, nd, unknown->on_output);
    even_out(unknown, n, ny);
}

/* The estimate from the whitened innovation; 0 if the outputs cannot tell an unknown input. */
static int set_estimate(Unknown *unknown, integer ny, int first)
{
    const integer nd = unknown->count;
    const double *G = unknown->on_output;
    double largest = 0.0;
    for (integer j = 0; j < nd; j++)
        for (integer i = 0; i < ny; i++) unknown->estimate[j * ny + i] = G[i * nd + j];
    multiply_transposed(unknown->estimate, unknown->estimate, nd, ny, nd, unknown->normal);
    for (integer j = 0; j < nd; j++) {
        double *entry = unknown->normal + j * nd + j;
        if (first && *entry == 0.0) *entry = 1.0; /* an input of the state has not acted yet */
        largest = larger(*entry, largest);
    }
    if (!factor(unknown->normal, nd, (double)nd * EPS * largest)) return 0;
    solve_lower(unknown->normal, nd, ny, unknown->estimate);
    solve_lower_transposed(unknown->normal, nd, ny, unknown->estimate);
    return 1;
}

/* The gain with what the estimate adds, and the innovation (ny,) less what the unknown inputs explain. */
static void decouple(Unknown *unknown, Filter *filter, double *white)
{
    const integer n = filter->n, ny = filter->ny, nd = unknown->count;
    multiply(filter->gain, unknown->on_output, n, ny, nd, unknown->left);
    for (integer i = 0; i < n * nd; i++) unknown->left[i] = unknown->on_state[i] - unknown->left[i];
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < nd; j++)
            add_multiple(filter->gain + i * ny, unknown->left[i * nd + j], unknown->estimate + j * ny, ny);
    for (integer j = 0; j < nd; j++) unknown->size[j] = dot(unknown->estimate + j * ny, filter->white, ny);
    for (integer i = 0; i < ny; i++) white[i] -= dot(unknown->on_output + i * nd, unknown->size, nd);
}

/* Filter K samples; returns DONE, NOT_POSITIVE, or the sample at which an unknown input cannot be told from y.
 *
 * x (n,) and P (n, n) are the estimate after the sample before (or, if `first`, before the first measurement) and are
 * overwritten by that after the last one. A, f, Q (K, ...) and E (K, n, nd) are of the sample BEFORE each measurement;
 * C, g, R and D (K, ny, nd) are of its own. Writes states (K, n) and white (K, ny), the innovations that are left.
 */
EXPORTED integer fdi_filter(integer samples, integer n, integer ny, integer nd, integer first, double *x, double *P,
                            const double *A, const double *f, const double *Q, const double *C, const double *g,
                            const double *R, const double *y, const double *E, const double *D, double *states,
                            double *white, double *block)
{
    Filter filter;
    Unknown unknown;
    Memory memory = {block, 0};
    lay_out_filter(&filter, &memory, n, ny);
    lay_out_unknown(&unknown, &memory, n, ny, nd);
    for (integer k = 0; k < samples; k++) {
        const Sample at = {A + k * n * n, f + k * n,      Q + k * n * n, C + k * ny * n,
                           g + k * ny,    R + k * ny * ny, y + k * ny};
        const int start = first && k == 0;
        if (!start) predict(&filter, &at, x, P);
        if (!innovate(&filter, &at, x, P)) return NOT_POSITIVE;
        copy(white + k * ny, filter.white, ny);
        if (nd > 0) {
            set_effects(&unknown, &filter, &at, E + k * n * nd, D + k * ny * nd, start);
            if (!set_estimate(&unknown, ny, start)) return k;
            decouple(&unknown, &filter, white + k * ny);
        }
        correct(&filter, x, P);
        copy(states + k * n, x, n);
    }
    return DONE;
}

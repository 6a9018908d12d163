/* A basis of d active rows: its edges (a dense inverse, updated and renewed), its vertex, the slacks of all rows. */
#include "polytopes/polytopes.h"
#include "vectors.h"

static const double RAY = 1e-13; /* a pivot below is none: the rows are dependent */

void lay_out_state(State *at, Memory *memory, integer d, integer m)
{
    at->x = doubles(memory, d), at->s = doubles(memory, m), at->W = integers(memory, d);
    at->Q = doubles(memory, d * d), at->y = doubles(memory, d);
    at->p = doubles(memory, d), at->rate = doubles(memory, m), at->ratio = doubles(memory, m);
    at->alpha = doubles(memory, d), at->work = doubles(memory, 2 * d * d);
}

/* target += sign * sum over j of p[j] column j of A, four columns a pass, and what is left in one more. */
WIDE static void add_columns(double *restrict target, const Rows *rows, const double *restrict p, double sign)
{
    const integer d = rows->d, m = rows->m, stride = rows->stride;
    integer j = 0;
    for (; j + 4 <= d; j += 4) {
        const double pa = sign * p[j], pb = sign * p[j + 1], pc = sign * p[j + 2], pd = sign * p[j + 3];
        const double *restrict a = rows->at + j * stride, *restrict b = a + stride;
        const double *restrict c = b + stride, *restrict e = c + stride;
        for (integer i = 0; i < m; i++) target[i] += (pa * a[i] + pb * b[i]) + (pc * c[i] + pd * e[i]);
    }
    const double *restrict a = rows->at + j * stride;
    if (d - j == 1) {
        add_multiple(target, sign * p[j], a, m);
    } else if (d - j == 2) {
        const double *restrict b = a + stride;
        const double pa = sign * p[j], pb = sign * p[j + 1];
        for (integer i = 0; i < m; i++) target[i] += pa * a[i] + pb * b[i];
    } else if (d - j == 3) {
        const double *restrict b = a + stride, *restrict c = b + stride;
        const double pa = sign * p[j], pb = sign * p[j + 1], pc = sign * p[j + 2];
        for (integer i = 0; i < m; i++) target[i] += (pa * a[i] + pb * b[i]) + pc * c[i];
    }
}

void combine(const Rows *rows, const double *p, double *rate)
{
    fill(rate, 0.0, rows->m);
    add_columns(rate, rows, p, 1.0);
}

void slacks(const Rows *rows, const double *x, double *s)
{
    copy(s, rows->b, rows->m);
    add_columns(s, rows, x, -1.0);
}

/* One Newton step of x onto its active rows, then fresh slacks. */
void settle(const Rows *rows, State *at)
{
    const integer d = rows->d;
    for (integer k = 0; k < d; k++) {
        const integer i = at->W[k];
        if (i < 0) continue;
        double residual = rows->b[i];
        for (integer j = 0; j < d; j++) residual -= rows->at[j * rows->stride + i] * at->x[j];
        add_multiple(at->x, residual, at->Q + k * d, d);
    }
    slacks(rows, at->x, at->s);
    for (integer k = 0; k < d; k++)
        if (at->W[k] >= 0) at->s[at->W[k]] = 0.0;
}

/* Q (d, d) = the transposed inverse of the rows (d,) in the left half of work (d, 2 d), by Gauss-Jordan with partial
 * pivoting. 0 if a pivot is not above the least one. */
int invert(double *work, integer d, double least, double *Q)
{
    const integer width = 2 * d;
    for (integer k = 0; k < d; k++)
        for (integer j = 0; j < d; j++) work[k * width + d + j] = j == k ? 1.0 : 0.0;
    for (integer c = 0; c < d; c++) {
        integer best = c;
        for (integer k = c + 1; k < d; k++)
            if (fabs(work[k * width + c]) > fabs(work[best * width + c])) best = k;
        double *pivot = work + c * width, *other = work + best * width;
        if (!(fabs(other[c]) > least)) return 0;
        for (integer j = c; best != c && j < width; j++) {
            const double kept = pivot[j];
            pivot[j] = other[j], other[j] = kept;
        }
        const double inverse = 1.0 / pivot[c];
        for (integer j = c; j < width; j++) pivot[j] *= inverse;
        for (integer k = 0; k < d; k++) {
            const double factor = work[k * width + c];
            if (k != c && factor != 0.0) add_multiple(work + k * width + c, -factor, pivot + c, width - c);
        }
    }
    for (integer j = 0; j < d; j++)
        for (integer k = 0; k < d; k++) Q[k * d + j] = work[j * width + d + k];
    return 1;
}

int invert_basis(const Rows *rows, const integer *W, double *Q, double *work)
{
    const integer d = rows->d;
    for (integer k = 0; k < d; k++)
        for (integer j = 0; j < d; j++)
            work[k * 2 * d + j] = W[k] >= 0 ? rows->at[j * rows->stride + W[k]] : (j == -1 - W[k] ? 1.0 : 0.0);
    return invert(work, d, RAY, Q);
}

void coordinates(const Rows *rows, integer i, const double *Q, double *alpha)
{
    const integer d = rows->d;
    for (integer k = 0; k < d; k++) {
        double total = 0.0;
        for (integer j = 0; j < d; j++) total += rows->at[j * rows->stride + i] * Q[k * d + j];
        alpha[k] = total;
    }
}

void exchange(double *Q, const double *alpha, integer slot, integer d)
{
    double *edge = Q + slot * d;
    const double inverse = 1.0 / alpha[slot];
    for (integer j = 0; j < d; j++) edge[j] *= inverse;
    for (integer q = 0; q < d; q++)
        if (q != slot && alpha[q] != 0.0) add_multiple(Q + q * d, -alpha[q], edge, d);
}

/* Point and basis at the origin: every slot artificial. */
void begin_at_origin(const Rows *rows, State *at)
{
    const integer d = rows->d;
    fill(at->x, 0.0, d);
    fill(at->Q, 0.0, d * d);
    for (integer j = 0; j < d; j++) at->W[j] = -1 - j, at->Q[j * d + j] = 1.0;
}

/* The state at the feasible point x0: every slot artificial. */
void begin(const Rows *rows, const double *x0, State *at)
{
    begin_at_origin(rows, at);
    copy(at->x, x0, rows->d);
    slacks(rows, at->x, at->s);
}

/* Size that tolerances refer to: the largest entry of b (1 for a cone). */
double scale_of(const Rows *rows)
{
    const double largest = largest_magnitude(rows->b, rows->m);
    return largest > 0.0 ? largest : 1.0;
}

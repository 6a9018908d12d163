/* How the window moves: the newest state advances, the base slides to its arrival set. */
#include "window.h"

/* The maps of x(k) -> x(k+1) at the centres of v(k). */
static void load_transition(const window *w, integer k)
{
    const integer n = w->n, nu = w->nu, nw = w->nw, nv = w->nv, s = slot(w, k), v = variables(w, k);
    const double *vc = w->vc + v * nv, *vr = w->vr + v * nv, *u = w->u + s * nu;
    for (integer i = 0; i < n; i++) {
        const double *m = w->stack + (s * w->ni * w->X + i) * w->P;
        double value = m[n + nu], magnitude = fabs(m[n + nu]), *inputs = w->inputs + (s * n + i) * nv;
        copy(w->A + (s * n + i) * n, m, n);
        for (integer j = 0; j < nu; j++) {
            value += m[n + j] * u[j];
            magnitude += fabs(m[n + j] * u[j]);
        }
        for (integer j = 0; j < nv; j++) {
            const double e = j < nw ? m[n + nu + 1 + j] : w->gain[(v * w->nq + j - nw) * w->X + i];
            value += e * vc[j];
            magnitude += fabs(e) * (fabs(vc[j]) + vr[j]);
            inputs[j] = e * vr[j];
        }
        w->drift[s * n + i] = value;
        w->drift_mag[s * n + i] = magnitude;
    }
}

/* Free response, magnitude and bound of the error of x(k+1), by rounding and by channels, from those of x(k). */
static void respond(const window *w, integer k)
{
    const integer n = w->n, s = slot(w, k), t = slot(w, k + 1);
    const double gamma = 2.0 * UNIT * (double)(n + w->nu + w->nw + w->nq + 8);
    for (integer i = 0; i < n; i++) {
        const double *A = w->A + (s * n + i) * n;
        double value = w->drift[s * n + i], magnitude = w->drift_mag[s * n + i], error = 0.0;
        for (integer j = 0; j < n; j++) {
            value += A[j] * w->phi[s * n + j];
            magnitude += fabs(A[j]) * w->mag[s * n + j];
            error += fabs(A[j]) * w->err[s * n + j];
        }
        w->phi[t * n + i] = value;
        w->mag[t * n + i] = w->terms[t * n + i] = magnitude;
        w->fresh[i] = gamma * magnitude + left_out(w, k, i) + FLOOR;
        w->err[t * n + i] = (error + w->fresh[i]) * UPWARD;
    }
    carry_error(n, w->carry + s * n * n, w->frame + t * n * n, w->rho + s * n, w->fresh, w->rho + t * n);
    for (integer i = 0; i < n; i++) {
        const double error = error_of(n, w->frame + t * n * n, w->rho + t * n, i);
        if (error < w->err[t * n + i]) w->err[t * n + i] = error;
    }
}

/* |x_i| by its spread over the box, which does not grow as |A|^k does. */
static void limit_magnitude(const window *w, integer t, integer i, double spread)
{
    const integer at = t * w->n + i;
    const double reach = (fabs(w->phi[at]) + w->err[at] + spread) * UPWARD;
    if (reach < w->mag[at]) w->mag[at] = reach;
}

static double sum_of_magnitudes(const double *values, integer count)
{
    double sum = 0.0;
    for (integer j = 0; j < count; j++) sum += fabs(values[j]);
    return sum;
}

/* psi of sample k becomes that of k + 1: A psi, and the inputs in the columns of v(k). */
void move_response(const window *w, double *psi, integer k)
{
    const integer n = w->n, Z = w->Z, nv = w->nv, s = slot(w, k), first = n + variables(w, k) * nv;
    const double *A = w->A + s * n * n, *inputs = w->inputs + s * n * nv;
    for (integer j = 0; j < Z; j++) {
        for (integer i = 0; i < n; i++) {
            double value = 0.0;
            for (integer r = 0; r < n; r++) value += A[i * n + r] * psi[r * Z + j];
            w->column[i] = value;
        }
        for (integer i = 0; i < n; i++) psi[i * Z + j] = w->column[i];
    }
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < nv; j++) psi[i * Z + first + j] += inputs[i * nv + j];
}

/* The newest state moves from k to k + 1. */
void advance(const window *w, integer k)
{
    const integer n = w->n, s = slot(w, k), t = slot(w, k + 1), square = n * n;
    load_transition(w, k);
    turn_frame(n, w->A + s * square, w->frame + s * square, w->frame + t * square, w->carry + s * square, w->turning);
    respond(w, k);
    move_response(w, w->psi, k);
    for (integer i = 0; i < n; i++) {
        const double *psi = w->psi + i * w->Z, spread = sum_of_magnitudes(psi + n, w->Z - n);
        w->from_v[t * n + i] = spread * UPWARD;
        limit_magnitude(w, t, i, spread + sum_of_magnitudes(psi, n));
    }
}

/* Centre the base state in its box. */
void anchor(const window *w)
{
    const integer n = w->n, s = slot(w, w->clock[BASE]);
    for (integer j = 0; j < n; j++) {
        midpoint(w->h_lower[j], w->h_upper[j], &w->xc[j], &w->xr[j]);
        w->phi[s * n + j] = w->xc[j];
        w->mag[s * n + j] = w->terms[s * n + j] = fabs(w->xc[j]) + w->xr[j];
        w->err[s * n + j] = w->rho[s * n + j] = 0.0;
    }
}

/* Variables and rows of sample k leave the window. */
static void drop_sample(const window *w, integer k)
{
    const integer Z = w->Z, first = w->n + variables(w, k) * w->nv, start = w->na + slot(w, k) * w->nr;
    for (integer j = first; j < first + w->nv; j++) {
        fill(w->GT + j * w->R, 0.0, w->R);
        for (integer i = 0; i < w->R; i++) w->G[i * Z + j] = 0.0;
        for (integer i = 0; i < w->n; i++) w->psi[i * Z + j] = 0.0;
    }
    for (integer i = start; i < start + w->nr; i++) clear_row(w, i);
}

/* Columns of the base state of the rows of the sample in slot s, and their bounds. */
static void replace_rows(const window *w, integer s)
{
    const integer n = w->n, start = w->na + s * w->nr;
    for (integer i = start; i < start + w->nr; i++) {
        if (w->scale[i] == 0.0) continue;
        for (integer j = 0; j < n; j++) {
            double value = 0.0;
            for (integer r = 0; r < n; r++) value += w->row_x[i * n + r] * w->response[r * n + j];
            w->G[i * w->Z + j] = value;
            w->GT[j * w->R + i] = value;
        }
        place_row(w, i, s);
    }
}

/* The response of x(k) to the base state becomes that of x(k+1), whose magnitude it limits. */
static void move_base_response(const window *w, integer k)
{
    const integer n = w->n, t = slot(w, k + 1);
    const double *A = w->A + slot(w, k) * n * n;
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++) {
            double value = 0.0;
            for (integer r = 0; r < n; r++) value += A[i * n + r] * w->response[r * n + j];
            w->moved[i * n + j] = value;
        }
    copy(w->response, w->moved, n * n);
    for (integer i = 0; i < n; i++) {
        double spread = w->from_v[t * n + i];
        for (integer j = 0; j < n; j++) spread += fabs(w->response[i * n + j]);
        limit_magnitude(w, t, i, spread);
    }
}

/* Columns of the base state and bounds of all rows, after the base has moved. */
static void rebuild(const window *w)
{
    const integer n = w->n, time = w->clock[TIME];
    fill(w->response, 0.0, n * n);
    for (integer j = 0; j < n; j++) w->response[j * n + j] = w->xr[j];
    for (integer k = w->clock[BASE]; k <= time; k++) {
        replace_rows(w, slot(w, k));
        if (k == time) break;
        respond(w, k);
        move_base_response(w, k);
    }
    for (integer i = 0; i < n; i++) copy(w->psi + i * w->Z, w->response + i * n, n);
}

/* Drop the oldest samples: the state at base + block is what the arrival bounds say. */
void slide(const window *w)
{
    const integer base = w->clock[BASE];
    for (integer k = base; k < base + w->block; k++) drop_sample(w, k);
    for (integer i = 0; i < w->nt; i++) {
        w->h_lower[i] = smaller(w->new_upper[i], w->new_lower[i]);
        w->h_upper[i] = larger(w->new_upper[i], w->new_lower[i]);
    }
    w->clock[BASE] = base + w->block;
    w->clock[PENDING] = 0;
    anchor(w);
    rebuild(w);
    arrival_rows(w);
}

/* Rows of the window: scaled, with the states eliminated, widened by what the elimination can round. */
#include "window.h"

#include "powers.h"

/* Bounds of row i of the sample in slot s, about the free response and widened by the rounding of its state. */
void place_row(const window *w, integer i, integer s)
{
    const integer n = w->n;
    const double *x = w->row_x + i * n, *phi = w->phi + s * n, *mag = w->mag + s * n, *err = w->err + s * n;
    double offset = 0.0, size = w->row_v[i] + w->row_c[i], rounding = 0.0;
    for (integer j = 0; j < n; j++) {
        offset += x[j] * phi[j];
        size += fabs(x[j]) * mag[j];
        rounding += fabs(x[j]) * err[j];
    }
    rounding += 2.0 * UNIT * (double)(n + 8) * size;
    w->magnitude[i] = 2.0 * size + 1.0;
    w->lower[i] = larger(-size - 1.0, w->raw_lower[i] - offset - rounding);
    w->upper[i] = smaller(size + 1.0, w->raw_upper[i] - offset + rounding);
}

/* A row that says nothing. One without a scale has no entries yet. */
void clear_row(const window *w, integer i)
{
    if (w->scale[i] != 0.0) {
        fill(w->G + i * w->Z, 0.0, w->Z);
        for (integer j = 0; j < w->Z; j++) w->GT[j * w->R + i] = 0.0;
    }
    fill(w->row_x + i * w->n, 0.0, w->n);
    w->row_v[i] = 0.0;
    w->row_c[i] = 0.0;
    w->raw_lower[i] = -INFINITY;
    w->raw_upper[i] = INFINITY;
    w->scale[i] = 0.0;
    w->magnitude[i] = 1.0;
    w->lower[i] = -1.0;
    w->upper[i] = 1.0;
}

/* The factor that brings a row to the order of 1; its bounds and its terms by it. */
static double scale_row(const window *w, integer i, double floor, double size)
{
    const double scale = 1.0 / larger(1e-300, larger(1e-6 * size, floor));
    w->scale[i] = scale;
    w->row_v[i] *= scale;
    w->row_c[i] *= scale;
    w->raw_lower[i] *= scale;
    w->raw_upper[i] *= scale;
    return scale;
}

/* Finish row i of the sample in slot s, whose state is psi z about its free response.
 *
 * The row's own variables stand in G[i, first : first + nv] as coefficients of the unscaled row; row_x, row_c and the
 * raw bounds are set. Scales the row, by its width `floor` where that is not tiny, and eliminates the state. */
void set_row(const window *w, const double *psi, integer i, integer s, integer first, integer nv, double floor)
{
    const integer n = w->n, Z = w->Z, R = w->R;
    double *g = w->G + i * Z, *x = w->row_x + i * n;
    w->row_v[i] = 0.0;
    for (integer j = first; j < first + nv; j++) w->row_v[i] += fabs(g[j]);
    double size = w->row_v[i];
    for (integer j = 0; j < n; j++) size += fabs(x[j]) * w->mag[s * n + j];
    const double scale = scale_row(w, i, floor, size);
    for (integer j = first; j < first + nv; j++) g[j] *= scale;
    for (integer r = 0; r < n; r++) {
        x[r] *= scale;
        if (x[r] != 0.0) add_multiple(g, x[r], psi + r * Z, Z);
    }
    for (integer j = 0; j < Z; j++) w->GT[j * R + i] = g[j];
    place_row(w, i, s);
}

/* The rows of all sensors at the newest sample k; NaN = missing. */
void measure(const window *w, integer k, double eps)
{
    for (integer o = 0; o < w->ny; o++) measure_sensor(w, w->psi, k, o, eps);
}

/* What v(k) adds to row r of [x(k+1); y(k)]: G of row i; the value at the centres and the size of the terms. */
static void add_variables(const window *w, integer k, integer r, integer i, double *known, double *magnitude)
{
    const integer nw = w->nw, nq = w->nq, nv = w->nv, v = variables(w, k);
    const double *vc = w->vc + v * nv, *vr = w->vr + v * nv;
    const double *m = w->stack + (slot(w, k) * w->ni * w->X + r) * w->P + w->n + w->nu + 1;
    double *g = w->G + i * w->Z + w->n + v * nv;
    for (integer j = 0; j < nv; j++) {
        const double coefficient = j < nw ? m[j] : w->gain[(v * nq + j - nw) * w->X + r];
        g[j] = coefficient * vr[j];
        *known += coefficient * vc[j];
        *magnitude += fabs(coefficient) * (fabs(vc[j]) + vr[j]);
    }
}

/* Row C x + D u + c + F w + channels within the noise about y(k), widened by the slack. */
void measure_sensor(const window *w, const double *psi, integer k, integer o, double eps)
{
    const integer n = w->n, nu = w->nu, ny = w->ny, r = n + o, s = slot(w, k), i = w->na + s * w->nr + o;
    const double *m = w->stack + (s * w->ni * w->X + r) * w->P, *u = w->u + s * nu;
    const double y = w->y[s * ny + o], noise = w->noise[s * ny + o];
    clear_row(w, i);
    w->slack[s * ny + o] = 0.0;
    if (isnan(y)) return;
    double known = m[n + nu], magnitude = fabs(m[n + nu]) + fabs(y) + noise;
    for (integer j = 0; j < n; j++) {
        w->row_x[i * n + j] = m[j];
        magnitude += fabs(m[j]) * w->mag[s * n + j];
    }
    for (integer j = 0; j < nu; j++)
        if (m[n + j] != 0.0) {
            known += m[n + j] * u[j];
            magnitude += fabs(m[n + j] * u[j]);
        }
    if (w->late) add_variables(w, k, r, i, &known, &magnitude);
    const double slack = short_above(eps * magnitude), width = noise + slack + (w->late ? left_out(w, k, r) : 0.0);
    w->slack[s * ny + o] = slack;
    w->raw_lower[i] = y - known - width;
    w->raw_upper[i] = y - known + width;
    w->row_c[i] = magnitude;
    set_row(w, psi, i, s, n + variables(w, k) * w->nv, w->late ? w->nv : 0, noise + slack);
}

/* Rows of the template beyond the box on the state at the base. */
void arrival_rows(const window *w)
{
    const integer n = w->n, s = slot(w, w->clock[BASE]);
    for (integer i = 0; i < w->na; i++) {
        clear_row(w, i);
        if (i < w->nt - n) {
            copy(w->row_x + i * n, w->T + (n + i) * n, n);
            w->raw_lower[i] = w->h_lower[n + i];
            w->raw_upper[i] = w->h_upper[n + i];
            w->row_c[i] = fabs(w->raw_lower[i]) + fabs(w->raw_upper[i]);
            scale_arrival_row(w, i, s);
        }
    }
}

/* Scale an arrival row by its spread over the box of the base state, which is the row's own state. */
void scale_arrival_row(const window *w, integer i, integer s)
{
    const integer n = w->n, Z = w->Z;
    double *x = w->row_x + i * n, spread = 0.0, size = 0.0;
    for (integer j = 0; j < n; j++) {
        spread += fabs(x[j]) * w->xr[j];
        size += fabs(x[j]) * w->mag[s * n + j];
    }
    const double scale = scale_row(w, i, spread, size);
    for (integer j = 0; j < n; j++) {
        x[j] *= scale;
        w->G[i * Z + j] = x[j] * w->xr[j];
        w->GT[j * w->R + i] = w->G[i * Z + j];
    }
    place_row(w, i, s);
}

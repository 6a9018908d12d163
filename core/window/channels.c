/* Channels of uncertainty: p = Delta s with s = f'(x, u, 1, w), bounded by two lines over s.
 *
 * The lines are exact where s keeps one sign, and the exact convex hull over [l, r] where it does not. A channel that
 * reaches the output opens with its sample, any other with the transition from it, once u(k) is known.
 */
#include "window.h"

/* Whether channel q of sample k enters y(k). */
integer reaches_output(const window *w, integer k, integer q)
{
    const double *gain = w->gain + (variables(w, k) * w->nq + q) * w->X;
    for (integer i = w->n; i < w->X; i++)
        if (gain[i] != 0.0) return 1;
    return 0;
}

static const double *functional_of(const window *w, integer k, integer q)
{
    return w->functional + (variables(w, k) * w->nq + q) * w->P;
}

/* What u, the constant and w say of s = f'(x, u, 1, w): value without w, magnitude, centre and spread with it. */
known_terms known_part(const window *w, integer k, integer q)
{
    const integer n = w->n, nu = w->nu, nw = w->nw, s = slot(w, k), v = variables(w, k);
    const double *f = functional_of(w, k, q), *u = w->u + s * nu;
    known_terms part = {f[n + nu], fabs(f[n + nu]), 0.0, 0.0};
    for (integer j = 0; j < nu; j++) {
        part.known += f[n + j] * u[j];
        part.magnitude += fabs(f[n + j] * u[j]);
    }
    part.centre = part.known;
    for (integer j = 0; j < nw; j++) {
        const double fw = f[n + nu + 1 + j];
        if (fw == 0.0) continue;
        double middle, half;
        midpoint(w->w_lower[v * nw + j], w->w_upper[v * nw + j], &middle, &half);
        part.centre += fw * middle;
        part.spread += fabs(fw) * half;
        part.magnitude += fabs(fw) * (fabs(middle) + half);
    }
    return part;
}

/* Bounds of s of one channel over the box of the variables; whether they leave its sign open. */
static integer bound_channel(const window *w, integer k, integer q)
{
    const integer n = w->n, Z = w->Z, s = slot(w, k), at = variables(w, k) * w->nq + q;
    const double *f = functional_of(w, k, q);
    known_terms part = known_part(w, k, q);
    double rounding = 0.0, radius = 0.0;
    for (integer j = 0; j < n; j++) {
        part.centre += f[j] * w->phi[s * n + j];
        part.magnitude += fabs(f[j]) * w->mag[s * n + j];
        rounding += fabs(f[j]) * w->err[s * n + j];
    }
    for (integer j = 0; j < Z; j++) {
        double value = 0.0;
        for (integer r = 0; r < n; r++) value += f[r] * w->psi[r * Z + j];
        radius += fabs(value);
    }
    rounding += 2.0 * UNIT * (double)(Z + n + w->nu + w->nw + 8) * part.magnitude;
    w->s_lower[at] = part.centre - part.spread - radius - rounding;
    w->s_upper[at] = part.centre + part.spread + radius + rounding;
    return radius > 0.0 && w->s_lower[at] < 0.0 && 0.0 < w->s_upper[at];
}

/* Bounds of s at sample k over the box of the variables; 1 if one leaves the sign of its s open.
 *
 * Of the channels that reach the output, the others having no part in the window yet; or of those others. */
integer bound_channels(const window *w, integer k, integer reaching)
{
    const integer v = variables(w, k);
    integer some_open = 0;
    for (integer q = 0; q < w->nq; q++) {
        const integer at = v * w->nq + q;
        if (reaches_output(w, k, q) == reaching) {
            some_open |= bound_channel(w, k, q);
        } else if (reaching) {
            w->s_lower[at] = w->s_upper[at] = 0.0;
            fill(w->lines + 4 * at, 0.0, 4);
        }
    }
    return some_open;
}

/* Variable p = Delta s of channel q at the newest sample k: its box and, where s is not known, its two rows. */
static void open_channel(const window *w, integer k, integer q)
{
    const integer v = variables(w, k), at = v * w->nq + q, p = v * w->nv + w->nw + q;
    const double lo = w->delta[2 * q], hi = w->delta[2 * q + 1], low = w->s_lower[at], high = w->s_upper[at];
    const double least_p = smaller(smaller(hi * high, hi * low), smaller(lo * high, lo * low));
    const double most_p = larger(larger(hi * high, hi * low), larger(lo * high, lo * low));
    const double widen = 2.0 * UNIT * larger(fabs(most_p), fabs(least_p));
    midpoint(least_p - widen, most_p + widen, &w->vc[p], &w->vr[p]);
    channel_rows(w, w->psi, k, q);
}

/* Variables and rows of the channels that reach the output at the newest sample k, or of the others. */
void open_channels(const window *w, integer k, integer reaching)
{
    for (integer q = 0; q < w->nq; q++)
        if (reaches_output(w, k, q) == reaching) open_channel(w, k, q);
}

/* Lines over s in [l, r] that bound Delta s from above and below, exact where s has one sign. */
static void draw_lines(const window *w, integer v, integer q)
{
    const double lo = w->delta[2 * q], hi = w->delta[2 * q + 1];
    const double low = w->s_lower[v * w->nq + q], high = w->s_upper[v * w->nq + q];
    double *line = w->lines + 4 * (v * w->nq + q);
    line[1] = line[3] = 0.0;
    if (low >= 0.0) {
        line[0] = hi;
        line[2] = lo;
    } else if (high <= 0.0) {
        line[0] = lo;
        line[2] = hi;
    } else {
        double slope = (hi * high - lo * low) / (high - low);
        double rounding = 8.0 * UNIT * (fabs(lo) + fabs(hi) + fabs(slope)) * larger(-low, high);
        line[0] = slope;
        line[1] = larger(hi * high - slope * high, lo * low - slope * low) + rounding;
        slope = (lo * high - hi * low) / (high - low);
        rounding = 8.0 * UNIT * (fabs(lo) + fabs(hi) + fabs(slope)) * larger(-low, high);
        line[2] = slope;
        line[3] = smaller(lo * high - slope * high, hi * low - slope * low) - rounding;
    }
}

/* One row of channel q at sample k: sign (p - slope s) <= sign intercept. */
static void channel_row(const window *w, const double *psi, integer k, integer q, integer side)
{
    const integer n = w->n, nw = w->nw, nv = w->nv, s = slot(w, k), v = variables(w, k), first = n + v * nv;
    const integer i = w->na + s * w->nr + w->ny + w->nh + 2 * q + side;
    const double *f = functional_of(w, k, q), *vc = w->vc + v * nv, *vr = w->vr + v * nv;
    const double *line = w->lines + 4 * (v * w->nq + q) + 2 * side;
    const double sign = side == 0 ? 1.0 : -1.0, slope = line[0], intercept = line[1];
    const known_terms part = known_part(w, k, q);
    double *g = w->G + i * w->Z + first, bound = sign * (intercept + slope * part.known - vc[nw + q]);
    for (integer j = 0; j < n; j++) w->row_x[i * n + j] = -sign * slope * f[j];
    for (integer j = 0; j < nw; j++) {
        const double fw = f[n + w->nu + 1 + j];
        g[j] = -sign * slope * fw * vr[j];
        bound += sign * slope * fw * vc[j];
    }
    g[nw + q] = sign * vr[nw + q];
    w->raw_upper[i] = bound;
    w->row_c[i] = fabs(intercept) + fabs(slope) * part.magnitude + fabs(vc[nw + q]);
    set_row(w, psi, i, s, first, nv, vr[nw + q]);
}

/* The two rows of channel q at sample k over the present bounds of its s; none where s is known. */
void channel_rows(const window *w, const double *psi, integer k, integer q)
{
    const double *f = functional_of(w, k, q);
    integer unknown = known_part(w, k, q).spread > 0.0;
    for (integer j = 0; j < w->n; j++) unknown = unknown || f[j] != 0.0;
    draw_lines(w, variables(w, k), q);
    for (integer side = 0; side < 2; side++) {
        clear_row(w, w->na + slot(w, k) * w->nr + w->ny + w->nh + 2 * q + side);
        if (unknown) channel_row(w, psi, k, q, side);
    }
}

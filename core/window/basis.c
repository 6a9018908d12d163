/* The basis of a program: active rows I, basic columns J and the dense inverse of G[I, J], one a direction.
 *
 * It stays as small as the number of rows that matter (5 on average for a window of 10 steps on the Eclipse). Entry
 * [b, a] of an inverse belongs to column J[b] and row I[a]; its rows are K apart.
 */
#include "window.h"

/* G[I, J] beside the identity, for p rows and nc columns. */
static void load_table(const window *w, integer q, integer p, integer nc)
{
    const integer K = w->K, L = w->L, *rows = w->rows + q * K, *cols = w->chosen;
    for (integer a = 0; a < p; a++) {
        const double *g = w->G + rows[a] * w->Z;
        for (integer b = 0; b < nc; b++) w->table[a * L + b] = g[cols[b]];
        fill(w->square + a * K, 0.0, p);
        w->square[a * K + a] = 1.0;
    }
}

/* Row r of column b becomes that of the identity: Gauss-Jordan on the table from column b on, and on the inverse. */
static void pivot_on(const window *w, integer p, integer nc, integer r, integer b)
{
    const integer K = w->K, L = w->L;
    double *M = w->table, *T = w->square;
    const double scale = 1.0 / M[r * L + b];
    for (integer j = b; j < nc; j++) M[r * L + j] *= scale;
    for (integer j = 0; j < p; j++) T[r * K + j] *= scale;
    for (integer a = 0; a < p; a++) {
        const double factor = M[a * L + b];
        if (a == r || factor == 0.0) continue;
        add_multiple(M + a * L + b, -factor, M + r * L + b, nc - b);
        add_multiple(T + a * K, -factor, T + r * K, p);
    }
}

/* The row of the largest entry of column b among those without a pivot; -1 if none is above the threshold. */
static integer pivot_row(const window *w, integer p, integer b, const integer *is_used, double threshold)
{
    integer r = -1;
    double best = threshold;
    for (integer a = 0; a < p; a++) {
        const double size = fabs(w->table[a * w->L + b]);
        if (!is_used[a] && size > best) {
            r = a;
            best = size;
        }
    }
    return r;
}

/* Rows, columns and inverse of the pivots that were found: column b has its pivot in row row_of[b], or -1. */
static void keep_pivots(const window *w, integer q, integer p, integer nc, const integer *row_of,
                        const integer *is_used)
{
    const integer K = w->K;
    integer *rows = w->rows + q * K, *cols = w->cols + q * K, *status = w->status + q * w->Z;
    double *inverse = w->inverse + q * K * K;
    integer kept = 0, at = 0;
    for (integer b = 0; b < nc; b++) {
        const integer j = w->chosen[b], r = row_of[b];
        if (r < 0) {
            if (status[j] == BASIC) status[j] = AT_CENTRE;
            continue;
        }
        status[j] = BASIC;
        integer to = 0;
        for (integer a = 0; a < p; a++)
            if (is_used[a]) inverse[kept * K + to++] = w->square[r * K + a];
        cols[kept++] = j;
    }
    for (integer a = 0; a < p; a++)
        if (is_used[a]) rows[at++] = rows[a];
}

/* Basis inverse of direction q from p candidate rows and c candidate columns, as many as pivot; their number.
 *
 * Arrival-state columns stand in where columns are short. What does not pivot leaves the basis. */
integer factor_basis(const window *w, integer q, integer p, integer c, double threshold)
{
    const integer *status = w->status + q * w->Z;
    integer *row_of = w->candidate, *is_used = w->at_upper, nc = c, k = 0;
    copy_integers(w->chosen, w->cols + q * w->K, c);
    if (p > c)
        for (integer j = 0; j < w->n; j++)
            if (status[j] != BASIC) w->chosen[nc++] = j;
    load_table(w, q, p, nc);
    for (integer a = 0; a < p; a++) is_used[a] = 0;
    for (integer b = 0; b < nc; b++) {
        row_of[b] = k < p ? pivot_row(w, p, b, is_used, threshold) : -1;
        if (row_of[b] < 0) continue;
        is_used[row_of[b]] = 1;
        pivot_on(w, p, nc, row_of[b], b);
        k++;
    }
    keep_pivots(w, q, p, nc, row_of, is_used);
    return k;
}

/* The inverse with one row and one column more: the row that leaves its bounds and the column that enters. */
static void border(const window *w, integer q, integer k, leaving out, integer enter, double theta)
{
    const integer K = w->K;
    double *inverse = w->inverse + q * K * K;
    const double scale = 1.0 / w->alpha[enter];
    for (integer b = 0; b < k; b++) {
        const double factor = w->uk[b] * scale;
        add_multiple(inverse + b * K, factor, w->wk, k);
        inverse[b * K + k] = -factor;
    }
    for (integer a = 0; a < k; a++) inverse[k * K + a] = -w->wk[a] * scale;
    inverse[k * K + k] = scale;
    w->rows[q * K + k] = out.row;
    w->cols[q * K + k] = enter;
    w->multiplier[k] = theta * out.side;
    w->at_upper[k] = out.side > 0.0;
}

/* One active row in place of another. */
static void exchange_rows(const window *w, integer q, integer k, leaving out, integer at, double theta)
{
    const integer K = w->K;
    double *inverse = w->inverse + q * K * K;
    const double scale = 1.0 / w->wk[at];
    for (integer b = 0; b < k; b++) {
        const double factor = inverse[b * K + at] * scale;
        add_multiple(inverse + b * K, -factor, w->wk, k);
        inverse[b * K + at] = factor;
    }
    w->rows[q * K + at] = out.row;
    w->multiplier[at] = theta * out.side;
    w->at_upper[at] = out.side > 0.0;
}

/* One basic column in place of another. */
static void exchange_columns(const window *w, integer q, integer k, integer position, integer enter)
{
    const integer K = w->K;
    double *inverse = w->inverse + q * K * K, *row = inverse + position * K;
    const double scale = 1.0 / w->uk[position];
    for (integer a = 0; a < k; a++) row[a] *= scale;
    for (integer b = 0; b < k; b++)
        if (b != position && w->uk[b] != 0.0) add_multiple(inverse + b * K, -w->uk[b], row, k);
    w->cols[q * K + position] = enter;
}

/* The inverse without a column and a row. */
static void shrink(const window *w, integer q, integer k, integer position, integer at)
{
    const integer K = w->K, last = k - 1;
    double *inverse = w->inverse + q * K * K, *row = inverse + position * K;
    const double scale = 1.0 / row[at];
    for (integer b = 0; b < k; b++) {
        const double factor = inverse[b * K + at] * scale;
        if (b != position && factor != 0.0) add_multiple(inverse + b * K, -factor, row, k);
    }
    if (position != last) {
        copy(row, inverse + last * K, k);
        w->cols[q * K + position] = w->cols[q * K + last];
    }
    if (at != last) {
        for (integer b = 0; b < last; b++) inverse[b * K + at] = inverse[b * K + last];
        w->rows[q * K + at] = w->rows[q * K + last];
        w->multiplier[at] = w->multiplier[last];
        w->at_upper[at] = w->at_upper[last];
    }
}

/* Border, shrink, or exchange a row or a column of the basis inverse; returns its new size.
 *
 * What leaves is out.row, if >= 0, or the basic column at out.position; `enter` is a variable, or Z + the place of an
 * active row. wk is the row of the tableau over active rows, alpha that over variables; theta is the dual step. */
integer change_basis(const window *w, integer q, integer k, leaving out, integer enter, double theta)
{
    const integer Z = w->Z, K = w->K, *rows = w->rows + q * K;
    const double *inverse = w->inverse + q * K * K;
    integer *status = w->status + q * Z;
    if (enter < Z) {
        const double *g = w->GT + enter * w->R;
        for (integer a = 0; a < k; a++) w->move[a] = g[rows[a]];
        for (integer b = 0; b < k; b++) w->uk[b] = dot(inverse + b * K, w->move, k);
        w->d[enter] = 0.0;
        status[enter] = BASIC;
    }
    if (out.row >= 0) {
        if (enter < Z) {
            border(w, q, k, out, enter, theta);
            return k + 1;
        }
        exchange_rows(w, q, k, out, enter - Z, theta);
        return k;
    }
    const integer left = w->cols[q * K + out.position];
    if (enter < Z) {
        exchange_columns(w, q, k, out.position, enter);
    } else {
        shrink(w, q, k, out.position, enter - Z);
        k--;
    }
    status[left] = out.side > 0.0 ? AT_UPPER : AT_LOWER;
    w->d[left] = theta * out.side;
    w->z[left] = out.side;
    return k;
}

/* No basis: every variable at its centre until it is priced. */
void forget_basis(const window *w, integer q)
{
    w->k[q] = 0;
    for (integer j = 0; j < w->Z; j++) w->status[q * w->Z + j] = AT_CENTRE;
}

/* Variables of dropped samples go to their centres; the rows and columns of q that stay come first: their numbers.
 * Returns whether the basis had a part in what was dropped, or in the arrival set, which has moved. */
static integer drop_old(const window *w, integer q, integer base_then, integer dropped, integer *p, integer *c)
{
    const integer n = w->n, nv = w->nv, K = w->K;
    integer *rows = w->rows + q * K, *cols = w->cols + q * K, *status = w->status + q * w->Z, is_touched = 0;
    *p = *c = 0;
    for (integer a = 0; a < w->k[q]; a++) {
        const integer i = rows[a];
        if (i < w->na) is_touched = 1;
        if (i >= w->na && modulo((i - w->na) / w->nr - base_then, w->S) < dropped)
            is_touched = 1;
        else
            rows[(*p)++] = i;
    }
    for (integer b = 0; b < w->k[q]; b++) {
        const integer j = cols[b];
        if (j < n) is_touched = 1;
        if (j >= n && modulo((j - n) / nv - base_then, w->V) < dropped)
            is_touched = 1;
        else
            cols[(*c)++] = j;
    }
    for (integer v = 0; v < w->V; v++)
        if (modulo(v - base_then, w->V) < dropped)
            for (integer j = n + v * nv; j < n + (v + 1) * nv; j++) status[j] = AT_CENTRE;
    return is_touched;
}

/* Carry the basis of direction q over to the present window: what was dropped since leaves it. */
void carry_basis(const window *w, integer q)
{
    const integer base = w->clock[BASE], base_then = w->seen_base[q];
    integer p, c;
    w->seen_base[q] = base;
    if (base == base_then) return;
    if (base_then < 0)
        forget_basis(w, q);
    else if (drop_old(w, q, base_then, base - base_then, &p, &c))
        w->k[q] = factor_basis(w, q, p, c, SAFE_PIVOT);
}

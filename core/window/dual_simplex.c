/* Bounded dual simplex: maximise c'z over -1 <= z <= 1, lower <= G z <= upper.
 *
 * Everything being boxed, any nonsingular basis is dual feasible after flipping bounds: there is no phase 1, and an
 * empty program shows itself with the multipliers that prove it. maximise.c makes a bound of what it ends with.
 */
#include "window.h"

#define FEASIBILITY 1e-9   /* violation of a scaled row or variable that counts as none */
#define ROUNDED (1e3 * UNIT) /* of the terms of a row: what its sums may have lost, besides */
#define NEAR_WORST 0.5     /* of the worst violation: rows from which on the exact norm is asked */
#define REFACTOR 60        /* pivots between factorisations, or as many as the basis has rows: each costs like those */
#define STALLED 1000       /* pivots after which the cost must have fallen: by rounding, a program could go on for ever */

/* target = row of the inverse's rows combined: sum over b of factor_b inverse[b, :]. */
static void combine(const window *w, integer q, integer k, const double *values, double *target)
{
    const integer K = w->K, *cols = w->cols + q * K;
    const double *inverse = w->inverse + q * K * K;
    fill(target, 0.0, k);
    for (integer b = 0; b < k; b++)
        if (values[cols[b]] != 0.0) add_multiple(target, values[cols[b]], inverse + b * K, k);
}

/* Multipliers and reduced costs of the basis; nonbasic variables go to the bound that they like. */
WIDE static void price_out(const window *w, integer q, integer k)
{
    const integer Z = w->Z, *rows = w->rows + q * w->K, *cols = w->cols + q * w->K;
    integer *status = w->status + q * Z;
    double *d = w->d;
    combine(w, q, k, w->cost, w->multiplier);
    copy(d, w->cost, Z);
    for (integer a = 0; a < k; a++) w->wk[a] = -w->multiplier[a];
    add_rows(d, w->G, rows, w->wk, k, Z);
    for (integer b = 0; b < k; b++) d[cols[b]] = 0.0;
    for (integer a = 0; a < k; a++) w->at_upper[a] = w->multiplier[a] >= 0.0;
    for (integer j = 0; j < Z; j++)
        if (status[j] != BASIC && d[j] != 0.0) status[j] = d[j] > 0.0 ? AT_UPPER : AT_LOWER;
}

/* z and the row activities of the basis. */
WIDE static void primal_point(const window *w, integer q, integer k)
{
    const integer Z = w->Z, K = w->K, *rows = w->rows + q * K, *cols = w->cols + q * K, *status = w->status + q * Z;
    const double *inverse = w->inverse + q * K * K;
    integer m = 0;
    for (integer j = 0; j < Z; j++) {
        w->z[j] = status[j] == AT_LOWER ? -1.0 : status[j] == AT_UPPER ? 1.0 : 0.0;
        if (w->z[j] != 0.0) {
            w->candidate[m] = j;
            w->move[m++] = w->z[j];
        }
    }
    fill(w->act, 0.0, w->R);
    add_rows(w->act, w->GT, w->candidate, w->move, m, w->R);
    for (integer a = 0; a < k; a++) w->wk[a] = (w->at_upper[a] ? w->upper : w->lower)[rows[a]] - w->act[rows[a]];
    for (integer b = 0; b < k; b++) w->z[cols[b]] = w->uk[b] = dot(inverse + b * K, w->wk, k);
    add_rows(w->act, w->GT, cols, w->uk, k, w->R);
}

/* How far the active rows are from their bounds, in units of what counts as nothing; wk = what they miss.
 *
 * They are on their bounds but for the errors of the inverse, whose share grows with the basic variables. */
static double misfit(const window *w, integer q, integer k)
{
    const integer *rows = w->rows + q * w->K, *cols = w->cols + q * w->K;
    double worst = 0.0, size = 1.0;
    for (integer a = 0; a < k; a++) {
        const integer i = rows[a];
        w->wk[a] = (w->at_upper[a] ? w->upper : w->lower)[i] - w->act[i];
        worst = larger(fabs(w->wk[a]) / (FEASIBILITY + ROUNDED * w->magnitude[i]), worst);
    }
    for (integer b = 0; b < k; b++) size = larger(fabs(w->z[cols[b]]), size);
    return worst / size;
}

/* One step of iterative refinement: the basic variables move by what the active rows miss, which is in wk. */
static void refine_point(const window *w, integer q, integer k)
{
    const integer K = w->K, *cols = w->cols + q * K;
    const double *inverse = w->inverse + q * K * K;
    for (integer b = 0; b < k; b++) w->z[cols[b]] += w->uk[b] = dot(inverse + b * K, w->wk, k);
    add_rows(w->act, w->GT, cols, w->uk, k, w->R);
}

/* Prices and point of a basis whose inverse is true: refined, or factored anew with ever larger pivots, where the point
 * misses the bounds of active rows. What pivots too little leaves the basis; its size. */
static integer prepare_basis(const window *w, integer q, integer k)
{
    static const double thresholds[] = {CLEAN_PIVOT, SAFE_PIVOT, LARGE_PIVOT, INFINITY};
    price_out(w, q, k);
    primal_point(w, q, k);
    for (integer attempt = 0; misfit(w, q, k) > 1.0; attempt++) {
        refine_point(w, q, k);
        if (misfit(w, q, k) <= 1.0) break;
        w->clock[REFACTORED]++;
        k = factor_basis(w, q, k, k, thresholds[attempt]);
        price_out(w, q, k);
        primal_point(w, q, k);
    }
    return k;
}

/* Violations of the rows, zero for active ones, and the largest, which is not negative. */
WIDE static double violations(const window *w, integer q, integer k)
{
    const integer R = w->R, *rows = w->rows + q * w->K;
    const double *restrict act = w->act, *restrict upper = w->upper, *restrict lower = w->lower;
    double *restrict vio = w->vio, part[4] = {0.0, 0.0, 0.0, 0.0};
    integer i = 0;
    for (integer j = 0; j < R; j++) vio[j] = larger(lower[j] - act[j], act[j] - upper[j]);
    for (integer a = 0; a < k; a++) vio[rows[a]] = 0.0;
    for (; i + 4 <= R; i += 4)
        for (int lane = 0; lane < 4; lane++) part[lane] = larger(vio[i + lane], part[lane]);
    for (; i < R; i++) part[0] = larger(vio[i], part[0]);
    return larger(larger(part[0], part[1]), larger(part[2], part[3]));
}

/* The row that violates its bounds most in the exact steepest-edge norm, among those within a share of the worst. */
static leaving leaving_row(const window *w, integer q, integer k, double *best)
{
    const double *vio = w->vio, worst = violations(w, q, k), threshold = larger(NEAR_WORST * worst, FEASIBILITY);
    leaving out = {-1, -1, 1.0, 0.0};
    if (!(worst > FEASIBILITY)) return out;
    for (integer i = 0; i < w->R; i++) {
        if (!(vio[i] >= threshold)) continue;
        combine(w, q, k, w->G + i * w->Z, w->wk);
        const double norm = 1.0 + sum_of_squares(w->wk, k);
        if (vio[i] * vio[i] > *best * norm) {
            *best = vio[i] * vio[i] / norm;
            out.row = i;
        }
    }
    if (out.row >= 0) {
        out.side = w->act[out.row] > w->upper[out.row] ? 1.0 : -1.0;
        out.violation = vio[out.row];
    }
    return out;
}

/* What leaves: a row, or a basic variable beyond its box; neither (both -1) at the optimum. side is +1 above. */
static leaving choose_leaving(const window *w, integer q, integer k)
{
    const integer K = w->K, *cols = w->cols + q * K;
    double best = 0.0;
    leaving out = leaving_row(w, q, k, &best);
    for (integer b = 0; b < k; b++) {
        const double value = w->z[cols[b]], violation = fabs(value) - 1.0;
        if (!(violation > FEASIBILITY)) continue;
        const double norm = sum_of_squares(w->inverse + (q * K + b) * K, k);
        if (violation * violation > best * norm) {
            best = violation * violation / norm;
            out = (leaving){-1, b, value > 0.0 ? 1.0 : -1.0, violation};
        }
    }
    return out;
}

/* alpha = row of the tableau over z, zero for basic variables; wk = the same over the active rows' bounds. */
WIDE static void tableau_row(const window *w, integer q, integer k, leaving out)
{
    const integer Z = w->Z, K = w->K;
    if (out.row < 0) {
        copy(w->wk, w->inverse + (q * K + out.position) * K, k);
        fill(w->alpha, 0.0, Z);
    } else {
        copy(w->alpha, w->G + out.row * Z, Z);
        combine(w, q, k, w->alpha, w->wk);
    }
    for (integer a = 0; a < k; a++) w->uk[a] = -w->wk[a];
    add_rows(w->alpha, w->G, w->rows + q * K, w->uk, k, Z);
    for (integer b = 0; b < k; b++) w->alpha[w->cols[q * K + b]] = 0.0;
}

/* The variable goes to its other bound, from its centre to the bound that the step likes; how far it moves. */
static double flip_variable(const window *w, integer *status, integer j, double side)
{
    if (*status == AT_CENTRE) {
        *status = side * w->alpha[j] > 0.0 ? AT_LOWER : AT_UPPER;
        return *status == AT_LOWER ? -1.0 : 1.0;
    }
    *status = *status == AT_UPPER ? AT_LOWER : AT_UPPER;
    return *status == AT_LOWER ? -2.0 : 2.0;
}

/* Carry out the flips and the entering move on z, the activities and the bounds of active rows. */
WIDE static void move_point(const window *w, integer q, integer k, entering in, double side)
{
    const integer Z = w->Z, K = w->K, *rows = w->rows + q * K, *cols = w->cols + q * K;
    const double *inverse = w->inverse + q * K * K;
    double *shift = w->uk;
    integer m = 0;
    fill(shift, 0.0, k);
    for (integer f = 0; f <= in.flips; f++) {
        const integer who = w->points[f].who, is_last = f == in.flips;
        if (who < Z) {
            const double dz = is_last ? -side * in.left / w->alpha[who]
                                      : flip_variable(w, w->status + q * Z + who, who, side);
            const double *g = w->GT + who * w->R;
            w->z[who] += dz;
            w->chosen[m] = who;
            w->move[m++] = dz;
            for (integer a = 0; a < k; a++) shift[a] -= dz * g[rows[a]];
        } else {
            const integer a = who - Z;
            const double width = w->upper[rows[a]] - w->lower[rows[a]];
            shift[a] += is_last ? -side * in.left / w->wk[a] : w->at_upper[a] ? -width : width;
            if (!is_last) w->at_upper[a] = !w->at_upper[a];
        }
    }
    for (integer b = 0; b < k; b++) {
        const double value = dot(inverse + b * K, shift, k);
        w->z[cols[b]] += value;
        w->chosen[m] = cols[b];
        w->move[m++] = value;
    }
    add_rows(w->act, w->GT, w->chosen, w->move, m, w->R);
}

/* Multipliers of the rows that no point of the box satisfies together. */
static void store_farkas(const window *w, integer q, integer k, leaving out)
{
    fill(w->farkas, 0.0, w->R);
    for (integer a = 0; a < k; a++) w->farkas[w->rows[q * w->K + a]] = -out.side * w->wk[a];
    if (out.row >= 0) w->farkas[out.row] = out.side;
}

/* One pivot: flips, the move, the dual step by theta, the new basis, whose size it returns. */
static integer pivot(const window *w, integer q, integer k, leaving out, entering in)
{
    const integer enter = w->points[in.flips].who;
    const double theta = w->points[in.flips].ratio;
    move_point(w, q, k, in, out.side);
    if (theta != 0.0) {
        add_multiple(w->d, -theta * out.side, w->alpha, w->Z);
        add_multiple(w->multiplier, -theta * out.side, w->wk, k);
    }
    return change_basis(w, q, k, out, enter, theta);
}

/* Whether the cost has fallen since it was looked at; on a way without end it does not. */
static integer has_fallen(const window *w, double *value)
{
    const double before = *value;
    *value = dot(w->cost, w->z, w->Z);
    return *value < before;
}

/* Bounded dual simplex from the basis of direction q; w->cost is maximised. Returns the outcome. */
integer dual_simplex(const window *w, integer q, integer limit)
{
    const integer without_room = w->clock[CAPPED] ? STOPPED : OVERFULL;
    integer k = prepare_basis(w, q, w->k[q]), since = 0, pivots = 0, outcome = STOPPED;
    double value = INFINITY;
    for (;;) {
        if (since >= most(REFACTOR, k)) {
            since = 0;
            k = prepare_basis(w, q, factor_basis(w, q, k, k, CLEAN_PIVOT));
        }
        const leaving out = choose_leaving(w, q, k);
        if (out.row < 0 && out.position < 0) {
            outcome = OPTIMAL;
            if (since == 0 || misfit(w, q, k) <= 1.0) break;
            outcome = STOPPED;
            since = 0;
            k = prepare_basis(w, q, k);
            continue;
        }
        if (pivots >= limit || (pivots % STALLED == STALLED - 1 && !has_fallen(w, &value))) break;
        if (k + 1 >= w->K) {
            outcome = without_room;
            break;
        }
        tableau_row(w, q, k, out);
        const integer m = collect_breakpoints(w, q, k, out);
        const entering in = choose_entering(w, m, out.violation);
        if (in.flips < 0) {
            store_farkas(w, q, k, out);
            outcome = EMPTY;
            break;
        }
        k = pivot(w, q, k, out, avoid_small_pivot(w, m, in));
        pivots++;
        since++;
    }
    w->k[q] = k;
    w->clock[PIVOTS] += pivots;
    w->clock[PROGRAMS]++;
    return outcome;
}

/* Multipliers of the basis for the cost. */
void price_rows(const window *w, integer q) { combine(w, q, w->k[q], w->cost, w->multiplier); }

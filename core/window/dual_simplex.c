/* Bounded dual simplex: maximise c'z over -1 <= z <= 1, lower <= G z <= upper.
 *
 * Everything being boxed, any nonsingular basis is dual feasible after flipping bounds: there is no phase 1, and an
 * empty program shows itself with the multipliers that prove it. Whatever the pivots did, the value that leaves is
 * the weak-duality sum of the multipliers, rounded outward, hence an outer bound.
 */
#include "window.h"

#define FEASIBILITY 1e-9 /* violation of a scaled row or variable that counts as none */
#define NEAR_WORST 0.5   /* of the worst violation: rows from which on the exact norm is asked */
#define REFACTOR 60      /* pivots between factorisations */
#define CLEAN_PIVOT 1e-11
#define SAFE_PIVOT 1e-6
#define LONG 150         /* pivots after which a program goes on with a cost that is disturbed by */
#define LARGE_JITTER 1e8 /* times the jitter, 1e-3 of the largest cost, and each time by */
#define LESS_JITTER 10.0
#define GAP 1e-9         /* between bound and optimum, as a share of the largest cost, not worth a factorisation */

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

/* Bounded dual simplex from the basis of direction q; w->cost is maximised. Returns the outcome. */
static integer optimise(const window *w, integer q, integer limit)
{
    const integer without_room = w->clock[CAPPED] ? STOPPED : OVERFULL;
    integer k = w->k[q], since = 0, pivots = 0, outcome = STOPPED;
    price_out(w, q, k);
    primal_point(w, q, k);
    for (;;) {
        if (since >= REFACTOR) {
            since = 0;
            k = factor_basis(w, q, k, k, CLEAN_PIVOT);
            price_out(w, q, k);
            primal_point(w, q, k);
        }
        const leaving out = choose_leaving(w, q, k);
        if (out.row < 0 && out.position < 0) {
            outcome = OPTIMAL;
            break;
        }
        if (pivots >= limit) break;
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

/* Weak-duality bound of max cost'z for the multipliers of the active rows, rounded up. */
WIDE static double outer_value(const window *w, integer q)
{
    const integer Z = w->Z, k = w->k[q], *rows = w->rows + q * w->K;
    double *rest = w->alpha, size = 0.0, value = 0.0;
    copy(rest, w->cost, Z);
    for (integer j = 0; j < Z; j++) size += fabs(rest[j]);
    for (integer a = 0; a < k; a++) {
        const integer i = rows[a];
        const double m = w->multiplier[a];
        value += m * (m > 0.0 ? w->upper[i] : w->lower[i]);
        size += fabs(m) * w->magnitude[i];
        w->wk[a] = -m;
    }
    add_rows(rest, w->G, rows, w->wk, k, Z);
    for (integer j = 0; j < Z; j++) value += fabs(rest[j]);
    return value + 2.0 * UNIT * (double)(Z + k + 8) * size;
}

/* How far the Farkas multipliers are from a proof, in floats: negative proves, up to rounding. */
static double farkas_gap(const window *w)
{
    double *total = w->alpha, value = 0.0, size = 0.0;
    fill(total, 0.0, w->Z);
    for (integer i = 0; i < w->R; i++) {
        const double f = w->farkas[i];
        if (f == 0.0) continue;
        value += f * (f > 0.0 ? w->upper[i] : w->lower[i]);
        size += fabs(f) * w->magnitude[i];
        add_multiple(total, f, w->G + i * w->Z, w->Z);
    }
    for (integer j = 0; j < w->Z; j++) value += fabs(total[j]);
    return value + UNIT * size;
}

/* The true cost, disturbed by so many times the jitter. */
static void disturb_cost(const window *w, double factor)
{
    const double scale = factor * largest_magnitude(w->true_cost, w->Z);
    for (integer j = 0; j < w->Z; j++) w->cost[j] = w->true_cost[j] + scale * w->jitter[j];
}

/* Whether the multipliers at hand and the last point, which is one of the window, leave nothing to gain. */
static integer is_close(const window *w, integer q)
{
    copy(w->cost, w->true_cost, w->Z);
    return outer_value(w, q) - dot(w->cost, w->z, w->Z) <= GAP * largest_magnitude(w->cost, w->Z);
}

/* `optimise`; what takes long goes on with a cost that is disturbed far more, then by less and less.
 *
 * In a long window the cost of most variables is next to nothing, so most steps are short: large disturbances save
 * three pivots of four. Any basis being dual feasible, the way back takes no phase of its own; in one leap it took
 * more pivots than all before it, or had no end. */
static integer optimise_patiently(const window *w, integer q, integer limit)
{
    const integer begun = w->clock[PIVOTS];
    disturb_cost(w, 1.0);
    integer outcome = optimise(w, q, least(limit, LONG));
    if (outcome != STOPPED || limit <= LONG) return outcome;
    for (double factor = LARGE_JITTER; factor >= 1.0; factor /= LESS_JITTER) {
        disturb_cost(w, factor);
        outcome = optimise(w, q, most(limit - (w->clock[PIVOTS] - begun), 0));
        if (outcome != OPTIMAL || is_close(w, q)) break;
    }
    return outcome;
}

/* What `optimise_patiently` found; an empty program only with multipliers that prove it, up to rounding: else from a
 * basis that is factored anew, then from none. */
static integer optimise_surely(const window *w, integer q, integer limit)
{
    for (integer attempt = 0; attempt < 3; attempt++) {
        if (attempt == 1) {
            w->clock[REFACTORED]++;
            w->k[q] = factor_basis(w, q, w->k[q], w->k[q], SAFE_PIVOT);
        } else if (attempt == 2) {
            forget_basis(w, q);
        }
        const integer outcome = optimise_patiently(w, q, limit);
        if (outcome != EMPTY || farkas_gap(w) < 0.0) return outcome;
    }
    return STOPPED;
}

/* Outer bound of max cost'z over the window, from the basis of direction q; returns the outcome. */
integer maximise(const window *w, integer q, integer limit, double *bound)
{
    carry_basis(w, q);
    copy(w->true_cost, w->cost, w->Z);
    const integer outcome = optimise_surely(w, q, limit);
    if (outcome == STOPPED) w->clock[STOPS]++;
    copy(w->cost, w->true_cost, w->Z);
    *bound = outer_value(w, q);
    if (outcome == OPTIMAL && *bound - dot(w->cost, w->z, w->Z) > GAP * largest_magnitude(w->cost, w->Z)) {
        /* Breakpoints that the ratio test passed over as small, and multipliers that have drifted, cost the bound
         * something where rows are long and their bounds wide: the same basis, factored and priced anew. */
        w->clock[REFACTORED]++;
        w->k[q] = factor_basis(w, q, w->k[q], w->k[q], CLEAN_PIVOT);
        if (optimise(w, q, least(limit, REFACTOR)) == OPTIMAL) *bound = smaller(outer_value(w, q), *bound);
    }
    return outcome;
}

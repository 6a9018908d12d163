/* The bound that a program gives: a weak-duality sum of its multipliers, which no pivot can make wrong, and tight.
 *
 * For any multipliers m of the rows, max cost'z <= sum of max(m lower, m upper) + |cost - G'm|_1, rounded up. The point
 * of an optimal basis is one of the window, so cost'z is at most the maximum there, and the gap between the two says
 * how much is left: a program whose gap is more than rounding goes on from a basis that is factored anew.
 */
#include "window.h"

#define SMALL_GAP 1e-10  /* between bound and point, of half the width that the bound has: not worth another try; */
#define GAP 1e-7         /* what remains of it after all of them, and does not count as a stop */
#define LONG 150         /* pivots after which a program goes on with a cost that is disturbed by */
#define LARGE_JITTER 1e8 /* times the jitter, 1e-3 of the largest cost, and each time by */
#define LESS_JITTER 10.0

/* value >= cost'z in the window; its rounding; what it has above cost'z at the point of the basis, rounding apart; half
 * the width that the same multipliers leave cost'z. */
typedef struct { double value, rounding, gap, radius; } dual_bound;

/* Weak-duality bound of max cost'z by the multipliers of the active rows, rounded up. */
WIDE static dual_bound outer_bound(const window *w, integer q)
{
    const integer Z = w->Z, k = w->k[q], *rows = w->rows + q * w->K;
    double *rest = w->alpha, size = 0.0, value = 0.0, gap = 0.0, radius = 0.0, left = 0.0;
    copy(rest, w->cost, Z);
    for (integer j = 0; j < Z; j++) size += fabs(rest[j]);
    for (integer a = 0; a < k; a++) {
        const integer i = rows[a];
        const double m = w->multiplier[a], width = w->upper[i] - w->lower[i];
        value += m * (m > 0.0 ? w->upper[i] : w->lower[i]);
        gap += (m > 0.0) == (w->at_upper[a] == 1) ? 0.0 : fabs(m) * width;
        radius += 0.5 * fabs(m) * width;
        size += fabs(m) * w->magnitude[i];
        w->wk[a] = -m;
    }
    add_rows(rest, w->G, rows, w->wk, k, Z);
    for (integer j = 0; j < Z; j++) left += fabs(rest[j]);
    gap += left - dot(rest, w->z, Z);
    const double rounding = 2.0 * UNIT * (double)(Z + k + 8) * size;
    return (dual_bound){value + left + rounding, rounding, gap, radius + left};
}

/* The bound of the true cost by the basis at hand, whatever cost its pivots were about. */
static dual_bound bound_of_basis(const window *w, integer q)
{
    copy(w->cost, w->true_cost, w->Z);
    price_rows(w, q);
    return outer_bound(w, q);
}

/* Whether the point leaves nothing to gain but such a share of the width, and what the multipliers round. */
static integer is_closed(dual_bound bound, double share)
{
    return bound.gap <= share * bound.radius + 8.0 * bound.rounding;
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

/* `dual_simplex`; what takes long goes on with a cost that is disturbed far more, then by less and less.
 *
 * In a long window the cost of most variables is next to nothing, so most steps are short: large disturbances save
 * three pivots of four. Any basis being dual feasible, the way back takes no phase of its own; in one leap it took
 * more pivots than all before it, or had no end. */
static integer optimise_patiently(const window *w, integer q, integer limit)
{
    const integer begun = w->clock[PIVOTS];
    disturb_cost(w, 1.0);
    integer outcome = dual_simplex(w, q, least(limit, LONG));
    if (outcome != STOPPED || limit <= LONG) return outcome;
    for (double factor = LARGE_JITTER; factor >= 1.0; factor /= LESS_JITTER) {
        disturb_cost(w, factor);
        outcome = dual_simplex(w, q, most(limit - (w->clock[PIVOTS] - begun), 0));
        if (outcome != OPTIMAL || is_closed(bound_of_basis(w, q), SMALL_GAP)) break;
    }
    return outcome;
}

/* Outer bound of max cost'z over the window, from the basis of direction q; returns the outcome.
 *
 * What is not sure is tried again: from the same basis, factored anew with ever larger pivots, at last from none. */
integer maximise(const window *w, integer q, integer limit, double *bound)
{
    static const double thresholds[] = {CLEAN_PIVOT, SAFE_PIVOT, INFINITY};
    const integer begun = w->clock[PIVOTS];
    carry_basis(w, q);
    copy(w->true_cost, w->cost, w->Z);
    integer outcome = optimise_patiently(w, q, limit);
    integer is_solved = 0;
    *bound = INFINITY;
    for (integer attempt = 0;; attempt++) {
        const dual_bound found = bound_of_basis(w, q);
        const integer left = limit - (w->clock[PIVOTS] - begun), is_last = attempt == 3 || left <= 0;
        *bound = smaller(found.value, *bound);
        if (outcome == OVERFULL || (outcome == EMPTY && farkas_gap(w) < 0.0)) return outcome;
        is_solved |= outcome == OPTIMAL && is_closed(found, GAP);
        if (is_solved && (is_last || is_closed(found, SMALL_GAP))) return OPTIMAL;
        if (is_last) break;
        w->clock[REFACTORED]++;
        w->k[q] = factor_basis(w, q, w->k[q], w->k[q], thresholds[attempt]);
        outcome = attempt == 0 && outcome == OPTIMAL ? dual_simplex(w, q, least(left, LONG))
                                                     : optimise_patiently(w, q, left);
    }
    w->clock[STOPS]++;
    return STOPPED;
}

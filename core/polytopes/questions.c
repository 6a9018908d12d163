/* Rows as a user gives them, asked in one call: put into even units, a largest ball, upper bounds of supports.
 *
 * Only what floats settle at once is answered: rows without zeros whose largest ball is not small, and forms whose
 * multipliers prove a bound near the value at the point that was found. All else is left to whoever asks.
 */
#include <float.h>

#include "polytopes/polytopes.h"
#include "polytopes/prepared.h"
#include "powers.h"
#include "vectors.h"

static const double ROOMY = 0.03125; /* radius, of the size of b, from which the axes are about even */
static const double SMALLEST = 1e-300; /* scaled numbers below are none */
static const double NOISE = 1e-15;     /* width, of the coordinates, that may be rounding */
enum { EVEN_POWERS = 2, ROUNDS = 3 }; /* exponents by which units of axes may differ from even ones; attempts */

EXPORTED integer fdi_prepared_size(integer d, integer m)
{
    Prepared set;
    return lay_out_prepared(&set, NULL, d, m);
}

EXPORTED integer fdi_prepared_facets_room(integer d, integer m) { return 2 * m + irredundant_room(d, m); }

/* Numbers (m,) of a minimal set of the rows of a prepared set: how many, or -1 if rounding leaves one open. */
EXPORTED integer fdi_prepared_facets(integer d, integer m, double *prepared, integer *chosen, double *block)
{
    Prepared set;
    Memory memory = {block, 0};
    integer *doubtful = integers(&memory, m);
    lay_out_prepared(&set, prepared, d, m);
    const integer count = fdi_irredundant(d, m, set.at, set.b, set.centre, chosen, doubtful, block + memory.used);
    for (integer k = 0; k < count; k++)
        if (doubtful[k]) return -1;
    return count;
}

EXPORTED integer fdi_prepared_ball_room(integer d, integer m) { return d + 1 + 2 * m + fdi_interior_room(d, m); }

/* Centre (d,) and radius of a largest ball of a prepared set in the units of its rows (m, d), one after the other.
 *
 * 0 if no finite one was found whose radius is within `clean` of what its multipliers prove, up to rounding.
 */
EXPORTED integer fdi_prepared_ball(integer d, integer m, const double *rows, double *prepared, double times, double clean,
                                   double *ball, double *block)
{
    Prepared set;
    lay_out_prepared(&set, prepared, d, m);
    double *found = block, *norms = found + d + 1 + m, *scratch = norms + m, proved = 0.0;
    integer top = -10000;
    for (integer i = 0; i < m; i++) {
        norms[i] = sqrt(sum_of_squares(rows + i * d, d));
        if (!(norms[i] > 1e-150 && norms[i] < 1e150)) return 0;
        top = most(top, exponent_of(norms[i]) + set.r[i]);
    }
    for (integer i = 0; i < m; i++) norms[i] = times_power(norms[i], set.r[i] - top); /* radii are 2^-top as large */
    if (fdi_interior(d, m, set.at, set.b, norms, set.centre, times, found, scratch) != OPTIMAL) return 0;
    double radius = INFINITY;
    for (integer i = 0; i < m; i++) {
        double slack = set.b[i];
        for (integer j = 0; j < d; j++) slack -= set.at[j * m + i] * found[j];
        radius = smaller(slack / norms[i], radius);
        proved += found[d + 1 + i] * set.b[i];
    }
    if (!(found[d] < INFINITY && radius > 0.0 && fabs(proved - radius) <= clean * radius)) return 0;
    for (integer j = 0; j < d; j++) ball[j] = times_power(found[j], set.s[j]);
    ball[d] = times_power(radius, -top);
    return 1;
}

static const double TIGHT = 1e-14; /* gap, of the terms, that rounding leaves */
static const double LOST = 1e-6;   /* of the largest entry: beside smaller ones floats do not vouch for a ray */

typedef struct {
    double *forms, *found, *gaps;
    integer *tops, *codes;
    double *scratch;
} Question;

static integer lay_out_question(Question *question, double *block, integer d, integer m, integer k)
{
    Memory memory = {block, 0};
    question->forms = doubles(&memory, k * d), question->found = doubles(&memory, (3 * d + 2) * k);
    question->gaps = doubles(&memory, 3 * k);
    question->tops = integers(&memory, k), question->codes = integers(&memory, (d + 1) * k);
    question->scratch = doubles(&memory, fdi_supports_room(d, m, k));
    return memory.used;
}

static void ask_axes(const Question *axes, integer d)
{
    fill(axes->forms, 0.0, 2 * d * d);
    for (integer j = 0; j < d; j++) axes->forms[j * d + j] = 0.5, axes->forms[(d + j) * d + j] = -0.5;
}

/* Widths (d,) along the axes, seen from a centre, of an infinite one that of the steepest row; 0 if one may be rounding. */
static int measure_axes(const Prepared *set, integer d, integer m, const double *centre, double radius, double *width,
                        double *block)
{
    Question axes;
    Memory memory = {block, 0};
    double *slack = doubles(&memory, m);
    lay_out_question(&axes, block + memory.used, d, m, 2 * d);
    ask_axes(&axes, d);
    fdi_supports(d, m, 2 * d, set->at, set->b, centre, axes.forms, axes.found, axes.codes, NULL, axes.scratch);
    copy(slack, set->b, m);
    for (integer j = 0; j < d; j++)
        for (integer i = 0; i < m; i++) slack[i] -= set->at[j * m + i] * centre[j];
    const integer *status = axes.codes + 2 * d * d;
    for (integer j = 0; j < d; j++) {
        const double high = axes.found[j * d + j], low = axes.found[(d + j) * d + j];
        double steepest = 0.0;
        for (integer i = 0; i < m; i++) steepest = larger(steepest, fabs(set->at[j * m + i]) / larger(slack[i], radius));
        width[j] = status[j] == OPTIMAL && status[d + j] == OPTIMAL ? high - low : 1.0 / steepest;
        if (!(width[j] > NOISE * larger(fabs(high), fabs(low)) && width[j] < INFINITY)) return 0;
    }
    return 1;
}

/* Puts the axes into units in which a set is about as wide along each: entries alone do not tell small ones that matter
 * from those that do not. 0 if they are so, or numbers would be lost.
 */
static int even_out(Prepared *set, integer d, integer m, const double *centre, double radius, double *block)
{
    Memory memory = {block, 0};
    double *width = doubles(&memory, d);
    integer low = 10000, high = -10000;
    if (!measure_axes(set, d, m, centre, radius, width, block + memory.used)) return 0;
    for (integer j = 0; j < d; j++) low = least(low, exponent_of(width[j])), high = most(high, exponent_of(width[j]));
    if (high - low <= EVEN_POWERS) return 0;
    for (integer j = 0; j < d; j++)
        for (integer i = 0; i < m; i++) {
            const double value = set->at[j * m + i];
            if (value != 0.0 && fabs(times_power(value, exponent_of(width[j]))) < SMALLEST) return 0;
        }
    for (integer i = 0; i < m; i++) {
        double square = 0.0;
        for (integer j = 0; j < d; j++) {
            set->at[j * m + i] = times_power(set->at[j * m + i], exponent_of(width[j]));
            square += set->at[j * m + i] * set->at[j * m + i];
        }
        const double norm = sqrt(square);
        const integer shift = exponent_of(norm);
        for (integer j = 0; j < d; j++) set->at[j * m + i] = times_power(set->at[j * m + i], -shift);
        set->norms[i] = times_power(norm, -shift), set->b[i] = times_power(set->b[i], -shift), set->r[i] -= shift;
    }
    for (integer j = 0; j < d; j++) set->s[j] += exponent_of(width[j]);
    return 1;
}

EXPORTED integer fdi_prepared_room(integer d, integer m)
{
    Question axes;
    const integer even = m + d + lay_out_question(&axes, NULL, d, m, 2 * d);
    return d + 1 + m + d + most(most(2 * m, even), most(fdi_scaled_room(m, d), fdi_interior_room(d, m)));
}

/* Prepares rows (m, d), rhs (m,); 0 if one is zero or out of reach, or if the largest ball is not clear: found, of a
 * radius above so much of the size of b, its centre inside whatever was rounded. times: as fdi_interior.
 */
EXPORTED integer fdi_prepared(integer d, integer m, const double *rows, const double *rhs, double times, double least_ball,
                              double *prepared, double *block)
{
    Prepared set;
    lay_out_prepared(&set, prepared, d, m);
    double *found = block, *origin = found + d + 1 + m, *scratch = origin + d;
    if (fdi_scaled(m, d, rows, rhs, set.at, set.s, scratch) < m) return 0;
    if (set.rest[m] >= 0 || set.rest[m + 1] >= 0) return 0;
    const Rows all = {d, m, m, set.at, set.b};
    integer status = OPTIMAL;
    for (integer round = 0; round <= ROUNDS; round++) {
        fill(origin, 0.0, d);
        status = fdi_interior(d, m, set.at, set.b, set.norms, origin, times, found, scratch);
        *set.size = scale_of(&all);
        if (status != OPTIMAL || !(found[d] > 0.0) || found[d] > ROOMY * *set.size) break;
        if (round == ROUNDS || !even_out(&set, d, m, found, found[d], scratch)) break;
    }
    *set.radius = found[d], set.reach[0] = NAN;
    copy(set.centre, found, d);
    for (integer j = 0; j < d; j++) set.point[j] = times_power(found[j], set.s[j]);
    copy(set.multipliers, found + d + 1, m);
    if (status != OPTIMAL || !(found[d] > least_ball * *set.size)) return 0;
    return fdi_strictly_inside(d, m, set.at, set.b, set.centre, NULL, NULL, scratch);
}

EXPORTED integer fdi_prepared_supports_room(integer d, integer m, integer k)
{
    Question own, axes;
    return lay_out_question(&own, NULL, d, m, k) + lay_out_question(&axes, NULL, d, m, 2 * d) + 4 * d * d;
}

static void solve(const Prepared *set, integer d, integer m, integer k, const Question *question, double *weights)
{
    fdi_supports(d, m, k, set->at, set->b, set->centre, question->forms, question->found, question->codes, weights,
                 question->scratch);
}

/* Bounds (d,) of |x| over the set from those along the axes (see `proved_reach` in Python); 0 if there are none. */
static int find_reach(Prepared *set, integer d, integer m, double *block)
{
    Question axes;
    lay_out_question(&axes, block, d, m, 2 * d);
    ask_axes(&axes, d);
    solve(set, d, m, 2 * d, &axes, NULL);
    const double *beside = axes.found + 4 * d * d, *bounds = beside + 2 * d * d;
    double farthest = 0.0, steepest = 0.0;
    for (integer q = 0; q < 2 * d; q++)
        if (axes.codes[2 * d * d + q] != OPTIMAL) return 0;
    for (integer j = 0; j < d; j++) {
        double slope = 0.0;
        for (integer i = 0; i < d; i++) slope += 2.0 * larger(beside[j * d + i], beside[(d + j) * d + i]);
        const double value = larger(larger(2.0 * bounds[j], 2.0 * bounds[d + j]), 0.0);
        farthest = larger(farthest, value), steepest = larger(steepest, slope);
        axes.gaps[j] = slope, set->reach[j] = value;
    }
    if (!(steepest < 0.25 && farthest < INFINITY)) return 0; /* then max |x| <= max v / (1 - 1/4) */
    for (integer j = 0; j < d; j++)
        set->reach[j] = (set->reach[j] + axes.gaps[j] * 2.0 * farthest) * (1.0 + 8.0 * EPS);
    return 1;
}

/* Bounds (d,) `reach` of |x| over the set from the rows W whose multipliers y prove its largest ball; 0 if there are none.
 *
 * y'A is about zero, so that no slack of a row in W is above y'b / y_i, and seen from the centre c no |a_i'(x - c)| is
 * above that. With R the inverse of d of these rows, |x - c| <= |R| times that, up to what rounding left: of R, F = R A - I,
 * and e = y'A, both of which count with |x| itself.
 */
static int reach_of_ball(const Prepared *set, integer d, integer m, double *reach, double *block)
{
    Memory memory = {block, 0};
    integer *W = integers(&memory, d + 1), count = 0, least_one = 0;
    double *work = doubles(&memory, 2 * d * d), *R = doubles(&memory, d * d), *e = doubles(&memory, d);
    double *most_slack = doubles(&memory, d + 1), total = 0.0, missed = 0.0, centre = 0.0, far = 0.0, turned = 0.0;
    for (integer i = 0; i < m; i++) {
        if (!(set->multipliers[i] > 0.0)) continue;
        if (count > d) return 0;
        W[count++] = i;
    }
    if (count <= d || !(*set->radius < INFINITY)) return 0;
    double terms = 0.0;
    for (integer k = 0; k <= d; k++) {
        const double part = set->multipliers[W[k]] * set->b[W[k]];
        total += part, terms += fabs(part);
        if (set->multipliers[W[k]] < set->multipliers[W[least_one]]) least_one = k;
    }
    total += (double)(d + 4) * EPS * terms;
    for (integer j = 0; j < d; j++) {
        double sum = 0.0, size = 0.0;
        for (integer k = 0; k <= d; k++) {
            const double part = set->multipliers[W[k]] * set->at[j * m + W[k]];
            sum += part, size += fabs(part);
        }
        missed += fabs(sum) + (double)(d + 4) * EPS * size, centre = larger(centre, fabs(set->centre[j]));
    }
    W[least_one] = W[d];
    const Rows rows = {d, m, m, set->at, set->b};
    if (!invert_basis(&rows, W, R, work)) return 0;
    for (integer k = 0; k < d; k++) most_slack[k] = (total + missed * centre) / set->multipliers[W[k]];
    for (integer j = 0; j < d; j++) { /* Q = R transposed: edge k is column k of R */
        double sum = 0.0, again = 0.0;
        for (integer k = 0; k < d; k++) {
            const double entry = fabs(R[k * d + j]);
            sum += entry * (most_slack[k] + *set->radius), again += entry * missed / set->multipliers[W[k]];
        }
        far = larger(far, sum), e[j] = again;
    }
    for (integer j = 0; j < d; j++) {
        double off = e[j];
        for (integer l = 0; l < d; l++) {
            double sum = j == l ? -1.0 : 0.0, size = 1.0;
            for (integer k = 0; k < d; k++) {
                const double part = R[k * d + j] * set->at[l * m + W[k]];
                sum += part, size += fabs(part);
            }
            off += fabs(sum) + (double)(d + 4) * EPS * size;
        }
        turned = larger(turned, off);
    }
    if (!(turned < 0.25 && far < INFINITY)) return 0;
    for (integer j = 0; j < d; j++) reach[j] = fabs(set->centre[j]) + 1.5 * far;
    return 1;
}

/* Forms (k, d) in the units of the set, their largest entries about one. */
static void scale_forms(const Prepared *set, integer d, integer k, const double *directions, const Question *question)
{
    for (integer q = 0; q < k; q++) {
        double *form = question->forms + q * d;
        for (integer j = 0; j < d; j++) form[j] = times_power(directions[q * d + j], set->s[j]);
        question->tops[q] = exponent_of(largest_magnitude(form, d));
        for (integer j = 0; j < d; j++) form[j] = times_power(form[j], -question->tops[q]);
    }
}

/* Whether the bounds that were proven are as near to the values at the points as rounding lets them be. */
static int tight(integer k, integer d, const Question *question)
{
    const integer *status = question->codes + k * d;
    for (integer q = 0; q < k; q++)
        if (status[q] == OPTIMAL && !(question->gaps[k + q] <= TIGHT * question->gaps[2 * k + q])) return 0;
    return 1;
}

/* The bounds of the forms that were solved, by a bound of |x|: first by one that costs nothing, and where that is not near
 * enough by one from programs along all axes, which is kept. */
static int bounds_of(Prepared *set, integer d, integer m, integer k, const Question *question, double *block)
{
    const double *beside = question->found + 2 * k * d, *bounds = beside + k * d;
    double *near = block;
    int rounded = 0;
    for (integer q = 0; q < k * d; q++) rounded |= beside[q] > 0.0;
    const int quick = !rounded || reach_of_ball(set, d, m, near, block + d);
    if (quick) {
        fdi_gaps(d, k, question->forms, question->found, bounds, bounds + k, beside, near, question->gaps);
        if (!rounded || tight(k, d, question)) return 1;
    }
    if (isnan(set->reach[0]) && !find_reach(set, d, m, block)) {
        set->reach[0] = NAN;
        return 0;
    }
    fdi_gaps(d, k, question->forms, question->found, bounds, bounds + k, beside, set->reach, question->gaps);
    return 1;
}

/* A lower bound of a form over a prepared set: its value at a point z, drawn towards the centre of the largest ball until
 * it breaks no row, whatever was rounded. */
static double lower_bound(const Prepared *set, integer d, integer m, const double *form, const double *z)
{
    const double *c = set->centre, unit = (double)(d + 3) * EPS;
    double back = 0.0, value = 0.0, inside = 0.0, sizes = 0.0;
    for (integer i = 0; i < m; i++) {
        double beyond = -set->b[i], slack = set->b[i], size = fabs(set->b[i]), other = size;
        for (integer j = 0; j < d; j++) {
            const double a = set->at[j * m + i];
            beyond += a * z[j], size += fabs(a * z[j]);
            slack -= a * c[j], other += fabs(a * c[j]);
        }
        const double broken = larger(beyond, 0.0) + unit * size, room = larger(slack - unit * other, 0.0);
        if (broken > 0.0) back = larger(broken / (broken + room), back);
    }
    for (integer j = 0; j < d; j++) {
        value += form[j] * z[j], inside += form[j] * c[j];
        sizes += fabs(form[j] * z[j]) + fabs(form[j] * c[j]);
    }
    return value - back * larger(value - inside, 0.0) - 3.0 * unit * sizes;
}

/* Whether floats tell a ray of a prepared set from a long edge: not where entries are lost beside others. */
static int tells_rays(const Prepared *set, integer d, integer m)
{
    double least = INFINITY, most = 0.0;
    for (integer k = 0; k < d * m; k++) {
        const double size = fabs(set->at[k]);
        most = larger(most, size);
        if (size > 0.0) least = smaller(least, size);
    }
    return least >= LOST * most;
}

/* Upper bounds (k,) of the supports of a prepared set along directions (k, d), infinite where it is unbounded.
 *
 * 0 if a bound is neither within `clean` of the sizes of its terms nor within `sharp` of the radius (and rounding) of the
 * value that was found, a ray is not told from a long edge, or a form was not solved. Points (k, d) and multipliers of
 * the rows (k, m), zero before, are left if there is room for them (else NULL), and lower bounds (k,). They mean
 * something only where values are finite.
 */
EXPORTED integer fdi_prepared_supports(integer d, integer m, integer k, double *prepared, const double *directions,
                                       double clean, double sharp, double *values, double *points, double *weights,
                                       double *lower, double *block)
{
    Prepared set;
    Question question;
    lay_out_prepared(&set, prepared, d, m);
    const integer used = lay_out_question(&question, block, d, m, k);
    scale_forms(&set, d, k, directions, &question);
    solve(&set, d, m, k, &question, weights);
    if (!bounds_of(&set, d, m, k, &question, block + used)) return 0;
    const integer *status = question.codes + k * d;
    for (integer q = 0; q < k; q++) {
        const double gap = question.gaps[k + q], terms = question.gaps[2 * k + q];
        values[q] = INFINITY;
        if (status[q] == UNBOUNDED && tells_rays(&set, d, m)) continue;
        const double room = smaller(clean * terms, sharp * larger(*set.radius, 0.0) + 8.0 * EPS * terms);
        if (status[q] != OPTIMAL || !(gap <= room)) return 0;
        values[q] = times_power(question.gaps[q], question.tops[q]);
        if (!(fabs(values[q]) < INFINITY)) return 0;
        const double *z = question.found + q * d;
        if (lower) lower[q] = times_power(lower_bound(&set, d, m, question.forms + q * d, z), question.tops[q]);
        if (points)
            for (integer j = 0; j < d; j++) points[q * d + j] = times_power(z[j], set.s[j]);
        if (weights)
            for (integer i = 0; i < m; i++)
                weights[q * m + i] = smaller(times_power(weights[q * m + i], set.r[i] + question.tops[q]), DBL_MAX);
    }
    return 1;
}

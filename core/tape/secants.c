/* Secants: of a function phi on [a, b] a slope q, and an interval that contains phi(s) - q s for all s there.
 *
 * Any slope would be sound, so slopes are computed in doubles; what they leave out is bounded with outward rounding. A
 * chord and the parallel tangent enclose a convex or concave function (Chebyshev's slope, as in affine arithmetic: de
 * Figueiredo and Stolfi, Numerical Algorithms 37 (2004)); sin and cos take one-sided bounds of second order, piece by piece
 * where an interval is wide; what bends both ways takes the slope that leaves out least.
 */
#include "tape/tape.h"

static const double NEAR = 1e-7;         /* relative width of [a, b] below which a chord's slope is lost to rounding */
static const double FLAT_ROOT = 1e-150;  /* size of a root below which its slope may overflow */
static const double GOLDEN = 0.6180339887498949;
static const integer SECTIONS = 10; /* golden ones: the slope is within a hundredth of its range from the best */

/* The ends of an argument and what a function is there. */
typedef struct { fdi_interval a, low, high; } ends;

static secant flat(fdi_interval values) { return (secant){0.0, values}; }

static secant mirrored(secant of) { return (secant){of.slope, opposite(of.rest)}; }

/* phi(s) - q s. */
static fdi_interval rest_at(fdi_interval value, double q, double s) { return difference(value, product(at(q), at(s))); }

/* Of a convex function whose phi(s) - q s is at least so much everywhere. */
static secant convex(ends e, double q, double least)
{
    return (secant){q, {least, larger(rest_at(e.low, q, e.a.low).high, rest_at(e.high, q, e.a.high).high)}};
}

static secant concave(ends e, double q, double most)
{
    return (secant){q, {smaller(rest_at(e.low, q, e.a.low).low, rest_at(e.high, q, e.a.high).low), most}};
}

static int is_near(fdi_interval a) { return width(a) <= NEAR * magnitude(a); }

static double chord(fdi_interval a, fdi_interval values) { return width(values) / width(a); }

static secant of_square(fdi_interval a)
{
    const double q = a.low + a.high;
    const ends e = {a, square(at(a.low)), square(at(a.high))};
    return convex(e, q, -product(at(0.25), square(at(q))).high);
}

static secant of_root(fdi_interval a, fdi_interval values)
{
    const double total = values.low + values.high, q = 1.0 / total;
    const ends e = {a, root(at(a.low)), root(at(a.high))};
    if (total <= FLAT_ROOT) return flat(values);
    return concave(e, q, product(at(0.25), inverse(at(q))).high);
}

static secant of_exponential(fdi_interval a, fdi_interval values)
{
    const double q = is_near(a) ? middle(fdi_exp_at(middle(a))) : chord(a, values);
    if (!(0.0 < q && q < INFINITY)) return flat(values);
    const ends e = {a, fdi_exp_at(a.low), fdi_exp_at(a.high)};
    return convex(e, q, product(at(q), difference(at(1.0), fdi_log_at(q))).low); /* where its derivative is q */
}

static secant of_logarithm(fdi_interval a, fdi_interval values)
{
    const double q = is_near(a) ? 1.0 / middle(a) : chord(a, values);
    if (!(0.0 < q && q < INFINITY)) return flat(values);
    const ends e = {a, fdi_log_at(a.low), fdi_log_at(a.high)};
    return concave(e, q, -sum(fdi_log_at(q), at(1.0)).low);
}

static secant of_inverse(fdi_interval a, fdi_interval values)
{
    if (a.high < 0.0) return mirrored(of_inverse(opposite(a), opposite(values)));
    const double q = -(1.0 / a.low) * (1.0 / a.high);
    if (!(1e-300 < -q && -q < INFINITY)) return flat(values);
    const ends e = {a, inverse(at(a.low)), inverse(at(a.high))};
    return convex(e, q, 2.0 * root(at(-q)).low);
}

static secant of_magnitude(fdi_interval a)
{
    if (a.low >= 0.0 || a.high <= 0.0) return (secant){a.low >= 0.0 ? 1.0 : -1.0, at(0.0)};
    const double q = (a.high + a.low) / (a.high - a.low);
    const fdi_interval low = rest_at(at(-a.low), q, a.low), high = rest_at(at(a.high), q, a.high);
    return (secant){q, {smaller(0.0, smaller(low.low, high.low)), larger(0.0, larger(low.high, high.high))}};
}

/* -- functions that bend both ways ---------------------------------------------------------------- */

typedef fdi_interval (*rest_of)(const ends *, double q);

/* The slope with the narrowest rest, whose width is a convex function of the slope. */
static secant narrowest(rest_of rest, const ends *e, double low, double high)
{
    double p = high - GOLDEN * (high - low), q = low + GOLDEN * (high - low);
    fdi_interval at_p = rest(e, p), at_q = rest(e, q);
    for (integer i = 0; i < SECTIONS; i++) {
        if (width(at_p) < width(at_q)) {
            high = q, q = p, at_q = at_p;
            p = high - GOLDEN * (high - low);
            at_p = rest(e, p);
        } else {
            low = p, p = q, at_p = at_q;
            q = low + GOLDEN * (high - low);
            at_q = rest(e, q);
        }
    }
    return width(at_p) < width(at_q) ? (secant){p, at_p} : (secant){q, at_q};
}

/* Of the signed root over an interval around zero: extremes at the ends and at s = +-1 / (4 q^2). */
static fdi_interval rest_of_signed_root(const ends *e, double q)
{
    const fdi_interval low = rest_at(e->low, q, e->a.low), high = rest_at(e->high, q, e->a.high);
    const double peak = product(at(0.25), inverse(at(q))).high;
    const double turn = below(0.25 / above(q * q)); /* not above the point of the peak */
    const double least = -e->a.low > turn ? -peak : 0.0, most = e->a.high > turn ? peak : 0.0;
    return interval(smaller(least, smaller(low.low, high.low)), larger(most, larger(low.high, high.high)));
}

static secant of_signed_root(fdi_interval a, fdi_interval values)
{
    if (a.low >= 0.0) return of_root(a, values);
    if (a.high <= 0.0) return mirrored(of_root(opposite(a), opposite(values)));
    const double largest = sqrt(magnitude(a));
    if (largest <= FLAT_ROOT) return flat(values);
    /* Between the chord's slope and the steepest that helps; 1.2071 / sqrt(d) is best on [-d, d]. */
    const ends e = {a, signed_root_at(a.low), signed_root_at(a.high)};
    return narrowest(rest_of_signed_root, &e, 0.5 / largest, 1.7 / largest);
}

/* Where the derivative of tanh is q: s = artanh(r) = log((1 + r) / sqrt(q)), r = sqrt(1 - q), 0 < q < 1. */
static fdi_interval turn_of_tangent(double q, fdi_interval r)
{
    const fdi_interval one = sum(at(1.0), r);
    const fdi_interval high = fdi_log_at(one.high), low = fdi_log_at(one.low), half = product(at(0.5), fdi_log_at(q));
    return difference(interval(low.low, high.high), half);
}

/* tanh(s) - q s there: r - (1 - r^2) artanh(r) = 2/3 r^3 + 2/15 r^5 + ..., each factor at most r^2. */
static double peak_of_tangent(double q, fdi_interval r, fdi_interval turn)
{
    if (r.high > 0.1) return difference(r, product(at(q), turn)).high;
    const double square = above(r.high * r.high), tail = 1.0 + square * 0.21;
    return (2.0 / 3.0) * r.high * square * tail * (1.0 + 8.0 * EPS) + 0x1p-1000;
}

static fdi_interval rest_of_tangent(const ends *e, double q)
{
    const fdi_interval low = rest_at(e->low, q, e->a.low), high = rest_at(e->high, q, e->a.high);
    double least = smaller(low.low, high.low), most = larger(low.high, high.high);
    if (0.0 < q && q < 1.0) {
        const fdi_interval r = root(difference(at(1.0), at(q))), turn = turn_of_tangent(q, r);
        const double peak = peak_of_tangent(q, r, turn);
        if (turn.low <= e->a.high && turn.high >= e->a.low) most = larger(most, peak);
        if (-turn.high <= e->a.high && -turn.low >= e->a.low) least = smaller(least, -peak);
    }
    return interval(least, most);
}

static secant narrower(secant found, fdi_interval values)
{
    return width(found.rest) < width(values) ? found : flat(values);
}

static secant of_tangent(fdi_interval a, fdi_interval values)
{
    const ends e = {a, fdi_tanh_at(a.low), fdi_tanh_at(a.high)};
    if (a.low < 0.0 && 0.0 < a.high) return narrower(narrowest(rest_of_tangent, &e, 0.0, 1.0), values);
    const double t = middle(fdi_tanh_at(middle(a)));
    const double q = is_near(a) ? (1.0 - t) * (1.0 + t) : chord(a, values);
    return narrower((secant){q, rest_of_tangent(&e, q)}, values); /* it bends one way */
}

/* From value and slope at the middle, and the range of the second derivative, which is minus that of the values. */
static secant of_wave(fdi_interval a, fdi_interval values, double m, fdi_interval value, fdi_interval slope)
{
    const double q = middle(slope), reach = above(larger(a.high - m, m - a.low));
    const fdi_interval tilt = product(interval(-reach, reach), difference(slope, at(q)));
    const fdi_interval half = interval(0.0, product(at(0.5), square(at(reach))).high);
    const fdi_interval curve = product(half, opposite(values));
    const fdi_interval bend = interval(smaller(0.0, curve.low), larger(0.0, curve.high));
    const fdi_interval anchor = difference(value, product(at(q), at(m)));
    return narrower((secant){q, sum(sum(anchor, tilt), bend)}, values);
}

/* Where an interval is so wide that sin or cos bends both ways: bounds of second order on each of its pieces. */
enum { MOST_PIECES = 32 };
static const double PIECE = 0.25;          /* width of a piece, at most */
static const double BENDS_BOTH_WAYS = 0.5; /* width below which one piece does */
static const double FAR = 0x1p30;          /* from where on centres of pieces are too coarse to pay */

typedef struct {
    ends e; /* first, so that a pointer to it is one to all */
    integer count;
    double reach, centre[MOST_PIECES];
    fdi_interval value[MOST_PIECES], slope[MOST_PIECES], bend[MOST_PIECES];
} pieces;

static fdi_interval rest_of_pieces(const ends *e, double q)
{
    const pieces *p = (const pieces *)e;
    fdi_interval rest = {INFINITY, -INFINITY};
    for (integer i = 0; i < p->count; i++) {
        const double tilt = above(magnitude(difference(p->slope[i], at(q))) * p->reach);
        const fdi_interval straight = sum(rest_at(p->value[i], q, p->centre[i]), interval(-tilt, tilt));
        const fdi_interval piece = sum(straight, p->bend[i]);
        rest = interval(smaller(rest.low, piece.low), larger(rest.high, piece.high));
    }
    return rest;
}

static secant of_pieces(integer op, fdi_interval a)
{
    pieces p = {.e.a = a, .count = (integer)ceil(width(a) / PIECE)};
    const double step = width(a) / (double)p.count;
    p.reach = above(0.5 * step + 4.0 * EPS * magnitude(a)); /* centres are rounded */
    const fdi_interval half = interval(0.0, product(at(0.5), square(at(p.reach))).high);
    for (integer i = 0; i < p.count; i++) {
        const double c = p.centre[i] = a.low + ((double)i + 0.5) * step;
        const fdi_interval sine = fdi_sin_at(c), cosine = fdi_cos_at(c);
        p.value[i] = op == SIN ? sine : cosine;
        p.slope[i] = op == SIN ? cosine : opposite(sine);
        /* The second derivative is minus the function, which changes by at most `reach`. */
        p.bend[i] = product(half, opposite(sum(p.value[i], interval(-p.reach, p.reach))));
    }
    return narrowest(rest_of_pieces, &p.e, -1.0, 1.0);
}

static secant of_sine_or_cosine(integer op, fdi_interval a, fdi_interval values)
{
    const double m = middle(a);
    const fdi_interval sine = fdi_sin_at(m), cosine = fdi_cos_at(m);
    const secant one = op == SIN ? of_wave(a, values, m, sine, cosine) : of_wave(a, values, m, cosine, opposite(sine));
    const int pays = width(a) > BENDS_BOTH_WAYS && width(a) <= MOST_PIECES * PIECE && magnitude(a) < FAR;
    const secant many = pays ? of_pieces(op, a) : one;
    return width(many.rest) < width(one.rest) ? many : one;
}

static secant of_operation(integer op, fdi_interval a, fdi_interval values)
{
    switch (op) {
    case SQR: return of_square(a);
    case INV: return of_inverse(a, values);
    case SQRT: return of_root(a, values);
    case EXP: return of_exponential(a, values);
    case LOG: return of_logarithm(a, values);
    case SIN:
    case COS: return of_sine_or_cosine(op, a, values);
    case TANH: return of_tangent(a, values);
    case ABS: return of_magnitude(a);
    case SROOT: return of_signed_root(a, values);
    default: return flat(values); /* SIGN */
    }
}

secant tape_secant(integer op, fdi_interval a, fdi_interval values)
{
    const secant found = of_operation(op, a, values);
    return fabs(found.slope) < INFINITY && is_bounded(found.rest) ? found : flat(values);
}

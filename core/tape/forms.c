/* Linear forms with remainders: an operation of forms is a form and an interval, each of which cuts the other.
 *
 * Sums of doubles are bounded by the sizes of their terms. A product keeps the sign of its squares, (z_j - c_j)^2 >= 0.
 */
#include "tape/tape.h"

static const double ROUNDED = 1.0 * EPS; /* of a term: two roundings, so that bounds of rounding may be rounded too */

#define EACH(j, s) (integer n_ = 0, j; n_ < (s)->count && (j = (s)->column[n_], 1); n_++)

static double largest(fdi_interval rest) { return larger(-rest.low, rest.high); }

static fdi_interval scaled(double slope, fdi_interval rest) /* rounded to nearest */
{
    const double first = slope * rest.low, last = slope * rest.high;
    return interval(smaller(first, last), larger(first, last));
}

static double reach_of(const double *g, const support *s)
{
    double reach = 0.0;
    for EACH(j, s) reach += fabs(g[j]) * s->radius[j];
    return reach;
}

/* Bound of the terms of a form. */
static double size_of(const form *f) { return fabs(f->k) + f->reach + largest(f->rest); }

/* Where a number is none, the first operand of `larger` and `smaller` is dropped: what is no bound stays no bound. */
void form_cut(form *f, const support *s)
{
    const double ends = larger(largest(f->rest), magnitude(f->range));
    const double lost = (double)(s->count + 4) * ROUNDED * (fabs(f->k) + f->reach + ends) + s->tiny;
    const double low = f->k - f->reach - lost, high = f->k + f->reach + lost;
    f->rest = interval(larger(f->range.low - high - lost, f->rest.low), smaller(f->range.high - low + lost, f->rest.high));
    f->range = interval(larger(low + f->rest.low, f->range.low), smaller(high + f->rest.high, f->range.high));
}

/* k, g and rest are sums in doubles of terms of this size in all, each rounded a few times. */
static void rounded(form *f, double size, const support *s)
{
    const double lost = (double)(s->count + 8) * ROUNDED * size + s->tiny;
    f->rest.low -= lost;
    f->rest.high += lost;
    form_cut(f, s);
}

void form_within(form *f, fdi_interval values, const support *s)
{
    f->range = interval(larger(values.low, f->range.low), smaller(values.high, f->range.high));
    form_cut(f, s);
}

void form_of_coordinate(form *f, double centre, double radius, fdi_interval values, integer column)
{
    f->k = centre, f->rest = at(0.0), f->range = values, f->reach = radius;
    f->g[column] = 1.0;
}

void form_of_constant(form *f, fdi_interval values, const support *s)
{
    f->k = middle(values), f->range = values, f->reach = 0.0;
    f->rest = values.low < values.high ? difference(values, at(f->k)) : at(0.0);
    for EACH(j, s) f->g[j] = 0.0;
}

static void copied(const form *a, const support *s, form *found)
{
    double *g = found->g;
    for EACH(j, s) g[j] = a->g[j];
    *found = *a;
    found->g = g;
}

static void negative(const form *a, const support *s, form *found)
{
    found->k = -a->k, found->reach = a->reach, found->rest = opposite(a->rest), found->range = opposite(a->range);
    for EACH(j, s) found->g[j] = -a->g[j];
}

/* a + b, or a - b where the sign is -1. */
void form_sum(const form *a, const form *b, double sign, fdi_interval values, const support *s, form *found)
{
    const fdi_interval rest = sign < 0.0 ? opposite(b->rest) : b->rest;
    found->k = a->k + sign * b->k;
    found->rest = interval(a->rest.low + rest.low, a->rest.high + rest.high);
    found->range = values;
    for EACH(j, s) found->g[j] = a->g[j] + sign * b->g[j];
    found->reach = reach_of(found->g, s);
    rounded(found, size_of(a) + size_of(b), s);
}

/* A function whose value is slope * a + rest. */
void form_sloped(const form *a, double slope, fdi_interval rest, fdi_interval values, const support *s, form *found)
{
    const double half = middle(rest), k = slope * a->k;
    const fdi_interval own = scaled(slope, a->rest);
    for EACH(j, s) found->g[j] = slope * a->g[j];
    found->reach = reach_of(found->g, s);
    const double size = fabs(k) + 2.0 * larger(largest(rest), 0.0) + largest(own) + found->reach;
    found->k = k + half;
    found->rest = interval(own.low + rest.low - half, own.high + rest.high - half);
    found->range = values;
    rounded(found, size, s);
}

static void multiplied(const form *a, const form *b, fdi_interval values, const support *s, form *found)
{
    const double *radius = s->radius;
    double low = 0.0, high = 0.0, mixed = 0.0;
    for (integer m = 0; m < s->count; m++) {
        const integer i = s->column[m];
        const double p = a->g[i] * radius[i], q = b->g[i] * radius[i], squared = p * q;
        low += smaller(squared, 0.0), high += larger(squared, 0.0);
        if (p == 0.0 && q == 0.0) continue;
        for (integer o = 0; o < m; o++) {
            const integer j = s->column[o];
            mixed += fabs(p * (b->g[j] * radius[j]) + (a->g[j] * radius[j]) * q);
        }
    }
    const double cross = a->reach * largest(b->rest) + b->reach * largest(a->rest) + mixed;
    const fdi_interval first = scaled(a->k, b->rest), second = scaled(b->k, a->rest);
    const fdi_interval low_a = scaled(a->rest.low, b->rest), high_a = scaled(a->rest.high, b->rest);
    const fdi_interval both = interval(smaller(low_a.low, high_a.low), larger(low_a.high, high_a.high));
    found->rest = interval(first.low + second.low + both.low + low - cross,
                           first.high + second.high + both.high + high + cross);
    const double size = (double)(s->count + 4) * size_of(a) * size_of(b), ak = a->k, bk = b->k;
    for EACH(j, s) found->g[j] = ak * b->g[j] + bk * a->g[j];
    found->k = ak * bk, found->range = values;
    found->reach = reach_of(found->g, s);
    rounded(found, size, s);
}

/* a / b = q + (a - q b) / b for every q; `over` is 1 / b. */
static void shared(const form *a, const form *b, const form *over, double q, const support *s, form *spare, form *found)
{
    form *part = spare, *left = spare + 1, *whole = spare + 2, *constant = spare;
    form_sloped(b, q, at(0.0), product(at(q), b->range), s, part);
    form_sum(a, part, -1.0, difference(a->range, part->range), s, left);
    multiplied(left, over, product(left->range, over->range), s, whole);
    form_of_constant(constant, at(q), s);
    form_sum(constant, whole, 1.0, sum(at(q), whole->range), s, found);
}

/* With q that of the centres, what a and b have in common leaves the numerator; with q that of their slopes the
 * numerator becomes nearly constant, and the rest is that of 1 / b. */
static void divided(const form *a, const form *b, fdi_interval values, const support *s, form *spare, form *found)
{
    form *over = spare, *other = spare + 1;
    double along = 0.0, square_b = 0.0;
    for EACH(j, s) {
        const double p = b->g[j] * s->radius[j];
        along += a->g[j] * s->radius[j] * p, square_b += p * p;
    }
    const double shares[] = {a->k / b->k, along / square_b};
    const fdi_interval inverted = inverse(b->range);
    const secant by = tape_secant(INV, b->range, inverted);
    form_sloped(b, by.slope, by.rest, inverted, s, over);
    multiplied(a, over, product(a->range, over->range), s, found);
    for (integer i = 0; i < 2; i++) {
        if (!(fabs(shares[i]) < 1e300)) continue;
        shared(a, b, over, shares[i], s, spare + 2, other);
        const fdi_interval p = found->range, q = other->range;
        if (width(other->rest) < width(found->rest)) copied(other, s, found);
        form_within(found, interval(larger(p.low, q.low), smaller(p.high, q.high)), s);
    }
    form_within(found, values, s);
}

/* b + max(a - b, 0), where either may be the larger one. */
static void maximum(const form *a, const form *b, fdi_interval values, const support *s, form *spare, form *found)
{
    form *gap = spare, *part = spare + 1;
    form_sum(a, b, -1.0, difference(a->range, b->range), s, gap);
    const fdi_interval d = gap->range;
    if (d.low >= 0.0 || d.high <= 0.0) {
        copied(d.low >= 0.0 ? a : b, s, found);
        return;
    }
    const double slope = d.high / (d.high - d.low);
    const fdi_interval low = opposite(product(at(slope), at(d.low)));
    const fdi_interval high = difference(at(d.high), product(at(slope), at(d.high)));
    const fdi_interval rest = interval(smaller(0.0, smaller(low.low, high.low)), larger(0.0, larger(low.high, high.high)));
    form_sloped(gap, slope, rest, interval(0.0, d.high), s, part);
    form_sum(b, part, 1.0, sum(b->range, part->range), s, found);
    form_within(found, values, s);
}

/* One form where t is below zero, the other elsewhere; where t may be both, either. */
static void chosen(const form *t, const form *first, const form *second, fdi_interval values, const support *s,
                   form *spare, form *found)
{
    if (!(t->range.low < 0.0 && 0.0 <= t->range.high)) {
        copied(t->range.high < 0.0 ? first : second, s, found);
        return;
    }
    form *gap = spare, *total = spare + 1;
    form_sum(first, second, -1.0, difference(first->range, second->range), s, gap);
    form_sum(first, second, 1.0, sum(first->range, second->range), s, total);
    const double share = 0.5 * magnitude(gap->range);
    form_sloped(total, 0.5, interval(-share, share), values, s, found);
}

int form_applied(integer op, const form *a, const form *b, const form *c, fdi_interval values, const support *s,
                 form *spare, form *found)
{
    switch (op) {
    case NEG: negative(a, s, found); break;
    case ADD: form_sum(a, b, 1.0, values, s, found); break;
    case SUB: form_sum(a, b, -1.0, values, s, found); break;
    case MUL: multiplied(a, b, values, s, found); break;
    case DIV: divided(a, b, values, s, spare, found); break;
    case MAX: maximum(a, b, values, s, spare, found); break;
    case SELECT: chosen(a, b, c, values, s, spare, found); break;
    case ATAN2: form_angle(a, b, values, s, spare, found); break;
    default: {
        const secant by = tape_secant(op, a->range, values);
        form_sloped(a, by.slope, by.rest, values, s, found);
    }
    }
    return isfinite(found->k + found->rest.low + found->rest.high + found->reach);
}

/* The form of atan2(y, x): one-sided bounds of second order, or the range alone where that is narrower or at the cut. */
#include "tape/tape.h"

static const double NO_DIRECTION = 1e-150; /* of x^2 + y^2: below it the derivatives may overflow */

/* A double near a derivative, and what it misses. */
typedef struct { double value; fdi_interval error; } slope;

static slope near_to(fdi_interval derivative)
{
    const double value = middle(derivative);
    return (slope){value, difference(derivative, at(value))};
}

/* Half the second differential over a box with these half-widths; the eigenvalues of the Hessian are +-1 / rho^2. */
static fdi_interval bend(fdi_interval x, fdi_interval y, double dx, double dy)
{
    const fdi_interval xx = square(x), yy = square(y), squares = sum(xx, yy);
    const fdi_interval over = square(inverse(squares)), two = at(2.0);
    const fdi_interval twice = product(two, product(product(x, y), over)), mixed = product(difference(yy, xx), over);
    const fdi_interval in_x = interval(0.0, square(at(dx)).high), in_y = interval(0.0, square(at(dy)).high);
    const double corner = product(at(dx), at(dy)).high;
    const fdi_interval off = product(two, product(mixed, interval(-corner, corner)));
    const fdi_interval half = product(at(0.5), sum(product(twice, difference(in_x, in_y)), off));
    const double most = product(product(at(0.5), sum(in_x, in_y)), inverse(squares)).high;
    return interval(larger(half.low, -most), smaller(half.high, most));
}

static void flat(fdi_interval values, const support *s, form *found)
{
    form_of_constant(found, values, s);
    form_cut(found, s);
}

void form_angle(const form *fy, const form *fx, fdi_interval values, const support *s, form *spare, form *found)
{
    const fdi_interval x = fx->range, y = fy->range;
    const double u = middle(x), v = middle(y);
    const double dx = above(larger(x.high - u, u - x.low)), dy = above(larger(y.high - v, v - y.low));
    const fdi_interval here = sum(square(at(u)), square(at(v)));
    flat(values, s, found);
    const fdi_interval turn = fdi_atan2_at(0.0, 0.0);
    const int is_whole = values.low == turn.low && values.high == turn.high;
    if (is_whole || !(sum(square(x), square(y)).low > NO_DIRECTION) || !(here.low > NO_DIRECTION)) return;
    const slope by_x = near_to(opposite(product(at(v), inverse(here)))), by_y = near_to(product(at(u), inverse(here)));
    const fdi_interval off = sum(product(interval(-dx, dx), by_x.error), product(interval(-dy, dy), by_y.error));
    const fdi_interval start = difference(difference(fdi_atan2_at(v, u), product(at(by_x.value), at(u))),
                                          product(at(by_y.value), at(v)));
    const fdi_interval rest = sum(sum(start, off), bend(x, y, dx, dy));
    const fdi_interval in_x = product(at(by_x.value), x), in_y = sum(product(at(by_y.value), y), rest);
    if (!is_bounded(rest) || !is_bounded(in_x) || !is_bounded(in_y)) return;
    form *part = spare, *other = spare + 1, *total = spare + 2;
    form_sloped(fx, by_x.value, at(0.0), in_x, s, part);
    form_sloped(fy, by_y.value, rest, in_y, s, other);
    form_sum(part, other, 1.0, sum(part->range, other->range), s, total);
    form_within(total, values, s);
    if (!(width(total->rest) < width(found->rest))) return;
    double *g = found->g;
    *found = *total;
    found->g = g;
    for (integer n = 0; n < s->count; n++) g[s->column[n]] = total->g[s->column[n]];
}

/* Recursion of the interval predictor (corrected Proposition 3 of paper 001), one transition and whole records. */
#include "interval/interval.h"

static const double SLACK = 8.0 * EPS; /* of the size of what was added: rounding, that of center +- radius included */

static Moved move(double center, double radius, double u, Gains gains)
{
    const double gc = gains.gc, target = gains.hc * u, distance = fabs(center - target);
    const double used = smaller(gains.limit, gains.gr + gains.slope * distance);
    const double kept = gc * center, driven = (1.0 - gc) * target, moved = kept + driven;
    const double wide =
        (fabs(gc) + used) * radius + used * distance + (fabs(1.0 - gc) + used) * gains.hr * fabs(u);
    const double size = fabs(kept) + fabs(driven) + used * (fabs(center) + fabs(target)) + fabs(moved);
    return (Moved){moved, wide + SLACK * (size + wide), used};
}

/* The interval after one transition. */
EXPORTED Moved fdi_interval_move(double center, double radius, double u, double gc, double gr, double hc, double hr,
                                 double slope, double limit)
{
    return move(center, radius, u, (Gains){gc, gr, hc, hr, slope, limit});
}

/* Fills center, radius (K,) from their first entries, and the radius of g used at each sample (K,).
 *
 * All arrays are (K,). Returns the first sample at which |gc| + gr < 1 fails, or -1. The last sample's transition is
 * not made.
 */
EXPORTED integer fdi_interval_propagate(integer samples, const double *u, const double *gc, const double *gr,
                                        const double *hc, const double *hr, const double *slope, const double *limit,
                                        double *center, double *radius, double *used)
{
    for (integer k = 0; k < samples; k++) {
        const Moved next =
            move(center[k], radius[k], u[k], (Gains){gc[k], gr[k], hc[k], hr[k], slope[k], limit[k]});
        used[k] = next.used;
        if (k + 1 == samples) break;
        if (!(fabs(gc[k]) + next.used < 1.0)) return k;
        center[k + 1] = next.center, radius[k + 1] = next.radius;
    }
    return -1;
}

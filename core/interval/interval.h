/* Interval prediction of one state, and the extremes of moving sums. */
#ifndef INTERVAL_H
#define INTERVAL_H

#include "core.h"

typedef struct {
    double center, radius; /* of the state after a transition */
    double used;           /* radius of g that it was made with */
} Moved;

typedef struct { /* of a transition: g in gc +- gr, whose radius grows with the distance up to a limit; h in hc +- hr */
    double gc, gr, hc, hr, slope, limit;
} Gains;

#endif

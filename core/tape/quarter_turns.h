/* An angle as a number of quarter turns and what is left. */
#ifndef TAPE_QUARTER_TURNS_H
#define TAPE_QUARTER_TURNS_H

#include "pairs.h"

typedef struct {
    integer quarter; /* modulo 4 */
    Pair rest;       /* at most pi/4 (1 + 2^-50) in size, and within 2^-75 of its size */
} Turned;            /* x = quarter pi/2 + rest, modulo 2 pi */

/* Of a finite x. */
Turned in_quarter_turns(double x);

#endif

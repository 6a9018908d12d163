/* Elementary functions of doubles and of intervals, rounded outward, from + - * / alone: no libm, no rounding mode.
 *
 * `_at`: an interval that contains the exact value at that very double, of neighbouring doubles or with one between them
 * (a quotient below 2^-27 of atan2: three apart; a subnormal result: up to four). `_over`: one that contains all values at
 * the points of a bounded interval, the ends being `_at` the ends or the function's own extremes; NaN is no end.
 * README.md derives the error bounds. All finite doubles are arguments, also of sin and cos.
 */
#ifndef TAPE_ELEMENTARY_H
#define TAPE_ELEMENTARY_H

#include "core.h"

typedef struct {
    double low, high; /* infinite: not bounded by doubles */
} fdi_interval;

EXPORTED fdi_interval fdi_pi(void);
EXPORTED fdi_interval fdi_exp_at(double x);
EXPORTED fdi_interval fdi_log_at(double x); /* the whole line if x is not positive */
EXPORTED fdi_interval fdi_sin_at(double x);
EXPORTED fdi_interval fdi_cos_at(double x);
EXPORTED fdi_interval fdi_tanh_at(double x);
EXPORTED fdi_interval fdi_atan2_at(double y, double x); /* in [-pi, pi]; pi on the cut, the whole turn at the origin */

EXPORTED fdi_interval fdi_exp_over(fdi_interval x);
EXPORTED fdi_interval fdi_log_over(fdi_interval x);
EXPORTED fdi_interval fdi_sin_over(fdi_interval x);
EXPORTED fdi_interval fdi_cos_over(fdi_interval x);
EXPORTED fdi_interval fdi_tanh_over(fdi_interval x);
EXPORTED fdi_interval fdi_atan2_over(fdi_interval y, fdi_interval x); /* the whole turn over the cut and the origin */

#endif

/* Kalman filters over samples, and the small dense matrices that they are made of. Matrices are (rows, columns), row by
 * row; n states, ny outputs, nd unknown inputs. An exported function works in a block of the caller's, of as many
 * doubles as the function of its name and `_room` says.
 *
 * matrices.c  products, Cholesky's factor, triangular systems
 * sample.c    prediction by the model and correction by a measurement, of one filter
 * kalman.c    one filter, unknown inputs decoupled
 * models.c    a bank of them with probabilities
 */
#ifndef FILTERS_H
#define FILTERS_H

#include "core.h"
#include "memory.h"

enum { DONE = -1, NOT_POSITIVE = -2 }; /* how a run ends, if not at a sample; the covariance of an innovation */

/* matrices.c */
void multiply(const double *A, const double *B, integer m, integer k, integer n, double *out);           /* A B */
void multiply_transposed(const double *A, const double *B, integer m, integer k, integer n, double *out); /* A B' */
void congruence(const double *A, const double *P, integer m, integer n, double *out, double *work);       /* A P A' */
int factor(double *S, integer n, double least); /* S = L L', L in place; 0 if a pivot is not above `least` */
void solve_lower(const double *L, integer n, integer columns, double *B);            /* L X = B, X in place */
void solve_lower_transposed(const double *L, integer n, integer columns, double *B); /* L' X = B */

/* sample.c */
typedef struct { /* of one sample; A, f and Q lead to it */
    const double *A, *f, *Q; /* (n, n), (n,), (n, n) */
    const double *C, *g, *R; /* (ny, n), (ny,), (ny, ny) */
    const double *y;         /* (ny,) NaN: not measured */
} Sample;

typedef struct {
    integer n, ny;
    double *C, *R, *L;  /* (ny, n), (ny, ny) without missing sensors; Cholesky's factor of the innovation's variance */
    double *white;      /* (ny,) whitened innovation */
    double *gain;       /* (n, ny) of it */
    double *K, *rest, *product, *spread; /* (n, ny), (n, n) thrice */
} Filter;

void lay_out_filter(Filter *filter, Memory *memory, integer n, integer ny);
void predict(const Filter *filter, const Sample *at, double *x, double *P);
int innovate(Filter *filter, const Sample *at, const double *x, const double *P); /* 0 if not positive definite */
void correct(Filter *filter, double *x, double *P);

#endif

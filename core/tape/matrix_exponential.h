/* The enclosed exponential of a matrix and its integral. */
#ifndef TAPE_MATRIX_EXPONENTIAL_H
#define TAPE_MATRIX_EXPONENTIAL_H

#include "memory.h"

/* Matrices (n, n): doubles near exp(J h) and its integral over [0, h], bounds of what each entry misses, and the
 * integral of exp(M t), rounded up, M being J with the absolute values of its off-diagonal entries. */
typedef struct { double *move, *gain, *move_error, *gain_error, *carried; } exponential;

integer fdi_exponential_room(integer n);
exponential exponential_in(Memory *memory, integer n);

/* Of J whose scaled norm max_i sum_j |J_ij| unit_j / unit_i h is at most 1, for powers of two `unit`;
 * what it moves is at most `reach` units. */
void exponential_take(integer n, const double *J, double h, const double *unit, double norm, double reach, Memory scratch,
                      exponential *e);

#endif

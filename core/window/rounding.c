/* How far the rounding of one sample reaches into later states, without the growth of powers of |A|.
 *
 * The error of the state obeys e(k+1) = A e(k) + delta(k). Bounded entry by entry it grows as |A|^k does, which for a
 * stable plant of 20 states was 6e12 after 29 samples. So it is kept in turned coordinates besides, e = Q r with
 * |r| <= rho: the QR factorisation of A Q gives the next Q, and its triangle carries rho (Lohner's method, as in
 * Nedialkov, Jackson and Corliss, Applied Mathematics and Computation 105, 1999, section 6). The smaller bound holds.
 */
#include "window.h"

#define ORTHOGONALITY 32.0   /* (n + 8)^2 units: more than a Householder factorisation misses by, relative to each
                              * column (Higham 2002, section 19.3) */

static double orthogonality(integer n) { return ORTHOGONALITY * (double)((n + 8) * (n + 8)) * UNIT; }

/* R = A Q, and for each column a bound of its length by the terms of its entries. */
static void turn(integer n, const double *A, const double *frame, double *R, double *length)
{
    fill(length, 0.0, n);
    for (integer j = 0; j < n; j++)
        for (integer i = 0; i < n; i++) {
            double value = 0.0;
            for (integer r = 0; r < n; r++) {
                const double term = A[i * n + r] * frame[r * n + j];
                value += term;
                length[j] += fabs(term);
            }
            R[i * n + j] = value;
        }
}

/* Householder vector v of column j of R, from entry j on; returns v'v / 2, or 0 where there is nothing to reflect. */
static double reflector(integer n, const double *R, integer j, double *v)
{
    double size = 0.0, square = 0.0;
    for (integer i = j; i < n; i++) size = larger(fabs(R[i * n + j]), size);
    if (size == 0.0 || !isfinite(size)) return 0.0;
    for (integer i = j; i < n; i++) {
        v[i] = R[i * n + j] / size;
        square += v[i] * v[i];
    }
    const double norm = sqrt(square);
    square += norm * fabs(v[j]);
    v[j] += v[j] >= 0.0 ? norm : -norm;
    return square;
}

/* The next frame: `turned` is Q' and `carry` bounds |Q'^-1 A Q| for the present frame Q; all (n, n). */
void turn_frame(integer n, const double *A, const double *frame, double *turned, double *carry, double *scratch)
{
    double *R = scratch, *length = scratch + n * n, *v = length + n;
    const double tolerance = orthogonality(n);
    turn(n, A, frame, R, length);
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++) turned[i * n + j] = i == j ? 1.0 : 0.0;
    for (integer j = 0; j < n - 1; j++) {
        const double square = reflector(n, R, j, v);
        if (square == 0.0) continue;
        for (integer c = j; c < n; c++) {
            double value = 0.0;
            for (integer i = j; i < n; i++) value += v[i] * R[i * n + c];
            value /= square;
            for (integer i = j; i < n; i++) R[i * n + c] -= value * v[i];
        }
        for (integer i = 0; i < n; i++) {
            double value = 0.0;
            for (integer c = j; c < n; c++) value += turned[i * n + c] * v[c];
            value /= square;
            for (integer c = j; c < n; c++) turned[i * n + c] -= value * v[c];
        }
    }
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++)
            carry[i * n + j] = ((i <= j ? fabs(R[i * n + j]) : 0.0) + tolerance * length[j]) * UPWARD;
}

/* Bounds of the next error in its frame, from those of the present one and the rounding `fresh` (n,). */
void carry_error(integer n, const double *carry, const double *turned, const double *rho, const double *fresh,
                 double *rho_next)
{
    double everything = 0.0;
    for (integer i = 0; i < n; i++) everything += fresh[i];
    for (integer a = 0; a < n; a++) {
        double value = orthogonality(n) * everything;
        for (integer j = 0; j < n; j++) value += carry[a * n + j] * rho[j] + fabs(turned[j * n + a]) * fresh[j];
        rho_next[a] = value * UPWARD;
    }
}

/* Bound of entry i of the error. */
double error_of(integer n, const double *turned, const double *rho, integer i)
{
    double value = 0.0;
    for (integer a = 0; a < n; a++) value += fabs(turned[i * n + a]) * rho[a];
    return value * UPWARD;
}

EXPORTED void fdi_turn_frame(integer n, const double *A, const double *frame, double *turned, double *carry,
                             double *scratch)
{
    turn_frame(n, A, frame, turned, carry, scratch);
}

EXPORTED void fdi_carry_error(integer n, const double *carry, const double *turned, const double *rho,
                              const double *fresh, double *rho_next)
{
    carry_error(n, carry, turned, rho, fresh, rho_next);
}

EXPORTED double fdi_error_of(integer n, const double *turned, const double *rho, integer i)
{
    return error_of(n, turned, rho, i);
}

/* Small dense matrices, row by row: products, Cholesky's factor, triangular systems. */
#include "filters/filters.h"
#include "vectors.h"

void multiply(const double *A, const double *B, integer m, integer k, integer n, double *out)
{
    for (integer i = 0; i < m; i++) {
        fill(out + i * n, 0.0, n);
        for (integer q = 0; q < k; q++) add_multiple(out + i * n, A[i * k + q], B + q * n, n);
    }
}

void multiply_transposed(const double *A, const double *B, integer m, integer k, integer n, double *out)
{
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < n; j++) out[i * n + j] = dot(A + i * k, B + j * k, k);
}

/* A P A' of A (m, n); work (m, n). */
void congruence(const double *A, const double *P, integer m, integer n, double *out, double *work)
{
    multiply(A, P, m, n, n, work);
    multiply_transposed(work, A, m, n, m, out);
}

/* The factor stands in the lower half; the upper one is not read. */
int factor(double *S, integer n, double least)
{
    for (integer j = 0; j < n; j++) {
        double *row = S + j * n;
        const double pivot = row[j] - sum_of_squares(row, j);
        if (!(pivot > least)) return 0;
        row[j] = sqrt(pivot);
        for (integer i = j + 1; i < n; i++) S[i * n + j] = (S[i * n + j] - dot(S + i * n, row, j)) / row[j];
    }
    return 1;
}

void solve_lower(const double *L, integer n, integer columns, double *B)
{
    for (integer i = 0; i < n; i++) {
        double *row = B + i * columns;
        for (integer j = 0; j < i; j++) add_multiple(row, -L[i * n + j], B + j * columns, columns);
        for (integer q = 0; q < columns; q++) row[q] /= L[i * n + i];
    }
}

void solve_lower_transposed(const double *L, integer n, integer columns, double *B)
{
    for (integer i = n - 1; i >= 0; i--) {
        double *row = B + i * columns;
        for (integer j = i + 1; j < n; j++) add_multiple(row, -L[j * n + i], B + j * columns, columns);
        for (integer q = 0; q < columns; q++) row[q] /= L[i * n + i];
    }
}

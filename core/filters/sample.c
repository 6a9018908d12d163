/* One sample of a Kalman filter: x' = A x + f, P' = A P A' + Q, then the measurement y = C x + g + noise of R. */
#include "filters/filters.h"
#include "vectors.h"

void lay_out_filter(Filter *filter, Memory *memory, integer n, integer ny)
{
    filter->n = n, filter->ny = ny;
    filter->C = doubles(memory, ny * n), filter->R = doubles(memory, ny * ny), filter->L = doubles(memory, ny * ny);
    filter->white = doubles(memory, ny), filter->gain = doubles(memory, n * ny), filter->K = doubles(memory, n * ny);
    filter->rest = doubles(memory, n * n), filter->product = doubles(memory, most(n, ny) * n);
    filter->spread = doubles(memory, n * n);
}

void predict(const Filter *filter, const Sample *at, double *x, double *P)
{
    const integer n = filter->n;
    double *moved = filter->spread;
    for (integer i = 0; i < n; i++) moved[i] = dot(at->A + i * n, x, n) + at->f[i];
    copy(x, moved, n);
    congruence(at->A, P, n, n, filter->spread, filter->product);
    for (integer i = 0; i < n * n; i++) P[i] = filter->spread[i] + at->Q[i];
}

/* Output matrix, noise and innovation; the rows of a missing sensor say nothing. */
static void read_sensors(Filter *filter, const Sample *at, const double *x)
{
    const integer n = filter->n, ny = filter->ny;
    copy(filter->C, at->C, ny * n);
    copy(filter->R, at->R, ny * ny);
    for (integer i = 0; i < ny; i++) {
        filter->white[i] = at->y[i] - at->g[i] - dot(at->C + i * n, x, n);
        if (at->y[i] == at->y[i]) continue;
        filter->white[i] = 0.0;
        fill(filter->C + i * n, 0.0, n);
        for (integer j = 0; j < ny; j++) filter->R[i * ny + j] = filter->R[j * ny + i] = 0.0;
        filter->R[i * ny + i] = 1.0;
    }
}

/* The whitened innovation and its gain. */
int innovate(Filter *filter, const Sample *at, const double *x, const double *P)
{
    const integer n = filter->n, ny = filter->ny;
    double *CP = filter->product;
    read_sensors(filter, at, x);
    multiply(filter->C, P, ny, n, n, CP);
    multiply_transposed(CP, filter->C, ny, n, ny, filter->L);
    for (integer i = 0; i < ny * ny; i++) filter->L[i] += filter->R[i];
    if (!factor(filter->L, ny, 0.0)) return 0;
    solve_lower(filter->L, ny, 1, filter->white);
    solve_lower(filter->L, ny, n, CP);
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < ny; j++) filter->gain[i * ny + j] = CP[j * n + i];
    return 1;
}

/* State and covariance after the measurement; the covariance in Joseph's form, which stays positive. */
void correct(Filter *filter, double *x, double *P)
{
    const integer n = filter->n, ny = filter->ny;
    double *transposed = filter->product, *K = filter->K, *rest = filter->rest;
    for (integer i = 0; i < n; i++) {
        x[i] += dot(filter->gain + i * ny, filter->white, ny);
        for (integer j = 0; j < ny; j++) transposed[j * n + i] = filter->gain[i * ny + j];
    }
    solve_lower_transposed(filter->L, ny, n, transposed);
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < ny; j++) K[i * ny + j] = transposed[j * n + i];
    multiply(K, filter->C, n, ny, n, rest);
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++) rest[i * n + j] = (i == j ? 1.0 : 0.0) - rest[i * n + j];
    congruence(rest, P, n, n, filter->spread, filter->product);
    copy(P, filter->spread, n * n);
    congruence(K, filter->R, n, ny, filter->spread, filter->product);
    for (integer i = 0; i < n * n; i++) P[i] += filter->spread[i];
}

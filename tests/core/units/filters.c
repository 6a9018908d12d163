/* Kalman filters: matrices, one state against its scalar recursion, banks, unknown inputs. */
#include "filters/filters.h"

#include <stdlib.h>

#include "check.h"
#include "vectors.h"

integer fdi_filter_room(integer n, integer ny, integer nd);
integer fdi_filter(integer samples, integer n, integer ny, integer nd, integer first, double *x, double *P,
                   const double *A, const double *f, const double *Q, const double *C, const double *g,
                   const double *R, const double *y, const double *E, const double *D, double *states, double *white,
                   double *block);
integer fdi_models_room(integer m, integer n, integer ny);
integer fdi_models(integer m, integer samples, integer n, integer ny, integer first, double *xs, double *Ps,
                   double *log_mu, const double *log_transition, const double *A, const double *f, const double *Q,
                   const double *C, const double *g, const double *R, const double *y, double *log_odds,
                   double *posterior, double *block);

enum { N = 5, SAMPLES = 20 };

static double *room_of(integer count) { return malloc(sizeof(double) * (size_t)count); }

static void factors(void)
{
    double root[N * N], S[N * N], L[N * N], B[2 * N], X[2 * N];
    draw(root, N * N);
    multiply_transposed(root, root, N, N, N, S);
    for (integer j = 0; j < N; j++) S[j * N + j] += 1.0;
    copy(L, S, N * N);
    CHECK(factor(L, N, 0.0));
    for (integer i = 0; i < N; i++)
        for (integer j = 0; j <= i; j++) CHECK(near(dot(L + i * N, L + j * N, j + 1), S[i * N + j], 1e-14));
    draw(B, 2 * N);
    copy(X, B, 2 * N);
    solve_lower(L, N, 2, X);
    solve_lower_transposed(L, N, 2, X);
    for (integer i = 0; i < N; i++)
        for (integer q = 0; q < 2; q++) {
            double value = 0.0;
            for (integer j = 0; j < N; j++) value += S[i * N + j] * X[2 * j + q];
            CHECK(near(value, B[2 * i + q], 1e-12));
        }
    S[0] = -1.0;
    CHECK(!factor(S, N, 0.0));
}

/* x' = a x + noise, y = x + noise, with a missing reading now and then. */
static void scalar_recursion(void)
{
    double A[SAMPLES], f[SAMPLES], Q[SAMPLES], C[SAMPLES], g[SAMPLES], R[SAMPLES], y[SAMPLES];
    double states[SAMPLES], white[SAMPLES], x = 0.5, P = 2.0, mean = 0.5, variance = 2.0;
    double *block = room_of(fdi_filter_room(1, 1, 0));
    draw(A, SAMPLES), draw(f, SAMPLES), draw(C, SAMPLES), draw(g, SAMPLES), draw(y, SAMPLES);
    fill(Q, 0.3, SAMPLES), fill(R, 0.1, SAMPLES);
    for (integer k = 2; k < SAMPLES; k += 5) y[k] = NAN;
    CHECK(fdi_filter(SAMPLES, 1, 1, 0, 1, &x, &P, A, f, Q, C, g, R, y, NULL, NULL, states, white, block) == DONE);
    for (integer k = 0; k < SAMPLES; k++) {
        if (k > 0) {
            mean = A[k] * mean + f[k];
            variance = A[k] * variance * A[k] + Q[k];
        }
        const double spread = C[k] * variance * C[k] + R[k], gain = isnan(y[k]) ? 0.0 : variance * C[k] / spread;
        const double off = isnan(y[k]) ? 0.0 : y[k] - g[k] - C[k] * mean;
        CHECK(near(white[k], off / sqrt(spread), 1e-12));
        mean += gain * off;
        variance -= gain * C[k] * variance;
        CHECK(near(states[k], mean, 1e-12));
    }
    CHECK(near(P, variance, 1e-12) && near(x, mean, 1e-12));
    P = -1e9;
    CHECK(fdi_filter(1, 1, 1, 0, 1, &x, &P, A, f, Q, C, g, R, y, NULL, NULL, states, white, block) == NOT_POSITIVE);
    free(block);
}

/* Two models of one state, never switched: odds are those of the two whitened innovations. */
static void odds_of_two_models(void)
{
    const double A[] = {0.0, 0.0}, f[] = {0.0, 0.0}, Q[] = {0.0, 0.0}, C[] = {1.0, 1.0}, R[] = {1.0, 1.0};
    const double g[] = {0.0, 2.0}, y[] = {0.25}, never[] = {0.0, -INFINITY, -INFINITY, 0.0};
    double xs[] = {0.0, 0.0}, Ps[] = {0.0, 0.0}, log_mu[] = {log(0.5), log(0.5)}, odds[1], posterior[2];
    double *block = room_of(fdi_models_room(2, 1, 1));
    CHECK(fdi_models(2, 1, 1, 1, 1, xs, Ps, log_mu, never, A, f, Q, C, g, R, y, odds, posterior, block) == DONE);
    CHECK(near(odds[0], 0.5 * (0.25 * 0.25 - 1.75 * 1.75), 1e-14));
    CHECK(near(posterior[0] + posterior[1], 1.0, 1e-15));
    CHECK(near(posterior[1], 1.0 / (1.0 + exp(-odds[0])), 1e-14));
    free(block);
}

/* An unknown input that enters one of two sensors leaves the other one alone. */
static void unknown_input(void)
{
    const double A[] = {1.0}, f[] = {0.0}, Q[] = {0.0}, C[] = {1.0, 1.0}, g[] = {0.0, 0.0}, R[] = {1.0, 0.0, 0.0, 1.0};
    const double E[] = {0.0}, D[] = {0.0, 1.0}, y[] = {1.0, 1e6};
    double x = 0.0, P = 1.0, states[1], white[2], *block = room_of(fdi_filter_room(1, 2, 1));
    CHECK(fdi_filter(1, 1, 2, 1, 1, &x, &P, A, f, Q, C, g, R, y, E, D, states, white, block) == DONE);
    CHECK(near(states[0], 0.5, 1e-9) && near(P, 0.5, 1e-9));
    const double unseen[] = {0.0, 0.0};
    CHECK(fdi_filter(1, 1, 2, 1, 0, &x, &P, A, f, Q, C, g, R, y, E, unseen, states, white, block) == 0);
    free(block);
}

int main(void)
{
    for (integer i = 0; i < 20; i++) {
        factors();
        scalar_recursion();
    }
    odds_of_two_models();
    unknown_input();
    return failures > 0;
}

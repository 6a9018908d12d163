/* The turned frame of a rounding error: orthogonal, and bounds that hold for errors which are carried in long doubles. */
#include "check.h"
#include "window/window.h"

enum { MOST = 6 };

static void is_a_frame(integer n, const double *frame)
{
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++) {
            double product = 0.0;
            for (integer r = 0; r < n; r++) product += frame[r * n + i] * frame[r * n + j];
            CHECK(near(product, i == j ? 1.0 : 0.0, 1e-14));
        }
}

/* carry >= |Q'^T A Q|, entry by entry. */
static void is_carried(integer n, const double *A, const double *frame, const double *turned, const double *carry)
{
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++) {
            long double value = 0.0L;
            for (integer r = 0; r < n; r++)
                for (integer s = 0; s < n; s++)
                    value += (long double)turned[r * n + i] * A[r * n + s] * frame[s * n + j];
            CHECK(fabsl(value) <= carry[i * n + j]);
        }
}

/* Errors e(k+1) = A e(k) + delta(k) with delta at a corner of its bounds; A changes from step to step, or is zero. */
static void chain(integer n, double size, int singular)
{
    double A[MOST * MOST], frame[MOST * MOST] = {0.0}, turned[MOST * MOST], carry[MOST * MOST];
    double scratch[(MOST + 2) * MOST], rho[MOST] = {0.0}, rho_next[MOST], fresh[MOST];
    long double error[MOST] = {0.0L}, moved[MOST];
    for (integer j = 0; j < n; j++) frame[j * n + j] = 1.0;
    for (integer k = 0; k < 12; k++) {
        draw(A, n * n);
        for (integer j = 0; j < n * n; j++) A[j] *= size;
        if (singular) fill(A, 0.0, k == 5 ? n * n : n);
        turn_frame(n, A, frame, turned, carry, scratch);
        is_a_frame(n, turned);
        is_carried(n, A, frame, turned, carry);
        for (integer i = 0; i < n; i++) {
            fresh[i] = 1e-3 * fabs(uniform());
            moved[i] = uniform() > 0.0 ? fresh[i] : -fresh[i];
            for (integer j = 0; j < n; j++) moved[i] += (long double)A[i * n + j] * error[j];
        }
        carry_error(n, carry, turned, rho, fresh, rho_next);
        for (integer i = 0; i < n; i++) error[i] = moved[i];
        copy(rho, rho_next, n);
        copy(frame, turned, n * n);
        for (integer i = 0; i < n; i++) CHECK(fabsl(error[i]) <= error_of(n, frame, rho, i));
    }
}

/* A rotation by steps, of which |A|^k would grow by 2^(k/2): the frame turns along, and the error is only summed. */
static void rotation_does_not_grow(void)
{
    const double A[] = {0.6, 0.8, -0.8, 0.6}, fresh[] = {1e-3, 1e-3};
    double frame[] = {1.0, 0.0, 0.0, 1.0}, turned[4], carry[4], scratch[8], rho[] = {0.0, 0.0}, next[2];
    for (integer k = 0; k < 100; k++) {
        turn_frame(2, A, frame, turned, carry, scratch);
        carry_error(2, carry, turned, rho, fresh, next);
        copy(rho, next, 2);
        copy(frame, turned, 4);
    }
    CHECK(error_of(2, frame, rho, 0) < 100 * 1e-3 * 2.0);
    CHECK(error_of(2, frame, rho, 0) > 100 * 1e-3);
}

int main(void)
{
    for (integer n = 1; n <= MOST; n++)
        for (integer i = 0; i < 20; i++) chain(n, i % 3 == 0 ? 0.3 : i % 3 == 1 ? 1.0 : 1e5, i % 4 == 0);
    rotation_does_not_grow();
    return failures > 0;
}

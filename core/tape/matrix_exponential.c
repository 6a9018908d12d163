/* exp(J h) by its series. |exp(J t)| <= exp(M t) entry by entry, so M carries what is only bounded.
 *
 * Term k, T_k = T_(k-1) J h / k, is computed with a relative error of (n + 3) k roundings of N_k, the same term of |J|,
 * which bounds those of J and of M; the sums round once more a term. Entries are bounded one by one: units of states
 * scale all of it. What follows the last term is at most twice its scaled norm.
 */
#include "tape/matrix_exponential.h"

#include "vectors.h"

static const double ROUNDED = 0.51 * EPS; /* a rounding, and what its bound is rounded by */
static const double LAST = 0x1p-100;      /* scaled norm of the first term left out: units are 1e-12 of a state or more */
static const double TAIL = 3.0;           /* of that norm: all terms left out, the next at most half of each */
static const double VANISHED = 0x1p-1074; /* what a product that is no normal double loses */
static const integer MOST_TERMS = 40;     /* 1 / 31! is below LAST */

exponential exponential_in(Memory *memory, integer n)
{
    exponential e;
    double **parts[] = {&e.move, &e.gain, &e.move_error, &e.gain_error, &e.carried};
    for (int i = 0; i < 5; i++) *parts[i] = doubles(memory, n * n);
    return e;
}

static void identity(double *matrix, double value, integer n)
{
    fill(matrix, 0.0, n * n);
    for (integer i = 0; i < n; i++) matrix[i * n + i] = value;
}

/* term = term M factor */
static void times(double *term, const double *M, double factor, double *row, integer n)
{
    for (integer i = 0; i < n; i++) {
        fill(row, 0.0, n);
        for (integer k = 0; k < n; k++)
            if (term[i * n + k] != 0.0) add_multiple(row, term[i * n + k], M + k * n, n);
        for (integer j = 0; j < n; j++) term[i * n + j] = row[j] * factor;
    }
}

/* Doubles of scratch that one needs. */
EXPORTED integer fdi_exponential_room(integer n) { return 7 * n * n + n; }

void exponential_take(integer n, const double *J, double h, const double *unit, double norm, Memory scratch,
                      exponential *e)
{
    const integer nn = n * n;
    double *A = doubles(&scratch, nn), *M = doubles(&scratch, nn), *row = doubles(&scratch, n);
    double *T = doubles(&scratch, nn), *N = doubles(&scratch, nn), *S = doubles(&scratch, nn);
    double *P = e->move, *G = e->gain, *C = e->carried, *lost = e->move_error, *lost_in_gain = e->gain_error;
    double *X = doubles(&scratch, nn), *XG = doubles(&scratch, nn);
    int is_metzler = 1;
    for (integer i = 0; i < nn; i++) {
        A[i] = fabs(J[i]);
        M[i] = i % (n + 1) == 0 ? J[i] : A[i];
        is_metzler &= M[i] == J[i];
    }
    identity(T, 1.0, n), identity(N, 1.0, n), identity(S, 1.0, n), identity(P, 1.0, n), identity(X, 1.0, n);
    identity(G, h, n), identity(C, h, n), identity(XG, h, n);
    fill(lost, 0.0, nn), fill(lost_in_gain, 0.0, nn);
    double left = norm * (1.0 + (double)(n + 8) * EPS); /* scaled norm of the next term */
    const double first = left;
    integer terms = 0;
    while (left > LAST && terms < MOST_TERMS) {
        const double k = (double)++terms, share = h / (k + 1.0), rounds = (double)(n + 3) * k;
        times(T, J, h / k, row, n);
        times(N, A, h / k, row, n);
        if (!is_metzler) times(S, M, h / k, row, n);
        for (integer i = 0; i < nn; i++) {
            P[i] += T[i], X[i] += N[i], lost[i] += rounds * N[i];
            G[i] += T[i] * share, XG[i] += N[i] * share, lost_in_gain[i] += rounds * (N[i] * share);
            if (!is_metzler) C[i] += S[i] * share;
        }
        left *= first / (k + 1.0);
    }
    if (is_metzler) copy(C, G, nn);
    const double sums = (double)(terms + 5);
    for (integer j = 0; j < n; j++) {
        double column = 0.0;
        for (integer i = 0; i < n; i++) column += X[i * n + j];
        const double vanished = (double)(MOST_TERMS * (n + 4)) * VANISHED * (1.0 + 2.0 * column);
        for (integer i = 0; i < n; i++) {
            const integer at = i * n + j;
            const double tail = TAIL * left * (unit[i] / unit[j]) + vanished;
            lost[at] = ROUNDED * (lost[at] + sums * X[at]) + tail;
            lost_in_gain[at] = ROUNDED * (lost_in_gain[at] + sums * XG[at]) + tail * h + vanished;
            C[at] = larger(0.0, (C[at] + lost_in_gain[at]) * (1.0 + EPS));
        }
    }
}

/* The same, to be held against balls: result (5, n, n) as `exponential` lists it. */
EXPORTED void fdi_exponential(integer n, const double *J, double h, const double *unit, double norm, double *scratch,
                              double *result)
{
    const integer nn = n * n;
    exponential e = {result, result + nn, result + 2 * nn, result + 3 * nn, result + 4 * nn};
    exponential_take(n, J, h, unit, norm, (Memory){scratch, 0}, &e);
}

/* exp(J h) by its series. |exp(J t)| <= exp(M t) entry by entry, so M carries what is only bounded.
 *
 * Term k, T_k = T_(k-1) J h / k, is computed with a relative error of (n + 3) k roundings of N_k, the same term of |J|,
 * which bounds those of J and of M; the sums round once more a term. Entries are bounded one by one: units of states
 * scale all of it. What follows the last term is at most twice its scaled norm.
 */
#include "tape/matrix_exponential.h"

#include "vectors.h"

static const double ROUNDED = 0.51 * EPS; /* a rounding, and what its bound is rounded by */
static const double LAST = 0x1p-64;       /* first term left out: of the units, and of a rounding of all that it moves */
static const double TAIL = 3.0;           /* of it: all terms left out, the next at most half of each */
static const double VANISHED = 0x1p-1074; /* what a product that is no normal double loses */
static const integer MOST_TERMS = 40;

/* One entry of the matrices J, |J| and M, side by side so that their products are vectors. */
enum { OF_J, OF_SIZE, OF_M, LANES = 4 };
typedef struct { double of[LANES]; } entry;

exponential exponential_in(Memory *memory, integer n)
{
    exponential e;
    double **parts[] = {&e.move, &e.gain, &e.move_error, &e.gain_error, &e.carried};
    for (int i = 0; i < 5; i++) *parts[i] = doubles(memory, n * n);
    return e;
}

/* Doubles of scratch that one needs. */
EXPORTED integer fdi_exponential_room(integer n) { return 4 * LANES * n * n + LANES * n; }

static entry *entries(Memory *memory, integer count) { return (entry *)(void *)doubles(memory, LANES * count); }

static void identity(entry *matrix, double value, integer n)
{
    fill((double *)(void *)matrix, 0.0, LANES * n * n);
    for (integer i = 0; i < n; i++)
        for (int lane = 0; lane < LANES; lane++) matrix[i * n + i].of[lane] = value;
}

/* term = term M factor */
static void times(entry *restrict term, const entry *restrict M, double factor, entry *restrict row, integer n)
{
    for (integer i = 0; i < n; i++) {
        for (integer j = 0; j < n; j++) {
            entry sum = {{0.0, 0.0, 0.0, 0.0}};
            for (integer k = 0; k < n; k++)
                for (int lane = 0; lane < LANES; lane++) sum.of[lane] += term[i * n + k].of[lane] * M[k * n + j].of[lane];
            row[j] = sum;
        }
        for (integer j = 0; j < n; j++)
            for (int lane = 0; lane < LANES; lane++) term[i * n + j].of[lane] = row[j].of[lane] * factor;
    }
}

void exponential_take(integer n, const double *J, double h, const double *unit, double norm, double reach,
                      Memory scratch, exponential *e)
{
    const integer nn = n * n;
    entry *M = entries(&scratch, nn), *T = entries(&scratch, nn), *row = entries(&scratch, n);
    entry *P = entries(&scratch, nn), *G = entries(&scratch, nn);
    double *lost = e->move_error, *lost_in_gain = e->gain_error;
    for (integer i = 0; i < nn; i++) {
        const double size = fabs(J[i]);
        M[i] = (entry){{J[i], size, i % (n + 1) == 0 ? J[i] : size, 0.0}};
    }
    identity(T, 1.0, n), identity(P, 1.0, n), identity(G, h, n);
    fill(lost, 0.0, nn), fill(lost_in_gain, 0.0, nn);
    const double first = norm * (1.0 + (double)(n + 8) * EPS), last = LAST / larger(reach, 1.0);
    double left = first; /* scaled norm of the next term */
    integer terms = 0;
    while (left > last && terms < MOST_TERMS) {
        const double k = (double)++terms, share = h / (k + 1.0), rounds = (double)(n + 3) * k;
        times(T, M, h / k, row, n);
        for (integer i = 0; i < nn; i++) {
            for (int lane = 0; lane < LANES; lane++) {
                P[i].of[lane] += T[i].of[lane];
                G[i].of[lane] += T[i].of[lane] * share;
            }
            lost[i] += rounds * T[i].of[OF_SIZE];
            lost_in_gain[i] += rounds * (T[i].of[OF_SIZE] * share);
        }
        left *= first / (k + 1.0);
    }
    const double sums = (double)(terms + 5);
    for (integer j = 0; j < n; j++) {
        double column = 0.0;
        for (integer i = 0; i < n; i++) column += P[i * n + j].of[OF_SIZE];
        const double vanished = (double)(MOST_TERMS * (n + 4)) * VANISHED * (1.0 + 2.0 * column);
        for (integer i = 0; i < n; i++) {
            const integer at = i * n + j;
            const double tail = TAIL * left * (unit[i] / unit[j]) + vanished;
            e->move[at] = P[at].of[OF_J], e->gain[at] = G[at].of[OF_J];
            lost[at] = ROUNDED * (lost[at] + sums * P[at].of[OF_SIZE]) + tail;
            lost_in_gain[at] = ROUNDED * (lost_in_gain[at] + sums * G[at].of[OF_SIZE]) + tail * h + vanished;
            e->carried[at] = larger(0.0, (G[at].of[OF_M] + lost_in_gain[at]) * (1.0 + EPS));
        }
    }
}

/* The same, to be held against balls: result (5, n, n) as `exponential` lists it. */
EXPORTED void fdi_exponential(integer n, const double *J, double h, const double *unit, double norm, double reach,
                              double *scratch, double *result)
{
    const integer nn = n * n;
    exponential e = {result, result + nn, result + 2 * nn, result + 3 * nn, result + 4 * nn};
    exponential_take(n, J, h, unit, norm, reach, (Memory){scratch, 0}, &e);
}

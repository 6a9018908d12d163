/* Even units: powers of two, whatever powers of two the rows and columns were multiplied by before. */
#include <stdlib.h>

#include "check.h"
#include "polytopes/polytopes.h"
#include "powers.h"
#include "vectors.h"

integer fdi_scaled_room(integer m, integer d);
integer fdi_scaled(integer m, integer d, const double *rows, const double *rhs, double *scaled, integer *codes,
                   double *block);

enum { M = 7, D = 4 };

typedef struct {
    double scaled[(D + 2) * M];
    integer codes[D + 2 * M + 2], k; /* s, r, numbers of rows, refused ones */
} Scaled;

static Scaled scaled_of(const double *rows, const double *rhs)
{
    Scaled found;
    double *block = malloc(sizeof(double) * (size_t)fdi_scaled_room(M, D));
    found.k = fdi_scaled(M, D, rows, rhs, found.scaled, found.codes, block);
    free(block);
    return found;
}

static void draw_rows(double *rows, double *rhs, double density)
{
    draw(rows, M * D);
    draw(rhs, M);
    for (integer j = 0; j < M * D; j++)
        if (fabs(uniform()) > density) rows[j] = 0.0;
}

/* The numbers that come out are those that went in, times powers of two; norms are in [1/2, 1). */
static void powers_alone(double density)
{
    double rows[M * D], rhs[M];
    draw_rows(rows, rhs, density);
    const Scaled found = scaled_of(rows, rhs);
    const integer k = found.k, *s = found.codes, *r = s + D, *kept = r + M;
    integer bounding = 0;
    for (integer i = 0; i < M; i++) bounding += largest_magnitude(rows + i * D, D) > 0.0;
    CHECK(k == bounding);
    for (integer q = 0; q < k; q++) {
        double square = 0.0;
        for (integer j = 0; j < D; j++) {
            const double entry = found.scaled[j * k + q];
            CHECK(entry == ldexp(rows[kept[q] * D + j], (int)(r[q] + s[j])));
            square += entry * entry;
        }
        const double norm = found.scaled[(D + 1) * k + q];
        CHECK(near(norm, sqrt(square), 1e-15));
        CHECK(norm >= 0.5 && norm < 1.0);
        CHECK(found.scaled[D * k + q] == ldexp(rhs[kept[q]], (int)r[q]));
    }
    CHECK(found.codes[D + 2 * M] == -1 && found.codes[D + 2 * M + 1] == -1);
}

static void other_units(double density)
{
    double rows[M * D], rhs[M], moved[M * D], moved_rhs[M];
    integer column[D];
    draw_rows(rows, rhs, density);
    for (integer j = 0; j < D; j++) column[j] = whole(-200, 200);
    for (integer i = 0; i < M; i++) {
        const integer row = whole(-200, 200);
        for (integer j = 0; j < D; j++) moved[i * D + j] = ldexp(rows[i * D + j], (int)(row + column[j]));
        moved_rhs[i] = ldexp(rhs[i], (int)row);
    }
    const Scaled one = scaled_of(rows, rhs), other = scaled_of(moved, moved_rhs);
    CHECK(one.k == other.k);
    for (integer j = 0; j < (D + 2) * one.k; j++) CHECK(one.scaled[j] == other.scaled[j]);
}

static void what_is_refused(void)
{
    double rows[M * D], rhs[M];
    draw_rows(rows, rhs, 1.0);
    rhs[3] = ldexp(rhs[3], 900);
    CHECK(scaled_of(rows, rhs).codes[D + 2 * M] == 3);
}

int main(void)
{
    for (integer i = 0; i < 100; i++) {
        powers_alone(i % 2 ? 1.0 : 0.5);
        other_units(i % 2 ? 1.0 : 0.5);
    }
    what_is_refused();
    return failures > 0;
}

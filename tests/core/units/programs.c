/* Support points and largest balls of polygons, against all corners; the ends that a program can have. */
#include <stdlib.h>

#include "check.h"
#include "polytopes/polytopes.h"
#include "vectors.h"

integer fdi_interior_room(integer d, integer m);
integer fdi_interior(integer d, integer m, const double *at, const double *b, const double *norms, const double *x0,
                     double cap, double *found, double *block);
integer fdi_supports_room(integer d, integer m, integer k);
void fdi_supports(integer d, integer m, integer k, const double *at, const double *b, const double *x0,
                  const double *directions, double *found, integer *codes, double *weights,
                  double *block);

enum { SIDES = 9, DIRECTIONS = 5 };

static double *room_of(integer count) { return malloc(sizeof(double) * (size_t)count); }

/* Unit normals all around at distances in [1/2, 1], transposed: at (2, m). */
static void polygon(integer m, double *at, double *b)
{
    for (integer i = 0; i < m; i++) {
        const double turn = (6.283185307179586 * ((double)i + 0.3 * uniform())) / (double)m;
        at[i] = cos(turn), at[m + i] = sin(turn);
        b[i] = 0.75 + 0.25 * uniform();
    }
}

static double over_corners(integer m, const double *at, const double *b, const double *c)
{
    double best = -INFINITY;
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < i; j++) {
            const double det = at[i] * at[m + j] - at[j] * at[m + i];
            const double x = (b[i] * at[m + j] - b[j] * at[m + i]) / det;
            const double y = (at[i] * b[j] - at[j] * b[i]) / det;
            int inside = fabs(det) > 1e-9;
            for (integer k = 0; k < m; k++) inside &= at[k] * x + at[m + k] * y <= b[k] + 1e-9;
            if (inside) best = larger(c[0] * x + c[1] * y, best);
        }
    return best;
}

static void supports_of_a_polygon(integer m)
{
    double at[2 * SIDES], b[SIDES], directions[2 * DIRECTIONS], found[8 * DIRECTIONS], weights[SIDES * DIRECTIONS] = {0.0};
    integer codes[3 * DIRECTIONS];
    double *block = room_of(fdi_supports_room(2, m, DIRECTIONS));
    const double origin[] = {0.0, 0.0};
    polygon(m, at, b);
    draw(directions, 2 * DIRECTIONS);
    fdi_supports(2, m, DIRECTIONS, at, b, origin, directions, found, codes, weights, block);
    for (integer q = 0; q < DIRECTIONS; q++) {
        const double expected = over_corners(m, at, b, directions + 2 * q), bound = found[6 * DIRECTIONS + q];
        CHECK(codes[2 * DIRECTIONS + q] == OPTIMAL);
        CHECK(near(dot(directions + 2 * q, found + 2 * q, 2), expected, 1e-13));
        CHECK(bound >= expected - 1e-15 && bound <= expected + 1e-13);
        CHECK(near(dot(weights + q * m, b, m), expected, 1e-13));
        for (integer j = 0; j < 2; j++) CHECK(codes[2 * q + j] >= 0 && codes[2 * q + j] < m);
    }
    free(block);
}

/* The ball touches the sides: no other centre has a larger one, by the multipliers. */
static void ball_of_a_polygon(integer m)
{
    double at[2 * SIDES], b[SIDES], norms[SIDES], found[3 + SIDES], value = 0.0, sum = 0.0, pull[2] = {0.0, 0.0};
    double *block = room_of(fdi_interior_room(2, m));
    const double far[] = {100.0, -50.0};
    polygon(m, at, b);
    fill(norms, 1.0, m);
    CHECK(fdi_interior(2, m, at, b, norms, far, 10.0, found, block) == OPTIMAL);
    for (integer i = 0; i < m; i++) {
        const double weight = found[3 + i];
        CHECK(at[i] * found[0] + at[m + i] * found[1] + found[2] <= b[i] + 1e-13);
        CHECK(weight >= -1e-13);
        value += weight * b[i], sum += weight;
        pull[0] += weight * at[i], pull[1] += weight * at[m + i];
    }
    CHECK(near(sum, 1.0, 1e-13) && near(value, found[2], 1e-13));
    CHECK(fabs(pull[0]) < 1e-13 && fabs(pull[1]) < 1e-13);
    free(block);
}

/* Rows that have no common point: a negative radius, and multipliers that say so. */
static void nothing_inside(void)
{
    const double at[] = {1.0, -1.0}, b[] = {-1.0, -1.0}, norms[] = {1.0, 1.0}, x0[] = {0.0};
    double found[4], *block = room_of(fdi_interior_room(1, 2));
    CHECK(fdi_interior(1, 2, at, b, norms, x0, 10.0, found, block) == OPTIMAL);
    CHECK(near(found[1], -1.0, 1e-15));
    CHECK(near(found[2], 0.5, 1e-15) && near(found[3], 0.5, 1e-15));
    free(block);
}

/* An open set: a ray in one direction, an optimum in another. */
static void no_end(void)
{
    const double at[] = {-1.0, 0.0, 0.0, -1.0}, b[] = {0.0, 0.0}, x0[] = {1.0, 1.0}, directions[] = {1.0, 1.0, -1.0, -2.0};
    double found[16], *block = room_of(fdi_supports_room(2, 2, 2));
    double weights[4] = {0.0};
    integer codes[6];
    fdi_supports(2, 2, 2, at, b, x0, directions, found, codes, weights, block);
    CHECK(codes[4] == UNBOUNDED);
    CHECK(codes[5] == OPTIMAL && fabs(found[12 + 1]) < 1e-15);
    free(block);
}

/* A basis that is exchanged row by row is the inverse of its rows, as a fresh one. */
static void exchanges(void)
{
    enum { D = 4, M = 12 };
    double at[D * M], b[M], Q[D * D], fresh[D * D], alpha[D], work[2 * D * D];
    integer W[D];
    draw(at, D * M);
    draw(b, M);
    const Rows rows = {D, M, M, at, b};
    for (integer j = 0; j < D; j++) W[j] = j;
    CHECK(invert_basis(&rows, W, Q, work));
    for (integer i = D; i < M; i++) {
        coordinates(&rows, i, Q, alpha);
        integer slot = 0;
        for (integer j = 1; j < D; j++)
            if (fabs(alpha[j]) > fabs(alpha[slot])) slot = j;
        exchange(Q, alpha, slot, D);
        W[slot] = i;
        CHECK(invert_basis(&rows, W, fresh, work));
        for (integer j = 0; j < D * D; j++) CHECK(near(Q[j], fresh[j], 1e-10));
    }
    W[1] = W[0];
    CHECK(!invert_basis(&rows, W, fresh, work));
}

int main(void)
{
    for (integer i = 0; i < 60; i++)
        for (integer m = 4; m <= SIDES; m++) {
            supports_of_a_polygon(m);
            ball_of_a_polygon(m);
        }
    nothing_inside();
    no_end();
    exchanges();
    return failures > 0;
}

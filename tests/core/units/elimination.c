/* Facets and shadows: redundant rows leave, and what casts a shadow has the supports of the shadow. */
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "polytopes/polytopes.h"
#include "vectors.h"

integer fdi_irredundant_room(integer d, integer m);
integer fdi_irredundant(integer d, integer m, const double *at, const double *b, const double *x0, integer *chosen,
                        integer *doubtful, double *block);
integer fdi_eliminate_room(integer dim, integer room);
integer fdi_eliminate(integer room, integer max_rows, integer cautious, double *table, double *other, integer *known,
                      integer *left, integer *columns, double *inner, integer *doubtful, integer *trace,
                      integer *progress, double *block);
integer fdi_supports_room(integer d, integer m, integer k);
void fdi_supports(integer d, integer m, integer k, const double *at, const double *b, const double *x0,
                  const double *directions, double *found, integer *codes, double *weights,
                  double *block);

enum { DIM = 4, ROOM = 400, MOST = 100 };

static double *room_of(integer count) { return malloc(sizeof(double) * (size_t)count); }

/* The unit cube about the origin, and rows that touch it nowhere. */
static void cube_with_more(integer d, integer more)
{
    const integer m = 2 * d + more;
    double at[DIM * MOST], b[MOST], origin[DIM] = {0.0};
    integer chosen[MOST], doubtful[MOST];
    double *block = room_of(fdi_irredundant_room(d, m));
    fill(at, 0.0, d * m);
    for (integer i = 0; i < m; i++) { /* every row of the cube between two of the others, as far as they go */
        const integer q = i % 2 || i / 2 >= 2 * d ? -1 : i / 2;
        double norm = 0.0;
        for (integer j = 0; j < d; j++) {
            at[j * m + i] = q < 0 ? uniform() : j == q / 2 ? (q % 2 ? -1.0 : 1.0) : 0.0;
            norm += at[j * m + i] * at[j * m + i];
        }
        for (integer j = 0; j < d; j++) at[j * m + i] /= sqrt(norm);
        b[i] = q < 0 ? 1.001 * sqrt((double)d) : 1.0;
    }
    const integer k = fdi_irredundant(d, m, at, b, origin, chosen, doubtful, block);
    CHECK(k == 2 * d);
    for (integer q = 0; q < k; q++) CHECK(b[chosen[q]] == 1.0 && !doubtful[q]);
    free(block);
}

typedef struct {
    double table[ROOM * (DIM + 1)], other[ROOM * (DIM + 1)], inner[DIM];
    integer known[ROOM], doubtful[ROOM], left[DIM], columns[DIM], trace[2 * DIM], progress[8];
} Shadow;

/* Eliminates the last coordinates of rows [A, b] about the origin. */
static integer eliminate(Shadow *of, const double *table, integer rows, integer columns)
{
    double *block = room_of(fdi_eliminate_room(DIM, ROOM));
    memset(of, 0, sizeof *of);
    copy(of->table, table, rows * (DIM + 1));
    for (integer j = 0; j < DIM; j++) of->left[j] = j;
    for (integer j = 0; j < columns; j++) of->columns[j] = DIM - 1 - j;
    of->progress[0] = of->progress[3] = rows, of->progress[1] = DIM, of->progress[2] = columns;
    integer state;
    do
        state = fdi_eliminate(ROOM, ROOM, 0, of->table, of->other, of->known, of->left, of->columns, of->inner,
                              of->doubtful, of->trace, of->progress, block);
    while (state == PAUSED);
    free(block);
    return state;
}

static double support(integer d, integer m, const double *table, const double *direction)
{
    double at[DIM * ROOM], b[ROOM], found[3 * DIM + 2], origin[DIM] = {0.0};
    double *block = room_of(fdi_supports_room(d, m, 1)), *weights = calloc((size_t)m, sizeof(double));
    integer codes[DIM + 1];
    for (integer i = 0; i < m; i++) {
        const double norm = sqrt(sum_of_squares(table + i * (d + 1), d));
        for (integer j = 0; j < d; j++) at[j * m + i] = table[i * (d + 1) + j] / norm;
        b[i] = table[i * (d + 1) + d] / norm;
    }
    fdi_supports(d, m, 1, at, b, origin, direction, found, codes, weights, block);
    CHECK(codes[d] == OPTIMAL);
    free(weights);
    free(block);
    return dot(direction, found, d);
}

static void shadow_of(integer rows, integer columns)
{
    double table[MOST * (DIM + 1)], direction[DIM];
    Shadow *of = malloc(sizeof *of);
    const integer d = DIM - columns;
    for (integer i = 0; i < rows; i++) {
        double *row = table + i * (DIM + 1);
        if (i < 2 * DIM) { /* bounded */
            fill(row, 0.0, DIM);
            row[i / 2] = i % 2 ? -1.0 : 1.0;
            row[DIM] = 2.0;
        } else {
            draw(row, DIM);
            row[DIM] = 0.75 + 0.25 * uniform();
        }
    }
    CHECK(eliminate(of, table, rows, columns) == FINISHED);
    CHECK(of->progress[1] == d && of->progress[2] == 0);
    for (integer j = 0; j < d; j++) CHECK(of->left[j] == j);
    for (integer i = 0; i < 10; i++) {
        fill(direction, 0.0, DIM);
        draw(direction, d);
        CHECK(near(support(d, of->progress[0], of->table, direction), support(DIM, rows, table, direction), 1e-10));
    }
    free(of);
}

/* Rows of the shadow of a cube are those of a cube, and no more. */
static void shadow_of_a_cube(void)
{
    double table[2 * DIM * (DIM + 1)] = {0.0};
    Shadow *of = malloc(sizeof *of);
    for (integer i = 0; i < 2 * DIM; i++) {
        table[i * (DIM + 1) + i / 2] = i % 2 ? -1.0 : 1.0;
        table[i * (DIM + 1) + DIM] = 1.0;
    }
    CHECK(eliminate(of, table, 2 * DIM, 3) == FINISHED);
    CHECK(of->progress[0] == 2);
    for (integer i = 0; i < 2; i++) CHECK(fabs(of->table[2 * i]) == fabs(of->table[2 * i + 1]));
    CHECK(of->table[0] * of->table[2] < 0.0);
    free(of);
}

int main(void)
{
    for (integer d = 2; d <= DIM; d++)
        for (integer more = 2 * d; more <= 80; more += 13) cube_with_more(d, more);
    for (integer i = 0; i < 6; i++)
        for (integer columns = 1; columns <= 2; columns++) shadow_of(2 * DIM + 2 * i, columns);
    shadow_of_a_cube();
    return failures > 0;
}

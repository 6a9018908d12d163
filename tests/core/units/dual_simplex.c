/* Programs of two variables against all vertices; programs that are empty against their multipliers. */
#include "window_of.h"

enum { ROWS = 4, LIMIT = 1000, QUESTIONS = 5 };

typedef struct { double a, b, bound; } line; /* a z0 + b z1 <= bound */

/* The lines of the box and of every row, two each. */
static integer lines_of(const window *w, line *lines)
{
    integer m = 0;
    for (integer side = 0; side < 2; side++) {
        const double sign = side == 0 ? 1.0 : -1.0;
        lines[m++] = (line){sign, 0.0, 1.0};
        lines[m++] = (line){0.0, sign, 1.0};
        for (integer i = 0; i < w->R; i++)
            lines[m++] = (line){sign * w->G[2 * i], sign * w->G[2 * i + 1], side == 0 ? w->upper[i] : -w->lower[i]};
    }
    return m;
}

/* The largest cost over all vertices; minus infinity if there is none. */
static double over_vertices(const line *lines, integer m, const double *cost)
{
    double best = -INFINITY;
    for (integer i = 0; i < m; i++)
        for (integer j = 0; j < i; j++) {
            const double det = lines[i].a * lines[j].b - lines[j].a * lines[i].b;
            if (fabs(det) < 1e-12) continue;
            const double x = (lines[i].bound * lines[j].b - lines[j].bound * lines[i].b) / det;
            const double y = (lines[i].a * lines[j].bound - lines[j].a * lines[i].bound) / det;
            int inside = 1;
            for (integer k = 0; k < m; k++) inside &= lines[k].a * x + lines[k].b * y <= lines[k].bound + 1e-9;
            if (inside) best = larger(cost[0] * x + cost[1] * y, best);
        }
    return best;
}

/* Whether the multipliers of the rows leave the box less than nothing. */
static int proves(const window *w)
{
    double total[2] = {0.0, 0.0}, value = 0.0;
    for (integer i = 0; i < w->R; i++) {
        const double f = w->farkas[i];
        value += f * (f > 0.0 ? w->upper[i] : w->lower[i]);
        for (integer j = 0; j < 2; j++) total[j] += f * w->G[2 * i + j];
    }
    return value + fabs(total[0]) + fabs(total[1]) < 0.0;
}

/* An inverse that errors have made useless. */
static void spoil(const window *w, integer q)
{
    for (integer i = 0; i < w->K * w->K; i++) w->inverse[q * w->K * w->K + i] *= 1.0 + uniform();
}

static integer of_two_variables(double width)
{
    void *room;
    const window w = program_of(2, ROWS, 8, &room);
    line lines[2 * ROWS + 4];
    integer empty = 0;
    for (integer i = 0; i < ROWS; i++) {
        double g[2];
        draw(g, 2);
        const double middle = uniform();
        put_row(&w, i, g, middle - width * fabs(uniform()), middle + width * fabs(uniform()));
    }
    const integer m = lines_of(&w, lines);
    for (integer i = 0; i < QUESTIONS; i++) { /* the same bases again: a start from what is known, at last from errors */
        const integer q = i % 2;
        double bound;
        draw(w.cost, 2);
        if (i > 2) spoil(&w, q);
        const double expected = over_vertices(lines, m, w.cost);
        const integer outcome = maximise(&w, q, LIMIT, &bound);
        if (outcome == EMPTY) {
            CHECK(proves(&w));
            CHECK(expected == -INFINITY || width < 0.3); /* by less than the oracle's tolerance */
            empty++;
        } else {
            CHECK(outcome == OPTIMAL);
            CHECK(bound >= expected - 1e-8 && bound <= expected + 1e-8);
        }
    }
    CHECK(w.clock[STOPS] == 0);
    free(room);
    return empty;
}

/* A bound of a program that ends at its limit is an outer one all the same. */
static void stopped_programs_are_outer(void)
{
    void *room;
    const window w = program_of(2, ROWS, 8, &room);
    line lines[2 * ROWS + 4];
    for (integer i = 0; i < ROWS; i++) {
        double g[2], bound;
        draw(g, 2);
        put_row(&w, i, g, -0.2, 0.2);
        draw(w.cost, 2);
        const double expected = over_vertices(lines, lines_of(&w, lines), w.cost);
        CHECK(maximise(&w, 0, 0, &bound) == STOPPED);
        CHECK(bound >= expected);
    }
    CHECK(w.clock[STOPS] == ROWS);
    free(room);
}

/* A basis without room asks for it; where there is none to be had, the program stops. */
static void bases_without_room(void)
{
    void *room;
    const window w = program_of(3, ROWS, 2, &room);
    double bound;
    for (integer i = 0; i < 3; i++) {
        double g[] = {0.1, 0.1, 0.1};
        g[i] = 1.0;
        put_row(&w, i, g, -0.25, 0.25);
    }
    fill(w.cost, 1.0, 3);
    CHECK(maximise(&w, 0, LIMIT, &bound) == OVERFULL);
    CHECK(bound >= 0.75 / 1.2);
    w.clock[CAPPED] = 1;
    CHECK(maximise(&w, 0, LIMIT, &bound) == STOPPED);
    free(room);
}

int main(void)
{
    integer empty = 0, full = 0;
    for (integer i = 0; i < 500; i++) full += QUESTIONS - of_two_variables(1.0);
    for (integer i = 0; i < 500; i++) empty += of_two_variables(0.2);
    CHECK(empty > 100);
    CHECK(full > 500);
    stopped_programs_are_outer();
    bases_without_room();
    return failures > 0;
}

/* The bound-flipping ratio test against sorting all breakpoints. */
#include "window_of.h"

enum { MOST = 12 };

static int by_ratio(const void *a, const void *b)
{
    const double one = ((const breakpoint *)a)->ratio, other = ((const breakpoint *)b)->ratio;
    return (one > other) - (one < other);
}

/* The step ends at the first breakpoint in order whose flip takes what is left of the violation. */
static void as_sorted(integer m, double violation)
{
    void *room;
    const window w = program_of(MOST, 1, 2, &room);
    breakpoint sorted[MOST];
    double total = 0.0, left = violation;
    for (integer j = 0; j < m; j++) {
        w.points[j] = (breakpoint){fabs(uniform()), fabs(uniform()), fabs(uniform()), j};
        sorted[j] = w.points[j];
        total += sorted[j].drop;
    }
    qsort(sorted, (size_t)m, sizeof *sorted, by_ratio);
    const entering in = choose_entering(&w, m, violation);
    if (total < violation || m == 0) {
        CHECK(in.flips == -1);
        CHECK(near(in.left, violation - total, 1e-14));
    } else {
        integer flips = 0;
        while (sorted[flips].drop < left) left -= sorted[flips++].drop;
        CHECK(in.flips == flips);
        CHECK(near(in.left, left, 1e-14));
        for (integer j = 0; j <= flips; j++) CHECK(w.points[j].who == sorted[j].who);
    }
    free(room);
}

static void ties_by_the_largest_pivot(void)
{
    void *room;
    const window w = program_of(MOST, 1, 2, &room);
    for (integer j = 0; j < 4; j++) w.points[j] = (breakpoint){0.5, j == 2 ? 0.9 : 0.1, 10.0, j};
    const entering in = choose_entering(&w, 4, 1.0);
    CHECK(in.flips == 0);
    CHECK(w.points[0].who == 2);
    free(room);
}

/* A tiny pivot gives way to a larger one of nearly the same ratio, later or earlier; else it stays. */
static void small_pivots_give_way(void)
{
    void *room;
    const window w = program_of(MOST, 1, 2, &room);
    w.points[0] = (breakpoint){0.5, 1e-8, 10.0, 0};
    w.points[1] = (breakpoint){0.5 + 1e-10, 0.3, 10.0, 1};
    w.points[2] = (breakpoint){0.6, 0.9, 10.0, 2};
    entering in = avoid_small_pivot(&w, 3, choose_entering(&w, 3, 1.0));
    CHECK(in.flips == 0 && w.points[0].who == 1);
    w.points[0] = (breakpoint){0.5 - 1e-10, 0.3, 0.25, 0};
    w.points[1] = (breakpoint){0.5, 1e-8, 10.0, 1};
    w.points[2] = (breakpoint){0.6, 0.9, 10.0, 2};
    in = avoid_small_pivot(&w, 3, choose_entering(&w, 3, 1.0));
    CHECK(in.flips == 0 && w.points[0].who == 0 && near(in.left, 1.0, 1e-15));
    w.points[0] = (breakpoint){0.5, 1e-8, 10.0, 0};
    w.points[1] = (breakpoint){0.6, 0.9, 10.0, 1};
    in = avoid_small_pivot(&w, 2, choose_entering(&w, 2, 1.0));
    CHECK(in.flips == 0 && w.points[0].who == 0);
    free(room);
}

int main(void)
{
    for (integer m = 0; m <= MOST; m++)
        for (integer i = 0; i < 40; i++) as_sorted(m, 0.1 + 0.3 * (double)m * fabs(uniform()));
    ties_by_the_largest_pivot();
    small_pivots_give_way();
    return failures > 0;
}

/* How fast the core's longest loop can be: a combination of rows that stay in the cache, again and again. */
#include "vectors.h"

WIDE static void combine(double *target, const double *matrix, const integer *index, const double *factor,
                         integer count, integer m, integer times)
{
    for (integer t = 0; t < times; t++) add_rows(target, matrix, index, factor, count, m);
}

EXPORTED void combine_again(double *target, const double *matrix, const integer *index, const double *factor,
                            integer count, integer m, integer times)
{
    combine(target, matrix, index, factor, count, m, times);
}

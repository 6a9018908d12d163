/* A window of a few rows and variables that a program fills by itself, without a plant. */
#ifndef WINDOW_OF_H
#define WINDOW_OF_H

#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "window/window.h"

integer fdi_window_layout(const integer *size, integer *table);
const char *fdi_window_arrays(void);

static inline integer arrays_of_a_window(void)
{
    integer count = 0;
    for (const char *at = fdi_window_arrays(); *at; at++) count += *at == ' ';
    return count;
}

/* Zeroed but for its sizes (13,); at a multiple of 64 bytes in *room, which the caller frees. */
static inline window window_of(const integer *size, void **room)
{
    window w;
    integer *table = malloc(sizeof(integer) * 8 * (size_t)arrays_of_a_window());
    const integer bytes = fdi_window_layout(size, table);
    free(table);
    *room = calloc(1, (size_t)bytes + 64);
    char *block = (char *)*room + (64 - (uintptr_t)*room % 64) % 64;
    memcpy(block, size, 13 * sizeof(integer));
    window_open(&w, block);
    return w;
}

/* A window whose program has `variables` >= 2 variables and `rows` rows, and bases of at most `basis`. */
static inline window program_of(integer variables, integer rows, integer basis, void **room)
{
    /* n, nu, nw, ny, nq, nh, nt, na, ni, N, block, K, late: a sample adds neither rows nor variables */
    const integer size[] = {variables, 0, 0, 0, 0, 0, variables, rows, 1, 2, 1, basis, 0};
    window w = window_of(size, room);
    for (integer q = 0; q < w.Q; q++) w.seen_base[q] = -1;
    return w;
}

/* Row i: lower <= g'z <= upper. */
static inline void put_row(const window *w, integer i, const double *g, double lower, double upper)
{
    w->magnitude[i] = 2.0 * (fabs(lower) + fabs(upper)) + 1.0;
    w->lower[i] = lower;
    w->upper[i] = upper;
    for (integer j = 0; j < w->Z; j++) {
        w->G[i * w->Z + j] = w->GT[j * w->R + i] = g[j];
        w->magnitude[i] += 2.0 * fabs(g[j]);
    }
}

#endif

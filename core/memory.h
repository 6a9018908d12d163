/* Pieces of the caller's block, one after the other. Without a block it counts: a layout says its own size. */
#ifndef MEMORY_H
#define MEMORY_H

#include "core.h"

typedef struct {
    double *block; /* NULL: count only */
    integer used;  /* doubles */
} Memory;

static inline double *doubles(Memory *memory, integer count)
{
    double *piece = memory->block ? memory->block + memory->used : NULL;
    memory->used += count;
    return piece;
}

static inline integer *integers(Memory *memory, integer count) /* as wide as doubles */
{
    return (integer *)(void *)doubles(memory, count);
}

#endif

/* The block of a window: its sizes, then its arrays one after the other, each at a multiple of 64 bytes. */
#include "window.h"

enum { ALIGNMENT = 64, DIMENSIONS = 4, SIZE_COUNT = 13 };

static integer rounded_up(integer bytes) { return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT; }

static integer bytes_of(integer entry, const integer *lengths, integer count)
{
    integer bytes = entry;
    for (integer i = 0; i < count; i++) bytes *= lengths[i];
    return rounded_up(bytes);
}

#define READ(name) const integer name = w->name = *size++; (void)name;
#define DERIVE(name, value) const integer name = w->name = (value); (void)name;

void window_open(window *w, void *memory)
{
    const integer *size = memory;
    char *at = (char *)memory + rounded_up(SIZE_COUNT * (integer)sizeof(integer));
    SIZES(READ)
    LENGTHS(DERIVE)
#define PLACE(type, use, name, ...)                                                                                  \
    {                                                                                                                \
        const integer lengths[] = {__VA_ARGS__};                                                                     \
        w->name = (type *)(void *)at;                                                                                \
        at += bytes_of(sizeof(type), lengths, sizeof lengths / sizeof *lengths);                                     \
    }
    ARRAYS(PLACE)
}

/* Where every array lies: use, kind, dimensions, four lengths and the offset in bytes.
 * Returns the bytes of the block; size (13,) as SIZES, table (arrays, 8). */
EXPORTED integer fdi_window_layout(const integer *size, integer *table)
{
    window sizes, *w = &sizes;
    integer at = rounded_up(SIZE_COUNT * (integer)sizeof(integer));
    SIZES(READ)
    LENGTHS(DERIVE)
#define LIST(type, use, name, ...)                                                                                   \
    {                                                                                                                \
        const integer lengths[] = {__VA_ARGS__}, count = sizeof lengths / sizeof *lengths;                           \
        *table++ = use;                                                                                              \
        *table++ = KIND_##type;                                                                                      \
        *table++ = count;                                                                                            \
        for (integer i = 0; i < DIMENSIONS; i++) *table++ = i < count ? lengths[i] : 1;                              \
        *table++ = at;                                                                                               \
        at += bytes_of(sizeof(type), lengths, count);                                                                \
    }
    ARRAYS(LIST)
    return at;
}

/* Names of the sizes and of the arrays, each followed by a space. */
EXPORTED const char *fdi_window_sizes(void)
{
#define NAME(name) #name " "
    return SIZES(NAME);
}

EXPORTED const char *fdi_window_arrays(void)
{
#define ARRAY_NAME(type, use, name, ...) #name " "
    return ARRAYS(ARRAY_NAME);
}

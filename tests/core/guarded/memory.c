/* The block of a window with guards: between the end of an array and the next multiple of 64 bytes nobody may read or
 * write. Takes the place of core/window/memory.c in a library that is built for AddressSanitizer. */
#include <sanitizer/asan_interface.h>

#define window_open open_plainly
#include "window/memory.c"
#undef window_open

void window_open(window *w, void *memory);

static void guard(void *array, integer entry, const integer *lengths, integer count)
{
    integer bytes = entry;
    for (integer i = 0; i < count; i++) bytes *= lengths[i];
    ASAN_POISON_MEMORY_REGION((char *)array + bytes, (size_t)(rounded_up(bytes) - bytes));
}

#define NAMED(name) const integer name = w->name; (void)name;
#define NAMED_LENGTH(name, value) NAMED(name)

void window_open(window *w, void *memory)
{
    open_plainly(w, memory);
    SIZES(NAMED)
    LENGTHS(NAMED_LENGTH)
#define GUARD(type, use, name, ...)                                                                                  \
    {                                                                                                                \
        const integer lengths[] = {__VA_ARGS__};                                                                     \
        guard(w->name, sizeof(type), lengths, sizeof lengths / sizeof *lengths);                                     \
    }
    ARRAYS(GUARD)
}

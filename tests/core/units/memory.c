/* The block of a window: arrays one after the other, apart, at multiples of 64 bytes, and the same for all who open it. */
#include "window_of.h"

enum { ENTRIES = 8 };

static integer bytes_of_entry(integer kind)
{
    return kind == KIND_breakpoint ? (integer)sizeof(breakpoint) : (integer)sizeof(double);
}

static void layout(void)
{
    integer size[13];
    for (integer i = 0; i < 13; i++) size[i] = whole(0, 5);
    size[0] = whole(1, 5);
    const integer count = arrays_of_a_window();
    integer *table = malloc(sizeof(integer) * ENTRIES * (size_t)count), end = 13 * (integer)sizeof(integer);
    const integer bytes = fdi_window_layout(size, table);
    for (integer i = 0; i < count; i++) {
        const integer *entry = table + ENTRIES * i;
        CHECK(entry[7] % 64 == 0);
        CHECK(entry[7] >= end && entry[7] < end + 64);
        end = entry[7] + bytes_of_entry(entry[1]);
        if (entry[0] == KEPT) CHECK(entry[1] != KIND_breakpoint);
        for (integer j = 3; j < 7; j++) CHECK(j - 3 < entry[2] || entry[j] == 1);
        end += bytes_of_entry(entry[1]) * (entry[3] * entry[4] * entry[5] * entry[6] - 1);
    }
    CHECK(bytes >= end && bytes < end + 64);
    void *room;
    const window w = window_of(size, &room);
    const char *block = (const char *)w.clock - table[7];
    CHECK(memcmp(block, size, sizeof size) == 0);
    CHECK((const char *)w.answer - block == table[ENTRIES * (count - 1) + 7]);
    CHECK(w.Z == w.n + (w.N + w.late) * (w.nw + w.nq));
    CHECK(w.R == w.na + (w.N + 1) * (w.ny + w.nh + 2 * w.nq));
    free(room);
    free(table);
}

int main(void)
{
    for (integer i = 0; i < 50; i++) layout();
    return failures > 0;
}

/* Volume of a polytope of which the vertices are known, and which of them lie on which rows.
 *
 * Each face is joined from its first vertex to the triangulations of its facets that do not hold that vertex (a pulling
 * triangulation, De Loera, Rambau and Santos 2010, section 4.3.2). The volumes of simplices are all positive, so that
 * nothing cancels in their sum.
 */
#include "polytopes/integers.h"
#include "polytopes/polytopes.h"
#include "vectors.h"

static const integer STEPS = 40000; /* faces that are looked at; beyond, other methods are quicker */

typedef struct {
    integer n, k, words, m, left;
    const double *points; /* (k, n) */
    uint64_t *rows;       /* (m, words) the vertices on each row, as bits */
    uint64_t *faces;      /* (n + 1, m + 1, words) of each dimension on the way down: a face and its facets */
    integer *apex;        /* (n + 1,) */
    double *edges;        /* (n, n) */
    double total;
} Pulling;

static integer lay_out(Pulling *volume, double *block, integer n, integer m, integer k)
{
    Memory memory = {block, 0};
    volume->n = n, volume->m = m, volume->k = k, volume->words = (k + 63) / 64, volume->left = STEPS;
    volume->rows = (uint64_t *)(void *)integers(&memory, m * volume->words);
    volume->faces = (uint64_t *)(void *)integers(&memory, (n + 1) * (m + 1) * volume->words);
    volume->apex = integers(&memory, n + 1), volume->edges = doubles(&memory, n * n), volume->total = 0.0;
    return memory.used;
}

integer volume_room(integer n, integer m, integer k)
{
    Pulling volume;
    return lay_out(&volume, NULL, n, m, k);
}

/* |det| of (n, n), which is overwritten. */
static double determinant(double *matrix, integer n)
{
    double product = 1.0;
    for (integer c = 0; c < n; c++) {
        integer best = c;
        for (integer i = c + 1; i < n; i++)
            if (fabs(matrix[i * n + c]) > fabs(matrix[best * n + c])) best = i;
        const double pivot = matrix[best * n + c];
        if (pivot == 0.0) return 0.0;
        for (integer j = c; best != c && j < n; j++) {
            const double kept = matrix[c * n + j];
            matrix[c * n + j] = matrix[best * n + j], matrix[best * n + j] = kept;
        }
        product *= fabs(pivot);
        for (integer i = c + 1; i < n; i++)
            add_multiple(matrix + i * n + c, -matrix[i * n + c] / pivot, matrix + c * n + c, n - c);
    }
    return product;
}

/* The numbers in a set that has at most n + 1 of them go to `numbers`; how many it has. */
static integer members(const uint64_t *set, integer words, integer most_numbers, integer *numbers)
{
    integer count = 0;
    for (integer w = 0; w < words; w++)
        for (uint64_t rest = set[w]; rest; rest &= rest - 1, count++)
            if (count < most_numbers) numbers[count] = 64 * w + bits((rest & (~rest + 1)) - 1);
    return count;
}

static void add_simplex(Pulling *volume)
{
    const integer n = volume->n;
    const double *first = volume->points + volume->apex[0] * n;
    for (integer i = 0; i < n; i++)
        for (integer j = 0; j < n; j++)
            volume->edges[i * n + j] = volume->points[volume->apex[i + 1] * n + j] - first[j];
    volume->total += determinant(volume->edges, n);
}

static int within(const uint64_t *small, const uint64_t *large, integer words)
{
    for (integer w = 0; w < words; w++)
        if (small[w] & ~large[w]) return 0;
    return 1;
}

/* The largest of the parts that rows have in common with a face, without it: its facets, behind it; how many. */
static integer facets_of(const Pulling *volume, uint64_t *face)
{
    const integer words = volume->words;
    integer count = 0;
    for (integer i = 0; i < volume->m; i++) {
        uint64_t *part = face + (count + 1) * words, any = 0;
        for (integer w = 0; w < words; w++) any |= part[w] = face[w] & volume->rows[i * words + w];
        int kept = any != 0 && !within(face, part, words);
        for (integer q = 1; q <= count && kept; q++) kept = !within(part, face + q * words, words);
        if (!kept) continue;
        integer put = 1;
        for (integer q = 1; q <= count; q++) {
            const uint64_t *other = face + q * words;
            if (within(other, part, words)) continue;
            for (integer w = 0; w < words; w++) face[put * words + w] = other[w];
            put++;
        }
        for (integer w = 0; w < words; w++) face[put * words + w] = part[w];
        count = put;
    }
    return count;
}

/* Adds the simplices of a face, which lies at the place of its dimension; 0 if there are too many. */
static int pull(Pulling *volume, integer level)
{
    const integer words = volume->words, dim = volume->n - level, size = (volume->m + 1) * words;
    uint64_t *face = volume->faces + level * size;
    const integer count = members(face, words, dim + 1, volume->apex + level);
    if (volume->left-- <= 0 || count <= dim) return 0;
    if (count == dim + 1) {
        add_simplex(volume);
        return 1;
    }
    const integer apex = volume->apex[level], facets = facets_of(volume, face);
    for (integer q = 1; q <= facets; q++) {
        const uint64_t *facet = face + q * words;
        if (facet[apex / 64] >> (apex % 64) & 1) continue;
        for (integer w = 0; w < words; w++) face[size + w] = facet[w];
        volume->apex[level] = apex;
        if (!pull(volume, level + 1)) return 0;
    }
    return 1;
}

/* Volume of the hull of points (k, n), its vertices; on (k, row_words): bits of the m rows that each lies on. -1 if it
 * has too many simplices, or a face has too few vertices. */
double volume_of(integer n, integer m, integer k, const double *points, const uint64_t *on, integer row_words,
                 double *block)
{
    Pulling volume;
    lay_out(&volume, block, n, m, k);
    volume.points = points;
    for (integer q = 0; q < m * volume.words; q++) volume.rows[q] = 0;
    for (integer w = 0; w < volume.words; w++) volume.faces[w] = 0;
    for (integer v = 0; v < k; v++) {
        const uint64_t bit = (uint64_t)1 << (v % 64);
        volume.faces[v / 64] |= bit;
        for (integer i = 0; i < m; i++)
            if (on[v * row_words + i / 64] >> (i % 64) & 1) volume.rows[i * volume.words + v / 64] |= bit;
    }
    if (!pull(&volume, 0)) return -1.0;
    for (integer j = 2; j <= n; j++) volume.total /= (double)j;
    return volume.total;
}

/* Units in which rows and columns are about even: powers of two, from exponents of entries alone.
 *
 * Rows and columns that are multiplied by powers of two get other exponents, and the same scaled numbers to the bit:
 * along a spanning tree of the nonzero pattern every exponent becomes zero, whatever it was, and all that follows sees
 * only what the tree leaves. Least squares make the exponents small (Curtis and Reid 1972, rounded to integers); the
 * right-hand sides say how large each block of coordinates is.
 *
 * Exponents are whole numbers in doubles until the end: sums of them are exact, and loops over them vectorise.
 */
#include "polytopes/polytopes.h"
#include "powers.h"
#include "vectors.h"

static const integer SWEEPS = 8;     /* of alternating means; a table without zeros needs one */
static const integer FARTHEST = 498; /* exponent of the distance of a hyperplane whose square and sums are floats */
static const double STILL = 0.1;     /* change of an exponent from which another sweep is not worth it */
static const double SMALLEST = 1e-300, LARGEST = 1e300; /* scaled numbers beyond are none */
static const integer WIDEST = 1000;  /* exponent of a column's unit */
static const double NONE = -1e12;    /* below every exponent */

typedef struct {
    integer m, d;
    double *e, *nonzero; /* (m, d) exponents of the entries; 1 where there is one */
    double *r, *s;       /* (m,), (d,) exponents to find: e + r + s is to be about zero */
    double *counts;      /* (m,) entries of a row */
    integer *block;      /* (d,) the first column of those that rows join with this one */
    integer *home;       /* (m,) the block of a row; -1: it has no entries */
    double *top;         /* (d,) of a block: the largest exponent of its right-hand sides */
    integer *seen, *queue;
    double *down, *along, *total, *weight;
} Table;

static void lay_out_table(Table *table, Memory *memory, integer m, integer d)
{
    table->m = m, table->d = d;
    table->e = doubles(memory, m * d), table->nonzero = doubles(memory, m * d);
    table->r = doubles(memory, m), table->s = doubles(memory, d), table->counts = doubles(memory, m);
    table->block = integers(memory, d), table->home = integers(memory, m), table->top = doubles(memory, d);
    table->seen = integers(memory, m), table->queue = integers(memory, d);
    table->down = doubles(memory, m), table->along = doubles(memory, d);
    table->total = doubles(memory, d), table->weight = doubles(memory, d);
}

EXPORTED integer fdi_exponents_room(integer m, integer d)
{
    Table table;
    Memory memory = {NULL, 0};
    lay_out_table(&table, &memory, m, d);
    return memory.used;
}

static void read_exponents(Table *table, const double *rows)
{
    const integer m = table->m, d = table->d;
    for (integer i = 0; i < m; i++) {
        table->counts[i] = 0.0;
        for (integer j = 0; j < d; j++) {
            const double entry = rows[i * d + j];
            table->nonzero[i * d + j] = entry != 0.0 ? 1.0 : 0.0;
            table->e[i * d + j] = entry != 0.0 ? (double)exponent_of(entry) : 0.0;
            table->counts[i] += table->nonzero[i * d + j];
        }
    }
    fill(table->r, 0.0, m);
    fill(table->s, 0.0, d);
}

/* Exponents r, s that make e + r + s zero along a spanning tree of each block. */
static void along_a_tree(Table *table)
{
    const integer m = table->m, d = table->d;
    for (integer j = 0; j < d; j++) table->block[j] = -1;
    for (integer i = 0; i < m; i++) table->seen[i] = 0;
    for (integer root = 0; root < d; root++) {
        if (table->block[root] >= 0) continue;
        table->block[root] = root, table->queue[0] = root;
        for (integer first = 0, last = 1; first < last; first++) {
            const integer j = table->queue[first];
            for (integer i = 0; i < m; i++) {
                const double *e = table->e + i * d, *nonzero = table->nonzero + i * d;
                if (nonzero[j] == 0.0 || table->seen[i]) continue;
                table->seen[i] = 1;
                table->r[i] = -(e[j] + table->s[j]);
                for (integer k = 0; k < d; k++) {
                    if (nonzero[k] == 0.0 || table->block[k] >= 0) continue;
                    table->block[k] = root, table->queue[last++] = k;
                    table->s[k] = -(e[k] + table->r[i]);
                }
            }
        }
    }
}

/* For the present corrections of the columns, the best ones of the rows, then of the columns; how far those moved. */
static double sweep(Table *table)
{
    const integer m = table->m, d = table->d;
    const double *s = table->s;
    double *along = table->along, *total = table->total, *weight = table->weight, change = 0.0;
    fill(total, 0.0, d);
    fill(weight, 0.0, d);
    for (integer i = 0; i < m; i++) {
        const double *e = table->e + i * d, *nonzero = table->nonzero + i * d, r = table->r[i];
        double sum = 0.0;
        for (integer j = 0; j < d; j++) sum += nonzero[j] * (e[j] + r + s[j] + along[j]);
        const double down = -sum / larger(table->counts[i], 1.0);
        if (!(table->counts[i] > 1.0)) continue;
        for (integer j = 0; j < d; j++) {
            total[j] += nonzero[j] * (e[j] + r + s[j] + down);
            weight[j] += nonzero[j];
        }
    }
    for (integer j = 0; j < d; j++) {
        if (!(weight[j] > 0.0)) continue;
        change = larger(fabs(along[j] + total[j] / weight[j]), change);
        along[j] = -total[j] / weight[j];
    }
    return change;
}

/* Corrects s so that the squares of e + r + s are small over the entries, for the best r. */
static void by_least_squares(Table *table)
{
    fill(table->along, 0.0, table->d);
    for (integer k = 0; k < SWEEPS; k++)
        if (sweep(table) < STILL) break;
    for (integer j = 0; j < table->d; j++) table->s[j] += floor(table->along[j] + 0.5);
}

/* r so that the largest entry of each row is in [1/2, 1), then both so that right-hand sides are at most one. */
static void by_sizes(Table *table, const double *rhs)
{
    const integer m = table->m, d = table->d;
    double *r = table->r, *s = table->s, *top = table->top;
    fill(top, NONE, d);
    for (integer i = 0; i < m; i++) {
        double largest = NONE;
        integer home = -1;
        for (integer j = 0; j < d; j++)
            if (table->nonzero[i * d + j] != 0.0)
                largest = larger(table->e[i * d + j] + s[j], largest), home = table->block[j];
        table->home[i] = home;
        r[i] = home >= 0 ? -largest : -(double)exponent_of(rhs[i]);
        if (home >= 0 && rhs[i] != 0.0) top[home] = larger((double)exponent_of(rhs[i]) + r[i], top[home]);
    }
    for (integer j = 0; j < d; j++)
        if (top[table->block[j]] > NONE) s[j] += top[table->block[j]];
    for (integer i = 0; i < m; i++)
        if (table->home[i] >= 0 && top[table->home[i]] > NONE) r[i] -= top[table->home[i]];
}

/* Exponents r (m,) and s (d,): 2^(r_i + s_j) rows[i, j] has rows whose largest entry is in [1/2, 1).
 *
 * 2^r_i rhs[i] is at most one, and about one somewhere in each block of coordinates that rows join, and in rows of
 * zeros. rows (m, d), rhs (m,).
 */
EXPORTED void fdi_exponents(integer m, integer d, const double *rows, const double *rhs, integer *r, integer *s,
                            double *block)
{
    Table table;
    Memory memory = {block, 0};
    lay_out_table(&table, &memory, m, d);
    read_exponents(&table, rows);
    along_a_tree(&table);
    by_least_squares(&table);
    by_sizes(&table, rhs);
    for (integer i = 0; i < m; i++) r[i] = (integer)table.r[i];
    for (integer j = 0; j < d; j++) s[j] = (integer)table.s[j];
}

EXPORTED integer fdi_scaled_room(integer m, integer d) { return m * (d + 1) + fdi_exponents_room(m, d); }

/* The numbers of the rows that are not zero; they themselves, compact, if they are not all. */
static integer rows_that_bound(integer m, integer d, const double **rows, const double **rhs, integer *kept, double *to)
{
    integer k = 0;
    for (integer i = 0; i < m; i++)
        if (largest_magnitude(*rows + i * d, d) > 0.0) kept[k++] = i;
    if (k == m) return m;
    for (integer q = 0; q < k; q++) {
        copy(to + q * d, *rows + kept[q] * d, d);
        to[m * d + q] = (*rhs)[kept[q]];
    }
    *rows = to, *rhs = to + m * d;
    return k;
}

/* The rows that are not zero in even units, transposed, with norms in [1/2, 1); returns how many they are, k.
 *
 * rows (m, d), rhs (m,). Leaves at (d, k), b and norms (k,) one after the other in `scaled`, which has room for
 * (d + 2) m doubles. In codes: exponents s (d,) and r (m,) of which k are used; numbers of the rows (m,), k of them;
 * and a row whose hyperplane is more than 1e150 from the origin, and one whose scaled numbers are no floats, -1 where
 * there is none.
 */
EXPORTED integer fdi_scaled(integer m, integer d, const double *rows, const double *rhs, double *scaled,
                            integer *codes, double *block)
{
    integer *s = codes, *r = s + d, *kept = r + m, *refused = kept + m;
    const integer k = rows_that_bound(m, d, &rows, &rhs, kept, block);
    double *at = scaled, *b = at + d * k, *norms = b + k;
    integer far = -1, lost = -1;
    fdi_exponents(k, d, rows, rhs, r, s, block + m * (d + 1));
    for (integer q = 0; q < k; q++) {
        const double *row = rows + q * d;
        double square = 0.0;
        for (integer j = 0; j < d; j++) {
            const double value = times_power(row[j], r[q] + s[j]);
            square += value * value;
        }
        if (rhs[q] != 0.0 && exponent_of(rhs[q]) - exponent_of(largest_magnitude(row, d)) > FARTHEST) far = kept[q];
        const double norm = sqrt(square);
        const integer shift = exponent_of(norm);
        r[q] -= shift;
        norms[q] = times_power(norm, -shift);
        for (integer j = 0; j < d; j++) {
            const double value = times_power(row[j], r[q] + s[j]);
            at[j * k + q] = value;
            if (row[j] != 0.0 && fabs(value) < SMALLEST) lost = kept[q];
        }
        b[q] = times_power(rhs[q], r[q]);
        if (rhs[q] != 0.0 && !(SMALLEST < fabs(b[q]) && fabs(b[q]) < LARGEST)) lost = kept[q];
    }
    for (integer j = 0; j < d; j++)
        if (s[j] > WIDEST || s[j] < -WIDEST) lost = most(lost, 0);
    refused[0] = far, refused[1] = lost;
    return k;
}

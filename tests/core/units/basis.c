/* A basis: the inverse of G[I, J] is one after a factorisation and after each of the four changes. */
#include "window_of.h"

enum { VARIABLES = 9, ROWS = 7, ROOM = 8 };

static int is_inverse(const window *w, integer k)
{
    for (integer a = 0; a < k; a++)
        for (integer other = 0; other < k; other++) {
            double value = 0.0;
            for (integer b = 0; b < k; b++)
                value += w->G[w->rows[a] * w->Z + w->cols[b]] * w->inverse[b * w->K + other];
            if (!near(value, a == other ? 1.0 : 0.0, 1e-8)) return 0;
        }
    return 1;
}

/* Basic are the columns, and no others; no row and no column is there twice. */
static int is_consistent(const window *w, integer k)
{
    integer basic = 0;
    for (integer j = 0; j < w->Z; j++) basic += w->status[j] == BASIC;
    for (integer b = 0; b < k; b++) {
        if (w->status[w->cols[b]] != BASIC) return 0;
        for (integer a = 0; a < b; a++)
            if (w->rows[a] == w->rows[b] || w->cols[a] == w->cols[b]) return 0;
    }
    return basic == k;
}

static window drawn(void **room)
{
    window w = program_of(VARIABLES, ROWS, ROOM, room);
    double g[VARIABLES];
    for (integer i = 0; i < ROWS; i++) {
        draw(g, VARIABLES);
        put_row(&w, i, g, -1.0, 1.0);
    }
    forget_basis(&w, 0);
    return w;
}

/* Rows 0 .. k - 1 and as many columns, basic. */
static integer begin(const window *w, integer k)
{
    for (integer b = 0; b < k; b++) {
        w->rows[b] = b;
        w->cols[b] = VARIABLES - 1 - b;
        w->status[VARIABLES - 1 - b] = BASIC;
    }
    return factor_basis(w, 0, k, k, 1e-11);
}

/* What the method hands over for a change by the row of the tableau of what leaves. */
static void tableau(const window *w, integer k, leaving out)
{
    for (integer a = 0; a < k; a++) {
        double value = 0.0;
        for (integer b = 0; b < k; b++)
            value += out.row < 0 ? (b == out.position ? w->inverse[b * w->K + a] : 0.0)
                                 : w->G[out.row * w->Z + w->cols[b]] * w->inverse[b * w->K + a];
        w->wk[a] = value;
    }
    for (integer j = 0; j < w->Z; j++) {
        w->alpha[j] = out.row < 0 ? 0.0 : w->G[out.row * w->Z + j];
        for (integer a = 0; a < k; a++) w->alpha[j] -= w->wk[a] * w->G[w->rows[a] * w->Z + j];
    }
}

static void factorisations(void)
{
    for (integer k = 0; k < ROWS; k++) {
        void *room;
        const window w = drawn(&room);
        CHECK(begin(&w, k) == k);
        CHECK(is_inverse(&w, k));
        CHECK(is_consistent(&w, k));
        free(room);
    }
}

/* A row that is a multiple of another leaves the basis, and a column with it; columns that are short stand in. */
static void dependent_rows_leave(void)
{
    void *room;
    const window w = drawn(&room);
    double g[VARIABLES];
    for (integer j = 0; j < VARIABLES; j++) g[j] = 3.0 * w.G[j];
    put_row(&w, 2, g, -1.0, 1.0);
    CHECK(begin(&w, 4) == 3);
    CHECK(is_inverse(&w, 3));
    CHECK(is_consistent(&w, 3));
    forget_basis(&w, 0);
    w.rows[0] = 3, w.rows[1] = 4, w.cols[0] = 5, w.status[5] = BASIC;
    CHECK(factor_basis(&w, 0, 2, 1, 1e-11) == 2);
    CHECK(is_inverse(&w, 2));
    CHECK(is_consistent(&w, 2));
    free(room);
}

static void changes(void)
{
    for (integer trial = 0; trial < 200; trial++) {
        void *room;
        const window w = drawn(&room);
        integer k = begin(&w, 4);
        const integer fresh = whole(4, ROWS - 1), column = whole(0, 4), at = whole(0, 3), position = whole(0, 3);
        const int is_row = trial % 2, is_variable = trial / 2 % 2;
        const leaving out = {is_row ? fresh : -1, is_row ? -1 : position, 1.0, 0.5};
        tableau(&w, k, out);
        const double pivot = is_variable ? w.alpha[column] : w.wk[at];
        if (fabs(pivot) > 1e-3) {
            k = change_basis(&w, 0, k, out, is_variable ? column : w.Z + at, 0.25);
            CHECK(k == 4 + (is_row && is_variable) - (!is_row && !is_variable));
            CHECK(is_inverse(&w, k));
            CHECK(is_consistent(&w, k));
        }
        free(room);
    }
}

int main(void)
{
    factorisations();
    dependent_rows_leave();
    changes();
    return failures > 0;
}

/* The loop over a tape's slots, in intervals and in linear forms. */
#include "tape/tape.h"

#include "vectors.h"

#define READ(name) t->name = *size++;

const double *tape_open(tape *t, const double *block, Memory *scratch)
{
    const integer *size = (const integer *)(const void *)block;
    TAPE_SIZES(READ)
    t->op = size;
    t->operand = t->op + t->slots;
    t->output = t->operand + 3 * t->slots;
    t->first = t->output + t->rows;
    t->column = t->first + t->slots + 1;
    t->constant = (const double *)(const void *)(t->column + t->listed);
    t->range = (fdi_interval *)(void *)doubles(scratch, 2 * t->slots);
    t->form = (form *)(void *)doubles(scratch, (integer)((sizeof(form) + 7) / 8) * t->slots);
    t->g = doubles(scratch, (t->slots + SPARE) * t->free);
    t->centre = doubles(scratch, t->free);
    t->radius = doubles(scratch, t->free);
    t->why = integers(scratch, t->slots);
    t->where = integers(scratch, t->slots);
    return t->constant + 2 * t->slots;
}

static const integer *operands_of(const tape *t, integer i) { return t->operand + 3 * i; }

/* A slot has no value, for the reason of the first operand that has none, if that is it. */
static void missing(const tape *t, integer i, int why)
{
    integer from = -1;
    for (integer o = 0; o < 3; o++) {
        const integer slot = operands_of(t, i)[o];
        if (t->why[slot] != BOUNDED && (from < 0 || t->why[from] == UNKNOWN)) from = slot;
    }
    t->why[i] = from < 0 ? why : t->why[from];
    t->where[i] = from < 0 ? i : t->where[from];
}

/* Whether an operation has the operands that it needs: all, or the argument of SELECT. */
static int has_operands(const tape *t, integer i)
{
    const integer *of = operands_of(t, i);
    if (t->op[i] == SELECT) return t->why[of[0]] == BOUNDED;
    return t->why[of[0]] == BOUNDED && t->why[of[1]] == BOUNDED;
}

static const fdi_interval *range_if_any(const tape *t, integer slot)
{
    return t->why[slot] == BOUNDED ? t->range + slot : NULL;
}

static void take_range(const tape *t, integer i)
{
    const integer *of = operands_of(t, i);
    int why = NO_PIECE;
    if (has_operands(t, i))
        why = fdi_interval_applied(t->op[i], t->range + of[0], range_if_any(t, of[1]), range_if_any(t, of[2]),
                                   t->range + i);
    t->why[i] = BOUNDED;
    if (why != BOUNDED) missing(t, i, why);
    if (t->op[i] == DIV && t->why[i] == UNKNOWN && t->why[of[1]] == BOUNDED && has_zero(t->range[of[1]]))
        t->why[i] = DIVIDES_BY_ZERO, t->where[i] = i; /* whatever it divides */
}

static int are_bounded(const tape *t, int may_be_unknown, refusal *refused)
{
    for (integer row = 0; row < t->rows; row++) {
        const integer slot = t->output[row];
        if (t->why[slot] == BOUNDED || (t->why[slot] == UNKNOWN && may_be_unknown)) continue;
        *refused = (refusal){row, t->why[slot], t->op[t->where[slot]]};
        return 0;
    }
    return 1;
}

int tape_ranges(const tape *t, const double *lower, const double *upper, int may_be_unknown, refusal *refused)
{
    for (integer i = 0; i < t->slots; i++) {
        const integer j = operands_of(t, i)[0];
        t->why[i] = BOUNDED;
        if (t->op[i] == CONSTANT)
            t->range[i] = interval(t->constant[2 * i], t->constant[2 * i + 1]);
        else if (t->op[i] != VARIABLE)
            take_range(t, i);
        else if (lower[j] == lower[j])
            t->range[i] = interval(lower[j], upper[j]);
        else
            t->why[i] = UNKNOWN, t->where[i] = i;
    }
    return are_bounded(t, may_be_unknown, refused);
}

static support box_of(const tape *t, const double *lower, const double *upper)
{
    double reach = 1.0;
    for (integer j = 0; j < t->free; j++) {
        const double c = t->centre[j] = 0.5 * lower[j] + 0.5 * upper[j];
        t->radius[j] = above(larger(upper[j] - c, c - lower[j]));
    }
    for (integer i = 0; i < t->slots; i++) /* of those that are read */
        if (t->op[i] == VARIABLE && t->operand[3 * i] < t->free) reach += t->radius[t->operand[3 * i]];
    return (support){t->radius, 0x1p-1022 * reach, NULL, 0};
}

static void take_form(const tape *t, integer i, const support *s, form *spare)
{
    const integer *of = operands_of(t, i);
    fdi_interval values;
    int why = NO_PIECE;
    if (has_operands(t, i)) {
        const fdi_interval *a = &t->form[of[0]].range, *b = &t->form[of[1]].range, *c = &t->form[of[2]].range;
        const int has_b = t->why[of[1]] == BOUNDED, has_c = t->why[of[2]] == BOUNDED;
        why = fdi_interval_applied(t->op[i], a, has_b ? b : NULL, has_c ? c : NULL, &values);
    }
    t->why[i] = BOUNDED;
    const form *of_first = t->form + of[0], *of_second = t->form + of[1], *of_third = t->form + of[2];
    if (why == BOUNDED && !form_applied(t->op[i], of_first, of_second, of_third, values, s, spare, t->form + i))
        why = BEYOND_FLOATS;
    if (why != BOUNDED) missing(t, i, why);
}

int tape_forms(const tape *t, const double *lower, const double *upper, refusal *refused)
{
    support s = box_of(t, lower, upper);
    form spare[SPARE];
    fill(t->g, 0.0, (t->slots + SPARE) * t->free); /* a form is zero where its slot reads nothing */
    for (integer i = 0; i < SPARE; i++) spare[i].g = t->g + (t->slots + i) * t->free;
    for (integer i = 0; i < t->slots; i++) {
        const integer j = operands_of(t, i)[0];
        form *f = t->form + i;
        f->g = t->g + i * t->free;
        s.column = t->column + t->first[i], s.count = t->first[i + 1] - t->first[i];
        t->why[i] = BOUNDED;
        if (t->op[i] == CONSTANT)
            form_of_constant(f, interval(t->constant[2 * i], t->constant[2 * i + 1]), &s);
        else if (t->op[i] != VARIABLE)
            take_form(t, i, &s, spare);
        else if (j < t->free)
            form_of_coordinate(f, t->centre[j], t->radius[j], interval(lower[j], upper[j]), j);
        else
            form_of_constant(f, interval(lower[j], upper[j]), &s);
    }
    return are_bounded(t, 0, refused);
}

/* -- what Python asks of a tape alone --------------------------------------------------------------- */

/* Doubles of scratch that a tape needs. */
EXPORTED integer fdi_tape_room(const double *block)
{
    tape t;
    Memory counted = {NULL, 0};
    tape_open(&t, block, &counted);
    return counted.used;
}

/* Bounds (rows) over a box; told (3) is the row without a range, why, and the operation. Returns whether there is none. */
EXPORTED integer fdi_tape_ranges(const double *block, double *scratch, const double *lower, const double *upper,
                                 double *low, double *high, integer *told)
{
    tape t;
    Memory memory = {scratch, 0};
    refusal refused;
    tape_open(&t, block, &memory);
    if (!tape_ranges(&t, lower, upper, 1, &refused)) {
        told[0] = refused.row, told[1] = refused.why, told[2] = refused.op;
        return 1;
    }
    for (integer row = 0; row < t.rows; row++) {
        const fdi_interval range = range_of_row(&t, row);
        low[row] = range.low, high[row] = range.high;
    }
    return 0;
}

/* Forms over a box: k, rest and range (rows, 5), g (rows, free); its centre and half-widths (2, free). */
EXPORTED integer fdi_tape_forms(const double *block, double *scratch, const double *lower, const double *upper,
                                double *values, double *g, double *box, integer *told)
{
    tape t;
    Memory memory = {scratch, 0};
    refusal refused;
    tape_open(&t, block, &memory);
    if (!tape_forms(&t, lower, upper, &refused)) {
        told[0] = refused.row, told[1] = refused.why, told[2] = refused.op;
        return 1;
    }
    for (integer row = 0; row < t.rows; row++) {
        const form *f = row_of(&t, row);
        const double found[] = {f->k, f->rest.low, f->rest.high, f->range.low, f->range.high};
        copy(values + 5 * row, found, 5);
        copy(g + row * t.free, f->g, t.free);
    }
    copy(box, t.centre, t.free);
    copy(box + t.free, t.radius, t.free);
    return 0;
}

/* The ranges of the operations of a tape. */
#include "tape/tape.h"

/* At zero a switch that slides takes every number between -1 and 1 (Filippov). */
static fdi_interval signs(fdi_interval a) { return interval(a.low > 0.0 ? 1.0 : -1.0, a.high < 0.0 ? -1.0 : 1.0); }

static int select(const fdi_interval *t, const fdi_interval *first, const fdi_interval *second, fdi_interval *value)
{
    const int may_first = t->low < 0.0, may_second = t->high >= 0.0;
    if ((may_first && !first) || (may_second && !second)) return NO_PIECE;
    if (may_first && may_second)
        *value = interval(smaller(first->low, second->low), larger(first->high, second->high));
    else
        *value = may_first ? *first : *second;
    return BOUNDED;
}

int fdi_interval_applied(integer op, const fdi_interval *a, const fdi_interval *b, const fdi_interval *c,
                         fdi_interval *value)
{
    switch (op) {
    case NEG: *value = opposite(*a); break;
    case ADD: *value = sum(*a, *b); break;
    case SUB: *value = difference(*a, *b); break;
    case MUL: *value = product(*a, *b); break;
    case SQR: *value = square(*a); break;
    case INV:
        if (has_zero(*a)) return DIVIDES_BY_ZERO;
        *value = inverse(*a);
        break;
    case DIV:
        if (has_zero(*b)) return DIVIDES_BY_ZERO;
        *value = product(*a, inverse(*b));
        break;
    case SQRT:
        if (a->low < 0.0) return ROOT_OF_NEGATIVE;
        *value = root(*a);
        break;
    case EXP: *value = fdi_exp_over(*a); break;
    case LOG:
        if (a->low <= 0.0) return LOG_OF_ZERO;
        *value = fdi_log_over(*a);
        break;
    case SIN: *value = fdi_sin_over(*a); break;
    case COS: *value = fdi_cos_over(*a); break;
    case TANH: *value = fdi_tanh_over(*a); break;
    case ABS: *value = magnitudes(*a); break;
    case SIGN: *value = signs(*a); break;
    case SROOT: *value = signed_root(*a); break;
    case MAX: *value = interval(larger(a->low, b->low), larger(a->high, b->high)); break;
    case ATAN2: *value = fdi_atan2_over(*a, *b); break;
    default: {
        const int why = select(a, b, c, value);
        if (why != BOUNDED) return why;
    }
    }
    return is_bounded(*value) ? BOUNDED : BEYOND_FLOATS;
}

/* For constants: operands and value as pairs of ends. */
EXPORTED integer fdi_tape_interval(integer op, const double *operands, double *value)
{
    const fdi_interval *of = (const fdi_interval *)(const void *)operands;
    return fdi_interval_applied(op, of, of + 1, of + 2, (fdi_interval *)(void *)value);
}

/* dx/dt = f(x, w, u) in doubles, by Runge and Kutta's method of fourth order: for simulations, which prove nothing. */
#include "tape/tape.h"

#include "vectors.h"

enum { STAGES = 4 };

/* Of finite doubles; what is not finite stays so. */
static double elementary(integer op, double s, double of)
{
    if (!isfinite(s) || !isfinite(of)) return s + of - s;
    switch (op) {
    case EXP: return middle(fdi_exp_at(s));
    case LOG: return middle(fdi_log_at(s));
    case SIN: return middle(fdi_sin_at(s));
    case COS: return middle(fdi_cos_at(s));
    case TANH: return middle(fdi_tanh_at(s));
    default: return middle(fdi_atan2_at(s, of));
    }
}

static double applied(integer op, double a, double b, double c)
{
    switch (op) {
    case NEG: return -a;
    case ADD: return a + b;
    case SUB: return a - b;
    case MUL: return a * b;
    case DIV: return a / b;
    case SQR: return a * a;
    case INV: return 1.0 / a;
    case SQRT: return sqrt(a);
    case SROOT: return a < 0.0 ? -sqrt(-a) : sqrt(a);
    case ABS: return fabs(a);
    case SIGN: return a > 0.0 ? 1.0 : a < 0.0 ? -1.0 : a;
    case MAX: return a != a || a > b ? a : b;
    case SELECT: return a < 0.0 ? b : c;
    case ATAN2: return elementary(op, a, b);
    default: return elementary(op, a, 0.0);
    }
}

/* The rows at z; a slot's value each in `slot`. NaN where a function has no value. */
static void take_values(const tape *t, const double *z, double *slot, double *row)
{
    for (integer i = 0; i < t->slots; i++) {
        const integer *of = t->operand + 3 * i;
        if (t->op[i] == VARIABLE) slot[i] = z[of[0]];
        else if (t->op[i] == CONSTANT) slot[i] = 0.5 * t->constant[2 * i] + 0.5 * t->constant[2 * i + 1];
        else slot[i] = applied(t->op[i], slot[of[0]], slot[of[1]], slot[of[2]]);
    }
    for (integer i = 0; i < t->rows; i++) row[i] = slot[t->output[i]];
}

/* Doubles of scratch that `fdi_tape_integrate` needs. */
EXPORTED integer fdi_tape_integrate_room(const double *block)
{
    tape t;
    Memory memory = {NULL, 0};
    tape_open(&t, block, &memory);
    return memory.used + t.slots + t.variables + (STAGES + 1) * t.rows;
}

/* x (n, the tape's rows) after a time T in so many steps, in place; the rest of z, its coordinates from n on, is held.
 * The slope is taken within [low, high] (n), beyond which a stage may be by a rounding. */
EXPORTED void fdi_tape_integrate(const double *block, double *scratch, double *x, const double *held, const double *low,
                                 const double *high, double T, integer steps)
{
    tape t;
    Memory memory = {scratch, 0};
    tape_open(&t, block, &memory);
    const integer n = t.rows;
    double *slot = doubles(&memory, t.slots), *z = doubles(&memory, t.variables), *k[STAGES], *at = doubles(&memory, n);
    const double h = T / (double)steps, share[STAGES] = {0.0, 0.5 * h, 0.5 * h, h};
    for (int s = 0; s < STAGES; s++) k[s] = doubles(&memory, n);
    copy(z + n, held, t.variables - n);
    for (integer step = 0; step < steps; step++) {
        for (int s = 0; s < STAGES; s++) {
            copy(at, x, n);
            if (s) add_multiple(at, share[s], k[s - 1], n);
            for (integer i = 0; i < n; i++) z[i] = clipped(at[i], low[i], high[i]);
            take_values(&t, z, slot, k[s]);
        }
        for (integer i = 0; i < n; i++)
            x[i] += h / 6.0 * (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i]);
    }
}

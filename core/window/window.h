/* A window of samples base .. time: its rows and variables, and the programs over them.
 *
 * The plant of one sample k, its uncertainties written as channels p = Delta s with Delta within bounds:
 *     x(k+1) = A x + B u + a + E w + sum of gain p,    y = C x + D u + c + F w + sum of gain p +- noise,
 *     s = functional'(x, u, 1, w),    w within bounds.
 * Variables z are the state at the base and v(k) = (w(k), p(k)) of every sample, scaled to [-1, 1] about their
 * centres; later states are eliminated, x(k) = phi(k) + psi(k) z up to an error err(k). The window is
 *     {z in [-1, 1]^Z : lower <= G z <= upper},
 * its rows scaled, and widened by all that rounding can have lost. Everything is in normal form: numbers without
 * units of the order of 1, so the tolerances below are absolute. A program maximises cost'z over the window;
 * whatever its pivots did, its value is the weak-duality sum of its multipliers rounded outward, an outer bound.
 *
 * A window lies in one block of memory, which the caller gives: its sizes, then its arrays (ARRAYS below). No pointer
 * is in it, so a copy of the bytes is a copy of the window. Rows and variables of a sample live in ring slots (rows
 * and data of sample k in k % S, variables in k % V), so that a basis survives when the window slides.
 */
#ifndef WINDOW_H
#define WINDOW_H

#include "vectors.h"

#define FLOOR 0x1p-900    /* of an error: in normal form, more than underflow can lose */
#define LARGEST 0x1p100   /* of a state: a window that reaches beyond says nothing more, and floats would overflow */
#define ENORMOUS 0x1p1000 /* of an input: beyond all states that observers bound */
#define CLEAN_PIVOT 1e-11 /* in a factorisation: smaller ones leave the basis; */
#define SAFE_PIVOT 1e-6   /* these and */
#define LARGE_PIVOT 1e-3  /* those where it is not accurate */
#define UPWARD (1.0 + 1e-12) /* more than sums of nonnegative terms round */

enum { AT_LOWER, AT_UPPER, BASIC, AT_CENTRE };     /* status of a variable */
enum { OPTIMAL, EMPTY, STOPPED, OVERFULL };        /* outcome of a program; OVERFULL: its basis needs more room */
enum { CONSISTENT, EMPTY_CANDIDATE, UNDECIDED, FULL }; /* verdict of a task's programs; FULL: one is OVERFULL */
enum { ARRIVAL, NEWEST, CHANNELS, QUERY };         /* tasks */
enum { FINE, SIGN_OPEN, BAD_INPUT, BAD_OUTPUT, BAD_MATRIX, RANK_ROSE, OUTGROWN };  /* what came of a sample */
enum { BASE, TIME, PENDING, STARTED, PIVOTS, STOPS, PROGRAMS, REFACTORED, CAPPED, STAGE, NEXT, /* of the clock */
       WAITING, PROGRAM, HAS_POINT, LINEARISED, CLOCK };
enum { IDLE, ENTERED, MOVED, COMPLETED };          /* stages of a sample that waits for room */
enum { SCRATCH, KEPT };                            /* whether an array is part of a saved window */
enum { KIND_double, KIND_integer, KIND_breakpoint }; /* of the entries of an array */

/* Of a dual step: the step at which a variable, or Z + the place of an active row, would be dual infeasible; the size
 * of its entry in the row of the tableau; how much its flip takes of the violation. */
typedef struct { double ratio, size, drop; integer who; } breakpoint;

/* The sizes that a caller chooses: n states, nu inputs, nw disturbances, ny sensors, nq channels, nh rows on w, nt
 * directions of the template, na rows on the arrival state besides its box, ni items of a stack, N steps that the
 * window holds at most, of which it drops `block` at once, K largest basis, late = 1 if w or p enter the output. */
#define SIZES(Y) Y(n) Y(nu) Y(nw) Y(ny) Y(nq) Y(nh) Y(nt) Y(na) Y(ni) Y(N) Y(block) Y(K) Y(late)

/* What follows from them: nv variables and nr rows of a sample, S slots of rows, V of variables, Z variables, R rows,
 * Q bases, X rows and P columns of a stack, L columns of a factorisation, J breakpoints of a program. */
#define LENGTHS(Y)                                                                                                   \
    Y(nv, nw + nq)                                                                                                   \
    Y(nr, ny + nh + 2 * nq)                                                                                          \
    Y(S, N + 1)                                                                                                      \
    Y(V, N + late)                                                                                                   \
    Y(Z, n + V * nv)                                                                                                 \
    Y(R, na + S * nr)                                                                                                \
    Y(Q, 4 * nt + 2 * nq + 1)                                                                                        \
    Y(X, n + ny)                                                                                                     \
    Y(P, n + nu + 1 + nw)                                                                                            \
    Y(L, K + n)                                                                                                      \
    Y(J, Z + K)

/* Every array of a window, Y(type, use, name, lengths): its layout, its pointer and the name that Python knows it by
 * come from this list. */
#define ARRAYS(Y)                                                                                                    \
    /* base, newest sample, whether arrival bounds wait for the slide, whether there is a sample; counts; whether */ \
    /* bases cannot have more room; stage of a sample that waits for it, and its next channel program; the task that */ \
    /* waits for it + 1, the program that does, whether one before it has a point; 1 + the newest sample whose state */ \
    /* was bounded for its linearisation */                                                                          \
    Y(integer, KEPT, clock, CLOCK)                                                                                   \
    /* the program: rows of z, also by columns, their bounds, and 2 (sum |G| + |bound|) + 1 */                       \
    Y(double, KEPT, G, R, Z)                                                                                         \
    Y(double, KEPT, GT, Z, R)                                                                                        \
    Y(double, KEPT, lower, R)                                                                                        \
    Y(double, KEPT, upper, R)                                                                                        \
    Y(double, KEPT, magnitude, R)                                                                                    \
    /* rows as they entered, scaled: coefficients of the state, sum of |own variables|, of |terms in the bounds|, */ \
    /* bounds before the state */                                                                                    \
    Y(double, KEPT, row_x, R, n)                                                                                     \
    Y(double, KEPT, row_v, R)                                                                                        \
    Y(double, KEPT, row_c, R)                                                                                        \
    Y(double, KEPT, raw_lower, R)                                                                                    \
    Y(double, KEPT, raw_upper, R)                                                                                    \
    Y(double, KEPT, scale, R)                                                                                        \
    /* newest state over z; per sample: state at z = 0, bound of |x|, of the terms that it was computed from, of */  \
    /* what v moves in it, and of the error; that error in its frame, and what carries it to the next */             \
    Y(double, KEPT, psi, n, Z)                                                                                       \
    Y(double, KEPT, phi, S, n)                                                                                       \
    Y(double, KEPT, mag, S, n)                                                                                       \
    Y(double, KEPT, terms, S, n)                                                                                     \
    Y(double, KEPT, from_v, S, n)                                                                                    \
    Y(double, KEPT, err, S, n)                                                                                       \
    Y(double, KEPT, rho, S, n)                                                                                       \
    Y(double, KEPT, frame, S, n, n)                                                                                  \
    Y(double, KEPT, carry, S, n, n)                                                                                  \
    /* per sample: A, the drift at the centres and its magnitude, the columns [E, gain] scaled */                    \
    Y(double, KEPT, A, S, n, n)                                                                                      \
    Y(double, KEPT, drift, S, n)                                                                                     \
    Y(double, KEPT, drift_mag, S, n)                                                                                 \
    Y(double, KEPT, inputs, S, n, nv)                                                                                \
    /* centres and half-widths of v and of the arrival state */                                                      \
    Y(double, KEPT, vc, V, nv)                                                                                       \
    Y(double, KEPT, vr, V, nv)                                                                                       \
    Y(double, KEPT, xc, n)                                                                                           \
    Y(double, KEPT, xr, n)                                                                                           \
    /* template; bounds of T x at the base, those at base + block that wait for the slide, and at the newest sample */ \
    Y(double, KEPT, T, nt, n)                                                                                        \
    Y(double, KEPT, h_lower, nt)                                                                                     \
    Y(double, KEPT, h_upper, nt)                                                                                     \
    Y(double, KEPT, new_lower, nt)                                                                                   \
    Y(double, KEPT, new_upper, nt)                                                                                   \
    Y(double, KEPT, now_lower, nt)                                                                                   \
    Y(double, KEPT, now_upper, nt)                                                                                   \
    /* data of every sample, for proofs; bounds of w at the newest */                                                \
    Y(double, KEPT, stack, S, ni, X, P)                                                                              \
    Y(double, KEPT, u, S, nu)                                                                                        \
    Y(double, KEPT, y, S, ny)                                                                                        \
    Y(double, KEPT, noise, S, ny)                                                                                    \
    Y(double, KEPT, slack, S, ny)                                                                                    \
    Y(double, KEPT, w_lower, V, nw)                                                                                  \
    Y(double, KEPT, w_upper, V, nw)                                                                                  \
    Y(double, KEPT, newest_w_lower, nw)                                                                              \
    Y(double, KEPT, newest_w_upper, nw)                                                                              \
    /* channels: gain functional' summed is the stack but for `left`, a bound of the rest times |Delta|, and whether */ \
    /* that is not zero; bounds of s; two lines over s that bound p (slope, intercept; above, then below) */         \
    Y(double, KEPT, gain, V, nq, X)                                                                                  \
    Y(double, KEPT, functional, V, nq, P)                                                                            \
    Y(double, KEPT, left, V, X, P)                                                                                   \
    Y(double, KEPT, is_left, V)                                                                                      \
    Y(double, KEPT, s_lower, V, nq)                                                                                  \
    Y(double, KEPT, s_upper, V, nq)                                                                                  \
    Y(double, KEPT, lines, V, nq, 4)                                                                                 \
    /* fixed: item of the stack and Delta bounds of each channel, rows on w, change of the cost against cycling */   \
    Y(integer, KEPT, owner, nq)                                                                                      \
    Y(double, KEPT, delta, nq, 2)                                                                                    \
    Y(double, KEPT, w_rows, nh, nw)                                                                                  \
    Y(double, KEPT, w_rows_lower, nh)                                                                                \
    Y(double, KEPT, w_rows_upper, nh)                                                                                \
    Y(double, KEPT, jitter, Z)                                                                                       \
    /* multipliers of an empty window */                                                                             \
    Y(double, KEPT, farkas, R)                                                                                       \
    /* bases (basis.c): size, base of the window then, rows, columns, status of all variables, inverse */            \
    Y(integer, KEPT, k, Q)                                                                                           \
    Y(integer, KEPT, seen_base, Q)                                                                                   \
    Y(integer, KEPT, rows, Q, K)                                                                                     \
    Y(integer, KEPT, cols, Q, K)                                                                                     \
    Y(integer, KEPT, status, Q, Z)                                                                                   \
    Y(double, KEPT, inverse, Q, K, K)                                                                                \
    /* a program while it runs (dual_simplex.c) */                                                                   \
    Y(double, SCRATCH, cost, Z)                                                                                      \
    Y(double, SCRATCH, true_cost, Z)                                                                                 \
    Y(double, SCRATCH, z, Z)                                                                                         \
    Y(double, SCRATCH, d, Z)                                                                                         \
    Y(double, SCRATCH, alpha, Z)                                                                                     \
    Y(double, SCRATCH, act, R)                                                                                       \
    Y(double, SCRATCH, vio, R)                                                                                       \
    Y(double, SCRATCH, multiplier, K)                                                                                \
    Y(integer, SCRATCH, at_upper, K)                                                                                 \
    Y(double, SCRATCH, wk, K)                                                                                        \
    Y(double, SCRATCH, uk, K)                                                                                        \
    Y(integer, SCRATCH, candidate, J)                                                                                \
    Y(breakpoint, SCRATCH, points, J)                                                                                \
    Y(integer, SCRATCH, chosen, J)                                                                                   \
    Y(double, SCRATCH, move, J)                                                                                      \
    Y(double, SCRATCH, whole, Z)                                                                                     \
    Y(double, SCRATCH, table, K, L)                                                                                  \
    Y(double, SCRATCH, square, K, K)                                                                                 \
    /* a sample while it enters */                                                                                   \
    Y(double, SCRATCH, fresh, n)                                                                                     \
    Y(double, SCRATCH, column, n)                                                                                    \
    Y(double, SCRATCH, costate, n)                                                                                   \
    Y(double, SCRATCH, response, n, n)                                                                               \
    Y(double, SCRATCH, moved, n, n)                                                                                  \
    Y(double, SCRATCH, turning, n + 2, n)                                                                            \
    Y(double, SCRATCH, rest, X, P)                                                                                   \
    Y(double, SCRATCH, older, n, Z)                                                                                  \
    /* what a caller writes before a call: the data of a sample; a direction, and where its bound is found */        \
    Y(double, SCRATCH, in_u, nu)                                                                                     \
    Y(double, SCRATCH, in_u_next, nu)                                                                                \
    Y(double, SCRATCH, in_y, ny)                                                                                     \
    Y(double, SCRATCH, in_stack, ni, X, P)                                                                           \
    Y(double, SCRATCH, in_noise, ny)                                                                                 \
    Y(double, SCRATCH, in_w_lower, nw)                                                                               \
    Y(double, SCRATCH, in_w_upper, nw)                                                                               \
    Y(double, SCRATCH, query, n)                                                                                     \
    Y(double, SCRATCH, answer, 1)

#define MEMBER(name) integer name;
#define LENGTH(name, value) integer name;
#define POINTER(type, use, name, ...) type *name;
typedef struct window {
    SIZES(MEMBER)
    LENGTHS(LENGTH)
    ARRAYS(POINTER)
} window;
#undef MEMBER
#undef LENGTH
#undef POINTER

typedef struct { integer verdict, program; } answer;       /* of a task; the program that ended it, or -1 */
typedef struct { double constant, rounding; } objective;   /* of a cost over z: its value at z = 0, its rounding */
typedef struct { double known, magnitude, centre, spread; } known_terms;
typedef struct { integer row, position; double side, violation; } leaving;
typedef struct { integer flips; double left; } entering;

static inline void copy_integers(integer *restrict target, const integer *restrict source, integer m)
{
    for (integer j = 0; j < m; j++) target[j] = source[j];
}

static inline integer modulo(integer a, integer b) /* the remainder that is not negative, of b > 0 */
{
    const integer r = a % b;
    return r < 0 ? r + b : r;
}

static inline integer slot(const window *w, integer k) { return modulo(k, w->S); }
static inline integer variables(const window *w, integer k) { return modulo(k, w->V); }

/* Centre and half-width of an interval; the half-width is rounded up. */
static inline void midpoint(double lower, double upper, double *centre, double *half)
{
    *centre = 0.5 * lower + 0.5 * upper;
    *half = larger(*centre - lower, upper - *centre) * (1.0 + 4.0 * UNIT);
}

/* memory.c: pointers into a block */
void window_open(window *w, void *block);

/* rounding.c: error bounds in turned coordinates; scratch (n + 2, n) */
void turn_frame(integer n, const double *A, const double *frame, double *turned, double *carry, double *scratch);
void carry_error(integer n, const double *carry, const double *turned, const double *rho, const double *fresh,
                 double *rho_next);
double error_of(integer n, const double *turned, const double *rho, integer i);

/* factors.c: uncertainties as channels */
integer factor_stack(integer ni, integer X, integer P, integer nq, const double *stack, const integer *owner,
                     const double *delta, double *gain, double *functional, double *left, double *rest);
integer factor_sample(const window *w, integer k);
double left_out(const window *w, integer k, integer row);

/* rows.c; psi (n, Z) is the state of the row's sample over z */
void clear_row(const window *w, integer i);
void place_row(const window *w, integer i, integer s);
void set_row(const window *w, const double *psi, integer i, integer s, integer first, integer nv, double floor);
void measure(const window *w, integer k, double eps);
void measure_sensor(const window *w, const double *psi, integer k, integer o, double eps);
void arrival_rows(const window *w);
void scale_arrival_row(const window *w, integer i, integer s);

/* channels.c */
integer reaches_output(const window *w, integer k, integer q);
known_terms known_part(const window *w, integer k, integer q);
integer bound_channels(const window *w, integer k, integer reaching);
void open_channels(const window *w, integer k, integer reaching);
void channel_rows(const window *w, const double *psi, integer k, integer q);

/* motion.c */
void anchor(const window *w);
void advance(const window *w, integer k);
void slide(const window *w);
void move_response(const window *w, double *psi, integer k);

/* basis.c */
integer factor_basis(const window *w, integer q, integer p, integer c, double threshold);
integer change_basis(const window *w, integer q, integer k, leaving out, integer enter, double theta);
void forget_basis(const window *w, integer q);
void carry_basis(const window *w, integer q);

/* ratio_test.c */
integer collect_breakpoints(const window *w, integer q, integer k, leaving out);
entering choose_entering(const window *w, integer m, double violation);
entering avoid_small_pivot(const window *w, integer m, entering chosen);

/* dual_simplex.c */
integer dual_simplex(const window *w, integer q, integer limit);
void price_rows(const window *w, integer q);

/* maximise.c */
integer maximise(const window *w, integer q, integer limit, double *bound);

/* sample.c: a whole sample, whose data lie in in_*; `enter`, `move`, `complete`, CHANNELS where signs are open, and
 * ARRIVAL. Returns what `enter` returns, or OUTGROWN. */
integer take(const window *w, double eps, integer limit, answer *found);
integer told(integer code, answer found); /* both in one number */

/* programs.c */
answer solve_programs(const window *w, integer task, integer start, integer stop, integer limit);

#endif

/* Dense linear programs of few variables over {x : A x <= b}, and what is made of many of them.
 *
 * basis.c        a basis: its edges, its vertex, its slacks
 * simplex.c      the primal simplex method in inequality form
 * duality.c      bounds of the optima that no rounding undercuts
 * programs.c     a largest ball, support points
 * scaling.c      even units for rows and columns
 * centre.c       rows seen from a point inside, duplicates left out
 * facets.c       redundancy of rows: one program a row
 * clarkson.c     the same over the facets that are known so far
 * elimination.c  Fourier-Motzkin elimination
 * box.c          what needs no program
 * moved_rows.c   rows moved inward by a set of known vertices
 * questions.c    rows as they are given, asked in one call
 * cone.c         extreme rays of cones in general position, proven in floats
 * near_cone.c    extreme rays of cones that are not in general position, in floats
 * bounded_sets.c vertices of rows, rows of points and volumes, in floats
 * order.c        lists of points in order
 * volume.c       volume by the vertices and the rows that they lie on
 * double_description.c  extreme rays of any pointed cone, in integers
 * pointed_cone.c  where that begins: the order of rows, a basis, its rays
 * exact_sets.c   vertices of rows, and rows of points, in integers from floats to floats
 *
 * Rows arrive scaled by powers of two, with Euclidean norms in [1/2, 2), and transposed, so that loops over rows are
 * contiguous. Sizes: d variables, m rows. An exported function works in a block of the caller's, of as many doubles as
 * the function of its name and `_room` says.
 */
#ifndef POLYTOPES_H
#define POLYTOPES_H

#include "core.h"
#include "memory.h"

enum { OPTIMAL, STOPPED, UNBOUNDED, AMBIGUOUS, LIMIT }; /* how a program ends */
enum { FINISHED, TOO_MANY, OPEN, PAUSED, NO_ROOM };     /* how an elimination ends */
enum { NO, YES, DOUBT };                                /* whether a row is needed */

typedef struct {
    integer d, m, stride; /* entry j of row i is at[j * stride + i] */
    const double *at;     /* (d, m) */
    const double *b;      /* (m,) */
} Rows;

/* Where the simplex method stands: d active rows, of which a slot may instead hold -1 - j for "x_j free". */
typedef struct {
    double *x;    /* (d,) point */
    double *s;    /* (m,) slacks b - A x */
    integer *W;   /* (d,) active row of each slot */
    double *Q;    /* (d, d) edges: row k opens when slot k is released; the inverse of the active rows, transposed */
    double *y;    /* (d,) multipliers of the active rows */
    double *p;    /* (d,) direction of a move */
    double *rate; /* (m,) A p */
    double *ratio; /* (m,) what the ratio test compares */
    double *alpha; /* (d,) a row as a combination of the active rows */
    double *work; /* (d, 2 d) */
} State;

/* basis.c */
void lay_out_state(State *at, Memory *memory, integer d, integer m);
void combine(const Rows *rows, const double *p, double *rate);                  /* rate = A p */
void slacks(const Rows *rows, const double *x, double *s);                      /* s = b - A x */
void settle(const Rows *rows, State *at);                                       /* x onto its active rows, s */
int invert(double *work, integer d, double least, double *Q);                     /* 0 if singular */
int invert_basis(const Rows *rows, const integer *W, double *Q, double *work);  /* 0 if singular */
void coordinates(const Rows *rows, integer i, const double *Q, double *alpha);  /* row i over the active rows */
void exchange(double *Q, const double *alpha, integer slot, integer d);         /* that row takes a slot */
void begin_at_origin(const Rows *rows, State *at);
void begin(const Rows *rows, const double *x0, State *at);
double scale_of(const Rows *rows);

/* simplex.c */
integer ascend(const Rows *rows, const double *c, State *at, double scale, double stop);
integer repair(const Rows *rows, State *at, double scale);
integer optimise(const Rows *rows, const double *c, State *at, double scale);

/* duality.c */
double dual_bound(const Rows *rows, const double *c, State *at, double *beside, double *spare, double *work);

/* centre.c */
integer fdi_strictly_inside(integer d, integer m, const double *at, const double *b, const double *z,
                            const double *of_rows, const double *of_rhs, double *room);
integer distinct(const Rows *rows, integer *chosen, Memory memory);
integer distinct_room(integer d, integer m);
int centred(const Rows *rows, const integer *chosen, integer k, const double *x0, double *at, double *b, Memory memory);
integer centred_room(integer k);

/* facets.c */
int exceeds(const Rows *rows, const double *c, double slack, State *at);
void put_column(double *c, const Rows *rows, integer i);
integer irredundant(const Rows *rows, const double *x0, const integer *known, integer *chosen, integer *doubtful,
                    Memory memory);
integer irredundant_room(integer d, integer m);
integer fdi_irredundant(integer d, integer m, const double *at, const double *b, const double *x0, integer *chosen,
                        integer *doubtful, double *block);

/* programs.c */
integer fdi_interior_room(integer d, integer m);
integer fdi_interior(integer d, integer m, const double *at, const double *b, const double *norms, const double *x0,
                     double times, double *found, double *block);
integer fdi_supports_room(integer d, integer m, integer k);
void fdi_supports(integer d, integer m, integer k, const double *at, const double *b, const double *x0,
                  const double *directions, double *found, integer *codes, double *weights, double *block);

/* scaling.c */
integer fdi_scaled_room(integer m, integer d);
integer fdi_scaled(integer m, integer d, const double *rows, const double *rhs, double *scaled, integer *codes,
                   double *block);

/* double_description.c */
integer fdi_double_description_room(integer d, integer m, integer room);
integer fdi_double_description(integer d, integer m, const integer *rows, const integer *start, const integer *simplex,
                               integer most_rays, integer room, integer *rays, double *block);

/* pointed_cone.c */
integer fdi_pointed_cone_room(integer d, integer m, integer room);
integer fdi_pointed_cone(integer d, integer m, const integer *rows, integer most_rays, integer room, integer *rays,
                         double *block);
const uint64_t *rows_of_rays(integer d, integer m, integer room, double *block);

/* cone.c */
void to_point(integer d, integer m, const double *at, const integer *rows, const double *inverse, double *step,
              double *ray);
integer fdi_cone_rays_room(integer d, integer m, integer most_rays);
integer fdi_cone_rays(integer d, integer m, const double *at, const double *inner, integer bounded, integer most_rays,
                      double *rays, integer *active, double *slack, double *block);

/* near_cone.c */
integer near_cone_room(integer d, integer m, integer room);
integer near_cone(integer d, integer m, const double *at, integer room, double *rays, uint64_t *on, double *block);
integer near_points(integer d, integer m, const double *at, const double *centre, integer room, double *rays,
                    uint64_t *on, double *block);

/* volume.c */
integer volume_room(integer n, integer m, integer k);
double volume_of(integer n, integer m, integer k, const double *points, const uint64_t *on, integer row_words,
                 double *block);

/* order.c */
void put_in_order(integer n, integer k, double *points, double *work);

/* duality.c */
void fdi_gaps(integer d, integer k, const double *forms, const double *points, const double *bounds,
              const double *spare, const double *beside, const double *reach, double *found);

/* clarkson.c */
void clarkson(const Rows *rows, const integer *asked, integer *keep, integer *doubtful, Memory memory);
integer clarkson_room(integer d, integer m);

#endif

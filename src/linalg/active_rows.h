/* Rows that hold, A y = t, gathered one by one, and what they leave free: where exact zeros of
 * velocities come from (contact/hold/hold.c, mechanism/hold.c). With Q an orthonormal basis of
 * the rows, y = y_0 + (E - Q Q') y_free, A y_0 = t; a direction in the rows' span is at rest where
 * none of those it takes part in has a target. Nothing small is set to 0. */
#ifndef PERP_LINALG_ACTIVE_ROWS_H
#define PERP_LINALG_ACTIVE_ROWS_H

#include <float.h>
#include <math.h>

#include "base/arena.h"

/* Rows have length 1; a remainder below the square root of rounding counts as dependent. Such a row
 * would determine a direction only with more error than the impulses that act on it have. */
#define PERP__RANK_TOLERANCE sqrt(DBL_EPSILON)

/* A direction is determined if no more than this of it is outside of the rows' span. */
#define PERP__SPAN 1e-10

typedef struct perp__active_rows {
    int32_t n, count, rank;
    double *rows, *targets, *norms;          /* most by n, most, most */
    int32_t *taken;                          /* most */
    double *basis, *particular, *components; /* n by n, n, n; components: of y_0 along the basis */
    double *unit;                            /* n: the caller's, for perp__active_rows_fix */
} perp__active_rows;

/* Room for `most` rows of up to n columns, `entries` numbers together. */
void perp__active_rows_layout(perp__active_rows *active, perp__arena *arena, size_t entries,
                              size_t most, size_t n);
/* No rows yet, of n columns each. */
void perp__active_rows_begin(perp__active_rows *active, int32_t n);
/* Where the next row goes. */
double *perp__active_rows_next(const perp__active_rows *active);
/* Takes it, with what it makes of y. One that is 0 is left out. */
void perp__active_rows_add(perp__active_rows *active, double target);
/* Finds the rank, an orthonormal basis of the rows (rank by n) and the shortest y_0 that meets the
 * targets of the rows taken; others are met as far as consistent. Destroys rows and targets. */
void perp__active_rows_solve(perp__active_rows *active);
/* y := y_0 and what the rows leave of y; and the components. */
void perp__active_rows_free(perp__active_rows *active, double *y);
/* Whether the rows determine `unit`, a direction of length 1 that is 0 but for `count` entries from
 * `first`, and rows without targets alone. Destroys it. */
bool perp__active_rows_fix(perp__active_rows *active, int32_t first, int32_t count);

/* y := what is left of y outside the span of the basis. */
void perp__project_out(const double *basis, int32_t rank, int32_t n, double *y);

#endif

/* The systems (L A + R) x = rhs of newton/matrix.h where A = B B' + C is known by its bodies: B the
 * scaled pieces of bodies.h, C compliance. With y = B'x of the contacts and F the bilateral rows,
 *   [I + B' K B  -B_F'; B_F  R_F] (y, x_F) = (B' N rhs, rhs_F),  N = (R + L C)^-1,  K = N L,
 * and x = N (rhs - L B y): as many unknowns as the bodies have velocities, however many contacts
 * they touch in. */
#ifndef PERP_CONTACT_NEWTON_BODIES_H
#define PERP_CONTACT_NEWTON_BODIES_H

#include "contact/bodies/bodies.h"
#include "contact/method.h"
#include "linalg/factor/factor.h"

typedef struct perp__newton_blocks perp__newton_blocks;

typedef struct perp__newton_bodies {
    const perp__bodies *bodies;
    const perp__newton_blocks *blocks;
    int32_t order; /* velocities and bilateral rows */
    int32_t *column_starts, *row_indices;
    double *values;
    int64_t *slots;       /* per unit, pieces by pieces: where in the columns of its block */
    double *inverses;     /* N: nine a contact */
    double *y;            /* order */
    double *full, *image; /* size */
    perp__kept_factor factor;
} perp__newton_bodies;

/* Entries of the matrix; more than INT32_MAX can't be taken. */
int64_t perp__newton_bodies_entries(const perp__bodies *bodies);
void perp__newton_bodies_layout(perp__arena *arena, perp__newton_bodies *own,
                                const perp__contact_problem *problem);
/* The pattern and its analysis. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__newton_bodies_read(perp__newton_bodies *own, const perp__newton_blocks *blocks,
                                     const perp__contact_problem *problem);
/* Where row `row`, one of its pattern, stands in `column`. */
int64_t perp__newton_bodies_find(const perp__newton_bodies *own, int32_t column, int32_t row);

void perp__newton_bodies_multiply(const perp__newton_bodies *own, const double *x, double *out);
perp_status perp__newton_bodies_factor(perp__newton_bodies *own, const double *L, const double *R,
                                       int32_t keep_pivots);
/* x := (L A + R)^-1 x, as exact as R's inverse is. */
void perp__newton_bodies_solve(perp__newton_bodies *own, const double *L, double *x);

#endif

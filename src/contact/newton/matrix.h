/* The systems L A + R of the second-order contact methods: A the scaled Delassus matrix, L and R
 * block diagonal, a block a contact. One pattern, so one symbolic analysis, for all of them. Where
 * the bodies are known, in the space of their velocities. */
#ifndef PERP_CONTACT_NEWTON_MATRIX_H
#define PERP_CONTACT_NEWTON_MATRIX_H

#include "contact/newton/bodies.h"
#include "linalg/factor/factor.h"

/* The unknowns that are left: contacts without friction keep their normal alone. Block k < contacts
 * is contact k, the others are a bilateral row each. */
struct perp__newton_blocks {
    int32_t contacts, blocks, n;
    int32_t *starts;   /* blocks + 1 */
    int32_t *rows;     /* n: the problem's row */
    int32_t *unknowns; /* the problem's rows: the unknown, or -1 */
    int32_t *owners;   /* n: the block */
    double *scales;    /* n: r = scales x; u times scales is A x + b */
};

typedef struct perp__newton_matrix {
    const perp__newton_blocks *blocks;
    int32_t by_bodies; /* then only `bodies`, `rest` and the last two are of account */
    perp__newton_bodies bodies;
    int32_t sparse;
    int32_t *column_starts, *row_indices; /* whole blocks of rows; diagonal blocks always there */
    double *A, *values;                   /* n by n column-major if dense */
    double *rest;                         /* n: of a refinement */
    perp__kept_factor factor;
    int32_t fresh; /* nothing factored since the last perp__newton_matrix_read */
    int64_t factorisations;
} perp__newton_matrix;

void perp__newton_blocks_layout(perp__arena *arena, perp__newton_blocks *blocks,
                                const perp__contact_problem *problem);
void perp__newton_blocks_read(perp__newton_blocks *blocks, const perp__contact_problem *problem);

/* PERP_OK, or PERP_ERROR_ARGUMENT where the pattern has more entries than an int32 counts. */
perp_status perp__newton_matrix_check(const perp__contact_problem *problem);
void perp__newton_matrix_layout(perp__arena *arena, perp__newton_matrix *matrix,
                                const perp__contact_problem *problem);
/* Fills A from W, or takes the bodies, and analyses the pattern. PERP_OK or PERP_ERROR_MEMORY. */
perp_status perp__newton_matrix_read(perp__newton_matrix *matrix, const perp__newton_blocks *blocks,
                                     const perp__contact_problem *problem);
void perp__newton_matrix_release(perp__newton_matrix *matrix);

/* y = A x */
void perp__newton_multiply(const perp__newton_matrix *matrix, const double *x, double *y);

/* L, R: nine doubles a block, as in cone.h. PERP_OK, PERP__FACTOR_SINGULAR or PERP_ERROR_MEMORY. */
perp_status perp__newton_factor(perp__newton_matrix *matrix, const double *L, const double *R);

/* x = (L A + R)^-1 rhs with refinement; rhs and x may not overlap. */
void perp__newton_solve(perp__newton_matrix *matrix, const double *L, const double *R,
                        const double *rhs, double *x);

#endif

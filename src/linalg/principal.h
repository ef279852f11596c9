/* Principal blocks: the rows and columns of a square matrix that an index list names. */
#ifndef PERP_LINALG_PRINCIPAL_H
#define PERP_LINALG_PRINCIPAL_H

#include "linalg/matrix.h"

typedef struct perp__principal {
    int32_t count;
    const int32_t *active;   /* count indices, increasing */
    const int32_t *position; /* rows of M: place in `active`, or -1 */
} perp__principal;

/* Entry (r,c) of the block to to[r * row_step + c * column_step]; one step is 1, the other count.
 */
void perp__principal_dense(const perp__matrix *M, const perp__principal *block, double *to,
                           size_t row_step, size_t column_step);

/* The same in CSC, from a CSC matrix: starts has count + 1 entries, rows and values room for as
 * many as M has. */
void perp__principal_csc(const perp__matrix *M, const perp__principal *block, int32_t *starts,
                         int32_t *rows, double *values);

#endif

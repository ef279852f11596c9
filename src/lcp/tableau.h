/* A condensed simplex tableau with delayed updates.
 *
 * Basic variables depend on the nonbasic ones as x_B = b - T x_N. Exchanging basic row r with
 * nonbasic column c changes T by one rank-1 matrix (beside row r and column c themselves), so the
 * last few exchanges are kept as T - U V and applied together by one matrix product: a pivot reads
 * and writes only its own row and column. */
#ifndef PERP_LCP_TABLEAU_H
#define PERP_LCP_TABLEAU_H

#include "base/arena.h"

typedef struct perp__tableau {
    int32_t rows, columns; /* in use */
    int32_t leading_dimension;
    int32_t delay;   /* exchanges kept before they are applied; 0: applied at once */
    int32_t pending; /* exchanges kept now */
    double *T;       /* leading_dimension by columns, column-major */
    double *U;       /* leading_dimension by delay */
    double *V;       /* delay by columns, column-major */
} perp__tableau;

/* Takes memory for up to `rows` by `columns`. */
void perp__tableau_layout(perp__arena *arena, perp__tableau *t, int32_t rows, int32_t columns);

/* Forgets the kept exchanges; T is filled by the caller afterwards. */
void perp__tableau_reset(perp__tableau *t, int32_t rows, int32_t columns);

/* column[0..rows-1] := T(:,c); row[0..columns-1] := T(r,:), kept exchanges included. */
void perp__tableau_column(const perp__tableau *t, int32_t c, double *column);
void perp__tableau_row(const perp__tableau *t, int32_t r, double *row);

/* Exchanges row r and column c, which the caller has just read into `column` and `row`. Both arrays
 * are overwritten. */
void perp__tableau_exchange(perp__tableau *t, int32_t r, int32_t c, double *column, double *row);

/* Forgets column c; the last column takes its place. */
void perp__tableau_drop(perp__tableau *t, int32_t c);

/* Applies what is kept, so that T itself is up to date. */
void perp__tableau_flush(perp__tableau *t);

#endif

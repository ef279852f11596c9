/* A condensed simplex tableau with delayed updates.
 *
 * Basic variables depend on the nonbasic ones as x_B = b - T x_N. Exchanging basic row r with
 * nonbasic column c changes any other column y of T alike (the product form of the inverse, Dantzig
 * & Orchard-Hays 1954): y_r becomes y_r / p and y_i becomes y_i - u_i y_r, where p = T(r,c) and
 * u = T(:,c) / p. So the last exchanges are kept as the columns u of a matrix U and applied to a
 * column when it is asked for, and to all of T together, as one matrix product, when there are too
 * many: an exchange reads and writes one column. */
#ifndef PERP_LCP_TABLEAU_H
#define PERP_LCP_TABLEAU_H

#include "base/arena.h"
#include "linalg/lanes/panels.h"

typedef struct perp__tableau {
    int32_t rows, columns; /* in use */
    int32_t leading_dimension;
    int32_t delay;     /* most exchanges kept before they are applied */
    int32_t pending;   /* exchanges kept now */
    double *T;         /* leading_dimension by columns, column-major */
    double *U;         /* in panels; u_r = 0 from its exchange backwards */
    double *L;         /* delay by delay, row-major: row k is row r of U before exchange k */
    double *rewritten; /* what becomes of the rows exchanged, for some columns */
    double *V;         /* of the multiples of U for some columns */
    double *pivots;    /* p of the exchanges kept */
    int32_t *exchanged, *entered; /* r and c of the exchanges kept */
    int32_t *again;               /* the next one kept with the same row, or 0 */
    int32_t *last;                /* of a row: the last exchange kept, or -1 */
    int32_t *started;             /* of a column: exchanges kept that are in T already */
    const perp__panel_kernels *kernels;
} perp__tableau;

/* Entries of a column with its padding. */
size_t perp__tableau_length(int32_t rows);

/* Takes memory for up to `rows` by `columns`. */
void perp__tableau_layout(perp__arena *arena, perp__tableau *t, int32_t rows, int32_t columns);

/* Forgets the kept exchanges: T, as the caller fills it, is `rows` by `columns` from here on. To be
 * called again whenever a row or a column joins. */
void perp__tableau_reset(perp__tableau *t, int32_t rows, int32_t columns);

/* column := T(:,c), kept exchanges included; perp__tableau_length entries, 0 in the padding. */
void perp__tableau_column(perp__tableau *t, int32_t c, double *column);

/* y := T x, kept exchanges included; y has perp__tableau_length entries, x is destroyed. */
void perp__tableau_multiply(perp__tableau *t, double *x, double *y);

/* Exchanges row r and column c, which the caller has just read into `column`. */
void perp__tableau_exchange(perp__tableau *t, int32_t r, int32_t c, const double *column);

/* Forgets column c; the last column takes its place. */
void perp__tableau_drop(perp__tableau *t, int32_t c);

/* Applies what is kept, so that T itself is up to date. */
void perp__tableau_flush(perp__tableau *t);

#endif

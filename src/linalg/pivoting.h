/* Small dense linear systems: of any rank by Gauss-Jordan elimination with complete pivoting, and
 * of a body or a contact by elimination with rows exchanged. */
#ifndef PERP_LINALG_PIVOTING_H
#define PERP_LINALG_PIVOTING_H

#include <stdbool.h>
#include <stdint.h>

/* A matrix n by n, row by row. After the elimination E K = (I X; 0 0) in the order of `columns`:
 * rows of E beyond the rank annihilate K. Columns of E come in the place of those of K. */
typedef struct perp__pivoting {
    int32_t n, rank;
    int32_t sign;     /* of the determinant; 0 where the rank is below n */
    double product;   /* of the pivots, without that sign */
    double *K;        /* overwritten: E's columns of the pivots' rows, then X */
    int32_t *columns; /* n: filled */
    int32_t *rows;    /* in the order of their pivots; n: filled */
} perp__pivoting;

/* A pivot of at most `singular` is 0, and so are those beyond the first `most`. */
void perp__pivoting_eliminate(perp__pivoting *p, double singular, int32_t most);

/* x: the solution of K x = b that is 0 at columns without a pivot. */
void perp__pivoting_solve(const perp__pivoting *p, double *x, const double *b);

/* direction: vector k, from 0, of a basis of the null space. */
void perp__pivoting_null(const perp__pivoting *p, double *direction, int32_t k);

/* width: what errors of the rows, of size `load`, are worth in x; 0 at columns without a pivot. */
void perp__pivoting_widths(const perp__pivoting *p, double *width, const double *load);

/* Whether the rows without a pivot have a right-hand side of 0, too, beside `load`. */
bool perp__pivoting_is_consistent(const perp__pivoting *p, const double *b, const double *load,
                                  double tolerance);

/* X := A^-1 X. A: n by n, n at most 6, with row stride `stride`; X: n by `columns`, at most 6, row
 * by row. Returns 0, and X = 0, where a pivot is 0 or not a number. */
bool perp__solve_small(const double *A, int32_t n, int32_t stride, double *X, int32_t columns);

#endif

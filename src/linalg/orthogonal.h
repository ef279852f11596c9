/* An orthonormal basis of the span of some rows, and what is left of a vector outside that span. */
#ifndef PERP_LINALG_ORTHOGONAL_H
#define PERP_LINALG_ORTHOGONAL_H

#include "base/arena.h"

/* rows: m by n, row by row, each of length 1; destroyed. targets: m; destroyed. Finds the rank, an
 * orthonormal basis of the rows (rank by n) and the shortest `particular` that meets the targets of
 * the rows taken; the others are met as far as they are consistent. taken: m, norms: m. */
int32_t perp__orthogonal_rows(double *rows, double *targets, int32_t *taken, double *norms,
                              double *basis, double *particular, int32_t m, int32_t n);

/* y := what is left of y outside the span of the basis. */
void perp__project_out(const double *basis, int32_t rank, int32_t n, double *y);

/* |x|, without overflow. */
double perp__length(const double *x, int32_t n);

/* Rows that hold, A y = t, gathered one by one: the next is written to rows + count n and taken. */
typedef struct perp__held_rows {
    int32_t n, count, rank;
    double *rows, *targets, *norms; /* most by n, most, most */
    double *basis, *particular;     /* n by n, n: what perp__held_rows_solve finds */
    int32_t *taken;                 /* most */
} perp__held_rows;

void perp__held_rows_layout(perp__held_rows *held, perp__arena *arena, int32_t most, int32_t n);
/* Where the next row goes. */
double *perp__held_rows_next(const perp__held_rows *held);
/* Takes it, with what it makes of y. One that is 0 is left out. */
void perp__held_rows_take(perp__held_rows *held, double target);
void perp__held_rows_solve(perp__held_rows *held);

#endif

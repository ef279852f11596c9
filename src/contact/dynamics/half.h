/* W = A M^-1 A' of few velocities as Y'Y with Y = L^-1 A', M = L L': half of the solves, and
 * symmetric as it is. */
#ifndef PERP_CONTACT_HALF_H
#define PERP_CONTACT_HALF_H

#include <stddef.h>
#include <stdint.h>

/* Rows of A that are worked on at a time: Y has so many more columns than one needs. */
enum { PERP__HALF_TILE = 8 };

/* Velocities up to which W is made so; and those up to which it is where M is dense, or where rows
 * outnumber them, as methods then go on in velocities: factors of a sparse M, mostly those of a
 * tree, are cheaper for W alone. */
enum { PERP__HALF_FEW = 96, PERP__HALF_MOST = 256 };

/* Columns of Y for so many rows of A. */
static inline size_t perp__half_width(int32_t size)
{
    return ((size_t)size + PERP__HALF_TILE - 1) / PERP__HALF_TILE * PERP__HALF_TILE;
}

/* Y := L^-1 Y for the lower triangle of L, n by n, column-major. Y is n by perp__half_width(size),
 * row-major, with zeros in the columns past `size`. firsts: for each tile of columns the first row
 * that is not 0; work: n. */
void perp__half_solve(int32_t n, int32_t size, const double *L, double *Y, const int32_t *firsts,
                      double *work);

/* X := L^-1, n <= PERP__HALF_MOST by perp__half_width(n), row-major. And x := X'X x; work: twice
 * the width. Where n is small, divisions one after the other take longer than all of these
 * products. */
void perp__half_invert(int32_t n, const double *L, double *X, double *work);
void perp__half_apply(int32_t n, const double *X, double *x, double *work);

/* W := Y'Y, size by size. */
void perp__half_product(int32_t n, int32_t size, const double *Y, const int32_t *firsts, double *W);

#endif

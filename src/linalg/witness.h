/* The second witness for `solved`: each row's violation beside what the row and its neighbours
 * carry, of a linear problem w = M z + q between bounds. */
#ifndef PERP_LINALG_WITNESS_H
#define PERP_LINALG_WITNESS_H

#include <math.h>

#include "base/arena.h"
#include "linalg/matrix.h"

/* The problem and the point in question, in the caller's units. */
typedef struct perp__witness_point {
    const perp__matrix *M;
    const int32_t *exponents; /* of perp__equilibrate */
    const int32_t *part;      /* 2 n, of perp__find_parts */
    int32_t parts;
    const double *q, *lower, *upper, *z, *w;
    const double *least; /* what z_j carries at least, however small it is; NULL: nothing */
    double tol;
} perp__witness_point;

/* n entries; cut, omegas, omega_of_part and most: 2 n. */
typedef struct perp__witness {
    int32_t known; /* the units are those of this matrix */
    double tol;    /* that it is cut for; 0: none */
    /* log2 of scales that bring the largest entry of every row and column of M near 1, and the
     * parts of M that hang together by couplings that are significant in them */
    int32_t *exponents, *cut, *omegas, *omega_of_part, *is_free;
    double *terms, *carried, *rounding, *wrong, *around, *ordinary, *allowed; /* see witness.c */
    double *most, *scales;                                                    /* the same; work */
} perp__witness;

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n);

/* The largest own residual of a row, INFINITY where one is off by its own right side; or 0 where a
 * look at the violations shows it is at most tol. Who changes M sets witness->known to 0. */
double perp__witness_own_residual(perp__witness *witness, const perp__witness_point *point);

/* terms[i] := sum_j |M_ij z_j| + |q_i|, scaled by 2^units, divided by 2^omegas; NULL: as it is. */
void perp__find_terms(const perp__matrix *M, const double *q, const double *z, const int32_t *units,
                      const int32_t *omegas, double *terms);

/* By how much row i fails to be the row of an exact solution with z's own index set. */
static inline double perp__row_violation(double z, double lower, double upper, double w)
{
    if (lower == upper)
        return 0.0;
    if (z == lower)
        return w < 0.0 ? -w : 0.0;
    if (z == upper)
        return w > 0.0 ? w : 0.0;
    return fabs(w);
}

#endif

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
    int32_t balanced;         /* what that returned */
    const int32_t *part;      /* 2 n, of perp__find_parts */
    int32_t parts;
    int32_t scaling; /* 0: the exponents are 0 by the caller's wish */
    const double *q, *lower, *upper, *z, *w;
    const double *row_norms; /* of the matrix scaled by the exponents; NULL: not known */
    const double *least;     /* what z_j carries at least, however small it is; NULL: nothing */
    double tol;
} perp__witness_point;

/* Units of M: log2 of scales that bring the largest entry of every row and column near 1, and the
 * parts of M that hang together by couplings that are significant in them. */
typedef struct perp__witness_units {
    int32_t *exponents, *cut;
} perp__witness_units;

typedef struct perp__witness {
    int32_t known;    /* the units are those of this matrix */
    int32_t count;    /* 1, or 2 */
    int32_t balanced; /* else their exponents are those that balancing starts from */
    double tol;       /* that they are cut for; 0: none */
    int32_t tied;     /* and rows are tied to their columns; else their parts are smaller */
    perp__witness_units units[2];
    int32_t *omegas, *omega_of_part, *is_free;
    double *terms, *carried, *rounding, *wrong, *around, *most; /* n, most 2 n: see witness.c */
    double *sizes;                                              /* 3 n */
} perp__witness;

/* Exponents of units of the size that a caller may have chosen. */
#define PERP__MODERATE_UNIT 200

/* For the witness alone: count, and the units that balancing starts from. */
void perp__witness_find_starts(perp__witness *witness, const perp__witness_point *point);

void perp__witness_layout(perp__arena *arena, perp__witness *witness, size_t n);

/* The largest own residual of a row; or 0 where a look at the violations shows that it is at most
 * tol. The owner sets witness->known to 0 when M has changed. */
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

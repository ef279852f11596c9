/* The matrix W as the methods see it: the caller's, or one of our own. */
#ifndef PERP_CONTACT_DELASSUS_H
#define PERP_CONTACT_DELASSUS_H

#include "base/arena.h"
#include "contact/bodies/bodies.h"
#include "linalg/matrix.h"

/* The memory of W with compliance on its diagonal, or of W of bodies; all zero at first. */
typedef struct perp__delassus {
    perp__arena arena;
    int32_t size, sparse;
    int64_t entries;
    double *values;
    int32_t *starts, *rows;
} perp__delassus;

/* W := own copy of W + diag(compliance). PERP_OK or _MEMORY. */
perp_status perp__delassus_add(perp__delassus *view, perp_context *context, perp__matrix *W,
                               const double *compliance);

/* Diagonal of W. */
void perp__delassus_diagonal(const perp__matrix *W, double *diagonal);

/* out := |W| |x| + |add|; add may be NULL */
void perp__absolute_product(const perp__matrix *W, const double *x, const double *add, double *out);

/* W of the bodies, compressed columns in own's memory. *made is 0 if it has too many entries.
 * PERP_OK or _MEMORY. */
perp_status perp__delassus_of_bodies(perp__delassus *view, perp_context *context,
                                     const perp__bodies *bodies, perp__matrix *W, int32_t *made);

/* out += |A'| |x| */
void perp__absolute_transposed(const perp__matrix *A, const double *x, double *out);

/* high + low := A'x + add in doubled precision; add may be NULL. */
void perp__transposed_doubled(const perp__matrix *A, const double *x, const double *add,
                              double *high, double *low);

#endif

/* M v = f + H'r + G's, u = H v + w, 0 = G v + b, with M dense, sparse or a callback. */
#ifndef PERP_CONTACT_DYNAMICS_H
#define PERP_CONTACT_DYNAMICS_H

#include <perp/contact.h>

#include "base/arena.h"
#include "contact/bodies/bodies.h"
#include "linalg/fronts/fronts.h"
#include "linalg/matrix.h"

typedef struct perp__dynamics {
    perp_context *context;
    int32_t n;
    int32_t size; /* rows of H and of G */
    int32_t has_M, forms_W;
    perp__matrix M, H, G; /* G: 0 rows if there is none */
    perp_contact_mass_solve solve;
    void *user;
    perp__arena arena;
    perp__fronts fronts;    /* sparse M, as it is factored: */
    int32_t *starts, *rows; /* its columns */
    double *values;
    double *factor;                            /* n by n: dense M, or one that half.c works on */
    double *inverse, *pair;                    /* its inverse, if n is small; work of half.c */
    double *W;                                 /* size by size */
    double *block;                             /* n by BLOCK; or Y of half.c */
    int32_t *firsts;                           /* its tiles */
    double *high, *low, *more_high, *more_low; /* n or size, the larger */
} perp__dynamics;

/* Checks everything but positive definiteness and fills own's views; `rows` is what the contacts
 * need of H. */
perp_status perp__dynamics_read(perp_context *context, perp__dynamics *view, int32_t rows,
                                const perp_contact_dynamics *dynamics);

/* Makes room, factors M and, if own->forms_W, forms W. PERP_OK, PERP_ERROR_ARGUMENT (M not positive
 * definite), _NOT_FINITE, _MEMORY or _CALLBACK. */
perp_status perp__dynamics_setup(perp__dynamics *view);

/* high + low := f + H'r + G's in doubled precision; f NULL: 0. */
void perp__dynamics_push(perp__dynamics *view, const double *f, const double *r);

/* v + v_low := M^-1 (f + H'r + G's), refined once in doubled precision where M is known; (r, s)
 * NULL: 0. PERP_OK, _CALLBACK or _NOT_FINITE. */
perp_status perp__dynamics_velocities(perp__dynamics *view, const double *f, const double *r,
                                      double *v, double *v_low);

/* u := (H v + w, G v + b), rounded once; b may be NULL. */
void perp__dynamics_relative(perp__dynamics *view, const double *v, const double *v_low,
                             const double *w, const double *b, double *u);

/* out := (|H| |v| + |w|, |G| |v| + |b|) */
void perp__dynamics_sizes(const perp__dynamics *view, const double *v, const double *w,
                          const double *b, double *out);

/* Y of W = Y'Y, n by size, row-major with that stride; NULL where W was not made so. */
const double *perp__dynamics_half(const perp__dynamics *view, size_t *stride);

void perp__dynamics_release(perp__dynamics *view);

/* ---- few velocities: half.c ---- */

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

/* ---- the matrix W as the methods see it: delassus.c ---- */

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

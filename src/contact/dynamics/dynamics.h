/* M v = f + H'r + G's, u = H v + w, 0 = G v + b, with M dense, sparse or a callback. */
#ifndef PERP_CONTACT_DYNAMICS_H
#define PERP_CONTACT_DYNAMICS_H

#include <perp/contact.h>

#include "base/arena.h"
#include "linalg/fronts/fronts.h"
#include "linalg/matrix.h"

typedef struct perp__dynamics {
    perp_context *context;
    int32_t n;
    int32_t size; /* rows of H and of G */
    int32_t has_M;
    int32_t forms_W;
    perp__matrix M, H, G; /* G: 0 rows if there is none */
    perp_contact_mass_solve solve;
    void *user;
    perp__arena arena;
    perp__fronts fronts;    /* sparse M, as it is factored: */
    int32_t *starts, *rows; /* its columns */
    double *values;
    double *factor;                            /* n by n: dense M, or one that half.h works on */
    double *inverse, *pair;                    /* its inverse, if n is small; work of half.h */
    double *W;                                 /* size by size */
    double *block;                             /* n by BLOCK; or Y of half.h */
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

#endif

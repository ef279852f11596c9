/* What the files of compliant contacts share. Matrices column-major without gaps. */
#ifndef PERP_MECHANISM_COMPLIANT_H
#define PERP_MECHANISM_COMPLIANT_H

#include <perp/friction.h>

#include "base/arena.h"
#include "base/check.h"
#include "base/handle.h"

enum { PERP__STAGES = 5 };

struct perp_compliant {
    PERP__HANDLE;
    perp__arena arena;
    int32_t n, p;
    double stiffness, damping;
    double *mass;             /* its Cholesky factor */
    double *normal, *tangent; /* p by n */
    double *force, *free;     /* n: force, mass^-1 force */
    double *mu;               /* p */
    double *response, *drag;  /* n by p: mass^-1 normal', mass^-1 tangent' diag(mu) */
    double *P, *Q;            /* p by p: normal response, normal drag */
    /* work */
    double *slip;                                /* p: signs of sliding */
    double *side;                                /* p: signs of the normal forces */
    double *matrix;                              /* p by p */
    int32_t *pivots;                             /* p */
    double *N, *right;                           /* p */
    double *gamma, *roots;                       /* 2 p, 4 p */
    double *x, *v, *V;                           /* n: state, stage */
    double *zx, *zv;                             /* n: what a stage starts from */
    double *kx[PERP__STAGES], *kv[PERP__STAGES]; /* n: slopes of the stages */
    double *next_x, *next_v, *error_x, *error_v; /* n */
    double *top_x, *top_v;                       /* n: largest values so far */
    double *top_delta;                           /* p */
};

perp_status perp__compliant_enter(perp_compliant *c);

#endif

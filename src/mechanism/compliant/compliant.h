/* What the files of compliant contacts share. Matrices column-major without gaps. */
#ifndef PERP_MECHANISM_COMPLIANT_H
#define PERP_MECHANISM_COMPLIANT_H

#include <perp/contact.h>
#include <perp/friction.h>

#include "base/arena.h"
#include "base/check.h"
#include "base/handle.h"
#include "linalg/active_rows.h"
#include "mechanism/tuning.h"

enum { PERP__STAGES = 5 };

/* x'' = free - response N - drag F: mass^-1 of force, normal' and tangent'. */
typedef struct perp__response {
    double *free;            /* n */
    double *response, *drag; /* n by p */
    double *P, *Q;           /* p by p: normal response, normal drag */
} perp__response;

struct perp_compliant {
    PERP__HANDLE;
    perp__arena arena;
    int32_t n, p;
    double stiffness, damping;
    double *mass;             /* its Cholesky factor */
    double *normal, *tangent; /* p by n */
    double *force;            /* n */
    double *mu, *mu_static;   /* p */
    int32_t *one_sided;       /* p */
    perp__response all, held; /* held: without what the contacts that stick forbid */
    perp__response now;       /* one of them */
    double *slip_response;    /* p by p: tangent drag */
    /* what the contacts do (modes.c) */
    int32_t *modes; /* p: PERP_CONTACT_SEPARATE, ... */
    int32_t *gives; /* p: 1: its friction does not hold it any longer */
    int32_t *stuck; /* the stuck ones that their rows tie down */
    int32_t stuck_count;
    double *factor; /* p by p: Cholesky factor of their block of slip_response */
    double *flank;  /* p: the sign of N: what sticks gives before it changes */
    double *sense;  /* p: the sign of sliding */
    int32_t *modes_before;
    double *sense_before; /* of the last decision */
    double *share;        /* p: F = share |N|; 0 of what is tied down, and of what is separate */
    double *friction;     /* p: F at the state */
    double *lower, *upper, *q, *w; /* p: bounds of F, the problem of who sticks */
    perp_lcp_solver *choice;
    perp__active_rows rows;
    /* work */
    double tol;                                  /* of a step */
    double *side;                                /* p: signs of the normal forces */
    double *matrix;                              /* p by p */
    int32_t *pivots;                             /* p */
    double *N, *right;                           /* p */
    double *gamma, *roots;                       /* 2 p, 4 p */
    double *x, *v, *V;                           /* n: state, stage */
    double *zx, *zv;                             /* n: what a stage starts from */
    double *kx[PERP__STAGES], *kv[PERP__STAGES]; /* n: slopes of the stages */
    double *next_x, *next_v, *error_x, *error_v; /* n */
    double *size;                                /* n: of the terms of x'' */
    double *top_x, *top_v;                       /* n: largest values so far */
    double *top_delta;                           /* p */
    int32_t has_run;                             /* 1: they are set */
};

perp_status perp__compliant_enter(perp_compliant *c);

/* row of A (p rows) times x. */
double perp__compliant_row(const perp_compliant *c, const double *A, int32_t row, const double *x);
/* to := the normal forces, also below 0 of what is one-sided. */
void perp__compliant_normals(const perp_compliant *c, double *to, const double *x, const double *v);
/* P and Q of a response. */
void perp__compliant_couple(const perp_compliant *c, perp__response *r);

/* ---- modes.c ---- */

/* A contact that can't go on as it does, and how the run ends where it has to; -1: none. */
typedef struct perp__event {
    int32_t contact, end;
} perp__event;

/* Whether a contact would be at rest at the start. */
bool perp__compliant_rests(const perp_compliant *c, int32_t k);
/* From the state x, v: who presses, sticks, or slides and where to, and `now`; velocities that
 * sticking contacts forbid become 0. Counts turns. *failed: none can be told. PERP_OK or _MEMORY.
 */
perp_status perp__compliant_decide(perp_compliant *c, perp_compliant_result *result,
                                   int32_t *failed);
/* Of the state next_x, next_v. */
perp__event perp__compliant_event(perp_compliant *c);
/* The friction forces of a state with these normal forces, into c->friction. */
void perp__compliant_friction(perp_compliant *c, const double *N);
/* v := what the contacts that stick leave of it. */
void perp__compliant_hold(perp_compliant *c, double *v);

#endif

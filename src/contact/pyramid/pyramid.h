/* The LCP of method lemke: its unknowns and their memory, shared by pyramid*.c only. */
#ifndef PERP_CONTACT_PYRAMID_H
#define PERP_CONTACT_PYRAMID_H

#include "contact/law.h"
#include "lcp/lcp.h"

/* Unknown of the LCP: z_j acts on `row` and, with size 2, the next, along d. Slip speeds act on
 * nothing: row -1. */
typedef struct perp__unknown {
    int32_t unit; /* its contact or bilateral row */
    int32_t row, size;
    double d[2];
} perp__unknown;

typedef struct perp__pyramid {
    perp__contact_work base;
    perp_lcp_solver *lcp;
    int32_t n;
    perp__unknown *unknowns;
    double *M, *q, *lower, *z, *direction;
    double *W;               /* dense copy of a sparse W */
    double *angles, *widths; /* 3 contacts: where the discs pushed at the last answer; windows */
    double *sides;           /* 3 contacts: e of those that hold both ways */
    int32_t regular;         /* polygons, without a window */
    double *impulse;         /* contacts and bilateral rows: the unit of z; and 1 over that of */
    double *per_velocity;    /* the rows; for slip speeds the other way round */
} perp__pyramid;

int64_t perp__pyramid_count(const perp__contact_problem *problem);

/* Contact by contact: r_n, or r_N and z, then for each part its betas and its lambda; then the
 * bilateral rows. */
void perp__pyramid_number(perp__pyramid *p);

/* Fills p->W from a sparse W; then M, q and lower, all but the slip speeds' rows and columns, which
 * are last. The second returns 0 where the time is over before it is done. */
void perp__pyramid_spread(perp__pyramid *p);
int32_t perp__pyramid_fill_impulses(perp__pyramid *p);
void perp__pyramid_fill_speeds(perp__pyramid *p);

/* x := the impulses that z stands for; the modes that it shows. */
void perp__pyramid_gather(const perp__pyramid *p, const double *z, double *x);
void perp__pyramid_modes(const perp__pyramid *p, int8_t *modes);

#endif

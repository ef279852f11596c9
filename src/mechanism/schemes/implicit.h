/* What the files of the implicit scheme share: the nonlinear complementarity problem of a step.
 *
 * Its unknowns: v+, then contact by contact r_n and its friction, then the bilateral impulses, then
 * the dry groups' friction. Friction of a disc of radius R (mu |r_N|, or h times a dry bound):
 *
 *   one tangent       x in [-1, 1]     r_t = R x          x perp u_t
 *   two, exact        x in R^2, l >= 0 r_t = R x          u_t + l x = 0, 0 <= l perp 1 - x'x >= 0
 *   two, a polygon    beta, l >= 0     r_t = sum beta d   0 <= beta_j perp d_j'u_t + l >= 0,
 *                                                         0 <= l perp R - sum beta >= 0
 *
 * The second is the Fritz-John form of the exact cone, R u_t + l r_t = 0, divided by R: it says
 * where to slide also to a contact that does not press yet. The first is the third with two
 * directions and x = (beta_1 - beta_2) / R. */
#ifndef PERP_MECHANISM_IMPLICIT_H
#define PERP_MECHANISM_IMPLICIT_H

#include <perp/ncp.h>

#include "mechanism/mechanism.h"

/* A contact, or a group of dry friction. */
typedef struct perp__implicit_disc {
    int32_t contact;  /* of the mechanism; contacts + group: dry friction */
    int32_t row;      /* its first tangent's */
    int32_t tangents; /* 0: no friction */
    int32_t edges;    /* of a polygon; 0: the interval or the disc itself */
    int32_t forces;   /* its first unknowns: x, or beta */
    int32_t normal;   /* its first unknown; -1: none */
    int32_t normals;  /* so many of them; free where they hold both ways */
    int32_t first;    /* unknown of its friction */
    double weight;    /* an impulse of friction, for the rows of x */
} perp__implicit_disc;

struct perp__implicit {
    PERP__WORK;
    perp_ncp_solver *solver;
    perp_ncp_settings settings;
    int32_t most, size; /* unknowns: room, of the problem at hand */
    int32_t bilateral;  /* the first unknown of those */
    int32_t discs_count;
    perp__implicit_disc *discs;
    double *z, *w, *start, *lower, *upper; /* size */
    double *changed, *shifted;             /* size: F and z beside a point, for differences */
    double *at;                            /* size: where `F` and m->end were evaluated last */
    double *F;                             /* size */
    double *q;                             /* coordinates: q+ at `at` */
    double *r;                             /* rows: impulses at `at` */
    double *u;                             /* rows: velocities at `at` */
    double *steps;                         /* n: sizes of the velocities */
    double *inverse_mass;                  /* rows: J M^-1 J' at the step's start */
    double speed;                          /* of the step, in the metric of M */
    double noise;             /* rounding of gap / h, the largest, beside the speeds of its row */
    int32_t is_at;            /* 1: `at` holds a point */
    double *bent;             /* size by n: columns of v beyond M and J, by differences */
    double *bent_at, *bent_r; /* n, rows: velocities and impulses of those */
    int32_t is_bent;
    int32_t outcome; /* of the solver */
    double residual;
    perp__start from;   /* of the step */
    perp_status failed; /* of a callback that asked to abort, and its message */
    char message[PERP__MESSAGE_SIZE];
};

/* ---- implicit_function.c ---- */
/* F and its Jacobian, for the solver; user: the mechanism. */
int32_t perp__implicit_function(double *F, const double *z, void *user);
int32_t perp__implicit_jacobian(double *J, const double *z, void *user);
/* m->end, m->friction, s->q, s->r, s->u and s->F := those of z, as evaluations in mechanism.h. */
perp_status perp__implicit_evaluate(perp_mechanism *m, perp__implicit *s, const double *z);
/* What the row's gap (or c) at s->q, `now`, is beyond the linear one, as a speed. */
double perp__implicit_curvature(perp_mechanism *m, perp__implicit *s, int32_t row, double now,
                                double before);

/* ---- implicit.c ---- */
/* h times the bound, or mu |r_N|. */
double perp__implicit_radius(const perp_mechanism *m, const perp__implicit *s,
                             const perp__implicit_disc *disc, const double *z);
/* The direction of force i: of a tangent, or of an edge of the polygon. */
void perp__implicit_direction(const perp__implicit_disc *disc, int32_t i, double d[2]);

#endif

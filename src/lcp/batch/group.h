/* A group of small problems side by side: lane k of every vector belongs to problem k. */
#ifndef PERP_LCP_BATCH_GROUP_H
#define PERP_LCP_BATCH_GROUP_H

#include <perp/lcp.h>

#include "lcp/solver.h"

typedef struct perp__batch_group {
    int32_t n, width;      /* width: problems in a group, the doubles of a vector */
    int32_t rests_at_zero; /* all lower bounds are 0, and no upper bound is finite */
    int32_t has_free;      /* some variable has no bound and is active from the start */
    int32_t most_rounds;   /* of exchanges */
    double *M, *LU;        /* n x n vectors, row by row */
    double *q, *lower, *upper;
    double *z_unit, *w_unit; /* 1 / (D omega) and D / omega: the tested residual's units */
    double *size;            /* D omega */
    double *norm;            /* of a row of M D omega, 1-norm */
    double *active, *rest;   /* 1 where w_i = 0 is solved for, else 0 and z_i = rest_i */
    double *target;          /* where z_i goes if it leaves the active set */
    double *change;          /* 1 where index i violates its place */
    double *inverse;         /* of LU's pivots */
    double *z, *high;        /* the point and w = M z + q, rounded from doubled precision */
    double *tested;          /* one vector: the tested residual, +inf where the kernel gave up */
    double *own_residual;    /* one vector: at least the own residual of every row; +inf where more
                       must be looked at to say: numbers that are not finite or too large,
                       a matrix that may fall into parts */
} perp__batch_group;

/* Solves the group by active sets (Kostreva 1978; Judice & Pires 1994), n and all inputs set. The
 * bits of a lane depend on its own problem alone. */
typedef struct perp__batch_kernel {
    int32_t width;
    void (*solve)(const perp__batch_group *group);
} perp__batch_kernel;

/* number = 0: the widest that this processor has, 1 the next, ...; NULL beyond the last. */
const perp__batch_kernel *perp__batch_kernel_number(int32_t number);

/* An arena's layout function; object is a group with n and width. */
void perp__batch_group_layout(perp__arena *arena, void *object);

/* Many problems, one after the other in memory. lower, upper: count x n or NULL. */
typedef struct perp__batch_data {
    perp_lcp_stack stack; /* the caller's */
    int32_t scaling;
    int32_t max_iterations; /* 0: the kernel's own limit */
} perp__batch_data;

/* Interleaves the problems first, first + 1, ... (the last one again where there are fewer). Lanes
 * that the kernel cannot take (a diagonal entry <= 0, a scale out of range) are told by 0 in
 * `takes`. Numbers that are not finite are the kernel's to find. */
void perp__batch_group_read(perp__batch_group *group, const perp__batch_data *data, int64_t first,
                            int32_t *takes);

#endif

/* The solver's own memory, shared by the files of the front door only. */
#ifndef PERP_NCP_SOLVER_H
#define PERP_NCP_SOLVER_H

#include <perp/ncp.h>

#include "base/arena.h"
#include "base/handle.h"
#include "base/outcome.h"
#include "linalg/witness.h"
#include "ncp/newton.h"

/* What a point is worth, recomputed from F and J there. */
typedef struct perp__ncp_residuals {
    perp__evidence
        evidence; /* tested, own, backward; sound: finite, and at_start is no objection */
    double natural;
    double at_start;   /* tested, by the scales of the start */
    perp_outcome said; /* by the method */
} perp__ncp_residuals;

/* What is kept while the parts of a problem are solved one by one. */
typedef struct perp__ncp_parts {
    int32_t *of, count;            /* the part of a row */
    double *z;                     /* the best of every part */
    double *lower, *upper, *start; /* of the whole */
} perp__ncp_parts;

struct perp_ncp_solver {
    PERP__HANDLE;
    perp_ncp_settings settings;
    perp__arena arena;
    int32_t setups; /* 0: no problem yet */
    perp__ncp_model model;
    perp__ncp_run run;
    perp__ncp_linear linear;
    perp__witness witness;
    perp__ncp_parts parts;
    double *start; /* z0, projected; moved to where F is defined */
    double *perturbed;
    int32_t apart;     /* of the next run: see model.h */
    double *unit;      /* of a perturbation */
    double *candidate; /* caller's units */
    double *best_z, *best_w;
    perp__ncp_residuals best;
    int32_t first_method; /* under auto */
    int32_t best_method;  /* -1: no point yet */
    int64_t iterations;
    int32_t trapped;
    uint64_t random;
};

/* The numbers of solver->candidate; F is left in model.w_caller. PERP_OK, PERP__NCP_OUTSIDE or
 * PERP_ERROR_CALLBACK. */
perp_status perp__ncp_outcome_of(perp_ncp_solver *solver, perp__ncp_residuals *residuals);

/* *trapped := whether best_z is a stationary point of the merit function, within rounding. */
perp_status perp__ncp_look_for_trap(perp_ncp_solver *solver, int32_t *trapped);

/* As the public functions, without entering the context: the caller is inside a public call
 * already. Failures are written into its message. */
perp_status perp__ncp_create(perp_context *context, perp_ncp_solver **solver,
                             const perp_ncp_settings *settings);
perp_status perp__ncp_setup(perp_ncp_solver *solver, const perp_ncp_problem *problem);
perp_status perp__ncp_solve(perp_ncp_solver *solver, double *z, double *w, perp_ncp_result *result,
                            const double *z0);

#endif

/* The points that a solve meets, and the best of them. */
#ifndef PERP_LCP_CANDIDATE_H
#define PERP_LCP_CANDIDATE_H

#include "base/outcome.h"
#include "lcp/plan.h"
#include "lcp/solver.h"

/* Sets solver->z and, scaled, solver->iterate to z0 (NULL: 0), projected onto the bounds. */
void perp__start_from(perp_lcp_solver *solver, const double *z0);

/* Makes solver->z the candidate of a step: evaluates it, polishes it unless it is far off, keeps it
 * if it is the best so far or the first. PERP_OK, or _MEMORY. */
perp_status perp__consider(perp_lcp_solver *solver, const perp__plan_step *step, perp_outcome said,
                           const perp__lcp_iterate *iterate, const double *z0);

/* Keeps solver->z as it is, by this method, if it is the best so far. */
void perp__consider_point(perp_lcp_solver *solver, int32_t method);

/* Keeps the start, projected, if nothing better was met. */
void perp__consider_start(perp_lcp_solver *solver, const double *z0);

/* Polishes the index set of z0; keeps the point if it solves the problem. PERP_OK, or _MEMORY. */
perp_status perp__try_start(perp_lcp_solver *solver, const double *z0);

/* Keeps the ray in solver->z, which stood the check. The last word comes after all attempts. */
void perp__keep_ray(perp_lcp_solver *solver);

#endif

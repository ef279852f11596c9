/* The LCP front door for the layers above: as the public functions, without entering the context
 * (the caller is inside a public call already) and with failures written into its message. */
#ifndef PERP_LCP_LCP_H
#define PERP_LCP_LCP_H

#include <perp/lcp.h>

#include "linalg/matrix.h"

/* As perp_lcp_solve, for a problem with a product: product.c. */
perp_status perp__lcp_solve_product(perp_context *context, double *z, double *w,
                                    perp_lcp_result *result, const perp_lcp_settings *settings,
                                    const perp_lcp_problem *problem, const double *z0);

/* Checks everything and fills *copy; NULL gives the defaults. *copy is untouched on failure. */
perp_status perp__lcp_settings_read(perp_context *context, perp_lcp_settings *copy,
                                    const perp_lcp_settings *settings);
/* copy := the caller's problem; nothing where that is NULL. products: it may be given by them. */
perp_status perp__lcp_caller_read(perp_context *context, perp_lcp_problem *copy,
                                  const perp_lcp_problem *problem, bool products);
perp_status perp__lcp_create(perp_context *context, perp_lcp_solver **solver,
                             const perp_lcp_settings *settings);
/* Whether `auto` searches the index sets of problems with up to 20 variables, where all else fails:
 * those of contacts, whose variables choose between two places. */
void perp__lcp_insist(perp_lcp_solver *solver, bool insists);
perp_status perp__lcp_set(perp_lcp_solver *solver, const perp_lcp_settings *settings);
/* signs[i] := -1 where the equation of a free z_i is to be turned round (solver.c), 1 elsewhere;
 * returns how many are. */
int32_t perp__lcp_orient(const perp__matrix *M, const double *lower, const double *upper,
                         int8_t *signs);
perp_status perp__lcp_setup(perp_lcp_solver *solver, const perp_matrix *M, const double *lower,
                            const double *upper);
/* The verdict on a point whose derivatives are asked for; and whether it has some: else the message
 * calls the point `name` and what is singular `set`. claims/sensitivity.c. */
int32_t perp__lcp_verdict(bool good, double condition, double margin, double tol);
perp_status perp__lcp_check_verdict(perp_context *context, const char *name, const char *set,
                                    int32_t verdict);
perp_status perp__lcp_solve(perp_lcp_solver *solver, double *z, double *w, double *ray,
                            perp_lcp_result *result, const double *q, const double *z0);

#endif

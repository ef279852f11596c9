/* A solver with all of a problem in place, for what looks inside. */
#ifndef PERP_TESTS_LCP_POSED_H
#define PERP_TESTS_LCP_POSED_H

#include "context.h"
#include "lcp/solver.h"

/* M row by row. */
static perp_lcp_solver *posed(int32_t n, const double *entries, const double *lower,
                              const double *upper, const double *q)
{
    perp_lcp_solver *solver = NULL;
    perp_matrix M;

    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    M = matrix_rows(entries, n, n);
    assert_int_equal(perp_lcp_solver_setup(solver, &M, lower, upper), PERP_OK);
    perp__scale_problem(solver, q);
    return solver;
}

#endif

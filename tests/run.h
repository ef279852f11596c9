/* One solve of one problem with everything it returns, checked as check.h does. */
#ifndef PERP_TESTS_RUN_H
#define PERP_TESTS_RUN_H

#include "check.h"
#include "gen.h"

typedef struct run {
    perp_status status;
    perp_lcp_result result;
    double *z, *w, *ray; /* n entries each */
} run;

/* Fresh default settings with this method. */
perp_lcp_settings run_settings(int32_t method);

/* The same to tol, by itself: what the method reaches, not what the polish makes of it. */
perp_lcp_settings run_alone(int32_t method, double tol);

/* A view of n by n numbers, row after row. */
perp_matrix run_dense(const double *values, int32_t n);

/* Solves through perp_lcp_solve, requires PERP_OK and a result that check_lcp_result accepts; fails
 * the test with `where` otherwise. settings may be NULL, z0 too. */
void run_lcp(run *r, perp_context *context, const gen_lcp *problem,
             const perp_lcp_settings *settings, const double *z0, const char *where);

/* The same for any view of the matrix. */
void run_view(run *r, perp_context *context, const perp_matrix *M, const double *q,
              const double *lower, const double *upper, const perp_lcp_settings *settings,
              const double *z0, const char *where);

void run_release(run *r);

/* Whether the outcome is one that counts as solved. */
int run_ok(const run *r);

/* max |a - b| over n entries. */
double run_distance(const double *a, const double *b, int32_t n);

#endif

#include "run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

perp_lcp_settings run_settings(int32_t method)
{
    perp_lcp_settings settings;

    assert_int_equal(perp_lcp_settings_init(&settings, sizeof settings), PERP_OK);
    settings.method = method;
    return settings;
}

perp_lcp_settings run_alone(int32_t method, double tol)
{
    perp_lcp_settings settings = run_settings(method);

    settings.polish = 0;
    settings.tol = tol;
    return settings;
}

perp_matrix run_dense(const double *values, int32_t n)
{
    return matrix_rows(values, n, n);
}

void run_view(run *r, perp_context *context, const perp_matrix *M, const double *q,
              const double *lower, const double *upper, const perp_lcp_settings *settings,
              const double *z0, const char *where)
{
    size_t n = (size_t)M->rows, i;

    memset(r, 0, sizeof *r);
    r->z = check_allocate(n, sizeof(double));
    r->w = check_allocate(n, sizeof(double));
    r->ray = check_allocate(n, sizeof(double));
    for (i = 0; i < n; i++) /* an entry that is not written is found */
        r->z[i] = r->w[i] = r->ray[i] = NAN;
    assert_int_equal(perp_struct_init(&r->result, sizeof r->result), PERP_OK);
    r->status = perp_lcp_solve(context, r->z, r->w, r->ray, &r->result, settings,
                               LCP(M, q, lower, upper), z0);
    if (r->status != PERP_OK)
        fail_msg("%s: %s: %s", where, perp_status_text(r->status), perp_context_message(context));
    check_require(check_lcp_result(M, q, lower, upper, r->z, r->w, r->ray, &r->result, settings),
                  where);
}

void run_lcp(run *r, perp_context *context, const gen_lcp *problem,
             const perp_lcp_settings *settings, const double *z0, const char *where)
{
    run_view(r, context, &problem->view, problem->q, problem->lower, problem->upper, settings, z0,
             where);
}

void run_release(run *r)
{
    free(r->z);
    free(r->w);
    free(r->ray);
    memset(r, 0, sizeof *r);
}

int run_ok(const run *r)
{
    return r->result.outcome == PERP_OUTCOME_SOLVED ||
           r->result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

double run_distance(const double *a, const double *b, int32_t n)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < n; i++)
        check_raise(&largest, fabs(a[i] - b[i]));
    return largest;
}

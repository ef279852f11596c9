/* perp_lcp_solve and the solver of perp/lcp.h: all methods, settings, storages, several q. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "problem.h"

static int32_t monitor_calls;

static int32_t monitor(const perp_lcp_progress *progress, void *user)
{
    const int32_t *answers = user; /* at which call, what */

    if (progress->iterations < 0 || isnan(progress->residual))
        fuzz_fail("progress: %lld iterations, residual %g", (long long)progress->iterations,
                  progress->residual);
    return monitor_calls++ == answers[0] ? answers[1] : 0;
}

/* The ray that proves that no z >= l has M z + q >= 0. 1e-12: it was checked in doubles. */
static void check_proof(const lcp_problem *p, const double *ray)
{
    wide *M = oracle_wide(p->n * p->n, p->M.dense), gain = 0, size = 0;
    int32_t i, j;

    for (i = 0; i < p->n; i++)
        if (!isfinite(p->lower[i]))
            return;
    for (i = 0; i < p->n; i++) {
        wide sum = 0, terms = 0, share = p->q[i];

        for (j = 0; j < p->n; j++) {
            sum += M[j * p->n + i] * ray[j];
            terms += oracle_abs(M[j * p->n + i] * ray[j]);
            share += M[i * p->n + j] * p->lower[j];
        }
        if (!(ray[i] >= 0) || sum > terms * (wide)1e-12)
            fuzz_fail("a proof: y >= 0 and M'y <= 0, y[%d] = %g, (M'y)[%d] = %Lg", i, ray[i], i,
                      (long double)sum);
        gain += ray[i] * share;
        size += oracle_abs(ray[i] * share);
    }
    if (!(gain < 0))
        fuzz_fail("a proof: y'(q + M l) < 0, it is %Lg of %Lg", (long double)gain,
                  (long double)size);
}

static void check_certificate(const lcp_problem *p, const perp_lcp_result *result,
                              const double *ray)
{
    if (result->has_ray != !fuzz_untouched(ray))
        fuzz_fail("a ray is written if and only if has_ray is 1");
    if (result->certificate != PERP_CERTIFICATE_INFEASIBLE)
        return;
    if (fuzz_good(result->outcome))
        fuzz_fail("'%s' with a proof that there is no solution",
                  perp_outcome_text(result->outcome));
    if (p->integer && oracle_feasible(p->n, p->iM, p->iq))
        fuzz_fail("'infeasible', but some z >= 0 has M z + q >= 0");
    if (result->has_ray)
        check_proof(p, ray);
}

/* Residuals as reported are numbers, and agree with the outcome; natural_residual is recomputed
 * (1e-9: it is a difference of doubles near a bound). */
static void check_residuals(const lcp_problem *p, const perp_lcp_settings *settings,
                            const perp_lcp_result *result, const double *z)
{
    wide *w = fuzz_take(p->n, sizeof *w), *t = fuzz_take(p->n, sizeof *t), largest = 0, noise = 0;
    int32_t i;

    if (isnan(result->residual) || isnan(result->natural_residual) || result->seconds < 0)
        fuzz_fail("residuals are numbers: %g, %g with outcome '%s'", result->residual,
                  result->natural_residual, perp_outcome_text(result->outcome));
    if (result->outcome == PERP_OUTCOME_SOLVED && !(result->residual <= settings->tol))
        fuzz_fail("'solved' with tested residual %g for tol %g", result->residual, settings->tol);
    lcp_problem_rows(p, z, w, t);
    for (i = 0; i < p->n; i++) {
        wide to_lower = (wide)z[i] - p->lower[i], to_upper = (wide)z[i] - p->upper[i];
        wide r = w[i] < to_upper ? to_upper : w[i] > to_lower ? to_lower : w[i];

        largest = oracle_abs(r) > largest ? oracle_abs(r) : largest;
        noise = t[i] > noise ? t[i] : noise;
    }
    if (largest < 1e300 && noise < DBL_MAX && /* w is a double, each of its terms too */
        oracle_abs(result->natural_residual - largest) >
            largest * (wide)1e-9 + noise * 0x1p-98 + (wide)1e-300)
        fuzz_fail("natural_residual is %g instead of %Lg", result->natural_residual,
                  (long double)largest);
}

static void check_solvable(const lcp_problem *p, const perp_lcp_settings *settings,
                           const perp_lcp_result *result)
{
    oracle_vertex *vertices = fuzz_take(ORACLE_VERTICES, sizeof *vertices);

    if (p->integer && settings->method == PERP_LCP_AUTO && settings->tol >= 1e-12 &&
        !fuzz_good(result->outcome) && oracle_vertices(p->n, p->iM, p->iq, vertices) > 0)
        fuzz_fail("auto ends with '%s', but the problem has solutions",
                  perp_outcome_text(result->outcome));
}

static void solve_one(fuzz_bytes *bytes, perp_context *context, perp_lcp_solver *solver,
                      const lcp_problem *p, const perp_lcp_settings *settings, int ended_early)
{
    double *z = fuzz_doubles(p->n), *w = fuzz_doubles(p->n), *ray = fuzz_doubles(p->n);
    double *z0 = fuzz_doubles(p->n);
    perp_lcp_result *result = fuzz_take(1, sizeof *result), kept;
    const void *const outputs[] = {z, w, ray, NULL};
    int with_start = fuzz_one_in(bytes, 3);
    perp_status status;

    if (with_start)
        fuzz_numbers(bytes, p->mood, z0, p->n);
    if (perp_struct_init(result, sizeof *result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    kept = *result;
    fuzz_show("z", z, p->n);
    monitor_calls = 0;
    status = solver ? perp_lcp_solver_solve(solver, z, w, ray, result, p->q, with_start ? z0 : NULL)
                    : perp_lcp_solve(context, z, w, ray, result, settings,
                                     LCP(&p->M.view, p->q, p->lower_given, p->upper_given),
                                     with_start ? z0 : NULL);
    if (!fuzz_status_of(context, status, "perp_lcp_solve", outputs)) {
        if (memcmp(&kept, result, sizeof kept) != 0)
            fuzz_fail("a refusal leaves the result untouched");
        return;
    }
    lcp_problem_check("lcp", p, z, w, result->outcome, settings->tol, ended_early);
    check_certificate(p, result, ray);
    check_residuals(p, settings, result, z);
    if (!ended_early)
        check_solvable(p, settings, result);
}

static void solve_again(fuzz_bytes *bytes, perp_context *context, lcp_problem *p,
                        const perp_lcp_settings *settings, int ended_early)
{
    perp_lcp_solver *solver = NULL;
    int32_t times = 1 + fuzz_pick(bytes, 3);

    if (fuzz_status(context, perp_lcp_solver_create(context, &solver, settings), "create") &&
        fuzz_status(context,
                    perp_lcp_solver_setup(solver, &p->M.view, p->lower_given, p->upper_given),
                    "setup"))
        while (times-- > 0) {
            solve_one(bytes, context, solver, p, settings, ended_early);
            fuzz_numbers(bytes, p->mood, p->q, p->n);
            p->integer = 0;
        }
    perp_lcp_solver_destroy(solver);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    perp_lcp_settings settings;
    int32_t answers[2] = {0, 0};
    lcp_problem problem;
    int ended_early = lcp_settings_make(&bytes, &settings);

    if (fuzz_one_in(&bytes, 8)) {
        answers[0] = fuzz_pick(&bytes, 4);
        answers[1] = fuzz_pick(&bytes, 3) - 1;
        settings.monitor = monitor;
        settings.monitor_user = answers;
        ended_early = 1;
    }
    lcp_problem_make(&bytes, &problem, 0, 12);
    if (fuzz_one_in(&bytes, 3))
        solve_again(&bytes, context, &problem, &settings, ended_early);
    else
        solve_one(&bytes, context, NULL, &problem, &settings, ended_early);
    fuzz_close(context);
    return 0;
}

/* Sizes at which the code changes course (blocked updates, dense and sparse polish, what `auto`
 * tries first), with bounds of every kind, against known solutions. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* Condition numbers grow to about 1e5 at n = 400 (eigenvalues from 1/2 to a few n); solved to a few
 * eps, |z| below 12: 1e-8 is wide, a wrong active set is off by 1/16. */
static void solve(const gen_lcp *problem, const perp_matrix *M, int32_t method, const char *what)
{
    perp_lcp_settings settings = run_settings(method);
    char where[96];
    run r;

    snprintf(where, sizeof where, "n = %d, %s, %s", (int)problem->n, what,
             perp_lcp_method_text(method));
    run_view(&r, context, M, problem->q, problem->lower, problem->upper, &settings, NULL, where);
    if (!run_ok(&r))
        fail_msg("%s: %s, residual %g", where, perp_outcome_text(r.result.outcome),
                 r.result.residual);
    if (!(run_distance(r.z, problem->z, problem->n) <= 1e-8))
        fail_msg("%s: off by %g", where, run_distance(r.z, problem->z, problem->n));
    run_release(&r);
}

static void test_dense_and_sparse(void **state)
{
    static const int32_t sizes[] = {31, 32, 33, 63, 64, 65, 95, 96, 97, 127, 128, 129, 192};
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER};
    gen_random random;
    size_t s, m;
    int32_t bounds;

    (void)state;
    gen_seed(&random, 81);
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
            gen_lcp problem, sparse;

            gen_problem(&problem, &random, sizes[s], bounds == 1 ? GEN_M : GEN_PD_UNSYMMETRIC,
                        bounds);
            gen_to_csc(&sparse, &problem);
            for (m = 0; m < 3; m++) {
                solve(&problem, &problem.view, methods[m], "dense");
                solve(&problem, &sparse.view, methods[m], "sparse");
            }
            gen_destroy(&sparse);
            gen_destroy(&problem);
        }
}

static void test_beyond_small_sparse(void **state)
{
    static const int32_t sides[] = {19, 20, 21, 24};
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER};
    size_t s, m;

    (void)state;
    for (s = 0; s < 4; s++) {
        gen_lcp problem;

        gen_obstacle_2d(&problem, sides[s]);
        for (m = 0; m < 3; m++)
            solve(&problem, &problem.view, methods[m], "obstacle");
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense_and_sparse),
        cmocka_unit_test(test_beyond_small_sparse),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* Triangles, on which Lemke's path may take 2^n pivots: `auto` solves them nevertheless. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

static const perp_lcp_settings *automatic(void)
{
    static perp_lcp_settings settings;

    settings = run_settings(PERP_LCP_AUTO);
    return &settings;
}

static void solve(run *r, const gen_lcp *problem, const perp_matrix *M)
{
    run_view(r, context, M, problem->q, problem->lower, problem->upper, automatic(), NULL,
             "triangle");
    if (!run_ok(r))
        fail_msg("%s", perp_outcome_text(r->result.outcome));
}

/* Integers and sixteenths below 2^20: all of it is exact but for the divisions, z below 12. */
static void test_known_solutions(void **state)
{
    static const int32_t sizes[] = {1, 2, 7, 17, 40, 100};
    gen_random random;

    (void)state;
    gen_seed(&random, 41);
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (int bounds = 0; bounds < GEN_BOUNDS; bounds++) {
            gen_lcp problem, sparse;
            perp_matrix views[3];

            gen_problem(&problem, &random, sizes[s], GEN_P, bounds);
            gen_to_csc(&sparse, &problem);
            views[0] = problem.view;
            views[1] = sparse.view;
            for (int k = 0; k < 2; k++) {
                run r;

                solve(&r, &problem, &views[k]);
                assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-9);
                run_release(&r);
            }
            gen_destroy(&sparse);
            gen_destroy(&problem);
        }
}

/* Murty's triangle and its transpose, by rows and by columns: Lemke's path has 2^200 pivots. The
 * solution is e_1, that of the transpose e_n. */
static void test_exponential_example(void **state)
{
    enum { N = 200 };
    double *M = check_allocate(N * N, sizeof *M), q[N];

    (void)state;
    for (int i = 0; i < N; i++) {
        q[i] = -1.0;
        for (int j = 0; j <= i; j++)
            M[N * i + j] = i == j ? 1.0 : 2.0;
    }
    for (int k = 0; k < 2; k++) {
        const gen_lcp problem = {.n = N, .q = q};
        perp_matrix view = fresh_matrix();
        run r;

        perp_matrix_dense(&view, k ? PERP_STORAGE_COLUMN_MAJOR : PERP_STORAGE_ROW_MAJOR, N, N, M,
                          N);
        solve(&r, &problem, &view);
        for (int i = 0; i < N; i++)
            assert_true(r.z[i] == (i == (k ? N - 1 : 0) ? 1.0 : 0.0));
        assert_true(r.result.iterations <= 2); /* substitution, whichever way round */
        run_release(&r);
    }
    free(M);
}

/* Nearly triangles: one entry on the other side closes a cycle, or the last row lacks its diagonal.
 */
static void test_what_is_none(void **state)
{
    enum { N = 20 };
    gen_random random;
    gen_lcp problem;
    run r;

    (void)state;
    gen_seed(&random, 42);
    gen_begin_dense(&problem, N);
    for (int32_t i = 0; i < N; i++) {
        problem.q[i] = gen_dyadic(&random, 2);
        for (int32_t j = 0; j <= i; j++)
            problem.M[N * i + j] = i == j ? 4.0 : gen_dyadic(&random, 1);
    }
    solve(&r, &problem, &problem.view);
    run_release(&r);
    problem.M[N * 3 + 17] = 0.5;
    problem.M[N * 17 + 3] = 0.5;
    solve(&r, &problem, &problem.view);
    run_release(&r);
    problem.M[N * 3 + 17] = 0.0;
    problem.M[N * 19 + 19] = 0.0;
    problem.q[N - 1] = 100.0; /* w > 0: z_n = 0 */
    solve(&r, &problem, &problem.view);
    run_release(&r);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_solutions),
        cmocka_unit_test(test_exponential_example),
        cmocka_unit_test(test_what_is_none),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

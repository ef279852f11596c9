/* One unsymmetric M in every storage: row-major, column-major, with a leading dimension, CSC with
 * and without explicit zeros. A matrix read transposed, or a gap that is read, shows here. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* The same matrix once more; `values` is the copy's, NaN wherever no entry lies. */
static double *lay_out(perp_matrix *view, const gen_lcp *problem, int32_t storage, int32_t gap)
{
    int32_t n = problem->n, i, j;
    int64_t ld = n + gap;
    double *values = check_allocate((size_t)(ld * (n + 1)), sizeof *values);

    for (i = 0; i < ld * (n + 1); i++)
        values[i] = NAN;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            values[storage == PERP_STORAGE_ROW_MAJOR ? i * ld + j : i + j * ld] =
                problem->M[i * n + j];
    assert_int_equal(perp_struct_init(view, sizeof *view), PERP_OK);
    assert_int_equal(perp_matrix_dense(view, storage, n, n, values, ld), PERP_OK);
    return values;
}

/* A CSC view that stores every entry, the zeros too. */
static void lay_out_full(gen_lcp *copy, const gen_lcp *problem)
{
    gen_lcp ones = *problem;
    int32_t n = problem->n, p;
    size_t count = (size_t)n * (size_t)n;

    ones.M = check_allocate(count, sizeof(double));
    for (p = 0; p < n * n; p++)
        ones.M[p] = 1.0;
    gen_to_csc(copy, &ones);
    for (p = 0; p < n * n; p++)
        copy->values[p] = problem->M[copy->row_indices[p] * n + p / n];
    free(ones.M);
}

/* Dense storages hold the same numbers and must give the same bits; sparse factorisations order
 * their work otherwise: the solutions are exact to a few roundings of well-conditioned systems
 * (n <= 12, condition numbers below 1e5). */
static void compare(const run *reference, const run *r, int32_t n, int dense, const char *where)
{
    if (reference->result.outcome != r->result.outcome)
        fail_msg("%s: %s, row-major: %s", where, perp_outcome_text(r->result.outcome),
                 perp_outcome_text(reference->result.outcome));
    if (dense && memcmp(reference->z, r->z, (size_t)n * sizeof(double)) != 0)
        fail_msg("%s: differs from row-major by %g", where, run_distance(reference->z, r->z, n));
    if (!(run_distance(reference->z, r->z, n) <= 1e-9))
        fail_msg("%s: differs from row-major by %g", where, run_distance(reference->z, r->z, n));
}

static void check_storages(const gen_lcp *problem, int32_t method, const char *name)
{
    static const int32_t storages[] = {PERP_STORAGE_ROW_MAJOR, PERP_STORAGE_COLUMN_MAJOR};
    perp_lcp_settings settings = run_settings(method);
    gen_lcp sparse, full;
    run reference, r;
    int32_t s, gap;
    char where[96];

    run_lcp(&reference, context, problem, &settings, NULL, name);
    for (s = 0; s < 2; s++)
        for (gap = 0; gap < 4; gap += 3) {
            perp_matrix view;
            double *values = lay_out(&view, problem, storages[s], gap);

            snprintf(where, sizeof where, "%s, storage %d, gap %d, %s", name, (int)s, (int)gap,
                     perp_lcp_method_text(method));
            run_view(&r, context, &view, problem->q, problem->lower, problem->upper, &settings,
                     NULL, where);
            compare(&reference, &r, problem->n, 1, where);
            run_release(&r);
            free(values);
        }
    gen_to_csc(&sparse, problem);
    snprintf(where, sizeof where, "%s, csc, %s", name, perp_lcp_method_text(method));
    run_view(&r, context, &sparse.view, problem->q, problem->lower, problem->upper, &settings, NULL,
             where);
    compare(&reference, &r, problem->n, 0, where);
    run_release(&r);
    gen_destroy(&sparse);
    lay_out_full(&full, problem);
    snprintf(where, sizeof where, "%s, csc with zeros, %s", name, perp_lcp_method_text(method));
    run_view(&r, context, &full.view, problem->q, problem->lower, problem->upper, &settings, NULL,
             where);
    compare(&reference, &r, problem->n, 0, where);
    run_release(&r);
    gen_destroy(&full);
    run_release(&reference);
}

/* (0, 1) solves it as written; transposed it would be (1, 0). */
static void test_two_by_two(void **state)
{
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS,
                                      PERP_LCP_FISCHER};
    const int M[] = {1, 3, 0, 1}, q[] = {-1, -1};
    gen_lcp problem;
    size_t m;

    (void)state;
    gen_from_integers(&problem, 2, M, q);
    for (m = 0; m < 4; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, "2 x 2");
        assert_true(r.z[0] == 0 && r.z[1] == 1);
        run_release(&r);
        check_storages(&problem, methods[m], "2 x 2");
    }
    gen_destroy(&problem);
}

static void test_random(void **state)
{
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_FISCHER,
                                      PERP_LCP_PGS};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 21);
    for (round = 0; round < 300; round++) {
        int class = round % 2 ? GEN_PD_UNSYMMETRIC : GEN_M;
        int32_t method = methods[round / 2 % (class == GEN_M ? 4 : 3)];
        gen_lcp problem;
        char name[32];

        gen_problem(&problem, &random, 2 + gen_integer(&random, 11), class, round % GEN_BOUNDS);
        snprintf(name, sizeof name, "round %d", round);
        check_storages(&problem, method, name);
        gen_destroy(&problem);
    }
}

/* 2500 unknowns: the sparse path of `auto`, against the solution it was made from. */
static void test_sparse_obstacle(void **state)
{
    static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_FISCHER};
    gen_lcp problem;
    size_t m;

    (void)state;
    gen_obstacle_2d(&problem, 50);
    for (m = 0; m < 2; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        run r;

        run_lcp(&r, context, &problem, &settings, NULL, "obstacle");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        /* condition about 50^2, |z| below 20, a refined solve: far below 1e-10 */
        assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-10);
        run_release(&r);
    }
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_by_two),
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_sparse_obstacle),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

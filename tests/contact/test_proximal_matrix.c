/* Method `proximal` by its inner interface: closed forms, random scenes checked from the law
 * itself, and everything a Delassus matrix may be: dense, sparse, unsymmetric, rank-deficient. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "proximal_scene.h"

#include "context.h"

static void solve(proximal_scene *s)
{
    perp__matrix W = {s->size, s->size, 1, (size_t)s->size, s->W, NULL, NULL};
    perp__contact_problem p = proximal_problem_of(context, s, &W);

    assert_int_equal(proximal_run(&p, s), PERP_OK);
    assert_int_equal(s->outcome, PERP_OUTCOME_SOLVED);
}

static void solve_sparse(proximal_scene *s)
{
    static proximal_columns c;
    perp__contact_problem p = proximal_problem_of(context, s, &c.view);

    proximal_compress(s, &c);
    assert_int_equal(proximal_run(&p, s), PERP_OK);
    assert_int_equal(s->outcome, PERP_OUTCOME_SOLVED);
}

/* One particle of mass 1/2 on a plane, W = 2 I: u = 2 r + q in every mode. The method is content
 * with a tested residual of 1e-15, which is 1e-14 of these q, and mu up to 2.5 multiplies it. */
static void test_one_particle_in_every_mode(void **state)
{
    static const struct {
        double mu, q[3], r[3];
    } cases[] = {
        {0.5, {1.0, 3.0, 4.0}, {0.0, 0.0, 0.0}},
        {0.5, {-2.0, 0.3, -0.4}, {1.0, -0.15, 0.2}},
        /* r_n = 1, r_t = -mu q_t / |q_t| */
        {0.5, {-2.0, 3.0, 4.0}, {1.0, -0.3, -0.4}},
        {2.5, {-2.0, -6.0, 8.0}, {1.0, 1.5, -2.0}},
    };

    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        proximal_scene s;

        memset(&s, 0, sizeof s);
        proximal_add_contact(&s, 3, cases[k].mu);
        for (int32_t i = 0; i < 3; i++) {
            s.W[4 * i] = 2.0;
            s.q[i] = cases[k].q[i];
        }
        proximal_set_traces(&s);
        solve(&s);
        for (int32_t i = 0; i < 3; i++)
            assert_true(fabs(s.r[i] - cases[k].r[i]) <= 1e-13);
    }
}

/* A product of two numbers of size up to a few hundred and of the solution's 1e-13 stays below
 * 1e-10. */
#define LAW 1e-10

static void test_laws_hold_on_random_problems(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 11);
    for (int trial = 0; trial < 200; trial++) {
        proximal_scene s;

        proximal_random_scene(&s, &random, 8, 1.0, 6 + trial % 12);
        solve(&s);
        assert_true(proximal_violation(&s) <= LAW);
    }
}

/* The second attempt by itself, many steps from where it is. Some may be lost, but rarely.
 * Coefficients up to 100 make impulses of that size more. */
static void test_second_attempt(void **state)
{
    int lost = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 12);
    for (int trial = 0; trial < 60; trial++) {
        proximal_scene s;
        perp__matrix W = {0, 0, 1, 0, s.W, NULL, NULL};
        perp__contact_problem p;

        proximal_random_scene(&s, &random, 6, trial % 2 ? 1.0 : 100.0, 6 + trial % 12);
        for (int32_t k = 0; k < s.contacts; k++)
            s.q[s.starts[k]] += 0.25; /* v = 0 becomes strictly admissible */
        W.rows = W.columns = s.size;
        W.column_stride = (size_t)s.size;
        p = proximal_problem_of(context, &s, &W);
        s.first = s.last = 1;
        assert_int_equal(proximal_run(&p, &s), PERP_OK);
        lost += s.outcome != PERP_OUTCOME_SOLVED;
        if (s.outcome == PERP_OUTCOME_SOLVED)
            assert_true(proximal_violation(&s) <= 100.0 * LAW);
    }
    assert_true(20 * lost <= 60);
}

/* Contacts that share nothing are problems by themselves; as a sparse matrix, and as a dense one.
 * Where the solution is unique (a definite matrix and little friction) the two agree. */
static void test_sparse_is_dense(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 13);
    for (int trial = 0; trial < 50; trial++) {
        proximal_scene s, t;

        proximal_random_scene(&s, &random, 8, 0.1, PROXIMAL_ROWS);
        for (int32_t i = 0; i < s.size; i++)
            for (int32_t j = 0; j < s.size; j++)
                if ((i + j) % 3 && abs(i - j) > 3)
                    s.W[j * s.size + i] = 0.0;
        for (int32_t i = 0; i < s.size; i++)
            s.W[i * s.size + i] += 40.0;
        proximal_set_traces(&s);
        t = s;
        solve(&s);
        solve_sparse(&t);
        assert_true(proximal_violation(&s) <= LAW);
        for (int32_t i = 0; i < s.size; i++)
            assert_true(fabs(s.r[i] - t.r[i]) <= 1e-12);
    }
}

/* W as it is, not its symmetric part: the laws are checked with the unsymmetric one. */
static void test_unsymmetric_matrix_is_used_as_given(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 14);
    for (int trial = 0; trial < 50; trial++) {
        proximal_scene s;

        proximal_random_scene(&s, &random, 5, 0.5, PROXIMAL_ROWS);
        for (int32_t i = 0; i < s.size * s.size; i++)
            s.W[i] *= 1.0 + 1e-3 * gen_dyadic(&random, 1);
        proximal_set_traces(&s);
        solve(&s);
        assert_true(proximal_violation(&s) <= LAW);
    }
}

/* Tangents turned in the plane turn the impulses and nothing else; unique, as above. */
static void test_isotropic(void **state)
{
    gen_random random;
    const double c = 0.6, sine = 0.8;

    (void)state;
    gen_seed(&random, 15);
    for (int trial = 0; trial < 20; trial++) {
        double Q[PROXIMAL_ROWS][PROXIMAL_ROWS] = {{0.0}}, r[PROXIMAL_ROWS] = {0.0};
        proximal_scene s, t;

        memset(&s, 0, sizeof s);
        for (int k = 0; k < 4; k++)
            proximal_add_contact(&s, 3, 0.2);
        proximal_random_delassus(&s, &random, PROXIMAL_ROWS);
        for (int32_t i = 0; i < s.size; i++)
            s.W[i * s.size + i] += 20.0;
        t = s;
        for (int32_t k = 0; k < s.rows; k += 3) {
            Q[k][k] = 1.0;
            Q[k + 1][k + 1] = Q[k + 2][k + 2] = c;
            Q[k + 1][k + 2] = -sine;
            Q[k + 2][k + 1] = sine;
        }
        for (int32_t i = 0; i < s.size; i++) {
            t.q[i] = 0.0;
            for (int32_t j = 0; j < s.size; j++) {
                t.q[i] += Q[i][j] * s.q[j];
                t.W[j * s.size + i] = 0.0;
                for (int32_t k = 0; k < s.size; k++)
                    for (int32_t l = 0; l < s.size; l++)
                        t.W[j * s.size + i] += Q[i][k] * proximal_entry(&s, k, l) * Q[j][l];
            }
        }
        proximal_set_traces(&s);
        proximal_set_traces(&t);
        solve(&s);
        solve(&t);
        for (int32_t i = 0; i < s.size; i++)
            for (int32_t j = 0; j < s.size; j++)
                r[i] += Q[i][j] * s.r[j];
        for (int32_t i = 0; i < s.size; i++)
            assert_true(fabs(r[i] - t.r[i]) <= 1e-13);
    }
}

/* From the solution itself, and from that of a neighbour: few factorisations, the same laws. */
static void test_warm_start_saves_steps(void **state)
{
    int64_t cold = 0, warm = 0, same = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 16);
    for (int trial = 0; trial < 50; trial++) {
        proximal_scene s;

        proximal_random_scene(&s, &random, 8, 0.5, 12);
        solve(&s);
        cold += s.iterations;
        s.warm = 1;
        solve(&s);
        same += s.iterations;
        for (int32_t k = 0; k < s.contacts; k++)
            s.q[s.starts[k]] *= 1.001;
        solve(&s);
        warm += s.iterations;
        assert_true(proximal_violation(&s) <= LAW);
    }
    assert_true(3 * warm < 2 * cold);
    assert_true(same <= warm);
}

static void test_same_bits_again(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 17);
    for (int trial = 0; trial < 20; trial++) {
        proximal_scene s, t;

        proximal_random_scene(&s, &random, 6, 1.0, 9);
        t = s;
        solve_sparse(&s);
        solve_sparse(&t);
        assert_memory_equal(s.r, t.r, (size_t)s.size * sizeof *s.r);
    }
}

static int32_t stop_at_three(void *user, int64_t iterations, double residual)
{
    (void)user;
    (void)residual;
    return iterations >= 3;
}

static void test_limits_and_monitor_stop_it(void **state)
{
    perp__contact_control control = {0.0, stop_at_three, NULL};
    gen_random random;
    proximal_scene s;
    perp__matrix W = {0, 0, 1, 0, s.W, NULL, NULL};
    perp__contact_problem p;

    (void)state;
    gen_seed(&random, 18);
    proximal_random_scene(&s, &random, 8, 0.5, 12);
    W.rows = W.columns = s.size;
    W.column_stride = (size_t)s.size;
    p = proximal_problem_of(context, &s, &W);
    p.tol = 1e-30; /* which nothing comes to */
    p.control = &control;
    s.last = 1;
    s.first = 1;
    assert_int_equal(proximal_run(&p, &s), PERP_OK);
    assert_int_equal(s.outcome, PERP_OUTCOME_STOPPED);
    assert_true(s.iterations >= 3);
    p.control = NULL;
    p.iteration_limit = 2;
    assert_int_equal(proximal_run(&p, &s), PERP_OK);
    assert_int_equal(s.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_int_equal(s.iterations, 2);
}

/* Every allocation fails once: an error status, nothing kept, and the next try succeeds. */
static void test_memory_runs_out(void **state)
{
    memory m = {0};
    perp_context_settings settings = memory_settings(&m);
    static proximal_columns c;
    gen_random random;
    proximal_scene s;
    perp__contact_problem p;
    perp_status status = PERP_ERROR_MEMORY;
    int failures = 0;

    (void)state;
    gen_seed(&random, 19);
    proximal_random_scene(&s, &random, 4, 0.5, 9);
    proximal_compress(&s, &c);
    p = proximal_problem_of(context, &s, &c.view);
    assert_int_equal(perp_context_create(&p.context, &settings), PERP_OK);
    while (status != PERP_OK) {
        int before = m.live;

        m.fails_at = m.calls + failures + 1;
        status = proximal_run(&p, &s);
        assert_int_equal(m.live, before);
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            failures++;
        }
    }
    assert_true(failures >= 3);
    perp_context_destroy(p.context);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_one_particle_in_every_mode, make, destroy),
        cmocka_unit_test_setup_teardown(test_laws_hold_on_random_problems, make, destroy),
        cmocka_unit_test_setup_teardown(test_second_attempt, make, destroy),
        cmocka_unit_test_setup_teardown(test_sparse_is_dense, make, destroy),
        cmocka_unit_test_setup_teardown(test_unsymmetric_matrix_is_used_as_given, make, destroy),
        cmocka_unit_test_setup_teardown(test_isotropic, make, destroy),
        cmocka_unit_test_setup_teardown(test_warm_start_saves_steps, make, destroy),
        cmocka_unit_test_setup_teardown(test_same_bits_again, make, destroy),
        cmocka_unit_test_setup_teardown(test_limits_and_monitor_stop_it, make, destroy),
        cmocka_unit_test(test_memory_runs_out),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

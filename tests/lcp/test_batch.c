/* perp_lcp_batch against the ordinary solver, problem by problem, and against known solutions;
 * every instruction set and any number of threads give the same bits. Numbers of every size:
 * test_batch_hostile.c. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "batch_many.h"
#include "memory.h"

/* Random problems of every class of tests/gen.h with a unique solution. */
static void create(many *p, int32_t n, uint64_t seed, int bounds)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_P, GEN_M};
    const size_t size = (size_t)n;
    gen_random random;
    size_t k, i;

    allocate(p, n);
    gen_seed(&random, seed);
    for (k = 0; k < COUNT; k++) {
        gen_lcp one;

        gen_problem(&one, &random, n, classes[k % 4], bounds);
        memcpy(p->M + k * size * size, one.M, size * size * sizeof(double));
        memcpy(p->q + k * size, one.q, size * sizeof(double));
        memcpy(p->known + k * size, one.z, size * sizeof(double));
        for (i = 0; i < size; i++) {
            p->lower[k * size + i] = one.lower ? one.lower[i] : 0.0;
            p->upper[k * size + i] = one.upper ? one.upper[i] : INFINITY;
        }
        gen_destroy(&one);
    }
}

/* Everything about problem k is checked from its own data; z is within 1e-8 of the exact solution:
 * conditions stay below 1e6, see test_front_door.c. */
static void check_answers(const many *p, const char *where)
{
    const size_t size = (size_t)p->n;
    size_t k;

    for (k = 0; k < COUNT; k++) {
        const perp_matrix M = run_dense(p->M + k * size * size, p->n);
        const check_lcp problem = {&M, p->q + k * size, p->lower + k * size, p->upper + k * size,
                                   1};
        check_measures measures;

        check_measure(&measures, &problem, p->z + k * size, p->w + k * size);
        if (p->outcomes[k] != PERP_OUTCOME_SOLVED || !(p->residuals[k] <= 1e-10))
            fail_msg("%s: problem %d: %s", where, (int)k, perp_outcome_text(p->outcomes[k]));
        /* the two residuals are of one z: they differ by what doubled precision leaves */
        assert_true(fabs(measures.residual - p->residuals[k]) <=
                    1e-3 * measures.residual + measures.noise);
        assert_true(measures.violation == 0.0);
        assert_true(measures.w_error <= 1.0);
        if (!(run_distance(p->z + k * size, p->known + k * size, p->n) <= 1e-8))
            fail_msg("%s: problem %d is off", where, (int)k);
    }
}

static void test_random_problems(void **state)
{
    static const int32_t sizes[] = {1, 2, 3, 7, 12, 32, 33};
    size_t s;
    int bounds;

    (void)state;
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
            char where[64];
            many p;

            snprintf(where, sizeof where, "n = %d, bounds %d", (int)sizes[s], bounds);
            create(&p, sizes[s], 100 + s, bounds);
            assert_int_equal(solve(&p, NULL, 1), PERP_OK);
            check_answers(&p, where);
            release(&p);
        }
}

static void test_threads_change_no_bit(void **state)
{
    const size_t bytes = COUNT * N * sizeof(double);
    int32_t threads;
    many p;

    (void)state;
    create(&p, N, 5, GEN_MIXED);
    assert_int_equal(solve(&p, NULL, 1), PERP_OK);
    for (threads = 2; threads < 9; threads += 3) {
        double *z = check_allocate(COUNT * N, sizeof(double));

        memcpy(z, p.z, bytes);
        memset(p.z, 0, bytes);
        assert_int_equal(solve(&p, NULL, threads), PERP_OK);
        assert_memory_equal(z, p.z, bytes);
        free(z);
    }
    release(&p);
}

/* The kernels of every instruction set, on the same problems. */
static void test_instruction_sets_change_no_bit(void **state)
{
    const perp__batch_kernel *kernel;
    perp__batch_data data;
    double *first = check_allocate(COUNT * N, sizeof(double));
    int32_t number;
    many p;

    (void)state;
    create(&p, N, 6, GEN_BOXED);
    data = data_of(&p);
    for (number = 0; (kernel = perp__batch_kernel_number(number)) != NULL; number++) {
        perp__batch_group group;
        perp__arena arena;
        int64_t at, lane, i;

        open_group(&group, &arena, &p, kernel);
        for (at = 0; at < COUNT; at += kernel->width) {
            int32_t takes[8];

            perp__batch_group_read(&group, &data, at, takes);
            kernel->solve(&group);
            for (lane = 0; lane < kernel->width && at + lane < COUNT; lane++)
                for (i = 0; i < N; i++) {
                    double z = group.z[i * kernel->width + lane];

                    if (number == 0)
                        first[(at + lane) * N + i] = z;
                    assert_memory_equal(&first[(at + lane) * N + i], &z, sizeof z);
                }
        }
        perp__arena_release(&arena);
    }
    assert_true(number >= 1);
    free(first);
    release(&p);
}

/* Contact problems have zeros on the diagonal, and some of these have no solution at all: every one
 * of them goes to a solver of its own and must come back with exactly its answer. */
static void test_what_the_kernel_cannot_take(void **state)
{
    static const gen_contact_options options = {2, 2, 4, 10, 0.5, 0, 0};
    gen_random random;
    many p;
    size_t k;

    (void)state;
    allocate(&p, N);
    gen_seed(&random, 8);
    for (k = 0; k < COUNT; k++) {
        gen_lcp one;
        size_t i;

        gen_contact(&one, &random, &options);
        assert_int_equal(one.n, N);
        memcpy(p.M + k * N * N, one.M, N * N * sizeof(double));
        memcpy(p.q + k * N, one.q, N * sizeof(double));
        for (i = 0; i < N; i++)
            p.upper[k * N + i] = INFINITY;
        if (k % 7 == 0) { /* 0 z_0 - 1 >= 0 cannot be */
            memset(p.M + k * N * N, 0, N * sizeof(double));
            p.q[k * N] = -1.0;
        }
        gen_destroy(&one);
    }
    assert_int_equal(solve(&p, NULL, 2), PERP_OK);
    for (k = 0; k < COUNT; k++) {
        const perp_matrix M = run_dense(p.M + k * N * N, N);
        run r;

        run_view(&r, context, &M, p.q + k * N, NULL, NULL, NULL, NULL, "contact");
        assert_int_equal(r.result.outcome, p.outcomes[k]);
        assert_int_equal(r.result.outcome == PERP_OUTCOME_SOLVED, k % 7 != 0);
        assert_memory_equal(r.z, p.z + k * N, N * sizeof(double));
        run_release(&r);
    }
    release(&p);
}

static void refuse(many *p, perp_status expected, const char *name, int32_t threads, int64_t count,
                   int32_t n)
{
    const size_t bytes = COUNT * N * sizeof(double);
    double *before = check_allocate(COUNT * N, sizeof(double));

    memcpy(before, p->z, bytes);
    assert_int_equal(perp_lcp_batch(context, p->z, p->w, p->outcomes, p->residuals, NULL, threads,
                                    LCP_STACK(count, n, p->M, p->q, p->lower, p->upper)),
                     expected);
    if (!strstr(perp_context_message(context), name))
        fail_msg("'%s' does not name '%s'", perp_context_message(context), name);
    assert_memory_equal(before, p->z, bytes);
    free(before);
}

static void test_refusals(void **state)
{
    double *kept;
    many p;

    (void)state;
    create(&p, N, 9, GEN_BOXED);
    refuse(&p, PERP_ERROR_ARGUMENT, "threads is 0", 0, COUNT, N);
    refuse(&p, PERP_ERROR_ARGUMENT, "threads is 257", 257, COUNT, N);
    refuse(&p, PERP_ERROR_ARGUMENT, "count is -1", 1, -1, N);
    refuse(&p, PERP_ERROR_ARGUMENT, "n is -3", 1, COUNT, -3);
    refuse(&p, PERP_ERROR_ARGUMENT, "count", 1, INT64_MAX, N);
    p.M[5 * N * N + 17] = NAN;
    refuse(&p, PERP_ERROR_NOT_FINITE, "M[737]", 1, COUNT, N);
    refuse(&p, PERP_ERROR_NOT_FINITE, "M[737]", 3, COUNT, N);
    p.M[5 * N * N + 17] = 0.0;
    p.q[9 * N + 4] = INFINITY;
    refuse(&p, PERP_ERROR_NOT_FINITE, "q[112]", 1, COUNT, N);
    p.q[9 * N + 4] = 0.0;
    p.lower[30] = p.upper[30] + 1.0;
    refuse(&p, PERP_ERROR_ARGUMENT, "[30]", 1, COUNT, N);
    p.lower[30] = p.upper[30];
    kept = p.M;
    p.M = NULL;
    refuse(&p, PERP_ERROR_ARGUMENT, "M", 1, COUNT, N);
    p.M = kept;
    assert_int_equal(solve(&p, NULL, 1), PERP_OK); /* the context is as good as before */
    assert_int_equal(perp_lcp_batch(NULL, p.z, NULL, NULL, NULL, NULL, 1,
                                    LCP_STACK(COUNT, N, p.M, p.q, NULL, NULL)),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_batch(context, NULL, NULL, NULL, NULL, NULL, 1,
                                    LCP_STACK(0, N, NULL, NULL, NULL, NULL)),
                     PERP_OK);
    release(&p);
}

/* Problems for the kernel and for a solver of its own, so that every allocation is met. */
static void test_memory_failures(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_context *poor = NULL;
    int calls = 1, k;
    many p;

    (void)state;
    create(&p, N, 11, GEN_BOXED);
    memset(p.M + 3 * N * N, 0, N * sizeof(double)); /* problem 3: a zero on the diagonal */
    for (k = 0; k <= calls; k++) {
        perp_status status;
        size_t i;

        m.calls = m.live = m.fails_at = 0;
        assert_int_equal(perp_context_create(&poor, &settings), PERP_OK);
        for (i = 0; i < COUNT * N; i++)
            p.z[i] = 42.0;
        m.calls = 0;
        m.fails_at = k;
        status = perp_lcp_batch(poor, p.z, p.w, p.outcomes, p.residuals, NULL, 2,
                                LCP_STACK(COUNT, N, p.M, p.q, p.lower, p.upper));
        if (k == 0) {
            assert_int_equal(status, PERP_OK);
            calls = m.calls;
        } else {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_true(strlen(perp_context_message(poor)) > 0);
            for (i = 0; i < COUNT * N; i++)
                assert_true(p.z[i] == 42.0);
        }
        assert_int_equal(m.live, 1); /* the context */
        perp_context_destroy(poor);
    }
    assert_true(calls >= 5);
    release(&p);
}

static void test_a_time_limit(void **state)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
    size_t k;
    many p;

    (void)state;
    create(&p, N, 10, GEN_BOXED);
    settings.time_limit = 1e-12; /* over before it begins */
    assert_int_equal(solve(&p, &settings, 1), PERP_OK);
    for (k = 0; k < COUNT; k++)
        assert_int_equal(p.outcomes[k], PERP_OUTCOME_TIME_LIMIT);
    for (k = 0; k < COUNT * N; k++)
        assert_true(p.z[k] >= p.lower[k] && p.z[k] <= p.upper[k]);
    release(&p);
}

/* A problem solved alone gets what is left of the call's time, not all the time in the world:
 * sweeps over second differences in 400 points take 1e5 of them, 5 us each at the least, for a
 * digit or two; they get 1 ms. */
static void test_a_time_limit_for_those_solved_alone(void **state)
{
    enum { LONG = 400 };
    double *M = check_allocate(LONG * LONG, sizeof *M), q[LONG], z[LONG], residual;
    perp_lcp_settings settings = run_settings(PERP_LCP_PGS);
    int32_t outcome, i;

    (void)state;
    for (i = 0; i < LONG; i++) {
        M[i * (LONG + 1)] = 2.0;
        if (i > 0)
            M[i * LONG + i - 1] = M[(i - 1) * LONG + i] = -1.0;
        q[i] = -1.0;
    }
    settings.time_limit = 1e-3;
    settings.max_iterations = 2000000000;
    settings.tol = 1e-300;
    settings.polish = 0;
    assert_int_equal(perp_lcp_batch(context, z, NULL, &outcome, &residual, &settings, 1,
                                    LCP_STACK(1, LONG, M, q, NULL, NULL)),
                     PERP_OK);
    assert_int_equal(outcome, PERP_OUTCOME_TIME_LIMIT);
    free(M);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_problems),
        cmocka_unit_test(test_threads_change_no_bit),
        cmocka_unit_test(test_instruction_sets_change_no_bit),
        cmocka_unit_test(test_what_the_kernel_cannot_take),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory_failures),
        cmocka_unit_test(test_a_time_limit),
        cmocka_unit_test(test_a_time_limit_for_those_solved_alone),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}

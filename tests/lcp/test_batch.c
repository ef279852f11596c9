/* perp_lcp_batch against the ordinary solver, problem by problem, and against known solutions;
 * every instruction set and any number of threads give the same bits. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "lcp/batch_group.h"
#include "memory.h"
#include "run.h"

enum { N = 12, COUNT = 203 }; /* 203: not a multiple of any vector's width */

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

typedef struct many {
    int32_t n;
    double *M, *q, *lower, *upper, *known; /* known: exact solutions */
    double *z, *w, *residuals;
    int32_t *outcomes;
} many;

static void allocate(many *p, int32_t n)
{
    const size_t all = (size_t)COUNT * (size_t)n;

    p->n = n;
    p->M = check_allocate(all * (size_t)n, sizeof(double));
    p->q = check_allocate(all, sizeof(double));
    p->lower = check_allocate(all, sizeof(double));
    p->upper = check_allocate(all, sizeof(double));
    p->known = check_allocate(all, sizeof(double));
    p->z = check_allocate(all, sizeof(double));
    p->w = check_allocate(all, sizeof(double));
    p->residuals = check_allocate(COUNT, sizeof(double));
    p->outcomes = check_allocate(COUNT, sizeof(int32_t));
}

static void release(many *p)
{
    free(p->M);
    free(p->q);
    free(p->lower);
    free(p->upper);
    free(p->known);
    free(p->z);
    free(p->w);
    free(p->residuals);
    free(p->outcomes);
}

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

static perp_status solve(many *p, const perp_lcp_settings *settings, int32_t threads)
{
    return perp_lcp_batch(context, p->z, p->w, p->outcomes, p->residuals, settings, threads, COUNT,
                          p->n, p->M, p->q, p->lower, p->upper);
}

/* Everything about problem k is checked from its own data; z is within 1e-8 of the exact solution:
 * conditions stay below 1e6, see test_front_door.c. */
static void check_answers(const many *p, const char *where)
{
    const size_t size = (size_t)p->n;
    size_t k;

    for (k = 0; k < COUNT; k++) {
        perp_matrix M;
        perp_lcp_result result;
        check_measures measures;
        check_lcp problem;

        perp_matrix_init(&M, sizeof M);
        perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, p->n, p->n, p->M + k * size * size, p->n);
        problem.M = &M;
        problem.q = p->q + k * size;
        problem.lower = p->lower + k * size;
        problem.upper = p->upper + k * size;
        problem.scaling = 1;
        (void)result;
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
    perp__batch_data data;
    const perp__batch_kernel *kernel;
    double *first = check_allocate(COUNT * N, sizeof(double));
    int32_t number;
    many p;

    (void)state;
    create(&p, N, 6, GEN_BOXED);
    memset(&data, 0, sizeof data);
    data.count = COUNT;
    data.n = N;
    data.scaling = 1;
    data.M = p.M;
    data.q = p.q;
    data.lower = p.lower;
    data.upper = p.upper;
    for (number = 0; (kernel = perp__batch_kernel_number(number)) != NULL; number++) {
        perp__batch_group group;
        perp__arena arena;
        int64_t at, lane, i;

        memset(&group, 0, sizeof group);
        group.n = N;
        group.width = kernel->width;
        perp__arena_init(&arena, context);
        assert_int_equal(perp__arena_fit(&arena, perp__batch_group_layout, &group), PERP_OK);
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
        perp_matrix M;
        run r;

        perp_matrix_init(&M, sizeof M);
        perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, N, N, p.M + k * N * N, N);
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
                                    count, n, p->M, p->q, p->lower, p->upper),
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
    assert_int_equal(
        perp_lcp_batch(NULL, p.z, NULL, NULL, NULL, NULL, 1, COUNT, N, p.M, p.q, NULL, NULL),
        PERP_ERROR_HANDLE);
    assert_int_equal(
        perp_lcp_batch(context, NULL, NULL, NULL, NULL, NULL, 1, 0, N, NULL, NULL, NULL, NULL),
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
        status = perp_lcp_batch(poor, p.z, p.w, p.outcomes, p.residuals, NULL, 2, COUNT, N, p.M,
                                p.q, p.lower, p.upper);
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
    };
    return cmocka_run_group_tests(tests, make, destroy);
}

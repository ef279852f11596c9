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

#include "lcp/batch/group.h"
#include "memory.h"
#include "run.h"

#include "context.h"

enum { N = 12, COUNT = 203 }; /* 203: not a multiple of any vector's width */

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
        memset(&arena, 0, sizeof arena);
        assert_int_equal(perp__arena_fit(&arena, context, perp__batch_group_layout, &group),
                         PERP_OK);
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

/* ---- numbers of every size ------------------------------------------------------------------- */

/* Many lanes are left to the kernel: a positive diagonal of moderate size more often than not. */
static double hostile(gen_random *random, int moderate)
{
    static const double sizes[] = {0.0,    4.9e-324, 1e-310, 2.3e-308, 1e-300,
                                   1e-100, 1e-30,    1e-16,  1e-12,    1e-8,
                                   0.5,    1.0,      3.0,    1e3,      1e8,
                                   1e12,   1e30,     1e100,  1e300,    1.7976931348623157e308};
    const int first = moderate ? 8 : 0, count = moderate ? 7 : 20;
    const double size = sizes[first + (int)(gen_uniform(random, 0.0, 1.0) * count) % count];

    return gen_uniform(random, -1.0, 1.0) < 0.0 ? -size : size;
}

/* Of three problems one is of moderate numbers, one of all sizes, one has a moderate matrix that
 * may fall into parts. Of three pairs of bounds one is 0 and inf. */
static void create_hostile(many *p, int32_t n, uint64_t seed, int all_sizes)
{
    const size_t size = (size_t)n;
    gen_random random;
    size_t k, i;

    allocate(p, n);
    gen_seed(&random, seed);
    for (k = 0; k < COUNT; k++) {
        for (i = 0; i < size * size; i++)
            p->M[k * size * size + i] = gen_uniform(&random, 0.0, 1.0) < 0.4
                                            ? 0.0
                                            : hostile(&random, !all_sizes || k % 3 != 1);
        for (i = 0; i < size; i++) {
            double *diagonal = &p->M[k * size * size + i * (size + 1)];
            const double a = hostile(&random, !all_sizes),
                         b = hostile(&random, !all_sizes || k % 3 == 0);
            const int kind = (int)gen_uniform(&random, 0.0, 9.0);

            *diagonal = k % 3 == 1 && kind < 2 ? *diagonal : fabs(*diagonal) + 1e-3;
            p->q[k * size + i] = hostile(&random, !all_sizes || k % 3 != 1);
            p->lower[k * size + i] = kind < 4 ? 0.0 : kind == 5 ? -INFINITY : fmin(a, b);
            p->upper[k * size + i] = kind < 4 || kind == 6 ? INFINITY : fmax(a, b);
            if (p->upper[k * size + i] < 0.0 && kind == 5)
                p->upper[k * size + i] = -p->upper[k * size + i];
        }
    }
}

/* The row's violation on the index set that z shows, and the sum of the sizes of its terms. Long
 * doubles: no product of doubles leaves their range, and a sum is good to 1e-18 of its terms. */
static long double violation_of(const many *p, size_t k, size_t i, const double *z,
                                long double *terms)
{
    const size_t n = (size_t)p->n, at = k * n + i;
    long double w = p->q[at];
    size_t j;

    *terms = fabsl(w);
    for (j = 0; j < n; j++) {
        const long double product = (long double)p->M[at * n + j] * z[j];

        w += product;
        *terms += fabsl(product);
    }
    if (p->lower[at] == p->upper[at])
        return 0.0L;
    return z[i] == p->lower[at]   ? fmaxl(-w, 0.0L)
           : z[i] == p->upper[at] ? fmaxl(w, 0.0L)
                                  : fabsl(w);
}

/* The largest |q_j| / sqrt(M_jj) of the rows that hang together with row i through entries that are
 * not 0. */
static long double unit_of_part(const many *p, size_t k, size_t i)
{
    const size_t n = (size_t)p->n;
    const double *M = p->M + k * n * n;
    int member[N] = {0}, changed = 1;
    long double largest = 0.0L;
    size_t a, b;

    for (member[i] = 1; changed;)
        for (changed = 0, a = 0; a < n; a++)
            for (b = 0; b < n; b++)
                if (member[a] && !member[b] && (M[a * n + b] != 0.0 || M[b * n + a] != 0.0))
                    changed = member[b] = 1;
    for (a = 0; a < n; a++)
        if (member[a])
            largest = fmaxl(largest, fabsl(p->q[k * n + a]) / sqrtl(M[a * n + a]));
    return largest;
}

/* What the kernel would have accepted is a solution in each row beside its own terms, and in each
 * part beside its own q. Powers of two in place of sqrt(M_ii) and max |q|: factors of up to 2 each
 * on both sides, 8 together. */
static int check_lane(const many *p, size_t k, const double *z, const double *w)
{
    const size_t n = (size_t)p->n;
    size_t i;

    for (i = 0; i < n; i++) {
        const double l = p->lower[k * n + i], u = p->upper[k * n + i];
        long double terms, violation;

        assert_true(isfinite(z[i]) && isfinite(w[i]) && z[i] >= l && z[i] <= u);
        violation = violation_of(p, k, i, z, &terms);
        assert_true(violation <= 1e-10L * terms);
        /* or z is as near to a bound, which the residual counts too, as w to 0 */
        if (violation > 0.0L && z[i] - l > 0.0 && u - z[i] > 0.0)
            assert_true(violation / sqrtl(p->M[(k * n + i) * n + i]) <=
                        8e-10L * unit_of_part(p, k, i));
    }
    return 1;
}

/* The kernel alone, whatever would have become of the lanes that it leaves to a solver. */
static void test_what_the_kernel_accepts(void **state)
{
    const perp__batch_kernel *kernel = perp__batch_kernel_number(0);
    int accepted = 0, round;

    (void)state;
    for (round = 0; round < 120; round++) {
        perp__batch_group group;
        perp__batch_data data;
        perp__arena arena;
        int64_t at, lane;
        many p;

        memset(&group, 0, sizeof group);
        memset(&data, 0, sizeof data);
        create_hostile(&p, 1 + round % 6, 1000 + (uint64_t)round, 1);
        data.count = COUNT;
        data.n = group.n = p.n;
        data.scaling = 1;
        data.M = p.M;
        data.q = p.q;
        data.lower = p.lower;
        data.upper = p.upper;
        group.width = kernel->width;
        memset(&arena, 0, sizeof arena);
        assert_int_equal(perp__arena_fit(&arena, context, perp__batch_group_layout, &group),
                         PERP_OK);
        for (at = 0; at < COUNT; at += kernel->width) {
            int32_t takes[8];

            perp__batch_group_read(&group, &data, at, takes);
            kernel->solve(&group);
            for (lane = 0; lane < kernel->width && at + lane < COUNT; lane++) {
                double z[N], w[N];
                int i;

                for (i = 0; i < p.n; i++) {
                    z[i] = group.z[i * kernel->width + lane];
                    w[i] = group.high[i * kernel->width + lane];
                }
                if (takes[lane] && group.tested[lane] <= 1e-10 && group.own[lane] <= 1e-10)
                    accepted += check_lane(&p, (size_t)(at + lane), z, w);
            }
        }
        perp__arena_release(&arena);
        release(&p);
    }
    assert_true(accepted >= 500); /* the test is about something */
}

/* The same verdict as the front door's on the same problem: good or not, and if not, why. */
static void test_verdicts_are_the_front_doors(void **state)
{
    int round;

    (void)state;
    for (round = 0; round < 30; round++) {
        many p;
        size_t k;

        create_hostile(&p, 1 + round % 6, 2000 + (uint64_t)round, 1);
        assert_int_equal(solve(&p, NULL, 1), PERP_OK);
        for (k = 0; k < COUNT; k++) {
            const size_t n = (size_t)p.n;
            const int good = p.outcomes[k] == PERP_OUTCOME_SOLVED ||
                             p.outcomes[k] == PERP_OUTCOME_ROUNDING_LIMIT;
            perp_lcp_result result;
            perp_matrix M;
            double z[N];
            size_t i;

            perp_matrix_init(&M, sizeof M);
            perp_lcp_result_init(&result, sizeof result);
            perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, p.n, p.n, p.M + k * n * n, p.n);
            assert_int_equal(perp_lcp_solve(context, z, NULL, NULL, &result, NULL, &M, p.q + k * n,
                                            p.lower + k * n, p.upper + k * n, NULL),
                             PERP_OK);
            assert_true(good ? result.outcome == PERP_OUTCOME_SOLVED ||
                                   result.outcome == PERP_OUTCOME_ROUNDING_LIMIT
                             : result.outcome == p.outcomes[k]);
            for (i = 0; good && i < n; i++)
                assert_true(isfinite(p.z[k * n + i]));
        }
        release(&p);
    }
}

/* z_0 and z_1 rest at bounds that overflow with the other's: once 'solved' with z = nan. */
static void test_overflow_is_no_solution(void **state)
{
    const double M[] = {1.0, 0.0, 1.0, 0x1p-16}, q[] = {1.0, 1.0};
    const double lower[] = {-1.7976931348623157e308, -INFINITY};
    const double upper[] = {INFINITY, INFINITY};
    double z[2], residual;
    int32_t outcome;

    (void)state;
    assert_int_equal(
        perp_lcp_batch(context, z, NULL, &outcome, &residual, NULL, 1, 1, 2, M, q, lower, upper),
        PERP_OK);
    /* the solution is (-1, 0) */
    assert_true(outcome != PERP_OUTCOME_SOLVED || (z[0] == -1.0 && z[1] == 0.0));
    assert_true(isfinite(z[0]) && isfinite(z[1]) && !isnan(residual));
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
    assert_int_equal(perp_lcp_batch(context, z, NULL, &outcome, &residual, &settings, 1, 1, LONG, M,
                                    q, NULL, NULL),
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
        cmocka_unit_test(test_what_the_kernel_accepts),
        cmocka_unit_test(test_verdicts_are_the_front_doors),
        cmocka_unit_test(test_overflow_is_no_solution),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}

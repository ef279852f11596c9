/* Factored bases under replaced columns, against the columns themselves. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "linalg/basis.h"
#include "linalg/squares.h"

/* Columns to choose from: unit columns 0 .. n-1, then `others` of any kind. */
typedef struct pool {
    int32_t n, others;
    double *dense; /* n by n + others */
} pool;

static int32_t read_column(const void *user, int32_t column, int32_t *rows, double *values)
{
    const pool *p = user;
    const double *entries = p->dense + (size_t)column * (size_t)p->n;
    int32_t count = 0, i;

    for (i = 0; i < p->n; i++)
        if (entries[i] != 0.0) {
            rows[count] = i;
            values[count++] = entries[i];
        }
    return count;
}

/* Others: sparse with a large entry in row k mod n, a few of them full. */
static pool make_pool(gen_random *random, int32_t n, int32_t others)
{
    pool p = {n, others, NULL};
    int32_t i, k;

    p.dense = check_allocate((size_t)n * (size_t)(n + others) + 1, sizeof(double));
    for (i = 0; i < n; i++)
        p.dense[i + n * i] = 1.0;
    for (k = 0; k < others && n > 0; k++) {
        double *column = p.dense + (size_t)(n + k) * (size_t)n;

        for (i = 0; i < (k % 9 == 4 ? n : 3); i++)
            column[k % 9 == 4 ? i : gen_integer(random, n)] = gen_uniform(random, -1.0, 1.0);
        column[k % n] += k % 2 ? 8.0 : -8.0;
    }
    return p;
}

typedef struct bench {
    pool columns;
    perp__columns source;
    perp__basis basis;
    perp__arena arena;
    int32_t spikes;
    size_t file_entries;
    int32_t *chosen;
} bench;

static void lay_out(perp__arena *arena, void *object)
{
    bench *b = object;
    const size_t n = (size_t)b->columns.n;

    perp__basis_layout(arena, &b->basis, b->columns.n, n * n, b->spikes, b->file_entries);
}

static void open_bench(bench *b, perp_context *of, pool columns, int32_t spikes, size_t entries)
{
    int32_t i;

    memset(b, 0, sizeof *b);
    b->columns = columns;
    b->spikes = spikes;
    b->file_entries = entries;
    b->chosen = check_allocate((size_t)columns.n + 1, sizeof *b->chosen);
    for (i = 0; i < columns.n; i++)
        b->chosen[i] = i;
    perp__arena_init(&b->arena, of);
    assert_int_equal(perp__arena_fit(&b->arena, lay_out, b), PERP_OK);
    b->source.user = &b->columns;
    b->source.read = read_column;
}

static void close_bench(bench *b)
{
    perp__basis_release(&b->basis);
    perp__arena_release(&b->arena);
    free(b->chosen);
    free(b->columns.dense);
}

static perp_status load(bench *b)
{
    return perp__basis_load(&b->basis, b->arena.context, b->columns.n, b->chosen, &b->source);
}

/* Both solves against the chosen columns. */
static void require_solves(bench *b, gen_random *random, double tolerance)
{
    const int32_t n = b->columns.n;
    const size_t bytes = (size_t)n * sizeof(double);
    matrix B = matrix_zero(n);
    double *a = check_allocate(3 * (size_t)n + 1, sizeof *a), *x = a + n, *e = x + n;
    double error;
    int32_t i, k;

    for (k = 0; k < n; k++)
        memcpy(B.dense + (size_t)k * (size_t)n, b->columns.dense + (size_t)b->chosen[k] * (size_t)n,
               bytes);
    for (i = 0; i < n; i++)
        a[i] = e[i] = gen_integer(random, 3) ? 0.0 : gen_normal(random);
    perp__basis_solve(&b->basis, a, x);
    error = backward_error(&B, 0, x, a);
    if (!(error <= tolerance))
        fail_msg("n = %d, %d spikes: backward error %g", (int)n, (int)b->basis.spikes, error);
    perp__basis_solve_transposed(&b->basis, e, x);
    error = backward_error(&B, 1, x, a);
    if (!(error <= tolerance))
        fail_msg("n = %d, %d spikes, transposed: backward error %g", (int)n, (int)b->basis.spikes,
                 error);
    free(a);
    matrix_release(&B);
}

/* Column k of the pool comes in where its spike is largest among positions that may leave. */
static void bring_in(bench *b, int32_t column)
{
    const int32_t n = b->columns.n;
    double *spike = check_allocate((size_t)n, sizeof *spike);
    int32_t r = 0, i;

    perp__basis_solve(&b->basis, b->columns.dense + (size_t)column * (size_t)n, spike);
    for (i = 1; i < n; i++)
        if (fabs(spike[i]) > fabs(spike[r]))
            r = i;
    b->chosen[r] = column;
    if (spike[r] != 0.0)
        perp__basis_replace(&b->basis, r, spike);
    free(spike);
}

/* Products of up to 12 elementary matrices with pivots that are the largest of their spikes: errors
 * grow by a modest factor each; 1e-10 leaves it room and is far from what a wrong entry gives. */
static void test_replacements(void **state)
{
    static const int32_t orders[] = {1, 2, 5, 40, 90};
    gen_random random;
    size_t k;

    (void)state;
    gen_seed(&random, 51);
    for (k = 0; k < sizeof orders / sizeof orders[0]; k++) {
        const int32_t n = orders[k];
        bench b;
        int32_t step, loads = 0;

        open_bench(&b, context, make_pool(&random, n, 3 * n), 12, 8 * (size_t)n);
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(n));
        for (step = 0; step < 60; step++) {
            if (!perp__basis_has_room(&b.basis)) {
                assert_int_equal(load(&b), PERP_OK);
                require_solves(&b, &random, tolerance_of(n));
                loads++;
            }
            bring_in(&b, gen_integer(&random, 4 * n));
            require_solves(&b, &random, 1e-10);
        }
        assert_true(loads > 0);
        close_bench(&b);
    }
}

/* Loaded from other columns than the slacks; the same columns give the same bits, whatever was
 * loaded or replaced before. */
static void test_loads(void **state)
{
    enum { N = 60 };
    gen_random random;
    double a[N], x[N], y[N];
    int32_t kept[N];
    bench b;
    int32_t round, i;

    (void)state;
    gen_seed(&random, 52);
    open_bench(&b, context, make_pool(&random, N, 2 * N), 5, 5 * N);
    for (round = 0; round < 20; round++) {
        for (i = 0; i < N; i++)
            b.chosen[i] = gen_integer(&random, round + 1) ? N + i + N * (i % 2) : i;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
        memcpy(kept, b.chosen, sizeof kept);
        for (i = 0; i < N; i++)
            a[i] = gen_normal(&random);
        perp__basis_solve(&b.basis, a, x);
        bring_in(&b, N + gen_integer(&random, N));
        require_solves(&b, &random, 1e-10);
        for (i = 0; i < N; i++)
            b.chosen[i] = i;
        assert_int_equal(load(&b), PERP_OK);
        perp__basis_solve(&b.basis, a, y);
        assert_memory_equal(a, y, sizeof a); /* the unit matrix */
        assert_true(perp__basis_condition(&b.basis) == 1.0);
        memcpy(b.chosen, kept, sizeof kept);
        assert_int_equal(load(&b), PERP_OK);
        perp__basis_solve(&b.basis, a, y);
        assert_memory_equal(x, y, sizeof x);
    }
    close_bench(&b);
}

/* Two slacks in one row, a column of zeros, two columns that are the same: said to be singular, and
 * what is loaded next is right. */
static void test_singular(void **state)
{
    enum { N = 20 };
    gen_random random;
    bench b;
    int kind;

    (void)state;
    gen_seed(&random, 53);
    open_bench(&b, context, make_pool(&random, N, N), 4, 4 * N);
    memset(b.columns.dense + (size_t)(2 * N - 1) * N, 0, N * sizeof(double));
    for (kind = 0; kind < 4; kind++) {
        int32_t i;

        for (i = 0; i < N; i++)
            b.chosen[i] = kind < 2 ? i : N + i;
        b.chosen[N - 1] = kind == 0 ? 3 : kind == 1 ? 2 * N - 1 : kind == 2 ? N + 4 : 2 * N - 1;
        assert_int_equal(load(&b), PERP__FACTOR_SINGULAR);
        b.chosen[N - 1] = N - 1;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
    }
    close_bench(&b);
}

static void test_order_zero(void **state)
{
    gen_random random;
    bench b;

    (void)state;
    gen_seed(&random, 54);
    open_bench(&b, context, make_pool(&random, 0, 0), 1, 1);
    assert_int_equal(load(&b), PERP_OK);
    perp__basis_solve(&b.basis, NULL, NULL);
    perp__basis_solve_transposed(&b.basis, NULL, NULL);
    assert_true(perp__basis_condition(&b.basis) == 1.0);
    close_bench(&b);
}

/* An allocator that fails at the k-th call and counts what is alive. */
typedef struct failing {
    int32_t calls, fail_at, alive;
} failing;

static void *failing_allocate(size_t size, void *user)
{
    failing *f = user;
    void *pointer;

    if (++f->calls == f->fail_at)
        return NULL;
    pointer = malloc(size);
    f->alive += pointer != NULL;
    return pointer;
}

static void failing_release(void *pointer, void *user)
{
    failing *f = user;

    f->alive -= pointer != NULL;
    free(pointer);
}

/* The first load allocates and may fail, later ones ask for nothing, whatever their kernels. */
static void test_memory(void **state)
{
    enum { N = 30 };
    perp_context_settings settings;
    failing f = {0, 0, 0};
    perp_context *failing_context;
    perp_status status = PERP_ERROR_MEMORY;
    gen_random random;
    bench b;
    int32_t k, i;

    (void)state;
    gen_seed(&random, 55);
    assert_int_equal(perp_context_settings_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = failing_allocate;
    settings.release = failing_release;
    settings.allocator_user = &f;
    assert_int_equal(perp_context_create(&failing_context, &settings), PERP_OK);
    open_bench(&b, failing_context, make_pool(&random, N, N), 4, 4 * N);
    for (k = 1; status != PERP_OK; k++) {
        const int32_t alive = f.alive;

        f.calls = 0;
        f.fail_at = k;
        status = load(&b);
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_int_equal(f.alive, alive);
        }
    }
    assert_true(k > 2);
    f.calls = f.fail_at = 0;
    for (k = 0; k < 10; k++) {
        for (i = 0; i < N; i++)
            b.chosen[i] = gen_integer(&random, 10) < k ? N + i : i;
        assert_int_equal(load(&b), PERP_OK);
        require_solves(&b, &random, tolerance_of(N));
    }
    assert_int_equal(f.calls, 0);
    close_bench(&b);
    perp_context_destroy(failing_context);
    assert_int_equal(f.alive, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_replacements), cmocka_unit_test(test_loads),
        cmocka_unit_test(test_singular),     cmocka_unit_test(test_order_zero),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

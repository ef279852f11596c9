/* Gauss-Seidel sweeps over the sliced matrix against the textbook's double loop. Everything is made
 * of small integers and powers of two, so that every sum is exact in any order and the two have to
 * agree to the last bit, z and residual. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "gen.h"
#include "lcp/pgs/sweep.h"

#include "context.h"

/* ---- a problem and its sweeper --------------------------------------------------------------- */

enum pattern { FULL, RANDOM, BAND, GRID, ARROW, LONG_ROWS, DIAGONAL, PATTERNS };

typedef struct bench {
    gen_lcp dense, sparse;
    perp__matrix own;
    perp__lcp_problem problem;
    perp__arena arena;
    perp__sweeper sweeper;
    double *factors, *step, *lower, *upper, *z;
    double omega;
} bench;

static int has_entry(enum pattern pattern, gen_random *random, int32_t n, int32_t i, int32_t j)
{
    int32_t side = (int32_t)sqrt((double)n), d = abs(i - j);

    switch (pattern) {
    case FULL:
        return 1;
    case RANDOM:
        return gen_integer(random, n) < 5;
    case BAND:
        return d <= 3;
    case GRID:
        return d == side || (d == 1 && (i > j ? i : j) % side != 0);
    case ARROW:
        return i == 0 || j == 0 || i == n - 1;
    case LONG_ROWS:
        return d == 1 || i % 11 == 5;
    default:
        return 0;
    }
}

static void layout(perp__arena *arena, void *object)
{
    bench *b = object;

    perp__sweeper_layout(arena, &b->sweeper, &b->problem);
}

static perp__matrix view(const gen_lcp *problem)
{
    perp__matrix M;

    memset(&M, 0, sizeof M);
    M.rows = M.columns = problem->n;
    if (problem->column_starts) {
        M.values = problem->values;
        M.column_starts = problem->column_starts;
        M.row_indices = problem->row_indices;
    } else {
        M.values = problem->M;
        M.row_stride = (size_t)problem->n;
        M.column_stride = 1;
    }
    return M;
}

static double *numbers(int32_t n)
{
    return calloc((size_t)n + 1, sizeof(double));
}

/* Numbers stay small: a row without an upper bound has no negative entry, so that neighbours above
 * their lower bounds keep it down; a single row has no lower bound. */
static void fill(bench *b, gen_random *random, enum pattern pattern, int32_t n)
{
    int *M = calloc((size_t)n * (size_t)n + 1, sizeof *M), *q = calloc((size_t)n + 1, sizeof *q);
    int32_t open = gen_integer(random, 20), bottomless = gen_integer(random, n);

    for (int32_t i = 0; i < n; i++) {
        b->factors[i] = gen_integer(random, 2) ? 1.0 : 0.5;
        b->z[i] = gen_integer(random, 9) - 4.0;
        b->lower[i] = i == bottomless ? -INFINITY : -2.0;
        b->upper[i] = i < open ? INFINITY : gen_integer(random, 5) ? 3.0 : -2.0;
        for (int32_t j = 0; j < n; j++)
            if (has_entry(pattern, random, n, i, j))
                M[i * n + j] = (int)gen_integer(random, 7) - (i < open ? 0 : 3);
        M[i * n + i] = 1;
        q[i] = (int)gen_integer(random, 21) - 10;
    }
    gen_from_integers(&b->dense, n, M, q);
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j < n; j++)
            b->dense.M[i * n + j] *= b->factors[i] * b->factors[j];
    gen_to_csc(&b->sparse, &b->dense);
    free(M);
    free(q);
}

static void create(bench *b, gen_random *random, enum pattern pattern, int32_t n, int csc,
                   int32_t symmetric)
{
    memset(b, 0, sizeof *b);
    b->factors = numbers(n);
    b->step = numbers(n);
    b->lower = numbers(n);
    b->upper = numbers(n);
    b->z = numbers(n);
    fill(b, random, pattern, n);
    b->own = view(csc ? &b->sparse : &b->dense);
    b->problem.context = context;
    b->problem.n = n;
    b->problem.M = &b->own;
    b->omega = gen_integer(random, 2) ? 1.0 : 2.0;
    for (int32_t i = 0; i < n; i++)
        b->step[i] = b->lower[i] < b->upper[i]
                         ? b->omega / b->dense.M[(size_t)i * (size_t)n + (size_t)i]
                         : 0.0;
    memset(&b->arena, 0, sizeof b->arena);
    assert_int_equal(perp__arena_fit(&b->arena, context, layout, b), PERP_OK);
    perp__rows_read(&b->sweeper.rows, &b->problem, b->step, symmetric);
    b->sweeper.keep = 1.0 - b->omega;
    for (int32_t i = 0; i < n; i++) {
        perp__slice *slice = &b->sweeper.rows.slices[i / PERP__SLICE];

        slice->load[i % PERP__SLICE] = b->dense.q[i] * b->step[i];
        slice->lower[i % PERP__SLICE] = b->lower[i];
        b->sweeper.rows.upper[i] = b->upper[i];
    }
    perp__sweeper_start(&b->sweeper, b->z);
}

static void release(bench *b)
{
    perp__arena_release(&b->arena);
    gen_destroy(&b->dense);
    gen_destroy(&b->sparse);
    free(b->factors);
    free(b->step);
    free(b->lower);
    free(b->upper);
    free(b->z);
}

static double middle(double a, double b, double c)
{
    return fmax(fmin(a, b), fmin(fmax(a, b), c));
}

/* The textbook: in place, row by row. */
static double sweep_by_hand(bench *b, int backward)
{
    const int32_t n = b->dense.n;
    double worst = 0.0;

    for (int32_t step = 0; step < n; step++) {
        int32_t i = backward ? n - 1 - step : step;
        double w = b->dense.q[i], r;

        for (int32_t j = 0; j < n; j++)
            w += b->dense.M[(size_t)i * (size_t)n + (size_t)j] * b->z[j];
        r = middle(b->z[i] - b->lower[i], b->z[i] - b->upper[i], w);
        if (b->lower[i] < b->upper[i])
            worst = fmax(worst, fabs(r));
        else
            worst = fmax(worst, fabs(b->z[i] - b->lower[i]));
        b->z[i] = fmin(fmax(b->z[i] - b->step[i] * w, b->lower[i]), b->upper[i]);
    }
    return worst;
}

static void compare(const bench *b)
{
    for (int32_t i = 0; i < b->dense.n; i++)
        assert_true(b->sweeper.z[i] == b->z[i]);
}

static const int32_t sizes[] = {1, 2, 7, 8, 9, 16, 25, 36, 64, 65, 100, 144, 200};

/* Steps are 1 to 8, so that integers stay integers. */
static void test_sweeps_of_the_textbook(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 21);
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        for (int variant = 0; variant < 4 * PATTERNS; variant++) {
            int32_t symmetric = variant % 2;
            bench b;

            create(&b, &random, (enum pattern)(variant / 4), sizes[k], variant / 2 % 2, symmetric);
            for (int step = 0; step < 3; step++) {
                int backward = symmetric && step % 2 == 1;
                double residual, expected = sweep_by_hand(&b, backward);

                if (backward)
                    perp__sweep_backward(&b.sweeper, &residual);
                else
                    perp__sweep(&b.sweeper, 1, &residual);
                compare(&b);
                assert_true(residual == expected);
            }
            release(&b);
        }
}

/* Several sweeps on each other's heels are the same sweeps. */
static void test_sweeps_at_once(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 22);
    for (int32_t n = 60; n <= 900; n += 120)
        for (int variant = 0; variant < 2 * PATTERNS; variant++) {
            double together[PERP__SWEEPS_AT_ONCE], alone[PERP__SWEEPS_AT_ONCE];
            gen_random copy = random;
            bench a, b;

            if (variant / 2 == FULL && n > 400)
                continue;
            create(&a, &random, (enum pattern)(variant / 2), n, variant % 2, 0);
            create(&b, &copy, (enum pattern)(variant / 2), n, variant % 2, 0);
            perp__sweep(&a.sweeper, PERP__SWEEPS_AT_ONCE, together);
            for (int k = 0; k < PERP__SWEEPS_AT_ONCE; k++)
                perp__sweep(&b.sweeper, 1, &alone[k]);
            assert_memory_equal(together, alone, sizeof alone);
            for (int32_t i = 0; i < n; i++)
                assert_true(a.sweeper.z[i] == b.sweeper.z[i]);
            release(&a);
            release(&b);
        }
}

/* An infinity anywhere is seen, though no comparison with the bounds shows it. */
static void test_overflow_is_seen(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 23);
    for (int32_t i = 0; i < 50; i++) {
        double residual;
        bench b;

        create(&b, &random, GRID, 50, i % 2, 0);
        b.sweeper.rows.slices[i / PERP__SLICE].load[i % PERP__SLICE] = i % 3 == 0   ? NAN
                                                                       : i % 3 == 1 ? INFINITY
                                                                                    : -INFINITY;
        b.step[i] = 1.0;
        perp__sweep(&b.sweeper, 1, &residual);
        /* rows that are held have weight 0 and w = 0 (z - x): NaN all the same */
        assert_true(residual == INFINITY);
        release(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sweeps_of_the_textbook),
        cmocka_unit_test(test_sweeps_at_once),
        cmocka_unit_test(test_overflow_is_seen),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

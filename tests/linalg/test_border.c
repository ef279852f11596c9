/* Dense blocks of sets that change from one to the next: the residual in exact sums, whichever
 * factors and borders the solution came from. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "check.h"
#include "exact.h"
#include "gen.h"
#include "linalg/sparse_block.h"

enum { MOST = 160 };

typedef struct fixture {
    perp_context *context;
    perp__sparse_block block;
    perp__matrix M;
    double values[MOST * MOST], row_norms[MOST], r[MOST], x[MOST];
    int32_t active[MOST], is_active[MOST];
    int32_t n, count;
} fixture;

/* Diagonally dominant, symmetric or not: the condition number of every block is below 3. */
static void open_fixture(fixture *f, gen_random *random, int32_t n, int symmetric)
{
    memset(f, 0, sizeof *f);
    f->n = n;
    f->M = (perp__matrix){n, n, 1, (size_t)n, f->values, NULL, NULL};
    for (int32_t j = 0; j < n; j++)
        for (int32_t i = 0; i < n; i++)
            f->values[i + j * n] = i == j ? 1.0 : gen_uniform(random, -0.5, 0.5) / n;
    for (int32_t j = 0; symmetric && j < n; j++)
        for (int32_t i = 0; i < j; i++)
            f->values[i + j * n] = f->values[j + i * n];
    for (int32_t i = 0; i < n; i++)
        f->row_norms[i] = 1.5;
    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    f->block.context = f->context;
    assert_int_equal(perp__sparse_block_read(&f->block, &f->M, f->row_norms), PERP_OK);
    assert_int_equal(f->block.is_symmetric, symmetric || n == 1);
}

static void close_fixture(fixture *f)
{
    perp__sparse_block_release(&f->block);
    perp_context_destroy(f->context);
    free(f);
}

/* Backward stable solves of well-conditioned systems with right-hand sides below 3 leave residuals
 * of some n u; borders make it a few of them. */
static void solve_and_check(fixture *f, gen_random *random)
{
    f->count = 0;
    for (int32_t i = 0; i < f->n; i++) {
        f->x[i] = f->r[i] = gen_uniform(random, -3.0, 3.0);
        if (f->is_active[i])
            f->active[f->count++] = i;
    }
    assert_int_equal(perp__sparse_block_approach(&f->block, f->active, f->count), PERP_OK);
    assert_int_equal(perp__sparse_block_solve_roughly(&f->block, f->x), PERP_OK);
    for (int32_t k = 0; k < f->count; k++) {
        const int32_t i = f->active[k];
        check_sum sum;

        check_sum_clear(&sum);
        check_sum_add(&sum, f->r[i], -1.0);
        for (int32_t p = 0; p < f->count; p++)
            check_sum_add(&sum, f->values[i + f->active[p] * f->n], f->x[f->active[p]]);
        assert_true(fabs(check_sum_value(&sum, 0)) <= 100.0 * (f->n + 1) * 0x1p-53);
    }
}

/* From few changes, which keep the factors, to many, which do not. */
static void test_sequences_of_sets(void **state)
{
    static const int32_t sizes[] = {1, 2, 5, 63, 64, 90, MOST};
    gen_random random;

    (void)state;
    gen_seed(&random, 51);
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (int kind = 0; kind < 2; kind++) {
            fixture *f = check_allocate(1, sizeof *f);
            int kept = 0;

            open_fixture(f, &random, sizes[s], kind);
            for (int round = 0; round < 30; round++) {
                solve_and_check(f, &random);
                kept += f->block.border.changes > 0;
                for (int32_t k = round % 10 == 9 ? f->n : 1 + round % 4; k > 0; k--)
                    f->is_active[gen_integer(&random, f->n)] ^= 1;
            }
            assert_true(sizes[s] < 8 ? kept == 0 : kept > 5);
            close_fixture(f);
        }
}

/* What goes and comes back is the old set again; from a restart on a set has the same bits whatever
 * was solved before. */
static void test_there_and_back(void **state)
{
    gen_random random;
    fixture *f = check_allocate(1, sizeof *f);
    double first[64];

    (void)state;
    gen_seed(&random, 52);
    open_fixture(f, &random, 64, 1);
    for (int32_t i = 0; i < 64; i++)
        f->is_active[i] = i % 4 > 0;
    for (int round = 0; round < 4; round++) {
        gen_seed(&random, 53);
        if (round == 3)
            perp__sparse_block_restart(&f->block, 0.0);
        solve_and_check(f, &random);
        if (round == 0)
            memcpy(first, f->x, sizeof first);
        assert_true(round == 1 ? f->block.border.changes == 2 : f->block.border.changes == 0);
        if (round != 1)
            assert_memory_equal(first, f->x, sizeof first);
        if (round < 2) { /* one leaves and one enters, and back */
            f->is_active[1] ^= 1;
            f->is_active[4] ^= 1;
        }
    }
    close_fixture(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sequences_of_sets),
        cmocka_unit_test(test_there_and_back),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

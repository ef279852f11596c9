/* Systems with the active block, for sets that change from one to the next: the residual in exact
 * sums, whichever factors and borders the solution came from. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/context.h"
#include "check.h"
#include "exact.h"
#include "gen.h"
#include "lcp/active_set/active_set.h"

typedef struct fixture {
    perp_context *context;
    perp__arena arena;
    perp__active_block block;
    perp__lcp_problem problem;
    perp__matrix M;
    double *values, *row_norms, *r, *x;
    int8_t *places;
    int32_t n;
} fixture;

static double *place_of(const fixture *f, int32_t i, int32_t j)
{
    return f->values + (size_t)i + (size_t)j * (size_t)f->n;
}

static void layout(perp__arena *arena, void *object)
{
    fixture *f = object;

    perp__active_block_layout(arena, &f->block, f->n, 0);
}

/* Diagonally dominant, symmetric or not: the
 * condition number of every block is below 3. */
static void open_fixture(fixture *f, gen_random *random, int32_t n, int symmetric)
{
    const size_t size = (size_t)n;
    int32_t i, j;

    memset(f, 0, sizeof *f);
    f->n = n;
    f->values = check_allocate(size * size, sizeof(double));
    f->row_norms = check_allocate(size, sizeof(double));
    f->r = check_allocate(size, sizeof(double));
    f->x = check_allocate(size, sizeof(double));
    f->places = check_allocate(size, 1);
    f->M.rows = f->M.columns = n;
    f->M.values = f->values;
    f->M.row_stride = 1;
    f->M.column_stride = size;
    for (i = 0; i < n; i++)
        f->row_norms[i] = 1.5;
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++)
            *place_of(f, i, j) = i == j ? 1.0 : gen_uniform(random, -0.5, 0.5) / n;
    for (j = 0; symmetric && j < n; j++)
        for (i = 0; i < j; i++)
            *place_of(f, i, j) = *place_of(f, j, i);
    f->problem.n = n;
    f->problem.M = &f->M;
    f->problem.row_norms = f->row_norms;
    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    memset(&f->arena, 0, sizeof f->arena);
    assert_int_equal(perp__arena_fit(&f->arena, f->context, layout, f), PERP_OK);
    perp__active_block_begin(&f->block, &f->problem, symmetric);
    f->block.definite = 0;
}

static void close_fixture(fixture *f)
{
    perp__arena_release(&f->arena);
    perp_context_destroy(f->context);
    free(f->values);
    free(f->row_norms);
    free(f->r);
    free(f->x);
    free(f->places);
}

/* Chooses the places as they are and solves. Backward stable solves of well-conditioned systems
 * with right-hand sides below 3 leave residuals of some n u; borders make it a few of them. */
static void choose_and_check(fixture *f, gen_random *random)
{
    int32_t i, j;

    for (i = 0; i < f->n; i++)
        f->x[i] = f->r[i] = gen_uniform(random, -3.0, 3.0);
    assert_int_equal(perp__active_block_choose(&f->block, f->places), PERP__BLOCK_READY);
    perp__active_block_solve(&f->block, f->places, f->x);
    for (i = 0; i < f->n; i++) {
        check_sum sum;

        if (f->places[i] != PERP__BETWEEN) {
            assert_true(f->x[i] == f->r[i]);
            continue;
        }
        check_sum_clear(&sum);
        check_sum_add(&sum, f->r[i], -1.0);
        for (j = 0; j < f->n; j++)
            if (f->places[j] == PERP__BETWEEN)
                check_sum_add(&sum, *place_of(f, i, j), f->x[j]);
        assert_true(fabs(check_sum_value(&sum, 0)) <= 100.0 * (f->n + 1) * 0x1p-53);
    }
}

static void change(fixture *f, gen_random *random, int32_t count)
{
    for (; count > 0; count--) {
        int8_t *place = f->places + gen_integer(random, f->n);

        *place = *place == PERP__BETWEEN ? (int8_t)gen_integer(random, 2) : PERP__BETWEEN;
    }
}

/* From few changes, which keep the factors, to many, which do not. */
static void test_sequences_of_sets(void **state)
{
    static const int32_t sizes[] = {1, 2, 5, 63, 64, 90, 160};
    gen_random random;
    size_t s;
    int kind, round;

    (void)state;
    gen_seed(&random, 51);
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (kind = 0; kind < 2; kind++) {
            int kept = 0;
            fixture f;

            open_fixture(&f, &random, sizes[s], kind);
            for (round = 0; round < 30; round++) {
                choose_and_check(&f, &random);
                kept += f.block.changes > 0;
                change(&f, &random, round % 10 == 9 ? f.n : 1 + round % 4);
            }
            assert_true(sizes[s] < 8 ? kept == 0 : kept > 5);
            close_fixture(&f);
        }
}

/* What goes and comes back is the old set again. */
static void test_there_and_back(void **state)
{
    gen_random random;
    fixture f;

    (void)state;
    gen_seed(&random, 52);
    open_fixture(&f, &random, 100, 1);
    memset(f.places, PERP__BETWEEN, 100);
    choose_and_check(&f, &random);
    assert_true(f.block.by_cholesky);
    f.places[7] = PERP__AT_LOWER;
    choose_and_check(&f, &random);
    assert_int_equal(f.block.changes, 1);
    f.places[7] = PERP__BETWEEN;
    choose_and_check(&f, &random);
    assert_int_equal(f.block.changes, 0);
    f.places[7] = PERP__AT_UPPER;
    choose_and_check(&f, &random);
    assert_int_equal(f.block.kept, 1); /* the column of the first time */
    close_fixture(&f);
}

/* Blocks that are singular, indefinite, or no part of a positive definite matrix. */
static void test_bad_blocks(void **state)
{
    gen_random random;
    int32_t n, kind, definite;

    (void)state;
    gen_seed(&random, 53);
    for (n = 2; n <= 70; n += 34)
        for (kind = 0; kind < 3; kind++)
            for (definite = 0; definite < 2; definite++) {
                enum perp__block_state wanted;
                fixture f;
                int32_t i;

                open_fixture(&f, &random, n, 1);
                memset(f.places, PERP__BETWEEN, (size_t)n);
                f.block.definite = definite;
                for (i = 0; i < n; i++) {
                    memset(f.values + (size_t)i * (size_t)n, 0, (size_t)n * sizeof(double));
                    f.values[(size_t)i * (size_t)(n + 1)] = 1.0;
                }
                if (kind == 0) { /* two equal rows */
                    f.values[1] = f.values[n] = 1.0;
                    wanted = definite ? PERP__BLOCK_INDEFINITE : PERP__BLOCK_SINGULAR;
                } else if (kind == 1) { /* regular, but indefinite: LU takes it */
                    f.values[0] = -1.0;
                    wanted = definite ? PERP__BLOCK_INDEFINITE : PERP__BLOCK_READY;
                } else { /* a negative determinant where nothing is symmetric */
                    f.block.symmetric = 0;
                    f.values[1] = f.values[n] = 2.0;
                    wanted = definite ? PERP__BLOCK_INDEFINITE : PERP__BLOCK_READY;
                }
                assert_int_equal(perp__active_block_choose(&f.block, f.places), wanted);
                memset(f.places, PERP__AT_LOWER, (size_t)n); /* nothing of it is left behind */
                f.places[n - 1] = n > 2 || kind != 1 ? PERP__BETWEEN : PERP__AT_LOWER;
                choose_and_check(&f, &random);
                close_fixture(&f);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sequences_of_sets),
        cmocka_unit_test(test_there_and_back),
        cmocka_unit_test(test_bad_blocks),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

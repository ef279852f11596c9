/* The active blocks of Newton matrices over values, patterns and storages: S_AA + W_A and
 * S_AA + rho I, symmetric or not, definite or not. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "gen.h"
#include "lcp/fischer/fischer.h"

#include "context.h"

#define N 12

typedef struct setting {
    perp__fischer_matrix matrix;
    perp__arena arena;
    perp__matrix M;
    perp__lcp_problem problem;
    perp__sparse_block block;
    double values[N * N], row_norms[N];
} setting;

static void layout(perp__arena *arena, void *object)
{
    setting *s = object;

    perp__fischer_matrix_layout(arena, &s->matrix, &s->problem);
}

static const int32_t e[N] = {0, 1, -1, 0, 2, 0, 0, -2, 0, 1, 0, 0}, none[N] = {0};

static void read_problem(setting *s, const gen_lcp *from, int csc)
{
    memset(&s->M, 0, sizeof s->M);
    s->M.rows = s->M.columns = N;
    s->M.values = s->values;
    s->M.column_starts = csc ? from->column_starts : NULL;
    s->M.row_indices = csc ? from->row_indices : NULL;
    s->M.row_stride = 1;
    s->M.column_stride = N;
    for (int j = 0; j < N; j++) /* D M D, by columns */
        if (csc)
            for (int k = from->column_starts[j]; k < from->column_starts[j + 1]; k++)
                s->values[k] = ldexp(from->values[k], e[from->row_indices[k]] + e[j]);
        else
            for (int i = 0; i < N; i++)
                s->values[i + j * N] = ldexp(from->M[i * N + j], e[i] + e[j]);
    memset(&s->problem, 0, sizeof s->problem);
    s->problem.context = context;
    s->problem.n = N;
    s->problem.M = &s->M;
    s->problem.row_norms = s->row_norms;
    perp__scaled_row_norms(&s->M, none, s->row_norms);
    if (csc) {
        s->problem.block = &s->block;
        assert_int_equal(perp__sparse_block_read(&s->block, &s->M), PERP_OK);
    }
    assert_int_equal(perp__arena_fit(&s->arena, context, layout, s), PERP_OK);
    perp__fischer_matrix_read(&s->matrix, &s->problem);
}

static void begin(setting *s)
{
    memset(s, 0, sizeof *s);
    memset(&s->arena, 0, sizeof s->arena);
    memset(&s->block, 0, sizeof s->block);
    s->block.context = context;
}

static void end(setting *s)
{
    perp__sparse_block_release(&s->block);
    perp__arena_release(&s->arena);
}

/* (S_AA + W_A) x = b by plain loops over the caller's dense M; W_i = rho where places tell A. */
static void require_block(setting *s, const int *M, const double *weights, double rho,
                          const int8_t *places, gen_random *random)
{
    double b[N], x[N], same[N];

    for (int i = 0; i < N; i++) {
        b[i] = x[i] = gen_uniform(random, -1, 1);
        same[i] = places[i] == PERP__BETWEEN ? rho : INFINITY;
    }
    assert_int_equal(perp__fischer_matrix_factor(&s->matrix, weights ? weights : same, !weights),
                     PERP_OK);
    perp__fischer_matrix_solve(&s->matrix, x);
    for (int i = 0; i < N; i++) {
        double sum = 0.0;

        if (places[i] != PERP__BETWEEN) {
            assert_true(x[i] == b[i]);
            continue;
        }
        for (int j = 0; j < N; j++)
            if (places[j] == PERP__BETWEEN)
                sum += ldexp(M[i * N + j], e[i] + e[j]) * x[j];
        /* the weights make rows dominant by 1 or more, entries stay below 2e3: N eps 2e3 < 1e-11 */
        assert_true(fabs((weights ? weights[i] : rho) * x[i] + sum - b[i]) <= 1e-11);
    }
}

static void require_solves(setting *s, const int *M, gen_random *random)
{
    double weights[N], b[N], y[N] = {0.0};
    int8_t places[N];

    for (int i = 0; i < N; i++) {
        places[i] = i % 3 == 0 ? PERP__AT_LOWER : PERP__BETWEEN;
        weights[i] = i % 3 == 0 ? INFINITY : gen_uniform(random, 800.0, 1600.0);
        b[i] = i % 4 == 0 ? 0.0 : gen_uniform(random, -1, 1);
    }
    require_block(s, M, weights, 0.0, places, random);
    require_block(s, M, NULL, 800.0, places, random);
    perp__multiply_add(&s->matrix.S, b, y);
    perp__fischer_matrix_add_column(&s->matrix, 2, -b[2], y);
    for (int i = 0; i < N; i++) {
        double sum = 0.0, across = 0.0;

        for (int j = 0; j < N; j++) {
            sum += j == 2 ? 0.0 : ldexp(M[i * N + j], e[i] + e[j]) * b[j];
            across += ldexp(M[j * N + i], e[i] + e[j]) * b[j];
        }
        /* N products below 200 and their sums: N^2 eps 200 < 1e-11 */
        assert_true(fabs(y[i] - sum) <= 1e-11);
        assert_true(fabs(perp__column_times(&s->matrix.S, i, b) - across) <= 1e-11);
        assert_true(perp__entry(&s->matrix.S, i, i) == ldexp(M[i * N + i], 2 * e[i]));
    }
}

/* 24 entries off the diagonal in places that depend on `shift`, and every other diagonal
 * entry: rows that are active have one, or have not. */
static void make_entries(int *M, int shift, int factor, int symmetric)
{
    memset(M, 0, N * N * sizeof *M);
    for (int k = 0; k < 24; k++)
        M[(k % N) * N + (k % N + 1 + shift + 3 * (k / N)) % N] =
            factor * (k % 5 - 2 ? k % 5 - 2 : 3);
    for (int i = 0; i < N; i += 2)
        M[i * N + i] = 2 * factor;
    for (int i = 0; i < N && symmetric; i++)
        for (int j = 0; j < i; j++)
            M[i * N + j] = M[j * N + i];
}

static void test_matrices(void **state)
{
    static const struct {
        int shift, factor, csc, symmetric;
    } steps[] = {{0, 1, 1, 0}, {0, 1, 1, 0}, {0, 3, 1, 1}, {2, 1, 1, 0}, {5, 2, 1, 1},
                 {5, 2, 0, 0}, {1, 1, 0, 1}, {1, 1, 1, 0}, {1, 1, 0, 0}};
    int M[N * N], q[N] = {0};
    gen_random random;
    setting s;

    (void)state;
    begin(&s);
    gen_seed(&random, 4);
    for (size_t k = 0; k < sizeof steps / sizeof steps[0]; k++) {
        gen_lcp full, sparse;

        make_entries(M, steps[k].shift, steps[k].factor, steps[k].symmetric);
        gen_from_integers(&full, N, M, q);
        gen_to_csc(&sparse, &full);
        read_problem(&s, steps[k].csc ? &sparse : &full, steps[k].csc);
        assert_int_equal(s.matrix.symmetric, steps[k].symmetric);
        require_solves(&s, M, &random);
        require_solves(&s, M, &random);
        if (!steps[k].csc && steps[k].symmetric)
            assert_int_equal(s.matrix.by, PERP__FISCHER_CHOLESKY);
        gen_destroy(&sparse);
        gen_destroy(&full);
    }
    end(&s);
}

/* S = e_0 e_0' is singular, and S + I / 4 not; [[0, 2], [2, 0]] is symmetric and not definite. */
static void test_singular(void **state)
{
    for (int csc = 0; csc < 2; csc++)
        for (int swap = 0; swap < 2; swap++) {
            int M[N * N] = {0}, q[N] = {0};
            double weights[N], x[N];
            gen_lcp full, sparse;
            setting s;

            (void)state;
            M[0] = 1 - swap;
            M[1] = M[N] = swap;
            gen_from_integers(&full, N, M, q);
            gen_to_csc(&sparse, &full);
            begin(&s);
            read_problem(&s, csc ? &sparse : &full, csc);
            for (int i = 0; i < N; i++) {
                weights[i] = 0.0;
                x[i] = i + 1.0;
            }
            for (int uniform = 0; uniform < 2; uniform++)
                assert_int_equal(perp__fischer_matrix_factor(&s.matrix, weights, uniform),
                                 PERP__FACTOR_SINGULAR);
            for (int i = 0; i < N; i++)
                weights[i] = 0.25;
            assert_int_equal(perp__fischer_matrix_factor(&s.matrix, weights, 1), PERP_OK);
            perp__fischer_matrix_solve(&s.matrix, x);
            /* [[1/4, 2], [2, 1/4]]^-1 (1, 2) = (20, 8) / 21 */
            assert_true(fabs(x[0] - (swap ? 20.0 / 21.0 : 1.0 / 1.25)) <= 1e-14);
            assert_true(fabs(x[1] - (swap ? 8.0 / 21.0 : 8.0)) <= 1e-14);
            for (int i = 2; i < N; i++)
                assert_true(x[i] == 4.0 * (i + 1.0)); /* / 1/4: exact */
            gen_destroy(&sparse);
            gen_destroy(&full);
            end(&s);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_matrices),
        cmocka_unit_test(test_singular),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

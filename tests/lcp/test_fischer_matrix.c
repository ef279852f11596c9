/* The Newton matrices: S + rho I scaled by rows plus a diagonal, through one factorisation that is
 * kept over values, patterns and storages. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "gen.h"
#include "lcp/fischer_matrix.h"

#define N 12

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

typedef struct setting {
    perp__fischer_matrix matrix;
    perp__arena arena;
    perp__matrix M;
    perp__lcp_problem problem;
    double factors[N];
} setting;

static void layout(perp__arena *arena, void *object)
{
    setting *s = object;

    perp__fischer_matrix_layout(arena, &s->matrix, &s->problem);
}

static const int32_t e[N] = {0, 1, -1, 0, 2, 0, 0, -2, 0, 1, 0, 0};

static void read_problem(setting *s, const gen_lcp *from, int csc)
{
    memset(&s->M, 0, sizeof s->M);
    s->M.rows = s->M.columns = N;
    s->M.values = csc ? from->values : from->M;
    s->M.column_starts = csc ? from->column_starts : NULL;
    s->M.row_indices = csc ? from->row_indices : NULL;
    s->M.row_stride = csc ? 0 : N;
    s->M.column_stride = csc ? 0 : 1;
    memset(&s->problem, 0, sizeof s->problem);
    s->problem.context = context;
    s->problem.n = N;
    s->problem.M = &s->M;
    s->problem.factors = s->factors;
    for (int i = 0; i < N; i++)
        s->factors[i] = ldexp(1.0, e[i]);
    assert_int_equal(perp__arena_fit(&s->arena, layout, s), PERP_OK);
    assert_int_equal(perp__fischer_matrix_read(&s->matrix, &s->problem), PERP_OK);
}

/* H x = b by plain loops over the caller's dense M. Entries of H are below 1e3, those of H^-1 below
 * 1e2 for these slopes (diagonally dominant rows): n * cond * eps = 12 * 1e5 * 2e-16 < 1e-9. */
static void require_solves(setting *s, const int *M, double rho, gen_random *random)
{
    double slope_z[N], slope_w[N], b[N], x[N], y[N], transposed[N];

    for (int i = 0; i < N; i++) {
        slope_w[i] = i % 3 == 0 ? 0.0 : gen_uniform(random, 0.01, 1.0);
        slope_z[i] = 800.0 * slope_w[i] + gen_uniform(random, 0.5, 1.0);
        b[i] = x[i] = gen_uniform(random, -1, 1);
    }
    assert_int_equal(perp__fischer_matrix_factor(&s->matrix, slope_z, slope_w, rho), PERP_OK);
    perp__fischer_matrix_solve(&s->matrix, x);
    perp__fischer_matrix_transposed(&s->matrix, b, transposed);
    perp__multiply(&s->matrix.S, x, y);
    for (int i = 0; i < N; i++) {
        double sum = 0.0, across = 0.0;

        for (int j = 0; j < N; j++) {
            sum += ldexp(M[i * N + j], e[i] + e[j]) * x[j];
            across += ldexp(M[j * N + i], e[i] + e[j]) * b[j];
        }
        assert_true(fabs(y[i] - sum) <= 1e-9);
        assert_true(fabs(transposed[i] - across) <= 1e-9);
        assert_true(fabs(slope_z[i] * x[i] + slope_w[i] * (sum + rho * x[i]) - b[i]) <= 1e-9);
    }
}

/* 24 entries off the diagonal in places that depend on `shift`, and every third diagonal entry. */
static void make_entries(int *M, int shift, int factor)
{
    memset(M, 0, N * N * sizeof *M);
    for (int k = 0; k < 24; k++)
        M[(k % N) * N + (k % N + 1 + shift + 3 * (k / N)) % N] =
            factor * (k % 5 - 2 ? k % 5 - 2 : 3);
    for (int i = 0; i < N; i += 3)
        M[i * N + i] = 2 * factor;
}

static void test_matrices(void **state)
{
    static const struct {
        int shift, factor, csc, kept; /* kept: the analysis of the line before serves */
    } steps[] = {{0, 1, 1, 0}, {0, 1, 1, 1}, {0, 3, 1, 1}, {2, 1, 1, 0}, {5, 2, 1, 0},
                 {5, 2, 0, 0}, {1, 1, 0, 1}, {1, 1, 1, 0}, {1, 1, 0, 0}};
    int M[N * N], q[N] = {0};
    gen_random random;
    setting s;

    (void)state;
    memset(&s, 0, sizeof s);
    perp__arena_init(&s.arena, context);
    gen_seed(&random, 4);
    for (size_t k = 0; k < sizeof steps / sizeof steps[0]; k++) {
        const perp__factor *before = s.matrix.kept.factor;
        const int32_t *pattern = s.matrix.kept.pattern;
        gen_lcp full, sparse;

        make_entries(M, steps[k].shift, steps[k].factor);
        gen_from_integers(&full, N, M, q);
        gen_to_csc(&sparse, &full);
        read_problem(&s, steps[k].csc ? &sparse : &full, steps[k].csc);
        if (steps[k].kept) /* an allocator may return the same address: only this is certain */
            assert_true(s.matrix.kept.factor == before && s.matrix.kept.pattern == pattern);
        require_solves(&s, M, 0.0, &random);
        require_solves(&s, M, 0.25, &random);
        gen_destroy(&sparse);
        gen_destroy(&full);
    }
    perp__fischer_matrix_release(&s.matrix);
    assert_null(s.matrix.kept.factor);
    perp__fischer_matrix_release(&s.matrix); /* twice is once */
    perp__arena_release(&s.arena);
}

/* Where D_z = 0 a singular S makes H singular, and rho regular. */
static void test_singular(void **state)
{
    int M[N * N], q[N] = {0};
    double slope_z[N] = {0.0}, slope_w[N], x[N];
    gen_lcp full, sparse;

    (void)state;
    for (int i = 0; i < N * N; i++)
        M[i] = 0;
    M[0] = 1;
    gen_from_integers(&full, N, M, q);
    gen_to_csc(&sparse, &full);
    for (int csc = 0; csc < 2; csc++) {
        setting s;

        memset(&s, 0, sizeof s);
        perp__arena_init(&s.arena, context);
        read_problem(&s, csc ? &sparse : &full, csc);
        for (int i = 0; i < N; i++) {
            slope_w[i] = 0.5;
            x[i] = i + 1.0;
        }
        assert_int_equal(perp__fischer_matrix_factor(&s.matrix, slope_z, slope_w, 0.0),
                         PERP__FACTOR_SINGULAR);
        assert_int_equal(perp__fischer_matrix_factor(&s.matrix, slope_z, slope_w, 0.25), PERP_OK);
        perp__fischer_matrix_solve(&s.matrix, x);
        assert_true(fabs(x[0] - 1.0 / (0.5 * 1.25)) <= 1e-15);
        for (int i = 1; i < N; i++)
            assert_true(x[i] == 8.0 * (i + 1.0)); /* / (1/2 * 1/4): exact */
        perp__fischer_matrix_release(&s.matrix);
        perp__arena_release(&s.arena);
    }
    gen_destroy(&sparse);
    gen_destroy(&full);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_matrices),
        cmocka_unit_test(test_singular),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

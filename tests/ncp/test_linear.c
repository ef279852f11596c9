/* Linear problems with every kind of bounds: the exact solution that they were made from, and the
 * linear complementarity solver, against every method, storage and sort of Jacobian. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "check.h"
#include "gen.h"

#include "context.h"

enum { MOST = 40 };

/* What the callbacks see: and whether they were ever asked outside of the bounds. */
typedef struct linear {
    const gen_lcp *problem;
    int storage;
    int outside, calls;
    int32_t unique; /* so many of the first variables are, w is not; 0: all */
} linear;

static void look(linear *l, const double *z)
{
    const gen_lcp *p = l->problem;

    l->calls++;
    for (int32_t i = 0; i < p->n; i++)
        l->outside +=
            !(z[i] >= (p->lower ? p->lower[i] : 0) && z[i] <= (p->upper ? p->upper[i] : INFINITY));
}

static int32_t function(double *F, const double *z, void *user)
{
    linear *l = user;
    const gen_lcp *p = l->problem;

    look(l, z);
    for (int32_t i = 0; i < p->n; i++) {
        F[i] = p->q[i];
        if (p->M)
            for (int32_t j = 0; j < p->n; j++)
                F[i] += p->M[i * p->n + j] * z[j];
    }
    for (int32_t j = 0; j < p->n && !p->M; j++)
        for (int32_t k = p->column_starts[j]; k < p->column_starts[j + 1]; k++)
            F[p->row_indices[k]] += p->values[k] * z[j];
    return 0;
}

static int32_t jacobian(double *J, const double *z, void *user)
{
    linear *l = user;
    const gen_lcp *p = l->problem;

    look(l, z);
    if (l->storage == PERP_STORAGE_CSC) {
        memcpy(J, p->values, (size_t)p->column_starts[p->n] * sizeof *J);
        return 0;
    }
    for (int32_t i = 0; i < p->n; i++)
        for (int32_t j = 0; j < p->n; j++)
            J[l->storage == PERP_STORAGE_ROW_MAJOR ? i * p->n + j : i + j * p->n] =
                p->M[i * p->n + j];
    return 0;
}

static perp_ncp_problem problem_of(linear *l, int with_jacobian)
{
    perp_ncp_problem problem = fresh_ncp_problem();

    problem.n = l->problem->n;
    problem.storage = l->storage;
    if (l->storage == PERP_STORAGE_CSC) {
        problem.column_starts = l->problem->column_starts;
        problem.row_indices = l->problem->row_indices;
    }
    problem.function = function;
    problem.jacobian = with_jacobian ? jacobian : NULL;
    problem.lower = l->problem->lower;
    problem.upper = l->problem->upper;
    problem.user = l;
    return problem;
}

static double distance(const double *a, const double *b, int32_t n)
{
    double most = 0;

    for (int32_t i = 0; i < n; i++)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

static void check(linear *l, int method, int with_jacobian, const char *where)
{
    const perp_ncp_problem problem = problem_of(l, with_jacobian);
    const int32_t n = l->problem->n, unique = l->unique ? l->unique : n;
    /* where multipliers are not unique Newton's method is slow in the end, and stops at tol */
    const double looser = l->unique ? 100.0 : 1.0;
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_result result = fresh_ncp_result();
    double z[MOST], w[MOST], again[MOST], z0[MOST];

    for (int32_t i = 0; i < n; i++)
        z0[i] = i % 3 - 1.0;
    l->outside = 0;
    settings.method = method;
    assert_int_equal(perp_ncp_solve(context, z, w, &result, &settings, &problem, z0), PERP_OK);
    if (result.outcome != PERP_OUTCOME_SOLVED)
        fail_msg("%s: %s", where, perp_outcome_text(result.outcome));
    assert_int_equal(l->outside, 0);
    assert_true(method == PERP_NCP_AUTO || result.method == method);
    /* entries are of size 4 and below, |z| too, n = 12: rounding times a condition below 1e4 */
    if (!(distance(z, l->problem->z, unique) <= 1e-10 * looser) ||
        !(result.natural_residual <= 1e-12 * looser))
        fail_msg("%s: off by %g, natural residual %g", where, distance(z, l->problem->z, unique),
                 result.natural_residual);
    for (int32_t i = 0; i < n; i++) {
        const double low = l->problem->lower ? l->problem->lower[i] : 0;

        assert_true(z[i] >= low);
        /* off the index set: exactly the bound */
        if (l->problem->z[i] == low && l->problem->w[i] > 0 && !l->unique)
            assert_true(z[i] == low);
    }
    assert_int_equal(perp_ncp_solve(context, again, w, &result, &settings, &problem, z0), PERP_OK);
    assert_memory_equal(z, again, (size_t)n * sizeof *z);
}

static void test_random(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 20261);
    for (int class = 0; class < GEN_CLASSES; class ++) {
        if (class == GEN_PSD_LOW_RANK)
            continue; /* solutions are not unique */
        for (int bounds = 0; bounds < GEN_BOUNDS; bounds++)
            for (int repeat = 0; repeat < 5; repeat++) {
                linear l = {0};
                gen_lcp dense, sparse;

                gen_problem(&dense, &random, 12, class, bounds);
                gen_to_csc(&sparse, &dense);
                sparse.q = dense.q;
                sparse.lower = dense.lower;
                sparse.upper = dense.upper;
                sparse.z = dense.z;
                sparse.w = dense.w;
                sparse.n = dense.n;
                for (int variant = 0; variant < 15; variant++) {
                    char where[80];

                    l.storage = variant % 3;
                    l.problem = l.storage == PERP_STORAGE_CSC ? &sparse : &dense;
                    snprintf(where, sizeof where, "class %d bounds %d repeat %d variant %d", class,
                             bounds, repeat, variant);
                    if (variant < 12)
                        check(&l, variant / 3 % 2 ? PERP_NCP_JOSEPHY : PERP_NCP_FISCHER,
                              variant < 6, where);
                    else
                        check(&l, PERP_NCP_AUTO, 1, where);
                }
                free(sparse.column_starts);
                free(sparse.row_indices);
                free(sparse.values);
                gen_destroy(&dense);
            }
    }
}

/* From a point at the solution's bounds and near it between them, an active set's step is the whole
 * way: the problem is linear. */
static void test_near_starts(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 311);
    for (int draw = 0; draw < 40; draw++) {
        const int bounds = draw % GEN_BOUNDS;
        linear l = {0};
        gen_lcp p;
        perp_ncp_problem problem;
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[MOST], z0[MOST];

        gen_problem(&p, &random, 12, GEN_PD_UNSYMMETRIC, bounds);
        l.problem = &p;
        l.storage = PERP_STORAGE_ROW_MAJOR;
        problem = problem_of(&l, 1);
        for (int32_t i = 0; i < p.n; i++) {
            const double low = p.lower ? p.lower[i] : 0, high = p.upper ? p.upper[i] : INFINITY;
            const double room = fmin(1, fmin(p.z[i] - low, high - p.z[i]));

            /* between its bounds by more than what w becomes */
            z0[i] = p.z[i] + gen_uniform(&random, -0x1p-8, 0x1p-8) * room;
        }
        settings.method = PERP_NCP_FISCHER;
        settings.polish = 0;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        if (result.iterations > 1)
            fail_msg("draw %d: %d steps", draw, (int)result.iterations);
        gen_destroy(&p);
    }
}

/* A singular problem, many solutions: the residual is all there is to check. */
static void test_low_rank(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 77);
    for (int repeat = 0; repeat < 20; repeat++) {
        linear l = {0};
        gen_lcp dense;
        perp_ncp_problem problem;
        perp_ncp_result result = fresh_ncp_result();
        double z[MOST];

        gen_problem(&dense, &random, 10, GEN_PSD_LOW_RANK, repeat % GEN_BOUNDS);
        l.problem = &dense;
        l.storage = PERP_STORAGE_ROW_MAJOR;
        problem = problem_of(&l, 1);
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, NULL, &problem, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        gen_destroy(&dense);
    }
}

/* [H A'; A 0] with free multipliers, the usual symmetric form of a quadratic program, and its
 * monotone twin [H A'; -A 0]: H is a Laplacian on a grid, A sparse. */
enum { SIDE = 5, VARIABLES = SIDE * SIDE, EQUATIONS = 8 };

static void make_program(gen_lcp *p, gen_random *random, double sign)
{
    enum { N = VARIABLES + EQUATIONS };

    gen_begin_dense(p, N);
    p->lower = gen_allocate(N, sizeof(double));
    p->upper = gen_allocate(N, sizeof(double));
    for (int32_t i = 0; i < N; i++) {
        const double size = gen_dyadic(random, 2);

        p->lower[i] = i < VARIABLES ? 0 : -INFINITY;
        p->upper[i] = INFINITY;
        p->z[i] = i < VARIABLES ? fmax(size, 0) : size;
        p->w[i] = i < VARIABLES ? fmax(-size, 0) : 0;
        for (int32_t j = 0; j < VARIABLES && i < VARIABLES; j++) {
            const int32_t steps = abs(i / SIDE - j / SIDE) + abs(i % SIDE - j % SIDE);

            p->M[i * N + j] = steps == 0 ? 4 : steps == 1 ? -1 : 0;
        }
        for (int32_t j = 0; j < VARIABLES && i >= VARIABLES; j++)
            if (gen_integer(random, 6) == 0) {
                p->M[j * N + i] = gen_dyadic(random, 2);
                p->M[i * N + j] = sign * p->M[j * N + i];
            }
    }
    for (int32_t i = 0; i < N; i++) {
        p->q[i] = p->w[i];
        for (int32_t j = 0; j < N; j++)
            p->q[i] -= p->M[i * N + j] * p->z[j];
    }
}

static void test_programs(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 30);
    for (int repeat = 0; repeat < 200; repeat++) {
        linear l = {0};
        gen_lcp p;

        make_program(&p, &random, repeat % 2 ? 1 : -1);
        l.problem = &p;
        l.storage = PERP_STORAGE_ROW_MAJOR;
        l.unique = VARIABLES;
        check(&l, PERP_NCP_FISCHER, 1, "program, fischer");
        check(&l, PERP_NCP_JOSEPHY, 1, "program, josephy");
        gen_destroy(&p);
    }
}

/* Programs with variables that come as near to their bound as 5e-324: that is on it. */
static void test_what_underflows(void **state)
{
    static const uint64_t seeds[] = {90, 785, 1150, 3250, 3252, 4760, 5289, 5755, 5955};

    (void)state;
    for (size_t k = 0; k < sizeof seeds / sizeof *seeds; k++) {
        linear l = {.storage = PERP_STORAGE_ROW_MAJOR, .unique = VARIABLES};
        gen_random random;
        gen_lcp p;

        gen_seed(&random, seeds[k]);
        make_program(&p, &random, seeds[k] % 2 ? 1 : -1);
        l.problem = &p;
        check(&l, PERP_NCP_FISCHER, 1, "underflow, fischer");
        gen_destroy(&p);
    }
}

/* A program and its twin differ in the signs of equations alone, and signs do not round: a method
 * goes through the same points. */
static void test_twins(void **state)
{
    static const int32_t methods[] = {PERP_NCP_FISCHER, PERP_NCP_JOSEPHY};

    (void)state;
    for (uint64_t seed = 1; seed <= 100; seed++)
        for (int m = 0; m < 2; m++) {
            double z[2][MOST], w[MOST], z0[MOST] = {0};
            int64_t steps[2];

            for (int k = 0; k < 2; k++) {
                perp_ncp_settings settings = fresh_ncp_settings();
                perp_ncp_result result = fresh_ncp_result();
                linear l = {.storage = PERP_STORAGE_ROW_MAJOR};
                perp_ncp_problem problem;
                gen_random random;
                gen_lcp p;

                gen_seed(&random, seed);
                make_program(&p, &random, k ? 1 : -1);
                l.problem = &p;
                problem = problem_of(&l, 1);
                settings.method = methods[m];
                assert_int_equal(perp_ncp_solve(context, z[k], w, &result, &settings, &problem, z0),
                                 PERP_OK);
                steps[k] = result.iterations;
                gen_destroy(&p);
            }
            assert_int_equal(steps[0], steps[1]);
            assert_true(distance(z[0], z[1], VARIABLES + EQUATIONS) == 0.0);
        }
}

/* Linear programs, by one method alone: at each solution Newton's matrix is singular, and the path
 * of the smoothed equations has to lead to one (Kanzow 1996: it exists where a monotone problem has
 * an interior). The witness is the program's own optimal value. */
static void test_linear_programs(void **state)
{
    enum { ROWS = 40, COLUMNS = 60, DRAWS = 40 };
    gen_random random;

    (void)state;
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        linear l = {0};
        gen_lcp p;
        perp_ncp_problem problem;
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[ROWS + COLUMNS];

        gen_seed(&random, seed);
        gen_linear_program(&p, &random, ROWS, COLUMNS, seed % 2);
        l.problem = &p;
        l.storage = PERP_STORAGE_ROW_MAJOR;
        problem = problem_of(&l, 1);
        settings.method = PERP_NCP_FISCHER;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, NULL),
                         PERP_OK);
        if (result.outcome != PERP_OUTCOME_SOLVED)
            fail_msg("%d: %s", (int)seed, perp_outcome_text(result.outcome));
        /* residual times the sums of x and y, below 1000 with their scale */
        assert_true(fabs(gen_program_error(&p, COLUMNS, z)) <= 1e-10 * 1e3);
        gen_destroy(&p);
    }
}

static int near(double a, double b)
{
    return fabs(a - b) <= 1e-12 * fabs(b); /* sums of ten terms, in another order */
}

/* omega is the power of two near max(|D q|, |z / D|), and not that
 * of D q alone as linear problems have it: how many times as large? */
static double looser(const gen_lcp *p, int scaling, const double *z)
{
    int32_t exponents[MOST];
    double offset = 0, size = 0;

    check_exponents(&p->view, scaling, exponents);
    for (int32_t i = 0; i < p->n; i++) {
        offset = fmax(offset, fabs(ldexp(p->q[i], exponents[i])));
        size = fmax(size, fabs(ldexp(z[i], -exponents[i])));
    }
    return size > offset ? ldexp(1, ilogb(size) - ilogb(offset)) : 1;
}

/* The marks of a point that is no solution are, but for omega, those of the linear problem. */
static void test_residuals(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 5);
    for (int repeat = 0; repeat < 30; repeat++) {
        linear l = {0};
        gen_lcp dense;
        perp_ncp_problem problem;
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        check_measures expected;
        double z[MOST], w[MOST];

        gen_problem(&dense, &random, 10, repeat % GEN_CLASSES, repeat / 2 % GEN_BOUNDS);
        l.problem = &dense;
        l.storage = PERP_STORAGE_ROW_MAJOR;
        problem = problem_of(&l, 1);
        settings.tol = 1e6; /* any point will do */
        settings.polish = 0;
        settings.scaling = repeat % 2;
        assert_int_equal(perp_ncp_solve(context, z, w, &result, &settings, &problem, dense.q),
                         PERP_OK);
        check_measure(&expected,
                      &(check_lcp){&dense.view, dense.q, dense.lower, dense.upper, repeat % 2}, z,
                      w);
        assert_true(expected.residual > 1e-3); /* or this test would test nothing */
        assert_true(near(result.residual * looser(&dense, repeat % 2, z), expected.residual));
        assert_true(near(result.natural_residual, expected.natural_residual));
        assert_true(near(result.backward_error, expected.backward_error));
        gen_destroy(&dense);
    }
}

/* z >= 0; M is positive definite, its diagonal and q are many powers of ten apart. */
static void draw_small_rows(gen_lcp *p, uint64_t seed, int32_t n)
{
    double B[MOST][MOST], K[MOST][MOST], s[MOST];
    gen_random random;

    gen_seed(&random, seed);
    gen_begin_dense(p, n);
    for (int32_t i = 0; i < n; i++) {
        s[i] = pow(10, gen_uniform(&random, -1, 1));
        for (int32_t j = 0; j < n; j++) {
            B[i][j] = gen_normal(&random);
            K[i][j] = 0.5 * gen_normal(&random);
        }
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j < n; j++) {
            double sum = K[i][j] - K[j][i];

            for (int32_t k = 0; k < n; k++)
                sum += B[i][k] * B[j][k] / n;
            if (i == j)
                sum += pow(10, gen_uniform(&random, -6, 2));
            p->M[i * n + j] = s[i] * sum * s[j];
        }
        p->q[i] = s[i] * gen_normal(&random) * pow(10, gen_uniform(&random, -4, 4));
    }
}

/* At a loose tolerance a method stops where the largest rows are content; where a small row is not,
 * it has to go on. Every answer obeys the laws row by row, to the root of tol beside the row's own
 * terms (docs/lcp.md). With the polish a variable at its bound is exactly there (perp/ncp.h). */
static void test_small_rows(void **state)
{
    enum { N = 12, DRAWS = 100 };
    int32_t unsolved = 0;

    (void)state;
    for (int32_t draw = 0; draw < 2 * DRAWS; draw++) {
        const int polish = draw % 2;
        gen_lcp p;
        linear l = {&p, PERP_STORAGE_ROW_MAJOR, 0, 0, 0};
        perp_ncp_problem problem;
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_result result = fresh_ncp_result();
        double z[N], w[N], z0[N];

        draw_small_rows(&p, (uint64_t)draw / 2, N);
        problem = problem_of(&l, 1);
        for (int32_t i = 0; i < N; i++)
            z0[i] = 1;
        settings.method = PERP_NCP_FISCHER;
        settings.tol = 1e-2;
        settings.polish = polish;
        assert_int_equal(perp_ncp_solve(context, z, w, &result, &settings, &problem, z0), PERP_OK);
        assert_true(result.outcome == PERP_OUTCOME_SOLVED || !polish);
        unsolved += result.outcome != PERP_OUTCOME_SOLVED;
        for (int32_t i = 0; i < N && result.outcome == PERP_OUTCOME_SOLVED; i++) {
            double terms = fabs(p.q[i]);

            for (int32_t j = 0; j < N; j++)
                terms += fabs(p.M[i * N + j] * z[j]);
            assert_true(w[i] >= -0.1 * terms);
            if (polish && w[i] > 0.1 * terms)
                assert_true(z[i] == 0);
        }
        gen_destroy(&p);
    }
    /* without the polish one may be left; it is more than ten where no run goes on */
    assert_true(unsolved <= 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),          cmocka_unit_test(test_low_rank),
        cmocka_unit_test(test_programs),        cmocka_unit_test(test_twins),
        cmocka_unit_test(test_what_underflows), cmocka_unit_test(test_linear_programs),
        cmocka_unit_test(test_residuals),       cmocka_unit_test(test_small_rows),
        cmocka_unit_test(test_near_starts)};

    return cmocka_run_group_tests(tests, make, destroy);
}

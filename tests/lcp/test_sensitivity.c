/* Derivatives of solutions: against differences of solutions, forward against adjoint, and what is
 * said where there are none. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "memory.h"
#include "run.h"

#include "context.h"

enum { LARGEST = 16 };

static perp_lcp_sensitivity *open_at(perp_lcp_sensitivity_info *info, const gen_lcp *problem,
                                     const double *z)
{
    perp_lcp_sensitivity *s = NULL;

    *info = fresh_lcp_sensitivity_info();
    assert_int_equal(perp_lcp_sensitivity_create(
                         context, &s, info, NULL,
                         LCP(&problem->view, problem->q, problem->lower, problem->upper), z),
                     PERP_OK);
    return s;
}

/* A direction in all data, and where the data are moved to. */
typedef struct direction {
    double dq[LARGEST], dM[LARGEST * LARGEST], dlower[LARGEST], dupper[LARGEST];
    perp_matrix view;
} direction;

static void make_direction(direction *d, gen_random *random, int32_t n)
{
    int32_t i;

    for (i = 0; i < n; i++) {
        d->dq[i] = gen_normal(random);
        d->dlower[i] = gen_normal(random);
        d->dupper[i] = gen_normal(random);
    }
    for (i = 0; i < n * n; i++)
        d->dM[i] = gen_normal(random);
    d->view = matrix_rows(d->dM, n, n);
}

static double dot(const double *a, const double *b, int32_t n)
{
    double sum = 0.0;
    int32_t i;

    for (i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* A problem with one solution, problem->z, moved out of ties: no row is within 1/32 of changing its
 * place. */
static void make_problem(gen_lcp *problem, gen_random *random, int32_t n, int class, int bounds)
{
    int32_t i;

    gen_problem(problem, random, n, class, bounds);
    for (i = 0; i < n; i++) {
        const double l = problem->lower ? problem->lower[i] : 0.0;
        const double u = problem->upper ? problem->upper[i] : INFINITY;
        const double push = problem->w[i] != 0.0 ? 0.0 : problem->z[i] == l ? 1.0 : -1.0;

        if (l < u && (problem->z[i] == l || problem->z[i] == u)) {
            problem->w[i] += push;
            problem->q[i] += push;
        }
    }
}

/* The solution after a step t along d. */
static void solve_moved(const gen_lcp *problem, const direction *d, double t, double *z)
{
    const int32_t n = problem->n;
    double M[LARGEST * LARGEST], q[LARGEST], lower[LARGEST], upper[LARGEST];
    perp_matrix view;
    int32_t i;
    run r;

    for (i = 0; i < n * n; i++)
        M[i] = problem->M[i] + t * d->dM[i];
    for (i = 0; i < n; i++) {
        const double l = problem->lower ? problem->lower[i] : 0.0;
        const double u = problem->upper ? problem->upper[i] : INFINITY;

        q[i] = problem->q[i] + t * d->dq[i];
        lower[i] = l + t * d->dlower[i];
        upper[i] = l == u ? lower[i] : u + t * d->dupper[i]; /* fixed: both move */
    }
    view = matrix_rows(M, n, n);
    run_view(&r, context, &view, q, lower, upper, NULL, z, "moved");
    assert_true(run_ok(&r));
    memcpy(z, r.z, (size_t)n * sizeof *z);
    run_release(&r);
}

/* ---- the numbers --------------------------------------------------------------------------- */

/* Central differences with t = 2^-17: their error is t^2 |d^3 z| / 6, and cond eps |z| / t from the
 * solutions' rounding; with the condition below 1e4 either is below 1e-6 of |dz|. */
static void test_differences(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_M};
    const double t = 0x1p-17;
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 150; round++) {
        const int32_t n = 1 + gen_integer(&random, LARGEST);
        double plus[LARGEST], minus[LARGEST], dz[LARGEST], size = 1.0;
        perp_lcp_sensitivity_info info;
        perp_lcp_sensitivity *s;
        gen_lcp problem;
        direction d;
        int32_t i;

        make_problem(&problem, &random, n, classes[round % 3], round % GEN_BOUNDS);
        make_direction(&d, &random, n);
        s = open_at(&info, &problem, problem.z);
        assert_int_equal(info.verdict, PERP_VERDICT_REGULAR);
        assert_int_equal(info.index, -1);
        assert_true(info.margin > 0.0 && info.condition >= 1.0);
        if (info.condition < 1e4 && info.margin > 1e-3) {
            assert_int_equal(perp_lcp_sensitivity_forward(s, dz, d.dq, &d.view, d.dlower, d.dupper),
                             PERP_OK);
            memcpy(plus, problem.z, (size_t)n * sizeof *plus);
            memcpy(minus, problem.z, (size_t)n * sizeof *minus);
            solve_moved(&problem, &d, t, plus);
            solve_moved(&problem, &d, -t, minus);
            for (i = 0; i < n; i++)
                check_raise(&size, fabs(dz[i]));
            for (i = 0; i < n; i++)
                assert_true(fabs((plus[i] - minus[i]) / (2.0 * t) - dz[i]) <= 1e-6 * size);
        }
        perp_lcp_sensitivity_destroy(s);
        gen_destroy(&problem);
    }
}

/* g'dz computed forward and backward; each kind of data alone, and all together. */
static void require_adjoint(perp_lcp_sensitivity *s, const gen_lcp *problem, const direction *d,
                            const double *g, int kind)
{
    const int32_t n = problem->n;
    const int all = kind == 4;
    double dz[LARGEST], p[LARGEST], lower[LARGEST], upper[LARGEST], backward = 0.0, size;
    int32_t i, j;

    assert_int_equal(perp_lcp_sensitivity_forward(
                         s, dz, all || kind == 0 ? d->dq : NULL, all || kind == 1 ? &d->view : NULL,
                         all || kind == 2 ? d->dlower : NULL, all || kind == 3 ? d->dupper : NULL),
                     PERP_OK);
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, p, lower, upper, g), PERP_OK);
    size = fabs(dot(g, dz, n));
    if (all || kind == 0)
        backward += dot(p, d->dq, n);
    for (i = 0; (all || kind == 1) && i < n; i++)
        for (j = 0; j < n; j++)
            backward += p[i] * problem->z[j] * d->dM[i * n + j];
    if (all || kind == 2)
        backward += dot(lower, d->dlower, n);
    if (all || kind == 3)
        backward += dot(upper, d->dupper, n);
    for (i = 0; i < n; i++)
        size += fabs(g[i] * dz[i]) + fabs(p[i]) * 20.0 * n;      /* |data| < 20 */
    assert_true(fabs(backward - dot(g, dz, n)) <= 1e-12 * size); /* cond n eps */
}

static void test_adjoint(void **state)
{
    gen_random random;
    int round, kind, sparse;

    (void)state;
    gen_seed(&random, 2);
    for (round = 0; round < 60; round++)
        for (sparse = 0; sparse < 2; sparse++) {
            const int32_t n = 1 + gen_integer(&random, LARGEST);
            perp_lcp_sensitivity_info info = fresh_lcp_sensitivity_info();
            perp_lcp_sensitivity *s = NULL;
            gen_lcp problem, csc;
            double g[LARGEST], p[LARGEST];
            direction d;
            int32_t i;

            make_problem(&problem, &random, n, GEN_PD_UNSYMMETRIC, round % GEN_BOUNDS);
            make_direction(&d, &random, n);
            gen_to_csc(&csc, &problem);
            assert_int_equal(
                perp_lcp_sensitivity_create(context, &s, &info, NULL,
                                            LCP(sparse ? &csc.view : &problem.view, problem.q,
                                                problem.lower, problem.upper),
                                            problem.z),
                PERP_OK);
            for (i = 0; i < n; i++)
                g[i] = gen_normal(&random);
            for (kind = 0; kind <= 4; kind++)
                require_adjoint(s, &problem, &d, g, kind);
            assert_int_equal(perp_lcp_sensitivity_adjoint(s, p, NULL, NULL, g), PERP_OK);
            assert_int_equal(perp_lcp_sensitivity_adjoint(s, g, NULL, NULL, g), PERP_OK);
            assert_memory_equal(g, p, (size_t)n * sizeof *g);
            perp_lcp_sensitivity_destroy(s);
            gen_destroy(&csc);
            gen_destroy(&problem);
        }
}

/* The obstacle problem, where the block is factored sparsely: with A the free nodes, moving q by
 * M_AA v on A moves z_A by -v, whatever v is. */
static void test_sparse_block(void **state)
{
    perp_lcp_sensitivity_info info;
    perp_lcp_sensitivity *s;
    double *v, *dq, *dz;
    gen_lcp problem;
    int32_t i, j, k, active = 0;

    (void)state;
    gen_obstacle_2d(&problem, 20);
    for (i = 0; i < problem.n; i++)
        if (problem.z[i] == 0.0 && problem.w[i] == 0.0)
            problem.q[i] += 1.0;
    v = check_allocate(3 * (size_t)problem.n, sizeof *v);
    dq = v + problem.n;
    dz = dq + problem.n;
    s = open_at(&info, &problem, problem.z);
    assert_int_equal(info.verdict, PERP_VERDICT_REGULAR);
    for (j = 0; j < problem.n; j++) {
        v[j] = problem.z[j] > 0.0 ? j % 7 - 3.0 : 0.0;
        active += problem.z[j] > 0.0;
        for (k = problem.column_starts[j]; k < problem.column_starts[j + 1]; k++)
            dq[problem.row_indices[k]] += problem.values[k] * v[j];
    }
    assert_int_equal(info.active, active);
    assert_true(active > 64);
    assert_int_equal(perp_lcp_sensitivity_forward(s, dz, dq, NULL, NULL, NULL), PERP_OK);
    for (i = 0; i < problem.n; i++)
        assert_true(fabs(dz[i] + v[i]) <= 1e-12); /* condition below 1e3 */
    perp_lcp_sensitivity_destroy(s);
    free(v);
    gen_destroy(&problem);
}

/* ---- verdicts ------------------------------------------------------------------------------ */

static void test_verdicts(void **state)
{
    static const int M[] = {2, 1, 1, 2}, ones[] = {1, 1, 1, 1};
    static const int edge[] = {-2, -1}, minus[] = {-1, -1};
    static const double edge_z[] = {1, 0}, half[] = {0.5, 0.5}, wrong[] = {1, 0.25};
    static const double dq[] = {1, 0};
    perp_lcp_sensitivity_info info;
    perp_lcp_sensitivity *s;
    double dz[2] = {7, 7};
    int32_t places[2];
    gen_lcp problem;

    (void)state;
    gen_from_integers(&problem, 2, M, edge);
    s = open_at(&info, &problem, edge_z);
    assert_int_equal(info.verdict, PERP_VERDICT_DEGENERATE);
    assert_int_equal(info.index, 1);
    assert_true(info.margin == 0.0 && info.active == 1);
    assert_int_equal(perp_lcp_sensitivity_places(s, places), PERP_OK);
    assert_int_equal(places[0], PERP_PLACE_BETWEEN);
    assert_int_equal(places[1], PERP_PLACE_LOWER);
    /* the piece with z2 = 0 */
    assert_int_equal(perp_lcp_sensitivity_forward(s, dz, dq, NULL, NULL, NULL), PERP_OK);
    /* a root, its square and two divisions are rounded */
    assert_true(fabs(dz[0] + 0.5) <= 4.0 * DBL_EPSILON && dz[1] == 0.0);
    perp_lcp_sensitivity_destroy(s);
    dz[0] = 7;
    s = open_at(&info, &problem, wrong);
    assert_int_equal(info.verdict, PERP_VERDICT_NOT_A_SOLUTION);
    assert_int_equal(info.index, 1); /* w = (0.25, 0.5) where z = (1, 0.25), scaled alike */
    assert_int_equal(perp_lcp_sensitivity_forward(s, dz, dq, NULL, NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    perp_lcp_sensitivity_destroy(s);
    gen_destroy(&problem);
    gen_from_integers(&problem, 2, ones, minus);
    s = open_at(&info, &problem, half);
    assert_int_equal(info.verdict, PERP_VERDICT_SINGULAR);
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, dz, NULL, NULL, dq), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "singular"));
    assert_true(dz[0] == 7);
    perp_lcp_sensitivity_destroy(s);
    gen_destroy(&problem);
}

/* z = 1 between 0 and 5/4, all scales 1: a quarter away from its upper bound. */
static void test_margin(void **state)
{
    static const int M[] = {1}, q[] = {-1};
    double lower = 0.0, upper = 1.25, z = 1.0;
    perp_lcp_sensitivity_info info = fresh_lcp_sensitivity_info();
    perp_lcp_sensitivity *s = NULL;
    gen_lcp problem;

    (void)state;
    gen_from_integers(&problem, 1, M, q);
    assert_int_equal(perp_lcp_sensitivity_create(context, &s, &info, NULL,
                                                 LCP(&problem.view, problem.q, &lower, &upper), &z),
                     PERP_OK);
    assert_true(info.margin == 0.25);
    perp_lcp_sensitivity_destroy(s);
    gen_destroy(&problem);
}

static void test_empty(void **state)
{
    perp_lcp_sensitivity_info info;
    gen_lcp problem;
    perp_lcp_sensitivity *s;

    (void)state;
    gen_from_integers(&problem, 0, NULL, NULL);
    s = open_at(&info, &problem, NULL);
    assert_int_equal(info.verdict, PERP_VERDICT_REGULAR);
    assert_true(info.margin == INFINITY && info.condition == 1.0);
    assert_int_equal(perp_lcp_sensitivity_forward(s, NULL, NULL, NULL, NULL, NULL), PERP_OK);
    assert_int_equal(perp_lcp_sensitivity_adjoint(s, NULL, NULL, NULL, NULL), PERP_OK);
    perp_lcp_sensitivity_destroy(s);
    perp_lcp_sensitivity_destroy(NULL);
    gen_destroy(&problem);
}

/* Rows and columns scaled by powers of two move dz with them, to the bit. */
static void test_scaling(void **state)
{
    gen_random random;
    int32_t i, j, n = 9;
    double dz[9], scaled[9], z[9], dq[9];
    perp_lcp_sensitivity_info info;
    perp_lcp_sensitivity *s;
    gen_lcp problem;
    int exponents[9];

    (void)state;
    gen_seed(&random, 3);
    make_problem(&problem, &random, n, GEN_PD_UNSYMMETRIC, GEN_PLAIN);
    for (i = 0; i < n; i++)
        dq[i] = gen_normal(&random);
    s = open_at(&info, &problem, problem.z);
    assert_int_equal(perp_lcp_sensitivity_forward(s, dz, dq, NULL, NULL, NULL), PERP_OK);
    perp_lcp_sensitivity_destroy(s);
    for (i = 0; i < n; i++)
        exponents[i] = gen_integer(&random, 400) - 200;
    for (i = 0; i < n; i++) {
        z[i] = ldexp(problem.z[i], -exponents[i]);
        problem.q[i] = ldexp(problem.q[i], exponents[i]);
        dq[i] = ldexp(dq[i], exponents[i]);
        for (j = 0; j < n; j++)
            problem.M[i * n + j] = ldexp(problem.M[i * n + j], exponents[i] + exponents[j]);
    }
    s = open_at(&info, &problem, z);
    assert_int_equal(perp_lcp_sensitivity_forward(s, scaled, dq, NULL, NULL, NULL), PERP_OK);
    perp_lcp_sensitivity_destroy(s);
    for (i = 0; i < n; i++)
        assert_true(scaled[i] == ldexp(dz[i], -exponents[i]));
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_differences),  cmocka_unit_test(test_adjoint),
        cmocka_unit_test(test_sparse_block), cmocka_unit_test(test_verdicts),
        cmocka_unit_test(test_margin),       cmocka_unit_test(test_empty),
        cmocka_unit_test(test_scaling),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* perp_lcp_verify: what it says where there is no proof, what it refuses, scaling, memory. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "suite.h"

#include "memory.h"
#include "run.h"

#include "context.h"

static perp_lcp_proof verify_bounded(int32_t n, const double *M, const double *q, const double *l,
                                     const double *u, const double *z)
{
    perp_matrix view = matrix_rows(M, n, n);
    perp_lcp_proof proof = fresh_lcp_proof();

    assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&view, q, l, u), z), PERP_OK);
    return proof;
}

static perp_lcp_proof verify(int32_t n, const double *M, const double *q, const double *z)
{
    return verify_bounded(n, M, q, NULL, NULL, z);
}

/* ---- verdicts ------------------------------------------------------------------------------ */

static void require(perp_lcp_proof proof, int32_t verdict, int32_t index)
{
    assert_int_equal(proof.verdict, verdict);
    assert_int_equal(proof.index, index);
    assert_true((proof.radius < INFINITY) == (verdict == PERP_VERDICT_REGULAR));
}

static void test_verdicts(void **state)
{
    static const double M[] = {2, 1, 1, 2}, ones[] = {1, 1, 1, 1}, q[] = {-3, -3};
    static const double solution[] = {1, 1}, zero[] = {0, 0}, half[] = {0.5, 0.5};
    static const double minus[] = {-1, -1}, edge[] = {-2, -1}, edge_z[] = {1, 0};
    static const double wall[] = {0, -1, -1, 0}, beside[] = {0, 1.25};

    (void)state;
    require(verify(2, M, q, solution), PERP_VERDICT_REGULAR, -1);
    /* reads as z = 0 with w = -3 there: the natural map moves both in */
    require(verify(2, M, q, zero), PERP_VERDICT_REGULAR, -1);
    assert_true(verify(2, M, q, zero).radius >= 1.0);
    /* w = (-1.75, -0.5) at z = (0, 1.25): the reading is {1, 2} once more */
    assert_true(verify(2, M, q, beside).radius >= 1.0);
    /* z1 = 1, z2 = 0, w2 = 0 */
    require(verify(2, M, edge, edge_z), PERP_VERDICT_DEGENERATE, 1);
    require(verify(2, ones, minus, half), PERP_VERDICT_SINGULAR, -1);
    /* unsolvable: {1, 2} has z = (-1, -1), the empty set w = (-1, -1) */
    require(verify(2, wall, minus, half), PERP_VERDICT_NOT_A_SOLUTION, 0);
    require(verify(0, NULL, NULL, NULL), PERP_VERDICT_REGULAR, -1);
    assert_true(verify(0, NULL, NULL, NULL).radius == 0.0);
}

static void test_bounds(void **state)
{
    static const double M[] = {2, 0, 0, 2}, q[] = {-3, 3};
    static const double l[] = {0, -INFINITY}, u[] = {1, INFINITY};
    static const double fixed_l[] = {0.5, -1}, fixed_u[] = {0.5, 1};
    static const double z[] = {1, -1.5}, fixed_z[] = {0.5, -1}, off[] = {0.75, -1};

    (void)state;
    require(verify_bounded(2, M, q, l, u, z), PERP_VERDICT_REGULAR, -1);
    require(verify_bounded(2, M, q, fixed_l, fixed_u, fixed_z), PERP_VERDICT_REGULAR, -1);
    assert_true(verify_bounded(2, M, q, fixed_l, fixed_u, fixed_z).radius == 0.0);
    assert_true(verify_bounded(2, M, q, fixed_l, fixed_u, off).radius >= 0.25);
    assert_true(verify_bounded(2, M, q, fixed_l, fixed_u, off).radius <= 0.25 + 1e-15);
}

/* A matrix that is far from an H-matrix, with every row active: ones beside a diagonal of ones. */
static perp_lcp_proof verify_tridiagonal(int32_t n)
{
    const size_t size = (size_t)n;
    int32_t *starts = check_allocate(size + 1, sizeof *starts), count = 0, i, j;
    int32_t *rows = check_allocate(3 * size, sizeof *rows);
    double *values = check_allocate(3 * size, sizeof *values);
    double *q = check_allocate(2 * size, sizeof *q), *z = q + size;
    perp_lcp_proof proof = fresh_lcp_proof();
    perp_matrix view;

    for (j = 0; j < n; j++) {
        starts[j] = count;
        z[j] = 1.0 + j % 5;
        for (i = j > 0 ? j - 1 : 0; i <= j + 1 && i < n; i++) {
            rows[count] = i;
            values[count++] = i == j ? 1.0 : i < j ? 2.0 : -1.0;
        }
    }
    starts[n] = count;
    for (j = 0; j < n; j++)
        for (i = starts[j]; i < starts[j + 1]; i++)
            q[rows[i]] -= values[i] * z[j];
    view = matrix_csc(n, n, starts, rows, values);
    assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&view, q), z), PERP_OK);
    free(starts);
    free(rows);
    free(values);
    free(q);
    return proof;
}

static void test_too_large(void **state)
{
    (void)state;
    require(verify_tridiagonal(50), PERP_VERDICT_REGULAR, -1);
    require(verify_tridiagonal(150), PERP_VERDICT_REGULAR, -1); /* expanded */
    require(verify_tridiagonal(2100), PERP_VERDICT_TOO_LARGE, -1);
}

static void test_texts(void **state)
{
    (void)state;
    assert_string_equal(perp_lcp_verdict_text(PERP_VERDICT_REGULAR), "regular");
    assert_string_equal(perp_lcp_verdict_text(PERP_VERDICT_NOT_A_SOLUTION), "not a solution");
    assert_string_equal(perp_lcp_verdict_text(PERP_VERDICT_SINGULAR), "singular");
    assert_string_equal(perp_lcp_verdict_text(PERP_VERDICT_DEGENERATE), "degenerate");
    assert_string_equal(perp_lcp_verdict_text(PERP_VERDICT_TOO_LARGE), "too large");
    assert_string_equal(perp_lcp_verdict_text(5), "unknown verdict");
    assert_string_equal(perp_lcp_verdict_text(-1), "unknown verdict");
}

/* ---- scaling ------------------------------------------------------------------------------- */

/* Rows, columns and q scaled by powers of two: the radii follow, to the bit. */
static void test_scaling(void **state)
{
    gen_random random;
    int32_t round, i, j, n = 8;

    (void)state;
    gen_seed(&random, 21);
    for (round = 0; round < 50; round++) {
        gen_lcp problem;
        double z[8], radii[8], scaled[8];
        perp_lcp_proof proof = fresh_lcp_proof(), other = fresh_lcp_proof();
        int exponents[8], power = gen_integer(&random, 600) - 300;

        gen_problem(&problem, &random, n, GEN_PD_UNSYMMETRIC, GEN_PLAIN);
        for (i = 0; i < n; i++) {
            z[i] = problem.z[i] * (1.0 + 1e-9 * gen_normal(&random));
            exponents[i] = gen_integer(&random, 200) - 100;
        }
        assert_int_equal(perp_lcp_verify(context, radii, &proof, LCP(&problem.view, problem.q), z),
                         PERP_OK);
        for (i = 0; i < n; i++) {
            z[i] = ldexp(z[i], power - exponents[i]);
            problem.q[i] = ldexp(problem.q[i], power + exponents[i]);
            for (j = 0; j < n; j++)
                problem.M[i * n + j] = ldexp(problem.M[i * n + j], exponents[i] + exponents[j]);
        }
        assert_int_equal(perp_lcp_verify(context, scaled, &other, LCP(&problem.view, problem.q), z),
                         PERP_OK);
        assert_int_equal(other.verdict, proof.verdict);
        assert_int_equal(other.index, proof.index);
        for (i = 0; i < n; i++)
            assert_true(scaled[i] == ldexp(radii[i], power - exponents[i]));
        gen_destroy(&problem);
    }
}

/* Where numbers below DBL_MIN count for nothing, nothing is claimed that hangs on them. */
static void test_subnormal(void **state)
{
    static const double one = 1.0, tiny = -0x1p-1060, zero = 0.0, upper = 0x1p-1060;
    perp_lcp_proof proof;
#if defined(__SSE2__)
    const unsigned control = _mm_getcsr();

    _mm_setcsr(control | 0x8040); /* flush to zero, denormals are zero */
#endif
    (void)state;
    proof = verify(1, &one, &tiny, &zero); /* z = 2^-1060 */
#if defined(__SSE2__)
    _mm_setcsr(control);
#endif
    assert_true(proof.radius >= 0x1p-1060);
#if defined(__SSE2__)
    _mm_setcsr(control | 0x8040);
#endif
    proof = verify_bounded(1, &one, &one, NULL, &upper, &upper); /* z = 0 */
#if defined(__SSE2__)
    _mm_setcsr(control);
#endif
    assert_true(proof.radius >= 0x1p-1060);
}

/* Scaled, M(1,0) is 2^1025 and overflows; yet w_1 = 2^25 - 2^27 + 1/2 < 0. */
static void test_overflow(void **state)
{
    static const double M[] = {1.0, 0.0, 0.0, 0x1p925, 0x1p-200, -0x1p923, 0.0, 0.0, 1.0};
    static const double q[] = {-0x1p-1000, 0x1p-101, -0x1p-996};
    static const double z[] = {0x1p-1000, 0.0, 0x1p-996};

    (void)state;
    assert_int_not_equal(verify(3, M, q, z).verdict, PERP_VERDICT_REGULAR);
}

/* ---- refusals and memory ------------------------------------------------------------------- */

typedef struct call {
    double M[4], q[2], lower[2], upper[2], z[2], radii[2];
    perp_matrix view;
    perp_lcp_proof proof;
} call;

static void prepare(call *c)
{
    static const call good = {{2, 1, 1, 2}, {-3, -3}, {0, 0}, {9, 9}, {1, 1}, {7, 7}, {0}, {0}};

    *c = good;
    c->view = matrix_rows(c->M, 2, 2);
    c->proof = fresh_lcp_proof();
    c->proof.radius = 5.0;
}

static void refuse(call *c, perp_status expected, const char *words)
{
    const call before = *c;

    assert_int_equal(perp_lcp_verify(context, c->radii, &c->proof,
                                     LCP(&c->view, c->q, c->lower, c->upper), c->z),
                     expected);
    assert_non_null(strstr(perp_context_message(context), words));
    assert_memory_equal(c->radii, before.radii, sizeof c->radii);
    assert_true(c->proof.radius == 5.0);
}

static void test_refusals(void **state)
{
    perp_lcp_proof proof = fresh_lcp_proof();
    call c;

    (void)state;
    prepare(&c);
    assert_int_equal(perp_lcp_verify(NULL, NULL, &proof, LCP(&c.view, c.q), c.z),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_verify(context, NULL, NULL, LCP(&c.view, c.q), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(NULL, c.q), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&c.view), c.z),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&c.view, c.q), NULL),
                     PERP_ERROR_ARGUMENT);
    c.M[1] = NAN;
    refuse(&c, PERP_ERROR_NOT_FINITE, "M(0,1)");
    prepare(&c);
    c.q[1] = INFINITY;
    refuse(&c, PERP_ERROR_NOT_FINITE, "q[1]");
    prepare(&c);
    c.z[0] = NAN;
    refuse(&c, PERP_ERROR_NOT_FINITE, "z[0]");
    prepare(&c);
    c.lower[1] = 10.0;
    refuse(&c, PERP_ERROR_ARGUMENT, "lower[1]");
    prepare(&c);
    c.upper[0] = NAN;
    refuse(&c, PERP_ERROR_NOT_FINITE, "upper[0]");
    prepare(&c);
    c.view.columns = 1;
    refuse(&c, PERP_ERROR_ARGUMENT, "2 by 1");
    prepare(&c);
    c.proof.struct_size = 0;
    refuse(&c, PERP_ERROR_ABI, "proof");
}

static void test_memory(void **state)
{
    int sparse;

    (void)state;
    for (sparse = 0; sparse < 2; sparse++) {
        memory m = {0, 0, 0};
        perp_context_settings settings = memory_settings(&m);
        perp_status status = PERP_ERROR_MEMORY;
        perp_context *limited;
        gen_lcp problem;
        gen_random random;

        gen_seed(&random, 22);
        if (sparse)
            gen_obstacle_2d(&problem, 16);
        else
            gen_problem(&problem, &random, 20, GEN_PD_SYMMETRIC, GEN_MIXED);
        assert_int_equal(perp_context_create(&limited, &settings), PERP_OK);
        for (m.fails_at = 1; status != PERP_OK; m.fails_at++) {
            perp_lcp_proof proof = fresh_lcp_proof();

            m.calls = 0;
            proof.radius = 5.0;
            status = perp_lcp_verify(limited, NULL, &proof,
                                     LCP(&problem.view, problem.q, problem.lower, problem.upper),
                                     problem.z);
            assert_int_equal(m.live, 1); /* the context */
            if (status != PERP_OK) {
                assert_int_equal(status, PERP_ERROR_MEMORY);
                assert_true(proof.radius == 5.0);
            }
        }
        assert_true(m.fails_at > 2);
        gen_destroy(&problem);
        perp_context_destroy(limited);
        assert_int_equal(m.live, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_verdicts),  cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_too_large), cmocka_unit_test(test_texts),
        cmocka_unit_test(test_scaling),   cmocka_unit_test(test_subnormal),
        cmocka_unit_test(test_overflow),  cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* perp_lcp_verify: its claims against exact solutions, and how often it can make one. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "lu_condition.h"

#include "exact.h"
#include "linalg/blas.h"
#include "rational.h"
#include "run.h"

#include "context.h"

static perp_lcp_proof verify(const gen_lcp *problem, double *radii, const double *z)
{
    perp_lcp_proof proof = fresh_lcp_proof();

    assert_int_equal(
        perp_lcp_verify(context, radii, &proof,
                        LCP(&problem->view, problem->q, problem->lower, problem->upper), z),
        PERP_OK);
    return proof;
}

/* Requires |z - numerator / denominator| <= radius, without rounding. */
static void require_near(double z, int64_t numerator, int64_t denominator, double radius)
{
    check_sum sum;
    double size;

    assert_true(llabs(numerator) < INT64_C(1) << 53 && denominator < INT64_C(1) << 53);
    check_sum_clear(&sum);
    check_sum_add(&sum, z, (double)denominator);
    check_sum_add(&sum, (double)numerator, -1.0);
    size = fabs(check_sum_value(&sum, 0));
    check_sum_clear(&sum);
    check_sum_add(&sum, radius, (double)denominator);
    check_sum_add(&sum, size * (1.0 - 4.0 * DBL_EPSILON), -1.0); /* two units, both values */
    assert_true(check_sum_value(&sum, 0) >= 0.0);
}

/* All claims about a problem whose only solution is problem->z, exactly. */
static void require_claims(const gen_lcp *problem, const perp_lcp_proof *proof, const double *radii,
                           const double *z)
{
    int32_t i;

    for (i = 0; i < problem->n; i++) {
        if (proof->verdict != PERP_VERDICT_REGULAR) {
            assert_true(radii[i] == INFINITY);
            continue;
        }
        assert_true(radii[i] <= proof->radius);
        /* differences of numbers within a factor of two of each other are exact, others hardly
         * need to be */
        assert_true(fabs(z[i] - problem->z[i]) <= radii[i] * (1.0 + DBL_EPSILON));
    }
}

static int is_degenerate(const gen_lcp *problem)
{
    int32_t i;

    for (i = 0; i < problem->n; i++) {
        const double l = problem->lower ? problem->lower[i] : 0.0;
        const double u = problem->upper ? problem->upper[i] : INFINITY;

        if (l < u && (problem->z[i] == l || problem->z[i] == u) && problem->w[i] == 0.0)
            return 1;
    }
    return 0;
}

/* ---- claims -------------------------------------------------------------------------------- */

/* Every class with one solution, every kind of bounds, dense and sparse; z exact, as solved, and
 * some way off. */
static void test_classes(void **state)
{
    gen_random random;
    int32_t round, class, bounds, proved = 0, nondegenerate = 0;

    (void)state;
    gen_seed(&random, 11);
    for (round = 0; round < 60; round++)
        for (class = 0; class < GEN_CLASSES; class ++)
            for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
                gen_lcp problem, csc;
                double z[24], radii[24];
                perp_lcp_proof proof;
                int32_t i, n = 1 + gen_integer(&random, 24);
                const double off = round % 3 == 0 ? 0.0 : round % 3 == 1 ? 0x1p-40 : 0x1p-6;

                if (class == GEN_PSD_LOW_RANK)
                    continue;
                gen_problem(&problem, &random, n, class, bounds);
                for (i = 0; i < n; i++)
                    z[i] = problem.z[i] + off * gen_normal(&random);
                proof = verify(&problem, radii, z);
                require_claims(&problem, &proof, radii, z);
                if (!is_degenerate(&problem)) {
                    nondegenerate += off == 0.0;
                    proved += off == 0.0 && proof.verdict == PERP_VERDICT_REGULAR;
                } else {
                    assert_int_not_equal(proof.verdict, PERP_VERDICT_REGULAR);
                }
                gen_to_csc(&csc, &problem);
                csc.lower = problem.lower;
                csc.upper = problem.upper;
                csc.q = problem.q;
                assert_int_equal(verify(&csc, radii, z).verdict, proof.verdict);
                csc.lower = csc.upper = csc.q = NULL;
                gen_destroy(&csc);
                gen_destroy(&problem);
            }
    assert_true(nondegenerate > 100); /* enough to mean something */
    assert_int_equal(proved, nondegenerate);
}

/* Small problems of integers with solutions that no double holds, against rational arithmetic. */
static void test_rational(void **state)
{
    gen_random random;
    int round, claims = 0;

    (void)state;
    gen_seed(&random, 12);
    for (round = 0; round < 600; round++) {
        enum { LARGEST = 6 };
        int M[LARGEST * LARGEST], q[LARGEST], n = 1 + gen_integer(&random, LARGEST), i;
        gen_lcp problem;
        unsigned set;

        for (i = 0; i < n * n; i++)
            M[i] = gen_integer(&random, 19) - 9 + (i % (n + 1) == 0 ? 9 : 0);
        for (i = 0; i < n; i++)
            q[i] = gen_integer(&random, 19) - 12;
        gen_from_integers(&problem, n, M, q);
        for (set = 0; set < 1u << n; set++) {
            int64_t numerators[LARGEST], denominator;
            double z[LARGEST], radii[LARGEST];
            perp_lcp_proof proof;

            if (!rational_basic_solution(n, M, q, set, numerators, &denominator))
                continue;
            for (i = 0; i < n; i++)
                z[i] = (double)numerators[i] / (double)denominator;
            proof = verify(&problem, radii, z);
            assert_int_not_equal(proof.verdict, PERP_VERDICT_TOO_LARGE);
            /* one of the solutions near z; with rounding of z alone it is this one */
            if (proof.verdict != PERP_VERDICT_REGULAR)
                continue;
            assert_true(proof.radius <= 1e-10);
            claims++;
            for (i = 0; i < n; i++)
                require_near(z[i], numerators[i], denominator, radii[i]);
        }
        gen_destroy(&problem);
    }
    assert_true(claims > 400);
}

/* Hilbert's matrix times the least common multiple of its denominators: integers, z = e exactly,
 * the condition grows to 1e20. A proof succeeds up to 1e15, and none is wrong. */
static void test_hilbert(void **state)
{
    double multiple = 1.0;
    int32_t n, i, j;

    (void)state;
    for (n = 1; n <= 15; n++) {
        static const int32_t primes[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29};
        gen_lcp problem;
        perp_lcp_proof proof;
        double radii[15], z[15];
        int32_t p, power;

        gen_hilbert(&problem, n);
        multiple = 1.0;
        for (p = 0; p < 10; p++)
            for (power = primes[p]; power <= 2 * n - 1; power *= primes[p])
                multiple *= primes[p];
        for (i = 0; i < n; i++) {
            problem.q[i] = 0.0;
            for (j = 0; j < n; j++) {
                problem.M[i * n + j] = multiple / (i + j + 1);
                problem.q[i] -= problem.M[i * n + j];
            }
            z[i] = i % 2 ? 1.0 + 1e-9 : 1.0 - DBL_EPSILON;
        }
        proof = verify(&problem, radii, problem.z);
        require_claims(&problem, &proof, radii, problem.z);
        if (n <= 11)
            assert_int_equal(proof.verdict, PERP_VERDICT_REGULAR);
        else if (proof.verdict != PERP_VERDICT_REGULAR)
            assert_int_equal(proof.verdict, PERP_VERDICT_SINGULAR);
        proof = verify(&problem, radii, z);
        require_claims(&problem, &proof, radii, z);
        gen_destroy(&problem);
    }
}

/* ---- use ----------------------------------------------------------------------------------- */

/* Nondegenerate problems of condition up to 1e10, solved by the library: at least 99 of 100 are
 * proved, with a radius of at most 1e3 cond eps |z|. M = Q diag(d) Q' + skew, Q a product of
 * reflections. */
static void make_conditioned(gen_lcp *problem, gen_random *random, int32_t n, double log_condition)
{
    double v[40];
    int32_t i, j, k;

    gen_problem(problem, random, n, GEN_PD_SYMMETRIC, GEN_PLAIN);
    for (i = 0; i < n * n; i++)
        problem->M[i] =
            i % (n + 1) == 0 ? exp2(-log_condition * (i / (n + 1)) / (n > 1 ? n - 1 : 1)) : 0.0;
    for (k = 0; k < 2 * 3; k++) { /* three reflections, from the left and from the right */
        double norm = 0.0;

        for (i = 0; i < n && k % 2 == 0; i++)
            v[i] = gen_normal(random);
        for (i = 0; i < n; i++)
            norm += v[i] * v[i];
        for (i = 0; i < n; i++) {
            const int32_t line = k % 2 == 0 ? 1 : n, step = k % 2 == 0 ? n : 1;
            double dot = 0.0;

            for (j = 0; j < n; j++)
                dot += v[j] * problem->M[i * line + j * step];
            for (j = 0; j < n; j++)
                problem->M[i * line + j * step] -= 2.0 * dot / norm * v[j];
        }
    }
    for (i = 0; i < n; i++) {
        problem->z[i] = gen_integer(random, 2) ? gen_uniform(random, 0.01, 2.0) : 0.0;
        problem->q[i] = problem->z[i] > 0.0 ? 0.0 : gen_uniform(random, 0.01, 2.0);
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            problem->q[i] -= problem->M[i * n + j] * problem->z[j];
}

static double condition_of(const gen_lcp *problem)
{
    const int32_t n = problem->n;
    double LU[40 * 40], work[160], norm = 0.0;
    int32_t pivots[40], i, j;

    for (j = 0; j < n; j++) {
        double sum = 0.0;

        for (i = 0; i < n; i++) {
            LU[i + n * j] = problem->M[i * n + j];
            sum += fabs(LU[i + n * j]);
        }
        check_raise(&norm, sum);
    }
    if (perp__lu_factor(n, LU, n, pivots) != 0)
        return INFINITY;
    return 1.0 / lu_condition(n, LU, n, norm, work, pivots);
}

static void test_usefulness(void **state)
{
    gen_random random;
    int round, solved = 0, proved = 0, narrow = 0;

    (void)state;
    gen_seed(&random, 13);
    for (round = 0; round < 400; round++) {
        double radii[40], condition, size = 0.0;
        perp_lcp_proof proof;
        gen_lcp problem;
        int32_t i;
        run r;

        /* log2(1e10) = 33.2; of a random basis the 1-norm's condition is a few times as large */
        make_conditioned(&problem, &random, 1 + gen_integer(&random, 40),
                         gen_uniform(&random, 0.0, 30.0));
        condition = condition_of(&problem);
        run_lcp(&r, context, &problem, NULL, NULL, "usefulness");
        if (run_ok(&r) && condition <= 1e10) {
            solved++;
            for (i = 0; i < problem.n; i++)
                check_raise(&size, fabs(r.z[i]));
            proof = verify(&problem, radii, r.z);
            proved += proof.verdict == PERP_VERDICT_REGULAR;
            narrow += proof.radius <= 1e3 * condition * DBL_EPSILON * size;
        }
        run_release(&r);
        gen_destroy(&problem);
    }
    assert_true(solved > 300);
    assert_true(100 * proved >= 99 * solved);
    assert_int_equal(narrow, proved);
}

/* A block of the 2-D obstacle problem that only sparse factorisations can take. */
static void test_sparse(void **state)
{
    gen_lcp problem;
    perp_lcp_proof proof;
    double *radii;
    int32_t i;

    (void)state;
    gen_obstacle_2d(&problem, 80);
    radii = check_allocate((size_t)problem.n, sizeof *radii);
    for (i = 0; i < problem.n; i++)
        if (problem.z[i] == 0.0 && problem.w[i] == 0.0)
            problem.q[i] += 1.0; /* no degenerate pair */
    proof = verify(&problem, radii, problem.z);
    assert_int_equal(proof.verdict, PERP_VERDICT_REGULAR);
    assert_true(proof.radius <= 1e-16); /* z is exact; a tenth of the last place of its entries */
    require_claims(&problem, &proof, radii, problem.z);
    /* another sign somewhere: still an H-matrix, no longer a Z-matrix */
    problem.values[problem.column_starts[3000] + 1] *= -1.0;
    proof = verify(&problem, radii, problem.z);
    assert_int_not_equal(proof.verdict, PERP_VERDICT_SINGULAR);
    assert_int_not_equal(proof.verdict, PERP_VERDICT_TOO_LARGE);
    free(radii);
    gen_destroy(&problem);
}

/* ---- the last bits ------------------------------------------------------------------------- */

/* w_0 = 1 + t + s - 1 - s + r in all orders, t = -2^-130, s = 2^-60, r = 2^-200: below 0, exactly,
 * but where t is added beside s and that beside 1 doubled precision keeps r alone, which is not. */
static void test_lost_in_doubled_precision(void **state)
{
    static const double terms[] = {-0x1p-130, 0x1p-60, -1.0, -0x1p-60, 0x1p-200};
    int order, storage, i;

    (void)state;
    for (order = 0; order < 120; order++)
        for (storage = 0; storage < 2; storage++) {
            double M[36] = {0}, q[6] = {1.0}, l[6] = {0}, u[6] = {INFINITY}, z[6] = {0}, left[5];
            perp_lcp_proof proof = fresh_lcp_proof();
            perp_matrix view = fresh_matrix();
            check_sum sum;
            int rest = order, n = 6;

            memcpy(left, terms, sizeof left);
            check_sum_clear(&sum);
            check_sum_add(&sum, 1.0, 1.0);
            for (i = 1; i < n; i++) { /* z_i = 1, fixed */
                const int k = rest % (n - i);

                rest /= n - i;
                M[storage == 0 ? i : 6 * i] = left[k];
                check_sum_add(&sum, left[k], 1.0);
                memmove(left + k, left + k + 1, (size_t)(n - i - k - 1) * sizeof *left);
                l[i] = u[i] = z[i] = 1.0;
            }
            for (i = 0; i < n; i++)
                M[7 * i] = 1.0;
            assert_true(check_sum_value(&sum, 0) < 0.0);
            perp_matrix_dense(&view,
                              storage == 0 ? PERP_STORAGE_ROW_MAJOR : PERP_STORAGE_COLUMN_MAJOR, n,
                              n, M, n);
            assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&view, q, l, u), z),
                             PERP_OK);
            assert_int_not_equal(proof.verdict, PERP_VERDICT_REGULAR);
        }
}

/* Row 0 is a combination of equations that determine the others, so that w_0 is 0 but for the tiny
 * number that a fixed variable adds: its sign is known exactly, whatever the solution (thirds and
 * sevenths) is, and no claim may contradict it. */
static void test_signs_of_tiny_sums(void **state)
{
    enum { LARGEST = 5 };
    gen_random random;
    int round, proved = 0;

    (void)state;
    gen_seed(&random, 77);
    for (round = 0; round < 20000; round++) {
        const int32_t m = 1 + gen_integer(&random, LARGEST - 2), n = m + 2;
        const double tiny =
            ldexp(gen_integer(&random, 2) ? 1.0 : -1.0, -60 - gen_integer(&random, 60));
        double M[LARGEST * LARGEST] = {0}, q[LARGEST] = {0}, z[LARGEST] = {0};
        double l[LARGEST], u[LARGEST];
        int64_t A[LARGEST * LARGEST], b[LARGEST], x[LARGEST], det;
        perp_lcp_proof proof = fresh_lcp_proof();
        perp_matrix view;
        int32_t i, j;

        for (i = 1; i <= m; i++) {
            const double c = gen_integer(&random, 7) - 3;

            l[i] = -INFINITY;
            u[i] = INFINITY;
            q[i] = gen_integer(&random, 19) - 9;
            b[i - 1] = -(int64_t)q[i];
            q[0] += c * q[i];
            for (j = 1; j <= m; j++) {
                M[n * i + j] = gen_integer(&random, 19) - 9;
                A[m * (i - 1) + j - 1] = (int64_t)M[n * i + j];
                M[j] += c * M[n * i + j];
            }
        }
        det = rational_solve(m, A, b, x);
        if (det == 0)
            continue;
        for (i = 1; i <= m; i++)
            z[i] = (double)x[i - 1] / (double)det;
        M[n * n - 1] = z[n - 1] = l[n - 1] = u[n - 1] = 1.0;
        z[0] = -1.0; /* M_00 = 0: read as at its bound, whatever rounding says of w_0 */
        M[n - 1] = tiny;
        l[0] = 0.0;
        u[0] = INFINITY;
        view = matrix_rows(M, n, n);
        assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&view, q, l, u), z), PERP_OK);
        if (proof.verdict == PERP_VERDICT_REGULAR)
            assert_true(tiny > 0.0);
        if (proof.verdict == PERP_VERDICT_NOT_A_SOLUTION)
            assert_true(tiny < 0.0);
        proved +=
            proof.verdict == PERP_VERDICT_REGULAR || proof.verdict == PERP_VERDICT_NOT_A_SOLUTION;
    }
    assert_true(proved > 1000);
}

/* A block of determinant 1 and integers so large that an approximate inverse is hardly one: what
 * refinement leaves of a start that is off by 1/4 may be as large as before, and so is the doubt
 * about w_2 = z_0 - z*_0 + d, which depends on no z but that: without z_2 in it, w_2 = d at every
 * solution of the equations, and there is a solution if and only if d >= 0. */
static void test_doubt_about_the_block(void **state)
{
    gen_random random;
    int round, proved = 0, refuted = 0, doubtful = 0;

    (void)state;
    gen_seed(&random, 78);
    for (round = 0; round < 20000; round++) {
        static const double l[3] = {-INFINITY, -INFINITY, 0}, u[3] = {INFINITY, INFINITY, INFINITY};
        const double limit = ldexp(1.0, 24 + round % 4), exact[2] = {3, -5};
        const double d = ldexp(gen_integer(&random, 2) ? 1.0 : -1.0, -gen_integer(&random, 20) - 3);
        double A[4] = {1, 0, 0, 1}, M[9] = {0}, q[3], z[3] = {0, 0, -1};
        perp_lcp_proof proof = fresh_lcp_proof();
        perp_matrix view;
        int32_t i;

        while (fmax(fmax(fabs(A[0]), fabs(A[1])), fmax(fabs(A[2]), fabs(A[3]))) < limit) {
            const int row = gen_integer(&random, 2);
            const double times = 1 + gen_integer(&random, 30);

            A[2 * row] += times * A[2 - 2 * row]; /* of determinant 1 again */
            A[2 * row + 1] += times * A[3 - 2 * row];
        }
        for (i = 0; i < 2; i++) {
            M[3 * i] = A[2 * i];
            M[3 * i + 1] = A[2 * i + 1];
            q[i] = -(A[2 * i] * exact[0] + A[2 * i + 1] * exact[1]);
            z[i] = exact[i] + 0.25 * gen_normal(&random);
        }
        M[6] = 1.0;
        q[2] = d - exact[0];
        view = matrix_rows(M, 3, 3);
        assert_int_equal(perp_lcp_verify(context, NULL, &proof, LCP(&view, q, l, u), z), PERP_OK);
        if (proof.verdict == PERP_VERDICT_REGULAR)
            assert_true(d > 0.0);
        if (proof.verdict == PERP_VERDICT_NOT_A_SOLUTION)
            assert_true(d < 0.0);
        proved += proof.verdict == PERP_VERDICT_REGULAR;
        refuted += proof.verdict == PERP_VERDICT_NOT_A_SOLUTION;
        doubtful += proof.verdict == PERP_VERDICT_DEGENERATE;
    }
    assert_true(proved > 100 && refuted > 100 && doubtful > 100);
}

/* z* = 1e308 lies farther from z = -1.7e308 than doubles reach: no radius, no proof. Nor where z,
 * in units of q, is beyond them. */
static void test_no_infinite_radius(void **state)
{
    const double M = 1e-300, q = -1e8, l = -INFINITY, u = INFINITY, z = -1.7e308;
    const double minus = -1.0, small = -1e-300, large = 1e300;
    double radius = 0.0;
    perp_lcp_proof proof = fresh_lcp_proof();
    perp_matrix view, view_1;

    (void)state;
    view = matrix_rows(&M, 1, 1);
    view_1 = matrix_rows(&minus, 1, 1);
    assert_int_equal(perp_lcp_verify(context, &radius, &proof, LCP(&view, &q, &l, &u), &z),
                     PERP_OK);
    assert_int_equal(proof.verdict, PERP_VERDICT_SINGULAR);
    assert_true(radius == INFINITY && proof.radius == INFINITY);
    assert_int_equal(perp_lcp_verify(context, &radius, &proof, LCP(&view_1, &small), &large),
                     PERP_OK);
    assert_int_equal(proof.verdict, PERP_VERDICT_SINGULAR);
    assert_int_equal(proof.index, -1);
    assert_true(radius == INFINITY && proof.radius == INFINITY);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_classes),
        cmocka_unit_test(test_rational),
        cmocka_unit_test(test_hilbert),
        cmocka_unit_test(test_usefulness),
        cmocka_unit_test(test_sparse),
        cmocka_unit_test(test_lost_in_doubled_precision),
        cmocka_unit_test(test_signs_of_tiny_sums),
        cmocka_unit_test(test_doubt_about_the_block),
        cmocka_unit_test(test_no_infinite_radius),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

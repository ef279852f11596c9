/* The judge of points: what is doubted, what is compared with what, and which candidate stays. The
 * points are made by hand, and what they violate follows from exact sums. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include "gen.h"
#include "lcp/solver.h"

#include "posed.h"

static perp_outcome judged(perp_lcp_solver *solver, const double *z)
{
    perp__evaluation residuals;

    memcpy(solver->z, z, (size_t)solver->n * sizeof *z);
    residuals = perp__evaluate(solver);
    return perp__lcp_outcome_of(solver, &residuals, PERP_OUTCOME_STALLED);
}

static perp_outcome verdict(int32_t n, const double *entries, const double *lower,
                            const double *upper, const double *q, const double *z)
{
    perp_lcp_solver *solver = posed(n, entries, lower, upper, q);
    const perp_outcome outcome = judged(solver, z);

    perp_lcp_solver_destroy(solver);
    return outcome;
}

/* z_0 to z_3 are fixed, w_4 = z_0 + z_1 - z_2 - z_3 + z_4 +- 1 = +-1 at z_4 = 0, its bound, on the
 * wrong side of 0. Beside z_0 doubled precision keeps 2^56, beside that no 1: it gives w_4 = 0,
 * where w_4 may be anything. */
static void test_lost_beside_large_z(void **state)
{
    static const double M[25] = {1, 0, 0, 0, 0, 0, 1, 0, 0, 0,  0,  0, 1,
                                 0, 0, 0, 0, 0, 1, 0, 1, 1, -1, -1, 1};
    static const double z[5] = {0x1p110, 0x1p56, 0x1p56, 0x1p110, 0};
    int32_t sign;

    (void)state;
    for (sign = -1; sign <= 1; sign += 2) {
        const double q[5] = {1, 1, 1, 1, sign};
        double lower[5], upper[5];

        memcpy(lower, z, sizeof z);
        memcpy(upper, z, sizeof z);
        lower[4] = sign < 0 ? 0.0 : -INFINITY;
        upper[4] = sign < 0 ? INFINITY : 0.0;
        assert_int_equal(verdict(5, M, lower, upper, q, z), PERP_OUTCOME_STALLED);
    }
}

/* A verified ray stays where a point is no answer, however near; a good point takes its place, and
 * of good ones the better. */
static void test_which_candidate_stays(void **state)
{
    static const double M = 1, q = -1;
    perp_lcp_solver *solver = posed(1, &M, NULL, NULL, &q);

    (void)state;
    memset(&solver->best.residuals, 0, sizeof solver->best.residuals);
    solver->best.residuals.tested = 1.0;
    solver->best.outcome = PERP_OUTCOME_RAY;
    solver->best.method = PERP_LCP_LEMKE;
    solver->z[0] = 0.75;
    perp__consider_point(solver, PERP_LCP_PGS, PERP_OUTCOME_STALLED);
    assert_int_equal(solver->best.outcome, PERP_OUTCOME_RAY);
    solver->z[0] = 1.0 + 1e-12;
    perp__consider_point(solver, PERP_LCP_PGS, PERP_OUTCOME_STALLED);
    assert_int_equal(solver->best.outcome, PERP_OUTCOME_SOLVED);
    solver->z[0] = 1.0 + 2e-12;
    perp__consider_point(solver, PERP_LCP_PGS, PERP_OUTCOME_STALLED);
    assert_true(solver->best.z[0] == 1.0 + 1e-12);
    solver->z[0] = 1.0;
    perp__consider_point(solver, PERP_LCP_PGS, PERP_OUTCOME_STALLED);
    assert_true(solver->best.z[0] == 1.0);
    solver->z[0] = 0.5;
    perp__consider_point(solver, PERP_LCP_PGS, PERP_OUTCOME_STALLED);
    assert_true(solver->best.z[0] == 1.0);
    perp_lcp_solver_destroy(solver);
}

/* A method that ends at infinity has offered nothing: the start is the candidate. */
static void test_a_point_out_of_range(void **state)
{
    static const double M = 1, q = -1, z0 = 0.5;
    perp_lcp_solver *solver = posed(1, &M, NULL, NULL, &q);
    perp__lcp_iterate iterate;
    perp__plan_step step;

    (void)state;
    memset(&iterate, 0, sizeof iterate);
    memset(&step, 0, sizeof step);
    step.method = PERP_LCP_PGS;
    step.rough = 1;
    solver->best.method = -1;
    solver->z[0] = INFINITY;
    assert_int_equal(perp__consider(solver, &step, PERP_OUTCOME_ITERATION_LIMIT, &iterate, &z0),
                     PERP_OK);
    assert_true(solver->best.z[0] == 0.5 && solver->best.residuals.tested == 0.5);
    assert_int_equal(solver->best.outcome, PERP_OUTCOME_STALLED);
    perp_lcp_solver_destroy(solver);
}

/* The residuals of a batch have no dimension either: z and w of 2^-700 round as those of 1 do, to
 * eps of eps, 2^-106, at the least, where they are not 0. */
static void test_a_batch_of_small_numbers(void **state)
{
    enum { COUNT = 64, N = 6 };
    static double M[COUNT * N * N], q[COUNT * N], z[COUNT * N], residuals[COUNT];
    int32_t outcomes[COUNT], rounded = 0, k, i;
    gen_random random;

    (void)state;
    gen_seed(&random, 79);
    for (i = 0; i < COUNT * N * N; i++)
        M[i] = gen_uniform(&random, -1, 1) + (i % (N * N) % (N + 1) == 0 ? 8.0 : 0.0);
    for (i = 0; i < COUNT * N; i++)
        q[i] = ldexp(gen_uniform(&random, -1, 1), -700);
    assert_int_equal(perp_lcp_batch(context, z, NULL, outcomes, residuals, NULL, 1,
                                    LCP_STACK(COUNT, N, M, q, NULL, NULL)),
                     PERP_OK);
    for (k = 0; k < COUNT; k++) {
        assert_int_equal(outcomes[k], PERP_OUTCOME_SOLVED);
        assert_true(residuals[k] == 0.0 || residuals[k] >= 0x1p-106);
        rounded += residuals[k] > 0.0;
    }
    assert_true(rounded > 0);
}

/* z = 1e-11 where w = 1: beside the 1 that row 0 carries, z is on its bound. 1e-9 is not. */
static void test_next_to_a_bound(void **state)
{
    static const double M = 1, q = 1, near = 1e-11, far = 1e-9;
    perp_lcp_solver *solver = posed(1, &M, NULL, NULL, &q);

    (void)state;
    assert_int_equal(judged(solver, &near), PERP_OUTCOME_SOLVED);
    assert_int_equal(judged(solver, &far), PERP_OUTCOME_STALLED);
    perp_lcp_solver_destroy(solver);
}

/* Rows of terms 2, 2^-12 and 2^-26 that cancel, in a chain, each coupled by 2^-13, which is
 * significant: row 2 may miss 16 units of rounding of the largest, 2^-47, whatever tol and its own
 * terms, no more. */
static void test_rounding_beside_the_largest(void **state)
{
    static const double M[9] = {1, 0, 0, 0x1p-13, 1, 0, 0, 0x1p-13, 1};
    static const double z[3] = {1, 0x1p-27, 0x1p-27};
    const double missing[] = {0x1p-47, 0x1p-46};
    int32_t k;

    (void)state;
    for (k = 0; k < 2; k++) {
        const double q[3] = {-1, -0x1p-13 - 0x1p-27, -0x1p-27 - 0x1p-40 - missing[k]};
        perp_lcp_solver *solver = posed(3, M, NULL, NULL, q);

        solver->settings.tol = 1e-12; /* a hundred-thousandth of that is less than rounding */
        assert_int_equal(judged(solver, z), k ? PERP_OUTCOME_STALLED : PERP_OUTCOME_SOLVED);
        perp_lcp_solver_destroy(solver);
    }
}

/* w_0 = -1e-16 at z_0 = 0 beside terms of 1e-12 or of its own size: no rounding of the large row
 * explains it where their coupling is noise, nor where nothing cancels in that row. */
static void test_what_excuses_nothing(void **state)
{
    static const double M[2][4] = {{1, 1e-12, 0, 1}, {1, 0, 1, 1}};
    static const double q[2][2] = {{-1e-12 - 1e-16, -1}, {-1e-16, 1}}, z[2][2] = {{0, 1}, {0, 0}};
    int32_t k;

    (void)state;
    for (k = 0; k < 2; k++) {
        assert_int_equal(verdict(2, M[k], NULL, NULL, q[k], z[k]), PERP_OUTCOME_STALLED);
    }
}

/* 8 z_1 + z_0 = 0 at z_1 = 0 and z_0 fixed at the smallest number: violated by all that it is,
 * though in units of the row that is 0. */
static void test_underflow_excuses_nothing(void **state)
{
    static const double M[4] = {8, 0, 1, 8}, q[2] = {0, 0}, z[2] = {0x1p-1074, 0};
    static const double lower[2] = {0x1p-1074, -INFINITY}, upper[2] = {0x1p-1074, INFINITY};

    (void)state;
    assert_int_equal(verdict(2, M, lower, upper, q, z), PERP_OUTCOME_STALLED);
}

/* Two equations, 3 z_1 = 3 and z_0 = -1e-6, and noise of either sign on the diagonal: at (0, 1) z_0
 * is wrong by 1e-6, though in units that make one of the diagonals 1 that is nothing. */
static void test_noise_on_the_diagonal(void **state)
{
    static const double lower[2] = {-INFINITY, -INFINITY}, upper[2] = {INFINITY, INFINITY};
    static const double q[2] = {3, 1e-6}, wrong[2] = {0, 1}, right[2] = {-1e-6 + 1e-12, 1};
    int32_t sign;

    (void)state;
    for (sign = -1; sign <= 1; sign += 2) {
        const double M[4] = {sign * 1e-12, -3, 1, -sign * 1e-12};
        perp_lcp_solver *solver = posed(2, M, lower, upper, q);

        assert_int_equal(judged(solver, wrong), PERP_OUTCOME_STALLED);
        if (sign > 0) /* w = (-1e-18, 0) */
            assert_int_equal(judged(solver, right), PERP_OUTCOME_SOLVED);
        perp_lcp_solver_destroy(solver);
    }
}

/* The same two equations apart but for noise on the diagonal, 3 z_1 = 3 and z_0 = -1e-16: nothing
 * that row 0 carries is passed on to z_0, so (0, 1) is as wrong as it is without the noise. */
static void test_noise_ties_nothing(void **state)
{
    static const double lower[2] = {-INFINITY, -INFINITY}, upper[2] = {INFINITY, INFINITY};
    static const double q[2] = {3, 1e-16}, wrong[2] = {0, 1};
    static const double noise[] = {0.0, 1e-20, 1e-300};
    int32_t k;

    (void)state;
    for (k = 0; k < 3; k++) {
        const double M[4] = {noise[k], -3, 1, noise[k]}, right[2] = {-1e-16 - noise[k], 1};
        perp_lcp_solver *solver = posed(2, M, lower, upper, q);

        assert_int_equal(judged(solver, wrong), PERP_OUTCOME_STALLED);
        assert_int_equal(judged(solver, right), PERP_OUTCOME_SOLVED);
        perp_lcp_solver_destroy(solver);
    }
}

/* z_0 <= 0.1 leaves row 1, 1 - 4 z_0 = 0, no solution, whatever the noise d on the diagonal; nor
 * does z_0 = 1 + 1e-4 solve -2 z_0 + 2 = 0 below a row with such a diagonal. */
static void test_noise_is_no_unit(void **state)
{
    static const double lower[3] = {0, -INFINITY, -INFINITY};
    static const double upper[3] = {0.1, INFINITY, INFINITY}, q[3] = {1, 1, 0}, q3[3] = {1, 2, 0};
    static const double noise[] = {-1e-308, -1e-30, -1e-13, 1e-13, 1e-30, 1e-300};
    static const double M3[9] = {-1e-12, 1e-12, -3, -2, 0, 0, 0, 0, 0};
    static const double free_lower[3] = {-INFINITY, -INFINITY, -INFINITY};
    static const double free_upper[3] = {INFINITY, INFINITY, INFINITY};
    static const double right[3] = {1, 0, (1 - 1e-12) / 3};
    static const double wrong[3] = {1 + 1e-4, 0, (1 - 1e-12) / 3};
    perp_lcp_solver *solver;
    int32_t k;

    (void)state;
    for (k = 0; k < 6; k++) {
        const double M[4] = {noise[k], 4, -4, 0}, z[2] = {0.1, -0.25 - 0.025 * noise[k]};

        assert_int_equal(verdict(2, M, lower, upper, q, z), PERP_OUTCOME_STALLED);
    }
    solver = posed(3, M3, free_lower, free_upper, q3);
    assert_int_equal(judged(solver, wrong), PERP_OUTCOME_STALLED);
    assert_int_equal(judged(solver, right), PERP_OUTCOME_SOLVED);
    perp_lcp_solver_destroy(solver);
}

/* w_1 = -4.2 at z_1 = 0, in a KKT system with noise of 1e-16 in the place of a zero: in units of
 * row 3 that are found from it that is 1e-15. And an equation off by a seventh of its terms, with
 * as much noise on two diagonals, which agree with each other about units of 1e8. */
static void test_noise_that_agrees(void **state)
{
    static const double M[16] = {0, -3, -1, -1, 3, 0, -1, -2, 1, 1, 1, -1e-16, 1, 2, -1e-16, 0};
    static const double q[4] = {1, -3, 2, -0.25}, z[4] = {0.25, 0, 0, 1};
    static const double N[16] = {-3, -3,    -2,    0.5, -1,   -1, 0.25, -3,
                                 2,  -0.25, 4e-15, 0,   -0.5, 3,  0,    4e-15};
    static const double lower[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    static const double upper[4] = {INFINITY, INFINITY, INFINITY, INFINITY};
    static const double p[4] = {0.5, -1, 1, -0.25}, wrong[4] = {-0.5, 0, 1, 0};

    (void)state;
    assert_int_equal(verdict(4, M, NULL, NULL, q, z), PERP_OUTCOME_STALLED);
    assert_int_equal(verdict(4, N, lower, upper, p, wrong), PERP_OUTCOME_STALLED);
}

/* Three equations, z = (0, -1/2, 0), with noise on the diagonals of the outer ones. In units that
 * these give, the middle row is small; it is off by 5e-5 of its terms all the same. */
static void test_couplings_that_units_of_noise_leave(void **state)
{
    static const double M[9] = {5e-11, -3, -2, 0.25, -0.25, 0.5, -1, 2, 4e-11};
    static const double lower[3] = {-INFINITY, -INFINITY, -INFINITY};
    static const double upper[3] = {INFINITY, INFINITY, INFINITY};
    static const double q[3] = {-1.5, -0.125, 1}, off[3] = {-1.5, -0.1250125, 1},
                        z[3] = {0, -0.5, 0};

    (void)state;
    assert_int_equal(verdict(3, M, lower, upper, q, z), PERP_OUTCOME_SOLVED);
    assert_int_equal(verdict(3, M, lower, upper, off, z), PERP_OUTCOME_STALLED);
}

/* At the end of doubles. w_1 = largest at z_1 = 0, off its bound by less than any unit holds; w_1 =
 * -largest at z_1 = 0, where the upper bound, 1e-308, gives w_0 another sign; w_2 = -4 at z_1 = 0
 * instead of 2e-308, though the units of rows 1 and 2 are as far apart as units get. */
static void test_the_end_of_doubles(void **state)
{
    static const double M[4] = {1e-300, DBL_MAX, DBL_MAX, 1e-200}, q[2] = {0, DBL_MAX};
    static const double lower[2] = {8.69e-311, -5e-324}, upper[2] = {INFINITY, INFINITY};
    static const double near[2] = {8.69e-311, 0};
    static const double M2[4] = {1e-308, -100, 100, 1e-308}, q2[2] = {1e-308, -DBL_MAX};
    static const double lower2[2] = {0, 0}, upper2[2] = {1e200, 1e-308}, wrong[2] = {0, 0};
    static const double M3[9] = {8e-105, 5e104, 0, 0, 4, 1e300, 0, DBL_MAX, 4e-300};
    static const double q3[3] = {1e-154, 1e100, -4}, lost[3] = {-1e-154 / 8e-105, 0, -1e-200};
    static const double lower3[3] = {-INFINITY, -INFINITY, -INFINITY};
    static const double upper3[3] = {INFINITY, INFINITY, INFINITY};

    (void)state;
    assert_int_equal(verdict(2, M, lower, upper, q, near), PERP_OUTCOME_STALLED);
    assert_int_equal(verdict(2, M2, lower2, upper2, q2, wrong), PERP_OUTCOME_STALLED);
    assert_int_equal(verdict(3, M3, lower3, upper3, q3, lost), PERP_OUTCOME_STALLED);
}

/* Row 1 is small, but z_0 carries what rounding leaves of row 0's ones: 2^-10 of tol 2 is passed on
 * to it, by far more than its own terms, 2^-26, and the floor of 1e-5 grant. Ten times that is not.
 */
static void test_roundings_travel(void **state)
{
    static const double M[9] = {1, 0, 1, 0x1p-10, 1, 0, 0, 0, 1};
    static const double lower[3] = {-INFINITY, -INFINITY, -INFINITY};
    static const double upper[3] = {INFINITY, INFINITY, INFINITY};
    static const double z[3] = {0x1p-20, 0x1p-27, 1}, missing[] = {0x1p-43, 0x1p-40};
    int32_t k;

    (void)state;
    for (k = 0; k < 2; k++) {
        const double q[3] = {-1 - 0x1p-20, -0x1p-30 - 0x1p-27 - missing[k], -1};
        perp_lcp_solver *solver = posed(3, M, lower, upper, q);

        solver->settings.tol = 1e-10;
        assert_int_equal(judged(solver, z), k ? PERP_OUTCOME_STALLED : PERP_OUTCOME_SOLVED);
        perp_lcp_solver_destroy(solver);
    }
}

/* As above with a looser tol: a millionth is 2e-2 of what row 2 and its neighbours are made of. */
static void test_small_rows_count(void **state)
{
    static const double M[9] = {1, 0, 0, 0x1p-8, 1, 0, 0, 0x1p-8, 1};
    static const double q[3] = {-1, -0x1p-8 - 0x1p-20, -0x1p-28 - 0x1p-20 - 0x1p-20};
    static const double z[3] = {1, 0x1p-20, 0x1p-20};
    perp_lcp_solver *solver = posed(3, M, NULL, NULL, q);

    (void)state;
    solver->settings.tol = 1e-6;
    assert_int_equal(judged(solver, z), PERP_OUTCOME_STALLED);
    perp_lcp_solver_destroy(solver);
}

/* w_0 = -1e300 at z_0's bound, the largest double: what z_0 may be overflows, and is not next to an
 * upper bound at infinity for that. */
static void test_next_to_infinity(void **state)
{
    static const double M[4] = {0, -1e129, 0, 0}, q[2] = {-1e300, 0};
    static const double lower[2] = {DBL_MAX, 1e154}, upper[2] = {INFINITY, INFINITY};
    int32_t scaling;

    (void)state;
    for (scaling = 0; scaling < 2; scaling++) {
        perp_lcp_solver *solver = posed(2, M, lower, upper, q);
        perp_lcp_settings settings = solver->settings;
        perp__evaluation residuals;
        perp_matrix view;

        settings.scaling = scaling;
        assert_int_equal(perp_lcp_solver_set(solver, &settings), PERP_OK);
        view = matrix_rows(M, 2, 2);
        assert_int_equal(perp_lcp_solver_setup(solver, &view, lower, upper), PERP_OK);
        perp__scale_problem(solver, q);
        memcpy(solver->z, lower, sizeof lower);
        residuals = perp__evaluate(solver);
        assert_true(perp__lcp_evidence(solver, &residuals, DBL_MAX).own_residual >=
                    0.5); /* of its terms */
        perp_lcp_solver_destroy(solver);
    }
}

/* A variable that no row and no number holds: at infinity it is no answer, whatever w is. */
static void test_not_finite(void **state)
{
    static const int32_t starts[3] = {0, 0, 1}, rows[1] = {1};
    static const double values[1] = {1}, q[2] = {0, -1}, z[2] = {0, 1}, away[2] = {INFINITY, 1};
    perp_lcp_solver *solver = NULL;
    perp_matrix M;

    (void)state;
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    M = matrix_csc(2, 2, starts, rows, values);
    assert_int_equal(perp_lcp_solver_setup(solver, &M, NULL, NULL), PERP_OK);
    perp__scale_problem(solver, q);
    assert_int_equal(judged(solver, z), PERP_OUTCOME_SOLVED);
    assert_int_equal(judged(solver, away), PERP_OUTCOME_STALLED);
    perp_lcp_solver_destroy(solver);
}

/* z_j = 2^990 for all but the last, where w = 2^39 2^990 + ... is beyond the range of doubles: no
 * answer, though z_last = 0 is at its bound. One number at a time, in vectors of 4 and of 8. */
static void test_w_out_of_range(void **state)
{
    static const int32_t sizes[] = {3, 4, 8, 11};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const int32_t n = sizes[k];
        double M[11 * 11] = {0}, q[11], z[11];
        int32_t j;

        for (j = 0; j < n; j++) {
            M[j * n + j] = M[(n - 1) * n + j] = 1;
            z[j] = j < n - 1 ? 0x1p990 : 0;
            q[j] = -z[j];
        }
        assert_int_equal(verdict(n, M, NULL, NULL, q, z), PERP_OUTCOME_SOLVED);
        M[(n - 1) * n] = 0x1p39;
        assert_int_equal(verdict(n, M, NULL, NULL, q, z), PERP_OUTCOME_STALLED);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lost_beside_large_z),
        cmocka_unit_test(test_which_candidate_stays),
        cmocka_unit_test(test_a_point_out_of_range),
        cmocka_unit_test(test_a_batch_of_small_numbers),
        cmocka_unit_test(test_next_to_a_bound),
        cmocka_unit_test(test_rounding_beside_the_largest),
        cmocka_unit_test(test_what_excuses_nothing),
        cmocka_unit_test(test_underflow_excuses_nothing),
        cmocka_unit_test(test_noise_on_the_diagonal),
        cmocka_unit_test(test_noise_ties_nothing),
        cmocka_unit_test(test_noise_is_no_unit),
        cmocka_unit_test(test_noise_that_agrees),
        cmocka_unit_test(test_couplings_that_units_of_noise_leave),
        cmocka_unit_test(test_the_end_of_doubles),
        cmocka_unit_test(test_roundings_travel),
        cmocka_unit_test(test_small_rows_count),
        cmocka_unit_test(test_next_to_infinity),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_w_out_of_range),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

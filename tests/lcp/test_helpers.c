/* Who watches the watchmen: the generator's solutions are exact, and the checker objects to every
 * single thing that can be wrong in a result. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"

#include "context.h"

/* w = M z + q to the last bit, complementary, within the bounds. */
static void require_exact(const gen_lcp *problem, const char *where)
{
    check_lcp lcp = {&problem->view, problem->q, problem->lower, problem->upper, 1};
    check_measures m;

    check_measure(&m, &lcp, problem->z, problem->w);
    if (m.residual != 0 || m.natural_residual != 0 || m.backward_error != 0 || m.w_error != 0 ||
        m.violation != 0 || m.complementarity != 0)
        fail_msg("%s: residual %g, w off by %g", where, m.residual, m.w_error);
}

static void test_generated_solutions_are_exact(void **state)
{
    gen_random random;
    gen_lcp problem;
    int round;
    int32_t k;

    (void)state;
    gen_seed(&random, 71);
    for (round = 0; round < 300; round++) {
        gen_problem(&problem, &random, 1 + gen_integer(&random, 30), round % GEN_CLASSES,
                    round / GEN_CLASSES % GEN_BOUNDS);
        require_exact(&problem, "random");
        gen_destroy(&problem);
    }
    for (k = 1; k <= 64; k *= 2) {
        gen_obstacle(&problem, k);
        require_exact(&problem, "obstacle");
        gen_destroy(&problem);
    }
    gen_obstacle_2d(&problem, 40);
    require_exact(&problem, "obstacle on a square");
    gen_destroy(&problem);
}

/* By hand: M = [4 1; 2 1/4], q = (-8, 3), z = (2, 1): w = (1, 7 1/4). e = (-1, 1), so that
 * S = [1 1; 2 1], D q = (-4, 6), omega = 4, scaled z = (1, 1/8), scaled w = (1/8, 29/8). */
static void test_measures_by_hand(void **state)
{
    const int zeros[4] = {0};
    const double values[4] = {4, 1, 2, 0.25}, z[2] = {2, 1};
    check_lcp lcp;
    check_measures m;
    gen_lcp problem;

    (void)state;
    gen_from_integers(&problem, 2, zeros, zeros);
    memcpy(problem.M, values, sizeof values);
    problem.q[0] = -8;
    problem.q[1] = 3;
    memset(&lcp, 0, sizeof lcp);
    lcp.M = &problem.view;
    lcp.q = problem.q;
    lcp.scaling = 1;
    check_measure(&m, &lcp, z, NULL);
    assert_true(m.natural_residual == 1.0);
    assert_true(m.residual == 0.125);
    /* row 0: (1/8) / (2 * 1 + 1); row 1: (29/8) / (3 * 1 + 3/2) */
    assert_true(fabs(m.backward_error - 29.0 / 36.0) <= DBL_EPSILON);
    assert_true(m.complementarity == 7.25);
    gen_destroy(&problem);
}

/* ---- the checker objects --------------------------------------------------------------------- */

typedef struct answer {
    double z[3], w[3], ray[3];
    perp_lcp_result result;
} answer;

static void object_to(const gen_lcp *problem, const answer *right, const answer *wrong,
                      const char *what)
{
    const perp_lcp_result *r = &wrong->result;

    assert_null(check_lcp_result(&problem->view, problem->q, NULL, NULL, right->z, right->w,
                                 right->ray, &right->result, NULL));
    if (!check_lcp_result(&problem->view, problem->q, NULL, NULL, wrong->z, wrong->w, wrong->ray, r,
                          NULL))
        fail_msg("nobody noticed: %s", what);
}

#define SPOIL(what, statement)                     \
    do {                                           \
        answer wrong = right;                      \
        statement;                                 \
        object_to(&problem, &right, &wrong, what); \
    } while (0)

static answer solve(const gen_lcp *problem)
{
    answer a;
    run r;

    memset(&a, 0, sizeof a);
    run_lcp(&r, context, problem, NULL, NULL, "right");
    memcpy(a.z, r.z, sizeof a.z);
    memcpy(a.w, r.w, sizeof a.w);
    memcpy(a.ray, r.ray, sizeof a.ray);
    a.result = r.result;
    run_release(&r);
    return a;
}

static void test_objections_to_a_solution(void **state)
{
    static const int M[] = {3, 1, 0, 1, 3, 1, 0, 1, 3}, q[] = {-5, 4, -7};
    gen_lcp problem;
    answer right;

    (void)state;
    gen_from_integers(&problem, 3, M, q);
    right = solve(&problem);
    assert_int_equal(right.result.outcome, PERP_OUTCOME_SOLVED);
    SPOIL("z moved", wrong.z[0] += 1e-9);
    SPOIL("z negative", wrong.z[1] = -1e-300);
    SPOIL("z NaN", wrong.z[2] = NAN);
    SPOIL("z infinite", wrong.z[2] = INFINITY);
    SPOIL("w moved", wrong.w[1] *= 1 + 4 * DBL_EPSILON);
    SPOIL("w NaN", wrong.w[1] = NAN);
    SPOIL("w rounded to zero", wrong.w[1] = 0);
    SPOIL("residual too large", wrong.result.residual += 1e-11);
    SPOIL("residual NaN", wrong.result.residual = NAN);
    SPOIL("natural residual", wrong.result.natural_residual += 1e-15);
    SPOIL("backward error", wrong.result.backward_error += 1e-17);
    SPOIL("backward error NaN", wrong.result.backward_error = NAN);
    SPOIL("outcome", wrong.result.outcome = PERP_OUTCOME_ROUNDING_LIMIT);
    SPOIL("outcome", wrong.result.outcome = PERP_OUTCOME_RAY);
    SPOIL("outcome", wrong.result.outcome = PERP_OUTCOME_STALLED);
    SPOIL("outcome", wrong.result.outcome = 99);
    SPOIL("method auto", wrong.result.method = PERP_LCP_AUTO);
    SPOIL("method", wrong.result.method = PERP_LCP_PATTERNS + 1);
    SPOIL("ray", wrong.result.has_ray = 1);
    SPOIL("certificate", wrong.result.certificate = PERP_CERTIFICATE_INFEASIBLE);
    SPOIL("seconds", wrong.result.seconds = NAN);
    SPOIL("iterations", wrong.result.iterations = -1);
    gen_destroy(&problem);
}

static void test_objections_to_a_ray(void **state)
{
    static const int M[] = {1, -1, 0, -1, 1, 0, 0, 0, 1}, q[] = {-1, -1, -1};
    gen_lcp problem;
    answer right;

    (void)state;
    gen_from_integers(&problem, 3, M, q);
    right = solve(&problem);
    assert_int_equal(right.result.outcome, PERP_OUTCOME_RAY);
    assert_int_equal(right.result.certificate, PERP_CERTIFICATE_INFEASIBLE);
    SPOIL("solved", wrong.result.outcome = PERP_OUTCOME_SOLVED);
    SPOIL("no ray", wrong.result.has_ray = 0);
    SPOIL("ray negative", wrong.ray[2] = -1e-12);
    SPOIL("ray NaN", wrong.ray[2] = NAN);
    SPOIL("ray of another length", wrong.ray[0] = wrong.ray[1] = 2);
    SPOIL("no direction", wrong.ray[0] = wrong.ray[1] = 0);
    SPOIL("not complementary", wrong.ray[2] = 1);
    SPOIL("no certificate", wrong.ray[0] = 1 - 1e-10);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_generated_solutions_are_exact),
        cmocka_unit_test(test_measures_by_hand),
        cmocka_unit_test(test_objections_to_a_solution),
        cmocka_unit_test(test_objections_to_a_ray),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

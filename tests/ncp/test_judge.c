/* The judge of points, by hand: what is compared with what, where J is not what it was, and what is
 * a trap. Linear problems of two free variables, or with bounds at 0. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "ncp/solver.h"

typedef struct rig {
    double M[4], q[2], lower; /* columns */
    double steeper;           /* J is as many times M, whatever F says */
    int32_t alone;            /* F is defined at this point only */
    double point[2];
    perp_context *context;
    perp_ncp_solver *solver;
} rig;

static int32_t function(double *F, const double *z, void *user)
{
    const rig *r = user;
    int32_t i;

    if (r->alone && memcmp(z, r->point, sizeof r->point) != 0)
        return 1;
    for (i = 0; i < 2; i++)
        F[i] = r->M[i] * z[0] + r->M[2 + i] * z[1] + r->q[i];
    return 0;
}

static int32_t jacobian(double *J, const double *z, void *user)
{
    const rig *r = user;
    int32_t i;

    (void)z;
    for (i = 0; i < 4; i++)
        J[i] = r->steeper * r->M[i];
    return r->alone;
}

/* After a solve from z0. */
static void pose(rig *r, const double *z0)
{
    const double lower[2] = {r->lower, r->lower};
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_result result = fresh_ncp_result();
    double z[2];

    r->steeper = 1.0;
    assert_int_equal(perp_context_create(&r->context, NULL), PERP_OK);
    problem.n = 2;
    problem.function = function;
    problem.jacobian = jacobian;
    problem.lower = lower;
    problem.user = r;
    assert_int_equal(perp_ncp_solver_create(r->context, &r->solver, NULL), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(r->solver, &problem), PERP_OK);
    assert_int_equal(perp_ncp_solver_solve(r->solver, z, NULL, &result, z0), PERP_OK);
}

static perp__evidence judged(rig *r, double z0, double z1)
{
    perp__ncp_residuals residuals;

    r->solver->candidate[0] = z0;
    r->solver->candidate[1] = z1;
    assert_int_equal(perp__ncp_outcome_of(r->solver, &residuals), PERP_OK);
    return residuals.evidence;
}

static void release(rig *r)
{
    perp_ncp_solver_destroy(r->solver);
    perp_context_destroy(r->context);
}

/* F_0 = z_0 - 1, F_1 = 1e-3 z_0 + z_1 - 1e-3 - 1e-7: at (1, 0) row 1 misses 1e-7, of terms of 2e-3
 * and as much again that z_0 passes on; beside the 1 of row 0 that is 1e-7. The coupling is
 * significant. */
static void test_each_row_beside_its_own(void **state)
{
    static const double start[2] = {0.0, 0.0};
    rig r = {.M = {1, 1e-3, 0, 1}, .q = {-1, -1e-3 - 1e-7}, .lower = -INFINITY};
    perp__evidence evidence;

    (void)state;
    pose(&r, start);
    r.solver->settings.tol = 1e-8;
    evidence = judged(&r, 1.0, 0.0);
    assert_true(evidence.sound);
    assert_true(evidence.tested >= 0.25e-7 && evidence.tested <= 4e-7); /* units to a factor of 2 */
    assert_true(evidence.own_residual >= 1e-7 / 8e-3 && evidence.own_residual <= 1e-7 / 2e-3);
    /* beside the row's 1 of |M|, times the largest |z|, 1 */
    assert_true(evidence.backward >= 0.25e-7 && evidence.backward <= 4e-7);
    evidence = judged(&r, 1.0, 1e-7);
    assert_true(evidence.own_residual <= 1e-12 && evidence.backward <= 4 * DBL_EPSILON);
    release(&r);
}

/* z_0 + z_1 = 1 + 2^-20 and 2^-10 z_0 = 2^-30 + 2^-48 at (2^-20, 1): what rounding leaves of z_0
 * beside z_1 is 2^-10 of tol 2 in row 1, more than that misses, however small row 1 is itself. But
 * 2^-43 is more than sqrt(tol) of the right side of row 1. */
static void test_roundings_travel(void **state)
{
    static const double start[2] = {0.0, 0.0};
    rig r = {.M = {1, 0x1p-10, 1, 0}, .q = {-1 - 0x1p-20, -0x1p-30 - 0x1p-48}, .lower = -INFINITY};

    (void)state;
    pose(&r, start);
    assert_true(judged(&r, 0x1p-20, 1.0).own_residual <= 4 * 0x1p-48 / 0x1p-9);
    r.q[1] = -0x1p-30 - 0x1p-43;
    assert_true(judged(&r, 0x1p-20, 1.0).own_residual == INFINITY);
    release(&r);
}

/* z_0 = 1e-11 where F_0 = 1: it counts as 0, and nothing is wrong; 1e-6 does not. */
static void test_next_to_a_bound(void **state)
{
    static const double start[2] = {1.0, 1.0};
    rig r = {.M = {1, 0, 0, 1}, .q = {1, -1}, .lower = 0.0};

    (void)state;
    pose(&r, start);
    r.solver->settings.tol = 1e-10;
    assert_true(judged(&r, 1e-11, 1.0).own_residual == 0.0);
    assert_true(judged(&r, 1e-6, 1.0).own_residual >= 0.25e-6);
    release(&r);
}

/* A J that is 1e30 times as steep: in its units F is small wherever z is. By those of the start it
 * is not. */
static void test_another_jacobian(void **state)
{
    static const double start[2] = {0.0, 0.0};
    rig r = {.M = {1, 0, 0, 1}, .q = {-1, -1}, .lower = -INFINITY};
    perp__evidence evidence;

    (void)state;
    pose(&r, start);
    r.steeper = 1e30;
    evidence = judged(&r, 1.0 + 1e-3, 1.0);
    assert_true(evidence.tested <= 1e-12);
    assert_false(evidence.sound);
    r.steeper = 1.0;
    assert_true(judged(&r, 1.0 + 1e-8, 1.0).sound);
    release(&r);
}

/* Where F is known at one point and J nowhere there are no units: 0 alone is small. */
static void test_no_jacobian(void **state)
{
    rig r = {.M = {1, 0, 0, 1}, .q = {-1, -1}, .lower = -INFINITY, .alone = 1};
    int32_t k;

    (void)state;
    for (k = 0; k < 2; k++) {
        perp__evidence evidence;

        r.point[0] = 1.0;
        r.point[1] = 1.0 + k * 1e-12;
        pose(&r, r.point);
        evidence = judged(&r, r.point[0], r.point[1]);
        assert_true(evidence.backward == INFINITY);
        if (k == 0)
            assert_true(evidence.tested == 0.0 && evidence.own_residual == 0.0);
        else
            assert_true(evidence.own_residual == INFINITY);
        release(&r);
    }
}

/* z = F + 1: at (3, 1) the residual falls towards (1, 1). F = (z_1 - 1, z_1) is never 0, and at z_1
 * = 1/2 its squares are least. */
static void test_traps(void **state)
{
    static const double start[2] = {0.0, 0.0}, slope[2] = {3.0, 1.0}, end[2] = {2.0, 0.0};
    rig r = {.M = {1, 0, 0, 1}, .q = {-1, -1}, .lower = -INFINITY};
    int32_t trapped = -1;

    (void)state;
    pose(&r, start);
    memcpy(r.solver->best_z, slope, sizeof slope);
    assert_int_equal(perp__ncp_look_for_trap(r.solver, &trapped), PERP_OK);
    assert_int_equal(trapped, 0);
    r.M[0] = 0.0;
    r.M[2] = 1.0;
    r.q[1] = 0.0;
    memcpy(r.solver->best_z, end, sizeof end);
    r.solver->best_z[1] = 0.5;
    assert_int_equal(perp__ncp_look_for_trap(r.solver, &trapped), PERP_OK);
    assert_int_equal(trapped, 1);
    release(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_row_beside_its_own),
        cmocka_unit_test(test_roundings_travel),
        cmocka_unit_test(test_next_to_a_bound),
        cmocka_unit_test(test_another_jacobian),
        cmocka_unit_test(test_no_jacobian),
        cmocka_unit_test(test_traps),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

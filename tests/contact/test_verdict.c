/* From numbers to verdicts: a part that fails fails the whole, nothing that is not finite passes,
 * of two points the better one stays, and what a proof is. Points and proofs are made by hand. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "contact/solver.h"

#include "context.h"

/* A solver after a solve by W, row by row, or by H of a unit mass; its points can be replaced. */
typedef struct rig {
    int32_t contacts, dim, joints;
    double W[16], H[4], q[4], compliance[4];
} rig;

static perp_contact_solver *solved(const rig *p, int32_t by_W)
{
    const int32_t rows = p->contacts * p->dim, size = rows + p->joints;
    static const double one = 1.0, none = 0.0;
    double r[4], u[4];
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_solver *solver;
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix W, H, M, G;

    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    W = matrix_rows(p->W, size, size);
    H = matrix_rows(p->H, rows, 1);
    M = matrix_rows(&one, 1, 1);
    G = matrix_rows(p->H + rows, p->joints, 1);
    laws.contacts = p->contacts;
    laws.dim = p->dim;
    laws.bilateral = p->joints;
    laws.compliance = p->compliance;
    dynamics.n = 1;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = p->joints > 0 ? &G : NULL;
    if (by_W) {
        assert_int_equal(perp_contact_solver_setup_delassus(solver, &laws, &W), PERP_OK);
        assert_int_equal(
            perp_contact_solver_solve_delassus(solver, ANSWER(NULL, r, u), &result, p->q, NULL),
            PERP_OK);
    } else {
        assert_int_equal(perp_contact_solver_setup_dynamics(solver, &laws, &dynamics), PERP_OK);
        assert_int_equal(perp_contact_solver_solve_dynamics(solver, ANSWER(NULL, r, u), &result,
                                                            &none, p->q, p->q + rows, NULL),
                         PERP_OK);
    }
    return solver;
}

/* Whether the point takes the place of the best. */
static int32_t offer(perp_contact_solver *solver, double r0, double r1)
{
    perp__contact_residuals residuals;

    solver->r[0] = r0;
    solver->r[1] = r1;
    assert_int_equal(perp__contact_consider(solver, PERP_CONTACT_METHOD_POLISH, NULL, &residuals),
                     PERP_OK);
    return solver->best.r[0] == r0 && solver->best.r[1] == r1;
}

/* A grain of 1e-9 kg on a block of 1e9 kg, falling with 0.1: r = (1e8, 1e-10). */
static const rig grain = {2, 1, 0, {1e-9, -1e-9, -1e-9, 1e9}, {0}, {-0.1, 0.0}, {0}};

/* Without the grain's impulse its speed is all wrong, but that is little beside the block; with too
 * much for the block by 5e-9 of it all is well, though by the tested residual that is less near. */
static void test_the_better_point(void **state)
{
    perp_contact_solver *solver = solved(&grain, 1);

    (void)state;
    solver->best.method = -1;            /* none yet, */
    solver->said = PERP_OUTCOME_STALLED; /* whatever the last method said */
    assert_true(offer(solver, 2e8, 0.0));
    assert_true(offer(solver, 1.5e8, 0.0));  /* nearer */
    assert_false(offer(solver, 1.8e8, 0.0)); /* less near */
    assert_true(offer(solver, 1e8, 0.0));
    assert_int_equal(solver->best.outcome, PERP_OUTCOME_STALLED);
    assert_true(solver->best.residuals.tested <= 2e-9);
    assert_true(offer(solver, 1e8 + 0.5, 1e-10));
    assert_int_equal(solver->best.outcome, PERP_OUTCOME_SOLVED);
    assert_true(solver->best.residuals.tested > 4e-9);
    assert_false(offer(solver, 1e8, 0.0));
    assert_true(offer(solver, 1e8, 1e-10));
    perp_contact_solver_destroy(solver);
}

/* y proves that no velocities exist if y_n >= 0, no tangent takes part, H'y + G's = 0 (W y = 0) and
 * y'q < 0, all by more than rounding; and no soft row gives way. A unit mass on a line. */
static void test_what_a_proof_is(void **state)
{
    static const struct {
        rig p;
        double y[4];
        int32_t proves;
    } cases[] = {
        /* opposed walls that close */
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0}}, {1, 1}, 1},
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-3, 1}, {0}}, {1, 1}, 1},
        /* that open, that stay as they are */
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {1, 1}, {0}}, {1, 1}, 0},
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {1, -1}, {0}}, {1, 1}, 0},
        /* walls do not pull */
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {1, 1}, {0}}, {-1, -1}, 0},
        /* the mass would move, a lot or by 1e-6 */
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0}}, {1, 0.5}, 0},
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0}}, {1, 1 - 1e-6}, 0},
        /* a soft wall: gives way; takes no part in the proof */
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0, 0.5}}, {1, 1}, 0},
        {{2, 1, 0, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0, 1e-30}}, {1, 1}, 0},
        /* tangents on one line with the normals: friction proves nothing, the normals do */
        {{2,
          2,
          0,
          {1, 1, -1, -1, 1, 1, -1, -1, -1, -1, 1, 1, -1, -1, 1, 1},
          {1, 1, -1, -1},
          {0, -1, 0, -1},
          {0}},
         {0, 1, 0, 1},
         0},
        {{2,
          2,
          0,
          {1, 1, -1, -1, 1, 1, -1, -1, -1, -1, 1, 1, -1, -1, 1, 1},
          {1, 1, -1, -1},
          {-1, 0, -1, 0},
          {0}},
         {1, 0, 1, 0},
         1},
        /* a joint that asks for a speed into the wall: pulls or not */
        {{1, 1, 1, {1, 1, 1, 1}, {1, 1}, {-1, 1}, {0}}, {1, -1}, 1},
        {{1, 1, 1, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0}}, {1, 1}, 1},
        {{1, 1, 1, {1, -1, -1, 1}, {1, -1}, {-1, -1}, {0}}, {1, 0.5}, 0},
    };
    int32_t by_W;
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++)
        for (by_W = 0; by_W < 2; by_W++) {
            const rig *p = &cases[k].p;
            perp_contact_solver *solver = solved(p, by_W);
            const perp__contact_call call = {
                .q = p->q, .w = p->q, .b = p->q + p->contacts * p->dim};

            solver->call = &call;
            solver->certificate = PERP_CONTACT_CERTIFICATE_NONE;
            perp__contact_keep_ray(solver, cases[k].y);
            if ((solver->certificate == PERP_CONTACT_CERTIFICATE_INFEASIBLE) != cases[k].proves)
                fail_msg("case %d by %s", (int)k, by_W ? "W" : "H");
            solver->call = NULL;
            perp_contact_solver_destroy(solver);
        }
}

/* The whole is as bad as its worst part, wherever that is, and as what is not finite. */
static void test_the_worst_part(void **state)
{
    static const rig three = {3, 1, 0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {-1, -1, -1}, {0}};
    static const perp__evidence kinds[] = {
        {0.0, 0.0, 0.0, 1}, {1e-6, 1e-6, 0.0, 1}, {1.0, 1.0, 1.0, 1}, {0.0, 1.0, 1.0, 1}};
    static const perp_outcome alone[] = {PERP_OUTCOME_SOLVED, PERP_OUTCOME_ROUNDING_LIMIT,
                                         PERP_OUTCOME_STALLED, PERP_OUTCOME_STALLED};
    perp_contact_solver *solver = solved(&three, 1);
    perp__contact_candidate point = solver->best;
    perp__evidence evidence[3];
    int32_t k, part, i;

    (void)state;
    assert_int_equal(solver->parts, 3);
    point.evidence = evidence;
    for (k = 0; k < 4; k++)
        for (part = 0; part < 3; part++) {
            for (i = 0; i < 3; i++)
                evidence[i] = kinds[i == part ? k : 0];
            point.residuals.sound = 1;
            assert_int_equal(perp__contact_verdict(solver, &point, PERP_OUTCOME_STALLED), alone[k]);
            point.residuals.sound = 0;
            assert_int_equal(perp__contact_verdict(solver, &point, PERP_OUTCOME_STALLED),
                             PERP_OUTCOME_STALLED);
        }
    perp_contact_solver_destroy(solver);
}

/* A ball that comes with 1, and a joint that is to stop 2 with W = 4: by hand, each beside its own
 * terms |W| |r| + |q|, and as a velocity over sqrt(W) in units of |q| / sqrt(W). */
static void test_numbers(void **state)
{
    static const rig two = {1, 1, 1, {1, 0, 0, 4}, {0}, {-1, 2}, {0}};
    static const struct {
        double r[2], tested[2], backward[2];
    } cases[] = {
        {{1, -0.5}, {0, 0}, {0, 0}},                 /* right */
        {{0, -0.5}, {1, 0}, {1, 0}},                 /* u_0 = -1 */
        {{2, -0.5}, {1, 0}, {1.0 / 3, 0}},           /* u_0 = 1, presses */
        {{1, 0}, {0, 1}, {0, 1}},                    /* u_1 = 2 */
        {{1, -0.25}, {0, 0.5}, {0, 1.0 / 3}},        /* u_1 = 1 */
        {{1, -0.75}, {0, 0.5}, {0, 0.2}},            /* u_1 = -1 */
        {{1.5, -1}, {0.5, 1}, {0.5 / 2.5, 1.0 / 3}}, /* u = (0.5, -2) */
    };
    perp_contact_solver *solver = solved(&two, 1);
    size_t k, i;

    (void)state;
    assert_int_equal(solver->parts, 2);
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp__contact_residuals residuals;

        memcpy(solver->r, cases[k].r, sizeof cases[k].r);
        assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
        for (i = 0; i < 2; i++) {
            const perp__evidence *part = &solver->evidence[i];

            assert_true(fabs(part->tested - cases[k].tested[i]) <= 4 * DBL_EPSILON);
            assert_true(fabs(part->backward - cases[k].backward[i]) <= 4 * DBL_EPSILON);
            /* far from an answer the neighbours are not looked at */
            assert_true(fabs(part->own_residual - cases[k].backward[i]) <= 4 * DBL_EPSILON);
        }
        assert_true(residuals.tested ==
                    fmax(solver->evidence[0].tested, solver->evidence[1].tested));
        assert_true(residuals.own_residual ==
                    fmax(solver->evidence[0].own_residual, solver->evidence[1].own_residual));
        assert_true(residuals.bilateral == fabs(solver->u[1]));
    }
    perp_contact_solver_destroy(solver);
}

/* Contact 1 has units of a millionth: t = 1e12, terms 2e6, as 2 in contact 0's. At tol 1e-12 the
 * floor is 16 eps / tol of that, and contact 0, which moves with 1e-7, is judged beside it; beside
 * a share of 2e6 it would lack nothing. */
static void test_units_of_the_floor(void **state)
{
    static const rig mixed = {2, 1, 0, {1, 10, 10, 1e12}, {0}, {-1.01e-5, -1e6}, {0}};
    perp_contact_solver *solver = solved(&mixed, 1);
    perp__contact_residuals residuals;

    (void)state;
    assert_int_equal(solver->parts, 1);
    solver->settings.tol = 1e-12;
    solver->r[0] = 2e-7;
    solver->r[1] = 1e-6;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.tested <= 1e-6);
    /* its own terms and what the coupling changes add a hundredth */
    assert_true(fabs(residuals.own_residual / (1e-7 / (32e12 * DBL_EPSILON)) - 1.0) <= 0.02);
    perp_contact_solver_destroy(solver);
}

/* Parts are what couplings above noise, 2^-30 of what there can be, connect; whether the rest is 0
 * is known too, for a part solved by itself would not see it. */
static void test_parts_and_leaks(void **state)
{
    static const struct {
        double coupling;
        int32_t parts, leaks;
    } cases[] = {{0, 2, 0}, {0x1p-50, 2, 1}, {-0x1p-31, 2, 1}, {0x1p-28, 1, 0}, {0x1p-2, 1, 0}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        const double c = cases[k].coupling;
        const rig two = {2, 1, 0, {1, c, c, 1}, {0}, {-1, -1}, {0}};
        perp_contact_solver *solver = solved(&two, 1);

        assert_int_equal(solver->parts, cases[k].parts);
        assert_int_equal(solver->leaks, cases[k].leaks);
        perp_contact_solver_destroy(solver);
    }
}

/* A contact with q = -1e-12 that 2 e-12 couples to one with q = -1: what it lacks, all of it, is
 * judged beside its own 1e-12. */
static void test_noise_connects_nothing(void **state)
{
    static const rig two = {2, 1, 0, {1, 2e-12, 2e-12, 1}, {0}, {-1, -1e-12}, {0}};
    perp_contact_solver *solver = solved(&two, 1);
    perp__contact_residuals residuals;

    (void)state;
    solver->r[0] = 1.0;
    solver->r[1] = 0.0; /* u_1 = 1e-12 */
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.own_residual <= 1e-9);
    solver->r[0] = 0.0;
    solver->r[1] = 0.0;
    solver->q[0] = 1.0;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.own_residual == 1.0); /* u_1 = -1e-12, all its terms */
    perp_contact_solver_destroy(solver);
}

/* Two contacts along coordinates of their own of one body, one of which carries 1e15: that is no
 * excuse for the other, which moves by half of what it is to stop, 1. Its own terms, 1.5, and what
 * they would do to itself, as much, make a sixth of that. */
static void test_other_coordinates_excuse_nothing(void **state)
{
    static const double M[] = {1, 1, 1}, H[] = {1, 0, 0, 0, 1, 0}, f[] = {-1e15, -1, 0}, w[2] = {0};
    static const int32_t starts[] = {0, 1, 2, 3}, places[] = {0, 1, 2};
    static const double half[] = {1e15, 0.5};
    const perp__contact_call call = {.q = w, .w = w, .f = f};
    const perp_matrix mass = matrix_csc(3, 3, starts, places, M), jacobian = matrix_rows(H, 2, 3);
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp__contact_residuals residuals;
    perp_contact_solver *solver;
    double r[2];

    (void)state;
    laws.contacts = 2;
    laws.dim = 1;
    dynamics.n = 3;
    dynamics.M = &mass;
    dynamics.H = &jacobian;
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &laws, &dynamics), PERP_OK);
    assert_int_equal(
        perp_contact_solver_solve_dynamics(solver, ANSWER(NULL, r), &result, f, w, NULL, NULL),
        PERP_OK);
    assert_int_equal(solver->bodies.width, 3);
    memcpy(solver->r, half, sizeof half);
    solver->call = &call;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.tested <= 1e-10 && fabs(residuals.own_residual - 1.0 / 6.0) <= 1e-4);
    solver->call = NULL;
    perp_contact_solver_destroy(solver);
}

/* Masses 2 and 4e-12 between two contacts. Impulses that leave the heavy one a momentum of its own
 * are right beside W = 1e12: then v is what they make of it, not 0.0 because both contacts hold.
 * 1e-4 = sqrt(tol) of the terms; the light one's are 1. */
static void test_momentum_beside_noise(void **state)
{
    static const double M[] = {2, 4e-12}, f[] = {3.85, 2}, w[4] = {0}, mu[] = {0.75, 1};
    static const int32_t starts[] = {0, 1, 2}, rows[] = {0, 1};
    static const double H[] = {-0.58, -1.86, -1.73, 0.33, -3.69, 2.71, 0, -0.58};
    double v[2], r[4];
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_solver *solver;
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix mass, jacobian;

    (void)state;
    mass = matrix_csc(2, 2, starts, rows, M);
    jacobian = matrix_rows(H, 4, 2);
    laws.contacts = laws.dim = 2;
    laws.mu = mu;
    dynamics.n = 2;
    dynamics.M = &mass;
    dynamics.H = &jacobian;
    assert_int_equal(perp_contact_solver_create(context, &solver, NULL), PERP_OK);
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &laws, &dynamics), PERP_OK);
    assert_int_equal(
        perp_contact_solver_solve_dynamics(solver, ANSWER(v, r), &result, f, w, NULL, NULL),
        PERP_OK);
    assert_true(perp__is_good(result.outcome));
    for (int32_t i = 0; i < 2; i++) {
        double lacks = M[i] * v[i] - f[i], terms = fabs(M[i] * v[i]) + fabs(f[i]);

        for (int32_t k = 0; k < 4; k++) {
            lacks -= H[2 * k + i] * r[k];
            terms += fabs(H[2 * k + i] * r[k]);
        }
        assert_true(fabs(lacks) <= 1e-4 * terms);
    }
    perp_contact_solver_destroy(solver);
}

/* u_n = 1/2 and next to no impulse obey the law to 1e-12, but not as a contact that presses, whose
 * u_n would be told to be 0. W = 3: the square of its root is less by rounding. */
static void test_modes_must_hold(void **state)
{
    static const rig leaves = {1, 1, 0, {3}, {0}, {0.5}, {0}};
    static const int8_t modes[] = {PERP_CONTACT_SEPARATE, PERP_CONTACT_STICK, PERP_CONTACT_SLIP};
    size_t k;

    (void)state;
    for (k = 0; k < 3; k++) {
        perp_contact_solver *solver = solved(&leaves, 1);
        perp__contact_residuals residuals;

        solver->r[0] = 1e-12;
        assert_int_equal(perp__contact_evaluate(solver, &modes[k], &residuals), PERP_OK);
        assert_true(residuals.tested <= 1e-11);
        /* beside its terms, 1/2, and once more that for its neighbours, itself */
        assert_true(k == 0 ? residuals.own_residual == 0.0
                           : fabs(residuals.own_residual - 0.5) <= 1e-4);
        perp_contact_solver_destroy(solver);
    }
}

/* Every number that would be returned: one of them spoilt, in an answer that is right. */
static void test_what_is_sound(void **state)
{
    static const rig ball = {1, 1, 0, {1}, {1}, {-1}, {0}};
    static const double bad[] = {NAN, INFINITY, -INFINITY}, none = 0.0;
    const perp__contact_call call = {.q = ball.q, .w = ball.q, .f = &none};
    int32_t by_W, which, k;

    (void)state;
    for (by_W = 0; by_W < 2; by_W++)
        for (which = 0; which < 3 + !by_W; which++)
            for (k = 0; k < 3; k++) {
                perp_contact_solver *solver = solved(&ball, by_W);
                double *const outputs[] = {NULL, solver->r, solver->u, solver->v};
                perp__contact_residuals residuals;

                solver->call = &call;
                solver->r[0] = 1.0;
                assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
                assert_true(residuals.sound);
                if (which == 0)
                    residuals.cone = bad[k];
                else
                    outputs[which][0] = bad[k];
                perp__contact_weigh(solver, &residuals);
                assert_false(residuals.sound);
                assert_false(solver->evidence[0].sound);
                solver->call = NULL;
                perp_contact_solver_destroy(solver);
            }
}

/* W = c c', c = (1, -1e-150): r = (1e160, 0) balances both, contact 1 is not told from one that
 * presses, and the 2e310 that its terms are as an impulse are beyond the range of doubles. What
 * contact 0 has too much, 1e-6, is judged beside the terms of each alone. */
static void test_neighbours_that_overflow(void **state)
{
    static const rig two = {2, 1, 0, {1, -1e-150, -1e-150, 1e-300}, {0}, {-1e160, 1e10}, {0}};
    perp_contact_solver *solver = solved(&two, 1);
    perp__contact_residuals residuals;

    (void)state;
    solver->r[0] = (1.0 + 1e-6) * 1e160;
    solver->r[1] = 0.0;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(fabs(residuals.own_residual / 0.5e-6 - 1.0) <= 1e-5);
    perp_contact_solver_destroy(solver);
}

/* A ball that leaves with 1e200, and beside it a joint that is to stop 1e307. What the ball's speed
 * might do to the joint is beyond the range of doubles: it excuses nothing. */
static void test_overflow_excuses_nothing(void **state)
{
    static const rig two = {1, 1, 1, {1, 1e150, 1e150, 1e308}, {0}, {1e200, 1e307}, {0}};
    static const rig large = {1, 1, 1, {1e308, 1e308, 1e308, 1e308}, {0}, {1e300, 1e300}, {0}};
    perp_contact_solver *solver = solved(&two, 1);
    perp__contact_residuals residuals;

    (void)state;
    assert_int_equal(solver->parts, 1);
    solver->r[0] = solver->r[1] = 0.0;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    /* u_1 = q_1 over that, what it does to itself and the floor: what leaves has no impulse */
    assert_true(residuals.tested <= 1e-40 && fabs(residuals.own_residual - 0.5) <= 1e-5);
    solver->r[1] = -0.1;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.own_residual <= DBL_EPSILON);
    perp_contact_solver_destroy(solver);
    solver = solved(&large, 1);
    solver->r[0] = 1.5;
    solver->r[1] = -1.5; /* u = q, and 3e308 is what it is made of: the joint moves */
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(solver->u[1] != 0.0 && residuals.own_residual == INFINITY);
    perp_contact_solver_destroy(solver);
}

/* The second joint's coupling to the first, which is to stop 1, would move it by 1e300: no
 * mechanics has such. W of units 1 and 1e200 couples by 1e100 at most, and neither that nor the
 * ball, which leaves with 1e200, excuses that the joint does not stop 1e200. */
static void test_couplings_of_no_mechanics(void **state)
{
    static const rig wild = {
        1, 1, 2, {1, 0, 1, 1, 1, 1, -1, 1e300, 1e200}, {0}, {1e200, -1, 1e200}, {0}};
    perp_contact_solver *solver = solved(&wild, 1);
    perp__contact_residuals residuals;

    (void)state;
    memset(solver->r, 0, 3 * sizeof *solver->r);
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    /* 1e200 over itself alone; 1e-5 is more than all the rest */
    assert_true(fabs(residuals.own_residual - 1.0) <= 1e-5);
    perp_contact_solver_destroy(solver);
}

/* W = [7e-5 -9e8; -9e8 .04], q = (2e5, -.007): no impulses solve that, and where the first contact
 * is balanced, by r_2 = 2e5 / 9e8, the second closes with nearly all that it has. */
static void test_no_mechanics_no_excuse(void **state)
{
    static const rig wild = {2, 1, 0, {7e-5, -9e8, -9e8, 0.04}, {0}, {2e5, -0.007}, {0}};
    perp_contact_solver *solver = solved(&wild, 1);
    perp__contact_residuals residuals;

    (void)state;
    assert_false(perp__is_good(solver->best.outcome));
    solver->r[0] = 0.0;
    solver->r[1] = 2e5 / 9e8;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.own_residual > 0.99); /* .04 * 2.2e-4 is .0013 of .007 */
    perp_contact_solver_destroy(solver);
}

/* Contacts that close with 1e-6, which is little beside their terms, 2, but not little enough. The
 * first is coupled with one of t = 1e-30 by 5e-13: rounding beside 1, but 500 times what there can
 * be, and no excuse. The other one has 1e6 between its normal and its tangent, with t = 2: it is no
 * excuse to itself. */
static void test_no_mechanics_within(void **state)
{
    static const struct {
        rig p;
        double r[4], terms;
    } cases[] = {
        {{2, 1, 0, {1e-30, 5e-13, 5e-13, 1}, {0}, {-5e-13, -1 - 1e-6}, {0}}, {0, 1}, 2},
        /* what balances it has t = 2 and terms of 2: 1 more */
        {{2,
          2,
          0,
          {1, 1e6, 1, 0, 1e6, 1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1},
          {0},
          {-1 - 1e-6, 0, -1, 0},
          {0}},
         {0, 0, 1, 0},
         3},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        perp_contact_solver *solver = solved(&cases[k].p, 1);
        perp__contact_residuals residuals;

        memcpy(solver->r, cases[k].r, (size_t)solver->size * sizeof *solver->r);
        assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
        assert_true(fabs(residuals.own_residual * cases[k].terms / 1e-6 - 1.0) <= 1e-4);
        perp_contact_solver_destroy(solver);
    }
}

/* Two contacts of a body at which 1 comes, the one without friction on what passes by with 1e10. No
 * impulse has to do with that speed, and it excuses nothing of what the other lacks. */
static void test_speeds_that_friction_cannot_answer(void **state)
{
    static const rig passing = {
        2,  2, 0, {1, 0.5, 1, 0, 0.5, 1, 0.5, 0, 1, 0.5, 1, 0, 0, 0, 0, 1}, {0}, {-1, 1e10, -1, 0},
        {0}};
    perp_contact_solver *solver = solved(&passing, 1);
    perp__contact_residuals residuals;

    (void)state;
    solver->r[0] = 0.5, solver->r[2] = 0.499, solver->r[1] = solver->r[3] = 0.0;
    assert_int_equal(perp__contact_evaluate(solver, NULL, &residuals), PERP_OK);
    assert_true(residuals.tested <= 1e-12);
    assert_true(residuals.own_residual >= 1e-4); /* 1e-3 over 2 of its own, and as much from each */
    perp_contact_solver_destroy(solver);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_better_point),
        cmocka_unit_test(test_what_a_proof_is),
        cmocka_unit_test(test_the_worst_part),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_units_of_the_floor),
        cmocka_unit_test(test_parts_and_leaks),
        cmocka_unit_test(test_noise_connects_nothing),
        cmocka_unit_test(test_other_coordinates_excuse_nothing),
        cmocka_unit_test(test_momentum_beside_noise),
        cmocka_unit_test(test_modes_must_hold),
        cmocka_unit_test(test_what_is_sound),
        cmocka_unit_test(test_neighbours_that_overflow),
        cmocka_unit_test(test_overflow_excuses_nothing),
        cmocka_unit_test(test_couplings_of_no_mechanics),
        cmocka_unit_test(test_no_mechanics_no_excuse),
        cmocka_unit_test(test_no_mechanics_within),
        cmocka_unit_test(test_speeds_that_friction_cannot_answer),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

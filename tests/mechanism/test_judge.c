/* What stands between a solver's answer and the step's: velocities that hold, and the balance of
 * momentum. A point mass falls on a floor; the answers are made by hand. */
#include "rig.h"

#include "mechanism/mechanism.h"

enum { PLANE = 2 };

typedef struct fall {
    double lever; /* of the tangent: what a force along it makes of the normal velocity */
    perp_context *context;
    perp_mechanism *m;
    perp__velocity_problem problem;
} fall;

static int32_t weigh(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    k[1] = -10.0;
    return 0;
}

static int32_t ground(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                      void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[1];
    H[1] = H[PLANE] = 1.0;
    H[PLANE + 1] = ((const fall *)user)->lever;
    return 0;
}

/* The frozen step's problem, from rest on the floor with a speed of 1 along it. */
static void pose(fall *f, double lever)
{
    static const double q[PLANE] = {0.0, 0.0}, v[PLANE] = {1.0, 0.0}, mu[1] = {0.5};
    perp_mechanism_settings settings = fresh_mechanism_settings();
    perp_mechanism_model model = fresh_mechanism_model();

    f->lever = lever;
    settings.law = PERP_MECHANISM_POISSON;
    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    model.velocities = PLANE;
    model.contacts = 1;
    model.mu = mu;
    model.force = weigh;
    model.contact_rows = ground;
    model.user = f;
    assert_int_equal(perp_mechanism_create(f->context, &f->m, &settings, &model), PERP_OK);
    assert_int_equal(perp__evaluate_all(f->m, &f->m->begin, 0.0, q, v), PERP_OK);
    perp__prepare_step(f->m, START(0.0, 0.1, q, v));
    f->problem = perp__pose(f->m, &f->m->begin);
}

static void answer(fall *f, double vx, double vy, double normal, double friction)
{
    perp__motion *a = &f->m->answer;

    a->v[0] = vx;
    a->v[1] = vy;
    a->r[0] = normal;
    a->r[1] = friction;
    a->outcome = PERP_OUTCOME_SOLVED;
}

static void release(fall *f)
{
    perp_mechanism_destroy(f->m);
    perp_context_destroy(f->context);
}

/* A solution stopped early says that everything holds, with impulses that hold nothing: it falls,
 * and its velocities are told as they are. One that is right gets its exact zeros. */
static void test_hold(void **state)
{
    perp__motion *a;
    fall f;

    (void)state;
    pose(&f, 0.0);
    a = &f.m->answer;
    answer(&f, 1.0, -1.0, 0.0, 0.0);
    a->holds[0] = a->holds[1] = 1;
    perp__hold_velocities(f.m, a, &f.problem);
    assert_true(a->v[0] == 1.0 && a->v[1] == -1.0);
    assert_true(a->u[0] == -1.0 && a->u[1] == 1.0);
    answer(&f, 0.5, 3e-16, 1.0, -0.5);
    a->holds[0] = 1;
    a->holds[1] = 0;
    perp__hold_velocities(f.m, a, &f.problem);
    assert_true(a->v[1] == 0.0 && a->u[0] == 0.0);
    near(a->v[0], 0.5, 4.0 * RIG_EPS, "slip");
    release(&f);
}

static int32_t judged(fall *f)
{
    perp__check_motion(f->m, &f->m->answer, &f->problem);
    return f->m->answer.outcome;
}

/* v+ = v + h k + r, or it is no answer. */
static void test_balance(void **state)
{
    fall f;

    (void)state;
    pose(&f, 0.0);
    answer(&f, 0.5, 0.0, 1.0, -0.5);
    assert_int_equal(judged(&f), PERP_OUTCOME_SOLVED);
    answer(&f, 0.5, 0.0, 1.0, -0.4);
    assert_int_equal(judged(&f), PERP_OUTCOME_STALLED);
    answer(&f, 0.5, 1e-6, 1.0, -0.5);
    assert_int_equal(judged(&f), PERP_OUTCOME_STALLED);
    answer(&f, 0.5, 0.0, (double)NAN, -0.5);
    assert_int_equal(judged(&f), PERP_OUTCOME_STALLED);
    answer(&f, INFINITY, 0.0, 1.0, -0.5);
    assert_int_equal(judged(&f), PERP_OUTCOME_STALLED);
    answer(&f, 0.5, 0.0, 1.0, -0.5);
    f.m->answer.outcome = PERP_OUTCOME_RAY; /* nothing makes that better */
    assert_int_equal(judged(&f), PERP_OUTCOME_RAY);
    release(&f);
}

/* An impact without collision: the slip pulls itself in, n'M^-1 (n - mu d) = 1 - lever / 2, and it
 * ended. A slip that goes on, or one that ends though it could go on, is none. */
static void test_jam(void **state)
{
    static const double levers[] = {-3.0, 0.0, 1.9, 2.1, 3.0};
    size_t k;
    fall f;

    (void)state;
    for (k = 0; k < sizeof levers / sizeof *levers; k++) {
        pose(&f, levers[k]);
        f.m->restitution[0] = 0.5;
        f.m->answer.holds[0] = 1;
        f.m->answer.u[1] = 0.0;
        assert_int_equal(perp__is_impact(f.m, &f.m->answer, 0), levers[k] > 2.0);
        f.m->answer.u[1] = 0.25;
        assert_int_equal(perp__is_impact(f.m, &f.m->answer, 0), 0);
        release(&f);
    }
}

/* Static friction counts where a speed is no more than rounding of its terms: on a belt that moves
 * with the body these are as large as the belt's speed. */
static void test_rest_on_a_belt(void **state)
{
    static const double v[PLANE] = {1.0, -1.0};
    double u[2] = {0.0, 0.0};
    fall f;

    (void)state;
    pose(&f, 1.0);
    u[1] = 2.0 * RIG_EPS;
    assert_true(perp__sliding_speed(f.m, &f.m->begin, 0, u, v, PERP__SUM_ROUNDING) == 0.0);
    u[1] = 1e-12;
    assert_true(perp__sliding_speed(f.m, &f.m->begin, 0, u, v, PERP__SUM_ROUNDING) == 1e-12);
    release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hold),
        cmocka_unit_test(test_balance),
        cmocka_unit_test(test_jam),
        cmocka_unit_test(test_rest_on_a_belt),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

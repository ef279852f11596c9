/* What a step claims: outcomes of parts and wholes, finite outputs, and budgets that hold. */
#include "rig.h"

/* ---- a unit point mass over the floor z = 0, in space -------------------------------------- */

enum { POINT = 3, ROUNDS = 64 };

typedef struct point {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
    double mu[1], restitution[1], weight, height; /* weight: along -z; height: of the floor */
    double grip;        /* force -grip sgn(v_x), which no theta step from rest meets */
    double from, until; /* times at which it doesn't grip */
    int32_t outside;    /* 1: there are no forces after t = 0 */
    int64_t forces;     /* calls */
    double q[POINT], v[POINT], impulse[POINT], velocity[POINT];
    int32_t modes[1];
} point;

static int32_t push(double *k, double t, const double *q, const double *v, void *user)
{
    point *p = user;

    (void)q;
    p->forces++;
    k[0] = t > p->from && t < p->until ? 0.0 : v[0] > 0.0 ? -p->grip : p->grip;
    k[2] = -p->weight;
    return p->outside && t > 0.0;
}

static int32_t floor_of(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    gap[0] = q[2] - ((const point *)user)->height;
    H[2] = H[POINT] = H[2 * POINT + 1] = 1.0; /* z, then x and y */
    return 0;
}

static void open_point(point *p)
{
    memset(p, 0, sizeof *p);
    assert_int_equal(perp_context_create(&p->context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_model_init(&p->model, sizeof p->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&p->settings, sizeof p->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&p->step, sizeof p->step), PERP_OK);
    p->model.velocities = POINT;
    p->model.contacts = 1;
    p->model.dim = 3;
    p->model.mu = p->mu;
    p->model.restitution = p->restitution;
    p->model.force = push;
    p->model.contact_rows = floor_of;
    p->model.user = p;
}

static void start_point(point *p)
{
    assert_int_equal(perp_mechanism_create(p->context, &p->mechanism, &p->settings, &p->model),
                     PERP_OK);
}

static void step_point(point *p, double h)
{
    if (perp_mechanism_advance(p->mechanism, p->q, p->v, p->impulse, p->velocity, p->modes, NULL,
                               &p->step, START(0.0, h, p->q, p->v)) != PERP_OK)
        fail_msg("%s", perp_context_message(p->context));
}

static void close_point(point *p)
{
    perp_mechanism_destroy(p->mechanism);
    perp_context_destroy(p->context);
}

/* ---- the selected answer ------------------------------------------------------------------- */

/* A block that slides on a floor has one answer, whichever is preferred: v - mu g h along its way,
 * and impulses m g h and mu m g h. */
static void test_select_in_space(void **state)
{
    const double h = 0.01;
    int32_t select;
    point p;

    (void)state;
    for (select = PERP_MECHANISM_ANY; select <= PERP_MECHANISM_FREEST; select++) {
        open_point(&p);
        p.mu[0] = 0.5;
        p.weight = 10.0;
        p.settings.select = select;
        p.v[0] = 0.6;
        p.v[1] = -0.8;
        start_point(&p);
        step_point(&p, h);
        assert_int_equal(p.step.outcome, PERP_OUTCOME_SOLVED);
        near(p.v[0], 0.6 * 0.95, 1e-9, "v_x"); /* ten times tol, beside a speed of 1 */
        near(p.v[1], -0.8 * 0.95, 1e-9, "v_y");
        assert_true(p.v[2] == 0.0);
        near(p.impulse[0], 0.1, 1e-9, "normal impulse");
        near(p.impulse[1], -0.6 * 0.05, 1e-9, "friction");
        close_point(&p);
    }
}

/* ---- wholes are as bad as their parts ------------------------------------------------------ */

/* No v+ = v + h/2 (k(v+) + k(v)) exists where k = -grip sgn v is stronger than v: the iteration for
 * k does not converge, and an impact solved afterwards doesn't make it. */
static void test_impact_after_no_convergence(void **state)
{
    point p;

    (void)state;
    open_point(&p);
    p.grip = 100.0;
    p.restitution[0] = 0.5;
    p.settings.scheme = PERP_MECHANISM_THETA;
    p.v[0] = 0.01;
    p.v[2] = -1.0;
    start_point(&p);
    step_point(&p, 0.1);
    assert_int_equal(p.step.impacts, 1);
    assert_int_equal(p.step.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    close_point(&p);
}

static int32_t stop_after_a_step(const perp_mechanism_view *view, void *user)
{
    int32_t *outcome = user;

    if (view->h == 0.0)
        return 0;
    *outcome = view->step->outcome;
    return 1;
}

/* A run's step is its two halves: here the first one, from 0 to 0.005, has no answer; the second
 * one and the whole, to 0.01, have. Longer ones have none, so that attempts at 0.64, 0.16 and 0.04
 * are refused before. */
static void test_halves(void **state)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    int32_t outcome = -1;
    point p;

    (void)state;
    open_point(&p);
    p.grip = 1e-6; /* small beside the speed, so that the step's error is none */
    p.from = 0.0075;
    p.until = 0.011;
    p.settings.scheme = PERP_MECHANISM_THETA;
    p.settings.error = 0.1;
    p.v[1] = 1.0;
    p.q[2] = 1.0;
    start_point(&p);
    assert_int_equal(perp_mechanism_run(p.mechanism, p.q, p.v, &result, START(0.0, 0.64, p.q, p.v),
                                        0.64, stop_after_a_step, &outcome),
                     PERP_OK);
    assert_int_equal(result.rejected, 3);
    assert_int_equal(outcome, PERP_OUTCOME_ITERATION_LIMIT);
    close_point(&p);
}

/* The residual is the largest of both stages of an impact: with the same first stage the one with
 * restitution is never below the one without, and rounding makes it larger somewhere. */
static void test_residual_of_stages(void **state)
{
    int32_t k, larger = 0;

    (void)state;
    for (k = 1; k < 60; k++) {
        double residual[2];
        int32_t i;

        for (i = 0; i < 2; i++) {
            point p;

            open_point(&p);
            p.mu[0] = 0.3;
            p.restitution[0] = 0.7 * i;
            p.v[0] = cos(k);
            p.v[1] = sin(1.7 * k);
            p.v[2] = -1.0 / k;
            start_point(&p);
            step_point(&p, 0.01);
            assert_int_equal(p.step.impacts, i);
            residual[i] = p.step.residual;
            close_point(&p);
        }
        assert_true(residual[1] >= residual[0]);
        larger += residual[1] > residual[0];
    }
    assert_true(larger > 0);
}

/* Poisson's law makes an impact of a contact that stops sliding only where it pulls itself in: a
 * mass that friction stops while it is pressed on the floor does not jump. */
static void test_stop_is_no_impact(void **state)
{
    point p;

    (void)state;
    open_point(&p);
    p.mu[0] = 0.5;
    p.weight = 10.0;
    p.restitution[0] = 0.5;
    p.settings.law = PERP_MECHANISM_POISSON;
    p.v[0] = 0.01;
    start_point(&p);
    step_point(&p, 0.1);
    assert_int_equal(p.step.impacts, 0);
    assert_true(p.v[0] == 0.0 && p.v[1] == 0.0 && p.v[2] == 0.0);
    close_point(&p);
}

/* ---- impulses and velocities of one answer ------------------------------------------------- */

/* Dry friction of a plane, as the disc it is and as the polygon that settings.cone makes of it: in
 * either case v+ - v = r for a unit mass, with r in the disc. */
static int32_t rub(double *bound, double *B, double *drift, double t, const double *q,
                   const double *v, void *user)
{
    (void)drift;
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    bound[0] = 10.0;
    B[0] = B[POINT + 1] = 1.0;
    return 0;
}

static void test_dry_polygon(void **state)
{
    int32_t cone;

    (void)state;
    for (cone = 0; cone < 8; cone += 4) {
        double impulse[2];
        point p;

        open_point(&p);
        p.model.contacts = 0;
        p.model.dry = 1;
        p.model.dry_dim = 2;
        p.model.dry_rows = rub;
        p.settings.cone = cone;
        p.v[0] = 1.0;
        p.v[1] = 0.3;
        start_point(&p);
        assert_int_equal(perp_mechanism_advance(p.mechanism, p.q, p.v, impulse, NULL, p.modes, NULL,
                                                &p.step, START(0.0, 0.01, p.q, p.v)),
                         PERP_OK);
        assert_int_equal(p.step.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(p.modes[0], PERP_MECHANISM_SLIP);
        near(p.v[0] - 1.0, impulse[0], 1e-10, "x"); /* tol, of a speed of 1 */
        near(p.v[1] - 0.3, impulse[1], 1e-10, "y");
        assert_true(hypot(impulse[0], impulse[1]) <= 0.1 * (1.0 + 1e-10));
        close_point(&p);
    }
}

/* ---- what is counted ----------------------------------------------------------------------- */

static int32_t keep_step(const perp_mechanism_view *view, void *user)
{
    memcpy(user, view->step, sizeof *view->step);
    return 0;
}

/* An implicit step that has no end solves the frozen problem twice: as its start, and as what it
 * comes down to. */
static void test_iterations_of_all_attempts(void **state)
{
    int64_t frozen = 0;
    int32_t scheme;

    (void)state;
    for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_IMPLICIT; scheme++) {
        point p;

        open_point(&p);
        p.weight = 10.0;
        p.mu[0] = 0.3;
        p.outside = 1;
        p.settings.scheme = scheme;
        p.v[0] = 1.0;
        start_point(&p);
        step_point(&p, 0.1);
        assert_int_equal(p.step.scheme, PERP_MECHANISM_FROZEN);
        assert_int_equal(p.step.outcome, PERP_OUTCOME_SOLVED);
        if (scheme == PERP_MECHANISM_FROZEN)
            frozen = p.step.iterations;
        else
            assert_true(p.step.iterations >= 2 * frozen);
        assert_true(frozen > 0);
        close_point(&p);
    }
}

/* Removing an overlap is a problem of the step's, and an observer's step took time. */
static void test_counts_of_a_run(void **state)
{
    perp_mechanism_run_result result;
    perp_mechanism_step step;
    int64_t without = 0;
    int32_t project;

    (void)state;
    for (project = 0; project < 2; project++) {
        point p;

        open_point(&p);
        p.weight = 10.0;
        p.settings.project = project;
        p.q[2] = -0.01;
        start_point(&p);
        perp_struct_init(&result, sizeof result);
        assert_int_equal(perp_mechanism_run(p.mechanism, p.q, p.v, &result,
                                            START(0.0, 0.01, p.q, p.v), 0.01, keep_step, &step),
                         PERP_OK);
        assert_true(step.seconds > 0.0 && step.seconds <= result.seconds);
        if (project == 0)
            without = result.iterations;
        else
            assert_true(result.iterations > without);
        close_point(&p);
    }
}

typedef struct totals {
    int64_t iterations;
    double residual;
} totals;

static int32_t add_step(const perp_mechanism_view *view, void *user)
{
    totals *all = user;

    all->iterations += view->step->iterations;
    all->residual = fmax(all->residual, view->step->residual);
    return 0;
}

/* A run's residual is the largest of its steps', its iterations are theirs and those of steps that
 * were refused. */
static void test_totals_of_a_run(void **state)
{
    int32_t adaptive;

    (void)state;
    for (adaptive = 0; adaptive < 2; adaptive++) {
        perp_mechanism_run_result result = fresh_mechanism_run_result();
        totals all = {0, 0.0};
        point p;

        open_point(&p);
        p.mu[0] = 0.1; /* it comes to rest from a slide: steps on the ground are refused, too */
        p.weight = 10.0;
        p.restitution[0] = 0.6;
        p.settings.error = adaptive ? 1e-6 : 0.0;
        p.v[0] = 0.7;
        p.v[1] = 0.4;
        p.q[2] = 0.1;
        start_point(&p);
        assert_int_equal(perp_mechanism_run(p.mechanism, p.q, p.v, &result,
                                            START(0.0, 0.01, p.q, p.v), 2.0, add_step, &all),
                         PERP_OK);
        assert_true(result.residual == all.residual && all.residual > 0.0);
        assert_int_equal(result.rejected > 0, adaptive);
        if (adaptive)
            assert_true(result.iterations > all.iterations);
        else
            assert_int_equal(result.iterations, all.iterations);
        close_point(&p);
    }
}

/* A gap is a difference, known to rounding of what it is taken from. */
static void test_closed_up_to_rounding(void **state)
{
    perp_mechanism_summary summary;
    int32_t open;

    (void)state;
    for (open = 0; open < 2; open++) {
        point p;

        open_point(&p);
        p.weight = 10.0;
        p.height = 1.0;
        p.q[2] = 1.0 + (open ? 1e-11 : 1e-13);
        start_point(&p);
        perp_struct_init(&summary, sizeof summary);
        assert_int_equal(perp_mechanism_accelerations(p.mechanism, &summary, 0.0, p.q, p.v),
                         PERP_OK);
        assert_int_equal(summary.closed, !open);
        close_point(&p);
    }
}

/* ---- budgets ------------------------------------------------------------------------------- */

/* Calls of the force in one step of the hopeless problem, within the limit. */
static int64_t forces_within(int32_t scheme, double limit, int32_t *outcome)
{
    int64_t forces;
    point p;

    open_point(&p);
    p.grip = 100.0;
    p.weight = 10.0;
    p.settings.scheme = scheme;
    p.settings.time_limit = limit;
    p.v[0] = 0.01;
    start_point(&p);
    step_point(&p, 0.1);
    *outcome = p.step.outcome;
    forces = p.forces;
    assert_true(p.q[2] >= 0.0); /* usable: not through the floor */
    assert_true(isfinite(p.v[0]) && isfinite(p.v[1]) && isfinite(p.v[2]));
    close_point(&p);
    return forces;
}

/* A nanosecond is over before the first iterate is: what is done then is what a step needs, not
 * what would be tried. (Counted in calls: a clock decides nothing here.) */
static void test_time_limit(void **state)
{
    int32_t outcome;

    (void)state;
    assert_true(forces_within(PERP_MECHANISM_THETA, 0.0, &outcome) >= 60);
    assert_int_equal(outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_in_range(forces_within(PERP_MECHANISM_THETA, 1e-9, &outcome), 1, 4);
    assert_int_equal(outcome, PERP_OUTCOME_TIME_LIMIT);
    assert_true(forces_within(PERP_MECHANISM_IMPLICIT, 0.0, &outcome) > 30);
    assert_in_range(forces_within(PERP_MECHANISM_IMPLICIT, 1e-9, &outcome), 1, 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_select_in_space),
        cmocka_unit_test(test_impact_after_no_convergence),
        cmocka_unit_test(test_halves),
        cmocka_unit_test(test_residual_of_stages),
        cmocka_unit_test(test_stop_is_no_impact),
        cmocka_unit_test(test_dry_polygon),
        cmocka_unit_test(test_iterations_of_all_attempts),
        cmocka_unit_test(test_counts_of_a_run),
        cmocka_unit_test(test_totals_of_a_run),
        cmocka_unit_test(test_closed_up_to_rounding),
        cmocka_unit_test(test_time_limit),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

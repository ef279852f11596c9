/* Steps of Moreau and Jean, beside closed forms: order 2 for theta = 1/2 without events, with
 * constraints and lasting contacts too; implicit Euler for theta = 1; order 1 through impacts. */
#include "memory.h"
#include "rig.h"

static perp_mechanism_settings theta_settings(double theta)
{
    perp_mechanism_settings settings = fresh_mechanism_settings();

    settings.scheme = PERP_MECHANISM_THETA;
    settings.theta = theta;
    return settings;
}

/* Largest distance from a machine's references for coordinates and velocities. */
static double error_of(int32_t name, double theta, double h)
{
    const perp_mechanism_settings settings = theta_settings(theta);
    machine_record record;
    machine m;
    double error = 0;
    int32_t k;

    machine_make(&m, name);
    rig_run(&record, name, &settings, h);
    for (k = 0; k < m.references; k++)
        if (m.reference[k].kind <= MACHINE_VELOCITY)
            error =
                fmax(error, fabs(machine_measure(&record, &m.reference[k]) - m.reference[k].value));
    return error;
}

/* At these steps the ratio is within 0.2 of the order: the next term is a percent of the first. */
static void test_orders(void **state)
{
    static const struct {
        int32_t name;
        double theta, h, order;
    } rows[] = {{MACHINE_PENDULUM, 0.5, 5e-3, 2}, {MACHINE_PENDULUM, 1, 5e-3, 1},
                {MACHINE_SPIN, 0.5, 2e-2, 2},     {MACHINE_SPIN, 1, 1e-2, 1},
                {MACHINE_SPIN, 0, 1e-2, 1},       {MACHINE_RAMP_R2, 1, 5e-3, 1}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++) {
        const double coarse = error_of(rows[k].name, rows[k].theta, rows[k].h),
                     fine = error_of(rows[k].name, rows[k].theta, rows[k].h / 2);

        near(log2(coarse / fine), rows[k].order, 0.2, "order");
    }
}

/* ---- k that depends on q and v ------------------------------------------------------------- */

/* k = -stiffness q - damping v + turning (v_1, -v_0) in two coordinates; may be asked for q
 * outside of its range; `load` is divided by mass 1. */
typedef struct springs {
    double stiffness, damping, turning, limit, load;
    int32_t calls;
} springs;

static int32_t spring_force(double *k, double t, const double *q, const double *v, void *user)
{
    springs *s = user;
    int32_t i;

    (void)t;
    s->calls++;
    if (s->limit > 0 && fabs(q[0]) > s->limit)
        return 1;
    for (i = 0; i < 2; i++)
        k[i] = s->load - s->stiffness * q[i] - s->damping * v[i];
    k[0] += s->turning * v[1];
    k[1] -= s->turning * v[0];
    return 0;
}

static void spring_model(perp_mechanism_model *model, springs *s)
{
    assert_int_equal(perp_mechanism_model_init(model, sizeof *model), PERP_OK);
    model->velocities = 2;
    model->force = spring_force;
    model->user = s;
}

/* One step; the outcome. */
static int32_t spring_step(springs *s, double theta, double h, double *q, double *v)
{
    const perp_mechanism_settings settings = theta_settings(theta);
    perp_mechanism_model model;
    perp_mechanism *mechanism;
    perp_mechanism_step step = fresh_mechanism_step();
    perp_context *context;

    spring_model(&model, s);
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &model), PERP_OK);
    assert_int_equal(
        perp_mechanism_advance(mechanism, q, v, NULL, NULL, NULL, NULL, &step, START(0, h, q, v)),
        PERP_OK);
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
    return step.outcome;
}

/* A linear system: v+ solves (1 + h theta d + h^2 theta^2 s) v+ = (1 - h (1-theta) d - h^2 theta
 * (1-theta) s) v - h s q, however stiff it is. */
static void test_linear(void **state)
{
    static const double thetas[] = {0.5, 0.7, 1}, sizes[] = {1, 1e4, 1e10};
    int a, b, c;

    (void)state;
    for (a = 0; a < 3; a++)
        for (b = 0; b < 3; b++)
            for (c = 0; c < 2; c++) {
                springs s = {sizes[b], c * sizes[b], 0, 0, 0, 0};
                const double theta = thetas[a], h = 0.1, k = h * s.stiffness, d = h * s.damping;
                const double weight = 1 + theta * d + h * theta * theta * k;
                double q[] = {1, -2}, v[] = {0.5, 3}, expected[2], place[2], size[2];
                int i;

                for (i = 0; i < 2; i++) {
                    expected[i] =
                        ((1 - (1 - theta) * d - h * theta * (1 - theta) * k) * v[i] - k * q[i]) /
                        weight;
                    place[i] = q[i] + h * (theta * expected[i] + (1 - theta) * v[i]);
                    size[i] = fabs(v[i]) + (d * fabs(v[i]) + k * fabs(q[i])) / weight;
                }
                assert_int_equal(spring_step(&s, theta, h, q, v), PERP_OUTCOME_SOLVED);
                for (i = 0; i < 2; i++) { /* to settings.tol of the sum of its terms */
                    near(v[i], expected[i], 1e-10 * 4 * (size[0] + size[1]), "v");
                    near(q[i], place[i], 1e-10 * 4 * h * (size[0] + size[1]), "q");
                }
                assert_true(s.calls < 20); /* differences included */
            }
}

/* Turning about the other velocity is not symmetric: no symmetric matrix helps, and where h times
 * it is above 2 the iteration cannot converge. It says so. */
static void test_iteration_limit(void **state)
{
    springs slow = {0, 0, 0.5, 0, 0, 0}, fast = {0, 0, 30, 0, 0, 0};
    double q[] = {0, 0}, v[] = {1, 0}, w[] = {1, 0};

    (void)state;
    assert_int_equal(spring_step(&slow, 0.5, 1, q, v), PERP_OUTCOME_SOLVED);
    /* the midpoint's rotation keeps the speed: angle 2 atan(1/4) */
    near(v[0], cos(2 * atan(0.25)), 1e-9, "v");
    near(v[1], -sin(2 * atan(0.25)), 1e-9, "v");
    assert_int_equal(spring_step(&fast, 0.5, 1, q, w), PERP_OUTCOME_ITERATION_LIMIT);
}

static void test_outside(void **state)
{
    springs s = {0, 0, 0, 1.5, 0, 0};
    double q[] = {1, 0}, v[] = {1, 0};

    (void)state;
    assert_int_equal(spring_step(&s, 0.5, 1, q, v), PERP_OUTCOME_EVALUATION_FAILED);
    assert_true(q[0] == 1 && q[1] == 0 && v[0] == 1 && v[1] == 0);
}

/* ---- friction and contact ------------------------------------------------------------------ */

/* Implicit Euler: where and when exact arithmetic stops, and rest from there on. */
static void test_ramp(void **state)
{
    static const struct {
        double h, x;
        int first;
    } rows[] = {{0.1, 1.5750711918848154, 17},
                {0.01, 1.6639337264529552, 168},
                {0.001, 1.6729195331378669, 1674}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof rows / sizeof *rows; k++) {
        int step;
        rig r;

        rig_open(&r, MACHINE_RAMP_R1);
        r.settings = theta_settings(1);
        rig_start(&r);
        for (step = 1; step <= 2 * rows[k].first; step++) {
            rig_step(&r, rows[k].h);
            assert_int_equal(r.v[0] == 0.0, step >= rows[k].first);
        }
        /* one rounding of numbers below 2 a step */
        near(r.q[0], rows[k].x, rows[k].first * 4 * RIG_EPS, "place of the stop");
        rig_close(&r);
    }
}

/* A ball at rest stays, to the last bit, and the floor carries it in each step. */
static void test_rest(void **state)
{
    double theta;

    (void)state;
    for (theta = 0.25; theta <= 1; theta += 0.25) {
        int step;
        rig r;

        rig_open(&r, MACHINE_BALL);
        r.settings = theta_settings(theta);
        r.machine.q[0] = 0;
        rig_start(&r);
        for (step = 0; step < 100; step++) {
            rig_step(&r, 1e-2);
            assert_true(r.q[0] == 0.0 && r.v[0] == 0.0);
            near(r.impulse[0], MACHINE_GRAVITY * 1e-2, 4 * RIG_EPS, "impulse at rest");
        }
        rig_close(&r);
    }
}

/* It bounces less and less and ends at rest: rebounds below g h are resting contact, which leaves
 * out 2 h of the sum of their times. Each of the bounces above is met up to a step late. */
static void test_ball(void **state)
{
    const double rest = 1.3545709229571927;
    double h;

    (void)state;
    for (h = 1e-2; h > 1e-4; h /= 4) {
        double stop = 0;
        rig r;

        rig_open(&r, MACHINE_BALL);
        r.settings = theta_settings(0.5);
        rig_start(&r);
        while (r.t < 2) {
            rig_step(&r, h);
            assert_true(r.q[0] >= 0);
            if (r.v[0] != 0.0)
                stop = r.t;
        }
        near(stop, rest, (log2(4.43 / (MACHINE_GRAVITY * h)) + 3) * h, "rest");
        assert_true(r.q[0] == 0.0);
        rig_close(&r);
    }
}

/* The three laws agree on chains that touch; to settings.tol. */
static void test_laws(void **state)
{
    static const int32_t chains[] = {MACHINE_CHAIN_3, MACHINE_CHAIN_5, MACHINE_CHAIN_UNLIKE};
    int32_t law, c, k;

    (void)state;
    for (law = PERP_MECHANISM_MOREAU; law <= PERP_MECHANISM_POISSON; law++)
        for (c = 0; c < 3; c++) {
            rig r;

            rig_open(&r, chains[c]);
            r.settings = theta_settings(0.5);
            r.settings.law = law;
            rig_start(&r);
            rig_step(&r, 1e-3);
            assert_int_equal(r.step.scheme, PERP_MECHANISM_THETA);
            assert_true(r.step.impacts > 0);
            for (k = 0; k < r.machine.references; k++)
                near(r.v[r.machine.reference[k].index], r.machine.reference[k].value, 1e-10,
                     r.machine.reference[k].what);
            rig_close(&r);
        }
}

/* The rod falls, tumbles and rests: order 1, with the constant that frozen steps have. */
static void test_fall(void **state)
{
    const perp_mechanism_settings settings = theta_settings(0.5);
    double h;

    (void)state;
    for (h = 2.5e-3; h > 1e-4; h /= 4) {
        machine_record record;
        int32_t i;

        rig_run(&record, MACHINE_ROD_FALL, &settings, h);
        near(record.q[0], -0.22735, 3 * h + 1e-5, "x");
        near(record.q[1], 0.05, 1e-15, "y");
        near(record.q[2], MACHINE_PI, 1e-14, "angle");
        for (i = 0; i < 3; i++)
            assert_true(record.v[i] == 0.0 && record.stop[i] < 0.9);
    }
}

/* The pendulum again, inside a circle that it touches by its own weight. */
static int32_t bowl_rows(double *gap, double *H, double *drift, double *mu, double t,
                         const double *q, void *user)
{
    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    gap[0] = (1 - q[0] * q[0] - q[1] * q[1]) / 2;
    H[0] = -q[0];
    H[1] = -q[1];
    return 0;
}

static double bowl_error(double h)
{
    perp_mechanism_settings settings = theta_settings(0.5);
    machine_record record;
    perp_context *context;
    double error = 0;
    machine m;
    int32_t k;

    machine_make(&m, MACHINE_PENDULUM);
    m.model.bilateral = 0;
    m.model.contacts = m.model.dim = 1;
    m.model.contact_rows = bowl_rows;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(machine_run(&record, context, &m, &settings, h, 0), PERP_OK);
    assert_int_equal(record.result.outcome, PERP_OUTCOME_SOLVED);
    for (k = 0; k < 4; k++)
        error = fmax(error, fabs(machine_measure(&record, &m.reference[k]) - m.reference[k].value));
    perp_context_destroy(context);
    return error;
}

/* A contact that lasts on curved ground keeps order 2. */
static void test_bowl(void **state)
{
    (void)state;
    near(log2(bowl_error(4e-3) / bowl_error(2e-3)), 2, 0.3, "order");
}

/* ---- velocities that jump ------------------------------------------------------------------ */

/* Thrown up from the floor so slowly that it is back within the step, a body lies on the floor, not
 * h v/2 above it. */
static void test_hop(void **state)
{
    const double h = 0.01;

    (void)state;
    for (int32_t k = 1; k < 10; k++) {
        const perp_mechanism_settings settings = theta_settings(0.5);
        rig r;

        rig_open(&r, MACHINE_BALL);
        r.settings = settings;
        r.machine.restitution[0] = 0;
        r.machine.q[0] = 0;
        r.machine.v[0] = 0.1 * k * (0.5 * MACHINE_GRAVITY * h);
        rig_start(&r);
        rig_step(&r, h);
        assert_true(r.q[0] == 0 && r.v[0] == 0);
        rig_close(&r);
    }
}

/* Painleve's rod jams at once, and goes on from the velocities of the impact: place and angle are
 * those up to what accelerations of g and of r w^2 = 0.45 make of h^2 (the mean of both velocities
 * leaves 0.2 h). */
static void test_jam(void **state)
{
    (void)state;
    for (double h = 1e-2; h > 1e-5; h *= 0.1) {
        rig r;

        rig_open(&r, MACHINE_ROD);
        r.settings = theta_settings(0.5);
        rig_start(&r);
        rig_step(&r, h);
        near(r.q[0], r.machine.q[0] + h * machine_value(&r.machine, "vx"), MACHINE_GRAVITY * h * h,
             "x");
        near(r.q[1], r.machine.q[1] + h * machine_value(&r.machine, "vy"), MACHINE_GRAVITY * h * h,
             "y");
        near(r.q[2], r.machine.q[2] + h * machine_value(&r.machine, "spin"),
             MACHINE_GRAVITY * h * h, "angle");
        rig_close(&r);
    }
}

/* ---- the handle ---------------------------------------------------------------------------- */

static perp_status everything(const perp_context_settings *from)
{
    const perp_mechanism_settings settings = theta_settings(0.5);
    springs s = {1e4, 1, 0, 0, 0, 0};
    double q[] = {1, 0}, v[] = {0, 1};
    perp_mechanism_model model;
    perp_mechanism *mechanism = NULL;
    perp_mechanism_step step = fresh_mechanism_step();
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, from);

    spring_model(&model, &s);
    if (status == PERP_OK)
        status = perp_mechanism_create(context, &mechanism, &settings, &model);
    if (status == PERP_OK) {
        status = perp_mechanism_advance(mechanism, q, v, NULL, NULL, NULL, NULL, &step,
                                        START(0, 0.1, q, v));
        if (status != PERP_OK)
            assert_true(q[0] == 1 && q[1] == 0 && v[0] == 0 && v[1] == 1);
    }
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
    return status;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(everything, 4);
}

/* The same bits, from handles old and new. */
static void test_determinism(void **state)
{
    const perp_mechanism_settings settings = theta_settings(0.5);
    machine_record one, other;

    (void)state;
    rig_run(&one, MACHINE_ROD_FALL, &settings, 2e-3);
    rig_run(&other, MACHINE_ROD_FALL, &settings, 2e-3);
    assert_memory_equal(one.q, other.q, sizeof one.q);
    assert_memory_equal(one.v, other.v, sizeof one.v);
    assert_int_equal(one.result.iterations, other.result.iterations);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orders),  cmocka_unit_test(test_linear),
        cmocka_unit_test(test_outside), cmocka_unit_test(test_iteration_limit),
        cmocka_unit_test(test_ramp),    cmocka_unit_test(test_rest),
        cmocka_unit_test(test_ball),    cmocka_unit_test(test_laws),
        cmocka_unit_test(test_fall),    cmocka_unit_test(test_bowl),
        cmocka_unit_test(test_hop),     cmocka_unit_test(test_jam),
        cmocka_unit_test(test_memory),  cmocka_unit_test(test_determinism),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

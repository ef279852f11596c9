/* What lets go in adaptive runs, against closed forms: a block that a growing force pulls along or
 * up, a slip that comes to rest, stick-slip on a belt, a mass that slides off a dome. */
#include "rig.h"

enum { MASS_N = 3 };

/* A point mass above the floor q[last] = 0, or a dome of radius 1. */
typedef struct mass {
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    double kg, mu, mu_static;
    double load[MASS_N], rate[MASS_N]; /* forces load + rate t */
    double late;                       /* the loads but the last come at this time */
    double drag;                       /* and a force -drag v */
    int32_t dome;
} mass;

static int32_t inertia(double *M, const double *q, void *user)
{
    const mass *m = user;
    const int32_t n = m->model.velocities;

    (void)q;
    for (int32_t i = 0; i < n; i++)
        M[i * (n + 1)] = m->kg;
    return 0;
}

static int32_t pull(double *k, double t, const double *q, const double *v, void *user)
{
    const mass *m = user;

    (void)q;
    for (int32_t i = 0; i < m->model.velocities; i++)
        k[i] = (t < m->late && i + 1 < m->model.velocities ? 0 : m->load[i]) + m->rate[i] * t -
               m->drag * v[i];
    return 0;
}

static int32_t ground(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                      void *user)
{
    const mass *m = user;
    const int32_t n = m->model.velocities, up = n - 1;

    (void)t;
    (void)drift;
    (void)mu;
    if (m->dome) {
        const double r = hypot(q[0], q[1]);

        gap[0] = r - 1;
        H[0] = H[3] = q[0] / r;
        H[1] = q[1] / r;
        H[2] = -H[1];
        return 0;
    }
    gap[0] = q[up];
    H[up] = 1;
    for (int32_t i = 0; i < up; i++)
        H[(i + 1) * n + i] = 1;
    return 0;
}

static void make_mass(mass *m, int32_t n, double mu, double mu_static)
{
    memset(m, 0, sizeof *m);
    assert_int_equal(perp_mechanism_model_init(&m->model, sizeof m->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&m->settings, sizeof m->settings), PERP_OK);
    m->kg = 1.4;
    m->mu = mu;
    m->mu_static = mu_static;
    m->model.velocities = m->model.dim = n;
    m->model.contacts = 1;
    m->model.mass = inertia;
    m->model.force = pull;
    m->model.contact_rows = ground;
    m->settings.scheme = PERP_MECHANISM_THETA;
}

/* From (q, v) to `end`, in place; steps taken. */
static int32_t go(mass *m, double *q, double *v, double end, perp_mechanism_observer observer,
                  void *user)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_mechanism *mechanism;
    perp_context *context;

    m->model.mu = &m->mu;
    m->model.mu_static = &m->mu_static;
    m->model.user = m;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(context, &mechanism, &m->settings, &m->model), PERP_OK);
    assert_int_equal(
        perp_mechanism_run(mechanism, q, v, &result, START(0, 1e-2, q, v), end, observer, user),
        PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
    return (int32_t)result.steps;
}

/* ---- a block and a force c t along the floor ------------------------------------------------- */

enum { NEWTONS = 8, SECONDS = 4 };

/* It breaks away at t1 = mu_static N / c; from there v = (c (t^2 - t1^2)/2 - mu N (t - t1)) / m.
 * The error of v beside v itself, and of x beside x, are those that were asked for. */
static void check_block(int32_t n, int32_t scheme, double mu_static, double error)
{
    const double mu = 0.45, c = 1.7, t1 = mu_static * NEWTONS / c, rest = SECONDS - t1;
    const double kg = 1.4, T = SECONDS;
    const double speed = (c * (T * T - t1 * t1) / 2 - mu * NEWTONS * rest) / kg;
    const double way = (c * ((T * T * T - t1 * t1 * t1) / 6 - t1 * t1 / 2 * rest) -
                        mu * NEWTONS * rest * rest / 2) /
                       kg;
    double q[MASS_N] = {0}, v[MASS_N] = {0};
    mass m;

    make_mass(&m, n, mu, mu_static);
    m.settings.scheme = scheme;
    m.settings.error = error;
    m.load[n - 1] = -NEWTONS;
    m.rate[0] = n == 2 ? c : 0.6 * c;
    m.rate[1] = n == 2 ? 0 : 0.8 * c;
    go(&m, q, v, SECONDS, NULL, NULL);
    near(n == 2 ? v[0] : hypot(v[0], v[1]), speed, error * speed, "v");
    near(n == 2 ? q[0] : hypot(q[0], q[1]), way, error * way, "x");
    assert_true(q[n - 1] == 0.0 && v[n - 1] == 0.0);
    if (n ==
        3) /* along the force: as exact as the contact problem, for each of thousands of steps */
        near(v[0] / v[1], 0.75, 1e-9, "direction");
}

static void test_block(void **state)
{
    double error;

    (void)state;
    for (error = 1e-4; error > 0.9e-10; error /= 10) {
        check_block(2, PERP_MECHANISM_THETA, 0.45, error);
        check_block(2, PERP_MECHANISM_THETA, 0.6, error);
    }
    check_block(3, PERP_MECHANISM_THETA, 0.45, 1e-6);
    check_block(3, PERP_MECHANISM_THETA, 0.6, 1e-6);
    check_block(2, PERP_MECHANISM_FROZEN, 0.6, 1e-4);
    check_block(2, PERP_MECHANISM_IMPLICIT, 0.6, 1e-4);
}

/* Drag and friction, m v' = -d v - mu N, for 3 s: v = (v0 + w) exp(-d t / m) - w, w = mu N / d.
 * What the iteration for the force may lack has to be less than the error, as thousands of steps
 * add it up. */
static void test_drag(void **state)
{
    const double mu = 0.45, d = 1.4, start = 60, w = mu * NEWTONS / d;
    double error;

    (void)state;
    for (error = 1e-4; error > 0.9e-10; error /= 10) {
        double q[MASS_N] = {0}, v[MASS_N] = {start};
        mass m;

        make_mass(&m, 2, mu, mu);
        m.settings.error = error;
        m.load[1] = -NEWTONS;
        m.drag = d;
        go(&m, q, v, 3, NULL, NULL);
        near(v[0], (start + w) * exp(-3 * d / m.kg) - w, error * start, "v");
    }
}

/* Pulled from the start with more than static friction holds it slips at once, on mu. */
static void test_slips_at_once(void **state)
{
    double q[MASS_N] = {0}, v[MASS_N] = {0};
    mass m;

    (void)state;
    make_mass(&m, 2, 0.45, 0.6);
    m.settings.error = 1e-8;
    m.load[0] = 5;
    m.load[1] = -NEWTONS;
    go(&m, q, v, 1, NULL, NULL);
    near(v[0], (5 - 0.45 * NEWTONS) / m.kg, 1e-8, "v");
}

/* A force that is switched on at 1.7 moves it from there, though nothing before says so. */
static void test_switch(void **state)
{
    double q[MASS_N] = {0}, v[MASS_N] = {0};
    mass m;

    (void)state;
    make_mass(&m, 2, 0.45, 0.6);
    m.settings.error = 1e-6;
    m.load[0] = 5;
    m.load[1] = -NEWTONS;
    m.late = 1.7;
    go(&m, q, v, 3, NULL, NULL);
    near(v[0], (5 - 0.45 * NEWTONS) * (3 - m.late) / m.kg, 1e-6, "v");
}

/* A slip against a force between mu N and mu_static N comes to rest and stays, as static friction
 * counts at rest; against more it turns round. In steps of any length the slip jumps over rest.
 * With friction p and the force f + t/5: m v = m v0 - (f + p) t - t^2/10 until it stops. */
static void test_comes_to_rest(void **state)
{
    const double force[] = {4, 5}, p = 0.45 * NEWTONS, kg = 1.4, speed = 2, end = 2;

    (void)state;
    for (int32_t k = 0; k < 2; k++) {
        const double sum = force[k] + p, stop = 5 * (sqrt(sum * sum + 0.4 * kg * speed) - sum);
        const double rest = k == 0 ? 0 : end - stop, back = force[k] - p + stop / 5;
        double q[MASS_N] = {0}, v[MASS_N] = {speed};
        mass m;

        make_mass(&m, 2, 0.45, 0.6);
        m.settings.error = 1e-6;
        m.load[0] = -force[k];
        m.rate[0] = -0.2;
        m.load[1] = -NEWTONS;
        go(&m, q, v, end, NULL, NULL);
        near(v[0], -(back * rest + rest * rest / 10) / kg, 2e-6 * speed, "v"); /* two events */
        near(q[0],
             speed * stop - (sum * stop * stop / 2 + stop * stop * stop / 30 +
                             back * rest * rest / 2 + rest * rest * rest / 30) /
                                kg,
             2e-6 * speed, "x");
        assert_true(k == 1 || v[0] == 0.0);
    }
}

/* The same in frozen steps, which do not end where the slip does: whatever the force and the step,
 * a slip that would turn round in it is caught. */
static void test_slip_is_caught(void **state)
{
    (void)state;
    for (int32_t k = 0; k < 40; k++) {
        double q[MASS_N] = {0}, v[MASS_N] = {0.3 + 0.1 * k};
        mass m;

        make_mass(&m, 2, 0.45, 0.6);
        m.settings.scheme = PERP_MECHANISM_FROZEN;
        m.settings.error = 1e-2 / (1 + k % 8);
        m.load[0] = -NEWTONS * (0.46 + 0.03 * (k % 5)); /* between mu N and mu_static N */
        m.load[1] = -NEWTONS;
        go(&m, q, v, 2.0, NULL, NULL);
        assert_true(v[0] == 0.0);
    }
}

/* In a guide that holds both ways: the load N = 8 - 5 t changes sides at 1.6, friction is mu |N|.
 */
static void test_changes_sides(void **state)
{
    static const int32_t both[] = {1};
    const double mu = 0.45, force = 5, turn = 1.6, end = 3;
    /* of |N|: until the turn, and all */
    const double first = NEWTONS * turn - 2.5 * turn * turn,
                 all = first + 2.5 * (end - turn) * (end - turn);
    double error;

    (void)state;
    for (error = 1e-4; error > 0.9e-10; error /= 10) {
        double q[MASS_N] = {0}, v[MASS_N] = {1, 0}, expected;
        mass m;

        make_mass(&m, 2, mu, mu);
        m.model.two_sided = both;
        m.settings.error = error;
        m.load[0] = force;
        m.load[1] = -NEWTONS;
        m.rate[1] = 5;
        go(&m, q, v, end, NULL, NULL);
        expected = 1 + (force * end - mu * all) / m.kg;
        near(v[0], expected, error * expected, "v");
        assert_true(v[1] == 0.0);
    }
}

/* ---- contacts that open ---------------------------------------------------------------------- */

/* Pulled up by c t: from t1 = N / c on y = c (t - t1)^3 / 6 m. */
static void test_lifts_off(void **state)
{
    double error;

    (void)state;
    for (error = 1e-4; error > 0.9e-10; error /= 100) {
        const double c = 3, t1 = NEWTONS / c, rest = SECONDS - t1;
        double q[MASS_N] = {0}, v[MASS_N] = {0};
        mass m;

        make_mass(&m, 2, 0.45, 0.6);
        m.settings.error = error;
        m.load[1] = -NEWTONS;
        m.rate[1] = c;
        go(&m, q, v, SECONDS, NULL, NULL);
        near(v[1], c * rest * rest / (2 * m.kg), error * v[1], "v");
        near(q[1], c * rest * rest * rest / (6 * m.kg), error * q[1], "y");
        assert_true(q[0] == 0.0 && v[0] == 0.0);
    }
}

/* Down a dome of radius 1 without friction, phi'' = g sin phi from phi = 0, by the method of Runge
 * and Kutta in 1e5 steps; it leaves where g cos phi = phi'^2, and flies. */
static void slide_off(double start, double end, double q[2])
{
    const double g = MACHINE_GRAVITY, h = end / 1e5;
    double phi = 0, w = start, t = 0, vx, vy;

    while (g * cos(phi) > w * w) {
        const double k1 = g * sin(phi), k2 = g * sin(phi + h / 2 * w),
                     k3 = g * sin(phi + h / 2 * (w + h / 2 * k1)),
                     k4 = g * sin(phi + h * (w + h / 2 * k2));

        phi += h * (w + h / 6 * (k1 + k2 + k3));
        w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        t += h;
    }
    vx = w * cos(phi); /* at most a step late, and then only the third derivative differs */
    vy = -w * sin(phi);
    q[0] = sin(phi) + vx * (end - t);
    q[1] = cos(phi) + vy * (end - t) - g / 2 * (end - t) * (end - t);
}

static double leaving_height(void)
{
    return (2 + 1 / MACHINE_GRAVITY) / 3;
}

static int32_t note_height(const perp_mechanism_view *view, void *user)
{
    double *nearest = user;

    *nearest = fmin(*nearest, fabs(view->q[1] - leaving_height()));
    return 0;
}

/* It leaves at the height (2 + v^2 / g) / 3, from where g y = v^2 + 2 g (1 - y), and a step ends
 * there. */
static void test_leaves_dome(void **state)
{
    double expected[2], error;

    (void)state;
    slide_off(1, 0.6, expected);
    for (error = 1e-4; error > 0.9e-8; error /= 100) {
        double q[MASS_N] = {0, 1}, v[MASS_N] = {1, 0}, nearest = 1;
        int32_t steps;
        mass m;

        make_mass(&m, 2, 0, 0);
        m.dome = 1;
        m.settings.error = error;
        m.load[1] = -m.kg * MACHINE_GRAVITY;
        steps = go(&m, q, v, 0.6, note_height, &nearest);
        near(nearest, 0, error * steps, "leaves");
        near(q[0], expected[0], error * steps, "x"); /* each step may add as much */
        near(q[1], expected[1], error * steps, "y");
    }
}

/* ---- a wall that pushes what slides over the floor ------------------------------------------- */

/* q = (x, y, z) over the floor, pushed by the wall x = 0.3 t. */
static int32_t floor_and_wall(double *gap, double *H, double *drift, double *mu, double t,
                              const double *q, void *user)
{
    (void)mu;
    (void)user;
    gap[0] = q[2];
    H[2] = H[3] = H[7] = 1;
    gap[1] = q[0] - 0.3 * t;
    H[9] = 1;
    drift[3] = -0.3;
    return 0;
}

static int32_t note_open_wall(const perp_mechanism_view *view, void *user)
{
    double *opened = user;

    if (view->h > 0 && view->modes[1] != PERP_MECHANISM_SEPARATE)
        *opened = view->t;
    return 0;
}

/* Friction of 4 takes 4 x' / |u| along x, of which the force t takes over more and more; 6 pulls
 * along y, so that the slip turns: y'' by the method of Runge and Kutta. */
static double wall_opens(void)
{
    const double h = 1e-5, kg = 1.4;
    double w = 0.4, t = 0;

    while (t < 4 * 0.3 / hypot(0.3, w)) {
        double k[4], at = w;

        for (int32_t i = 0; i < 4; i++) {
            k[i] = (6 - 4 * at / hypot(0.3, at)) / kg;
            at = w + h * (i == 2 ? 1 : 0.5) * k[i];
        }
        w += h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3]);
        t += h;
    }
    return t;
}

static void test_wall_opens(void **state)
{
    static const int32_t dims[] = {3, 1};
    const double mu[] = {0.5, 0};
    double q[MASS_N] = {0}, v[MASS_N] = {0.3, 0.4, 0}, opened = 0;
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_mechanism *mechanism;
    perp_context *context;
    mass m;

    (void)state;
    make_mass(&m, 3, 0, 0);
    m.load[1] = 6;
    m.load[2] = -NEWTONS;
    m.rate[0] = 1;
    m.settings.error = 1e-7;
    m.model.contacts = 2;
    m.model.dims = dims;
    m.model.mu = mu;
    m.model.contact_rows = floor_and_wall;
    m.model.user = &m;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(context, &mechanism, &m.settings, &m.model), PERP_OK);
    assert_int_equal(perp_mechanism_run(mechanism, q, v, &result, START(0, 1e-2, q, v), 2.5,
                                        note_open_wall, &opened),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    near(opened, wall_opens(), 3e-5, "the wall's last force"); /* a step of wall_opens, and error */
    perp_mechanism_destroy(mechanism);
    perp_context_destroy(context);
}

/* ---- stick and slip -------------------------------------------------------------------------- */

typedef struct slips {
    double first, last; /* when they began */
    int32_t mode, count;
} slips;

static int32_t count_slips(const perp_mechanism_view *view, void *user)
{
    slips *s = user;
    const double began = view->t - view->h;

    if (view->h > 0 && view->modes[0] == PERP_MECHANISM_SLIP && s->mode == PERP_MECHANISM_STICK) {
        s->first = s->count == 0 ? began : s->first;
        s->last = began;
        s->count++;
    }
    s->mode = view->h > 0 ? view->modes[0] : PERP_MECHANISM_STICK;
    return 0;
}

/* Ten cycles, with 1e-6 asked for: a mean period to 1e-6. */
static void test_belt(void **state)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    slips s = {0};
    rig r;

    (void)state;
    rig_open(&r, MACHINE_BELT);
    r.settings.scheme = PERP_MECHANISM_THETA;
    r.settings.error = 1e-6;
    rig_start(&r);
    assert_int_equal(perp_mechanism_run(r.mechanism, r.q, r.v, &result, START(0, 1e-2, r.q, r.v),
                                        7.5, count_slips, &s),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(s.count, 11);
    near(s.first, machine_value(&r.machine, "stick"), 1e-9, "first slip");
    near((s.last - s.first) / (s.count - 1), machine_value(&r.machine, "period"), 1e-6, "period");
    rig_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_block),          cmocka_unit_test(test_drag),
        cmocka_unit_test(test_slips_at_once),  cmocka_unit_test(test_switch),
        cmocka_unit_test(test_changes_sides),  cmocka_unit_test(test_comes_to_rest),
        cmocka_unit_test(test_slip_is_caught), cmocka_unit_test(test_lifts_off),
        cmocka_unit_test(test_leaves_dome),    cmocka_unit_test(test_wall_opens),
        cmocka_unit_test(test_belt),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

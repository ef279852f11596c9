/* Machines through either door, contacts that hold both ways and load-dependent friction: the same
 * accelerations, the same answers of a step, and of one coordinate the same step. */
#include "doors.h"

/* How often there were so many answers. */
typedef struct tally {
    int of[8];
} tally;

/* The answers of the friction are those of the mechanism; forces: its contacts are the friction's
 * sources, one by one. Whether two of them meet. */
static int compare(table *s, perp_load_friction *friction, const load_case *c, int32_t count,
                   int forces)
{
    perp_load_found one = fresh_load_found();
    int32_t i, j;
    int vertex = 0;

    assert_int_equal(s->summary.exhaustive, 1);
    if (count != s->summary.count)
        fail_msg("%d answers, and %d of the mechanism", (int)count, (int)s->summary.count);
    for (i = 0; i < count; i++) {
        const perp_mechanism_found *other;

        assert_int_equal(perp_load_friction_get(friction, &one, i), PERP_OK);
        vertex |= one.at_vertex;
        other = find(s, c->n, one.acceleration);
        assert_non_null(other);
        for (j = 0; j < c->n && forces; j++) { /* as near as accelerations, by conditions below 1e4
                                                */
            const double size = 1e-8 * fmax(1.0, fabs(one.normal_force[j]));

            table_near(other->force[2 * j], one.normal_force[j], size, "normal force");
            table_near(other->force[2 * j + 1], -one.friction[j], size, "friction");
        }
        if (c->n == 1) /* the sign of an inertia, whatever the contact rests on */
            assert_int_equal(other->stable, one.stable);
    }
    return vertex;
}

static void accelerate(table *s, const load_case *c, int forces, tally *seen)
{
    perp_load_friction *friction;
    perp_load_summary summary = fresh_load_summary();

    table_open(s);
    table_ask(s);
    friction = open_load(s->context, c);
    assert_int_equal(perp_load_friction_solve(friction, &summary, c->tau, c->sign), PERP_OK);
    compare(s, friction, c, summary.count, forces);
    seen->of[summary.count]++;
    if (s->summary.reason == PERP_MECHANISM_ALWAYS_ONE)
        assert_int_equal(s->summary.count, 1);
    perp_load_friction_destroy(friction);
    table_close(s);
}

/* c->sign are velocities. */
static void step(table *s, const load_case *c, double h, int forces, tally *seen)
{
    perp_load_friction *friction;
    perp_mechanism_step taken = fresh_mechanism_step();
    perp_load_step step = fresh_load_step();
    double next[3], v[TABLE_N], impulse[TABLE_ROWS];
    int vertex;

    table_open(s);
    friction = open_load(s->context, c);
    assert_int_equal(perp_load_friction_step(friction, next, NULL, &step, c->tau, c->sign, NULL, h),
                     PERP_OK);
    assert_int_equal(step.exhaustive, 1);
    if (perp_mechanism_answers(s->mechanism, &s->summary, 0, h, s->q, s->v) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
    vertex = compare(s, friction, c, step.answers, forces);
    seen->of[step.answers]++;
    assert_int_equal(perp_mechanism_advance(s->mechanism, s->q, v, impulse, NULL, NULL, NULL,
                                            &taken, START(0, h, s->q, s->v)),
                     PERP_OK);
    assert_int_equal(taken.outcome, PERP_OUTCOME_SOLVED);
    if (c->n == 1 && !vertex) { /* where answers meet neither is stable, or both */
        table_near(v[0], next[0], 1e-9, "velocity"); /* tol, 1e-10 beside the impulses */
        assert_int_equal(v[0] == 0.0, next[0] == 0.0);
    }
    perp_load_friction_destroy(friction);
    table_close(s);
}

/* ---- any system ---------------------------------------------------------------------------- */

static uint64_t seed;

static double draw(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 4503599627370496.0 - 1.0;
}

static void draw_load(load_case *c, int32_t n)
{
    int32_t i, j;

    memset(c, 0, sizeof *c);
    c->n = n;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            c->A[n * i + j] = i == j ? 3.0 : 0.0;
        for (j = 0; j < n; j++)
            c->C[n * i + j] = 3.0 * draw();
        c->b[i] = draw();
        c->d[i] = draw();
        c->tau[i] = 2.0 * draw();
        c->mu[i] = 2.0 * fabs(draw());
        c->mu_static[i] = c->mu[i] * (1.0 + 0.5 * fabs(draw()));
        c->sign[i] = draw() > 0.8 ? 0.0 : draw() > 0.0 ? 1.0 : -1.0;
    }
}

static void test_any(void **state)
{
    tally found = {{0}}, ahead = {{0}};
    int k;

    (void)state;
    seed = 11;
    for (k = 0; k < 600; k++) {
        load_case c;
        table s;
        int32_t i, j;

        draw_load(&c, 1 + k % 3);
        pose_load(&s, &c);
        accelerate(&s, &c, 1, &found);
        for (i = 0; i < c.n; i++)
            c.sign[i] *= fabs(draw());
        pose_load(&s, &c);
        for (i = 0; i < c.n; i++) /* the masses that are carried along move */
            for (j = 0; j < c.n; j++)
                s.v[c.n + i] -= s.H[2 * i * 2 * c.n + j] * c.sign[j];
        step(&s, &c, pow(10, draw() - 1), 1, &ahead);
    }
    assert_true(found.of[0] > 20 && found.of[1] > 50 && found.of[2] > 50 && found.of[3] > 0);
    assert_true(ahead.of[0] == 0); /* a step always has an answer */
    assert_true(ahead.of[1] > 50 && ahead.of[3] > 50);
}

/* Pulled from rest by 5.01 against mu_static N = 5 it leaves with mu N = 3: by every scheme. */
static void test_leaves_rest(void **state)
{
    const load_case c = {1, {1}, {0}, {0}, {1}, {3}, {5}, {5.01}, {0}};
    const double h = 1e-3;
    int32_t scheme;

    (void)state;
    for (scheme = PERP_MECHANISM_FROZEN; scheme <= PERP_MECHANISM_THETA; scheme++) {
        perp_mechanism_step taken = fresh_mechanism_step();
        perp_load_friction *friction;
        double next, v[TABLE_N];
        table s;

        pose_load(&s, &c);
        s.settings.scheme = scheme;
        table_open(&s);
        friction = open_load(s.context, &c);
        assert_int_equal(
            perp_load_friction_step(friction, &next, NULL, NULL, c.tau, c.sign, NULL, h), PERP_OK);
        assert_int_equal(perp_mechanism_advance(s.mechanism, s.q, v, NULL, NULL, NULL, NULL, &taken,
                                                START(0, h, s.q, s.v)),
                         PERP_OK);
        table_near(next, 2.01 * h, 1e-13, "load friction");
        table_near(v[0], 2.01 * h, 1e-12, "mechanism");
        perp_load_friction_destroy(friction);
        table_close(&s);
    }
}

/* ---- the drawer ---------------------------------------------------------------------------- */

/* Guides alike: N = +-m h x'' / L in both. m x'' + 2 mu |m h / L x''| sgn x' = F. */
static void test_drawer(void **state)
{
    tally found = {{0}}, ahead = {{0}};
    int mu, way, pull;

    (void)state;
    for (mu = 1; mu <= 8; mu++)
        for (way = -1; way <= 1; way++)
            for (pull = -3; pull <= 3; pull++) {
                const drawer_case d = {2.3, 0.6, 0.25, 0.05 * mu, pull};
                const load_case c = {1,          {d.mass},  {d.mass * d.offset / d.guide},
                                     {0},        {0},       {2 * d.mu},
                                     {2 * d.mu}, {d.force}, {way}};
                table s;

                pose_drawer(&s, &d, way);
                accelerate(&s, &c, 0, &found);
                pose_drawer(&s, &d, way);
                step(&s, &c, 0.01, 0, &ahead);
            }
    assert_true(found.of[0] > 0 && found.of[1] > 0 && found.of[2] > 0);
    assert_true(ahead.of[0] == 0 && ahead.of[1] > 0 && ahead.of[3] > 0);
}

/* A load P across and the guide behind without friction: N = -P / 2 - m h x'' / L in front. */
static void test_loaded_drawer(void **state)
{
    tally found = {{0}}, ahead = {{0}};
    int mu, way, pull, load;

    (void)state;
    for (mu = 1; mu <= 4; mu++)
        for (way = -1; way <= 1; way++)
            for (pull = -3; pull <= 3; pull++)
                for (load = -2; load <= 2; load++) {
                    const drawer_case d = {2.3, 0.6, 0.25, 0.2 * mu, 0.15 * pull};
                    const load_case c = {1,      {d.mass},      {-d.mass * d.offset / d.guide},
                                         {0},    {-load / 2.0}, {d.mu},
                                         {d.mu}, {d.force},     {way}};
                    int stepping;

                    for (stepping = 0; stepping < 2; stepping++) {
                        table s;

                        pose_drawer(&s, &d, way);
                        s.k[1] = load;
                        s.mu[1] = s.mu_static[1] = 0;
                        if (stepping)
                            step(&s, &c, 0.01, 1, &ahead);
                        else
                            accelerate(&s, &c, 1, &found);
                    }
                }
    assert_true(found.of[0] > 0 && found.of[1] > 0 && found.of[2] > 0 && found.of[3] > 0);
    assert_true(ahead.of[0] == 0 && ahead.of[1] > 0 && ahead.of[3] > 0);
}

/* ---- the lead screw ------------------------------------------------------------------------ */

/* The same screw as A th'' + b + mu |C th'' + d| sgn th' = T with the axial load C th'' + d, as in
 * examples/lead_screw.py. */
static void test_screw(void **state)
{
    const double lead = 3.14159265358979323846 / 36, r = 0.01, m = 50, W = 100;
    const double up = r * tan(lead + atan(0.2)), down = r * tan(lead - atan(0.2));
    const double pitch = r * tan(lead), mean = 0.5 * (up + down), half = 0.5 * (up - down);
    tally found = {{0}}, ahead = {{0}};
    int way, k;

    (void)state;
    for (way = -1; way <= 1; way++)
        for (k = -20; k <= 20; k++) {
            const load_case c = {1,           {2e-5 + m * pitch * mean},
                                 {m * pitch}, {W * mean},
                                 {W},         {half},
                                 {half},      {0.02 * k},
                                 {way}};
            table s;

            pose_screw(&s, 0.02 * k, way);
            accelerate(&s, &c, 0, &found);
            pose_screw(&s, 0.02 * k, way);
            step(&s, &c, 1e-5, 0, &ahead);
        }
    assert_true(found.of[0] > 0 && found.of[1] > 0 && found.of[2] > 0 && found.of[3] > 0);
    assert_true(ahead.of[0] == 0 && ahead.of[1] > 0 && ahead.of[3] > 0);
}

/* ---- the finger ---------------------------------------------------------------------------- */

/* A carriage, pushed by F, with a finger at the angle a whose tip, pressed by a torque, slides in a
 * slot: m x'' = F - f, N l cos a = torque + f l sin a, so that N = torque / (l cos a) + tan a (F -
 * m x''). */
static void pose_finger(table *s, double angle, double mu, double torque, double push, double way)
{
    static const int32_t one = 1;

    table_make(s, 2, 1, 2);
    fill_dimensions(s, &one);
    s->M[0] = 2.0;
    s->M[3] = 0.1; /* it does not turn */
    s->k[0] = push;
    s->k[1] = torque;
    s->H[1] = -0.5 * cos(angle); /* length 0.5 */
    s->H[2] = 1.0;
    s->H[3] = -0.5 * sin(angle);
    s->mu[0] = s->mu_static[0] = mu;
    s->v[0] = way;
}

static void test_finger(void **state)
{
    tally found = {{0}}, ahead = {{0}};
    int way, push, degree, press;

    (void)state;
    for (way = -1; way <= 1; way++)
        for (push = -6; push <= 6; push += 3)
            for (degree = 15; degree < 90; degree += 15)
                for (press = -1; press <= 1; press++) {
                    const double a = degree * 3.14159265358979323846 / 180, mu = 0.5;
                    const load_case c = {
                        1,    {2},  {-2 * tan(a)}, {0},  {press / (0.5 * cos(a)) + push * tan(a)},
                        {mu}, {mu}, {push},        {way}};
                    table s;

                    pose_finger(&s, a, mu, press, push, way);
                    accelerate(&s, &c, 1, &found);
                    pose_finger(&s, a, mu, press, push, way);
                    step(&s, &c, 1e-3, 1, &ahead);
                }
    assert_true(found.of[0] > 0 && found.of[1] > 0 && found.of[2] > 0 && found.of[3] > 0);
    assert_true(ahead.of[0] == 0 && ahead.of[1] > 0 && ahead.of[3] > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any),    cmocka_unit_test(test_leaves_rest),
        cmocka_unit_test(test_drawer), cmocka_unit_test(test_loaded_drawer),
        cmocka_unit_test(test_screw),  cmocka_unit_test(test_finger),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Accelerations of contacts that hold both ways: Dupont's drawer between two guides, his scalar
 * machine and his two coordinates, the lead screw, a pin's quadratic. */
#include "doors.h"

/* The accelerations of the first coordinate, one after the other. */
static void expect(table *s, int count, const double *x, double tolerance)
{
    int32_t k, i;

    assert_int_equal(table_ask(s), count);
    assert_int_equal(s->summary.exhaustive, 1);
    for (i = 0; i < count; i++) {
        for (k = 0; k < count; k++)
            if (fabs(table_get(s, k)->acceleration[0] - x[i]) <= tolerance * fmax(1.0, fabs(x[i])))
                break;
        if (k == count)
            fail_msg("%.17g is not among the accelerations", x[i]);
    }
}

/* Worked out in rational numbers: a = 1, b = 0, mu = 1/2, c = 3, d = 2, so that the inertias are
 * 5/2 and -1/2. The numbers here are of size 1 and the masses of 1/2 and 64: 1e-12 is rounding. */
static void test_scalar(void **state)
{
    static const struct {
        double tau, sign;
        int count;
        double x[3];
    } cases[] = {
        {-1, 1, 0, {0}},        {0, 1, 2, {-2, -0.4}}, {3, 1, 2, {-8, 0.8}},
        {-1, -1, 2, {-0.8, 0}}, {0, -1, 0, {0}},       {3, -1, 0, {0}},
        {-2, 0, 1, {-1.2}},     {-1, 0, 2, {-0.8, 0}}, {-5.0 / 6, 0, 3, {-11.0 / 15, -1.0 / 3, 0}},
        {0, 0, 1, {0}},         {1, 0, 1, {0}},        {2, 0, 1, {0.4}}};
    size_t k;
    int32_t i;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        const load_case c = {1, {1}, {3}, {0}, {2}, {0.5}, {0.5}, {cases[k].tau}, {cases[k].sign}};
        table s;

        pose_load(&s, &c);
        table_open(&s);
        expect(&s, cases[k].count, cases[k].x, 1e-12);
        for (i = 0; i < s.summary.count; i++) {
            const perp_mechanism_found *found = table_get(&s, i);
            const double x = found->acceleration[0], normal = 3 * x + 2;

            assert_int_equal(found->dimension, 0);
            table_near(found->force[0], normal, 1e-12, "normal force");
            table_near(found->force[1], x - cases[k].tau, 1e-12, "friction");
            /* what sticks, and the branch with the inertia 5/2: N along the motion */
            assert_int_equal(found->stable,
                             (cases[k].sign == 0 && x == 0.0) ||
                                 normal * (cases[k].sign == 0 ? x : cases[k].sign) > 0);
        }
        table_close(&s);
    }
}

/* A = [2 1; 1 2], C = [3 1; 1 3], d = mu = 1, both forwards: 4, 0, 0 and 2 answers, in rational
 * numbers. */
static void test_two_coordinates(void **state)
{
    static const struct {
        double tau[2];
        int count;
        double x[4];
    } cases[] = {{{0, 0}, 4, {-1, -1, -1.0 / 7, 0.2}},
                 {{-2, -2}, 0, {0}},
                 {{3, -3}, 0, {0}},
                 {{-1, 4}, 2, {0, 1.6}}};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        load_case c = {2, {2, 1, 1, 2}, {3, 1, 1, 3}, {0}, {1, 1}, {1, 1}, {1, 1}, {0}, {1, 1}};
        table s;

        memcpy(c.tau, cases[k].tau, sizeof cases[k].tau);
        pose_load(&s, &c);
        table_open(&s);
        expect(&s, cases[k].count, cases[k].x, 1e-12);
        assert_int_equal(s.summary.patterns, 4);
        table_close(&s);
    }
}

/* ---- the drawer ---------------------------------------------------------------------------- */

/* m x'' + 2 mu |N| = F with N = m h x'' / L: two accelerations along the motion, F / (m (1 + 2 mu h
 * / L)), stable, and F / (m (1 - 2 mu h / L)), not; none against it; and no family of preloads. */
static void test_drawer(void **state)
{
    static const drawer_case cases[] = {{2, 0.5, 0.3, 0.4, 1}, {2.3, 0.6, 0.25, 0.35, 3}};
    static const double known[2][2] = {{3.0 / 14, -1.5}, {0.486697, -1.918159}};
    int k, i;

    (void)state;
    for (k = 0; k < 2; k++) {
        const drawer_case *c = &cases[k];
        const double z = 2 * c->mu * c->offset / c->guide;
        const double x[2] = {c->force / (c->mass * (1 + z)), c->force / (c->mass * (1 - z))};
        table s;

        pose_drawer(&s, c, 1);
        table_open(&s);
        expect(&s, 2, x, 1e-13); /* numbers of size 1 */
        assert_int_equal(s.summary.families, 0);
        assert_int_equal(s.summary.stable, 1);
        assert_int_equal(s.summary.reason, PERP_MECHANISM_COUPLED);
        for (i = 0; i < 2; i++) {
            const perp_mechanism_found *found = table_get(&s, i);
            const double a = found->acceleration[0], N = c->mass * c->offset * a / c->guide;

            assert_int_equal(found->stable, a > 0);
            table_near(a, known[k][a > 0 ? 0 : 1], 5e-7, "acceleration"); /* six digits */
            assert_true(found->acceleration[1] == 0.0 && found->acceleration[2] == 0.0);
            table_near(found->force[0], -N, 1e-13, "normal force in front");
            table_near(found->force[2], N, 1e-13, "normal force behind");
            table_near(found->force[1], -c->mu * fabs(N), 1e-13, "friction in front");
            table_near(found->force[3], -c->mu * fabs(N), 1e-13, "friction behind");
        }
        table_close(&s);
        pose_drawer(&s, c, -1); /* against its motion: none */
        table_open(&s);
        assert_int_equal(table_ask(&s), 0);
        table_close(&s);
        pose_drawer(&s, c, 0); /* from rest nothing presses that could hold it */
        table_open(&s);
        expect(&s, 1, x, 1e-13);
        table_close(&s);
    }
}

/* ---- the lead screw ------------------------------------------------------------------------ */

/* Numbers of an independent computation: T = 0 has two accelerations, with N = 13.807 and -69.547,
 * the first stable; below the vertex, -0.0457202, there are none. It holds itself at rest, and
 * moves up from 0.2926087 on, down from -0.1105765. */
static void test_screw(void **state)
{
    static const double x[2] = {-1977.0895003470284, -3897.5253610274788};
    static const double normal[2] = {13.807, -69.547};
    int32_t i;
    table s;

    (void)state;
    pose_screw(&s, 0.0, 1.0);
    table_open(&s);
    expect(&s, 2, x, 1e-12); /* rounding of the closed form that x is printed from */
    assert_int_equal(s.summary.reason, PERP_MECHANISM_NEGATIVE_INERTIA);
    for (i = 0; i < 2; i++) {
        const perp_mechanism_found *found = table_get(&s, i);
        const int real = found->acceleration[0] > -2000;

        assert_int_equal(found->stable, real);
        table_near(found->force[0], normal[real ? 0 : 1], 1e-4, "normal force"); /* as printed */
    }
    table_close(&s);
}

/* ---- pins ---------------------------------------------------------------------------------- */

/* A pendulum on a pin: about the pin I a = T - m g l sin - mu r |N|, with the mass centre's
 * acceleration (a l, -w^2 l) in its own axes. |N| is the root of a quadratic, I_c a - ... . */
static void pose_pendulum(table *s, double mu, double torque, double way)
{
    static const int32_t two = 2;

    table_make(s, 3, 1, 3);
    fill_dimensions(s, &two);
    s->M[0] = s->M[4] = 2.0; /* mass; the mass centre is 0.5 below the pin */
    s->M[8] = 0.1;
    s->k[1] = -2.0 * 9.81;
    s->k[2] = torque;
    s->H[0] = 1.0; /* the pin's point (0, 0.5): x - 0.5 angle, y */
    s->H[2] = -0.5;
    s->H[4] = 1.0;
    s->H[8] = 0.3; /* radius times turning */
    s->mu[0] = s->mu_static[0] = mu;
    s->v[0] = 0.5 * way;
    s->v[2] = way;
}

/* Hanging straight, turning forwards: N = (2 (a / 2), 2 g) by Newton, and
 * (0.1 + 2 / 4) a = T - mu 0.3 sqrt(a^2 + 4 g^2): for mu 0.3 < 0.6 one answer, the root of
 * (0.36 - e^2) a^2 - 1.2 T a + T^2 - 4 e^2 g^2 = 0 with T - 0.6 a > 0, e = 0.3 mu. (The table's
 * rows are constant: its centripetal force is 0.) */
static void test_pendulum(void **state)
{
    static const double mus[] = {0.1, 1.0, 1.9, 2.1, 5.0}, torques[] = {-40, -20, 0, 5, 40};
    int i, j, k;

    (void)state;
    for (i = 0; i < 5; i++)
        for (j = 0; j < 5; j++) {
            const double e = 0.3 * mus[i], T = torques[j], g = 9.81;
            const double A = 0.36 - e * e, B = -0.6 * T, C = T * T - 4 * e * e * g * g;
            const double inside = B * B - A * C;
            double x[2];
            int count = 0;
            table s;

            for (k = -1; k <= 1 && inside >= 0; k += 2) {
                const double a = (-B + k * sqrt(inside)) / A;

                if (T - 0.6 * a > 0)
                    x[count++] = a;
            }
            pose_pendulum(&s, mus[i], T, 1.0);
            table_open(&s);
            assert_int_equal(table_ask(&s), count);
            assert_int_equal(s.summary.exhaustive, 1);
            for (k = 0; k < count; k++) {
                double least = INFINITY;
                int32_t m;

                for (m = 0; m < count; m++)
                    least = fmin(least, fabs(table_get(&s, m)->acceleration[2] - x[k]));
                assert_true(least <= 1e-11 * fmax(1.0, fabs(x[k]))); /* a quadratic's rounding */
            }
            assert_int_equal(s.summary.reason,
                             e < 0.6 ? PERP_MECHANISM_ALWAYS_ONE : PERP_MECHANISM_NEGATIVE_INERTIA);
            table_close(&s);
        }
}

/* At rest a pin holds what is below mu r |N|, exactly. */
static void test_pendulum_rests(void **state)
{
    const double g = 9.81, holds = 0.5 * 0.3 * 2 * g;
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        static const double part[] = {-1.001, -0.999, 0.999, 1.001};
        table s;

        pose_pendulum(&s, 0.5, part[k] * holds, 0.0);
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        if (fabs(part[k]) < 1) {
            assert_true(table_get(&s, 0)->acceleration[2] == 0.0);
            assert_int_equal(table_get(&s, 0)->modes[0], PERP_MECHANISM_STICK);
        } else {
            assert_true(part[k] * table_get(&s, 0)->acceleration[2] > 0.0);
            assert_int_equal(table_get(&s, 0)->modes[0], PERP_MECHANISM_SLIP);
        }
        assert_int_equal(table_get(&s, 0)->stable, 1);
        table_close(&s);
    }
}

/* ---- refusals ------------------------------------------------------------------------------ */

static void test_refusals(void **state)
{
    static const int32_t four = 4, two = 2;
    double restitution = 0.5;
    perp_context *context;
    perp_mechanism *mechanism;
    table s;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    pose_pendulum(&s, 0.5, 0, 0);
    s.model.two_sided = &four;
    assert_int_equal(perp_mechanism_create(context, &mechanism, NULL, &s.model),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "two_sided[0] is 4"));
    s.model.two_sided = &two;
    s.model.dim = 2;
    assert_int_equal(perp_mechanism_create(context, &mechanism, NULL, &s.model),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "dims[0] is 2, expected 3 or 4"));
    s.model.dim = 3;
    s.model.restitution = &restitution;
    assert_int_equal(perp_mechanism_create(context, &mechanism, NULL, &s.model),
                     PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "restitution[0] is 0.5"));
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scalar),         cmocka_unit_test(test_two_coordinates),
        cmocka_unit_test(test_drawer),         cmocka_unit_test(test_screw),
        cmocka_unit_test(test_pendulum),       cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_pendulum_rests),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

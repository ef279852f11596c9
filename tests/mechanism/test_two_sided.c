/* Accelerations of contacts that hold both ways: Dupont's drawer between two guides, his scalar
 * machine and his two coordinates, the lead screw, a pin's quadratic, and load-dependent friction
 * in general, which is the same through either door. */
#include "found.h"

/* ---- load-dependent friction as a mechanism ----------------------------------------------------
 *
 * A x + b + mu |C x + d| sgn v = tau. A row N = C x + d is what a mass m_i that is carried along,
 * y_i = C_i q / m_i, with the force -d_i on it, asks of its guide: m_i y_i'' = N_i - d_i. The
 * others feel -C_i'N_i / m_i, which C'C / m less inertia and the force C'd / m make up for. */

typedef struct load_case {
    int32_t n;
    double A[9], C[9], b[3], d[3], mu[3], mu_static[3], tau[3], sign[3];
} load_case;

static void fill_dimensions(table *s, const int32_t *two_sided)
{
    s->model.two_sided = two_sided;
    s->model.mu_static = s->mu_static;
}

static void pose_load(table *s, const load_case *c)
{
    static const int32_t ones[3] = {1, 1, 1};
    const int32_t n = c->n;
    int32_t i, j, k;

    table_make(s, 2 * n, n, 2);
    fill_dimensions(s, ones);
    memset(s->M, 0, sizeof s->M);
    for (i = 0; i < n; i++) {
        const double mass = 64.0; /* large enough for A to stay positive definite */

        s->M[(n + i) * (2 * n + 1)] = mass;
        s->k[i] += c->tau[i] - c->b[i];
        s->k[n + i] = -c->d[i];
        for (j = 0; j < n; j++) {
            s->M[i * 2 * n + j] += c->A[n * i + j];
            s->k[j] += c->C[n * i + j] * c->d[i] / mass;
            s->H[2 * i * 2 * n + j] = -c->C[n * i + j] / mass;
            for (k = 0; k < n; k++)
                s->M[j * 2 * n + k] -= c->C[n * i + j] * c->C[n * i + k] / mass;
        }
        s->H[2 * i * 2 * n + n + i] = 1.0;
        s->H[(2 * i + 1) * 2 * n + i] = 1.0;
        s->v[i] = c->sign[i];
        s->mu[i] = c->mu[i];
        s->mu_static[i] = c->mu_static[i];
    }
}

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

static perp_load_friction *open_load(perp_context *context, const load_case *c)
{
    perp_load_friction *friction;
    perp_load_system system;
    perp_matrix A, C;

    perp_matrix_init(&A, sizeof A);
    perp_matrix_init(&C, sizeof C);
    perp_matrix_dense(&A, PERP_STORAGE_ROW_MAJOR, c->n, c->n, c->A, c->n);
    perp_matrix_dense(&C, PERP_STORAGE_ROW_MAJOR, c->n, c->n, c->C, c->n);
    assert_int_equal(perp_load_system_init(&system, sizeof system), PERP_OK);
    system.n = c->n;
    system.A = &A;
    system.C = &C;
    system.b = c->b;
    system.d = c->d;
    system.mu = c->mu;
    system.mu_static = c->mu_static;
    assert_int_equal(perp_load_friction_create(context, &friction, NULL, &system), PERP_OK);
    return friction;
}

/* The answer with this x among those of the mechanism, or NULL. */
static const perp_mechanism_found *find(table *s, int32_t n, const double *x)
{
    int32_t k, i;

    for (k = 0; k < s->summary.count; k++) {
        const perp_mechanism_found *found = table_get(s, k);

        for (i = 0; i < n; i++) /* the masses' condition is below 1e3, that of patterns below 1e4 */
            if (!(fabs(found->acceleration[i] - x[i]) <= 1e-8 * fmax(1.0, fabs(x[i]))))
                break;
        if (i == n)
            return found;
    }
    return NULL;
}

static void test_either_door(void **state)
{
    int several = 0, none = 0, k;

    (void)state;
    seed = 11;
    for (k = 0; k < 600; k++) {
        perp_load_friction *friction;
        perp_load_summary summary;
        perp_load_found one;
        load_case c;
        table s;
        int32_t i, j;

        draw_load(&c, 1 + k % 3);
        pose_load(&s, &c);
        table_open(&s);
        table_ask(&s);
        friction = open_load(s.context, &c);
        assert_int_equal(perp_load_summary_init(&summary, sizeof summary), PERP_OK);
        assert_int_equal(perp_load_found_init(&one, sizeof one), PERP_OK);
        assert_int_equal(perp_load_friction_solve(friction, &summary, c.tau, c.sign), PERP_OK);
        if (summary.count != s.summary.count)
            fail_msg("system %d: %d answers, and %d of the mechanism", k, (int)summary.count,
                     (int)s.summary.count);
        for (i = 0; i < summary.count; i++) {
            const perp_mechanism_found *other;

            assert_int_equal(perp_load_friction_get(friction, &one, i), PERP_OK);
            other = find(&s, c.n, one.acceleration);
            assert_non_null(other);
            for (j = 0; j < c.n; j++) {
                table_near(other->force[2 * j], one.normal_force[j], 1e-8, "normal force");
                table_near(other->force[2 * j + 1], -one.friction[j], 1e-8, "friction");
            }
            if (c.n == 1) /* one contact's stability is the sign of an inertia, whatever it rests on
                           */
                assert_int_equal(other->stable, one.stable);
        }
        if (s.summary.reason == PERP_MECHANISM_ALWAYS_ONE)
            assert_int_equal(s.summary.count, 1);
        several += summary.count > 1;
        none += summary.count == 0;
        perp_load_friction_destroy(friction);
        table_close(&s);
    }
    assert_true(several > 50 && none > 20); /* all kinds occur */
}

/* ---- the drawer ---------------------------------------------------------------------------- */

typedef struct drawer_case {
    double mass, offset, guide, mu, force;
} drawer_case;

/* Planar body (x, y, angle), its mass centre `offset` beside the line of the pull and of two pins
 * in guides, `guide` apart: N_1 = -N_2 = m h x'' / L. */
static void pose_drawer(table *s, const drawer_case *c, int way)
{
    static const int32_t ones[2] = {1, 1};
    const double rows[4][3] = {
        {0, 1, c->guide / 2}, {1, 0, c->offset}, {0, 1, -c->guide / 2}, {1, 0, c->offset}};
    int i;

    table_make(s, 3, 2, 2);
    fill_dimensions(s, ones);
    s->M[0] = s->M[4] = c->mass;
    s->M[8] = 0.7; /* it does not turn */
    s->k[0] = c->force;
    s->k[2] = c->force * c->offset;
    for (i = 0; i < 4; i++)
        table_row(s->H, 3, i, rows[i]);
    s->mu[0] = s->mu[1] = s->mu_static[0] = s->mu_static[1] = c->mu;
    s->v[0] = way;
}

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

/* q = (angle, nut), N along (-r sin, cos), slip along (r cos, sin). */
static void pose_screw(table *s, double torque, double way)
{
    static const int32_t one = 1;
    const double lead = 3.14159265358979323846 / 36, r = 0.01, m = 50;

    table_make(s, 2, 1, 2);
    fill_dimensions(s, &one);
    s->M[0] = 2e-5;
    s->M[3] = m;
    s->k[0] = torque;
    s->k[1] = -100;
    s->H[0] = -r * sin(lead);
    s->H[1] = cos(lead);
    s->H[2] = r * cos(lead);
    s->H[3] = sin(lead);
    s->mu[0] = s->mu_static[0] = 0.2;
    s->v[0] = way;
    s->v[1] = way * r * tan(lead);
}

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

/* The same screw as A th'' + b + mu |C th'' + d| sgn th' = T with the axial load C th'' + d, as in
 * examples/lead_screw.py: moving and at rest, up to three answers. */
static void test_screw_either_door(void **state)
{
    const double lead = 3.14159265358979323846 / 36, r = 0.01, m = 50, W = 100;
    const double up = r * tan(lead + atan(0.2)), down = r * tan(lead - atan(0.2));
    const double pitch = r * tan(lead), mean = 0.5 * (up + down), half = 0.5 * (up - down);
    int way, k, counts[4] = {0};

    (void)state;
    for (way = -1; way <= 1; way++)
        for (k = -20; k <= 20; k++) {
            const load_case c = {1,           {2e-5 + m * pitch * mean},
                                 {m * pitch}, {W * mean},
                                 {W},         {half},
                                 {half},      {0.02 * k},
                                 {way}};
            perp_load_friction *friction;
            perp_load_summary summary;
            perp_load_found one;
            table s;
            int32_t i;

            pose_screw(&s, 0.02 * k, way);
            table_open(&s);
            table_ask(&s);
            friction = open_load(s.context, &c);
            assert_int_equal(perp_load_summary_init(&summary, sizeof summary), PERP_OK);
            assert_int_equal(perp_load_found_init(&one, sizeof one), PERP_OK);
            assert_int_equal(perp_load_friction_solve(friction, &summary, c.tau, c.sign), PERP_OK);
            assert_int_equal(summary.count, s.summary.count);
            for (i = 0; i < summary.count; i++) {
                assert_int_equal(perp_load_friction_get(friction, &one, i), PERP_OK);
                assert_non_null(find(&s, 1, one.acceleration));
                assert_int_equal(find(&s, 1, one.acceleration)->stable, one.stable);
            }
            counts[summary.count]++;
            perp_load_friction_destroy(friction);
            table_close(&s);
        }
    assert_true(counts[0] > 0 && counts[1] > 0 && counts[2] > 0 && counts[3] > 0);
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
        cmocka_unit_test(test_drawer),         cmocka_unit_test(test_either_door),
        cmocka_unit_test(test_screw),          cmocka_unit_test(test_pendulum),
        cmocka_unit_test(test_refusals),       cmocka_unit_test(test_screw_either_door),
        cmocka_unit_test(test_pendulum_rests),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

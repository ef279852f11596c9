/* Load-dependent friction with known answers: one coordinate (worked out in
 * rational numbers), two coordinates with 4, 2 and 0 answers, the sticky drawer, families. */
#include "friction_run.h"

static const double A = 1, b = 0, C = 3, d = 2, mu = 0.5; /* inertias 5/2 and -1/2 */

/* Of (j): torque, the sign of motion, answers and which of them are stable. */
typedef struct scalar_case {
    double tau, velocity;
    int count;
    double x[3];
    int kind[3], stable[3];
} scalar_case;

enum { DYN = PERP_LOAD_DYNAMIC, STAT = PERP_LOAD_STATIC };

static const scalar_case scalar_cases[] = {
    {-1, 1, 0, {0}, {0}, {0}},
    {-2.0 / 3, 1, 1, {-2.0 / 3}, {DYN}, {0}},
    {0, 1, 2, {-2, -0.4}, {DYN, DYN}, {0, 1}},
    {3, 1, 2, {-8, 0.8}, {DYN, DYN}, {0, 1}},
    {-1, -1, 2, {-0.8, 0}, {DYN, DYN}, {1, 0}},
    {-2.0 / 3, -1, 1, {-2.0 / 3}, {DYN}, {0}},
    {0, -1, 0, {0}, {0}, {0}},
    {3, -1, 0, {0}, {0}, {0}},
    {-2, 0, 1, {-1.2}, {DYN}, {1}},
    {-1, 0, 2, {-0.8, 0}, {DYN, STAT}, {1, 1}},
    {-5.0 / 6, 0, 3, {-11.0 / 15, -1.0 / 3, 0}, {DYN, DYN, STAT}, {1, 0, 1}},
    {-2.0 / 3, 0, 2, {-2.0 / 3, 0}, {DYN, STAT}, {0, 1}},
    {0, 0, 1, {0}, {STAT}, {1}},
    {1, 0, 1, {0}, {STAT}, {1}},
    {2, 0, 1, {0.4}, {DYN}, {1}},
};

static void test_scalar(void **state)
{
    asked a;
    size_t k;
    int i;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    for (k = 0; k < sizeof scalar_cases / sizeof *scalar_cases; k++) {
        const scalar_case *c = &scalar_cases[k];

        assert_int_equal(ask(&a, &c->tau, &c->velocity), c->count);
        assert_int_equal(a.summary.exhaustive, 1);
        for (i = 0; i < c->count; i++) {
            const perp_load_found found = answer(&a, i);
            const double x = found.acceleration[0];

            /* data of three digits; at the vertex 1 ulp of tau is 2 of x */
            assert_close(x, c->x[i], 4);
            assert_int_equal(found.kind, c->kind[i]);
            assert_int_equal(found.stable, c->stable[i]);
            assert_int_equal(found.dimension, 0);
            assert_close(found.normal_force[0], 3 * x + 2, 8);
            assert_close(x + found.friction[0], c->tau, 8);
            assert_true(found.residual < 1e-15);
            if (found.kind == PERP_LOAD_STATIC) /* by the active set */
                assert_true(x == 0.0);
        }
    }
    finish(&a);
}

static void test_words(void **state)
{
    (void)state;
    assert_string_equal(perp_load_kind_text(PERP_LOAD_FAMILY), "family");
    assert_string_equal(perp_load_kind_text(9), "unknown kind");
    assert_string_equal(perp_load_mode_text(PERP_LOAD_STOPPED), "stopped");
    assert_string_equal(perp_load_mode_text(-1), "unknown mode");
    assert_string_equal(perp_load_reason_text(PERP_LOAD_WELL_POSED), "");
    assert_string_equal(perp_load_reason_text(99), "unknown reason");
}

/* mu|c| = a: at tau* a half-line of answers with N <= 0, from the vertex on. */
static void test_half_line(void **state)
{
    const double flat = 2, forward = 1, vertex_tau = -1, above = 0.5, below = -1.5;
    perp_load_found found;
    asked a;

    (void)state;
    describe(&a, 1, &A, &b, &flat, &d, &mu);
    start(&a, NULL);
    assert_int_equal(ask(&a, &vertex_tau, &forward), 1);
    found = answer(&a, 0);
    assert_int_equal(found.kind, PERP_LOAD_FAMILY);
    assert_int_equal(found.dimension, 1);
    assert_int_equal(found.vertex_count, 1);
    assert_int_equal(found.ray_count, 1);
    assert_close(found.vertices[0], -1, 4);
    assert_close(found.rays[0] / fabs(found.rays[0]), -1, 0);
    assert_int_equal(found.stable, 0);
    assert_int_equal(ask(&a, &above, &forward), 1);
    assert_close(answer(&a, 0).acceleration[0], -0.25, 4); /* 2 x + 1 = tau */
    assert_int_equal(ask(&a, &below, &forward), 0);
    finish(&a);
}

static void test_two_coordinates(void **state)
{
    const double A2[] = {2, 1, 1, 2}, C2[] = {3, 1, 1, 3}, one[] = {1, 1}, zero[] = {0, 0};
    const double tau[][2] = {{0, 0}, {-2, -2}, {3, -3}, {5, 5}, {-1, 4}};
    const double expected[][4][2] = {{{-1, -1}, {-1, 0.2}, {-1.0 / 7, -1.0 / 7}, {0.2, -1}},
                                     {{0, 0}},
                                     {{0, 0}},
                                     {{-6, -6}, {-6, 3.2}, {4.0 / 7, 4.0 / 7}, {3.2, -6}},
                                     {{0, -5}, {1.6, -5}}};
    const int counts[] = {4, 0, 0, 4, 2};
    asked a;
    int k, i;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    start(&a, NULL);
    for (k = 0; k < 5; k++) {
        assert_int_equal(ask(&a, tau[k], one), counts[k]);
        for (i = 0; i < counts[k]; i++) {
            const perp_load_found found = answer(&a, i);

            assert_close(found.acceleration[0], expected[k][i][0], 8);
            assert_close(found.acceleration[1], expected[k][i][1], 8);
            /* both normal forces positive: the only stable branch */
            assert_int_equal(found.stable, found.normal_force[0] > 0 && found.normal_force[1] > 0);
        }
    }
    finish(&a);
}

static void test_uniqueness(void **state)
{
    const double A2[] = {2, 1, 1, 2}, C2[] = {3, 1, 1, 3}, one[] = {1, 1}, zero[] = {0, 0};
    perp_load_uniqueness u = fresh_load_uniqueness();
    asked a;

    (void)state;
    describe(&a, 2, A2, zero, C2, one, one);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
    assert_int_equal(u.verdict, PERP_LOAD_NOT_UNIQUE);
    assert_int_equal(u.exact, 1);
    assert_close(u.determinant, -5.0 / 3, 8); /* of 7, -5/3, -5/3, 1/3 */
    /* G = [5 -1; -1 5] / 3 has the eigenvalues 4/3 and 2, G diag(1, -1) +-sqrt(24)/3 */
    assert_close(u.margin, 0.5, 8);
    assert_true(u.norm >= 2.0 - 1e-12 && u.norm < 2.0 + 1e-11);
    assert_true(u.radius >= 2.0 - 1e-12 && u.radius < 2.0 + 1e-6);
    finish(&a);

    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
    assert_int_equal(u.verdict, PERP_LOAD_NOT_UNIQUE);
    assert_close(u.margin, 2.0 / 3, 4); /* mu_c = a / |c| = 1/3 */
    finish(&a);
}

/* Offset h of the pull, guide of length L: C = 2 m h / L, so m (1 +- 2 mu h / L). */
static void test_drawer(void **state)
{
    const double m = 2, h = 0.5, L = 0.3, friction = 0.4, zero = 0, force = 1;
    const double arm = 2 * m * h / L, forward = 1;
    perp_load_uniqueness u = fresh_load_uniqueness();
    asked a;

    (void)state;
    describe(&a, 1, &m, &zero, &arm, &zero, &friction);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
    assert_int_equal(u.verdict, PERP_LOAD_NOT_UNIQUE);
    assert_close(u.margin * h, 0.375, 4); /* critical offset L / (2 mu): inertia linear in both */
    assert_int_equal(ask(&a, &force, &forward), 2);
    assert_close(1 / answer(&a, 1).acceleration[0], 14.0 / 3, 8);
    assert_close(1 / answer(&a, 0).acceleration[0], -2.0 / 3, 8);
    assert_int_equal(answer(&a, 1).stable, 1);
    assert_int_equal(answer(&a, 0).stable, 0);
    finish(&a);
}

static void test_inverse(void **state)
{
    const double wanted[] = {-2, -0.4, 0}, forward = 1, rest = 0, weak = 0.1;
    perp_load_inverse inverse = fresh_load_inverse();
    double tau;
    asked a;

    (void)state;
    describe(&a, 1, &A, &b, &C, &d, &mu);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_inverse(a.friction, &tau, &inverse, &forward, &wanted[0]),
                     PERP_OK);
    assert_close(tau, 0, 1);
    assert_int_equal(inverse.reason, PERP_LOAD_UNSTABLE);
    assert_int_equal(inverse.accelerations, 2);
    assert_int_equal(perp_load_friction_inverse(a.friction, &tau, &inverse, &forward, &wanted[1]),
                     PERP_OK);
    assert_int_equal(inverse.reason, PERP_LOAD_SEVERAL);
    assert_int_equal(inverse.stable, 1);
    assert_int_equal(inverse.well_posed, 0);
    finish(&a);

    describe(&a, 1, &A, &b, &C, &d, &weak);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_inverse(a.friction, &tau, &inverse, &forward, &wanted[1]),
                     PERP_OK);
    assert_close(tau, -0.4 + 0.1 * 0.8, 2);
    assert_int_equal(inverse.well_posed, 1);
    assert_int_equal(perp_load_friction_inverse(a.friction, &tau, &inverse, &rest, &wanted[2]),
                     PERP_OK);
    assert_int_equal(inverse.reason, PERP_LOAD_AT_REST);
    assert_int_equal(inverse.undetermined, 1);
    finish(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scalar),     cmocka_unit_test(test_words),
        cmocka_unit_test(test_half_line),  cmocka_unit_test(test_two_coordinates),
        cmocka_unit_test(test_uniqueness), cmocka_unit_test(test_drawer),
        cmocka_unit_test(test_inverse),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

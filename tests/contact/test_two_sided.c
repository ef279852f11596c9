/* Contacts that hold both ways: laws recomputed, closed forms (Dupont's drawer), zeros, starts, and
 * what is refused. test_two_sided_random.c has answers enumerated. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "two_sided.h"

/* Pins, axles, ball joints and guides in space, beside contacts in space: the laws. */
static void test_laws(void **state)
{
    static const int32_t kinds[][2] = {{1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 4}, {3, 5}, {0, 3}};
    (void)state;
    for (uint64_t k = 1; k <= 200; k++) {
        both_problem p;
        both_answer a;
        memset(&p, 0, sizeof p);
        both_seed = 77 * k;
        for (int c = 0; c < 3; c++) {
            const int32_t *kind = kinds[(int)(3.5 * (both_draw() + 1.0))];
            both_add(&p, kind[0], kind[1], 0.8 + 0.7 * both_draw());
        }
        both_fill(&p, 1, k % 3 == 0, k % 2 == 0);
        both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
        both_require_solved(&a, k);
        both_require_laws(&p, &a);
        both_by_dynamics(&p, PERP_CONTACT_METHOD_PROXIMAL, 0, NULL, &a);
        both_require_solved(&a, k);
        both_require_laws(&p, &a);
        both_by_delassus(&p, PERP_CONTACT_METHOD_PROXIMAL, NULL, &a);
        both_require_solved(&a, k);
        both_require_laws(&p, &a);
        both_by_delassus(&p, PERP_CONTACT_METHOD_LEMKE, NULL, &a);
        both_require_solved(&a, k);
        both_require_laws(&p, &a);
    }
}

/* ---- Dupont's drawer ------------------------------------------------------------------------ */

/* A drawer of mass m between guides without clearance, pulled by F at h off its mass centre: corner
 * guides at +-L/2 carry N_2 = -N_1 = m a h / L, so that m a + 2 mu |m a h / L| = F where it moves
 * forward: a = F / (m (1 +- 2 mu h / L)), two answers. One step of h from speed V. */
static const double mass = 2.3, inertia = 0.11, pull = 3.0, offset = 0.6, guide = 0.25,
                    friction = 0.35, step = 1e-3, speed = 1.0;

static void build_drawer(both_problem *p)
{
    both_drawer(p, mass, inertia, offset, guide, friction);
    p->f[0] = mass * speed + step * pull;
    p->f[2] = step * pull * offset;
    both_form(p);
}

static double acceleration(const both_answer *a)
{
    return (a->v[0] - speed) / step;
}

/* From a start on either side of N each of the two answers is found, and at rest the third, that
 * the drawer jams, where the start sticks. */
static void test_drawer(void **state)
{
    const double arm = 2.0 * friction * offset / guide;
    const double expected[] = {pull / (mass * (1.0 + arm)), pull / (mass * (1.0 - arm))};
    (void)state;
    assert_true(fabs(expected[0] - 0.486697) < 5e-7 && fabs(expected[1] + 1.918159) < 5e-7);
    for (int side = 0; side < 2; side++) {
        const double N = -step * mass * expected[side] * offset / guide;
        const double r0[] = {N, -friction * fabs(N), -N, -friction * fabs(N)};
        both_problem p;
        both_answer a;
        build_drawer(&p);
        both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, r0, &a);
        both_require_solved(&a, (uint64_t)side);
        /* tol 1e-10 of a momentum of 2.3, over m h = 2.3e-3 */
        assert_true(fabs(acceleration(&a) - expected[side]) < 2e-7);
        assert_true(a.u[0] == 0.0 && a.u[2] == 0.0 && a.v[1] == 0.0 && a.v[2] == 0.0);
        assert_int_equal(a.modes[0], PERP_CONTACT_SLIP);
        assert_int_equal(a.modes[1], PERP_CONTACT_SLIP);
    }
}

/* Without a start it is one of the three. */
static void test_drawer_methods(void **state)
{
    static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_LEMKE,
                                      PERP_CONTACT_METHOD_PROXIMAL};
    (void)state;
    for (int m = 0; m < 3; m++) {
        both_problem p;
        both_answer a;
        build_drawer(&p);
        both_by_dynamics(&p, methods[m], 0, NULL, &a);
        both_require_solved(&a, (uint64_t)m);
        assert_true(fabs(acceleration(&a) - 0.486697) < 1e-6 ||
                    fabs(acceleration(&a) + 1.918159) < 1e-6 || a.v[0] == 0.0);
    }
}

/* Pushed against its jam it does not move: v is 0 to the last bit. */
static void test_zeros(void **state)
{
    both_problem p;
    both_answer a;
    (void)state;
    build_drawer(&p);
    p.f[0] = step * pull;
    both_form(&p);
    both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
    both_require_solved(&a, 0);
    if (a.modes[0] == PERP_CONTACT_STICK)
        for (int i = 0; i < 3; i++)
            assert_true(a.v[i] == 0.0);
    p.f[2] = 0.0; /* at the mass centre's height the guides carry it all */
    for (int k = 0; k < 2; k++)
        p.mu[k] = 2.0;
    both_form(&p);
    both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
    both_require_solved(&a, 1);
    both_require_laws(&p, &a);
}

/* ---- refusals ------------------------------------------------------------------------------- */

static void refuse(both_problem *p, int32_t method, const char *text)
{
    both_answer a;
    const perp_status status = both_call(p, method, 0, NULL, &a);
    assert_int_equal(status, PERP_ERROR_ARGUMENT);
    if (!strstr(perp_context_message(both_context), text))
        fail_msg("'%s' without '%s'", perp_context_message(both_context), text);
    build_drawer(p);
}

static void test_refusals(void **state)
{
    both_problem p;
    (void)state;
    build_drawer(&p);
    p.two_sided[1] = 4;
    refuse(&p, 0, "laws.two_sided[1] is 4, expected 0, 1, 2 or 3");
    p.two_sided[1] = -1;
    refuse(&p, 0, "laws.two_sided[1] is -1, expected 0, 1, 2 or 3");
    p.two_sided[1] = 2;
    refuse(&p, 0, "laws.dims[1] is 2, expected 3 or 4: 2 normals that hold both ways");
    p.dims[0] = 1;
    refuse(&p, 0, "laws.dims[0] is 1, expected 2 or 3");
    p.dims[0] = 4;
    refuse(&p, 0, "laws.dims[0] is 4, expected 2 or 3");
    memset(p.H, 0, MOST * sizeof *p.H);
    refuse(&p, 0, "contact 0: its normal impulse moves nothing");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),           cmocka_unit_test(test_drawer),
        cmocka_unit_test(test_drawer_methods), cmocka_unit_test(test_zeros),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, both_make, both_destroy);
}

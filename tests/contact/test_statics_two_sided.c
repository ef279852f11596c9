/* Guides and pins whose direction of pressing is told by impulses: beads in slots, drawers and
 * axles in bushes, at 1 - 1e-9 and 1 + 1e-9 of what their friction holds, in closed form. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"

#include "context.h"

enum { MEMBERS = 2000, MOST_N = 3, MOST_ROWS = 4 };

static double r[MOST_ROWS], v[MOST_N];

/* Contacts of these dimensions and normals; the verdict. */
static int32_t ask(int32_t n, int32_t contacts, int32_t dim, int32_t normals, double mu,
                   const double *H, const double *f, const double *r0)
{
    const int32_t both[] = {normals, normals};
    const double coefficients[] = {mu, mu};
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix view;
    perp_statics_problem problem = fresh_statics_problem();
    perp_statics_result result = fresh_statics_result();

    view = matrix_rows(H, contacts * dim, n);
    laws.contacts = contacts;
    laws.dim = dim;
    laws.mu = coefficients;
    laws.two_sided = both;
    problem.n = n;
    problem.laws = &laws;
    problem.H = &view;
    problem.f = f;
    problem.r0 = r0;
    assert_int_equal(perp_contact_statics(context, r, v, &result, &problem, NULL), PERP_OK);
    return result.verdict;
}

/* What is left of the forces beside 1e-12 (statics.c, BALANCED) of all terms. */
static void check_balance(int32_t n, int32_t rows, const double *H, const double *f)
{
    double left = 0.0, most = 0.0;

    for (int32_t j = 0; j < n; j++) {
        double sum = f[j], terms = fabs(f[j]);

        for (int32_t i = 0; i < rows; i++) {
            sum += H[i * n + j] * r[i];
            terms += fabs(H[i * n + j] * r[i]);
        }
        left = fmax(left, fabs(sum));
        most = fmax(most, terms);
    }
    assert_true(left <= 1e-12 * most);
}

/* A bead in a slot of any heading: forces along it up to mu times those across hold. Pressed the
 * other way nothing balances, and so it falls. */
static void test_beads_in_slots(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 11);
    for (int32_t k = 0; k < MEMBERS; k++) {
        const double angle = gen_uniform(&random, 0.0, 6.283185),
                     mu = gen_uniform(&random, 0.05, 1.5);
        const double size = exp(gen_uniform(&random, -9.0, 9.0)), slack = k % 2 ? 1e-9 : -1e-9;
        const double side = k % 4 < 2 ? 1.0 : -1.0, c = cos(angle), s = sin(angle);
        const double H[] = {c, s, -s, c}, along = side * mu * (1.0 + slack);
        const double f[] = {size * (side * c - along * s), size * (side * s + along * c)};
        const double r0[] = {-side * exp(gen_uniform(&random, -600.0, 600.0)), 0.0};
        const double other[] = {-r0[0], 0.0};

        assert_int_equal(ask(2, 1, 2, 1, mu, H, f, r0),
                         slack < 0.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        if (slack < 0.0) {
            check_balance(2, 2, H, f);
            assert_true(side * r[0] < 0.0 && fabs(r[1]) <= mu * fabs(r[0]));
        }
        assert_int_equal(ask(2, 1, 2, 1, mu, H, f, other), PERP_STATICS_FALLS);
    }
}

/* A drawer between guides, one at each end, is pulled beside its middle: it jams from length over 2
 * mu on. */
static void test_drawers(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 12);
    for (int32_t k = 0; k < MEMBERS; k++) {
        const double length = gen_uniform(&random, 0.1, 3.0), mu = gen_uniform(&random, 0.05, 1.5);
        const double half = 0.5 * length, way = k % 4 < 2 ? 1.0 : -1.0;
        const double slack = k % 2 ? 1e-9 : -1e-9;
        const double H[] = {0, 1, half, 1, 0, 0, 0, 1, -half, 1, 0, 0};
        const double f[] = {1.0, 0.0, -way * length / (2.0 * mu) * (1.0 + slack)};
        const double r0[] = {way, 0.0, -way, 0.0};

        assert_int_equal(ask(3, 2, 2, 1, mu, H, f, r0),
                         slack > 0.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        if (slack > 0.0)
            check_balance(3, 4, H, f);
    }
}

/* An axle in its bush holds a moment up to mu times its radius times the force, of any direction.
 * r0 that is turned from that by an angle leaves the cosine of it; where it stands then, impulses
 * are those of the force all the same. */
static void test_axles_in_bushes(void **state)
{
    gen_random random;

    (void)state;
    gen_seed(&random, 13);
    for (int32_t k = 0; k < MEMBERS; k++) {
        const double angle = gen_uniform(&random, 0.0, 6.283185),
                     mu = gen_uniform(&random, 0.05, 1.5);
        const double turned = k % 3 ? 0.0 : gen_uniform(&random, -1.2, 1.2);
        const double radius = gen_uniform(&random, 0.1, 2.0), slack = k % 2 ? 1e-9 : -1e-9;
        const double H[] = {1, 0, 0, 0, 1, 0, 0, 0, radius};
        const double held = mu * radius * cos(turned);
        const double f[] = {-cos(angle), -sin(angle), held * (1.0 + slack)};
        const double r0[] = {3.0 * cos(angle + turned), 3.0 * sin(angle + turned), 0.0};

        assert_int_equal(ask(3, 1, 3, 2, mu, H, f, r0),
                         slack < 0.0 ? PERP_STATICS_STANDS : PERP_STATICS_FALLS);
        if (slack < 0.0) {
            check_balance(3, 3, H, f);
            assert_true(fabs(r[2]) <= mu * hypot(r[0], r[1]));
        }
    }
}

/* Without friction nothing has to be told. */
static void test_slots_without_friction(void **state)
{
    const double H[] = {0, 1, 1, 0}, along[] = {1.0, 0.0};

    (void)state;
    for (double way = -1.0; way < 2.0; way += 2.0) {
        const double across[] = {0.0, way};

        assert_int_equal(ask(2, 1, 2, 1, 0.0, H, across, NULL), PERP_STATICS_STANDS);
        assert_true(fabs(r[0] + way) <= 1e-15 && r[1] == 0.0);
    }
    assert_int_equal(ask(2, 1, 2, 1, 0.0, H, along, NULL), PERP_STATICS_FALLS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_beads_in_slots),
        cmocka_unit_test(test_drawers),
        cmocka_unit_test(test_axles_in_bushes),
        cmocka_unit_test(test_slots_without_friction),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* The edge of sticking at every scale, towers of very different masses, and numbers at the ends of
 * what there is. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "context.h"

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON, PERP_CONTACT_METHOD_LEMKE};

enum { METHODS = sizeof methods / sizeof *methods };

/* A brick on a slope whose mu is 1e-9 above or below tan(angle), at the default tolerance: it holds
 * with velocity 0.0, or it moves with g h (sin - mu cos), 3e-10 of g h, to six digits. */
static void test_edge_of_sticking(void **state)
{
    static const double gravities[] = {1e-12, 9.81, 1e12}, masses[] = {1e-6, 1.0, 1e8};
    const double angle = 0.3, h = 0.01;
    int32_t g, m, k, dim, above;

    (void)state;
    for (g = 0; g < 3; g++)
        for (m = 0; m < 3; m++)
            for (k = 0; k < METHODS; k++)
                for (dim = 2; dim <= 3; dim++)
                    for (above = 0; above < 2; above++) {
                        const double mu = tan(angle) * (above ? 1 + 1e-9 : 1 - 1e-9);
                        const double s = gravities[g] * h, w = 1 / masses[m];
                        const double q[3] = {-s * cos(angle), s * sin(angle), 0.0};
                        const double W[9] = {w, 0, 0, 0, w, 0, 0, 0, w}, W2[4] = {w, 0, 0, w};
                        perp_contact_settings settings = fresh_contact_settings();
                        perp_contact_result result = fresh_contact_result();
                        perp_contact_laws laws = fresh_contact_laws();
                        perp_matrix view = fresh_matrix();
                        double r[3], u[3];
                        int32_t mode;

                        assert_int_equal(
                            perp_matrix_dense(&view, 0, dim, dim, dim == 3 ? W : W2, dim), 0);
                        settings.method = methods[k];
                        laws.contacts = 1;
                        laws.dim = dim;
                        laws.mu = &mu;
                        assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u, &mode),
                                                            &result, &settings,
                                                            DELASSUS(&laws, &view, q), NULL),
                                         PERP_OK);
                        assert_int_equal(mode, above ? PERP_CONTACT_STICK : PERP_CONTACT_SLIP);
                        if (above)
                            assert_true(u[1] == 0.0 && (dim == 2 || u[2] == 0.0));
                        else
                            assert_true(fabs(u[1] / (s * (sin(angle) - mu * cos(angle))) - 1) <=
                                        1e-6);
                    }
}

/* A block on a block, pushed with a tenth of its weight: the impulses are the weights. Heavy over
 * light, r_1 - r_2 is the light one's weight, which impulses of the heavy one's size hold to 2^-53
 * of themselves: that is the rounding limit. */
static void test_two_blocks(void **state)
{
    static const double ratios[] = {1.0, 1e2, 1e4, 1e8};
    const double s = 9.81 * 0.01, mu[2] = {0.5, 0.5};
    int32_t a, order, k, i, j;

    (void)state;
    for (a = 0; a < 4; a++)
        for (order = 0; order < 2; order++)
            for (k = 0; k < METHODS; k++) {
                const double m[2] = {order ? ratios[a] : 1.0, order ? 1.0 : ratios[a]};
                const double f[4] = {0.0, -m[0] * s, 0.1 * m[1] * s, -m[1] * s}, w[4] = {0.0};
                const double expected[4] = {(m[0] + m[1]) * s, -0.1 * m[1] * s, m[1] * s,
                                            -0.1 * m[1] * s};
                double M[16] = {0.0}, r[4], v[4];
                const double H[16] = {0, 1, 0, -1, 1, 0, -1, 0, 0, 0, 0, 1, 0, 0, 1, 0};
                perp_contact_dynamics dynamics = fresh_contact_dynamics();
                perp_contact_settings settings = fresh_contact_settings();
                perp_contact_result result = fresh_contact_result();
                perp_contact_laws laws = fresh_contact_laws();
                perp_matrix mass, rows;

                for (i = 0; i < 2; i++)
                    for (j = 0; j < 2; j++)
                        M[5 * (2 * i + j)] = m[i];
                assert_int_equal(perp_struct_init(&mass, sizeof mass), 0);
                assert_int_equal(perp_struct_init(&rows, sizeof rows), 0);
                assert_int_equal(perp_matrix_dense(&mass, 0, 4, 4, M, 4), 0);
                assert_int_equal(perp_matrix_dense(&rows, 0, 4, 4, H, 4), 0);
                settings.method = methods[k];
                settings.tol = 1e-10;
                laws.contacts = 2;
                laws.dim = 2;
                laws.mu = mu;
                dynamics.n = 4;
                dynamics.M = &mass;
                dynamics.H = &rows;
                assert_int_equal(perp_contact_solve(context, ANSWER(v, r), &result, &settings,
                                                    DYNAMICS(&laws, &dynamics, f, w), NULL),
                                 PERP_OK);
                if (result.outcome > PERP_OUTCOME_ROUNDING_LIMIT)
                    fail_msg("ratio %g, order %d, %s: %s, residual %g", ratios[a], (int)order,
                             perp_contact_method_text(methods[k]),
                             perp_outcome_text(result.outcome), result.residual);
                for (i = 0; i < 4; i++)
                    assert_true(fabs(r[i] - expected[i]) <= 1e-6 * fabs(expected[i]));
            }
}

/* What methods solve inside, the LCP of the polyhedra and that of the proof, overflows in the units
 * of these contacts. W and q are finite: that nobody finds an answer is an outcome, no refusal. */
static void test_inner_problems_that_overflow(void **state)
{
    static const double W[4] = {3.8e160, -6.8e123, -6.8e123, 1.08e93}, q[2] = {1.7e308, -1.7e308};
    static const double mu[2] = {0.0, 0.0};
    int32_t k, cone;

    (void)state;
    for (k = 0; k < METHODS; k++)
        for (cone = 0; cone <= 4; cone += 4) {
            const int32_t pivots =
                methods[k] == PERP_CONTACT_METHOD_AUTO || methods[k] == PERP_CONTACT_METHOD_LEMKE;
            perp_contact_settings settings = fresh_contact_settings();
            perp_contact_result result = fresh_contact_result();
            perp_contact_laws laws = fresh_contact_laws();
            perp_matrix view = fresh_matrix();
            double r[2], u[2];

            if (cone > 0 && !pivots)
                continue;
            assert_int_equal(perp_matrix_dense(&view, 0, 2, 2, W, 2), 0);
            settings.method = methods[k];
            settings.cone = cone;
            laws.contacts = 2;
            laws.dim = 1;
            laws.mu = mu;
            if (perp_contact_solve(context, ANSWER(NULL, r, u), &result, &settings,
                                   DELASSUS(&laws, &view, q), NULL) != PERP_OK)
                fail_msg("%s, cone %d: %s", perp_contact_method_text(methods[k]), (int)cone,
                         perp_context_message(context));
            assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
            assert_true(isfinite(r[0]) && isfinite(r[1]) && isfinite(u[0]) && isfinite(u[1]));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edge_of_sticking),
        cmocka_unit_test(test_two_blocks),
        cmocka_unit_test(test_inner_problems_that_overflow),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

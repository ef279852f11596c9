/* The numbers of perp_contact_result against others' words for the law, exact zeros, and all
 * methods against each other. */
#include <float.h>
#include <math.h>

#include "suite.h"

#include "hand_over.h"

#include "context.h"

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON};

static void require_zeros(const hand_over *p)
{
    int32_t k, i;

    for (k = 0; k < p->contacts; k++)
        for (i = p->starts[k]; i < p->starts[k + 1]; i++) {
            if (p->modes[k] == PERP_CONTACT_SEPARATE)
                assert_true(p->r[i] == 0.0);
            else if (p->modes[k] == PERP_CONTACT_STICK || i == p->starts[k])
                assert_true(p->u[i] == 0.0);
        }
    for (i = p->rows; i < p->size; i++)
        assert_true(p->u[i] == 0.0);
}

static double energy(const hand_over *p, const double *v)
{
    double sum = 0.0;
    int32_t i, j;

    for (i = 0; i < p->n; i++)
        for (j = 0; j < p->n; j++)
            sum += 0.5 * v[i] * p->M[i + j * p->n] * v[j];
    return sum;
}

/* f = M v_before: what inelastic contacts without gaps leave is never more. */
static double energy_before(const hand_over *p)
{
    hand_over free = *p;

    free.contacts = free.rows = 0;
    hand_views(&free);
    free.H_view.leading_dimension = 1;
    assert_int_equal(hand_solve(&free, context, NULL), PERP_OK);
    return energy(p, free.v);
}

/* Contacts in general position: as many coordinates as rows, so r is unique. */
static void test_methods_agree(void **state)
{
    uint64_t seed;
    size_t m;
    int32_t i;

    (void)state;
    for (seed = 0; seed < 60; seed++) {
        const int32_t dim = (int32_t)(seed % 4), joints = (int32_t)(seed % 3);
        hand_over first, p;

        for (m = 0; m < sizeof methods / sizeof *methods; m++) {
            hand_make(&p, seed, 24, 6, dim, joints, 1.0);
            p.settings.method = methods[m];
            p.settings.tol = 1e-12;
            assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
            if (p.result.outcome > PERP_OUTCOME_ROUNDING_LIMIT)
                fail_msg("seed %d, %s: %s, residual %g", (int)seed,
                         perp_contact_method_text(methods[m]), perp_outcome_text(p.result.outcome),
                         p.result.residual);
            /* numbers of order 1 to 10; products of them at the tolerance */
            if (hand_violation(&p) > 1e-10)
                fail_msg("seed %d, %s: violation %g", (int)seed,
                         perp_contact_method_text(methods[m]), hand_violation(&p));
            require_zeros(&p);
            assert_true(p.result.signorini_velocity <= 1e-10 && p.result.cone <= 1e-15);
            assert_true(p.result.dissipation_velocity <= 1e-10 && p.result.bilateral <= 1e-10);
            if (m == 0)
                first = p;
            for (i = 0; i < p.n; i++)
                assert_true(fabs(p.v[i] - first.v[i]) <= 1e-9);
        }
    }
}

static void test_no_energy_is_made(void **state)
{
    uint64_t seed;

    (void)state;
    for (seed = 100; seed < 140; seed++) {
        hand_over p;
        int32_t k;

        hand_make(&p, seed, 10, 5, 3, 0, 2.0);
        for (k = 0; k < p.rows; k++)
            p.w[k] = 0.0;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        /* at the default tolerance, 1e-8, of energies of order 10 */
        assert_true(energy(&p, p.v) <= energy_before(&p) + 1e-7);
    }
}

/* W = 1 and r as it is handed over: each number by hand. */
static void judge(perp_contact_result *result, int32_t dim, double mu, const double *q,
                  const double *r0, double *r, double *u)
{
    const double W[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, W2[4] = {1, 0, 0, 1}, W1[1] = {1};
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix view = fresh_matrix();

    assert_int_equal(perp_struct_init(result, sizeof *result), PERP_OK);
    assert_int_equal(perp_matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, dim, dim,
                                       dim == 3   ? W
                                       : dim == 2 ? W2
                                                  : W1,
                                       dim),
                     PERP_OK);
    settings.tol = 1e6; /* anything will do: the start is what comes back */
    laws.contacts = 1;
    laws.dim = dim;
    laws.mu = &mu;
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u), result, &settings,
                                        DELASSUS(&laws, &view, q), r0),
                     PERP_OK);
    assert_int_equal(result->method, PERP_CONTACT_METHOD_POLISH);
    assert_int_equal(result->outcome, PERP_OUTCOME_SOLVED);
}

static void require_near(double x, double expected)
{
    if (!(fabs(x - expected) <= 4 * DBL_EPSILON * fmax(1.0, fabs(expected))))
        fail_msg("%.17g, expected %.17g", x, expected);
}

static void test_numbers(void **state)
{
    perp_contact_result result;
    double r[3], u[3];

    (void)state;
    { /* presses with 2 where 1 is right: u_n = 1, t = 1; omega = |q| = 1 */
        const double q[1] = {-1}, r0[1] = {2};

        judge(&result, 1, 0.0, q, r0, r, u);
        require_near(result.signorini_velocity, 1.0);
        require_near(result.signorini_impulse, 1.0);
        require_near(result.residual, 1.0);
        require_near(result.natural_residual, 1.0);
        require_near(result.backward_error, 1.0 / 3.0); /* of |W| |r| + |q| */
    }
    { /* t = 2; sticks with the wrong r_t: u = (0, 0.25), well inside the cone */
        const double q[2] = {-1, 0}, r0[2] = {1, 0.25};

        judge(&result, 2, 1.0, q, r0, r, u);
        require_near(result.signorini_velocity, 0.0);
        require_near(result.dissipation_velocity, 0.25);
        require_near(result.dissipation_impulse, 0.125);
        require_near(result.cone, 0.0);
        /* x = r - (0.25, 0.25) / 2 = (0.875, 0.125) is in the cone */
        require_near(result.natural_residual, 0.125 * sqrt(2.0));
        require_near(result.residual, sqrt(2.0) * 0.125 * sqrt(2.0) / (1.0 / sqrt(2.0)));
    }
    { /* slides along x with friction along -x, but at an angle */
        const double q[3] = {-1, 3, 0}, r0[3] = {1, 0, -0.5};

        judge(&result, 3, 0.5, q, r0, r, u); /* u = (0, 3, -0.5), t = 3 */
        require_near(result.signorini_impulse, 0.0);
        /* x = (-1, -1/3): to radius 1/2 */
        require_near(result.dissipation_impulse,
                     hypot(0.5 / sqrt(1 + 1.0 / 9), -0.5 + 0.5 / 3 / sqrt(1 + 1.0 / 9)));
        require_near(result.dissipation_velocity, 3 * result.dissipation_impulse);
    }
}

/* A start outside of the cones is projected, and a good answer warm-starts to itself. */
static void test_projection(void **state)
{
    const double q[3] = {-1, 3, 0}, outside[3] = {1, -4, 0}, below[3] = {-1, -4, 0};
    perp_contact_result result;
    double r[3], u[3];

    (void)state;
    judge(&result, 3, 0.5, q, outside, r, u);
    assert_true(r[0] == 1.0 && r[1] == -0.5 && r[2] == 0.0);
    require_near(result.residual, 0.0);
    assert_true(u[0] == 0.0 && u[1] == 2.5 && u[2] == 0.0);
    judge(&result, 3, 0.5, q, below, r, u);
    assert_true(r[0] == 0.0 && r[1] == 0.0 && r[2] == 0.0);
}

/* Scaling W by powers of 4 and q by powers of 2 changes no bit of the residuals. */
static void test_units(void **state)
{
    hand_over p, scaled;
    int32_t i;

    (void)state;
    hand_make(&p, 5, 15, 5, 3, 0, 1.0);
    scaled = p;
    hand_views(&scaled);
    for (i = 0; i < p.n * p.n; i++)
        scaled.M[i] *= 4.0;
    for (i = 0; i < p.n; i++)
        scaled.f[i] *= 8.0;
    for (i = 0; i < p.rows; i++)
        scaled.w[i] *= 2.0;
    assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
    assert_int_equal(hand_solve(&scaled, context, NULL), PERP_OK);
    assert_true(p.result.residual == scaled.result.residual);
    assert_true(p.result.backward_error == scaled.result.backward_error);
    for (i = 0; i < p.rows; i++)
        assert_true(8.0 * p.r[i] == scaled.r[i] && 2.0 * p.u[i] == scaled.u[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_methods_agree), cmocka_unit_test(test_no_energy_is_made),
        cmocka_unit_test(test_numbers),       cmocka_unit_test(test_projection),
        cmocka_unit_test(test_units),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* Exact zeros through the public entrance, perp_contact_solve, which has to find the bodies itself:
 * piles at rest, small bodies beside a large one, a row that yields and so pins nothing,
 * and slips of rounding. */
#include <math.h>
#include <stdlib.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"
#include "piles.h"

static void test_public(void **state)
{
    static const int32_t classes[] = {PILES_COLUMN, PILES_TOWER, PILES_WALL};
    perp_context *context = NULL;
    perp_contact_settings settings = fresh_contact_settings();
    int c, i, others = 0;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (c = 0; c < 3; c++) {
        piles_options o = piles_defaults();
        perp_contact_result result;
        double *v, *r, *u;
        piles p;

        o.class = classes[c];
        o.contacts = 120;
        o.mu = 0.8;
        piles_make(&p, &o);
        v = gen_allocate((size_t)p.n, sizeof *v);
        r = gen_allocate((size_t)p.rows, sizeof *r);
        u = gen_allocate((size_t)p.rows, sizeof *u);
        assert_int_equal(piles_solve(context, &p, NULL, &result, v, r, u, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        for (i = 0; i < p.n; i++)
            assert_true(v[i] == 0.0);
        for (i = 0; i < p.rows; i++)
            assert_true(u[i] == 0.0);
        /* as the impulses make them: 0 to the tested residual, which levers may enlarge */
        settings.raw_velocity = 1;
        assert_int_equal(piles_solve(context, &p, &settings, &result, v, r, u, NULL), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        for (i = 0; i < p.n; i++) {
            assert_true(fabs(v[i]) <= 100.0 * settings.tol);
            others += v[i] != 0.0;
        }
        free(v);
        free(r);
        free(u);
        piles_destroy(&p);
    }
    assert_true(others > 0);
    perp_context_destroy(context);
}

/* A tower of ten planar boxes beside an arm of twelve velocities: blocks of 3 and of 12. The boxes
 * rest; the arm, with M = E + 0.1 and a push of 1 on each of its velocities, moves. */
static void test_small_beside_large(void **state)
{
    enum { ARM = 12, BOXES = 10, SIZE = ARM + 3 * BOXES, CONTACTS = 2 * BOXES };
    enum { ROWS = 2 * CONTACTS + ARM };
    static double M[SIZE * SIZE], H[ROWS * SIZE], f[SIZE], w[ROWS], mu[CONTACTS];
    double v[SIZE], r[ROWS], u[ROWS], lower[ARM], upper[ARM];
    perp_matrix views[2];
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_context *context = NULL;

    (void)state;
    for (int i = 0; i < SIZE; i++) {
        const int place = (i - ARM) % 3; /* x, z, angle */

        for (int j = 0; j < ARM && i < ARM; j++)
            M[i * SIZE + j] = 0.1 + (i == j);
        if (i >= ARM)
            M[i * SIZE + i] = place < 2 ? 1.0 : 1.0 / 6.0;
        f[i] = i < ARM ? 1.0 : place == 1 ? -0.1 : 0.0;
    }
    for (int k = 0; k < CONTACTS; k++) {
        const double x = k % 2 ? 0.5 : -0.5;

        for (int side = 0; side < 2; side++) { /* the box above, half a side away; and below */
            const double sign = side ? -1.0 : 1.0, z = side ? 0.5 : -0.5;
            const int column = ARM + 3 * (k / 2 - side);

            if (k / 2 - side < 0)
                continue;
            H[2 * k * SIZE + column + 1] = sign;
            H[2 * k * SIZE + column + 2] = sign * x;
            H[(2 * k + 1) * SIZE + column] = sign;
            H[(2 * k + 1) * SIZE + column + 2] = -sign * z;
        }
        mu[k] = 0.5;
    }
    for (int k = 0; k < 2; k++) {
        perp_struct_init(&views[k], sizeof views[k]);
        views[k].rows = k ? 2 * CONTACTS : SIZE;
        views[k].columns = SIZE;
        views[k].leading_dimension = SIZE;
        views[k].storage = (int32_t)PERP_STORAGE_ROW_MAJOR;
        views[k].values = k ? H : M;
    }
    dynamics.n = SIZE, dynamics.M = &views[0], dynamics.H = &views[1];
    laws.contacts = CONTACTS, laws.dim = 2, laws.mu = mu;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_contact_solve(context, ANSWER(v, r), &result, NULL,
                                        DYNAMICS(&laws, &dynamics, f, w), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    for (int i = 0; i < SIZE; i++) {
        if (i < ARM)
            assert_true(fabs(v[i] - 1.0 / 2.2) <= 1e-14);
        else
            assert_true(v[i] == 0.0);
    }
    /* without blocks while something moves: forty rows are few, and u of what holds is 0; the
     * boxes' v is that of rounding, with M of the order of 1 and impulses of at most 1 */
    settings.raw_velocity = 2;
    assert_int_equal(perp_contact_solve(context, ANSWER(v, r, u), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, f, w), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    for (int i = 0; i < SIZE; i++)
        assert_true(fabs(v[i] - (i < ARM ? 1.0 / 2.2 : 0.0)) <= (i < ARM ? 1e-14 : settings.tol));
    for (int i = 0; i < 2 * CONTACTS; i++)
        assert_true(u[i] == 0.0);
    /* where all rests, the arm by dry friction of at most 1.1 in each joint, v is 0 here, too */
    for (int i = 0; i < ARM; i++) {
        H[(2 * CONTACTS + i) * SIZE + i] = 1.0;
        lower[i] = -1.1, upper[i] = 1.1;
    }
    views[1].rows = ROWS;
    laws.bounded = ARM, laws.lower = lower, laws.upper = upper;
    assert_int_equal(perp_contact_solve(context, ANSWER(v, r, u), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, f, w), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    for (int i = 0; i < SIZE; i++)
        assert_true(v[i] == 0.0);
    perp_context_destroy(context);
}

/* One rod of compliance c, b = -1: G v + c s = 1, M v = G s. With a G of 1e-9 rounding leaves
 * nothing of G v beside c s = 1, but v = 1e-9 / (M c) all the same: a row that yields pins nothing.
 */
static void test_yielding_row(void **state)
{
    static const double G = 1e-9, f = 0.0, b = -1.0, c = 0.02;
    perp_context *context = NULL;
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H, row;
    const double mass = 1.0;
    double v, r, u;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    M = matrix_rows(&mass, 1, 1);
    H = matrix_rows(&mass, 0, 1);
    row = matrix_rows(&G, 1, 1);
    laws.bilateral = 1;
    laws.compliance = &c;
    dynamics.n = 1;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = &row;
    assert_int_equal(perp_contact_solve(context, ANSWER(&v, &r, &u), &result, NULL,
                                        DYNAMICS(&laws, &dynamics, &f, NULL, &b), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(fabs(v - 5e-8) <= 1e-14 && u == 0.0);
    perp_context_destroy(context);
}

/* Blocks that are pushed by mu times their weight, beside a joint that turns against its dry
 * friction: a slip of rounding is none, even where v stays as the impulses make it. */
static void test_slips_of_rounding(void **state)
{
    enum { N = 3, DRAWS = 200 };
    static const double H[N * N] = {0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    static const double w[N] = {0.0}, lower = -1.0, upper = 1.0;
    double M[N * N] = {0.0}, f[N] = {0.0, 0.0, 2.0}, mu, v[N], r[N], u[N];
    perp_matrix views[2];
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_context *context = NULL;
    gen_random random;
    int rounded = 0;

    (void)state;
    gen_seed(&random, 7);
    for (int k = 0; k < 2; k++) {
        perp_struct_init(&views[k], sizeof views[k]);
        views[k].rows = views[k].columns = N;
        views[k].leading_dimension = N;
        views[k].storage = (int32_t)PERP_STORAGE_ROW_MAJOR;
        views[k].values = k ? H : M;
    }
    dynamics.n = N, dynamics.M = &views[0], dynamics.H = &views[1];
    laws.contacts = laws.bounded = 1, laws.dim = 2, laws.mu = &mu;
    laws.lower = &lower, laws.upper = &upper;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    for (int draw = 0; draw < DRAWS; draw++) {
        mu = gen_uniform(&random, 0.1, 1.0);
        M[0] = M[4] = gen_uniform(&random, 0.5, 2.0);
        M[8] = 1.0;
        f[1] = -gen_uniform(&random, 0.5, 2.0);
        f[0] = -mu * f[1];
        for (int raw = 1; raw <= 2; raw++) {
            settings.raw_velocity = raw;
            assert_int_equal(perp_contact_solve(context, ANSWER(v, r, u), &result, &settings,
                                                DYNAMICS(&laws, &dynamics, f, w), NULL),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(fabs(v[2] - 1.0) <= settings.tol);
            assert_true(raw == 1 || u[1] == 0.0);
            rounded += raw == 1 && u[1] != 0.0;
        }
    }
    assert_true(rounded > 0);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_public),
        cmocka_unit_test(test_yielding_row),
        cmocka_unit_test(test_small_beside_large),
        cmocka_unit_test(test_slips_of_rounding),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

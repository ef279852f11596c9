/* Method `proximal` in the space of the bodies' velocities against itself with the Delassus matrix:
 * piles with many more contacts than velocities, and joints. The residuals are the front door's. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "bodies_load.h"
#include "piles.h"

#include "context.h"

static perp_contact_settings proximal(void)
{
    perp_contact_settings settings = fresh_contact_settings();

    settings.method = PERP_CONTACT_METHOD_PROXIMAL;
    return settings;
}

static perp_contact_result by_bodies(const piles *p, double *v, double *u, double *r)
{
    const perp_contact_settings settings = proximal();
    perp_contact_result result;

    assert_int_equal(piles_solve(context, p, &settings, &result, v, r, u, NULL), PERP_OK);
    return result;
}

/* The same as compressed columns of W, made of the bodies. */
static perp_contact_result by_matrix(const piles *p, double *u, double *r)
{
    perp_contact_settings settings = proximal();
    perp_contact_laws laws = piles_laws(p);
    int32_t *starts = gen_allocate((size_t)p->contacts + 1, sizeof *starts), suits = 0;
    double *q = gen_allocate((size_t)p->rows, sizeof *q);
    perp__matrix M, H;
    perp__bodies bodies;
    perp__bodies_input input;
    perp_contact_result result = fresh_contact_result();
    perp_matrix W;
    int32_t *columns, *rows;
    double *values;

    for (int32_t k = 0; k < p->contacts; k++)
        starts[k + 1] = starts[k] + p->dims[k];
    memset(&bodies, 0, sizeof bodies);
    memset(&input, 0, sizeof input);
    assert_int_equal(perp__matrix_read(context, "M", &M, &p->M), PERP_OK);
    assert_int_equal(perp__matrix_read(context, "H", &H, &p->H), PERP_OK);
    input.n = p->n;
    input.contacts = p->contacts;
    input.size = p->rows;
    input.starts = starts;
    input.M = &M;
    input.H = &H;
    memset(&bodies, 0, sizeof bodies);
    bodies.context = context;
    assert_int_equal(perp__bodies_setup(&bodies, &input, &suits), PERP_OK);
    assert_int_equal(suits, 1);
    columns = gen_allocate((size_t)p->rows + 1, sizeof *columns);
    rows = gen_allocate((size_t)perp__bodies_delassus_entries(&bodies), sizeof *rows);
    values = gen_allocate((size_t)perp__bodies_delassus_entries(&bodies), sizeof *values);
    perp__bodies_delassus(&bodies, columns, rows, values);
    bodies_load(&bodies, p->f, p->w, NULL, q);
    W = matrix_csc(p->rows, p->rows, columns, rows, values);
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL, r, u), &result, &settings,
                                        DELASSUS(&laws, &W, q), NULL),
                     PERP_OK);
    perp__bodies_release(&bodies);
    free(starts);
    free(q);
    free(columns);
    free(rows);
    free(values);
    return result;
}

/* Impulses of redundant contacts are not unique. Without friction the velocities are (those of
 * the contacts are compared); with a little friction and bodies at rest they are 0. */
static void test_piles_move_alike(void **state)
{
    (void)state;
    for (int class = 0; class < PILES_CLASSES; class ++)
        for (int motion = PILES_REST; motion <= PILES_PUSH; motion++) {
            piles_options options = piles_defaults();
            double *u[2], *r, scale = 0.0;
            perp_contact_result result;
            piles p;

            options.class = class;
            options.contacts = 60;
            options.mu = motion == PILES_REST ? 0.5 : 0.0;
            options.motion = motion;
            piles_make(&p, &options);
            u[0] = gen_allocate((size_t)p.rows, sizeof **u);
            u[1] = gen_allocate((size_t)p.rows, sizeof **u);
            r = gen_allocate((size_t)p.rows, sizeof *r);
            result = by_bodies(&p, NULL, u[0], r);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(result.residual <= 1e-11);
            result = by_matrix(&p, u[1], r);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            assert_true(result.residual <= 1e-11);
            for (int32_t i = 0; i < p.rows; i++)
                scale = fmax(scale, fabs(u[0][i]));
            for (int32_t i = 0; i < p.rows; i++)
                assert_true(fabs(u[0][i] - u[1][i]) <= 1e-9 * fmax(scale, 0.1));
            free(u[0]);
            free(u[1]);
            free(r);
            piles_destroy(&p);
        }
}

/* Pushed piles with friction: solved, by the front door's own residual. */
static void test_pushed_piles_are_solved(void **state)
{
    (void)state;
    for (int class = 0; class < PILES_CLASSES; class ++) {
        piles_options options = piles_defaults();
        perp_contact_result result;
        double *r;
        piles p;

        options.class = class;
        options.contacts = 60;
        options.motion = PILES_PUSH;
        options.seed = 3;
        piles_make(&p, &options);
        r = gen_allocate((size_t)p.rows, sizeof *r);
        result = by_bodies(&p, NULL, NULL, r);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(result.residual <= 1e-11);
        free(r);
        piles_destroy(&p);
    }
}

/* Balls touch in one point each, so that with little friction the velocities are unique (boxes may
 * turn differently on faces that slide): block Gauss-Seidel to 1e-11, which shares nothing with
 * this method, ends in the same ones. */
static void test_sweeps_agree(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 5; seed++) {
        piles_options options = piles_defaults();
        const perp_contact_settings settings = piles_settings(PERP_CONTACT_METHOD_SWEEP, 1e-11);
        perp_contact_result result;
        double *v[2], *r;
        piles p;

        options.class = PILES_HEAP;
        options.contacts = 16;
        options.motion = PILES_PUSH;
        options.mu = 0.1;
        options.seed = seed;
        piles_make(&p, &options);
        v[0] = gen_allocate((size_t)p.n, sizeof **v);
        v[1] = gen_allocate((size_t)p.n, sizeof **v);
        r = gen_allocate((size_t)p.rows, sizeof *r);
        assert_int_equal(by_bodies(&p, v[0], NULL, r).outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(piles_solve(context, &p, &settings, &result, v[1], r, NULL, NULL),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        for (int32_t i = 0; i < p.n; i++)
            assert_true(fabs(v[0][i] - v[1][i]) <= 1e-7);
        free(v[0]);
        free(v[1]);
        free(r);
        piles_destroy(&p);
    }
}

/* Two particles on a rod along the first axis, the first on the ground (normal: second axis), mu =
 * 1/2, both pushed along the rod, in whole numbers: r_n = 4, r_t = -2, 2 v_1 = 3 + 3 - 2, and the
 * rod's 1 shares the friction. */
static void test_joints_are_equations(void **state)
{
    const double M_dense[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const double H_dense[8] = {0, 1, 0, 0, 1, 0, 0, 0}; /* rows: normal, tangent */
    const double G_dense[4] = {1, 0, -1, 0};
    const double f[4] = {3, -4, 3, 0}, w[2] = {0, 0}, b[1] = {0}, mu[1] = {0.5};
    perp_matrix M, H, G;
    perp_contact_settings settings = proximal();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_result result = fresh_contact_result();
    double v[4], r[3];
    int32_t modes[1];

    (void)state;
    M = matrix_rows(M_dense, 4, 4);
    H = matrix_rows(H_dense, 2, 4);
    G = matrix_rows(G_dense, 1, 4);
    laws.contacts = 1;
    laws.dim = 2;
    laws.mu = mu;
    dynamics.n = 4;
    dynamics.M = &M;
    dynamics.H = &H;
    dynamics.G = &G;
    assert_int_equal(perp_contact_solve(context, ANSWER(v, r, NULL, modes), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, f, w, b), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(modes[0], PERP_CONTACT_SLIP);
    assert_true(fabs(r[0] - 4.0) <= 1e-13 && fabs(r[1] + 2.0) <= 1e-13);
    assert_true(fabs(v[0] - 2.0) <= 1e-13 && fabs(v[2] - 2.0) <= 1e-13 && fabs(v[1]) <= 1e-13);
    assert_true(fabs(r[2] - 1.0) <= 1e-13);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_piles_move_alike, make, destroy),
        cmocka_unit_test_setup_teardown(test_pushed_piles_are_solved, make, destroy),
        cmocka_unit_test_setup_teardown(test_sweeps_agree, make, destroy),
        cmocka_unit_test_setup_teardown(test_joints_are_equations, make, destroy),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

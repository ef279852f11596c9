/* The inner entrance: what it answers obeys the laws in the caller's own rows and masses. */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include <perp/perp.h>

#include "base/context.h"
#include "gen.h"
#include "memory.h"
#include "rigid_fixture.h"

/* Boxes in a pyramid; from above some are hit. */
static void hit(rigid_scene *s, double speed)
{
    const int32_t w = s->width;

    for (int32_t b = 0; b < s->bodies; b += 3) {
        s->free[b * w] += speed * (b % 2 ? 1.0 : -0.5);
        s->free[b * w + 1] += 0.3 * speed;
        s->free[b * w + w - 1] += speed;
    }
}

static void test_laws(void **state)
{
    static const double tols[] = {1e-4, 1e-6, 1e-10};
    int planar, moves, t;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (moves = 0; moves < 2; moves++)
            for (t = 0; t < 3; t++) {
                fixture f;
                perp__rigid_problem p;
                perp__rigid_answer a;

                open_fixture(&f, planar, NULL);
                rigid_pyramid(&f.s, 6, 0.5);
                if (moves)
                    hit(&f.s, 1.0);
                p = rigid_problem(&f.s);
                p.tol = tols[t];
                a = solve(&f, &p);
                assert_true(a.outcome == PERP_OUTCOME_SOLVED);
                assert_true(a.tested <= p.tol && a.own_residual <= p.tol);
                check_momentum(&f.s);
                /* tested is beside the largest free velocity (0.1 m/s, or 3), times
                 * sqrt(t_k / t_j), here below 10; the maps of cone and disc differ by less than
                 * 1 + mu */
                assert_true(worst_violation(&f.s, &a) <= 15.0 * p.tol * (moves ? 3.0 : 0.1));
                close_fixture(&f);
            }
}

/* The scene as the public entrance takes it: dense matrices, row by row. */
typedef struct public_problem {
    int32_t n, rows, *dims;
    double *M, *H, *v, *r, *load, *bias, *mu;
} public_problem;

static void fill_public(public_problem *q, const rigid_scene *s)
{
    int32_t row = 0, k, i, j, side;

    for (i = 0; i < q->n; i++) {
        q->M[i * q->n + i] = s->mass[(i / 6) * 36 + (i % 6) * 7];
        q->load[i] = q->M[i * q->n + i] * s->free[i];
    }
    for (k = 0; k < s->contacts; k++) {
        q->dims[k] = s->rows[k].dim;
        q->mu[k] = s->rows[k].mu;
        for (i = 0; i < q->dims[k]; i++, row++) {
            q->bias[row] = s->rows[k].bias[i];
            for (side = 0; side < 2; side++)
                for (j = 0; s->rows[k].body[side] >= 0 && j < 6; j++)
                    q->H[row * q->n + 6 * s->rows[k].body[side] + j] = s->rows[k].rows[side][i][j];
        }
    }
}

static void make_public(public_problem *q, const rigid_scene *s)
{
    double **const all[] = {&q->M, &q->H, &q->v, &q->r, &q->load, &q->bias, &q->mu};
    size_t sizes[7], i;
    int32_t k;

    q->n = 6 * s->bodies;
    for (q->rows = 0, k = 0; k < s->contacts; k++)
        q->rows += s->rows[k].dim;
    sizes[0] = (size_t)(q->n * q->n);
    sizes[1] = (size_t)(q->rows * q->n);
    sizes[2] = sizes[4] = (size_t)q->n;
    sizes[3] = sizes[5] = (size_t)q->rows;
    sizes[6] = (size_t)s->contacts;
    for (i = 0; i < 7; i++) {
        *all[i] = gen_allocate(sizes[i], sizeof(double));
        memset(*all[i], 0, sizes[i] * sizeof(double));
    }
    q->dims = gen_allocate((size_t)s->contacts, sizeof *q->dims);
    fill_public(q, s);
}

static void free_public(public_problem *q)
{
    void *all[] = {q->M, q->H, q->v, q->r, q->load, q->bias, q->mu, q->dims};

    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

static void solve_public(perp_context *context, public_problem *q, int32_t contacts)
{
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_result result = fresh_contact_result();
    perp_contact_laws laws = fresh_contact_laws();
    perp_matrix M, H;

    M = matrix_rows(q->M, q->n, q->n);
    H = matrix_rows(q->H, q->rows, q->n);
    settings.tol = 1e-12;
    laws.contacts = contacts;
    laws.dims = q->dims;
    laws.mu = q->mu;
    dynamics.n = q->n;
    dynamics.M = &M;
    dynamics.H = &H;
    assert_int_equal(perp_contact_solve(context, ANSWER(q->v, q->r), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, q->load, q->bias), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
}

/* Dimensions mixed, contacts without friction among them: the answer is the public entrance's,
 * which gets the same as matrices. */
static void test_public_entrance(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;
    public_problem q;
    int32_t k, i;

    (void)state;
    open_fixture(&f, 0, NULL);
    for (k = 0; k < 5; k++) {
        rigid_box(&f.s, 0.1 * k, 0.0, k + 0.5, half, 1.0 + k, NULL);
        rigid_face(&f.s, k - 1, k, 0.1 * k - 0.4, 0.1 * k + 0.5, -0.5, 0.5, k, 0.3);
        f.s.contacts--; /* three points a face: what they carry is known */
    }
    hit(&f.s, 0.7);
    for (k = 0; k < f.s.contacts; k++) {
        f.s.rows[k].dim = k % 5 == 1 ? 1 : k % 7 == 3 ? 2 : 3;
        f.s.rows[k].bias[0] = k % 4 ? 0.0 : 0.125;
    }
    make_public(&q, &f.s);
    solve_public(f.context, &q, f.s.contacts);
    p = rigid_problem(&f.s);
    p.tol = 1e-12;
    a = solve(&f, &p);
    assert_int_equal(a.outcome, PERP_OUTCOME_SOLVED);
    /* friction is small: v is unique. Both are within 1e-12 of it, times its condition */
    for (i = 0; i < q.n; i++)
        assert_true(fabs(f.s.v[i] - q.v[i]) <= 1e-9);
    free_public(&q);
    close_fixture(&f);
}

/* A rod hangs by one end from a pin, in the plane: the pin's two rows leave the turn. With inertia
 * m l^2 / 3 about the centre, half-length l, gravity alone gives alpha = (3 g) / (4 l). */
static void test_joint(void **state)
{
    static const double half[3] = {0.5, 0.0, 0.0}, place[3] = {0.5, 0.0, 0.0};
    static const double pin[2] = {0.0, 0.0}, right[2] = {1.0, 0.0};
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;

    (void)state;
    open_fixture(&f, 1, NULL);
    rigid_add(&f.s, place, half, 2.0, NULL);
    rigid_touch(&f.s, RIGID_GROUND, 0, pin, right, 2, 0.0);
    p = rigid_problem(&f.s);
    p.contacts = 0;
    p.joints = 1;
    p.tol = 1e-10;
    a = solve(&f, &p);
    assert_int_equal(a.outcome, PERP_OUTCOME_SOLVED);
    assert_true(fabs(f.s.v[0]) <= 1e-15); /* rounding of g h = 0.1 */
    assert_true(fabs(f.s.v[2] + 0.75 * RIGID_G * RIGID_H / 0.5) <= 1e-14);
    assert_true(fabs(f.s.v[1] + 0.5 * 0.75 * RIGID_G * RIGID_H / 0.5) <= 1e-14);
    assert_true(f.s.velocity[0] == 0.0 && f.s.velocity[1] == 0.0);
    close_fixture(&f);
}

/* A brick on a belt that pulls it: mu g h in one step, from rest. */
static void test_carrier(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.25}, belt[6] = {2.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    static const double under[3] = {0.0, 0.0, -1.0};
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;
    int32_t brick, i;

    (void)state;
    open_fixture(&f, 0, NULL);
    brick = rigid_box(&f.s, 0.0, 0.0, 0.25, half, 3.0, NULL);
    rigid_add(&f.s, under, half, 0.0, belt);
    rigid_face(&f.s, 1, brick, -0.5, 0.5, -0.5, 0.5, 0.0, 0.4);
    p = rigid_problem(&f.s);
    p.tol = 1e-10;
    a = solve(&f, &p);
    assert_int_equal(a.outcome, PERP_OUTCOME_SOLVED);
    assert_true(fabs(f.s.v[0] - 0.4 * RIGID_G * RIGID_H) <= 1e-12);
    for (i = 0; i < 4; i++) {
        assert_int_equal(a.modes[i], PERP_CONTACT_SLIP);
        assert_true(fabs(f.s.velocity[3 * i + 1] - (f.s.v[0] - 2.0)) <= 1e-12);
    }
    close_fixture(&f);
}

static double *copied(const double *x, size_t count)
{
    return memcpy(gen_allocate(count, sizeof *x), x, count * sizeof *x);
}

/* `again`, and a start that is the answer: the same bits, whatever was solved before. */
static void test_again(void **state)
{
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;
    double *first, *v;
    int32_t i;

    (void)state;
    open_fixture(&f, 0, NULL);
    rigid_pyramid(&f.s, 5, 0.5);
    p = rigid_problem(&f.s);
    solve(&f, &p);
    hit(&f.s, 0.4);
    solve(&f, &p);
    first = copied(f.s.impulse, (size_t)f.s.contacts * 3);
    v = copied(f.s.v, (size_t)f.s.bodies * 6);
    p.again = 1;
    solve(&f, &p);
    assert_memory_equal(first, f.s.impulse, (size_t)f.s.contacts * 3 * sizeof *first);
    assert_memory_equal(v, f.s.v, (size_t)f.s.bodies * 6 * sizeof *v);
    memcpy(f.s.warm, first, (size_t)f.s.contacts * 3 * sizeof *first);
    p.warm = f.s.warm;
    a = solve(&f, &p);
    assert_int_equal(a.iterations, 0);
    for (i = 0; i < 6 * f.s.bodies; i++) /* as near as both are to the truth */
        assert_true(fabs(v[i] - f.s.v[i]) <= 1e-7);
    free(first);
    free(v);
    close_fixture(&f);
}

static void test_memory(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    fixture f;
    perp__rigid_problem p;
    int i, calls;

    (void)state;
    open_fixture(&f, 0, &settings);
    rigid_pyramid(&f.s, 5, 0.5);
    p = rigid_problem(&f.s);
    solve(&f, &p);
    p.warm = memcpy(f.s.warm, f.s.impulse, (size_t)f.s.contacts * 3 * sizeof(double));
    solve(&f, &p);
    calls = m.calls;
    for (i = 0; i < 4; i++) {
        p.tol = i % 2 ? 1e-4 : 1e-9;
        p.contacts = f.s.contacts - 4 * i;
        solve(&f, &p);
    }
    assert_int_equal(m.calls, calls);
    close_fixture(&f);
    assert_int_equal(m.live, 0);
    for (i = 1; i <= calls; i++) { /* every allocation fails once */
        perp__rigid_answer a;
        perp_status status;

        m.calls = 0;
        m.fails_at = i;
        rigid_open(&f.s, 0);
        f.solver = NULL;
        f.context = NULL;
        rigid_pyramid(&f.s, 5, 0.5);
        p = rigid_problem(&f.s);
        a = rigid_answer(&f.s);
        status = perp_context_create(&f.context, &settings);
        if (status == PERP_OK)
            status = perp__contact_create(f.context, &f.solver, NULL);
        if (status == PERP_OK)
            status = perp__rigid_solve(f.solver, &a, &p);
        assert_int_equal(status, m.calls >= i ? PERP_ERROR_MEMORY : PERP_OK);
        close_fixture(&f);
        assert_int_equal(m.live, 0);
    }
}

static void test_nothing(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;

    (void)state;
    open_fixture(&f, 0, NULL);
    p = rigid_problem(&f.s);
    a = solve(&f, &p);
    assert_int_equal(a.outcome, PERP_OUTCOME_SOLVED);
    rigid_box(&f.s, 0.0, 0.0, 0.0, half, 1.0, NULL);
    p = rigid_problem(&f.s);
    a = solve(&f, &p);
    assert_int_equal(a.outcome, PERP_OUTCOME_SOLVED);
    assert_memory_equal(f.s.v, f.s.free, 6 * sizeof(double));
    rigid_face(&f.s, RIGID_GROUND, RIGID_GROUND, 0.0, 1.0, 0.0, 1.0, 0.0, 0.3);
    p = rigid_problem(&f.s);
    assert_int_equal(perp__rigid_solve(f.solver, &a, &p), PERP_ERROR_ARGUMENT);
    assert_string_equal(perp_context_message(f.context),
                        "contact 0: its normal impulse moves nothing, W(0,0) is 0");
    close_fixture(&f);
}

/* Between two plates that approach: no velocities keep off both. */
static void test_no_answer(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5}, up[3] = {0.0, 0.0, 1.0};
    static const double below[3] = {0.0, 0.0, -0.5}, above[3] = {0.0, 0.0, 0.5};
    fixture f;
    perp__rigid_problem p;
    perp__rigid_answer a;
    int32_t box;

    (void)state;
    open_fixture(&f, 0, NULL);
    box = rigid_box(&f.s, 0.0, 0.0, 0.0, half, 1.0, NULL);
    rigid_touch(&f.s, RIGID_GROUND, box, below, up, 3, 0.3)->bias[0] = -1.0;
    rigid_touch(&f.s, box, RIGID_GROUND, above, up, 3, 0.3)->bias[0] = -1.0;
    p = rigid_problem(&f.s);
    a = solve(&f, &p);
    assert_false(a.outcome == PERP_OUTCOME_SOLVED || a.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
    close_fixture(&f);
}

/* A tol below rounding, where 1e-8 is enough: as many steps as without last resorts, which go on.
 */
static void test_enough(void **state)
{
    (void)state;
    for (int planar = 0; planar < 2; planar++) {
        fixture f;
        perp__rigid_problem p;
        int64_t without, all;

        open_fixture(&f, planar, NULL);
        rigid_pyramid(&f.s, 4, 0.5);
        hit(&f.s, 1.0);
        p = rigid_problem(&f.s);
        p.tol = 1e-40;
        all = solve(&f, &p).iterations;
        p.quick = 1;
        without = solve(&f, &p).iterations;
        p.quick = 0;
        p.enough = 1e-8;
        perp__rigid_answer a = solve(&f, &p);
        assert_true(a.tested <= p.enough && a.own_residual <= p.enough);
        assert_true(a.iterations <= without && without < all);
        close_fixture(&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),    cmocka_unit_test(test_public_entrance),
        cmocka_unit_test(test_joint),   cmocka_unit_test(test_carrier),

        cmocka_unit_test(test_again),   cmocka_unit_test(test_memory),
        cmocka_unit_test(test_nothing), cmocka_unit_test(test_no_answer),
        cmocka_unit_test(test_enough),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

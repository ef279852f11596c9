/* Exact zeros: what the rows that hold determine is not close to the truth but the truth, and what
 * they leave free moves as it should. Through the entrance for rigid bodies; test_hold_public.c
 * goes through perp_contact_solve. */
#include <float.h>
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include <perp/perp.h>

#include "contact/solver.h"
#include "gen.h"
#include "rigid_scene.h"

typedef struct fixture {
    perp_context *context;
    perp_contact_solver *solver;
    rigid_scene s;
    perp__rigid_problem p;
    perp__rigid_answer a;
} fixture;

static const double unit_half[3] = {0.5, 0.5, 0.5};

static void open_fixture(fixture *f, int32_t planar)
{
    memset(f, 0, sizeof *f);
    rigid_open(&f->s, planar);
    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    assert_int_equal(perp__contact_create(f->context, &f->solver, NULL), PERP_OK);
}

static void close_fixture(fixture *f)
{
    perp__handle_end(f->solver);
    perp_context_destroy(f->context);
    rigid_close(&f->s);
}

static void solve(fixture *f, double tol)
{
    f->p = rigid_problem(&f->s);
    f->a = rigid_answer(&f->s);
    f->p.tol = tol;
    f->p.holds = 1;
    assert_int_equal(perp__rigid_solve(f->solver, &f->a, &f->p), PERP_OK);
    assert_true(f->a.outcome == PERP_OUTCOME_SOLVED || f->a.outcome == PERP_OUTCOME_ROUNDING_LIMIT);
}

static const double *v_of(const fixture *f, int32_t body)
{
    return f->s.v + (size_t)(body * f->s.width);
}

/* 0.0, not -0.0. */
static void check_rest(const fixture *f)
{
    int32_t i, k;

    for (i = 0; i < f->s.bodies * f->s.width; i++)
        assert_true(f->s.v[i] == 0.0 && !signbit(f->s.v[i]));
    for (i = 0; i < f->s.bodies; i++)
        assert_int_equal(f->s.carrier[i], PERP__RIGID_AT_REST);
    for (k = 0; k < 3 * f->s.contacts; k++)
        assert_true(f->s.velocity[k] == 0.0);
}

static void test_piles_rest(void **state)
{
    static const double tols[] = {1e-3, 1e-6, 1e-10};
    int planar, t;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (t = 0; t < 3; t++) {
            fixture f;
            int i;

            open_fixture(&f, planar);
            for (i = 0; i < 20; i++) { /* a stack, light and heavy in turn */
                const int32_t box =
                    rigid_box(&f.s, 0.0, 0.0, i + 0.5, unit_half, i % 2 ? 0.1 : 10.0, NULL);

                rigid_face(&f.s, box - 1, box, -0.5, 0.5, -0.5, 0.5, i, 0.5);
            }
            solve(&f, tols[t]);
            check_rest(&f);
            close_fixture(&f);
            open_fixture(&f, planar);
            rigid_pyramid(&f.s, 20, 0.5);
            assert_int_equal(f.s.bodies, 210);
            solve(&f, tols[t]);
            check_rest(&f);
            close_fixture(&f);
        }
}

/* A brick on a slope: gravity along it is (1 +- 1e-9) times what friction bears. */
static void test_threshold(void **state)
{
    static const double excess[] = {1e-9, -1e-9};
    const double g = RIGID_G * RIGID_H, mu = 0.5;
    int k;

    (void)state;
    for (k = 0; k < 2; k++) {
        fixture f;

        open_fixture(&f, 0);
        rigid_box(&f.s, 0.0, 0.0, 0.5, unit_half, 2.0, NULL);
        rigid_face(&f.s, RIGID_GROUND, 0, -0.5, 0.5, -0.5, 0.5, 0.0, mu);
        f.s.free[0] = mu * g * (1.0 + excess[k]);
        solve(&f, 1e-13);
        if (k == 1) {
            check_rest(&f);
        } else { /* mu g 1e-9, as well as doubles tell 1 + 1e-9 from 1 */
            assert_true(fabs(f.s.v[0] / (mu * g * 1e-9) - 1.0) <= 1e-5);
            assert_true(f.s.v[2] == 0.0 && f.s.v[3] == 0.0 && f.s.v[4] == 0.0);
        }
        close_fixture(&f);
    }
}

/* Boxes on a belt and on a table that turns have these motions to the last bit. */
static void test_carriers(void **state)
{
    static const double belt[6] = {0.3, -0.2, 0.1, 0.0, 0.0, 0.0};
    static const double table[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.07};
    static const double place[3] = {3.0, 0.5, -1.0};
    const double *twists[2] = {belt, table};
    int32_t k, i;

    (void)state;
    for (k = 0; k < 2; k++) {
        fixture f;

        open_fixture(&f, 0);
        for (i = 0; i < 3; i++)
            rigid_box(&f.s, 0.0, 0.0, i + 0.5, unit_half, 1.0 + i, twists[k]);
        rigid_add(&f.s, place, unit_half, 0.0, twists[k]);
        for (i = 0; i < 3; i++)
            rigid_face(&f.s, i ? i - 1 : 3, i, -0.5, 0.5, -0.5, 0.5, i, 0.6);
        for (i = 0; i < 3 && k == 1; i++) { /* free velocities that turn with it */
            f.s.free[6 * i] = 0.07 * 0.5;
            f.s.free[6 * i + 1] = -0.07 * 3.0;
        }
        solve(&f, 1e-8);
        for (i = 0; i < 3; i++) {
            const double carried[6] = {0.07 * 0.5, 0.07 * -3.0, 0.0, 0.0, 0.0, 0.07};

            assert_int_equal(f.s.carrier[i], 3);
            assert_memory_equal(v_of(&f, i), k ? carried : belt, sizeof carried);
        }
        for (i = 0; i < 3 * f.s.contacts; i++)
            assert_true(f.s.velocity[i] == 0.0);
        close_fixture(&f);
    }
}

/* A plank over two lifts, 1 m apart, that rise with 1/8 and 1/2 m/s: 0.375 rad/s. */
static void test_two_carriers(void **state)
{
    static const double half[3] = {0.7, 0.5, 0.3}, up[2] = {0.0, 1.0};
    static const double left[2] = {-0.5, 0.0}, right[2] = {0.5, 0.0};
    static const double slow[3] = {0.0, 0.125, 0.0}, fast[3] = {0.0, 0.5, 0.0};
    fixture f;

    (void)state;
    open_fixture(&f, 1);
    rigid_box(&f.s, 0.0, 0.0, 0.3, half, 3.0, NULL);
    rigid_add(&f.s, left, half, 0.0, slow);
    rigid_add(&f.s, right, half, 0.0, fast);
    rigid_touch(&f.s, 1, 0, left, up, 2, 5.0);
    rigid_touch(&f.s, 2, 0, right, up, 2, 0.0);
    solve(&f, 1e-10);
    /* some roundings of 1/2 */
    assert_true(fabs(f.s.v[2] - 0.375) <= 4e-16);
    assert_true(fabs(f.s.v[1] - 0.3125) <= 4e-16);
    assert_true(fabs(f.s.v[0] + 0.375 * 0.3) <= 4e-16);
    assert_int_equal(f.s.carrier[0], 0); /* it moves as nothing else does, but determined */
    assert_true(f.s.velocity[0] == 0.0 && f.s.velocity[3] == 0.0);
    close_fixture(&f);
}

/* Eight points on a slope: their normals have rank 3, to rounding, and not a direction more. */
static void test_slope(void **state)
{
    static const double corner[4][2] = {{-0.5, -0.5}, {0.5, -0.4}, {-0.4, 0.5}, {0.5, 0.45}};
    int seed;

    (void)state;
    for (seed = 0; seed < 20; seed++) {
        gen_random random;
        fixture f;
        double n[3], t[2][3], length = 0.0, along = 0.0, across = 0.0, place[3];
        int32_t k, i;

        gen_seed(&random, (uint64_t)seed);
        for (i = 0; i < 3; i++) {
            n[i] = gen_uniform(&random, -0.5, 0.5) + (i == 2 ? 1.0 : 0.0);
            length += n[i] * n[i];
        }
        for (i = 0; i < 3; i++)
            n[i] /= sqrt(length);
        rigid_tangents(n, t);
        open_fixture(&f, 0);
        for (i = 0; i < 3; i++)
            place[i] = 0.5 * n[i];
        rigid_add(&f.s, place, unit_half, 2.0, NULL);
        for (k = 0; k < 8; k++) {
            double point[3];

            for (i = 0; i < 3; i++)
                point[i] =
                    (k < 4 ? 1.0 : 0.6) * (corner[k % 4][0] * t[0][i] + corner[k % 4][1] * t[1][i]);
            rigid_touch(&f.s, RIGID_GROUND, 0, point, n, 3, 0.05);
        }
        solve(&f, 1e-10);
        for (i = 0; i < 3; i++) {
            along += f.s.v[i] * f.s.v[i];
            across += f.s.v[i] * n[i];
        }
        assert_int_equal(f.s.carrier[0], PERP__RIGID_FREE);
        assert_true(sqrt(along) > 1e-3);
        assert_true(fabs(across) <= 1e-15); /* rounding of g h = 0.1 */
        close_fixture(&f);
    }
}

/* A belt that is given by its surface's velocity alone: what it holds is known to rounding, and
 * carries another box as one. */
static void test_pushed(void **state)
{
    static const double start[6] = {0.3, 0.0, 0.0, 0.0, 0.0, 0.0};
    fixture f;
    int32_t k, i;

    (void)state;
    open_fixture(&f, 0);
    for (i = 0; i < 2; i++) {
        rigid_box(&f.s, 0.0, 0.0, i + 0.5, unit_half, 1.0 + i, start);
        rigid_face(&f.s, i - 1, i, -0.5, 0.5, -0.5, 0.5, i, 0.6);
    }
    for (k = 0; k < 4; k++)
        f.s.rows[k].bias[1] = -0.3;
    solve(&f, 1e-10);
    assert_true(fabs(f.s.v[0] - 0.3) <= 4e-16); /* some roundings of 0.3 */
    for (i = 1; i < 6; i++)
        assert_true(fabs(f.s.v[i]) <= 4e-16);
    assert_int_equal(f.s.carrier[0], 0);
    assert_int_equal(f.s.carrier[1], 0);
    for (k = 0; k < 3 * f.s.contacts; k++)
        assert_true(f.s.velocity[k] == 0.0);
    close_fixture(&f);
}

/* Modes of which the velocities say otherwise: nothing holds, v = v_free + M^-1 J'r. */
static void test_false_modes(void **state)
{
    static const double start[6] = {0.0, 0.0, 2.0, 0.0, 0.0, 0.0};
    fixture f;
    int32_t k;

    (void)state;
    open_fixture(&f, 0);
    rigid_box(&f.s, 0.0, 0.0, 0.5, unit_half, 2.0, start);
    rigid_face(&f.s, RIGID_GROUND, 0, -0.5, 0.5, -0.5, 0.5, 0.0, 0.6);
    f.p = rigid_problem(&f.s);
    f.a = rigid_answer(&f.s);
    memset(f.s.impulse, 0, 12 * sizeof(double));
    for (k = 0; k < 4; k++)
        f.s.modes[k] = PERP_CONTACT_STICK;
    assert_int_equal(perp__rigid_hold(f.solver, &f.a, &f.p), PERP_OK);
    assert_memory_equal(f.s.v, f.s.free, 6 * sizeof(double));
    assert_int_equal(f.s.carrier[0], PERP__RIGID_FREE);
    close_fixture(&f);
}

/* Sliding: normals hold three velocities of the box at 0.0 and leave the others as they should be;
 * and those of the one that rides on it. */
static void test_slip(void **state)
{
    static const double start[6] = {2.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const double expected = 2.0 - 0.25 * RIGID_G * RIGID_H;
    int riders;

    (void)state;
    for (riders = 0; riders < 3; riders++) {
        fixture f;
        int32_t i, b;

        open_fixture(&f, 0);
        for (b = 0; b <= riders; b++) {
            rigid_box(&f.s, 0.0, 0.0, b + 0.5, unit_half, 1.0 + b, start);
            rigid_face(&f.s, b - 1, b, -0.5, 0.5, -0.5, 0.5, b, b ? 0.5 : 0.25);
        }
        solve(&f, 1e-12);
        for (b = 0; b <= riders; b++) {
            assert_int_equal(f.s.carrier[b], PERP__RIGID_FREE);
            assert_true(fabs(v_of(&f, b)[0] - expected) <= 1e-11); /* the solve's tolerance */
            assert_true(v_of(&f, b)[2] == 0.0);
            assert_true(v_of(&f, b)[3] == 0.0 && v_of(&f, b)[4] == 0.0);
        }
        for (i = 0; i < f.s.contacts; i++)
            assert_true(f.s.velocity[3 * i] == 0.0);
        close_fixture(&f);
    }
}

/* Two rods lean against each other on rough ground, in the plane: neither is held by the ground
 * alone. A third on top of them, then, is held by both. */
static void test_cards(void **state)
{
    static const double half[2] = {0.5, 0.02}, left[3] = {-0.25, 0.4, 0.0},
                        right[3] = {0.25, 0.4, 0.0};
    static const double feet[2][2] = {{-0.5, 0.0}, {0.5, 0.0}}, top[2] = {0.0, 0.8};
    static const double up[2] = {0.0, 1.0}, across[2] = {1.0, 0.0};
    fixture f;

    (void)state;
    open_fixture(&f, 1);
    rigid_add(&f.s, left, half, 1.0, NULL);
    rigid_add(&f.s, right, half, 1.3, NULL);
    rigid_touch(&f.s, RIGID_GROUND, 0, feet[0], up, 2, 1.0);
    rigid_touch(&f.s, RIGID_GROUND, 1, feet[1], up, 2, 1.0);
    rigid_touch(&f.s, 0, 1, top, across, 2, 1.0);
    solve(&f, 1e-10);
    check_rest(&f);
    close_fixture(&f);
}

/* The fourth leg of a table presses by nothing, and so may two more: they hold all the same, where
 * otherwise the table could turn about the last two. */
static void test_legs(void **state)
{
    static const double corner[4][3] = {
        {-0.5, -0.5, 0}, {0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}};
    static const double up[3] = {0.0, 0.0, 1.0};
    fixture f;
    int32_t k;

    (void)state;
    open_fixture(&f, 0);
    rigid_box(&f.s, 0.0, 0.0, 0.5, unit_half, 2.0, NULL);
    for (k = 0; k < 4; k++)
        rigid_touch(&f.s, RIGID_GROUND, 0, corner[k], up, 3, 0.5);
    f.p = rigid_problem(&f.s);
    f.a = rigid_answer(&f.s);
    memset(f.s.impulse, 0, 12 * sizeof(double));
    f.s.impulse[0] = f.s.impulse[9] = 0.5 * 2.0 * RIGID_G * RIGID_H; /* 0 and 3, diagonal */
    for (k = 0; k < 4; k++)
        f.s.modes[k] = k % 3 ? PERP_CONTACT_SEPARATE : PERP_CONTACT_STICK;
    assert_int_equal(perp__rigid_hold(f.solver, &f.a, &f.p), PERP_OK);
    check_rest(&f);
    close_fixture(&f);
}

/* A box on 1e4 points: at rest 6 independent rows are found among the first few, sliding each
 * normal is taken up once. Either way the cost is linear. */
static void test_redundant(void **state)
{
    static const double up[3] = {0.0, 0.0, 1.0};
    int64_t taken_up[2][2];
    int slides, large, k;

    (void)state;
    for (slides = 0; slides < 2; slides++)
        for (large = 0; large < 2; large++) {
            const int count = large ? 10000 : 1000;
            const double start[6] = {slides ? 3.0 : 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
            fixture f;

            open_fixture(&f, 0);
            rigid_box(&f.s, 0.0, 0.0, 0.5, unit_half, 2.0, start);
            for (k = 0; k < count; k++) { /* on a circle */
                const double angle = 6.283185307179586 * k / count;
                const double point[3] = {0.5 * cos(angle), 0.5 * sin(angle), 0.0};

                rigid_touch(&f.s, RIGID_GROUND, 0, point, up, 3, 0.5);
            }
            solve(&f, 1e-8);
            taken_up[slides][large] = f.solver->hold.taken_up;
            if (!slides)
                check_rest(&f);
            else
                assert_true(f.s.v[0] > 2.9 && f.s.v[2] == 0.0 && f.s.v[3] == 0.0);
            close_fixture(&f);
        }
    assert_true(taken_up[0][1] <= 12);
    assert_true(taken_up[1][0] <= 2 * 1000 && taken_up[1][1] <= 2 * 10000);
}

/* Pyramids of 55 and 210: as many rows a body. */
static void test_linear(void **state)
{
    int planar, base;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (base = 10; base <= 20; base += 10) {
            fixture f;

            open_fixture(&f, planar);
            rigid_pyramid(&f.s, base, 0.5);
            solve(&f, 1e-6);
            /* three sticking points are 9 rows and have rank 6, two in the plane 4 and 3 */
            assert_true(f.solver->hold.taken_up <= (planar ? 4 : 9) * f.s.bodies);
            close_fixture(&f);
        }
}

/* Without friction on a lift: what stops the lowest box is no rest, all rise. */
static void test_lift(void **state)
{
    static const double rising[6] = {0.0, 0.0, 0.25, 0.0, 0.0, 0.0};
    fixture f;

    (void)state;
    open_fixture(&f, 0);
    for (int32_t i = 0; i < 3; i++)
        rigid_box(&f.s, 0.0, 0.0, i + 0.5, unit_half, 1.0 + i, NULL);
    rigid_box(&f.s, 0.0, 0.0, -0.5, unit_half, 0.0, rising);
    for (int32_t i = 0; i < 3; i++)
        rigid_face(&f.s, i ? i - 1 : 3, i, -0.5, 0.5, -0.5, 0.5, i, 0.0);
    solve(&f, 1e-8);
    for (int32_t i = 0; i < 3; i++) /* rounding of 12 rows of length 1 and speeds of 1/4 */
        assert_true(fabs(v_of(&f, i)[2] - 0.25) <= 12 * DBL_EPSILON);
    close_fixture(&f);
}

/* ---- against an independent projection ------------------------------------------------------- */

/* Rows that hold: as the modes say. */
static int32_t rows_held(const rigid_scene *s, int32_t k)
{
    return s->modes[k] == PERP_CONTACT_SEPARATE ? 0
           : s->modes[k] == PERP_CONTACT_STICK  ? s->rows[k].dim
                                                : 1;
}

/* u of a row in long doubles. */
static long double row_velocity(const rigid_scene *s, int32_t k, int32_t i, const long double *v)
{
    long double u = s->rows[k].bias[i];
    int32_t side, j;

    for (side = 0; side < 2; side++)
        for (j = 0; s->rows[k].body[side] >= 0 && j < s->width; j++)
            u += s->rows[k].rows[side][i][j] * v[s->rows[k].body[side] * s->width + j];
    return u;
}

static void push(const rigid_scene *s, int32_t k, int32_t i, long double impulse, long double *v)
{
    int32_t side, j;

    for (side = 0; side < 2; side++)
        for (j = 0; s->rows[k].body[side] >= 0 && j < s->width; j++) {
            const int32_t b = s->rows[k].body[side], w = s->width;

            v[b * w + j] +=
                impulse * s->rows[k].rows[side][i][j] / s->mass[b * w * w + j * (w + 1)];
        }
}

/* Kaczmarz' method: onto one row that holds after the other, in the metric of the mass, until they
 * all hold. It converges to the nearest point. */
static void project(const rigid_scene *s, long double *v)
{
    int32_t round, k, i, n = s->bodies * s->width;
    long double *unit = gen_allocate((size_t)n, sizeof *unit);
    long double worst = 1.0L;

    for (round = 0; round < 2000000 && worst > 1e-17L; round++)
        for (worst = 0.0L, k = 0; k < s->contacts; k++)
            for (i = 0; i < rows_held(s, k); i++) {
                const long double u = row_velocity(s, k, i, v);
                long double w;

                memset(unit, 0, (size_t)n * sizeof *unit);
                push(s, k, i, 1.0L, unit);
                w = row_velocity(s, k, i, unit) - s->rows[k].bias[i];
                push(s, k, i, -u / w, v);
                if (fabsl(u) > worst)
                    worst = fabsl(u);
            }
    free(unit);
}

static void add_random_contact(rigid_scene *s, gen_random *random, int32_t k, int32_t bodies)
{
    const int32_t planar = s->width == 3, dim = planar ? 2 : 3;
    double point[3], normal[3], length;
    int32_t i;

    for (i = 0; i < 3; i++) {
        point[i] = gen_uniform(random, -1.0, 1.0);
        normal[i] = gen_uniform(random, -1.0, 1.0);
    }
    length = hypot(hypot(normal[0], normal[1]), planar ? 0.0 : normal[2]);
    for (i = 0; i < 3; i++)
        normal[i] /= length;
    rigid_touch(s, k < bodies ? RIGID_GROUND : k % bodies, (k + 1) % bodies, point, normal, dim,
                0.5);
    s->modes[k] = (int32_t)(gen_uniform(random, 0.0, 2.99));
    for (i = 0; i < 3; i++) { /* of a contact that slips only the tangents matter */
        s->impulse[3 * k + i] = 0.0;
        if (s->modes[k] != PERP_CONTACT_SEPARATE && i < dim)
            s->impulse[3 * k + i] = gen_uniform(random, 0.1, 1.0);
    }
}

static void fill_random(rigid_scene *s, uint64_t seed)
{
    const int32_t bodies = 2 + (int32_t)(seed % 4);
    gen_random random;
    int32_t i, k;

    gen_seed(&random, seed);
    for (i = 0; i < bodies; i++) {
        double place[3], half[3], start[6];

        for (k = 0; k < 3; k++) {
            place[k] = gen_uniform(&random, -1.0, 1.0);
            half[k] = gen_uniform(&random, 0.3, 1.0);
        }
        for (k = 0; k < 6; k++)
            start[k] = gen_uniform(&random, -1.0, 1.0);
        rigid_add(s, place, half, gen_uniform(&random, 0.5, 2.0), start);
    }
    for (k = 0; k < 2 * bodies; k++)
        add_random_contact(s, &random, k, bodies);
}

static void test_projection(void **state)
{
    int seed, planar;

    (void)state;
    for (planar = 0; planar < 2; planar++)
        for (seed = 0; seed < 60; seed++) {
            fixture f;
            long double *v;
            int32_t i, k, n;

            open_fixture(&f, planar);
            fill_random(&f.s, (uint64_t)(seed + 100 * planar));
            n = f.s.bodies * f.s.width;
            v = gen_allocate((size_t)n, sizeof *v);
            for (i = 0; i < n; i++)
                v[i] = f.s.free[i];
            for (k = 0; k < f.s.contacts; k++)
                for (i = rows_held(&f.s, k); i < f.s.rows[k].dim; i++)
                    push(&f.s, k, i, f.s.impulse[3 * k + i], v);
            project(&f.s, v);
            f.p = rigid_problem(&f.s);
            f.a = rigid_answer(&f.s);
            f.p.tol = 1e10; /* the modes are to be believed: these are no answers */
            assert_int_equal(perp__rigid_hold(f.solver, &f.a, &f.p), PERP_OK);
            for (i = 0; i < n; i++) /* velocities of 1; Kaczmarz stops at 1e-17 a row */
                assert_true(fabsl(v[i] - f.s.v[i]) <= 1e-10L);
            free(v);
            close_fixture(&f);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_piles_rest),  cmocka_unit_test(test_threshold),
        cmocka_unit_test(test_carriers),    cmocka_unit_test(test_two_carriers),
        cmocka_unit_test(test_slip),        cmocka_unit_test(test_cards),
        cmocka_unit_test(test_legs),        cmocka_unit_test(test_redundant),
        cmocka_unit_test(test_linear),      cmocka_unit_test(test_lift),
        cmocka_unit_test(test_projection),  cmocka_unit_test(test_pushed),
        cmocka_unit_test(test_false_modes), cmocka_unit_test(test_slope),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

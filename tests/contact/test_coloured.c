/* Coloured sweeps: the same bits from every set of instructions, pairs that share no body, and what
 * they converge to: the law of each contact, and the velocities that the exact methods find. */
#include <stdio.h>

#include "suite.h"

#include <float.h>
#include <perp/base.h>

#include "base/handle.h"
#include "contact/coloured/coloured.h"
#include "contact/rigid_scene.h"

typedef struct fixture {
    perp_context *context;
    perp__coloured coloured;
    rigid_scene s;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step;
    double *gap, *guard, *moving;
} fixture;

static void open_scene(fixture *f, int32_t planar)
{
    memset(f, 0, sizeof *f);
    assert_int_equal(perp_context_create(&f->context, NULL), PERP_OK);
    perp__coloured_init(&f->coloured, f->context);
    rigid_open(&f->s, planar);
}

/* Contacts touch. */
static void prepare(fixture *f, int32_t passes)
{
    const size_t numbers = (size_t)(f->s.width * (f->s.bodies + 1));
    int32_t k;

    f->problem = rigid_problem(&f->s);
    f->answer = rigid_answer(&f->s);
    f->moving = rigid_grown(f->moving, numbers, sizeof(double));
    f->gap = rigid_grown(f->gap, (size_t)f->s.contacts, sizeof(double));
    f->guard = rigid_grown(f->guard, (size_t)f->s.contacts, sizeof(double));
    for (k = 0; k < f->s.contacts; k++) {
        f->gap[k] = 0.0;
        f->guard[k] = 1e-3;
    }
    f->step.h = RIGID_H;
    f->step.passes = passes;
    f->step.gap = f->gap;
    f->step.guard = f->guard;
}

static void run(fixture *f)
{
    assert_int_equal(
        perp__coloured_step(&f->coloured, &f->answer, f->moving, &f->problem, &f->step), PERP_OK);
}

static void close_scene(fixture *f)
{
    free(f->moving);
    free(f->gap);
    free(f->guard);
    rigid_close(&f->s);
    perp__coloured_release(&f->coloured);
    perp_context_destroy(f->context);
}

/* Twenty balls in a ring about one that they all touch, and each its neighbours. */
static void add_ring(fixture *f, int32_t count)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    double push[6] = {0.3, -0.2, 0.1, 0.5, 0.0, 0.2};
    const int32_t hub = rigid_box(&f->s, 0.0, 0.0, 0.0, half, 3.0, push);
    const double step = 6.283185307179586 / count;
    int32_t i;

    for (i = 0; i < count; i++) {
        const double a = i * step, n[3] = {cos(a), sin(a), 0.0};
        const double at[3] = {0.5 * n[0], 0.5 * n[1], 0.0};
        const double pull[6] = {-n[0], -n[1], 0.1 * (i % 3), 0.0, 0.3, 0.0};
        const int32_t ball = rigid_box(&f->s, n[0], n[1], 0.0, half, 1.0 + i % 4, pull);

        rigid_touch(&f->s, hub, ball, at, n, 3, i % 5 == 0 ? 0.0 : 0.2 * (i % 5));
        if (i > 0) {
            const double b = a - 0.5 * step, t[3] = {-sin(b), cos(b), 0.0};
            const double between[3] = {cos(b), sin(b), 0.0};

            rigid_touch(&f->s, ball - 1, ball, between, t, 3, 0.4);
        }
    }
}

static void test_same_bits(void **state)
{
    const perp__coloured_kernels *found[PERP__COLOURED_SETS];
    const int32_t sets = perp__coloured_find_kernels(found);
    double expected[6 * 21], moved[6 * 21], measured[3 * 39], tested = 0.0;
    int32_t k;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    add_ring(&f, 20);
    prepare(&f, 25);
    f.step.clear = 2;
    f.step.measures = 1;
    assert_int_equal(f.s.contacts, 39);
    f.gap[3] = -0.01;
    f.gap[5] = 0.002;
    for (k = 0; k < sets; k++) {
        f.coloured.kernels = found[k];
        run(&f);
        if (k > 0) {
            assert_memory_equal(f.s.v, expected, sizeof expected);
            assert_memory_equal(f.moving, moved, sizeof moved);
            assert_memory_equal(f.answer.velocity, measured, sizeof measured);
            assert_true(f.answer.tested == tested);
        }
        tested = f.answer.tested;
        memcpy(measured, f.answer.velocity, sizeof measured);
        memcpy(expected, f.s.v, sizeof expected);
        memcpy(moved, f.moving, sizeof moved);
    }
    close_scene(&f);
}

/* No two pairs of a group share a body, and every contact is in one place: with more pairs at a
 * body than there are colours too. */
static void test_groups(void **state)
{
    int32_t g, k, l, m, seen = 0;
    int8_t *count;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    add_ring(&f, 90);
    prepare(&f, 4);
    run(&f);
    count = calloc((size_t)f.s.contacts, sizeof *count);
    assert_non_null(count);
    for (g = 0; g < f.coloured.groups; g++) {
        const perp__lane_group *group = &f.coloured.group[g];

        for (l = 0; l < PERP__GROUP; l++)
            for (m = 0; m < l; m++) {
                const int32_t none = f.s.bodies;

                assert_true(group->a[l] == none || group->a[l] != group->a[m]);
                assert_true(group->a[l] == none || group->a[l] != group->b[m]);
                assert_true(group->b[l] == none || group->b[l] != group->a[m]);
                assert_true(group->b[l] == none || group->b[l] != group->b[m]);
            }
        for (k = 0; k < group->points; k++)
            for (l = 0; l < PERP__GROUP; l++)
                if (f.coloured.point[group->first + k].contact[l] >= 0) {
                    count[f.coloured.point[group->first + k].contact[l]]++;
                    seen++;
                }
    }
    assert_int_equal(seen, f.s.contacts);
    for (k = 0; k < f.s.contacts; k++)
        assert_int_equal(count[k], 1);
    free(count);
    close_scene(&f);
}

/* What pieces write to is theirs alone while others of the colour are at work, what nothing moves
 * included. A pyramid of 253 boxes is large enough to be cut. */
static void test_pieces_keep_apart(void **state)
{
    int32_t *owner, first = 0, pieces;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    rigid_pyramid(&f.s, 22, 0.5);
    prepare(&f, 1);
    run(&f);
    assert_true(f.coloured.is_large);
    owner = calloc((size_t)f.coloured.rows, sizeof *owner);
    assert_non_null(owner);
    pieces = f.coloured.colour_first[f.coloured.colour_count];
    assert_true(pieces > 4 * f.coloured.colour_count);
    assert_int_equal(f.coloured.piece_first[pieces], f.coloured.groups);
    for (int32_t colour = 0; colour < f.coloured.colour_count; colour++) {
        memset(owner, 0, (size_t)f.coloured.rows * sizeof *owner);
        for (int32_t i = f.coloured.colour_first[colour]; i < f.coloured.colour_first[colour + 1];
             i++) {
            assert_int_equal(f.coloured.piece_first[i], first);
            for (; first < f.coloured.piece_first[i + 1]; first++)
                for (int32_t l = 0; l < 2 * PERP__GROUP; l++) {
                    const perp__lane_group *group = &f.coloured.group[first];
                    const int32_t row = l < PERP__GROUP ? group->a[l] : group->b[l - PERP__GROUP];

                    assert_in_range(row, 0, f.coloured.rows - 1);
                    assert_true(owner[row] == 0 || owner[row] == i + 1);
                    owner[row] = i + 1;
                }
        }
    }
    free(owner);
    close_scene(&f);
}

static void run_backwards(perp_task task, void *data, int32_t count, void *user)
{
    ++*(int32_t *)user;
    while (count-- > 0)
        task(count, data);
}

/* However many threads there are, and in a caller's order. */
static void test_same_bits_in_pieces(void **state)
{
    static const int32_t threads[] = {1, 2, 3, 8, 3};
    double expected[6 * 253], moved[6 * 253];
    int32_t calls = 0;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    rigid_pyramid(&f.s, 22, 0.5);
    prepare(&f, 40);
    f.step.clear = 2;
    f.gap[30] = -0.01;
    assert_int_equal(f.s.bodies, 253);
    run(&f);
    memcpy(expected, f.s.v, sizeof expected);
    memcpy(moved, f.moving, sizeof moved);
    for (int32_t k = 0; k < 5; k++) {
        assert_int_equal(perp__tasks_create(f.context, &f.coloured.tasks, threads[k],
                                            k == 4 ? run_backwards : NULL, &calls),
                         PERP_OK);
        for (int32_t i = 0; i < 10; i++) {
            memset(f.s.v, 0, sizeof expected);
            run(&f);
            assert_memory_equal(f.s.v, expected, sizeof expected);
            assert_memory_equal(f.moving, moved, sizeof moved);
        }
        perp__tasks_destroy(f.coloured.tasks);
    }
    assert_true(calls > 10 * 40); /* a colour at a time */
    close_scene(&f);
}

/* Many passes come to what the exact solver finds: v is unique, since contacts are isolated enough
 * or slip. Passes stop at rounding; the exact answer is good to its tol. */
static void against_exact(fixture *f, int32_t passes, double tolerance)
{
    perp_contact_solver *solver = NULL;
    const int32_t numbers = f->s.width * f->s.bodies;
    double *v;
    int32_t i;

    prepare(f, passes);
    run(f);
    v = rigid_grown(NULL, (size_t)numbers, sizeof *v);
    memcpy(v, f->s.v, (size_t)numbers * sizeof *v);
    assert_int_equal(perp__contact_create(f->context, &solver, NULL), PERP_OK);
    f->problem.tol = 1e-10;
    assert_int_equal(perp__rigid_solve(solver, &f->answer, &f->problem), PERP_OK);
    assert_int_equal(f->answer.outcome, PERP_OUTCOME_SOLVED);
    for (i = 0; i < numbers; i++)
        if (!(fabs(v[i] - f->s.v[i]) <= tolerance))
            fail_msg("v[%d] is %.17g, exact %.17g", (int)i, v[i], f->s.v[i]);
    perp__handle_end(solver);
    free(v);
}

static void test_limit(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    const double thrown[6] = {1.5, 0.4, -1.0, 0.0, 0.0, 0.0}, flat[3] = {1.5, -1.0, 0.3};
    int32_t planar;
    fixture f;

    (void)state;
    for (planar = 0; planar < 2; planar++) {
        open_scene(&f, planar);
        rigid_pyramid(&f.s, 3, 0.5);
        against_exact(&f, 3000, 1e-10); /* at rest; Gauss-Seidel's rate is about 0.99 */
        close_scene(&f);
        open_scene(&f, planar);
        rigid_box(&f.s, 0.0, 0.0, 0.5, half, 2.0, planar ? flat : thrown);
        rigid_face(&f.s, RIGID_GROUND, 0, -0.5, 0.5, -0.5, 0.5, 0.0, 0.3);
        against_exact(&f, 3000, 1e-10);
        close_scene(&f);
    }
}

/* Steps from the impulses that the last one ended with stand still: warm starts keep no drift. The
 * velocity falls by orders from the first step, g h, in 300 steps. */
static void test_warm(void **state)
{
    double *warm, fastest = 0.0;
    int32_t i;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    rigid_pyramid(&f.s, 5, 0.5);
    prepare(&f, 8);
    warm = calloc(3 * (size_t)f.s.contacts, sizeof *warm);
    assert_non_null(warm);
    f.problem.warm = warm;
    for (i = 0; i < 300; i++) {
        run(&f);
        memcpy(warm, f.answer.impulse, 3 * (size_t)f.s.contacts * sizeof *warm);
    }
    for (i = 0; i < 6 * f.s.bodies; i++)
        fastest = fmax(fastest, fabs(f.s.v[i]));
    assert_true(fastest < 1e-3 * RIGID_G * RIGID_H);
    free(warm);
    close_scene(&f);
}

/* Rounds of passes end with the first whose residual is within tol, at the last one, and with the
 * budget: a box bears one of 30 times its mass, which four passes do not hold. */
static void test_rounds(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    int32_t ended;
    double left;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    rigid_box(&f.s, 0.0, 0.0, 0.5, half, 1.0, NULL);
    rigid_box(&f.s, 0.0, 0.0, 1.5, half, 30.0, NULL);
    rigid_face(&f.s, RIGID_GROUND, 0, -0.5, 0.5, -0.5, 0.5, 0.0, 0.5);
    rigid_face(&f.s, 0, 1, -0.5, 0.5, -0.5, 0.5, 1.0, 0.5);
    prepare(&f, 4);
    f.problem.tol = 1e-3;
    f.step.measures = 1;
    run(&f);
    left = f.answer.tested;
    assert_true(left > f.problem.tol && f.answer.iterations == 4);
    f.step.rounds = 2;
    run(&f);
    assert_true(f.answer.tested < left && f.answer.iterations == 8);
    f.step.rounds = 100;
    run(&f);
    assert_true(f.answer.tested <= f.problem.tol);
    ended = (int32_t)f.answer.iterations;
    assert_true(ended % 4 == 0 && ended > 8 && ended < 400);
    f.step.rounds = 1; /* none of as many passes that are measured as a whole was good before */
    for (f.step.passes = 4; f.step.passes <= ended; f.step.passes += 4) {
        run(&f);
        assert_true((f.answer.tested <= f.problem.tol) == (f.step.passes == ended));
    }
    f.step.passes = 4;
    f.step.rounds = 100;
    f.problem.max_iterations = 6;
    run(&f);
    assert_int_equal(f.answer.iterations, 8);
    close_scene(&f);
}

/* Problems that share no body have the bits side by side that they have alone, whichever others
 * there are: each its own momentum, rounds and start, some with overlap to take out, of one to five
 * rows of boxes or a ring. */
static void test_side_by_side(void **state)
{
    enum { PARTS = 6, MOST = 64 };
    static double v[PARTS][6 * MOST], moved[PARTS][6 * MOST], pushed[PARTS][3 * 4 * MOST];
    perp__coloured_part parts[PARTS];
    int32_t passes[PARTS], others = 0;
    double tested[PARTS];
    fixture f[PARTS];

    (void)state;
    memset(parts, 0, sizeof parts);
    for (int32_t k = 0; k < PARTS; k++) {
        open_scene(&f[k], 0);
        if (k == PARTS - 1)
            add_ring(&f[k], 20);
        else
            rigid_pyramid(&f[k].s, 1 + k, 0.4);
        assert_in_range(f[k].s.bodies, 1, MOST);
        assert_in_range(f[k].s.contacts, 1, 4 * MOST);
        prepare(&f[k], 16);
        f[k].gap[0] = k % 2 == 0 ? -0.01 : 0.0;
        f[k].step.measures = 1;
        f[k].step.rounds = 2 + k;
        f[k].step.clear = k == 2 ? 0 : 2;
        f[k].problem.tol = 1e-4;
        f[k].problem.warm = f[k].s.warm;
        for (int32_t i = 0; i < f[k].s.contacts; i++)
            f[k].s.warm[3 * i] = k == 3 ? 100.0 : 0.01;
        run(&f[k]);
        memcpy(v[k], f[k].s.v, (size_t)(6 * f[k].s.bodies) * sizeof(double));
        memcpy(moved[k], f[k].moving, (size_t)(6 * f[k].s.bodies) * sizeof(double));
        memcpy(pushed[k], f[k].s.impulse, (size_t)(3 * f[k].s.contacts) * sizeof(double));
        passes[k] = (int32_t)f[k].answer.iterations;
        tested[k] = f[k].answer.tested;
        others += passes[k] != passes[0];
        parts[k].answer = &f[k].answer;
        parts[k].moving = f[k].moving;
        parts[k].problem = &f[k].problem;
        parts[k].step = &f[k].step;
    }
    assert_true(others >= 2); /* some end before others */
    for (int32_t first = 0; first < PARTS; first++) {
        for (int32_t k = first; k < PARTS; k++) {
            memset(f[k].s.v, 0, (size_t)(6 * f[k].s.bodies) * sizeof(double));
            f[k].answer.tested = -1.0;
        }
        assert_int_equal(perp__coloured_parts(&f[0].coloured, parts + first, PARTS - first),
                         PERP_OK);
        for (int32_t k = first; k < PARTS; k++) {
            const size_t numbers = (size_t)(6 * f[k].s.bodies);

            assert_memory_equal(f[k].s.v, v[k], numbers * sizeof(double));
            assert_memory_equal(f[k].moving, moved[k], numbers * sizeof(double));
            assert_memory_equal(f[k].s.impulse, pushed[k],
                                (size_t)(3 * f[k].s.contacts) * sizeof(double));
            assert_int_equal(f[k].answer.iterations, passes[k]);
            assert_true(f[k].answer.tested == tested[k]);
        }
    }
    for (int32_t k = 0; k < PARTS; k++)
        close_scene(&f[k]);
}

/* A body that nothing presses keeps the bits of its free velocity, and a carrier carries. */
static void test_free_and_carried(void **state)
{
    static const double half[3] = {0.5, 0.5, 0.5};
    const double up[6] = {0.0, 0.0, 1.0, 0.1, 0.2, 0.3}, belt[6] = {0.05, 0.0, 0.0, 0, 0, 0};
    int32_t i;
    fixture f;

    (void)state;
    open_scene(&f, 0);
    rigid_box(&f.s, 0.0, 0.0, 0.5, half, 2.0, up);
    rigid_box(&f.s, 5.0, 0.0, 0.5, half, 2.0, NULL);
    rigid_add(&f.s, half, half, 0.0, belt);
    rigid_face(&f.s, RIGID_GROUND, 0, -0.5, 0.5, -0.5, 0.5, 0.0, 0.3);
    rigid_face(&f.s, 2, 1, 4.5, 5.5, -0.5, 0.5, 0.0, 1000.0);
    prepare(&f, 2000);
    run(&f);
    assert_memory_equal(f.s.v, f.s.free, 6 * sizeof(double));
    for (i = 0; i < 6; i++) /* stuck to the belt, to what 2000 passes leave of 0.05 m/s */
        assert_true(fabs(f.s.v[6 + i] - belt[i]) < 1e-9);
    close_scene(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_groups),
        cmocka_unit_test(test_pieces_keep_apart),
        cmocka_unit_test(test_same_bits_in_pieces),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_warm),
        cmocka_unit_test(test_rounds),
        cmocka_unit_test(test_side_by_side),
        cmocka_unit_test(test_free_and_carried),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

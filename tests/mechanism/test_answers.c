/* All answers of a step, and the one that is selected. */
#include "rig.h"

/* Sums of products of a few numbers of size 1 to 10. */
#define ROUNDING 1e-12

typedef struct answers {
    perp_mechanism_summary summary;
    perp_mechanism_found found;
} answers;

static int32_t ask(rig *r, answers *a, double h)
{
    perp_struct_init(&a->summary, sizeof a->summary);
    if (perp_mechanism_answers(r->mechanism, &a->summary, r->t, h, r->q, r->v) != PERP_OK)
        fail_msg("%s", perp_context_message(r->context));
    assert_int_equal(a->summary.exhaustive, 1);
    return a->summary.count;
}

static const perp_mechanism_found *get(rig *r, answers *a, int32_t index)
{
    perp_struct_init(&a->found, sizeof a->found);
    assert_int_equal(perp_mechanism_get_acceleration(r->mechanism, &a->found, index), PERP_OK);
    assert_true(a->found.residual <= ROUNDING);
    return &a->found;
}

/* Pulled out from rest by a force of 1: with mu > tan(slope) velocities 0 and h solve the step,
 * else h alone. */
static void pull_wedge(double mu, int32_t select)
{
    const double h = 1e-2, slope = MACHINE_PI / 18;
    const int jams = mu > tan(slope);
    int32_t k, count, still = 0, out = 0;
    answers a;
    rig r;

    rig_open(&r, MACHINE_WEDGE);
    r.settings.select = select;
    r.machine.mu[0] = r.machine.mu[1] = mu;
    r.machine.data.mass.load[1] = 1;
    r.machine.v[1] = 0;
    rig_start(&r);
    count = ask(&r, &a, h);
    for (k = 0; k < count; k++) {
        const perp_mechanism_found *found = get(&r, &a, k);

        assert_true(found->acceleration[0] == 0.0 && found->free == 0);
        still += found->acceleration[1] == 0.0;
        out += found->acceleration[1] == 1.0;
    }
    assert_int_equal(out, 1);
    assert_true(jams ? still >= 1 : still == 0);
    assert_int_equal(still + out, count);
    rig_step(&r, h);
    if (select == PERP_MECHANISM_ANY)
        assert_int_equal(r.step.answers, 0);
    else {
        assert_int_equal(r.step.answers, count);
        assert_int_equal(r.step.exhaustive, 1);
        near(r.v[1], jams && select == PERP_MECHANISM_NEAREST ? 0.0 : h, 0.0, "selected");
    }
    rig_close(&r);
}

static void test_wedge(void **state)
{
    int32_t select;

    (void)state;
    for (select = PERP_MECHANISM_ANY; select <= PERP_MECHANISM_FREEST; select++) {
        pull_wedge(0.1, select);
        pull_wedge(0.3, select);
    }
}

static void open_rod(rig *r, double gravity, int32_t select)
{
    rig_open(r, MACHINE_ROD);
    r->settings.select = select;
    r->machine.data.body.gravity[0] = 0;
    r->machine.data.body.gravity[1] = gravity;
    rig_start(r);
}

/* Painleve's rod under gravity: no acceleration, one answer of the step, the jam. */
static void test_rod_without_acceleration(void **state)
{
    const double h = 1e-2;
    answers a;
    rig r;

    (void)state;
    open_rod(&r, -MACHINE_GRAVITY, PERP_MECHANISM_ANY);
    assert_int_equal(ask(&r, &a, h), 1);
    near(r.v[0] + h * get(&r, &a, 0)->acceleration[0], -0.57057, ROUNDING, "jam");
    rig_close(&r);
}

/* With 5 upwards, W_nn = 1.6, W_nt = -1.2, W_tt = 3.4, mu = 2: the tip leaves, or slides on with
 * p N + 5 = 0, p = 1.6 - 2.4, which is unstable, or sticks:
 *   1.6 N - 1.2 F + 5 h = 0,   -1.2 N + 3.4 F = 1   (impulses, determinant 4). */
static void test_rod_three_ways(void **state)
{
    const double h = 1e-3, N = (1.2 - 17 * h) / 4, F = (1.6 - 6 * h) / 4;
    int32_t select, k;
    answers a;
    rig r;

    (void)state;
    for (select = PERP_MECHANISM_ANY; select <= PERP_MECHANISM_FREEST; select++) {
        int seen[3] = {0, 0, 0};

        open_rod(&r, 5, select);
        assert_int_equal(ask(&r, &a, h), 3);
        assert_int_equal(a.summary.stable, 2);
        assert_int_equal(a.summary.reason, PERP_MECHANISM_NEGATIVE_INERTIA);
        for (k = 0; k < 3; k++) {
            const perp_mechanism_found *found = get(&r, &a, k);
            const int32_t mode = found->modes[0];

            seen[mode]++;
            assert_int_equal(found->stable, mode != PERP_MECHANISM_SLIP);
            near(found->force[0] * h,
                 mode == PERP_MECHANISM_SLIP    ? 6.25 * h
                 : mode == PERP_MECHANISM_STICK ? N
                                                : 0,
                 ROUNDING, "N");
            near(found->force[1] * h,
                 mode == PERP_MECHANISM_SLIP    ? 12.5 * h
                 : mode == PERP_MECHANISM_STICK ? F
                                                : 0,
                 ROUNDING, "F");
        }
        assert_true(seen[0] == 1 && seen[1] == 1 && seen[2] == 1);
        rig_step(&r, h);
        if (select != PERP_MECHANISM_ANY) { /* the stable one that is a motion: it leaves */
            assert_int_equal(r.step.answers, 3);
            assert_int_equal(r.modes[0], PERP_MECHANISM_SEPARATE);
            near(r.v[1], 5 * h, ROUNDING, "leaves");
        }
        rig_close(&r);
    }
}

/* The answer of every step of the falling rod is one of its problem's. */
static void test_steps_are_among_them(void **state)
{
    const double h = 2.5e-3;
    answers a;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_ROD_FALL);
    rig_start(&r);
    while (r.t < 1.0 - h / 2) {
        const int32_t count = ask(&r, &a, h);
        double start[3], velocities[64][3], nearest = INFINITY;
        int32_t k, i;

        assert_true(count >= 1 && count <= 64);
        memcpy(start, r.v, sizeof start);
        for (k = 0; k < count; k++) {
            const perp_mechanism_found *found = get(&r, &a, k);

            for (i = 0; i < 3; i++)
                velocities[k][i] = start[i] + h * found->acceleration[i];
        }
        rig_step(&r, h);
        for (k = 0; k < count; k++)
            nearest =
                fmin(nearest, fabs(velocities[k][0] - r.v[0]) + fabs(velocities[k][1] - r.v[1]) +
                                  fabs(velocities[k][2] - r.v[2]));
        near(nearest, 0, 1e-9, "an answer of the step"); /* tol is 1e-10 of the impulses */
    }
    rig_close(&r);
}

/* Friction of a given bound: one answer, and rest is exact. */
static void test_ramp(void **state)
{
    answers a;
    rig r;

    (void)state;
    rig_open(&r, MACHINE_RAMP_R1);
    r.settings.select = PERP_MECHANISM_NEAREST;
    rig_start(&r);
    while (r.t < 3) {
        assert_int_equal(ask(&r, &a, 0.1), 1);
        rig_step(&r, 0.1);
        assert_int_equal(r.step.answers, 1);
        assert_true((r.t > 1.65) == (r.v[0] == 0.0)); /* from step 17 on */
    }
    rig_close(&r);
}

static void test_refusals(void **state)
{
    perp_mechanism_summary summary = fresh_mechanism_summary();
    perp_mechanism_found found = fresh_mechanism_found();
    rig r;

    (void)state;
    rig_open(&r, MACHINE_WEDGE);
    rig_start(&r);
    assert_int_equal(perp_mechanism_answers(NULL, &summary, 0, 1, r.q, r.v), PERP_ERROR_HANDLE);
    assert_int_equal(perp_mechanism_answers(r.mechanism, NULL, 0, 1, r.q, r.v),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_answers(r.mechanism, &summary, 0, 0, r.q, r.v),
                     PERP_ERROR_ARGUMENT);
    assert_string_equal(perp_context_message(r.context), "h is 0, expected a length > 0");
    assert_int_equal(perp_mechanism_answers(r.mechanism, &summary, 0, NAN, r.q, r.v),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_answers(r.mechanism, &summary, 0, 1, NULL, r.v),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_get_acceleration(r.mechanism, &found, 0), PERP_ERROR_ARGUMENT);
    r.settings.select = 3;
    assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_answers(r.mechanism, &summary, 0, 1, r.q, r.v), PERP_OK);
    assert_int_equal(perp_mechanism_get_acceleration(r.mechanism, &found, 0), PERP_OK);
    rig_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wedge),          cmocka_unit_test(test_rod_without_acceleration),
        cmocka_unit_test(test_rod_three_ways), cmocka_unit_test(test_steps_are_among_them),
        cmocka_unit_test(test_ramp),           cmocka_unit_test(test_refusals),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

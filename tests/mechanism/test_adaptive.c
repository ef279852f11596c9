/* Runs in steps chosen by their estimated error: the error that they really have, against closed
 * forms and against equal steps of the same cost; how they end. */
#include "memory.h"
#include "rig.h"

static perp_mechanism_settings chosen(int32_t scheme, double error)
{
    perp_mechanism_settings settings = fresh_mechanism_settings();

    settings.scheme = scheme;
    settings.error = error;
    return settings;
}

/* Distance from the first reference for a coordinate. */
static double error_of(const machine *m, const machine_record *record)
{
    int32_t k;

    for (k = 0; k < m->references; k++)
        if (m->reference[k].kind == MACHINE_COORDINATE)
            return fabs(machine_measure(record, &m->reference[k]) - m->reference[k].value);
    fail_msg("%s has no reference", m->name);
    return NAN;
}

typedef struct problem {
    int32_t name;
    double h, scale, known; /* scale: the largest coordinate; known: to how much the reference is */
} problem;

/* The creep of ten cycles, a ball before its last bounce, a pendulum, the falling rod. */
static const problem problems[] = {{MACHINE_RAMP_R7, 1e-2, 4, 1e-9},
                                   {MACHINE_BALL, 1e-2, 1, 1e-9},
                                   {MACHINE_PENDULUM, 1e-2, 1, 1e-9},
                                   {MACHINE_ROD_FALL, 5e-3, MACHINE_PI, 1e-5}};

/* Every step may be wrong by the tolerance, and that adds up: N times the tolerance at most. It
 * gets smaller with the tolerance, by a factor of 10 at least over three decades. */
static void test_errors(void **state)
{
    static const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA};
    size_t p, s;
    int decade;

    (void)state;
    for (p = 0; p < sizeof problems / sizeof *problems; p++)
        for (s = 0; s < 2; s++) {
            const problem *now = &problems[p];
            double tolerance = 1e-2, first = 0, error = 0;

            for (decade = 0; decade < 4; decade++, tolerance /= 10) {
                const perp_mechanism_settings settings = chosen(schemes[s], tolerance);
                machine_record record;
                machine m;

                machine_make(&m, now->name);
                rig_run(&record, now->name, &settings, now->h);
                error = error_of(&m, &record);
                if (decade == 0)
                    first = error;
                near(error, 0, (double)record.result.steps * tolerance * now->scale + now->known,
                     m.name);
                assert_true(record.result.t == m.end);
                assert_true(record.result.error <= (double)record.result.steps * tolerance);
            }
            assert_true(error <= fmax(first / 10, now->known));
        }
}

/* A pendulum in x and y, on its constraint: extrapolated theta steps are of order 3, positions and
 * velocities. Order from the errors beside the closed form and the numbers of steps. */
static void test_order(void **state)
{
    double errors[2], steps[2], order;
    int k;

    (void)state;
    for (k = 0; k < 2; k++) {
        const perp_mechanism_settings settings = chosen(PERP_MECHANISM_THETA, k ? 1e-9 : 1e-6);
        machine_record record;
        machine m;
        int32_t i;

        machine_make(&m, MACHINE_PENDULUM);
        rig_run(&record, MACHINE_PENDULUM, &settings, 1e-3);
        steps[k] = (double)record.result.steps;
        errors[k] = 0;
        for (i = 0; i < 4; i++) /* x, y, vx, vy */
            errors[k] = fmax(
                errors[k], fabs(machine_measure(&record, &m.reference[i]) - m.reference[i].value));
    }
    order = log(errors[0] / errors[1]) / log(steps[1] / steps[0]);
    /* 2 without the third order; the first steps, shorter than the others, count as well */
    if (!(order > 2.7 && order < 3.5))
        fail_msg("order %g: %g in %g steps, %g in %g", order, errors[0], steps[0], errors[1],
                 steps[1]);
}

/* Theta steps of equal length that cost as many evaluations have larger errors. */
static void test_cost(void **state)
{
    size_t p;

    (void)state;
    for (p = 0; p < sizeof problems / sizeof *problems; p++) {
        const perp_mechanism_settings settings = chosen(PERP_MECHANISM_THETA, 1e-4),
                                      equal = chosen(PERP_MECHANISM_THETA, 0);
        const problem *now = &problems[p];
        machine_record record, other;
        double error, others;
        machine m;

        machine_make(&m, now->name);
        rig_run(&record, now->name, &settings, now->h);
        rig_run(&other, now->name, &equal, 3.1 * m.end / (double)record.result.evaluations);
        error = error_of(&m, &record);
        others = error_of(&m, &other);
        printf("%-10s %4d steps, %5d evaluations: error %.1e; equal steps, %5d: %.1e\n", m.name,
               (int)record.result.steps, (int)record.result.evaluations, error,
               (int)other.result.evaluations, others);
        assert_true(error < others);
    }
}

/* A slip that comes to rest is located: where a brick stops, once or in each of ten cycles, is
 * known to the error asked for beside the way, though a stop is only one of the steps. */
static void test_stops(void **state)
{
    static const int32_t names[] = {MACHINE_RAMP_R1, MACHINE_RAMP_R2, MACHINE_RAMP_R4,
                                    MACHINE_RAMP_R7};

    (void)state;
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        for (double error = 1e-4; error > 1e-9; error /= 10) {
            const perp_mechanism_settings settings = chosen(PERP_MECHANISM_THETA, error);
            machine_record record;
            machine m;

            machine_make(&m, names[k]);
            rig_run(&record, names[k], &settings, 1e-2);
            near(error_of(&m, &record), 0, error * fmax(fabs(record.q[0]), 1), m.name);
        }
}

/* ---- turns ----------------------------------------------------------------------------------- */

/* q'' = -100 q, with dry friction of 5: half turns about +-0.05, each smaller by 0.1. */
static int32_t spring(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)v;
    (void)user;
    k[0] = -100 * q[0];
    return 0;
}

static int32_t rubbing(double *bound, double *B, double *drift, double t, const double *q,
                       const double *v, void *user)
{
    (void)drift;
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    bound[0] = 5;
    B[0] = 1;
    return 0;
}

/* From q = 1 at rest. */
static void make_rubbed(machine *m)
{
    const double half = MACHINE_PI / 10;
    double amplitude = 1, left;

    memset(m, 0, sizeof *m);
    assert_int_equal(perp_mechanism_model_init(&m->model, sizeof m->model), PERP_OK);
    m->name = "rubbed";
    m->model.velocities = m->model.dry = 1;
    m->model.force = spring;
    m->model.dry_rows = rubbing;
    m->q[0] = 1;
    m->end = 2;
    for (left = m->end; left > half; left -= half)
        amplitude = amplitude > 0 ? 0.1 - amplitude : -0.1 - amplitude;
    machine_refer(m, MACHINE_COORDINATE, 0,
                  copysign(0.05, amplitude) +
                      (amplitude - copysign(0.05, amplitude)) * cos(10 * left),
                  "q", "half turns");
}

/* Where a slip turns round, friction has the wrong sign for a part of the step: without a look at
 * that, errors would go with the root of the tolerance. Six turns, one tolerance each. */
static void test_turns(void **state)
{
    static const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA};
    double tolerance;
    int32_t s;

    (void)state;
    for (s = 0; s < 2; s++)
        for (tolerance = 1e-3; tolerance > 1e-7; tolerance /= 10) {
            const perp_mechanism_settings settings = chosen(schemes[s], tolerance);
            machine_record record;
            perp_context *context;
            machine m;

            make_rubbed(&m);
            assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
            assert_int_equal(machine_run(&record, context, &m, &settings, 1e-2, 0), PERP_OK);
            assert_int_equal(record.result.outcome, PERP_OUTCOME_SOLVED);
            near(error_of(&m, &record), 0, 6 * tolerance, "q");
            perp_context_destroy(context);
        }
}

/* ---- rest and accumulation ------------------------------------------------------------------- */

typedef struct watched {
    double t, longest, at_rest, error;
    int32_t steps, stop_after, answer;
} watched;

static int32_t watch(const perp_mechanism_view *view, void *user)
{
    watched *w = user;

    assert_true(view->h == 0 || fabs(view->t - (w->t + view->h)) <= 1e-15 * fabs(view->t));
    w->t = view->t;
    w->longest = fmax(w->longest, view->h);
    if (view->h > 0) {
        w->error += view->step->error;
        w->steps++;
    }
    if (view->v[0] != 0.0)
        w->at_rest = INFINITY;
    else if (isinf(w->at_rest))
        w->at_rest = view->t;
    return w->stop_after > 0 && w->steps >= w->stop_after ? w->answer : 0;
}

/* The status of a run of a rig; its results in place. */
static perp_status run_rig(rig *r, perp_mechanism_run_result *result, watched *w, double h,
                           double end)
{
    assert_int_equal(perp_struct_init(result, sizeof *result), PERP_OK);
    return perp_mechanism_run(r->mechanism, r->q, r->v, result,
                              START(0, h, r->machine.q, r->machine.v), end, watch, w);
}

/* The brick stops where and when it should, and its velocity is 0.0 from there on. */
static void test_rest(void **state)
{
    static const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA};
    int32_t s;

    (void)state;
    for (s = 0; s < 2; s++) {
        perp_mechanism_run_result result;
        watched w = {0};
        rig r;

        rig_open(&r, MACHINE_RAMP_R1);
        r.settings = chosen(schemes[s], 1e-4);
        r.settings.longest = 0.1;
        rig_start(&r);
        assert_int_equal(run_rig(&r, &result, &w, 1e-2, 5), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        near(w.at_rest, machine_value(&r.machine, "stop"), 0.1, "stop"); /* the step it is in */
        near(r.q[0], machine_value(&r.machine, "x"), 2e-4 * (double)result.steps, "x");
        assert_true(r.v[0] == 0.0 && w.longest <= 0.1 * (1 + 1e-12));
        assert_int_equal(w.steps, result.steps);
        near(w.error, result.error, 1e-15 * (double)result.steps, "sum of estimates");
        rig_close(&r);
    }
}

/* Infinitely many bounces before 1.3545709: the control goes through, to rest. What is left out are
 * rebounds below the speed that gravity gives in a step, and errors of the bounces before. */
static void test_accumulation(void **state)
{
    static const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA};
    int32_t s;

    (void)state;
    for (s = 0; s < 2; s++) {
        perp_mechanism_run_result result;
        watched w = {0};
        rig r;

        rig_open(&r, MACHINE_BALL);
        r.settings = chosen(schemes[s], 1e-4);
        rig_start(&r);
        assert_int_equal(run_rig(&r, &result, &w, 1e-2, 2), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(r.q[0] == 0.0 && r.v[0] == 0.0);
        near(w.at_rest, machine_value(&r.machine, "rest"), 0.05, "rest");
        assert_true(result.steps < 1000);
        rig_close(&r);
    }
}

/* ---- ends ------------------------------------------------------------------------------------ */

static void test_stalled(void **state)
{
    perp_mechanism_run_result result;
    watched w = {0};
    rig r;

    (void)state;
    rig_open(&r, MACHINE_PENDULUM);
    r.settings = chosen(PERP_MECHANISM_FROZEN, 1e-8);
    r.settings.shortest = 1e-2;
    rig_start(&r);
    assert_int_equal(run_rig(&r, &result, &w, 0.1, 1), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STALLED);
    assert_true(result.t == 0 && result.steps == 0 && result.rejected > 0);
    assert_true(r.q[0] == r.machine.q[0] && r.v[1] == 0);
    rig_close(&r);
}

static void test_stopped(void **state)
{
    perp_mechanism_run_result result;
    watched w = {0};
    rig r;

    (void)state;
    rig_open(&r, MACHINE_RAMP_R2);
    r.settings = chosen(PERP_MECHANISM_FROZEN, 1e-4);
    rig_start(&r);
    w.stop_after = 3;
    w.answer = 1;
    assert_int_equal(run_rig(&r, &result, &w, 1e-2, 1), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    assert_true(result.steps == 3 && result.t == w.t);
    memset(&w, 0, sizeof w);
    w.stop_after = 2;
    w.answer = -1;
    r.q[0] = 7;
    assert_int_equal(run_rig(&r, &result, &w, 1e-2, 1), PERP_ERROR_CALLBACK);
    assert_true(r.q[0] == 7);
    rig_close(&r);
}

static void test_time_limit(void **state)
{
    perp_mechanism_run_result result;
    watched w = {0};
    rig r;

    (void)state;
    rig_open(&r, MACHINE_RAMP_R7);
    r.settings = chosen(PERP_MECHANISM_FROZEN, 1e-6);
    r.settings.time_limit = 1e-9;
    rig_start(&r);
    assert_int_equal(run_rig(&r, &result, &w, 1e-2, 30), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
    assert_true(result.steps + result.rejected == 1);
    rig_close(&r);
}

/* k = 1 where q < 1, and no more beyond. */
static int32_t fenced(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)v;
    k[0] = 1;
    return q[0] < 1 ? 0 : *(const int32_t *)user;
}

/* Steps get shorter before the fence, and the run ends there: q = t^2/2 = 1. A negative answer
 * aborts it. */
static void test_fence(void **state)
{
    const perp_mechanism_settings settings = chosen(PERP_MECHANISM_FROZEN, 1e-3);
    const double start = 0;
    int32_t answer;

    (void)state;
    for (answer = -1; answer <= 1; answer += 2) {
        perp_mechanism_model model = fresh_mechanism_model();
        perp_mechanism *mechanism;
        perp_mechanism_run_result result = fresh_mechanism_run_result();
        perp_context *context;
        perp_status status;
        double q = 5, v = 6;

        model.velocities = 1;
        model.force = fenced;
        model.user = &answer;
        assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
        assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &model), PERP_OK);
        status = perp_mechanism_run(mechanism, &q, &v, &result, START(0, 0.1, &start, &start), 3,
                                    NULL, NULL);
        if (answer < 0) {
            assert_int_equal(status, PERP_ERROR_CALLBACK);
            assert_true(q == 5 && v == 6);
        } else {
            assert_int_equal(status, PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_EVALUATION_FAILED);
            /* the error of the steps before, and of one */
            near(result.t, sqrt(2), 1e-3 * (double)result.steps, "t");
            near(q, 1, 1e-3 * (double)result.steps, "q");
        }
        perp_mechanism_destroy(mechanism);
        perp_context_destroy(context);
    }
}

/* ---- the handle ------------------------------------------------------------------------------ */

static perp_status everything(const perp_context_settings *from)
{
    const perp_mechanism_settings settings = chosen(PERP_MECHANISM_THETA, 1e-3);
    machine_record record;
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, from);
    machine m;

    machine_make(&m, MACHINE_RAMP_R1);
    if (status == PERP_OK)
        status = machine_run(&record, context, &m, &settings, 1e-2, 0);
    perp_context_destroy(context);
    return status;
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(everything, 0);
}

static void test_determinism(void **state)
{
    const perp_mechanism_settings settings = chosen(PERP_MECHANISM_FROZEN, 1e-3);
    machine_record one, other;

    (void)state;
    rig_run(&one, MACHINE_ROD_FALL, &settings, 5e-3);
    rig_run(&other, MACHINE_ROD_FALL, &settings, 5e-3);
    assert_memory_equal(one.q, other.q, sizeof one.q);
    assert_memory_equal(one.v, other.v, sizeof one.v);
    assert_memory_equal(&one.result.error, &other.result.error, sizeof one.result.error);
    assert_int_equal(one.result.evaluations, other.result.evaluations);
}

/* ---- rest ------------------------------------------------------------------------------------ */

static int32_t heavy(double *M, const double *q, void *user)
{
    (void)q;
    (void)user;
    M[0] = 2;
    return 0;
}

static int32_t growing(double *k, double t, const double *q, const double *v, void *user)
{
    (void)q;
    (void)v;
    (void)user;
    k[0] = 3 * sin(6 * t);
    return 0;
}

/* From complete rest at 0, by a force that is 0 there: v = (1 - cos 6t) / 4, q = (t - sin(6t) / 6)
 * / 4 for the mass 2. No step is wrong by more than the tolerance of numbers of size 1. */
static void test_growing_force(void **state)
{
    static const int32_t schemes[] = {PERP_MECHANISM_FROZEN, PERP_MECHANISM_IMPLICIT,
                                      PERP_MECHANISM_THETA};
    int k, i;

    (void)state;
    for (k = 0; k < 3; k++)
        for (i = 0; i < 3; i++) {
            const perp_mechanism_settings settings = chosen(schemes[k], 1e-5);
            perp_mechanism_model model = fresh_mechanism_model();
            perp_mechanism_run_result result = fresh_mechanism_run_result();
            perp_mechanism *mechanism;
            perp_context *context;
            double q = 0, v = 0;

            model.velocities = 1;
            model.mass = heavy;
            model.force = growing;
            assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
            assert_int_equal(perp_mechanism_create(context, &mechanism, &settings, &model),
                             PERP_OK);
            assert_int_equal(perp_mechanism_run(mechanism, &q, &v, &result,
                                                START(0, pow(10, i - 3), &q, &v), 3, NULL, NULL),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
            near(v, (1 - cos(18)) / 4, (double)result.steps * 1e-5, "speed");
            near(q, (3 - sin(18) / 6) / 4, (double)result.steps * 1e-5, "place");
            perp_mechanism_destroy(mechanism);
            perp_context_destroy(context);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_errors),        cmocka_unit_test(test_order),
        cmocka_unit_test(test_cost),          cmocka_unit_test(test_turns),
        cmocka_unit_test(test_rest),          cmocka_unit_test(test_accumulation),
        cmocka_unit_test(test_stalled),       cmocka_unit_test(test_stopped),
        cmocka_unit_test(test_time_limit),    cmocka_unit_test(test_fence),
        cmocka_unit_test(test_memory),        cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_growing_force), cmocka_unit_test(test_stops),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

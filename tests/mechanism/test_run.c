/* Runs of equal steps: their times, what observers see, and how they end. */
#include "tabled.h"

typedef struct seen {
    tabled *rig;
    int32_t calls, stop_at, answer; /* the call that returns `answer` */
    double t[64], h[64], q[64];
    int32_t outcome;
} seen;

static int32_t watch(const perp_mechanism_view *view, void *user)
{
    seen *s = user;
    const tabled *r = s->rig;
    int32_t i;

    assert_int_equal(view->struct_size, sizeof *view);
    assert_non_null(view->step);
    assert_int_equal(view->step->outcome, PERP_OUTCOME_SOLVED);
    for (i = 0; i < r->model.velocities; i++)
        assert_true(isfinite(view->q[i]) && isfinite(view->v[i]));
    if (s->calls < 64) {
        s->t[s->calls] = view->t;
        s->h[s->calls] = view->h;
        s->q[s->calls] = view->q[0];
    }
    if (s->calls == 0) { /* nothing has happened */
        assert_true(view->h == 0.0);
        assert_true(view->impulse[0] == 0.0);
        assert_int_equal(view->modes[0], PERP_MECHANISM_SEPARATE);
    }
    return s->calls++ == s->stop_at ? s->answer : 0;
}

/* A mass on the floor that slides without friction. */
static void make_sled(tabled *r)
{
    tabled_make(r, 2, 1, 2);
    r->H[1] = 1.0;
    r->H[2] = 1.0;
    r->k[1] = -9.81;
    r->v[0] = 1.0;
    tabled_open(r);
}

static perp_mechanism_run_result run(tabled *r, seen *s, double t0, double t1, double h,
                                     perp_status expected)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();

    s->rig = r;
    assert_int_equal(perp_mechanism_run(r->mechanism, r->q, r->v, &result, START(t0, h, r->q, r->v),
                                        t1, watch, s),
                     expected);
    return result;
}

static void test_times(void **state)
{
    static const struct {
        double t0, t1, h;
        int32_t steps;
        double length;
    } cases[] = {{0, 1, 0.1, 10, 0.1},
                 {0, 1, 0.3, 4, 0.25},
                 {2, 5, 10, 1, 3},
                 {-1, 1, 0.25, 8, 0.25},
                 {0, 1, 1, 1, 1},
                 {0, 0.3, 0.1, 3, 0.1},
                 {1e6, 1e6 + 1, 0.0625, 16, 0.0625}};
    size_t i;
    int32_t k;

    (void)state;
    for (i = 0; i < sizeof cases / sizeof *cases; i++) {
        perp_mechanism_run_result result;
        seen s = {.stop_at = -1};
        tabled r;

        make_sled(&r);
        result = run(&r, &s, cases[i].t0, cases[i].t1, cases[i].h, PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(result.steps, cases[i].steps);
        assert_int_equal(s.calls, cases[i].steps + 1);
        assert_true(result.t == cases[i].t1);
        assert_true(isnan(result.error));
        assert_int_equal(result.rejected, 0);
        assert_int_equal(result.fallbacks, 0);
        assert_true(result.seconds >= 0.0);
        assert_true(s.t[0] == cases[i].t0);
        for (k = 1; k <= cases[i].steps; k++) {
            const double t = cases[i].t0 + k * cases[i].length;

            tabled_near(s.t[k], t, 4e-16, "t"); /* two roundings */
            tabled_near(s.h[k], cases[i].length, 4e-16, "h");
            tabled_near(s.q[k], k * cases[i].length, 4e-15, "q"); /* one a step */
        }
        assert_true(s.t[cases[i].steps] == cases[i].t1);
        tabled_close(&r);
    }
}

/* A run is its steps: the same bits. */
static void test_steps(void **state)
{
    tabled r, twin;
    seen s = {.stop_at = -1};
    int32_t k;

    (void)state;
    tabled_make_everything(&r);
    tabled_make_everything(&twin);
    tabled_open(&r);
    tabled_open(&twin);
    run(&r, &s, 0.0, 1.0, 0.0625, PERP_OK);
    for (k = 0; k < 16; k++)
        assert_int_equal(tabled_advance(&twin, 0.0625), PERP_OUTCOME_SOLVED);
    assert_memory_equal(r.q, twin.q, sizeof r.q);
    assert_memory_equal(r.v, twin.v, sizeof r.v);
    tabled_close(&r);
    tabled_close(&twin);
}

/* The rows at the end of a step are those of the next one's start: a run asks for them once, a
 * call by itself asks for its own. */
static void test_evaluations(void **state)
{
    static const double lengths[] = {0.0625, 0.1}; /* with sums of h that are exact, and not */
    perp_mechanism_run_result result;
    seen s = {.stop_at = -1};
    int32_t i;

    (void)state;
    for (i = 0; i < 2; i++) {
        int32_t steps, k;
        tabled r;

        make_sled(&r);
        result = run(&r, &s, 0.0, 1.0, lengths[i], PERP_OK);
        steps = (int32_t)result.steps;
        assert_int_equal(steps, i == 0 ? 16 : 10);
        assert_int_equal(r.calls[TABLED_CONTACTS], steps + 1);
        assert_int_equal(r.calls[TABLED_FORCE], steps);
        assert_int_equal(result.evaluations, steps + 1);
        for (k = 1; k <= 3; k++) {
            assert_int_equal(tabled_advance(&r, 0.1), PERP_OUTCOME_SOLVED);
            assert_int_equal(r.calls[TABLED_CONTACTS], steps + 1 + 2 * k);
            assert_int_equal(r.step.evaluations, 2);
        }
        tabled_close(&r);
    }
}

static void test_stop(void **state)
{
    perp_mechanism_run_result result;
    seen s = {.stop_at = 3, .answer = 1};
    tabled r;

    (void)state;
    make_sled(&r);
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    assert_int_equal(result.steps, 3);
    assert_true(result.t == 0.375);
    assert_true(r.q[0] == 0.375);
    memset(&s, 0, sizeof s);
    s.answer = 7; /* at the start already */
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_STOPPED);
    assert_int_equal(result.steps, 0);
    assert_true(result.t == 0.0);
    assert_true(r.q[0] == 0.375 && r.v[0] == 1.0);
    tabled_close(&r);
}

static void test_abort(void **state)
{
    perp_mechanism_run_result result;
    seen s = {.stop_at = 3, .answer = -4};
    tabled r;

    (void)state;
    make_sled(&r);
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_ERROR_CALLBACK);
    tabled_says(&r, "the observer returned -4");
    assert_int_equal(result.steps, 0); /* untouched */
    assert_true(r.q[0] == 0.0 && r.v[0] == 1.0);
    memset(&s, 0, sizeof s);
    s.stop_at = -1;
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.steps, 8);
    tabled_close(&r);
}

/* A limit that is over at once ends the run after the step it is in; the last step ends it as
 * solved. */
static void test_time_limit(void **state)
{
    perp_mechanism_run_result result;
    seen s = {.stop_at = -1};
    tabled r;

    (void)state;
    make_sled(&r);
    r.settings.time_limit = 1e-12;
    assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings), PERP_OK);
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_TIME_LIMIT);
    assert_int_equal(result.steps, 1);
    assert_true(result.t == 0.125);
    result = run(&r, &s, 0.0, 0.125, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    r.settings.time_limit = 1e3;
    assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings), PERP_OK);
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    tabled_close(&r);
}

/* Walls that close from t = 1/2 on: the run ends in front of the step that does not exist. */
static int32_t closing(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                       void *user)
{
    (void)mu;
    (void)user;
    gap[0] = q[0] + fmin(0.5 - t, 0.0);
    gap[1] = -q[0] + fmin(0.5 - t, 0.0);
    H[0] = 1.0;
    H[1] = -1.0;
    drift[0] = drift[1] = t >= 0.5 ? -1.0 : 0.0;
    return 0;
}

static void test_end_without_a_step(void **state)
{
    perp_mechanism_run_result result;
    seen s = {.stop_at = -1};
    tabled r;

    (void)state;
    tabled_make(&r, 1, 2, 1);
    r.model.contact_rows = closing;
    tabled_open(&r);
    result = run(&r, &s, 0.0, 1.0, 0.125, PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_RAY);
    assert_true(result.t == 0.5);
    assert_int_equal(result.steps, 4);
    assert_int_equal(s.calls, 5);
    tabled_zero(r.q[0], "q");
    tabled_close(&r);
}

/* A tolerance that no arithmetic meets: the run says that its steps were not solved to it. */
static void test_outcome_of_poor_steps(void **state)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    r.mu[0] = 0.3;
    r.settings.tol = 1e-300;
    tabled_open(&r);
    assert_int_equal(perp_mechanism_run(r.mechanism, r.q, r.v, &result, START(0.0, 0.1, r.q, r.v),
                                        1.0, NULL, NULL),
                     PERP_OK);
    assert_true(result.residual > 0.0);
    assert_int_not_equal(result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(result.t == 1.0);
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_times),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_evaluations),

        cmocka_unit_test(test_stop),
        cmocka_unit_test(test_abort),
        cmocka_unit_test(test_time_limit),
        cmocka_unit_test(test_end_without_a_step),
        cmocka_unit_test(test_outcome_of_poor_steps),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

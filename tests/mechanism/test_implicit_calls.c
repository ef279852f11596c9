/* Implicit steps when things go wrong: callbacks that have no answer at the step's end, or abort,
 * and memory that is short. */
#include "asked.h"

#include "memory.h"

/* A pendulum of length 1 with dry friction, above a floor; its force says at which times it is
 * defined. */
typedef struct trouble {
    double after;   /* the force behaves so after this time, */
    int32_t reply;  /* returns this */
    double value;   /* and writes this */
    double least_x; /* rows are defined for x above this */
    double widest;  /* step that rows allow, from x_0 */
    double from;
} trouble;

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    const trouble *s = user;

    (void)q;
    k[0] = -0.1 * v[0];
    k[1] = -9.81;
    if (!(t > s->after))
        return 0;
    if (s->value != 0)
        k[1] = s->value;
    return s->reply;
}

static int32_t mass(double *M, const double *q, void *user)
{
    (void)user;
    M[0] = 1 + q[0] * q[0];
    M[3] = 2;
    return 0;
}

static int32_t floor_rows(double *gap, double *H, double *drift, double *mu, double t,
                          const double *q, void *user)
{
    const trouble *s = user;

    (void)drift;
    (void)mu;
    (void)t;
    if (q[0] < s->least_x || fabs(q[0] - s->from) > s->widest)
        return 1;
    gap[0] = q[1] + 0.5 + 0.1 * q[0] * q[0];
    H[0] = 0.2 * q[0];
    H[1] = 1;
    H[2] = 1;
    H[3] = -0.2 * q[0];
    return 0;
}

static int32_t rod_rows(double *c, double *G, double *drift, double t, const double *q, void *user)
{
    (void)drift;
    (void)t;
    (void)user;
    c[0] = (q[0] * q[0] + q[1] * q[1] - 1) / 2;
    G[0] = q[0];
    G[1] = q[1];
    return 0;
}

static int32_t dry_rows(double *bound, double *B, double *drift, double t, const double *q,
                        const double *v, void *user)
{
    (void)drift;
    (void)t;
    (void)v;
    (void)user;
    bound[0] = 0.3;
    B[0] = -q[1];
    B[1] = q[0];
    return 0;
}

static const double mu = 0.4;

static void describe(asked *a, trouble *s, int32_t scheme)
{
    asked_begin(a, 2, scheme);
    memset(s, 0, sizeof *s);
    s->after = s->widest = HUGE_VAL;
    s->least_x = -HUGE_VAL;
    s->from = 0.8;
    a->model.contacts = 1;
    a->model.bilateral = 1;
    a->model.dry = 1;
    a->model.mu = &mu;
    a->model.mass = mass;
    a->model.force = force;
    a->model.contact_rows = floor_rows;
    a->model.bilateral_rows = rod_rows;
    a->model.dry_rows = dry_rows;
    a->model.user = s;
}

static const double start_q[2] = {0.8, -0.6}, start_v[2] = {0.6, 0.8};

/* Steps from the start. */
static perp_status try(asked *a, double *q, double *v, double h)
{
    return perp_mechanism_advance(a->mechanism, q, v, NULL, NULL, NULL, NULL, &a->step,
                                  START(0, h, start_q, start_v));
}

/* Where the end has no answer (outside, NaN, M k that is none) the step is frozen's, to the last
 * bit, and says so. */
static void test_fallback(void **state)
{
    static const struct {
        int32_t reply;
        double value;
    } ends[] = {{1, 0}, {0, HUGE_VAL}, {0, 1}};
    size_t k;

    (void)state;
    for (k = 0; k < 3; k++) {
        double q[2], v[2], expected_q[2], expected_v[2];
        perp_mechanism_run_result result = fresh_mechanism_run_result();
        trouble s, t;
        asked a, b;

        describe(&a, &s, PERP_MECHANISM_IMPLICIT);
        describe(&b, &t, PERP_MECHANISM_FROZEN);
        asked_make(&a);
        asked_make(&b);
        s.after = 0.005;
        s.reply = ends[k].reply;
        s.value = k == 2 ? (double)NAN : ends[k].value;
        assert_int_equal(try(&b, expected_q, expected_v, 0.01), PERP_OK);
        assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
        assert_int_equal(a.step.outcome, PERP_OUTCOME_SOLVED);
        assert_int_equal(a.step.scheme, PERP_MECHANISM_FROZEN);
        assert_memory_equal(q, expected_q, sizeof q);
        assert_memory_equal(v, expected_v, sizeof v);
        assert_string_equal(perp_context_message(a.context), "");
        /* a run counts them, and ends where the force has no answer at the start either */
        s.after = 0.095;
        if (k == 0) {
            assert_int_equal(perp_mechanism_run(a.mechanism, q, v, &result,
                                                START(0, 0.01, start_q, start_v), 0.2, NULL, NULL),
                             PERP_OK);
            assert_int_equal(result.outcome, PERP_OUTCOME_EVALUATION_FAILED);
            assert_int_equal(result.fallbacks, 1);
            assert_int_equal(result.steps, 10);
        } else {
            assert_int_equal(perp_mechanism_run(a.mechanism, q, v, &result,
                                                START(0, 0.01, start_q, start_v), 0.2, NULL, NULL),
                             PERP_ERROR_NOT_FINITE);
            assert_non_null(strstr(perp_context_message(a.context), "k[1] of its callback is"));
        }
        /* and the handle works on */
        s.after = HUGE_VAL;
        assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
        assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
        asked_end(&a);
        asked_end(&b);
    }
}

/* An abort at the end, and one in a later call of the same step: the message names the callback,
 * outputs stay. */
static void test_abort(void **state)
{
    double q[2] = {7, 7}, v[2] = {7, 7};
    trouble s;
    asked a;

    (void)state;
    describe(&a, &s, PERP_MECHANISM_IMPLICIT);
    asked_make(&a);
    s.after = 0.005;
    s.reply = -3;
    a.step.outcome = -9;
    assert_int_equal(try(&a, q, v, 0.01), PERP_ERROR_CALLBACK);
    assert_string_equal(perp_context_message(a.context), "the force callback returned -3");
    assert_true(q[0] == 7 && q[1] == 7 && v[0] == 7 && v[1] == 7 && a.step.outcome == -9);
    s.reply = 0;
    assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
    assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
    asked_end(&a);
}

/* The end of the frozen step is outside; there is an implicit answer inside: bodies that the floor
 * stops later slide on less. If neither is inside nothing moves. */
static void test_outside(void **state)
{
    double q[2], v[2], inside, far;
    trouble s;
    asked a;

    (void)state;
    describe(&a, &s, PERP_MECHANISM_IMPLICIT);
    asked_make(&a);
    assert_int_equal(try(&a, q, v, 0.1), PERP_OK);
    assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
    inside = fabs(q[0] - start_q[0]);
    asked_end(&a);
    describe(&a, &s, PERP_MECHANISM_FROZEN);
    a.settings.project = 0;
    asked_make(&a);
    assert_int_equal(try(&a, q, v, 0.1), PERP_OK);
    far = fabs(q[0] - start_q[0]);
    asked_end(&a);
    assert_true(inside < far); /* else this tests nothing */
    describe(&a, &s, PERP_MECHANISM_IMPLICIT);
    asked_make(&a);
    s.widest = 0.5 * (inside + far);
    assert_int_equal(try(&a, q, v, 0.1), PERP_OK);
    assert_int_equal(a.step.outcome, PERP_OUTCOME_SOLVED);
    assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
    /* both to tol = 1e-10 of speeds of 1, times h */
    assert_true(fabs(fabs(q[0] - start_q[0]) - inside) < 2e-11);
    s.widest = 0.5 * inside;
    assert_int_equal(try(&a, q, v, 0.1), PERP_OK);
    assert_int_equal(a.step.outcome, PERP_OUTCOME_EVALUATION_FAILED);
    assert_memory_equal(q, start_q, sizeof q);
    assert_memory_equal(v, start_v, sizeof v);
    asked_end(&a);
}

/* Every allocation fails once: the call says so, or another method answers; nothing is lost, and
 * the next try works. */
static void test_allocation(void **state)
{
    int fails_at, done = 0;

    (void)state;
    for (fails_at = 1; !done; fails_at++) {
        memory m = {0};
        perp_context_settings settings = memory_settings(&m);
        double q[2] = {7, 7}, v[2];
        perp_status status;
        trouble s;
        asked a;

        describe(&a, &s, PERP_MECHANISM_IMPLICIT);
        perp_context_destroy(a.context);
        assert_int_equal(perp_context_create(&a.context, &settings), PERP_OK);
        m.fails_at = m.calls + fails_at;
        status = perp_mechanism_create(a.context, &a.mechanism, &a.settings, &a.model);
        if (status == PERP_OK) {
            status = try(&a, q, v, 0.01);
            done = m.calls < m.fails_at;
            if (status != PERP_OK)
                assert_true(q[0] == 7);
            m.fails_at = 0;
            assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
            assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
            perp_mechanism_destroy(a.mechanism);
        } else {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_non_null(strstr(perp_context_message(a.context), "out of memory"));
        }
        perp_context_destroy(a.context);
        assert_int_equal(m.live, 0);
        assert_true(fails_at < 200);
    }
}

/* Settings to implicit and back on a living handle. The first implicit step makes what it needs:
 * with every allocation failing the state stays, and the next step has its memory. */
static void test_set(void **state)
{
    int fails_at;
    perp_status status = PERP_ERROR_MEMORY;

    (void)state;
    for (fails_at = 1; status != PERP_OK; fails_at++) {
        memory m = {0};
        perp_context_settings settings = memory_settings(&m);
        double q[2], v[2];
        trouble s;
        asked a;

        describe(&a, &s, PERP_MECHANISM_FROZEN);
        perp_context_destroy(a.context);
        assert_int_equal(perp_context_create(&a.context, &settings), PERP_OK);
        asked_make(&a);
        a.settings.scheme = PERP_MECHANISM_IMPLICIT;
        assert_int_equal(perp_mechanism_set(a.mechanism, &a.settings), PERP_OK);
        m.fails_at = m.calls + fails_at;
        status = try(&a, q, v, 0.01);
        assert_true(status == PERP_OK || status == PERP_ERROR_MEMORY);
        m.fails_at = 0;
        assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
        assert_int_equal(a.step.scheme, PERP_MECHANISM_IMPLICIT);
        a.settings.scheme = PERP_MECHANISM_FROZEN;
        assert_int_equal(perp_mechanism_set(a.mechanism, &a.settings), PERP_OK);
        assert_int_equal(try(&a, q, v, 0.01), PERP_OK);
        assert_int_equal(a.step.scheme, PERP_MECHANISM_FROZEN);
        asked_end(&a);
        assert_int_equal(m.live, 0);
        assert_true(fails_at < 200);
    }
    assert_true(fails_at > 3);
}

/* Steps do not allocate once there was one of their size: of the same swing the second time none
 * does. */
static void test_no_allocation(void **state)
{
    memory m = {0};
    perp_context_settings settings = memory_settings(&m);
    trouble s;
    asked a;
    int round, before = 0, closed = 0;

    (void)state;
    describe(&a, &s, PERP_MECHANISM_IMPLICIT);
    perp_context_destroy(a.context);
    assert_int_equal(perp_context_create(&a.context, &settings), PERP_OK);
    asked_make(&a);
    for (round = 0; round < 2; round++) {
        double q[2], v[2];
        int i;

        memcpy(q, start_q, sizeof q);
        memcpy(v, start_v, sizeof v);
        before = m.calls;
        for (i = 0; i < 200; i++) {
            asked_step(&a, q, v, NULL, NULL, i * 0.01, 0.01);
            closed += a.step.closed;
        }
    }
    assert_true(closed > 0);
    assert_int_equal(m.calls, before);
    asked_end(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fallback), cmocka_unit_test(test_abort),
        cmocka_unit_test(test_outside),  cmocka_unit_test(test_allocation),
        cmocka_unit_test(test_set),      cmocka_unit_test(test_no_allocation),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Callbacks of a mechanism that fail, that answer nonsense, or that do what they must not. */
#include "tabled.h"

#include "memory.h"

/* What a refused call must leave alone. */
typedef struct outputs {
    double q[TABLED_N], v[TABLED_N], impulse[TABLED_ROWS], velocity[TABLED_ROWS], ray[TABLED_ROWS];
    int32_t modes[TABLED_ROWS];
    perp_mechanism_step step;
} outputs;

static void keep(outputs *o, const tabled *r)
{
    memset(o, 0, sizeof *o);
    memcpy(o->q, r->q, sizeof o->q);
    memcpy(o->v, r->v, sizeof o->v);
    memcpy(o->impulse, r->impulse, sizeof o->impulse);
    memcpy(o->velocity, r->velocity, sizeof o->velocity);
    memcpy(o->ray, r->ray, sizeof o->ray);
    memcpy(o->modes, r->modes, sizeof o->modes);
    o->step = r->step;
}

static void same(const outputs *o, const tabled *r)
{
    assert_memory_equal(o->q, r->q, sizeof o->q);
    assert_memory_equal(o->v, r->v, sizeof o->v);
    assert_memory_equal(o->impulse, r->impulse, sizeof o->impulse);
    assert_memory_equal(o->velocity, r->velocity, sizeof o->velocity);
    assert_memory_equal(o->ray, r->ray, sizeof o->ray);
    assert_memory_equal(o->modes, r->modes, sizeof o->modes);
    assert_memory_equal(&o->step, &r->step, sizeof o->step);
}

/* The step is refused with this text, leaves all outputs alone, and the next one works. */
static void refused(tabled *r, perp_status status, const char *text)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    double q[TABLED_N], v[TABLED_N];
    outputs before;

    memset(r->impulse, 7, sizeof r->impulse);
    memset(r->modes, 7, sizeof r->modes);
    keep(&before, r);
    assert_int_equal(tabled_try(r, 0.125), status);
    tabled_says(r, text);
    same(&before, r);
    memcpy(q, r->q, sizeof q);
    memcpy(v, r->v, sizeof v);
    result.outcome = -7;
    assert_int_equal(
        perp_mechanism_run(r->mechanism, q, v, &result, START(0, 0.125, r->q, r->v), 1, NULL, NULL),
        status);
    tabled_says(r, text);
    assert_memory_equal(q, r->q, sizeof q);
    assert_memory_equal(v, r->v, sizeof v);
    assert_int_equal(result.outcome, -7);
    r->array = TABLED_NOTHING;
    r->callback = TABLED_NONE;
    assert_int_equal(tabled_advance(r, 0.125), PERP_OUTCOME_SOLVED);
    memset(r->q, 0, sizeof r->q);
    memset(r->v, 0, sizeof r->v);
    r->v[0] = 2.0;
}

static void test_not_finite(void **state)
{
    static const struct {
        int32_t array, entry;
        const char *text;
    } arrays[] = {
        {TABLED_M, 7, "M[7] of its callback is"},
        {TABLED_K, 4, "k[4] of its callback is"},
        {TABLED_GAP, 1, "gap[1] of its callback is"},
        {TABLED_H, 24, "H[24] of its callback is"},
        {TABLED_DRIFT, 4, "drift (contacts)[4] of its callback is"},
        {TABLED_MU, 1, "mu[1] of its callback is"},
        {TABLED_C, 0, "c[0] of its callback is"},
        {TABLED_G, 2, "G[2] of its callback is"},
        {TABLED_C_DRIFT, 0, "drift (bilateral)[0] of its callback is"},
        {TABLED_BOUND, 0, "bound[0] of its callback is"},
        {TABLED_B, 3, "B[3] of its callback is"},
        {TABLED_B_DRIFT, 0, "drift (dry)[0] of its callback is"},
        {TABLED_RATE, 4, "rate[4] of its callback is"},
        {TABLED_Q, 1, "q[1] of its callback is"},
    };
    static const double values[] = {NAN, INFINITY, -INFINITY};
    size_t i, k;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    tabled_open(&r);
    for (i = 0; i < sizeof arrays / sizeof *arrays; i++)
        for (k = 0; k < 3; k++) {
            r.array = arrays[i].array;
            r.entry = arrays[i].entry;
            r.value = values[k];
            refused(&r, PERP_ERROR_NOT_FINITE, arrays[i].text);
        }
    tabled_close(&r);
}

static void test_nonsense(void **state)
{
    static const struct {
        int32_t array, entry;
        double value;
        const char *text;
    } wrong[] = {
        {TABLED_M, 1, 0.5, "M is not symmetric: entry (0, 1)"},
        {TABLED_M, 12, -1.0, "M is not positive definite (leading block of 3 rows)"},
        {TABLED_M, 24, 0.0, "M is not positive definite (leading block of 5 rows)"},
        {TABLED_H, 2, 0.0, "the normal of contact 0 is zero"},
        {TABLED_H, 16, 0.0, "the normal of contact 1 is zero"},
        {TABLED_MU, 1, -0.25, "mu[1] of its callback is -0.25, negative"},
        {TABLED_BOUND, 0, -0.25, "bound[0] of its callback is -0.25, negative"},
    };
    size_t i;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    tabled_open(&r);
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        r.array = wrong[i].array;
        r.entry = wrong[i].entry;
        r.value = wrong[i].value;
        refused(&r, PERP_ERROR_ARGUMENT, wrong[i].text);
    }
    tabled_close(&r);
}

/* Numbers that are finite each, and overflow together. */
static void test_overflow(void **state)
{
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    tabled_open(&r);
    r.v[2] = 1e308;
    r.M[12] = 100.0;
    assert_int_equal(tabled_try(&r, 0.125), PERP_ERROR_NOT_FINITE);
    tabled_says(&r, "(M v0 + h k)[2] is inf");
    tabled_close(&r);
    tabled_make_everything(&r);
    tabled_open(&r);
    r.v[2] = 1e308;
    r.q[2] = 1e308;
    r.M[12] = 1.0;
    assert_int_equal(tabled_try(&r, 100.0), PERP_ERROR_NOT_FINITE);
    tabled_says(&r, "(q + h N(q) v)[2] is inf");
    tabled_close(&r);
}

/* A positive answer: outside of what the mechanism is defined for; a negative one: abort. */
static void test_answers(void **state)
{
    static const char *const names[] = {
        "",         "mass",       "force",    "contact_rows", "bilateral_rows",
        "dry_rows", "kinematics", "normalise"};
    perp_mechanism_run_result result;
    double q[TABLED_N], v[TABLED_N];
    char text[64];
    int32_t callback, i;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    tabled_open(&r);
    for (callback = TABLED_MASS; callback <= TABLED_NORMALISE; callback++) {
        r.callback = callback;
        r.answer = -5;
        text[0] = 0;
        strcat(strcat(strcat(text, "the "), names[callback]), " callback returned -5");
        refused(&r, PERP_ERROR_CALLBACK, text);
        r.callback = callback;
        r.answer = 3;
        memcpy(q, r.q, sizeof q);
        memcpy(v, r.v, sizeof v);
        r.step.has_ray = 7;
        assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_EVALUATION_FAILED);
        assert_memory_equal(q, r.q, sizeof q); /* the state stays */
        assert_memory_equal(v, r.v, sizeof v);
        for (i = 0; i < 7; i++)
            tabled_zero(r.impulse[i], "impulse");
        assert_int_equal(r.step.has_ray, 0);
        assert_int_equal(r.step.closed, 0);
        assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
        assert_int_equal(perp_mechanism_run(r.mechanism, q, v, &result, START(0, 0.125, r.q, r.v),
                                            1, NULL, NULL),
                         PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_EVALUATION_FAILED);
        assert_int_equal(result.steps, 0);
        assert_true(result.t == 0.0);
        r.callback = TABLED_NONE;
    }
    tabled_close(&r);
}

/* ---- calls from inside ---------------------------------------------------------------------- */

static void call_everything(void *user, int32_t callback)
{
    tabled *r = user;
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_mechanism *other = NULL;
    double q[TABLED_N] = {0}, v[TABLED_N] = {0};

    (void)callback;
    assert_int_equal(tabled_try(r, 0.125), PERP_ERROR_BUSY);
    assert_int_equal(
        perp_mechanism_run(r->mechanism, q, v, &result, START(0, 1, q, v), 1, NULL, NULL),
        PERP_ERROR_BUSY);
    assert_int_equal(perp_mechanism_set(r->mechanism, NULL), PERP_ERROR_BUSY);
    assert_int_equal(perp_mechanism_create(r->context, &other, NULL, &r->model), PERP_ERROR_BUSY);
    assert_null(other);
    perp_mechanism_destroy(r->mechanism); /* ignored */
}

static int32_t observe(const perp_mechanism_view *view, void *user)
{
    (void)view;
    call_everything(user, TABLED_NONE);
    return 0;
}

static void test_reentry(void **state)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    tabled r, twin;

    (void)state;
    tabled_make_everything(&r);
    tabled_make_everything(&twin);
    tabled_open(&r);
    tabled_open(&twin);
    r.inside = call_everything;
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    assert_int_equal(tabled_advance(&twin, 0.125), PERP_OUTCOME_SOLVED);
    assert_memory_equal(r.v, twin.v, sizeof r.v);
    assert_int_equal(perp_mechanism_run(r.mechanism, r.q, r.v, &result, START(0, 0.125, r.q, r.v),
                                        1, observe, &r),
                     PERP_OK);
    assert_int_equal(result.steps, 8);
    tabled_close(&r);
    tabled_close(&twin);
}

/* ---- memory --------------------------------------------------------------------------------- */

/* A life with each law and each cone, with projection, impacts and a run. */
static perp_status live(const perp_context_settings *from, int32_t law, int32_t cone)
{
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    perp_status status;
    tabled r;

    tabled_make_everything(&r);
    r.settings.law = law;
    r.settings.cone = cone;
    r.restitution[0] = 0.5;
    status = perp_context_create(&r.context, from);
    if (status != PERP_OK)
        return status;
    status = perp_mechanism_create(r.context, &r.mechanism, &r.settings, &r.model);
    r.q[2] = -0.01;
    r.q[3] = 0.01;
    r.v[2] = -3.0;
    if (status == PERP_OK)
        status = tabled_try(&r, 0.125);
    if (status == PERP_OK) {
        assert_int_equal(r.step.impacts, 1);
        r.settings.tol = 1e-9;
        status = perp_mechanism_set(r.mechanism, &r.settings);
    }
    if (status == PERP_OK)
        status = perp_mechanism_run(r.mechanism, r.q, r.v, &result, START(0, 0.125, r.q, r.v), 1,
                                    NULL, NULL);
    perp_mechanism_destroy(r.mechanism);
    perp_context_destroy(r.context);
    return status;
}

static perp_status with_moreau(const perp_context_settings *settings)
{
    return live(settings, PERP_MECHANISM_MOREAU, 0);
}

static perp_status with_poisson(const perp_context_settings *settings)
{
    return live(settings, PERP_MECHANISM_POISSON, 8);
}

static void test_memory(void **state)
{
    (void)state;
    memory_fails_anywhere(with_moreau, 10);
    memory_fails_anywhere(with_poisson, 10);
}

/* A step, or new settings, that run out of memory leave the handle as it was. */
static void test_memory_of_a_step(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    int32_t asked = 0, asked_to_set = 0, k;
    tabled r;

    (void)state;
    for (k = 0; k <= asked || k <= asked_to_set; k++) { /* 0: to count */
        tabled_make_everything(&r);
        m.fails_at = 0;
        assert_int_equal(perp_context_create(&r.context, &settings), PERP_OK);
        assert_int_equal(perp_mechanism_create(r.context, &r.mechanism, NULL, &r.model), PERP_OK);
        m.calls = 0;
        m.fails_at = k;
        assert_int_equal(tabled_try(&r, 0.125), k > 0 && k <= asked ? PERP_ERROR_MEMORY : PERP_OK);
        asked = k == 0 ? m.calls : asked;
        if (k > 0 && k <= asked) {
            tabled_says(&r, "memory");
            tabled_near(r.v[0], 2.0, 0.0, "v");
        }
        m.fails_at = 0;
        assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
        r.settings.law = PERP_MECHANISM_POISSON; /* needs what was not needed before */
        m.calls = 0;
        m.fails_at = k;
        assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings),
                         k > 0 && k <= asked_to_set ? PERP_ERROR_MEMORY : PERP_OK);
        asked_to_set = k == 0 ? m.calls : asked_to_set;
        m.fails_at = 0;
        assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
        tabled_close(&r);
        assert_int_equal(m.live, 0);
    }
    assert_true(asked_to_set > 0);
    assert_true(asked > 1);
}

static void test_no_memory_later(void **state)
{
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    int32_t before, k;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    r.settings.law = PERP_MECHANISM_POISSON;
    r.restitution[0] = 0.5;
    assert_int_equal(perp_context_create(&r.context, &settings), PERP_OK);
    assert_int_equal(perp_mechanism_create(r.context, &r.mechanism, &r.settings, &r.model),
                     PERP_OK);
    r.v[2] = -3.0;
    r.q[2] = -0.01; /* with an impact and a projection, the largest problems */
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    before = m.calls;
    for (k = 0; k < 20; k++) {
        r.v[2] = k % 2 ? -3.0 : 0.0;
        r.q[2] = k % 3 ? 0.0 : -0.01;
        assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    }
    assert_int_equal(
        perp_mechanism_run(r.mechanism, r.q, r.v, &result, START(0, 0.01, r.q, r.v), 1, NULL, NULL),
        PERP_OK);
    assert_int_equal(m.calls, before);
    tabled_close(&r);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_not_finite),       cmocka_unit_test(test_nonsense),
        cmocka_unit_test(test_overflow),         cmocka_unit_test(test_answers),
        cmocka_unit_test(test_reentry),          cmocka_unit_test(test_memory),
        cmocka_unit_test(test_memory_of_a_step), cmocka_unit_test(test_no_memory_later),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

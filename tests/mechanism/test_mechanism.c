/* Mechanisms: their life, and every argument that is refused. */
#include "tabled.h"

/* ---- what create refuses ------------------------------------------------------------------- */

static void refuse(tabled *r, perp_status status, const char *text)
{
    perp_mechanism *const before = (perp_mechanism *)(void *)r;
    perp_mechanism *mechanism = before;

    assert_int_equal(perp_context_create(&r->context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(r->context, &mechanism, &r->settings, &r->model),
                     status);
    assert_ptr_equal(mechanism, before); /* untouched */
    tabled_says(r, text);
    perp_context_destroy(r->context);
}

#define REFUSED(change, status, text) \
    do {                              \
        tabled_make_everything(&r);   \
        r.change;                     \
        refuse(&r, status, text);     \
    } while (0)

static void test_sizes(void **state)
{
    tabled r;

    (void)state;
    REFUSED(model.velocities = 0, PERP_ERROR_ARGUMENT, "model.velocities is 0");
    REFUSED(model.velocities = -3, PERP_ERROR_ARGUMENT, "model.velocities is -3");
    REFUSED(model.coordinates = -1, PERP_ERROR_ARGUMENT, "model.coordinates is -1");
    REFUSED(model.contacts = -1, PERP_ERROR_ARGUMENT, "model.contacts is -1");
    REFUSED(model.contacts = INT32_MAX, PERP_ERROR_ARGUMENT, "model.contacts is 2147483647");
    REFUSED(model.bilateral = -1, PERP_ERROR_ARGUMENT, "model.bilateral is -1");
    REFUSED(model.dry = -1, PERP_ERROR_ARGUMENT, "model.dry is -1");
    REFUSED(model.dry_dim = 3, PERP_ERROR_ARGUMENT, "model.dry_dim is 3");
    REFUSED(dims[1] = 4, PERP_ERROR_ARGUMENT, "model.dims[1] is 4");
    tabled_make_everything(&r);
    r.model.dims = NULL;
    r.model.dim = 0;
    refuse(&r, PERP_ERROR_ARGUMENT, "model.dim is 0");
    REFUSED(model.struct_size = 8, PERP_ERROR_ABI, "model.struct_size");
    REFUSED(settings.struct_size = 0, PERP_ERROR_ABI, "settings.struct_size");
}

static void test_missing_callbacks(void **state)
{
    tabled r;

    (void)state;
    REFUSED(model.contact_rows = NULL, PERP_ERROR_ARGUMENT, "model.contact_rows is NULL");
    REFUSED(model.bilateral_rows = NULL, PERP_ERROR_ARGUMENT, "model.bilateral_rows is NULL");
    REFUSED(model.dry_rows = NULL, PERP_ERROR_ARGUMENT, "model.dry_rows is NULL");
    tabled_make_everything(&r);
    r.model.coordinates = 6;
    r.model.kinematics = NULL;
    refuse(&r, PERP_ERROR_ARGUMENT, "model.kinematics is NULL");
}

static void test_coefficients(void **state)
{
    static const struct {
        double value;
        perp_status status;
        const char *what;
    } wrong[] = {{-0.5, PERP_ERROR_ARGUMENT, "[1] is -0.5"},
                 {NAN, PERP_ERROR_NOT_FINITE, "[1] is"},
                 {INFINITY, PERP_ERROR_NOT_FINITE, "[1] is inf"}};
    static const char *const names[] = {"model.mu", "model.mu_static", "model.stribeck",
                                        "model.restitution"};
    size_t i, k;
    tabled r;

    (void)state;
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++)
        for (k = 0; k < sizeof names / sizeof *names; k++) {
            double *const arrays[] = {r.mu, r.mu_static, r.stribeck, r.restitution};
            char text[64] = "";

            tabled_make_everything(&r);
            arrays[k][1] = wrong[i].value;
            strcat(strcat(text, names[k]), wrong[i].what);
            refuse(&r, wrong[i].status, text);
        }
    REFUSED(mu_static[0] = 0.25, PERP_ERROR_ARGUMENT, "model.mu_static[0] = 0.25 < mu[0] = 0.5");
    for (k = 0; k < 2; k++) { /* no tangents, no friction */
        tabled_make_everything(&r);
        r.dims[1] = 1;
        r.mu[1] = k == 0 ? 0.5 : 0.0;
        r.mu_static[1] = 0.75;
        refuse(&r, PERP_ERROR_ARGUMENT,
               k == 0 ? "model.mu[1] is 0.5, but contact 1 has no tangents"
                      : "model.mu_static[1] is 0.75, but contact 1 has no tangents");
    }
    tabled_make_everything(&r);
    r.model.mu = NULL; /* 0: the static one may be anything */
    tabled_open(&r);
    tabled_close(&r);
    REFUSED(restitution[1] = 1.25, PERP_ERROR_ARGUMENT, "model.restitution[1] is 1.25");
}

static void test_settings(void **state)
{
#define CHANGE(field, number)                                                                  \
    {                                                                                          \
        offsetof(perp_mechanism_settings, field), sizeof((perp_mechanism_settings *)0)->field, \
            number, "settings." #field                                                         \
    }
    static const struct {
        size_t at, size;
        double value;
        const char *text;
    } wrong[] = {CHANGE(scheme, 3),
                 CHANGE(scheme, -1),
                 CHANGE(law, 4),
                 CHANGE(law, -1),
                 CHANGE(cone, 2),
                 CHANGE(cone, -1),
                 CHANGE(cone, 1025),
                 CHANGE(theta, -0.125),
                 CHANGE(theta, 1.125),
                 CHANGE(theta, NAN),
                 CHANGE(tol, 0),
                 CHANGE(tol, -1),
                 CHANGE(tol, 1),
                 CHANGE(tol, NAN),
                 CHANGE(error, -1),
                 CHANGE(error, 1),
                 CHANGE(error, NAN),
                 CHANGE(shortest, -1),
                 CHANGE(shortest, NAN),
                 CHANGE(longest, -1),
                 CHANGE(longest, INFINITY),
                 CHANGE(time_limit, -1),
                 CHANGE(time_limit, NAN),
                 CHANGE(most_patterns, 0),
                 CHANGE(directions, 2),
                 CHANGE(starts, 0),
                 CHANGE(stiffness, 0),
                 CHANGE(stiffness, INFINITY),
                 CHANGE(damping, -1),
                 CHANGE(damping, NAN),
                 CHANGE(select, 3),
                 CHANGE(reserved, 1)};
#undef CHANGE
    perp_mechanism_settings settings;
    size_t i;
    tabled r, twin;

    (void)state;
    tabled_make_everything(&r);
    r.settings.law = PERP_MECHANISM_NEWTON;
    tabled_open(&r);
    for (i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char *const field = (char *)&settings + wrong[i].at;
        const int32_t small = (int32_t)(isnan(wrong[i].value) ? 0 : wrong[i].value);
        const int64_t whole = 0;
        const perp_status status =
            isnan(wrong[i].value) ? PERP_ERROR_NOT_FINITE : PERP_ERROR_ARGUMENT;

        assert_int_equal(perp_mechanism_settings_init(&settings, sizeof settings), PERP_OK);
        if (wrong[i].size == sizeof small)
            memcpy(field, &small, sizeof small);
        else if (wrong[i].at == offsetof(perp_mechanism_settings, most_patterns))
            memcpy(field, &whole, sizeof whole);
        else
            memcpy(field, &wrong[i].value, sizeof wrong[i].value);
        assert_int_equal(perp_mechanism_set(r.mechanism, &settings), status);
        tabled_says(&r, wrong[i].text);
        twin = r;
        twin.settings = settings;
        twin.model.user = &twin;
        refuse(&twin, status, wrong[i].text);
    }
    assert_int_equal(tabled_advance(&r, 0.125),
                     PERP_OUTCOME_SOLVED); /* the old ones are in force */
    assert_int_equal(perp_mechanism_set(r.mechanism, NULL), PERP_OK);
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    assert_int_equal(perp_mechanism_set(NULL, NULL), PERP_ERROR_HANDLE);
    tabled_close(&r);
}

/* Settings that are set are the ones that count: e = 1/2 for a ball that comes in with -1. */
static void test_set(void **state)
{
    tabled r;

    (void)state;
    tabled_make(&r, 1, 1, 1);
    r.H[0] = 1.0;
    r.restitution[0] = 0.5;
    r.settings.law = PERP_MECHANISM_MOREAU;
    tabled_open(&r);
    r.q[0] = -0.25;
    r.v[0] = -1.0;
    r.settings.project = 0;
    assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings), PERP_OK);
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    tabled_near(r.v[0], 0.5, 0.0, "v");
    tabled_near(r.step.penetration, 0.25, 0.0, "penetration");
    r.settings.project = 1;
    assert_int_equal(perp_mechanism_set(r.mechanism, &r.settings), PERP_OK);
    r.q[0] = -0.25;
    r.v[0] = -1.0;
    assert_int_equal(tabled_advance(&r, 0.5), PERP_OUTCOME_SOLVED);
    tabled_near(r.q[0], 0.0, 1e-15, "q"); /* one rounding of the displacement */
    tabled_close(&r);
}

/* ---- a handle's life ------------------------------------------------------------------------ */

static void test_life(void **state)
{
    perp_mechanism *mechanism = NULL;
    perp_context *context;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    perp_mechanism_destroy(NULL);
    assert_int_equal(perp_mechanism_create(NULL, &mechanism, &r.settings, &r.model),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_context_create(&r.context, NULL), PERP_OK);
    assert_int_equal(perp_mechanism_create(r.context, NULL, &r.settings, &r.model),
                     PERP_ERROR_ARGUMENT);
    tabled_says(&r, "mechanism is NULL");
    assert_int_equal(perp_mechanism_create(r.context, &mechanism, &r.settings, NULL),
                     PERP_ERROR_ARGUMENT);
    tabled_says(&r, "model is NULL");
    assert_null(mechanism);
    assert_int_equal(perp_mechanism_create(r.context, &r.mechanism, NULL, &r.model), PERP_OK);
    memset(r.dims, 7, sizeof r.dims); /* the model was copied with its arrays */
    memset(r.mu, 7, sizeof r.mu);
    r.dims[0] = 3; /* the tabled itself needs them */
    r.dims[1] = 2;
    context = r.context;
    perp_context_destroy(context); /* lives on in the mechanism */
    assert_int_equal(tabled_advance(&r, 0.125), PERP_OUTCOME_SOLVED);
    tabled_near(r.v[0], 2.0 - 0.125 * 0.5 * 9.81 / (1.0 - 0.25 * 0.25 / 2.0), 2e-1, "v");
    perp_mechanism_destroy(r.mechanism);
}

static void test_words(void **state)
{
    (void)state;
    assert_string_equal(perp_mechanism_scheme_text(PERP_MECHANISM_FROZEN), "frozen");
    assert_string_equal(perp_mechanism_scheme_text(PERP_MECHANISM_IMPLICIT), "implicit");
    assert_string_equal(perp_mechanism_scheme_text(PERP_MECHANISM_THETA), "theta");
    assert_string_equal(perp_mechanism_scheme_text(-1), "unknown scheme");
    assert_string_equal(perp_mechanism_law_text(PERP_MECHANISM_MOREAU), "moreau");
    assert_string_equal(perp_mechanism_law_text(PERP_MECHANISM_NEWTON), "newton");
    assert_string_equal(perp_mechanism_law_text(PERP_MECHANISM_POISSON), "poisson");
    assert_string_equal(perp_mechanism_law_text(PERP_MECHANISM_STRONGE), "stronge");
    assert_string_equal(perp_mechanism_law_text(4), "unknown law");
    assert_string_equal(perp_mechanism_select_text(PERP_MECHANISM_FREEST), "freest");
    assert_string_equal(perp_mechanism_select_text(3), "unknown selection");
}

/* ---- what a step refuses -------------------------------------------------------------------- */

static void test_step_arguments(void **state)
{
    static const double lengths[] = {0.0, -1.0, NAN, INFINITY};
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    double *const arrays[] = {NULL, NULL};
    double q[TABLED_N] = {0}, v[TABLED_N] = {0}, out[TABLED_N] = {7, 7, 7, 7, 7};
    size_t i;
    tabled r;

    (void)state;
    (void)arrays;
    tabled_make_everything(&r);
    tabled_open(&r);
#define STEP(a, b, step, t, h, c, d) \
    perp_mechanism_advance(r.mechanism, a, b, NULL, NULL, NULL, NULL, step, START(t, h, c, d))
    assert_int_equal(
        perp_mechanism_advance(NULL, out, out, NULL, NULL, NULL, NULL, &r.step, START(0, 1, q, v)),
        PERP_ERROR_HANDLE);
    assert_int_equal(STEP(NULL, out, &r.step, 0, 1, q, v), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "q is NULL");
    assert_int_equal(STEP(out, NULL, &r.step, 0, 1, q, v), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "v is NULL");
    assert_int_equal(STEP(out, out, NULL, 0, 1, q, v), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "step is NULL");
    assert_int_equal(STEP(out, out, &r.step, 0, 1, NULL, v), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "q0 is NULL");
    assert_int_equal(STEP(out, out, &r.step, 0, 1, q, NULL), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "v0 is NULL");
    for (i = 0; i < 4; i++) {
        assert_int_equal(STEP(out, out, &r.step, 0, lengths[i], q, v), PERP_ERROR_ARGUMENT);
        tabled_says(&r, "h is");
    }
    for (i = 0; i < 3; i++) {
        assert_int_equal(STEP(out, out, &r.step, bad[i], 1, q, v), PERP_ERROR_NOT_FINITE);
        tabled_says(&r, "t[0] is");
        q[3] = bad[i];
        assert_int_equal(STEP(out, out, &r.step, 0, 1, q, v), PERP_ERROR_NOT_FINITE);
        tabled_says(&r, "q0[3] is");
        q[3] = 0.0;
        v[4] = bad[i];
        assert_int_equal(STEP(out, out, &r.step, 0, 1, q, v), PERP_ERROR_NOT_FINITE);
        tabled_says(&r, "v0[4] is");
        v[4] = 0.0;
    }
    r.step.struct_size = 16;
    assert_int_equal(STEP(out, out, &r.step, 0, 1, q, v), PERP_ERROR_ABI);
    tabled_says(&r, "step.struct_size");
    for (i = 0; i < 5; i++)
        assert_true(out[i] == 7.0);
    assert_int_equal(r.calls[TABLED_MASS], 0);
    r.step.struct_size = sizeof r.step;
    assert_int_equal(STEP(out, out, &r.step, 0, 1, q, v), PERP_OK);
#undef STEP
    tabled_close(&r);
}

static void test_run_arguments(void **state)
{
    static const double ends[] = {1.0, 0.5, NAN, INFINITY, -INFINITY};
    static const double lengths[] = {0.0, -1.0, NAN, INFINITY, 1e-16};
    perp_mechanism_run_result result = fresh_mechanism_run_result();
    double q[TABLED_N] = {0}, v[TABLED_N] = {0}, out[TABLED_N] = {7, 7, 7, 7, 7};
    size_t i;
    tabled r;

    (void)state;
    tabled_make_everything(&r);
    tabled_open(&r);
#define RUN(a, b, result, t0, t1, h, c, d) \
    perp_mechanism_run(r.mechanism, a, b, result, START(t0, h, c, d), t1, NULL, NULL)
    assert_int_equal(perp_mechanism_run(NULL, out, out, &result, START(1, 1, q, v), 2, NULL, NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(RUN(NULL, out, &result, 1, 2, 1, q, v), PERP_ERROR_ARGUMENT);
    assert_int_equal(RUN(out, NULL, &result, 1, 2, 1, q, v), PERP_ERROR_ARGUMENT);
    assert_int_equal(RUN(out, out, NULL, 1, 2, 1, q, v), PERP_ERROR_ARGUMENT);
    tabled_says(&r, "result is NULL");
    assert_int_equal(RUN(out, out, &result, 1, 2, 1, NULL, v), PERP_ERROR_ARGUMENT);
    assert_int_equal(RUN(out, out, &result, 1, 2, 1, q, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(RUN(out, out, &result, NAN, 2, 1, q, v), PERP_ERROR_NOT_FINITE);
    tabled_says(&r, "t[0] is");
    for (i = 0; i < 5; i++) {
        assert_int_equal(RUN(out, out, &result, 1, ends[i], 1, q, v), PERP_ERROR_ARGUMENT);
        tabled_says(&r, "t1 is");
        assert_int_equal(RUN(out, out, &result, 1, 2, lengths[i], q, v), PERP_ERROR_ARGUMENT);
        tabled_says(&r, "h is");
    }
    q[0] = NAN;
    assert_int_equal(RUN(out, out, &result, 1, 2, 1, q, v), PERP_ERROR_NOT_FINITE);
    q[0] = 0.0;
    result.struct_size = 8;
    assert_int_equal(RUN(out, out, &result, 1, 2, 1, q, v), PERP_ERROR_ABI);
    for (i = 0; i < 5; i++)
        assert_true(out[i] == 7.0);
    result.struct_size = sizeof result;
    assert_int_equal(RUN(out, out, &result, 1, 2, 1, q, v), PERP_OK);
#undef RUN
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sizes),         cmocka_unit_test(test_missing_callbacks),
        cmocka_unit_test(test_coefficients),  cmocka_unit_test(test_settings),
        cmocka_unit_test(test_set),           cmocka_unit_test(test_life),
        cmocka_unit_test(test_words),         cmocka_unit_test(test_step_arguments),
        cmocka_unit_test(test_run_arguments),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

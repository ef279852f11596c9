/* Accelerations: what is refused, callbacks that fail, memory, and what stays of an answer. */
#include "found.h"

#include "memory.h"

/* Two corners of a box at rest in the plane: a family. */
static void make_box(table *s)
{
    static const double rows[4][3] = {{0, 1, -2}, {1, 0, 1}, {0, 1, 2}, {1, 0, 1}};
    int i;

    table_make(s, 3, 2, 2);
    for (i = 0; i < 4; i++)
        table_row(s->H, 3, i, rows[i]);
    s->k[0] = 0.1;
    s->k[1] = -1.0;
    s->mu[0] = s->mu[1] = 0.5;
}

static void says(const table *s, const char *text)
{
    if (!strstr(perp_context_message(s->context), text))
        fail_msg("'%s' does not say '%s'", perp_context_message(s->context), text);
}

static void refuse(table *s, perp_status status, const char *text)
{
    perp_mechanism_summary before = s->summary;

    assert_int_equal(perp_mechanism_accelerations(s->mechanism, &s->summary, s->t, s->q, s->v),
                     status);
    says(s, text);
    assert_memory_equal(&before, &s->summary, sizeof before);
    assert_int_equal(perp_mechanism_get_acceleration(s->mechanism, &s->found, 0),
                     PERP_ERROR_ARGUMENT); /* no answers are kept */
}

static void test_arguments(void **state)
{
    perp_mechanism_summary summary;
    table s;

    (void)state;
    make_box(&s);
    table_open(&s);
    assert_int_equal(perp_mechanism_get_acceleration(s.mechanism, &s.found, 0),
                     PERP_ERROR_ARGUMENT);
    says(&s, "perp_mechanism_accelerations");
    assert_int_equal(perp_mechanism_accelerations(NULL, &s.summary, 0, s.q, s.v),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_mechanism_get_acceleration(NULL, &s.found, 0), PERP_ERROR_HANDLE);
    assert_int_equal(perp_mechanism_accelerations(s.mechanism, NULL, 0, s.q, s.v),
                     PERP_ERROR_ARGUMENT);
    memset(&summary, 0, sizeof summary);
    assert_int_equal(perp_mechanism_accelerations(s.mechanism, &summary, 0, s.q, s.v),
                     PERP_ERROR_ABI);
    assert_int_equal(perp_mechanism_accelerations(s.mechanism, &s.summary, 0, NULL, s.v),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_accelerations(s.mechanism, &s.summary, 0, s.q, NULL),
                     PERP_ERROR_ARGUMENT);
    s.q[1] = (double)NAN;
    refuse(&s, PERP_ERROR_NOT_FINITE, "[1]");
    s.q[1] = 0.0;
    s.v[2] = (double)INFINITY;
    refuse(&s, PERP_ERROR_NOT_FINITE, "[2]");
    s.v[2] = 0.0;
    s.t = (double)NAN;
    refuse(&s, PERP_ERROR_NOT_FINITE, "t");
    s.t = 0.0;
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(perp_mechanism_get_acceleration(s.mechanism, &s.found, 1),
                     PERP_ERROR_ARGUMENT);
    says(&s, "index is 1");
    assert_int_equal(perp_mechanism_get_acceleration(s.mechanism, &s.found, -1),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_mechanism_get_acceleration(s.mechanism, NULL, 0), PERP_ERROR_ARGUMENT);
    table_get(&s, 0);
    s.M[0] = -1.0;
    refuse(&s, PERP_ERROR_ARGUMENT, "positive definite");
    table_close(&s);
}

static void test_words(void **state)
{
    int32_t k, j;

    (void)state;
    for (k = 0; k <= PERP_MECHANISM_STATIC_FRICTION; k++)
        for (j = 0; j < k; j++)
            assert_string_not_equal(perp_mechanism_reason_text(k), perp_mechanism_reason_text(j));
    assert_string_equal(perp_mechanism_reason_text(-1), "unknown reason");
    assert_string_equal(perp_mechanism_reason_text(k), "unknown reason");
}

/* ---- callbacks ------------------------------------------------------------------------------ */

static int32_t answer_of_curvature;
static double bias_of_curvature;

static int32_t curvature(double *bias, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    bias[3] = bias_of_curvature;
    return answer_of_curvature;
}

static int32_t curved(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                      void *user)
{
    const table *s = user;

    if (t != 0.0 && s->bound[0] > 0.0 && fabs(t) > s->bound[0])
        return 1; /* only near t = 0 */
    table_contacts(gap, H, drift, mu, t, q, user);
    H[0] = 3.0 * sin(q[0] / 3.0);
    drift[0] = exp(t) - 1.0;
    return 0;
}

static void test_callbacks(void **state)
{
    table s;

    (void)state;
    make_box(&s);
    s.model.curvature = curvature;
    table_open(&s);
    answer_of_curvature = -3;
    refuse(&s, PERP_ERROR_CALLBACK, "curvature callback returned -3");
    answer_of_curvature = 1;
    refuse(&s, PERP_ERROR_ARGUMENT, "outside");
    answer_of_curvature = 0;
    bias_of_curvature = (double)NAN;
    refuse(&s, PERP_ERROR_NOT_FINITE, "bias[3]");
    bias_of_curvature = 0.0;
    assert_int_equal(table_ask(&s), 1);
    table_close(&s);
}

/* Differences where the rows exist only near the state, and change with the time, too. */
static void test_differences(void **state)
{
    double reach;

    (void)state;
    for (reach = 0.0; reach < 2.0; reach = reach == 0.0 ? 1e-2 : 10 * reach) {
        table s;

        table_make(&s, 2, 1, 1);
        s.model.contact_rows = curved;
        s.H[1] = 1.0;
        s.k[1] = -5.0;
        s.v[0] = 2.0;
        s.bound[0] = reach;
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        /* d/dt (3 sin(q0 / 3)) v0 + exp(t) = v0^2 + 1 at q0 = t = 0 */
        table_near(table_get(&s, 0)->acceleration[1], -5.0, 1e-11, "it takes off");
        table_near(s.found.row_acceleration[0] + 5.0, 5.0, 1e-11, "0 + 5");
        table_close(&s);
    }
}

/* A sled of mass 2, of a body and what is tied to it: the body's contact carries 1 with mu = 0.3,
 * and the other is held by dry friction of 0.4. Where there are too many patterns the search finds
 * the same acceleration as all of them do, from rest and in motion. */
static void test_search_with_all_kinds(void **state)
{
    static const double pulls[] = {2.0, 0.5}, expected[] = {(2.0 - 0.3 - 0.4) / 2, 0.0};

    (void)state;
    for (int most = 0; most < 2; most++)
        for (int k = 0; k < 3; k++) {
            table s;

            table_make(&s, 3, 1, 2); /* x and y of the body, the other's x */
            s.model.bilateral = s.model.dry = 1;
            s.settings.most_patterns = most ? 1 << 20 : 1;
            s.H[1] = s.H[3] = 1.0;
            s.G[0] = s.B[2] = 1.0;
            s.G[2] = -1.0;
            s.mu[0] = 0.3;
            s.bound[0] = 0.4;
            s.k[0] = pulls[k % 2];
            s.k[1] = -1.0;
            s.v[0] = s.v[2] = k / 2;
            table_open(&s);
            assert_int_equal(table_ask(&s), 1);
            assert_int_equal(s.summary.exhaustive, most);
            for (int i = 0; i < 3; i += 2)
                table_near(table_get(&s, 0)->acceleration[i], expected[k % 2], 1e-14, "it");
            table_close(&s);
        }
}

/* ---- memory --------------------------------------------------------------------------------- */

/* A family, slips in a plane and the search: everything that takes memory. */
static void make_everything(table *s)
{
    int j, i;

    table_make(s, 6, 3, 3);
    for (j = 0; j < 3; j++) {
        const double x = cos(2.0 * j), y = sin(2.0 * j);
        const double rows[3][6] = {
            {0, 0, 1, y, -x, 0}, {1, 0, 0, 0, -0.3, -y}, {0, 1, 0, 0.3, 0, x}};

        for (i = 0; i < 3; i++)
            table_row(s->H, 6, 3 * j + i, rows[i]);
        s->mu[j] = 0.4;
    }
    s->k[0] = 0.8;
    s->k[2] = -2.0;
    s->settings.directions = 4;
    s->settings.starts = 2;
}

static void check_memory(table *s)
{
    int32_t expected = -1;
    int k;

    for (k = 0;; k++) { /* k = 0: nothing fails */
        memory m = {0};
        perp_context_settings settings = memory_settings(&m);
        perp_status status;
        int before;

        assert_int_equal(perp_context_create(&s->context, &settings), PERP_OK);
        assert_int_equal(perp_mechanism_create(s->context, &s->mechanism, &s->settings, &s->model),
                         PERP_OK);
        before = m.calls;
        m.fails_at = k > 0 ? before + k : 0;
        status = perp_mechanism_accelerations(s->mechanism, &s->summary, 0, s->q, s->v);
        if (k > 0 && m.calls < before + k) { /* the call was not reached */
            assert_int_equal(status, PERP_OK);
            table_close(s);
            assert_int_equal(m.live, 0);
            break;
        }
        assert_int_equal(status, k == 0 ? PERP_OK : PERP_ERROR_MEMORY);
        m.fails_at = 0;
        if (k == 0)
            expected = s->summary.count;
        else
            assert_int_equal(perp_mechanism_get_acceleration(s->mechanism, &s->found, 0),
                             PERP_ERROR_ARGUMENT);
        assert_int_equal(table_ask(s), expected); /* the handle is as good as before */
        table_close(s);
        assert_int_equal(m.live, 0);
    }
    assert_true(k > 3);
}

static void test_memory(void **state)
{
    table s;

    (void)state;
    make_box(&s);
    check_memory(&s);
    make_everything(&s);
    check_memory(&s);
    s.settings.most_patterns = 2;
    check_memory(&s);
}

/* The same question gives the same bits, whatever was asked in between. */
static void test_repeat(void **state)
{
    double first[12], width;
    table s;
    int i;

    (void)state;
    make_everything(&s);
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    memcpy(first, table_get(&s, 0)->force, 9 * sizeof *first);
    width = s.found.acceleration[0];
    s.k[0] = 0.1;
    table_ask(&s);
    s.k[0] = 0.8;
    assert_int_equal(table_ask(&s), 1);
    assert_memory_equal(first, table_get(&s, 0)->force, 9 * sizeof *first);
    assert_true(width == s.found.acceleration[0]);
    for (i = 0; i < 3; i++) /* slides: 0.8 > 0.4 of 2.0 fails, so it is at the limit */
        assert_int_equal(s.found.modes[i], PERP_MECHANISM_STICK);
    table_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arguments),
        cmocka_unit_test(test_words),
        cmocka_unit_test(test_callbacks),
        cmocka_unit_test(test_differences),
        cmocka_unit_test(test_search_with_all_kinds),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_repeat),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

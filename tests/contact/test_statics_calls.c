/* Calls of perp_contact_statics and perp_world_statics that go wrong: refusals name the argument
 * and write nothing, and every allocation may fail. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "memory.h"
#include "refused.h"

/* A box on four corners, pushed by 1 along x. */
typedef struct question {
    double H[12][6], mu[4], f[6], load[6];
    perp_contact_laws laws;
    perp_matrix view;
    perp_statics_problem problem;
    perp_statics_settings settings;
    perp_statics_result result;
    double r[12], v[6];
} question;

static void pose(question *q)
{
    memset(q, 0, sizeof *q);
    for (int k = 0; k < 4; k++) {
        const double x = k & 1 ? 1.0 : -1.0, y = k & 2 ? 1.0 : -1.0;
        const double rows[3][6] = {{0, 0, 1, y, -x, 0}, {1, 0, 0, 0, -1, -y}, {0, 1, 0, 1, 0, x}};

        memcpy(q->H[3 * k], rows, sizeof rows);
        q->mu[k] = 0.5;
    }
    q->f[2] = -10.0;
    q->load[0] = 1.0;
    assert_int_equal(perp_contact_laws_init(&q->laws, sizeof q->laws), PERP_OK);
    q->view = matrix_rows(q->H[0], 12, 6);
    assert_int_equal(perp_struct_init(&q->problem, sizeof q->problem), PERP_OK);
    assert_int_equal(perp_struct_init(&q->settings, sizeof q->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&q->result, sizeof q->result), PERP_OK);
    q->laws.contacts = 4;
    q->laws.mu = q->mu;
    q->problem.n = 6;
    q->problem.laws = &q->laws;
    q->problem.H = &q->view;
    q->problem.f = q->f;
    q->problem.load = q->load;
    for (int i = 0; i < 12; i++)
        q->r[i] = 7.0;
    for (int i = 0; i < 6; i++)
        q->v[i] = 7.0;
    q->result.margin = 7.0;
}

/* The status, a word of the message, nothing written; and the next call is as good as ever. */
static void refuse(perp_context *context, question *q, perp_status expected, const char *word,
                   const char *changes)
{
    question good;

    refused(context,
            perp_contact_statics(context, q->r, q->v, &q->result, &q->problem, &q->settings),
            expected, word, changes);
    for (int i = 0; i < 12; i++)
        assert_true(q->r[i] == 7.0);
    for (int i = 0; i < 6; i++)
        assert_true(q->v[i] == 7.0);
    pose(&good);
    assert_int_equal(
        perp_contact_statics(context, good.r, good.v, &good.result, &good.problem, &good.settings),
        PERP_OK);
    assert_int_equal(good.result.verdict, PERP_STATICS_STANDS);
    assert_true(fabs(good.result.safety - 5.0) <= 5e-8); /* mu m g = 5; it tips at 10 */
}

/* That is what these changes of a good question make of it. */
#define REFUSED(status, word, ...)                       \
    do {                                                 \
        pose(&q);                                        \
        __VA_ARGS__;                                     \
        refuse(context, &q, status, word, #__VA_ARGS__); \
    } while (0)

static void test_refusals(void **state)
{
    const double lower[] = {1.0}, upper[] = {0.0};
    const int32_t two_sided[] = {0, 1, 0, 0};
    const double r0[12] = {1.0, 0.0, 0.0, 0.0, 2.0, 2.0, 1.0}; /* of contact 1: no normal */
    const double not_finite[12] = {0.0, INFINITY};
    perp_context *context;
    question q;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    REFUSED(ARGUMENT, "H", q.problem.n = 5);
    REFUSED(ARGUMENT, "n is -1", q.problem.n = -1);
    REFUSED(ARGUMENT, "reserved", q.problem.reserved = 1);
    REFUSED(ARGUMENT, "laws", q.problem.laws = NULL);
    REFUSED(ARGUMENT, "H", q.problem.H = NULL);
    REFUSED(ARGUMENT, "f", q.problem.f = NULL);
    REFUSED(NOT_FINITE, "f[3]", q.f[3] = NAN);
    REFUSED(NOT_FINITE, "load[4]", q.load[4] = INFINITY);
    REFUSED(NOT_FINITE, "H", q.H[7][2] = NAN);
    REFUSED(ARGUMENT, "mu[2]", q.mu[2] = -0.5);
    REFUSED(ARGUMENT, "two_sided[1] is 1, and r0 does not tell", q.laws.two_sided = two_sided);
    REFUSED(ARGUMENT, "two_sided[1] is 1, and r0 does not tell", q.laws.two_sided = two_sided;
            q.problem.r0 = r0);
    REFUSED(NOT_FINITE, "r0[1]", q.problem.r0 = not_finite);
    REFUSED(ARGUMENT, "lower[0]", q.laws.bounded = 1; q.laws.lower = lower; q.laws.upper = upper);
    REFUSED(ARGUMENT, "objective", q.settings.objective = 2);
    REFUSED(ARGUMENT, "max_iterations", q.settings.max_iterations = -1);
    REFUSED(ABI, "problem", q.problem.struct_size = 3);
    REFUSED(ABI, "result", q.result.struct_size = 3);
    pose(&q);
    assert_int_equal(perp_contact_statics(context, q.r, q.v, NULL, &q.problem, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_statics(context, q.r, q.v, &q.result, NULL, NULL),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_statics(NULL, q.r, q.v, &q.result, &q.problem, NULL),
                     PERP_ERROR_HANDLE);
    perp_context_destroy(context);
}

/* No contacts, no velocities, nobody who wants to know more than the verdict. */
static void test_nothing(void **state)
{
    perp_context *context;
    question q;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    pose(&q);
    q.laws.contacts = 0;
    q.problem.H = NULL;
    assert_int_equal(perp_contact_statics(context, NULL, NULL, &q.result, &q.problem, NULL),
                     PERP_OK);
    assert_int_equal(q.result.verdict, PERP_STATICS_FALLS);
    q.problem.n = 0;
    assert_int_equal(perp_contact_statics(context, NULL, NULL, &q.result, &q.problem, NULL),
                     PERP_OK);
    assert_int_equal(q.result.verdict, PERP_STATICS_STANDS);
    perp_context_destroy(context);
}

static void test_words(void **state)
{
    (void)state;
    assert_string_equal(perp_statics_verdict_text(PERP_STATICS_STANDS), "stands");
    assert_string_equal(perp_statics_verdict_text(PERP_STATICS_FALLS), "falls");
    assert_string_equal(perp_statics_verdict_text(PERP_STATICS_INDETERMINATE), "indeterminate");
    assert_string_equal(perp_statics_verdict_text(3), "unknown verdict");
    assert_string_equal(perp_statics_verdict_text(-1), "unknown verdict");
}

/* Matrices that are none: columns of G, rows of a column that are not sorted or outside. */
static void test_matrices(void **state)
{
    static const int32_t starts[] = {0, 2, 2, 2, 2, 2, 2}, sorted[] = {1, 0}, outside[] = {0, 12};
    static const double values[12] = {1.0, 1.0};
    perp_context *context;
    perp_matrix other;
    question q;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    other = matrix_rows(values, 1, 5);
    REFUSED(ARGUMENT, "G is 1 by 5, expected 1 by 6", q.problem.G = &other);
    REFUSED(ARGUMENT, "H is 1 by 5, expected 12 by 6", q.problem.H = &other);
    assert_int_equal(perp_matrix_csc(&other, 12, 6, starts, sorted, values), PERP_OK);
    REFUSED(ARGUMENT, "H", q.problem.H = &other);
    assert_int_equal(perp_matrix_csc(&other, 12, 6, starts, outside, values), PERP_OK);
    REFUSED(ARGUMENT, "H", q.problem.H = &other);
    perp_context_destroy(context);
}

/* Contexts know nothing of each other: an answer is the same in each, a refusal stays where it was.
 */
static void test_two_contexts(void **state)
{
    perp_context *contexts[2];
    question q[2];
    int k;

    (void)state;
    for (k = 0; k < 2; k++) {
        assert_int_equal(perp_context_create(&contexts[k], NULL), PERP_OK);
        pose(&q[k]);
    }
    q[1].f[0] = NAN;
    for (k = 0; k < 2; k++)
        assert_int_equal(
            perp_contact_statics(contexts[k], q[k].r, q[k].v, &q[k].result, &q[k].problem, NULL),
            k ? PERP_ERROR_NOT_FINITE : PERP_OK);
    assert_string_equal(perp_context_message(contexts[0]), "");
    assert_non_null(strstr(perp_context_message(contexts[1]), "f[0]"));
    pose(&q[1]);
    assert_int_equal(
        perp_contact_statics(contexts[1], q[1].r, q[1].v, &q[1].result, &q[1].problem, NULL),
        PERP_OK);
    assert_memory_equal(q[0].r, q[1].r, sizeof q[0].r);
    for (k = 0; k < 2; k++)
        perp_context_destroy(contexts[k]);
}

static void test_every_allocation_may_fail(void **state)
{
    int k = 0, failed;

    (void)state;
    do {
        memory m = {.fails_at = ++k};
        const perp_context_settings settings = memory_settings(&m);
        perp_context *context;
        perp_status status = perp_context_create(&context, &settings);
        question q;

        failed = status == PERP_ERROR_MEMORY;
        if (failed)
            continue;
        pose(&q);
        status = perp_contact_statics(context, q.r, q.v, &q.result, &q.problem, NULL);
        failed = status == PERP_ERROR_MEMORY;
        if (failed) {
            assert_true(q.r[0] == 7.0 && q.v[0] == 7.0 && q.result.margin == 7.0);
            status = perp_contact_statics(context, q.r, q.v, &q.result, &q.problem, NULL);
        }
        assert_int_equal(status, PERP_OK);
        assert_int_equal(q.result.verdict, PERP_STATICS_STANDS);
        perp_context_destroy(context);
        assert_int_equal(m.live, 0);
    } while (failed);
    assert_true(k > 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),     cmocka_unit_test(test_matrices),
        cmocka_unit_test(test_nothing),      cmocka_unit_test(test_words),
        cmocka_unit_test(test_two_contexts), cmocka_unit_test(test_every_allocation_may_fail),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

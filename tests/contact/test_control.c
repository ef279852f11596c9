/* Limits, the monitor, starts, other loads on one set-up, determinism. */
#include <math.h>

#include "suite.h"

#include "hand_over.h"

#include "context.h"

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO, PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON, PERP_CONTACT_METHOD_LEMKE};

enum { METHODS = sizeof methods / sizeof *methods };

typedef struct watch {
    int calls;
    int32_t answer;
    int64_t last;
} watch;

static int32_t look(const perp_contact_progress *progress, void *user)
{
    watch *w = user;

    assert_int_equal(progress->struct_size, sizeof *progress);
    assert_true(progress->method >= PERP_CONTACT_METHOD_SWEEP &&
                progress->method <= PERP_CONTACT_METHOD_PROXIMAL);
    assert_true(progress->residual >= 0.0);
    w->last = progress->iterations;
    w->calls++;
    return w->answer;
}

/* What stopped has the best iterate's true residual; an abort writes nothing. */
static void test_monitor(void **state)
{
    int32_t m;

    (void)state;
    for (m = 0; m < METHODS; m++) {
        watch w = {0, 0, 0};
        hand_over p;

        hand_make(&p, 11, 20, 6, 3, 1, 1.0);
        p.settings.method = methods[m];
        p.settings.tol = 1e-13;
        p.settings.monitor = look;
        p.settings.monitor_user = &w;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        assert_true(w.calls > 0);
        w.calls = 0;
        w.answer = 1;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_int_equal(w.calls, 1);
        if (p.result.outcome > PERP_OUTCOME_ROUNDING_LIMIT)
            assert_int_equal(p.result.outcome, PERP_OUTCOME_STOPPED);
        assert_true(isfinite(p.result.residual));
        w.answer = -1;
        p.result.outcome = 77;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_ERROR_CALLBACK);
        assert_int_equal(p.result.outcome, 77);
        assert_string_equal(perp_context_message(context), "the monitor asked to abort");
    }
}

/* A limit that has passed before the first iteration, and one iteration. */
static void test_limits(void **state)
{
    int32_t m;

    (void)state;
    for (m = 0; m < METHODS; m++) {
        hand_over p;

        hand_make(&p, 12, 20, 8, 3, 0, 1.0);
        p.settings.method = methods[m];
        p.settings.tol = 1e-15; /* rounding is 1e-16 times numbers of order 10: out of reach */
        p.settings.time_limit = 1e-9;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_true(p.result.outcome == PERP_OUTCOME_TIME_LIMIT ||
                    p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
        assert_true(isfinite(p.result.residual));
        p.settings.time_limit = 0.0;
        p.settings.max_iterations = 1;
        p.settings.method = PERP_CONTACT_METHOD_SWEEP;
        assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
        assert_true(p.result.outcome != PERP_OUTCOME_TIME_LIMIT && p.result.iterations <= 1);
    }
}

/* The answer as a start is the answer, and costs nothing; a start outside the cones is projected.
 */
static void test_starts(void **state)
{
    hand_over p;
    double start[HAND_SIZE];
    int32_t i;

    (void)state;
    hand_make(&p, 13, 24, 6, 3, 2, 1.0);
    assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
    memcpy(start, p.r, sizeof start);
    assert_int_equal(hand_solve(&p, context, start), PERP_OK);
    assert_int_equal(p.result.method, PERP_CONTACT_METHOD_POLISH);
    assert_int_equal(p.result.outcome, PERP_OUTCOME_SOLVED);
    for (i = 0; i < p.size; i++)
        start[i] = 1e3 * (i % 5 - 2);
    assert_int_equal(hand_solve(&p, context, start), PERP_OK);
    assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
    assert_true(hand_violation(&p) <= 1e-5); /* 1e-8 of sizes up to 1e3 */
}

/* A set-up serves many loads, with the bits of a solver of their own. */
static void test_loads_and_determinism(void **state)
{
    int32_t m, round, i;

    (void)state;
    for (m = 0; m < METHODS; m++) {
        perp_contact_solver *solver;
        hand_over p, once;

        hand_make(&p, 14, 20, 6, 0, 1, 1.0);
        p.settings.method = methods[m];
        assert_int_equal(perp_contact_solver_create(context, &solver, &p.settings), PERP_OK);
        assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics), PERP_OK);
        for (round = 0; round < 5; round++) {
            for (i = 0; i < p.n; i++)
                p.f[i] = sin(3.0 * i + round);
            assert_int_equal(
                perp_contact_solver_solve_dynamics(solver, ANSWER(p.v, p.r, p.u, p.modes, p.ray),
                                                   &p.result, p.f, p.w, p.b, NULL),
                PERP_OK);
            assert_true(p.result.outcome <= PERP_OUTCOME_ROUNDING_LIMIT);
            once = p;
            hand_views(&once);
            once.settings = p.settings;
            assert_int_equal(hand_solve(&once, context, NULL), PERP_OK);
            assert_memory_equal(once.r, p.r, (size_t)p.size * sizeof(double));
            assert_memory_equal(once.u, p.u, (size_t)p.size * sizeof(double));
            assert_memory_equal(once.v, p.v, (size_t)p.n * sizeof(double));
        }
        perp_contact_solver_destroy(solver);
    }
}

/* Nothing to solve: no contacts, no velocities, contacts that are all open. */
static void test_empty(void **state)
{
    hand_over p;
    int32_t i;

    (void)state;
    hand_make(&p, 15, 6, 2, 3, 0, 1.0);
    for (i = 0; i < p.n; i++)
        p.f[i] = 0.0;
    for (i = 0; i < p.contacts; i++)
        p.w[p.starts[i]] = 1.0;
    assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
    assert_int_equal(p.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(p.result.residual == 0.0 && p.result.backward_error == 0.0);
    for (i = 0; i < p.rows; i++)
        assert_true(p.r[i] == 0.0 && p.u[i] == p.w[i]);
    p.contacts = p.rows = p.size = p.n = 0;
    hand_views(&p);
    p.M_view.leading_dimension = p.H_view.leading_dimension = 1;
    assert_int_equal(hand_solve(&p, context, NULL), PERP_OK);
    assert_int_equal(p.result.outcome, PERP_OUTCOME_SOLVED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_monitor), cmocka_unit_test(test_limits),
        cmocka_unit_test(test_starts),  cmocka_unit_test(test_loads_and_determinism),
        cmocka_unit_test(test_empty),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

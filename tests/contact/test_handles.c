/* The life of a contact solver: handles, calls in the wrong order, callbacks that call back. */
#include <math.h>
#include <stdio.h>

#include "suite.h"

#include "hand_over.h"

#include "context.h"

static void require_refused(perp_status found, perp_status expected, const char *words)
{
    assert_int_equal(found, expected);
    if (!strstr(perp_context_message(context), words))
        fail_msg("message '%s' without '%s'", perp_context_message(context), words);
}

static int32_t reenter(const perp_contact_progress *progress, void *user)
{
    perp_contact_solver *solver = *(perp_contact_solver **)user;

    (void)progress;
    assert_int_equal(perp_contact_solver_set(solver, NULL), PERP_ERROR_BUSY);
    perp_contact_solver_destroy(solver); /* ignored */
    return -1;
}

static void test_handles(void **state)
{
    perp_contact_solver *solver = NULL, *const none = NULL;
    perp_contact_settings settings;
    hand_over p;

    (void)state;
    hand_make(&p, 3, 5, 2, 3, 1, 1.0);
    assert_int_equal(perp_contact_solver_create(NULL, &solver, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_create(context, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_set(none, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_setup_delassus(none, NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_setup_dynamics(none, NULL, NULL), PERP_ERROR_HANDLE);
    perp_contact_solver_destroy(NULL);
    settings = p.settings;
    settings.tol = 1e-14;
    settings.monitor = reenter;
    settings.monitor_user = &solver;
    assert_int_equal(perp_contact_solver_create(context, &solver, &settings), PERP_OK);
    require_refused(perp_contact_solver_solve_dynamics(solver, ANSWER(NULL, p.r), &p.result, p.f,
                                                       p.w, p.b, NULL),
                    PERP_ERROR_ARGUMENT, "the solver has no problem");
    require_refused(perp_contact_solver_setup_dynamics(solver, &p.laws, NULL), PERP_ERROR_ARGUMENT,
                    "dynamics is NULL");
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics), PERP_OK);
    require_refused(
        perp_contact_solver_solve_delassus(solver, ANSWER(NULL, p.r), &p.result, p.f, NULL),
        PERP_ERROR_ARGUMENT, "set up with dynamics");
    require_refused(perp_contact_solver_solve_dynamics(solver, ANSWER(NULL, p.r), &p.result, p.f,
                                                       p.w, p.b, NULL),
                    PERP_ERROR_CALLBACK, "abort");
    assert_int_equal(perp_contact_solver_set(solver, NULL), PERP_OK);
    p.mu[0] = -1.0; /* a setup that is refused leaves the problem that was there */
    assert_int_equal(perp_contact_solver_setup_dynamics(solver, &p.laws, &p.dynamics),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_solve_dynamics(solver, ANSWER(NULL, p.r), &p.result, p.f,
                                                        p.w, p.b, NULL),
                     PERP_OK);
    perp_contact_solver_destroy(solver);
}

static void test_words(void **state)
{
    (void)state;
    assert_string_equal(perp_contact_method_text(PERP_CONTACT_METHOD_SWEEP), "sweep");
    assert_string_equal(perp_contact_method_text(PERP_CONTACT_METHOD_PROXIMAL), "proximal");
    assert_string_equal(perp_contact_method_text(7), "unknown method");
    assert_string_equal(perp_contact_method_text(-1), "unknown method");
    assert_string_equal(perp_contact_mode_text(PERP_CONTACT_SLIP), "slip");
    assert_string_equal(perp_contact_mode_text(PERP_CONTACT_UPPER), "upper");
    assert_string_equal(perp_contact_mode_text(5), "unknown mode");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_handles),
        cmocka_unit_test(test_words),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

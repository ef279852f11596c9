/* perp_contact_solver_step: what it refuses, arguments, places, sizes, numbers and memory. A
 * refused step touches no part of an answer, and the next one is as good as before. */
#include "suite.h"

#include "memory.h"
#include "step_block.h"

static void test_what_is_missing(void **state)
{
    block *b = *state;
    const struct {
        void *field;
        const char *message;
    } needed[] = {
        {&b->step.mass, "step.mass is NULL"},
        {&b->step.mass_sources, "step.mass_sources is NULL"},
        {&b->step.mass_diagonal, "step.mass_diagonal is NULL"},
        {&b->step.velocity, "step.velocity is NULL"},
        {&b->step.force, "step.force is NULL"},
        {&b->step.J, "step.J is NULL"},
        {&b->at_J, "*step.J is NULL"},
        {&b->step.gaps, "step.gaps is NULL"},
        {&b->at_gaps, "*step.gaps is NULL"},
        {&b->step.H_sources, "step.H_sources is NULL"},
        {&b->step.gap_rows, "step.gap_rows is NULL"},
        {&b->step.gap_sources, "step.gap_sources is NULL"},
        {&b->step.H_rows, "step.H_rows is NULL"},
        {&b->step.M, "step.M is NULL"},
        {&b->step.H, "step.H is NULL"},
        {&b->step.f, "step.f is NULL"},
        {&b->step.w, "step.w is NULL"},
        {&b->step.v, "step.v is NULL"},
        {&b->step.r, "step.r is NULL"},
        {&b->step.start, "step.start is NULL"},
        {&b->step.modes, "step.modes is NULL"},
        {&b->step.acceleration, "step.acceleration is NULL"},
        {&b->step.force_of_rows, "step.force_of_rows is NULL"},
    };

    rest(b);
    for (size_t k = 0; k < sizeof needed / sizeof *needed; k++) {
        void *was, *none = NULL;

        memcpy(&was, needed[k].field, sizeof was);
        memcpy(needed[k].field, &none, sizeof none);
        require_refused(b, PERP_ERROR_ARGUMENT, needed[k].message);
        memcpy(needed[k].field, &was, sizeof was);
        require_usable(b);
    }
}

static int32_t mass_solve(double *x, int32_t columns, void *user)
{
    const double *mass = user;

    for (int32_t i = 0; i < columns * N; i++)
        x[i] /= mass[i % N == 2 ? 3 : 0];
    return 0;
}

/* f = M v + h force takes an M. */
static void test_a_callback_is_no_mass(void **state)
{
    block *b = *state;

    rest(b);
    b->dynamics.M = NULL, b->dynamics.solve = mass_solve, b->dynamics.user = b->mass;
    b->step.rests = 0;
    require_refused(b, PERP_ERROR_ARGUMENT, "perp_contact_solver_step with an M");
    b->dynamics.M = &b->views[0], b->dynamics.solve = NULL, b->dynamics.user = NULL;
    require_usable(b);
}

static void test_places_out_of_range(void **state)
{
    static const int32_t bad[] = {-1, INT32_MIN, 3, INT32_MAX};
    block *b = *state;
    int32_t gap_row = 0, gap_source = 3, rows[3] = {3, 2, 0}, diagonals[N] = {0, 4, 8};
    int32_t sources[3 * N];

    memcpy(sources, H_sources, sizeof sources);
    b->step.gap_rows = &gap_row, b->step.gap_sources = &gap_source, b->step.H_rows = rows;
    b->step.H_sources = sources, b->step.mass_diagonal = diagonals;
    rest(b);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        gap_row = bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.gap_rows[0] is");
        gap_row = 0;
        gap_source = bad[k] == 3 ? 4 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.gap_sources[0] is");
        gap_source = 3;
        rows[2] = bad[k] == 3 ? 4 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.H_rows[2] is");
        rows[2] = 0;
        diagonals[1] = bad[k] == 3 ? 9 : bad[k];
        require_refused(b, PERP_ERROR_ARGUMENT, "step.mass_diagonal[1] is");
        diagonals[1] = 4;
        if (bad[k] < 0) { /* nobody told how long J is */
            sources[4] = bad[k];
            require_refused(b, PERP_ERROR_ARGUMENT, "step.H_sources[4] is");
            sources[4] = H_sources[4];
        }
        require_usable(b);
    }
    diagonals[1] = 0;
    require_refused(b, PERP_ERROR_ARGUMENT, "expected more than the one before");
    diagonals[1] = 4;
    require_usable(b);
}

static void test_sizes_that_do_not_fit(void **state)
{
    block *b = *state;
    const struct {
        int32_t *field, value;
        const char *message;
    } wrong[] = {
        {&b->step.n, 2, "step.n is 2, but laws and dynamics have 3"},
        {&b->step.contacts, 2, "step.contacts is 2, but laws and dynamics have 1"},
        {&b->step.rows, 2, "step.rows is 2, but laws and dynamics have 3"},
        {&b->step.contacts, 0, "step.contacts is 0, but laws and dynamics have 1"},
        {&b->step.rows, -1, "step has a count below 0"},
        {&b->step.M_entries, -1, "step has a count below 0"},
        {&b->step.watch_count, -1, "step has a count below 0"},
        {&b->step.watch_count, 1, "step.watches is NULL"},
        {&b->step.bilateral, 1, "step.G_rows is NULL"},
        {&b->dynamics.n, 2, "M is 3 by 3, expected 2 by 2"},
        {&b->laws.contacts, 2, ""},
    };

    rest(b);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const int32_t was = *wrong[k].field;

        *wrong[k].field = wrong[k].value;
        b->step.rests = 0;
        require_refused(b, PERP_ERROR_ARGUMENT, wrong[k].message);
        *wrong[k].field = was;
        require_usable(b);
    }
    b->step.h = 0.0;
    require_refused(b, PERP_ERROR_ARGUMENT, "step.h is 0, expected a time > 0");
    b->step.h = NAN;
    require_refused(b, PERP_ERROR_ARGUMENT, "step.h is ");
    b->step.h = H_STEP;
    require_usable(b);
}

static void test_numbers_that_are_none(void **state)
{
    static const double none[] = {NAN, INFINITY, -INFINITY};
    block *b = *state;
    double *numbers[] = {&b->mass[1], &b->mass[3], &b->velocity[2], &b->force[0],  &b->J[11],
                         &b->J[6],    &b->gaps[3], &b->scale[0],    &b->damping[1]};

    b->dynamics.M = &b->views[0];
    rest(b);
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
            const double was = *numbers[k];

            if (numbers[k] == &b->gaps[3] && none[i] < 0.0)
                continue; /* deep: no velocity */
            *numbers[k] = none[i];
            require_refused(b, PERP_ERROR_NOT_FINITE, "");
            *numbers[k] = was;
            require_usable(b);
        }
    b->r[1] = NAN;
    assert_int_equal(perp_contact_solver_hand_back(b->solver, &b->step), PERP_ERROR_NOT_FINITE);
    assert_string_equal(perp_context_message(b->context), "step.r[1] is nan");
}

/* Each allocation of a first step, and of one that needs more room, fails once. */
static void test_memory_runs_out(void **state)
{
    block *b = *state;
    memory m = {0, 0, 0};
    perp_context_settings settings = memory_settings(&m);
    answer untouched;
    double shift[N];
    int k;

    b->step.shift = shift, b->gaps[3] = -0.01;
    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    assert_int_equal(perp_context_create(&b->context, &settings), PERP_OK);
    for (k = 1;; k++) {
        answer after;
        perp_status status;

        assert_int_equal(perp_contact_solver_create(b->context, &b->solver, NULL), PERP_OK);
        b->force[0] = 4.0, b->row_force[1] = 0.0, b->step.rests = 0, b->step.warm = 1;
        memset(b->start, 0, sizeof b->start);
        untouched = answer_of(b);
        m.calls = 0, m.fails_at = k;
        status = try_step(b);
        m.fails_at = 0;
        if (status == PERP_OK) {
            require_usable(b);
            break;
        }
        assert_int_equal(status, PERP_ERROR_MEMORY);
        assert_string_not_equal(perp_context_message(b->context), "");
        after = answer_of(b);
        assert_memory_equal(&after, &untouched, sizeof after);
        require_usable(b);
        perp_contact_solver_destroy(b->solver);
    }
    assert_true(k > 3);
    perp_contact_solver_destroy(b->solver);
    perp_context_destroy(b->context); /* whose memory ends here */
    b->solver = NULL, b->context = NULL;
}

static void test_who_may_not_be_asked(void **state)
{
    block *b = *state;

    assert_int_equal(perp_contact_solver_hand_back(b->solver, &b->step), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_step(NULL, &b->step, &b->result, &b->laws, &b->dynamics),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_hand_back(NULL, &b->step), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solver_step(b->solver, NULL, &b->result, &b->laws, &b->dynamics),
                     PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_contact_solver_hand_back(b->solver, NULL), PERP_ERROR_ARGUMENT);
    b->step.struct_size = 8;
    assert_int_equal(try_step(b), PERP_ERROR_ABI);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_what_is_missing),       TEST(test_a_callback_is_no_mass),
        TEST(test_places_out_of_range),   TEST(test_sizes_that_do_not_fit),
        TEST(test_numbers_that_are_none), TEST(test_memory_runs_out),
        TEST(test_who_may_not_be_asked),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

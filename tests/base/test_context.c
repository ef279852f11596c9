/* The context: allocator, log, message, life with and after its children. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "base/context.h"

typedef struct counter {
    int live, calls;
    int refuse; /* from now on */
} counter;

static void *count_allocate(size_t size, void *user)
{
    counter *c = user;

    c->calls++;
    if (c->refuse)
        return NULL;
    c->live++;
    return malloc(size);
}

static void count_release(void *pointer, void *user)
{
    counter *c = user;

    assert_non_null(pointer); /* release is never asked to release nothing */
    c->live--;
    free(pointer);
}

static perp_context_settings counted(counter *c)
{
    perp_context_settings settings;

    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = count_allocate;
    settings.release = count_release;
    settings.allocator_user = c;
    return settings;
}

static void test_defaults(void **state)
{
    perp_context *context = NULL;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_non_null(context);
    assert_string_equal(perp_context_message(context), "");
    perp_context_destroy(context);
    perp_context_destroy(NULL);
}

static void test_own_allocator_gets_everything_back(void **state)
{
    counter c = {0, 0, 0};
    perp_context_settings settings = counted(&c);
    perp_context *context;

    (void)state;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    assert_int_equal(c.calls, 1); /* base.h: creation is one allocation */
    perp_context_destroy(context);
    assert_int_equal(c.live, 0);
}

static void test_refusals_leave_the_handle_alone(void **state)
{
    perp_context *const sentinel = (perp_context *)(void *)&state;
    perp_context *context = sentinel;
    counter c = {0, 0, 1};
    perp_context_settings settings = counted(&c);

    (void)state;
    assert_int_equal(perp_context_create(NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp_context_create(&context, &settings), PERP_ERROR_MEMORY);
    settings.release = NULL; /* both or neither */
    assert_int_equal(perp_context_create(&context, &settings), PERP_ERROR_ARGUMENT);
    settings = counted(&c);
    settings.allocate = NULL;
    assert_int_equal(perp_context_create(&context, &settings), PERP_ERROR_ARGUMENT);
    settings = counted(&c);
    settings.struct_size = 0;
    assert_int_equal(perp_context_create(&context, &settings), PERP_ERROR_ABI);
    assert_ptr_equal(context, sentinel);
    assert_int_equal(c.live, 0);
}

static void test_solvers_keep_the_context_alive(void **state)
{
    counter c = {0, 0, 0};
    perp_context_settings settings = counted(&c);
    perp_context *context;
    perp_lcp_solver *first, *second;

    (void)state;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(context, &first, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(context, &second, NULL), PERP_OK);
    perp_context_destroy(context);
    assert_true(c.live > 0);
    perp_lcp_solver_destroy(first);
    assert_true(c.live > 0);
    perp_lcp_solver_destroy(second);
    assert_int_equal(c.live, 0);
}

static void test_a_destroyed_context_makes_no_more_solvers(void **state)
{
    perp_context *context;
    perp_lcp_solver *solver, *const sentinel = (perp_lcp_solver *)(void *)&state;
    perp_lcp_solver *none = sentinel;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    perp_context_destroy(context);
    perp_context_destroy(context); /* harmless while a solver keeps the memory */
    assert_int_equal(perp_lcp_solver_create(context, &none, NULL), PERP_ERROR_HANDLE);
    assert_ptr_equal(none, sentinel);
    assert_string_equal(perp_context_message(context), "");
    perp_lcp_solver_destroy(solver);
}

static void test_what_is_not_a_context_is_refused(void **state)
{
    double memory[64] = {0};
    perp_lcp_solver *solver;

    (void)state;
    assert_int_equal(perp_lcp_solver_create(NULL, &solver, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_solver_create((perp_context *)(void *)memory, &solver, NULL),
                     PERP_ERROR_HANDLE);
    assert_string_equal(perp_context_message(NULL), "");
    assert_string_equal(perp_context_message((perp_context *)(void *)memory), "");
}

typedef struct log_lines {
    int count;
    char last[256];
} log_lines;

static void keep_line(const char *message, void *user)
{
    log_lines *lines = user;

    lines->count++;
    snprintf(lines->last, sizeof lines->last, "%s", message);
}

static void test_messages_come_and_go(void **state)
{
    perp_context_settings settings;
    perp_context *context;
    perp_lcp_solver *solver;
    log_lines lines = {0, ""};

    (void)state;
    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.log = keep_line;
    settings.log_user = &lines;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(context, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "solver"));
    assert_string_equal(lines.last, perp_context_message(context));
    assert_null(strchr(lines.last, '\n'));
    assert_int_equal(perp_lcp_solver_create(context, &solver, NULL), PERP_OK);
    assert_string_equal(perp_context_message(context), "");
    perp_lcp_solver_destroy(solver);
    perp_context_destroy(context);
}

static void test_long_messages_are_cut(void **state)
{
    perp_context *context;
    char text[2 * PERP__MESSAGE_SIZE];

    (void)state;
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__fail(context, PERP_ERROR_ARGUMENT, "%s", text), PERP_ERROR_ARGUMENT);
    assert_int_equal(strlen(perp_context_message(context)), PERP__MESSAGE_SIZE - 1);
    assert_int_equal(perp__fail(NULL, PERP_ERROR_MEMORY, "nobody listens"), PERP_ERROR_MEMORY);
    perp_context_destroy(context);
}

static void test_enter_refuses_a_second_call(void **state)
{
    perp_context *context;

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__enter(context), PERP_OK);
    assert_int_equal(perp__enter(context), PERP_ERROR_BUSY);
    assert_int_equal(perp__leave(context, PERP_ERROR_MEMORY), PERP_ERROR_MEMORY);
    assert_int_equal(perp__enter(context), PERP_OK);
    assert_int_equal(perp__leave(context, PERP_OK), PERP_OK);
    perp_context_destroy(context);
}

static void test_allocations_that_overflow_fail(void **state)
{
    counter c = {0, 0, 0};
    perp_context_settings settings = counted(&c);
    perp_context *context;
    void *memory;

    (void)state;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    assert_null(perp__allocate(context, SIZE_MAX / 2, 3));
    assert_null(perp__allocate(context, 3, SIZE_MAX / 2));
    assert_int_equal(c.calls, 1);           /* the allocator was not even asked */
    memory = perp__allocate(context, 0, 8); /* an allocator may answer 0 bytes with NULL */
    assert_non_null(memory);
    perp__release(context, memory);
    perp__release(context, NULL);
    perp_context_destroy(context);
    assert_int_equal(c.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_own_allocator_gets_everything_back),
        cmocka_unit_test(test_refusals_leave_the_handle_alone),
        cmocka_unit_test(test_solvers_keep_the_context_alive),
        cmocka_unit_test(test_a_destroyed_context_makes_no_more_solvers),
        cmocka_unit_test(test_what_is_not_a_context_is_refused),
        cmocka_unit_test(test_messages_come_and_go),
        cmocka_unit_test(test_long_messages_are_cut),
        cmocka_unit_test(test_enter_refuses_a_second_call),
        cmocka_unit_test(test_allocations_that_overflow_fail),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The arena: alignment, growth, overflow, failure. */
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "base/arena.h"

typedef struct arrays {
    size_t n;
    double *x;
    int8_t *flags;
    int32_t *indices;
} arrays;

static void layout(perp__arena *arena, void *object)
{
    arrays *a = object;

    a->x = perp__arena_take(arena, a->n, sizeof *a->x);
    a->flags = perp__arena_take(arena, a->n, sizeof *a->flags);
    a->indices = perp__arena_take(arena, a->n, sizeof *a->indices);
}

static int fail_next;
static int live;

static void *stubborn_allocate(size_t size, void *user)
{
    char *memory;

    (void)user;
    if (fail_next)
        return NULL;
    live++;
    memory = malloc(size + 8); /* aligned for any object, but not for a cache line */
    return memory;
}

static void stubborn_release(void *pointer, void *user)
{
    (void)user;
    live--;
    free(pointer);
}

static perp_context *make_context(void)
{
    perp_context_settings settings;
    perp_context *context;

    fail_next = 0;
    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = stubborn_allocate;
    settings.release = stubborn_release;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    return context;
}

/* Fills every array to its end: a sanitizer or valgrind sees a block that is too small, and what
 * overlaps shows here. */
static void fill_and_verify(arrays *a)
{
    size_t i;

    for (i = 0; i < a->n; i++) {
        a->x[i] = (double)i;
        a->flags[i] = (int8_t)(i % 100);
        a->indices[i] = -(int32_t)i;
    }
    for (i = 0; i < a->n; i++) {
        assert_true(a->x[i] == (double)i);
        assert_int_equal(a->flags[i], i % 100);
        assert_int_equal(a->indices[i], -(int32_t)i);
    }
}

static void test_arrays_are_aligned_and_apart(void **state)
{
    perp_context *context = make_context();
    perp__arena arena;
    arrays a;

    (void)state;
    memset(&arena, 0, sizeof arena);
    for (a.n = 0; a.n < 200; a.n += 13) {
        assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
        assert_int_equal((uintptr_t)a.x % 64, 0);
        assert_int_equal((uintptr_t)a.flags % 64, 0);
        assert_int_equal((uintptr_t)a.indices % 64, 0);
        fill_and_verify(&a);
    }
    perp__arena_release(&arena);
    perp_context_destroy(context);
    assert_int_equal(live, 0);
}

static void test_a_fit_that_fits_allocates_nothing(void **state)
{
    perp_context *context = make_context();
    perp__arena arena;
    arrays a;
    double *first;

    (void)state;
    memset(&arena, 0, sizeof arena);
    a.n = 100;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
    first = a.x;
    fail_next = 1;
    a.n = 50;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
    a.n = 100;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
    assert_ptr_equal(a.x, first);
    perp__arena_release(&arena);
    perp_context_destroy(context);
}

static void test_failure_keeps_the_block(void **state)
{
    perp_context *context = make_context();
    perp__arena arena;
    arrays a, larger;

    (void)state;
    memset(&arena, 0, sizeof arena);
    a.n = 100;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
    a.x[99] = 3.0;
    fail_next = 1;
    larger = a;
    larger.n = 10000;
    assert_int_equal(perp__arena_fit(&arena, context, layout, &larger), PERP_ERROR_MEMORY);
    assert_string_not_equal(perp_context_message(context), "");
    assert_true(a.x[99] == 3.0);
    assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_OK);
    assert_true(a.x[99] == 3.0);
    perp__arena_release(&arena);
    perp_context_destroy(context);
    assert_int_equal(live, 0);
}

static void test_sizes_that_overflow_fail(void **state)
{
    static const size_t huge[] = {SIZE_MAX, SIZE_MAX / 8, SIZE_MAX / 8 + 1, SIZE_MAX / 16,
                                  SIZE_MAX / 13};
    perp_context *context = make_context();
    perp__arena arena;
    size_t k;

    (void)state;
    memset(&arena, 0, sizeof arena);
    for (k = 0; k < sizeof huge / sizeof *huge; k++) {
        arrays a;

        a.n = huge[k];
        assert_int_equal(perp__arena_fit(&arena, context, layout, &a), PERP_ERROR_MEMORY);
    }
    perp__arena_release(&arena);
    perp_context_destroy(context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_arrays_are_aligned_and_apart),
        cmocka_unit_test(test_a_fit_that_fits_allocates_nothing),
        cmocka_unit_test(test_failure_keeps_the_block),
        cmocka_unit_test(test_sizes_that_overflow_fail),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

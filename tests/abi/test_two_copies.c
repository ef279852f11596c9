/* Two programs in one process may each bring a copy of perp: a simulator that embeds it, and a
 * Python package that bundles it. The copies must not find each other's symbols or share state. Two
 * files with the shared library's bytes stand for them here. */
#define _POSIX_C_SOURCE 200809L

#include "suite.h"

#include <perp/perp.h>

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef PERP_TEST_SHARED
#error "the Makefile says where libperp.so is"
#endif

/* What a copy exports, as far as these tests use it, and what it has allocated. */
typedef struct library {
    char path[256];
    void *handle;
    int live_blocks;
    perp_context *context;
    perp_status (*struct_init)(void *, size_t);
    perp_status (*create)(perp_context **, const perp_context_settings *);
    void (*destroy)(perp_context *);
    const char *(*message)(const perp_context *);
    perp_status (*matrix_dense)(perp_matrix *, int32_t, int32_t, int32_t, const double *, int64_t);
    perp_status (*solve)(perp_context *, double *, double *, double *, perp_lcp_result *,
                         const perp_lcp_settings *, const perp_lcp_problem *, const double *);
} library;

typedef struct fixture {
    char folder[64];
    library copies[2];
} fixture;

static void *allocate(size_t size, void *user)
{
    ((library *)user)->live_blocks++;
    return malloc(size);
}

static void release(void *pointer, void *user)
{
    ((library *)user)->live_blocks--;
    free(pointer);
}

static void copy_file(const char *to, const char *from)
{
    char block[1 << 14];
    size_t count;
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    assert_non_null(in);
    assert_non_null(out);
    while ((count = fread(block, 1, sizeof block, in)) > 0)
        assert_int_equal(fwrite(block, 1, count, out), count);
    assert_int_equal(fclose(in), 0);
    assert_int_equal(fclose(out), 0);
}

/* Writes the address of a function into `function`; C has no cast for it, POSIX this way. */
static void find(library *copy, const char *name, void *function)
{
    void *address = dlsym(copy->handle, name);
    assert_non_null(address);
    memcpy(function, &address, sizeof address);
}

static void load(library *copy, const char *folder, const char *name)
{
    snprintf(copy->path, sizeof copy->path, "%s/%s", folder, name);
    copy_file(copy->path, PERP_TEST_SHARED);
    copy->handle = dlopen(copy->path, RTLD_NOW | RTLD_LOCAL);
    if (copy->handle == NULL)
        fail_msg("%s", dlerror());
    find(copy, "perp_struct_init", &copy->struct_init);
    find(copy, "perp_context_create", &copy->create);
    find(copy, "perp_context_destroy", &copy->destroy);
    find(copy, "perp_context_message", &copy->message);
    find(copy, "perp_matrix_dense", &copy->matrix_dense);
    find(copy, "perp_lcp_solve", &copy->solve);
}

static void open_context(library *copy)
{
    perp_context_settings settings;
    assert_int_equal(copy->struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = allocate;
    settings.release = release;
    settings.allocator_user = copy;
    assert_int_equal(copy->create(&copy->context, &settings), PERP_OK);
}

static int setup(void **state)
{
    static const char *const names[2] = {"libperp_one.so", "libperp_two.so"};
    fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    strcpy(f->folder, "/tmp/perp_two_copies_XXXXXX");
    assert_non_null(mkdtemp(f->folder));
    for (int i = 0; i < 2; i++) {
        load(&f->copies[i], f->folder, names[i]);
        open_context(&f->copies[i]);
    }
    *state = f;
    return 0;
}

static void unload(library *copy)
{
    if (copy->handle == NULL)
        return;
    copy->destroy(copy->context);
    assert_int_equal(dlclose(copy->handle), 0);
    copy->handle = NULL;
}

static int teardown(void **state)
{
    fixture *f = *state;
    for (int i = 0; i < 2; i++) {
        unload(&f->copies[i]);
        remove(f->copies[i].path);
    }
    rmdir(f->folder);
    free(f);
    return 0;
}

/* M = [2 1; 1 2], q = (-1, 1) has z = (1/2, 0), w = (0, 3/2); the first column alone solves it. */
static void solve_small(library *copy, double *z, double *w)
{
    const double M[] = {2, 1, 1, 2}, q[] = {-1, 1};
    perp_matrix view;
    perp_lcp_result result;
    assert_int_equal(copy->struct_init(&view, sizeof view), PERP_OK);
    assert_int_equal(copy->matrix_dense(&view, PERP_STORAGE_COLUMN_MAJOR, 2, 2, M, 2), PERP_OK);
    assert_int_equal(copy->struct_init(&result, sizeof result), PERP_OK);
    assert_int_equal(copy->solve(copy->context, z, w, NULL, &result, NULL, LCP(&view, q), NULL),
                     PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
}

static void test_copies_are_distinct(void **state)
{
    const fixture *f = *state;
    assert_true(f->copies[0].handle != f->copies[1].handle);
    assert_true(f->copies[0].create != f->copies[1].create);
    /* Nor is either of them the one that this program was linked with. */
    assert_true(f->copies[0].create != perp_context_create);
    assert_true(f->copies[1].create != perp_context_create);
}

static void test_messages_stay_apart(void **state)
{
    fixture *f = *state;
    library *one = &f->copies[0], *two = &f->copies[1];
    double z[2], w[2];
    assert_true(one->solve(one->context, z, w, NULL, NULL, NULL, NULL, NULL) < 0);
    assert_true(one->message(one->context)[0] != '\0');
    assert_string_equal(two->message(two->context), "");
    solve_small(two, z, w);
    assert_true(one->message(one->context)[0] != '\0');
}

/* The same version or not, one copy's handle means nothing to the other. */
static void test_handles_stay_apart(void **state)
{
    fixture *f = *state;
    library *one = &f->copies[0], *two = &f->copies[1];
    perp_lcp_solver *solver = NULL;
    double z[2], w[2];
    assert_int_equal(two->solve(one->context, z, w, NULL, NULL, NULL, NULL, NULL),
                     PERP_ERROR_HANDLE);
    assert_string_equal(two->message(one->context), "");
    two->destroy(one->context); /* ignored */
    assert_int_equal(perp_lcp_solver_create(one->context, &solver, NULL), PERP_ERROR_HANDLE);
    solve_small(one, z, w);
}

static void test_memory_stays_apart(void **state)
{
    fixture *f = *state;
    double z[2], w[2];
    const int before = f->copies[1].live_blocks;
    assert_int_equal(before, 1); /* a context is one block */
    solve_small(&f->copies[0], z, w);
    assert_int_equal(f->copies[1].live_blocks, before);
    unload(&f->copies[0]);
    assert_int_equal(f->copies[0].live_blocks, 0);
    assert_int_equal(f->copies[1].live_blocks, before);
}

/* Both give the same bits, and one goes on when the other has been unloaded. 1e-15 is some units in
 * the last place of numbers near 1. */
static void test_one_outlives_the_other(void **state)
{
    fixture *f = *state;
    double z[2][2], w[2][2];
    for (int i = 0; i < 2; i++)
        solve_small(&f->copies[i], z[i], w[i]);
    assert_memory_equal(z[0], z[1], sizeof z[0]);
    assert_memory_equal(w[0], w[1], sizeof w[0]);
    unload(&f->copies[0]);
    solve_small(&f->copies[1], z[0], w[0]);
    assert_memory_equal(z[0], z[1], sizeof z[0]);
    assert_true(z[0][0] > 0.5 - 1e-15 && z[0][0] < 0.5 + 1e-15);
    assert_true(z[0][1] == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_copies_are_distinct, setup, teardown),
        cmocka_unit_test_setup_teardown(test_messages_stay_apart, setup, teardown),
        cmocka_unit_test_setup_teardown(test_handles_stay_apart, setup, teardown),
        cmocka_unit_test_setup_teardown(test_memory_stays_apart, setup, teardown),
        cmocka_unit_test_setup_teardown(test_one_outlives_the_other, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

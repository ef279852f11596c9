/* libperp-mechanism beside libperp, as shared libraries: it works in contexts of that libperp and
 * of no other copy, and its handles are children of their context like any others. */
#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

#if !defined PERP_TEST_SHARED || !defined PERP_TEST_MECHANISM
#error "the Makefile says where the libraries are"
#endif

typedef struct fixture {
    void *first, *second;
    perp_context *context;
    int live_blocks;
    perp_status (*context_create)(perp_context **, const perp_context_settings *);
    void (*context_destroy)(perp_context *);
    const char *(*message)(const perp_context *);
    perp_status (*create)(perp_context *, perp_mechanism **, const perp_mechanism_settings *,
                          const perp_mechanism_model *);
    void (*destroy)(perp_mechanism *);
    perp_status (*run)(perp_mechanism *, double *, double *, perp_mechanism_run_result *,
                       const perp_mechanism_start *, double, perp_mechanism_observer, void *);
} fixture;

static void *allocate(size_t size, void *user)
{
    ((fixture *)user)->live_blocks++;
    return malloc(size);
}

static void release(void *pointer, void *user)
{
    ((fixture *)user)->live_blocks--;
    free(pointer);
}

/* Writes the address of a function into `function`; C has no cast for it, POSIX this way. */
static void find(void *library, const char *name, void *function)
{
    void *address = dlsym(library, name);

    assert_non_null(address);
    memcpy(function, &address, sizeof address);
}

static void *load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);

    if (library == NULL)
        fail_msg("%s", dlerror());
    return library;
}

static int setup(void **state)
{
    fixture *f = calloc(1, sizeof *f);
    perp_context_settings settings;

    assert_non_null(f);
    f->first = load(PERP_TEST_SHARED); /* the second finds it by its soname */
    f->second = load(PERP_TEST_MECHANISM);
    find(f->first, "perp_context_create", &f->context_create);
    find(f->first, "perp_context_destroy", &f->context_destroy);
    find(f->first, "perp_context_message", &f->message);
    find(f->second, "perp_mechanism_create", &f->create);
    find(f->second, "perp_mechanism_destroy", &f->destroy);
    find(f->second, "perp_mechanism_run", &f->run);
    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = allocate;
    settings.release = release;
    settings.allocator_user = f;
    assert_int_equal(f->context_create(&f->context, &settings), PERP_OK);
    *state = f;
    return 0;
}

static int teardown(void **state)
{
    fixture *f = *state;

    f->context_destroy(f->context);
    assert_int_equal(f->live_blocks, 0);
    assert_int_equal(dlclose(f->second), 0);
    assert_int_equal(dlclose(f->first), 0);
    free(f);
    return 0;
}

static int32_t weight(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t, (void)q, (void)v, (void)user;
    k[0] = -1.0;
    return 0;
}

static int32_t floor_below(double *gap, double *rows, double *drift, double *mu, double t,
                           const double *q, void *user)
{
    (void)mu, (void)t, (void)user;
    gap[0] = q[0];
    rows[0] = 1.0;
    drift[0] = 0.0;
    return 0;
}

/* A mass that falls on a floor. */
static perp_status make(fixture *f, perp_context *context, perp_mechanism **mechanism)
{
    perp_mechanism_model model;

    assert_int_equal(perp_mechanism_model_init(&model, sizeof model), PERP_OK);
    model.velocities = 1;
    model.contacts = model.dim = 1;
    model.force = weight;
    model.contact_rows = floor_below;
    return f->create(context, mechanism, NULL, &model);
}

static double fall(const fixture *f, perp_mechanism *mechanism)
{
    const double q0 = 0.5, v0 = 0.0;
    double q = 0.0, v = 1.0;
    perp_mechanism_run_result result;

    assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
    assert_int_equal(
        f->run(mechanism, &q, &v, &result, START(0.0, 0.125, &q0, &v0), 4.0, NULL, NULL), PERP_OK);
    assert_true(v == 0.0);
    return q;
}

static void test_it_works_in_contexts_of_the_first(void **state)
{
    fixture *f = *state;
    perp_mechanism *mechanism = NULL;

    assert_int_equal(make(f, f->context, &mechanism), PERP_OK);
    assert_true(fall(f, mechanism) >= -1e-12); /* on the floor, but for rounding */
    f->destroy(mechanism);
    assert_int_equal(f->live_blocks, 1); /* the context */
}

static void test_it_outlives_the_handle_of_its_context(void **state)
{
    fixture *f = *state;
    perp_mechanism *mechanism = NULL, *other = NULL;

    assert_int_equal(make(f, f->context, &mechanism), PERP_OK);
    f->context_destroy(f->context);
    assert_true(fall(f, mechanism) >= -1e-12);
    assert_int_equal(make(f, f->context, &other), PERP_ERROR_HANDLE);
    f->destroy(mechanism);
    assert_int_equal(f->live_blocks, 0);
    assert_int_equal(f->context_create(&f->context, NULL), PERP_OK);
}

static void test_refusals_of_either_are_told_by_the_context(void **state)
{
    fixture *f = *state;
    perp_mechanism *mechanism = NULL;

    assert_int_equal(f->create(f->context, &mechanism, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_string_equal(f->message(f->context), "model is NULL");
}

/* The copy that this program is linked with. */
static void test_contexts_of_another_copy_are_refused(void **state)
{
    fixture *f = *state;
    perp_context *foreign = NULL;
    perp_mechanism *mechanism = NULL;

    assert_int_equal(perp_context_create(&foreign, NULL), PERP_OK);
    assert_int_equal(make(f, foreign, &mechanism), PERP_ERROR_HANDLE);
    assert_int_equal(make(f, NULL, &mechanism), PERP_ERROR_HANDLE);
    assert_null(mechanism);
    perp_context_destroy(foreign);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_it_works_in_contexts_of_the_first, setup, teardown),
        cmocka_unit_test_setup_teardown(test_it_outlives_the_handle_of_its_context, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(test_refusals_of_either_are_told_by_the_context, setup,
                                        teardown),
        cmocka_unit_test_setup_teardown(test_contexts_of_another_copy_are_refused, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

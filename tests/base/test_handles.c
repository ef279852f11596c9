/* One life for every kind of handle: inside a callback nothing is destroyed and every call is
 * refused as busy, nothing is made from a destroyed context, a dead handle and one of another kind
 * are the same error, and a create that runs out of memory leaves nothing. One table; a new kind
 * gets a row. */
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

/* ---- memory that stays readable, so that what a dead handle does is defined ------------------ */

enum { BLOCKS = 4000 };

static struct {
    void *block[BLOCKS];
    int released[BLOCKS];
    int count, live;
    int fails_in; /* the allocation that fails, from 1; 0: none */
} memory;

static int hostile; /* callbacks use and destroy whatever there is */
static int called;  /* callbacks while hostile */
static void *dying; /* the handle whose end was asked for outside of callbacks */
static void attack_everything(void);

static void *keep_allocate(size_t size, void *user)
{
    (void)user;
    attack_everything();
    if (memory.fails_in > 0 && --memory.fails_in == 0)
        return NULL;
    assert_true(memory.count < BLOCKS);
    memory.block[memory.count] = malloc(size);
    memset(memory.block[memory.count], 0xa5, size);
    memory.released[memory.count] = 0;
    memory.live++;
    return memory.block[memory.count++];
}

static void keep_release(void *pointer, void *user)
{
    int i;

    (void)user;
    attack_everything();
    for (i = 0; i < memory.count && memory.block[i] != pointer; i++)
        ;
    assert_true(i < memory.count);
    assert_false(memory.released[i]); /* nothing is released twice */
    memory.released[i] = 1;
    memory.live--;
}

static void keep_log(const char *message, void *user)
{
    (void)message;
    (void)user;
    attack_everything();
}

/* ---- the kinds ------------------------------------------------------------------------------- */

static const double one = 1.0, minus_one = -1.0;

static perp_matrix unit_matrix(void)
{
    perp_matrix M;

    assert_int_equal(perp_struct_init(&M, sizeof M), PERP_OK);
    assert_int_equal(perp_matrix_dense(&M, PERP_STORAGE_ROW_MAJOR, 1, 1, &one, 1), PERP_OK);
    return M;
}

static perp_status make_lcp(perp_context *context, void **made)
{
    return perp_lcp_solver_create(context, (perp_lcp_solver **)made, NULL);
}

static perp_status misuse_lcp(void *handle)
{
    return perp_lcp_solver_solve(handle, NULL, NULL, NULL, NULL, NULL, NULL);
}

static perp_status make_sensitivity(perp_context *context, void **made)
{
    perp_lcp_sensitivity_info info;
    perp_matrix M = unit_matrix();

    assert_int_equal(perp_struct_init(&info, sizeof info), PERP_OK);
    return perp_lcp_sensitivity_create(context, (perp_lcp_sensitivity **)made, &info, NULL,
                                       LCP(&M, &minus_one), &one);
}

static perp_status misuse_sensitivity(void *handle)
{
    return perp_lcp_sensitivity_places(handle, NULL);
}

static perp_status make_ncp(perp_context *context, void **made)
{
    return perp_ncp_solver_create(context, (perp_ncp_solver **)made, NULL);
}

static perp_status misuse_ncp(void *handle)
{
    return perp_ncp_solver_setup(handle, NULL);
}

static perp_status make_contact(perp_context *context, void **made)
{
    return perp_contact_solver_create(context, (perp_contact_solver **)made, NULL);
}

static perp_status misuse_contact(void *handle)
{
    return perp_contact_solver_setup_delassus(handle, NULL, NULL);
}

static perp_status make_friction(perp_context *context, void **made)
{
    perp_matrix M = unit_matrix();
    perp_load_system system;

    assert_int_equal(perp_load_system_init(&system, sizeof system), PERP_OK);
    system.n = 1;
    system.A = system.C = &M;
    system.mu = &one;
    return perp_load_friction_create(context, (perp_load_friction **)made, NULL, &system);
}

static perp_status misuse_friction(void *handle)
{
    return perp_load_friction_get(handle, NULL, 7);
}

static perp_status make_compliant(perp_context *context, void **made)
{
    perp_matrix M = unit_matrix();
    perp_compliant_system system;

    assert_int_equal(perp_struct_init(&system, sizeof system), PERP_OK);
    system.n = system.contacts = 1;
    system.mass = system.normal = system.tangent = &M;
    system.mu = &one;
    system.stiffness = 1.0;
    return perp_compliant_create(context, (perp_compliant **)made, &system);
}

static perp_status misuse_compliant(void *handle)
{
    return perp_compliant_linearise(handle, NULL, NULL, NULL, NULL, NULL);
}

static int32_t push(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    attack_everything();
    k[0] = 1.0;
    return 0;
}

static perp_status make_mechanism(perp_context *context, void **made)
{
    perp_mechanism_model model;

    assert_int_equal(perp_mechanism_model_init(&model, sizeof model), PERP_OK);
    model.velocities = 1;
    model.force = push;
    return perp_mechanism_create(context, (perp_mechanism **)made, NULL, &model);
}

static perp_status misuse_mechanism(void *handle)
{
    return perp_mechanism_run(handle, NULL, NULL, NULL, START(0.0, 0.5, NULL, NULL), 1.0, NULL,
                              NULL);
}

static perp_status make_world(perp_context *context, void **made)
{
    return perp_world_create(context, (perp_world **)made, NULL);
}

static perp_status misuse_world(void *handle)
{
    return perp_world_step(handle, NULL, -1.0);
}

/* The end of each kind. */
#define END(kind)                        \
    static void end_##kind(void *handle) \
    {                                    \
        perp_##kind##_destroy(handle);   \
    }
END(lcp_solver)
END(lcp_sensitivity)
END(ncp_solver)
END(contact_solver)
END(load_friction)
END(compliant)
END(mechanism)
END(world)

static const struct kind {
    const char *name;
    perp_status (*make)(perp_context *context, void **made);
    perp_status (*misuse)(void *handle); /* a call that fails, and so writes to the log */
    void (*end)(void *handle);
} kinds[] = {
    {"lcp solver", make_lcp, misuse_lcp, end_lcp_solver},
    {"sensitivity", make_sensitivity, misuse_sensitivity, end_lcp_sensitivity},
    {"ncp solver", make_ncp, misuse_ncp, end_ncp_solver},
    {"contact solver", make_contact, misuse_contact, end_contact_solver},
    {"load friction", make_friction, misuse_friction, end_load_friction},
    {"compliant", make_compliant, misuse_compliant, end_compliant},
    {"mechanism", make_mechanism, misuse_mechanism, end_mechanism},
    {"world", make_world, misuse_world, end_world},
};

enum { KINDS = sizeof kinds / sizeof kinds[0] };

static perp_context *context;
static void *handles[KINDS];

/* Of a handle that dies all memory but its own is released while it still is of its kind. */
static void require_busy(int k)
{
    void *made = &made;
    perp_status found = handles[k] ? kinds[k].misuse(handles[k]) : PERP_ERROR_BUSY;

    if (found != PERP_ERROR_BUSY && !(handles[k] == dying && found == PERP_ERROR_HANDLE))
        fail_msg("%s: %d when it is used inside a callback", kinds[k].name, (int)found);
    if (kinds[k].make(context, &made) != PERP_ERROR_BUSY || made != (void *)&made)
        fail_msg("%s: made inside a callback", kinds[k].name);
}

static void attack_everything(void)
{
    int k;

    if (!hostile)
        return;
    called++;
    for (k = 0; k < KINDS; k++) {
        require_busy(k);
        if (handles[k])
            kinds[k].end(handles[k]);
    }
    perp_context_destroy(context);
}

static int begin(void **state)
{
    perp_context_settings settings;
    int k;

    (void)state;
    hostile = 0;
    memset(&memory, 0, sizeof memory);
    assert_int_equal(perp_struct_init(&settings, sizeof settings), PERP_OK);
    settings.allocate = keep_allocate;
    settings.release = keep_release;
    settings.log = keep_log;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    for (k = 0; k < KINDS; k++)
        assert_int_equal(kinds[k].make(context, &handles[k]), PERP_OK);
    return 0;
}

/* Everything that was not destroyed still is, and goes for good. */
static int end(void **state)
{
    int k;

    (void)state;
    hostile = 0;
    for (k = 0; k < KINDS; k++)
        if (handles[k])
            kinds[k].end(handles[k]);
    perp_context_destroy(context);
    assert_int_equal(memory.live, 0);
    while (memory.count > 0)
        free(memory.block[--memory.count]);
    return 0;
}

/* All that live still answer as before. */
static void require_alive(void)
{
    int k;

    hostile = 0;
    for (k = 0; k < KINDS; k++) {
        perp_status found = handles[k] ? kinds[k].misuse(handles[k]) : PERP_ERROR_ARGUMENT;

        if (found != PERP_ERROR_ARGUMENT && found != PERP_ERROR_ABI)
            fail_msg("%s: %d after it was destroyed inside a callback", kinds[k].name, (int)found);
    }
}

/* ---- tests ----------------------------------------------------------------------------------- */

static void test_the_log_destroys_nothing(void **state)
{
    int k;

    (void)state;
    for (k = 0; k < KINDS; k++) {
        called = 0;
        hostile = 1;
        assert_true(kinds[k].misuse(handles[k]) < 0);
        if (called != 1)
            fail_msg("%s: %d lines in the log", kinds[k].name, called);
        require_alive();
    }
    called = 0; /* a call that has no handle but the context */
    hostile = 1;
    assert_int_equal(perp_lcp_solver_create(context, NULL, NULL), PERP_ERROR_ARGUMENT);
    assert_int_equal(called, 1);
    require_alive();
}

static void test_the_allocator_destroys_nothing(void **state)
{
    int k;

    (void)state;
    for (k = 0; k < KINDS; k++) {
        called = 0;
        hostile = 1;
        dying = handles[k];
        kinds[k].end(dying); /* once, though the callbacks destroy it again */
        dying = NULL;
        hostile = 0;
        handles[k] = NULL;
        assert_true(called > 0);
        require_alive();
        called = 0;
        hostile = 1;
        assert_int_equal(kinds[k].make(context, &handles[k]), PERP_OK);
        assert_true(called > 0);
        require_alive();
    }
}

/* The context alone: its log ends it while a call is open. */
static void test_the_log_does_not_destroy_a_context_without_handles(void **state)
{
    int k;

    (void)state;
    for (k = 0; k < KINDS; k++) {
        kinds[k].end(handles[k]);
        handles[k] = NULL;
    }
    called = 0;
    hostile = 1;
    assert_int_equal(perp_lcp_batch(context, NULL, NULL, NULL, NULL, NULL, 1,
                                    LCP_STACK(1, 1, NULL, NULL, NULL, NULL)),
                     PERP_ERROR_ARGUMENT);
    hostile = 0;
    assert_true(called > 0);
    assert_true(strlen(perp_context_message(context)) > 0);
}

static int32_t stop_lcp(const perp_lcp_progress *progress, void *user)
{
    (void)progress;
    (void)user;
    attack_everything();
    return 0;
}

static int32_t identity(double *F, const double *z, void *user)
{
    (void)user;
    attack_everything();
    F[0] = z[0] - 1.0;
    return 0;
}

/* Monitors and models. The calls that make a solver of their own are the sharp ones: that solver
 * is the last thing that keeps a destroyed context. */
static void test_callbacks_of_users_destroy_nothing(void **state)
{
    perp_matrix M = unit_matrix();
    perp_lcp_settings settings;
    perp_lcp_result result;
    perp_ncp_problem problem;
    perp_ncp_result ncp_result;
    perp_mechanism_run_result run;
    double z = 0.0, q0 = 0.0, v0 = 0.0, q = 0.0, v = 0.0;

    (void)state;
    assert_int_equal(perp_lcp_settings_init(&settings, sizeof settings), PERP_OK);
    assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
    settings.method = PERP_LCP_PGS;
    settings.monitor = stop_lcp;
    called = 0;
    hostile = 1;
    assert_int_equal(
        perp_lcp_solve(context, &z, NULL, NULL, &result, &settings, LCP(&M, &minus_one), NULL),
        PERP_OK);
    assert_true(called > 0 && z == 1.0);
    require_alive();
    assert_int_equal(perp_struct_init(&problem, sizeof problem), PERP_OK);
    assert_int_equal(perp_struct_init(&ncp_result, sizeof ncp_result), PERP_OK);
    problem.n = 1;
    problem.function = identity;
    called = 0;
    hostile = 1;
    assert_int_equal(perp_ncp_solve(context, &z, NULL, &ncp_result, NULL, &problem, &q0), PERP_OK);
    assert_true(called > 0);
    require_alive();
    assert_int_equal(perp_struct_init(&run, sizeof run), PERP_OK);
    called = 0;
    hostile = 1;
    assert_int_equal(
        perp_mechanism_run(handles[6], &q, &v, &run, START(0.0, 0.5, &q0, &v0), 1.0, NULL, NULL),
        PERP_OK);
    assert_true(called > 0 && v == 1.0); /* unit force on unit mass for unit time, exactly */
    require_alive();
}

static void test_dead_handles_are_refused(void **state)
{
    int k;

    (void)state;
    for (k = 0; k < KINDS; k++) {
        void *dead = handles[k];

        kinds[k].end(dead);
        handles[k] = NULL;
        if (kinds[k].misuse(dead) != PERP_ERROR_HANDLE)
            fail_msg("%s: used after its end", kinds[k].name);
        kinds[k].end(dead);
        assert_int_equal(kinds[k].misuse(NULL), PERP_ERROR_HANDLE);
        kinds[k].end(NULL);
    }
    perp_context_destroy(context);
    perp_context_destroy(context);
    assert_string_equal(perp_context_message(context), "");
    for (k = 0; k < KINDS; k++)
        assert_int_equal(kinds[k].make(context, &handles[k]), PERP_ERROR_HANDLE);
    context = NULL;
}

/* Handles of other kinds, a context, and memory that never was one. */
static void test_strangers_are_refused(void **state)
{
    double nothing[8] = {0.0};
    void *strangers[KINDS + 2], *made;
    int k, j;

    (void)state;
    memcpy(strangers, handles, sizeof handles);
    strangers[KINDS] = context;
    strangers[KINDS + 1] = nothing;
    for (k = 0; k < KINDS; k++)
        for (j = 0; j < KINDS + 2; j++) {
            if (j == k)
                continue;
            if (kinds[k].misuse(strangers[j]) != PERP_ERROR_HANDLE)
                fail_msg("%s: stranger %d taken for one", kinds[k].name, j);
            kinds[k].end(strangers[j]); /* ignored */
        }
    for (j = 0; j < KINDS + 2; j++)
        if (strangers[j] != context) {
            assert_int_equal(kinds[0].make(strangers[j], &made), PERP_ERROR_HANDLE);
            perp_context_destroy(strangers[j]);
        }
    assert_int_equal(perp_world_ground(strangers[0]), 0); /* what has no status says 0 */
    assert_int_equal(perp_world_contact_count(strangers[0]), 0);
    require_alive();
}

/* Whichever allocation of a create fails: the status, a message, no handle, nothing left behind. */
static void test_creates_without_memory_leave_nothing(void **state)
{
    int k, failed, count;

    (void)state;
    for (k = 0; k < KINDS; k++) {
        const int live = memory.live;
        void *made = NULL;

        for (failed = 0;; failed++) {
            memory.fails_in = failed + 1;
            made = &made;
            if (kinds[k].make(context, &made) == PERP_OK)
                break;
            assert_int_equal(memory.fails_in, 0);
            assert_ptr_equal(made, &made);
            assert_int_equal(memory.live, live);
            assert_non_null(strstr(perp_context_message(context), "out of memory for"));
            memory.fails_in = 1;
            assert_int_equal(kinds[k].make(context, &made), PERP_ERROR_MEMORY);
        }
        if (failed == 0 || memory.fails_in != 1)
            fail_msg("%s: made without memory", kinds[k].name);
        memory.fails_in = 0;
        count = memory.count;
        kinds[k].end(made);
        assert_int_equal(memory.count, count); /* an end needs no memory */
        assert_int_equal(memory.live, live);
    }
    require_alive();
}

/* A context that only lives on in what it made. */
static void test_nothing_is_made_from_a_destroyed_context(void **state)
{
    int32_t passive = 7;
    void *made;
    int k;

    (void)state;
    perp_context_destroy(context);
    for (k = 0; k < KINDS; k++) {
        made = &made;
        if (kinds[k].make(context, &made) != PERP_ERROR_HANDLE || made != (void *)&made)
            fail_msg("%s: made from a destroyed context", kinds[k].name);
    }
    assert_int_equal(perp_lcp_solve(context, NULL, NULL, NULL, NULL, NULL, LCP(NULL), NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_verify(context, NULL, NULL, LCP(NULL), NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_all(context, NULL, NULL, LCP(NULL), NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lcp_batch(context, NULL, NULL, NULL, NULL, NULL, 1,
                                    LCP_STACK(1, 1, NULL, NULL, NULL, NULL)),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_solve(context, NULL, NULL, NULL, NULL, NULL, NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_ncp_check_jacobian(context, NULL, NULL, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(perp_contact_solve(context, ANSWER(NULL), NULL, NULL, DYNAMICS(NULL), NULL),
                     PERP_ERROR_HANDLE);
    assert_int_equal(
        perp_contact_solve(context, ANSWER(NULL), NULL, NULL, DELASSUS(NULL, NULL, NULL), NULL),
        PERP_ERROR_HANDLE);
    assert_int_equal(perp_stribeck_force(context, NULL, NULL, NULL, 0.0), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lugre_force(context, NULL, NULL, NULL, 0.0, 0.0), PERP_ERROR_HANDLE);
    assert_int_equal(perp_lugre_step(context, NULL, NULL, NULL, NULL, 0.0, 0.0, 1.0),
                     PERP_ERROR_HANDLE);
    assert_int_equal(perp_lugre_passive(context, &passive, NULL), PERP_ERROR_HANDLE);
    assert_int_equal(passive, 7);
    require_alive();
}

/* base.h: a message is valid until the next call; an end is none, so that cleaning up first and
 * telling afterwards works. */
static void test_an_end_keeps_the_message(void **state)
{
    (void)state;
    assert_true(kinds[0].misuse(handles[0]) < 0);
    kinds[0].end(handles[0]);
    handles[0] = NULL;
    assert_true(strlen(perp_context_message(context)) > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_the_log_destroys_nothing, begin, end),
        cmocka_unit_test_setup_teardown(test_the_allocator_destroys_nothing, begin, end),
        cmocka_unit_test_setup_teardown(test_the_log_does_not_destroy_a_context_without_handles,
                                        begin, end),
        cmocka_unit_test_setup_teardown(test_callbacks_of_users_destroy_nothing, begin, end),
        cmocka_unit_test_setup_teardown(test_dead_handles_are_refused, begin, end),
        cmocka_unit_test_setup_teardown(test_strangers_are_refused, begin, end),
        cmocka_unit_test_setup_teardown(test_creates_without_memory_leave_nothing, begin, end),
        cmocka_unit_test_setup_teardown(test_nothing_is_made_from_a_destroyed_context, begin, end),
        cmocka_unit_test_setup_teardown(test_an_end_keeps_the_message, begin, end),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

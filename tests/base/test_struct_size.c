/* struct_size: too small, too old, unknown tails, and structs of other releases. */
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

#include "base/check.h"

/* A struct as three releases saw it: the first ends with `b`, ours with `c`, a later one with `d`.
 */
typedef struct release_1 {
    size_t struct_size;
    double a, b;
} release_1;

typedef struct release_2 {
    size_t struct_size;
    double a, b, c;
} release_2;

typedef struct release_3 {
    size_t struct_size;
    double a, b, c, d;
} release_3;

enum { FIRST = sizeof(release_1) };

static void test_init_zeroes_and_sets_the_size(void **state)
{
    release_2 s;

    (void)state;
    memset(&s, 0xff, sizeof s);
    assert_int_equal(perp__struct_init(&s, sizeof s, FIRST), PERP_OK);
    assert_int_equal(s.struct_size, sizeof s);
    assert_true(s.a == 0 && s.b == 0 && s.c == 0);
}

static void test_init_writes_no_further_than_it_is_told(void **state)
{
    release_3 s;

    (void)state;
    s.c = 7.0;
    assert_int_equal(perp__struct_init(&s, FIRST, FIRST), PERP_OK);
    assert_int_equal(s.struct_size, FIRST);
    assert_true(s.c == 7.0);
}

static void test_init_refuses_impossible_sizes(void **state)
{
    release_2 s;

    (void)state;
    memset(&s, 0x5a, sizeof s);
    assert_int_equal(perp__struct_init(NULL, sizeof s, FIRST), PERP_ERROR_ABI);
    assert_int_equal(perp__struct_init(&s, FIRST - 1, FIRST), PERP_ERROR_ABI);
    assert_int_equal(perp__struct_init(&s, 0, FIRST), PERP_ERROR_ABI);
    assert_int_equal(perp__struct_init(&s, SIZE_MAX, FIRST), PERP_ERROR_ABI);
    assert_int_equal(((unsigned char *)&s)[0], 0x5a);
}

static void test_an_older_struct_leaves_the_defaults_of_what_it_lacks(void **state)
{
    release_1 caller = {sizeof caller, 1.0, 2.0};
    release_2 own = {sizeof own, -1.0, -2.0, -3.0};

    (void)state;
    assert_int_equal(perp__struct_read(NULL, "s", &own, sizeof own, &caller, FIRST), PERP_OK);
    assert_true(own.a == 1.0 && own.b == 2.0 && own.c == -3.0);
}

static void test_a_newer_struct_is_taken_while_its_tail_is_zero(void **state)
{
    release_3 caller = {sizeof caller, 1.0, 2.0, 3.0, 0.0};
    release_2 own = {sizeof own, 0, 0, 0};

    (void)state;
    assert_int_equal(perp__struct_read(NULL, "s", &own, sizeof own, &caller, FIRST), PERP_OK);
    assert_true(own.c == 3.0);
    caller.d = 4.0;
    own.a = 9.0;
    assert_int_equal(perp__struct_read(NULL, "s", &own, sizeof own, &caller, FIRST),
                     PERP_ERROR_ABI);
    assert_true(own.a == 9.0);
}

static void test_the_three_faults_have_different_messages(void **state)
{
    release_3 caller = {0, 0, 0, 0, 0};
    perp_context *context;
    char small[256], large[256];

    (void)state;
    assert_int_equal(perp_context_create(&context, NULL), PERP_OK);
    assert_int_equal(perp__struct_check(context, "thing", &caller, sizeof(release_2), FIRST),
                     PERP_ERROR_ABI);
    strcpy(small, perp_context_message(context));
    caller.struct_size = SIZE_MAX / 3;
    assert_int_equal(perp__struct_check(context, "thing", &caller, sizeof(release_2), FIRST),
                     PERP_ERROR_ABI);
    strcpy(large, perp_context_message(context));
    caller.struct_size = sizeof caller;
    caller.d = 1.0;
    assert_int_equal(perp__struct_check(context, "thing", &caller, sizeof(release_2), FIRST),
                     PERP_ERROR_ABI);
    assert_string_not_equal(small, large);
    assert_string_not_equal(small, perp_context_message(context));
    assert_string_not_equal(large, perp_context_message(context));
    assert_non_null(strstr(small, "thing"));
    assert_non_null(strstr(large, "thing"));
    assert_non_null(strstr(perp_context_message(context), "thing"));
    assert_int_equal(perp__struct_check(context, "thing", NULL, sizeof(release_2), FIRST),
                     PERP_ERROR_ARGUMENT);
    perp_context_destroy(context);
}

static void test_write_keeps_the_callers_size_and_reach(void **state)
{
    release_2 own = {sizeof own, 1.0, 2.0, 3.0};
    release_3 newer = {sizeof newer, 0, 0, 0, 4.0};
    struct {
        release_1 s;
        double next;
    } older = {{sizeof(release_1), 0, 0}, 5.0};

    (void)state;
    perp__struct_write(&newer, &own, sizeof own);
    assert_int_equal(newer.struct_size, sizeof newer);
    assert_true(newer.a == 1.0 && newer.c == 3.0 && newer.d == 4.0);
    perp__struct_write(&older.s, &own, sizeof own);
    assert_int_equal(older.s.struct_size, sizeof(release_1));
    assert_true(older.s.b == 2.0 && older.next == 5.0);
}

/* A struct with defaults: its init takes its size and larger, refuses less, NULL and nonsense. */
#define CHECK_INIT(T)                                                                    \
    do {                                                                                 \
        union {                                                                          \
            T s;                                                                         \
            unsigned char bytes[sizeof(T) + 64];                                         \
        } u;                                                                             \
        memset(&u, 0xff, sizeof u);                                                      \
        assert_int_equal(T##_init(&u.s, sizeof(T)), PERP_OK);                            \
        assert_int_equal(u.s.struct_size, sizeof(T));                                    \
        assert_int_equal(u.bytes[sizeof(T)], 0xff);                                      \
        assert_int_equal(T##_init(&u.s, sizeof u), PERP_OK); /* a later release's */     \
        assert_int_equal(u.s.struct_size, sizeof u);                                     \
        assert_int_equal(u.bytes[sizeof u - 1], 0);                                      \
        assert_int_equal(T##_init(&u.s, PERP__FIRST(T)), PERP_OK); /* the first one's */ \
        assert_int_equal(T##_init(NULL, sizeof(T)), PERP_ERROR_ABI);                     \
        assert_int_equal(T##_init(&u.s, PERP__FIRST(T) - 1), PERP_ERROR_ABI);            \
        assert_int_equal(T##_init(&u.s, 0), PERP_ERROR_ABI);                             \
        assert_int_equal(T##_init(&u.s, SIZE_MAX), PERP_ERROR_ABI);                      \
    } while (0)

/* One without: perp_struct_init knows no type, and what is too small is refused where it is used.
 */
#define CHECK_ZERO(T)                                                              \
    do {                                                                           \
        T s;                                                                       \
        memset(&s, 0xff, sizeof s);                                                \
        assert_int_equal(perp_struct_init(&s, sizeof s), PERP_OK);                 \
        assert_int_equal(s.struct_size, sizeof s);                                 \
        assert_int_equal(((unsigned char *)&s)[sizeof s - 1], 0);                  \
        assert_int_equal(PERP__CHECK(T, NULL, &s), PERP_OK);                       \
        assert_int_equal(perp_struct_init(&s, PERP__FIRST(T)), PERP_OK);           \
        assert_int_equal(PERP__CHECK(T, NULL, &s), PERP_OK); /* the first one's */ \
        assert_int_equal(perp_struct_init(&s, PERP__FIRST(T) - 1), PERP_OK);       \
        assert_int_equal(PERP__CHECK(T, NULL, &s), PERP_ERROR_ABI);                \
    } while (0)

static perp_status perp_world_settings_init_3(perp_world_settings *settings, size_t size)
{
    return perp_world_settings_init(settings, size, 0);
}

#define perp_world_settings_init perp_world_settings_init_3

static void test_public_inits(void **state)
{
    (void)state;
    CHECK_INIT(perp_body_settings);
    CHECK_INIT(perp_body_state);
    CHECK_INIT(perp_compliant_settings);
    CHECK_INIT(perp_contact_laws);
    CHECK_INIT(perp_contact_settings);
    CHECK_INIT(perp_joint_settings);
    CHECK_INIT(perp_lcp_settings);
    CHECK_INIT(perp_load_settings);
    CHECK_INIT(perp_load_system);
    CHECK_INIT(perp_mechanism_model);
    CHECK_INIT(perp_mechanism_settings);
    CHECK_INIT(perp_ncp_settings);
    CHECK_INIT(perp_shape_settings);
    CHECK_INIT(perp_world_settings);
}

static void test_public_structs_without_defaults(void **state)
{
    (void)state;
    CHECK_ZERO(perp_bristle);
    CHECK_ZERO(perp_compliant_result);
    CHECK_ZERO(perp_compliant_stability);
    CHECK_ZERO(perp_compliant_system);
    CHECK_ZERO(perp_contact_dynamics);
    CHECK_ZERO(perp_contact_result);
    CHECK_ZERO(perp_contact_run);
    CHECK_ZERO(perp_contact_sensitivity_info);
    CHECK_ZERO(perp_contact_source);
    CHECK_ZERO(perp_contact_step);
    CHECK_ZERO(perp_context_settings);
    CHECK_ZERO(perp_joint_state);
    CHECK_ZERO(perp_lcp_enumeration);
    CHECK_ZERO(perp_lcp_proof);
    CHECK_ZERO(perp_lcp_result);
    CHECK_ZERO(perp_lcp_sensitivity_info);
    CHECK_ZERO(perp_load_found);
    CHECK_ZERO(perp_load_inverse);
    CHECK_ZERO(perp_load_step);
    CHECK_ZERO(perp_load_summary);
    CHECK_ZERO(perp_load_uniqueness);
    CHECK_ZERO(perp_matrix);
    CHECK_ZERO(perp_mechanism_check_result);
    CHECK_ZERO(perp_mechanism_found);
    CHECK_ZERO(perp_mechanism_run_result);
    CHECK_ZERO(perp_mechanism_step);
    CHECK_ZERO(perp_mechanism_summary);
    CHECK_ZERO(perp_ncp_check);
    CHECK_ZERO(perp_ncp_problem);
    CHECK_ZERO(perp_ncp_result);
    CHECK_ZERO(perp_statics_problem);
    CHECK_ZERO(perp_statics_result);
    CHECK_ZERO(perp_statics_settings);
    CHECK_ZERO(perp_step_result);
    CHECK_ZERO(perp_world_contact);
    CHECK_ZERO(perp_world_load);
    CHECK_ZERO(perp_world_states);
    CHECK_ZERO(perp_world_stats);
    assert_int_equal(perp_struct_init(NULL, sizeof(perp_lcp_result)), PERP_ERROR_ABI);
    assert_int_equal(perp_struct_init(state, 0), PERP_ERROR_ABI);
    assert_int_equal(perp_struct_init(state, SIZE_MAX), PERP_ERROR_ABI);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_init_zeroes_and_sets_the_size),
        cmocka_unit_test(test_init_writes_no_further_than_it_is_told),
        cmocka_unit_test(test_init_refuses_impossible_sizes),
        cmocka_unit_test(test_an_older_struct_leaves_the_defaults_of_what_it_lacks),
        cmocka_unit_test(test_a_newer_struct_is_taken_while_its_tail_is_zero),
        cmocka_unit_test(test_the_three_faults_have_different_messages),
        cmocka_unit_test(test_write_keeps_the_callers_size_and_reach),
        cmocka_unit_test(test_public_inits),
        cmocka_unit_test(test_public_structs_without_defaults),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

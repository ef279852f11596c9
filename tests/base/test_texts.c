/* Statuses, outcomes and versions: numbers that never change and words that bindings rely on. */
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

static void test_status_values(void **state)
{
    (void)state;
    assert_int_equal(PERP_OK, 0);
    assert_int_equal(PERP_ERROR_ARGUMENT, -1);
    assert_int_equal(PERP_ERROR_NOT_FINITE, -2);
    assert_int_equal(PERP_ERROR_MEMORY, -3);
    assert_int_equal(PERP_ERROR_ABI, -4);
    assert_int_equal(PERP_ERROR_HANDLE, -5);
    assert_int_equal(PERP_ERROR_BUSY, -6);
    assert_int_equal(PERP_ERROR_CALLBACK, -7);
}

static void test_outcome_words(void **state)
{
    static const char *const words[] = {"solved",          "rounding_limit", "ray",
                                        "iteration_limit", "time_limit",     "stalled",
                                        "singular",        "stopped",        "evaluation_failed"};
    int32_t i;

    (void)state;
    for (i = 0; i < 9; i++)
        assert_string_equal(perp_outcome_text(i), words[i]);
    assert_string_equal(perp_outcome_text(9), "unknown outcome");
    assert_string_equal(perp_outcome_text(-1), "unknown outcome");
    assert_string_equal(perp_outcome_text(INT32_MAX), "unknown outcome");
}

static void test_status_words(void **state)
{
    int32_t i, j;

    (void)state;
    assert_string_equal(perp_status_text(PERP_OK), "success");
    for (i = -7; i <= 0; i++) { /* all known, no two alike */
        assert_string_not_equal(perp_status_text(i), "unknown status");
        for (j = -7; j < i; j++)
            assert_string_not_equal(perp_status_text(i), perp_status_text(j));
    }
    assert_string_equal(perp_status_text(1), "unknown status");
    assert_string_equal(perp_status_text(-8), "unknown status");
    assert_string_equal(perp_status_text(INT32_MIN), "unknown status");
}

static void test_method_words(void **state)
{
    (void)state;
    assert_string_equal(perp_lcp_method_text(PERP_LCP_AUTO), "auto");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_LEMKE), "lemke");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_PGS), "pgs");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_FISCHER), "fischer");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_POLISH), "polish");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_PATTERNS), "patterns");
    assert_string_equal(perp_lcp_method_text(PERP_LCP_MPRGP), "mprgp");
    assert_string_equal(perp_lcp_method_text(-1), "unknown method");
    assert_string_equal(perp_lcp_method_text(INT32_MAX), "unknown method");
}

static void test_versions_agree(void **state)
{
    char expected[32];

    (void)state;
    assert_int_equal(perp_version(), PERP_VERSION);
    assert_int_equal(PERP_VERSION,
                     PERP_VERSION_MAJOR * 10000 + PERP_VERSION_MINOR * 100 + PERP_VERSION_PATCH);
    assert_int_equal(perp_abi_version(), PERP_ABI_VERSION);
    snprintf(expected, sizeof expected, "%d.%d.%d ", PERP_VERSION_MAJOR, PERP_VERSION_MINOR,
             PERP_VERSION_PATCH);
    assert_int_equal(strncmp(perp_version_text(), expected, strlen(expected)), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_status_values),  cmocka_unit_test(test_outcome_words),
        cmocka_unit_test(test_status_words),   cmocka_unit_test(test_method_words),
        cmocka_unit_test(test_versions_agree),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

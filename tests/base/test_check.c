/* Checks of arrays: what is refused, and that the message names the entry. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include "base/check.h"
#include "base/clock.h"

#include "context.h"

static void test_finite(void **state)
{
    double x[5] = {1.0, -0.0, 5e-324, 1.7976931348623157e308, 2.0};
    static const double bad[] = {NAN, INFINITY, -INFINITY};
    size_t i, k;

    (void)state;
    assert_int_equal(perp__check_finite(context, "x", x, 5), PERP_OK);
    assert_int_equal(perp__check_finite(context, "x", NULL, 0), PERP_OK);
    for (i = 0; i < 5; i++)
        for (k = 0; k < 3; k++) {
            double kept = x[i];
            char name[16];

            x[i] = bad[k];
            snprintf(name, sizeof name, "x[%zu]", i);
            assert_int_equal(perp__check_finite(context, "x", x, 5), PERP_ERROR_NOT_FINITE);
            assert_non_null(strstr(perp_context_message(context), name));
            x[i] = kept;
        }
}

/* One field of each type and pair of brackets. */
typedef struct thing {
    int32_t flag, count, choice, reserved;
    int64_t most;
    double tol, limit, share, ratio;
} thing;

static const perp__field fields[] = {
    PERP__INTEGER(thing, flag, 0, 1),
    PERP__INTEGER(thing, count, 0, INFINITY),
    PERP__INTEGER(thing, choice, -1, 3),
    PERP__INTEGER(thing, reserved, 0, 0),
    PERP__INTEGER(thing, most, 1, INFINITY),
    PERP__REAL(thing, tol, "()", 0, INFINITY),
    PERP__REAL(thing, limit, "[]", 0, INFINITY),
    PERP__REAL(thing, share, "[)", 0, 1),
    PERP__REAL(thing, ratio, "(]", 0, 0.1),
};

static const thing good = {1, 0, 3, 0, 1, 1e-300, INFINITY, 0.0, 0.1};

/* Status and message where one field differs from `good`. */
static void require_field(const thing *t, perp_status status, const char *message)
{
    assert_int_equal(PERP__CHECK_FIELDS(context, "thing", t, fields), status);
    if (message)
        assert_string_equal(perp_context_message(context), message);
}

static void test_fields(void **state)
{
    thing t = good;

    (void)state;
    require_field(&t, PERP_OK, NULL);
    t.flag = 2;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.flag is 2, expected 0 or 1");
    t = good;
    t.count = INT32_MAX;
    require_field(&t, PERP_OK, NULL);
    t.count = INT32_MIN;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.count is -2147483648, expected at least 0");
    t = good;
    t.choice = -2;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.choice is -2, expected -1 to 3");
    t.choice = 4;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.choice is 4, expected -1 to 3");
    t = good;
    t.reserved = 1;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.reserved is 1, expected 0");
    t = good;
    t.most = INT64_MAX; /* beyond 32 bits */
    require_field(&t, PERP_OK, NULL);
    t.most = INT64_C(-4294967295); /* whose low half is 1 */
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.most is -4294967295, expected at least 1");
}

static void test_fields_of_reals(void **state)
{
    thing t = good;

    (void)state;
    t.tol = -0.0;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.tol is -0, expected a number above 0");
    t.tol = INFINITY;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.tol is inf, expected a number above 0");
    t.tol = NAN;
    require_field(&t, PERP_ERROR_NOT_FINITE, "thing.tol is nan");
    t = good;
    t.limit = -5e-324;
    require_field(&t, PERP_ERROR_ARGUMENT, NULL);
    t.limit = NAN;
    require_field(&t, PERP_ERROR_NOT_FINITE, "thing.limit is nan");
    t = good;
    t.share = 1.0;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.share is 1, expected a number in [0, 1)");
    t = good;
    t.ratio = 0.0;
    require_field(&t, PERP_ERROR_ARGUMENT, "thing.ratio is 0, expected a number in (0, 0.1]");
    t.ratio = nextafter(0.1, 1.0);
    require_field(&t, PERP_ERROR_ARGUMENT, NULL);
}

static perp_status bounds(double l, double u)
{
    double lower[3] = {0, 0, 0}, upper[3] = {1, 1, 1};

    lower[1] = l;
    upper[1] = u;
    return perp__check_bounds(context, lower, upper, 3);
}

static void test_bounds(void **state)
{
    double negative = -1.0, positive = 1.0;

    (void)state;
    assert_int_equal(bounds(-INFINITY, INFINITY), PERP_OK);
    assert_int_equal(bounds(1, 1), PERP_OK);
    assert_int_equal(bounds(-0.0, 0.0), PERP_OK);
    assert_int_equal(bounds(0.0, -0.0), PERP_OK);
    assert_int_equal(bounds(INFINITY, INFINITY), PERP_ERROR_NOT_FINITE);
    assert_non_null(strstr(perp_context_message(context), "lower[1]"));
    assert_int_equal(bounds(-INFINITY, -INFINITY), PERP_ERROR_NOT_FINITE);
    assert_non_null(strstr(perp_context_message(context), "upper[1]"));
    assert_int_equal(bounds(NAN, 1), PERP_ERROR_NOT_FINITE);
    assert_int_equal(bounds(0, NAN), PERP_ERROR_NOT_FINITE);
    assert_int_equal(bounds(2, 1), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "lower[1]"));
    assert_non_null(strstr(perp_context_message(context), "upper[1]"));
    /* NULL is 0 and +inf */
    assert_int_equal(perp__check_bounds(context, NULL, NULL, 3), PERP_OK);
    assert_int_equal(perp__check_bounds(context, NULL, &negative, 1), PERP_ERROR_ARGUMENT);
    assert_int_equal(perp__check_bounds(context, &positive, NULL, 1), PERP_OK);
}

static void test_pointer(void **state)
{
    (void)state;
    assert_int_equal(perp__check_pointer(context, "q", &context), PERP_OK);
    assert_int_equal(perp__check_pointer(context, "q", NULL), PERP_ERROR_ARGUMENT);
    assert_non_null(strstr(perp_context_message(context), "q"));
}

static void test_the_clock_never_goes_backwards(void **state)
{
    double last = perp__now();
    int k;

    (void)state;
    for (k = 0; k < 1000; k++) {
        double now = perp__now();

        assert_true(now >= last);
        last = now;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_finite),
        cmocka_unit_test(test_fields),
        cmocka_unit_test(test_fields_of_reals),
        cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_pointer),
        cmocka_unit_test(test_the_clock_never_goes_backwards),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* The tests' own accumulator: what it sums is known without rounding. */
#include <float.h>
#include <math.h>

#include "suite.h"

#include "exact.h"
#include "gen.h"

static double sum_of(const double (*pairs)[2], int count, int exponent)
{
    check_sum sum;
    int k;

    check_sum_clear(&sum);
    for (k = 0; k < count; k++)
        check_sum_add(&sum, pairs[k][0], pairs[k][1]);
    return check_sum_value(&sum, exponent);
}

static void test_cancellation(void **state)
{
    static const double big[][2] = {{1e300, 1e300}, {1.5, 2.0}, {-1e300, 1e300}};
    static const double split[][2] = {{1 + DBL_EPSILON, 1 - DBL_EPSILON}, {-1, 1}};
    static const double least[][2] = {{5e-324, 5e-324}, {1e300, 1}, {-1e300, 1}};

    (void)state;
    assert_true(sum_of(big, 3, 0) == 3.0);
    assert_true(sum_of(split, 2, 0) == -0x1p-104);
    assert_true(sum_of(least, 3, 2148) == 1.0); /* 2^-1074 squared */
    assert_true(sum_of(least, 0, 0) == 0.0);
}

static void test_range(void **state)
{
    static const double largest[][2] = {{DBL_MAX, DBL_MAX}, {DBL_MAX, DBL_MAX}};
    static const double negative[][2] = {{-DBL_MAX, DBL_MAX}, {5e-324, 5e-324}};

    (void)state;
    /* 2 (2^1024 (1 - 2^-53))^2 = 2^2049 (1 - 2^-52 + ..), within two units in the last place */
    assert_true(fabs(sum_of(largest, 2, -2049) - 1.0) <= 4 * DBL_EPSILON);
    assert_true(fabs(sum_of(negative, 2, -2048) + 1.0) <= 4 * DBL_EPSILON);
    assert_true(sum_of(largest, 2, 0) == INFINITY);
    assert_true(sum_of(negative, 2, 0) == -INFINITY);
}

/* Sums of dyadic numbers are exact in double too: both ways must agree to the bit. */
static void test_against_integers(void **state)
{
    gen_random random;
    check_sum sum;
    int round, k;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 200; round++) {
        int64_t expected = 0;

        check_sum_clear(&sum);
        for (k = 0; k < 100; k++) {
            int32_t a = gen_integer(&random, 2000001) - 1000000;
            int32_t b = gen_integer(&random, 2000001) - 1000000;

            expected += (int64_t)a * b;
            check_sum_add(&sum, a * 0x1p-600, b * 0x1p500);
        }
        assert_true(check_sum_value(&sum, 100) == (double)expected);
        assert_true(check_sum_value(&sum, 90) == (double)expected * 0x1p-10); /* reads again */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cancellation),
        cmocka_unit_test(test_range),
        cmocka_unit_test(test_against_integers),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

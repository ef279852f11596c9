/* The gate: what it lets through, by its definition (docs/lcp.md, Outcomes), number by number. */
#include <float.h>
#include <stdlib.h>

#include "suite.h"

#include "base/outcome.h"

#define SOLVED PERP_OUTCOME_SOLVED
#define LIMIT PERP_OUTCOME_ROUNDING_LIMIT
#define STALLED PERP_OUTCOME_STALLED

/* tol = 2^-20 here: its root 2^-10 is a double, and what lies just above each is the next one. */
#define TOL 0x1p-20
#define ROOT 0x1p-10
#define ABOVE(x) ((x) * (1.0 + DBL_EPSILON))
/* 16 units of rounding: the bound of docs/lcp.md on a backward error that no double betters. */
#define LEAST (16.0 * DBL_EPSILON)

/* With `said` a failure the gate says that failure of what is not good. */
static void test_what_passes(void **state)
{
    static const struct {
        perp__evidence evidence; /* tested, own, backward, sound */
        perp_outcome expected;
    } cases[] = {
        {{0.0, 0.0, 0.0, 1}, SOLVED},
        {{0.0, 0.0, INFINITY, 1}, SOLVED}, /* a class without backward errors */
        {{TOL, TOL, INFINITY, 1}, SOLVED},
        {{ABOVE(TOL), 0.0, INFINITY, 1}, PERP_OUTCOME_RAY},
        {{0.0, ABOVE(TOL), INFINITY, 1}, PERP_OUTCOME_RAY},
        {{ABOVE(TOL), 0.0, LEAST, 1}, LIMIT},
        {{0.0, ABOVE(TOL), LEAST, 1}, LIMIT},
        {{ROOT, ROOT, LEAST, 1}, LIMIT},
        {{ROOT, ROOT, 0.0, 1}, LIMIT},
        {{ROOT, ROOT, ABOVE(LEAST), 1}, PERP_OUTCOME_RAY},
        {{ABOVE(ROOT), 0.0, 0.0, 1}, PERP_OUTCOME_RAY},
        {{0.0, ABOVE(ROOT), 0.0, 1}, PERP_OUTCOME_RAY},
        {{1e300, 1e300, 0.0, 1}, PERP_OUTCOME_RAY},
        /* not finite: never */
        {{INFINITY, 0.0, 0.0, 1}, PERP_OUTCOME_RAY},
        {{0.0, INFINITY, 0.0, 1}, PERP_OUTCOME_RAY},
        {{NAN, 0.0, 0.0, 1}, PERP_OUTCOME_RAY},
        {{0.0, NAN, 0.0, 1}, PERP_OUTCOME_RAY},
        {{ABOVE(TOL), 0.0, NAN, 1}, PERP_OUTCOME_RAY},
        {{NAN, NAN, NAN, 1}, PERP_OUTCOME_RAY},
        {{0.0, 0.0, NAN, 1}, SOLVED}, /* where it is not asked for it does not matter */
        /* something else speaks against it */
        {{0.0, 0.0, 0.0, 0}, PERP_OUTCOME_RAY},
        {{ROOT, ROOT, 0.0, 0}, PERP_OUTCOME_RAY},
    };
    size_t k;

    (void)state;
    for (k = 0; k < sizeof cases / sizeof *cases; k++)
        if (perp__gate(&cases[k].evidence, TOL, PERP_OUTCOME_RAY) != cases[k].expected)
            fail_msg("case %d: %s", (int)k,
                     perp_outcome_text(perp__gate(&cases[k].evidence, TOL, PERP_OUTCOME_RAY)));
}

/* A tolerance that is no number lets nothing through, and one of infinity no NaN. */
static void test_tolerances(void **state)
{
    static const perp__evidence small = {1e-3, 1e-3, INFINITY, 1}, none = {NAN, NAN, NAN, 1};

    (void)state;
    assert_int_equal(perp__gate(&small, NAN, -1), STALLED);
    assert_int_equal(perp__gate(&small, 0.0, -1), STALLED);
    assert_int_equal(perp__gate(&none, INFINITY, -1), STALLED);
}

/* The numbers decide, not the method: what it said counts for a failure only. */
static void test_what_was_said(void **state)
{
    static const perp__evidence good = {0.0, 0.0, INFINITY, 1}, bad = {1.0, 1.0, INFINITY, 1};
    static const perp__evidence limit = {ROOT, ROOT, 0.0, 1};
    int32_t said;

    (void)state;
    for (said = -1; said <= PERP_OUTCOME_EVALUATION_FAILED; said++) {
        const int32_t fails = said >= 0 && said != SOLVED && said != LIMIT;

        assert_int_equal(perp__gate(&good, TOL, said), SOLVED);
        assert_int_equal(perp__gate(&limit, TOL, said), LIMIT);
        assert_int_equal(perp__gate(&bad, TOL, said), fails ? said : STALLED);
        assert_int_equal(perp__is_good(said), said == SOLVED || said == LIMIT);
    }
}

/* Which of two is worse, for all pairs: failures over answers, rounding_limit over solved; of two
 * failures the first. */
static void test_worse_outcome(void **state)
{
    int32_t a, b;

    (void)state;
    for (a = 0; a <= PERP_OUTCOME_EVALUATION_FAILED; a++)
        for (b = 0; b <= PERP_OUTCOME_EVALUATION_FAILED; b++) {
            const int32_t rank_a = a == SOLVED ? 0 : a == LIMIT ? 1 : 2;
            const int32_t rank_b = b == SOLVED ? 0 : b == LIMIT ? 1 : 2;

            assert_int_equal(perp__worse_outcome(a, b), rank_b > rank_a ? b : a);
        }
}

static void test_raise_to(void **state)
{
    static const double values[] = {-1.0, 0.0, 1.0, INFINITY};
    double largest;
    size_t i, j;

    (void)state;
    for (i = 0; i < 4; i++) {
        for (j = 0; j < 4; j++) {
            largest = values[i];
            perp__raise_to(&largest, values[j]);
            assert_true(largest == values[i > j ? i : j]);
        }
        largest = values[i];
        perp__raise_to(&largest, NAN);
        assert_true(isnan(largest));
        perp__raise_to(&largest, values[i]);
        assert_true(isnan(largest));
    }
}

/* One entry among others, at every place. */
static void test_all_finite(void **state)
{
    static const double kinds[] = {0.0, -0.0, DBL_MAX, -DBL_MAX, 5e-324, NAN, INFINITY, -INFINITY};
    double x[20];
    size_t count, at, k, i;

    (void)state;
    assert_true(perp__all_finite(NULL, 0));
    for (count = 1; count <= 20; count++)
        for (at = 0; at < count; at++)
            for (k = 0; k < 8; k++) {
                for (i = 0; i < count; i++)
                    x[i] = i % 2 ? DBL_MAX : -1.0;
                x[at] = kinds[k];
                assert_int_equal(perp__all_finite(x, count) != 0, k < 5);
            }
    x[0] = INFINITY; /* two that would cancel */
    x[1] = -INFINITY;
    assert_false(perp__all_finite(x, 2));
    x[2] = NAN; /* what lies behind the end does not count */
    x[0] = x[1] = 1.0;
    assert_true(perp__all_finite(x, 2));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_passes),   cmocka_unit_test(test_tolerances),
        cmocka_unit_test(test_what_was_said), cmocka_unit_test(test_worse_outcome),
        cmocka_unit_test(test_raise_to),      cmocka_unit_test(test_all_finite),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

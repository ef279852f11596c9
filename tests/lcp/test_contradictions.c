/* Equations that contradict each other are no answer, however large the multipliers; and large
 * multipliers that are right are one. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "suite.h"

#include "contradictions.h"
#include "run.h"

#include "context.h"

/* PROGRAMS in the environment asks for another number of problems. */
static long count_of(long usual)
{
    const char *wanted = getenv("PROGRAMS");

    return wanted ? atol(wanted) : usual;
}

/* A contradiction may hide behind right sides that are 1e5 to 1e8 times larger, of an energy as
 * stiff as the equations, and push z that far: no double meets its rows then, with or without a
 * solution. And rows without a right side may carry it on. Right sides that a weak energy takes up,
 * or large only in the units of their rows, hide none. */
static void test_without_solution(void **state)
{
    static const double tols[] = {1e-10, 1e-6};
    static const double most[] = {0.01, 0.01}; /* 0.14 at 1e-10 without the rule */
    const long count = count_of(2000);
    long good[2] = {0, 0};
    gen_random random;

    (void)state;
    gen_seed(&random, 91);
    for (long k = 0; k < count; k++) {
        perp_lcp_settings settings = run_settings(PERP_LCP_AUTO);
        perp_lcp_result result = fresh_lcp_result();
        gen_lcp problem;

        settings.tol = tols[k % 2];
        gen_contradiction(&problem, &random, 0);
        assert_int_equal(perp_lcp_solve(context, problem.w, NULL, NULL, &result, &settings,
                                        LCP(&problem.view, problem.q, problem.lower), NULL),
                         PERP_OK);
        good[k % 2] +=
            result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
        gen_destroy(&problem);
    }
    for (int k = 0; k < 2; k++) {
        print_message("tol %g: %ld of %ld are good\n", tols[k], good[k], count / 2);
        assert_true((double)good[k] <= most[k] * (double)count / 2);
    }
}

/* The solution is one, and most are found from nowhere. */
static void test_with_solution(void **state)
{
    const long count = count_of(2000);
    long found = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 92);
    for (long k = 0; k < count; k++) {
        gen_lcp problem;
        char where[32];
        run r;

        snprintf(where, sizeof where, "twin %ld", k);
        gen_contradiction(&problem, &random, 1);
        run_lcp(&r, context, &problem, NULL, problem.z, where);
        if (!run_ok(&r))
            fail_msg("%s, from its solution: %s", where, perp_outcome_text(r.result.outcome));
        run_release(&r);
        run_lcp(&r, context, &problem, NULL, NULL, where);
        found += run_ok(&r);
        run_release(&r);
        gen_destroy(&problem);
    }
    print_message("%ld of %ld are found\n", found, count);
    assert_true(found >= count * 95 / 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_solution),
        cmocka_unit_test(test_with_solution),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

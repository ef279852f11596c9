/* Every problem of the zoo from every start without its Jacobian: by differences, auto reaches the
 * same 1e-12 of F's size as with it, and one of the solutions where all are known. */
#include "problems.h"

#include "suite.h"

#include <stdlib.h>
#include <string.h>

#include "context.h"

/* max |z - z*| over 1 + |z*|, of the nearest solution that is stated */
static double apart(const zoo_problem *p, const double *z)
{
    double least = INFINITY;

    for (int32_t s = 0; s < p->solution_count; s++) {
        const double *solution = p->solutions + (ptrdiff_t)s * p->n;
        double most = 0;

        for (int32_t i = 0; i < p->n; i++)
            most = fmax(most, fabs(z[i] - solution[i]) / (1 + fabs(solution[i])));
        least = fmin(least, most);
    }
    return least;
}

static void solve(const zoo_entry *entry, zoo_problem *p, int32_t start)
{
    perp_ncp_problem problem = fresh_ncp_problem();
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_result result = fresh_ncp_result();
    double *z = zoo_memory((size_t)p->n, sizeof *z), *w = zoo_memory((size_t)p->n, sizeof *w);
    double residual;

    zoo_view(p, &problem);
    problem.jacobian = NULL;
    assert_int_equal(perp_ncp_solve(context, z, w, &result, &settings, &problem,
                                    p->starts + (ptrdiff_t)start * p->n),
                     PERP_OK);
    residual = zoo_residual(p, z, w);
    if (result.outcome != PERP_OUTCOME_SOLVED || !(residual <= 1e-12 * p->scale))
        fail_msg("%s from start %d: %s, natural residual %g of %g", entry->name, (int)start,
                 perp_outcome_text(result.outcome), residual, p->scale);
    assert_int_equal(result.trapped, 0);
    /* stated to 10 digits or better; conditions are below 1e4 of a residual of 1e-12 */
    if (entry->knowledge == ZOO_ALL && !(apart(p, z) <= 1e-7))
        fail_msg("%s from start %d: solved, but %g from any solution", entry->name, (int)start,
                 apart(p, z));
    free(w);
    free(z);
}

/* Without the Jacobians. Those with large n take many calls, and show nothing more. */
static void test_zoo_by_differences(void **state)
{
    int32_t count;
    const zoo_entry *table = zoo_table(&count);

    (void)state;
    for (int32_t k = 0; k < count; k++) {
        zoo_problem *p = zoo_create(&table[k], table[k].size);

        for (int32_t s = 0; s < p->start_count && p->n <= 100; s++)
            solve(&table[k], p, s);
        zoo_destroy(p);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_zoo_by_differences),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* `auto` on every problem of the zoo from every start; what it says is judged by problems.c. */
#include "problems.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

static perp_context *context;

static int make(void **state)
{
    (void)state;
    return perp_context_create(&context, NULL);
}

static int destroy(void **state)
{
    (void)state;
    perp_context_destroy(context);
    return 0;
}

static perp_ncp_solver *make_solver(zoo_problem *problem, int32_t method)
{
    perp_ncp_problem view;
    perp_ncp_settings settings;
    perp_ncp_solver *solver = NULL;
    assert_int_equal(perp_ncp_problem_init(&view, sizeof view), PERP_OK);
    assert_int_equal(perp_ncp_settings_init(&settings, sizeof settings), PERP_OK);
    settings.method = method;
    zoo_view(problem, &view);
    assert_int_equal(perp_ncp_solver_create(context, &solver, &settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(solver, &view), PERP_OK);
    return solver;
}

static double distance_to_solutions(const zoo_problem *problem, const double *z)
{
    double nearest = INFINITY;
    for (int32_t k = 0; k < problem->solution_count; k++) {
        const double *solution = problem->solutions + (ptrdiff_t)problem->n * k;
        double distance = 0;
        for (int32_t i = 0; i < problem->n; i++)
            distance = fmax(distance, fabs(z[i] - solution[i]) / (1 + fabs(solution[i])));
        nearest = fmin(nearest, distance);
    }
    return nearest;
}

/* A continuum of solutions may go on to large z, and F's terms grow with it. */
static double scale_at(const zoo_problem *problem, const zoo_entry *entry, const double *z)
{
    double scale = problem->scale;
    for (int32_t i = 0; entry->knowledge == ZOO_FAMILY && i < problem->n; i++)
        scale = fmax(scale, fabs(z[i]));
    return scale;
}

/* What is wrong with the answer, or NULL. */
static const char *complaint(const zoo_problem *problem, const zoo_entry *entry, const double *z,
                             const double *w, const perp_ncp_result *result)
{
    static char text[200];
    double *F = problem->scratch, residual, distance;
    int solved =
        result->outcome == PERP_OUTCOME_SOLVED || result->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    for (int32_t i = 0; i < problem->n; i++)
        if (!(z[i] >= problem->lower[i] && z[i] <= problem->upper[i]))
            return "z is not within its bounds";
    if (problem->equations(problem, z, F, NULL) != 0)
        return solved ? "z is outside of the domain" : "not solved";
    if (memcmp(w, F, (size_t)problem->n * sizeof *w) != 0)
        return "w is not F(z)";
    residual = zoo_residual(problem, z, F);
    /* the same formula in the library, so the same number but for the order of its roundings */
    if (!(fabs(result->natural_residual - residual) <= 1e-14 * (problem->scale + residual)))
        return "natural_residual is not what it is";
    if (!solved) {
        snprintf(text, sizeof text, "%s, trapped %d, natural residual %.1e",
                 perp_outcome_text(result->outcome), (int)result->trapped, residual);
        return entry->trap && result->trapped ? NULL : text;
    }
    if (!(residual <= 1e-12 * scale_at(problem, entry, z))) {
        snprintf(text, sizeof text, "%s with natural residual %.1e, scale %.1e",
                 perp_outcome_text(result->outcome), residual, problem->scale);
        return text;
    }
    /* 1e-8: what a residual of 1e-12 is worth for the worst of these Jacobians; at a singular one
     * the residual is quadratic in the distance */
    distance = distance_to_solutions(problem, z);
    if ((entry->knowledge == ZOO_ALL && !(distance <= 1e-8)) ||
        (entry->knowledge == ZOO_SINGULAR && !(distance <= 1e-4))) {
        snprintf(text, sizeof text, "solved, but %.1e from every solution there is", distance);
        return text;
    }
    return NULL;
}

/* Tells all failures before it fails. */
static int run_entry(const zoo_entry *entry, int32_t method)
{
    zoo_problem *problem = zoo_create(entry, entry->size);
    perp_ncp_solver *solver = make_solver(problem, method);
    double *z = zoo_memory((size_t)problem->n, sizeof *z);
    double *w = zoo_memory((size_t)problem->n, sizeof *w);
    int failures = 0;
    for (int32_t k = 0; k < problem->start_count; k++) {
        perp_ncp_result result;
        const char *wrong;
        assert_int_equal(perp_ncp_result_init(&result, sizeof result), PERP_OK);
        perp_status status = perp_ncp_solver_solve(solver, z, w, &result,
                                                   problem->starts + (ptrdiff_t)problem->n * k);
        wrong = status == PERP_OK ? complaint(problem, entry, z, w, &result)
                                  : perp_context_message(context);
        if (wrong) {
            print_error("%s, start %d: %s\n", entry->name, (int)k, wrong);
            failures++;
        }
    }
    free(w);
    free(z);
    perp_ncp_solver_destroy(solver);
    zoo_destroy(problem);
    return failures;
}

static void auto_solves_all_from_every_start(void **state)
{
    int32_t count;
    const zoo_entry *table = zoo_table(&count);
    int failures = 0;
    (void)state;
    for (int32_t e = 0; e < count; e++)
        failures += run_entry(&table[e], PERP_NCP_AUTO);
    assert_int_equal(failures, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(auto_solves_all_from_every_start),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}

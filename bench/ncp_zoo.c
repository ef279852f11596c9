/* The problems of tests/ncp/problems.h at two sizes, by each method: 'solved' of so many starts,
 * and what the first of them took: Newton steps, calls of F and J (by callback), perturbed starts,
 * the natural residual in the problem's own units, and the median of three in ms. 'nonzeros' is the
 * Jacobian's pattern. A capital T marks a point where the merit function has trapped the method.
 * A solve has twenty seconds. Problems whose source begins with 'in the manner of' have data of our
 * own. */
#include "measure.h"

#include "../tests/ncp/problems.h"

#define TIME_LIMIT 20.0 /* seconds a solve */

static void print_row(const zoo_problem *problem, int32_t method, int solved,
                      const perp_ncp_result *result, double time)
{
    printf("%-18s %6d %7d %-8s %d/%d %-8s %-17s %c %6lld %7lld %6lld %3d %9.1e %10.3f\n",
           problem->name, problem->n, problem->nonzeros, perp_ncp_method_text(method), solved,
           problem->start_count, perp_ncp_method_text(result->method),
           perp_outcome_text(result->outcome), result->trapped ? 'T' : ' ',
           (long long)result->iterations, (long long)result->function_evaluations,
           (long long)result->jacobian_evaluations, result->restarts, result->natural_residual,
           1e3 * time);
    fflush(stdout);
}

/* All starts once, the first three times more unless it takes long. */
static void measure(perp_context *context, zoo_problem *problem, int32_t method)
{
    perp_ncp_settings settings;
    perp_ncp_problem view;
    perp_ncp_result first, result;
    perp_ncp_solver *solver = NULL;
    double *z = require_memory((size_t)problem->n * sizeof *z), times[3];
    int solved = 0, repeats = 0;
    perp_ncp_settings_init(&settings, sizeof settings);
    perp_struct_init(&view, sizeof view);
    perp_struct_init(&first, sizeof first);
    perp_struct_init(&result, sizeof result);
    settings.method = method;
    settings.time_limit = TIME_LIMIT;
    zoo_view(problem, &view);
    require(perp_ncp_solver_create(context, &solver, &settings) == PERP_OK, "no solver");
    require(perp_ncp_solver_setup(solver, &view) == PERP_OK, perp_context_message(context));
    for (int32_t k = 0; k < problem->start_count; k++) {
        const double *start = problem->starts + (ptrdiff_t)problem->n * k;
        perp_status status = perp_ncp_solver_solve(solver, z, NULL, &result, start);
        require(status == PERP_OK, perp_context_message(context));
        solved +=
            result.outcome == PERP_OUTCOME_SOLVED || result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
        if (k == 0)
            first = result;
    }
    times[repeats++] = first.seconds;
    while (repeats < 3 && first.seconds < 1) {
        require(perp_ncp_solver_solve(solver, z, NULL, &result, problem->starts) == PERP_OK,
                "a solve that went well before");
        times[repeats++] = result.seconds;
    }
    print_row(problem, method, solved, &first, median(times, repeats));
    perp_ncp_solver_destroy(solver);
    free(z);
}

/* ncp_zoo [PROBLEM]: all of them, or one. */
int main(int arguments, char **argument)
{
    static const int32_t methods[] = {PERP_NCP_AUTO, PERP_NCP_FISCHER, PERP_NCP_JOSEPHY};
    double gflops, gbytes;
    int32_t count;
    perp_context *context = NULL;
    const zoo_entry *table = zoo_table(&count);
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%-18s %6s %7s %-8s %s %-8s %-17s   %6s %7s %6s %3s %9s %10s\n", "problem", "n",
           "nonzeros", "method", "solved", "by", "outcome", "steps", "F", "J", "re.", "residual",
           "ms");
    for (int32_t e = 0; e < count; e++) {
        if (arguments > 1 && strcmp(argument[1], table[e].name) != 0)
            continue;
        for (int large = 0; large <= (table[e].large > 0); large++) {
            zoo_problem *problem = zoo_create(&table[e], large ? table[e].large : table[e].size);
            for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
                measure(context, problem, methods[m]);
            zoo_destroy(problem);
        }
    }
    printf("\nsources\n");
    for (int32_t e = 0; e < count; e++)
        printf("%-18s %s\n", table[e].name, table[e].source);
    perp_context_destroy(context);
    return 0;
}

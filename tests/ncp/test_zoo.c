/* `auto` on every problem of the zoo from every start; what it says is judged by problems.c. */
#include "problems.h"

#include <stdio.h>

#include "suite.h"

#include <stdlib.h>
#include <string.h>

#include "context.h"

static perp_ncp_solver *make_solver(zoo_problem *problem, int32_t method)
{
    perp_ncp_problem view = fresh_ncp_problem();
    perp_ncp_settings settings = fresh_ncp_settings();
    perp_ncp_solver *solver = NULL;
    settings.method = method;
    zoo_view(problem, &view);
    assert_int_equal(perp_ncp_solver_create(context, &solver, &settings), PERP_OK);
    assert_int_equal(perp_ncp_solver_setup(solver, &view), PERP_OK);
    return solver;
}

/* To the nearest stated solution; to the first answer where there is only one, not stated. */
static double distance_to_solutions(zoo_problem *problem, const zoo_entry *entry, const double *z)
{
    double nearest = INFINITY;
    if (entry->knowledge == ZOO_UNIQUE && problem->solution_count == 0)
        zoo_set(zoo_solution(problem), z, problem->n);
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
static const char *complaint(zoo_problem *problem, const zoo_entry *entry, const double *z,
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
    distance = distance_to_solutions(problem, entry, z);
    int only = entry->knowledge == ZOO_ALL || entry->knowledge == ZOO_UNIQUE;
    if ((only && !(distance <= 1e-8)) ||
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
        perp_ncp_result result = fresh_ncp_result();
        const char *wrong;
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

/* Solves an entry from one of its starts and hands back z, which the caller frees. */
static double *solve_from(int32_t method, const char *name, int32_t size, int32_t start,
                          zoo_problem **problem, int32_t *by)
{
    int32_t count, e = 0;
    const zoo_entry *table = zoo_table(&count);
    perp_ncp_result result = fresh_ncp_result();
    while (strcmp(table[e].name, name) != 0)
        assert_true(++e < count);
    *problem = zoo_create(&table[e], size);
    perp_ncp_solver *solver = make_solver(*problem, method);
    double *z = zoo_memory((size_t)(*problem)->n, sizeof *z);
    const double *z0 = (*problem)->starts + (ptrdiff_t)(*problem)->n * start;
    assert_int_equal(perp_ncp_solver_solve(solver, z, NULL, &result, z0), PERP_OK);
    assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
    *by = result.method;
    perp_ncp_solver_destroy(solver);
    return z;
}

static double *solve_by(int32_t method, const char *name, int32_t size, zoo_problem **problem,
                        int32_t *by)
{
    return solve_from(method, name, size, 0, problem, by);
}

static double *solve(const char *name, int32_t size, zoo_problem **problem)
{
    int32_t by;
    return solve_by(PERP_NCP_AUTO, name, size, problem, &by);
}

/* From n = 1000 on, where the Jacobian is like Laplace's, auto begins with josephy; fischer alone
 * comes to the same. 1e-10: residuals of 1e-15 times the inverse of Laplace's matrix, n / 8. */
static void large_obstacles_begin_with_josephy(void **state)
{
    static const char *const names[] = {"obstacle-2d", "torsion", "bearing"};
    static const int32_t sizes[] = {31 * 31, 33 * 33};
    (void)state;
    for (int32_t k = 0; k < 3; k++)
        for (int32_t s = 0; s < 2; s++) {
            zoo_problem *problem, *again;
            int32_t by, other;
            double *z = solve_by(PERP_NCP_AUTO, names[k], sizes[s], &problem, &by);
            double *y = solve_by(PERP_NCP_FISCHER, names[k], sizes[s], &again, &other);
            assert_int_equal(by, s == 0 ? PERP_NCP_FISCHER : PERP_NCP_JOSEPHY);
            for (int32_t i = 0; i < problem->n; i++)
                assert_true(fabs(z[i] - y[i]) <= 1e-10);
            free(z);
            free(y);
            zoo_destroy(problem);
            zoo_destroy(again);
        }
}

/* A full step from this start leads to where viscosity is exp(20) and the linear problem has no
 * solution: josephy goes back at once, where it was lost for minutes. There are several solutions;
 * 1e-12 as for all. */
static void josephy_comes_back_from_where_trust_has_led(void **state)
{
    zoo_problem *problem;
    int32_t by;
    double *z = solve_from(PERP_NCP_JOSEPHY, "bearing-barus", 70 * 70, 2, &problem, &by);
    (void)state;
    assert_int_equal(problem->equations(problem, z, problem->scratch, NULL), 0);
    assert_true(zoo_residual(problem, z, problem->scratch) <= 1e-12 * problem->scale);
    free(z);
    zoo_destroy(problem);
}

/* On a large network fischer gains nothing in 20 steps, and josephy, whose turn it is then, takes
 * less than ten: 60 are enough. Of fischer's own it would be more than 150, from one start. 1e-12
 * as for all. */
static void what_gains_nothing_makes_way(void **state)
{
    int32_t count;
    const zoo_entry *entry = zoo_table(&count);
    perp_ncp_solver *solver;
    perp_ncp_result result = fresh_ncp_result();
    zoo_problem *problem;
    double *z;
    (void)state;
    while (strcmp(entry->name, "traffic-grid") != 0)
        entry++;
    problem = zoo_create(entry, 2000);
    solver = make_solver(problem, PERP_NCP_AUTO);
    z = zoo_memory((size_t)problem->n, sizeof *z);
    for (int32_t k = 0; k < problem->start_count; k++) {
        const double *z0 = problem->starts + (ptrdiff_t)problem->n * k;
        assert_int_equal(perp_ncp_solver_solve(solver, z, NULL, &result, z0), PERP_OK);
        assert_int_equal(result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(result.iterations <= 60);
        assert_int_equal(problem->equations(problem, z, problem->scratch, NULL), 0);
        assert_true(zoo_residual(problem, z, problem->scratch) <= 1e-12 * problem->scale);
    }
    perp_ncp_solver_destroy(solver);
    free(z);
    zoo_destroy(problem);
}

/* The height of the exact membrane at distance 1 from the middle, and u(1/2) of Bratu's equation
 * (both closed forms). Bratu's error is of second order: a grid twice as fine is four times as
 * good; the membrane's free boundary falls between the nodes, so it is only better. */
static void grids_come_near_the_continuum(void **state)
{
    double error[2][2];
    (void)state;
    for (int32_t fine = 0; fine < 2; fine++) {
        const int32_t k = fine ? 47 : 23, half = k / 2;
        zoo_problem *problem;
        double *z = solve("obstacle-2d", k * k, &problem);
        /* the node a quarter of the width to the right of the middle */
        error[0][fine] = fabs(z[half * k + half + (k + 1) / 4] - 0.47151989340211012);
        free(z);
        zoo_destroy(problem);
        z = solve("bratu-1d", k, &problem);
        error[1][fine] = fabs(z[half] - 0.32895242134111357);
        free(z);
        zoo_destroy(problem);
    }
    assert_true(error[0][0] < 1e-3 && error[0][1] < error[0][0]);
    assert_true(error[1][0] < 5e-4 && fabs(error[1][0] / error[1][1] - 4) < 0.1);
}

/* The cost of the bounded torques by shooting: L-BFGS-B of SciPy on the forty torques alone, from
 * three starts, the same to 15 digits. */
static void the_pendulum_is_brought_to_rest_at_least_cost(void **state)
{
    zoo_problem *problem;
    double *z = solve("pendulum-control", 200, &problem), cost = 0;
    (void)state;
    for (int32_t s = 0; s < 40; s++) {
        const double *y = z + 5 * s;
        cost += 0.125 * (y[0] * y[0] + 0.1 * y[1] * y[1] + 0.1 * y[2] * y[2]);
    }
    assert_true(fabs(cost - 1.564447544763453) <= 1e-13);
    free(z);
    zoo_destroy(problem);
}

/* Largest pressure and the constant of the gap: Newton's method on the active set with the
 * equations written anew in NumPy; the Jacobian's condition is 5e6. */
static void the_film_carries_its_load(void **state)
{
    zoo_problem *problem;
    double *z = solve("ehl-kost", 100, &problem), most = 0;
    (void)state;
    for (int32_t i = 0; i < 100; i++)
        most = fmax(most, z[i]);
    assert_true(fabs(most - 1.06575503175483) <= 1e-11);
    assert_true(fabs(z[100] - 1.14831728713428) <= 1e-11);
    free(z);
    zoo_destroy(problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(auto_solves_all_from_every_start),
        cmocka_unit_test(large_obstacles_begin_with_josephy),
        cmocka_unit_test(josephy_comes_back_from_where_trust_has_led),
        cmocka_unit_test(what_gains_nothing_makes_way),
        cmocka_unit_test(grids_come_near_the_continuum),
        cmocka_unit_test(the_pendulum_is_brought_to_rest_at_least_cost),
        cmocka_unit_test(the_film_carries_its_load),
    };
    return cmocka_run_group_tests(tests, make, destroy);
}

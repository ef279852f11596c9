/* Active sets on large sparse problems, nested iteration included: against closed forms, Newton's
 * method and each other's order of the unknowns. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "grids.h"
#include "run.h"

#include "context.h"

static void make_grid(gen_lcp *problem, gen_random *random, const grid_options *options)
{
    const int32_t n = options->size[0] * options->size[1] * options->size[2];
    grid_options own = *options;

    own.place = check_allocate(3 * (size_t)n, sizeof(double));
    grid_problem(problem, random, &own);
    grid_load(problem, own.place, options->size[0]);
    free(own.place);
}

/* Solves by this method alone; fails the test if it does not. */
static void solve(run *r, const gen_lcp *problem, int32_t method, const char *name)
{
    perp_lcp_settings settings = run_settings(method);
    char where[96];

    snprintf(where, sizeof where, "%s, %s", name, perp_lcp_method_text(method));
    run_lcp(r, context, problem, &settings, NULL, where);
    if (!run_ok(r))
        fail_msg("%s: %s, residual %g", where, perp_outcome_text(r->result.outcome),
                 r->result.residual);
}

static double largest(const double *z, int32_t n)
{
    double most = 0.0;
    int32_t i;

    for (i = 0; i < n; i++)
        most = fmax(most, fabs(z[i]));
    return most;
}

/* One problem by active sets and by Newton's method. Both end with a backward error of a few eps,
 * so that they differ by some cond(M) eps: 1e4 times that is allowed for jumps of 1e4. */
static void compare(const gen_lcp *problem, int64_t most, const char *name)
{
    run own, newton;
    double distance;

    solve(&own, problem, PERP_LCP_ACTIVE_SET, name);
    solve(&newton, problem, PERP_LCP_FISCHER, name);
    distance = run_distance(own.z, newton.z, problem->n);
    if (!(distance <= 1e-8 * largest(own.z, problem->n)))
        fail_msg("%s: off by %g of %g", name, distance, largest(own.z, problem->n));
    if (own.result.iterations > most)
        fail_msg("%s: %d steps", name, (int)own.result.iterations);
    run_release(&own);
    run_release(&newton);
}

/* Steps of active sets alone would be in proportion to the side of the grid; most is twice what
 * nested iteration takes. The first of each pair is too small for it, the second large enough. */
typedef struct scene {
    const char *name;
    grid_options options;
    int64_t most;
} scene;

static const scene scenes[] = {
    {"plane, small", {{40, 40, 1}, {0}, 0, 0, 0, NULL}, 40},
    {"plane", {{66, 62, 1}, {0}, 0, 0, 0, NULL}, 12},
    {"permuted, small", {{40, 40, 1}, {0}, 0, 0, 1, NULL}, 40},
    {"permuted", {{66, 62, 1}, {0}, 0, 0, 1, NULL}, 12},
    {"space", {{17, 18, 16}, {0}, 0, 0, 0, NULL}, 12},
    {"weak in one direction", {{66, 62, 1}, {1, 1e-3, 0}, 0, 0, 0, NULL}, 12},
    {"strong in one direction", {{66, 62, 1}, {1, 1e3, 0}, 0, 0, 1, NULL}, 16},
    {"jumps of 100", {{66, 62, 1}, {0}, 2, 0, 0, NULL}, 16},
    {"jumps of 10000", {{66, 62, 1}, {0}, 4, 0, 1, NULL}, 40},
    {"wind", {{40, 30, 1}, {0}, 0, 1, 0, NULL}, 10},
    {"a storm", {{60, 60, 1}, {0}, 0, 30, 0, NULL}, 10},
    {"a storm, nodes in random order", {{60, 60, 1}, {0}, 0, 30, 1, NULL}, 12},
    {"wind in space", {{16, 16, 16}, {0}, 0, 3, 0, NULL}, 10},
};

enum { SCENES = sizeof scenes / sizeof *scenes };

/* Obstacles below; above; on both sides; on both with free and fixed variables among them. */
static void set_bounds(gen_lcp *problem, gen_random *random, int which)
{
    const double size = 0.004;
    int32_t i;

    for (i = 0; i < problem->n && which > 0; i++) {
        const int32_t kind = which == 3 ? gen_integer(random, 40) : 39;

        problem->lower[i] = which == 1 ? -INFINITY : -size;
        problem->upper[i] = size / 2;
        if (kind == 0)
            problem->lower[i] = problem->upper[i] = gen_uniform(random, -size, size);
        else if (kind < 4)
            problem->upper[i] = INFINITY;
        else if (kind < 8)
            problem->lower[i] = -INFINITY;
    }
}

static void test_grids(void **state)
{
    gen_random random;
    char name[64];
    int s, bounds;

    (void)state;
    gen_seed(&random, 131);
    for (s = 0; s < SCENES; s++)
        for (bounds = 0; bounds < (s < 2 ? 4 : 1); bounds++) {
            gen_lcp problem;

            make_grid(&problem, &random, &scenes[s].options);
            set_bounds(&problem, &random, bounds);
            snprintf(name, sizeof name, "%s, bounds %d", scenes[s].name, bounds);
            compare(&problem, scenes[s].most, name);
            gen_destroy(&problem);
        }
}

/* The membrane over a hemisphere, flat at r = 2: the free part is harmonic outside of the contact
 * radius a, a^2 (1 - ln(a / 2)) = 1. The grid's own error is of order h^2 with h = 4 / 101 and a
 * jump of the second derivative at a: 7e-3 at 16 by 16 nodes, 1e-3 here. */
static void test_membrane(void **state)
{
    static const grid_options options = {{100, 100, 1}, {0}, 0, 0, 0, NULL};
    const double a = 0.69796514822337357, h = 4.0 / 101;
    gen_random random;
    gen_lcp problem;
    double error = 0.0;
    int32_t i, k;
    run r;

    (void)state;
    gen_seed(&random, 132);
    grid_problem(&problem, &random, &options);
    for (i = 0; i < problem.n; i++) {
        const double x = h * (i % 100 + 1) - 2, y = h * (i / 100 + 1) - 2, square = x * x + y * y;
        const double beyond[4][2] = {{x - h, y}, {x + h, y}, {x, y - h}, {x, y + h}};

        problem.lower[i] = square < 1 ? sqrt(1 - square) : -INFINITY;
        for (k = 0; k < 4; k++)
            if (fabs(beyond[k][0]) > 2 - h / 2 || fabs(beyond[k][1]) > 2 - h / 2)
                problem.q[i] +=
                    a * a / sqrt(1 - a * a) * log(hypot(beyond[k][0], beyond[k][1]) / 2);
    }
    solve(&r, &problem, PERP_LCP_AUTO, "membrane");
    assert_int_equal(r.result.method, PERP_LCP_ACTIVE_SET);
    for (i = 0; i < problem.n; i++) {
        const double radius = hypot(h * (i % 100 + 1) - 2, h * (i / 100 + 1) - 2);
        const double exact =
            radius <= a ? sqrt(1 - radius * radius) : -a * a / sqrt(1 - a * a) * log(radius / 2);

        error = fmax(error, fabs(r.z[i] - exact));
    }
    assert_true(error <= 2e-3);
    run_release(&r);
    gen_destroy(&problem);
}

/* A plate of side x side nodes that bends: the biharmonic operator, the square of the Laplacian. */
static void make_plate(gen_lcp *plate, int32_t side)
{
    const grid_options options = {{side, side, 1}, {0}, 0, 0, 0, NULL};
    gen_random random;
    gen_lcp plane;
    int32_t n, count = 0;
    double *column;

    gen_seed(&random, 133);
    make_grid(&plane, &random, &options);
    make_grid(plate, &random, &options);
    n = plane.n;
    column = check_allocate((size_t)n, sizeof *column);
    free(plate->values);
    free(plate->row_indices);
    plate->values = check_allocate(13 * (size_t)n, sizeof(double));
    plate->row_indices = check_allocate(13 * (size_t)n, sizeof(int32_t));
    for (int32_t j = 0; j < n; j++) {
        for (int32_t k = plane.column_starts[j]; k < plane.column_starts[j + 1]; k++)
            for (int32_t i = plane.row_indices[k], m = plane.column_starts[i];
                 m < plane.column_starts[i + 1]; m++)
                column[plane.row_indices[m]] += plane.values[k] * plane.values[m];
        plate->column_starts[j] = count;
        for (int32_t i = 0; i < n; i++)
            if (column[i] != 0.0) {
                plate->row_indices[count] = i;
                plate->values[count++] = column[i];
                column[i] = 0.0;
            }
    }
    plate->column_starts[n] = count;
    assert_int_equal(perp_matrix_csc(&plate->view, n, n, plate->column_starts, plate->row_indices,
                                     plate->values),
                     PERP_OK);
    free(column);
    gen_destroy(&plane);
}

/* The biharmonic operator is no M-matrix: active sets as they are, or another method. */
static void test_plate(void **state)
{
    gen_lcp plate;
    run r;

    (void)state;
    make_plate(&plate, 36);
    for (int32_t i = 0; i < plate.n; i++)
        plate.lower[i] = -0.02;
    solve(&r, &plate, PERP_LCP_AUTO, "plate");
    run_release(&r);
    gen_destroy(&plate);
}

/* A plate that a dome lifts: exchanges alone lower the number of wrong signs with each of them, by
 * a few, and take as many as the mesh is wide. The penalty's way takes no more on a finer
 * mesh: eleven exchanges to see that they creep, one step for each of 14 penalties, and some to
 * end. With as many for a penalty as its set takes to settle, they were 41. */
static void test_lifted_plate(void **state)
{
    enum { SIDE = 150, MOST = 36 };
    gen_lcp plate;
    run r;

    (void)state;
    make_plate(&plate, SIDE);
    for (int32_t i = 0; i < plate.n; i++) {
        const double x = (i % SIDE + 1) / (SIDE + 1.0) - 0.5;
        const double y = (i / SIDE + 1) / (SIDE + 1.0) - 0.5;

        plate.lower[i] = 0.05 - (x * x + y * y);
        plate.q[i] = 50.0 / pow(SIDE + 1.0, 4);
    }
    solve(&r, &plate, PERP_LCP_ACTIVE_SET, "lifted plate");
    assert_true(r.result.iterations <= MOST);
    run_release(&r);
    gen_destroy(&plate);
}

/* Beams on two supports (u = u'' = 0) under a uniform load f, over a flat floor at depth d: the
 * free spans at the ends have length a with d = f a^4 / 24, and there, with s from where the beam
 * lifts off, u = -d + f a s^3 / 12 - f s^4 / 24. Exchanges alone move the ends of the contact by
 * about a node a step, more than the 500 that there are. */
static void test_beams(void **state)
{
    enum { LEAST = 1000, MORE = 500 };
    static const double stencil[] = {1, -4, 6, -4, 1};
    gen_random random;

    (void)state;
    gen_seed(&random, 134);
    for (int32_t k = 0; k < 8; k++) {
        const int32_t n = LEAST + gen_integer(&random, MORE);
        const double h = 1.0 / (n + 1), a = gen_uniform(&random, 0.15, 0.45);
        const double f = pow(10.0, gen_uniform(&random, -3, 3)), d = f * pow(a, 4) / 24.0;
        int32_t at = 0;
        gen_lcp beam;
        double error = 0.0;
        run r;

        gen_begin(&beam, n);
        beam.column_starts = gen_allocate((size_t)n + 1, sizeof(int32_t));
        beam.row_indices = gen_allocate(5 * (size_t)n, sizeof(int32_t));
        beam.values = gen_allocate(5 * (size_t)n, sizeof(double));
        beam.lower = gen_allocate((size_t)n, sizeof(double));
        for (int32_t j = 0; j < n; j++) {
            beam.column_starts[j] = at;
            for (int32_t i = j > 2 ? j - 2 : 0; i < n && i <= j + 2; i++) {
                beam.row_indices[at] = i;
                beam.values[at++] = i == j && (j == 0 || j == n - 1) ? 5.0 : stencil[i - j + 2];
            }
            beam.q[j] = f * pow(h, 4);
            beam.lower[j] = -d;
        }
        beam.column_starts[n] = at;
        assert_int_equal(perp_struct_init(&beam.view, sizeof beam.view), PERP_OK);
        assert_int_equal(
            perp_matrix_csc(&beam.view, n, n, beam.column_starts, beam.row_indices, beam.values),
            PERP_OK);
        solve(&r, &beam, PERP_LCP_ACTIVE_SET, "beam");
        for (int32_t i = 0; i < n; i++) {
            const double x = (i + 1) * h, s = fmax(a - fmin(x, 1.0 - x), 0.0);

            error = fmax(error, fabs(r.z[i] + d - f * pow(s, 3) * (a / 12.0 - s / 24.0)));
        }
        assert_true(error <= 0.02 * d); /* differences of a span with a n >= 150 nodes, first order
                                           where it ends */
        run_release(&r);
        gen_destroy(&beam);
    }
}

/* Loads that vanish where the membrane touches: z = w = 0 in whole regions. Which of those
 * variables count as free is arbitrary; that they are zero is not. */
static void test_degenerate(void **state)
{
    static const grid_options options = {{80, 80, 1}, {0}, 0, 0, 1, NULL};
    gen_random random;
    gen_lcp problem;
    int32_t i, zeros = 0;
    run r;

    (void)state;
    gen_seed(&random, 134);
    make_grid(&problem, &random, &options);
    for (i = 0; i < problem.n; i++)
        problem.q[i] = problem.q[i] > 0 ? 0.0 : problem.q[i];
    for (i = 0; i < problem.n; i++) /* a wall through the middle */
        if (gen_integer(&random, 3) == 0)
            problem.upper[i] = problem.lower[i] = 0.0;
    solve(&r, &problem, PERP_LCP_ACTIVE_SET, "degenerate");
    for (i = 0; i < problem.n; i++)
        zeros += r.z[i] == 0.0;
    assert_true(zeros >= problem.n / 3);
    run_release(&r);
    gen_destroy(&problem);
}

/* Starts near the solution and far from it, limits, a polish that is left out. */
static void test_starts_and_limits(void **state)
{
    static const grid_options options = {{80, 80, 1}, {0}, 0, 0, 0, NULL};
    perp_lcp_settings settings = run_settings(PERP_LCP_ACTIVE_SET);
    gen_random random;
    gen_lcp problem;
    double *far;
    run first, again;
    int32_t i;

    (void)state;
    gen_seed(&random, 135);
    make_grid(&problem, &random, &options);
    solve(&first, &problem, PERP_LCP_ACTIVE_SET, "cold");
    run_lcp(&again, context, &problem, &settings, first.z, "near");
    assert_true(run_ok(&again) && again.result.iterations <= 3);
    run_release(&again);
    far = check_allocate((size_t)problem.n, sizeof *far);
    for (i = 0; i < problem.n; i++)
        far[i] = gen_uniform(&random, -1, 1);
    run_lcp(&again, context, &problem, &settings, far, "far");
    assert_true(run_ok(&again));
    assert_true(run_distance(first.z, again.z, problem.n) <= 1e-12);
    run_release(&again);
    settings.polish = 0;
    run_lcp(&again, context, &problem, &settings, NULL, "not polished");
    assert_true(run_ok(&again));
    run_release(&again);
    settings.max_iterations = 1;
    run_lcp(&again, context, &problem, &settings, NULL, "one step");
    assert_int_equal(again.result.outcome, PERP_OUTCOME_ITERATION_LIMIT);
    assert_int_equal(again.result.iterations, 1);
    run_release(&again);
    free(far);
    run_release(&first);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grids),
        cmocka_unit_test(test_membrane),
        cmocka_unit_test(test_plate),
        cmocka_unit_test(test_lifted_plate),
        cmocka_unit_test(test_beams),
        cmocka_unit_test(test_degenerate),
        cmocka_unit_test(test_starts_and_limits),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

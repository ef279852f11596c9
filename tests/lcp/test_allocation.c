/* Memory: every allocation may fail, nothing is lost, and a second solve asks for none. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "grids.h"
#include "memory.h"
#include "run.h"
#include "scene.h"

/* Methods, storages and problems that go through different code: dense and sparse, a solution, a
 * ray, a method that hands over to another. */
typedef struct scenario {
    const char *name;
    int32_t method, polish;
    int sparse, large, solvable;
} scenario;

static const scenario scenarios[] = {
    {"auto, dense", PERP_LCP_AUTO, 1, 0, 0, 1},
    {"auto, sparse", PERP_LCP_AUTO, 1, 1, 0, 1},
    {"auto, large sparse", PERP_LCP_AUTO, 1, 1, 1, 1},
    {"auto, unsolvable", PERP_LCP_AUTO, 1, 0, 0, 0},
    {"lemke, dense", PERP_LCP_LEMKE, 0, 0, 0, 1},
    {"lemke, sparse", PERP_LCP_LEMKE, 1, 1, 0, 1},
    {"lemke, large sparse", PERP_LCP_LEMKE, 1, 1, 1, 1},
    {"lemke, unsolvable", PERP_LCP_LEMKE, 1, 0, 0, 0},
    {"lemke, doubled", PERP_LCP_LEMKE, 1, 0, 2, 1},
    {"pgs, dense", PERP_LCP_PGS, 0, 0, 0, 1},
    {"pgs, sparse", PERP_LCP_PGS, 1, 1, 0, 1},
    {"fischer, dense", PERP_LCP_FISCHER, 0, 0, 0, 1},
    {"fischer, sparse", PERP_LCP_FISCHER, 1, 1, 0, 1},
    {"fischer, large sparse", PERP_LCP_FISCHER, 1, 1, 1, 1},
    {"auto, large sparse with wind", PERP_LCP_AUTO, 1, 1, 3, 1},
    {"auto, turned equations", PERP_LCP_AUTO, 1, 0, 4, 1},
    {"lemke, turned equations", PERP_LCP_LEMKE, 1, 1, 4, 1},
    {"active set, dense", PERP_LCP_ACTIVE_SET, 1, 0, 0, 1},
    {"active set, small sparse", PERP_LCP_ACTIVE_SET, 0, 1, 0, 1},
};

enum { SCENARIOS = sizeof scenarios / sizeof *scenarios };

static void make_problem(gen_lcp *problem, const scenario *s, uint64_t seed)
{
    gen_random random;

    gen_seed(&random, seed);
    if (s->large == 2) {
        const scene_options o = scene_draw(117); /* needs a second path, with memory of its own */

        scene_lcp(problem, &o);
    } else if (s->large == 3) { /* coarser levels of an unsymmetric matrix */
        const grid_options o = {{36, 30, 1}, {0}, 0, 1, 0, NULL};
        int32_t i;

        grid_problem(problem, &random, &o);
        for (i = 0; i < problem->n; i++)
            problem->q[i] = sin(0.01 * i) - 0.2;
    } else if (s->large && s->large != 4) {
        gen_obstacle_2d(problem, 22); /* more unknowns than `auto` and lemke take for small */
    } else {
        gen_problem(problem, &random, 12, GEN_PD_SYMMETRIC, s->solvable ? GEN_MIXED : GEN_PLAIN);
        if (!s->solvable) { /* rows 0 and 1 become walls that push against each other */
            memset(problem->M, 0, 24 * sizeof(double));
            problem->M[0] = problem->M[13] = 1;
            problem->M[1] = problem->M[12] = -1;
            problem->q[0] = problem->q[1] = -1;
        }
        for (int32_t i = 0; i < 12 && s->large == 4; i++) { /* [H A'; A 0], which is symmetric */
            problem->lower[i] = -INFINITY;
            problem->upper[i] = INFINITY;
            for (int32_t j = 9; j < 12 && i >= 9; j++)
                problem->M[12 * i + j] = 0.0;
        }
        if (s->sparse) {
            gen_lcp csc;

            gen_to_csc(&csc, problem);
            problem->column_starts = csc.column_starts;
            problem->row_indices = csc.row_indices;
            problem->values = csc.values;
            problem->view = csc.view;
        }
    }
}

static perp_lcp_settings settings_of(const scenario *s)
{
    perp_lcp_settings settings = run_settings(s->method);

    settings.polish = s->polish;
    return settings;
}

/* ---- every k-th allocation fails ------------------------------------------------------------- */

static void test_context_and_solver(void **state)
{
    memory m = {0, 0, 1};
    perp_context_settings settings = memory_settings(&m);
    perp_context *context, *const none = (perp_context *)(void *)&m;
    perp_lcp_solver *solver, *const no_solver = (perp_lcp_solver *)(void *)&m;

    (void)state;
    context = none;
    assert_int_equal(perp_context_create(&context, &settings), PERP_ERROR_MEMORY);
    assert_ptr_equal(context, none);
    m.fails_at = 0;
    assert_int_equal(perp_context_create(&context, &settings), PERP_OK);
    for (m.calls = 0, m.fails_at = 1;; m.calls = 0, m.fails_at++) {
        perp_status status;

        solver = no_solver;
        status = perp_lcp_solver_create(context, &solver, NULL);
        if (status == PERP_OK)
            break;
        assert_int_equal(status, PERP_ERROR_MEMORY);
        assert_ptr_equal(solver, no_solver);
        assert_string_not_equal(perp_context_message(context), "");
        assert_int_equal(m.live, 1); /* the context alone */
    }
    perp_lcp_solver_destroy(solver);
    perp_context_destroy(context);
    assert_int_equal(m.live, 0);
}

/* One solve with the k-th allocation of the whole call failing; 0 if nothing failed. */
static int fail_once(perp_context *context, memory *m, const gen_lcp *problem,
                     const perp_lcp_settings *settings, const run *expected, int k,
                     const char *where)
{
    size_t n = (size_t)problem->n, bytes = n * sizeof(double), i;
    double *z = check_allocate(2 * n, sizeof *z), *w = z + n;
    perp_lcp_result result = fresh_lcp_result();
    perp_status status;
    int live = m->live;

    result.outcome = 77;
    for (i = 0; i < 2 * n; i++)
        z[i] = 123.25;
    m->calls = 0;
    m->fails_at = k;
    status = perp_lcp_solve(context, z, w, NULL, &result, settings,
                            LCP(&problem->view, problem->q, problem->lower, problem->upper), NULL);
    m->fails_at = 0;
    if (m->live != live)
        fail_msg("%s: %d blocks lost when allocation %d failed", where, m->live - live, k);
    if (status == PERP_OK) {
        assert_memory_equal(z, expected->z, bytes);
    } else {
        assert_int_equal(status, PERP_ERROR_MEMORY);
        assert_string_not_equal(perp_context_message(context), "");
        assert_int_equal(result.outcome, 77);
        for (i = 0; i < 2 * n; i++)
            assert_true(z[i] == 123.25);
    }
    free(z);
    return status != PERP_OK;
}

static void test_at_once(void **state)
{
    int s;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        memory m = {0, 0, 0};
        perp_context_settings context_settings = memory_settings(&m);
        perp_lcp_settings settings = settings_of(&scenarios[s]);
        perp_context *context;
        gen_lcp problem;
        run expected;
        int k, count;

        make_problem(&problem, &scenarios[s], 31);
        assert_int_equal(perp_context_create(&context, &context_settings), PERP_OK);
        m.calls = 0;
        run_lcp(&expected, context, &problem, &settings, NULL, scenarios[s].name);
        assert_int_equal(run_ok(&expected), scenarios[s].solvable);
        count = m.calls;
        assert_true(count > 0);
        for (k = 1; k <= count; k++) /* each must matter: the call cannot do without */
            assert_true(
                fail_once(context, &m, &problem, &settings, &expected, k, scenarios[s].name));
        assert_false(
            fail_once(context, &m, &problem, &settings, &expected, count + 1, scenarios[s].name));
        run_release(&expected);
        gen_destroy(&problem);
        perp_context_destroy(context);
        assert_int_equal(m.live, 0);
    }
}

/* What a test of a solver in use needs. */
typedef struct bench {
    memory m;
    perp_context *context;
    perp_lcp_settings settings;
    perp_lcp_solver *solver;
    perp_lcp_result result;
    gen_lcp problem;
    double *z;
} bench;

static void open_bench(bench *b, const scenario *s, uint64_t seed)
{
    perp_context_settings context_settings;

    memset(b, 0, sizeof *b);
    context_settings = memory_settings(&b->m);
    b->settings = settings_of(s);
    make_problem(&b->problem, s, seed);
    b->z = check_allocate((size_t)b->problem.n, sizeof *b->z);
    assert_int_equal(perp_struct_init(&b->result, sizeof b->result), PERP_OK);
    assert_int_equal(perp_context_create(&b->context, &context_settings), PERP_OK);
    assert_int_equal(perp_lcp_solver_create(b->context, &b->solver, &b->settings), PERP_OK);
}

static void close_bench(bench *b)
{
    perp_lcp_solver_destroy(b->solver);
    perp_context_destroy(b->context);
    assert_int_equal(b->m.live, 0);
    free(b->z);
    gen_destroy(&b->problem);
}

static perp_status setup(bench *b)
{
    return perp_lcp_solver_setup(b->solver, &b->problem.view, b->problem.lower, b->problem.upper);
}

static perp_status solve(bench *b, const double *z0)
{
    return perp_lcp_solver_solve(b->solver, b->z, NULL, NULL, &b->result, b->problem.q, z0);
}

/* z = 1 for the problem z - 1 that the solver was set up with before */
static void require_old_problem(bench *b)
{
    static const double minus = -1.0;
    double z = 0.0;

    assert_int_equal(perp_lcp_solver_solve(b->solver, &z, NULL, NULL, &b->result, &minus, NULL),
                     PERP_OK);
    assert_true(z == 1.0);
}

/* Setup with a larger problem fails at the k-th allocation: the old problem still solves. Then
 * solve fails at the k-th, and the next attempt succeeds. */
static void fail_step_by_step(bench *b)
{
    static const double one = 1.0;
    perp_status status = PERP_ERROR_MEMORY;
    perp_matrix small = matrix_rows(&one, 1, 1);
    int k;

    assert_int_equal(perp_lcp_solver_setup(b->solver, &small, NULL, NULL), PERP_OK);
    for (k = 1; status != PERP_OK; k++) {
        b->m.calls = 0;
        b->m.fails_at = k;
        status = setup(b);
        b->m.fails_at = 0;
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            require_old_problem(b);
        }
    }
    status = PERP_ERROR_MEMORY;
    for (k = 1; status != PERP_OK; k++) {
        b->z[0] = 123.25;
        b->m.calls = 0;
        b->m.fails_at = k;
        status = solve(b, NULL);
        b->m.fails_at = 0;
        if (status != PERP_OK) {
            assert_int_equal(status, PERP_ERROR_MEMORY);
            assert_true(b->z[0] == 123.25);
        }
    }
}

static void test_step_by_step(void **state)
{
    int s;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        bench b;
        run expected;

        open_bench(&b, &scenarios[s], 32);
        run_lcp(&expected, b.context, &b.problem, &b.settings, NULL, scenarios[s].name);
        fail_step_by_step(&b);
        assert_memory_equal(b.z, expected.z, (size_t)b.problem.n * sizeof(double));
        run_release(&expected);
        close_bench(&b);
    }
}

/* ---- no allocation after the first ----------------------------------------------------------- */

/* Later solves with other q, so with other active sets, cold and warm. */
static void solve_some_more(bench *b)
{
    int32_t round, i;

    for (round = 0; round < 4; round++) {
        assert_int_equal(solve(b, round & 1 ? b->z : NULL), PERP_OK);
        for (i = 0; i < b->problem.n; i++)
            b->problem.q[i] += (i % 3 - 1) * 0.5;
    }
}

static void test_second_solve_allocates_nothing(void **state)
{
    int s, allocations = 0;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        bench b;

        open_bench(&b, &scenarios[s], 33);
        assert_int_equal(setup(&b), PERP_OK);
        assert_int_equal(solve(&b, NULL), PERP_OK);
        b.m.calls = 0;
        solve_some_more(&b);
        if (b.m.calls != 0)
            print_error("%s: %d allocations in later solves\n", scenarios[s].name, b.m.calls);
        allocations += b.m.calls;
        close_bench(&b);
    }
    assert_int_equal(allocations, 0);
}

/* lcp.h: setup again with the same sizes allocates nothing, and the solves after it neither. */
static void test_second_setup_allocates_nothing(void **state)
{
    int s, allocations = 0;

    (void)state;
    for (s = 0; s < SCENARIOS; s++) {
        bench b;

        open_bench(&b, &scenarios[s], 34);
        assert_int_equal(setup(&b), PERP_OK);
        assert_int_equal(solve(&b, NULL), PERP_OK);
        b.m.calls = 0;
        assert_int_equal(setup(&b), PERP_OK);
        solve_some_more(&b);
        if (b.m.calls != 0)
            print_error("%s: %d allocations after a second setup\n", scenarios[s].name, b.m.calls);
        allocations += b.m.calls;
        close_bench(&b);
    }
    assert_int_equal(allocations, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_context_and_solver),
        cmocka_unit_test(test_at_once),
        cmocka_unit_test(test_step_by_step),
        cmocka_unit_test(test_second_solve_allocates_nothing),
        cmocka_unit_test(test_second_setup_allocates_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}

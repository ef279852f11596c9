/* Lemke's method with a factored basis, on CSC problems too large for the tableau to be chosen. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "run.h"
#include "scene.h"

#include "context.h"

/* Large and empty enough for the factored basis. */
enum { BLOCKS = 12, ORDER = 17 };

/* Every way to go: from a guess, from the slacks, without the polish, lexicographic. */
typedef struct way {
    const char *name;
    int crash, polish, rule;
} way;

static const way ways[] = {
    {"crash", 1, 1, PERP_PIVOT_HARRIS},
    {"cold", 0, 1, PERP_PIVOT_HARRIS},
    {"crash, no polish", 1, 0, PERP_PIVOT_HARRIS},
    {"cold, no polish", 0, 0, PERP_PIVOT_HARRIS},
    {"lexicographic", 1, 1, PERP_PIVOT_LEXICOGRAPHIC},
};
enum { WAYS = sizeof ways / sizeof *ways };

static perp_lcp_settings settings_of(const way *w)
{
    perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);

    settings.crash = w->crash;
    settings.polish = w->polish;
    settings.pivot_rule = w->rule;
    return settings;
}

/* Solves in every way, those without the polish only if asked to; z, if given, is the only solution
 * and found to within `tolerance`. */
static void solve_every_way(const gen_lcp *problem, const double *z, double tolerance,
                            int unpolished, const char *name)
{
    int k;

    for (k = 0; k < WAYS; k++) {
        perp_lcp_settings settings = settings_of(&ways[k]);
        char where[160];
        run r;

        if (!ways[k].polish && !unpolished)
            continue;
        snprintf(where, sizeof where, "%s, n = %d, %s", name, (int)problem->n, ways[k].name);
        run_lcp(&r, context, problem, &settings, NULL, where);
        if (!run_ok(&r) || r.result.method != PERP_LCP_LEMKE)
            fail_msg("%s: %s by %s, residual %g", where, perp_outcome_text(r.result.outcome),
                     perp_lcp_method_text(r.result.method), r.result.residual);
        if (z && !(run_distance(r.z, z, problem->n) <= tolerance))
            fail_msg("%s: off by %g", where, run_distance(r.z, z, problem->n));
        run_release(&r);
    }
}

/* The dense problem with its M in compressed columns; what it owned is the sparse one's. */
static void compress(gen_lcp *sparse, gen_lcp *dense)
{
    gen_to_csc(sparse, dense);
    sparse->q = dense->q;
    sparse->lower = dense->lower;
    sparse->upper = dense->upper;
    sparse->z = dense->z;
    sparse->w = dense->w;
    free(dense->M);
}

/* Problems of one class as the blocks of a large one, their variables one by one in turn. */
static void make_blocks(gen_lcp *problem, gen_random *random, int class, int bounds)
{
    const int32_t n = BLOCKS * ORDER;
    gen_lcp all;
    int32_t block, i, j;

    gen_begin_dense(&all, n);
    all.lower = check_allocate((size_t)n, sizeof(double));
    all.upper = check_allocate((size_t)n, sizeof(double));
    for (block = 0; block < BLOCKS; block++) {
        gen_lcp part;

        gen_problem(&part, random, ORDER, class, bounds);
        for (i = 0; i < ORDER; i++) {
            const int32_t to = block + BLOCKS * i;

            all.q[to] = part.q[i];
            all.lower[to] = part.lower ? part.lower[i] : 0.0;
            all.upper[to] = part.upper ? part.upper[i] : INFINITY;
            all.z[to] = part.z[i];
            for (j = 0; j < ORDER; j++)
                all.M[to * n + block + BLOCKS * j] = part.M[i * ORDER + j];
        }
        gen_destroy(&part);
    }
    compress(problem, &all);
}

/* Exact solutions. The polish gives them to the last digits; what pivoting alone leaves is eps
 * times the condition, at most some 1e4 here, times pivots. */
static void test_every_class(void **state)
{
    int class, bounds;

    (void)state;
    for (class = 0; class < GEN_CLASSES; class ++)
        for (bounds = 0; bounds < GEN_BOUNDS; bounds++) {
            gen_random random;
            gen_lcp problem;
            char name[64];

            gen_seed(&random, (uint64_t)(100 + 10 * class + bounds));
            make_blocks(&problem, &random, class, bounds);
            snprintf(name, sizeof name, "class %d, bounds %d", class, bounds);
            solve_every_way(&problem, class == GEN_PSD_LOW_RANK ? NULL : problem.z, 1e-9,
                            class != GEN_P, name);
            gen_destroy(&problem);
        }
}

/* The optimality conditions of  min 1/2 x'H x + c'x,  A x = b,  x_i >= 0 but for the free ones:
 * M = [H -A'; A 0], the multipliers free. From known x, y and reduced costs; `repeats` rows of A
 * come twice, and then y is not unique. */
static void make_program(gen_lcp *problem, gen_random *random, int32_t variables, int32_t rows,
                         int32_t repeats, int free_too)
{
    const int32_t n = variables + rows + repeats;
    gen_lcp dense;
    double *M;
    int32_t i, j, k;

    gen_begin_dense(&dense, n);
    dense.lower = check_allocate((size_t)n, sizeof(double));
    dense.upper = check_allocate((size_t)n, sizeof(double));
    M = dense.M;
    for (i = 0; i < variables; i++) {
        M[i * n + i] = 4.0;
        if (i > 0)
            M[i * n + i - 1] = M[(i - 1) * n + i] = -1.0;
    }
    for (k = 0; k < rows + repeats; k++)
        for (j = 0; j < variables; j++) {
            const int32_t i_row = variables + k, twin = variables + k - rows;

            M[i_row * n + j] = k >= rows ? M[twin * n + j]
                               : j == k  ? 1.0
                                         : (gen_integer(random, 12) ? 0.0 : gen_dyadic(random, 1));
            M[j * n + i_row] = -M[i_row * n + j];
        }
    for (i = 0; i < n; i++) {
        const int is_free = i >= variables || (free_too && i % 3 == 0);

        dense.upper[i] = INFINITY;
        dense.lower[i] = is_free ? -INFINITY : 0.0;
        dense.z[i] = is_free || gen_integer(random, 2) ? 1.0 + fabs(gen_dyadic(random, 4)) : 0.0;
        if (i >= variables + rows)
            dense.z[i] = 0.0;
        dense.w[i] = dense.z[i] == 0.0 && !is_free ? 1.0 : 0.0;
        dense.q[i] = dense.w[i];
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            dense.q[i] -= M[i * n + j] * dense.z[j];
    compress(problem, &dense);
}

/* Multipliers without a diagonal: the free variables alone make a singular block, with or without
 * free x among them; repeated equations make every basis of theirs singular. x is unique. Active
 * sets go on from a singular block with a proximal term, and come to the end of the path by
 * themselves. */
static void test_programs(void **state)
{
    int repeats, free_too;

    (void)state;
    for (repeats = 0; repeats < 2; repeats++)
        for (free_too = 0; free_too < 2; free_too++) {
            const int32_t variables = 170;
            gen_random random;
            gen_lcp problem;
            char name[64];
            int k;

            gen_seed(&random, (uint64_t)(7 + 2 * repeats + free_too));
            make_program(&problem, &random, variables, 40, 5 * repeats, free_too);
            snprintf(name, sizeof name, "program, %d, %d", repeats, free_too);
            for (k = 0; k < WAYS; k++) {
                perp_lcp_settings settings = settings_of(&ways[k]);
                run r;

                run_lcp(&r, context, &problem, &settings, NULL, name);
                if (!run_ok(&r) || !(run_distance(r.z, problem.z, variables) <= 1e-8))
                    fail_msg("%s, %s: %s, off by %g", name, ways[k].name,
                             perp_outcome_text(r.result.outcome),
                             run_distance(r.z, problem.z, variables));
                /* active sets take 3 to 15 steps, a path from the slacks 66 to 180 pivots */
                if (settings.crash && settings.pivot_rule == PERP_PIVOT_HARRIS)
                    assert_true(r.result.iterations <= 30);
                run_release(&r);
            }
            gen_destroy(&problem);
        }
}

/* Contact problems, which no guess helps with: every one is solved, and in every way. */
static void test_contacts(void **state)
{
    static const double ratios[] = {1.0, 1e4, 1e8};
    int k;

    (void)state;
    for (k = 0; k < 3; k++) {
        gen_contact_options options = {21, 60, 4, ratios[k], 1.0, k % 2 ? 4 : 0, k % 2};
        gen_random random;
        gen_lcp dense, problem;

        gen_seed(&random, (uint64_t)(300 + k));
        gen_contact(&dense, &random, &options);
        compress(&problem, &dense);
        solve_every_way(&problem, NULL, 0.0, 1, "contacts");
        gen_destroy(&problem);
    }
}

/* Scenes with mass ratios up to 1e8 on which no path over sparse factors in double ends well: they
 * need the tableau in doubled precision that there is room for. All are solvable by construction.
 */
static void test_scenes(void **state)
{
    static const uint64_t seeds[] = {380, 500, 524, 647};
    size_t k;

    (void)state;
    for (k = 0; k < sizeof seeds / sizeof *seeds; k++) {
        const perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        const scene_options o = scene_draw(seeds[k]);
        gen_lcp dense, problem;
        run r;

        scene_lcp(&dense, &o);
        compress(&problem, &dense);
        run_lcp(&r, context, &problem, &settings, NULL, "scene");
        if (!run_ok(&r))
            fail_msg("scene %d: %s", (int)seeds[k], perp_outcome_text(r.result.outcome));
        run_release(&r);
        gen_destroy(&problem);
    }
}

/* From a cold start a pivot for every node above the obstacle; after the crash only a few. */
static void test_obstacle(void **state)
{
    gen_lcp problem;
    int side;

    (void)state;
    for (side = 16; side <= 64; side *= 2) {
        perp_lcp_settings settings = run_settings(PERP_LCP_LEMKE);
        int64_t above = 0;
        int32_t i;
        run r;

        gen_obstacle_2d(&problem, side);
        for (i = 0; i < problem.n; i++)
            above += problem.z[i] > 0.0;
        run_lcp(&r, context, &problem, &settings, NULL, "obstacle");
        assert_true(run_ok(&r));
        assert_true(run_distance(r.z, problem.z, problem.n) <= 1e-9);
        assert_true(r.result.iterations <= 60);
        run_release(&r);
        settings.crash = 0;
        if (side < 64) {
            run_lcp(&r, context, &problem, &settings, NULL, "obstacle, cold");
            assert_true(run_ok(&r));
            assert_true(r.result.iterations >= above);
            run_release(&r);
        }
        gen_destroy(&problem);
    }
}

/* Walls that push against each other, beside a problem that has a solution: a ray that proves it.
 */
static void test_infeasible(void **state)
{
    int k;

    (void)state;
    for (k = 0; k < WAYS; k++) {
        perp_lcp_settings settings = settings_of(&ways[k]);
        gen_random random;
        gen_lcp problem;
        run r;
        int32_t at;

        gen_seed(&random, 9);
        make_blocks(&problem, &random, GEN_PD_SYMMETRIC, GEN_PLAIN);
        for (at = 0; at < problem.column_starts[problem.n]; at++) {
            const int32_t i = problem.row_indices[at];

            if (i == 0 || i == BLOCKS)
                problem.values[at] = 0.0;
        }
        problem.values[0] = problem.values[problem.column_starts[BLOCKS] + 1] = 1.0;
        problem.values[1] = problem.values[problem.column_starts[BLOCKS]] = -1.0;
        problem.q[0] = problem.q[BLOCKS] = -1.0;
        run_lcp(&r, context, &problem, &settings, NULL, ways[k].name);
        assert_int_equal(r.result.outcome, PERP_OUTCOME_RAY);
        run_release(&r);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_class), cmocka_unit_test(test_programs),
        cmocka_unit_test(test_contacts),    cmocka_unit_test(test_obstacle),
        cmocka_unit_test(test_infeasible),  cmocka_unit_test(test_scenes),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

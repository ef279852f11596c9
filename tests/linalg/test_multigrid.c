/* Multigrid by aggregation: the hierarchy's properties, and solves with blocks of grid matrices. */
#include "suite.h"

#include "grids.h"
#include "linalg/multigrid/multigrid.h"
#include "linalg/squares.h"

typedef struct scene {
    const char *name;
    grid_options options;
    int32_t most_steps; /* of conjugate gradients, to 1e-8 */
} scene;

/* Twice the steps seen. Without coarse levels it takes hundreds, and with those of another matrix
 * or of the whole one instead of the block several dozen. */
static const scene scenes[] = {
    {"plane", {{60, 60, 1}, {0}, 0, 0, 0, NULL}, 20},
    {"plane, permuted", {{60, 60, 1}, {0}, 0, 0, 1, NULL}, 26},
    {"long", {{400, 12, 1}, {0}, 0, 0, 0, NULL}, 20},
    {"line", {{3000, 1, 1}, {0}, 0, 0, 0, NULL}, 20},
    {"space", {{15, 15, 15}, {0}, 0, 0, 0, NULL}, 18},
    {"weak in one direction", {{60, 60, 1}, {1, 1e-3, 0}, 0, 0, 0, NULL}, 20},
    {"jumps", {{60, 60, 1}, {0}, 4, 0, 0, NULL}, 24},
};

enum { SCENES = sizeof scenes / sizeof *scenes };

static perp__matrix view_of_problem(const gen_lcp *problem)
{
    perp__matrix M;

    memset(&M, 0, sizeof M);
    M.rows = M.columns = problem->n;
    M.values = problem->values;
    M.column_starts = problem->column_starts;
    M.row_indices = problem->row_indices;
    return M;
}

/* Blocks of all rows, of a half, and of rows at random. */
static int32_t choose(gen_random *random, int32_t n, int which, int32_t *active)
{
    int32_t count = 0, i;

    for (i = 0; i < n; i++)
        if (which == 0 || (which == 1 && i < n / 2) || (which == 2 && gen_integer(random, 4)))
            active[count++] = i;
    return count;
}

/* |b - S_AA x| / |b| in the 2-norm, from the problem's own entries. */
static double residual_of(const gen_lcp *problem, const int32_t *active, int32_t count,
                          const double *b, const double *x)
{
    double residual = 0.0, size = 0.0;
    int32_t c, k;

    for (c = 0; c < count; c++) {
        const int32_t j = active[c]; /* symmetric: column j is row j */
        double r = b[j];

        for (k = problem->column_starts[j]; k < problem->column_starts[j + 1]; k++)
            r -= problem->values[k] * x[problem->row_indices[k]];
        residual += r * r;
        size += b[j] * b[j];
    }
    return sqrt(residual / size);
}

static void check_blocks(gen_random *random, perp__multigrid *grid, const gen_lcp *problem,
                         const scene *s)
{
    const size_t n = (size_t)problem->n;
    int32_t *active = check_allocate(n, sizeof *active);
    double *b = check_allocate(3 * n, sizeof *b), *r = b + n, *x = r + n;
    int which;

    for (which = 0; which < 3; which++) {
        const int32_t count = choose(random, problem->n, which, active);
        int32_t i, steps;

        for (i = 0; i < problem->n; i++)
            b[i] = r[i] = gen_normal(random);
        assert_true(perp__multigrid_take_block(grid, 0, active, count));
        steps = perp__multigrid_solve(grid, r, x, 1e-8, 200);
        if (!(steps > 0 && steps <= s->most_steps))
            fail_msg("%s, block %d: %d steps", s->name, which, (int)steps);
        /* the preconditioned norm may have ended it, which weighs the components otherwise */
        if (!(residual_of(problem, active, count, b, x) <= 1e-6))
            fail_msg("%s, block %d: residual %g", s->name, which,
                     residual_of(problem, active, count, b, x));
        for (i = 0; i < count; i++)
            x[active[i]] = 0.0;
        for (i = 0; i < problem->n; i++)
            assert_true(x[i] == 0.0); /* zero outside of the block */
    }
    free(b);
    free(active);
}

/* P >= 0 keeps coarse points feasible; coarse levels must shrink, and hold few entries in all. */
static void check_hierarchy(const perp__multigrid *grid, const char *name)
{
    double entries = 0.0;
    int32_t k, p;

    assert_true(grid->levels > 1);
    for (k = 0; k < grid->levels; k++) {
        const perp__level *level = &grid->level[k];

        entries += level->starts[level->n];
        if (k + 1 == grid->levels)
            break;
        assert_true(level->coarse == level[1].n && level->coarse < level->n);
        for (p = 0; p < level->p_starts[level->n]; p++)
            assert_true(level->p_values[p] >= 0.0);
    }
    if (!(entries <= 2.5 * grid->level[0].starts[grid->level[0].n]))
        fail_msg("%s: %g entries in all", name, entries);
}

static void test_grids(void **state)
{
    perp__multigrid grid;
    gen_random random;
    int s;

    (void)state;
    gen_seed(&random, 121);
    memset(&grid, 0, sizeof grid);
    grid.context = context;
    for (s = 0; s < SCENES; s++) { /* one object for all */
        gen_lcp problem;
        perp__matrix M;

        grid_problem(&problem, &random, &scenes[s].options);
        M = view_of_problem(&problem);
        grid.deadline = 1e-9; /* long past: nothing is built, and the memory is good for the next */
        assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
        assert_int_equal(grid.levels, 0);
        grid.deadline = 0.0;
        assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
        check_hierarchy(&grid, scenes[s].name);
        check_blocks(&random, &grid, &problem, &scenes[s]);
        gen_destroy(&problem);
    }
    perp__multigrid_release(&grid);
}

/* P' S P of the first coarse level against a product made by definition; with rows of P left out
 * where they are outside of the block. */
static void test_coarse_matrix(void **state)
{
    static const grid_options options = {{12, 11, 1}, {0}, 2, 0, 1, NULL};
    perp__multigrid grid;
    gen_random random;
    gen_lcp problem;
    perp__matrix M;
    double *P, *C;
    int32_t n, m, active[132], count, i, j, k, p, a, b;

    (void)state;
    gen_seed(&random, 122);
    grid_problem(&problem, &random, &options);
    n = problem.n;
    M = view_of_problem(&problem);
    memset(&grid, 0, sizeof grid);
    grid.context = context;
    assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
    m = grid.level[1].n;
    count = choose(&random, n, 2, active);
    assert_true(perp__multigrid_take_block(&grid, 0, active, count));
    P = check_allocate((size_t)(n * m), sizeof *P);
    C = check_allocate((size_t)(m * m), sizeof *C);
    for (i = 0; i < n; i++)
        for (p = grid.level[0].p_starts[i]; p < grid.level[0].p_starts[i + 1]; p++)
            P[i * m + grid.level[0].p_columns[p]] =
                grid.level[0].inside[i] ? grid.level[0].p_values[p] : 0.0;
    for (j = 0; j < n; j++)
        for (k = problem.column_starts[j]; k < problem.column_starts[j + 1]; k++)
            for (a = 0, i = problem.row_indices[k]; a < m; a++)
                for (b = 0; b < m && P[i * m + a] != 0.0; b++)
                    C[a * m + b] += P[i * m + a] * problem.values[k] * P[j * m + b];
    for (a = 0; a < m; a++)
        for (k = grid.level[1].starts[a]; k < grid.level[1].starts[a + 1]; k++) {
            b = grid.level[1].rows[k];
            /* rounding of a few dozen products of numbers up to 16 */
            assert_true(fabs(grid.level[1].block_values[k] - C[a * m + b]) <= 1e-11 ||
                        (a == b && C[a * m + b] == 0.0 && grid.level[1].block_values[k] == 1.0));
            C[a * m + b] = 0.0;
        }
    for (k = 0; k < m * m; k++)
        assert_true(C[k] == 0.0); /* nothing outside of the pattern */
    free(P);
    free(C);
    perp__multigrid_release(&grid);
    gen_destroy(&problem);
}

/* A matrix that is not positive definite is told, not solved. */
static void test_indefinite(void **state)
{
    static const grid_options options = {{40, 40, 1}, {0}, 0, 0, 0, NULL};
    perp__multigrid grid;
    gen_random random;
    gen_lcp problem;
    perp__matrix M;
    int32_t *active, i, k;
    double *b;

    (void)state;
    gen_seed(&random, 123);
    grid_problem(&problem, &random, &options);
    for (i = 0; i < problem.n; i++)
        for (k = problem.column_starts[i]; k < problem.column_starts[i + 1]; k++)
            if (problem.row_indices[k] == i)
                problem.values[k] = 3.0; /* eigenvalues from -1 on */
    M = view_of_problem(&problem);
    active = check_allocate((size_t)problem.n, sizeof *active);
    b = check_allocate(2 * (size_t)problem.n, sizeof *b);
    for (i = 0; i < problem.n; i++) {
        active[i] = i;
        b[i] = gen_normal(&random);
    }
    memset(&grid, 0, sizeof grid);
    grid.context = context;
    assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
    assert_true(!perp__multigrid_take_block(&grid, 0, active, problem.n) ||
                perp__multigrid_solve(&grid, b, b + problem.n, 1e-8, 100) < 0);
    perp__multigrid_release(&grid);
    free(b);
    free(active);
    gen_destroy(&problem);
}

/* Nothing to coarsen: a diagonal matrix, or a small one. */
static void test_no_levels(void **state)
{
    static const grid_options options = {{9, 9, 1}, {0}, 0, 0, 0, NULL};
    perp__multigrid grid;
    gen_random random;
    gen_lcp problem;
    perp__matrix M;
    int32_t starts[301], rows[300], i;
    double values[300];

    (void)state;
    gen_seed(&random, 124);
    grid_problem(&problem, &random, &options);
    M = view_of_problem(&problem);
    memset(&grid, 0, sizeof grid);
    grid.context = context;
    assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
    assert_int_equal(grid.levels, 1);
    for (i = 0; i < 300; i++) {
        starts[i] = rows[i] = i;
        values[i] = 1.0;
    }
    starts[300] = 300;
    M.rows = M.columns = 300;
    M.column_starts = starts;
    M.row_indices = rows;
    M.values = values;
    assert_int_equal(perp__multigrid_build(&grid, &M), PERP_OK);
    assert_int_equal(grid.levels, 1);
    perp__multigrid_release(&grid);
    gen_destroy(&problem);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grids),
        cmocka_unit_test(test_coarse_matrix),
        cmocka_unit_test(test_indefinite),
        cmocka_unit_test(test_no_levels),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}

/* The shortest way for small dense problems 0 <= z perp M z + q >= 0: Lemke's path (lemke/path.c
 * has its source) on the stack, one step of refinement by its pivots, and the same residuals and
 * the same judge as for any other point. It takes nothing but what is solved to the last digits;
 * all else is left to the methods, which begin anew. */
#include <string.h>

#include "lcp/solver.h"
#include "lcp/lemke/lemke.h"
#include "linalg/doubled.h"
#include "linalg/lanes/vectors.h"

enum {
    LENGTH = PERP__SMALL_LENGTH,
    /* Pivots a row: twice what most problems need. */
    MOST_PIVOTS = 4,
    PIVOTS = (MOST_PIVOTS + 1) * LENGTH /* and one a row to the basis to start from */
};

/* Where the column of a nonbasic variable begins: what it was before that pivot. */
typedef struct column {
    const double *start;
    int32_t pivot;
} column;

/* basic + T nonbasic = b. Of T there is no more than what its columns began with and the pivots
 * since (the product form of the inverse), for a path needs one column a pivot: a pivot in row r
 * takes a column x to x - x_r eta, where the first x has 0 in row r. Variables: z_k = k, w_k = n +
 * k, t = 2 n. Rows from n on are 0, so that vectors may reach there. */
typedef struct path {
    size_t n, row; /* t's row, once it is basic */
    double slack;
    int32_t most, count; /* pivots of the path; of it and before it */
    int32_t basic[LENGTH], rows[PIVOTS];
    column nonbasic[2 * LENGTH + 1];
    double cover[LENGTH], b[LENGTH]; /* t's column; the values of the basic variables */
    double etas[PIVOTS * LENGTH];
} path;

#define NONE SIZE_MAX

/* From LENGTH - 1 - r on: unit vector r, and 1 but for entry r; from LENGTH - n on: n times -1. */
#define EIGHT(x) x, x, x, x, x, x, x, x
#define SEVEN(x) x, x, x, x, x, x, x
#define ALL(x) EIGHT(x), EIGHT(x), EIGHT(x), EIGHT(x)
#define ALL_BUT_ONE(x) EIGHT(x), EIGHT(x), EIGHT(x), SEVEN(x)
static const double units[2 * LENGTH - 1] = {[LENGTH - 1] = 1};
static const double others[2 * LENGTH - 1] = {ALL_BUT_ONE(1), 0, ALL_BUT_ONE(1)};
static const double covers[2 * LENGTH] = {ALL(-1)};

typedef struct kernels {
    int32_t (*solve)(perp_lcp_solver *solver, const double *z0);
    double (*scale)(perp_lcp_solver *solver);
} kernels;

#define TEMPLATE "lcp/small_vector.h"
#include "linalg/lanes/each_set.h"

static const kernels *fastest(void)
{
    static const kernels *const sets[] = {PERP__OF_EACH_SET(&kernels)};

    return sets[perp__widest_vectors()];
}

void perp__small_read(perp_lcp_solver *solver)
{
    const size_t n = (size_t)solver->n, rows = solver->M.row_stride;
    const size_t columns = solver->M.column_stride;
    const double *from = solver->M.values;
    double *into = solver->columns;

    for (size_t j = 0; j < n; j++, from += columns, into += LENGTH)
        for (size_t i = 0; i < n; i++)
            into[i] = from[i * rows];
    solver->M.values = solver->columns;
    solver->M.row_stride = 1;
    solver->M.column_stride = LENGTH;
    solver->wide = solver->M;
    solver->wide.rows = solver->length;
}

void perp__small_equilibrate(perp_lcp_solver *solver)
{
    const int32_t is_scaled = solver->settings.scaling;

    memset(solver->exponents, 0, (size_t)solver->n * sizeof *solver->exponents);
    if (is_scaled)
        perp__find_exponents(&solver->M, solver->exponents, solver->work);
    if (fastest()->scale(solver) < perp__power_of_two(PERP__NOISE) || !is_scaled)
        return;
    perp__balance_noise(&solver->M, solver->exponents, solver->work);
    fastest()->scale(solver);
}

bool perp__small_solve(perp_lcp_solver *solver, const double *z0, perp__evaluation *residuals)
{
    const perp_lcp_settings *s = &solver->settings;

    /* bounds 0 and +inf, M of one part, and nothing asked for that takes a method of its own */
    if (!solver->is_small || solver->parts != 1 || !solver->powers_normal || !s->polish ||
        s->pivot_rule != PERP_PIVOT_HARRIS || !fastest()->solve(solver, z0))
        return 0;
    *residuals = perp__evaluate_product(solver);
    return perp__is_exact(solver, residuals);
}

/* Primal-dual active sets for dense problems: block principal pivoting as a method of its own. */
#include <string.h>

#include "lcp/active_set/block_pivoting.h"

/* Sparse matrices up to this size are expanded: their factorisations cost more than dense ones. */
#define PERP__SMALL_SPARSE 64
#define PERP__PATIENCE 10
/* The default limit. */
#define PERP__ROUNDS 10000

typedef struct active_set_work {
    perp__lcp_work head;
    perp__block_pivoting pivoting;
    perp__lcp_problem dense; /* the problem with its matrix expanded */
    perp__matrix M;
    double *expanded; /* n by n; sparse M only */
    int32_t examined; /* since the last set-up: expanded, and `symmetric` is known */
    int32_t symmetric;
} active_set_work;

static int32_t suits(const perp__lcp_problem *problem)
{
    return !problem->M->column_starts || problem->n <= PERP__SMALL_SPARSE;
}

static void layout(perp__arena *arena, void *work)
{
    active_set_work *a = work;
    const perp__lcp_problem *p = a->head.problem;
    const size_t n = (size_t)p->n;

    perp__block_pivoting_layout(arena, &a->pivoting, p->n, 0);
    a->expanded = perp__arena_take(arena, p->M->column_starts ? n * n : 0, sizeof(double));
    a->examined = 0;
}

static void expand(active_set_work *a)
{
    const perp__matrix *M = a->head.problem->M;
    const size_t n = (size_t)M->rows;

    a->M = *M;
    if (!M->column_starts)
        return;
    for (int32_t j = 0; j < M->columns; j++) {
        double *column = a->expanded + (size_t)j * n;

        memset(column, 0, n * sizeof *column);
        for (int32_t k = M->column_starts[j]; k < M->column_starts[j + 1]; k++)
            column[M->row_indices[k]] = M->values[k];
    }
    a->M.values = a->expanded;
    a->M.row_stride = 1;
    a->M.column_stride = n;
    a->M.column_starts = a->M.row_indices = NULL;
}

static int32_t correct(void *work, const double *residual, double *step)
{
    active_set_work *a = work;
    perp__block_pivoting *b = &a->pivoting;

    memcpy(step, residual, (size_t)a->head.problem->n * sizeof *step);
    perp__active_block_solve(&b->active, b->places, step);
    return 1;
}

static perp_status solve(void *work, perp__lcp_iterate *iterate)
{
    active_set_work *a = work;
    perp__block_pivoting *b = &a->pivoting;
    const size_t n = (size_t)a->head.problem->n;

    a->dense = *a->head.problem;
    if (!a->examined)
        expand(a);
    a->dense.M = &a->M;
    if (!a->examined)
        a->symmetric = perp__is_symmetric(&a->dense);
    a->examined = 1;
    perp__active_block_begin(&b->active, &a->dense, a->symmetric);
    b->active.definite = 0;
    b->problem = &a->dense;
    b->patience = PERP__PATIENCE;
    b->single_patience = 20 + 2 * (int32_t)n;
    b->round_limit = a->dense.iteration_limit > 0 ? a->dense.iteration_limit : PERP__ROUNDS;
    if (iterate->warm)
        perp__places_of(&a->dense, iterate->z, b->places);
    else
        perp__block_pivoting_start(&a->dense, b->places);
    memcpy(b->z, iterate->z, n * sizeof *b->z);
    iterate->outcome = perp__block_pivoting_run(b);
    iterate->iterations = b->rounds;
    memcpy(iterate->z, b->z, n * sizeof *b->z);
    memcpy(iterate->places, b->places, n);
    iterate->has_places = 1;
    if (iterate->outcome == PERP_OUTCOME_SOLVED)
        iterate->correct = correct;
    return PERP_OK;
}

const perp__lcp_method perp__lcp_active_set = {
    PERP_LCP_ACTIVE_SET, sizeof(active_set_work), 1, suits, NULL, layout, solve, NULL,
};

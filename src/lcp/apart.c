/* Parts that the methods did not solve together are solved one by one, each a problem of its own:
 * what a part is worth is not to depend on what else there is. Small ones come to the tree of index
 * sets (lcp/all/all.h) that way. */
#include <string.h>

#include "base/clock.h"
#include "lcp/solver.h"

/* What the parts are solved in. */
typedef struct apart {
    const perp_lcp_solver *whole;
    perp_lcp_solver *solver;    /* of one part after the other */
    int32_t *part;              /* 2 n: the part that a row belongs to, then its column */
    int32_t *rows, *starts;     /* part k has rows[starts[k]] .. rows[starts[k + 1] - 1] */
    int32_t *position;          /* of a row in the part, -1 of those of other parts */
    int32_t *columns, *indices; /* CSC of a part of a sparse matrix */
    double *values;
    double *q, *lower, *upper, *z;
    int32_t method; /* that gave the last of their answers */
} apart;

static void lay_out(perp__arena *arena, void *object)
{
    apart *own = object;
    const size_t n = (size_t)own->whole->n;
    const int32_t *ends = own->whole->M.column_starts;
    const size_t entries = ends ? (size_t)ends[n] : n * n;

    PERP__INTEGERS(arena, n + 1, &own->starts, &own->columns);
    PERP__INTEGERS(arena, n, &own->rows, &own->position);
    PERP__DOUBLES(arena, n, &own->q, &own->lower, &own->upper, &own->z);
    own->part = perp__arena_take(arena, 2 * n, sizeof(int32_t));
    own->indices = perp__arena_take(arena, ends ? entries : 0, sizeof(int32_t));
    own->values = perp__arena_take(arena, entries, sizeof(double));
}

/* Rows and their columns in one part. Returns how many there are; rows := theirs, in order. */
static int32_t find_parts(perp_lcp_solver *solver, apart *own)
{
    const int32_t n = solver->n;
    int32_t *tied = own->position, count;

    for (int32_t i = 0; i < n; i++)
        tied[i] = 1;
    count = perp__find_significant_parts(&solver->M, NULL, 0.0, tied, own->part, solver->reach);
    memset(own->starts, 0, ((size_t)n + 1) * sizeof *own->starts);
    for (int32_t i = 0; i < n; i++)
        own->starts[own->part[i]]++;
    for (int32_t k = 0; k < n; k++)
        own->starts[k + 1] += own->starts[k];
    for (int32_t i = n; i-- > 0;) {
        own->rows[--own->starts[own->part[i]]] = i;
        own->position[i] = -1;
    }
    return count;
}

/* The part's matrix, bounds and q to its solver. */
static perp_status set_up(perp_lcp_solver *solver, apart *own, const perp__index_set *set)
{
    perp_matrix M = perp__view(PERP_STORAGE_COLUMN_MAJOR, set->count, set->count, own->values);
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < set->count; k++) {
        own->position[set->active[k]] = k;
        own->q[k] = solver->q[set->active[k]];
        own->lower[k] = solver->lower[set->active[k]];
        own->upper[k] = solver->upper[set->active[k]];
    }
    if (solver->M.column_starts) {
        perp__principal_csc(&solver->M, set, own->columns, own->indices, own->values);
        status =
            perp_matrix_csc(&M, set->count, set->count, own->columns, own->indices, own->values);
    } else {
        perp__principal_dense(&solver->M, set, own->values, 1, (size_t)set->count);
    }
    for (int32_t k = 0; k < set->count; k++)
        own->position[set->active[k]] = -1;
    if (status == PERP_OK && !own->solver)
        status = perp__lcp_create(solver->context, &own->solver, NULL);
    if (status != PERP_OK)
        return status;
    own->solver->settings = solver->settings;
    own->solver->insists = solver->insists;
    return perp__lcp_setup(own->solver, &M, own->lower, own->upper);
}

/* Whether the part's piece of solver->z is an answer of the part; *tested := its residual. */
static int32_t is_solved(const perp_lcp_solver *solver, apart *own, const perp__index_set *set,
                         double *tested)
{
    perp__evaluation worth;

    for (int32_t k = 0; k < set->count; k++)
        own->solver->z[k] = solver->z[set->active[k]];
    perp__scale_problem(own->solver, own->q);
    worth = perp__evaluate(own->solver);
    *tested = worth.tested;
    return perp__is_good(perp__lcp_judge(own->solver, &worth, PERP_OUTCOME_STALLED));
}

/* What the caller's budgets leave for the part; false if that is nothing. */
static int32_t has_budget_left(perp_lcp_solver *solver, perp_lcp_settings *left)
{
    const int64_t budget = left->max_iterations;

    if (solver->deadline > 0.0)
        left->time_limit = perp__time_left(solver->deadline);
    if (budget == 0)
        return 1;
    left->max_iterations = (int32_t)(budget - solver->spent);
    if (left->max_iterations > 0)
        return 1;
    solver->ended = PERP_OUTCOME_ITERATION_LIMIT;
    return 0;
}

/* What was found to the whole: a ray, or a point that is better than that of before. */
static void hand_back(perp_lcp_solver *solver, apart *own, const perp__index_set *set,
                      double tested, perp_outcome *said)
{
    const perp_lcp_solver *part = own->solver;
    const int32_t is_ray = part->best.outcome == PERP_OUTCOME_RAY;
    const int32_t is_better =
        perp__is_good(part->best.outcome) || !(tested <= part->best.worth.tested);

    own->method = part->best.method;
    solver->spent += part->spent;
    solver->ended = part->ended;
    if (is_ray) {
        *said = PERP_OUTCOME_RAY;
        solver->best_certificate = part->best_certificate;
        memset(solver->best_ray, 0, (size_t)solver->n * sizeof *solver->best_ray);
    }
    for (int32_t k = 0; k < set->count; k++) {
        if (is_ray)
            solver->best_ray[set->active[k]] = part->best_ray[k];
        if (is_better)
            solver->z[set->active[k]] = part->best.z[k];
    }
}

/* As alone: from the caller's start, not from where the whole has come to. */
static perp_status solve_part(perp_lcp_solver *solver, apart *own, const perp__index_set *set,
                              const double *z0, perp_outcome *said)
{
    perp_lcp_result result;
    double tested;
    perp_status status = set_up(solver, own, set);

    PERP__THEN(status, perp_lcp_result_init(&result, sizeof result));
    if (status != PERP_OK || is_solved(solver, own, set, &tested) ||
        !has_budget_left(solver, &own->solver->settings))
        return status;
    for (int32_t k = 0; k < set->count && z0; k++)
        own->z[k] = z0[set->active[k]];
    status = perp__lcp_solve(own->solver, own->z, NULL, NULL, &result, own->q, z0 ? own->z : NULL);
    if (status == PERP_OK)
        hand_back(solver, own, set, tested, said);
    return status;
}

perp_status perp__solve_apart(perp_lcp_solver *solver, const double *z0)
{
    perp_outcome said = PERP_OUTCOME_STALLED;
    int32_t parts = 1;
    apart *own;
    perp_status status;

    if (solver->parts < 2)
        return PERP_OK;
    status = perp__workspace_fit(&solver->apart, solver->context, sizeof *own, lay_out, solver,
                                 solver->setups);
    own = solver->apart.work;
    if (status == PERP_OK)
        parts = find_parts(solver, own);
    if (parts < 2)
        return status;
    own->method = solver->best.method;
    memcpy(solver->z, solver->best.z, (size_t)solver->n * sizeof *solver->z);
    for (int32_t k = 0; k < parts && status == PERP_OK && solver->ended < 0; k++) {
        const perp__index_set set = {own->starts[k + 1] - own->starts[k],
                                     own->rows + own->starts[k], own->position};

        status = solve_part(solver, own, &set, z0, &said);
        if (said == PERP_OUTCOME_RAY && solver->best_certificate != PERP_CERTIFICATE_NONE)
            break;
    }
    if (status == PERP_OK)
        perp__consider_point(solver, own->method, said);
    return status;
}

void perp__apart_release(void *work)
{
    perp__lcp_destroy(((apart *)work)->solver);
}

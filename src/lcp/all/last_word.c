/* The last word on small problems: where pivoting, sweeps and Newton's method have found no
 * solution, the tree of index sets (patterns/patterns.h) is searched for the first that the gate
 * takes. At most 3^12 index sets, and few of them are reached. */
#include <math.h>
#include <string.h>

#include "base/context.h"
#include "lcp/all/all.h"
#include "lcp/candidate.h"

/* Largest n: there a search that finds nothing takes milliseconds. */
#define PERP__LARGEST_LAST_WORD 12

static perp__lcp_all *tree_of(perp_lcp_solver *solver)
{
    if (!solver->tree) {
        solver->tree = perp__allocate(solver->context, 1, sizeof *solver->tree);
        if (!solver->tree)
            return NULL;
        perp__lcp_all_init(solver->tree, solver);
        solver->tree->first = 1;
    }
    return solver->tree;
}

int32_t perp__has_last_word(const perp_lcp_solver *solver)
{
    return solver->settings.method == PERP_LCP_AUTO && solver->n <= PERP__LARGEST_LAST_WORD;
}

perp_status perp__last_word(perp_lcp_solver *solver)
{
    perp__lcp_all *tree = tree_of(solver);
    perp_status status;

    if (!tree)
        return perp__fail_memory(solver->context, "the tree of index sets");
    tree->aborted = tree->found = 0;
    memset(&tree->result, 0, sizeof tree->result);
    if (solver->settings.max_iterations > 0)
        tree->limit = solver->settings.max_iterations - solver->spent;
    solver->control.method = PERP_LCP_PATTERNS;
    solver->control.deadline = solver->deadline;
    solver->correct = NULL;
    status = perp__lcp_all_prepare(tree);
    if (status == PERP_OK)
        status = perp__lcp_all_search(tree);
    if (status == PERP_OK && tree->aborted)
        status = perp__fail(solver->context, PERP_ERROR_CALLBACK, "the monitor asked to abort");
    if (status != PERP_OK)
        return status;
    solver->spent += tree->result.nodes;
    if (tree->found)
        perp__consider_point(solver, PERP_LCP_PATTERNS);
    else if (tree->tree.ended)
        solver->ended = tree->result.outcome;
    return PERP_OK;
}

void perp__last_word_release(perp_lcp_solver *solver)
{
    if (!solver->tree)
        return;
    perp__lcp_all_release(solver->tree);
    perp__release(solver->context, solver->tree);
}

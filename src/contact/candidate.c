/* The best point so far: what every method, start and polish has to offer goes through here. */
#include <string.h>

#include "contact/solver.h"

static void keep(perp_contact_solver *solver)
{
    perp__contact_candidate *best = &solver->best;

    if (solver->parts > 0)
        memcpy(best->evidence, solver->evidence, (size_t)solver->parts * sizeof *best->evidence);
    perp__copy(best->r, solver->r, solver->size);
    perp__copy(best->u, solver->u, solver->size);
    if (solver->contacts > 0)
        memcpy(best->modes, solver->modes, (size_t)solver->contacts);
    perp__copy(solver->best_v, solver->v, solver->n);
}

/* Whether the point under evaluation takes the place of the best. */
static int32_t is_better(const perp_contact_solver *solver, const perp__contact_candidate *point)
{
    const perp__contact_candidate *best = &solver->best;

    if (best->method < 0)
        return 1;
    if (perp__is_good(point->outcome) != perp__is_good(best->outcome))
        return perp__is_good(point->outcome);
    if (point->worth.sound != best->worth.sound)
        return point->worth.sound;
    return point->worth.tested < best->worth.tested;
}

perp_status perp__contact_consider(perp_contact_solver *solver, int32_t method, const int8_t *modes,
                                   perp__contact_worth *found)
{
    perp__contact_candidate point = {0};
    perp_status status = perp__contact_evaluate(solver, modes, &point.worth);

    if (status != PERP_OK)
        return status;
    point.evidence = solver->evidence;
    point.method = method;
    point.outcome = perp__contact_verdict(solver, &point, solver->said);
    *found = point.worth;
    if (!is_better(solver, &point))
        return PERP_OK;
    solver->best.worth = point.worth;
    solver->best.outcome = point.outcome;
    solver->best.method = method;
    keep(solver);
    return PERP_OK;
}

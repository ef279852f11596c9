/* A system that falls into independent parts, one part after the other: what one line search could
 * not bring down together is solved part by part, as each would be by itself. */
#include <string.h>

#include "linalg/lines.h"
#include "ncp/solver.h"

#define MOST_PARTS 64 /* a run for one of them looks at all */

int32_t perp__ncp_split(perp_ncp_solver *solver)
{
    const perp__ncp_model *m = &solver->model;
    perp__ncp_parts *parts = &solver->parts;
    const size_t bytes = (size_t)m->n * sizeof(double);

    memcpy(parts->of, m->group, (size_t)m->n * sizeof *parts->of);
    parts->count = perp__number_parts(parts->of, m->n);
    if (solver->best_method < 0 || parts->count < 2 || parts->count > MOST_PARTS)
        return 0;
    memcpy(parts->z, solver->best_z, bytes);
    memcpy(parts->lower, m->lower, bytes);
    memcpy(parts->upper, m->upper, bytes);
    memcpy(parts->start, solver->start, bytes);
    return 1;
}

void perp__ncp_hold_others(perp_ncp_solver *solver, int32_t p)
{
    perp__ncp_model *m = &solver->model;
    const perp__ncp_parts *parts = &solver->parts;

    for (int32_t i = 0; i < m->n; i++) {
        const int32_t held = p >= 0 && parts->of[i] != p;

        m->lower[i] = held ? parts->z[i] : parts->lower[i];
        m->upper[i] = held ? parts->z[i] : parts->upper[i];
        solver->start[i] = held ? parts->z[i] : parts->start[i];
    }
    memcpy(solver->candidate, parts->z, (size_t)m->n * sizeof(double));
    m->colours.known = 0; /* the columns of what is held are left out */
    solver->best_method = -1;
}

void perp__ncp_gather(perp_ncp_solver *solver, int32_t p)
{
    perp__ncp_parts *parts = &solver->parts;

    for (int32_t i = 0; i < solver->model.n; i++)
        if (parts->of[i] == p)
            parts->z[i] = solver->best_z[i];
}

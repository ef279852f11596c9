/* Accelerations of contacts that do not slide are velocities of a contact problem: M v' = k + J'f,
 * u' = J v' + bias, 0 <= f_n perp u_n' >= 0 and friction opposite to u_t'. */
#include <math.h>
#include <string.h>

#include "mechanism/accelerations/accelerations.h"

/* What the directions of the solver's answer are worth, for ranks. */
#define ROUGH 1e-6

/* Whether there is a slip that starts in a plane, and nothing that slides with friction. */
static int32_t applies(const perp__acceleration *a)
{
    int32_t planes = 0, i;

    for (i = 0; i < a->units; i++) {
        if (a->unit[i].moves && a->unit[i].friction && !a->unit[i].dry)
            return 0;
        planes += a->unit[i].tangents == 2 && a->unit[i].friction && !a->unit[i].moves;
    }
    return planes > 0;
}

static void fill(perp__acceleration *a, perp__velocity_problem *problem)
{
    const perp_mechanism *m = a->m;
    const size_t n = (size_t)m->n;
    int32_t i, j;
    size_t k;

    memcpy(a->seed.momentum, m->begin.k, n * sizeof *a->seed.momentum);
    memset(a->seed.included, 0, (size_t)m->contacts);
    memset(a->seed.friction, 0, (size_t)m->contacts * sizeof *a->seed.friction);
    memset(a->seed.dry, 0, (size_t)m->dry * sizeof *a->seed.dry);
    for (i = 0; i < a->units; i++) {
        const perp__unit *unit = a->unit + i;

        if (!unit->dry) {
            a->seed.included[unit->source] = 1;
            a->seed.friction[unit->source] = unit->friction ? unit->mu : 0.0;
        } else if (!unit->moves) {
            a->seed.dry[unit->source - m->contacts] = unit->bound;
        } else {
            for (j = 0; j < unit->tangents; j++) {
                const double *row = m->begin.J + (size_t)a->row_of[unit->row + j] * n;

                for (k = 0; k < n; k++)
                    a->seed.momentum[k] -= row[k] * unit->bound * unit->way[j];
            }
        }
    }
    problem->momentum = a->seed.momentum;
    problem->shift = a->zeros;
    problem->friction = a->seed.friction;
    problem->included = a->seed.included;
    problem->dry = a->seed.dry;
}

static void take_pattern(perp__acceleration *a, const perp__velocity_answer *answer)
{
    int32_t i, j;

    for (i = 0; i < a->units; i++) {
        const perp__unit *unit = a->unit + i;
        double *way = a->pattern.way + 2 * (size_t)i, length = 0.0;
        const double *u = answer->u + a->row_of[unit->row] + !unit->dry;
        int32_t mode = answer->modes[unit->source];

        way[0] = way[1] = 0.0;
        if (mode != PERP_MECHANISM_SEPARATE && !unit->friction)
            mode = PERP_MECHANISM_SLIP;
        for (j = 0; j < unit->tangents; j++)
            length = hypot(length, u[j]);
        for (j = 0; j < unit->tangents && mode == PERP_MECHANISM_SLIP && unit->friction; j++)
            way[j] = unit->moves ? unit->way[j] : length > 0.0 ? u[j] / length : j == 0;
        a->pattern.mode[i] = (int8_t)mode;
    }
}

perp_status perp__found_seed(perp__acceleration *a)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    perp__velocity_problem problem = {0};
    perp_status status;

    if (!applies(a))
        return PERP_OK;
    terms.drift = a->bias;
    problem.terms = &terms;
    fill(a, &problem);
    m->second.iterations = 0;
    status = perp__solve_velocities(m, &m->second, &problem);
    m->answer.iterations += m->second.iterations; /* of the step that asks, if one does */
    if (status != PERP_OK || !perp__is_good(m->second.outcome))
        return status;
    take_pattern(a, &m->second);
    return perp__found_turning(a) > 0 ? perp__found_try(a, ROUGH) : PERP_OK;
}

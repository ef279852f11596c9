/* Answers of a few patterns, where there are too many or a family is too large.
 *
 * Accelerations are velocities of a contact problem: M v' = k + J'f, u' = J v' + bias,
 * 0 <= f_n perp u_n' >= 0 and friction opposite to u_t'. Its solver gives one.
 *
 * Others by fixed points: the point of a pattern asks for another one (what is pulled separates,
 * what is passed presses, what friction does not hold slips against it, what slips against its
 * acceleration sticks), until it asks for its own. From all contacts that press, from none, then
 * from patterns by a fixed random sequence. */
#include <math.h>
#include <string.h>

#include "base/random.h"
#include "mechanism/accelerations/accelerations.h"

/* ---- of the contact problem ------------------------------------------------------------------ */

/* What slides already has a drift too fast to be turned round, so that friction is opposite to it.
 */
static perp__velocity_problem pose(perp__acceleration *a, perp__terms *terms)
{
    const perp_mechanism *m = a->m;
    const perp__velocity_problem problem = {.terms = terms,
                                            .momentum = terms->k,
                                            .shift = a->zeros,
                                            .friction = a->seed.friction,
                                            .included = a->seed.included,
                                            .dry = a->seed.dry};
    double fastest = 0.0;

    terms->drift = m->differences;
    memcpy(terms->drift, a->bias, (size_t)m->rows * sizeof *a->bias);
    memset(a->seed.included, 0, (size_t)m->contacts);
    memset(a->seed.friction, 0, (size_t)m->contacts * sizeof *a->seed.friction);
    for (int32_t i = 0; i < a->active; i++)
        fastest = fmax(fastest, a->load[i]);
    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;

        if (element->dry) {
            a->seed.dry[element->source - m->contacts] = element->bound;
        } else {
            a->seed.included[element->source] = 1;
            a->seed.friction[element->source] = element->friction ? element->mu : 0.0;
        }
        for (int32_t j = 0; j < element->tangents && element->moves; j++)
            terms->drift[a->row_of[element->tangent] + j] +=
                PERP__FAST * fastest * element->direction[j];
    }
    return problem;
}

/* The direction of an element's slip: its own where it slides already, else that of sign x. */
static void direct(perp__acceleration *a, int32_t index, double sign, const double *x)
{
    const perp__element *element = a->element + index;
    const double length = perp__length(x, element->tangents);
    double *direction = a->pattern.direction + 2 * (size_t)index;

    direction[0] = direction[1] = 0.0;
    if (a->pattern.mode[index] != PERP_MECHANISM_SLIP || !element->friction)
        return;
    for (int32_t i = 0; i < element->tangents; i++)
        direction[i] = element->moves ? element->direction[i]
                       : length > 0.0 ? sign * x[i] / length
                                      : i == 0; /* without a size it doesn't matter */
}

perp_status perp__acceleration_seed(perp__acceleration *a)
{
    perp_mechanism *m = a->m;
    perp__terms terms = m->begin;
    perp__velocity_problem problem;
    const perp__motion *answer = &m->second;
    int32_t planes = 0, slides = 0, two_sided = 0;
    perp_status status;

    /* 1. after an enumeration where nothing slides with friction, for slips that start in a plane
     */
    for (int32_t i = 0; i < a->elements; i++) {
        two_sided |= a->element[i].two_sided;
        slides |= a->element[i].moves && a->element[i].friction && !a->element[i].dry;
        planes += a->element[i].tangents == 2 && a->element[i].friction && !a->element[i].moves;
    }
    if (two_sided || (a->complete && (slides || planes == 0)))
        return PERP_OK;
    /* 2. the contact problem */
    problem = pose(a, &terms);
    m->second.iterations = 0;
    status = perp__solve_velocities(m, &m->second, &problem);
    m->answer.iterations += answer->iterations; /* of the step that asks, if one does */
    if (status != PERP_OK || !perp__is_good(answer->outcome))
        return status;
    /* 3. its pattern */
    for (int32_t i = 0; i < a->elements; i++) {
        const perp__element *element = a->element + i;
        const int32_t mode = answer->modes[element->source];

        /* what slides and is stopped all the same has no acceleration, unless it slides on */
        a->pattern.mode[i] = (int8_t)mode;
        if (mode != PERP_MECHANISM_SEPARATE && (!element->friction || element->moves))
            a->pattern.mode[i] = PERP_MECHANISM_SLIP;
        direct(a, i, 1.0, answer->u + a->row_of[element->row] + !element->dry);
    }
    return a->complete && perp__slip_count(a) == 0
               ? PERP_OK
               : perp__acceleration_try(a, PERP__ROUGH_DIRECTIONS);
}

/* ---- from pattern to pattern ------------------------------------------------------------------
 */

/* What the element is to do by the forces and accelerations of now; whether that is something else.
 */
static bool change(perp__acceleration *a, int32_t index)
{
    const perp__element *element = a->element + index;
    const double *f = a->linear.x + element->tangent, *u = a->linear.u + element->tangent;
    const double normal = element->dry ? element->bound : a->linear.x[element->row];
    double *direction = a->pattern.direction + 2 * (size_t)index;
    double *load = a->pattern.load + PERP__MOST_NORMALS * (size_t)index;
    const int32_t count = element->tangents, before = a->pattern.mode[index];
    const double was[3] = {direction[0], direction[1], load[0]};
    int32_t mode = before;

    if (element->two_sided && element->normals == 1)
        load[0] = normal < 0.0 ? -1.0 : 1.0;
    if (!element->two_sided && !element->dry && before != PERP_MECHANISM_SEPARATE && normal < 0.0)
        mode = PERP_MECHANISM_SEPARATE;
    else if (before == PERP_MECHANISM_SEPARATE && a->linear.u[element->row] < 0.0)
        mode = element->friction && !element->moves ? PERP_MECHANISM_STICK : PERP_MECHANISM_SLIP;
    else if (before == PERP_MECHANISM_STICK &&
             perp__length(f, count) > (element->dry ? 1.0 : element->mu_stick) * fabs(normal))
        mode = PERP_MECHANISM_SLIP;
    else if (perp__element_starts(element, before) &&
             !(direction[0] * u[0] + (count > 1 ? direction[1] * u[1] : 0.0) > 0.0))
        mode = PERP_MECHANISM_STICK;
    a->pattern.mode[index] = (int8_t)mode;
    if (mode != before)
        direct(a, index, before == PERP_MECHANISM_STICK ? -1.0 : 1.0,
               before == PERP_MECHANISM_STICK ? f : u);
    return mode != before || direction[0] != was[0] || direction[1] != was[1] || load[0] != was[2];
}

perp_status perp__acceleration_search(perp__acceleration *a, perp_mechanism_summary *summary)
{
    uint64_t seed = 1;
    perp_status status = PERP_OK;

    for (int32_t start = 0; start < a->m->settings.starts && status == PERP_OK; start++) {
        int32_t changes = 1;

        for (int32_t i = 0; i < a->elements; i++) {
            const int32_t count = perp__element_choices(a, i);
            const int32_t some = (int32_t)(perp__next_random(&seed) % (uint64_t)count);

            perp__element_choose(a, i, start == 0 ? (count > 1) : start == 1 ? 0 : some);
        }
        /* all at once, then one at a time: that ends in its answer where there is one for any
         * loads (K. G. Murty's least index, Opsearch 11 (1974)) */
        for (int32_t round = 0; changes > 0 && round < 8 * a->elements + 8 && status == PERP_OK &&
                                !perp__mechanism_is_late(a->m);
             round++) {
            summary->patterns++;
            status = perp__acceleration_try(a, PERP__ROUGH_DIRECTIONS);
            changes = 0;
            for (int32_t i = 0; i < a->elements && (changes == 0 || round < 2 * a->elements); i++)
                changes += change(a, i);
        }
    }
    return status;
}

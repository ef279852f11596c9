/* All accelerations of a state, the front door. */
#include "mechanism/accelerations/accelerations.h"

#include <string.h>

#include "base/context.h"

PERP__WORDS(perp_mechanism_reason_text, "unknown reason",
            "one acceleration, whatever the loads are", "a contact that slides pulls itself in",
            "a contact that slides neither pulls itself in nor pushes itself away",
            "contacts pull each other in", "contacts share a load", "too many contacts to decide",
            "friction is larger at rest than in motion")

/* ---- memory -------------------------------------------------------------------------------- */

static void layout(perp__arena *arena, void *object)
{
    perp__acceleration *a = object;
    const size_t n = (size_t)a->m->n, rows = (size_t)a->m->rows;
    const size_t elements = (size_t)(a->m->contacts + a->m->dry);

    PERP__DOUBLES(arena, rows, &a->bias, &a->size, &a->beta, &a->load, &a->scale, &a->zeros);
    PERP__INTEGERS(arena, rows, &a->row_of, &a->turning.columns, &a->turning.rows);
    a->indices = perp__arena_take(arena, 2 * rows, sizeof(int32_t));
    a->element = perp__arena_take(arena, elements, sizeof *a->element);
    a->pattern.mode = perp__arena_take(arena, elements, 1);
    PERP__DOUBLES(arena, 2 * elements, &a->pattern.direction, &a->chosen);
    a->tree.next = perp__arena_take(arena, elements, sizeof(int32_t));
    a->linear.angle = perp__arena_take(arena, elements, sizeof(double));
    a->pattern.load = perp__arena_take(arena, PERP__MOST_NORMALS * elements, sizeof(double));
    a->load_work = perp__arena_take(arena, perp__load_room(elements), sizeof(double));
    a->turn_work = perp__arena_take(arena, 3 * rows, sizeof(double));
    PERP__DOUBLES(arena, n, &a->velocity);
    a->seed.friction = perp__arena_take(arena, (size_t)a->m->contacts, sizeof(double));
    a->seed.dry = perp__arena_take(arena, (size_t)a->m->dry, sizeof(double));
    a->seed.included = perp__arena_take(arena, (size_t)a->m->contacts, 1);
}

void perp__acceleration_release(perp__acceleration *a)
{
    if (!a)
        return;
    perp__answers_release(&a->answers);
    perp__cone_release(&a->polyhedron.cone);
    perp__arena_release(&a->blocks);
    perp__work_release(a);
}

/* ---- the question -------------------------------------------------------------------------- */

perp_status perp__acceleration_open(perp_mechanism *m)
{
    perp__acceleration *a = m->accelerations;

    if (!a) {
        a = m->accelerations = perp__work_create(m, sizeof *a, layout);
        if (!a)
            return PERP_ERROR_MEMORY;
        a->answers.context = a->polyhedron.cone.context = m->context;
        a->linear.tolerance = PERP__NOTHING;
        a->linear.user = a;
        a->linear.conditions = perp__element_conditions;
        a->answers.length = m->rows;
        a->answers.positions = m->contacts + m->dry;
        a->answers.eigenvalues = 4 * m->rows;
        a->answers.extra = m->n + m->rows + (2 + PERP__MOST_NORMALS) * (m->contacts + m->dry);
        a->answers.holds = perp__acceleration_holds;
        a->answers.user = a;
        a->polyhedron.rounding = a->polyhedron.row_rounding = PERP__NOTHING;
        a->polyhedron.least = PERP__AGREEMENT;
        memset(a->zeros, 0, (size_t)m->rows * sizeof *a->zeros);
    }
    a->asked = a->has_singular = a->has_negative = a->bent = 0;
    perp__answers_clear(&a->answers);
    return PERP_OK;
}

perp_status perp_mechanism_accelerations(perp_mechanism *mechanism, perp_mechanism_summary *summary,
                                         double t, const double *q, const double *v)
{
    perp_mechanism *m = mechanism;
    perp_mechanism_summary copy;
    int32_t impact;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    perp_struct_init(&copy, sizeof copy);
    status = PERP__CHECK(perp_mechanism_summary, m->context, summary);
    PERP__THEN(status, perp__mechanism_check_state(m, t, q, v));
    PERP__THEN(status, perp__acceleration_open(m));
    PERP__THEN(status, perp__acceleration_state(m->accelerations, &impact, t, q, v));
    PERP__THEN(status, perp__acceleration_look(m->accelerations, &copy, impact));
    if (status == PERP_OK) {
        m->accelerations->asked = 1;
        perp__struct_write(summary, &copy, sizeof copy);
    }
    return perp__leave(m->context, status);
}

perp_status perp_mechanism_get_acceleration(perp_mechanism *mechanism, perp_mechanism_found *found,
                                            int32_t index)
{
    perp_mechanism *m = mechanism;
    const perp__acceleration *a;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    a = m->accelerations;
    status = PERP__CHECK(perp_mechanism_found, m->context, found);
    if (status == PERP_OK && (!a || !a->asked))
        status = perp__refuse(m->context,
                              "there are no accelerations: ask perp_mechanism_accelerations first");
    if (status == PERP_OK && (index < 0 || index >= a->answers.count))
        status = perp__refuse(m->context, "index is %d, and there are %d answers", (int)index,
                              (int)a->answers.count);
    if (status == PERP_OK) {
        const perp__answer *answer = perp__answers_get(&a->answers, index);
        const perp_mechanism_found copy = {
            .stable = answer->stable,
            .flutter = answer->flutter,
            .at_vertex = answer->at_vertex,
            .dimension = answer->dimension,
            .free = answer->free,
            .vertex_count = answer->vertices,
            .ray_count = answer->rays,
            .residual = answer->residual,
            .acceleration = answer->extra,
            .force = answer->middle,
            .row_acceleration = perp__answer_row_acceleration(a, answer),
            .modes = answer->modes,
            .eigenvalues = answer->eigenvalues,
            .eigenvalue_count = answer->eigenvalue_count,
            .vertices = answer->points,
            .rays = answer->points + (size_t)answer->vertices * (size_t)m->rows};

        perp__struct_write(found, &copy, sizeof copy);
    }
    return perp__leave(m->context, status);
}

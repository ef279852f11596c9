/* The life of a mechanism: create, set, destroy. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "mechanism/schemes/implicit.h"

/* Seconds that count as a time limit that has passed: 0 would be none. */
#define SHORTEST 1e-9

static void layout_terms(perp__arena *arena, const perp_mechanism *m, perp__terms *terms)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;

    PERP__DOUBLES(arena, n * n, &terms->M, &terms->factor);
    PERP__DOUBLES(arena, n, &terms->k);
    PERP__DOUBLES(arena, (size_t)(m->contacts + m->constraints - m->bilateral), &terms->gap);
    PERP__DOUBLES(arena, (size_t)m->contacts, &terms->mu);
    PERP__DOUBLES(arena, rows * n, &terms->J);
    PERP__DOUBLES(arena, rows, &terms->drift);
    PERP__DOUBLES(arena, (size_t)m->constraints, &terms->c);
    PERP__DOUBLES(arena, (size_t)m->dry, &terms->bound);
}

static void layout_motion(perp__arena *arena, const perp_mechanism *m, perp__motion *motion)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;

    PERP__DOUBLES(arena, (size_t)m->coordinates, &motion->q);
    PERP__DOUBLES(arena, n + 3 * rows, &motion->v);
    motion->u = motion->v ? motion->v + n : NULL; /* NULL while the arena only measures */
    motion->r = motion->v ? motion->u + rows : NULL;
    motion->ray = motion->v ? motion->r + rows : NULL;
    PERP__INTEGERS(arena, (size_t)(m->contacts + m->dry), &motion->modes);
    motion->holds = perp__arena_take(arena, rows, 1);
}

static void layout(perp__arena *arena, void *object)
{
    perp_mechanism *m = object;
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, contacts = (size_t)m->contacts;
    perp__motion *const motions[] = {&m->answer, &m->second, &m->now,
                                     &m->next,   &m->trial,  &m->half};

    PERP__INTEGERS(arena, contacts + 1, &m->dims, &m->two_sided, &m->starts);
    PERP__INTEGERS(arena, (size_t)m->constraints, &m->constraint_row);
    PERP__INTEGERS(arena, rows, &m->normal_of);
    PERP__INTEGERS(arena, contacts + (size_t)m->dry, &m->tangent, &m->tangents);
    PERP__DOUBLES(arena, contacts, &m->mu, &m->mu_static, &m->stribeck, &m->shift, &m->friction,
                  &m->restitution, &m->pressure, &m->impact_shift, &m->start_speed);
    layout_terms(arena, m, &m->begin);
    layout_terms(arena, m, &m->end);
    for (size_t k = 0; k < sizeof motions / sizeof *motions; k++)
        layout_motion(arena, m, motions[k]);
    perp__held_rows_layout(&m->held, arena, rows * n, rows, n);
    PERP__DOUBLES(arena, n, &m->momentum, &m->free, &m->kept_v, &m->acceleration);
    PERP__DOUBLES(arena, (size_t)m->dry, &m->dry_bound);
    PERP__DOUBLES(arena, rows, &m->start_velocity, &m->free_velocity);
    PERP__DOUBLES(arena, (size_t)m->coordinates, &m->moved, &m->kept_q);
    PERP__DOUBLES(arena, 4 * n, &m->work);
    m->included = perp__arena_take(arena, contacts, 1);
    m->let_go = perp__arena_take(arena, contacts, 1);
}

/* Each work begins with this. */
typedef struct work {
    PERP__WORK;
} work;

void *perp__work_create(perp_mechanism *m, size_t size, perp__layout layout_work)
{
    work *made = perp__allocate(m->context, 1, size);

    if (!made) {
        perp__fail_memory(m->context, "a mechanism");
        return NULL;
    }
    memset(made, 0, size);
    made->m = m;
    if (!layout_work || perp__arena_fit(&made->arena, m->context, layout_work, made) == PERP_OK)
        return made;
    perp__work_release(made);
    return NULL;
}

void perp__work_release(void *object)
{
    work *made = object;

    if (made) {
        perp__arena_release(&made->arena);
        perp__release(made->m->context, made);
    }
}

perp_status perp__mechanism_fail_in(perp_mechanism *m, perp_status status, const char *what)
{
    char message[PERP__MESSAGE_SIZE];

    memcpy(message, m->context->message, sizeof message);
    return perp__fail(m->context, status, "%s: %s", what, message);
}

void perp__copy_motion(const perp_mechanism *m, perp__motion *to, const perp__motion *from)
{
    memcpy(to->v, from->v, ((size_t)m->n + 3 * (size_t)m->rows) * sizeof *to->v);
    memcpy(to->modes, from->modes, (size_t)(m->contacts + m->dry) * sizeof *to->modes);
    memcpy(to->holds, from->holds, (size_t)m->rows);
}

void perp__clear_motion(const perp_mechanism *m, perp__motion *motion)
{
    memset(motion->r, 0, 2 * (size_t)m->rows * sizeof *motion->r); /* and the ray */
    memset(motion->holds, 0, (size_t)m->rows);
    for (int32_t j = 0; j < m->contacts + m->dry; j++) /* dry friction without a bound slides */
        motion->modes[j] = j < m->contacts ? PERP_CONTACT_SEPARATE : PERP_CONTACT_SLIP;
    motion->certificate = motion->has_ray = 0;
}

/* The solvers for these settings. */
static perp_status fit_assemblies(perp_mechanism *m, const perp_mechanism_settings *settings)
{
    const int32_t poisson = settings->law == PERP_MECHANISM_POISSON;
    perp_status status = perp__assembly_fit(m, &m->projection, 0, 1e-10, 0);

    m->assembly.holds_itself = 1;
    PERP__THEN(status, perp__assembly_fit(m, &m->assembly, poisson, settings->tol, settings->cone));
    return status;
}

static void release(void *object)
{
    perp_mechanism *m = object;

    perp__acceleration_release(m->accelerations);
    perp__implicit_release(m->implicit);
    perp__work_release(m->theta);
    perp__work_release(m->adaptive);
    perp__assembly_release(&m->assembly);
    perp__assembly_release(&m->projection);
    perp__arena_release(&m->arena);
}

static const perp__kind kind = {"a mechanism", sizeof(perp_mechanism), release};

/* A handle with sizes and room, but without the numbers of the model. */
static perp_status make(perp_context *context, perp_mechanism **made,
                        const perp_mechanism_settings *settings, const perp_mechanism_model *model)
{
    perp_mechanism *m = perp__handle_create(context, &kind);
    perp_status status;

    if (!m)
        return PERP_ERROR_MEMORY;
    m->settings = *settings;
    perp__mechanism_sizes(m, model);
    status = perp__arena_fit(&m->arena, context, layout, m);
    if (status == PERP_OK) {
        perp__mechanism_take(m, model);
        status = fit_assemblies(m, settings);
    }
    PERP__THEN(status, perp__implicit_create(m, &m->implicit, settings));
    if (status != PERP_OK) {
        perp__handle_end(m);
        return status;
    }
    *made = m;
    return PERP_OK;
}

static perp_status create(perp_context *context, perp_mechanism **mechanism,
                          const perp_mechanism_settings *settings,
                          const perp_mechanism_model *model)
{
    perp_mechanism_settings own;
    perp_mechanism_model read;
    perp_status status = perp__check_pointer(context, "mechanism", mechanism);

    PERP__THEN(status, perp__mechanism_settings_read(context, &own, settings));
    PERP__THEN(status, perp__mechanism_model_read(context, &read, model));
    PERP__THEN(status, perp__mechanism_check_cone(context, &own, &read));
    return status == PERP_OK ? make(context, mechanism, &own, &read) : status;
}

perp_status perp_mechanism_create(perp_context *context, perp_mechanism **mechanism,
                                  const perp_mechanism_settings *settings,
                                  const perp_mechanism_model *model)
{
    return PERP__CALL(perp__enter(context), context, create(context, mechanism, settings, model));
}

void perp_mechanism_destroy(perp_mechanism *mechanism)
{
    perp__handle_destroy(mechanism, &kind);
}

perp_status perp__mechanism_enter(perp_mechanism *m)
{
    const perp_status status = perp__handle_enter(m, &kind);

    if (status == PERP_OK)
        m->deadline = m->settings.time_limit > 0.0 ? perp__now() + m->settings.time_limit : 0.0;
    return status;
}

int32_t perp__mechanism_is_late(const perp_mechanism *m)
{
    return m->deadline > 0.0 && perp__now() > m->deadline;
}

double perp__mechanism_time_left(const perp_mechanism *m)
{
    return m->deadline > 0.0 ? fmax(m->deadline - perp__now(), SHORTEST) : 0.0;
}

static perp_status set(perp_mechanism *m, const perp_mechanism_settings *settings)
{
    perp_mechanism_settings own;
    perp__implicit *implicit = NULL;
    perp_status status = perp__mechanism_settings_read(m->context, &own, settings);

    PERP__THEN(status, perp__mechanism_check_cone(m->context, &own, &m->model));
    PERP__THEN(status, perp__implicit_create(m, &implicit, &own));
    PERP__THEN(status, fit_assemblies(m, &own));
    if (status == PERP_OK) {
        perp__implicit_release(m->implicit);
        m->implicit = implicit;
        m->settings = own;
    } else {
        perp__implicit_release(implicit);
    }
    return status;
}

perp_status perp_mechanism_set(perp_mechanism *mechanism, const perp_mechanism_settings *settings)
{
    return PERP__CALL(perp__mechanism_enter(mechanism), mechanism->context,
                      set(mechanism, settings));
}

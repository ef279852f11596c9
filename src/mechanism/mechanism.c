/* The life of a mechanism: create, set, destroy. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "mechanism/schemes/adaptive.h"
#include "mechanism/schemes/implicit.h"

/* Seconds that count as a time limit that has passed: 0 would be none. */
#define SHORTEST 1e-9

static void take_vector(perp__arena *arena, double **vector, size_t count)
{
    *vector = perp__arena_take(arena, count, sizeof(double));
}

static void layout_terms(perp__arena *arena, const perp_mechanism *m, perp__terms *terms)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;

    take_vector(arena, &terms->M, n * n);
    take_vector(arena, &terms->factor, n * n);
    take_vector(arena, &terms->k, n);
    take_vector(arena, &terms->gap, (size_t)(m->contacts + m->constraints - m->bilateral));
    take_vector(arena, &terms->mu, (size_t)m->contacts);
    take_vector(arena, &terms->J, rows * n);
    take_vector(arena, &terms->drift, rows);
    take_vector(arena, &terms->c, (size_t)m->constraints);
    take_vector(arena, &terms->bound, (size_t)m->dry);
}

static void layout_motion(perp__arena *arena, const perp_mechanism *m, perp__motion *motion)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;

    take_vector(arena, &motion->q, (size_t)m->coordinates);
    take_vector(arena, &motion->v, n + 3 * rows);
    motion->u = motion->v ? motion->v + n : NULL; /* NULL while the arena only measures */
    motion->r = motion->v ? motion->u + rows : NULL;
    motion->ray = motion->v ? motion->r + rows : NULL;
    motion->modes = perp__arena_take(arena, (size_t)(m->contacts + m->dry), sizeof(int32_t));
    motion->holds = perp__arena_take(arena, rows, 1);
}

static void layout(perp__arena *arena, void *object)
{
    perp_mechanism *m = object;
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, contacts = (size_t)m->contacts;
    double **const of_contacts[] = {&m->mu,       &m->mu_static,    &m->stribeck,
                                    &m->shift,    &m->friction,     &m->restitution,
                                    &m->pressure, &m->impact_shift, &m->start_speed};
    perp__motion *const motions[] = {&m->answer, &m->second, &m->now,
                                     &m->next,   &m->trial,  &m->half};

    PERP__INTEGERS(arena, contacts, &m->dims, &m->two_sided);
    m->constraint_row = perp__arena_take(arena, (size_t)m->constraints, sizeof(int32_t));
    m->starts = perp__arena_take(arena, contacts + 1, sizeof(int32_t));
    for (size_t k = 0; k < sizeof of_contacts / sizeof *of_contacts; k++)
        take_vector(arena, of_contacts[k], contacts);
    layout_terms(arena, m, &m->begin);
    layout_terms(arena, m, &m->end);
    for (size_t k = 0; k < sizeof motions / sizeof *motions; k++)
        layout_motion(arena, m, motions[k]);
    perp__held_rows_layout(&m->held, arena, rows * n, rows, n);
    take_vector(arena, &m->momentum, n);
    take_vector(arena, &m->free, n);
    take_vector(arena, &m->dry_bound, (size_t)m->dry);
    take_vector(arena, &m->start_velocity, rows);
    take_vector(arena, &m->free_velocity, rows);
    take_vector(arena, &m->moved, (size_t)m->coordinates);
    take_vector(arena, &m->kept_q, (size_t)m->coordinates);
    take_vector(arena, &m->kept_v, n);
    take_vector(arena, &m->work, 4 * n);
    m->included = perp__arena_take(arena, contacts, 1);
    m->let_go = perp__arena_take(arena, contacts, 1);
    m->normal_of = perp__arena_take(arena, rows, sizeof(int32_t));
    PERP__INTEGERS(arena, contacts + (size_t)m->dry, &m->tangent, &m->tangents);
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
    perp__arena_init(&made->arena, m->context);
    made->m = m;
    if (!layout_work || perp__arena_fit(&made->arena, layout_work, made) == PERP_OK)
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
    if (status == PERP_OK)
        status = perp__assembly_fit(m, &m->assembly, poisson, settings->tol, settings->cone);
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
    perp__arena_init(&m->arena, context);
    perp__arena_init(&m->assembly.arena, context);
    perp__arena_init(&m->projection.arena, context);
    perp__mechanism_sizes(m, model);
    status = perp__arena_fit(&m->arena, layout, m);
    if (status == PERP_OK) {
        perp__mechanism_take(m, model);
        status = fit_assemblies(m, settings);
    }
    if (status == PERP_OK)
        status = perp__implicit_create(m, &m->implicit, settings);
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

    if (status == PERP_OK)
        status = perp__mechanism_settings_read(context, &own, settings);
    if (status == PERP_OK)
        status = perp__mechanism_model_read(context, &read, model);
    if (status == PERP_OK)
        status = perp__mechanism_check_cone(context, &own, &read);
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

    if (status == PERP_OK)
        status = perp__mechanism_check_cone(m->context, &own, &m->model);
    if (status == PERP_OK)
        status = perp__implicit_create(m, &implicit, &own);
    if (status == PERP_OK)
        status = fit_assemblies(m, &own);
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

/* The life of a mechanism: create, set, destroy. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "mechanism/schemes/adaptive.h"
#include "mechanism/assembly.h"
#include "mechanism/schemes/implicit.h"
#include "mechanism/mechanism_read.h"
#include "mechanism/schemes/theta.h"

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
    take_vector(arena, &terms->gap, (size_t)m->contacts);
    take_vector(arena, &terms->mu, (size_t)m->contacts);
    take_vector(arena, &terms->J, rows * n);
    take_vector(arena, &terms->drift, rows);
    take_vector(arena, &terms->c, (size_t)m->bilateral);
    take_vector(arena, &terms->bound, (size_t)m->dry);
}

static void layout_answer(perp__arena *arena, const perp_mechanism *m,
                          perp__velocity_answer *answer)
{
    const size_t rows = (size_t)m->rows;

    take_vector(arena, &answer->v, (size_t)m->n);
    take_vector(arena, &answer->r, rows);
    take_vector(arena, &answer->u, rows);
    take_vector(arena, &answer->ray, rows);
    answer->modes = perp__arena_take(arena, (size_t)(m->contacts + m->dry), sizeof(int32_t));
    answer->holds = perp__arena_take(arena, rows, 1);
}

static void layout_state(perp__arena *arena, const perp_mechanism *m, perp__mechanism_state *state)
{
    const size_t rows = (size_t)m->rows;

    take_vector(arena, &state->q, (size_t)m->coordinates);
    take_vector(arena, &state->v, (size_t)m->n);
    take_vector(arena, &state->impulse, rows);
    take_vector(arena, &state->velocity, rows);
    take_vector(arena, &state->ray, rows);
    state->modes = perp__arena_take(arena, (size_t)(m->contacts + m->dry), sizeof(int32_t));
}

static size_t work_size(const perp_mechanism *m)
{
    const size_t n = (size_t)m->n, rows = (size_t)m->rows;

    return rows * n + 4 * rows + 2 * n * n + 8 * n + 2 * (size_t)m->coordinates;
}

static void layout(perp__arena *arena, void *object)
{
    perp_mechanism *m = object;
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, contacts = (size_t)m->contacts;
    double **const of_contacts[] = {&m->mu,       &m->mu_static,    &m->stribeck,
                                    &m->shift,    &m->friction,     &m->restitution,
                                    &m->pressure, &m->impact_shift, &m->start_speed};
    perp__mechanism_state *const states[] = {&m->now, &m->next, &m->trial, &m->half};
    size_t k;

    m->dims = perp__arena_take(arena, contacts, sizeof(int32_t));
    m->starts = perp__arena_take(arena, contacts + 1, sizeof(int32_t));
    for (k = 0; k < sizeof of_contacts / sizeof *of_contacts; k++)
        take_vector(arena, of_contacts[k], contacts);
    layout_terms(arena, m, &m->begin);
    layout_terms(arena, m, &m->end);
    layout_answer(arena, m, &m->answer);
    layout_answer(arena, m, &m->second);
    for (k = 0; k < sizeof states / sizeof *states; k++)
        layout_state(arena, m, states[k]);
    take_vector(arena, &m->momentum, n);
    take_vector(arena, &m->free, n);
    take_vector(arena, &m->dry_bound, (size_t)m->dry);
    take_vector(arena, &m->start_velocity, rows);
    take_vector(arena, &m->free_velocity, rows);
    take_vector(arena, &m->moved, (size_t)m->coordinates);
    take_vector(arena, &m->kept_q, (size_t)m->coordinates);
    take_vector(arena, &m->kept_v, n);
    take_vector(arena, &m->work, work_size(m));
    m->included = perp__arena_take(arena, contacts, 1);
    m->indices = perp__arena_take(arena, 2 * rows + n, sizeof(int32_t));
}

perp_status perp__mechanism_fail_in(perp_mechanism *m, perp_status status, const char *what)
{
    char message[PERP__MESSAGE_SIZE];

    memcpy(message, m->context->message, sizeof message);
    return perp__fail(m->context, status, "%s: %s", what, message);
}

static void release_assemblies(perp_mechanism *m)
{
    perp__assembly_release(&m->assembly);
    perp__assembly_release(&m->projection);
}

/* The solvers for these settings, in `assembly` and `projection`. */
static perp_status create_assemblies(perp_mechanism *m, const perp_mechanism_settings *settings,
                                     perp__assembly *assembly, perp__assembly *projection)
{
    const int32_t poisson = settings->law == PERP_MECHANISM_POISSON;
    perp_status status;

    memset(assembly, 0, sizeof *assembly);
    memset(projection, 0, sizeof *projection);
    assembly->holds_itself = 1;
    status = perp__assembly_create(m, assembly, poisson, settings->tol, settings->cone);
    if (status == PERP_OK)
        status = perp__assembly_create(m, projection, 0, 1e-10, 0);
    if (status != PERP_OK) {
        perp__assembly_release(assembly);
        perp__assembly_release(projection);
    }
    return status;
}

static void release(void *object)
{
    perp_mechanism *m = object;

    perp__acceleration_release(m->accelerations);
    release_assemblies(m);
    perp__implicit_release(m, m->scheme_work);
    perp__theta_release(m);
    perp__adaptive_release(m);
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
        status = create_assemblies(m, settings, &m->assembly, &m->projection);
    }
    if (status == PERP_OK)
        status = perp__implicit_create(m, &m->scheme_work, settings);
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
    return status == PERP_OK ? make(context, mechanism, &own, &read) : status;
}

perp_status perp_mechanism_create(perp_context *context, perp_mechanism **mechanism,
                                  const perp_mechanism_settings *settings,
                                  const perp_mechanism_model *model)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    return perp__leave(context, create(context, mechanism, settings, model));
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
    perp__assembly assembly, projection;
    void *scheme_work = NULL;
    perp_status status = perp__mechanism_settings_read(m->context, &own, settings);

    if (status == PERP_OK)
        status = perp__implicit_create(m, &scheme_work, &own);
    if (status == PERP_OK)
        status = create_assemblies(m, &own, &assembly, &projection);
    if (status != PERP_OK) {
        perp__implicit_release(m, scheme_work);
        return status;
    }
    release_assemblies(m);
    perp__implicit_release(m, m->scheme_work);
    m->scheme_work = scheme_work;
    m->assembly = assembly;
    m->projection = projection;
    m->settings = own;
    return PERP_OK;
}

perp_status perp_mechanism_set(perp_mechanism *mechanism, const perp_mechanism_settings *settings)
{
    perp_status status = perp__mechanism_enter(mechanism);

    if (status != PERP_OK)
        return status;
    return perp__leave(mechanism->context, set(mechanism, settings));
}

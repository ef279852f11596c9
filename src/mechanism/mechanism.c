/* What a mechanism is made of, as it is handed over, and its life: create, set, destroy. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "linalg/spatial.h"
#include "mechanism/copy.h"

#define LARGEST 10000000 /* so that sizes of arrays fit */

PERP__INIT_WITH(perp_mechanism_model, .dim = 2, .dry_dim = 1)

PERP__INIT_WITH(perp_mechanism_settings, .project = 1, .theta = 0.5, .tol = 1e-10,
                .most_patterns = (int64_t)1 << 22, .directions = 16, .starts = 16, .stiffness = 1.0,
                .damping = 2.0)

/* ---- settings ------------------------------------------------------------------------------ */

static const perp__field settings_fields[] = {
    PERP__INTEGER(perp_mechanism_settings, scheme, PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA),
    PERP__INTEGER(perp_mechanism_settings, law, PERP_MECHANISM_MOREAU, PERP_MECHANISM_STRONGE),
    PERP__INTEGER(perp_mechanism_settings, select, PERP_MECHANISM_ANY, PERP_MECHANISM_FREEST),
    PERP__REAL(perp_mechanism_settings, theta, "[]", 0, 1),
    PERP__REAL(perp_mechanism_settings, tol, "()", 0, 1),
    PERP__REAL(perp_mechanism_settings, error, "[)", 0, 1),
    PERP__REAL(perp_mechanism_settings, shortest, "[)", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, longest, "[)", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, time_limit, "[]", 0, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, most_patterns, 1, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, directions, 3, PERP__MOST_EDGES),
    PERP__INTEGER(perp_mechanism_settings, starts, 1, INFINITY),
    PERP__REAL(perp_mechanism_settings, stiffness, "()", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, damping, "[)", 0, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, reserved, 0, 0),
    PERP__REAL(perp_mechanism_settings, overlap, "[)", 0, INFINITY),
};

static PERP__SETTINGS_READER(read_settings, perp_mechanism_settings, settings_fields,
                             read.cone == 0 || (read.cone >= 3 && read.cone <= PERP__MOST_EDGES)
                                 ? PERP_OK
                                 : perp__refuse(context,
                                                "settings.cone is %d, expected 0 or 3 to %d",
                                                (int)read.cone, PERP__MOST_EDGES))

    /* ---- the model ---- */

    static const perp__field sizes[] = {
        PERP__INTEGER(perp_mechanism_model, velocities, 1, LARGEST),
        PERP__INTEGER(perp_mechanism_model, coordinates, 0, LARGEST),
        PERP__INTEGER(perp_mechanism_model, contacts, 0, LARGEST),
        PERP__INTEGER(perp_mechanism_model, bilateral, 0, LARGEST),
        PERP__INTEGER(perp_mechanism_model, dry, 0, LARGEST),
        PERP__INTEGER(perp_mechanism_model, dry_dim, 1, 2),
};

static int32_t dim_of(const perp_mechanism_model *model, int32_t j)
{
    return model->dims ? model->dims[j] : model->dim;
}

/* Normals that hold both ways. */
static int32_t both_of(const perp_mechanism_model *model, int32_t j)
{
    return model->two_sided ? model->two_sided[j] : 0;
}

/* Checks sizes and callbacks. */
static perp_status read_model(perp_context *context, perp_mechanism_model *read,
                              const perp_mechanism_model *model)
{
    perp_status status = perp__check_pointer(context, "model", model);

    perp_mechanism_model_init(read, sizeof *read);
    PERP__THEN(status, PERP__READ(perp_mechanism_model, context, read, model));
    PERP__THEN(status, PERP__CHECK_FIELDS(context, "model", read, sizes));
    if (status == PERP_OK && !read->dims &&
        (read->dim < 1 || read->dim > (read->two_sided ? 5 : 3)))
        status = perp__refuse(context, "model.dim is %d, expected 1, 2 or 3", (int)read->dim);
    PERP__THEN(status, perp__check_dims(context, "model", read->contacts, read->dim, read->dims,
                                        read->two_sided));
    if (status != PERP_OK)
        return status;
    if (read->contacts > 0 && !read->contact_rows)
        return perp__refuse(context, "model.contact_rows is NULL, and there are %d contacts",
                            (int)read->contacts);
    if (read->bilateral > 0 && !read->bilateral_rows)
        return perp__refuse(context,
                            "model.bilateral_rows is NULL, and there are %d bilateral rows",
                            (int)read->bilateral);
    if (read->dry > 0 && !read->dry_rows)
        return perp__refuse(context, "model.dry_rows is NULL, and there are %d dry groups",
                            (int)read->dry);
    if (read->coordinates != 0 && read->coordinates != read->velocities && !read->kinematics)
        return perp__refuse(
            context, "model.kinematics is NULL, and there are %d coordinates for %d velocities",
            (int)read->coordinates, (int)read->velocities);
    return PERP_OK;
}

/* ---- life ------------------------------------------------------------------------------------ */

static void layout(perp__arena *arena, void *object)
{
    perp_mechanism *m = object;
    const size_t n = (size_t)m->n, rows = (size_t)m->rows, contacts = (size_t)m->contacts;
    perp__motion *const motions[] = {&m->answer, &m->second, &m->compressed, &m->now,
                                     &m->next,   &m->trial,  &m->half};

    PERP__INTEGERS(arena, contacts + 1, &m->dims, &m->two_sided, &m->starts);
    PERP__INTEGERS(arena, (size_t)m->constraints, &m->constraint_row);
    PERP__INTEGERS(arena, rows, &m->normal_of);
    PERP__INTEGERS(arena, contacts + (size_t)m->dry, &m->tangent, &m->tangents);
    PERP__DOUBLES(arena, contacts, &m->mu, &m->mu_static, &m->stribeck, &m->shift, &m->friction,
                  &m->restitution, &m->pressure, &m->impact_shift, &m->start_speed);
    for (size_t k = 0; k < 2; k++) {
        perp__terms *terms = k == 0 ? &m->begin : &m->end;

        PERP__DOUBLES(arena, n * n, &terms->M, &terms->factor);
        PERP__DOUBLES(arena, n, &terms->k);
        PERP__DOUBLES(arena, contacts + (size_t)(m->constraints - m->bilateral), &terms->gap);
        PERP__DOUBLES(arena, contacts, &terms->mu);
        PERP__DOUBLES(arena, rows * n, &terms->J);
        PERP__DOUBLES(arena, rows, &terms->drift);
        PERP__DOUBLES(arena, (size_t)m->constraints, &terms->c);
        PERP__DOUBLES(arena, (size_t)m->dry, &terms->bound);
    }
    for (size_t k = 0; k < sizeof motions / sizeof *motions; k++) {
        perp__motion *motion = motions[k];

        PERP__DOUBLES(arena, (size_t)m->coordinates, &motion->q);
        PERP__DOUBLES(arena, n + 3 * rows, &motion->v);
        motion->u = motion->v ? motion->v + n : NULL; /* NULL while the arena only measures */
        motion->r = motion->v ? motion->u + rows : NULL;
        motion->ray = motion->v ? motion->r + rows : NULL;
        PERP__INTEGERS(arena, contacts + (size_t)m->dry, &motion->modes);
        motion->holds = perp__arena_take(arena, rows, 1);
    }
    perp__active_rows_layout(&m->held, arena, rows * n, rows, n);
    PERP__DOUBLES(arena, n, &m->momentum, &m->free, &m->kept_v, &m->acceleration);
    PERP__DOUBLES(arena, (size_t)m->dry, &m->dry_bound);
    PERP__DOUBLES(arena, rows, &m->start_velocity, &m->free_velocity);
    PERP__DOUBLES(arena, (size_t)m->coordinates, &m->moved, &m->kept_q);
    PERP__DOUBLES(arena, 4 * n, &m->work);
    PERP__DOUBLES(arena, (3 + 2 * PERP__BIAS_COLUMNS) * rows, &m->differences);
    m->included = perp__arena_take(arena, contacts, 1);
    m->together = perp__arena_take(arena, contacts, 1);
    m->let_go = perp__arena_take(arena, contacts, 1);
    m->apart = perp__arena_take(arena, contacts, 1);
}

/* Each work begins with this. */
typedef struct work {
    PERP__WORK;
} work;

void *perp__work_create(perp_mechanism *m, size_t size, perp__layout layout_work)
{
    work *made = perp__allocate_zeros(m->context, 1, size, "a mechanism");

    if (!made)
        return NULL;
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

/* The solvers for these settings. Polyhedra of friction are not for what holds both ways. */
static perp_status fit_assemblies(perp_mechanism *m, const perp_mechanism_settings *settings)
{
    const bool expands = settings->law >= PERP_MECHANISM_POISSON;
    perp_status status;

    for (int32_t j = 0; j < m->contacts && settings->cone != 0; j++)
        if (m->two_sided[j] > 0)
            return perp__refuse(m->context,
                                "settings.cone is %d, but contact %d holds both ways: 0 alone",
                                (int)settings->cone, (int)j);
    status = perp__assembly_fit(m, &m->projection, 0, 1e-10, 0);
    PERP__THEN(status, perp__assembly_fit(m, &m->assembly, expands, settings->tol, settings->cone));
    return status;
}

static void release(void *object)
{
    perp_mechanism *m = object;

    perp__acceleration_release(m->accelerations);
    perp__work_release(m->implicit);
    perp__work_release(m->theta);
    perp__work_release(m->adaptive);
    perp__assembly_release(m, &m->assembly);
    perp__assembly_release(m, &m->projection);
    perp__arena_release(&m->arena);
}

static const perp__kind kind = {"a mechanism", sizeof(perp_mechanism), release};

/* The contacts' numbers, checked. */
static perp_status copy_contacts(perp_mechanism *m, const perp_mechanism_model *model)
{
    const double *at_rest = model->mu_static ? model->mu_static : model->mu;
    perp_context *context = m->context;
    perp_status status = perp__copy_sizes(context, "model.mu", m->contacts, m->mu, model->mu);

    PERP__THEN(status,
               perp__copy_sizes(context, "model.mu_static", m->contacts, m->mu_static, at_rest));
    PERP__THEN(status, perp__copy_sizes(context, "model.stribeck", m->contacts, m->stribeck,
                                        model->stribeck));
    PERP__THEN(status, perp__copy_sizes(context, "model.restitution", m->contacts, m->restitution,
                                        model->restitution));
    for (int32_t j = 0; j < m->contacts && status == PERP_OK; j++) {
        const double mu = m->mu[j], most = m->mu_static[j], e = m->restitution[j];

        if (most < mu)
            return perp__refuse(context, "model.mu_static[%d] = %g < mu[%d] = %g", (int)j, most,
                                (int)j, mu);
        if (dim_of(model, j) == 1 && most > 0.0)
            return perp__refuse(context,
                                "model.%s[%d] is %g, but contact %d has no tangents (dimension 1): "
                                "no friction",
                                mu > 0.0 ? "mu" : "mu_static", (int)j, mu > 0.0 ? mu : most,
                                (int)j);
        if (e > 1.0)
            return perp__refuse(context, "model.restitution[%d] is %g, above 1", (int)j, e);
        if (e > 0.0 && both_of(model, j) > 0)
            return perp__refuse(context,
                                "model.restitution[%d] is %g, but contact %d holds both ways",
                                (int)j, e, (int)j);
    }
    return status;
}

static perp_status make(perp_mechanism *m, const perp_mechanism_settings *settings,
                        const perp_mechanism_model *model)
{
    perp_status status;

    /* 1. sizes, and room */
    m->settings = *settings;
    m->model = *model;
    m->n = model->velocities;
    m->coordinates = model->coordinates > 0 ? model->coordinates : model->velocities;
    m->contacts = model->contacts;
    m->bilateral = m->constraints = model->bilateral;
    m->dry = model->dry;
    m->dry_rows = model->dry * model->dry_dim;
    for (int32_t j = 0; j < m->contacts; j++) {
        m->contact_rows += dim_of(model, j);
        m->constraints += both_of(model, j);
    }
    m->rows = m->contact_rows + m->bilateral + m->dry_rows;
    status = perp__arena_fit(&m->arena, m->context, layout, m);
    /* 2. its numbers */
    PERP__THEN(status, copy_contacts(m, model));
    if (status != PERP_OK)
        return status;
    memset(m->let_go, 0, (size_t)m->contacts * sizeof *m->let_go);
    memset(m->apart, 0, (size_t)m->contacts * sizeof *m->apart);
    memset(m->acceleration, 0, (size_t)m->n * sizeof *m->acceleration);
    m->starts[0] = 0;
    memset(m->normal_of, -1, (size_t)m->rows * sizeof *m->normal_of);
    for (int32_t j = 0; j < m->bilateral; j++)
        m->constraint_row[j] = m->contact_rows + j;
    for (int32_t j = 0, c = m->bilateral; j < m->contacts; j++) {
        m->dims[j] = dim_of(model, j);
        m->two_sided[j] = both_of(model, j);
        m->starts[j + 1] = m->starts[j] + m->dims[j];
        m->tangent[j] = m->starts[j] + (m->two_sided[j] > 0 ? m->two_sided[j] : 1);
        m->tangents[j] = m->starts[j + 1] - m->tangent[j];
        if (m->two_sided[j] == 0)
            m->normal_of[m->starts[j]] = j;
        for (int32_t i = 0; i < m->two_sided[j]; i++)
            m->constraint_row[c++] = m->starts[j] + i;
    }
    for (int32_t j = 0; j < m->dry; j++) {
        m->tangent[m->contacts + j] = m->contact_rows + m->bilateral + j * model->dry_dim;
        m->tangents[m->contacts + j] = model->dry_dim;
    }
    return fit_assemblies(m, settings);
}

perp_status perp_mechanism_create(perp_context *context, perp_mechanism **mechanism,
                                  const perp_mechanism_settings *settings,
                                  const perp_mechanism_model *model)
{
    perp_mechanism *m = NULL;
    perp_mechanism_settings copy;
    perp_mechanism_model read;
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(context, "mechanism", mechanism);
    PERP__THEN(status, read_settings(context, &copy, settings));
    PERP__THEN(status, read_model(context, &read, model));
    if (status == PERP_OK) {
        m = perp__handle_create(context, &kind);
        status = m ? make(m, &copy, &read) : PERP_ERROR_MEMORY;
    }
    if (m)
        PERP__HAND_OUT(status, m, mechanism);
    return perp__leave(context, status);
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

bool perp__mechanism_is_late(const perp_mechanism *m)
{
    return m->deadline > 0.0 && perp__now() > m->deadline;
}

perp_status perp_mechanism_set(perp_mechanism *mechanism, const perp_mechanism_settings *settings)
{
    perp_mechanism *m = mechanism;
    perp_mechanism_settings copy;
    perp_status status = perp__mechanism_enter(m);

    if (status != PERP_OK)
        return status;
    status = read_settings(m->context, &copy, settings);
    PERP__THEN(status, fit_assemblies(m, &copy));
    if (status == PERP_OK)
        m->settings = copy;
    return perp__leave(m->context, status);
}

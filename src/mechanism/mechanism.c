/* What a mechanism is made of, as it is handed over, and its life: create, set, destroy. */
#include "mechanism/mechanism.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/context.h"
#include "contact/contact.h"
#include "mechanism/schemes/implicit.h"

#define LARGEST 10000000     /* so that sizes of arrays fit */
#define MOST_DIRECTIONS 1024 /* of a slip that starts; as of perp/contact.h's cones */

/* ---- defaults ------------------------------------------------------------------------------ */

PERP__INIT_WITH(perp_mechanism_model, .dim = 2, .dry_dim = 1)

PERP__INIT_WITH(perp_mechanism_settings, .project = 1, .theta = 0.5, .tol = 1e-10,
                .most_patterns = (int64_t)1 << 22, .directions = 16, .starts = 16, .stiffness = 1.0,
                .damping = 2.0)

PERP__INIT(perp_mechanism_step)
PERP__INIT(perp_mechanism_run_result)

/* ---- settings ------------------------------------------------------------------------------ */

static const perp__field settings_fields[] = {
    PERP__INTEGER(perp_mechanism_settings, scheme, PERP_MECHANISM_FROZEN, PERP_MECHANISM_THETA),
    PERP__INTEGER(perp_mechanism_settings, law, PERP_MECHANISM_MOREAU, PERP_MECHANISM_POISSON),
    PERP__INTEGER(perp_mechanism_settings, select, PERP_MECHANISM_ANY, PERP_MECHANISM_FREEST),
    PERP__REAL(perp_mechanism_settings, theta, "[]", 0, 1),
    PERP__REAL(perp_mechanism_settings, tol, "()", 0, 1),
    PERP__REAL(perp_mechanism_settings, error, "[)", 0, 1),
    PERP__REAL(perp_mechanism_settings, shortest, "[)", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, longest, "[)", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, time_limit, "[]", 0, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, most_patterns, 1, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, directions, 3, MOST_DIRECTIONS),
    PERP__INTEGER(perp_mechanism_settings, starts, 1, INFINITY),
    PERP__REAL(perp_mechanism_settings, stiffness, "()", 0, INFINITY),
    PERP__REAL(perp_mechanism_settings, damping, "[)", 0, INFINITY),
    PERP__INTEGER(perp_mechanism_settings, reserved, 0, 0),
    PERP__REAL(perp_mechanism_settings, overlap, "[)", 0, INFINITY),
};

static perp_status check_cone(perp_context *context, int32_t cone)
{
    if (cone == 0 || (cone >= 3 && cone <= MOST_DIRECTIONS))
        return PERP_OK;
    return perp__refuse(context, "settings.cone is %d, expected 0 or 3 to %d", (int)cone,
                        MOST_DIRECTIONS);
}

static PERP__SETTINGS_READER(read_settings, perp_mechanism_settings, settings_fields,
                             check_cone(context, read.cone))

    /* ---- the model -----------------------------------------------------------------------------
     */

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

static perp_status check_dimensions(perp_context *context, const perp_mechanism_model *model)
{
    const perp_contact_laws laws = {.contacts = model->contacts,
                                    .dim = model->dim,
                                    .dims = model->dims,
                                    .two_sided = model->two_sided};

    if (!model->dims && (model->dim < 1 || model->dim > (model->two_sided ? 5 : 3)))
        return perp__refuse(context, "model.dim is %d, expected 1, 2 or 3", (int)model->dim);
    return perp__contact_check_dims(context, "model", &laws);
}

static perp_status check_callbacks(perp_context *context, const perp_mechanism_model *model)
{
    if (model->contacts > 0 && !model->contact_rows)
        return perp__refuse(context, "model.contact_rows is NULL, and there are %d contacts",
                            (int)model->contacts);
    if (model->bilateral > 0 && !model->bilateral_rows)
        return perp__refuse(context,
                            "model.bilateral_rows is NULL, and there are %d bilateral rows",
                            (int)model->bilateral);
    if (model->dry > 0 && !model->dry_rows)
        return perp__refuse(context, "model.dry_rows is NULL, and there are %d dry groups",
                            (int)model->dry);
    if (model->coordinates != 0 && model->coordinates != model->velocities && !model->kinematics)
        return perp__refuse(
            context, "model.kinematics is NULL, and there are %d coordinates for %d velocities",
            (int)model->coordinates, (int)model->velocities);
    return PERP_OK;
}

static perp_status check_contacts(perp_context *context, const perp_mechanism_model *model)
{
    const struct {
        const char *name;
        const double *x; /* NULL, or finite and >= 0 */
    } lists[] = {{"model.mu", model->mu},
                 {"model.mu_static", model->mu_static},
                 {"model.stribeck", model->stribeck},
                 {"model.restitution", model->restitution}};
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < 4 && status == PERP_OK; k++) {
        if (lists[k].x)
            status =
                perp__check_finite(context, lists[k].name, lists[k].x, (size_t)model->contacts);
        for (int32_t j = 0; j < model->contacts && lists[k].x && status == PERP_OK; j++)
            if (lists[k].x[j] < 0.0)
                status = perp__refuse(context, "%s[%d] is %g, negative", lists[k].name, (int)j,
                                      lists[k].x[j]);
    }
    for (int32_t j = 0; j < model->contacts && status == PERP_OK; j++) {
        const double mu = model->mu ? model->mu[j] : 0.0;

        if (model->mu_static && model->mu_static[j] < mu)
            return perp__refuse(context, "model.mu_static[%d] = %g < mu[%d] = %g", (int)j,
                                model->mu_static[j], (int)j, mu);
        if (dim_of(model, j) == 1 && (mu > 0.0 || (model->mu_static && model->mu_static[j] > 0.0)))
            return perp__refuse(context,
                                "model.%s[%d] is %g, but contact %d has no tangents (dimension 1): "
                                "no friction",
                                mu > 0.0 ? "mu" : "mu_static", (int)j,
                                mu > 0.0 ? mu : model->mu_static[j], (int)j);
        if (model->restitution && model->restitution[j] > 1.0)
            return perp__refuse(context, "model.restitution[%d] is %g, above 1", (int)j,
                                model->restitution[j]);
        if (model->restitution && model->restitution[j] > 0.0 && both_of(model, j) > 0)
            return perp__refuse(context,
                                "model.restitution[%d] is %g, but contact %d holds both ways",
                                (int)j, model->restitution[j], (int)j);
    }
    return status;
}

/* Checks sizes, callbacks and every number. */
static perp_status read_model(perp_context *context, perp_mechanism_model *own,
                              const perp_mechanism_model *model)
{
    perp_mechanism_model read;
    perp_status status = perp__check_pointer(context, "model", model);

    perp_mechanism_model_init(&read, sizeof read);
    PERP__THEN(status, PERP__READ(perp_mechanism_model, context, &read, model));
    PERP__THEN(status, PERP__CHECK_FIELDS(context, "model", &read, sizes));
    PERP__THEN(status, check_dimensions(context, &read));
    PERP__THEN(status, check_callbacks(context, &read));
    PERP__THEN(status, check_contacts(context, &read));
    if (status == PERP_OK)
        *own = read;
    return status;
}

static void set_sizes(perp_mechanism *m, const perp_mechanism_model *model)
{
    m->model = *model;
    m->n = model->velocities;
    m->coordinates = model->coordinates > 0 ? model->coordinates : model->velocities;
    m->contacts = model->contacts;
    m->bilateral = model->bilateral;
    m->dry = model->dry;
    m->dry_rows = model->dry * model->dry_dim;
    for (int32_t j = 0; j < m->contacts; j++)
        m->contact_rows += dim_of(model, j);
    m->constraints = m->bilateral;
    for (int32_t j = 0; j < m->contacts; j++)
        m->constraints += both_of(model, j);
    m->rows = m->contact_rows + m->bilateral + m->dry_rows;
}

static void copy_or_zero(double *to, const double *from, int32_t count)
{
    if (from)
        memcpy(to, from, (size_t)count * sizeof *to);
    else
        memset(to, 0, (size_t)count * sizeof *to);
}

/* Sizes of a model that was read; then, once there is room, its numbers. */
static void take_model(perp_mechanism *m, const perp_mechanism_model *model)
{
    copy_or_zero(m->mu, model->mu, m->contacts);
    copy_or_zero(m->mu_static, model->mu_static ? model->mu_static : model->mu, m->contacts);
    copy_or_zero(m->stribeck, model->stribeck, m->contacts);
    copy_or_zero(m->restitution, model->restitution, m->contacts);
    memset(m->let_go, 0, (size_t)m->contacts * sizeof *m->let_go);
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
}

/* ---- life ------------------------------------------------------------------------------------ */

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

/* The solvers for these settings. Polyhedra of friction are not for contacts that hold both ways.
 */
static perp_status fit_assemblies(perp_mechanism *m, const perp_mechanism_settings *settings)
{
    const int32_t poisson = settings->law == PERP_MECHANISM_POISSON;
    perp_status status;

    for (int32_t j = 0; j < m->contacts && settings->cone != 0; j++)
        if (m->two_sided[j] > 0)
            return perp__refuse(m->context,
                                "settings.cone is %d, but contact %d holds both ways: 0 alone",
                                (int)settings->cone, (int)j);
    status = perp__assembly_fit(m, &m->projection, 0, 1e-10, 0);
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
    set_sizes(m, model);
    status = perp__arena_fit(&m->arena, context, layout, m);
    if (status == PERP_OK) {
        take_model(m, model);
        status = fit_assemblies(m, settings);
    }
    PERP__HAND_OUT(status, m, made);
    return status;
}

static perp_status create(perp_context *context, perp_mechanism **mechanism,
                          const perp_mechanism_settings *settings,
                          const perp_mechanism_model *model)
{
    perp_mechanism_settings own;
    perp_mechanism_model read;
    perp_status status = perp__check_pointer(context, "mechanism", mechanism);

    PERP__THEN(status, read_settings(context, &own, settings));
    PERP__THEN(status, read_model(context, &read, model));
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
    perp_status status = read_settings(m->context, &own, settings);

    PERP__THEN(status, fit_assemblies(m, &own));
    if (status == PERP_OK)
        m->settings = own;
    return status;
}

perp_status perp_mechanism_set(perp_mechanism *mechanism, const perp_mechanism_settings *settings)
{
    return PERP__CALL(perp__mechanism_enter(mechanism), mechanism->context,
                      set(mechanism, settings));
}

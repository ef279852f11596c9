#include "mechanism/mechanism_read.h"

#include <math.h>
#include <string.h>

#include "base/context.h"

#define LARGEST 10000000     /* so that sizes of arrays fit */
#define MOST_DIRECTIONS 1024 /* of a slip that starts; as of perp/contact.h's cones */

/* ---- defaults ------------------------------------------------------------------------------ */

perp_status perp_mechanism_model_init(perp_mechanism_model *model, size_t size)
{
    perp_status status = perp__struct_init(model, size, PERP__FIRST(perp_mechanism_model));

    if (status == PERP_OK) {
        model->dim = 2;
        model->dry_dim = 1;
    }
    return status;
}

perp_status perp_mechanism_settings_init(perp_mechanism_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_mechanism_settings));

    if (status == PERP_OK) {
        settings->project = 1;
        settings->theta = 0.5;
        settings->tol = 1e-10;
        settings->most_patterns = (int64_t)1 << 22;
        settings->directions = 16;
        settings->starts = 16;
        settings->stiffness = 1.0;
        settings->damping = 2.0;
    }
    return status;
}

PERP__INIT(perp_mechanism_step)
PERP__INIT(perp_mechanism_run_result)

/* ---- settings ------------------------------------------------------------------------------ */

static perp_status check_step_control(perp_context *context, const perp_mechanism_settings *s)
{
    if (!(s->error >= 0.0 && s->error < 1.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.error is %g, not in [0, 1)",
                          s->error);
    if (!(s->shortest >= 0.0 && isfinite(s->shortest)))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.shortest is %g, negative",
                          s->shortest);
    if (!(s->longest >= 0.0 && isfinite(s->longest)))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.longest is %g, negative",
                          s->longest);
    if (!(s->time_limit >= 0.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.time_limit is %g, negative",
                          s->time_limit);
    return PERP_OK;
}

static perp_status check_search(perp_context *context, const perp_mechanism_settings *s)
{
    if (s->most_patterns < 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.most_patterns is %lld, below 1",
                          (long long)s->most_patterns);
    if (s->directions < 3 || s->directions > MOST_DIRECTIONS)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.directions is %d, expected 3 to %d", (int)s->directions,
                          MOST_DIRECTIONS);
    if (s->starts < 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.starts is %d, below 1",
                          (int)s->starts);
    if (!(s->stiffness > 0.0 && isfinite(s->stiffness)))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.stiffness is %g, not positive",
                          s->stiffness);
    if (!(s->damping >= 0.0 && isfinite(s->damping)))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.damping is %g, negative",
                          s->damping);
    return PERP_OK;
}

static perp_status check_settings(perp_context *context, const perp_mechanism_settings *s)
{
    perp_status status;

    if (s->scheme < PERP_MECHANISM_FROZEN || s->scheme > PERP_MECHANISM_THETA)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.scheme is %d, not one of "
                          "PERP_MECHANISM_...",
                          (int)s->scheme);
    if (s->law < PERP_MECHANISM_MOREAU || s->law > PERP_MECHANISM_POISSON)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.law is %d, not one of "
                          "PERP_MECHANISM_...",
                          (int)s->law);
    if (s->cone != 0 && (s->cone < 3 || s->cone > 1024))
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.cone is %d, expected 0 or 3 to 1024", (int)s->cone);
    if (s->select < PERP_MECHANISM_ANY || s->select > PERP_MECHANISM_FREEST)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.select is %d, not one of PERP_MECHANISM_...", (int)s->select);
    if (!(s->theta >= 0.0 && s->theta <= 1.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.theta is %g, not in [0, 1]",
                          s->theta);
    if (!(s->tol > 0.0 && s->tol < 1.0))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.tol is %g, not in (0, 1)",
                          s->tol);
    status = check_step_control(context, s);
    return status == PERP_OK ? check_search(context, s) : status;
}

perp_status perp__mechanism_settings_read(perp_context *context, perp_mechanism_settings *own,
                                          const perp_mechanism_settings *settings)
{
    perp_mechanism_settings read;
    perp_status status;

    perp_mechanism_settings_init(&read, sizeof read);
    status = PERP__READ(perp_mechanism_settings, context, &read, settings);
    if (status == PERP_OK)
        status = check_settings(context, &read);
    if (status == PERP_OK)
        *own = read;
    return status;
}

/* ---- the model ----------------------------------------------------------------------------- */

static perp_status check_size(perp_context *context, const char *name, int32_t size, int32_t least)
{
    if (size < least || size > LARGEST)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "model.%s is %d, expected at least %d",
                          name, (int)size, (int)least);
    return PERP_OK;
}

static perp_status check_dimensions(perp_context *context, const perp_mechanism_model *model)
{
    int32_t j;

    if (!model->dims && (model->dim < 1 || model->dim > 3))
        return perp__fail(context, PERP_ERROR_ARGUMENT, "model.dim is %d, expected 1, 2 or 3",
                          (int)model->dim);
    for (j = 0; j < model->contacts && model->dims; j++)
        if (model->dims[j] < 1 || model->dims[j] > 3)
            return perp__fail(context, PERP_ERROR_ARGUMENT,
                              "model.dims[%d] is %d, expected 1, 2 or 3", (int)j,
                              (int)model->dims[j]);
    if (model->dry_dim < 1 || model->dry_dim > 2)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "model.dry_dim is %d, expected 1 or 2",
                          (int)model->dry_dim);
    return PERP_OK;
}

static perp_status check_callbacks(perp_context *context, const perp_mechanism_model *model)
{
    if (model->contacts > 0 && !model->contact_rows)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "model.contact_rows is NULL, and there are %d contacts",
                          (int)model->contacts);
    if (model->bilateral > 0 && !model->bilateral_rows)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "model.bilateral_rows is NULL, and there are %d bilateral rows",
                          (int)model->bilateral);
    if (model->dry > 0 && !model->dry_rows)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "model.dry_rows is NULL, and there are %d dry groups", (int)model->dry);
    if (model->coordinates != 0 && model->coordinates != model->velocities && !model->kinematics)
        return perp__fail(
            context, PERP_ERROR_ARGUMENT,
            "model.kinematics is NULL, and there are %d coordinates for %d velocities",
            (int)model->coordinates, (int)model->velocities);
    return PERP_OK;
}

/* Finite and >= 0. */
static perp_status check_coefficients(perp_context *context, const char *name, const double *x,
                                      int32_t count)
{
    perp_status status;
    int32_t j;

    if (!x)
        return PERP_OK;
    status = perp__check_finite(context, name, x, (size_t)count);
    for (j = 0; j < count && status == PERP_OK; j++)
        if (x[j] < 0.0)
            status = perp__fail(context, PERP_ERROR_ARGUMENT, "%s[%d] is %g, negative", name,
                                (int)j, x[j]);
    return status;
}

static perp_status check_contacts(perp_context *context, const perp_mechanism_model *model)
{
    perp_status status = check_coefficients(context, "model.mu", model->mu, model->contacts);
    int32_t j;

    if (status == PERP_OK)
        status = check_coefficients(context, "model.mu_static", model->mu_static, model->contacts);
    if (status == PERP_OK)
        status = check_coefficients(context, "model.stribeck", model->stribeck, model->contacts);
    if (status == PERP_OK)
        status =
            check_coefficients(context, "model.restitution", model->restitution, model->contacts);
    for (j = 0; j < model->contacts && status == PERP_OK; j++) {
        const double mu = model->mu ? model->mu[j] : 0.0;

        if (model->mu_static && model->mu_static[j] < mu)
            return perp__fail(context, PERP_ERROR_ARGUMENT,
                              "model.mu_static[%d] = %g < mu[%d] = %g", (int)j, model->mu_static[j],
                              (int)j, mu);
        if (model->restitution && model->restitution[j] > 1.0)
            return perp__fail(context, PERP_ERROR_ARGUMENT, "model.restitution[%d] is %g, above 1",
                              (int)j, model->restitution[j]);
    }
    return status;
}

perp_status perp__mechanism_model_read(perp_context *context, perp_mechanism_model *own,
                                       const perp_mechanism_model *model)
{
    perp_mechanism_model read;
    perp_status status = perp__check_pointer(context, "model", model);

    perp_mechanism_model_init(&read, sizeof read);
    if (status == PERP_OK)
        status = PERP__READ(perp_mechanism_model, context, &read, model);
    if (status == PERP_OK)
        status = check_size(context, "velocities", read.velocities, 1);
    if (status == PERP_OK)
        status = check_size(context, "coordinates", read.coordinates, 0);
    if (status == PERP_OK)
        status = check_size(context, "contacts", read.contacts, 0);
    if (status == PERP_OK)
        status = check_size(context, "bilateral", read.bilateral, 0);
    if (status == PERP_OK)
        status = check_size(context, "dry", read.dry, 0);
    if (status == PERP_OK)
        status = check_dimensions(context, &read);
    if (status == PERP_OK)
        status = check_callbacks(context, &read);
    if (status == PERP_OK)
        status = check_contacts(context, &read);
    if (status == PERP_OK)
        *own = read;
    return status;
}

void perp__mechanism_sizes(perp_mechanism *m, const perp_mechanism_model *model)
{
    int32_t j;

    m->model = *model;
    m->n = model->velocities;
    m->coordinates = model->coordinates > 0 ? model->coordinates : model->velocities;
    m->contacts = model->contacts;
    m->bilateral = model->bilateral;
    m->dry = model->dry;
    m->dry_rows = model->dry * model->dry_dim;
    for (j = 0; j < m->contacts; j++)
        m->contact_rows += model->dims ? model->dims[j] : model->dim;
    m->rows = m->contact_rows + m->bilateral + m->dry_rows;
}

static void copy_or_zero(double *to, const double *from, int32_t count)
{
    if (from)
        memcpy(to, from, (size_t)count * sizeof *to);
    else
        memset(to, 0, (size_t)count * sizeof *to);
}

void perp__mechanism_take(perp_mechanism *m, const perp_mechanism_model *model)
{
    int32_t j;

    copy_or_zero(m->mu, model->mu, m->contacts);
    copy_or_zero(m->mu_static, model->mu_static ? model->mu_static : model->mu, m->contacts);
    copy_or_zero(m->stribeck, model->stribeck, m->contacts);
    copy_or_zero(m->restitution, model->restitution, m->contacts);
    m->starts[0] = 0;
    for (j = 0; j < m->contacts; j++) {
        m->dims[j] = model->dims ? model->dims[j] : model->dim;
        m->starts[j + 1] = m->starts[j] + m->dims[j];
    }
    m->model.dims = m->dims;
    m->model.mu = m->mu;
    m->model.mu_static = m->mu_static;
    m->model.stribeck = m->stribeck;
    m->model.restitution = m->restitution;
}

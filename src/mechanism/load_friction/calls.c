/* Load-dependent friction: the calls on a handle, and their structs and words. */
#include <math.h>
#include <string.h>

#include "base/check.h"
#include "mechanism/load_friction/load_friction.h"

#define PERP__FOUND_FIRST PERP__SIZE_THROUGH(perp_load_found, rays)
#define PERP__SUMMARY_FIRST PERP__SIZE_THROUGH(perp_load_summary, patterns)
#define PERP__INVERSE_FIRST PERP__SIZE_THROUGH(perp_load_inverse, reserved)

/* ---- structs and words --------------------------------------------------------------------- */

perp_status perp_load_system_init(perp_load_system *system, size_t size)
{
    perp_status status = perp__struct_init(system, size, PERP__LOAD_SYSTEM_FIRST);

    if (status == PERP_OK) {
        system->stiffness = 1.0;
        system->damping = 2.0;
    }
    return status;
}

perp_status perp_load_settings_init(perp_load_settings *settings, size_t size)
{
    perp_status status = perp__struct_init(settings, size, PERP__LOAD_SETTINGS_FIRST);

    if (status == PERP_OK) {
        settings->tol = 1e-13;
        settings->most_patterns = 1 << 21;
        settings->starts = 64;
    }
    return status;
}

perp_status perp_load_found_init(perp_load_found *found, size_t size)
{
    return perp__struct_init(found, size, PERP__FOUND_FIRST);
}

perp_status perp_load_summary_init(perp_load_summary *summary, size_t size)
{
    return perp__struct_init(summary, size, PERP__SUMMARY_FIRST);
}

perp_status perp_load_inverse_init(perp_load_inverse *inverse, size_t size)
{
    return perp__struct_init(inverse, size, PERP__INVERSE_FIRST);
}

const char *perp_load_kind_text(int32_t kind)
{
    static const char *const words[] = {"dynamic", "static", "mixed", "family"};

    return kind >= 0 && kind < 4 ? words[kind] : "unknown kind";
}

const char *perp_load_mode_text(int32_t mode)
{
    static const char *const words[] = {"slide", "stick", "forward", "backward", "stopped"};

    return mode >= 0 && mode < 5 ? words[mode] : "unknown mode";
}

const char *perp_load_reason_text(int32_t reason)
{
    static const char *const words[] = {
        "",
        "the torque leaves the acceleration free along a direction: an effective inertia is zero",
        "the wanted motion is on an unstable branch, where an effective inertia is negative",
        "the wanted motion is unstable: compliant contacts oscillate away from it (flutter)",
        "the torque has other accelerations, too",
        "static friction at rest leaves the torque open within its limits",
        "the system is too large to exclude other accelerations of this torque"};

    return reason >= 0 && reason < 7 ? words[reason] : "unknown reason";
}

/* ---- calls --------------------------------------------------------------------------------- */

perp_status perp__friction_check_vector(perp_load_friction *f, const char *name, const double *x)
{
    perp_status status = perp__check_pointer(f->context, name, x);

    return status == PERP_OK ? perp__check_finite(f->context, name, x, (size_t)f->n) : status;
}

static perp_status set(perp_load_friction *f, const perp_load_system *system)
{
    perp_load_friction *made, kept;
    perp_load_system read;
    perp_status status = perp__check_pointer(f->context, "system", system);

    perp_load_system_init(&read, sizeof read);
    if (status == PERP_OK)
        status = perp__struct_read(f->context, "system", &read, sizeof read, system,
                                   PERP__LOAD_SYSTEM_FIRST);
    if (status == PERP_OK && read.n != f->n)
        status = perp__fail(f->context, PERP_ERROR_ARGUMENT, "system.n is %d, it was %d",
                            (int)read.n, (int)f->n);
    if (status == PERP_OK)
        status = perp__friction_create_like(f, &made, &read);
    if (status != PERP_OK)
        return status;
    kept = *f;
    *f = *made;
    *made = kept;
    perp__handle_end(made);
    return PERP_OK;
}

perp_status perp_load_friction_set(perp_load_friction *friction, const perp_load_system *system)
{
    perp_status status = perp__friction_enter(friction);

    if (status != PERP_OK)
        return status;
    return perp__leave(friction->context, set(friction, system));
}

void perp__friction_ask(perp_load_friction *f, const double *tau, const double *velocity)
{
    const size_t n = (size_t)f->n;
    int32_t i;

    if (tau != f->tau)
        memcpy(f->tau, tau, n * sizeof *tau);
    f->question.tau = f->tau;
    memset(f->question.stop, 0, n * sizeof *f->question.stop);
    memset(f->question.before, 0, n);
    memcpy(f->question.mu_stick, f->mu_static, n * sizeof *f->mu_static);
    for (i = 0; i < f->n; i++)
        f->question.sign[i] = (int8_t)((velocity[i] > 0.0) - (velocity[i] < 0.0));
}

static perp_status solve(perp_load_friction *f, perp_load_summary *summary, const double *tau,
                         const double *velocity)
{
    perp_load_summary own;
    perp_status status =
        perp__struct_check(f->context, "summary", summary, sizeof *summary, PERP__SUMMARY_FIRST);

    if (status == PERP_OK)
        status = perp__friction_check_vector(f, "tau", tau);
    if (status == PERP_OK)
        status = perp__friction_check_vector(f, "velocity", velocity);
    if (status != PERP_OK)
        return status;
    perp__friction_ask(f, tau, velocity);
    status = perp__friction_answer_all(f, &own);
    if (status == PERP_OK)
        perp__struct_write(summary, &own, sizeof own);
    return status;
}

perp_status perp_load_friction_solve(perp_load_friction *friction, perp_load_summary *summary,
                                     const double *tau, const double *velocity)
{
    perp_status status = perp__friction_enter(friction);

    if (status != PERP_OK)
        return status;
    return perp__leave(friction->context, solve(friction, summary, tau, velocity));
}

static perp_status get(perp_load_friction *f, perp_load_found *found, int32_t index)
{
    const perp__answer *a;
    perp_load_found own;
    perp_status status =
        perp__struct_check(f->context, "found", found, sizeof *found, PERP__FOUND_FIRST);

    if (status != PERP_OK)
        return status;
    if (index < 0 || index >= f->answers.count)
        return perp__fail(f->context, PERP_ERROR_ARGUMENT, "index is %d, but there are %d answers",
                          (int)index, (int)f->answers.count);
    a = perp__answers_get(&f->answers, index);
    memset(&own, 0, sizeof own);
    own.kind = a->kind;
    own.stable = a->stable;
    own.flutter = a->flutter;
    own.at_vertex = a->at_vertex;
    own.dimension = a->dimension;
    own.vertex_count = a->vertices;
    own.ray_count = a->rays;
    own.residual = a->residual;
    own.acceleration = a->middle;
    own.normal_force = perp__friction_normal(a);
    own.friction = perp__friction_force(f, a);
    own.modes = a->modes;
    own.eigenvalues = a->eigenvalues;
    own.vertices = a->points;
    own.rays = a->points + (size_t)a->vertices * (size_t)f->n;
    perp__struct_write(found, &own, sizeof own);
    return PERP_OK;
}

perp_status perp_load_friction_get(perp_load_friction *friction, perp_load_found *found,
                                   int32_t index)
{
    perp_status status = perp__friction_enter(friction);

    if (status != PERP_OK)
        return status;
    return perp__leave(friction->context, get(friction, found, index));
}

/* Energy and momentum of the dynamic bodies. */
#include "world/step.h"

#include "base/context.h"
#include "linalg/spatial.h"

/* I w in the world frame. */
static void spin_of(const perp_world *world, int32_t i, const perp__state *state, double *spin)
{
    double R[9], w[3], Iw[3];

    perp__rotation_of(world, state, R);
    perp__apply_transposed3(w, R, state->angular_velocity);
    perp__apply3(Iw, world->bodies[i].inertia, w);
    perp__apply3(spin, R, Iw);
}

double perp__kinetic_of(const perp_world *world, int32_t i, const perp__state *state)
{
    double spin[3];

    spin_of(world, i, state, spin);
    return 0.5 * (world->bodies[i].mass * perp__dot3(state->velocity, state->velocity) +
                  perp__dot3(spin, state->angular_velocity));
}

double perp__energy_lost(const perp_world *world, int32_t i)
{
    const perp__state *from = &world->states[i], *to = &world->next[i];
    double work = 0.0;

    for (int32_t k = 0; k < 3; k++) {
        const double force = world->bodies[i].mass * world->settings.gravity[k] + from->force[k];
        work += force * (to->position[k] - from->position[k]) +
                from->torque[k] * world->motions[i].moving[3 + k] * world->step_length;
    }
    return perp__kinetic_of(world, i, from) - perp__kinetic_of(world, i, to) + work;
}

double perp__energy_rounding(const perp_world *world, int32_t i)
{
    const perp__state *from = &world->states[i], *to = &world->next[i];
    double sum = perp__kinetic_of(world, i, from) + perp__kinetic_of(world, i, to);

    for (int32_t k = 0; k < 3; k++)
        sum += fabs(world->bodies[i].mass * world->settings.gravity[k] + from->force[k]) *
                   (fabs(from->position[k]) + fabs(to->position[k])) +
               fabs(from->torque[k]);
    return PERP__SUM_ROUNDING * sum;
}

double perp__work_needed(const perp_world *world, int32_t i, const double *shift)
{
    double work = 0.0;

    for (int32_t k = 0; k < 3; k++)
        work -= (world->bodies[i].mass * world->settings.gravity[k] + world->states[i].force[k]) *
                    shift[k] +
                world->states[i].torque[k] * shift[3 + k];
    return work;
}

perp_status perp_world_energy(const perp_world *world, double *kinetic, double *potential)
{
    double moving = 0.0, height = 0.0;
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->body_slots; i++) {
        const perp__state *state = &world->states[i];
        double mass = world->bodies[i].mass;

        if (!world->bodies[i].alive || !perp__is_dynamic(world, i))
            continue;
        moving += perp__kinetic_of(world, i, state);
        height -= mass * perp__dot3(world->settings.gravity, state->position);
    }
    if (kinetic)
        *kinetic = moving;
    if (potential)
        *potential = height;
    return perp__leave(world->context, PERP_OK);
}

perp_status perp_world_momentum(const perp_world *world, double *linear, double *angular)
{
    double p[3] = {0.0, 0.0, 0.0}, L[3] = {0.0, 0.0, 0.0};
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->body_slots; i++) {
        const perp__state *state = &world->states[i];
        double mass = world->bodies[i].mass;
        double spin[3], orbit[3];

        if (!world->bodies[i].alive || !perp__is_dynamic(world, i))
            continue;
        spin_of(world, i, state, spin);
        perp__cross(orbit, state->position, state->velocity);
        perp__add3(p, mass, state->velocity);
        perp__add3(L, mass, orbit);
        perp__add3(L, 1.0, spin);
    }
    if (linear)
        perp__copy3(linear, p);
    if (angular)
        perp__copy3(angular, L);
    return perp__leave(world->context, PERP_OK);
}

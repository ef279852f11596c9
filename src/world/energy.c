/* Energy and momentum of the dynamic bodies. */
#include "world/step.h"

#include "base/context.h"

/* I w in the world frame. */
static void spin_of(const perp_world *world, int32_t i, const perp__state *state, double *spin)
{
    double R[9], w[3], Iw[3];

    perp__rotation_of(world, state, R);
    perp__apply_transposed3(w, R, state->angular_velocity);
    perp__apply3(Iw, world->bodies[i].inertia, w);
    perp__apply3(spin, R, Iw);
}

double perp__kinetic_of(const perp_world *world, int32_t i, const perp__state *state,
                        const double *frame)
{
    double spin[3], beside[3];

    spin_of(world, i, state, spin);
    perp__subtract3(beside, state->velocity, frame);
    return 0.5 * (world->bodies[i].mass * perp__dot3(beside, beside) +
                  perp__dot3(spin, state->angular_velocity));
}

double perp__energy_lost(const perp_world *world, int32_t i, const double *frame, double *rounding)
{
    const perp__state *from = &world->states[i], *to = &world->next[i];
    const double before = perp__kinetic_of(world, i, from, frame);
    const double after = perp__kinetic_of(world, i, to, frame);
    double shift[6], sum = before + after;

    for (int32_t k = 0; k < 3; k++) {
        shift[k] = to->position[k] - from->position[k] - world->step_length * frame[k];
        shift[3 + k] = world->step_length * world->motions[i].moving[3 + k];
        sum += fabs(world->bodies[i].mass * world->settings.gravity[k] + from->force[k]) *
                   (fabs(from->position[k]) + fabs(to->position[k])) +
               fabs(from->torque[k]);
    }
    *rounding += PERP__SUM_ROUNDING * sum;
    return before - after - perp__work_needed(world, i, shift);
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

/* Of all dynamic bodies; energies are kinetic and potential. */
static perp_status add_up(const perp_world *world, double energies[2], double p[3], double L[3])
{
    const double at_rest[3] = {0.0};
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->body_slots; i++) {
        const perp__state *state = &world->states[i];
        const double mass = world->bodies[i].mass;
        double spin[3], orbit[3];

        if (!world->bodies[i].alive || !perp__is_dynamic(world, i))
            continue;
        energies[0] += perp__kinetic_of(world, i, state, at_rest);
        energies[1] -= mass * perp__dot3(world->settings.gravity, state->position);
        spin_of(world, i, state, spin);
        perp__cross(orbit, state->position, state->velocity);
        perp__add3(p, mass, state->velocity);
        perp__add3(L, mass, orbit);
        perp__add3(L, 1.0, spin);
    }
    return perp__leave(world->context, PERP_OK);
}

perp_status perp_world_energy(const perp_world *world, double *kinetic, double *potential)
{
    double energies[2] = {0.0}, p[3] = {0.0}, L[3] = {0.0};
    const perp_status status = add_up(world, energies, p, L);

    if (status == PERP_OK && kinetic)
        *kinetic = energies[0];
    if (status == PERP_OK && potential)
        *potential = energies[1];
    return status;
}

perp_status perp_world_momentum(const perp_world *world, double *linear, double *angular)
{
    double energies[2] = {0.0}, p[3] = {0.0}, L[3] = {0.0};
    const perp_status status = add_up(world, energies, p, L);

    if (status == PERP_OK && linear)
        perp__copy3(linear, p);
    if (status == PERP_OK && angular)
        perp__copy3(angular, L);
    return status;
}

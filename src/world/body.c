/* Bodies: adding, removing, reading and replacing what changes in time. */
#include "world/joints/joints.h"

#include "base/check.h"
#include "base/context.h"

#define UNIT_TOLERANCE 1e-6

/* A state begins with the numbers of perp_body_state, and these with those of perp_body_settings,
 * in one order (tests/abi). */
#define NUMBERS_OF(type, object) ((char *)(object) + offsetof(type, position))

PERP__INIT_WITH(perp_body_settings, .kind = PERP_BODY_DYNAMIC, .orientation[0] = 1.0)

PERP__INIT_WITH(perp_body_state, .orientation[0] = 1.0)

perp_status perp__check_quaternion(perp_context *context, const char *name, double *q)
{
    double norm;
    perp_status status = perp__check_finite(context, name, q, 4);

    if (status != PERP_OK)
        return status;
    norm = perp__quaternion_norm(q);
    if (!(fabs(norm - 1.0) <= UNIT_TOLERANCE))
        return perp__refuse(context, "%s has norm %.9g, 1 expected to %g", name, norm,
                            UNIT_TOLERANCE);
    if (fabs(norm - 1.0) > 2.0 * DBL_EPSILON)
        perp__quaternion_normalise(q);
    return PERP_OK;
}

perp_status perp__check_vector3(const perp_world *world, const char *name, const double *x)
{
    perp_status status = perp__check_finite(world->context, name, x, 3);

    if (status == PERP_OK && world->settings.planar && x[2] != 0.0)
        status = perp__refuse(world->context, "%s[2] is %g: a planar world has no z, 0 expected",
                              name, x[2]);
    return status;
}

/* Angular velocity or torque: planar worlds have the z component only. */
static perp_status check_turning(const perp_world *world, const char *name, const double *x)
{
    perp_status status = perp__check_finite(world->context, name, x, 3);

    if (status == PERP_OK && world->settings.planar && (x[0] != 0.0 || x[1] != 0.0))
        status = perp__refuse(world->context,
                              "%s[%d] is %g: a planar world turns about z only, 0 expected", name,
                              x[0] != 0.0 ? 0 : 1, x[0] != 0.0 ? x[0] : x[1]);
    return status;
}

/* Checks position and velocity, and in three dimensions normalises the orientation; a planar
 * world's comes from the angle. */
static perp_status check_state(const perp_world *world, perp__state *state, const char *position,
                               const char *velocity, const char *angular_velocity)
{
    perp_status status = perp__check_vector3(world, position, state->position);

    PERP__THEN(status, perp__check_vector3(world, velocity, state->velocity));
    PERP__THEN(status, check_turning(world, angular_velocity, state->angular_velocity));
    if (status != PERP_OK)
        return status;
    if (world->settings.planar) {
        status = perp__check_finite(world->context, "angle", &state->angle, 1);
        state->orientation[0] = cos(0.5 * state->angle);
        state->orientation[1] = state->orientation[2] = 0.0;
        state->orientation[3] = sin(0.5 * state->angle);
    } else {
        status = perp__check_quaternion(world->context, "orientation", state->orientation);
        state->angle = 0.0;
    }
    return status;
}

/* Takes a free slot, or the next one; room is there. */
static int32_t take_slot(perp_world *world, const perp__body *body, const perp__state *state)
{
    int32_t slot = world->bodies.free;
    uint32_t generation = 1;
    bool listed = 0;

    if (slot >= 0) {
        world->bodies.free = world->bodies.all[slot].next_free;
        generation = world->bodies.all[slot].generation;
        listed = world->bodies.all[slot].awake;
    } else {
        slot = world->bodies.slots++;
    }
    world->bodies.all[slot] = *body;
    world->bodies.all[slot].generation = generation;
    world->bodies.all[slot].alive = 1;
    world->bodies.all[slot].awake = listed;
    world->bodies.all[slot].nap = world->bodies.all[slot].first_shape = -1;
    world->bodies.clusters[slot] = slot;
    world->bodies.states[slot] = *state;
    perp__note_put(world, slot);
    world->bodies.edition++;
    world->results.stats.bodies++;
    return slot;
}

perp_status perp__add_body(perp_world *world, perp_body *id, const perp_body_settings *settings)
{
    const perp__growing arrays[] = {
        PERP__GROWING(world->bodies.all, world->bodies.slots, 1),
        PERP__GROWING(world->bodies.states, world->bodies.slots, 1),
        PERP__GROWING(world->bodies.clusters, world->bodies.slots, 1),
        PERP__GROWING(world->sleep.awake, world->sleep.awake_count + world->sleep.roused_count, 1)};
    perp__body body;
    perp__state state;
    int32_t slot;
    perp_status status;

    memset(&body, 0, sizeof body);
    memset(&state, 0, sizeof state);
    if (settings->kind < PERP_BODY_DYNAMIC || settings->kind > PERP_BODY_KINEMATIC)
        return perp__refuse(world->context, "settings.kind is %d, a PERP_BODY_... expected",
                            (int)settings->kind);
    body.kind = settings->kind;
    memcpy(&state, NUMBERS_OF(perp_body_settings, settings), offsetof(perp__state, force));
    status = check_state(world, &state, "settings.position", "settings.velocity",
                         "settings.angular_velocity");
    if (status == PERP_OK && body.kind == PERP_BODY_STATIC &&
        !(perp__is_zero3(state.velocity) && perp__is_zero3(state.angular_velocity)))
        status = perp__refuse(world->context,
                              "settings.velocity and angular_velocity of a static body must be 0");
    if (status == PERP_OK && body.kind == PERP_BODY_DYNAMIC)
        status = perp__body_mass(world, &body, settings->mass, settings->inertia);
    if (status == PERP_OK && world->bodies.free < 0)
        status = perp__grow(world->context, "another body", &world->bodies.capacity,
                            (int64_t)world->bodies.slots + 1, arrays, 4);
    if (status != PERP_OK)
        return status;
    slot = take_slot(world, &body, &state);
    *id = perp__id(slot, world->bodies.all[slot].generation);
    return PERP_OK;
}

static perp_status add_body(perp_world *world, perp_body *body, const perp_body_settings *caller)
{
    perp_body_settings settings;
    perp_status status = perp__check_pointer(world->context, "body", body);

    PERP__THEN(status, perp_body_settings_init(&settings, sizeof settings));
    PERP__THEN(status, perp__struct_read(world->context, "settings", &settings, sizeof settings,
                                         caller, PERP__FIRST(perp_body_settings)));
    PERP__THEN(status, perp__add_body(world, body, &settings));
    return status;
}

perp_status perp_world_add_body(perp_world *world, perp_body *body,
                                const perp_body_settings *settings)
{
    return PERP__WORLD_CALL(world, add_body(world, body, settings));
}

static perp_status remove_body(perp_world *world, perp_body id)
{
    int32_t slot;
    perp_status status = perp__find_body(world, &slot, id);

    if (status != PERP_OK)
        return status;
    if (slot == 0)
        return perp__refuse(world->context, "body is the ground, which can't be removed");
    perp__disturb(world, slot);
    perp__remove_shapes(world, slot);
    perp__remove_joints(world, slot);
    world->bodies.all[slot].alive = 0;
    world->sleep.awake_changed = 1;
    world->bodies.all[slot].generation++;
    world->bodies.all[slot].next_free = world->bodies.free;
    world->bodies.free = slot;
    world->bodies.edition++;
    world->results.stats.bodies--;
    return PERP_OK;
}

perp_status perp_world_remove_body(perp_world *world, perp_body body)
{
    return PERP__WORLD_CALL(world, remove_body(world, body));
}

static perp_status get_body(const perp_world *world, perp_body_state *state, perp_body id)
{
    perp_body_state copy;
    int32_t slot;
    perp_status status = PERP__CHECK(perp_body_state, world->context, state);

    PERP__THEN(status, perp__find_body(world, &slot, id));
    PERP__THEN(status, perp_body_state_init(&copy, sizeof copy));
    if (status != PERP_OK)
        return status;
    memcpy(NUMBERS_OF(perp_body_state, &copy), &world->bodies.states[slot],
           offsetof(perp__state, put));
    perp__struct_write(state, &copy, sizeof copy);
    return PERP_OK;
}

perp_status perp_world_get_body(const perp_world *world, perp_body_state *state, perp_body body)
{
    return PERP__WORLD_CALL(world, get_body(world, state, body));
}

static perp_status set_body(perp_world *world, const perp_body_state *caller, perp_body id)
{
    perp_body_state copy;
    perp__state state;
    int32_t slot;
    perp_status status = perp__check_pointer(world->context, "state", caller);

    PERP__THEN(status, perp__find_body(world, &slot, id));
    PERP__THEN(status, perp_body_state_init(&copy, sizeof copy));
    PERP__THEN(status, perp__struct_read(world->context, "state", &copy, sizeof copy, caller,
                                         PERP__FIRST(perp_body_state)));
    if (status != PERP_OK)
        return status;
    memset(&state, 0, sizeof state);
    memcpy(&state, NUMBERS_OF(perp_body_state, &copy), offsetof(perp__state, put));
    status =
        check_state(world, &state, "state.position", "state.velocity", "state.angular_velocity");
    PERP__THEN(status, perp__check_vector3(world, "state.force", state.force));
    PERP__THEN(status, check_turning(world, "state.torque", state.torque));
    if (status == PERP_OK && world->bodies.all[slot].kind == PERP_BODY_STATIC &&
        !(perp__is_zero3(state.velocity) && perp__is_zero3(state.angular_velocity) &&
          perp__is_zero3(state.force) && perp__is_zero3(state.torque)))
        status =
            perp__refuse(world->context, "body is static: velocities, force and torque must be 0");
    if (status == PERP_OK &&
        memcmp(&world->bodies.states[slot], &state, offsetof(perp__state, put)) != 0) {
        if (memcmp(&world->bodies.states[slot], &state, offsetof(perp__state, velocity)) != 0)
            perp__note_put(world, slot);
        memcpy(&world->bodies.states[slot], &state, offsetof(perp__state, put));
        perp__disturb(world, slot);
    }
    return status;
}

perp_status perp_world_set_body(perp_world *world, const perp_body_state *state, perp_body body)
{
    return PERP__WORLD_CALL(world, set_body(world, state, body));
}

static perp_status get_mass(const perp_world *world, double *mass, double *inertia, perp_body id)
{
    const perp__body *body;
    int32_t slot;
    perp_status status = perp__find_body(world, &slot, id);

    if (status != PERP_OK)
        return status;
    body = &world->bodies.all[slot];
    if (mass)
        *mass = body->kind == PERP_BODY_DYNAMIC ? body->mass : INFINITY;
    for (int32_t k = 0; k < 9 && inertia; k++)
        inertia[k] = body->inertia[k];
    for (int32_t k = world->settings.planar ? 8 : 0;
         k < 9 && inertia && body->kind != PERP_BODY_DYNAMIC; k += 4)
        inertia[k] = INFINITY;
    return PERP_OK;
}

perp_status perp_world_get_mass(const perp_world *world, double *mass, double *inertia,
                                perp_body body)
{
    return PERP__WORLD_CALL(world, get_mass(world, mass, inertia, body));
}

static perp_status get_states(const perp_world *world, perp_world_states *states)
{
    const perp__state *first = world->bodies.states;
    perp_world_states copy;
    perp_status status = PERP__CHECK(perp_world_states, world->context, states);

    PERP__THEN(status, perp_struct_init(&copy, sizeof copy));
    if (status != PERP_OK)
        return status;
    copy.slots = world->bodies.slots;
    copy.pose_stride = copy.twist_stride = sizeof *first;
    copy.position = first->position;
    copy.orientation = first->orientation;
    copy.angle = &first->angle;
    copy.velocity = first->velocity;
    copy.angular_velocity = first->angular_velocity;
    perp__struct_write(states, &copy, sizeof copy);
    return PERP_OK;
}

perp_status perp_world_get_states(const perp_world *world, perp_world_states *states)
{
    return PERP__WORLD_CALL(world, get_states(world, states));
}

perp_status perp_world_body_slot(const perp_world *world, int32_t *slot, perp_body body)
{
    return PERP__WORLD_CALL(world, slot ? perp__find_body(world, slot, body)
                                        : perp__check_pointer(world->context, "slot", slot));
}

/* The next positions.
 *
 * What contacts push moves with the velocity that meets them, x+ = x + h v, by the exponential map
 * of h w. What nothing pushes moves with the mean velocity, x+ = x + h (v + v_f)/2, exact for a
 * constant force; it turns by the exponential map of h (w + w+)/2 in the body frame, w+ by the
 * implicit midpoint rule for Euler's equations, and is then aligned so that the angular momentum in
 * space is what it was, plus the torque's. */
#include "world/islands/lanes.h"

/* q+ = exp(t w) q, w in the world frame; 0 leaves every bit. */
void perp__turn(const perp_world *world, perp__state *state, double t, const double *w)
{
    const double turn[3] = {t * w[0], t * w[1], t * w[2]};
    double rotation[4], turned[4];

    if (perp__is_zero3(turn))
        return;
    if (world->settings.planar) {
        state->angle += turn[2];
        state->orientation[0] = cos(0.5 * state->angle);
        state->orientation[3] = sin(0.5 * state->angle);
        return;
    }
    perp__quaternion_exponential(rotation, turn);
    perp__quaternion_product(turned, rotation, state->orientation);
    perp__quaternion_normalise(turned);
    memcpy(state->orientation, turned, sizeof turned);
}

/* Angular momentum R I w in the world frame. */
static void momentum_of(const perp_world *world, const perp__body *body, const perp__state *state,
                        const double *w, double *momentum)
{
    double R[9], Iw[3];

    perp__rotation_of(world, state, R);
    perp__apply3(Iw, body->inertia, w);
    perp__apply3(momentum, R, Iw);
}

/* Free rotation of a body whose inertia is not a multiple of the identity. The torque is that of
 * the world frame, seen from the body half-way through the step. */
static void rotate_freely(perp_world *world, int32_t i, double h)
{
    const perp__body *body = &world->bodies.all[i];
    const perp__state *old = &world->bodies.states[i];
    perp__state *next = &world->step.next[i];
    perp__state halfway = *old;
    double R[9], w[3], w_next[3], torque[3], mean[3], before[3], after[3];
    double rotation[4], turned[4], product;

    world->step.motions[i].enclosed = 0; /* it does not turn by the motion at hand alone */
    perp__apply_transposed3(w, world->step.motions[i].rotation, old->angular_velocity);
    perp__turn(world, &halfway, 0.5 * h, old->angular_velocity);
    perp__rotation_of(world, &halfway, R);
    perp__apply_transposed3(torque, R, old->torque);
    perp__euler_step(body, h, w, torque, w_next);
    for (int32_t k = 0; k < 3; k++)
        mean[k] = 0.5 * (w[k] + w_next[k]);
    perp__apply3(world->step.motions[i].moving + 3, R, mean); /* the torque works along it */
    perp__apply3(after, world->step.motions[i].rotation, mean);
    perp__turn(world, next, h, after);
    momentum_of(world, body, old, w, before);
    perp__add3(before, h, old->torque);
    momentum_of(world, body, next, w_next, after);
    /* the smallest rotation that brings the momentum that is into that which should be; there is no
     * direction to keep, or it is far off, in steps of many radians */
    product = perp__length3(after) * perp__length3(before);
    rotation[0] = product + perp__dot3(after, before);
    perp__cross(rotation + 1, after, before);
    if (!world->settings.planar && rotation[0] > 0.5 * product) {
        perp__quaternion_normalise(rotation);
        perp__quaternion_product(turned, rotation, next->orientation);
        perp__quaternion_normalise(turned);
        memcpy(next->orientation, turned, sizeof turned);
    }
    perp__rotation_of(world, next, R);
    perp__apply3(next->angular_velocity, R, w_next);
}

/* To the twist that forces alone make of its own. */
static void move_freely(perp_world *world, int32_t i, double h, const double *v_f)
{
    const perp__state *old = &world->bodies.states[i];
    perp__state *next = &world->step.next[i];
    double mean[3];

    for (int32_t k = 0; k < 3; k++) {
        next->position[k] += h * (0.5 * (old->velocity[k] + v_f[k]));
        mean[k] = 0.5 * (old->angular_velocity[k] + v_f[3 + k]);
    }
    perp__copy3(next->velocity, v_f);
    if (world->bodies.all[i].spherical) {
        perp__turn(world, next, h, mean);
        perp__copy3(next->angular_velocity, v_f + 3);
    } else if (!perp__is_zero3(old->angular_velocity) || !perp__is_zero3(old->torque)) {
        rotate_freely(world, i, h);
    }
}

static bool is_finite(const perp__state *state)
{
    return perp__is_finite3(state->position) && perp__is_finite3(state->orientation) &&
           0.0 * state->orientation[3] == 0.0 && 0.0 * state->angle == 0.0 &&
           perp__is_finite3(state->velocity) && perp__is_finite3(state->angular_velocity);
}

int32_t perp__find_infinite(const perp_world *world)
{
    for (int32_t i = 0; i < world->sleep.awake_count; i++)
        if (!is_finite(&world->step.next[world->sleep.awake[i]]))
            return world->sleep.awake[i];
    return -1;
}

static void exchange(perp_world *world, int32_t i)
{
    const perp__state state = world->bodies.states[i];

    world->bodies.states[i] = world->step.next[i];
    world->step.next[i] = state;
}

bool perp__glide(perp_world *world, int32_t i, double h)
{
    const perp__body *body = &world->bodies.all[i];
    double free[6], moving[6];

    if (!body->spherical || body->kind != PERP_BODY_DYNAMIC || body->first_joint != 0)
        return 0;
    perp__push_freely(world, i, h, free);
    for (int32_t k = 0; k < 3; k++) {
        moving[k] = 0.5 * (world->bodies.states[i].velocity[k] + free[k]);
        moving[3 + k] = 0.5 * (world->bodies.states[i].angular_velocity[k] + free[3 + k]);
    }
    if (!perp__stays_enclosed(world, i, moving, h))
        return 0;
    world->step.next[i] = world->bodies.states[i];
    move_freely(world, i, h, free);
    if (!is_finite(&world->step.next[i]) || perp__stays(world, i))
        return 0;
    world->step.motions[i].coasts = world->step.coasting;
    world->step.roles[i].repeats = 0;
    exchange(world, i);
    return 1;
}

void perp__stop_coasting(perp_world *world, int32_t i)
{
    if (world->step.motions[i].coasts != world->step.coasting)
        return;
    world->step.motions[i].coasts = 0;
    world->step.moving[world->step.moving_count++] = i;
    exchange(world, i);
    perp__start_motion(world, i, world->step.length); /* it may have glided so far */
}

void perp__stop_all_coasting(perp_world *world)
{
    for (int32_t i = 0; i < world->sleep.awake_count && world->step.motions; i++)
        perp__stop_coasting(world, world->sleep.awake[i]);
}

/* A range of what does not coast; `found`: one whose numbers are not finite, or -1. */
static void integrate(perp_world *world, perp__share *share, double h)
{
    share->found = -1;
    for (int32_t i = share->first; i < share->end && share->found < 0; i++) {
        const int32_t body = world->step.moving[i];
        const int32_t kind = world->bodies.all[body].kind;
        perp__state *next = &world->step.next[body];
        perp__motion *motion = &world->step.motions[body];

        *next = world->bodies.states[body];
        if (kind == PERP_BODY_STATIC) {
            motion->placed += motion->placed == world->step.coasting;
            continue;
        }
        if (kind == PERP_BODY_DYNAMIC &&
            (world->step.roles[body].island < 0 ||
             (!world->step.roles[body].jointed && perp__goes_freely(world, body))))
            move_freely(world, body, h, motion->free);
        else {
            perp__add3(next->position, h, motion->moving);
            perp__turn(world, next, h, motion->moving + 3);
            perp__copy3(next->velocity, motion->after);
            perp__copy3(next->angular_velocity, motion->after + 3);
            if (kind == PERP_BODY_KINEMATIC)
                memcpy(next->led, motion->start, sizeof next->led);
        }
        if (!is_finite(next))
            share->found = body;
        else if (!motion->enclosed || perp__has_pairs(world, body)) {
            const perp__state *old = &world->bodies.states[body];
            const bool anew = motion->placed != world->step.coasting;
            const bool turns =
                anew || old->angle != next->angle ||
                memcmp(old->orientation, next->orientation, sizeof old->orientation) != 0;

            if (anew || !perp__is_zero3(motion->moving) || !perp__stays(world, body))
                perp__place_body(world, world->step.next, body, turns);
            motion->placed = world->step.coasting + 1;
        }
    }
}

int32_t perp__integrate(perp_world *world, double h)
{
    perp__share all = {.found = -1};
    const int32_t lanes = perp__share_out(world, world->step.moving_count, integrate, h, &all);

    for (int32_t k = 0; k < lanes && all.found < 0; k++)
        all.found = world->lanes[k].share.found;
    return all.found;
}

/* What carries an island, and whether it lies with that motion still: whether the impulses of the
 * last step, as they are, balance what forces do in this one. */
#include "world/joints/joints.h"

/* ---- what carries an island ---- */

static bool is_moving(const perp_world *world, int32_t body)
{
    return !(perp__is_zero3(world->bodies.states[body].velocity) &&
             perp__is_zero3(world->bodies.states[body].angular_velocity));
}

bool perp__moves_with(const perp_world *world, const perp__carrying *carrying, int32_t body)
{
    const perp__state *state = &world->bodies.states[body];
    double twist[6], rounding = 0.0;

    perp__carried_twist(world, carrying, body, 0.0, twist);
    if (!perp__is_zero3(twist + 3)) /* turning adds what rounds */
        rounding =
            PERP__ROUNDING_LIMIT *
            (perp__length3(twist) + perp__length3(world->bodies.states[carrying->body].velocity));
    for (int32_t k = 0; k < 3; k++)
        if (fabs(twist[k] - state->velocity[k]) > rounding ||
            twist[3 + k] != state->angular_velocity[k])
            return 0;
    return 1;
}

bool perp__find_carrying(const perp_world *world, const perp__island *island, int32_t moving,
                         perp__carrying *carrying)
{
    const int32_t ties = perp__count_ties(island);
    int32_t k, body;

    *carrying = (perp__carrying){PERP__CARRIED_AT_REST, -1, 0};
    for (k = 0; k < ties && carrying->body < 0; k++) {
        body = perp__tie(world, island, k);
        if (world->step.roles[body].dynamic || is_moving(world, body) < moving)
            continue;
        carrying->motion = is_moving(world, body) ? PERP__CARRIED_ALONG : PERP__CARRIED_AT_REST;
        carrying->body = body;
    }
    for (k = moving ? 0 : k; k < ties && carrying->body >= 0 && !carrying->parts; k++) {
        body = perp__tie(world, island, k);
        carrying->parts = body != carrying->body && !world->step.roles[body].dynamic &&
                          !perp__moves_with(world, carrying, body);
    }
    return moving ? carrying->body >= 0 : !carrying->parts;
}

bool perp__find_frame(const perp_world *world, const perp__island *island, double *frame)
{
    perp__carrying carrying;
    const bool one = perp__find_carrying(world, island, 0, &carrying);
    const double *twist;

    memset(frame, 0, 3 * sizeof *frame);
    if (carrying.motion == PERP__CARRIED_AT_REST)
        return one;
    twist = world->step.motions[carrying.body].start;
    perp__copy3(frame, twist);
    return one && perp__is_zero3(twist + 3);
}

/* Where a carrier that turns takes the arm from its position to a body, after a time t. */
static void turn_arm(const perp_world *world, const perp__carrying *carrying, int32_t body,
                     double t, double *arm)
{
    const double *spin = world->step.motions[carrying->body].start + 3;
    const double turn[3] = {t * spin[0], t * spin[1], t * spin[2]};
    double R[9], start[3];

    perp__subtract3(start, world->bodies.states[body].position,
                    world->bodies.states[carrying->body].position);
    perp__turn_matrix(R, turn);
    perp__apply3(arm, R, start);
}

void perp__carried_twist(const perp_world *world, const perp__carrying *carrying, int32_t body,
                         double t, double *twist)
{
    const double *of;
    double arm[3], turned[3];

    if (carrying->motion == PERP__CARRIED_PARTLY) {
        perp__twist_of(world, world->solve.work.still + world->dof * world->step.roles[body].local,
                       twist);
        return;
    }
    if (carrying->body < 0 ? carrying->motion != PERP__CARRIED_ON
                           : carrying->motion == PERP__CARRIED_AT_REST && t >= 0.0) {
        memset(twist, 0, 6 * sizeof *twist);
        return;
    }
    of = carrying->motion == PERP__CARRIED_ON ? world->step.motions[body].start
         : t < 0.0                            ? world->bodies.states[carrying->body].led
                                              : world->step.motions[carrying->body].start;
    memcpy(twist, of, 6 * sizeof *twist);
    if (perp__is_zero3(of + 3) || carrying->motion == PERP__CARRIED_ON)
        return;
    turn_arm(world, carrying, body, fmax(t, 0.0), arm);
    perp__cross(turned, of + 3, arm);
    perp__add3(twist, 1.0, turned);
}

void perp__ride(perp_world *world, const perp__island *island, double h)
{
    perp__carrying carrying;

    if (!perp__find_carrying(world, island, 1, &carrying) ||
        perp__is_zero3(world->step.motions[carrying.body].start + 3))
        return;
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        double *moving = world->step.motions[body].moving, from[3], to[3];

        perp__subtract3(from, world->bodies.states[body].position,
                        world->bodies.states[carrying.body].position);
        turn_arm(world, &carrying, body, h, to);
        for (int32_t k = 0; k < 3; k++)
            moving[k] = world->step.motions[carrying.body].start[k] + (to[k] - from[k]) / h;
    }
}

/* To the last bit; or, of a carrier that turns, to what a step leaves that knows rows of its
 * beginning alone: h w^2 r; or, slowly, to what forces make of each body in a step, as impulses of
 * twice their size stop it. t: 0, or before the step. */
static bool begins_with(const perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, bool slowly, double t)
{
    const double spin = carrying->motion == PERP__CARRIED_ALONG
                            ? perp__length3(world->step.motions[carrying->body].start + 3)
                            : 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__motion *motion = &world->step.motions[body];
        double twist[6], beside[6], gain[6], both[2][6];

        perp__carried_twist(world, carrying, body, t, twist);
        for (int32_t k = 0; k < 6; k++) {
            beside[k] = motion->start[k] - twist[k];
            gain[k] = motion->free[k] - motion->start[k];
            if (!slowly &&
                fabs(beside[k]) > world->step.length * spin * perp__length3(twist + k / 3 * 3))
                return 0;
        }
        if (!slowly)
            continue;
        perp__coordinates_of(world, beside, both[0]);
        perp__coordinates_of(world, gain, both[1]);
        if (!(perp__mass_norm(world, body, both[0]) <= perp__mass_norm(world, body, both[1])))
            return 0;
    }
    return 1;
}

bool perp__begins_standing(const perp_world *world, const perp__island *island, bool slowly,
                           perp__carrying *carrying)
{
    for (int32_t moving = 1; moving >= 0; moving--) {
        if (!perp__find_carrying(world, island, moving, carrying))
            continue;
        if (begins_with(world, island, carrying, slowly, 0.0) ||
            /* what is static had no other motion in the last step */
            (carrying->body >= 0 && world->bodies.all[carrying->body].kind == PERP_BODY_KINEMATIC &&
             begins_with(world, island, carrying, slowly, -1.0)))
            return 1;
    }
    carrying->motion = PERP__CARRIED_ON;
    carrying->parts = 0;
    /* Whether nothing changes at the contacts if bodies go on as they are: to the last bit, as
     * rounding of a sliding velocity is no rest. */
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        double u[3];

        perp__relative_velocity(world, contact, PERP__TWIST_START, u);
        if (u[0] != 0.0 || (contact->friction > 0.0 && (u[1] != 0.0 || u[2] != 0.0)))
            return 0;
    }
    return island->joints == 0;
}

/* ---- the impulses of the last step ---- */

/* The sum of a body's forces, in the world's frame, and the size of its terms, by its mass. */
enum { FORCE = 0, MOMENT = 3, TERMS = 6, NUMBERS = 7 };

static void press(const perp_world *world, const perp__world_contact *contact, const double *r,
                  double *sums)
{
    double force[3], moment[3], size;

    if (r[0] == 0.0)
        return;
    for (int32_t k = 0; k < 3; k++)
        force[k] =
            r[0] * contact->axes[0][k] + r[1] * contact->axes[1][k] + r[2] * contact->axes[2][k];
    size = perp__length3(force);
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        double *sum = sums + NUMBERS * world->step.roles[body].local;

        if (world->bodies.all[body].kind != PERP_BODY_DYNAMIC)
            continue;
        perp__cross(moment, contact->arms[side], force);
        for (int32_t k = 0; k < 3; k++) {
            sum[FORCE + k] += side == 0 ? -force[k] : force[k];
            sum[MOMENT + k] += side == 0 ? -moment[k] : moment[k];
        }
        sum[TERMS] += size;
    }
}

void perp__find_force(const perp_world *world, const perp__carrying *carrying, int32_t body,
                      double t, const double *now, const double *free, double *force)
{
    const double *R = world->step.motions[body].rotation, *I = world->bodies.all[body].inertia;
    double carried[6], local[3], turned[3], change[3], momentum[3], gyroscopic[3];

    perp__carried_twist(world, carrying, body, t, carried);
    /* The angular impulse that takes the body from `now` to the carried angular velocity in a time
     * t without contacts: the free motion turns, and so has gyroscopic terms of its own. */
    perp__subtract3(change, now + 3, carried + 3);
    perp__apply_transposed3(local, R, change);
    perp__apply3(turned, I, local);
    perp__apply3(force + 3, R, turned);
    perp__apply_transposed3(local, R, carried + 3);
    perp__apply3(turned, I, local);
    perp__apply3(momentum, R, turned);
    perp__cross(gyroscopic, carried + 3, momentum);
    perp__add3(force + 3, t, world->bodies.states[body].torque);
    perp__add3(force + 3, -t, gyroscopic);
    for (int32_t k = 0; k < 3; k++) {
        force[k] = world->bodies.all[body].mass * (free[k] - carried[k]);
        force[3 + k] /= perp__body_length(world, body);
    }
}

static void lie(perp_world *world, const perp__island *island, const perp__carrying *carrying)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        perp__motion *motion = &world->step.motions[body];

        perp__carried_twist(world, carrying, body, world->step.length, motion->after);
        memcpy(motion->moving, motion->after, sizeof motion->moving);
    }
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        perp__response *response = perp__step_response(world, island, i);

        perp__copy3(response->impulse, response->next);
        memset(response->velocity, 0, sizeof response->velocity);
        /* what slides freely stands along the normal alone */
        if (!perp__step_flags(world, island, i)->rubs)
            perp__relative_velocity(world, contact, PERP__TWIST_AFTER, response->velocity);
        response->velocity[0] = 0.0;
        response->mode = response->impulse[0] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    }
}

/* What the last step's impulses leave of a body's forces beside the sizes of their terms, and what
 * presses on its mass centre at least; the most of all. INFINITY: they are none of this step's. */
static double last_unbalance(perp_world *world, const perp__island *island,
                             const perp__carrying *carrying, bool swept)
{
    double *sums = world->solve.work.forces, left = 0.0;

    memset(sums, 0, NUMBERS * (size_t)island->bodies * sizeof *sums);
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        const perp__contact_flags *flags = perp__step_flags(world, island, i);
        perp__response *response = perp__step_response(world, island, i);
        const double *r = response->remembered, most = contact->friction * r[0];

        /* it may press as it did while nothing moves; sweeps take out what is deep */
        if (!(r[0] >= 0.0 && r[1] * r[1] + r[2] * r[2] <= most * most) ||
            (r[0] > 0.0 && !(contact->gap <= perp__closed_gap(world, contact))) ||
            (swept && flags->deep))
            return INFINITY;
        perp__copy3(response->next, r);
        press(world, contact, response->next, sums);
    }
    for (int32_t i = 0; i < island->bodies && left <= PERP__BALANCED; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__motion *motion = &world->step.motions[body];
        const double length = perp__body_length(world, body), *sum = sums + NUMBERS * i;
        double force[6], rest[6], local;

        perp__find_force(world, carrying, body, world->step.length, motion->start, motion->free,
                         force);
        for (int32_t k = 0; k < 6; k++)
            rest[k] = force[k] + sum[k] / (k < 3 ? 1.0 : length);
        local = perp__length2(perp__length3(rest), perp__length3(rest + 3));
        if (local > 0.0)
            perp__raise_to(&left,
                           local / (perp__length3(force) + perp__length3(force + 3) + sum[TERMS]));
    }
    return left;
}

perp_status perp__lie_still(perp_world *world, const perp__island *island, bool swept,
                            perp__verdict *verdict)
{
    perp_status status = PERP_OK;
    perp__carrying carrying;
    double left;

    verdict->moves = !perp__begins_standing(world, island, 0, &carrying);
    if ((world->settings.cone != 0 && !world->settings.planar) || verdict->moves || carrying.parts)
        return PERP_OK;
    left = last_unbalance(world, island, &carrying, swept);
    if (!(left <= PERP__BALANCED))
        status = perp__stand_as_decided(world, island, &carrying, swept, &left);
    if (status != PERP_OK || !(left <= PERP__BALANCED))
        return status;
    lie(world, island, &carrying);
    verdict->outcome = PERP_OUTCOME_SOLVED;
    verdict->residual = left;
    verdict->stages = 1;
    verdict->swept = swept;
    verdict->stands = 1;
    verdict->rides = carrying.motion == PERP__CARRIED_ALONG;
    return PERP_OK;
}

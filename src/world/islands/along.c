/* Contacts in islands with joints: they go along with their bodies through an interval, as joints
 * do beside them (joints/trial.c). Else a joint and a contact on one line contradict each other by
 * as much as all turns, however short the step is.
 *
 * The normal and the tangents a turn as both bodies do, perp__common_turn(). The arm s of a body is
 * turned with it, but for the radius of what is round: that turns below its contact and goes along
 * with the normal. What slides has one point on both bodies all the same, so that an impulse is
 * equal and opposite. Rows are those half-way, J = (a, s x a), as seen from the end; by then they
 * are J1, and (J1 - J) v of the velocities of the round before is left to the biases. */
#include "world/joints/joints.h"

#include "base/groups.h"

/* How far a body went and turned since the step began. */
static void find_drift(const perp_world *world, int32_t body, double *drift)
{
    const perp__island_work *work = &world->solve.work;

    if (perp__is_dynamic(world, body))
        perp__twist_of(world, work->drift + world->dof * world->step.roles[body].local, drift);
    else
        for (int32_t k = 0; k < 6; k++)
            drift[k] = work->gone * world->step.motions[body].moving[k];
}

/* Turns of both bodies and, of the normal, that which both have in common: before the interval, and
 * in half of it; *angle: that of all of these. Returns 0 where there are none. */
static bool find_turns(const perp_world *world, const int32_t *body, double begun[3][9],
                       double half[3][9], double *angle)
{
    const perp__island_work *work = &world->solve.work;
    double gone[3][3], turn[3][3];
    bool turns = 0;

    for (int32_t side = 0; side < 2; side++) {
        const double *spin = world->step.motions[body[side]].trial + 3;
        double drift[6];

        find_drift(world, body[side], drift);
        perp__copy3(gone[side], drift + 3);
        for (int32_t k = 0; k < 3; k++)
            turn[side][k] = 0.5 * work->span * spin[k];
        turns |= !perp__is_zero3(gone[side]) || !perp__is_zero3(turn[side]);
    }
    perp__common_turn(gone[2], gone[0], gone[1]);
    perp__common_turn(turn[2], turn[0], turn[1]);
    *angle = perp__length3(gone[2]) + 2.0 * perp__length3(turn[2]);
    for (int32_t k = 0; k < 3 && turns; k++) {
        perp__turn_matrix(begun[k], gone[k]);
        perp__turn_matrix(half[k], turn[k]);
    }
    return turns;
}

/* By how much of half a step's slide the point goes along on this body: not at all on what is round
 * or moves on what stands, else half of it where the other body is like this one. */
static double share_of_slide(const perp_world *world, const int32_t *shape, int32_t side)
{
    int32_t keeps[2];

    for (int32_t k = 0; k < 2; k++) {
        const perp__shape *other = &world->shapes.all[shape[1 - k]];

        keeps[k] = world->shapes.all[shape[k]].geometry.radius > 0.0 ||
                   (other->geometry.radius == 0.0 &&
                    world->bodies.all[other->body].kind == PERP_BODY_STATIC);
    }
    return keeps[side] ? 0.0 : keeps[1 - side] ? 1.0 : 0.5;
}

/* Else an impact where bodies slid before they met has two points, and angular momentum is lost. */
void perp__meet_now(const perp_world *world, perp__world_contact *contact, double gap)
{
    const int32_t shape[2] = {contact->shape_a, contact->shape_b};
    double apart[3] = {0.0}, at[6];

    perp__add3(apart, -gap, contact->axes[0]);
    for (int32_t side = 0; side < 2; side++) {
        find_drift(world, world->shapes.all[shape[side]].body, at);
        if (perp__length3(at) > world->shapes.all[shape[side]].reach)
            return; /* hit in its mass centre */
        perp__add3(at, 1.0, world->bodies.states[world->shapes.all[shape[side]].body].position);
        perp__add3(at, 1.0, contact->arms[side]);
        perp__add3(apart, 2.0 * side - 1.0, at);
    }
    perp__add3(contact->arms[0], share_of_slide(world, shape, 0), apart);
    perp__add3(contact->arms[1], -share_of_slide(world, shape, 1), apart);
}

/* Between bodies that joints join, directly or by way of others, rows of contacts and joints may
 * say the same, each known to the square of the turn that the bodies have in common: nothing limits
 * impulses along what is left of the difference. So a contact gives way by as much of what an
 * impulse moves: that limits them, is of third order in velocities, and takes energy at most. */
static void give_way(perp_world *world, const perp__island *island, double angle,
                     const int32_t *body, perp__rigid_rows *rows)
{
    int32_t *parts = world->solve.work.parts;

    if (!perp__is_dynamic(world, body[0]) || !perp__is_dynamic(world, body[1]) ||
        perp__root_of(parts, rows->body[0]) != perp__root_of(parts, rows->body[1]))
        return;
    for (int32_t k = 0; k < rows->dim; k++)
        rows->compliance[k] = angle * angle * perp__moved_by(world, island, rows, k);
}

void perp__turn_contact(perp_world *world, const perp__island *island,
                        const perp__world_contact *contact)
{
    perp__island_work *work = &world->solve.work;
    perp__rigid_rows *rows = &work->rows[work->count];
    const int32_t body[2] = {contact->body_a, contact->body_b};
    const int32_t shape[2] = {contact->shape_a, contact->shape_b};
    double *turning = work->turning + 3 * work->count, slide[3], spun[3], axes[3][3][3];
    double begun[3][9], half[3][9], now[2][6], angle;

    if (!find_turns(world, body, begun, half, &angle))
        return;

    /* 1. axes as the interval begins, half-way, and at its end; how bodies part by half of it */
    for (int32_t k = 0; k < rows->dim; k++) {
        perp__apply3(axes[0][k], begun[2], contact->axes[k]);
        perp__apply3(axes[1][k], half[2], axes[0][k]);
        perp__apply3(axes[2][k], half[2], axes[1][k]);
    }
    for (int32_t k = 0; k < 3; k++)
        slide[k] = 0.0;
    for (int32_t side = 0; side < 2; side++) {
        perp__twist_now(world, body[side], now[side]);
        perp__cross(spun, now[side] + 3, contact->arms[side]);
        perp__add3(spun, 1.0, now[side]);
        perp__add3(slide, (side == 0 ? -0.5 : 0.5) * work->span, spun);
    }
    work->came[work->count] = 0.0;
    for (int32_t side = 0; side < 2; side++) {
        const double sign = side == 0 ? -1.0 : 1.0, *last = world->step.motions[body[side]].last;
        const double radius = -sign * world->shapes.all[shape[side]].geometry.radius;
        const double share = -sign * share_of_slide(world, shape, side);
        double arm[3][3], moment[3], seen[3];

        if (rows->body[side] < 0)
            continue;

        /* 2. arms then: to the shape's core, with its share of the slide, and to the surface */
        perp__copy3(moment, contact->arms[side]);
        perp__add3(moment, -radius, contact->axes[0]);
        perp__apply3(arm[0], begun[side], moment);
        perp__apply3(arm[1], half[side], arm[0]);
        perp__apply3(arm[2], half[side], arm[1]);
        perp__apply3(seen, half[2], slide);
        perp__add3(arm[1], share, seen);
        perp__apply3(moment, half[2], seen);
        perp__add3(arm[2], 2.0 * share, moment);
        for (int32_t at = 0; at < 3; at++)
            perp__add3(arm[at], radius, axes[at][0]);

        /* 3. rows, what they change by, and the normal velocity as the interval begins */
        perp__cross(moment, arm[0], axes[0][0]);
        work->came[work->count] +=
            sign * (perp__dot3(axes[0][0], now[side]) + perp__dot3(moment, now[side] + 3));
        for (int32_t k = 0; k < rows->dim; k++) {
            double twist[6] = {0.0};

            perp__cross(moment, arm[1], axes[1][k]);
            perp__apply3(seen, half[side], moment);
            perp__add3(twist, sign, axes[1][k]);
            perp__add3(twist + 3, sign, seen);
            perp__coordinates_of(world, twist, rows->rows[side][k]);
            perp__cross(moment, arm[2], axes[2][k]);
            turning[k] += sign * (perp__dot3(axes[2][k], last) + perp__dot3(moment, last + 3)) -
                          perp__dot(twist, last, 6);
        }
    }
    give_way(world, island, angle, body, rows);
}

void perp__turn_contacts(perp_world *world)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < work->count; i++)
        for (int32_t k = 0; k < work->rows[i].dim; k++)
            work->rows[i].bias[k] += work->turning[3 * i + k];
}

/* Exact velocities of an island from the solution of its complementarity problem.
 *
 * The solution says which contacts are closed and which of those stick. With these rows known, the
 * velocities follow without the impulses that hold them (hold.c), so that a velocity which the rows
 * determine carries no rounding: a body at rest has 0.0, a body carried by a belt has the belt's
 * velocity. Nothing small is ever set to zero: only what the solution can't tell from zero, being
 * within the rounding of the terms it was computed from, decides whether a row holds. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/hold.h"
#include "world/spatial.h"

/* Rounding of a sum relative to its terms: what a velocity that should be 0 may come out as. */
#define ROUNDING (256.0 * PERP__EPSILON)

/* Exact velocities must agree with the solution's as well as that is known, relative to the largest
 * terms of the island, and meet the rows; what a solution stopped early says of contacts fails
 * this, and its own velocities stand. */
#define AGREEMENT 1e-8

static int32_t is_dynamic(const perp_world *world, int32_t body)
{
    return world->bodies[body].kind == PERP_BODY_DYNAMIC;
}

static perp__motion *island_motion(const perp_world *world, const perp__island *island, int32_t i)
{
    return &world->motions[world->body_order[island->first_body + i]];
}

static perp__world_contact *island_contact(const perp_world *world, const perp__island *island,
                                           int32_t i)
{
    return &world->contacts.contacts[world->contact_order[island->first_contact + i]];
}

/* |L^-1 twist|: twice its square root is the kinetic energy. */
static double mass_norm(const perp__motion *motion, const double *twist)
{
    double turning[3];

    perp__apply3(turning, motion->inverse_factor, twist + 3);
    return hypot(motion->root_mass * perp__length3(twist), perp__length3(turning));
}

/* |L' row'|: the largest row-velocity of a twist of mass norm 1. */
static double row_norm(const perp__motion *motion, const double *row)
{
    double turning[3];

    perp__apply_transposed3(turning, motion->factor, row + 3);
    return hypot(motion->root_inverse_mass * perp__length3(row), perp__length3(turning));
}

/* Velocities as the solution has them, v = v_f + M^-1 J' r, and for each body the size of the terms
 * in that sum. */
static void solved_velocities(perp_world *world, const perp__island *island)
{
    int32_t i, j, axis;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = island_motion(world, island, i);
        double change[6];

        memcpy(change, motion->free, sizeof change);
        perp__add6(change, -1.0, motion->start);
        memcpy(motion->solved, motion->free, sizeof motion->solved);
        motion->strength = mass_norm(motion, motion->start) + mass_norm(motion, change);
        for (j = 0; j < motion->touched; j++) {
            const perp__link *link = &world->links[motion->first_link + j];
            const perp__world_contact *contact = &world->contacts.contacts[link->contact];

            for (axis = 0; axis < 3; axis++) {
                if (contact->impulse[axis] == 0.0)
                    continue;
                perp__add6(motion->solved, contact->impulse[axis],
                           contact->response[link->side][axis]);
                motion->strength += fabs(contact->impulse[axis]) *
                                    row_norm(motion, contact->rows[link->side][axis]);
            }
        }
    }
}

/* Size of the terms that make the relative velocity along an axis. */
static double axis_scale(const perp_world *world, const perp__world_contact *contact, int32_t axis)
{
    const int32_t bodies[2] = {contact->body_a, contact->body_b};
    double scale = axis == 0 ? fabs(contact->target) : 0.0;
    int32_t side, i;

    for (side = 0; side < 2; side++) {
        const perp__motion *motion = &world->motions[bodies[side]];
        const double *row = contact->rows[side][axis];

        if (is_dynamic(world, bodies[side]))
            scale += row_norm(motion, row) * motion->strength;
        else
            for (i = 0; i < 6; i++)
                scale += fabs(row[i] * motion->start[i]);
    }
    return scale;
}

static void relative_velocity(const perp_world *world, const perp__world_contact *contact,
                              double *u)
{
    const int32_t bodies[2] = {contact->body_a, contact->body_b};
    int32_t side, axis;

    memset(u, 0, 3 * sizeof *u);
    for (side = 0; side < 2; side++) {
        const perp__motion *motion = &world->motions[bodies[side]];
        const double *twist = is_dynamic(world, bodies[side]) ? motion->solved : motion->start;

        for (axis = 0; axis < 3; axis++)
            u[axis] += perp__dot6(contact->rows[side][axis], twist);
    }
}

/* Closed: presses, or its gap closes to rounding without pressing (the fourth leg of a table).
 * Sticks: closed and no slip speed lambda, or one within rounding. */
static void classify(const perp_world *world, perp__world_contact *contact)
{
    const double *z = world->work.z + contact->first_row;
    double u[3], normal;

    relative_velocity(world, contact, u);
    normal = ROUNDING * axis_scale(world, contact, 0);
    contact->closed = contact->impulse[0] > 0.0 || fabs(u[0] - contact->target) <= normal;
    contact->sticks = 0;
    if (!contact->closed || contact->edges == 0)
        return;
    if (contact->impulse[0] > 0.0 && z[contact->edges + 1] == 0.0)
        contact->sticks = 1;
    else
        contact->sticks = hypot(u[1], u[2]) <= ROUNDING * (axis_scale(world, contact, 1) +
                                                           axis_scale(world, contact, 2));
}

/* Bodies held by what is held already, until no more are found. */
static void hold_single_bodies(perp_world *world, const perp__island *island, size_t twist)
{
    int32_t found, i;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = island_motion(world, island, i);

        motion->held = 0;
        motion->root = PERP__ROOT_NONE;
        motion->group = -1;
    }
    do {
        found = 0;
        for (i = 0; i < island->bodies; i++)
            if (!island_motion(world, island, i)->held)
                found += perp__hold_body(world, world->body_order[island->first_body + i], twist);
    } while (found > 0);
}

static int32_t group_root(const perp_world *world, int32_t i)
{
    while (world->parent[i] != i)
        i = world->parent[i];
    return i;
}

/* Groups of the bodies that are left: closed contacts join them. */
static void find_groups(perp_world *world, const perp__island *island)
{
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        int32_t body = world->body_order[island->first_body + i];

        world->parent[body] = body;
    }
    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);
        int32_t a = contact->body_a, b = contact->body_b;

        if (!contact->closed || !is_dynamic(world, a) || !is_dynamic(world, b) ||
            world->motions[a].held || world->motions[b].held)
            continue;
        a = group_root(world, a);
        b = group_root(world, b);
        if (a < b)
            world->parent[b] = a;
        else
            world->parent[a] = b;
    }
    for (i = 0; i < island->bodies; i++) {
        int32_t body = world->body_order[island->first_body + i];

        world->motions[body].group = group_root(world, body);
    }
}

static void hold_groups(perp_world *world, const perp__island *island, size_t twist)
{
    int32_t *bodies = world->work.group_bodies;
    int32_t i, j;

    find_groups(world, island);
    for (i = 0; i < island->bodies; i++) {
        int32_t group = world->body_order[island->first_body + i];
        int32_t count = 0;

        if (world->motions[group].held || world->motions[group].group != group)
            continue; /* a group is named after its first body */
        for (j = i; j < island->bodies; j++) {
            int32_t body = world->body_order[island->first_body + j];
            perp__motion *motion = &world->motions[body];

            if (motion->held || motion->group != group)
                continue;
            motion->column = count;
            bodies[count++] = body;
        }
        perp__hold_group(world, bodies, count, group, twist);
    }
}

/* Velocities meet the rows: what is closed neither opens nor closes, what sticks does not slip, and
 * nothing else closes further than its target. */
static int32_t meets_rows(const perp_world *world, const perp__world_contact *contact, size_t twist)
{
    double u[3], excess;
    int32_t axis;

    perp__relative_velocity(world, contact, twist, u);
    excess = u[0] - contact->target;
    if (contact->closed)
        excess = -fabs(excess);
    if (!(excess >= -AGREEMENT * axis_scale(world, contact, 0)))
        return 0;
    for (axis = 1; axis < 3 && contact->sticks; axis++)
        if (!(fabs(u[axis]) <= AGREEMENT * axis_scale(world, contact, axis)))
            return 0;
    return 1;
}

static int32_t agrees(perp_world *world, const perp__island *island, size_t twist)
{
    double strongest = 0.0;
    int32_t i;

    for (i = 0; i < island->bodies; i++)
        strongest = fmax(strongest, island_motion(world, island, i)->strength);
    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = island_motion(world, island, i);
        double difference[6];

        memcpy(difference, perp__twist(motion, twist), sizeof difference);
        perp__add6(difference, -1.0, motion->solved);
        if (!(mass_norm(motion, difference) <= AGREEMENT * strongest))
            return 0;
    }
    for (i = 0; i < island->contacts; i++)
        if (!meets_rows(world, island_contact(world, island, i), twist))
            return 0;
    return 1;
}

/* Relative velocity as reported: what a holding contact holds is exact. */
static void write_velocity(perp_world *world, perp__world_contact *contact, size_t twist,
                           int32_t exact)
{
    int32_t root = perp__root_of(world, contact->body_a);

    perp__relative_velocity(world, contact, twist, contact->velocity);
    if (!exact || !contact->closed)
        return;
    contact->velocity[0] = contact->target;
    if (contact->sticks ||
        (root != PERP__ROOT_NONE && root == perp__root_of(world, contact->body_b)))
        contact->velocity[1] = contact->velocity[2] = 0.0;
}

void perp__exact_velocities(perp_world *world, const perp__island *island, size_t twist)
{
    int32_t i, exact;

    solved_velocities(world, island);
    for (i = 0; i < island->contacts; i++)
        classify(world, island_contact(world, island, i));
    hold_single_bodies(world, island, twist);
    hold_groups(world, island, twist);
    exact = agrees(world, island, twist);
    for (i = 0; i < island->bodies && !exact; i++) {
        perp__motion *motion = island_motion(world, island, i);

        memcpy(perp__twist(motion, twist), motion->solved, sizeof motion->solved);
    }
    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        if (!exact)
            contact->closed = contact->impulse[0] > 0.0;
        write_velocity(world, contact, twist, exact);
    }
}

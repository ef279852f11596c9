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

static int32_t is_dynamic(const perp_world *world, int32_t body)
{
    return world->bodies[body].kind == PERP_BODY_DYNAMIC;
}

/* Velocities as the solution has them, v = v_f + M^-1 J' r, and for each body the size of the terms
 * in that sum. */
static void solved_velocities(perp_world *world, const perp__island *island)
{
    int32_t i, j, axis;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);
        double change[6];

        memcpy(change, motion->free, sizeof change);
        perp__add6(change, -1.0, motion->start);
        memcpy(motion->solved, motion->free, sizeof motion->solved);
        motion->strength = perp__mass_norm(motion, motion->start) + perp__mass_norm(motion, change);
        for (j = 0; j < motion->touched; j++) {
            const perp__link *link = &world->links[motion->first_link + j];
            const perp__world_contact *contact = &world->contacts.contacts[link->contact];

            for (axis = 0; axis < 3; axis++) {
                if (contact->impulse[axis] == 0.0)
                    continue;
                perp__add6(motion->solved, contact->impulse[axis],
                           contact->response[link->side][axis]);
                motion->strength += fabs(contact->impulse[axis]) *
                                    perp__row_norm(motion, contact->rows[link->side][axis]);
            }
        }
    }
}

/* Closed: presses, or its gap closes to rounding without pressing (the fourth leg of a table).
 * Sticks: closed and no slip speed lambda, or one within rounding. */
static void classify(const perp_world *world, perp__world_contact *contact)
{
    double u[3], normal;

    perp__relative_velocity(world, contact, PERP__TWIST_SOLVED, u);
    normal = ROUNDING * perp__axis_scale(world, contact, 0);
    contact->closed = contact->impulse[0] > 0.0 || fabs(u[0] - contact->target) <= normal;
    contact->sticks = 0;
    if (!contact->closed || contact->edges == 0)
        return;
    if (contact->impulse[0] > 0.0 && contact->slip == 0.0)
        contact->sticks = 1;
    else
        contact->sticks = hypot(u[1], u[2]) <= ROUNDING * (perp__axis_scale(world, contact, 1) +
                                                           perp__axis_scale(world, contact, 2));
}

/* Bodies held by what is held already, until no more are found. */
static void hold_single_bodies(perp_world *world, const perp__island *island, size_t twist)
{
    int32_t found, i;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        motion->held = 0;
        motion->root = PERP__ROOT_NONE;
        motion->group = -1;
    }
    do {
        found = 0;
        for (i = 0; i < island->bodies; i++)
            if (!perp__island_motion(world, island, i)->held)
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
        const perp__world_contact *contact =
            perp__island_contact(world, &world->contacts, island, i);
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

/* What the rows give must be an answer, or no worse than what the impulses give: a solution stopped
 * early says things of its contacts that do not hold. */
static int32_t hold(perp_world *world, const perp__island *island, size_t twist,
                    perp__evidence *evidence)
{
    const double tol = world->settings.tol;
    perp__evidence held = *evidence;

    if (!(evidence->own <= sqrt(tol)) || !perp__may_hold(world, island))
        return 0;
    hold_single_bodies(world, island, twist);
    hold_groups(world, island, twist);
    held.own = perp__own_residual(world, island, twist);
    if (!perp__is_good(perp__gate(&held, tol, -1)) && !(held.own <= evidence->own))
        return 0;
    *evidence = held;
    return 1;
}

void perp__exact_velocities(perp_world *world, const perp__island *island, size_t twist,
                            perp__evidence *evidence)
{
    int32_t i, exact;

    solved_velocities(world, island);
    evidence->own = perp__own_residual(world, island, PERP__TWIST_SOLVED);
    for (i = 0; i < island->contacts; i++)
        classify(world, perp__island_contact(world, &world->contacts, island, i));
    exact = hold(world, island, twist, evidence);
    for (i = 0; i < island->bodies && !exact; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memcpy(perp__twist(motion, twist), motion->solved, sizeof motion->solved);
    }
    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = perp__island_contact(world, &world->contacts, island, i);

        if (!exact)
            contact->closed = contact->impulse[0] > 0.0;
        write_velocity(world, contact, twist, exact);
    }
}

/* Contacts that come to an island whose motion is known: passes over what is near them change that
 * motion, from the velocities and impulses at hand. The rest of the island stays as it is, to the
 * last bit, and costs next to nothing; what that leaves is for a sweep over all of it.
 *
 * With v the velocity at the end of the step, m that which moves positions, and both changed by the
 * same d: a gap ends as gap + h J (m + d), so that b_n = gap / h + J m - J v as v + d sees it. */
#include "world/islands/contact_rows.h"

#include <math.h>
#include <string.h>

/* How many contacts lead from a fresh one to the farthest that is near it; and the passes. */
#define NEIGHBOURS 2
#define PASSES 8

/* Marks contacts that are near a fresh one in work.hit, and bodies of these in work.near. */
static void find_near(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    int8_t *left = work->near; /* of contacts that lead on from a body */

    memset(left, 0, (size_t)island->bodies * sizeof *left);
    for (int32_t round = 0; round <= NEIGHBOURS; round++)
        for (int32_t i = 0; i < island->contacts; i++) {
            const perp__tie *tie = perp__step_tie(world, island, i);
            const int32_t a = tie->local[0], b = tie->local[1];
            int8_t most = tie->fresh ? NEIGHBOURS + 1 : 0;

            most = a >= 0 && left[a] > most ? left[a] : most;
            most = b >= 0 && left[b] > most ? left[b] : most;
            if (a >= 0 && left[a] < most)
                left[a] = (int8_t)(most - 1);
            if (b >= 0 && left[b] < most)
                left[b] = (int8_t)(most - 1);
            work->hit[i] = most > 0;
        }
    for (int32_t i = 0; i < island->contacts; i++)
        for (int32_t side = 0; side < 2 && work->hit[i]; side++) {
            const int32_t local = perp__step_tie(world, island, i)->local[side];

            if (local >= 0)
                left[local] = NEIGHBOURS + 1;
        }
}

/* What is near as an island: its bodies in work.members, its contacts in work.part. */
static perp__island cut_out(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    perp__island part = {0};

    find_near(world, island);
    for (int32_t i = 0; i < island->contacts; i++)
        if (work->hit[i])
            work->part[part.contacts++] = world->contact_order[island->first_contact + i];
    for (int32_t i = 0; i < island->bodies; i++)
        if (work->near[i] > NEIGHBOURS) {
            world->roles[world->body_order[island->first_body + i]].local = part.bodies;
            work->members[part.bodies++] = world->body_order[island->first_body + i];
        }
    return part;
}

/* Where the island has come to: work.free and work.moving, and the impulses of what is near. */
static void load(perp_world *world, const perp__island *island, double h)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__motion *motion = perp__island_motion(world, island, i);

        perp__coordinates_of(world, motion->after, work->free + n * i);
        perp__coordinates_of(world, motion->moving, work->moving + n * i);
    }
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        double m[3], v[3];

        perp__relative_velocity(world, contact, PERP__TWIST_MOVING, m);
        perp__relative_velocity(world, contact, PERP__TWIST_AFTER, v);
        work->rows[i].bias[0] = fmax(contact->gap, 0.0) / h + m[0] - v[0];
        perp__copy3(work->warm + 3 * i, perp__step_response(world, island, i)->impulse);
    }
}

/* Passes over such a part. */
static perp_status sweep(perp_world *world, const perp__island *part, double h)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step = {0};
    perp_status status;

    perp__gather_bodies(world, part);
    perp__choose_rows(world, part, NULL);
    perp__pose_island(world, part, &problem);
    perp__receive(world, &answer);
    load(world, part, h);
    step.h = h;
    step.passes = PASSES;
    step.pushed = 1;
    status = perp__coloured_step(&world->coloured, &answer, NULL, &problem, &step);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->dof * part->bodies; i++) {
        work->moving[i] += work->v[i] - work->free[i];
        work->now[i] = work->v[i];
    }
    for (int32_t i = 0; i < part->contacts; i++) {
        perp__response *response = perp__step_response(world, part, i);

        perp__copy3(response->impulse, work->impulse + 3 * i);
        perp__copy3(response->next, response->impulse);
        perp__copy3(response->warm, response->impulse);
    }
    perp__spend(world, PASSES);
    perp__write_twists(world, part);
    return PERP_OK;
}

perp_status perp__sweep_near(perp_world *world, const perp__island *island, double h)
{
    int32_t *const bodies = world->body_order, *const contacts = world->contact_order;
    const perp__island part = cut_out(world, island);
    perp_status status;

    world->body_order = world->work.members;
    world->contact_order = world->work.part;
    status = sweep(world, &part, h);
    world->body_order = bodies;
    world->contact_order = contacts;
    for (int32_t i = 0; i < island->bodies; i++)
        if (world->work.near[i] > NEIGHBOURS)
            world->roles[bodies[island->first_body + i]].local = i;
    return status;
}

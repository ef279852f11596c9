/* Contacts that come to an island whose motion is known: passes over what is near them change that
 * motion, from the velocities and impulses at hand. The rest of the island stays as it is, to the
 * last bit, and costs next to nothing; what that leaves is for a sweep over all of it.
 *
 * With v the velocity at the end of the step, m that which moves positions, and both changed by the
 * same d: a gap ends as gap + h J (m + d), so that b_n = gap / h + J m - J v as v + d sees it. */
#include "world/world.h"

#include <math.h>
#include <string.h>

/* How many contacts lead from a fresh one to the farthest that is near it; and the passes. */
#define NEIGHBOURS 2
#define PASSES 8

/* The number left for a dynamic body, of contacts that lead on from it. */
static int8_t *left_for(perp_world *world, int32_t body)
{
    return world->bodies[body].kind == PERP_BODY_DYNAMIC
               ? &world->work.near[world->motions[body].local]
               : NULL;
}

/* Marks contacts that are not near a fresh one in work.hit. */
static void find_far(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;

    memset(work->near, 0, (size_t)island->bodies * sizeof *work->near);
    for (int32_t round = 0; round <= NEIGHBOURS; round++)
        for (int32_t i = 0; i < island->contacts; i++) {
            const perp__world_contact *contact = perp__step_contact(world, island, i);
            int8_t *a = left_for(world, contact->body_a), *b = left_for(world, contact->body_b);
            int8_t most = contact->fresh ? NEIGHBOURS + 1 : 0;

            most = a && *a > most ? *a : most;
            most = b && *b > most ? *b : most;
            if (a && *a < most)
                *a = (int8_t)(most - 1);
            if (b && *b < most)
                *b = (int8_t)(most - 1);
            work->hit[i] = most == 0;
        }
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
    for (int32_t i = 0; i < work->count; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, work->chosen[i]);
        double m[3], v[3];

        perp__relative_velocity(world, contact, PERP__TWIST_MOVING, m);
        perp__relative_velocity(world, contact, PERP__TWIST_AFTER, v);
        work->rows[i].bias[0] = fmax(contact->gap, 0.0) / h + m[0] - v[0];
        memcpy(work->warm + 3 * i, contact->impulse, sizeof contact->impulse);
    }
}

perp_status perp__sweep_near(perp_world *world, const perp__island *island, double h)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__substeps step;
    perp_status status;

    perp__gather_bodies(world, island);
    find_far(world, island);
    perp__choose_rows(world, island, work->hit);
    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    load(world, island, h);
    memset(&step, 0, sizeof step);
    step.h = h;
    step.passes = PASSES;
    step.start = work->free;
    step.pushed = 1;
    status = perp__coloured_step(&world->coloured, &answer, NULL, &problem, &step);
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < world->dof * island->bodies; i++) {
        work->moving[i] += work->v[i] - work->free[i];
        work->now[i] = work->v[i];
    }
    for (int32_t i = 0; i < work->count; i++) {
        perp__world_contact *contact = perp__step_contact(world, island, work->chosen[i]);

        memcpy(contact->impulse, work->impulse + 3 * i, sizeof contact->impulse);
        memcpy(contact->next, contact->impulse, sizeof contact->next);
        memcpy(contact->warm, contact->impulse, sizeof contact->warm);
    }
    perp__spend(world, PASSES);
    perp__write_twists(world, island);
    return PERP_OK;
}

/* Penetration is removed from the positions alone. For each island in which bodies overlap,
 *
 *   min 1/2 dq'M dq   subject to   gap + n'dq >= 0,
 *
 * a frictionless complementarity problem 0 <= c perp n'M^-1 n c + gap >= 0, dq = M^-1 n c. One pass
 * with the geometry frozen; where none exists (a body wedged between walls that overlap) the island
 * stays as it is. Contacts that rest with a gap of rounding are left alone, to the last bit. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/spatial.h"

/* Overlap, relative to the bodies' size, that is worth removing. */
#define OVERLAP_TOLERANCE 1e-12

static double overlap_of(const perp__world_contact *contact)
{
    double allowed = fmax(OVERLAP_TOLERANCE * contact->size, contact->rounding);

    return contact->gap < -allowed ? -contact->gap : 0.0;
}

static double deepest(const perp__contact_set *set)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < set->count; i++)
        largest = fmax(largest, overlap_of(&set->contacts[i]));
    return largest;
}

static perp__world_contact *island_contact(const perp_world *world, const perp__island *island,
                                           int32_t i)
{
    return &world->overlaps.contacts[world->contact_order[island->first_contact + i]];
}

static int32_t overlaps(const perp_world *world, const perp__island *island)
{
    int32_t i;

    for (i = 0; i < island->contacts; i++)
        if (overlap_of(island_contact(world, island, i)) > 0.0)
            return 1;
    return 0;
}

/* dq = M^-1 n c, applied body by body. */
static void apply(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->bodies; i++) {
        int32_t body = world->body_order[island->first_body + i];
        const perp__motion *motion = &world->motions[body];
        double shift[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

        for (j = 0; j < motion->touched; j++) {
            const perp__link *link = &world->links[motion->first_link + j];
            const perp__world_contact *contact = &world->overlaps.contacts[link->contact];

            perp__add6(shift, world->work.z[contact->first_row], contact->response[link->side][0]);
        }
        perp__add3(world->next[body].position, 1.0, shift);
        perp__turn(world, &world->next[body], shift + 3);
    }
}

static perp_status project_island(perp_world *world, const perp__island *island)
{
    perp_status status;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        perp__contact_jacobian(world, world->next, contact);
        world->work.q[contact->first_row] = contact->gap;
    }
    perp__assemble_matrix(world, &world->overlaps, island);
    status = perp__solve_rows(world, island->rows, 0);
    if (status == PERP_OK && (world->work.result.outcome == PERP_OUTCOME_SOLVED ||
                              world->work.result.outcome == PERP_OUTCOME_ROUNDING_LIMIT))
        apply(world, island);
    return status;
}

/* Works on the next states; the links and islands of the step are gone afterwards. */
perp_status perp__project_overlaps(perp_world *world)
{
    double depth;
    int32_t i;
    perp_status status;

    perp__place(world, world->next);
    status = perp__find_overlaps(world, 0.0);
    depth = status == PERP_OK ? deepest(&world->overlaps) : 0.0;
    if (depth == 0.0)
        return status;
    /* neighbours that the correction could push into each other */
    status = perp__find_overlaps(world, 2.0 * depth);
    for (i = 0; i < world->overlaps.count; i++)
        world->overlaps.contacts[i].edges = 0;
    if (status == PERP_OK)
        status = perp__build_islands(world, &world->overlaps);
    if (status == PERP_OK)
        status = perp__fit_island_work(world, 0);
    for (i = 0; status == PERP_OK && i < world->island_count; i++)
        if (overlaps(world, &world->islands[i]))
            status = project_island(world, &world->islands[i]);
    return status;
}

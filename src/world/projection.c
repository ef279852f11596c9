/* Penetration is removed from the positions alone. For each island in which bodies overlap,
 *
 *   min 1/2 dq'M dq   subject to   gap + n'dq >= 0,
 *
 * a frictionless complementarity problem 0 <= c perp n'M^-1 n c + gap >= 0, dq = M^-1 n c, in one
 * pass with the geometry frozen. That holds for ways of the size of the overlap only: where a light
 * body would rather slide far away than lift a heavy one off it, all bodies count as equally heavy
 * instead; and where no short way exists (a body wedged between walls that overlap) the island
 * stays as it is. Contacts that rest with a gap of rounding are left alone, to the last bit. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/spatial.h"

/* Overlap, relative to the bodies' size, that is worth removing. */
#define OVERLAP_TOLERANCE 1e-12

/* How far a point may be moved, in overlaps. */
#define LONGEST_WAY 8.0

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

static int32_t overlaps(const perp_world *world, const perp__island *island)
{
    int32_t i;

    for (i = 0; i < island->contacts; i++)
        if (overlap_of(perp__island_contact(world, &world->overlaps, island, i)) > 0.0)
            return 1;
    return 0;
}

/* dq = M^-1 n c of each body, kept in its motion. */
static void find_shifts(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memset(motion->solved, 0, sizeof motion->solved);
        for (j = 0; j < motion->touched; j++) {
            const perp__link *link = &world->links[motion->first_link + j];
            const perp__world_contact *contact = &world->overlaps.contacts[link->contact];

            perp__add6(motion->solved, world->work.z[contact->first_row],
                       contact->response[link->side][0]);
        }
    }
}

/* The largest way a point of a body goes. */
static double longest_way(const perp_world *world, const perp__island *island)
{
    double largest = 0.0;
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        int32_t body = world->body_order[island->first_body + i];
        const double *shift = world->motions[body].solved;

        perp__raise_to(&largest, perp__length3(shift) +
                                     perp__length3(shift + 3) * world->bodies[body].radius);
    }
    return largest;
}

static void apply(perp_world *world, const perp__island *island)
{
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        int32_t body = world->body_order[island->first_body + i];
        const double *shift = world->motions[body].solved;

        perp__add3(world->next[body].position, 1.0, shift);
        perp__turn(world, &world->next[body], shift + 3);
    }
}

/* Shifts from the problem's solution, or by sweeps where the budget leaves no more. Returns in
 * *found whether they are any good. */
static perp_status solve_shifts(perp_world *world, const perp__island *island, int32_t *found)
{
    perp_outcome said = perp__may_pivot(world, island->rows);
    perp_status status = PERP_OK;

    if (said == PERP_OUTCOME_SOLVED) {
        perp__assemble_matrix(world, &world->overlaps, island);
        world->work.set_up = 0;
        status = perp__solve_rows(world, island->rows);
        said = world->work.result.outcome;
        find_shifts(world, island);
    }
    if (said == PERP_OUTCOME_TIME_LIMIT || said == PERP_OUTCOME_ITERATION_LIMIT) {
        perp__start_sweeps(world, &world->overlaps, island, PERP__TWIST_SOLVED);
        perp__sweep_island(world, &world->overlaps, island, perp__seconds_left(world));
        said = PERP_OUTCOME_SOLVED;
    }
    *found = perp__is_good(said);
    return status;
}

/* Corrects the island if that takes no long way; *left tells if it was left as it is. */
static perp_status project_island(perp_world *world, const perp__island *island, double longest,
                                  int32_t *left)
{
    int32_t found, i;
    perp_status status;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = perp__island_contact(world, &world->overlaps, island, i);

        perp__contact_jacobian(world, contact);
        world->work.q[contact->first_row] = contact->gap;
        contact->target = 0.0 - contact->gap;
    }
    status = solve_shifts(world, island, &found);
    *left = status != PERP_OK || !found || !(longest_way(world, island) <= longest);
    if (!*left)
        apply(world, island);
    return status;
}

/* Mass 1 for every body, and the inertia of a sphere of its size. */
static void weigh_equally(perp_world *world)
{
    int32_t i, k;

    for (i = 0; i < world->body_slots; i++) {
        perp__motion *motion = &world->motions[i];
        double r = world->bodies[i].radius;

        if (!world->bodies[i].alive || world->bodies[i].kind != PERP_BODY_DYNAMIC)
            continue;
        motion->inverse_mass = 1.0;
        memset(motion->inverse_inertia, 0, sizeof motion->inverse_inertia);
        for (k = world->settings.planar ? 8 : 0; k < 9 && r > 0.0; k += 4)
            motion->inverse_inertia[k] = 2.5 / (r * r);
    }
}

/* One pass over the islands that overlap; returns in *left how many stay as they are. */
static perp_status project(perp_world *world, double longest, int32_t equally, int32_t *left)
{
    perp_status status;
    int32_t i, stays;

    *left = 0;
    perp__place(world, world->next);
    for (i = 0; i < world->body_slots; i++) /* static bodies have no way */
        memset(world->motions[i].solved, 0, sizeof world->motions[i].solved);
    if (equally)
        weigh_equally(world);
    /* neighbours that the correction could push into each other */
    status = perp__find_overlaps(world, 2.0 * longest);
    for (i = 0; i < world->overlaps.count; i++)
        world->overlaps.contacts[i].edges = 0;
    if (status == PERP_OK)
        status = perp__build_islands(world, &world->overlaps);
    if (status == PERP_OK)
        status = perp__fit_island_work(world, 0);
    for (i = 0; status == PERP_OK && i < world->island_count; i++) {
        if (!overlaps(world, &world->islands[i]))
            continue;
        status = project_island(world, &world->islands[i], longest, &stays);
        *left += stays;
    }
    return status;
}

/* Works on the next states; the links and islands of the step are gone afterwards. */
perp_status perp__project_overlaps(perp_world *world)
{
    double depth, longest;
    int32_t left;
    perp_status status;

    perp__place(world, world->next);
    status = perp__find_overlaps(world, 0.0);
    depth = status == PERP_OK ? deepest(&world->overlaps) : 0.0;
    if (depth == 0.0)
        return status;
    longest = LONGEST_WAY * depth;
    status = project(world, longest, 0, &left);
    if (status == PERP_OK && left > 0)
        status = project(world, longest, 1, &left);
    return status;
}

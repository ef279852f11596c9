/* The islands of a step: which contacts take part, and the path of each island through the step.
 *
 * Over an interval of length t from velocities v, with forces that would lead to v_f,
 *
 *   M (v+ - v_f) = J'r,   u = J v+,   0 <= r_n  perp  u_n + max(gap, 0) / t >= 0,   Coulomb's law
 *
 * (Stewart & Trinkle 1996, Anitescu & Potra 1997). An island without impacts is one such interval.
 * One with impacts is cut there (impacts.c). */
#include "world/joints/joints.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"
#include "world/islands/contact_rows.h"
#include "world/islands/lanes.h"
#include "world/islands/standing.h"

/* The share of an island's contacts that is little; that which is not worth another sweep of all;
 * unless bodies come so deep into others, beside their size; and how often an island is swept as a
 * whole. */
#define LITTLE 0.25
#define HARDLY_ANY 0.01
#define DEEP 1e-3
#define MOST_SWEEPS 3

/* Whether something closes if nothing acts: by the end of the step, or by its velocities then. */
static int32_t closes(perp_world *world, const perp__island *island, double h)
{
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        const double gap = perp__open_gap(contact, contact->gap);

        if (gap + h * fmin(contact->free, 0.5 * (contact->start + contact->free)) < 0.0)
            return 1;
    }
    return 0;
}

/* Nothing acts: velocities are those of the forces. */
static void leave_alone(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        for (int32_t k = 0; k < 6; k++)
            motion->moving[k] = 0.5 * (motion->start[k] + motion->free[k]);
        memcpy(motion->after, motion->free, sizeof motion->after);
    }
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        memset(response->impulse, 0, sizeof response->impulse);
        memset(response->next, 0, sizeof response->next);
        perp__relative_velocity(world, perp__step_contact(world, island, i), PERP__TWIST_FREE,
                                response->velocity);
        response->mode = PERP_CONTACT_SEPARATE;
    }
}

/* How many contacts, or joints, came to the island since it was solved. */
static int32_t count_fresh(const perp_world *world, const perp__island *island,
                           const perp__verdict *verdict)
{
    int32_t i, fresh = island->joints > 0 && !verdict->jointed;

    for (i = 0; i < island->contacts; i++)
        fresh += perp__step_tie(world, island, i)->fresh;
    return fresh;
}

static perp_status sweep_all(perp_world *world, const perp__island *island, double h,
                             perp__verdict *verdict)
{
    verdict->patched = 0;
    return perp__sweep_island(world, island, h, verdict);
}

/* Contacts came. Large islands are swept, near what came where that is little; they are finished
 * once nothing comes any more. */
static perp_status solve_island(perp_world *world, const perp__island *island, double h,
                                int32_t fresh, perp__verdict *verdict)
{
    const int32_t sweeps = verdict->sweeps, patched = verdict->patched;
    const int32_t known = verdict->jointed && verdict->impacts == 0, asked = verdict->asked;
    perp__carrying carrying;
    int32_t begins;

    memset(verdict, 0, sizeof *verdict);
    verdict->asked = asked;
    if (island->joints > 0) {
        perp__begin_joints(world, island, h, known);
        verdict->jointed = 1;
        return perp__follow_island(world, island, h, verdict);
    }
    if (perp__lies_still(world, island, verdict))
        return PERP_OK;
    begins = perp__begins_standing(world, island, &carrying);
    if (!begins && !closes(world, island, h)) {
        leave_alone(world, island);
        return PERP_OK;
    }
    if (perp__is_small(world, island))
        return perp__follow_island(world, island, h, verdict);
    verdict->sweeps = sweeps;
    if (begins || fresh > LITTLE * island->contacts)
        return sweep_all(world, island, h, verdict);
    verdict->sweeps += sweeps == 0;
    verdict->patched = patched + fresh;
    return perp__sweep_near(world, island, h);
}

/* Whether what came late is many contacts, or the motion takes bodies deep into others. */
static int32_t lacks_a_sweep(perp_world *world, const perp__island *island, double h,
                             const perp__verdict *verdict)
{
    if (verdict->patched == 0 || verdict->sweeps >= MOST_SWEEPS)
        return 0;
    if (verdict->patched > HARDLY_ANY * island->contacts)
        return 1;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        double u[3];

        perp__relative_velocity(world, contact, PERP__TWIST_MOVING, u);
        if (fmax(contact->gap, 0.0) + h * u[0] < -DEEP * contact->size)
            return 1;
    }
    return 0;
}

/* Nothing came. Where many contacts came late, near which alone it has been swept, it is swept as a
 * whole once more. */
static perp_status finish_island(perp_world *world, const perp__island *island, double h,
                                 perp__verdict *verdict)
{
    const int32_t asked = verdict->asked;

    if (lacks_a_sweep(world, island, h, verdict))
        return sweep_all(world, island, h, verdict);
    memset(verdict, 0, sizeof *verdict);
    verdict->asked = asked;
    if (perp__is_worth_exact(world, island))
        return perp__follow_island(world, island, h, verdict);
    return perp__finish_swept(world, island, h, verdict);
}

perp_status perp__solve_one(perp_world *world, const perp__island *island, double h,
                            int32_t finishes, int32_t *open)
{
    perp__verdict verdict = perp__island_motion(world, island, 0)->verdict;
    const int32_t fresh = finishes ? 0 : count_fresh(world, island, &verdict);
    const int32_t ends = finishes && verdict.sweeps > 0;
    perp_status status = PERP_OK;

    if (fresh > 0)
        status = solve_island(world, island, h, fresh, &verdict);
    else if (ends) {
        status = finish_island(world, island, h, &verdict);
        *open = 1;
    }
    world->budget.contacts -= island->contacts + island->joints;
    if (fresh == 0 && !ends)
        return PERP_OK;
    for (int32_t k = 0; k < island->contacts && !finishes; k++)
        perp__step_tie(world, island, k)->fresh = 0;
    for (int32_t k = 0; k < island->contacts && !verdict.stands; k++)
        memset(perp__step_response(world, island, k)->base, 0, 3 * sizeof(double));
    verdict.endless = 0;
    for (int32_t k = 0; k < island->contacts && (ends || verdict.sweeps == 0); k++)
        verdict.endless += !perp__is_finite_contact(
            &world->contacts, world->contact_order[island->first_contact + k]);
    for (int32_t k = 0; k < island->bodies; k++) {
        perp__island_motion(world, island, k)->verdict = verdict;
        world->roles[world->body_order[island->first_body + k]].swept = (int8_t)verdict.swept;
    }
    return status;
}

/* All of them, on the caller's thread. */
static perp_status solve_in_turn(perp_world *world, double h, int32_t *open, int32_t *last)
{
    perp_status status = PERP_OK;
    int32_t ended = 0;

    *last = -1;
    world->budget.contacts = 0;
    for (int32_t i = 0; i < world->island_count; i++)
        world->budget.contacts += world->islands[i].contacts + world->islands[i].joints;
    for (int32_t i = 0; i < world->island_count && !ended; i++) {
        status = perp__solve_one(world, &world->islands[i], h, open != NULL, open);
        ended =
            status != PERP_OK ||
            perp__island_motion(world, &world->islands[i], 0)->verdict.outcome == PERP_OUTCOME_RAY;
        *last = ended ? i : -1;
    }
    return status;
}

/* Solves the islands to which contacts came; or, none having come, finishes what is swept so far,
 * and tells in *open whether any was. Stops at a ray. */
static perp_status solve_islands(perp_world *world, double h, int32_t *open,
                                 perp__solve_summary *summary)
{
    int32_t last;
    const perp_status status = perp__shares_islands(world)
                                   ? perp__solve_in_lanes(world, h, open, &last)
                                   : solve_in_turn(world, h, open, &last);

    if (status == PERP_OK && last >= 0) {
        summary->outcome = PERP_OUTCOME_RAY;
        summary->residual = perp__island_motion(world, &world->islands[last], 0)->verdict.residual;
    }
    return status;
}

/* Islands of the contacts included so far. */
static perp_status solve_changed(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status = perp__build_islands(world, &world->contacts);

    PERP__THEN(status, perp__fit_island_work(world));
    return status == PERP_OK ? solve_islands(world, h, NULL, summary) : status;
}

/* The last word on each island. */
static void summarise(const perp_world *world, perp__solve_summary *summary)
{
    for (int32_t i = 0; i < world->island_count; i++) {
        const perp__verdict *verdict = &perp__island_motion(world, &world->islands[i], 0)->verdict;

        summary->outcome = perp__worse_outcome(summary->outcome, verdict->outcome);
        perp__raise_to(&summary->residual, verdict->residual);
        summary->solved += verdict->stages > 0;
        summary->impacts += verdict->impacts > 0;
        summary->rough += verdict->rough;
        summary->endless += verdict->endless;
    }
}

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status;
    int32_t came = 0, open = 1;

    memset(summary, 0, sizeof *summary);
    world->island_count = 0;
    status = world->joint_count > 0 ? solve_changed(world, h, summary) : PERP_OK;
    if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
        status = perp__join_contacts(world, h, &came);
    while (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY && (came > 0 || open)) {
        open = 0;
        if (came > 0)
            status = solve_changed(world, h, summary);
        else
            status = solve_islands(world, h, &open, summary);
        open = open || came > 0;
        if (status == PERP_OK && open)
            status = perp__join_contacts(world, h, &came);
    }
    if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
        summarise(world, summary);
    return status;
}

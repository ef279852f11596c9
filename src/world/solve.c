/* The complementarity problems of the islands.
 *
 * First stage, without restitution (Stewart & Trinkle 1995, Anitescu & Potra 1997), in the
 * impulses c, beta and the slip speed lambda of each contact:
 *
 *   0 <= c      perp  u_n - target    >= 0,    target = -max(gap, 0) / h
 *   0 <= beta   perp  D'u + e lambda  >= 0,    u = J v_f + J M^-1 J' r
 *   0 <= lambda perp  mu c - e'beta   >= 0
 *
 * Its velocities move the positions, so that a body that hits something ends the step touching it.
 *
 * Second stage, only after an impact: some contact presses, has restitution e > 0 and approached
 * faster than free forces alone explain, u_n- < -h |a_n| with h a_n = u_n(v_f) - u_n-. Slower
 * approaches are resting contact, which would else bounce at speeds of order g h for ever. The
 * same problem with Moreau's law: contacts that touch after the first stage have
 *
 *   target = -e u_n-,
 *
 * not clipped at 0 (with equal e a solution then always exists, 2 (1 + e) times the inelastic
 * change of velocity over 2); others have -max(e u_n-, gap'/h) with the gap' that the first stage
 * leaves. The velocities of this stage are those after the step. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "world/spatial.h"

/* A point whose own residual is above this is no start for sweeps: none at all is a better one. */
#define FAR_OFF 1e-3

static perp__world_contact *island_contact(const perp_world *world, const perp__island *island,
                                           int32_t i)
{
    return perp__island_contact(world, &world->contacts, island, i);
}

/* A gap that is not told apart from 0 is 0: rounding of coordinates must not move what rests. */
static double positive_gap(const perp__world_contact *contact, double gap)
{
    return gap > contact->rounding ? gap : 0.0;
}

static void write_q(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);
        double *q = world->work.q + contact->first_row;

        q[0] = contact->free[0] - contact->target;
        if (contact->edges == 0)
            continue;
        for (j = 0; j < contact->edges; j++)
            q[1 + j] = world->edge[j][0] * contact->free[1] + world->edge[j][1] * contact->free[2];
        q[1 + contact->edges] = 0.0;
    }
}

/* Impulses along the axes. Without a normal impulse there is no friction; what rounding took out of
 * the cone goes back. */
static void read_impulses(perp_world *world, const perp__island *island)
{
    int32_t i, j;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);
        const double *z = world->work.z + contact->first_row;
        double gauge, most = contact->friction * z[0];

        contact->impulse[0] = z[0];
        contact->impulse[1] = contact->impulse[2] = contact->slip = 0.0;
        if (z[0] == 0.0 || contact->edges == 0)
            continue;
        contact->slip = z[contact->edges + 1];
        for (j = 0; j < contact->edges; j++) {
            contact->impulse[1] += world->edge[j][0] * z[1 + j];
            contact->impulse[2] += world->edge[j][1] * z[1 + j];
        }
        gauge = perp__gauge(world, contact->impulse + 1);
        if (gauge > most)
            for (j = 1; j < 3; j++)
                contact->impulse[j] *= most / gauge;
    }
}

static int32_t moves_by_itself(const perp_world *world, int32_t body)
{
    const double *twist = world->motions[body].start;

    return world->bodies[body].kind == PERP_BODY_KINEMATIC &&
           !(perp__is_zero3(twist) && perp__is_zero3(twist + 3));
}

/* Whether theory promises a solution (docs/world.md): always in the first stage, for one
 * restitution in the second, unless something that nothing stops closes on a body. */
static int32_t is_solvable(const perp_world *world, const perp__island *island, int32_t stage)
{
    double restitution = -1.0;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = island_contact(world, island, i);

        if (moves_by_itself(world, contact->body_a) || moves_by_itself(world, contact->body_b))
            return 0;
        if (stage > 1 && restitution >= 0.0 && contact->restitution != restitution)
            return 0;
        restitution = contact->restitution;
    }
    return 1;
}

/* The island's problem, if the budget allows: *said is how that ended. A ray where there is a
 * solution is a failure of the method, not of the scene. */
static perp_status pivot(perp_world *world, const perp__island *island, int32_t stage,
                         perp_outcome *said)
{
    perp_status status;

    *said = perp__may_pivot(world, island->rows);
    world->work.fresh = 0;
    if (*said != PERP_OUTCOME_SOLVED)
        return PERP_OK;
    if (!world->work.set_up)
        perp__assemble_matrix(world, &world->contacts, island);
    write_q(world, island);
    status = perp__solve_rows(world, island->rows);
    *said = world->work.result.outcome;
    world->work.fresh = status == PERP_OK;
    if (*said == PERP_OUTCOME_RAY && is_solvable(world, island, stage))
        *said = PERP_OUTCOME_STALLED;
    return status;
}

/* Velocities and impulses as the problem's solution has them, and what they are worth. */
static perp__evidence take_solution(perp_world *world, const perp__island *island, size_t twist)
{
    const perp_lcp_result *result = &world->work.result;
    perp__evidence evidence = {result->residual, 0.0, result->backward_error, 1};

    read_impulses(world, island);
    perp__exact_velocities(world, island, twist, &evidence);
    return evidence;
}

/* Sweeps from the solution, or from nothing where that is `far` off. Which share of the time they
 * get is the island's of the contacts, half of it: later rounds may come. */
static perp__evidence take_sweeps(perp_world *world, const perp__island *island, size_t twist,
                                  int32_t far)
{
    const double share = 0.5 * island->contacts / world->contacts.count;
    perp__evidence evidence = {0.0, 0.0, INFINITY, 1};
    int32_t i;

    if (far)
        perp__start_sweeps(world, &world->contacts, island, PERP__TWIST_FREE);
    perp__sweep_island(world, &world->contacts, island, share * perp__seconds_left(world));
    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);
        const double most = contact->friction * contact->impulse[0];
        double u[3];

        perp__relative_velocity(world, contact, PERP__TWIST_SOLVED, u);
        contact->slip =
            perp__gauge(world, contact->impulse + 1) < most ? 0.0 : perp__slip(world, u + 1);
    }
    perp__exact_velocities(world, island, twist, &evidence);
    evidence.tested = evidence.own; /* no row of an island counts for more than a contact's own */
    return evidence;
}

/* Solves for the targets that stand, writes the twist, and judges it. What a method or a budget
 * leaves short of an answer is swept, and kept where that betters it. */
static perp_status solve_stage(perp_world *world, const perp__island *island,
                               perp__verdict *verdict)
{
    const size_t twist = verdict->stages > 0 ? PERP__TWIST_AFTER : PERP__TWIST_MOVING;
    const double tol = world->settings.tol;
    perp__evidence evidence = {INFINITY, INFINITY, INFINITY, 0}, swept;
    perp_outcome said, outcome;
    perp_status status = pivot(world, island, ++verdict->stages, &said);
    int32_t far;

    if (status != PERP_OK)
        return status;
    if (said == PERP_OUTCOME_RAY) {
        verdict->outcome = said;
        verdict->residual = world->work.result.residual;
        return PERP_OK;
    }
    if (world->work.fresh)
        evidence = take_solution(world, island, twist);
    outcome = perp__gate(&evidence, tol, said);
    far = !(evidence.own <= FAR_OFF);
    if (!perp__is_good(outcome)) {
        swept = take_sweeps(world, island, twist, far);
        if (far || swept.own < evidence.own)
            evidence = swept;
        else
            evidence = take_solution(world, island, twist);
        outcome = perp__gate(&evidence, tol, said);
    }
    verdict->outcome = perp__worse_outcome(verdict->outcome, outcome);
    perp__raise_to(&verdict->residual, evidence.tested);
    return PERP_OK;
}

/* First-stage targets; returns 0 if no contact would close by itself: nothing needs solving. */
static int32_t first_targets(perp_world *world, const perp__island *island, double h)
{
    int32_t closing = 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        contact->target = 0.0 - positive_gap(contact, contact->gap) / h; /* not -0.0 */
        closing = closing || contact->free[0] < contact->target;
    }
    return closing;
}

static int32_t is_impact(const perp__world_contact *contact)
{
    double forced = fabs(contact->free[0] - contact->start[0]); /* h |a_n| */

    return contact->restitution > 0.0 && contact->impulse[0] > 0.0 && contact->start[0] < -forced;
}

/* Second-stage targets where there was an impact; returns whether there was. */
static int32_t second_targets(perp_world *world, const perp__island *island, double h)
{
    int32_t impact = 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++)
        impact = impact || is_impact(island_contact(world, island, i));
    for (i = 0; i < island->contacts && impact; i++) {
        perp__world_contact *contact = island_contact(world, island, i);
        double bounce = contact->restitution * contact->start[0];
        double gap = contact->gap + h * contact->velocity[0];

        if (contact->closed || positive_gap(contact, gap) == 0.0)
            contact->target = 0.0 - bounce;
        else
            contact->target = 0.0 - fmax(bounce, gap / h);
    }
    return impact;
}

/* Sets the twists of an island's bodies to another of theirs. */
static void copy_twists(perp_world *world, const perp__island *island, size_t to, size_t from)
{
    int32_t i;

    for (i = 0; i < island->bodies; i++) {
        perp__motion *motion = &world->motions[world->body_order[island->first_body + i]];

        memcpy(perp__twist(motion, to), perp__twist(motion, from), sizeof motion->free);
    }
}

/* Both stages. */
static perp_status solve_island(perp_world *world, const perp__island *island, double h,
                                perp__verdict *verdict)
{
    perp_status status;

    copy_twists(world, island, PERP__TWIST_MOVING, PERP__TWIST_FREE);
    copy_twists(world, island, PERP__TWIST_AFTER, PERP__TWIST_FREE);
    if (!first_targets(world, island, h))
        return PERP_OK;
    world->work.set_up = 0;
    status = solve_stage(world, island, verdict);
    if (status != PERP_OK || verdict->outcome == PERP_OUTCOME_RAY)
        return status;
    if (second_targets(world, island, h))
        return solve_stage(world, island, verdict);
    copy_twists(world, island, PERP__TWIST_AFTER, PERP__TWIST_MOVING);
    return PERP_OK;
}

/* Whether contacts came to the island since it was solved; they count as old from now on. */
static int32_t has_changed(perp_world *world, const perp__island *island)
{
    int32_t changed = 0;
    int32_t i;

    for (i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = island_contact(world, island, i);

        changed = changed || contact->fresh;
        contact->fresh = 0;
    }
    return changed;
}

/* Islands of the contacts included so far; those that changed are solved. Stops at a ray. */
static perp_status solve_changed(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status = perp__build_islands(world, &world->contacts);
    int32_t i, k;

    if (status == PERP_OK)
        status = perp__fit_island_work(world, 1);
    for (i = 0; i < world->island_count && status == PERP_OK; i++) {
        const perp__island *island = &world->islands[i];
        perp__verdict verdict = {PERP_OUTCOME_SOLVED, 0, 0.0};

        if (!has_changed(world, island))
            continue;
        status = solve_island(world, island, h, &verdict);
        for (k = 0; k < island->bodies; k++)
            world->motions[world->body_order[island->first_body + k]].verdict = verdict;
        if (verdict.outcome == PERP_OUTCOME_RAY) {
            summary->outcome = PERP_OUTCOME_RAY;
            summary->residual = verdict.residual;
            break;
        }
    }
    return status;
}

/* The last word on each island. */
static void summarise(const perp_world *world, perp__solve_summary *summary)
{
    int32_t i;

    for (i = 0; i < world->island_count; i++) {
        const perp__verdict *verdict =
            &world->motions[world->body_order[world->islands[i].first_body]].verdict;

        summary->outcome = perp__worse_outcome(summary->outcome, verdict->outcome);
        perp__raise_to(&summary->residual, verdict->residual);
        summary->solved += verdict->stages > 0;
        summary->impacts += verdict->stages > 1;
    }
}

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary)
{
    perp_status status;
    int32_t came = 0;

    memset(summary, 0, sizeof *summary);
    world->island_count = 0;
    status = perp__join_contacts(world, h, &came);
    while (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY && came > 0) {
        status = solve_changed(world, h, summary);
        if (status == PERP_OK)
            status = perp__join_contacts(world, h, &came);
    }
    if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
        summarise(world, summary);
    return status;
}

/* The islands of a step, and the path of each through it:
 *
 *   1. points that touch, or that the motions at hand may close, and joints, make the islands;
 *   2. each is solved, once, by the way that suits it;
 *   3. what its motion makes meet joins in, and islands to which something came are solved anew, as
 *      often as the level looks; then only for what would go deep. What exact methods are to
 *      follow, at level `exact` all of it, is swept while something comes, and only then solved.
 *
 * Over an interval of length t from velocities v, with forces that would lead to v_f,
 *
 *   M (v+ - v_f) = J'r,   u = J v+,   0 <= r_n  perp  u_n + max(gap, 0) / t >= 0,   Coulomb's law
 *
 * (Stewart & Trinkle 1996, Anitescu & Potra 1997). An island without impacts is one such interval.
 * One with impacts is cut there (impacts.c). */
#include "world/joints/joints.h"

#include "world/islands/lanes.h"

bool perp__goes_freely(const perp_world *world, int32_t body)
{
    const perp__motion *motion = &world->step.motions[body];

    return memcmp(motion->after, motion->free, sizeof motion->after) == 0;
}

/* Whether something closes if nothing acts: by the end of the step, or its velocities, on arcs. */
static bool closes(perp_world *world, const perp__island *island, double h)
{
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        const double gap = perp__open_gap(contact, contact->gap);
        const double end = gap + h * fmin(contact->free, 0.5 * (contact->start + contact->free));

        if (end < 0.0 &&
            (!perp__goes_freely(world, contact->body_a) ||
             !perp__goes_freely(world, contact->body_b) ||
             perp__meets(world, world->islands.contact_order[island->first_contact + i], h, end)))
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

/* The exact solution; what time does not suffice for is swept, as what begins after it is. */
static perp_status follow(perp_world *world, const perp__island *island, double h, bool known,
                          const perp__verdict *before, perp__verdict *verdict)
{
    perp_status status;

    *verdict = *before;
    perp__begin_joints(world, island, h, known);
    status = perp__follow_island(world, island, h, verdict);
    if (status != PERP_OK || verdict->outcome != PERP_OUTCOME_TIME_LIMIT)
        return status;
    *verdict = *before;
    perp__begin_joints(world, island, h, 0);
    status = perp__sweep_island(world, island, h, verdict);
    verdict->outcome = perp__worse_outcome(verdict->outcome, PERP_OUTCOME_TIME_LIMIT);
    return status;
}

perp_status perp__keep_sweep(perp_world *world, const perp__island *island, double h,
                             const perp__verdict *before, perp__verdict *verdict)
{
    verdict->sketched =
        !verdict->stands &&
        (perp__is_sketch(world) || (perp__is_few(world, island, perp__level_of(world)->few) &&
                                    (!perp__is_good(verdict->outcome) || verdict->may_rest)));
    if (world->step.sketches || !verdict->sketched)
        return PERP_OK;
    return follow(world, island, h, 0, before, verdict);
}

/* The path of an island: what stands stays, and what nothing closes goes freely; few rows are
 * solved exactly, or where sweeps come to no answer, or nearly to rest; others are swept. */
static perp_status solve_island(perp_world *world, int32_t number, double h, perp__verdict *verdict,
                                int32_t *waits)
{
    const perp__island *island = &world->islands.all[number];
    perp__verdict before = {.asked = verdict->asked,
                            .in_vain = verdict->in_vain,
                            .jointed = island->joints > 0,
                            .coarse = verdict->coarse,
                            .turn = verdict->turn};
    const bool exact = perp__is_worth_exact(world, island);
    const bool known = exact && verdict->jointed && verdict->impacts == 0;
    const bool swept = verdict->sketched && !world->step.sketches; /* to no answer */
    perp_status status = PERP_OK;

    if (island->joints > 0 && !verdict->jointed)
        status = perp__find_spare_rows(world, island);
    if (status != PERP_OK)
        return status;
    *verdict = before;
    if (island->joints == 0) {
        status = perp__lie_still(world, island, !exact, verdict);
        if (status != PERP_OK || verdict->stands)
            return status;
        before.moves = verdict->moves;
        if (verdict->moves && !closes(world, island, h)) {
            leave_alone(world, island);
            return PERP_OK;
        }
    }
    if (!exact && !swept) {
        *waits = perp__joins_batch(world, island);
        if (*waits) {
            status = perp__wait_for_sweep(world, number, h, &before, verdict);
            *waits = status == PERP_OK && !verdict->stands;
            return status;
        }
        perp__begin_joints(world, island, h, 0);
        status = perp__sweep_island(world, island, h, verdict);
        return status == PERP_OK ? perp__keep_sweep(world, island, h, &before, verdict) : status;
    }
    return follow(world, island, h, known, &before, verdict);
}

/* Whether a body turns so far about a point that presses on it, its radius aside, that the point
 * goes elsewhere along the normal than its rate says, h^2/2 n.(w x (w x r)), by more than the half
 * widths of both shapes: then it can be beyond the other one. Joints have perp__is_rough(). */
static bool turns_far(const perp_world *world, int32_t i, double h)
{
    const perp__world_contact *contact = &world->contacts.now.contacts[i];
    const perp__shape *a = &world->shapes.all[contact->shape_a];
    const perp__shape *b = &world->shapes.all[contact->shape_b];
    bool far = 0;

    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        const double *w = world->step.motions[body].after + 3;
        double arm[3], rate[3], bend[3];

        if (!world->step.roles[body].dynamic || perp__is_zero3(w))
            continue;
        perp__copy3(arm, contact->arms[side]);
        perp__add3(arm, side == 0 ? -a->geometry.radius : b->geometry.radius, contact->axes[0]);
        perp__cross(rate, w, arm);
        perp__cross(bend, w, rate);
        far |= 0.5 * h * h * fabs(perp__dot3(contact->axes[0], bend)) > a->thickness + b->thickness;
    }
    return far;
}

void perp__conclude_one(perp_world *world, int32_t number, double h, perp__verdict *verdict,
                        perp_status status, int32_t *last)
{
    const perp__island *island = &world->islands.all[number];
    const bool no_projection = verdict->swept && !perp__has_put(world, island);

    if (verdict->stands && verdict->rides && verdict->impacts == 0)
        perp__ride(world, island, h);
    verdict->endless = 0;
    for (int32_t k = 0; k < island->contacts; k++) {
        const int32_t at = world->islands.contact_order[island->first_contact + k];

        world->contacts.now.flags[at].fresh = 0;
        if (island->joints == 0 && world->contacts.now.responses[at].impulse[0] > 0.0)
            verdict->rough |= turns_far(world, at, h);
        if (!verdict->stands && world->contacts.now.responses[at].mode != PERP_CONTACT_STICK)
            memset(world->contacts.now.responses[at].base, 0, 3 * sizeof(double));
        if (!verdict->stands || !world->contacts.now.flags[at].repeats) /* else it was looked at */
            verdict->endless += !perp__is_finite_contact(&world->contacts.now, at);
    }
    for (int32_t k = 0; k < island->bodies; k++) {
        const double *w = perp__island_motion(world, island, k)->moving + 3;
        perp__role *role = &world->step.roles[world->islands.body_order[island->first_body + k]];

        perp__island_motion(world, island, k)->verdict = *verdict;
        role->swept = (int8_t)no_projection;
        role->far |= island->joints > 0 &&
                     0.5 * h * h * perp__dot3(w, w) > fmax(perp__level_of(world)->deep, PERP__NEAR);
    }
    if (status != PERP_OK || verdict->outcome == PERP_OUTCOME_RAY)
        *last = number;
}

perp_status perp__solve_one(perp_world *world, int32_t number, double h, int32_t *last)
{
    perp__island *island = &world->islands.all[number];
    perp__verdict verdict = perp__island_motion(world, island, 0)->verdict;
    int32_t fresh = island->joints > 0 && !verdict.jointed; /* came since it was solved */
    const int64_t spent = world->step.budget.spent;
    int32_t waits = 0;
    perp_status status;

    island->spent = 0;
    for (int32_t i = 0; i < island->contacts; i++)
        fresh += perp__step_flags(world, island, i)->fresh;
    world->step.budget.contacts -= island->contacts + island->joints;
    if (fresh == 0 && (!verdict.sketched || world->step.sketches))
        return PERP_OK;
    verdict.sketched &= fresh == 0;
    for (int32_t k = 0; k < island->bodies; k++) {
        const perp__verdict *known = &perp__island_motion(world, island, k)->verdict;

        verdict.in_vain |= known->in_vain;
        verdict.coarse |= known->coarse;
        perp__raise_to(&verdict.turn, known->turn);
    }
    status = solve_island(world, number, h, &verdict, &waits);
    if (!waits)
        perp__conclude_one(world, number, h, &verdict, status, last);
    island->spent = world->step.budget.spent - spent;
    if (world->solve.batch && world->solve.batch->count == PERP__BATCH_ISLANDS)
        status = perp__sweep_batch(world, h, last);
    return status;
}

perp_status perp__end_solving(perp_world *world, double h, perp_status status, int32_t *last)
{
    int32_t ended = -1;
    const perp_status swept = world->solve.batch ? perp__sweep_batch(world, h, &ended) : PERP_OK;

    if (ended < 0 || (*last >= 0 && *last < ended))
        return status;
    *last = ended;
    return swept;
}

/* Solves the islands to which contacts came. Stops at a ray. */
static perp_status solve_changed(perp_world *world, double h, perp__solve_summary *summary)
{
    int32_t last = -1;
    perp_status status = perp__build_islands(world, &world->contacts.now, 0);

    PERP__THEN(status, perp__fit_island_work(world));
    if (world->solve.batch)
        PERP__THEN(status, perp__fit_batch(world));
    if (status != PERP_OK)
        return status;
    /* 1. Side by side, or all of them on the caller's thread. */
    if (world->lane_count > 0 && perp__shares_islands(world)) {
        status = perp__solve_in_lanes(world, h, &last);
    } else {
        world->step.budget.contacts = 0;
        for (int32_t i = 0; i < world->islands.count; i++)
            world->step.budget.contacts +=
                world->islands.all[i].contacts + world->islands.all[i].joints;
        for (int32_t i = 0; i < world->islands.count && last < 0; i++)
            status = perp__solve_one(world, i, h, &last);
        status = perp__end_solving(world, h, status, &last);
    }
    if (status != PERP_OK)
        return status;
    /* 2. The last word on each island. */
    memset(summary, 0, sizeof *summary);
    for (int32_t i = 0; i < world->islands.count; i++) {
        const perp__verdict *verdict =
            &perp__island_motion(world, &world->islands.all[i], 0)->verdict;

        summary->outcome = perp__worse_outcome(summary->outcome, verdict->outcome);
        perp__raise_to(&summary->residual, verdict->residual);
        summary->solved += verdict->stages > 0;
        summary->impacts += verdict->impacts > 0;
        summary->rough += verdict->rough;
        summary->endless += verdict->endless;
        summary->sketched += verdict->sketched;
    }
    if (last >= 0) {
        summary->outcome = PERP_OUTCOME_RAY;
        summary->residual =
            perp__island_motion(world, &world->islands.all[last], 0)->verdict.residual;
    }
    return status;
}

perp_status perp__solve_islands(perp_world *world, double h, perp__solve_summary *summary)
{
    const perp__level *level = &perp__levels[world->settings.accuracy];
    perp_status status = PERP_OK;
    int32_t came;

    memset(summary, 0, sizeof *summary);
    world->islands.count = 0;
    world->step.sketches = 1;
    for (int32_t i = 0; i < world->joints.slots; i++)
        world->joints.all[i].placed = 0;
    came = perp__include_points(world, h, 0.0);
    if (came > 0 || world->joints.count > 0)
        status = solve_changed(world, h, summary);
    do {
        came = 0;
        if (status == PERP_OK && summary->outcome != PERP_OUTCOME_RAY)
            status = perp__join_contacts(
                world, h, world->contacts.rounds < level->looks ? 0.0 : level->deep, &came);
        if (world->sleep.awake_changed) /* something came to what slept: the step begins anew */
            return status;
        if (came == 0 && world->step.sketches) { /* what was sketched is solved */
            world->step.sketches = 0;
            came = summary->sketched;
        }
        if (status == PERP_OK && came > 0)
            status = solve_changed(world, h, summary);
    } while (status == PERP_OK && came > 0 &&
             (world->step.sketches || !perp__takes_parts(world, summary)));
    world->step.sketches = 0;
    return status;
}

/* Penetration is removed from the positions alone. For each island in which bodies overlap,
 *
 *   min 1/2 dq'M dq   subject to   gap + n'dq >= 0,
 *
 * a frictionless complementarity problem 0 <= c perp n'M^-1 n c + gap >= 0, dq = M^-1 n c, in one
 * pass with the geometry frozen. That holds for ways of the size of the overlap only: where no
 * short way exists (a body wedged between walls that overlap) the island stays as it is. Contacts
 * that rest with a gap of rounding are left alone, to the last bit. */
#include <math.h>
#include <string.h>

#include "linalg/spatial.h"
#include "world/islands/lanes.h"
#include "world/joints/joints.h"

/* Iterations of a method for the ways: what is left of an overlap comes again. */
#define ITERATIONS 50

/* How far a point may be moved, in overlaps. */
#define LONGEST_WAY 8.0

/* Overlaps of the next states; of what is swept, deeper ones than the level lets a motion make. */
static void find_overlaps(perp_world *world, perp__share *share, double h)
{
    const double deep = fmax(perp__level_of(world)->deep, PERP__IN_PLACE);
    perp__point points[PERP__MAX_POINTS];

    (void)h;
    for (int32_t i = share->first; i < share->end; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);
        const int32_t *body = pair->body;
        double least;
        int32_t made = 0;

        pair->overlap = 0.0;
        if (perp__is_swept(world, pair) || !perp__are_near(world, pair, 0.0))
            continue;
        least = world->step.roles[body[0]].swept || world->step.roles[body[1]].swept
                    ? deep
                    : PERP__IN_PLACE;
        least = -fmax(least * perp__pair_size(world, pair), perp__pair_rounding(world, pair));
        made = perp__collide(&world->step.placed[pair->first], &world->step.placed[pair->second],
                             world->settings.planar, least, points);
        for (int32_t k = 0; k < made; k++)
            if (points[k].gap < least)
                perp__raise_to(&pair->overlap, -points[k].gap);
    }
}

/* The deepest of each body, with what joints lack; and of all. Fat boxes hold them already, but for
 * what turns freely. */
static double deepest(perp_world *world)
{
    const double lack = world->joints.count > 0 ? perp__joint_errors(world) : 0.0;
    perp__share all = {0};
    double most = 0.0;

    (void)perp__share_out(world, world->pairs.count, find_overlaps, 0.0, &all);
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];

        world->step.motions[body].overlap = world->step.roles[body].jointed ? lack : 0.0;
    }
    for (int32_t i = 0; i < world->pairs.count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);

        perp__raise_to(&most, pair->overlap);
        for (int32_t side = 0; side < 2; side++)
            if (perp__is_dynamic(world, pair->body[side]))
                perp__raise_to(&world->step.motions[pair->body[side]].overlap, pair->overlap);
    }
    for (int32_t i = 0; i < world->islands.count; i++) { /* what is pushed pushes on */
        const perp__island *island = &world->islands.all[i];
        double way = perp__is_few(world, island, PERP__FEW_CONTACTS) ? 0.0 : INFINITY;

        for (int32_t k = 0; k < island->bodies && way < INFINITY; k++)
            perp__raise_to(&way, perp__island_motion(world, island, k)->overlap);
        for (int32_t k = 0; k < island->bodies && way < INFINITY; k++)
            perp__island_motion(world, island, k)->overlap = way;
    }
    return most + lack;
}

/* How far a step may take what overlaps: as far as what is not deep goes, a share of the overlap,
 * or as far as the shapes went in the step, where nothing but that can have made it. */
static double reach_of(const perp_world *world, const perp__world_contact *contact)
{
    const double deep = perp__deep_overlap(contact);
    perp__moving a, b;
    const bool put =
        world->step.roles[contact->body_a].put || world->step.roles[contact->body_b].put;

    perp__moving_shape(world, contact->shape_a, world->step.length, &a);
    perp__moving_shape(world, contact->shape_b, world->step.length, &b);
    return fmax(fmax(deep, perp__cleared(-contact->gap, 0.5 * deep)),
                put ? 0.0 : perp__relative_displacement(&a, &b));
}

/* The largest way of a mass centre, or of a point of contact with its body: what is thin may turn
 * far about its length without going anywhere. */
static double longest_displacement(const perp_world *world, const perp__island *island)
{
    double largest = 0.0, way[3];

    for (int32_t i = 0; i < island->bodies; i++)
        perp__raise_to(&largest, perp__length3(perp__island_motion(world, island, i)->shift));
    for (int32_t i = 0; i < 2 * island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i / 2);
        const int32_t body = i % 2 == 0 ? contact->body_a : contact->body_b;
        const double *shift = world->step.motions[body].shift;

        if (!perp__is_dynamic(world, body))
            continue;
        perp__cross(way, shift + 3, contact->arms[i % 2]);
        perp__add3(way, 1.0, shift);
        perp__raise_to(&largest, perp__length3(way));
    }
    return largest;
}

/* Makes the shifts. What turns goes on to do so as its own frame sees it, with the energy that it
 * had: a velocity that stayed as it is would gain some, step by step, of a capsule that spins while
 * it rolls. Joints have made theirs for the axes that are. */
static void apply(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const double *shift = world->step.motions[body].shift;
        perp__state *state = &world->step.next[body];
        double before[9], after[9], local[3];

        perp__rotation_of(world, state, before);
        perp__add3(state->position, 1.0, shift);
        perp__turn(world, state, 1.0, shift + 3);
        if (island->joints > 0 || world->settings.planar || perp__is_zero3(shift + 3) ||
            perp__is_zero3(state->angular_velocity))
            continue;
        perp__rotation_of(world, state, after);
        perp__apply_transposed3(local, before, state->angular_velocity);
        perp__apply3(state->angular_velocity, after, local);
    }
}

/* Shifts are shorter where a point would go farther than `most`, or leave its tangent by more than
 * half of what opens; or for more energy than the step left, rounding aside, and what turned into
 * the overlap has; the rest comes out as more is lost. Linear gaps open by the same share. */
static void shorten(const perp_world *world, const perp__island *island, double opening,
                    double most)
{
    double left = 0.0, needed = 0.0, rounding = 0.0, frame[3];
    double share = fmin(1.0, most / longest_displacement(world, island));

    (void)perp__find_frame(world, island, frame);
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const double *shift = world->step.motions[body].shift,
                     turned = perp__dot3(shift + 3, shift + 3);

        share = fmin(share, opening / (turned * world->bodies.all[body].radius));
        left += world->step.motions[body].unspent;
        if (world->step.roles[body].far)
            left += perp__kinetic_of(world, body, &world->step.next[body], frame);
        (void)perp__energy_lost(world, body, frame, &rounding);
        needed += perp__work_needed(world, body, shift);
    }
    if (share * needed > left + rounding && !perp__has_put(world, island))
        share = left / needed;
    for (int32_t i = 0; i < island->bodies; i++)
        for (int32_t k = 0; k < 6; k++)
            perp__island_motion(world, island, i)->shift[k] *= share;
}

void perp__write_normal(const perp_world *world, const perp__world_contact *contact, double gap,
                        perp__rigid_rows *rows)
{
    const int32_t body[2] = {contact->body_a, contact->body_b};
    double row[2][6];

    perp__contact_row(contact, 0, 0, row[0]);
    perp__contact_row(contact, 1, 0, row[1]);
    perp__write_row(world, body, (const double(*)[6])row, gap, 1.0, rows);
}

/* Rows of the island's overlaps, and of limits that its points may come to; bodies at rest. */
static void pose(perp_world *world, const perp__island *island, double most)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    work->carriers = 0;
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];

        perp__write_factor(world, body, world->step.motions[body].rotation,
                           work->factors + n * n * i);
    }
    memset(work->free, 0, (size_t)(n * island->bodies) * sizeof *work->free);
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__world_contact *contact = perp__step_contact(world, island, i);

        perp__write_normal(world, contact, fmax(contact->gap, -reach_of(world, contact)),
                           &work->rows[i]);
    }
    work->count = island->contacts;
    perp__add_joint_errors(world, island, 2.0 * most);
}

/* Shifts of the island's bodies; *found: whether they are any good. */
static perp_status solve_shifts(perp_world *world, const perp__island *island, int32_t *found)
{
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step = {.h = 1.0, .passes = world->solve.work.inequalities > 0 ? PERP__PASSES : 1};
    const bool swept = island->joints > 0 && world->settings.accuracy < PERP_ACCURACY_ACCURATE;
    perp_status status;

    world->solve.work.set_up = 0;
    perp__pose_island(world, island, &problem);
    perp__receive(world, &answer);
    problem.warm = NULL;
    problem.cone = 0;
    problem.method = island->contacts > 2 * PERP__FEW_CONTACTS ? PERP_CONTACT_METHOD_SWEEP
                                                               : PERP_CONTACT_METHOD_AUTO;
    if (problem.max_iterations == 0 || problem.max_iterations > ITERATIONS)
        problem.max_iterations = ITERATIONS;
    problem.holds = 1;
    answer.outcome = PERP_OUTCOME_ITERATION_LIMIT; /* of passes: what they leave comes again */
    status = swept ? perp__coloured_step(&world->solve.coloured, &answer, NULL, &problem, &step)
                   : perp__rigid_solve(world->solve.solver, &answer, &problem);
    if (status != PERP_OK)
        return status;
    perp__spend(world, answer.iterations);
    *found = answer.outcome != PERP_OUTCOME_RAY && answer.outcome <= PERP_OUTCOME_STALLED;
    for (int32_t i = 0; i < island->bodies; i++)
        perp__twist_of(world, world->solve.work.v + world->dof * i,
                       perp__island_motion(world, island, i)->shift);
    return PERP_OK;
}

/* Corrects the island. Of what nothing holds the mass centre stays, so that no way is too long;
 * else none is longer than what opens makes of a chain of so many. */
static perp_status project_island(perp_world *world, const perp__island *island, double longest,
                                  double most)
{
    double rounding;
    const double gained = perp__energy_gained(world, island, &rounding);
    perp__carrying carrying;
    perp_status status;
    int32_t found = 0;

    (void)perp__find_carrying(world, island, 0, &carrying);
    pose(world, island, most);
    status = solve_shifts(world, island, &found);
    if (status != PERP_OK)
        return status;
    if (found && (carrying.body < 0 || longest_displacement(world, island) <=
                                           (LONGEST_WAY + island->bodies) * longest)) {
        shorten(world, island, longest, most);
        apply(world, island);
    }
    return perp__close_joints(world, island, gained);
}

/* Works on the next states; the links and islands of the step are gone afterwards. */
perp_status perp__project_overlaps(perp_world *world, int32_t *changed)
{
    double depth = 0.0;
    perp_status status = perp__end_islands(world, changed);

    PERP__THEN(status,
               perp__enclose(world, world->step.moving, world->step.moving_count, 0.0, 0.0));
    if (status == PERP_OK && !world->sleep.awake_changed)
        depth = deepest(world);
    if (status != PERP_OK || depth == 0.0)
        return status;
    *changed = 1;
    perp__stop_all_coasting(world);
    perp__place(world, world->step.next);
    /* neighbours that the correction could push into each other */
    status = perp__find_overlaps(world, LONGEST_WAY);
    if (world->sleep.awake_changed) /* some of what is not on the list: the step begins anew */
        return status;
    PERP__THEN(status, perp__build_islands(world, &world->contacts.overlaps, 0));
    PERP__THEN(status, perp__fit_island_work(world));
    for (int32_t i = 0; i < world->islands.count && status == PERP_OK; i++) {
        const perp__island *island = &world->islands.all[i];
        const double lack = perp__island_errors(world, island);
        double opening = 0.0, most = 0.0; /* of its overlaps; how far a point may go */

        for (int32_t k = 0; k < island->contacts; k++) {
            const perp__world_contact *contact = perp__step_contact(world, island, k);

            if (contact->gap < -contact->rounding) {
                perp__raise_to(&most, reach_of(world, contact));
                perp__raise_to(&opening, fmin(-contact->gap, reach_of(world, contact)));
            }
        }
        if (lack + opening > 0.0)
            status = project_island(world, island, lack + opening, lack + most);
    }
    return status;
}

void perp__find_put(perp_world *world)
{
    const perp__contact_set *set = &world->contacts.now;

    for (int32_t i = 0; i < 2 * set->count; i++) {
        const perp__world_contact *contact = &set->contacts[i / 2];
        const int32_t *body = set->flags[i / 2].body;
        const int64_t put = world->bodies.states[body[i % 2]].put;

        if (perp__is_dynamic(world, body[i % 2]) &&
            ((((put | world->bodies.states[body[1 - i % 2]].put) & PERP__PUT) &&
              perp__is_deep(contact)) ||
             ((put & PERP__PUT_INTO) && contact->gap < -0.5 * perp__deep_overlap(contact))))
            world->step.roles[body[i % 2]].put = PERP__PUT_INTO;
    }
}

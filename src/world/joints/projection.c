/* What joints lack in the next positions. It is taken out of them island by island, by Newton's
 * method in the metric of M, before the projection (projection.c), which knows the joints' rows as
 * well, and of what its ways leave after it. Errors of rounding are left alone, to the last bit.
 *
 * Velocities of what only swings are those of its path then (swing.c), and become those nearest to
 * them that joints have where it ends. That loses energy, of fourth order a step, which they get
 * back: their size stays, if they obeyed the joints where the step began.
 *
 * At last bodies that impulses and joints join have no more energy than before the step and forces
 * gave them. What contacts gave is taken where it came from (energy.c); where ways that close
 * joints were up a potential or a path had not settled, all velocities get smaller, in one ratio:
 * those that obey joints do so still. What is free to fly keeps its momentum. */
#include <math.h>
#include <string.h>

#include "world/joints/joints.h"

static double tolerance_of(const perp__joint_view *view, double most, bool is_length)
{
    return is_length ? fmax(most * view->size, view->rounding) : most;
}

/* What joint i lacks in the next states, of equations and limits. A sum of lengths, in which what
 * is rounding does not count. */
static double error_of(const perp_world *world, perp__joint *joint)
{
    const perp__joint_state *state = perp__state_of(world, joint);
    const bool turns = joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW;
    const bool swept =
        world->step.roles[joint->body[0]].swept || world->step.roles[joint->body[1]].swept;
    const double allowed = swept ? PERP__NEGLIGIBLE : PERP__IN_PLACE;
    perp__joint_view *view = &joint->end;
    double sum = 0.0, excess;

    perp__view_of_states(world, joint, world->step.next, state->coordinate, 1, view);
    joint->allowed = tolerance_of(view, allowed, 1);
    for (int32_t k = 0; k < view->count; k++) {
        const bool is_length = perp__is_length(world, joint, k);

        if (fabs(view->error[k]) > tolerance_of(view, allowed, is_length))
            sum += fabs(view->error[k]) * (is_length ? 1.0 : view->size);
    }
    excess = fmax(fmax(state->lower - view->coordinate, view->coordinate - state->upper), 0.0);
    if (excess > tolerance_of(view, PERP__IN_PLACE, !turns))
        sum += excess * (turns ? view->size : 1.0);
    return joint->lack = sum;
}

double perp__island_errors(const perp_world *world, const perp__island *island)
{
    double sum = 0.0;

    for (int32_t i = 0; i < island->joints; i++)
        sum += error_of(world, perp__island_joint(world, island, i));
    return sum;
}

double perp__joint_errors(const perp_world *world)
{
    double sum = 0.0;

    for (int32_t i = 0; i < world->joints.slots; i++)
        if (perp__joint_works(world, i))
            sum += world->joints.all[i].lack;
    return sum;
}

void perp__write_row(const perp_world *world, const int32_t body[2], const double row[2][6],
                     double error, double sign, perp__rigid_rows *rows)
{
    memset(rows, 0, sizeof *rows);
    rows->dim = 1;
    rows->bias[0] = sign * error;
    for (int32_t side = 0; side < 2; side++) {
        rows->body[side] = perp__is_dynamic(world, body[side]) ? world->step.roles[body[side]].local
                                                               : PERP__RIGID_AT_REST;
        perp__coordinates_of(world, row[side], rows->rows[side][0]);
        for (int32_t j = 0; j < world->dof; j++)
            rows->rows[side][0][j] *= sign;
    }
}

/* What velocities in some states make of a row; of bodies that move as they are `told` alone. */
static double rate_of(const perp_world *world, const perp__joint *joint, const perp__state *states,
                      const perp__joint_view *view, int32_t row, bool told)
{
    double rate = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        const perp__state *state = &states[joint->body[side]];

        if (!told || !perp__is_dynamic(world, joint->body[side]))
            rate += perp__dot3(view->rows[row][side], state->velocity) +
                    perp__dot3(view->rows[row][side] + 3, state->angular_velocity);
    }
    return rate;
}

/* Whether a joint has equation k in the next states, the lock being the last. */
static bool has_row(const perp_world *world, const perp__joint *joint, int32_t k,
                    perp__row_kind which)
{
    return (k < joint->end.count ||
            (k == PERP__SLOT_LOCK && perp__is_locked(perp__state_of(world, joint)) &&
             perp__has_direction(&joint->end))) &&
           !(which == PERP__ROWS_NOT_SPARE && joint->spare[k]);
}

/* Rows of the island's joints in the next states: limits within `reach`; or equations, equal limits
 * being one, with their errors, alone or with all limits that they were beyond since these were
 * opened, or with what bodies that move as they are told make of them. */
static void add_rows(perp_world *world, const perp__island *island, perp__row_kind which,
                     double reach)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < island->joints; i++) {
        const perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);
        const perp__joint_view *view = &joint->end;
        const double beyond[2] = {state->lower - view->coordinate, view->coordinate - state->upper};
        double length = 1.0; /* what a unit of its coordinate moves */

        for (int32_t k = 0; k <= PERP__JOINT_ROWS && which != PERP__ROWS_OF_LIMITS; k++)
            if (has_row(world, joint, k, which))
                perp__write_row(world, joint->body, view->rows[k],
                                which >= PERP__ROWS_OF_RATES
                                    ? rate_of(world, joint, world->step.next, view, k, 1)
                                    : (k == PERP__SLOT_LOCK ? -beyond[0] : view->error[k]),
                                1.0, &work->rows[work->units++]);
        if (joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW)
            length = view->size;
        for (int32_t k = 0; k < 2 && !perp__is_locked(state) && perp__has_direction(view); k++)
            if (which == PERP__ROWS_OF_LIMITS ? length * -beyond[k] < reach
                                              : which == PERP__ROWS_OF_CLOSING && joint->closing[k])
                perp__write_row(world, joint->body, view->rows[PERP__JOINT_ROWS],
                                k == 0 ? -beyond[0] : beyond[1], k == 0 ? 1.0 : -1.0,
                                &work->rows[work->units++]);
    }
}

void perp__add_joint_errors(perp_world *world, const perp__island *island, double reach)
{
    perp__island_work *work = &world->solve.work;

    work->units = work->count;
    add_rows(world, island, PERP__ROWS_OF_LIMITS, reach);
    work->inequalities = work->units;
    add_rows(world, island, PERP__ROWS_OF_ERRORS, 0.0);
}

void perp__pose_positions(perp_world *world, const perp__island *island, perp__row_kind which,
                          int32_t equally)
{
    perp__island_work *work = &world->solve.work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const double r = world->bodies.all[body].radius;
        double R[9], *C = work->factors + n * n * i;

        work->members[i] = body;
        perp__rotation_of(world, &world->step.next[body], R);
        perp__write_factor(world, body, R, C);
        /* mass 1, and the inertia of a sphere of the body's size; its own, over its mass, of a body
         * without shapes */
        for (int32_t k = 0; equally && k < n * n; k++)
            C[k] *= r > 0.0 ? 0.0 : sqrt(world->bodies.all[body].mass);
        for (int32_t k = 0; equally && r > 0.0 && k < n; k++)
            C[(n + 1) * k] = k < (n == 6 ? 3 : 2) ? 1.0 : sqrt(2.5) / r;
    }
    memset(work->free, 0, (size_t)(n * island->bodies) * sizeof *work->free);
    memset(work->now, 0, (size_t)(n * island->bodies) * sizeof *work->now);
    work->units = work->carriers = 0;
    work->set_up = 0;
    for (int32_t i = 0; i < island->contacts && which == PERP__ROWS_OF_CLOSING; i++)
        if (work->hit[i])
            perp__write_normal(world, perp__step_contact(world, island, i),
                               fmax(work->gap[i], 0.0) + work->came[i], &work->rows[work->units++]);
    work->count = work->inequalities = work->units;
    add_rows(world, island, which, 0.0);
}

/* ---- velocities ---- */

/* Whether joints have the velocities of the bodies: what else there is of them is no more than that
 * share of the terms; where the step ends of speeds beside the joint's size, too, whose rounding
 * turns have. */
static bool are_on_joints(const perp_world *world, const perp__island *island,
                          const perp__state *states, double most)
{
    for (int32_t i = 0; i < island->joints; i++) {
        const perp__joint *joint = perp__island_joint(world, island, i);
        const double size = states == world->step.next ? joint->end.size : 0.0;
        perp__joint_view begin;
        const perp__joint_view *view = &joint->end;

        if (states != world->step.next) {
            perp__view_of_states(world, joint, states, 0.0, 1, &begin);
            view = &begin;
        }
        for (int32_t k = 0; k < PERP__SLOT_LOWER; k++) {
            double terms = 0.0;

            if (!has_row(world, joint, k, PERP__ROWS_OF_RATES))
                continue;
            for (int32_t side = 0; side < 2; side++) {
                const perp__state *state = &states[joint->body[side]];
                const double *row = view->rows[k][side];
                const double speed = perp__length3(state->velocity);

                terms += perp__length3(row) * speed +
                         perp__length3(row + 3) * (perp__length3(state->angular_velocity) +
                                                   (size > 0.0 ? speed / size : 0.0));
            }
            if (fabs(rate_of(world, joint, states, view, k, 0)) > most * terms)
                return 0;
        }
    }
    return 1;
}

/* ---- energy ---- */

/* The most that motors can do in a step. One of the speed 0 takes energy, as friction does. */
static double work_of_motors(const perp_world *world, const perp__island *island)
{
    double sum = 0.0;

    for (int32_t i = 0; i < island->joints; i++) {
        const perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);
        perp__joint_view begin, end;

        if (joint->impulse[PERP__SLOT_MOTOR] == 0.0 || state->speed == 0.0)
            continue;
        if (state->force == INFINITY)
            return INFINITY;
        perp__view_of_states(world, joint, world->bodies.states, 0.0, 0, &begin);
        perp__view_of_states(world, joint, world->step.next, 0.0, 0, &end);
        sum += world->step.length * state->force *
               fmax(fabs(rate_of(world, joint, world->bodies.states, &begin, PERP__JOINT_ROWS, 0)),
                    fabs(rate_of(world, joint, world->step.next, &end, PERP__JOINT_ROWS, 0)));
    }
    return sum;
}

/* The velocity of the mass centre along which nothing pushes from outside of the island: all of it
 * of what flies freely, that along planes, or where they meet, of what is on these without
 * friction; that of the frame across them. */
static void velocity_to_keep(const perp_world *world, const perp__island *island, double *kept)
{
    double mass = 0.0, momentum[3] = {0.0}, across[3][3];
    int32_t held = 0;

    for (int32_t k = 0; k < 2 * island->joints; k++)
        if (!perp__is_dynamic(world, perp__island_joint(world, island, k / 2)->body[k % 2]))
            held = 3;
    for (int32_t i = 0; i < island->contacts && held < 3; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (perp__is_dynamic(world, contact->body_a) && perp__is_dynamic(world, contact->body_b))
            continue;
        perp__copy3(across[held], contact->axes[0]);
        for (int32_t k = 0; k < held; k++)
            perp__add3(across[held], -perp__dot3(across[held], across[k]), across[k]);
        held =
            contact->friction > 0.0 ? 3 : held + (perp__normalise3(across[held]) > PERP__PARALLEL);
    }
    (void)perp__find_frame(world, island, kept);
    for (int32_t i = 0; i < island->bodies && held < 3; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];

        mass += world->bodies.all[body].mass;
        perp__add3(momentum, world->bodies.all[body].mass, world->step.next[body].velocity);
        perp__add3(momentum, -world->bodies.all[body].mass, kept);
    }
    for (int32_t k = 0; k < held && held < 3; k++)
        perp__add3(momentum, -perp__dot3(momentum, across[k]), across[k]);
    if (held < 3)
        perp__add3(kept, 1.0 / mass, momentum);
}

/* Takes so much of it, all where it is beyond the range of doubles. */
static void take_energy(perp_world *world, const perp__island *island, double excess)
{
    double kept[3], kinetic, share;

    velocity_to_keep(world, island, kept);
    kinetic = perp__kinetic_beside(world, island, kept);
    share = isfinite(excess / kinetic) ? sqrt(fmax(1.0 - excess / kinetic, 0.0)) : excess < 0.0;
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__state *state = &world->step.next[world->islands.body_order[island->first_body + i]];

        for (int32_t k = 0; k < 3; k++) {
            state->velocity[k] = kept[k] + share * (state->velocity[k] - kept[k]);
            state->angular_velocity[k] *= share;
        }
    }
}

double perp__energy_given(const perp_world *world, const perp__island *island)
{
    double rounding, given = perp__energy_gained(world, island, &rounding);

    if (island->joints > 0)
        given -= work_of_motors(world, island);
    return given > 0.0 ? fmax(given - rounding, 0.0) : given;
}

/* More than all that moves came from the way, as far as velocities were solved: then bodies stay
 * where they were, or the frame takes them, and what is too much is what their velocities gained.
 * Returns if they stay. */
static bool keep_energy(perp_world *world, const perp__island *island, double given)
{
    double kept[3], frame[3];
    bool stays;

    (void)perp__find_frame(world, island, frame);
    velocity_to_keep(world, island, kept);
    stays = given >= perp__kinetic_beside(world, island, kept);
    for (int32_t i = 0; i < island->bodies && stays; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        const perp__state now = world->step.next[body];
        world->step.next[body] = world->bodies.states[body];
        perp__add3(world->step.next[body].position, world->step.length, frame);
        perp__copy3(world->step.next[body].velocity, now.velocity);
        perp__copy3(world->step.next[body].angular_velocity, now.angular_velocity);
    }
    take_energy(world, island, stays ? fmax(perp__energy_given(world, island), 0.0) : given);
    return stays;
}

/* work.v := the velocities next to those in the next states that meet such rows there. */
static perp_status meet_ends(perp_world *world, const perp__island *island, perp__row_kind which)
{
    perp__island_work *work = &world->solve.work;
    double twist[6];

    perp__pose_positions(world, island, which, 0);
    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__state *state = &world->step.next[work->members[i]];

        perp__copy3(twist, state->velocity);
        perp__copy3(twist + 3, state->angular_velocity);
        perp__coordinates_of(world, twist, work->free + world->dof * i);
    }
    return perp__solve_equations(world, island, PERP__REFINED, NULL);
}

/* The nearest velocities that joints have, of what only swings. The impulses by which they become
 * so are told along rows that no others say: along what repeats these they are mere rounding. */
static perp_status end_swing(perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->solve.work;
    const double *r = work->impulse;
    double kept[3], twist[6], before, after;
    int32_t repeats = 0;
    perp_status status;

    velocity_to_keep(world, island, kept);
    before = perp__kinetic_beside(world, island, kept);
    if (before == 0.0 || are_on_joints(world, island, world->step.next, PERP__SUM_ROUNDING))
        return PERP_OK;
    status = meet_ends(world, island, PERP__ROWS_NOT_SPARE);
    for (int32_t k = 0; k < island->joints * (PERP__JOINT_ROWS + 1) && status == PERP_OK; k++) {
        perp__joint *joint = perp__island_joint(world, island, k / (PERP__JOINT_ROWS + 1));
        const int32_t slot = k % (PERP__JOINT_ROWS + 1);

        repeats |= joint->spare[slot];
        if (has_row(world, joint, slot, PERP__ROWS_NOT_SPARE)) {
            perp__tell_impulse(joint, &joint->end, slot, *r);
            joint->impulse[slot] += *r;
            r += 3;
        }
    }
    if (repeats)
        PERP__THEN(status, meet_ends(world, island, PERP__ROWS_OF_RATES));
    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__state *state = &world->step.next[work->members[i]];

        perp__twist_of(world, work->v + world->dof * i, twist);
        perp__copy3(state->velocity, twist);
        perp__copy3(state->angular_velocity, twist + 3);
    }
    after = perp__kinetic_beside(world, island, kept);
    if (after < before && after > 0.0 &&
        are_on_joints(world, island, world->bodies.states, sqrt(perp__exact_tol(world))))
        take_energy(world, island, after - before);
    return PERP_OK;
}

static void place_again(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++)
        perp__place_body(world, world->step.next, world->islands.body_order[island->first_body + i],
                         1);
}

perp_status perp__end_islands(perp_world *world, int32_t *changed)
{
    perp_status status = PERP_OK;

    *changed = 0;
    world->step.scaled = 0.0;
    /* 1. What joints lack. */
    for (int32_t i = 0; i < world->islands.count && status == PERP_OK; i++) {
        const perp__island *island = &world->islands.all[i];
        int32_t closed = 0;

        if (island->joints == 0)
            continue;
        status = perp__close_island(world, island, world->step.length, &closed);
        if (perp__island_motion(world, island, 0)->verdict.swings)
            PERP__THEN(status, end_swing(world, island));
        if (closed)
            place_again(world, island);
        *changed |= closed;
    }
    /* 2. Energy, of bodies that impulses join. */
    PERP__THEN(status, perp__build_islands(world, &world->contacts.now, 1));
    for (int32_t i = 0; i < world->islands.count && status == PERP_OK; i++) {
        const perp__island *island = &world->islands.all[i];
        double given = perp__energy_given(world, island);

        for (int32_t k = 0; k < island->bodies; k++)
            perp__island_motion(world, island, k)->unspent = fmax(-given, 0.0) / island->bodies;
        if (!(given > 0.0))
            continue;
        *changed = 1;
        given = perp__take_given(world, island, given);
        if (given > 0.0 && keep_energy(world, island, given))
            (void)perp__island_errors(world, island);
        place_again(world, island);
    }
    return status;
}

perp_status perp__close_joints(perp_world *world, const perp__island *island, double gained)
{
    double rounding;
    int32_t changed = 0;
    const perp_status status = perp__close_island(world, island, 0.0, &changed);

    for (int32_t i = 0; i < island->bodies; i++)
        gained += perp__island_motion(world, island, i)->unspent;
    gained = perp__energy_gained(world, island, &rounding) - gained - rounding;
    if (gained > 0.0 && !perp__has_put(world, island)) /* NaN: seen by several */
        take_energy(world, island,
                    island->joints > 0 ? gained : perp__take_turns(world, island, gained, 1));
    return status;
}

/* Where joints are in a step, round after round.
 *
 * Over a step of length h from poses q0 to q1, bodies in an island with joints obey
 *
 *   M(q1) v1 - M(q0) v0 = h f + J(q_m)' r,     J(q1) v1 = 0,     q1 = q0 + h (v0 + v1) / 2
 *
 * with q_m half-way: impulses act where the bodies are in the middle of the step, and velocities
 * obey the joints at its end. That is second order. Momentum is kept to rounding, angular momentum
 * but for what the projection moves bodies by, which is third order a step. The contact layer has
 * one J for both, so that the problem is posed as
 *
 *   v1 = M(q1)^-1 (M(q0) v0 + h f + J_m' r),     J_m v1 + (J_1 - J_m) v1* = 0
 *
 * with v1* and the poses of the round before, to begin with those of v1 = v0. Two rounds are second
 * order; what is at rest has nothing to repeat. Where that does not settle (more than a radian) the
 * step is rough, and is taken in parts (adaptive.c); where these cannot be J(q0) serves for all,
 * which is first order and gives no energy. Between impacts the same holds of each interval. */
#include "world/joints/joints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* Rounds, by accuracy; and change of the motion, in radians and sizes, that ends them. */
static const int32_t most_rounds[] = {2, 2, 4, 24};
#define SETTLED 1e-14
#define EXTRA_ROUNDS 3 /* for limits that are reached on the way */

/* Beside the motion, in the kinetic metric, by how much the last round may have changed it. */
#define ROUGH 0.0625

/* Beside the largest rates that a row may have, what it lacks at the end of an interval for turning
 * in half of that, a quarter of a pendulum's angle: too much; and too little to matter. */
#define FAR 0.25
#define LITTLE 0.03125

/* Beside the terms of a rate, what counts as none. */
#define STILL 1e-9

/* At a time t after the interval at hand began. */
static void pose_along(const perp_world *world, int32_t body, double t, perp__placement *pose)
{
    const perp__motion *motion = &world->motions[body];
    const int32_t moves = perp__is_dynamic(world, body);
    perp__state state = world->states[body];
    double displacement[6] = {0.0};

    if (moves)
        perp__twist_of(world, world->work.drift + world->dof * world->roles[body].local,
                       displacement);
    for (int32_t k = 0; k < 6; k++)
        displacement[k] += (moves ? t : world->work.gone + t) * motion->trial[k];
    perp__add3(state.position, 1.0, displacement);
    perp__turn(world, &state, displacement + 3);
    perp__copy3(pose->position, state.position);
    if (perp__is_zero3(displacement + 3))
        memcpy(pose->rotation, motion->rotation, sizeof pose->rotation);
    else
        perp__rotation_of(world, &state, pose->rotation);
}

static void twist_now(const perp_world *world, int32_t body, double *twist)
{
    const perp__motion *motion = &world->motions[body];

    if (perp__is_dynamic(world, body))
        perp__twist_of(world, world->work.now + world->dof * world->roles[body].local, twist);
    else
        memcpy(twist, motion->start, sizeof motion->start);
}

/* M of the end of an interval of length t, and the velocity that forces alone would give then, as
 * what they add in a step: I1 w = I0 w0 + t torque. */
static void turn_mass(perp_world *world, int32_t body, double t)
{
    const perp__body *of = &world->bodies[body];
    const int32_t n = world->dof, i = world->roles[body].local;
    perp__island_work *work = &world->work;
    double now[6], gain[6], w[3], momentum[3], turned[3];
    perp__placement start, end;

    if (of->spherical)
        return;
    pose_along(world, body, 0.0, &start);
    pose_along(world, body, t, &end);
    perp__write_factor(world, body, end.rotation, work->factors + n * n * i);
    if (t == 0.0)
        return;
    twist_now(world, body, now);
    perp__twist_of(world, work->gain + n * i, gain);
    perp__apply_transposed3(w, start.rotation, now + 3);
    perp__apply3(turned, of->inertia, w);
    perp__apply3(momentum, start.rotation, turned);
    perp__add3(momentum, t, world->states[body].torque);
    perp__apply_transposed3(turned, end.rotation, momentum);
    perp__apply3(w, of->inverse_inertia, turned);
    perp__apply3(turned, end.rotation, w);
    for (int32_t k = 0; k < 3; k++)
        gain[3 + k] = work->length / t * (turned[k] - now[3 + k]);
    perp__coordinates_of(world, gain, work->gain + n * i);
}

/* What the change of J from the middle to the end makes of the trial motion's last velocity. */
static void find_turning(const perp_world *world, perp__joint *joint, const perp__joint_view *end)
{
    for (int32_t i = 0; i <= PERP__JOINT_ROWS; i++) {
        joint->turning[i] = 0.0;
        for (int32_t side = 0; side < 2 && (i < joint->middle.count || i == PERP__JOINT_ROWS);
             side++)
            for (int32_t k = 0; k < 6; k++)
                joint->turning[i] += (end->rows[i][side][k] - joint->middle.rows[i][side][k]) *
                                     world->motions[joint->body[side]].last[k];
    }
}

static void view_on_way(const perp_world *world, const perp__joint *joint, double t,
                        perp__joint_view *view)
{
    perp__placement poses[2];

    for (int32_t side = 0; side < 2; side++)
        pose_along(world, joint->body[side], t, &poses[side]);
    perp__view_joint(world, joint, perp__state_of(world, joint)->coordinate, poses, view);
}

void perp__place_joints(perp_world *world, const perp__island *island, double t)
{
    perp__joint_view end;

    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++)
        turn_mass(world, world->body_order[island->first_body + i], t);
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);

        view_on_way(world, joint, 0.5 * t, &joint->middle);
        view_on_way(world, joint, t, &end);
        find_turning(world, joint, &end);
    }
}

/* What row i may make of the velocities of both bodies, at most. */
static double most_of_row(const perp_world *world, const perp__joint *joint, int32_t i)
{
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        const double *row = joint->middle.rows[i][side];
        const double *last = world->motions[joint->body[side]].last;
        const double spin = perp__length3(last + 3);

        sum += perp__length3(row) *
                   (perp__length3(last) + world->bodies[joint->body[side]].radius * spin) +
               perp__length3(row + 3) * spin;
    }
    return sum;
}

/* The largest that a row lacks at the end of the interval, beside that. */
static double turn_of(const perp_world *world, const perp__island *island)
{
    double largest = 0.0;

    for (int32_t k = 0; k < island->joints; k++) {
        const perp__joint *joint = perp__island_joint(world, island, k);

        for (int32_t i = 0; i < joint->middle.count; i++)
            if (joint->turning[i] != 0.0)
                perp__raise_to(&largest, fabs(joint->turning[i]) / most_of_row(world, joint, i));
    }
    return largest;
}

/* ---- the rounds of an interval ---- */

/* Whether the coordinate goes towards a limit, but for rounding. */
static int32_t approaches(const perp_world *world, const perp__joint *joint, double row[2][6],
                          double sign)
{
    double rate = 0.0, terms = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        double now[6];

        twist_now(world, joint->body[side], now);
        for (int32_t k = 0; k < 6; k++) {
            const double term = row[side][k] * now[k];

            rate += sign * term;
            terms += fabs(term);
        }
    }
    return rate < -STILL * terms;
}

/* Beyond the lower limit, or below the upper one. */
static double gap_of(const perp__joint_state *state, const perp__joint_view *view, int32_t which)
{
    return which == 0 ? view->coordinate - state->lower : state->upper - view->coordinate;
}

void perp__aim_joints(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        twist_now(world, world->work.members[i], motion->trial);
        memcpy(motion->last, motion->trial, sizeof motion->last);
    }
}

void perp__begin_joints(perp_world *world, const perp__island *island, double h, int32_t known)
{
    world->work.length = h;
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memcpy(motion->trial, known ? motion->moving : motion->start, sizeof motion->trial);
        memcpy(motion->last, known ? motion->after : motion->start, sizeof motion->last);
    }
}

void perp__find_limits(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        perp__joint_view view;

        view_on_way(world, joint, 0.0, &view);
        for (int32_t which = 0; which < 2; which++) {
            const double gap = gap_of(perp__state_of(world, joint), &view, which);
            const double rounding =
                joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW
                    ? 64.0 * DBL_EPSILON
                    : view.rounding;

            joint->gap[which] = gap > rounding ? gap : 0.0;
            joint->came[which] =
                approaches(world, joint, view.rows[PERP__JOINT_ROWS], which == 0 ? 1.0 : -1.0);
            joint->reached[which] = gap <= rounding;
        }
    }
}

/* Limits that the motion goes beyond take part from now on. */
static int32_t reach_limits(perp_world *world, const perp__island *island, double t)
{
    perp__joint_view end;
    int32_t i, which, came = 0;

    for (i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);

        view_on_way(world, joint, t, &end);
        for (which = 0; which < 2; which++)
            if (gap_of(perp__state_of(world, joint), &end, which) < 0.0 && !joint->reached[which]) {
                joint->reached[which] = 1;
                came++;
            }
    }
    return came;
}

/* Takes the motion that was found for the next trial; returns by how much it differs, and *beside:
 * in the kinetic metric, beside itself and what the interval began with. */
static double update_trial(perp_world *world, const perp__island *island, double t, double *beside)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;
    double largest = 0.0, moves = 0.0, differs = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);
        const double size = world->bodies[work->members[i]].radius;
        double moving[6], change[6], numbers[6];

        perp__twist_of(world, work->moving + n * i, moving);
        for (int32_t k = 0; k < 6; k++) {
            const double displacement = t * fabs(moving[k] - motion->trial[k]);

            change[k] = moving[k] - motion->trial[k];
            perp__raise_to(&largest, k >= 3       ? displacement
                                     : size > 0.0 ? displacement / size
                                                  : displacement);
        }
        perp__coordinates_of(world, change, numbers);
        differs = hypot(differs, perp__mass_norm(world, work->members[i], numbers));
        moves = hypot(moves, fmax(perp__mass_norm(world, work->members[i], work->now + n * i),
                                  perp__mass_norm(world, work->members[i], work->moving + n * i)));
        memcpy(motion->trial, moving, sizeof moving);
        perp__twist_of(world, work->v + n * i, motion->last);
    }
    *beside = differs / moves;
    return largest;
}

static void stop_trial(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memset(motion->trial, 0, sizeof motion->trial);
    }
}

int32_t perp__goes_round(perp_world *world, const perp__island *island, double t,
                         perp__rounds *rounds)
{
    const double before = rounds->change;
    double beside;
    int32_t ends;

    if (rounds->coarse)
        return 0;
    rounds->turn = turn_of(world, island);
    rounds->change = update_trial(world, island, t, &beside);
    if (reach_limits(world, island, t) > 0 && rounds->extra++ < EXTRA_ROUNDS) {
        rounds->done = 0;
        rounds->change = INFINITY;
        return 1;
    }
    ends = ++rounds->done >= most_rounds[world->settings.accuracy];
    if (rounds->change > sqrt(SETTLED))
        rounds->coarse = ends ? rounds->turn > LITTLE && !(beside <= ROUGH)
                              : rounds->done > 2 && !(rounds->change < before);
    if (rounds->coarse)
        stop_trial(world, island);
    return rounds->coarse || (!ends && rounds->change > SETTLED);
}

int32_t perp__is_rough(const perp__rounds *rounds, int32_t works)
{
    return rounds->turn > FAR || (rounds->turn > LITTLE && (rounds->coarse || works));
}

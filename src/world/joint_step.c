/* Joints in a step.
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
 * which is first order and gives no energy. Between impacts the same holds of each interval.
 *
 * Motor and friction are rows with two bounds, as contact has them (contact/bounded.h). */
#include "world/joints.h"

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

/* Beside the terms of a velocity, what rounding makes of one that is 0; and what counts as none. */
#define ROUNDING (64.0 * DBL_EPSILON)
#define STILL 1e-9

static perp__joint *island_joint(const perp_world *world, const perp__island *island, int32_t i)
{
    return &world->joints[world->joint_order[island->first_joint + i]];
}

static perp__joint_state *state_of(const perp_world *world, const perp__joint *joint)
{
    return &world->joint_states[joint - world->joints];
}

/* ---- where the trial motion leads ---- */

/* At a time t after the interval at hand began. */
static void pose_on_way(const perp_world *world, int32_t body, double t, perp__placement *pose)
{
    const perp__motion *motion = &world->motions[body];
    const int32_t moves = perp__is_dynamic(world, body);
    perp__state state = world->states[body];
    double way[6] = {0.0};

    if (moves)
        perp__twist_of(world, world->work.drift + world->dof * motion->local, way);
    for (int32_t k = 0; k < 6; k++)
        way[k] += (moves ? t : world->work.gone + t) * motion->trial[k];
    perp__add3(state.position, 1.0, way);
    perp__turn(world, &state, way + 3);
    perp__copy3(pose->position, state.position);
    if (perp__is_zero3(way + 3))
        memcpy(pose->rotation, motion->rotation, sizeof pose->rotation);
    else
        perp__rotation_of(world, &state, pose->rotation);
}

static void twist_now(const perp_world *world, int32_t body, double *twist)
{
    const perp__motion *motion = &world->motions[body];

    if (perp__is_dynamic(world, body))
        perp__twist_of(world, world->work.now + world->dof * motion->local, twist);
    else
        memcpy(twist, motion->start, sizeof motion->start);
}

/* M of the end of an interval of length t, and the velocity that forces alone would give then, as
 * what they add in a step: I1 w = I0 w0 + t torque. */
static void turn_mass(perp_world *world, int32_t body, double t)
{
    const perp__body *of = &world->bodies[body];
    const int32_t n = world->dof, i = world->motions[body].local;
    perp__island_work *work = &world->work;
    double now[6], gain[6], w[3], momentum[3], turned[3];
    perp__placement start, end;

    if (of->spherical)
        return;
    pose_on_way(world, body, 0.0, &start);
    pose_on_way(world, body, t, &end);
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
        pose_on_way(world, joint->body[side], t, &poses[side]);
    perp__view_joint(world, joint, state_of(world, joint)->coordinate, poses, view);
}

void perp__place_joints(perp_world *world, const perp__island *island, double t)
{
    perp__joint_view end;

    for (int32_t i = 0; i < island->bodies && island->joints > 0; i++)
        turn_mass(world, world->body_order[island->first_body + i], t);
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = island_joint(world, island, i);

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
        const perp__joint *joint = island_joint(world, island, k);

        for (int32_t i = 0; i < joint->middle.count; i++)
            if (joint->turning[i] != 0.0)
                perp__raise_to(&largest, fabs(joint->turning[i]) / most_of_row(world, joint, i));
    }
    return largest;
}

/* ---- rows ---- */

void perp__number_joint_bodies(perp_world *world, const perp__island *island, int32_t afresh)
{
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = island_joint(world, island, i);

        for (int32_t side = 0; side < 2; side++)
            if (afresh)
                perp__forget_number(world, joint->body[side]);
            else
                perp__number_of(world, island, joint->body[side]);
        joint->used = 0;
        memset(joint->impulse, 0, sizeof joint->impulse);
        memset(joint->next_warm, 0, sizeof joint->next_warm);
    }
}

static perp__rigid_rows *next_unit(perp_world *world, const perp__joint *joint, int32_t slot,
                                   int32_t dim)
{
    perp__island_work *work = &world->work;
    perp__joint_unit *unit = &work->joint_units[work->units - work->count];
    perp__rigid_rows *rows = &work->rows[work->units];
    const double *warm = state_of(world, joint)->warm + slot;

    memset(rows, 0, sizeof *rows);
    unit->joint = (int32_t)(joint - world->joints);
    unit->slot = slot;
    unit->dim = rows->dim = dim;
    for (int32_t i = 0; i < 3; i++)
        work->warm[3 * work->units + i] = i < dim ? warm[i] : 0.0;
    work->units++;
    return rows;
}

/* Row `from` of the joint, half-way, into row k of a unit, `sign` times. */
static void fill_row(perp_world *world, const perp__island *island, const perp__joint *joint,
                     int32_t from, double sign, perp__rigid_rows *rows, int32_t k)
{
    for (int32_t side = 0; side < 2; side++) {
        rows->body[side] = perp__number_of(world, island, joint->body[side]);
        perp__coordinates_of(world, joint->middle.rows[from][side], rows->rows[side][k]);
        for (int32_t j = 0; j < world->dof; j++)
            rows->rows[side][k][j] *= sign;
    }
}

/* A distance of 0 has no direction. */
int32_t perp__has_direction(const perp__joint_view *view)
{
    const double(*row)[6] = view->rows[PERP__JOINT_ROWS];

    return !(perp__is_zero3(row[1]) && perp__is_zero3(row[1] + 3));
}

static void add_limit(perp_world *world, const perp__island *island, perp__joint *joint,
                      int32_t which)
{
    perp__rigid_rows *rows = next_unit(world, joint, PERP__SLOT_LOWER + which, 1);
    const double sign = which == 0 ? 1.0 : -1.0;

    fill_row(world, island, joint, PERP__JOINT_ROWS, sign, rows, 0);
    rows->bias[0] = sign * joint->turning[PERP__JOINT_ROWS];
}

/* Row k of a unit: what a unit impulse along it moves. */
static double response(const perp_world *world, const perp__joint *joint)
{
    double sum = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        double row[6], norm;

        if (!perp__is_dynamic(world, joint->body[side]))
            continue;
        perp__coordinates_of(world, joint->middle.rows[PERP__JOINT_ROWS][side], row);
        norm = perp__row_norm(world, joint->body[side], row);
        sum += norm * norm;
    }
    return sum;
}

/* Dry friction with the bound `most`, beside a speed. */
static void add_bounded(perp_world *world, const perp__island *island, perp__joint *joint,
                        int32_t slot, double speed, double most)
{
    const int32_t k = most < INFINITY ? 1 : 0;
    perp__rigid_rows *rows = next_unit(world, joint, slot, 1 + k);
    double *warm = world->work.warm + 3 * (world->work.units - 1);
    int exponent;

    fill_row(world, island, joint, PERP__JOINT_ROWS, 1.0, rows, k);
    rows->bias[k] = joint->turning[PERP__JOINT_ROWS] - speed;
    if (k == 0)
        return;
    rows->mu = 1.0;
    rows->bounded = 1;
    (void)frexp(response(world, joint), &exponent);
    rows->compliance[0] = ldexp(1.0, exponent);
    warm[1] = warm[0];
    warm[0] = most * world->work.length;
}

/* Units that are contacts to the contact layer, then those that are equations. */
static void add_inequalities(perp_world *world, const perp__island *island, perp__joint *joint)
{
    const perp__joint_state *state = state_of(world, joint);

    if (!perp__has_direction(&joint->middle))
        return;
    for (int32_t which = 0; which < 2; which++)
        if (joint->reached[which])
            add_limit(world, island, joint, which);
    if (state->force > 0.0 && state->force < INFINITY)
        add_bounded(world, island, joint, PERP__SLOT_MOTOR, state->speed, state->force);
    if (state->friction > 0.0 && state->friction < INFINITY)
        add_bounded(world, island, joint, PERP__SLOT_FRICTION, 0.0, state->friction);
}

static int32_t is_locked(const perp__joint_state *state)
{
    return state->lower == state->upper;
}

static void add_equations(perp_world *world, const perp__island *island, perp__joint *joint)
{
    const perp__joint_state *state = state_of(world, joint);
    const int32_t count = joint->middle.count;

    for (int32_t slot = 0; slot < count; slot += 3) {
        const int32_t dim = count - slot < 3 ? count - slot : 3;
        perp__rigid_rows *rows = next_unit(world, joint, slot, dim);

        for (int32_t k = 0; k < dim; k++) {
            fill_row(world, island, joint, slot + k, 1.0, rows, k);
            rows->bias[k] = joint->turning[slot + k];
        }
    }
    if (!perp__has_direction(&joint->middle))
        return;
    if (is_locked(state)) {
        perp__rigid_rows *rows = next_unit(world, joint, PERP__SLOT_LOCK, 1);

        fill_row(world, island, joint, PERP__JOINT_ROWS, 1.0, rows, 0);
        rows->bias[0] = joint->turning[PERP__JOINT_ROWS];
        return; /* what holds needs no motor, and takes no friction */
    }
    if (state->force == INFINITY)
        add_bounded(world, island, joint, PERP__SLOT_MOTOR, state->speed, INFINITY);
    else if (state->friction == INFINITY)
        add_bounded(world, island, joint, PERP__SLOT_FRICTION, 0.0, INFINITY);
}

static void count_rows(perp_world *world)
{
    const perp__island_work *work = &world->work;

    for (int32_t i = 0; i < work->units - work->count; i++)
        world->joints[work->joint_units[i].joint].used = 0;
    for (int32_t i = 0; i < work->units - work->count; i++) {
        const perp__joint_unit *unit = &work->joint_units[i];

        world->joints[unit->joint].used += unit->slot < PERP__SLOT_LOCK ? unit->dim : 1;
    }
}

void perp__add_joint_rows(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;

    work->units = work->count;
    for (int32_t i = 0; i < island->joints; i++)
        if (!is_locked(state_of(world, island_joint(world, island, i))))
            add_inequalities(world, island, island_joint(world, island, i));
    work->inequalities = work->units;
    for (int32_t i = 0; i < island->joints; i++)
        add_equations(world, island, island_joint(world, island, i));
    count_rows(world);
}

/* The force or moment that bounds a unit of a motor or of dry friction. */
static double bound_of(const perp_world *world, const perp__joint_unit *unit)
{
    const perp__joint_state *state = &world->joint_states[unit->joint];

    return unit->slot == PERP__SLOT_MOTOR ? state->force : state->friction;
}

void perp__time_joints(perp_world *world, double t)
{
    perp__island_work *work = &world->work;

    for (int32_t i = work->count; i < work->inequalities; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        const double *gap = world->joints[unit->joint].gap;

        if (unit->slot >= PERP__SLOT_MOTOR)
            work->rows[i].bias[0] = -work->rows[i].compliance[0] * (t * bound_of(world, unit));
        else if (gap[unit->slot - PERP__SLOT_LOWER] > 0.0)
            work->rows[i].bias[0] = gap[unit->slot - PERP__SLOT_LOWER] / t;
    }
}

/* ---- what came out ---- */

static double within(double x, double most)
{
    return fmin(fmax(x, -most), most);
}

/* A bound is just that, of the whole step too, whatever a method made of the row that stands for
 * it: beside impulses that are larger by 1e10 that row is solved to tol of those. */
void perp__add_joint_impulses(perp_world *world, const double *impulse, double share)
{
    const perp__island_work *work = &world->work;

    for (int32_t i = work->count; i < work->units; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        perp__joint *joint = &world->joints[unit->joint];
        const int32_t is_bounded = i < work->inequalities && unit->slot >= PERP__SLOT_MOTOR;
        const double *r = impulse + 3 * (i - work->count) + is_bounded;
        const double most = is_bounded ? work->length * bound_of(world, unit) : INFINITY;

        for (int32_t k = 0; k < unit->dim - is_bounded; k++) {
            double *sum = &joint->impulse[unit->slot + k];

            *sum = within(*sum + share * r[k], most);
            joint->next_warm[unit->slot + k] = within(r[k], most);
        }
    }
}

int32_t perp__limits_last(const perp_world *world)
{
    const perp__island_work *work = &world->work;

    for (int32_t i = work->count; i < work->inequalities; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        const perp__joint *joint = &world->joints[unit->joint];

        if (unit->slot < PERP__SLOT_MOTOR && work->impulse[3 * i] > 0.0 &&
            !(joint->gap[unit->slot - PERP__SLOT_LOWER] <= 0.0 &&
              joint->came[unit->slot - PERP__SLOT_LOWER] == 0))
            return 0;
    }
    return 1;
}

/* The largest velocity of a body beside its terms. */
static double remaining_motion(const perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    double largest = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const double speed = perp__mass_norm(world, work->members[i], work->v + world->dof * i);

        if (speed > 0.0)
            perp__raise_to(&largest, speed / work->strength[i]);
    }
    return largest;
}

/* The equations once more, for what is left of the velocities: a step of refinement. */
static perp_status refine(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                          const perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem rest = *problem;
    perp_status status;

    rest.free = work->solved;
    rest.warm = NULL;
    rest.again = 1;
    rest.method = PERP_CONTACT_METHOD_PROXIMAL;
    memcpy(work->solved, work->v, (size_t)(world->dof * island->bodies) * sizeof *work->v);
    memcpy(work->warm, work->impulse, 3 * (size_t)work->units * sizeof *work->warm);
    status = perp__rigid_solve(world->solver, answer, &rest);
    for (int32_t i = 0; status == PERP_OK && i < 3 * work->units; i++)
        work->impulse[i] += work->warm[i];
    return status;
}

/* A velocity that rounding does not tell apart from 0 is 0, where that is so of all the island:
 * what hangs at rest is pinned by nothing along its way. */
perp_status perp__rest_joints(perp_world *world, const perp__island *island,
                              const perp__rigid_answer *answer, const perp__rigid_problem *problem)
{
    perp__island_work *work = &world->work;
    perp__rigid_answer refined = *answer;
    double left;
    perp_status status = PERP_OK;

    if (island->joints == 0 || work->carriers > 0)
        return PERP_OK;
    left = remaining_motion(world, island);
    if (left > ROUNDING && left <= STILL && work->inequalities == 0) {
        status = refine(world, island, &refined, problem);
        left = remaining_motion(world, island);
    }
    if (status == PERP_OK && left <= ROUNDING)
        memset(work->v, 0, (size_t)(world->dof * island->bodies) * sizeof *work->v);
    return status;
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
        perp__joint *joint = island_joint(world, island, i);
        perp__joint_view view;

        view_on_way(world, joint, 0.0, &view);
        for (int32_t which = 0; which < 2; which++) {
            const double gap = gap_of(state_of(world, joint), &view, which);
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
        perp__joint *joint = island_joint(world, island, i);

        view_on_way(world, joint, t, &end);
        for (which = 0; which < 2; which++)
            if (gap_of(state_of(world, joint), &end, which) < 0.0 && !joint->reached[which]) {
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
            const double way = t * fabs(moving[k] - motion->trial[k]);

            change[k] = moving[k] - motion->trial[k];
            perp__raise_to(&largest, k >= 3 ? way : size > 0.0 ? way / size : way);
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

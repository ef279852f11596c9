/* Joints in a step: their rows in the problem of an interval, in the poses of trial.c, and
 * what comes out. Motor and friction are rows with two bounds, as contact has them
 * (contact/bounded.h). */
#include "world/joints/joints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* Beside the terms of a velocity, what rounding makes of one that is 0; and what counts as none. */
#define ROUNDING (64.0 * DBL_EPSILON)
#define STILL 1e-9

/* ---- rows ---- */

void perp__number_joint_bodies(perp_world *world, const perp__island *island, int32_t afresh)
{
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);

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
    const double *warm = perp__state_of(world, joint)->warm + slot;

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
    const perp__joint_state *state = perp__state_of(world, joint);

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
    const perp__joint_state *state = perp__state_of(world, joint);
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
        if (!is_locked(perp__state_of(world, perp__island_joint(world, island, i))))
            add_inequalities(world, island, perp__island_joint(world, island, i));
    work->inequalities = work->units;
    for (int32_t i = 0; i < island->joints; i++)
        add_equations(world, island, perp__island_joint(world, island, i));
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

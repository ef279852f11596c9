/* Joints in a step: their rows in the problem of an interval, in the poses of trial.c, and
 * what comes out: for the velocities, for who reads it, for the next step, and for who may sleep
 * (rest.c). Motor and friction are rows with two bounds, as contact has them
 * (contact/bounded.h). */
#include "world/joints/joints.h"

#include <float.h>

#include "base/groups.h"

/* Joints are out of place by less than this angle, below which two directions are one. Rows that
 * repeat others, as those of hinges in a loop do, come near to them by that times the number of
 * rows, over which it adds up. */
#define PLACED PERP__PARALLEL

/* Places farther off than this may have no difference. */
#define FAR (DBL_MAX / 4.0)

/* ---- rows ---- */

void perp__clear_joints(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);

        joint->used = 0;
        memset(joint->impulse, 0, sizeof joint->impulse);
        memset(joint->told, 0, sizeof joint->told);
        memset(joint->next_warm, 0, sizeof joint->next_warm);
    }
}

static perp__rigid_rows *next_unit(perp_world *world, perp__joint *joint, int32_t slot, int32_t dim)
{
    perp__island_work *work = &world->solve.work;
    perp__joint_unit *unit = &work->joint_units[work->units - work->count];
    perp__rigid_rows *rows = &work->rows[work->units];
    const double *warm = perp__state_of(world, joint)->warm + slot;

    memset(rows, 0, sizeof *rows);
    unit->joint = (int32_t)(joint - world->joints.all);
    unit->slot = slot;
    unit->dim = rows->dim = dim;
    for (int32_t i = 0; i < 3; i++)
        work->warm[3 * work->units + i] = i < dim ? warm[i] : 0.0;
    joint->used += slot < PERP__SLOT_LOCK ? dim : 1;
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

bool perp__has_direction(const perp__joint_view *view)
{
    const double(*row)[6] = view->rows[PERP__JOINT_ROWS];

    return !(perp__is_zero3(row[1]) && perp__is_zero3(row[1] + 3));
}

/* A row with the bound `most`, of a motor or of dry friction, beside a speed. */
static void add_bounded(perp_world *world, const perp__island *island, perp__joint *joint,
                        int32_t slot, double speed, double most)
{
    const int32_t k = most < INFINITY ? 1 : 0;
    perp__rigid_rows *rows = next_unit(world, joint, slot, 1 + k);
    double *warm = world->solve.work.warm + 3 * (world->solve.work.units - 1);
    int exponent;

    fill_row(world, island, joint, PERP__JOINT_ROWS, 1.0, rows, k);
    rows->bias[k] = joint->turning[PERP__JOINT_ROWS] - speed;
    if (k == 0)
        return;
    rows->mu = 1.0;
    rows->bounded = 1;
    (void)frexp(perp__moved_by(world, island, rows, k), &exponent);
    rows->compliance[0] = ldexp(1.0, exponent);
    warm[1] = warm[0];
    warm[0] = most * world->solve.work.length;
}

/* Those that are not spare, up to three in a row to a unit. */
static void add_equations(perp_world *world, const perp__island *island, perp__joint *joint)
{
    int32_t slot = 0;

    while (slot < joint->middle.count) {
        perp__rigid_rows *rows;
        int32_t dim = 0;

        while (slot + dim < joint->middle.count && dim < 3 && !joint->spare[slot + dim])
            dim++;
        if (dim == 0) {
            slot++;
            continue;
        }
        rows = next_unit(world, joint, slot, dim);
        for (int32_t k = 0; k < dim; k++, slot++) {
            fill_row(world, island, joint, slot, 1.0, rows, k);
            rows->bias[k] = joint->turning[slot];
        }
    }
    if (perp__is_locked(perp__state_of(world, joint)) && perp__has_direction(&joint->middle) &&
        !joint->spare[PERP__SLOT_LOCK]) {
        perp__rigid_rows *rows = next_unit(world, joint, PERP__SLOT_LOCK, 1);

        fill_row(world, island, joint, PERP__JOINT_ROWS, 1.0, rows, 0);
        rows->bias[0] = joint->turning[PERP__JOINT_ROWS];
    }
}

int32_t perp__join_parts(const perp_world *world, const perp__island *island)
{
    int32_t *parents = world->solve.work.parts, ground = -1, loops = 0;

    for (int32_t i = 0; i < island->bodies; i++)
        parents[i] = i;
    for (int32_t i = 0; i < island->joints; i++) {
        const int32_t *body = perp__island_joint(world, island, i)->body;
        int32_t ends[2];

        for (int32_t side = 0; side < 2; side++)
            ends[side] =
                perp__is_dynamic(world, body[side]) ? world->step.roles[body[side]].local : ground;
        if (ends[0] < 0 || ends[1] < 0)
            ground = ends[0] < 0 ? ends[1] : ends[0]; /* the first that is tied stands for it */
        else
            loops |= !perp__join(parents, ends[0], ends[1]);
    }
    return loops;
}

perp_status perp__find_spare_rows(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->solve.work;
    perp__joint_block *block = &world->solve.coloured.joints;
    perp__rigid_problem problem;
    int32_t n = 0;
    perp_status status;

    for (int32_t i = 0; i < island->joints; i++)
        memset(perp__island_joint(world, island, i)->spare, 0, PERP__JOINT_ROWS + 1);
    if (!perp__join_parts(world, island))
        return PERP_OK;
    perp__gather_bodies(world, island);
    perp__place_joints(world, island, 0.0);
    work->count = work->inequalities = work->units = 0;
    for (int32_t i = 0; i < island->joints; i++)
        add_equations(world, island, perp__island_joint(world, island, i));
    perp__pose_island(world, island, &problem);
    block->most_angle = PLACED;
    status = perp__joint_block_set_up(block, world->context, &problem);
    block->most_angle = 0.0;
    for (int32_t i = 0; i < work->units && status == PERP_OK; i++) {
        const perp__joint_unit *unit = &work->joint_units[i];

        for (int32_t k = 0; k < unit->dim; k++, n++)
            world->joints.all[unit->joint].spare[unit->slot + k] =
                block->factored && block->factor.repeats[block->lane[n]];
    }
    return status;
}

/* Units that are contacts to the contact layer, then those that are equations. */
void perp__add_joint_rows(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->solve.work;

    /* 1. limits that are reached, motors and friction with bounds */
    work->units = work->count;
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);

        joint->used = 0;
        if (perp__is_locked(state) || !perp__has_direction(&joint->middle))
            continue;
        for (int32_t which = 0; which < 2; which++) {
            const double sign = which == 0 ? 1.0 : -1.0;
            perp__rigid_rows *rows;

            if (!joint->reached[which])
                continue;
            rows = next_unit(world, joint, PERP__SLOT_LOWER + which, 1);
            fill_row(world, island, joint, PERP__JOINT_ROWS, sign, rows, 0);
            rows->bias[0] = sign * joint->turning[PERP__JOINT_ROWS];
        }
        if (state->force > 0.0 && state->force < INFINITY)
            add_bounded(world, island, joint, PERP__SLOT_MOTOR, state->speed, state->force);
        if (state->friction > 0.0 && state->friction < INFINITY)
            add_bounded(world, island, joint, PERP__SLOT_FRICTION, 0.0, state->friction);
    }

    /* 2. equations; a motor of any force, or friction: what a lock holds needs and takes none */
    work->inequalities = work->units;
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);

        add_equations(world, island, joint);
        if (perp__is_locked(state) || !perp__has_direction(&joint->middle))
            continue;
        if (state->force == INFINITY)
            add_bounded(world, island, joint, PERP__SLOT_MOTOR, state->speed, INFINITY);
        else if (state->friction == INFINITY)
            add_bounded(world, island, joint, PERP__SLOT_FRICTION, 0.0, INFINITY);
    }
}

/* The force or moment that bounds a unit of a motor or of dry friction. */
static double bound_of(const perp_world *world, const perp__joint_unit *unit)
{
    const perp__joint_state *state = &world->joints.states[unit->joint];

    return unit->slot == PERP__SLOT_MOTOR ? state->force : state->friction;
}

void perp__time_joints(perp_world *world, double t)
{
    perp__island_work *work = &world->solve.work;

    for (int32_t i = work->count; i < work->inequalities; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        const double *gap = world->joints.all[unit->joint].gap;

        if (unit->slot >= PERP__SLOT_MOTOR)
            work->rows[i].bias[0] = -work->rows[i].compliance[0] * (t * bound_of(world, unit));
        else if (gap[unit->slot - PERP__SLOT_LOWER] > 0.0)
            work->rows[i].bias[0] = gap[unit->slot - PERP__SLOT_LOWER] / t;
    }
}

/* ---- what came out ---- */

/* Moments are about the anchor, and turned from where bodies end, as rows have them, to the mean of
 * the way there. */
void perp__tell_impulse(perp__joint *joint, const perp__joint_view *view, int32_t slot, double r)
{
    const double *row = view->rows[slot < PERP__JOINT_ROWS ? slot : PERP__JOINT_ROWS][1];
    const double push = slot == PERP__SLOT_UPPER ? -r : r;
    double moment[3], seen[3];

    perp__apply3(seen, view->mean, row);
    perp__cross(moment, view->arms[1], seen);
    perp__subtract3(moment, row + 3, moment);
    perp__apply_transposed3(seen, view->mean, moment);
    perp__add3(joint->told[0], push, row);
    perp__add3(joint->told[1], push, seen);
}

/* A bound is just that, of the whole step too, whatever a method made of the row that stands for
 * it: beside impulses that are larger by 1e10 that row is solved to tol of those. */
void perp__add_joint_impulses(perp_world *world, const double *impulse, double share)
{
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = work->count; i < work->units; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        perp__joint *joint = &world->joints.all[unit->joint];
        const int32_t is_bounded = i < work->inequalities && unit->slot >= PERP__SLOT_MOTOR;
        const double *r = impulse + 3 * (i - work->count) + is_bounded;
        const double most = is_bounded ? work->length * bound_of(world, unit) : INFINITY;

        for (int32_t k = 0; k < unit->dim - is_bounded; k++) {
            double *sum = &joint->impulse[unit->slot + k];

            *sum = fmin(fmax(*sum + share * r[k], -most), most);
            joint->next_warm[unit->slot + k] = fmin(fmax(r[k], -most), most);
            perp__tell_impulse(joint, &joint->middle, unit->slot + k, share * r[k]);
        }
    }
}

bool perp__limits_last(const perp_world *world)
{
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = work->count; i < work->inequalities; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];
        const perp__joint *joint = &world->joints.all[unit->joint];

        if (unit->slot < PERP__SLOT_MOTOR && work->impulse[3 * i] > 0.0 &&
            !(joint->gap[unit->slot - PERP__SLOT_LOWER] <= 0.0 &&
              joint->came[unit->slot - PERP__SLOT_LOWER] == 0))
            return 0;
    }
    return 1;
}

/* ---- what is kept of it ---- */

/* Impulses of the step on B, and where the coordinate is. */
static void read_state(const perp_world *world, const perp__joint *joint, perp__joint_state *state)
{
    const double *r = joint->impulse;
    perp_joint_state *last = &state->last;
    perp__joint_view view;

    perp__view_of_states(world, joint, world->bodies.states, state->coordinate, 0, &view);
    state->coordinate = view.coordinate;
    memcpy(state->warm, joint->next_warm, sizeof state->warm);
    memset(last, 0, sizeof *last);
    last->motor_impulse = r[PERP__SLOT_MOTOR];
    last->friction_impulse = r[PERP__SLOT_FRICTION];
    last->limit_impulse = r[PERP__SLOT_LOCK] + r[PERP__SLOT_LOWER] - r[PERP__SLOT_UPPER];
    last->at_limit = (r[PERP__SLOT_UPPER] > 0.0) - (r[PERP__SLOT_LOWER] > 0.0);
    perp__copy3(last->impulse, joint->told[0]);
    perp__copy3(last->moment, joint->told[1]);
    for (int32_t row = 0; row < 2 && world->settings.planar; row++)
        last->moment[row] = 0.0;
}

perp_status perp__check_joints(const perp_world *world)
{
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < world->joints.slots && status == PERP_OK; i++) {
        const perp__joint *joint = &world->joints.all[i];
        perp__joint_view view = {.coordinate = 0.0};
        double place = 0.0;

        if (!perp__joint_works(world, i))
            continue;
        for (int32_t side = 0; side < 2; side++)
            place = fmax(place, fmax(perp__largest3(world->step.next[joint->body[side]].position),
                                     perp__largest3(joint->anchors[side])));
        if (!(place < FAR)) /* else it has one */
            perp__view_of_states(world, joint, world->step.next, 0.0, 0, &view);
        if (!isfinite(view.coordinate) || !perp__is_finite3(joint->told[0]) ||
            !perp__is_finite3(joint->told[1]))
            status = perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                                "the step takes joint %d beyond the range of numbers", (int)i);
    }
    return status;
}

void perp__keep_joints(perp_world *world)
{
    for (int32_t i = 0; i < world->joints.slots; i++) {
        const perp__joint_state before = world->joints.states[i];

        if (!perp__joint_works(world, i))
            continue;
        read_state(world, &world->joints.all[i], &world->joints.states[i]);
        world->joints.all[i].changed =
            memcmp(&before, &world->joints.states[i], sizeof before) != 0;
    }
}

int32_t perp__count_joint_rows(const perp_world *world)
{
    int32_t i, count = 0;

    for (i = 0; i < world->joints.slots; i++)
        count += world->joints.all[i].alive ? world->joints.all[i].used : 0;
    return count;
}

/* ---- rest.c ---- */

void perp__join_joined(perp_world *world)
{
    for (int32_t i = 0; i < world->joints.slots; i++) {
        const int32_t *body = world->joints.all[i].body;

        if (!perp__joint_works(world, i))
            continue;
        world->step.roles[body[0]].jointed = world->step.roles[body[1]].jointed = 1;
        if (perp__is_dynamic(world, body[0]) && perp__is_dynamic(world, body[1]))
            perp__join(world->islands.parent, body[0], body[1]);
    }
}

void perp__upset_joints(perp_world *world)
{
    for (int32_t i = 0; i < world->joints.slots; i++) {
        const int32_t *body = world->joints.all[i].body;

        for (int32_t side = 0; side < 2 && perp__joint_works(world, i); side++)
            if (perp__is_dynamic(world, body[side]) &&
                (world->joints.all[i].changed || (world->bodies.all[body[1 - side]].awake &&
                                                  !world->step.roles[body[1 - side]].calm)))
                world->step.roles[perp__root_of(world->islands.parent, body[side])].calm = 0;
    }
}

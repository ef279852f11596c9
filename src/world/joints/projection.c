/* What joints lack in the next positions: rows of the projection (projection.c). Errors of rounding
 * are left alone, to the last bit. */
#include <math.h>
#include <string.h>

#include "world/joints/joints.h"

/* Errors, in sizes and radians, that are worth removing. */
#define TOLERANCE 1e-12

static double tolerance_of(const perp__joint_view *view, int32_t is_length)
{
    return is_length ? fmax(TOLERANCE * view->size, view->rounding) : TOLERANCE;
}

static int32_t turns(const perp__joint *joint)
{
    return joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW;
}

/* Beyond the limits: < 0 below the lower one, > 0 above the upper one. */
static double excess_of(const perp__joint_state *state, const perp__joint_view *view)
{
    return view->coordinate < state->lower   ? view->coordinate - state->lower
           : view->coordinate > state->upper ? view->coordinate - state->upper
                                             : 0.0;
}

static double error_of(const perp_world *world, int32_t i)
{
    const perp__joint *joint = &world->joints[i];
    const perp__joint_state *state = &world->joint_states[i];
    perp__joint_view view;
    double sum = 0.0, excess;

    perp__view_of_states(world, joint, world->next, state->coordinate, &view);
    excess = excess_of(state, &view);
    for (int32_t k = 0; k < view.count; k++) {
        const int32_t is_length = perp__is_length(world, joint, k);

        if (fabs(view.error[k]) > tolerance_of(&view, is_length))
            sum += fabs(view.error[k]) * (is_length ? 1.0 : view.size);
    }
    if (fabs(excess) > tolerance_of(&view, !turns(joint)))
        sum += fabs(excess) * (turns(joint) ? view.size : 1.0);
    return sum;
}

double perp__joint_errors(const perp_world *world)
{
    double sum = 0.0;

    for (int32_t i = 0; i < world->joint_slots; i++)
        if (perp__joint_works(world, i))
            sum += error_of(world, i);
    return sum;
}

int32_t perp__lacks_joints(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->joints; i++)
        if (error_of(world, world->joint_order[island->first_joint + i]) > 0.0)
            return 1;
    return 0;
}

static void add_row(perp_world *world, const perp__joint *joint, double row[2][6], double error,
                    double sign)
{
    perp__island_work *work = &world->work;
    perp__rigid_rows *rows = &work->rows[work->units++];

    memset(rows, 0, sizeof *rows);
    rows->dim = 1;
    rows->bias[0] = sign * error;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = joint->body[side];

        rows->body[side] =
            perp__is_dynamic(world, body) ? world->roles[body].local : PERP__RIGID_AT_REST;
        perp__coordinates_of(world, row[side], rows->rows[side][0]);
        for (int32_t j = 0; j < world->dof; j++)
            rows->rows[side][0][j] *= sign;
    }
}

static void add_limits(perp_world *world, int32_t i)
{
    const perp__joint_state *state = &world->joint_states[i];
    perp__joint_view view;

    perp__view_of_states(world, &world->joints[i], world->next, state->coordinate, &view);
    if (state->lower == state->upper || !perp__has_direction(&view))
        return;
    if (view.coordinate < state->lower)
        add_row(world, &world->joints[i], view.rows[PERP__JOINT_ROWS],
                view.coordinate - state->lower, 1.0);
    if (view.coordinate > state->upper)
        add_row(world, &world->joints[i], view.rows[PERP__JOINT_ROWS],
                view.coordinate - state->upper, -1.0);
}

static void add_equations(perp_world *world, int32_t i)
{
    const perp__joint_state *state = &world->joint_states[i];
    perp__joint_view view;

    perp__view_of_states(world, &world->joints[i], world->next, state->coordinate, &view);
    for (int32_t k = 0; k < view.count; k++)
        add_row(world, &world->joints[i], view.rows[k], view.error[k], 1.0);
    if (state->lower == state->upper && perp__has_direction(&view))
        add_row(world, &world->joints[i], view.rows[PERP__JOINT_ROWS],
                view.coordinate - state->lower, 1.0);
}

void perp__add_joint_errors(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;

    work->units = work->count;
    for (int32_t i = 0; i < island->joints; i++)
        add_limits(world, world->joint_order[island->first_joint + i]);
    work->inequalities = work->units;
    for (int32_t i = 0; i < island->joints; i++)
        add_equations(world, world->joint_order[island->first_joint + i]);
}

/* What is kept of a step's joints: what a caller reads, what the next step starts from, and whether
 * that lets their bodies sleep (rest.c). */
#include <math.h>
#include <string.h>

#include "base/groups.h"
#include "linalg/spatial.h"
#include "world/joints/joints.h"

/* Places farther off than this may have no difference, and impulses no moment. */
#define FAR 1e300

/* Impulses of the step on B, and where the coordinate is between these states. */
static void read_state(const perp_world *world, const perp__joint *joint, const perp__state *states,
                       perp__joint_state *state)
{
    const double *r = joint->impulse;
    perp_joint_state *last = &state->last;
    perp__joint_view view;
    double along, taken[3];

    perp__view_of_states(world, joint, states, state->coordinate, &view);
    state->coordinate = view.coordinate;
    memcpy(state->warm, joint->next_warm, sizeof state->warm);
    memset(last, 0, sizeof *last);
    last->motor_impulse = r[PERP__SLOT_MOTOR];
    last->friction_impulse = r[PERP__SLOT_FRICTION];
    last->limit_impulse = r[PERP__SLOT_LOCK] + r[PERP__SLOT_LOWER] - r[PERP__SLOT_UPPER];
    last->at_limit = (r[PERP__SLOT_UPPER] > 0.0) - (r[PERP__SLOT_LOWER] > 0.0);
    along = last->limit_impulse + last->motor_impulse + last->friction_impulse;
    for (int32_t row = 0; row <= PERP__JOINT_ROWS; row++) {
        const double push = row < PERP__JOINT_ROWS ? r[row] : along;

        if (push == 0.0)
            continue;
        perp__add3(last->impulse, push, joint->middle.rows[row][1]);
        perp__add3(last->moment, push, joint->middle.rows[row][1] + 3);
    }
    perp__cross(taken, joint->middle.arms[1], last->impulse);
    perp__add3(last->moment, -1.0, taken);
    for (int32_t row = 0; row < 2 && world->settings.planar; row++)
        last->moment[row] = 0.0;
}

/* The largest of the numbers that the joint's state is made of. */
static double largest_of(const perp_world *world, const perp__joint *joint)
{
    double place = 0.0, impulse = 0.0;

    for (int32_t side = 0; side < 2; side++)
        place = fmax(place, fmax(perp__largest3(world->next[joint->body[side]].position),
                                 perp__largest3(joint->anchors[side])));
    for (int32_t row = 0; row < PERP__JOINT_SLOTS; row++)
        impulse = fmax(impulse, fabs(joint->impulse[row]));
    return fmax(place, impulse * (1.0 + perp__largest3(joint->middle.arms[1])));
}

perp_status perp__check_joints(const perp_world *world)
{
    for (int32_t i = 0; i < world->joint_slots; i++) {
        const perp__joint *joint = &world->joints[i];
        perp__joint_state told;

        if (!perp__joint_works(world, i) || largest_of(world, joint) < FAR)
            continue;
        told = world->joint_states[i];
        read_state(world, joint, world->next, &told);
        if (!isfinite(told.coordinate) || !perp__is_finite3(told.last.impulse) ||
            !perp__is_finite3(told.last.moment))
            return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                              "the step takes joint %d beyond the range of numbers", (int)i);
    }
    return PERP_OK;
}

void perp__keep_joints(perp_world *world)
{
    for (int32_t i = 0; i < world->joint_slots; i++) {
        const perp__joint_state before = world->joint_states[i];

        if (!perp__joint_works(world, i))
            continue;
        read_state(world, &world->joints[i], world->states, &world->joint_states[i]);
        world->joints[i].changed = memcmp(&before, &world->joint_states[i], sizeof before) != 0;
    }
}

int32_t perp__count_joint_rows(const perp_world *world)
{
    int32_t i, count = 0;

    for (i = 0; i < world->joint_slots; i++)
        count += world->joints[i].alive ? world->joints[i].used : 0;
    return count;
}

/* ---- rest.c ---- */

void perp__join_calm(perp_world *world)
{
    for (int32_t i = 0; i < world->joint_slots; i++) {
        const int32_t *body = world->joints[i].body;

        if (perp__joint_works(world, i) && perp__is_dynamic(world, body[0]) &&
            perp__is_dynamic(world, body[1]))
            perp__join(world->parent, body[0], body[1]);
    }
}

void perp__upset_joints(perp_world *world)
{
    for (int32_t i = 0; i < world->joint_slots; i++) {
        const int32_t *body = world->joints[i].body;

        for (int32_t side = 0; side < 2 && perp__joint_works(world, i); side++)
            if (perp__is_dynamic(world, body[side]) &&
                (world->joints[i].changed ||
                 (world->bodies[body[1 - side]].awake && !world->roles[body[1 - side]].calm)))
                world->roles[perp__root_of(world->parent, body[side])].calm = 0;
    }
}

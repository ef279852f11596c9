/* Joints: adding, removing, reading and changing what may change. */
#include "base/groups.h"
#include "base/check.h"
#include "base/context.h"
#include "world/joints/joints.h"

PERP__INIT_WITH(perp_joint_settings, .kind = PERP_JOINT_BALL, .axis[2] = 1.0, .lower = -INFINITY,
                .upper = INFINITY)

/* ---- ids and lists ---- */

static perp_status find_joint(const perp_world *world, int32_t *slot, perp_joint id)
{
    const uint64_t number = id & UINT64_C(0xffffffff);
    const perp__joint *joint;

    if (id == 0)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "joint is 0, the null id");
    if (number == 0 || number > (uint64_t)world->joints.slots)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "joint is not a joint of this world");
    joint = &world->joints.all[number - 1];
    if (!joint->alive || joint->generation != id >> 32)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "joint was removed from this world");
    *slot = (int32_t)(number - 1);
    return PERP_OK;
}

static void take_off_list(perp_world *world, int32_t slot, int32_t side)
{
    int32_t *link = &world->bodies.all[world->joints.all[slot].body[side]].first_joint;

    while (*link != 1 + 2 * slot + side)
        link = &world->joints.all[(*link - 1) / 2].next[(*link - 1) % 2];
    *link = world->joints.all[slot].next[side];
}

bool perp__joint_parts(const perp_world *world, int32_t a, int32_t b)
{
    const int32_t sum = a + b, from = perp__is_dynamic(world, a) ? a : b; /* the ground has many */

    if (perp__root_of(world->bodies.clusters, a) == perp__root_of(world->bodies.clusters, b))
        return 1;
    for (int32_t link = world->bodies.all[from].first_joint; link != 0;) {
        const perp__joint *joint = &world->joints.all[(link - 1) / 2];

        if (!joint->collides && joint->body[0] + joint->body[1] == sum)
            return 1;
        link = joint->next[(link - 1) % 2];
    }
    return 0;
}

void perp__find_clusters(perp_world *world)
{
    for (int32_t i = 0; i < world->bodies.slots; i++)
        world->bodies.clusters[i] = i;
    for (int32_t i = 0; i < world->joints.slots; i++)
        if (world->joints.all[i].alive && world->joints.all[i].kind == PERP_JOINT_FIXED)
            perp__join(world->bodies.clusters, world->joints.all[i].body[0],
                       world->joints.all[i].body[1]);
}

/* ---- checks ---- */

static perp_status check_limits(const perp_world *world, int32_t kind, double lower, double upper)
{
    if (isnan(lower) || isnan(upper))
        return perp__fail(world->context, PERP_ERROR_NOT_FINITE, "lower is %g and upper is %g",
                          lower, upper);
    if (!(lower <= upper) || lower == INFINITY || upper == -INFINITY)
        return perp__refuse(world->context, "lower is %g and upper is %g, lower <= upper expected",
                            lower, upper);
    if (!perp__joint_has_coordinate(kind) && (lower > -INFINITY || upper < INFINITY))
        return perp__refuse(world->context, "a joint of this kind has no coordinate to be limited");
    if (kind == PERP_JOINT_DISTANCE && (upper < 0.0 || (lower == upper && lower == 0.0)))
        return perp__refuse(world->context, "upper is %g, a distance > 0 expected", upper);
    return PERP_OK;
}

static perp_status check_most(const perp_world *world, int32_t kind, const char *name, double most)
{
    if (isnan(most))
        return perp__fail(world->context, PERP_ERROR_NOT_FINITE, "%s is not a number", name);
    if (!(most >= 0.0))
        return perp__refuse(world->context, "%s is %g, >= 0 expected", name, most);
    if (most > 0.0 && !perp__joint_has_coordinate(kind))
        return perp__refuse(world->context, "%s is %g, but a joint of this kind has no coordinate",
                            name, most);
    return PERP_OK;
}

/* Checks the axis, and gives what joints without one of their own are described in. */
static perp_status read_axis(const perp_world *world, const perp_joint_settings *settings,
                             double *axis)
{
    const int32_t kind = settings->kind, planar = world->settings.planar;
    perp_status status;

    memset(axis, 0, 3 * sizeof *axis);
    axis[kind == PERP_JOINT_FIXED && planar ? 0 : 2] = 1.0;
    if (kind != PERP_JOINT_PRISMATIC &&
        (planar || (kind != PERP_JOINT_REVOLUTE && kind != PERP_JOINT_SCREW &&
                    kind != PERP_JOINT_CYLINDRICAL && kind != PERP_JOINT_PLANAR)))
        return PERP_OK;
    perp__copy3(axis, settings->axis);
    status = perp__check_finite(world->context, "settings.axis", axis, 3);
    if (status == PERP_OK && !(perp__normalise3(axis) > 0.0))
        return perp__refuse(world->context, "settings.axis is 0");
    return status == PERP_OK ? perp__check_vector3(world, "settings.axis", axis) : status;
}

static perp_status check_settings(const perp_world *world, const perp_joint_settings *settings)
{
    const int32_t kind = settings->kind;
    perp_status status;

    if (kind < PERP_JOINT_BALL || kind > PERP_JOINT_DISTANCE)
        return perp__refuse(world->context,
                            "settings.kind is %d, PERP_JOINT_BALL to _DISTANCE expected",
                            (int)kind);
    if (world->settings.planar &&
        (kind == PERP_JOINT_SCREW || kind == PERP_JOINT_CYLINDRICAL || kind == PERP_JOINT_PLANAR))
        return perp__refuse(world->context,
                            "settings.kind is %d, which a planar world does not have", (int)kind);
    if (settings->collides != 0 && settings->collides != 1)
        return perp__refuse(world->context, "settings.collides is %d, 0 or 1 expected",
                            (int)settings->collides);
    status = perp__check_vector3(world, "settings.anchor", settings->anchor);
    if (status == PERP_OK && kind == PERP_JOINT_DISTANCE)
        status = perp__check_vector3(world, "settings.anchor_b", settings->anchor_b);
    PERP__THEN(status, perp__check_finite(world->context, "settings.pitch", &settings->pitch, 1));
    PERP__THEN(status, check_limits(world, kind, settings->lower, settings->upper));
    PERP__THEN(status,
               perp__check_finite(world->context, "motor_speed", &settings->motor_speed, 1));
    PERP__THEN(status, check_most(world, kind, "motor_force", settings->motor_force));
    PERP__THEN(status, check_most(world, kind, "friction", settings->friction));
    return status;
}

static perp_status check_bodies(const perp_world *world, int32_t slots[2], perp_body a, perp_body b)
{
    perp_status status = perp__find_body(world, &slots[0], a);

    PERP__THEN(status, perp__find_body(world, &slots[1], b));
    if (status != PERP_OK)
        return status;
    if (slots[0] == slots[1])
        return perp__refuse(world->context, "a and b are the same body");
    if (!perp__is_dynamic(world, slots[0]) && !perp__is_dynamic(world, slots[1]))
        return perp__refuse(world->context,
                            "neither a nor b is dynamic: nothing can move the joint");
    return PERP_OK;
}

/* ---- making one ---- */

void perp__view_of_states(const perp_world *world, const perp__joint *joint,
                          const perp__state *states, double before, bool equations,
                          perp__joint_view *view)
{
    perp__placement places[2];

    view->coordinate = 0.0;
    if (!equations && !perp__joint_has_coordinate(joint->kind))
        return;
    for (int32_t side = 0; side < 2; side++) {
        perp__copy3(places[side].position, states[joint->body[side]].position);
        perp__rotation_of(world, &states[joint->body[side]], places[side].rotation);
    }
    perp__view_placed(world, joint, before, places, equations, view);
}

/* Anchors and axes as the bodies see them. */
static void attach(const perp_world *world, perp__joint *joint, const perp_joint_settings *settings,
                   const double *n)
{
    const bool in_plane = world->settings.planar && n[2] == 0.0;
    const int32_t i = fabs(n[0]) > 0.9 ? 1 : 0;
    double axes[3][3] = {{n[0], n[1], n[2]}}, arm[3];

    /* 1. (n, t1, t2) as for contacts: t1 is x brought into the plane across n, or y where n is
     * close to x; where n lies in the plane of a planar world t1 does too, and t2 is z */
    if (in_plane) {
        axes[1][0] = -n[1];
        axes[1][1] = n[0];
        axes[2][2] = 1.0;
    } else {
        axes[1][i] = 1.0;
        perp__add3(axes[1], -n[i], n);
        (void)perp__normalise3(axes[1]);
        perp__cross(axes[2], n, axes[1]);
    }

    /* 2. in the frames of both bodies */
    for (int32_t side = 0; side < 2; side++) {
        const bool is_other = side == 1 && settings->kind == PERP_JOINT_DISTANCE;
        const perp__state *state = &world->bodies.states[joint->body[side]];
        double R[9];

        perp__rotation_of(world, state, R);
        perp__subtract3(arm, is_other ? settings->anchor_b : settings->anchor, state->position);
        perp__apply_transposed3(joint->anchors[side], R, arm);
        for (int32_t k = 0; k < 3; k++)
            perp__apply_transposed3(joint->axes[side][k], R, axes[k]);
    }
}

bool perp__joint_works(const perp_world *world, int32_t i)
{
    const perp__joint *joint = &world->joints.all[i];
    const perp__body *a, *b;

    if (!joint->alive)
        return 0;
    a = &world->bodies.all[joint->body[0]];
    b = &world->bodies.all[joint->body[1]];
    return (a->awake && a->kind == PERP_BODY_DYNAMIC) || (b->awake && b->kind == PERP_BODY_DYNAMIC);
}

static void rouse_both(perp_world *world, const perp__joint *joint)
{
    for (int32_t side = 0; side < 2; side++)
        if (perp__is_dynamic(world, joint->body[side]))
            perp__rouse(world, joint->body[side]);
}

void perp__rouse_joined(perp_world *world, int32_t body)
{
    for (int32_t link = world->bodies.all[body].first_joint; link != 0;) {
        rouse_both(world, &world->joints.all[(link - 1) / 2]);
        link = world->joints.all[(link - 1) / 2].next[(link - 1) % 2];
    }
}

/* Pairs of shapes come and go with what may touch. */
static void change_composition(perp_world *world, const perp__joint *joint)
{
    for (int32_t side = 0; side < 2; side++)
        perp__note_put(world, joint->body[side]);
    world->pairs.planes_changed = 1;
    world->bodies.edition++;
}

/* What keeps anchors apart needs a direction to push in. */
static perp_status check_direction(const perp_world *world, const perp__joint *joint, double lower,
                                   const perp__joint_view *view)
{
    if (joint->kind == PERP_JOINT_DISTANCE && lower > 0.0 && !(view->coordinate > view->rounding))
        return perp__refuse(world->context,
                            "the anchors are in the same place: their distance is 0");
    return PERP_OK;
}

static perp_status read_length(const perp_world *world, const perp__joint *joint,
                               perp_joint_settings *settings)
{
    perp__joint_view view;

    if (settings->kind != PERP_JOINT_DISTANCE)
        return PERP_OK;
    perp__view_of_states(world, joint, world->bodies.states, 0.0, 1, &view);
    if (settings->lower > -INFINITY || settings->upper < INFINITY)
        return check_direction(world, joint, settings->lower, &view);
    settings->lower = settings->upper = view.coordinate;
    return check_direction(world, joint, INFINITY, &view);
}

/* Gives a joint a slot, and puts it on the lists of its bodies; returns the slot. */
static int32_t place_joint(perp_world *world, perp__joint *made)
{
    const bool again = world->joints.free >= 0;
    const int32_t slot = again ? world->joints.free : world->joints.slots++;

    made->generation = again ? world->joints.all[slot].generation : 1;
    made->alive = 1;
    if (again)
        world->joints.free = world->joints.all[slot].next_free;
    for (int32_t side = 0; side < 2; side++) {
        perp__body *body = &world->bodies.all[made->body[side]];

        made->next[side] = body->first_joint;
        body->first_joint = 1 + 2 * slot + side;
    }
    world->joints.all[slot] = *made;
    world->joints.count++;
    change_composition(world, made);
    return slot;
}

static perp_status add_joint(perp_world *world, perp_joint *id, perp_body a, perp_body b,
                             const perp_joint_settings *caller)
{
    const perp__growing arrays[] = {PERP__GROWING(world->joints.all, world->joints.slots, 1),
                                    PERP__GROWING(world->joints.states, world->joints.slots, 1)};
    perp_joint_settings settings;
    perp__joint made;
    perp__joint_state *state;
    double axis[3];
    int32_t slot;

    /* 1. what the caller asks for */
    perp_status status = perp__check_pointer(world->context, "joint", id);
    PERP__THEN(status, perp_joint_settings_init(&settings, sizeof settings));
    PERP__THEN(status, perp__struct_read(world->context, "settings", &settings, sizeof settings,
                                         caller, PERP__FIRST(perp_joint_settings)));
    PERP__THEN(status, check_settings(world, &settings));
    memset(&made, 0, sizeof made);
    PERP__THEN(status, check_bodies(world, made.body, a, b));
    PERP__THEN(status, read_axis(world, &settings, axis));
    if (status != PERP_OK)
        return status;

    /* 2. the joint, where its bodies are */
    made.kind = settings.kind;
    made.collides = settings.collides;
    made.pitch = settings.pitch / 6.28318530717958647692;
    attach(world, &made, &settings, axis);
    status = read_length(world, &made, &settings);
    if (status == PERP_OK && world->joints.free < 0)
        status = perp__grow(world->context, "another joint", &world->joints.capacity,
                            (int64_t)world->joints.slots + 1, arrays, 2);
    if (status != PERP_OK)
        return status;

    /* 3. its slot and its state */
    slot = place_joint(world, &made);
    state = &world->joints.states[slot];
    memset(state, 0, sizeof *state); /* padding too: snapshots hold it */
    state->lower = settings.lower;
    state->upper = settings.upper;
    state->speed = settings.motor_speed;
    state->force = settings.motor_force;
    state->friction = settings.friction;
    *id = perp__id(slot, made.generation);
    return PERP_OK;
}

perp_status perp_world_add_joint(perp_world *world, perp_joint *joint, perp_body a, perp_body b,
                                 const perp_joint_settings *settings)
{
    return PERP__WORLD_CALL(world, add_joint(world, joint, a, b, settings));
}

/* ---- removing ---- */

static void drop_joint(perp_world *world, int32_t slot)
{
    perp__joint *joint = &world->joints.all[slot];

    change_composition(world, joint);
    take_off_list(world, slot, 0);
    take_off_list(world, slot, 1);
    joint->alive = 0;
    joint->generation++;
    joint->next_free = world->joints.free;
    world->joints.free = slot;
    world->joints.count--;
}

void perp__remove_joints(perp_world *world, int32_t body)
{
    while (world->bodies.all[body].first_joint != 0)
        drop_joint(world, (world->bodies.all[body].first_joint - 1) / 2);
}

static perp_status remove_joint(perp_world *world, perp_joint joint)
{
    int32_t slot = 0;
    const perp_status status = find_joint(world, &slot, joint);

    if (status == PERP_OK)
        drop_joint(world, slot);
    return status;
}

perp_status perp_world_remove_joint(perp_world *world, perp_joint joint)
{
    return PERP__WORLD_CALL(world, remove_joint(world, joint));
}

/* ---- reading and changing ---- */

static perp_status get_joint(const perp_world *world, perp_joint_state *state, perp_joint id)
{
    perp_joint_state copy;
    perp__joint_view view;
    const perp__joint *joint;
    const perp__joint_state *laws;
    int32_t slot = 0;
    perp_status status = PERP__CHECK(perp_joint_state, world->context, state);

    PERP__THEN(status, find_joint(world, &slot, id));
    if (status != PERP_OK)
        return status;
    joint = &world->joints.all[slot];
    laws = &world->joints.states[slot];
    copy = laws->last;
    copy.struct_size = sizeof copy;
    perp__view_of_states(world, joint, world->bodies.states, laws->coordinate, 1, &view);
    copy.position = view.coordinate;
    copy.speed = 0.0;
    for (int32_t side = 0; side < 2; side++) {
        const perp__state *moving = &world->bodies.states[joint->body[side]];
        const double *row = view.rows[PERP__JOINT_ROWS][side];

        copy.speed += perp__dot3(row, moving->velocity);
        copy.speed += perp__dot3(row + 3, moving->angular_velocity);
    }
    copy.lower = laws->lower;
    copy.upper = laws->upper;
    copy.motor_speed = laws->speed;
    copy.motor_force = laws->force;
    copy.friction = laws->friction;
    perp__copy3(copy.anchor, world->bodies.states[joint->body[1]].position);
    perp__add3(copy.anchor, 1.0, view.arms[1]);
    perp__struct_write(state, &copy, sizeof copy);
    return PERP_OK;
}

perp_status perp_world_get_joint(const perp_world *world, perp_joint_state *state, perp_joint joint)
{
    return PERP__WORLD_CALL(world, get_joint(world, state, joint));
}

typedef enum law { LIMITS, MOTOR, FRICTION } law;

/* Checks what would be in force, and takes it. */
static perp_status set_law(perp_world *world, perp_joint id, law which, double a, double b)
{
    const perp__joint *joint;
    perp__joint_state laws;
    perp__joint_view view;
    int32_t slot = 0;
    perp_status status = find_joint(world, &slot, id);

    if (status != PERP_OK)
        return status;
    joint = &world->joints.all[slot];
    laws = world->joints.states[slot];
    if (which == LIMITS) {
        laws.lower = a;
        laws.upper = b;
    } else if (which == MOTOR) {
        laws.speed = a;
        laws.force = b;
    } else {
        laws.friction = a;
    }
    perp__view_of_states(world, joint, world->bodies.states, laws.coordinate, 1, &view);
    status = check_limits(world, joint->kind, laws.lower, laws.upper);
    PERP__THEN(status, check_direction(world, joint, laws.lower, &view));
    PERP__THEN(status, perp__check_finite(world->context, "motor_speed", &laws.speed, 1));
    PERP__THEN(status, check_most(world, joint->kind, "motor_force", laws.force));
    PERP__THEN(status, check_most(world, joint->kind, "friction", laws.friction));
    if (status != PERP_OK)
        return status;
    if (memcmp(&world->joints.states[slot], &laws, sizeof laws) != 0)
        rouse_both(world, joint);
    world->joints.states[slot] = laws;
    return PERP_OK;
}

perp_status perp_world_set_joint_limits(perp_world *world, perp_joint joint, double lower,
                                        double upper)
{
    return PERP__WORLD_CALL(world, set_law(world, joint, LIMITS, lower, upper));
}

perp_status perp_world_set_joint_motor(perp_world *world, perp_joint joint, double motor_speed,
                                       double motor_force)
{
    return PERP__WORLD_CALL(world, set_law(world, joint, MOTOR, motor_speed, motor_force));
}

perp_status perp_world_set_joint_friction(perp_world *world, perp_joint joint, double friction)
{
    return PERP__WORLD_CALL(world, set_law(world, joint, FRICTION, friction, 0.0));
}

/* perp/joint.h: any order of adding and removing bodies and joints, of changing limits, motors and
 * friction, stepping and restoring.
 *
 * A gentle world's joints make trees of moderate bodies: then anchors stay together, axes where
 * they are, and coordinates within their limits, by the poses alone. */
#include <math.h>
#include <string.h>

#include "fuzz.h"

enum { BODIES = 6, JOINTS = 8, CALLS = 30 };

/* What the target itself knows of a joint: bodies, and anchors and axis in their frames. */
typedef struct link {
    perp_joint joint;
    perp_body bodies[2];
    int32_t kind;
    double anchors[2][3], axes[2][3], motor_force, friction;
} link;

typedef struct scene {
    perp_context *context;
    perp_world *world;
    fuzz_mood mood;
    int planar, gentle, quick; /* brief: steps of any length would be as many as they are long */
    int32_t count, links;
    perp_body bodies[BODIES + 1]; /* the ground is the last */
    link link[JOINTS];
} scene;

static perp_body_state read_body(const scene *s, perp_body body)
{
    perp_body_state state;

    if (perp_body_state_init(&state, sizeof state) != PERP_OK ||
        perp_world_get_body(s->world, &state, body) != PERP_OK)
        fuzz_fail("joints: a body that was added can be read");
    return state;
}

/* out := x turned by the body's orientation, or back. */
static void turn(const perp_body_state *state, const double *x, int back, double *out)
{
    const double *p = state->orientation, w = p[0], s = back ? -1.0 : 1.0;
    const double v[3] = {s * p[1], s * p[2], s * p[3]};
    double cross[3];
    int32_t i;

    for (i = 0; i < 3; i++)
        cross[i] = v[(i + 1) % 3] * x[(i + 2) % 3] - v[(i + 2) % 3] * x[(i + 1) % 3] + w * x[i];
    for (i = 0; i < 3; i++)
        out[i] =
            x[i] + 2 * (v[(i + 1) % 3] * cross[(i + 2) % 3] - v[(i + 2) % 3] * cross[(i + 1) % 3]);
}

static void place_of(const perp_body_state *state, const double *own, double *out)
{
    int32_t i;

    turn(state, own, 0, out);
    for (i = 0; i < 3; i++)
        out[i] += state->position[i];
}

static void add_body(fuzz_bytes *bytes, scene *s)
{
    perp_body_settings settings;
    double half[3];
    int32_t i;

    if (s->count == BODIES)
        return;
    if (perp_body_settings_init(&settings, sizeof settings) != PERP_OK)
        fuzz_fail("perp_body_settings_init takes its own size");
    settings.mass = s->gentle ? 0.25 * (1 + fuzz_pick(bytes, 8)) : fuzz_number(bytes, s->mood);
    for (i = 0; i < 3; i++) {
        half[i] = 0.125 * (1 + fuzz_pick(bytes, 8));
        settings.position[i] = (fuzz_pick(bytes, 9) - 4) * 0.5;
        settings.velocity[i] = (fuzz_pick(bytes, 5) - 2) * 0.5;
        settings.angular_velocity[i] = (fuzz_pick(bytes, 5) - 2) * 0.5;
        if (!s->gentle && fuzz_one_in(bytes, 4))
            settings.position[i] = fuzz_number(bytes, s->mood);
        if (!s->gentle && fuzz_one_in(bytes, 4))
            settings.velocity[i] = fuzz_number(bytes, s->mood);
        settings.inertia[4 * i] = s->gentle ? 0.125 * (1 + i) : fuzz_size(bytes, s->mood);
    }
    if (s->planar)
        settings.position[2] = settings.velocity[2] = settings.angular_velocity[0] =
            settings.angular_velocity[1] = 0.0;
    if (!fuzz_status(s->context, perp_world_add_body(s->world, &s->bodies[s->count], &settings),
                     "add_body"))
        return;
    if (fuzz_one_in(bytes, 3)) {
        s->gentle &= s->count < 0; /* what touches may hold a joint away from its limits */
        fuzz_status(s->context, perp_world_add_box(s->world, NULL, s->bodies[s->count], half, NULL),
                    "add_box");
    }
    s->count++;
}

static void choose(fuzz_bytes *bytes, const scene *s, perp_joint_settings *settings)
{
    static const int32_t planar[] = {PERP_JOINT_BALL, PERP_JOINT_REVOLUTE, PERP_JOINT_PRISMATIC,
                                     PERP_JOINT_FIXED, PERP_JOINT_DISTANCE};
    int32_t i;

    if (perp_joint_settings_init(settings, sizeof *settings) != PERP_OK)
        fuzz_fail("perp_joint_settings_init takes its own size");
    settings->kind = s->planar ? planar[fuzz_pick(bytes, 5)] : fuzz_pick(bytes, 8);
    settings->collides = fuzz_one_in(bytes, 4);
    for (i = 0; i < 3; i++) {
        const int planar_z = s->planar && i == 2;

        settings->anchor[i] = planar_z ? 0.0 : (fuzz_pick(bytes, 9) - 4) * 0.5;
        settings->anchor_b[i] = planar_z ? 0.0 : (fuzz_pick(bytes, 9) - 4) * 0.5;
        settings->axis[i] = planar_z ? 0.0 : fuzz_pick(bytes, 5) - 2.0;
        if (!s->gentle && fuzz_one_in(bytes, 4))
            settings->anchor[i] = fuzz_number(bytes, s->mood);
        if (!s->gentle && fuzz_one_in(bytes, 4))
            settings->axis[i] = fuzz_number(bytes, s->mood);
    }
    settings->pitch = fuzz_pick(bytes, 3) * 0.25;
    if (settings->kind == PERP_JOINT_BALL || settings->kind == PERP_JOINT_FIXED ||
        settings->kind == PERP_JOINT_PLANAR)
        return;
    if (fuzz_one_in(bytes, 2)) {
        settings->lower = settings->kind == PERP_JOINT_DISTANCE ? 0.25 : -0.25;
        settings->upper = settings->kind == PERP_JOINT_DISTANCE ? 6.0 : 0.5;
    }
    if (fuzz_one_in(bytes, 3)) {
        settings->motor_speed = fuzz_pick(bytes, 9) - 4.0;
        settings->motor_force = fuzz_one_in(bytes, 4) ? (double)INFINITY : fuzz_pick(bytes, 8);
    }
    if (fuzz_one_in(bytes, 3))
        settings->friction = s->gentle ? fuzz_pick(bytes, 8) : fuzz_number(bytes, s->mood);
}

static void add_joint(fuzz_bytes *bytes, scene *s)
{
    perp_joint_settings settings;
    link *l = &s->link[s->links];
    int32_t b = s->count > 0 ? fuzz_pick(bytes, s->count) : 0, a, side, k;

    choose(bytes, s, &settings);
    if (s->links == JOINTS || s->count == 0)
        return;
    a = fuzz_pick(bytes, s->count + 1);
    for (k = 0; s->gentle && k < s->links; k++) /* a tree: one joint to what came before */
        if (l[k - s->links].bodies[1] == s->bodies[b])
            return;
    if (s->gentle && a > b)
        a = s->count;
    memset(l, 0, sizeof *l);
    l->bodies[0] = s->bodies[a == s->count ? BODIES : a];
    l->bodies[1] = s->bodies[b];
    if (!fuzz_status(
            s->context,
            perp_world_add_joint(s->world, &l->joint, l->bodies[0], l->bodies[1], &settings),
            "add_joint"))
        return;
    l->kind = settings.kind;
    l->motor_force = settings.motor_force;
    l->friction = settings.friction;
    for (side = 0; side < 2; side++) {
        const perp_body_state state = read_body(s, l->bodies[side]);
        const double *anchor =
            side == 1 && l->kind == PERP_JOINT_DISTANCE ? settings.anchor_b : settings.anchor;
        double arm[3];

        for (k = 0; k < 3; k++)
            arm[k] = anchor[k] - state.position[k];
        turn(&state, arm, 1, l->anchors[side]);
        turn(&state, settings.axis, 1, l->axes[side]);
    }
    s->links++;
}

static void forget_link(scene *s, int32_t k)
{
    perp_joint_state state;

    if (perp_struct_init(&state, sizeof state) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (perp_world_get_joint(s->world, &state, s->link[k].joint) == PERP_OK)
        fuzz_fail("joints: a removed joint is refused");
    s->link[k] = s->link[--s->links];
}

static void remove_one(fuzz_bytes *bytes, scene *s)
{
    int32_t k;

    if (s->links > 0 && fuzz_one_in(bytes, 2)) {
        k = fuzz_pick(bytes, s->links);
        if (fuzz_status(s->context, perp_world_remove_joint(s->world, s->link[k].joint), "remove"))
            forget_link(s, k);
    } else if (s->count > 0) {
        const int32_t b = fuzz_pick(bytes, s->count);
        const perp_body body = s->bodies[b];

        if (!fuzz_status(s->context, perp_world_remove_body(s->world, body), "remove_body"))
            return;
        s->gentle &= b == s->count - 1; /* the order of the tree */
        s->bodies[b] = s->bodies[--s->count];
        for (k = s->links; k-- > 0;)
            if (s->link[k].bodies[0] == body || s->link[k].bodies[1] == body)
                forget_link(s, k);
    }
}

static void change(fuzz_bytes *bytes, scene *s)
{
    double x[2];
    link *l = &s->link[s->links > 0 ? fuzz_pick(bytes, s->links) : 0];

    fuzz_numbers(bytes, s->gentle ? FUZZ_MODERATE : s->mood, x, 2);
    if (s->links == 0)
        return;
    switch (fuzz_pick(bytes, 3)) {
    case 0:
        if (fuzz_status(s->context,
                        perp_world_set_joint_limits(s->world, l->joint, -fabs(x[0]), fabs(x[1])),
                        "set_joint_limits") &&
            l->kind == PERP_JOINT_DISTANCE)
            s->gentle = 0; /* no distance may do */
        break;
    case 1:
        if (fuzz_status(s->context, perp_world_set_joint_motor(s->world, l->joint, x[0], x[1]),
                        "set_joint_motor"))
            l->motor_force = x[1];
        break;
    default:
        if (fuzz_status(s->context, perp_world_set_joint_friction(s->world, l->joint, x[0]),
                        "set_joint_friction"))
            l->friction = x[0];
    }
}

static void check_pose(const link *l, const perp_body_state *states)
{
    double at[2][3], axis[2][3], apart = 0.0, askew = 0.0, along = 0.0, length = 0.0;
    int32_t side, i;

    for (side = 0; side < 2; side++) {
        place_of(&states[side], l->anchors[side], at[side]);
        turn(&states[side], l->axes[side], 0, axis[side]);
    }
    for (i = 0; i < 3; i++)
        length += axis[0][i] * axis[0][i];
    for (i = 0; i < 3; i++) {
        apart = fmax(apart, fabs(at[0][i] - at[1][i]));
        askew = fmax(askew, fabs(axis[0][i] - axis[1][i]) / sqrt(length));
        along += (at[1][i] - at[0][i]) * axis[0][i] / sqrt(length);
    }
    if ((l->kind == PERP_JOINT_BALL || l->kind == PERP_JOINT_REVOLUTE ||
         l->kind == PERP_JOINT_FIXED) &&
        apart > 1e-5)
        fuzz_fail("joints: anchors of a joint of kind %d are %g apart", l->kind, apart);
    if (l->kind != PERP_JOINT_BALL && l->kind != PERP_JOINT_DISTANCE && length > 0 && askew > 1e-5)
        fuzz_fail("joints: axes of a joint of kind %d are %g askew", l->kind, askew);
    if (l->kind == PERP_JOINT_PLANAR && length > 0 && fabs(along) > 1e-5)
        fuzz_fail("joints: a planar joint is %g off its plane", along);
}

static double length_of(const double *x)
{
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

/* The largest speed of an anchor beside the other. */
static double speed_of_anchors(const link *l, const perp_body_state *states)
{
    double sum = 0.0;
    int32_t side;

    for (side = 0; side < 2; side++)
        sum += length_of(states[side].velocity) +
               length_of(states[side].angular_velocity) * length_of(l->anchors[side]);
    return sum;
}

/* After a step of dt that counts as solved. 1e-5: sizes and speeds of a few units a step of at most
 * 0.02, and what a projection of few passes leaves; slack: 1e-9, or the root of tol where that is
 * missed. */
static void check_joint(const scene *s, const link *l, double dt, double slack)
{
    const perp_body_state states[2] = {read_body(s, l->bodies[0]), read_body(s, l->bodies[1])};
    perp_joint_state state;

    if (perp_struct_init(&state, sizeof state) != PERP_OK ||
        perp_world_get_joint(s->world, &state, l->joint) != PERP_OK)
        fuzz_fail("joints: a joint that was added can be read");
    fuzz_finite("joint position", &state.position, 1);
    fuzz_finite("joint impulse", state.impulse, 3);
    fuzz_finite("joint moment", state.moment, 3);
    if (!(fabs(state.motor_impulse) <= dt * l->motor_force * (1 + slack)) ||
        !(fabs(state.friction_impulse) <= dt * l->friction * (1 + slack)))
        fuzz_fail("joints: motor %g of %g, friction %g of %g", state.motor_impulse,
                  dt * l->motor_force, state.friction_impulse, dt * l->friction);
    /* a distance turns by the way of its ends beside it */
    if (!s->gentle || (l->kind == PERP_JOINT_DISTANCE &&
                       !(dt * speed_of_anchors(l, states) < 0.1 * fabs(state.position))))
        return;
    if (!(state.position >= state.lower - 1e-5 && state.position <= state.upper + 1e-5))
        fuzz_fail("joints: kind %d at %g is not within [%g, %g]", l->kind, state.position,
                  state.lower, state.upper);
    if (!s->planar)
        check_pose(l, states);
}

static int step(fuzz_bytes *bytes, scene *s, double dt)
{
    perp_step_result result;
    int32_t k, axis;

    (void)bytes;
    if (perp_struct_init(&result, sizeof result) != PERP_OK)
        fuzz_fail("perp_struct_init takes its own size");
    if (!fuzz_status(s->context, perp_world_step(s->world, &result, dt), "step"))
        return 0;
    if (!fuzz_good(result.outcome)) {
        s->gentle = 0;
        return 1;
    }
    if (isnan(result.residual) || !result.advanced)
        fuzz_fail("joints: '%s' with residual %g", perp_outcome_text(result.outcome),
                  result.residual);
    for (k = 0; k < s->count; k++) {
        const perp_body_state state = read_body(s, s->bodies[k]);

        fuzz_finite("position", state.position, 3);
        fuzz_finite("orientation", state.orientation, 4);
        fuzz_finite("velocity", state.velocity, 3);
        fuzz_finite("angular_velocity", state.angular_velocity, 3);
        for (axis = 0; axis < 3; axis++) /* a rod that is stretched throws its body about */
            s->gentle &= fabs(state.angular_velocity[axis]) * dt < 0.1;
    }
    for (k = 0; k < s->links; k++)
        check_joint(s, &s->link[k], dt, result.outcome == PERP_OUTCOME_SOLVED ? 1e-9 : 1e-3);
    return 1;
}

/* Save, step, restore, step: the same bits. */
static void restore(fuzz_bytes *bytes, scene *s)
{
    double first[BODIES][14], dt = 0.005 * (1 + fuzz_pick(bytes, 4));
    perp_body_state state;
    size_t size = 0;
    int32_t round, k, stepped = 0;
    char *blob;
    int gentle = s->gentle;

    if (!fuzz_status(s->context, perp_world_snapshot_size(s->world, &size), "snapshot_size") ||
        size > 100000)
        return;
    blob = fuzz_take((int32_t)size, 1);
    if (!fuzz_status(s->context, perp_world_snapshot_save(s->world, blob, size), "save"))
        return;
    for (round = 0; round < 2; round++) {
        stepped += step(bytes, s, dt);
        for (k = 0; k < s->count && stepped == round + 1; k++) {
            state = read_body(s, s->bodies[k]);
            if (round == 0)
                memcpy(first[k], state.position, sizeof first[k]);
            else if (memcmp(first[k], state.position, sizeof first[k]) != 0)
                fuzz_fail("joints: a restored world continues with the same bits");
        }
        if (round == 0 &&
            !fuzz_status(s->context, perp_world_snapshot_restore(s->world, blob, size), "restore"))
            return;
        s->gentle = round == 0 ? gentle : s->gentle;
    }
}

static void make(fuzz_bytes *bytes, scene *s)
{
    perp_world_settings settings;
    uint8_t flags = fuzz_byte(bytes);

    s->planar = flags & 1;
    s->gentle = (flags & 2) == 0;
    s->mood = s->gentle ? FUZZ_MODERATE : fuzz_mood_of(bytes);
    if (perp_world_settings_init(&settings, sizeof settings, s->planar) != PERP_OK)
        fuzz_fail("perp_world_settings_init takes its own size");
    settings.accuracy = flags >> 6;
    s->quick = s->gentle;
    if (flags & 4 && s->quick)
        settings.error = 1e-3;
    if (flags & 8)
        settings.cone = 4;
    if (flags & 16)
        settings.max_iterations = 1 + fuzz_pick(bytes, 50);
    settings.strict = (flags & 32) != 0;
    if (fuzz_status(s->context, perp_world_create(s->context, &s->world, &settings), "create"))
        s->bodies[BODIES] = perp_world_ground(s->world);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_bytes bytes = {data, data + size};
    perp_context *context = fuzz_open(&bytes, 1);
    scene s = {0};
    int32_t call;

    s.context = context;
    make(&bytes, &s);
    for (call = 0; s.world && call < CALLS && bytes.at < bytes.end; call++) {
        int mark = fuzz_mark(), what = fuzz_pick(&bytes, 16);

        if (what < 4)
            add_body(&bytes, &s);
        else if (what < 8)
            add_joint(&bytes, &s);
        else if (what < 13)
            step(&bytes, &s,
                 s.quick ? 0.005 * (1 + fuzz_pick(&bytes, 4)) : fuzz_size(&bytes, s.mood));
        else if (what == 13)
            change(&bytes, &s);
        else if (what == 14)
            remove_one(&bytes, &s);
        else
            restore(&bytes, &s);
        fuzz_drop_to(mark);
    }
    perp_world_destroy(s.world);
    fuzz_close(context);
    return 0;
}

/* Short ways to build and look at worlds in tests. Everything goes through the public interface;
 * a call that fails fails the test with the context's message. */
#ifndef PERP_TESTS_WORLD_SCENE_H
#define PERP_TESTS_WORLD_SCENE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#define GRAVITY 9.81
#define EPSILON 2.220446049250313e-16
#define PI 3.14159265358979323846

typedef struct scene {
    perp_context *context;
    perp_world *world;
    perp_body ground;
} scene;

#define SCENE_OK(s, call)                                                  \
    do {                                                                   \
        perp_status scene_status = (call);                                 \
        if (scene_status != PERP_OK)                                       \
            fail_msg("%s: %s (%s)", #call, perp_status_text(scene_status), \
                     perp_context_message((s)->context));                  \
    } while (0)

static inline void scene_create(scene *s, const perp_world_settings *settings)
{
    memset(s, 0, sizeof *s);
    assert_int_equal(perp_context_create(&s->context, NULL), PERP_OK);
    SCENE_OK(s, perp_world_create(s->context, &s->world, settings));
    s->ground = perp_world_ground(s->world);
}

/* A world with the default settings but for gravity's components. */
static inline void scene_open(scene *s, int32_t planar, double gx, double gy, double gz)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
    settings.gravity[0] = gx;
    settings.gravity[1] = gy;
    settings.gravity[2] = gz;
    scene_create(s, &settings);
}

static inline void scene_close(scene *s)
{
    perp_world_destroy(s->world);
    perp_context_destroy(s->context);
}

static inline perp_body_settings scene_defaults(void)
{
    perp_body_settings settings;

    assert_int_equal(perp_body_settings_init(&settings, sizeof settings), PERP_OK);
    return settings;
}

/* The defaults, but for mass and moments of 1, whatever the shapes. */
static inline perp_body_settings scene_settings(void)
{
    perp_body_settings settings = scene_defaults();

    settings.mass = 1.0;
    settings.inertia[0] = settings.inertia[4] = settings.inertia[8] = 1.0;
    return settings;
}

static inline perp_body scene_add(scene *s, const perp_body_settings *settings)
{
    perp_body body = 0;

    SCENE_OK(s, perp_world_add_body(s->world, &body, settings));
    assert_int_not_equal(body, 0);
    return body;
}

static inline perp_shape_settings scene_material(double friction, double restitution)
{
    perp_shape_settings settings;

    assert_int_equal(perp_shape_settings_init(&settings, sizeof settings), PERP_OK);
    settings.friction = friction;
    settings.restitution = restitution;
    return settings;
}

static inline void scene_plane(scene *s, perp_body body, double nx, double ny, double nz,
                               double offset, double friction, double restitution)
{
    perp_shape_settings settings = scene_material(friction, restitution);
    const double normal[3] = {nx, ny, nz};

    SCENE_OK(s, perp_world_add_plane(s->world, NULL, body, normal, offset, &settings));
}

static inline void scene_box(scene *s, perp_body body, double x, double y, double z,
                             double friction, double restitution)
{
    perp_shape_settings settings = scene_material(friction, restitution);
    const double half_extents[3] = {x, y, z};

    SCENE_OK(s, perp_world_add_box(s->world, NULL, body, half_extents, &settings));
}

static inline void scene_sphere(scene *s, perp_body body, double radius, double friction,
                                double restitution)
{
    perp_shape_settings settings = scene_material(friction, restitution);

    SCENE_OK(s, perp_world_add_sphere(s->world, NULL, body, radius, &settings));
}

/* A sphere of radius 0 away from the mass centre. */
static inline void scene_point(scene *s, perp_body body, double x, double y, double z,
                               double friction, double restitution)
{
    perp_shape_settings settings = scene_material(friction, restitution);

    settings.offset[0] = x;
    settings.offset[1] = y;
    settings.offset[2] = z;
    SCENE_OK(s, perp_world_add_sphere(s->world, NULL, body, 0.0, &settings));
}

static inline perp_body_state scene_state(scene *s, perp_body body)
{
    perp_body_state state;

    assert_int_equal(perp_body_state_init(&state, sizeof state), PERP_OK);
    SCENE_OK(s, perp_world_get_body(s->world, &state, body));
    return state;
}

static inline void scene_push(scene *s, perp_body body, double fx, double fy, double fz)
{
    perp_body_state state = scene_state(s, body);

    state.force[0] = fx;
    state.force[1] = fy;
    state.force[2] = fz;
    SCENE_OK(s, perp_world_set_body(s->world, &state, body));
}

/* One step that must be solved. */
static inline perp_step_result scene_step(scene *s, double h)
{
    perp_step_result result;

    assert_int_equal(perp_struct_init(&result, sizeof result), PERP_OK);
    SCENE_OK(s, perp_world_step(s->world, &result, h));
    if (result.outcome != PERP_OUTCOME_SOLVED && result.outcome != PERP_OUTCOME_ROUNDING_LIMIT)
        fail_msg("step ended with %s", perp_outcome_text(result.outcome));
    assert_int_equal(result.advanced, 1);
    return result;
}

static inline void scene_steps(scene *s, int count, double h)
{
    while (count-- > 0)
        scene_step(s, h);
}

static inline perp_world_contact scene_contact(scene *s, int32_t index)
{
    perp_world_contact contact;

    assert_int_equal(perp_struct_init(&contact, sizeof contact), PERP_OK);
    SCENE_OK(s, perp_world_get_contact(s->world, &contact, index));
    return contact;
}

static inline double scene_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* All six velocity components are exactly zero. */
static inline int scene_rests(scene *s, perp_body body)
{
    perp_body_state state = scene_state(s, body);
    int i, rests = 1;

    for (i = 0; i < 3; i++)
        rests = rests && state.velocity[i] == 0.0 && state.angular_velocity[i] == 0.0;
    return rests;
}

/* |a - b| <= bound, with both numbers in the message; NaN fails. */
static inline void scene_near(double a, double b, double bound, const char *what)
{
    if (!(fabs(a - b) <= bound))
        fail_msg("%s: %.17g, expected %.17g within %.3g, off by %.3g", what, a, b, bound,
                 fabs(a - b));
}

/* Box (or, planar, rectangle) of mass m and half extents on a slope that falls at `theta` towards
 * +x, touching it at the slope's origin; the slope has the box's friction. */
static inline perp_body scene_box_on_slope(scene *s, int32_t planar, double theta, double mass,
                                           const double *half, double friction, double speed)
{
    perp_body_settings settings = scene_settings();
    int up = planar ? 1 : 2;
    double normal[3] = {sin(theta), 0.0, 0.0};
    double down[3] = {cos(theta), 0.0, 0.0};
    perp_body body;
    int i;

    normal[up] = cos(theta);
    down[up] = -sin(theta);
    settings.mass = mass;
    settings.inertia[0] = mass * (half[1] * half[1] + half[2] * half[2]) / 3.0;
    settings.inertia[4] = mass * (half[0] * half[0] + half[2] * half[2]) / 3.0;
    settings.inertia[8] = mass * (half[0] * half[0] + half[1] * half[1]) / 3.0;
    for (i = 0; i < 3; i++) {
        settings.position[i] = normal[i] * half[up];
        settings.velocity[i] = down[i] * speed;
    }
    if (planar) {
        settings.angle = -theta;
    } else {
        settings.orientation[0] = cos(0.5 * theta);
        settings.orientation[2] = sin(0.5 * theta);
    }
    body = scene_add(s, &settings);
    scene_box(s, body, half[0], half[1], half[2], friction, 0.0);
    scene_plane(s, s->ground, normal[0], normal[1], normal[2], 0.0, friction, 0.0);
    return body;
}

#endif

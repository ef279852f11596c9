/* Short ways to joints, besides those of scene.h. */
#ifndef PERP_TESTS_WORLD_JOINT_SCENE_H
#define PERP_TESTS_WORLD_JOINT_SCENE_H

#include "world/scene.h"

static inline perp_joint_settings joint_at(int32_t kind, double x, double y, double z)
{
    perp_joint_settings settings;

    assert_int_equal(perp_joint_settings_init(&settings, sizeof settings), PERP_OK);
    settings.kind = kind;
    settings.anchor[0] = x;
    settings.anchor[1] = y;
    settings.anchor[2] = z;
    return settings;
}

static inline perp_joint_settings joint_along(int32_t kind, double ax, double ay, double az)
{
    perp_joint_settings settings = joint_at(kind, 0.0, 0.0, 0.0);

    settings.axis[0] = ax;
    settings.axis[1] = ay;
    settings.axis[2] = az;
    return settings;
}

static inline perp_joint joint_add(scene *s, perp_body a, perp_body b,
                                   const perp_joint_settings *settings)
{
    perp_joint joint = 0;

    SCENE_OK(s, perp_world_add_joint(s->world, &joint, a, b, settings));
    assert_int_not_equal(joint, 0);
    return joint;
}

static inline perp_joint_state joint_state(scene *s, perp_joint joint)
{
    perp_joint_state state;

    assert_int_equal(perp_struct_init(&state, sizeof state), PERP_OK);
    SCENE_OK(s, perp_world_get_joint(s->world, &state, joint));
    return state;
}

/* A body of the given mass and principal moments. */
static inline perp_body_settings joint_body(double mass, double i1, double i2, double i3, double x,
                                            double y, double z)
{
    perp_body_settings settings = scene_settings();

    settings.mass = mass;
    settings.inertia[0] = i1;
    settings.inertia[4] = i2;
    settings.inertia[8] = i3;
    settings.position[0] = x;
    settings.position[1] = y;
    settings.position[2] = z;
    return settings;
}

/* A world with gravity down z, or in the plane down y. */
static inline void joint_open(scene *s, int32_t planar, int32_t accuracy)
{
    perp_world_settings settings;

    assert_int_equal(perp_world_settings_init(&settings, sizeof settings, planar), PERP_OK);
    settings.accuracy = accuracy;
    scene_create(s, &settings);
}

static inline double joint_energy(scene *s)
{
    double kinetic, potential;

    SCENE_OK(s, perp_world_energy(s->world, &kinetic, &potential));
    return kinetic + potential;
}

#endif

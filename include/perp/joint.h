/* perp/joint.h: joints between two bodies of a world.
 *
 * A joint is equations C(q) = 0 between the poses of two bodies, met to rounding at every accuracy:
 * that of contacts beside them is the level's (perp/world.h). Velocities obey them at the end of
 * each step; what positions lack then is taken away without a trace in velocities; where they turn
 * by a radian and more in a step all of the world takes it in up to 64 parts. Rows exist for what
 * the kind takes away, for limits that are reached, and for a motor and friction that are there.
 *
 *   kind         takes away                        coordinate: position 0 is that of its creation
 *   ball         3 translations                    -
 *   revolute     3 translations, 2 rotations       angle about the axis, whole turns counted
 *   prismatic    2 translations, 3 rotations       way along the axis
 *   fixed        all                               -
 *   screw        2 and 2, and the way by the angle angle about the axis
 *   cylindrical  2 translations, 2 rotations       way along the axis
 *   planar       1 translation, 2 rotations        -
 *   distance     nothing but what its limits do    distance of the anchors
 *
 * In the coordinate x, with impulses in the interval of length h,
 *
 *   lower <= x <= upper      inelastic; equal limits hold x where they are
 *   motor      |r| <= h motor_force,  x' = motor_speed where |r| is less, else r as near to it as
 * that allows friction   |r| <= h friction, the same for x' = 0: a joint that sticks has velocity
 * 0.0
 *
 * A planar world has ball and revolute (both turn about z), prismatic, fixed and distance joints,
 * with axes in the plane.
 *
 * Conventions as in perp/world.h. Anchors and axes are given in the world's frame, where the bodies
 * are when the joint is added; from then on they belong to the bodies. Positive is B beside A. */
#ifndef PERP_JOINT_H
#define PERP_JOINT_H

#include <perp/base.h>
#include <perp/world.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An id by value; 0 is null. An id of something removed is recognised and refused. */
typedef uint64_t perp_joint;

/* Values never change. */
enum perp_joint_kind_value {
    PERP_JOINT_BALL = 0,
    PERP_JOINT_REVOLUTE = 1,
    PERP_JOINT_PRISMATIC = 2,
    PERP_JOINT_FIXED = 3,
    PERP_JOINT_SCREW = 4,
    PERP_JOINT_CYLINDRICAL = 5,
    PERP_JOINT_PLANAR = 6,
    PERP_JOINT_DISTANCE = 7
};

typedef struct perp_joint_settings {
    size_t struct_size;
    int32_t kind;       /* PERP_JOINT_...; default ball */
    int32_t collides;   /* 1: the two bodies may touch each other; default 0. Not of fixed: what
                           cannot move beside each other does not touch */
    double anchor[3];   /* a point that belongs to both bodies; distance: to A. Default 0 */
    double anchor_b[3]; /* distance only: the point of B */
    double axis[3];     /* not 0, normalised; default (0, 0, 1). Not of ball, fixed and distance; a
                           planar world reads that of prismatic alone */
    double pitch;       /* screw: way a turn; default 0 */
    double lower;       /* limits of the coordinate, lower <= upper; default -inf and +inf. A */
    double upper;       /* distance with the defaults keeps the length that it has */
    double motor_speed; /* any number; default 0 */
    double motor_force; /* most that it pushes or, in an angle, turns with; >= 0, +inf: its speed is
                           kept; default 0: no motor */
    double friction;    /* the same for dry friction; default 0 */
} perp_joint_settings;

/* Impulses are those of the last step; of the last part of one that was taken in parts. */
typedef struct perp_joint_state {
    size_t struct_size;
    double position;      /* coordinate; 0 for kinds without */
    double speed;         /* its rate */
    double anchor[3];     /* where it is now, on B */
    double impulse[3];    /* on B, of all rows, in the world's frame; A gets the opposite */
    double moment[3];     /* about the anchor; planar: only [2] */
    double motor_impulse; /* parts of it along the coordinate */
    double friction_impulse;
    double limit_impulse; /* > 0: the lower one presses; equal limits: either */
    int32_t at_limit;     /* -1: the lower one presses, 1: the upper one, 0 */
    int32_t reserved;
    double lower, upper, motor_speed, motor_force, friction; /* in force from the next step on */
} perp_joint_state;

/* Sets every field to its default. Returns PERP_OK; PERP_ERROR_ABI for NULL or an unknown size. */
PERP_API perp_status perp_joint_settings_init(perp_joint_settings *settings, size_t size);

/* Adds a joint between two different bodies, at least one of them dynamic.
 * Returns: PERP_OK, PERP_ERROR_ARGUMENT (a kind that a planar world has not, a zero axis, limits in
 *          the wrong order or of a kind without coordinate, ...), _NOT_FINITE, _ABI, _HANDLE, _BUSY
 *          or _MEMORY. After a failure the world is as it was.
 * Out:     joint: an id. */
PERP_API perp_status perp_world_add_joint(perp_world *world, perp_joint *joint, perp_body a,
                                          perp_body b,
                                          const perp_joint_settings *settings) PERP_WARN_UNUSED;

/* Removes a joint. Those of a body go with the body. */
PERP_API perp_status perp_world_remove_joint(perp_world *world, perp_joint joint) PERP_WARN_UNUSED;

PERP_API perp_status perp_world_get_joint(const perp_world *world, perp_joint_state *state,
                                          perp_joint joint) PERP_WARN_UNUSED;

/* Change limits, motor or friction from the next step on, as in perp_joint_settings. A coordinate
 * that is outside of new limits is put back by the projection. Snapshots hold them. */
PERP_API perp_status perp_world_set_joint_limits(perp_world *world, perp_joint joint, double lower,
                                                 double upper) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_set_joint_motor(perp_world *world, perp_joint joint,
                                                double motor_speed,
                                                double motor_force) PERP_WARN_UNUSED;
PERP_API perp_status perp_world_set_joint_friction(perp_world *world, perp_joint joint,
                                                   double friction) PERP_WARN_UNUSED;

#ifdef __cplusplus
}
#endif

#endif

/* What a joint is, inside of the world: included by world.h alone.
 *
 * Its equations C(q) = 0, their rates J v and the rate of its coordinate come from the poses of its
 * bodies (rows.c). A step puts them among the rows of its island's problem (step.c);
 * the slots below number what impulses a joint has. */
#ifndef PERP_WORLD_JOINT_H
#define PERP_WORLD_JOINT_H

#include <perp/joint.h>

enum {
    PERP__JOINT_ROWS = 6,               /* equations of a kind, at most: slots 0 .. 5 */
    PERP__SLOT_LOCK = PERP__JOINT_ROWS, /* equal limits */
    PERP__SLOT_LOWER,
    PERP__SLOT_UPPER,
    PERP__SLOT_MOTOR,
    PERP__SLOT_FRICTION,
    PERP__JOINT_SLOTS,
    PERP__JOINT_UNITS = PERP__JOINT_ROWS + 1 /* of a problem, at most */
};

/* What changes from step to step, and what a caller may change: exactly what a snapshot holds. */
typedef struct perp__joint_state {
    double lower, upper;
    double speed, force; /* motor */
    double friction;
    double coordinate; /* with whole turns */
    double warm[PERP__JOINT_SLOTS];
    perp_joint_state last; /* impulses of the last step */
} perp__joint_state;

/* A joint as it is in some poses of its bodies, or between two of them (rows.c). */
typedef struct perp__joint_view {
    int32_t count;                           /* equations */
    double rows[PERP__JOINT_ROWS + 1][2][6]; /* J of A and of B; the last: of the coordinate */
    double error[PERP__JOINT_ROWS];          /* C */
    double coordinate;                       /* with whole turns */
    double arms[2][3];                       /* from the mass centres to the anchors */
    double mean[9];                          /* B's, of its path */
    double size;                             /* of the arms */
    double rounding;                         /* of lengths */
} perp__joint_view;

typedef struct perp__joint {
    uint32_t generation;
    int32_t alive, next_free, kind, body[2];
    int32_t
        next[2]; /* in the lists of the two bodies: 1 + twice the joint's number + side; 0: end */
    int32_t collides;
    double anchors[2][3]; /* body frames */
    double axes[2][3][3]; /* axis, t1, t2, right-handed, in the body frames */
    double pitch;         /* way a radian */
    int32_t used;         /* rows of the last step */
    int32_t changed;      /* the last step left something else to start from, or to tell */
    /* of the step at hand */
    int32_t placed;                       /* by the velocities before it, 2: beside contacts */
    perp__joint_view middle;              /* between both ends of the trial motion */
    perp__joint_view end;                 /* in the next states */
    double lack, allowed;                 /* of it there, and what it may lack */
    double turning[PERP__JOINT_ROWS + 1]; /* what rows change till its end makes of velocities */
    double gap[2];                        /* lower, upper: at the start of the step */
    int32_t came[2];                      /* it moves towards them then */
    int32_t reached[2];                   /* the limits that take part */
    int8_t spare[PERP__JOINT_ROWS + 1];   /* equations, and the lock, that others say already */
    int32_t closing[2];                   /* those that were passed while it is closed */
    double impulse[PERP__JOINT_SLOTS];
    double told[2][3]; /* all of it on B, in the world's frame, and its moment about the anchor */
    double next_warm[PERP__JOINT_SLOTS];
} perp__joint;

/* The joints of a world, by slot. */
typedef struct perp__world_joints {
    perp__joint *all;
    perp__joint_state *states;
    int32_t slots, capacity, free, count;
} perp__world_joints;

/* Where a body is. */
typedef struct perp__placement {
    double position[3], rotation[9];
} perp__placement;

/* From where to where it goes in an interval, turning about one axis. What it does to a point that
 * is at R a, with the mean of its turns, is `mean` times what R a does. */
typedef struct perp__path {
    perp__placement from, to;
    double mean[9];
    double turn[9]; /* R of `to` = turn R of `from` */
    double half[9]; /* half of that turn */
    int32_t stays;  /* where it ends */
} perp__path;

/* One unit of the problem at hand: `dim` impulses of a joint from `slot` on. */
typedef struct perp__joint_unit {
    int32_t joint, slot, dim;
} perp__joint_unit;

#endif

/* Where joints are: equations, coordinates and their rates, given two poses.
 *
 * With p = x + R anchor on either body, d = p_B - p_A and body axes (n, t1, t2), the equations are
 *
 *   e . d = 0, e fixed in space,         rate e . (v_B + w_B x r_B - v_A - w_A x r_A), arms to
 *                                        the middle of p_A and p_B: d is as good as 0
 *   a . d = 0, a an axis of A,           the same, with A's arm to p_B
 *   a . b = 0, axes of A and B,          rate (a x b) . (w_A - w_B)
 *
 * and one of a screw, n . d = pitch (angle). Impulses act on both bodies in one point, so that they
 * keep angular momentum wherever that is. */
#include "world/joints/joints.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

#define TURN 6.28318530717958647692

/* Roundings of coordinates that an error of position may be made of. */
#define ROUNDING (32.0 * PERP__EPSILON)

/* Two bodies in place. */
typedef struct pair_of_poses {
    double p[2][3];       /* anchors */
    double d[3];          /* p_B - p_A */
    double long_arm[3];   /* from A's mass centre to p_B */
    double middle[2][3];  /* arms to the middle of p_A and p_B */
    double axes[2][3][3]; /* in space */
} pair_of_poses;

enum row_code {
    SPACE_X, /* e . d */
    SPACE_Y,
    SPACE_Z,
    ALONG_N, /* a . d */
    ALONG_1,
    ALONG_2,
    TILT_1, /* t1_A . n_B */
    TILT_2, /* t2_A . n_B */
    TWIST,  /* t1_A . t2_B */
    SCREW,
    END
};

static const int8_t kinds[][PERP__JOINT_ROWS + 1] = {
    {SPACE_X, SPACE_Y, SPACE_Z, END},                        /* ball */
    {SPACE_X, SPACE_Y, SPACE_Z, TILT_1, TILT_2, END},        /* revolute */
    {ALONG_1, ALONG_2, TILT_1, TILT_2, TWIST, END},          /* prismatic */
    {SPACE_X, SPACE_Y, SPACE_Z, TILT_1, TILT_2, TWIST, END}, /* fixed */
    {ALONG_1, ALONG_2, TILT_1, TILT_2, SCREW, END},          /* screw */
    {ALONG_1, ALONG_2, TILT_1, TILT_2, END},                 /* cylindrical */
    {ALONG_N, TILT_1, TILT_2, END},                          /* planar */
    {END}                                                    /* distance */
};

/* In the plane the axis of a fixed joint is x, so that a tilt is all the turning there is. */
static const int8_t planar_kinds[][PERP__JOINT_ROWS + 1] = {{SPACE_X, SPACE_Y, END},
                                                            {SPACE_X, SPACE_Y, END},
                                                            {ALONG_1, TILT_1, END},
                                                            {SPACE_X, SPACE_Y, TILT_1, END},
                                                            {END},
                                                            {END},
                                                            {END},
                                                            {END}};

int32_t perp__joint_has_coordinate(int32_t kind)
{
    return kind == PERP_JOINT_REVOLUTE || kind == PERP_JOINT_PRISMATIC ||
           kind == PERP_JOINT_SCREW || kind == PERP_JOINT_CYLINDRICAL ||
           kind == PERP_JOINT_DISTANCE;
}

static void push_row(double rows[2][6], const double *e, const double *arm_a, const double *arm_b)
{
    double moment[3];

    perp__cross(moment, arm_a, e);
    for (int32_t i = 0; i < 3; i++) {
        rows[0][i] = -e[i];
        rows[0][3 + i] = -moment[i];
    }
    perp__cross(rows[1] + 3, arm_b, e);
    perp__copy3(rows[1], e);
}

static void turn_row(double rows[2][6], const double *axis)
{
    memset(rows, 0, 12 * sizeof(double));
    perp__copy3(rows[1] + 3, axis);
    perp__add3(rows[0] + 3, -1.0, axis);
}

/* The angle nearest to where it was. */
static double angle_of(const pair_of_poses *at, double before)
{
    const double angle = atan2(perp__dot3(at->axes[0][2], at->axes[1][1]),
                               perp__dot3(at->axes[0][1], at->axes[1][1]));

    return before + remainder(angle - before, TURN);
}

static double coordinate_row(const perp__joint *joint, const pair_of_poses *at, double before,
                             perp__joint_view *view)
{
    double(*rows)[6] = view->rows[PERP__JOINT_ROWS], e[3], length;

    memset(rows, 0, 12 * sizeof(double));
    if (joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW) {
        turn_row(rows, at->axes[0][0]);
        return angle_of(at, before);
    }
    if (joint->kind == PERP_JOINT_PRISMATIC || joint->kind == PERP_JOINT_CYLINDRICAL) {
        push_row(rows, at->axes[0][0], at->long_arm, view->arms[1]);
        return perp__dot3(at->axes[0][0], at->d);
    }
    if (joint->kind != PERP_JOINT_DISTANCE)
        return 0.0;
    perp__copy3(e, at->d);
    length = perp__normalise3(e);
    if (length > 0.0)
        push_row(rows, e, view->arms[0], view->arms[1]);
    return length;
}

static double equation(const perp__joint *joint, const pair_of_poses *at, int32_t code,
                       perp__joint_view *view, double rows[2][6])
{
    static const int8_t pairs[][2] = {{1, 0}, {2, 0}, {1, 2}};
    double axis[3] = {0.0, 0.0, 0.0}, turn[2][6];

    if (code <= SPACE_Z) {
        axis[code - SPACE_X] = 1.0;
        push_row(rows, axis, at->middle[0], at->middle[1]);
        return at->d[code - SPACE_X];
    }
    if (code <= ALONG_2) {
        const double *a = at->axes[0][code - ALONG_N];

        push_row(rows, a, at->long_arm, view->arms[1]);
        return perp__dot3(a, at->d);
    }
    if (code <= TWIST) {
        const double *a = at->axes[0][pairs[code - TILT_1][0]];
        const double *b = at->axes[1][pairs[code - TILT_1][1]];

        perp__cross(axis, b, a); /* B's part of the rate is - a x b */
        turn_row(rows, axis);
        return perp__dot3(a, b);
    }
    push_row(rows, at->axes[0][0], at->long_arm, view->arms[1]);
    turn_row(turn, at->axes[0][0]);
    for (int32_t i = 3; i < 6; i++) {
        rows[0][i] -= joint->pitch * turn[0][i];
        rows[1][i] -= joint->pitch * turn[1][i];
    }
    return perp__dot3(at->axes[0][0], at->d) - joint->pitch * view->coordinate;
}

static double place_side(const perp__joint *joint, int32_t side, const perp__placement *pose,
                         pair_of_poses *at, perp__joint_view *view)
{
    perp__apply3(view->arms[side], pose->rotation, joint->anchors[side]);
    for (int32_t k = 0; k < 3; k++) {
        at->p[side][k] = pose->position[k] + view->arms[side][k];
        perp__apply3(at->axes[side][k], pose->rotation, joint->axes[side][k]);
    }
    return perp__largest3(pose->position) + perp__length3(view->arms[side]);
}

void perp__view_joint(const perp_world *world, const perp__joint *joint, double before,
                      const perp__placement poses[2], perp__joint_view *view)
{
    const int8_t *codes = (world->settings.planar ? planar_kinds : kinds)[joint->kind];
    pair_of_poses at;
    int32_t i;

    view->rounding = ROUNDING * (place_side(joint, 0, &poses[0], &at, view) +
                                 place_side(joint, 1, &poses[1], &at, view));
    view->size = perp__length3(view->arms[0]) + perp__length3(view->arms[1]);
    perp__subtract3(at.d, at.p[1], at.p[0]);
    perp__along3(at.long_arm, view->arms[0], 1.0, at.d);
    perp__along3(at.middle[0], view->arms[0], 0.5, at.d);
    perp__along3(at.middle[1], view->arms[1], -0.5, at.d);
    view->coordinate = coordinate_row(joint, &at, before, view);
    for (i = 0; codes[i] != END; i++)
        view->error[i] = equation(joint, &at, codes[i], view, view->rows[i]);
    view->count = i;
}

/* Of translations: their errors are lengths; those of turning are angles. */
int32_t perp__is_length(const perp_world *world, const perp__joint *joint, int32_t i)
{
    const int8_t code = (world->settings.planar ? planar_kinds : kinds)[joint->kind][i];

    return code < TILT_1 || code == SCREW;
}

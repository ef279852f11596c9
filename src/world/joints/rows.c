/* Where joints are: equations, coordinates and their rates.
 *
 * With p = x + R anchor on either body, d = p_B - p_A and body axes (n, t1, t2), the equations are
 *
 *   e . d = 0, e fixed in space,      a . d = 0, a an axis of A,      a . b = 0, axes of A and B,
 *
 * and one of a screw, n . d = pitch (angle). All but that and the angle are products of two numbers
 * that are linear in x and R, so that between two poses
 *
 *   a1 . b1 - a0 . b0 = (b0 + b1)/2 . (a1 - a0) + (a0 + a1)/2 . (b1 - b0)
 *
 * without any remainder; and R1 - R0 = E [t w]x R0 on a path, E = perp__path.mean. So there are
 * rows J with
 *
 *   C(q1) - C(q0) = t J v,   v the twist, the same in every frame that turns with the body,
 *
 * a discrete gradient (Gonzalez 1999): impulses J'r do no work on a motion that keeps C. They are
 * written for angular velocities as those of the body are seen from where it ends. Of a path
 * without length they are the rates of C. */
#include "world/joints/joints.h"

/* Two bodies in place, or on their ways. */
typedef struct pair_of_poses {
    const perp__path *path[2];
    double p[2][3];       /* anchors: means of both ends, as what follows */
    double d[3];          /* p_B - p_A */
    double axes[2][3][3]; /* in space */
    double ends[2][3][3]; /* axes at the end */
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

bool perp__joint_has_coordinate(int32_t kind)
{
    return kind == PERP_JOINT_REVOLUTE || kind == PERP_JOINT_PRISMATIC ||
           kind == PERP_JOINT_SCREW || kind == PERP_JOINT_CYLINDRICAL ||
           kind == PERP_JOINT_DISTANCE;
}

bool perp__has_space_axes(int32_t kind)
{
    return kinds[kind][0] == SPACE_X;
}

/* row += sign (x . change of a vector that is `end` at the end of the body's path). */
static void add_turn(double *row, const pair_of_poses *at, int32_t side, double sign,
                     const double *end, const double *x)
{
    double seen[3], moment[3];

    if (at->path[side]->stays)
        perp__copy3(seen, x);
    else
        perp__apply3(seen, at->path[side]->mean, x);
    perp__cross(moment, end, seen);
    perp__add3(row + 3, sign, moment);
}

/* e . (change of p_B - change of p_A) */
static void push_row(double rows[2][6], const pair_of_poses *at, const double *e,
                     const perp__joint_view *view)
{
    memset(rows, 0, 12 * sizeof(double));
    for (int32_t side = 0; side < 2; side++) {
        const double sign = side == 0 ? -1.0 : 1.0;

        perp__add3(rows[side], sign, e);
        add_turn(rows[side], at, side, sign, view->arms[side], e);
    }
}

/* a . d, axis k of A */
static double slide_row(double rows[2][6], const pair_of_poses *at, int32_t k,
                        const perp__joint_view *view)
{
    push_row(rows, at, at->axes[0][k], view);
    add_turn(rows[0], at, 0, 1.0, at->ends[0][k], at->d);
    return perp__dot3(at->axes[0][k], at->d);
}

/* The turn of B about n, less that of A. */
static void spin_row(double rows[2][6], const pair_of_poses *at)
{
    memset(rows, 0, 12 * sizeof(double));
    perp__add3(rows[0] + 3, -1.0, at->ends[0][0]);
    perp__copy3(rows[1] + 3, at->ends[1][0]);
}

static double coordinate_row(const perp__joint *joint, const pair_of_poses *at, double before,
                             perp__joint_view *view)
{
    double(*rows)[6] = view->rows[PERP__JOINT_ROWS], e[3], length;

    memset(rows, 0, 12 * sizeof(double));
    if (joint->kind == PERP_JOINT_REVOLUTE || joint->kind == PERP_JOINT_SCREW) {
        const double angle = atan2(perp__dot3(at->axes[0][2], at->axes[1][1]),
                                   perp__dot3(at->axes[0][1], at->axes[1][1]));

        spin_row(rows, at);
        return before +
               remainder(angle - before, 2.0 * PERP__PI); /* the angle nearest to where it was */
    }
    if (joint->kind == PERP_JOINT_PRISMATIC || joint->kind == PERP_JOINT_CYLINDRICAL)
        return slide_row(rows, at, 0, view);
    if (joint->kind != PERP_JOINT_DISTANCE)
        return 0.0;
    for (int32_t k = 0; k < 3; k++) /* what hangs upright does so but for rounding */
        e[k] = fabs(at->d[k]) > view->rounding ? at->d[k] : 0.0;
    length = perp__normalise3(e);
    if (length > 0.0)
        push_row(rows, at, e, view);
    return length;
}

static double equation(const perp__joint *joint, const pair_of_poses *at, int32_t code,
                       perp__joint_view *view, double rows[2][6])
{
    static const int8_t pairs[][2] = {{1, 0}, {2, 0}, {1, 2}};
    double axis[3] = {0.0, 0.0, 0.0}, turn[2][6], error;

    if (code <= SPACE_Z) {
        axis[code - SPACE_X] = 1.0;
        push_row(rows, at, axis, view);
        return at->d[code - SPACE_X];
    }
    if (code <= ALONG_2)
        return slide_row(rows, at, code - ALONG_N, view);
    if (code <= TWIST) {
        const int32_t i = pairs[code - TILT_1][0], j = pairs[code - TILT_1][1];

        memset(rows, 0, 12 * sizeof(double));
        add_turn(rows[0], at, 0, 1.0, at->ends[0][i], at->axes[1][j]);
        add_turn(rows[1], at, 1, 1.0, at->ends[1][j], at->axes[0][i]);
        return perp__dot3(at->axes[0][i], at->axes[1][j]);
    }
    error = slide_row(rows, at, 0, view) - joint->pitch * view->coordinate;
    spin_row(turn, at);
    for (int32_t side = 0; side < 2; side++)
        perp__add3(rows[side] + 3, -joint->pitch, turn[side] + 3);
    return error;
}

static double place_side(const perp__joint *joint, int32_t side, const perp__path *path,
                         pair_of_poses *at, perp__joint_view *view)
{
    const double *anchor = joint->anchors[side];
    double arm[3];

    at->path[side] = path;
    perp__apply3(view->arms[side], path->to.rotation, anchor);
    for (int32_t k = 0; k < 3; k++)
        perp__apply3(at->ends[side][k], path->to.rotation, joint->axes[side][k]);
    if (path->stays) {
        for (int32_t k = 0; k < 3; k++)
            at->p[side][k] = path->to.position[k] + view->arms[side][k];
        memcpy(at->axes[side], at->ends[side], sizeof at->axes[side]);
        return perp__largest3(path->to.position) + perp__length3(view->arms[side]);
    }
    perp__apply3(arm, path->from.rotation, anchor);
    for (int32_t k = 0; k < 3; k++) {
        double from[3];

        at->p[side][k] = 0.5 * ((path->from.position[k] + arm[k]) +
                                (path->to.position[k] + view->arms[side][k]));
        perp__apply3(from, path->from.rotation, joint->axes[side][k]);
        for (int32_t i = 0; i < 3; i++)
            at->axes[side][k][i] = 0.5 * (from[i] + at->ends[side][k][i]);
    }
    return perp__largest3(path->to.position) + perp__length3(view->arms[side]);
}

void perp__view_joint(const perp_world *world, const perp__joint *joint, double before,
                      const perp__path *const paths[2], bool equations, perp__joint_view *view)
{
    const int8_t *codes = (world->settings.planar ? planar_kinds : kinds)[joint->kind];
    pair_of_poses at;
    int32_t i;

    view->rounding = PERP__SUM_ROUNDING * (place_side(joint, 0, paths[0], &at, view) +
                                           place_side(joint, 1, paths[1], &at, view));
    view->size = perp__length3(view->arms[0]) + perp__length3(view->arms[1]);
    memcpy(view->mean, paths[1]->mean, sizeof view->mean);
    perp__subtract3(at.d, at.p[1], at.p[0]);
    view->coordinate = coordinate_row(joint, &at, before, view);
    for (i = 0; equations && codes[i] != END; i++)
        view->error[i] = equation(joint, &at, codes[i], view, view->rows[i]);
    view->count = i;
}

void perp__view_placed(const perp_world *world, const perp__joint *joint, double before,
                       const perp__placement places[2], bool equations, perp__joint_view *view)
{
    perp__path paths[2];

    paths[0].to = places[0];
    paths[1].to = places[1];
    paths[0].stays = paths[1].stays = 1;
    memset(paths[1].mean, 0, sizeof paths[1].mean);
    paths[1].mean[0] = paths[1].mean[4] = paths[1].mean[8] = 1.0;
    perp__view_joint(world, joint, before, (const perp__path *const[2]){&paths[0], &paths[1]},
                     equations, view);
}

/* Of translations: their errors are lengths; those of turning are angles. */
bool perp__is_length(const perp_world *world, const perp__joint *joint, int32_t i)
{
    const int8_t code = (world->settings.planar ? planar_kinds : kinds)[joint->kind][i];

    return code < TILT_1 || code == SCREW;
}

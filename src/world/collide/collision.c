/* The pose in which two shapes meet on their way.
 *
 * Shapes are apart as long as one axis separates them; the last axis to close is the normal of the
 * collision. Boxes: along a fixed direction the separation of bodies that go straight is linear in
 * time, so that each axis gives the interval in which it does not separate, and the shapes meet at
 * the first time that lies in all of them. Bodies that turn do so in steps of STRIDE, and each time
 * found is looked at again in the pose there. Of balls the line between the closest points is such
 * an axis: their distance is a convex function of time, and to go as far as an axis says is
 * Newton's method, which comes to its first zero from below.
 *
 * Axes along which shapes touch at the start are gates: they close only where the motion presses by
 * more than grazing. A box that slides over flush tiles is kept from the next one by its bottom,
 * which nothing presses, also while its front passes the tile's side. */
#include "world/collide/collision.h"

#include <float.h>
#include <string.h>

#include "world/collide/polytope.h"
#include "linalg/spatial.h"

/* Radians between two looks at the axes. */
#define STRIDE 0.125

/* After so many, which one corner that stays and another that comes down can need for next to no
 * way, the end of the stretch is looked at, and the closing found from both sides. */
#define MANY_LOOKS 16

void perp__moved(const perp__moving *shape, double t, perp__placed *placed)
{
    const perp__placed *start = shape->start;
    double offset[3];
    placed->geometry = start->geometry;
    if (t == 0.0 || perp__is_zero3(shape->turn)) {
        perp__along3(placed->position, start->position, t, shape->displacement);
        memcpy(placed->rotation, start->rotation, sizeof placed->rotation);
        return;
    }
    double turn[3] = {t * shape->turn[0], t * shape->turn[1], t * shape->turn[2]}, R[9];
    perp__turn_matrix(R, turn);
    perp__multiply3(placed->rotation, R, start->rotation);
    perp__subtract3(offset, start->position, shape->centre);
    perp__apply3(placed->position, R, offset);
    for (int k = 0; k < 3; k++)
        placed->position[k] += shape->centre[k] + t * shape->displacement[k];
}

/* No less than the length, and cheap. */
static double sum(const double *x)
{
    return fabs(x[0]) + fabs(x[1]) + fabs(x[2]);
}

double perp__relative_displacement(const perp__moving *a, const perp__moving *b)
{
    double displacement[3];
    perp__subtract3(displacement, b->displacement, a->displacement);
    return sum(displacement) + sum(a->turn) * a->reach + sum(b->turn) * b->reach;
}

bool perp__axes_of(const perp__placed *a, const perp__placed *b, int32_t planar, double far,
                   perp__axes *axes)
{
    perp__convex_pair pair;
    bool all = 1;
    if (perp__are_boxes(a, b, planar)) {
        perp__box_axes(a, b, far, axes);
    } else if (perp__is_ball_pair(a, b)) {
        perp__ball_axes(a, b, planar, axes);
    } else {
        perp__convex_pair_set(&pair, a, b, planar);
        return perp__convex_axes(&pair, far, axes);
    }
    for (int k = 0; k < axes->faces[0] + axes->faces[1] && all; k++)
        all = !(axes->axis[k].separation > far);
    return all;
}

/* An axis is told apart from another one if they differ by more than the motion turns them. Of
 * those that are not the face of the shape that turns less is the normal: it has it all the way. */
static int32_t steadier_face(const perp__moving *a, const perp__moving *b, const perp__axes *axes,
                             int32_t best)
{
    const double turn_a = sum(a->turn), turn_b = sum(b->turn);
    const int32_t first = turn_a <= turn_b ? 0 : axes->faces[0];
    const int32_t end = first + axes->faces[turn_a <= turn_b ? 0 : 1];
    int32_t steadier = -1;
    if (turn_a == turn_b || (best >= first && best < end) || axes->count == 0)
        return best;
    for (int32_t k = first; k < end; k++) {
        double apart[3];
        perp__subtract3(apart, axes->axis[k].normal, axes->axis[best].normal);
        if (axes->axis[k].separation > 0.0 && perp__length3(apart) <= turn_a + turn_b &&
            (steadier < 0 || axes->axis[k].separation > axes->axis[steadier].separation))
            steadier = k;
    }
    return steadier < 0 ? best : steadier;
}

bool perp__touch_plainly(const perp__moving *moving_a, const perp__moving *moving_b, int32_t planar,
                         const perp__touch_tolerance *tolerance, const perp__axes *axes,
                         perp__collision *collision)
{
    const perp__placed *a = moving_a->start, *b = moving_b->start;
    const double due = perp__relative_displacement(moving_a, moving_b) + tolerance->touching;
    int32_t best = perp__last_to_close(a, b, axes, NULL);
    const perp__axis *axis;

    collision->time = 0.0;
    collision->axis = collision->doubtful = 0;
    if (axes->axis[best].separation > tolerance->touching)
        return 0;
    if (axes->axis[best].separation > tolerance->rounding)
        best = steadier_face(moving_a, moving_b, axes, best);
    axis = &axes->axis[best];
    collision->axis = axis->number;
    if (axis->number == PERP__CLOSEST_AXIS) /* a rim, unless nothing has one */
        return axis->separation < -tolerance->touching || axes->faces[0] + axes->faces[1] == 0 ||
               (a->geometry->radius > 0.0 && b->geometry->radius > 0.0);
    const double deep = axis->separation < -tolerance->touching ? due : tolerance->touching;
    const double aside = perp__separation_aside(a, b, planar, axes, best, -2.0 * due, -deep);
    collision->doubtful = -aside < due;
    return axis->separation < -tolerance->touching ||
           (axis->separation <= tolerance->touching && aside < -tolerance->touching);
}

/* A gate closes where the separation falls below minus this. `grazing` 0: the gate without what a
 * motion may close of it, for the time at which shapes that do press on have met. */
static double gate_of(double separation, const perp__touch_tolerance *tolerance, double grazing)
{
    if (fabs(separation) > tolerance->touching)
        return 0.0;
    return fmax(-separation, 0.0) + grazing;
}

/* The share of the stretch in which a separation that goes from `first` to `last` is closed. */
static void narrow(double first, double last, double *enter, double *leave)
{
    if (first > 0.0 && last >= 0.0)
        *enter = INFINITY;
    else if (first > 0.0)
        *enter = fmax(*enter, first / (first - last));
    else if (last > 0.0)
        *leave = fmin(*leave, first / (first - last));
}

/* Two shapes on their way, with the gates of their axes. */
typedef struct course {
    const perp__moving *a, *b;
    const perp__touch_tolerance *tolerance;
    int32_t planar, turning;
    double gate[PERP__MAX_AXES];
    double bare[PERP__MAX_AXES]; /* gates without what a motion may close of them */
    double frame[2][9];          /* A's and B's, at the time looked at last */
    perp__axes axes;             /* then, in A's frame */
    int32_t last;                /* of them to close */
} course;

/* The separation along axis k at the end of a stretch in which the centres go so far `way`, and in
 * `against` that in the other direction where a box B may have passed to A's other side. Between
 * both ends it counts as straight. That is wrong by the turn times the way for a face's axis that
 * turns with its shape, by the turn times the shape's reach for one that stays. */
static double separation_at(const course *on, int32_t k, double way, const perp__placed *a,
                            const perp__placed *b, double *against)
{
    const perp__axis *axis = &on->axes.axis[k];
    const bool of_a = k < on->axes.faces[0],
               of_b = !of_a && k - on->axes.faces[0] < on->axes.faces[1];
    double normal[3], between[3], local[3];
    perp__apply3(normal, of_a && way < on->a->reach ? a->rotation : on->frame[0], axis->normal);
    if (of_b && way < on->b->reach) {
        perp__apply_transposed3(local, on->frame[1], normal);
        perp__apply3(normal, b->rotation, local);
    }
    const double along = perp__separation(a, b, normal);
    perp__subtract3(between, b->position, a->position);
    *against = -INFINITY;
    if (along < 0.0 && axis->width < INFINITY && perp__dot3(normal, between) < 0.0) {
        for (int m = 0; m < 3; m++)
            normal[m] = -normal[m];
        *against = perp__separation(a, b, normal);
    }
    return along;
}

/* The time in [t, end] at which the shapes meet if they keep the axes of time t; INFINITY if they
 * don't: the last to close tells so most often. What bodies that do not turn go is free of the
 * rounding of their places. */
static double entry_of(const course *on, const double *gate, double t, double end)
{
    const perp__axes *axes = &on->axes;
    const int32_t first = on->last < axes->count ? on->last : 0;
    perp__placed a, b;
    double enter = 0.0, leave = 1.0, world[3], displacement[3];
    perp__subtract3(world, on->b->displacement, on->a->displacement);
    perp__apply_transposed3(displacement, on->a->start->rotation, world);
    if (on->turning) {
        perp__moved(on->a, end, &a);
        perp__moved(on->b, end, &b);
    }
    for (int32_t i = 0; i < axes->count && enter <= leave; i++) {
        const int32_t k = i == 0 ? first : i == first ? 0 : i;
        const perp__axis *axis = &axes->axis[k];
        if (axis->separation == -INFINITY)
            continue;
        double along = axis->separation + (end - t) * perp__dot3(axis->normal, displacement);
        double against = -along - 2.0 * axis->width;
        if (on->turning)
            along = separation_at(on, k, (end - t) * perp__length3(world), &a, &b, &against);
        narrow(axis->separation + gate[k], along + gate[k], &enter, &leave);
        if (against > 0.0) /* B has passed to A's other side */
            narrow(-axis->separation - 2.0 * axis->width, against, &enter, &leave);
    }
    return enter <= leave && enter <= 1.0 ? t + enter * (end - t) : INFINITY;
}

static bool axes_at(course *on, double t, double far)
{
    perp__placed a, b;
    perp__moved(on->a, t, &a);
    perp__moved(on->b, t, &b);
    memcpy(on->frame[0], a.rotation, sizeof a.rotation);
    memcpy(on->frame[1], b.rotation, sizeof b.rotation);
    return perp__axes_of(&a, &b, on->planar, far, &on->axes);
}

/* What the last axis to close lacks at time t. */
static double look_at(course *on, double t)
{
    (void)axes_at(on, t, INFINITY);
    on->last = perp__last_to_close(on->a->start, on->b->start, &on->axes, on->gate);
    return on->axes.axis[on->last].separation + on->gate[on->last];
}

/* The time between `open` and `closed` at which the last axis closes: false position, halved where
 * one end stays (the Illinois rule). */
static double find_closing(course *on, double open, double closed)
{
    double at_open, at_closed, deep;
    int side = 0; /* that came last */
    at_open = look_at(on, open);
    if (at_open <= 0.0) /* in each other from the start */
        return open;
    at_closed = deep = look_at(on, closed);
    for (int look = 0; look < DBL_MANT_DIG && deep < -on->tolerance->rounding; look++) {
        double t = open + (closed - open) * (at_open / (at_open - at_closed));
        double lacks = look_at(on, t);
        if (lacks > 0.0) {
            open = t;
            at_open = lacks;
            at_closed *= side > 0 ? 0.5 : 1.0;
            side = 1;
        } else {
            if (closed == t)
                break;
            closed = t;
            at_closed = deep = lacks;
            at_open *= side < 0 ? 0.5 : 1.0;
            side = -1;
        }
    }
    look_at(on, closed);
    return closed;
}

/* Looks at the axes of the start, sets their gates; whether a face keeps shapes apart all along. */
static bool set_out(course *on, const perp__moving *a, const perp__moving *b, int32_t planar,
                    const perp__touch_tolerance *tolerance)
{
    on->a = a;
    on->b = b;
    on->tolerance = tolerance;
    on->planar = planar;
    if (!axes_at(on, 0.0, perp__relative_displacement(a, b) + tolerance->touching))
        return 1;
    for (int32_t k = on->axes.count; k < PERP__BOX_AXES; k++) /* edges that are parallel now */
        on->gate[k] = on->bare[k] = 0.0;
    for (int32_t k = 0; k < on->axes.count; k++) {
        on->gate[k] = gate_of(on->axes.axis[k].separation, tolerance, tolerance->grazing);
        on->bare[k] = gate_of(on->axes.axis[k].separation, tolerance, 0.0);
    }
    on->last = perp__last_to_close(a->start, b->start, &on->axes, on->gate);
    return 0;
}

/* The shapes meet at time t along the axis that was the last to close. Those that go straight have
 * met without what the gates kept of it before; but the edges of shapes other than boxes are not
 * all among their axes. */
static void set_collision(course *on, double t, perp__collision *collision)
{
    const bool boxes = perp__are_boxes(on->a->start, on->b->start, on->planar);
    perp__placed a, b;
    double due;
    perp__moved(on->a, t, &a);
    perp__moved(on->b, t, &b);
    collision->axis = on->axes.axis[on->last].number;
    due = perp__relative_displacement(on->a, on->b) + on->tolerance->touching;
    collision->doubtful =
        -perp__separation_aside(&a, &b, on->planar, &on->axes, on->last, -due, -due) < due;
    if (!on->turning && (on->gate[on->last] != 0.0 || boxes)) {
        (void)axes_at(on, 0.0, INFINITY);
        t = fmin(t, entry_of(on, on->bare, 0.0, 1.0));
    }
    collision->time = t;
}

/* Fixed axes close before those that turn, and come nearer to their time by a share only: where the
 * last one to close goes by its rate, the next look is when that closes it; and as long as it can't
 * have closed nothing meets, for one axis that separates is enough. */
int32_t perp__find_collision(const perp__moving *a, const perp__moving *b, int32_t planar,
                             const perp__touch_tolerance *tolerance, perp__collision *collision)
{
    const double angle = perp__length3(a->turn) + perp__length3(b->turn);
    const double displacement = perp__relative_displacement(a, b);
    /* what passes a round shape closely comes nearer by half in each look */
    const double still_share =
        perp__are_boxes(a->start, b->start, planar) ? PERP__NEGLIGIBLE : 4.0 * DBL_EPSILON;
    double t = 0.0, lacks = -INFINITY, due = INFINITY, free = 0.0;
    int32_t met = 0, ends, look;
    double between[3], bend; /* half of what the rate of a separation may change by in the step */
    course on;               /* large: what is not used stays as it is */
    perp__subtract3(between, b->start->position, a->start->position);
    bend =
        angle * (displacement + 0.5 * angle * (sum(between) + a->reach + b->reach + displacement));
    on.turning = angle > 0.0;
    ends = set_out(&on, a, b, planar, tolerance);
    for (look = 0; look < PERP__MAX_LOOKS && t < 1.0 && !met && !ends; look++) {
        const double last = t, before = lacks;
        const int32_t axis = on.last;

        /* 1. the next look: before they meet, or turn by STRIDE; the looks must last to the end */
        const double share = fmax(STRIDE / angle, (1.0 - t) / (PERP__MAX_LOOKS - look));
        const double end = angle > 0.0 ? fmin(1.0, t + share) : 1.0;
        const double most = fmin(lacks, on.axes.axis[on.last].width); /* not through the other */
        double entry = t + due;
        if (free >= end - t)
            entry = INFINITY;
        else if (!(entry <= end && bend * due * due <= most))
            entry = fmax(entry_of(&on, on.gate, t, end), t + free);
        if (entry == INFINITY && end >= 1.0)
            break;
        const int still = entry != INFINITY && entry - t <= still_share * (end - t);
        t = entry == INFINITY ? end : entry;

        /* 2. they have met if the last axis lacks nothing then; or, after many looks, at the end */
        lacks = look_at(&on, t);
        met = still || lacks <= tolerance->rounding;
        if (met && angle > 0.0 && lacks < -tolerance->rounding) {
            t = find_closing(&on, last, t);
        } else if (!met && look % MANY_LOOKS == MANY_LOOKS - 1) {
            met = look_at(&on, end) < -tolerance->rounding;
            if (met)
                t = find_closing(&on, t, end);
            else
                look_at(&on, t);
        }

        /* 3. when the axis is due by its rate; and how long it is open for sure: what lacks so
         * much, closed at a rate that grows no faster than by 2 bend */
        const bool goes_on = !met && on.turning && on.last == axis && look > 0;
        double rate = goes_on ? (before - lacks) / (t - last) : 0.0;
        due = rate > 0.0 ? lacks / rate : INFINITY;
        rate += bend * (t - last);
        free = goes_on ? 2.0 * lacks / (rate + sqrt(rate * rate + 4.0 * bend * lacks)) : 0.0;
    }
    if (met)
        set_collision(&on, t, collision);
    return met ? 1 : look == PERP__MAX_LOOKS && t < 1.0 ? -1 : 0;
}

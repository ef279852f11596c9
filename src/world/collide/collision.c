/* The pose in which two shapes meet on their way.
 *
 * Shapes are apart as long as one axis separates them; the last axis to close is the normal of the
 * collision. Boxes: along a fixed direction the separation of bodies that go straight is linear in
 * time, so that each axis gives the interval in which it does not separate, and the shapes meet at
 * the first time that lies in all of them. Bodies that turn do so in steps of STRIDE, and each time
 * found is looked at again in the pose there. Balls: the distance of a point that goes straight
 * from a convex shape is a convex function of time, so Newton's method comes to its first zero from
 * below.
 *
 * Axes along which shapes touch at the start are gates: they close only where the motion presses by
 * more than grazing. A box that slides over flush tiles is kept from the next one by its bottom,
 * which nothing presses, also while its front passes the tile's side. */
#include "world/collide/collision.h"

#include <float.h>
#include <string.h>

#include "world/collide/box.h"
#include "world/collide/convex.h"
#include "linalg/spatial.h"

/* Radians between two looks at the axes. */
#define STRIDE 0.125

#define MAX_LOOKS 160

/* After so many, which one corner that stays and another that comes down can need for next to no
 * way, the end of the stretch is looked at, and the closing found from both sides. */
#define MANY_LOOKS 16
#define HALVINGS 12

/* How far the way of a ball may bend between two looks, in terms of the smaller shape. */
#define BEND 1e-3
#define MAX_REFINEMENTS 20

/* Cosine of the angle from which on two axes count as different directions. */
#define ASIDE 0.9

void perp__moved(const perp__moving *shape, double t, perp__placed *placed)
{
    const perp__placed *start = shape->start;
    double offset[3];
    placed->geometry = start->geometry;
    if (perp__is_zero3(shape->turn)) {
        perp__along3(placed->position, start->position, t, shape->displacement);
        memcpy(placed->rotation, start->rotation, sizeof placed->rotation);
        return;
    }
    double turn[3] = {t * shape->turn[0], t * shape->turn[1], t * shape->turn[2]}, q[4], R[9];
    perp__quaternion_exponential(q, turn);
    perp__quaternion_matrix(R, q);
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

static int32_t stay_apart(const perp__moving *a, const perp__moving *b,
                          const perp__collision *collision)
{
    double displacement[3];
    perp__subtract3(displacement, b->displacement, a->displacement);
    return perp__stay_apart(collision->apart, collision->lead, displacement,
                            sum(a->turn) * a->reach + sum(b->turn) * b->reach);
}

static int32_t are_boxes(const perp__placed *a, const perp__placed *b)
{
    return a->geometry->kind == PERP__BOX && b->geometry->kind == PERP__BOX;
}

/* What the files of balls do: a ball against a ball or a box. */
static int32_t is_ball_pair(const perp__placed *a, const perp__placed *b)
{
    const int32_t kind_a = a->geometry->kind, kind_b = b->geometry->kind;
    return kind_a <= PERP__SPHERE && kind_b <= PERP__SPHERE && !are_boxes(a, b);
}

void perp__axes_of(const perp__placed *a, const perp__placed *b, int32_t planar, perp__axes *axes)
{
    perp__convex_pair pair;
    axes->faces[0] = axes->faces[1] = axes->count = 0;
    if (is_ball_pair(a, b))
        return;
    if (are_boxes(a, b)) {
        perp__box_axes(a, b, planar, axes);
        return;
    }
    perp__convex_pair_set(&pair, a, b, planar);
    perp__convex_axes(&pair, axes);
}

/* How far one axis alone decides: the largest separation, of cores, along other directions than
 * `best`. */
static double separation_aside(const perp__placed *a, const perp__placed *b, int32_t planar,
                               const perp__axes *axes, int32_t best)
{
    double largest = -INFINITY;
    perp__convex_pair pair;
    if (!are_boxes(a, b)) {
        perp__convex_pair_set(&pair, a, b, planar);
        return perp__convex_aside(&pair, axes, best);
    }
    for (int32_t k = 0; k < axes->count; k++)
        if (axes->axis[k].separation > largest &&
            fabs(perp__dot3(axes->axis[k].normal, axes->axis[best].normal)) < ASIDE)
            largest = axes->axis[k].separation;
    return largest;
}

/* The centre of a ball in the frame of a box, and its way out: the closest point's direction. */
static void centre_in_box(const perp__placed *box, const perp__placed *ball, double *centre)
{
    double between[3];
    perp__subtract3(between, ball->position, box->position);
    if (box->geometry->kind == PERP__BOX)
        perp__apply_transposed3(centre, box->rotation, between);
    else /* a ball has no frame: its turning is nothing */
        perp__copy3(centre, between);
}

/* Distance of a point from a box (negative inside: to the next face) and its gradient. */
static double box_distance(const double *half, int dimension, const double *centre,
                           double *gradient, double *aside)
{
    double inside = -INFINITY;
    int out = 0, next = 0;
    for (int j = 0; j < 3; j++)
        gradient[j] = 0.0;
    *aside = INFINITY;
    for (int j = 0; j < dimension; j++) {
        double beyond = fabs(centre[j]) - half[j];
        if (beyond > 0.0) {
            gradient[j] = centre[j] < 0.0 ? -beyond : beyond;
            out++;
        } else {
            *aside = fmin(*aside, -beyond);
        }
        if (beyond > inside) {
            inside = beyond;
            next = j;
        }
    }
    if (out > 1)
        *aside = 0.0;
    if (out > 0)
        return perp__normalise3(gradient);
    gradient[next] = centre[next] < 0.0 ? -1.0 : 1.0;
    return inside;
}

static int32_t are_rounded(const perp__placed *a, const perp__placed *b)
{
    return a->geometry->radius > 0.0 && b->geometry->radius > 0.0;
}

int32_t perp__touch_plainly(const perp__moving *moving_a, const perp__moving *moving_b,
                            int32_t planar, const perp__nearness *near, perp__collision *collision)
{
    const perp__placed *a = moving_a->start, *b = moving_b->start;
    int32_t kind_a = a->geometry->kind, kind_b = b->geometry->kind;
    collision->time = 0.0;
    collision->axis = collision->doubtful = 0;
    if (kind_a == PERP__SPHERE && kind_b == PERP__SPHERE) {
        double between[3];
        perp__subtract3(between, b->position, a->position);
        double reach = a->geometry->radius + b->geometry->radius + near->touching;
        return perp__dot3(between, between) <= reach * reach;
    }
    if (!is_ball_pair(a, b)) {
        perp__axes axes;
        perp__axes_of(a, b, planar, &axes);
        int32_t best = perp__last_to_close(a, b, &axes, NULL);
        const perp__axis *axis = &axes.axis[best];
        if (axis->separation > near->touching)
            return 0;
        collision->axis = axis->number;
        if (axis->number == PERP__CLOSEST_AXIS) /* a rim, unless nothing has one */
            return axis->separation < -near->touching || are_rounded(a, b);
        double aside = separation_aside(a, b, planar, &axes, best);
        collision->doubtful =
            -aside < perp__relative_displacement(moving_a, moving_b) + near->touching;
        return axis->separation < -near->touching ||
               (axis->separation <= near->touching && aside < -near->touching);
    }
    const perp__placed *box = kind_a == PERP__BOX ? a : b, *ball = kind_a == PERP__BOX ? b : a;
    double centre[3], gradient[3], aside;
    centre_in_box(box, ball, centre);
    double gap =
        box_distance(box->geometry->half_extents, planar ? 2 : 3, centre, gradient, &aside) -
        ball->geometry->radius;
    return gap < -near->touching || (gap <= near->touching && aside > near->touching);
}

/* A gate closes where the separation falls below minus this. `grazing` 0: the gate without what a
 * motion may close of it, for the time at which shapes that do press on have met. */
static double gate_of(double separation, const perp__nearness *near, double grazing)
{
    if (fabs(separation) > near->touching)
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
    const perp__moving *a;
    const perp__moving *b;
    int32_t planar;
    int32_t turning;
    double gate[PERP__MAX_AXES];
    double frame[9]; /* A's, at the time looked at last */
    perp__axes axes; /* then, in that frame */
    int32_t last;    /* of them to close */
} course;

/* The separation along an axis at the end of a stretch, and in `against` that in the other
 * direction where B may have passed to A's other side; boxes lie about their places. */
static double separation_at(const course *on, const perp__axis *axis, const perp__placed *a,
                            const perp__placed *b, double *against)
{
    double normal[3], between[3];
    perp__apply3(normal, on->frame, axis->normal);
    const double along = perp__separation(a, b, normal);
    perp__subtract3(between, b->position, a->position);
    *against = -INFINITY;
    if (along < 0.0 && axis->width < INFINITY &&
        (perp__dot3(normal, between) < 0.0 || !are_boxes(a, b))) {
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
            along = separation_at(on, axis, &a, &b, &against);
        narrow(axis->separation + gate[k], along + gate[k], &enter, &leave);
        if (against > 0.0) /* B has passed to A's other side */
            narrow(-axis->separation - 2.0 * axis->width, against, &enter, &leave);
    }
    return enter <= leave && enter <= 1.0 ? t + enter * (end - t) : INFINITY;
}

static void axes_at(course *on, double t)
{
    perp__placed a, b;
    perp__moved(on->a, t, &a);
    perp__moved(on->b, t, &b);
    memcpy(on->frame, a.rotation, sizeof on->frame);
    perp__axes_of(&a, &b, on->planar, &on->axes);
}

/* What the last axis to close lacks at time t. */
static double look_at(course *on, double t)
{
    axes_at(on, t);
    on->last = perp__last_to_close(on->a->start, on->b->start, &on->axes, on->gate);
    return on->axes.axis[on->last].separation + on->gate[on->last];
}

/* The time between `open` and `closed` at which the last axis closes: false position, halved where
 * one end stays (the Illinois rule). */
static double find_closing(course *on, double open, double closed, double rounding)
{
    double at_open = look_at(on, open), at_closed, deep;
    int side = 0;       /* that came last */
    if (at_open <= 0.0) /* in each other from the start */
        return open;
    at_closed = deep = look_at(on, closed);
    for (int look = 0; look < MAX_REFINEMENTS && deep < -rounding; look++) {
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

/* The same where what the last axis lacks has a kink between the two. */
static double halve(course *on, double open, double closed, double rounding)
{
    for (int look = 0; look < HALVINGS; look++) {
        const double t = 0.5 * (open + closed);

        *(look_at(on, t) > 0.0 ? &open : &closed) = t;
    }
    return find_closing(on, open, closed, rounding);
}

/* Whether one of the axes of the start keeps the shapes apart all the way. */
static int32_t one_axis_keeps(const course *on, const perp__nearness *near,
                              perp__collision *collision)
{
    int32_t kept = 0;
    for (int32_t k = 0; k < on->axes.count && !kept; k++) {
        const perp__axis *axis = &on->axes.axis[k];
        if (!(axis->separation > near->touching))
            continue;
        collision->lead = axis->separation - near->touching;
        perp__apply3(collision->apart, on->frame, axis->normal);
        kept = stay_apart(on->a, on->b, collision);
    }
    return kept;
}

/* The time at which shapes that go straight have met, without what the gates kept of it. The edges
 * of shapes other than boxes are not all among their axes. */
static double time_without_gates(course *on, const double *bare, double t)
{
    if (on->turning || (on->gate[on->last] == 0.0 && !are_boxes(on->a->start, on->b->start)))
        return t;
    axes_at(on, 0.0);
    return fmin(t, entry_of(on, bare, 0.0, 1.0));
}

/* The gates of the axes of the start, and those without what a motion may close of them. */
static void set_gates(course *on, const perp__nearness *near, double *bare)
{
    for (int32_t k = on->axes.count; k < PERP__BOX_AXES; k++) /* edges that are parallel now */
        on->gate[k] = bare[k] = 0.0;
    for (int32_t k = 0; k < on->axes.count; k++) {
        on->gate[k] = gate_of(on->axes.axis[k].separation, near, near->grazing);
        bare[k] = gate_of(on->axes.axis[k].separation, near, 0.0);
    }
    on->last = perp__last_to_close(on->a->start, on->b->start, &on->axes, on->gate);
}

static void set_collision(course *on, double t, const double *bare, const perp__nearness *near,
                          perp__collision *collision)
{
    perp__placed a, b;
    perp__moved(on->a, t, &a);
    perp__moved(on->b, t, &b);
    collision->axis = on->axes.axis[on->last].number;
    collision->doubtful = -separation_aside(&a, &b, on->planar, &on->axes, on->last) <
                          perp__relative_displacement(on->a, on->b) + near->touching;
    collision->time = time_without_gates(on, bare, t);
}

/* Half of what the rate of a separation may change by in the step, along an axis that turns. */
static double bend_of(const perp__moving *a, const perp__moving *b, double angle)
{
    const double displacement = perp__relative_displacement(a, b);
    double between[3];

    perp__subtract3(between, b->start->position, a->start->position);
    return angle *
           (displacement + 0.5 * angle * (sum(between) + a->reach + b->reach + displacement));
}

/* No less than `lacks`, closed at a rate that grows no faster than by 2 bend, is open so long. */
static double free_time(double lacks, double rate, double bend)
{
    return 2.0 * lacks / (rate + sqrt(rate * rate + 4.0 * bend * lacks));
}

/* Fixed axes close before those that turn, and come nearer to their time by a share only: where the
 * last one to close goes by its rate, the next look is when that closes it; and as long as it can't
 * have closed nothing meets, for one axis that separates is enough. */
static int32_t collide_along_axes(const perp__moving *a, const perp__moving *b, int32_t planar,
                                  const perp__nearness *near, perp__collision *collision)
{
    course on;
    double bare[PERP__MAX_AXES], t = 0.0, lacks = -INFINITY, due = INFINITY, free = 0.0;
    const double angle = perp__length3(a->turn) + perp__length3(b->turn);
    const double bend = bend_of(a, b, angle);
    /* what passes a round shape closely comes nearer by half in each look */
    const double still_share = are_boxes(a->start, b->start) ? 1e-9 : 4.0 * DBL_EPSILON;
    on.a = a;
    on.b = b;
    on.planar = planar;
    on.turning = angle > 0.0;
    axes_at(&on, 0.0);
    if (one_axis_keeps(&on, near, collision))
        return 0;
    set_gates(&on, near, bare);
    for (int look = 0; look < MAX_LOOKS && t < 1.0; look++) {
        const double last = t, before = lacks;
        const int32_t axis = on.last;
        double end = angle > 0.0 ? fmin(1.0, t + STRIDE / angle) : 1.0;
        const double most = fmin(lacks, on.axes.axis[on.last].width); /* not through the other */
        double entry = t + due;
        if (free >= end - t)
            entry = INFINITY;
        else if (!(entry <= end && bend * due * due <= most))
            entry = fmax(entry_of(&on, on.gate, t, end), t + free);
        if (entry == INFINITY && end >= 1.0)
            return 0;
        int still = entry == INFINITY ? 0 : entry - t <= still_share * (end - t);
        t = entry == INFINITY ? end : entry;
        lacks = look_at(&on, t);
        if (still || lacks <= near->rounding) {
            if (angle > 0.0 && lacks < -near->rounding)
                t = find_closing(&on, last, t, near->rounding);
            set_collision(&on, t, bare, near, collision);
            return 1;
        }
        if (look % MANY_LOOKS == MANY_LOOKS - 1) {
            if (look_at(&on, end) < -near->rounding) {
                t = halve(&on, t, end, near->rounding);
                set_collision(&on, t, bare, near, collision);
                return 1;
            }
            look_at(&on, t);
        }
        due = INFINITY;
        free = 0.0;
        if (on.turning && on.last == axis && look > 0) {
            const double rate = (before - lacks) / (t - last);

            if (rate > 0.0)
                due = lacks / rate;
            free = free_time(lacks, rate + bend * (t - last), bend);
        }
    }
    return 0;
}

/* Newton's method for the first time in [t, end] at which a point on its way from `from` by `way`
 * comes within `radius` of the box with the half extents `half`; faces are gates. */
static double ball_entry(const double *half, int dimension, double radius, const double *from,
                         const double *displacement, const double *gates, double rounding)
{
    double t = 0.0, leave = 1.0;
    for (int j = 0; j < dimension; j++)
        for (int side = 0; side < 2; side++) {
            double sign = side ? 1.0 : -1.0, gate = gates[2 * j + side];
            double first = sign * from[j] - half[j] - radius + gate;
            narrow(first, first + sign * displacement[j], &t, &leave);
        }
    for (int look = 0; look < MAX_LOOKS && t <= leave; look++) {
        double at[3], gradient[3], aside;
        perp__along3(at, from, t, displacement);
        double gap = box_distance(half, dimension, at, gradient, &aside) - radius + gates[6];
        double rate = -perp__dot3(gradient, displacement);
        if (!(rate > 0.0))
            return INFINITY;
        if (gap <= rounding)
            return t;
        t += gap / rate;
    }
    return INFINITY;
}

/* The share of the step in which the ball's way in the frame of the box leaves its chord by little:
 * c = R' (d + t x) bends by (2 |turn| |x| + |turn|^2 |d|) / 8. */
static double ball_stride(const perp__moving *a, const perp__moving *b, const double *from)
{
    double turn = sum(a->turn) + sum(b->turn), displacement = perp__relative_displacement(a, b);
    double bend = 0.125 * turn * (2.0 * displacement + turn * (sum(from) + displacement));
    double least = BEND * fmin(a->reach, b->reach);
    return fmax(bend > least ? sqrt(least / bend) : 1.0, 1.0 / MAX_LOOKS);
}

/* Ball `b` and box or ball `a`; a ball is a box without extent, but round. */
static int32_t collide_ball(const perp__moving *a, const perp__moving *b, int32_t planar,
                            const perp__nearness *near, perp__collision *collision)
{
    static const double none[3] = {0.0, 0.0, 0.0};
    int boxed = a->start->geometry->kind == PERP__BOX, dimension = planar ? 2 : 3;
    const double *half = boxed ? a->start->geometry->half_extents : none;
    double radius = b->start->geometry->radius + (boxed ? 0.0 : a->start->geometry->radius);
    double angle = perp__length3(a->turn) + perp__length3(b->turn);
    double gates[7] = {0.0}, bare[7] = {0.0}, from[3], gradient[3], aside, t = 0.0;

    centre_in_box(a->start, b->start, from);
    double distance = box_distance(half, dimension, from, gradient, &aside) - radius;
    if (distance > near->touching) {
        collision->lead = distance - near->touching;
        if (boxed)
            perp__apply3(collision->apart, a->start->rotation, gradient);
        else
            perp__copy3(collision->apart, gradient);
        if (stay_apart(a, b, collision))
            return 0;
    }
    for (int k = 0; k < 7; k++) {
        if (k < 6 && (!boxed || k / 2 >= dimension))
            continue;
        double separation = distance;
        if (k < 6)
            separation = (k % 2 ? from[k / 2] : -from[k / 2]) - half[k / 2] - radius;
        gates[k] = gate_of(separation, near, near->grazing);
        bare[k] = gate_of(separation, near, 0.0);
    }
    double stride = boxed ? ball_stride(a, b, from) : 1.0;
    while (t < 1.0) {
        double end = fmin(1.0, t + stride);
        perp__placed later_a, later_b;
        double to[3], displacement[3];
        perp__moved(a, end, &later_a);
        perp__moved(b, end, &later_b);
        centre_in_box(&later_a, &later_b, to);
        perp__subtract3(displacement, to, from);
        if (angle == 0.0) {
            double world[3];
            perp__subtract3(world, b->displacement, a->displacement);
            if (boxed)
                perp__apply_transposed3(displacement, a->start->rotation, world);
            else
                perp__copy3(displacement, world);
        }
        double entry =
            ball_entry(half, dimension, radius, from, displacement, gates, near->rounding);
        if (entry <= 1.0) {
            double at[3];
            entry = fmin(entry, ball_entry(half, dimension, radius, from, displacement, bare,
                                           near->rounding));
            perp__along3(at, from, entry, displacement);
            box_distance(half, dimension, at, gradient, &aside);
            collision->time = t + entry * (end - t);
            collision->axis = 0;
            collision->doubtful =
                boxed && aside < perp__relative_displacement(a, b) + near->touching;
            return 1;
        }
        t = end;
        memcpy(from, to, sizeof from);
    }
    return 0;
}

int32_t perp__find_collision(const perp__moving *a, const perp__moving *b, int32_t planar,
                             const perp__nearness *near, perp__collision *collision)
{
    if (!is_ball_pair(a->start, b->start))
        return collide_along_axes(a, b, planar, near, collision);
    if (b->start->geometry->kind == PERP__SPHERE)
        return collide_ball(a, b, planar, near, collision);
    int met = collide_ball(b, a, planar, near, collision);
    for (int k = 0; k < 3; k++) /* from A to B */
        collision->apart[k] = -collision->apart[k];
    return met;
}

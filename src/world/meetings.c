/* Which pairs touch or meet, and in which points.
 *
 * A pair meets with the normal of the axis that closes last, unless what meets there is covered: a
 * tile's side is no wall where the next tile stands before it. Bodies that turn sink into their
 * neighbours by terms of second order, so that a corner can come to lie beside such a face; then
 * the next axis whose face lies open is the normal. */
#include "world/step.h"

#include "linalg/spatial.h"

#define RELATIVE_SLACK 1e-9

/* A gap is a difference of coordinates: this many units of rounding of the largest of them. */
#define GAP_ROUNDING (64.0 * PERP__EPSILON)

/* By how much of its way a motion may close shapes that touch without pressing. */
#define RELATIVE_GRAZING 1e-6

/* A face is covered where what lies before it is nearer than this share of the shape's thickness.
 */
#define CRACK 1e-4

/* Directions whose cosine lacks less than the square of this are one. */
#define SUPPORT 1e-6

/* Along a face's normal shapes overlap by less than this share of their thickness if it is the one
 * that they meet with. */
#define SHALLOW 0.6

static double rounding_of(const perp_world *world, int32_t shape)
{
    const double *x = world->placed[shape].position;
    double largest = perp__largest3(x);

    return GAP_ROUNDING *
           (largest + world->shapes[shape].radius + fabs(world->shapes[shape].geometry.offset));
}

double perp__pair_rounding(const perp_world *world, const perp__pair *pair)
{
    return rounding_of(world, pair->first) + rounding_of(world, pair->second);
}

double perp__pair_size(const perp_world *world, const perp__pair *pair)
{
    return world->bodies[world->shapes[pair->first].body].radius +
           world->bodies[world->shapes[pair->second].body].radius;
}

/* The thickness of the thinner shape; 0 for points before half-spaces. */
static double size_of(const perp_world *world, const perp__pair *pair)
{
    double size =
        perp__lesser(world->shapes[pair->first].thickness, world->shapes[pair->second].thickness);

    return isfinite(size) ? size : 0.0;
}

static perp__nearness nearness_of(const perp_world *world, const perp__pair *pair, double way)
{
    double rounding = perp__pair_rounding(world, pair);
    perp__nearness near;

    near.touching = RELATIVE_SLACK * size_of(world, pair) + rounding;
    near.grazing = rounding + RELATIVE_GRAZING * way;
    near.rounding = rounding;
    return near;
}

static int32_t has_plane(const perp_world *world, const perp__pair *pair)
{
    return world->shapes[pair->first].geometry.kind == PERP__PLANE ||
           world->shapes[pair->second].geometry.kind == PERP__PLANE;
}

/* Whether the spheres about two shapes are within `margin` of each other. */
int32_t perp__are_near(const perp_world *world, const perp__pair *pair, double margin)
{
    const double *a = world->placed[pair->first].position;
    const double *b = world->placed[pair->second].position;
    const double between[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double reach =
        world->shapes[pair->first].radius + world->shapes[pair->second].radius + margin;

    return has_plane(world, pair) || perp__dot3(between, between) <= reach * reach ||
           !isfinite(reach * reach);
}

/* A ball in its body's centre does not. */
static int32_t rotates(const perp__shape *shape)
{
    return shape->geometry.kind != PERP__SPHERE || !perp__is_zero3(shape->offset);
}

/* A shape on the way of its body's motion. */
perp__moving perp__moving_shape(const perp_world *world, int32_t shape, double h)
{
    const perp__shape *at = &world->shapes[shape];
    const perp__motion *motion = &world->motions[at->body];
    const int32_t turning = rotates(at);
    perp__moving moving;

    moving.start = &world->placed[shape];
    perp__copy3(moving.centre, world->states[at->body].position);
    for (int32_t k = 0; k < 3; k++) {
        moving.way[k] = h * motion->moving[k];
        moving.turn[k] = turning ? h * motion->moving[3 + k] : 0.0;
    }
    moving.reach = at->reach;
    return moving;
}

/* Whether the motion closes a point, with the normal at the start, of a half-space and another. */
static int32_t reaches_plane(const perp_world *world, const perp__moving *a, const perp__moving *b)
{
    perp__point points[PERP__MAX_POINTS];
    int32_t made =
        perp__collide(a->start, b->start, world->settings.planar, perp__relative_way(a, b), points);

    for (int32_t i = 0; i < made; i++) {
        double arm[2][3], turned[2][3], gap = points[i].gap;

        for (int32_t k = 0; k < 3; k++) {
            arm[0][k] = points[i].position[k] - a->centre[k];
            arm[1][k] = points[i].position[k] - b->centre[k];
        }
        perp__cross(turned[0], a->turn, arm[0]);
        perp__cross(turned[1], b->turn, arm[1]);
        for (int32_t k = 0; k < 3; k++)
            gap += points[i].normal[k] * ((b->way[k] + turned[1][k]) - (a->way[k] + turned[0][k]));
        if (gap < 0.0)
            return 1;
    }
    return 0;
}

/* ---- what is covered ---- */

/* Whether another shape near `shape` than `owner` holds the point. */
static int32_t is_held(const perp_world *world, int32_t shape, int32_t owner, const double *point,
                       double h, double t, double depth)
{
    int32_t link = world->shapes[shape].first_link;

    while (link >= 0) {
        const perp__pair *pair = &world->pairs[link / 2];
        const int32_t other = link % 2 ? pair->first : pair->second;
        const perp__moving moving = perp__moving_shape(world, other, h);
        perp__placed placed;

        link = pair->next[link % 2];
        if (other == owner)
            continue;
        perp__moved(&moving, t, &placed);
        if (perp__holds(&placed, point, depth))
            return 1;
    }
    return 0;
}

/* Whether one of the faces of `owner`, within `rim` of `position`, that make its normal there is
 * covered there by another shape near `shape`. One face alone is open unless the meeting is
 * doubtful. Lists of what never moves may be long: they are read for bodies of many shapes only. */
static int32_t is_covered(const perp_world *world, int32_t owner, int32_t shape,
                          const perp__placed *at, const double *position, const double *normal,
                          double rim, int32_t doubtful, double crack, double h, double t)
{
    double probes[PERP__MAX_PROBES][3];
    int32_t faces;

    if (!perp__is_dynamic(world, world->shapes[shape].body) &&
        world->bodies[world->shapes[owner].body].shapes < 2)
        return 0;
    faces = perp__probe_faces(at, world->settings.planar, position, normal, rim, doubtful ? 1 : 2,
                              crack, probes);
    for (int32_t i = 0; i < faces; i++)
        if (is_held(world, shape, owner, probes[i], h, t, 0.25 * crack))
            return 1;
    return 0;
}

/* Whether either surface is covered where the points lie deepest; or on the whole: in the middle of
 * them all. */
static int32_t are_covered(const perp_world *world, const perp__pair *pair,
                           const perp__placed *at_a, const perp__placed *at_b,
                           const perp__point *points, int32_t count, int32_t doubtful,
                           int32_t whole, double h, double t, const perp__nearness *near)
{
    const double crack = CRACK * size_of(world, pair) + near->rounding;
    const double *n = points[0].normal, back[3] = {-n[0], -n[1], -n[2]};
    double least = INFINITY, middle[3] = {0.0, 0.0, 0.0}, share = 0.0, rim;

    for (int32_t i = 0; i < count; i++)
        least = fmin(least, points[i].gap);
    for (int32_t i = 0; i < count; i++)
        if (whole || points[i].gap <= least + near->touching) {
            perp__add3(middle, 1.0, points[i].position);
            share += 1.0;
        }
    for (int32_t k = 0; k < 3; k++)
        middle[k] /= share;
    rim = crack + fabs(least);
    return is_covered(world, pair->first, pair->second, at_a, middle, n, rim, doubtful || whole,
                      crack, h, t) ||
           is_covered(world, pair->second, pair->first, at_b, middle, back, rim, doubtful || whole,
                      crack, h, t);
}

/* The face axis of largest separation, at least `least`, that is another direction than `covered`,
 * in the frame of A; -1 if there is none. It is taken off the list. */
static int32_t next_face(perp__axes *axes, const double *covered, double least)
{
    int32_t best = -1;

    for (int32_t k = 0; k < axes->faces[0] + axes->faces[1]; k++)
        if (axes->axis[k].separation > -INFINITY && axes->axis[k].separation >= least &&
            fabs(perp__dot3(axes->axis[k].normal, covered)) < 1.0 - SUPPORT * SUPPORT &&
            (best < 0 || axes->axis[k].separation > axes->axis[best].separation))
            best = k;
    if (best >= 0)
        axes->axis[best].separation = -INFINITY;
    return best;
}

/* The points of a meeting; -1 where they do not lie open. */
static int32_t points_along(const perp_world *world, const perp__pair *pair,
                            const perp__meeting *meeting, int32_t whole, double h,
                            const perp__nearness *near, perp__point *points)
{
    const perp__moving a = perp__moving_shape(world, pair->first, h);
    const perp__moving b = perp__moving_shape(world, pair->second, h);
    perp__placed at_a, at_b;
    int32_t made;

    perp__moved(&a, meeting->time, &at_a);
    perp__moved(&b, meeting->time, &at_b);
    made = perp__collide_along(&at_a, &at_b, world->settings.planar, meeting->axis, points);
    return made > 0 && are_covered(world, pair, &at_a, &at_b, points, made, meeting->doubtful,
                                   whole, h, meeting->time, near)
               ? -1
               : made;
}

/* The points over the next face that lies open, in the poses at `later`, to which the meeting is
 * moved. Returns how many, 0 if all is covered. */
static int32_t points_of_faces(const perp_world *world, const perp__pair *pair,
                               perp__meeting *meeting, double later, const double *covered,
                               double least, int32_t whole, double h, const perp__nearness *near,
                               perp__point *points)
{
    const perp__moving a = perp__moving_shape(world, pair->first, h);
    const perp__moving b = perp__moving_shape(world, pair->second, h);
    perp__meeting next = *meeting;
    perp__placed at_a, at_b;
    perp__axes axes;
    double own[3];
    int32_t made = 0;

    perp__moved(&a, later, &at_a);
    perp__moved(&b, later, &at_b);
    perp__apply_transposed3(own, at_a.rotation, covered);
    perp__axes_of(&at_a, &at_b, world->settings.planar, &axes);
    next.time = later;
    next.doubtful = 1;
    while (made <= 0 && (next.axis = next_face(&axes, own, least)) >= 0)
        made = points_along(world, pair, &next, whole, h, near, points);
    if (made <= 0)
        return 0;
    meeting->axis = next.axis;
    meeting->time = later;
    return made;
}

/* The points along the axis of `meeting`, if they lie open; else over the next face that does. Of
 * bricks that sink a little into what they stand on the rims of all faces are covered: those by
 * which the shapes hardly overlap are met before any other one all the same, if their middle lies
 * open. Returns how many, 0 if all is covered. */
static int32_t open_points(const perp_world *world, const perp__pair *pair, perp__meeting *meeting,
                           double later, double h, const perp__nearness *near, perp__point *points)
{
    const double least = -SHALLOW * size_of(world, pair);
    double covered[3];
    int32_t made = points_along(world, pair, meeting, 0, h, near, points);

    if (made >= 0)
        return made;
    perp__copy3(covered, points[0].normal);
    made = points_of_faces(world, pair, meeting, later, covered, least, 0, h, near, points);
    if (made == 0)
        made = points_along(world, pair, meeting, 1, h, near, points);
    if (made <= 0)
        made = points_of_faces(world, pair, meeting, later, covered, least, 1, h, near, points);
    if (made == 0)
        made = points_of_faces(world, pair, meeting, later, covered, -INFINITY, 0, h, near, points);
    return made;
}

/* ---- pairs ---- */

/* The normal along which the pair pressed in the last step; NULL if it did not. */
static const double *pressed_along(const perp_world *world, const perp__pair *pair)
{
    for (int32_t i = pair->first_kept; i >= 0; i = world->kept[i].next)
        if (!perp__is_zero3(world->kept[i].memory.impulse))
            return world->kept[i].memory.normal;
    for (int32_t i = 0; i < pair->memories; i++)
        if (!perp__is_zero3(world->memories[pair->first_memory + i].impulse))
            return world->memories[pair->first_memory + i].normal;
    return NULL;
}

/* Whether the shapes touch plainly; or pressed in the last step, are no farther apart than `far`,
 * and have one normal only or hardly move: what lies on others leaves them by as much as a step is
 * wrong, and would be met again in rounds, layer after layer. */
static int32_t touch_plainly(const perp_world *world, perp__pair *pair, const perp__moving *a,
                             const perp__moving *b, const perp__nearness *near, double far)
{
    const int32_t planar = world->settings.planar;
    const int32_t round =
        a->start->geometry->kind == PERP__SPHERE && b->start->geometry->kind == PERP__SPHERE;
    perp__nearness wide = *near;

    if (perp__touch_plainly(a, b, planar, near, &pair->meeting))
        return 1;
    pair->plain = 0;
    wide.touching = far;
    return far > near->touching && (round || perp__relative_way(a, b) <= far) &&
           pressed_along(world, pair) && perp__touch_plainly(a, b, planar, &wide, &pair->meeting);
}

static int32_t is_still(const perp_world *world, int32_t shape)
{
    const perp__state *state = &world->states[world->shapes[shape].body];

    return perp__is_zero3(state->velocity) && perp__is_zero3(state->angular_velocity);
}

/* Whether shapes that touch, and do not move, pressed in the last step along an axis that they
 * still have: where several keep them apart, nothing yet says that it is another one. */
static int32_t presses_on(const perp_world *world, perp__pair *pair, const perp__moving *a,
                          const perp__moving *b, double far)
{
    const double *normal = pressed_along(world, pair);
    perp__axes axes;
    double own[3];

    if (!normal || !is_still(world, pair->first) || !is_still(world, pair->second))
        return 0;
    perp__axes_of(a->start, b->start, world->settings.planar, &axes);
    perp__apply_transposed3(own, a->start->rotation, normal);
    for (int32_t k = 0; k < axes.count; k++)
        if (fabs(axes.axis[k].separation) <= far &&
            fabs(perp__dot3(axes.axis[k].normal, own)) >= 1.0 - SUPPORT * SUPPORT) {
            pair->meeting.axis = axes.axis[k].number;
            pair->meeting.time = 0.0;
            pair->meeting.doubtful = 1;
            return 1;
        }
    return 0;
}

int32_t perp__touching_points(const perp_world *world, perp__pair *pair, double h, double far,
                              perp__point *points)
{
    const perp__moving a = perp__moving_shape(world, pair->first, h);
    const perp__moving b = perp__moving_shape(world, pair->second, h);
    const double way = perp__relative_way(&a, &b);
    const perp__nearness near = nearness_of(world, pair, way);
    const int32_t planar = world->settings.planar;
    int32_t made;
    const double sizes = perp__pair_size(world, pair);

    pair->meeting.lead = 0.0;
    pair->plain = 1;
    if (!perp__are_near(world, pair, perp__greater(near.touching, PERP__NEAR * sizes)))
        return 0;
    if (has_plane(world, pair)) { /* one normal at any distance: near ones come at once */
        const double due =
            perp__greater(perp__lesser(PERP__NEAR * sizes, 2.0 * way), near.touching);

        made = perp__collide(a.start, b.start, planar, perp__greater(far, due), points);
        for (int32_t i = 0; i < made; i++)
            if (points[i].gap <= due)
                return made;
        return 0;
    }
    if (!touch_plainly(world, pair, &a, &b, &near, PERP__NEAR * sizes) &&
        !presses_on(world, pair, &a, &b, PERP__NEAR * sizes))
        return 0;
    return open_points(world, pair, &pair->meeting, 0.0, h, &near, points);
}

/* What turning adds to the way of a shape's points, at most. */
static double turning_of(const perp_world *world, const perp__shape *shape, double h)
{
    const double *spin = world->motions[shape->body].moving + 3;

    return rotates(shape) ? h * (fabs(spin[0]) + fabs(spin[1]) + fabs(spin[2])) * shape->reach
                          : 0.0;
}

/* Whether the plane that was found between the two before does for this motion too. */
static int32_t still_apart(const perp_world *world, const perp__pair *pair, double h)
{
    const perp__shape *a = &world->shapes[pair->first], *b = &world->shapes[pair->second];
    const double *from = world->motions[a->body].moving, *to = world->motions[b->body].moving;
    const double way[3] = {h * to[0] - h * from[0], h * to[1] - h * from[1],
                           h * to[2] - h * from[2]};

    return perp__stay_apart(&pair->meeting, way, turning_of(world, a, h) + turning_of(world, b, h));
}

/* What keeps the spheres about two shapes apart. */
static void note_lead(const perp_world *world, perp__pair *pair, double touching)
{
    const perp__shape *a = &world->shapes[pair->first], *b = &world->shapes[pair->second];
    double *apart = pair->meeting.apart;

    perp__subtract3(apart, world->placed[pair->second].position,
                    world->placed[pair->first].position);
    pair->meeting.lead = fmax(perp__normalise3(apart) - (a->radius + b->radius) - touching, 0.0);
}

int32_t perp__pair_meets(const perp_world *world, perp__pair *pair, double h)
{
    perp__moving a, b;
    perp__nearness near;
    double way;

    if (pair->meeting.lead > 0.0 && still_apart(world, pair, h))
        return 0;
    a = perp__moving_shape(world, pair->first, h);
    b = perp__moving_shape(world, pair->second, h);
    way = perp__relative_way(&a, &b);
    near = nearness_of(world, pair, way);
    if (!perp__are_near(world, pair, way + near.touching)) {
        note_lead(world, pair, near.touching);
        return 0;
    }
    if (has_plane(world, pair)) {
        pair->meeting.time = 0.0;
        pair->meeting.doubtful = 0;
        return reaches_plane(world, &a, &b);
    }
    return perp__meet(&a, &b, world->settings.planar, &near, &pair->meeting);
}

int32_t perp__meeting_points(const perp_world *world, perp__pair *pair, double h,
                             perp__point *points)
{
    const perp__moving a = perp__moving_shape(world, pair->first, h);
    const perp__moving b = perp__moving_shape(world, pair->second, h);
    const perp__nearness near = nearness_of(world, pair, perp__relative_way(&a, &b));

    return open_points(world, pair, &pair->meeting, 1.0, h, &near, points);
}

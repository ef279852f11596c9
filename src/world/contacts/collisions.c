/* Which pairs touch or meet, and in which points.
 *
 * A pair meets with the normal of the axis that closes last, unless what meets there is covered: a
 * tile's side is no wall where the next tile stands before it. Bodies that turn sink into their
 * neighbours by terms of second order, so that a corner can come to lie beside such a face; then
 * the next axis whose face lies open is the normal. */
#include "world/step.h"

#include <float.h>

/* A face is covered where what lies before it is nearer than this share of its thickness. */
#define CRACK 1e-4

/* Along a face's normal shapes overlap by less than this share of their thickness if it is the one
 * that they meet with: what a turn of a third of a radian in a step sinks corners by. A deeper face
 * would part shapes by all that they reach over each other, which may be half of their length. */
#define SHALLOW 0.05

/* ---- what is covered ---- */

/* Which of the points another shape near `shape` than `owner` holds, at the share t of the step:
 * bit i for point i; one of them at least, or `all` that are held. */
static uint32_t held_points(const perp_world *world, int32_t shape, int32_t owner,
                            const double points[][3], int32_t count, double h, double t,
                            double depth, bool all)
{
    int32_t link = world->shapes.all[shape].first_link;
    uint32_t held = 0;

    while (link >= 0 && (all ? held != (1u << count) - 1u : !held && count > 0)) {
        const perp__pair *pair = &world->pairs.all[link / 2];
        const int32_t side = 1 - link % 2, other = side == 0 ? pair->first : pair->second;
        const double *v = world->step.motions[pair->body[side]].moving;
        const perp__placed *there = &world->step.placed[other];
        double between[3], reach = there->radius;
        perp__placed placed;

        link = pair->next[link % 2];
        if (other == owner)
            continue;
        if (t > 0.0)
            reach += h * (fabs(v[0]) + fabs(v[1]) + fabs(v[2])) +
                     perp__turning(world, pair->body[side], pair->reach[side], h);
        for (int32_t i = 0; i < count; i++) {
            perp__subtract3(between, points[i], world->step.placed[other].position);
            if (held >> i & 1u || perp__dot3(between, between) > reach * reach)
                continue; /* or it comes nowhere near the point */
            if (t > 0.0 && there != &placed) {
                perp__moving moving;

                perp__moving_shape(world, other, h, &moving);
                perp__moved(&moving, t, &placed);
                there = &placed;
            }
            if (perp__holds(there, points[i], depth))
                held |= 1u << i;
        }
    }
    return held;
}

/* A pair in its motion, and where the points of its collision go. */
typedef struct encounter {
    const perp_world *world;
    const perp__pair *pair;
    double h;
    perp__moving a, b;
    double displacement; /* of the two beside each other */
    perp__touch_tolerance tolerance;
    perp__point *points;
} encounter;

static void begin_encounter(encounter *e, const perp_world *world, const perp__pair *pair, double h,
                            perp__point *points)
{
    e->world = world;
    e->pair = pair;
    e->h = h;
    e->points = points;
    perp__moving_shape(world, pair->first, h, &e->a);
    perp__moving_shape(world, pair->second, h, &e->b);
    e->displacement = perp__relative_displacement(&e->a, &e->b);
    e->tolerance.rounding = perp__pair_rounding(world, pair);
    e->tolerance.touching = perp__pair_touching(world, pair, e->tolerance.rounding);
    e->tolerance.grazing = e->tolerance.rounding + PERP__PARALLEL * e->displacement;
}

/* Whether one of the faces of `owner` that make the footing's normal is covered there, at the share
 * t of the step, by another shape near `shape`. On the whole an edge is open if one of its faces is
 * and the shapes overlap along that by more than the thickness: none came in through it. Lists of
 * what never moves may be long: they are read for bodies of many shapes only. */
static bool is_covered(const encounter *e, const perp__footing *at, double t, int32_t owner,
                       int32_t shape, const perp__placed *placed, const perp__placed *beside,
                       bool whole)
{
    const perp_world *world = e->world;
    double probes[PERP__MAX_PROBES][3], normals[PERP__MAX_PROBES][3];
    uint32_t held;
    int32_t faces;

    if (!perp__is_dynamic(world, world->shapes.all[shape].body) &&
        world->bodies.all[world->shapes.all[owner].body].shapes < 2)
        return 0;
    faces = perp__probe_faces(placed, at, probes, normals);
    held = held_points(world, shape, owner, (const double(*)[3])probes, faces, e->h, t,
                       0.25 * at->crack, whole);
    for (int32_t i = 0; i < faces && whole; i++)
        if (!(held >> i & 1u) &&
            perp__separation(placed, beside, normals[i]) < -perp__pair_thickness(world, e->pair))
            return 0;
    return held != 0;
}

/* Whether either surface is covered where the points lie deepest; or on the whole: in the middle of
 * them all. One face alone is open unless the collision is doubtful. */
static bool are_covered(const encounter *e, const perp__collision *collision, bool whole,
                        const perp__placed *a, const perp__placed *b, int32_t count)
{
    const perp__point *points = e->points;
    const double *n = points[0].normal, back[3] = {-n[0], -n[1], -n[2]};
    double position[3] = {0.0, 0.0, 0.0}, least = INFINITY, share = 0.0;
    perp__footing at = {.position = position,
                        .normal = n,
                        .crack =
                            CRACK * perp__pair_thickness(e->world, e->pair) + e->tolerance.rounding,
                        .planar = e->world->settings.planar,
                        .least = collision->doubtful || whole ? 1 : 2};

    for (int32_t i = 0; i < count; i++)
        least = fmin(least, points[i].gap);
    for (int32_t i = 0; i < count; i++)
        if (whole || points[i].gap <= least + e->tolerance.touching) {
            perp__add3(position, 1.0, points[i].position);
            share += 1.0;
        }
    for (int32_t k = 0; k < 3; k++)
        position[k] /= share;
    at.rim = at.crack + fabs(least);
    if (is_covered(e, &at, collision->time, e->pair->first, e->pair->second, a, b, whole))
        return 1;
    at.normal = back;
    return is_covered(e, &at, collision->time, e->pair->second, e->pair->first, b, a, whole);
}

/* Where points have to lie open: where they are deepest, in the middle of them all, or nowhere. */
typedef enum asked { AT_DEEPEST, ON_THE_WHOLE, NOT_AT_ALL } asked;

/* The points of a collision; -1 where they do not lie open. */
static int32_t points_along(const encounter *e, const perp__collision *collision, asked where)
{
    perp__placed a, b;
    int32_t made;

    perp__moved(&e->a, collision->time, &a);
    perp__moved(&e->b, collision->time, &b);
    made = perp__collide_along(&a, &b, e->world->settings.planar, collision->axis, e->points);
    if (collision->axis == PERP__MIDDLE_AXIS) /* at rest, and closed by what all others leave */
        return made;
    if (made > 0 && where != NOT_AT_ALL &&
        are_covered(e, collision, where == ON_THE_WHOLE, &a, &b, made))
        made = -1;
    return made;
}

/* Which shape's face an axis is. */
typedef enum face_of { FIRST, SECOND, EDGES } face_of;

static face_of face_owner(const perp__axes *axes, int32_t k)
{
    return k < axes->faces[0] ? FIRST : k < axes->faces[0] + axes->faces[1] ? SECOND : EDGES;
}

/* Whether the shapes came in along a normal that they have at the share t of the step: as it lay
 * before they moved in the shape that has this face, of edges in one of the two, they overlap along
 * it by no more than `begun` and the thickness. A thin shape that another one is half-way through
 * overlaps it least along any way aside, which leads past neither. */
static bool came_along(const encounter *e, double t, const double *normal, face_of owner,
                       double begun)
{
    const perp__moving *shape[2] = {&e->a, &e->b};

    for (int32_t side = 0; side < 2; side++) {
        double local[3], before[3];
        perp__placed later;

        if (owner != EDGES && owner != (face_of)side)
            continue;
        perp__moved(shape[side], t, &later);
        perp__apply_transposed3(local, later.rotation, normal);
        perp__apply3(before, shape[side]->start->rotation, local);
        if (perp__separation(e->a.start, e->b.start, before) >=
            begun - perp__pair_thickness(e->world, e->pair))
            return 1;
    }
    return 0;
}

/* The points over the next face that lies open, of those with a separation of at least `least` and
 * another normal than `covered`, in the poses at `later`, to which the collision is moved. Returns
 * how many, 0 if all is covered. */
static int32_t points_of_faces(const encounter *e, perp__collision *collision, double later,
                               const double *covered, double least, asked where)
{
    perp__collision next = *collision;
    perp__placed a, b;
    perp__axes axes;
    double normal[3];
    int32_t best = 0, made = 0;

    perp__moved(&e->a, later, &a);
    perp__moved(&e->b, later, &b);
    (void)perp__axes_of(&a, &b, e->world->settings.planar, INFINITY, &axes);
    next.time = later;
    next.doubtful = 1;
    while (made <= 0 && best >= 0) {
        best = -1;
        for (int32_t k = 0; k < axes.faces[0] + axes.faces[1]; k++) {
            perp__apply3(normal, a.rotation, axes.axis[k].normal);
            if (axes.axis[k].separation > -INFINITY && axes.axis[k].separation >= least &&
                !perp__is_same_way(fabs(perp__dot3(normal, covered))) &&
                (best < 0 || axes.axis[k].separation > axes.axis[best].separation) &&
                came_along(e, later, normal, face_owner(&axes, k), 0.0))
                best = k;
        }
        if (best >= 0) {
            axes.axis[best].separation = -INFINITY; /* it is looked at once */
            next.axis = best;
            made = points_along(e, &next, where);
        }
    }
    if (made <= 0)
        return 0;
    collision->axis = next.axis;
    collision->time = later;
    return made;
}

/* The points along the axis of `collision`, if they lie open; else over the next face that does. Of
 * bricks that sink a little into what they stand on the rims of all faces are covered: those by
 * which the shapes hardly overlap are met before any other one all the same, if their middle lies
 * open. In a corner that two shapes make each of them covers the other's face for what sank into
 * both: so what had points in the last step has some still. Returns how many, 0 if all is covered:
 * then no point keeps them apart, and they meet when one lies open. */
static int32_t open_points(const encounter *e, perp__collision *collision, double later)
{
    const double least = -SHALLOW * perp__pair_thickness(e->world, e->pair);
    double covered[3];
    int32_t made = points_along(e, collision, AT_DEEPEST);

    if (made >= 0)
        return made;
    perp__copy3(covered, e->points[0].normal);
    made = points_of_faces(e, collision, later, covered, least, AT_DEEPEST);
    if (made == 0)
        made = points_along(e, collision, ON_THE_WHOLE);
    if (made <= 0)
        made = points_of_faces(e, collision, later, covered, least, ON_THE_WHOLE);
    if (made <= 0 && (e->pair->first_sleeping >= 0 || e->pair->memories > 0))
        made = points_along(e, collision, NOT_AT_ALL);
    return made;
}

/* ---- pairs ---- */

/* The normal along which the pair pressed in the last step; NULL if it did not. */
static const double *pressed_along(const perp_world *world, const perp__pair *pair)
{
    for (int32_t i = pair->first_sleeping; i >= 0; i = world->sleep.contacts[i].next)
        if (!perp__is_zero3(world->sleep.contacts[i].memory.impulse))
            return world->sleep.contacts[i].memory.normal;
    for (int32_t i = 0; i < pair->memories; i++)
        if (!perp__is_zero3(world->memory.all[pair->first_memory + i].impulse))
            return world->memory.all[pair->first_memory + i].normal;
    return NULL;
}

/* Whether the shapes touch plainly; or are no farther apart than `margin`, and pressed in the last
 * step and hardly move, or are balls whose way bends off their tangent by less than a quarter of
 * that: what lies on others leaves them by as much as a step is wrong; or would touch plainly in
 * whatever way their bodies go, no farther than they do now. */
static bool touch_plainly(const encounter *e, perp__pair *pair, const perp__axes *axes,
                          double margin)
{
    const int32_t planar = e->world->settings.planar;
    const perp__geometry *a = e->a.start->geometry, *b = e->b.start->geometry;
    const double apart = a->radius + b->radius; /* of balls' centres */
    const bool rounded = a->radius > 0.0 && b->radius > 0.0;
    const bool balls = a->kind == PERP__SPHERE && b->kind == PERP__SPHERE;
    perp__touch_tolerance wide = e->tolerance;

    if (perp__touch_plainly(&e->a, &e->b, planar, &e->tolerance, axes, &pair->collision))
        return 1;
    pair->plain = 0;
    wide.touching = margin;
    if (margin > e->tolerance.touching &&
        ((balls && e->displacement * e->displacement <= 0.5 * margin * apart) ||
         (e->displacement <= margin && pressed_along(e->world, pair))) &&
        perp__touch_plainly(&e->a, &e->b, planar, &wide, axes, &pair->collision))
        return 1;
    wide.touching = perp__greater(margin, perp__way_of(&e->a) + perp__way_of(&e->b));
    return !rounded && perp__touch_plainly(&e->a, &e->b, planar, &wide, axes, &pair->collision);
}

/* Whether the bodies begin the step at rest beside each other. */
static bool begin_at_rest(const encounter *e)
{
    const double *a = e->world->step.motions[e->world->shapes.all[e->pair->first].body].start;
    const double *b = e->world->step.motions[e->world->shapes.all[e->pair->second].body].start;

    return memcmp(a, b, 6 * sizeof *a) == 0 && perp__is_zero3(a + 3);
}

/* Whether shapes that touch, and do not move, pressed in the last step along an axis that they
 * still have: where several keep them apart, nothing yet says that it is another one. */
static bool presses_on(const encounter *e, perp__pair *pair, const perp__axes *axes, double far)
{
    const double *normal = begin_at_rest(e) ? pressed_along(e->world, pair) : NULL;
    double local[3], middle[3];

    if (!normal)
        return 0;
    perp__apply_transposed3(local, e->a.start->rotation, normal);
    pair->collision.axis = PERP__MIDDLE_AXIS;
    bool found = perp__middle_of_faces(axes, e->tolerance.touching, middle, NULL) &&
                 perp__is_same_way(fabs(perp__dot3(middle, local)));
    for (int32_t k = 0; k < axes->count && !found; k++) {
        pair->collision.axis = axes->axis[k].number;
        found = fabs(axes->axis[k].separation) <= far &&
                perp__is_same_way(fabs(perp__dot3(axes->axis[k].normal, local)));
    }
    pair->collision.time = 0.0;
    pair->collision.doubtful = 1;
    return found;
}

/* Whether shapes at rest that touch in an edge or a corner of both can lean on each other along the
 * middle of the faces there: each of these can hold that by friction, so that whichever the motion
 * would close, they stand on it. Where faces lie in one plane nothing says that one leans. */
static bool lean(const encounter *e, perp__pair *pair, const perp__axes *axes)
{
    const perp_world *world = e->world;
    const double mu =
        perp__pair_friction(&world->shapes.all[pair->first], &world->shapes.all[pair->second]);
    double middle[3], within;

    pair->collision.axis = PERP__MIDDLE_AXIS;
    pair->collision.time = 0.0;
    pair->collision.doubtful = 1;
    return begin_at_rest(e) &&
           perp__middle_of_faces(axes, e->tolerance.touching, middle, &within) &&
           within * sqrt(1.0 + mu * mu) > 1.0;
}

/* Bodies that begin at rest beside each other, and touch along the axis of their collision from the
 * start, meet where they are, not where forces alone would turn them; and along the middle of the
 * faces that touch where there are several: not along that which the motion closes last, for it is
 * that of a world without this contact. */
static void meet_at_rest(const encounter *e, perp__pair *pair, const perp__axes *axes)
{
    double middle[3];

    for (int32_t k = 0; k < axes->count; k++)
        if (axes->axis[k].number == pair->collision.axis &&
            fabs(axes->axis[k].separation) <= e->tolerance.touching) {
            pair->collision.time = 0.0;
            if (perp__middle_of_faces(axes, e->tolerance.touching, middle, NULL))
                pair->collision.axis = PERP__MIDDLE_AXIS;
            return;
        }
}

/* The points of shapes that are near each other and have these axes. */
static int32_t touch_along(const encounter *e, perp__pair *pair, const perp__axes *axes,
                           double margin)
{
    if (!touch_plainly(e, pair, axes, margin) && !presses_on(e, pair, axes, margin) &&
        !lean(e, pair, axes))
        return 0;
    if (begin_at_rest(e))
        meet_at_rest(e, pair, axes);
    /* what lies between shapes that are apart keeps them so: they meet along no other face */
    for (int32_t k = 0; k < axes->count; k++)
        if (axes->axis[k].number == pair->collision.axis &&
            axes->axis[k].separation > perp__greater(margin, e->tolerance.touching)) {
            const int32_t made = points_along(e, &pair->collision, AT_DEEPEST);

            return made > 0 ? made : 0;
        }
    return open_points(e, &pair->collision, 0.0);
}

/* What separates the shapes most, an axis or the spheres about them, and by how much the motion may
 * close that until they touch; or, of those that have points, until one along it would be deep. */
static void note_clearance(const encounter *e, perp__pair *pair, const perp__axes *axes,
                           int32_t made)
{
    const perp__placed *a = e->a.start, *b = e->b.start;
    const double beyond =
        made > 0 ? PERP__NEAR * perp__pair_size(e->world, pair) : -e->tolerance.touching;
    double *apart = pair->collision.apart, separation;

    perp__subtract3(apart, b->position, a->position);
    separation = perp__normalise3(apart) - e->world->shapes.all[pair->first].radius -
                 e->world->shapes.all[pair->second].radius;
    for (int32_t k = 0; k < axes->count; k++)
        if (axes->axis[k].separation > separation) {
            separation = axes->axis[k].separation;
            perp__apply3(apart, a->rotation, axes->axis[k].normal);
        }
    pair->collision.clearance = perp__greater(separation + beyond, 0.0);
}

int32_t perp__touching_points(const perp_world *world, perp__pair *pair, double h, double far,
                              perp__point *points)
{
    const double touching = perp__pair_touching(world, pair, perp__pair_rounding(world, pair));
    const double margin = PERP__NEAR * perp__pair_size(world, pair);
    int32_t made = 0;
    perp__axes axes;
    encounter e;
    double reach;

    pair->plain = 1;
    if (pair->plane) { /* one normal at any distance: near ones come at once */
        const int32_t a = pair->body[0], b = pair->body[1];
        const double *from = world->step.motions[a].moving, *to = world->step.motions[b].moving;
        const double displacement = (fabs(h * to[0] - h * from[0]) + fabs(h * to[1] - h * from[1]) +
                                     fabs(h * to[2] - h * from[2])) +
                                    perp__turning(world, a, pair->reach[0], h) +
                                    perp__turning(world, b, pair->reach[1], h);
        const double due = perp__greater(perp__lesser(margin, 2.0 * displacement), touching);

        made = perp__collide(&world->step.placed[pair->first], &world->step.placed[pair->second],
                             world->settings.planar, perp__greater(far, due), points);
        for (int32_t i = 0; i < made; i++)
            if (points[i].gap <= due)
                return made;
        return 0;
    }
    begin_encounter(&e, world, pair, h, points);
    reach = perp__greater(touching, perp__greater(margin, perp__way_of(&e.a) + perp__way_of(&e.b)));
    axes.count = 0;
    if (perp__are_near(world, pair, reach)) {
        const double parted = perp__separation(e.a.start, e.b.start, pair->collision.apart);

        pair->collision.clearance = parted - touching;
        if (parted > reach + e.tolerance.rounding) /* along what kept them apart before */
            return 0;
        pair->plain =
            (int8_t)perp__axes_of(e.a.start, e.b.start, world->settings.planar, reach, &axes);
        made = pair->plain ? touch_along(&e, pair, &axes, margin) : 0;
    }
    note_clearance(&e, pair, &axes, made);
    return made;
}

bool perp__pair_collides(const perp_world *world, perp__pair *pair, double h)
{
    const int32_t planar = world->settings.planar;
    int32_t met; /* -1: unknown */
    perp__point points[PERP__MAX_POINTS];
    perp__axes axes;
    perp__placed a, b;
    encounter e;

    begin_encounter(&e, world, pair, h, points);
    pair->collision.begun = -INFINITY;
    /* 1. other shapes than half-spaces */
    if (!pair->plane) {
        met = perp__find_collision(&e.a, &e.b, planar, &e.tolerance, &pair->collision);
        if (met > 0 && begin_at_rest(&e)) {
            (void)perp__axes_of(e.a.start, e.b.start, planar, INFINITY, &axes);
            meet_at_rest(&e, pair, &axes);
        }
        return met > 0;
    }
    /* 2. whether the motion ends in a half-space, with the points of the start */
    perp__moved(&e.a, 1.0, &a);
    perp__moved(&e.b, 1.0, &b);
    pair->collision.time = 0.0;
    pair->collision.doubtful = 0;
    return perp__collide(&a, &b, planar, 0.0, points) > 0;
}

bool perp__pair_meets(const perp_world *world, const perp__pair *pair, double h)
{
    perp__collision collision;
    encounter e;

    begin_encounter(&e, world, pair, h, NULL);
    return perp__find_collision(&e.a, &e.b, world->settings.planar, &e.tolerance, &collision) != 0;
}

/* Shapes in each other: along which axis least, and by how much; that axis' separation is more
 * than 0 where they are apart. */
typedef struct overlap {
    int32_t axis;
    face_of owner;
    double separation, normal[3]; /* in the world, from the first to the second */
} overlap;

/* At the share t of the step. Apart by more than `far` they lack nothing; mostly the axis that kept
 * them so at the start tells. */
static overlap overlap_at(const encounter *e, double t, double far)
{
    const int32_t planar = e->world->settings.planar;
    perp__point points[PERP__MAX_POINTS];
    overlap found = {0, EDGES, INFINITY, {0.0, 0.0, 0.0}};
    perp__placed a, b;
    perp__axes axes;

    perp__moved(&e->a, t, &a);
    perp__moved(&e->b, t, &b);
    axes.count = 0;
    if (!e->pair->plane && (perp__separation(&a, &b, e->pair->collision.apart) > far ||
                            !perp__axes_of(&a, &b, planar, far, &axes)))
        return found;
    if (axes.count > 0) {
        const int32_t last = perp__last_to_close(&a, &b, &axes, NULL);
        const perp__axis *best = &axes.axis[last];

        found.axis = best->number;
        found.owner = face_owner(&axes, last);
        found.separation = best->separation;
        perp__apply3(found.normal, a.rotation, best->normal);
    } else {
        for (int32_t i = perp__collide(&a, &b, planar, far, points); i-- > 0;) {
            found.separation = fmin(found.separation, points[i].gap);
            perp__copy3(found.normal, points[i].normal);
        }
    }
    return found;
}

/* Shapes that the step takes more than half-way through each other overlap least along a way that
 * they did not come, or are apart there. Then the last pose is taken in which they overlap along
 * the way that they came, to within the half widths of both. Where they go in at the end by rates
 * that make less than the overlap in a step, or go out again, these would let it be: the last pose
 * is taken that is no deeper than the level lets a motion go. Of half-spaces all points are there
 * from the start. */
bool perp__pair_sinks(const perp_world *world, perp__pair *pair, double h)
{
    const perp__shape *first = &world->shapes.all[pair->first],
                      *second = &world->shapes.all[pair->second];
    const double level =
        fmax(perp__level_of(world)->deep, PERP__NEAR) * perp__pair_size(world, pair);
    const double deep = pair->plane ? level : PERP__NEAR * perp__pair_size(world, pair);
    const double width = pair->plane ? deep : first->thickness + second->thickness;
    perp__collision *collision = &pair->collision;
    const double turning = perp__turning(world, pair->body[0], pair->reach[0], h) +
                           perp__turning(world, pair->body[1], pair->reach[1], h);
    double from = 0.0, to = 1.0;
    overlap before, end;
    encounter e;

    if (turning <= deep)
        return 0;
    begin_encounter(&e, world, pair, h, NULL);
    end = overlap_at(&e, 1.0, e.displacement > width ? INFINITY : -deep);
    if (!(end.separation < -deep) && (pair->plane || e.displacement <= width))
        return 0;
    before = overlap_at(&e, 0.0, INFINITY);
    collision->begun = perp__lesser(before.separation, 0.0);
    const double closes =
        64.0 * (overlap_at(&e, 1.0 - 1.0 / 64.0, INFINITY).separation - end.separation);
    const bool along = pair->plane || came_along(&e, 1.0, end.normal, end.owner, collision->begun);
    const bool leaves = along && !(closes >= collision->begun - end.separation);
    const double finest = (leaves ? level : width) / (e.displacement + turning);
    while ((leaves || !along) && to - from > fmax(finest, DBL_EPSILON)) {
        const double t = 0.5 * (from + to);
        const overlap between = overlap_at(&e, t, INFINITY);

        if ((!leaves || between.separation >= collision->begun - level) &&
            (pair->plane || came_along(&e, t, between.normal, between.owner, collision->begun))) {
            before = between;
            from = t;
        } else {
            end = between;
            to = t;
        }
    }
    collision->time = along && !leaves ? 1.0 : from;
    collision->axis = along && !leaves ? end.axis : before.axis;
    collision->doubtful = 1;
    return perp__lesser(before.separation, end.separation) < collision->begun - deep;
}

int32_t perp__collision_points(const perp_world *world, perp__pair *pair, double h,
                               perp__point *points)
{
    encounter e;

    begin_encounter(&e, world, pair, h, points);
    return open_points(&e, &pair->collision, 1.0);
}

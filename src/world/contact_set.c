/* The contact points of a step: the points that count, and as few others as can be.
 *
 * Shapes that touch plainly at the start, or lie in each other, have the points and the normal of
 * that pose; half-spaces do at any distance. All other pairs are open: they count only if the
 * motion at hand makes them meet, and take points and normal from the pose in which they do. First
 * come the plain points, and once these are solved for the motion is that of the solution: what the
 * floor holds does not sink into the side of the next tile. Points that no motion so far closes are
 * left out: a problem without some contacts has a solution of the whole problem if its velocities
 * keep these open too.
 *
 * Within a step of length h a point of a body moves by at most h (|v| + |w| r) if nothing touches
 * the body. What touches it can make it as fast as the fastest thing of the scene, no faster in
 * the inelastic stage that moves positions. Hence the margin of a pair
 *
 *   h (reach_A + reach_B + fastest) + slack,
 *
 * with a slack relative to the shapes' sizes, for contacts that rest with a gap of rounding. A push
 * far from the mass centre can make a light body's ends faster than that; then the margins grow and
 * the step starts again. */
#include "world/world.h"

#include <string.h>

#include "base/context.h"
#include "world/collide/meeting.h"
#include "world/spatial.h"

#define RELATIVE_SLACK 1e-9

/* A gap below this share of the bodies' size is near: such points take part from the start. */
#define NEAR 1e-3

/* By how much of its way a motion may close shapes that touch without pressing; by how much of the
 * slop; and by how much of the shapes' size at most, for bodies that turn. */
#define RELATIVE_GRAZING 1e-6
#define SLOP_GRAZING 1e-2
#define LARGEST_GRAZING 1e-2

/* Radians in a step beyond which a linear contact says little. */
#define LARGE_TURN 0.25

/* How often an open pair may join; rounds in which doubtful meetings wait for others; and rounds
 * after which what still meets is left to the projection. */
#define MAX_JOINS 3
#define PATIENCE 8
#define MAX_ROUNDS 24

/* A gap is a difference of coordinates: this many units of rounding of the largest of them. */
#define GAP_ROUNDING (64.0 * PERP__EPSILON)

static double rounding_of(const perp_world *world, int32_t shape)
{
    const double *x = world->placed[shape].position;
    double largest = fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2])));

    return GAP_ROUNDING *
           (largest + world->shapes[shape].radius + fabs(world->shapes[shape].geometry.offset));
}

static double slack_of(const perp_world *world, int32_t shape)
{
    return RELATIVE_SLACK * world->shapes[shape].radius + rounding_of(world, shape);
}

/* How far from this body others are: the arm of a turning half-space. */
static double scene_radius(const perp_world *world, int32_t body)
{
    double largest = 0.0;
    int32_t i, k;

    for (i = 0; i < world->body_slots; i++) {
        double difference[3], distance;

        if (!world->bodies[i].alive || world->bodies[i].kind != PERP_BODY_DYNAMIC)
            continue;
        for (k = 0; k < 3; k++)
            difference[k] = world->states[i].position[k] - world->states[body].position[k];
        distance = perp__length3(difference) + world->bodies[i].radius;
        if (distance > largest)
            largest = distance;
    }
    return largest;
}

/* Largest speed of a point of the body, before or after the forces of the step. */
static double reach_of(const perp_world *world, int32_t i)
{
    const perp__motion *motion = &world->motions[i];
    double speed, spin, arm;

    if (world->bodies[i].kind == PERP_BODY_STATIC)
        return 0.0;
    speed = fmax(perp__length3(motion->start), perp__length3(motion->free));
    spin = fmax(perp__length3(motion->start + 3), perp__length3(motion->free + 3));
    arm = world->bodies[i].radius;
    if (spin > 0.0 && world->bodies[i].planes > 0)
        arm = fmax(arm, scene_radius(world, i));
    return speed + spin * arm;
}

void perp__find_reaches(perp_world *world)
{
    int32_t i;

    for (i = 0; i < world->body_slots; i++)
        if (world->bodies[i].alive)
            world->motions[i].reach = reach_of(world, i);
}

static double fastest_reach(const perp_world *world)
{
    double fastest = 0.0;
    int32_t i;

    for (i = 0; i < world->body_slots; i++)
        if (world->bodies[i].alive)
            fastest = fmax(fastest, world->motions[i].reach);
    return fastest;
}

int32_t perp__raise_reaches(perp_world *world)
{
    double spare = 0.5 * fastest_reach(world); /* a pair's margin has twice that */
    int32_t raised = 0;
    int32_t i;

    for (i = 0; i < world->body_slots; i++) {
        perp__motion *motion = &world->motions[i];
        double speed;

        if (!world->bodies[i].alive || motion->island < 0)
            continue;
        speed = perp__length3(motion->moving) +
                perp__length3(motion->moving + 3) * world->bodies[i].radius;
        if (speed <= motion->reach + spare)
            continue;
        motion->reach = speed;
        raised++;
    }
    return raised;
}

/* Extents of all shapes, grown by what the body can move within h and by `more`. */
static int32_t make_extents(perp_world *world, double h, double more)
{
    int32_t count = 0;
    int32_t i;

    for (i = 0; i < world->shape_slots; i++) {
        const perp__shape *shape = &world->shapes[i];
        perp__extent *extent = &world->extents[count];
        double margin;

        if (!shape->alive)
            continue;
        margin = h * world->motions[shape->body].reach + more + slack_of(world, i);
        perp__extent_of(&world->placed[i], margin, extent);
        extent->item = i;
        extent->group = shape->body;
        count++;
    }
    return count;
}

static int32_t can_touch(const perp_world *world, const perp__pair *pair)
{
    const perp__body *a = &world->bodies[world->shapes[pair->first].body];
    const perp__body *b = &world->bodies[world->shapes[pair->second].body];

    return a->kind == PERP_BODY_DYNAMIC || b->kind == PERP_BODY_DYNAMIC;
}

/* Pairs whose extents overlap and of which one can move. */
static perp_status find_pairs(perp_world *world, int32_t extents)
{
    int32_t found = perp__broad_phase(world->extents, extents, world->pairs, world->pair_capacity);
    int32_t i, kept = 0;

    if (found > world->pair_capacity) {
        int32_t capacity = found > INT32_MAX / 2 ? found : 2 * found;
        perp__pair *pairs =
            perp__grown(world->context, world->pairs, 0, (size_t)capacity * sizeof *pairs);

        if (!pairs)
            return perp__fail_memory(world->context, "the pairs of shapes");
        world->pairs = pairs;
        world->pair_capacity = capacity;
        found = perp__broad_phase(world->extents, extents, world->pairs, world->pair_capacity);
    }
    for (i = 0; i < found; i++)
        if (can_touch(world, &world->pairs[i]))
            world->pairs[kept++] = world->pairs[i];
    world->pair_count = kept;
    return PERP_OK;
}

static perp_status reserve_contacts(perp_world *world, perp__contact_set *set, int32_t needed)
{
    perp__world_contact *contacts;
    int32_t capacity = set->capacity > 0 ? set->capacity : PERP__MAX_POINTS;

    if (needed <= set->capacity)
        return PERP_OK;
    if (needed > INT32_MAX / 4)
        return perp__fail_memory(world->context, "the contacts");
    while (capacity < needed)
        capacity *= 2;
    contacts = perp__grown(world->context, set->contacts, (size_t)set->count * sizeof *contacts,
                           (size_t)capacity * sizeof *contacts);
    if (!contacts)
        return perp__fail_memory(world->context, "the contacts");
    set->contacts = contacts;
    set->capacity = capacity;
    return PERP_OK;
}

/* The geometric mean; exact where both are equal. */
static double pair_friction(double a, double b)
{
    return a == b ? a : sqrt(a) * sqrt(b);
}

static void fill_contact(perp_world *world, perp__world_contact *contact, const perp__pair *pair,
                         const perp__point *point)
{
    const perp__shape *a = &world->shapes[pair->first];
    const perp__shape *b = &world->shapes[pair->second];

    memset(contact, 0, sizeof *contact);
    contact->body_a = a->body;
    contact->body_b = b->body;
    contact->shape_a = pair->first;
    contact->shape_b = pair->second;
    contact->feature = (uint64_t)point->feature;
    perp__copy3(contact->position, point->position);
    perp__copy3(contact->axes[0], point->normal);
    contact->gap = point->gap;
    contact->rounding = rounding_of(world, pair->first) + rounding_of(world, pair->second);
    contact->size = world->bodies[a->body].radius + world->bodies[b->body].radius;
    contact->friction = pair_friction(a->friction, b->friction);
    contact->restitution = fmax(a->restitution, b->restitution);
    contact->edges = contact->friction > 0.0 ? world->edges : 0;
    perp__contact_frame(world, contact);
}

/* Arms from the mass centres of bodies in the given states. */
static void set_arms(const perp__state *states, perp__world_contact *contact)
{
    int32_t k;

    for (k = 0; k < 3; k++) {
        contact->arms[0][k] = contact->position[k] - states[contact->body_a].position[k];
        contact->arms[1][k] = contact->position[k] - states[contact->body_b].position[k];
    }
}

/* Rows and velocities as if nothing touched. */
static void prepare_contact(const perp_world *world, perp__world_contact *contact)
{
    perp__contact_jacobian(world, contact);
    perp__relative_velocity(world, contact, PERP__TWIST_START, contact->start);
    perp__relative_velocity(world, contact, PERP__TWIST_FREE, contact->free);
    perp__copy3(contact->velocity, contact->free);
}

static perp__nearness nearness_of(const perp_world *world, const perp__pair *pair)
{
    double size = fmin(world->shapes[pair->first].thickness, world->shapes[pair->second].thickness);
    double rounding = rounding_of(world, pair->first) + rounding_of(world, pair->second);
    perp__nearness near;

    if (!isfinite(size))
        size = 0.0;
    near.touching = (RELATIVE_SLACK + world->slop) * size + rounding;
    near.grazing = rounding + SLOP_GRAZING * world->slop * size;
    near.rounding = rounding;
    return near;
}

/* Appends the points of a pair in the given states, with gaps up to `margin`. */
static perp_status add_points(perp_world *world, perp__contact_set *set, const perp__pair *pair,
                              const perp__state *states, double margin)
{
    perp__point points[PERP__MAX_POINTS];
    int32_t i, made;
    perp_status status = reserve_contacts(world, set, set->count + PERP__MAX_POINTS);

    if (status != PERP_OK)
        return status;
    made = perp__collide(&world->placed[pair->first], &world->placed[pair->second],
                         world->settings.planar, margin, points);
    for (i = 0; i < made; i++) {
        perp__world_contact *contact = &set->contacts[set->count++];

        fill_contact(world, contact, pair, &points[i]);
        set_arms(states, contact);
    }
    return PERP_OK;
}

/* Decides how each pair takes part, and makes the points of those that touch plainly. */
perp_status perp__find_contacts(perp_world *world, double h)
{
    double fastest = fastest_reach(world);
    int32_t i, k;
    perp_status status = find_pairs(world, make_extents(world, h, 0.5 * h * fastest));

    world->contacts.count = 0;
    world->rounds = 0;
    for (i = 0; i < world->body_slots; i++) /* no motion has been looked at */
        world->motions[i].tried[0] = NAN;
    for (i = 0; i < world->pair_count && status == PERP_OK; i++) {
        perp__pair *pair = &world->pairs[i];
        const perp__nearness near = nearness_of(world, pair);

        pair->joined = 0;
        pair->open = !perp__touch_plainly(&world->placed[pair->first], &world->placed[pair->second],
                                          world->settings.planar, &near);
        k = world->contacts.count;
        if (!pair->open)
            status = add_points(world, &world->contacts, pair, world->states, INFINITY);
        for (; k < world->contacts.count; k++)
            prepare_contact(world, &world->contacts.contacts[k]);
    }
    return status;
}

/* A shape on the way of its body's motion. */
static perp__moving moving_shape(const perp_world *world, int32_t shape, double h)
{
    const perp__shape *at = &world->shapes[shape];
    const perp__motion *motion = &world->motions[at->body];
    int32_t k, turns = at->geometry.kind != PERP__SPHERE || !perp__is_zero3(at->offset);
    perp__moving moving;

    moving.start = &world->placed[shape];
    perp__copy3(moving.centre, world->states[at->body].position);
    for (k = 0; k < 3; k++) {
        moving.way[k] = h * motion->moving[k];
        moving.turn[k] = turns ? h * motion->moving[3 + k] : 0.0;
    }
    moving.reach = perp__length3(at->offset) + at->radius;
    return moving;
}

/* What the motion may close without pressing: its share of rounding, and what a turn leaves of a
 * linear contact. */
static void set_grazing(perp__nearness *near, const perp__moving *a, const perp__moving *b,
                        double size)
{
    double turn_a = fmin(perp__length3(a->turn), LARGE_TURN);
    double turn_b = fmin(perp__length3(b->turn), LARGE_TURN);

    near->grazing += RELATIVE_GRAZING * perp__relative_way(a, b) +
                     fmin(0.5 * (turn_a * turn_a * a->reach + turn_b * turn_b * b->reach),
                          LARGEST_GRAZING * size);
}

/* Whether the motion at hand makes an open pair meet. */
static int32_t meets(const perp_world *world, perp__pair *pair, double h)
{
    const perp__moving a = moving_shape(world, pair->first, h);
    const perp__moving b = moving_shape(world, pair->second, h);
    const double size =
        fmin(world->shapes[pair->first].thickness, world->shapes[pair->second].thickness);
    perp__nearness near = nearness_of(world, pair);
    double between[3], reach;
    int32_t k;

    for (k = 0; k < 3; k++)
        between[k] = b.start->position[k] - a.start->position[k];
    reach = perp__relative_way(&a, &b) + world->shapes[pair->first].radius +
            world->shapes[pair->second].radius + near.touching;
    if (!(perp__length3(between) <= reach))
        return 0;
    set_grazing(&near, &a, &b, size);
    return perp__meet(&a, &b, world->settings.planar, &near, &pair->meeting);
}

/* The point as seen from the start: arms are those of the meeting, the gap is what the motion has
 * closed till then. */
static void set_back(const perp_world *world, perp__world_contact *contact, double t,
                     const perp__moving *a, const perp__moving *b)
{
    const perp__moving *sides[2] = {a, b};
    double closed = 0.0;
    int32_t side, k;

    for (side = 0; side < 2; side++) {
        double turned[3], at[3];

        for (k = 0; k < 3; k++)
            contact->arms[side][k] =
                contact->position[k] - (sides[side]->centre[k] + t * sides[side]->way[k]);
        perp__cross(turned, sides[side]->turn, contact->arms[side]);
        for (k = 0; k < 3; k++)
            at[k] = sides[side]->way[k] + turned[k];
        closed += (side == 0 ? t : -t) * perp__dot3(contact->axes[0], at);
        for (k = 0; k < 3; k++)
            contact->position[k] -= 0.5 * t * at[k];
    }
    contact->gap += closed;
    prepare_contact(world, contact);
}

static int32_t has_feature(const perp__contact_set *set, const perp__pair *pair, int32_t feature)
{
    int32_t i;

    for (i = 0; i < set->count; i++)
        if (set->contacts[i].shape_a == pair->first && set->contacts[i].shape_b == pair->second &&
            set->contacts[i].feature == (uint64_t)feature)
            return 1;
    return 0;
}

/* Appends the points in which a pair meets. */
static perp_status join_pair(perp_world *world, perp__pair *pair, double h)
{
    const perp__moving a = moving_shape(world, pair->first, h);
    const perp__moving b = moving_shape(world, pair->second, h);
    const double t = pair->meeting.time;
    perp__placed at_a, at_b;
    perp__point points[PERP__MAX_POINTS];
    int32_t i, made;
    perp_status status =
        reserve_contacts(world, &world->contacts, world->contacts.count + PERP__MAX_POINTS);

    if (status != PERP_OK)
        return status;
    perp__moved(&a, t, &at_a);
    perp__moved(&b, t, &at_b);
    made = perp__collide_along(&at_a, &at_b, world->settings.planar, pair->meeting.axis, points);
    for (i = 0; i < made; i++) {
        perp__world_contact *contact;

        if (pair->joined > 0 && has_feature(&world->contacts, pair, points[i].feature))
            continue;
        contact = &world->contacts.contacts[world->contacts.count++];
        fill_contact(world, contact, pair, &points[i]);
        set_back(world, contact, t, &a, &b);
    }
    pair->joined++;
    return PERP_OK;
}

/* Includes the points that are near or that the motion at hand closes; returns how many. */
static int32_t include_points(perp_world *world, double h)
{
    int32_t i, came = 0;

    for (i = 0; i < world->contacts.count; i++) {
        perp__world_contact *contact = &world->contacts.contacts[i];
        double u[3];

        if (contact->included)
            continue;
        perp__relative_velocity(world, contact, PERP__TWIST_MOVING, u);
        if (contact->gap + h * u[0] >= 0.0 &&
            contact->gap > fmax(NEAR * contact->size, contact->rounding))
            continue;
        contact->included = contact->fresh = 1;
        came++;
    }
    return came;
}

/* Whether the motion of either body is not the one that was looked at last. */
static int32_t is_new(const perp_world *world, const perp__pair *pair)
{
    return world->motions[world->shapes[pair->first].body].moved ||
           world->motions[world->shapes[pair->second].body].moved;
}

static void look_for_new_motions(perp_world *world)
{
    int32_t i;

    for (i = 0; i < world->body_slots; i++) {
        perp__motion *motion = &world->motions[i];

        if (!world->bodies[i].alive)
            continue;
        motion->moved = memcmp(motion->tried, motion->moving, sizeof motion->tried) != 0;
        memcpy(motion->tried, motion->moving, sizeof motion->tried);
        motion->earliest = INFINITY;
    }
}

/* A pair that met before is looked at again where a body turns so far that its first meeting says
 * little of the next corner. */
static int32_t is_worth_a_look(const perp_world *world, const perp__pair *pair, double h)
{
    const double *a = world->motions[world->shapes[pair->first].body].moving;
    const double *b = world->motions[world->shapes[pair->second].body].moving;

    if (!pair->open || !is_new(world, pair))
        return 0;
    return pair->joined == 0 || (pair->joined < MAX_JOINS &&
                                 h * (perp__length3(a + 3) + perp__length3(b + 3)) > LARGE_TURN);
}

/* Meetings of the open pairs. One near the rim of a face waits if the body meets something before:
 * what stops it there may keep it from this. */
static perp_status join_meetings(perp_world *world, double h)
{
    perp_status status = PERP_OK;
    int32_t i;

    look_for_new_motions(world);
    for (i = 0; i < world->pair_count; i++) {
        perp__pair *pair = &world->pairs[i];
        perp__motion *a = &world->motions[world->shapes[pair->first].body];
        perp__motion *b = &world->motions[world->shapes[pair->second].body];

        pair->met = is_worth_a_look(world, pair, h) && meets(world, pair, h);
        if (!pair->met)
            continue;
        a->earliest = fmin(a->earliest, pair->meeting.time);
        b->earliest = fmin(b->earliest, pair->meeting.time);
    }
    for (i = 0; i < world->pair_count && status == PERP_OK; i++) {
        perp__pair *pair = &world->pairs[i];
        const int32_t bodies[2] = {world->shapes[pair->first].body,
                                   world->shapes[pair->second].body};
        int32_t k, waits = 0;

        for (k = 0; pair->met && k < 2; k++)
            waits = waits || (pair->meeting.doubtful && world->rounds < PATIENCE &&
                              world->bodies[bodies[k]].kind == PERP_BODY_DYNAMIC &&
                              world->motions[bodies[k]].earliest < pair->meeting.time);
        if (pair->met && waits)
            world->motions[bodies[0]].tried[0] = NAN; /* again in the next round */
        else if (pair->met)
            status = join_pair(world, pair, h);
    }
    return status;
}

perp_status perp__join_contacts(perp_world *world, double h, int32_t *came)
{
    perp_status status;

    *came = include_points(world, h);
    if (*came > 0 || world->rounds++ >= MAX_ROUNDS)
        return PERP_OK;
    status = join_meetings(world, h);
    if (status == PERP_OK)
        *came = include_points(world, h);
    return status;
}

perp_status perp__find_near_pairs(perp_world *world, double margin)
{
    return find_pairs(world, make_extents(world, 0.0, 0.5 * margin));
}

perp_status perp__find_overlaps(perp_world *world, double margin)
{
    perp_status status = PERP_OK;
    int32_t i;

    world->overlaps.count = 0;
    for (i = 0; i < world->pair_count && status == PERP_OK; i++)
        status = add_points(world, &world->overlaps, &world->pairs[i], world->next, margin);
    for (i = 0; i < world->overlaps.count; i++)
        world->overlaps.contacts[i].included = 1;
    return status;
}

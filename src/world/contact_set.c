/* The contact points of a step: every point that can close within it, and as few others as can be.
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
#include "world/spatial.h"

#define RELATIVE_SLACK 1e-9

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
    perp__copy3(contact->position, point->position);
    perp__copy3(contact->axes[0], point->normal);
    contact->gap = point->gap;
    contact->rounding = rounding_of(world, pair->first) + rounding_of(world, pair->second);
    contact->size = world->bodies[a->body].radius + world->bodies[b->body].radius;
    contact->friction = pair_friction(a->friction, b->friction);
    contact->restitution = fmax(a->restitution, b->restitution);
    contact->edges = contact->friction > 0.0 ? world->edges : 0;
    contact->included = 1;
    perp__contact_frame(world, contact);
}

/* Appends the points of a pair; *made tells how many. */
static perp_status add_points(perp_world *world, perp__contact_set *set, const perp__pair *pair,
                              double margin, int32_t *made)
{
    perp__point points[PERP__MAX_POINTS];
    int32_t i;
    perp_status status = reserve_contacts(world, set, set->count + PERP__MAX_POINTS);

    if (status != PERP_OK)
        return status;
    *made = perp__collide(&world->placed[pair->first], &world->placed[pair->second],
                          world->settings.planar, margin, points);
    for (i = 0; i < *made; i++)
        fill_contact(world, &set->contacts[set->count++], pair, &points[i]);
    return PERP_OK;
}

perp_status perp__find_contacts(perp_world *world, double h)
{
    double fastest = fastest_reach(world);
    int32_t i, made, kept = 0;
    perp_status status = find_pairs(world, make_extents(world, h, 0.5 * h * fastest));

    world->contacts.count = 0;
    for (i = 0; i < world->pair_count && status == PERP_OK; i++) {
        const perp__pair pair = world->pairs[i];
        const perp__motion *a = &world->motions[world->shapes[pair.first].body];
        const perp__motion *b = &world->motions[world->shapes[pair.second].body];
        double margin = h * (a->reach + b->reach + fastest) + slack_of(world, pair.first) +
                        slack_of(world, pair.second);

        made = 0;
        status = add_points(world, &world->contacts, &pair, margin, &made);
        if (made > 0)
            world->pairs[kept++] = pair;
    }
    world->pair_count = kept; /* the projection looks at these again */
    return status;
}

perp_status perp__find_near_pairs(perp_world *world, double margin)
{
    return find_pairs(world, make_extents(world, 0.0, 0.5 * margin));
}

perp_status perp__find_overlaps(perp_world *world, double margin)
{
    perp_status status = PERP_OK;
    int32_t i, made;

    world->overlaps.count = 0;
    for (i = 0; i < world->pair_count && status == PERP_OK; i++)
        status = add_points(world, &world->overlaps, &world->pairs[i], margin, &made);
    return status;
}

/* Which shapes are near each other: fat boxes in a tree, and a pair for any two that overlap.
 *
 * A shape's fat box holds where the shape is, where the motion at hand takes it, and some space
 * around. As long as it does, nothing is to be done; once it does not, the shape gets a new one,
 * pairs whose boxes are apart go and new ones come. Pairs live in one pool; each is in the lists of
 * its two shapes. Half-spaces have no box: they make pairs with the boxes that reach into them.
 * Everything that depends on pairs goes through them in the order of their shapes' slots, which
 * does not depend on how they came about. */
#include "world/world.h"

#include <string.h>

#include "base/check.h"
#include "base/context.h"
#include "linalg/spatial.h"

enum { NONE = -1 };

/* Space around a shape in its fat box, in terms of its radius. */
#define SPACE 0.1

/* Extents grow by a few roundings, so that shapes that exactly touch are found. */
#define ROUNDING (8.0 * PERP__EPSILON)

/* ---- lists: a link is twice the pair's number, plus the side on which the shape is ---- */

static int32_t shape_on(const perp__pair *pair, int32_t side)
{
    return side == 0 ? pair->first : pair->second;
}

static void put_on_list(perp_world *world, int32_t link)
{
    perp__pair *pair = &world->pairs[link / 2];
    perp__shape *shape = &world->shapes[shape_on(pair, link % 2)];

    pair->previous[link % 2] = NONE;
    pair->next[link % 2] = shape->first_link;
    if (shape->first_link != NONE)
        world->pairs[shape->first_link / 2].previous[shape->first_link % 2] = link;
    shape->first_link = link;
}

static void take_off_list(perp_world *world, int32_t link)
{
    const perp__pair *pair = &world->pairs[link / 2];
    const int32_t next = pair->next[link % 2], previous = pair->previous[link % 2];

    if (next != NONE)
        world->pairs[next / 2].previous[next % 2] = previous;
    if (previous != NONE)
        world->pairs[previous / 2].next[previous % 2] = next;
    else
        world->shapes[shape_on(pair, link % 2)].first_link = next;
}

static void drop_pair(perp_world *world, int32_t number)
{
    take_off_list(world, 2 * number);
    take_off_list(world, 2 * number + 1);
    world->pairs[number].first = NONE;
    world->pairs[number].next[0] = world->free_pair;
    world->free_pair = number;
    world->pair_count--;
    world->pairs_changed = 1;
}

static perp_status reserve_pair(perp_world *world)
{
    const int32_t capacity = world->pair_capacity > 0 ? 2 * world->pair_capacity : 32;
    const size_t used = (size_t)world->pair_slots;
    perp__pair *pairs;
    int32_t *order;

    if (world->free_pair != NONE || world->pair_slots < world->pair_capacity)
        return PERP_OK;
    if (world->pair_capacity > INT32_MAX / 8)
        return perp__fail_memory(world->context, "the pairs of shapes");
    order = perp__grown(world->context, world->pair_order, 0, 2 * (size_t)capacity * sizeof *order);
    if (!order)
        return perp__fail_memory(world->context, "the pairs of shapes");
    world->pair_order = order;
    world->pairs_changed = 1;
    pairs = perp__grown(world->context, world->pairs, used * sizeof *pairs,
                        (size_t)capacity * sizeof *pairs);
    if (!pairs)
        return perp__fail_memory(world->context, "the pairs of shapes");
    world->pairs = pairs;
    world->pair_capacity = capacity;
    return PERP_OK;
}

static int32_t can_touch(const perp_world *world, int32_t a, int32_t b)
{
    const int32_t body_a = world->shapes[a].body, body_b = world->shapes[b].body;

    return body_a != body_b && (world->bodies[body_a].kind == PERP_BODY_DYNAMIC ||
                                world->bodies[body_b].kind == PERP_BODY_DYNAMIC) &&
           (world->joint_count == 0 || !perp__joint_parts(world, body_a, body_b));
}

static perp_status add_pair(perp_world *world, int32_t a, int32_t b)
{
    perp_status status = reserve_pair(world);
    int32_t number;

    if (status != PERP_OK)
        return status;
    number = world->free_pair;
    if (number != NONE)
        world->free_pair = world->pairs[number].next[0];
    else
        number = world->pair_slots++;
    memset(&world->pairs[number], 0, sizeof world->pairs[number]);
    world->pairs[number].first = a < b ? a : b;
    world->pairs[number].second = a < b ? b : a;
    world->pairs[number].open = 1;
    put_on_list(world, 2 * number);
    put_on_list(world, 2 * number + 1);
    world->pair_count++;
    world->pairs_changed = 1;
    return PERP_OK;
}

/* ---- the order of pairs ---- */

/* Pairs by the slots of their shapes: two passes of a counting sort. */
static void sort_by(const perp_world *world, int32_t side, const int32_t *from, int32_t *to)
{
    int32_t *start = world->shape_counts;
    int32_t i, sum = 0;

    memset(start, 0, (size_t)world->shape_slots * sizeof *start);
    for (i = 0; i < world->pair_count; i++)
        start[shape_on(&world->pairs[from[i]], side)]++;
    for (i = 0; i < world->shape_slots; i++) {
        const int32_t count = start[i];

        start[i] = sum;
        sum += count;
    }
    for (i = 0; i < world->pair_count; i++)
        to[start[shape_on(&world->pairs[from[i]], side)]++] = from[i];
}

static void order_pairs(perp_world *world)
{
    int32_t *order = world->pair_order, *other;
    int32_t i, count = 0;

    if (!world->pairs_changed || world->pair_capacity == 0)
        return;
    other = order + world->pair_capacity;
    for (i = 0; i < world->pair_slots; i++)
        if (world->pairs[i].first != NONE)
            order[count++] = i;
    sort_by(world, 1, order, other);
    sort_by(world, 0, other, order);
    world->pairs_changed = 0;
}

/* ---- fat boxes ---- */

static int32_t is_plane(const perp_world *world, int32_t shape)
{
    return world->shapes[shape].geometry.kind == PERP__PLANE;
}

/* Whether a box reaches into a half-space; one that moves may come anywhere. */
static int32_t reaches_plane(const perp_world *world, const perp__bounds *box, int32_t plane)
{
    const perp__placed *placed = &world->placed[plane];
    double normal[3], lowest = 0.0, size = fabs(placed->geometry->offset);
    int32_t k;

    if (world->bodies[world->shapes[plane].body].kind != PERP_BODY_STATIC)
        return 1;
    perp__apply3(normal, placed->rotation, placed->geometry->normal);
    for (k = 0; k < 3; k++) {
        lowest += fmin(normal[k] * (box->low[k] - placed->position[k]),
                       normal[k] * (box->high[k] - placed->position[k]));
        size += fmax(fabs(box->low[k]), fabs(box->high[k])) + fabs(placed->position[k]);
    }
    return lowest <= placed->geometry->offset + ROUNDING * size;
}

static const perp__bounds *fat_box(const perp_world *world, int32_t shape)
{
    return &world->tree.nodes[world->shapes[shape].leaf].bounds;
}

static int32_t still_near(const perp_world *world, int32_t shape, int32_t other)
{
    if (is_plane(world, other))
        return reaches_plane(world, fat_box(world, shape), other);
    return world->shapes[other].leaf != NONE &&
           perp__bounds_overlap(fat_box(world, shape), fat_box(world, other));
}

/* Drops the pairs of a shape that ended, and marks the others' shapes. */
static void review_pairs(perp_world *world, int32_t shape)
{
    int32_t link = world->shapes[shape].first_link;

    world->mark++;
    while (link != NONE) {
        const perp__pair *pair = &world->pairs[link / 2];
        const int32_t other = shape_on(pair, 1 - link % 2), next = pair->next[link % 2];

        if (still_near(world, shape, other) && can_touch(world, shape, other))
            world->shapes[other].mark = world->mark;
        else
            drop_pair(world, link / 2);
        link = next;
    }
}

static perp_status find_partners(perp_world *world, int32_t shape)
{
    perp__tree_walk walk;
    perp_status status = PERP_OK;
    int32_t other;

    review_pairs(world, shape);
    perp__tree_start(&world->tree, &walk);
    while (status == PERP_OK &&
           (other = perp__tree_next(&world->tree, &walk, fat_box(world, shape))) != NONE)
        if (world->shapes[other].mark != world->mark && can_touch(world, shape, other))
            status = add_pair(world, shape, other);
    for (other = world->first_plane; other != NONE && status == PERP_OK;
         other = world->shapes[other].next_plane)
        if (world->shapes[other].mark != world->mark && can_touch(world, shape, other) &&
            reaches_plane(world, fat_box(world, shape), other))
            status = add_pair(world, shape, other);
    return status;
}

/* Makes the shape's fat box hold `box`. */
static perp_status cover(perp_world *world, int32_t i, const perp__bounds *box, double speed)
{
    perp__shape *shape = &world->shapes[i];
    perp__bounds fat;
    perp_status status;
    int32_t k;

    if (shape->leaf != NONE && perp__bounds_contain(fat_box(world, i), box))
        return PERP_OK;
    for (k = 0; k < 3; k++) { /* half as much again of a long way, so as not to come every step */
        const double space = SPACE * shape->radius + 0.5 * speed;

        fat.low[k] = box->low[k] - space;
        fat.high[k] = box->high[k] + space;
    }
    if (!perp__all_finite(fat.low, 3) || !perp__all_finite(fat.high, 3))
        return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                          "the step takes body %d beyond the range of numbers", (int)shape->body);
    if (shape->leaf != NONE)
        perp__tree_remove(&world->tree, shape->leaf);
    shape->leaf = perp__tree_insert(&world->tree, &fat, i);
    status = find_partners(world, i);
    if (status != PERP_OK) { /* without a box it comes again */
        perp__tree_remove(&world->tree, shape->leaf);
        shape->leaf = NONE;
    }
    return status;
}

/* Lets the box hold what the body's motion does to the shape; returns how far that takes it. */
static double sweep(const perp_world *world, int32_t i, double h, perp__bounds *box)
{
    const perp__motion *motion = &world->motions[world->shapes[i].body];
    const double arm = perp__length3(world->shapes[i].offset) + world->shapes[i].radius;
    const double turn = fmin(h * perp__length3(motion->moving + 3), 2.0) * arm;
    int32_t k;

    for (k = 0; k < 3; k++) {
        const double way = h * motion->moving[k];

        box->low[k] += fmin(way, 0.0) - turn;
        box->high[k] += fmax(way, 0.0) + turn;
    }
    return fmin(h * perp__length3(motion->moving), world->shapes[i].radius) + turn;
}

/* Half-spaces that came or moved make their pairs anew. */
static perp_status look_at_planes(perp_world *world)
{
    perp_status status = PERP_OK;
    int32_t i;

    for (i = 0; i < world->shape_slots && world->planes_changed && status == PERP_OK; i++)
        if (world->shapes[i].alive && world->shapes[i].leaf != NONE)
            status = find_partners(world, i);
    if (status == PERP_OK)
        world->planes_changed = 0;
    return status;
}

/* Boxes for where bodies are: h = 0 and `more` around; or also for where they go: the motions at
 * hand. Bodies that did not move since they were looked at are passed over. */
static perp_status cover_all(perp_world *world, double h, double more)
{
    perp_status status = look_at_planes(world);
    int32_t i;

    for (i = 0; i < world->shape_slots && status == PERP_OK; i++) {
        const perp__shape *shape = &world->shapes[i];
        perp__bounds box;
        double way = 0.0;

        if (!shape->alive || is_plane(world, i) || world->bodies[shape->body].settled)
            continue;
        perp__extent_of(&world->placed[i], more, &box);
        if (h > 0.0)
            way = sweep(world, i, h, &box);
        status = cover(world, i, &box, way);
    }
    for (i = 0; i < world->body_slots && status == PERP_OK; i++)
        if (world->bodies[i].kind == PERP_BODY_STATIC)
            world->bodies[i].settled = 1;
    order_pairs(world);
    return status;
}

perp_status perp__cover_motions(perp_world *world, double h)
{
    return cover_all(world, h, 0.0);
}

perp_status perp__cover_places(perp_world *world, double margin)
{
    return cover_all(world, 0.0, margin);
}

void perp__forget_shape(perp_world *world, int32_t i)
{
    perp__shape *shape = &world->shapes[i];

    while (shape->first_link != NONE)
        drop_pair(world, shape->first_link / 2);
    if (shape->leaf != NONE)
        perp__tree_remove(&world->tree, shape->leaf);
    shape->leaf = NONE;
    if (is_plane(world, i)) {
        int32_t *link = &world->first_plane;

        while (*link != i)
            link = &world->shapes[*link].next_plane;
        *link = shape->next_plane;
    }
}

void perp__enlist_shape(perp_world *world, int32_t i)
{
    perp__shape *shape = &world->shapes[i];

    shape->leaf = shape->first_link = NONE;
    shape->mark = 0;
    world->bodies[shape->body].settled = 0;
    if (is_plane(world, i)) {
        shape->next_plane = world->first_plane;
        world->first_plane = i;
        world->planes_changed = 1;
    }
}

void perp__unsettle(perp_world *world, int32_t body)
{
    world->bodies[body].settled = 0;
    if (world->bodies[body].planes > 0)
        world->planes_changed = 1;
}

void perp__unsettle_all(perp_world *world)
{
    int32_t i;

    for (i = 0; i < world->body_slots; i++)
        perp__unsettle(world, i);
}

/* Which shapes are near each other: fat boxes in a tree, and a pair for any two that overlap.
 *
 * A shape's fat box holds where the shape is, where the motion at hand takes it, and some space
 * around. As long as it does, nothing is to be done; once it does not, the shape gets a new one,
 * pairs whose boxes are apart go and new ones come. Pairs live in one pool; each is in the lists of
 * its two shapes. Half-spaces have no box: they make pairs with the boxes that reach into them.
 * Everything that depends on pairs goes through them in the order of their shapes' slots, which
 * does not depend on how they came about. */
#include "world/joints/joints.h"

#include "base/context.h"

enum { NONE = -1 };

/* Space around a shape in its fat box, in terms of its radius. */
#define SPACE 0.1

/* Steps of the same motion that a new fat box holds, as long as they take it no farther than the
 * shape is wide; and how many times the space of a new box is too much at the start of a step: what
 * was fast is alone again once it is slow. */
#define AHEAD 4.0

static bool is_plane(const perp_world *world, int32_t shape)
{
    return world->shapes.all[shape].geometry.kind == PERP__PLANE;
}

/* ---- lists: a link is twice the pair's number, plus the side on which the shape is ---- */

static int32_t shape_on(const perp__pair *pair, int32_t side)
{
    return side == 0 ? pair->first : pair->second;
}

static void put_on_list(perp_world *world, int32_t link)
{
    perp__pair *pair = &world->pairs.all[link / 2];
    perp__shape *shape = &world->shapes.all[shape_on(pair, link % 2)];

    pair->previous[link % 2] = NONE;
    pair->next[link % 2] = shape->first_link;
    if (shape->first_link != NONE)
        world->pairs.all[shape->first_link / 2].previous[shape->first_link % 2] = link;
    shape->first_link = link;
}

static void take_off_list(perp_world *world, int32_t link)
{
    const perp__pair *pair = &world->pairs.all[link / 2];
    const int32_t next = pair->next[link % 2], previous = pair->previous[link % 2];

    if (next != NONE)
        world->pairs.all[next / 2].previous[next % 2] = previous;
    if (previous != NONE)
        world->pairs.all[previous / 2].next[previous % 2] = next;
    else
        world->shapes.all[shape_on(pair, link % 2)].first_link = next;
}

static void drop_pair(perp_world *world, int32_t number)
{
    perp__pair *pair = &world->pairs.all[number];
    int32_t last = pair->first_sleeping;

    if (last != NONE) { /* what it kept is of the last step all the same */
        for (world->sleep.orphan_count++; world->sleep.contacts[last].next != NONE;
             world->sleep.orphan_count++)
            last = world->sleep.contacts[last].next;
        world->sleep.contacts[last].next = world->sleep.first_orphan;
        world->sleep.first_orphan = pair->first_sleeping;
    }
    perp__unsettle(world, pair->body[0]);
    perp__unsettle(world, pair->body[1]);
    take_off_list(world, 2 * number);
    take_off_list(world, 2 * number + 1);
    pair->first = NONE;
    pair->next[0] = world->pairs.free;
    world->pairs.free = number;
    world->pairs.changed |= 1;
}

static uint64_t key_of(const perp_world *world, int32_t number)
{
    const perp__pair *pair = &world->pairs.all[number];

    return (uint64_t)pair->first << 32 | (uint64_t)pair->second;
}

static bool can_touch(const perp_world *world, int32_t a, int32_t b)
{
    const int32_t body_a = world->shapes.all[a].body, body_b = world->shapes.all[b].body;

    return body_a != body_b &&
           (world->bodies.all[body_a].kind == PERP_BODY_DYNAMIC ||
            world->bodies.all[body_b].kind == PERP_BODY_DYNAMIC) &&
           (world->joints.count == 0 || !perp__joint_parts(world, body_a, body_b));
}

static perp_status add_pair(perp_world *world, int32_t a, int32_t b)
{
    const perp__growing arrays[] = {PERP__GROWING(world->pairs.order, 0, 2),
                                    PERP__GROWING(world->pairs.met, 0, 1),
                                    PERP__GROWING(world->pairs.all, world->pairs.slots, 1)};
    perp_status status = PERP_OK;
    int32_t number = world->pairs.free;
    perp__pair *pair;

    /* 1. its number */
    if (number == NONE && world->pairs.slots == world->pairs.capacity) {
        world->pairs.changed = 2;
        status = perp__grow(world->context, "the pairs of shapes", &world->pairs.capacity,
                            (int64_t)world->pairs.slots + 1, arrays, 3);
    }
    if (status != PERP_OK)
        return status;
    if (number != NONE)
        world->pairs.free = world->pairs.all[number].next[0];
    else
        number = world->pairs.slots++;

    /* 2. the pair, and what it wakes */
    pair = &world->pairs.all[number];
    memset(pair, 0, sizeof *pair);
    pair->first = a < b ? a : b;
    pair->second = a < b ? b : a;
    pair->open = 1;
    pair->first_sleeping = pair->late = NONE;
    pair->spare = INFINITY;
    put_on_list(world, 2 * number);
    put_on_list(world, 2 * number + 1);
    for (int32_t side = 0; side < 2; side++) {
        const int32_t shape = shape_on(pair, side), body = world->shapes.all[shape].body;

        pair->body[side] = body;
        pair->reach[side] = perp__turning_reach(&world->shapes.all[shape]);
        pair->plane = pair->plane || is_plane(world, shape);
        perp__unsettle(world, body);
        perp__stop_coasting(world, body);
        if (world->bodies.all[body].kind == PERP_BODY_DYNAMIC)
            perp__rouse(world, body);
    }

    /* 3. for the order of pairs: while those added are few, and nothing was roused */
    if (world->sleep.awake_changed || world->pairs.added >= world->pairs.capacity / 2)
        world->pairs.changed = 2;
    if (world->pairs.changed < 2) {
        perp__keyed *added = &world->pairs.order[world->pairs.capacity + world->pairs.added++];

        added->key = key_of(world, number);
        added->value = number;
        world->pairs.changed |= 1;
    }
    return PERP_OK;
}

/* ---- the order of pairs ---- */

/* All of them anew: each in the charge of one shape awake. Pairs with what was roused within the
 * step wait until that begins anew. */
static void sort_pairs(perp_world *world)
{
    perp__keyed *order = world->pairs.order;
    int32_t count = 0;

    for (int32_t i = 0; i < world->sleep.awake_shape_count; i++)
        for (int32_t link = world->shapes.all[world->sleep.awake_shapes[i]].first_link;
             link != NONE; link = world->pairs.all[link / 2].next[link % 2]) {
            perp__pair *pair = &world->pairs.all[link / 2];
            const perp__body *other =
                &world->bodies.all[world->shapes.all[shape_on(pair, 1 - link % 2)].body];

            if (other->awake ? link % 2 != 0 : other->kind == PERP_BODY_DYNAMIC)
                continue;
            pair->listed = 1;
            order[count].key = key_of(world, link / 2);
            order[count++].value = link / 2;
        }
    if (count > 0) /* NULL has no second half */
        perp__sort(order, order + world->pairs.capacity, count);
    world->pairs.count = count;
}

/* Keeps those of a list that still are what they were, and are listed or new. */
static int32_t sift_pairs(perp_world *world, perp__keyed *list, int32_t count, bool listed)
{
    int32_t kept = 0;

    for (int32_t i = 0; i < count; i++) {
        perp__pair *pair = &world->pairs.all[list[i].value];

        if (i + PERP__FETCHED_AHEAD < count)
            perp__fetch(&world->pairs.all[list[i + PERP__FETCHED_AHEAD].value], 1);
        if (pair->first == NONE || pair->listed != listed ||
            key_of(world, list[i].value) != list[i].key)
            continue;
        pair->listed = 1;
        list[kept++] = list[i];
    }
    return kept;
}

/* Pairs of what is awake by the slots of their shapes. */
static void order_pairs(perp_world *world)
{
    perp__keyed *order = world->pairs.order;
    perp__keyed *added = order ? order + world->pairs.capacity : NULL; /* NULL has no second half */

    if (world->pairs.changed >= 2) {
        sort_pairs(world);
    } else { /* what came and went since they were sorted */
        int32_t old = sift_pairs(world, order, world->pairs.count, 1);
        int32_t count = sift_pairs(world, added, world->pairs.added, 0);

        if (count > 0)
            perp__sort(added, added + count, count);
        world->pairs.count = old + count;
        for (int32_t to = old + count; count > 0;)
            order[--to] = old > 0 && order[old - 1].key > added[count - 1].key ? order[--old]
                                                                               : added[--count];
    }
    world->pairs.changed = world->pairs.added = 0;
}

/* ---- fat boxes ---- */

/* Whether a box reaches into a half-space; one that moves may come anywhere. */
static bool reaches_plane(const perp_world *world, const perp__bounds *box, int32_t plane)
{
    const perp__placed *placed = &world->step.placed[plane];
    double normal[3], lowest = 0.0, size = fabs(placed->geometry->offset);

    if (world->bodies.all[world->shapes.all[plane].body].kind != PERP_BODY_STATIC)
        return 1;
    perp__apply3(normal, placed->rotation, placed->geometry->normal);
    for (int32_t k = 0; k < 3; k++) {
        lowest += fmin(normal[k] * (box->low[k] - placed->position[k]),
                       normal[k] * (box->high[k] - placed->position[k]));
        size += fmax(fabs(box->low[k]), fabs(box->high[k])) + fabs(placed->position[k]);
    }
    return lowest <= placed->geometry->offset + PERP__ROUNDING_LIMIT * size;
}

static const perp__bounds *fat_box(const perp_world *world, int32_t shape)
{
    return &world->pairs.tree.nodes[world->shapes.all[shape].leaf].bounds;
}

/* Whether the boxes let the shapes meet. A sphere and a capsule are all that is within their radius
 * of a point and of a segment, and these are in the box without that radius: of balls in a grid,
 * whose boxes meet in 26 places, 6 stay. */
static bool are_near(const perp_world *world, int32_t a, int32_t b)
{
    const perp__bounds *box_a = fat_box(world, a), *box_b = fat_box(world, b);
    const double reach =
        world->shapes.all[a].geometry.radius + world->shapes.all[b].geometry.radius;
    double square = 0.0;

    for (int32_t k = 0; k < 3; k++) {
        const double apart =
            reach + perp__greater(box_a->low[k] - box_b->high[k], box_b->low[k] - box_a->high[k]);

        if (apart > 0.0)
            square += apart * apart;
    }
    return square <= reach * reach;
}

/* Drops the pairs of a shape that ended, and adds those that are new. */
static perp_status find_partners(perp_world *world, int32_t shape)
{
    const perp__bounds *fat = fat_box(world, shape);
    perp__tree_query query;
    perp_status status = PERP_OK;
    int32_t other, link = world->shapes.all[shape].first_link;

    /* 1. the others' shapes of those that stay are marked */
    world->pairs.mark++;
    while (link != NONE) {
        const perp__pair *pair = &world->pairs.all[link / 2];
        const int32_t next = pair->next[link % 2];
        bool near;

        other = shape_on(pair, 1 - link % 2);
        near = is_plane(world, other)
                   ? reaches_plane(world, fat, other)
                   : world->shapes.all[other].leaf != NONE && are_near(world, shape, other);
        if (near && can_touch(world, shape, other))
            world->shapes.all[other].mark = world->pairs.mark;
        else
            drop_pair(world, link / 2);
        link = next;
    }

    /* 2. boxes that overlap, then half-spaces that the box reaches into */
    perp__tree_start(&world->pairs.tree, &query);
    while (status == PERP_OK && (other = perp__tree_next(&world->pairs.tree, &query, fat)) != NONE)
        if (world->shapes.all[other].mark != world->pairs.mark && are_near(world, shape, other) &&
            can_touch(world, shape, other))
            status = add_pair(world, shape, other);
    for (other = world->pairs.first_plane; other != NONE && status == PERP_OK;
         other = world->shapes.all[other].next_plane)
        if (world->shapes.all[other].mark != world->pairs.mark && can_touch(world, shape, other) &&
            reaches_plane(world, fat, other))
            status = add_pair(world, shape, other);
    return status;
}

perp_status perp__fail_range(const perp_world *world, int32_t body)
{
    return perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                      "the step takes body %d beyond the range of numbers", (int)body);
}

static double space_of(const perp__shape *shape, double speed)
{
    return SPACE * shape->radius + 0.5 * speed;
}

/* Whether the shape's fat box holds the box, and is not too fat for it. */
static bool is_held(const perp_world *world, int32_t i, const perp__bounds *box, double space)
{
    const perp__bounds *fat;
    double excess = 0.0;

    if (world->shapes.all[i].leaf == NONE)
        return 0;
    fat = fat_box(world, i);
    for (int32_t k = 0; k < 3; k++) {
        if (!(fat->low[k] <= box->low[k] && box->high[k] <= fat->high[k]))
            return 0;
        excess = perp__greater(excess, (fat->high[k] - fat->low[k]) - (box->high[k] - box->low[k]));
    }
    return world->contacts.rounds > 0 || !(excess > AHEAD * 2.0 * space);
}

/* Lets the box hold what the body's motion does to the shape; returns how far that takes it. */
static double sweep(const perp__shape *shape, const double *moving, double h, perp__bounds *box,
                    double *ahead)
{
    const double radius = shape->radius;
    const double arm = perp__length3(shape->offset) + radius;
    const double turn = perp__lesser(h * perp__length3(moving + 3), 2.0) * arm;

    for (int32_t k = 0; k < 3; k++) {
        const double displacement = h * moving[k];

        box->low[k] += (displacement < 0.0 ? displacement : 0.0) - turn;
        box->high[k] += (displacement > 0.0 ? displacement : 0.0) + turn;
        ahead[k] = perp__lesser(perp__greater(AHEAD * displacement, -2.0 * radius), 2.0 * radius);
    }
    return perp__lesser(h * perp__length3(moving), radius) + turn;
}

/* Makes the fat boxes of a body hold its shapes where they are, and `more` around: where h > 0 also
 * where the motion at hand takes them, and as new boxes where they will be in a few steps, so as
 * not to come again in each. */
static perp_status enclose(perp_world *world, int32_t body, double h, double more)
{
    double *room = &world->step.motions[body].room;
    perp_status status = PERP_OK;

    *room = INFINITY;
    for (int32_t i = world->bodies.all[body].first_shape; i != NONE && status == PERP_OK;
         i = world->shapes.all[i].next_of_body) {
        perp__shape *shape = &world->shapes.all[i];
        double displacement = 0.0, space, ahead[3] = {0.0, 0.0, 0.0};
        perp__bounds box;

        if (is_plane(world, i))
            continue;
        perp__extent_of(&world->step.placed[i], more, &box);
        for (int32_t k = 0; k < 3 && shape->leaf != NONE; k++)
            *room = perp__lesser(*room, perp__lesser(box.low[k] - fat_box(world, i)->low[k],
                                                     fat_box(world, i)->high[k] - box.high[k]));
        if (h > 0.0)
            displacement = sweep(shape, world->step.motions[body].moving, h, &box, ahead);
        space = space_of(shape, displacement);
        if (is_held(world, i, &box, space))
            continue;
        *room = 0.0;
        for (int32_t k = 0; k < 3; k++) {
            box.low[k] = box.low[k] - space + (ahead[k] < 0.0 ? ahead[k] : 0.0);
            box.high[k] = box.high[k] + space + (ahead[k] > 0.0 ? ahead[k] : 0.0);
        }
        if (!(perp__is_finite3(box.low) && perp__is_finite3(box.high)))
            return perp__fail_range(world, body);
        if (shape->leaf != NONE)
            perp__tree_remove(&world->pairs.tree, shape->leaf);
        shape->leaf = perp__tree_insert(&world->pairs.tree, &box, i);
        status = find_partners(world, i);
        if (status != PERP_OK) { /* without a box it comes again */
            perp__tree_remove(&world->pairs.tree, shape->leaf);
            shape->leaf = NONE;
        }
    }
    return status;
}

bool perp__stays_enclosed(const perp_world *world, int32_t body, const double *moving, double h)
{
    const perp__state *state = &world->bodies.states[body];
    double R[9];

    perp__rotation_of(world, state, R);
    for (int32_t i = world->bodies.all[body].first_shape; i != NONE;
         i = world->shapes.all[i].next_of_body) {
        const perp__shape *shape = &world->shapes.all[i];
        double ahead[3];
        perp__placed placed;
        perp__bounds box;

        if (shape->leaf == NONE)
            return 0;
        perp__place_shape(shape, state->position, R, 1, &placed);
        perp__extent_of(&placed, 0.0, &box);
        if (!is_held(world, i, &box, space_of(shape, sweep(shape, moving, h, &box, ahead))))
            return 0;
    }
    return 1;
}

/* All of a body while it is at hand: what is awake may be more than a cache holds. */
perp_status perp__enclose_motions(perp_world *world, double h)
{
    perp_status status = PERP_OK;

    /* 1. Half-spaces in place, before boxes are held against them; those that came or moved make
     * their pairs anew. */
    for (int32_t i = world->pairs.first_plane; i != NONE; i = world->shapes.all[i].next_plane)
        if (world->bodies.all[world->shapes.all[i].body].awake)
            perp__keep_placed(world, world->shapes.all[i].body);
    if (world->pairs.planes_changed)
        perp__find_clusters(world);
    for (int32_t i = 0; i < world->shapes.slots && world->pairs.planes_changed && status == PERP_OK;
         i++)
        if (world->shapes.all[i].alive && world->shapes.all[i].leaf != NONE)
            status = find_partners(world, i);
    if (world->pairs.planes_changed)
        world->pairs.changed = 2; /* what sleeps has new ones too */
    if (status == PERP_OK)
        world->pairs.planes_changed = 0;
    /* 2. Bodies, each as a whole while it is at hand. */
    world->step.moving_count = 0;
    for (int32_t i = 0; i < world->sleep.awake_count && status == PERP_OK; i++) {
        const int32_t body = world->sleep.awake[i];

        if (!perp__has_pairs(world, body) && perp__glide(world, body, h))
            continue;
        status = perp__start_motion(world, body, h) ? enclose(world, body, h, 0.0)
                                                    : perp__fail_range(world, body);
        world->step.moving[world->step.moving_count++] = body;
    }
    if (world->pairs.changed)
        order_pairs(world);
    return status;
}

perp_status perp__enclose(perp_world *world, const int32_t *bodies, int32_t count, double h,
                          double ways)
{
    perp_status status = PERP_OK;

    for (int32_t i = 0; i < count && status == PERP_OK; i++) {
        perp__motion *motion = &world->step.motions[bodies[i]];
        const bool widens = ways > 0.0 && perp__is_dynamic(world, bodies[i]);

        if (ways > 0.0 || !motion->enclosed)
            status = enclose(world, bodies[i], h, widens ? ways * motion->overlap : 0.0);
        motion->enclosed |= h > 0.0;
    }
    if (world->pairs.changed)
        order_pairs(world);
    return status;
}

/* Takes a shape off a list of shapes. */
static void unlink_shape(perp_world *world, int32_t *link, size_t next, int32_t i)
{
    while (*link != i)
        link = (int32_t *)((char *)&world->shapes.all[*link] + next);
    *link = *(int32_t *)((char *)&world->shapes.all[i] + next);
}

void perp__forget_shape(perp_world *world, int32_t i)
{
    perp__shape *shape = &world->shapes.all[i];

    while (shape->first_link != NONE)
        drop_pair(world, shape->first_link / 2);
    if (shape->leaf != NONE)
        perp__tree_remove(&world->pairs.tree, shape->leaf);
    shape->leaf = NONE;
    if (is_plane(world, i))
        unlink_shape(world, &world->pairs.first_plane, offsetof(perp__shape, next_plane), i);
    unlink_shape(world, &world->bodies.all[shape->body].first_shape,
                 offsetof(perp__shape, next_of_body), i);
}

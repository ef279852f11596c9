/* The contact points of a step: the points that count, and as few others as can be.
 *
 * Shapes that touch plainly at the start, or lie in each other, have the points and the normal of
 * that pose, and so have those that would touch plainly in whatever way their bodies go, no farther
 * than they do; half-spaces do at any distance. All other pairs are open: they count only if the
 * motion at hand makes them meet, and take points and normal from the pose in which they do. That
 * is looked for once the plain points are solved for: what the floor holds does not sink into the
 * side of the next tile. Points that no motion so far closes are left out: a problem without some
 * contacts has a solution of the whole problem if its velocities keep these open too. */
#include "world/islands/lanes.h"

#include "base/context.h"

static perp_status grow(perp_world *world, perp__contact_set *set, int32_t needed)
{
    const perp__growing arrays[] = {PERP__GROWING(set->contacts, set->count, 1),
                                    PERP__GROWING(set->responses, set->count, 1),
                                    PERP__GROWING(set->flags, set->count, 1)};

    return perp__grow(world->context, "the contacts", &set->capacity, needed, arrays, 3);
}

/* Room for `needed` contacts, and as many memories; the last step's set is the next one's. */
perp_status perp__reserve_contacts(perp_world *world, perp__contact_set *set, int32_t needed)
{
    perp_status status;

    if (needed <= set->capacity)
        return PERP_OK;
    status = perp__reserve_memories(world, needed);
    if (status == PERP_OK && set == &world->contacts.now)
        status = grow(world, &world->contacts.last, needed);
    return status == PERP_OK ? grow(world, set, needed) : status;
}

void perp__write_arms(perp__world_contact *contact, const double *centre_a, const double *centre_b)
{
    const double half = 0.5 * fmax(contact->gap, 0.0);

    perp__subtract3(contact->arms[0], contact->position, centre_a);
    perp__add3(contact->arms[0], -half, contact->axes[0]);
    perp__subtract3(contact->arms[1], contact->position, centre_b);
    perp__add3(contact->arms[1], half, contact->axes[0]);
}

/* Writes point number i of a set, which takes no part yet, of bodies in these states; the contact
 * `last` before may be the same pair's: what points of a pair have in common is that one's then. */
static void write_contact(const perp_world *world, const perp__contact_set *set, int32_t i,
                          const perp__world_contact *last, const perp__pair *pair,
                          const perp__point *point, const perp__state *states)
{
    const perp__shape *a = &world->shapes.all[pair->first];
    const perp__shape *b = &world->shapes.all[pair->second];
    perp__world_contact *contact = &set->contacts[i];
    perp__response *response = &set->responses[i];
    perp__contact_flags *flags = &set->flags[i];

    if (last && last->shape_a == pair->first && last->shape_b == pair->second &&
        last->round == world->contacts.rounds &&
        memcmp(last->axes[0], point->normal, sizeof point->normal) == 0) {
        memcpy(contact->axes, last->axes, sizeof *contact - offsetof(perp__world_contact, axes));
    } else {
        contact->body_a = a->body;
        contact->body_b = b->body;
        contact->shape_a = pair->first;
        contact->shape_b = pair->second;
        contact->generations[0] = world->bodies.all[a->body].generation;
        contact->generations[1] = world->bodies.all[b->body].generation;
        contact->generations[2] = a->generation;
        contact->generations[3] = b->generation;
        contact->pair = (int32_t)(pair - world->pairs.all);
        contact->round = world->contacts.rounds;
        contact->rounding = perp__pair_rounding(world, pair);
        contact->size = perp__pair_size(world, pair);
        contact->friction = perp__pair_friction(a, b);
        contact->restitution = perp__greater(a->restitution, b->restitution);
        perp__copy3(contact->axes[0], point->normal);
        perp__contact_frame(world, contact);
    }
    memset(response, 0, sizeof *response);
    response->later = -1;
    contact->feature = (uint64_t)point->feature;
    perp__copy3(contact->position, point->position);
    contact->gap = point->gap;
    perp__write_arms(contact, states[a->body].position, states[b->body].position);
    perp__recall(world, pair, contact, response->warm, response->base);
    memset(flags, 0, sizeof *flags);
    flags->body[0] = contact->body_a;
    flags->body[1] = contact->body_b;
    flags->rubs = contact->friction > 0.0;
}

perp__world_contact *perp__append_contact(const perp_world *world, perp__contact_set *set,
                                          const perp__pair *pair, const perp__point *point,
                                          const perp__state *states)
{
    const int32_t i = set->count++;

    write_contact(world, set, i, i > 0 ? &set->contacts[i - 1] : NULL, pair, point, states);
    return &set->contacts[i];
}

void perp__prepare_contact(const perp_world *world, const perp__contact_set *set, int32_t i)
{
    perp__world_contact *contact = &set->contacts[i];
    perp__response *response = &set->responses[i];

    contact->start = perp__normal_velocity(world, contact, PERP__TWIST_START);
    contact->free = perp__normal_velocity(world, contact, PERP__TWIST_FREE);
    set->flags[i].deep = (int8_t)perp__is_deep(contact);
    perp__copy3(response->remembered, response->warm);
}

void perp__write_touching(const perp_world *world, int32_t i, const perp__world_contact *last,
                          const perp__pair *pair, const perp__point *point)
{
    const perp__contact_set *set = &world->contacts.now;

    write_contact(world, set, i, last, pair, point, world->bodies.states);
    set->flags[i].closed = !(set->contacts[i].gap > set->contacts[i].rounding);
    perp__prepare_contact(world, set, i);
}

double perp__longest_displacement(const perp_world *world, int32_t body, double h)
{
    const double *moving = world->step.motions[body].moving;

    return h * (perp__length3(moving) + perp__length3(moving + 3) * world->bodies.all[body].radius);
}

/* The points of a pair that touches plainly, unless its contacts have them; how many there are.
 * Beyond the gap `spare` they are left out: the corners of a box far from the half-space it is
 * before, until a motion might take them there. */
static int32_t touch(const perp_world *world, perp__pair *pair, double h, perp__point *points)
{
    double far = INFINITY;

    if (pair->plane) {
        const int32_t side = world->shapes.all[pair->first].geometry.kind == PERP__PLANE ? 0 : 1;

        if (world->bodies.all[pair->body[side]].kind == PERP_BODY_STATIC)
            far = perp__greater(PERP__NEAR * perp__pair_size(world, pair),
                                perp__longest_displacement(world, pair->body[1 - side], h));
    }
    pair->same = world->sleep.settled > 0 && perp__stays_same(world, pair);
    if (!pair->same)
        pair->made = (int8_t)perp__touching_points(world, pair, h, far, points);
    pair->open = pair->made == 0;
    pair->joined = 0;
    pair->late = -1;
    pair->spare = pair->open ? INFINITY : far;
    return pair->made;
}

/* ---- the points of a share's pairs, and after room was made the contacts ---- */

static void touch_share(perp_world *world, perp__share *share, double h)
{
    share->count = 0;
    for (int32_t i = share->first; i < share->end && share->status == PERP_OK; i++) {
        const perp__growing array = PERP__GROWING(share->points, share->count, 1);
        perp__pair *pair = perp__ordered_pair(world, i);

        share->status = perp__grow(share->context, NULL, &share->capacity,
                                   share->count + PERP__MAX_POINTS, &array, 1);
        if (share->status == PERP_OK)
            share->count += touch(world, pair, h, share->points + share->count);
    }
}

static void write_share(perp_world *world, perp__share *share, double h)
{
    const perp__point *point = share->points;
    const perp__world_contact *last = NULL;
    int32_t number = share->contact;

    (void)h;
    for (int32_t i = share->first; i < share->end; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->first_now = number;
        for (int32_t k = 0; k < pair->made; k++, point++) {
            if (pair->same)
                perp__repeat_contact(world, pair, k, number);
            else
                perp__write_touching(world, number, last, pair, point);
            last = &world->contacts.now.contacts[number++];
        }
        perp__hand_over(world, pair);
    }
}

/* The set of all pairs that touch, from what the shares found. */
static perp_status gather_shares(perp_world *world, int32_t lanes, double h)
{
    int32_t count = 0;
    perp_status status = PERP_OK;

    for (int32_t k = 0; k < lanes && status == PERP_OK; k++) {
        perp__share *share = &world->lanes[k].share;

        status = share->status;
        share->contact = count;
        if (share->count > INT32_MAX - count)
            status = PERP_ERROR_MEMORY;
        count += status == PERP_OK ? share->count : 0;
    }
    if (status != PERP_OK)
        return perp__fail_memory(world->context, "the contacts");
    status = perp__reserve_contacts(world, &world->contacts.now, count);
    if (status != PERP_OK)
        return status;
    (void)perp__share_out(world, world->pairs.count, write_share, h, NULL);
    world->contacts.now.count = count;
    return PERP_OK;
}

/* A pair alone, where pairs are not shared out. */
static perp_status touch_alone(perp_world *world, int32_t i, double h)
{
    perp__point points[PERP__MAX_POINTS];
    perp__share share = {.first = i, .end = i + 1, .points = points, .capacity = PERP__MAX_POINTS};
    perp_status status;

    touch_share(world, &share, h);
    share.contact = world->contacts.now.count;
    status = perp__reserve_contacts(world, &world->contacts.now, share.contact + share.count);
    if (status == PERP_OK) {
        write_share(world, &share, h);
        world->contacts.now.count += share.count;
    }
    return status;
}

perp_status perp__find_contacts(perp_world *world, double h)
{
    perp_status status;
    int32_t lanes = 0;

    /* 1. Pairs, and what they remember. */
    world->contacts.now.count = world->contacts.now.included = world->contacts.now.rubbing = 0;
    world->contacts.rounds = 0;
    status = perp__enclose_motions(world, h);
    if (status == PERP_OK && world->memory.restored)
        perp__find_memories(world);
    if (status == PERP_OK && world->sleep.settled > 0)
        perp__note_settled(world);
    /* 2. How each pair takes part, and the points of those that touch plainly. */
    if (status == PERP_OK)
        lanes = perp__share_out(world, world->pairs.count, touch_share, h, NULL);
    if (lanes > 0)
        status = gather_shares(world, lanes, h);
    for (int32_t i = 0; i < world->pairs.count && status == PERP_OK; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);

        if (lanes == 0)
            status = touch_alone(world, i, h);
        for (int32_t side = 0; side < 2 && pair->spare < INFINITY; side++) {
            double *spare = &world->step.motions[pair->body[side]].spare; /* other pairs' as well */

            *spare = pair->spare < *spare ? pair->spare : *spare;
        }
    }
    world->contacts.now.early = world->contacts.now.count;
    if (status == PERP_OK && world->sleep.some_put && !world->sleep.awake_changed)
        perp__find_put(world);
    return status;
}

perp_status perp__find_overlaps(perp_world *world, double ways)
{
    perp__contact_set *set = &world->contacts.overlaps;
    perp__point points[PERP__MAX_POINTS];
    perp_status status =
        perp__enclose(world, world->sleep.awake, world->sleep.awake_count, 0.0, ways);

    set->count = 0;
    for (int32_t i = 0; i < world->pairs.count && status == PERP_OK; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);
        double margin = 0.0;
        int32_t made = 0;

        for (int32_t side = 0; side < 2; side++)
            if (perp__is_dynamic(world, pair->body[side]))
                margin += ways * world->step.motions[pair->body[side]].overlap;
        if (!(margin > 0.0) || perp__is_swept(world, pair) || !perp__are_near(world, pair, margin))
            continue;
        status = perp__reserve_contacts(world, set, set->count + PERP__MAX_POINTS);
        if (status == PERP_OK)
            made =
                perp__collide(&world->step.placed[pair->first], &world->step.placed[pair->second],
                              world->settings.planar, margin, points);
        for (int32_t k = 0; k < made; k++) {
            (void)perp__append_contact(world, set, pair, &points[k], world->step.next);
            set->flags[set->count - 1].included = 1;
        }
    }
    return status;
}

/* ---- what pairs and their shapes measure: sizes, roundings, how far a motion takes them ---- */

static double rounding_of(const perp_world *world, int32_t shape)
{
    const perp__shape *at = &world->shapes.all[shape];

    return PERP__SUM_ROUNDING * (perp__largest3(world->step.placed[shape].position) + at->radius +
                                 fabs(at->geometry.offset));
}

double perp__pair_rounding(const perp_world *world, const perp__pair *pair)
{
    return rounding_of(world, pair->first) + rounding_of(world, pair->second);
}

double perp__pair_size(const perp_world *world, const perp__pair *pair)
{
    const double a = world->bodies.all[world->shapes.all[pair->first].body].radius;
    const double b = world->bodies.all[world->shapes.all[pair->second].body].radius;

    return a > 0.0 && b > 0.0 ? 2.0 * fmin(a, b) : a + b;
}

double perp__pair_thickness(const perp_world *world, const perp__pair *pair)
{
    double size = perp__lesser(world->shapes.all[pair->first].thickness,
                               world->shapes.all[pair->second].thickness);

    return isfinite(size) ? size : 0.0;
}

double perp__pair_touching(const perp_world *world, const perp__pair *pair, double rounding)
{
    return PERP__NEGLIGIBLE * perp__pair_thickness(world, pair) + rounding;
}

bool perp__are_near(const perp_world *world, const perp__pair *pair, double margin)
{
    const perp__placed *a = &world->step.placed[pair->first],
                       *b = &world->step.placed[pair->second];
    const double reach = a->radius + b->radius + margin;
    double between[3];

    perp__subtract3(between, b->position, a->position);
    return perp__dot3(between, between) <= reach * reach || !isfinite(reach * reach);
}

/* A ball in its body's centre does not. */
static bool rotates(const perp__shape *shape)
{
    return shape->geometry.kind != PERP__SPHERE || !perp__is_zero3(shape->offset);
}

double perp__turning_reach(const perp__shape *shape)
{
    return rotates(shape) ? shape->reach : 0.0;
}

void perp__moving_shape(const perp_world *world, int32_t shape, double h, perp__moving *moving)
{
    const perp__shape *at = &world->shapes.all[shape];
    const double *twist = world->step.motions[at->body].moving;
    const bool turns = rotates(at);

    moving->start = &world->step.placed[shape];
    moving->reach = at->reach;
    perp__copy3(moving->centre, world->bodies.states[at->body].position);
    for (int32_t k = 0; k < 3; k++) {
        moving->displacement[k] = h * twist[k];
        moving->turn[k] = turns ? h * twist[3 + k] : 0.0;
    }
}

double perp__way_of(const perp__moving *shape)
{
    return perp__length3(shape->displacement) + perp__length3(shape->turn) * shape->reach;
}

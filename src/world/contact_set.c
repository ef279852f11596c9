/* The contact points of a step: the points that count, and as few others as can be.
 *
 * Shapes that touch plainly at the start, or lie in each other, have the points and the normal of
 * that pose; half-spaces do at any distance. All other pairs are open: they count only if the
 * motion at hand makes them meet, and take points and normal from the pose in which they do. First
 * come the plain points, and once these are solved for the motion is that of the solution: what the
 * floor holds does not sink into the side of the next tile. Points that no motion so far closes are
 * left out: a problem without some contacts has a solution of the whole problem if its velocities
 * keep these open too.
 */
#include "world/world.h"

#include <string.h>

#include "base/context.h"
#include "world/collide/meeting.h"
#include "linalg/spatial.h"

/* How often an open pair may join; rounds in which doubtful meetings wait for others; and rounds
 * after which what still meets is left to the projection. */
#define MAX_JOINS 3
#define PATIENCE 8
#define MAX_ROUNDS 24

/* Radians in a step beyond which a linear contact says little. */
#define LARGE_TURN 0.25

perp_status perp__reserve_memories(perp_world *world, int32_t count)
{
    const size_t used = (size_t)world->memory_count, room = (size_t)count;
    perp__memory *memories, *next;

    if (count <= world->memory_capacity)
        return PERP_OK;
    next = perp__grown(world->context, world->next_memories, 0, room * sizeof *next);
    if (!next)
        return perp__fail_memory(world->context, "the contacts");
    world->next_memories = next;
    memories = perp__grown(world->context, world->memories, used * sizeof *memories,
                           room * sizeof *memories);
    if (!memories)
        return perp__fail_memory(world->context, "the contacts");
    world->memories = memories;
    world->memory_capacity = count;
    return PERP_OK;
}

static perp_status grow(perp_world *world, perp__contact_set *set, int32_t capacity)
{
    perp__world_contact *contacts =
        perp__grown(world->context, set->contacts, (size_t)set->count * sizeof *contacts,
                    (size_t)capacity * sizeof *contacts);

    if (!contacts)
        return perp__fail_memory(world->context, "the contacts");
    set->contacts = contacts;
    set->capacity = capacity;
    return PERP_OK;
}

/* Room for `needed` contacts, and as many memories of them; the last step's set is the next one's.
 */
static perp_status reserve_contacts(perp_world *world, perp__contact_set *set, int32_t needed)
{
    int32_t capacity = set->capacity > 0 ? set->capacity : PERP__MAX_POINTS;
    perp_status status;

    if (needed <= set->capacity)
        return PERP_OK;
    if (needed > INT32_MAX / 4)
        return perp__fail_memory(world->context, "the contacts");
    while (capacity < needed)
        capacity *= 2;
    status = perp__reserve_memories(world, capacity);
    if (status == PERP_OK && set == &world->contacts && world->last.capacity < capacity)
        status = grow(world, &world->last, capacity);
    return status == PERP_OK ? grow(world, set, capacity) : status;
}

/* The geometric mean; exact where both are equal. */
static double pair_friction(double a, double b)
{
    return a == b ? a : sqrt(a) * sqrt(b);
}

/* What the last step gave to the point, along its axes now; the same bits where these are. */
static void take_memory(const perp_world *world, const perp__memory *memory,
                        perp__world_contact *contact)
{
    perp__world_contact then;
    double impulse[3] = {0.0, 0.0, 0.0};

    if (memcmp(memory->normal, contact->axes[0], sizeof memory->normal) == 0) {
        perp__copy3(contact->warm, memory->impulse);
        return;
    }
    perp__copy3(then.axes[0], memory->normal);
    perp__contact_frame(world, &then);
    for (int32_t k = 0; k < 3; k++)
        perp__add3(impulse, memory->impulse[k], then.axes[k]);
    for (int32_t k = 0; k < 3; k++)
        contact->warm[k] = perp__dot3(contact->axes[k], impulse);
}

static void recall(const perp_world *world, const perp__pair *pair, perp__world_contact *contact)
{
    for (int32_t i = pair->first_kept; i >= 0; i = world->kept[i].next)
        if (world->kept[i].memory.feature == contact->feature) {
            take_memory(world, &world->kept[i].memory, contact);
            return;
        }
    for (int32_t i = 0; i < pair->memories; i++)
        if (world->memories[pair->first_memory + i].feature == contact->feature) {
            take_memory(world, &world->memories[pair->first_memory + i], contact);
            return;
        }
}

/* What the points of a pair have in common. */
static void begin_contact(const perp_world *world, perp__world_contact *contact,
                          const perp__pair *pair, const double *normal)
{
    const perp__shape *a = &world->shapes[pair->first];
    const perp__shape *b = &world->shapes[pair->second];

    memset(contact, 0, sizeof *contact);
    contact->body_a = a->body;
    contact->body_b = b->body;
    contact->shape_a = pair->first;
    contact->shape_b = pair->second;
    contact->generations[0] = world->bodies[a->body].generation;
    contact->generations[1] = world->bodies[b->body].generation;
    contact->generations[2] = a->generation;
    contact->generations[3] = b->generation;
    contact->pair = (int32_t)(pair - world->pairs);
    contact->round = world->rounds;
    contact->rounding = perp__pair_rounding(world, pair);
    contact->size = perp__pair_size(world, pair);
    contact->friction = pair_friction(a->friction, b->friction);
    contact->restitution = fmax(a->restitution, b->restitution);
    perp__copy3(contact->axes[0], normal);
    perp__contact_frame(world, contact);
}

/* Appends a point, of which there is room for; the point before may be the same pair's. */
static perp__world_contact *append(const perp_world *world, perp__contact_set *set,
                                   const perp__pair *pair, const perp__point *point)
{
    perp__world_contact *contact = &set->contacts[set->count++];
    const perp__world_contact *last = contact - 1;

    if (set->count > 1 && last->shape_a == pair->first && last->shape_b == pair->second &&
        last->round == world->rounds &&
        memcmp(last->axes[0], point->normal, sizeof point->normal) == 0) {
        *contact = *last;
        memset(contact->warm, 0, sizeof contact->warm);
    } else {
        begin_contact(world, contact, pair, point->normal);
    }
    contact->feature = (uint64_t)point->feature;
    perp__copy3(contact->position, point->position);
    contact->gap = point->gap;
    recall(world, pair, contact);
    return contact;
}

/* Arms from the mass centres of bodies in the given states. */
static void set_arms(const perp__state *states, perp__world_contact *contact)
{
    for (int32_t k = 0; k < 3; k++) {
        contact->arms[0][k] = contact->position[k] - states[contact->body_a].position[k];
        contact->arms[1][k] = contact->position[k] - states[contact->body_b].position[k];
    }
}

/* Velocities as if nothing touched. */
static void prepare_contact(const perp_world *world, perp__world_contact *contact)
{
    perp__relative_velocity(world, contact, PERP__TWIST_START, contact->start);
    perp__relative_velocity(world, contact, PERP__TWIST_FREE, contact->free);
    perp__copy3(contact->velocity, contact->free);
    perp__copy3(contact->remembered, contact->warm);
}

/* Appends the points of a pair in the given states, with gaps up to `margin`. */
static perp_status add_points(perp_world *world, perp__contact_set *set, const perp__pair *pair,
                              const perp__state *states, double margin)
{
    perp__point points[PERP__MAX_POINTS];
    int32_t made;
    perp_status status = reserve_contacts(world, set, set->count + PERP__MAX_POINTS);

    if (status != PERP_OK)
        return status;
    made = perp__collide(&world->placed[pair->first], &world->placed[pair->second],
                         world->settings.planar, margin, points);
    for (int32_t i = 0; i < made; i++) {
        perp__world_contact *contact = append(world, set, pair, &points[i]);

        set_arms(states, contact);
    }
    return PERP_OK;
}

/* The pair of two shapes, among the ordered; NULL if there is none. */
static perp__pair *find_pair(const perp_world *world, int32_t first, int32_t second)
{
    int32_t low = 0, high = world->pair_count;

    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        perp__pair *pair = perp__ordered_pair(world, middle);

        if (pair->first == first && pair->second == second)
            return pair;
        if (pair->first < first || (pair->first == first && pair->second < second))
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

/* Gives memories that came with a snapshot back to their pairs. */
static void find_memories(perp_world *world)
{
    perp__pair *pair = NULL;

    if (!world->memories_restored)
        return;
    world->memories_restored = 0;
    for (int32_t i = 0; i < world->pair_slots; i++)
        world->pairs[i].memories = 0;
    for (int32_t i = 0; i < world->memory_count; i++) {
        const perp__memory *memory = &world->memories[i];

        if (i == 0 || memory->first != memory[-1].first || memory->second != memory[-1].second) {
            pair = find_pair(world, memory->first, memory->second);
            if (pair)
                pair->first_memory = i;
        }
        if (pair)
            pair->memories++;
    }
}

/* Decides how each pair takes part, and makes the points of those that touch plainly. */
perp_status perp__find_contacts(perp_world *world, double h)
{
    perp__point points[PERP__MAX_POINTS];
    int32_t made;
    perp_status status;

    world->contacts.count = 0;
    world->rounds = 0;
    status = perp__cover_motions(world, h);
    if (status == PERP_OK)
        find_memories(world);
    for (int32_t i = 0; i < world->pair_count && status == PERP_OK; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->joined = pair->waited = 0;
        made = perp__touching_points(world, pair, h, points);
        pair->open = made == 0;
        status = reserve_contacts(world, &world->contacts, world->contacts.count + made);
        for (int32_t q = 0; q < made && status == PERP_OK; q++) {
            perp__world_contact *contact = append(world, &world->contacts, pair, &points[q]);

            set_arms(world->states, contact);
            prepare_contact(world, contact);
        }
    }
    return status;
}

/* A body that comes from farther than it is long is hit in its mass centre: a step in which it
 * would turn by many radians says nothing about the points beside it, and they let the centre
 * through. */
static void centre_arm(perp__world_contact *contact, int32_t side)
{
    const double along = perp__dot3(contact->axes[0], contact->arms[side]);

    for (int32_t k = 0; k < 3; k++)
        contact->arms[side][k] = along * contact->axes[0][k];
}

/* The point as seen from the start: arms are those of the meeting, the gap is what the motion has
 * closed till then. */
static void set_back(const perp_world *world, perp__world_contact *contact, double t,
                     const perp__moving *a, const perp__moving *b)
{
    const perp__moving *sides[2] = {a, b};
    double closed = 0.0;

    for (int32_t side = 0; side < 2; side++) {
        double turned[3], at[3];

        for (int32_t k = 0; k < 3; k++)
            contact->arms[side][k] =
                contact->position[k] - (sides[side]->centre[k] + t * sides[side]->way[k]);
        if (t * perp__length3(sides[side]->way) > sides[side]->reach)
            centre_arm(contact, side);
        perp__cross(turned, sides[side]->turn, contact->arms[side]);
        for (int32_t k = 0; k < 3; k++)
            at[k] = sides[side]->way[k] + turned[k];
        closed += (side == 0 ? t : -t) * perp__dot3(contact->axes[0], at);
        for (int32_t k = 0; k < 3; k++)
            contact->position[k] -= 0.5 * t * at[k];
    }
    contact->gap += closed;
    prepare_contact(world, contact);
}

static int32_t has_feature(const perp__contact_set *set, const perp__pair *pair, int32_t feature)
{
    for (int32_t i = 0; i < set->count; i++)
        if (set->contacts[i].shape_a == pair->first && set->contacts[i].shape_b == pair->second &&
            set->contacts[i].feature == (uint64_t)feature)
            return 1;
    return 0;
}

/* Appends the points in which a pair meets. */
static perp_status join_pair(perp_world *world, perp__pair *pair, double h)
{
    const perp__moving a = perp__moving_shape(world, pair->first, h);
    const perp__moving b = perp__moving_shape(world, pair->second, h);
    perp__point points[PERP__MAX_POINTS];
    int32_t i, made = perp__meeting_points(world, pair, h, points);
    perp_status status = reserve_contacts(world, &world->contacts, world->contacts.count + made);

    for (i = 0; i < made && status == PERP_OK; i++) {
        perp__world_contact *contact;

        if (pair->joined > 0 && has_feature(&world->contacts, pair, points[i].feature))
            continue;
        contact = append(world, &world->contacts, pair, &points[i]);
        set_back(world, contact, pair->meeting.time, &a, &b);
    }
    pair->joined += made > 0;
    return status;
}

/* How far the motion at hand may take a point, at most. */
static double way_of(const perp_world *world, const perp__world_contact *contact, double h)
{
    const double *a = world->motions[contact->body_a].moving;
    const double *b = world->motions[contact->body_b].moving;

    return h * (perp__length3(a) + perp__length3(a + 3) * perp__length3(contact->arms[0]) +
                perp__length3(b) + perp__length3(b + 3) * perp__length3(contact->arms[1]));
}

/* Includes the points that the motion at hand closes, and those so near that another motion may;
 * returns how many. */
static int32_t include_points(perp_world *world, double h)
{
    int32_t i, came = 0;

    for (i = 0; i < world->contacts.count; i++) {
        perp__world_contact *contact = &world->contacts.contacts[i];
        double u[3];

        if (contact->included)
            continue;
        perp__relative_velocity(world, contact, PERP__TWIST_MOVING, u);
        if (contact->gap + h * u[0] >= 0.0 && contact->gap > contact->rounding &&
            (contact->gap > PERP__NEAR * contact->size ||
             contact->gap > 2.0 * way_of(world, contact, h)))
            continue;
        contact->included = contact->fresh = 1;
        came++;
    }
    return came;
}

/* Whether the motion of either body is not the one that was looked at last. */
static int32_t is_new(const perp_world *world, const perp__pair *pair)
{
    return world->motions[world->shapes[pair->first].body].moved == world->rounds ||
           world->motions[world->shapes[pair->second].body].moved == world->rounds;
}

/* Motions that the islands changed: all others are what they were. */
static void look_for_new_motions(perp_world *world)
{
    for (int32_t i = perp__count_members(world); i-- > 0;) {
        perp__motion *motion = &world->motions[world->body_order[i]];

        if (memcmp(motion->tried, motion->moving, sizeof motion->tried) == 0)
            continue;
        memcpy(motion->tried, motion->moving, sizeof motion->tried);
        motion->moved = world->rounds;
        motion->covered = 0;
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
    perp_status status;

    status = perp__cover_changes(world, h);
    for (int32_t i = 0; i < world->pair_count && status == PERP_OK; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);
        perp__motion *a = &world->motions[world->shapes[pair->first].body];
        perp__motion *b = &world->motions[world->shapes[pair->second].body];

        pair->met = is_worth_a_look(world, pair, h) && perp__pair_meets(world, pair, h);
        if (!pair->met)
            continue;
        a->earliest = fmin(a->earliest, pair->meeting.time);
        b->earliest = fmin(b->earliest, pair->meeting.time);
    }
    for (int32_t i = 0; i < world->pair_count && status == PERP_OK; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);
        const int32_t bodies[2] = {world->shapes[pair->first].body,
                                   world->shapes[pair->second].body};
        int32_t k, waits = 0;

        for (k = 0; pair->met && k < 2; k++)
            waits = waits || (pair->meeting.doubtful && world->rounds < PATIENCE &&
                              world->bodies[bodies[k]].kind == PERP_BODY_DYNAMIC &&
                              world->motions[bodies[k]].earliest < pair->meeting.time);
        pair->waited = pair->waited || (pair->met && waits);
        if (pair->met && waits)
            world->motions[bodies[0]].moved = world->rounds + 1; /* again in the next round */
        else if (pair->met)
            status = join_pair(world, pair, h);
    }
    for (int32_t i = 0; i < world->pair_count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);

        if (!pair->met)
            continue;
        world->motions[world->shapes[pair->first].body].earliest = INFINITY;
        world->motions[world->shapes[pair->second].body].earliest = INFINITY;
    }
    return status;
}

perp_status perp__join_contacts(perp_world *world, double h, int32_t *came)
{
    perp_status status;

    *came = include_points(world, h);
    if (*came > 0)
        return PERP_OK;
    world->rounds++;
    look_for_new_motions(world);
    if (world->rounds > MAX_ROUNDS)
        return PERP_OK;
    status = join_meetings(world, h);
    if (status == PERP_OK)
        *came = include_points(world, h);
    return status;
}

perp_status perp__find_overlaps(perp_world *world, double margin)
{
    perp_status status = perp__cover_places(world, 0.5 * margin);

    world->overlaps.count = 0;
    for (int32_t i = 0; i < world->pair_count && status == PERP_OK; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);

        if (perp__are_near(world, pair, margin))
            status = add_points(world, &world->overlaps, pair, world->next, margin);
    }
    for (int32_t i = 0; i < world->overlaps.count; i++)
        world->overlaps.contacts[i].included = 1;
    return status;
}

/* The contact's pair; NULL if it ended within the step. */
static perp__pair *pair_of(const perp_world *world, const perp__world_contact *contact)
{
    perp__pair *pair = &world->pairs[contact->pair];

    return pair->first == contact->shape_a && pair->second == contact->shape_b ? pair : NULL;
}

/* Whether the pair's memories are other ones than those of the step before. */
static int32_t is_news(const perp_world *world, const perp__pair *pair)
{
    return pair->memories != pair->had ||
           (pair->had > 0 &&
            memcmp(&world->memories[pair->had_first], &world->next_memories[pair->first_memory],
                   (size_t)pair->had * sizeof *world->memories) != 0);
}

void perp__write_memory(const perp__world_contact *contact, perp__memory *memory)
{
    memory->first = contact->shape_a;
    memory->second = contact->shape_b;
    memory->feature = contact->feature;
    perp__copy3(memory->normal, contact->axes[0]);
    perp__copy3(memory->impulse, contact->next);
}

void perp__remember(perp_world *world)
{
    perp__memory *memories = world->next_memories;
    int32_t i, count = 0;

    for (i = 0; i < world->pair_count; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->had_first = pair->first_memory;
        pair->had = pair->memories;
        pair->memories = 0;
    }
    for (i = 0; i < world->contacts.count; i++) {
        const perp__world_contact *contact = &world->contacts.contacts[i];

        if (pair_of(world, contact))
            pair_of(world, contact)->memories++;
        else
            world->motions[contact->body_a].repeats = world->motions[contact->body_b].repeats = 0;
    }
    for (i = 0; i < world->pair_count; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->first_memory = count;
        count += pair->memories;
        pair->memories = 0;
    }
    for (i = 0; i < world->contacts.count; i++) {
        perp__pair *pair = pair_of(world, &world->contacts.contacts[i]);

        if (pair)
            perp__write_memory(&world->contacts.contacts[i],
                               &memories[pair->first_memory + pair->memories++]);
    }
    for (i = 0; i < world->pair_count; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->changed = pair->first_kept >= 0 || is_news(world, pair);
        perp__drop_kept(world, pair->first_kept);
        pair->first_kept = -1;
    }
    world->next_memories = world->memories;
    world->memories = memories;
    world->memory_count = count;
    world->memories_restored = 0;
}

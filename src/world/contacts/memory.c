/* What a step's contacts leave to those of the next: impulses, known by pair and feature, in the
 * order of the pairs. Those of pairs that sleep are kept with them (rest.c). And the points
 * themselves, to the last bit, where two bodies ended the step as they began it, and so did what is
 * near them and might cover what they meet with. */
#include "world/step.h"

perp_status perp__reserve_memories(perp_world *world, int32_t count)
{
    const perp__growing arrays[] = {PERP__GROWING(world->memory.next, world->memory.capacity, 1),
                                    PERP__GROWING(world->memory.all, world->memory.count, 1)};

    return perp__grow(world->context, "the contacts", &world->memory.capacity, count, arrays, 2);
}

/* What a point of the last step was given, along axes of a point now; same axes, same bits. */
static void turn_impulse(const perp_world *world, const perp__memory *memory,
                         const perp__world_contact *contact, double *out)
{
    perp__world_contact then;
    double impulse[3] = {0.0, 0.0, 0.0};

    if (memcmp(memory->normal, contact->axes[0], sizeof memory->normal) == 0) {
        perp__copy3(out, memory->impulse);
        return;
    }
    perp__copy3(then.axes[0], memory->normal);
    perp__contact_frame(world, &then);
    for (int32_t k = 0; k < 3; k++)
        perp__add3(impulse, memory->impulse[k], then.axes[k]);
    for (int32_t k = 0; k < 3; k++)
        out[k] = perp__dot3(contact->axes[k], impulse);
}

void perp__recall(const perp_world *world, const perp__pair *pair,
                  const perp__world_contact *contact, double *warm, double *base)
{
    const perp__memory *memory = NULL;

    for (int32_t i = pair->first_sleeping; i >= 0 && !memory; i = world->sleep.contacts[i].next)
        if (world->sleep.contacts[i].memory.feature == contact->feature)
            memory = &world->sleep.contacts[i].memory;
    for (int32_t i = 0; i < pair->memories && !memory; i++)
        if (world->memory.all[pair->first_memory + i].feature == contact->feature)
            memory = &world->memory.all[pair->first_memory + i];
    if (!memory)
        return;
    turn_impulse(world, memory, contact, warm);
    if (memcmp(memory->normal, contact->axes[0], sizeof memory->normal) == 0)
        perp__copy3(base, memory->base);
}

/* What a point carried whose feature is not there any more goes on to the nearest: where edges lie
 * on each other, rounding decides what a point is called. */
void perp__hand_over(const perp_world *world, const perp__pair *pair)
{
    const perp__contact_set *set = &world->contacts.now;
    const int32_t first = pair->first_now, count = pair->same ? 0 : pair->made;

    for (int32_t m = pair->first_memory; m < pair->first_memory + pair->memories; m++) {
        const perp__memory *memory = &world->memory.all[m];
        double least = INFINITY, apart[3], turned[3];
        int32_t nearest = -1, same = first + m - pair->first_memory;

        if (same < first + count && set->contacts[same].feature == memory->feature)
            continue;
        for (int32_t i = first; i < first + count && least > -1.0; i++) {
            const perp__world_contact *contact = &set->contacts[i];

            perp__subtract3(apart, contact->position, memory->position);
            if (contact->feature == memory->feature) {
                least = -1.0;
            } else if (perp__length3(apart) < least) {
                least = perp__length3(apart);
                nearest = i;
            }
        }
        if (least < 0.0 || nearest < 0 || perp__is_zero3(memory->impulse))
            continue;
        turn_impulse(world, memory, &set->contacts[nearest], turned);
        perp__add3(set->responses[nearest].warm, 1.0, turned);
        perp__add3(set->responses[nearest].remembered, 1.0, turned);
    }
}

/* ---- points that are those of the last step ---- */

void perp__note_settled(perp_world *world)
{
    for (int32_t i = 0; i < world->sleep.awake_count; i++)
        world->step.roles[world->sleep.awake[i]].calm =
            world->step.roles[world->sleep.awake[i]].repeats;
    for (int32_t i = 0; i < world->pairs.count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);
        perp__role *a = &world->step.roles[pair->body[0]], *b = &world->step.roles[pair->body[1]];

        a->calm = a->calm && b->repeats;
        b->calm = b->calm && a->repeats;
    }
}

/* Whether the body is what it was, and what may cover its shapes: what is near one that never moves
 * is asked for bodies of many shapes only. */
static bool is_settled(const perp_world *world, int32_t body, int32_t other)
{
    const perp__role *role = &world->step.roles[body];

    return role->repeats && (role->dynamic ? role->calm : world->bodies.all[other].shapes < 2);
}

bool perp__stays_same(const perp_world *world, const perp__pair *pair)
{
    const int32_t a = pair->body[0], b = pair->body[1];

    return pair->steps == world->step.coasting && (pair->plain || !pair->changed) &&
           is_settled(world, a, b) && is_settled(world, b, a);
}

void perp__repeat_contact(const perp_world *world, const perp__pair *pair, int32_t k, int32_t i)
{
    const perp__contact_set *set = &world->contacts.now, *last = &world->contacts.last;
    const int32_t from = pair->first_last + k;
    perp__response *response = &set->responses[i];

    if (i + PERP__FETCHED_AHEAD < set->capacity)
        perp__fetch(&set->responses[i + PERP__FETCHED_AHEAD], sizeof *set->responses);
    if (from + PERP__FETCHED_AHEAD < last->capacity)
        perp__fetch(last->responses[from + PERP__FETCHED_AHEAD].next, sizeof last->responses->next);
    set->contacts[i] = last->contacts[from];
    memset(response, 0, sizeof *response);
    response->later = -1;
    perp__copy3(response->warm, last->responses[from].next); /* what it left to its memory */
    perp__copy3(response->remembered, response->warm);
    perp__copy3(response->base, last->responses[from].base);
    set->flags[i] = last->flags[from];
    set->flags[i].included = set->flags[i].fresh = set->flags[i].pushes = 0;
    set->flags[i].repeats = 1;
}

/* ---- memories ---- */

/* The pair of two shapes, among the ordered; NULL if there is none. */
static perp__pair *find_pair(const perp_world *world, int32_t first, int32_t second)
{
    int32_t low = 0, high = world->pairs.count;

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

void perp__find_memories(perp_world *world)
{
    perp__pair *pair = NULL;

    world->memory.restored = 0;
    for (int32_t i = 0; i < world->pairs.slots; i++)
        world->pairs.all[i].memories = 0;
    for (int32_t i = 0; i < world->memory.count; i++) {
        const perp__memory *memory = &world->memory.all[i];

        if (i == 0 || memory->first != memory[-1].first || memory->second != memory[-1].second) {
            pair = find_pair(world, memory->first, memory->second);
            if (pair && pair->memories == 0)
                pair->first_memory = i;
            else
                pair = NULL; /* what fell asleep in that step is there twice */
        }
        if (pair)
            pair->memories++;
    }
}

void perp__write_memory(const perp__contact_set *set, int32_t i, perp__memory *memory)
{
    const perp__world_contact *contact = &set->contacts[i];

    memory->first = contact->shape_a;
    memory->second = contact->shape_b;
    memory->feature = contact->feature;
    perp__copy3(memory->normal, contact->axes[0]);
    perp__copy3(memory->position, contact->position);
    perp__copy3(memory->impulse, set->responses[i].next);
    perp__copy3(memory->base, set->responses[i].base);
}

/* Contacts of the first round are in the order of their pairs; later ones hang on these. */
void perp__remember(perp_world *world)
{
    const perp__contact_set *set = &world->contacts.now;
    perp__memory *const memories = world->memory.next;
    int32_t early = 0, count = 0;

    /* 1. the memories of each pair, in their order */
    for (int32_t i = 0; i < world->pairs.count; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);
        const perp__role *a = &world->step.roles[pair->body[0]],
                         *b = &world->step.roles[pair->body[1]];

        pair->had_first = pair->first_memory;
        pair->had = pair->memories;
        pair->first_memory = count;
        pair->first_last = pair->first_now;
        pair->steps = world->step.coasting;
        for (int32_t k = 0; k < pair->made; k++)
            perp__write_memory(set, pair->first_now + k, &memories[count++]);
        for (int32_t k = pair->late; k >= 0; k = set->responses[k].later)
            perp__write_memory(set, k, &memories[count++]);
        pair->memories = count - pair->first_memory;
        /* whether the memories are others than before, or no one asks: a body moves */
        pair->changed = pair->first_sleeping >= 0 || pair->memories != pair->had ||
                        a->repeats < a->dynamic || b->repeats < b->dynamic ||
                        (pair->had > 0 &&
                         memcmp(&world->memory.all[pair->had_first], &memories[pair->first_memory],
                                (size_t)pair->had * sizeof *memories) != 0);
        if (pair->first_sleeping >= 0)
            perp__drop_sleeping(world, &pair->first_sleeping);
        early += pair->made;
    }

    /* 2. a contact whose pair ended within the step is not to be remembered */
    for (int32_t i = early == set->early ? early : 0; i < set->count; i++) {
        const perp__world_contact *contact = &set->contacts[i];
        const perp__pair *pair = &world->pairs.all[contact->pair];

        if (pair->first != contact->shape_a || pair->second != contact->shape_b)
            world->step.roles[contact->body_a].repeats =
                world->step.roles[contact->body_b].repeats = 0;
    }

    /* 3. they are the last step's from now on */
    world->memory.next = world->memory.all;
    world->memory.all = memories;
    world->memory.count = count;
    world->memory.restored = 0;
}

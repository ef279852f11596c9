/* What a step's contacts leave to those of the next: impulses, known by pair and feature, in the
 * order of the pairs. Those of pairs that sleep are kept with them (rest.c). And the points
 * themselves, to the last bit, where two bodies ended the step as they began it, and so did what is
 * near them and might cover what they meet with. */
#include "world/islands/contact_rows.h"

#include <string.h>

#include "base/grow.h"
#include "linalg/spatial.h"

perp_status perp__reserve_memories(perp_world *world, int32_t count)
{
    const perp__growing arrays[] = {PERP__GROWING(world->next_memories, 0, 1),
                                    PERP__GROWING(world->memories, world->memory_count, 1)};

    return perp__grow(world->context, "the contacts", &world->memory_capacity, count, arrays, 2);
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

void perp__recall(const perp_world *world, const perp__pair *pair, perp__world_contact *contact)
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

/* ---- points that are those of the last step ---- */

void perp__note_settled(perp_world *world)
{
    for (int32_t i = 0; i < world->awake_count && world->settled > 0; i++)
        world->roles[world->awake[i]].calm = world->roles[world->awake[i]].repeats;
    for (int32_t i = 0; i < world->pair_count && world->settled > 0; i++) {
        const perp__pair *pair = perp__ordered_head(world, i);
        perp__role *a = &world->roles[pair->body[0]], *b = &world->roles[pair->body[1]];

        a->calm = a->calm && b->repeats;
        b->calm = b->calm && a->repeats;
    }
}

/* Whether the body is what it was, and what may cover its shapes: what is near one that never moves
 * is asked for bodies of many shapes only. */
static int32_t is_settled(const perp_world *world, int32_t body, int32_t other)
{
    const perp__role *role = &world->roles[body];

    return role->repeats && (role->dynamic ? role->calm : world->bodies[other].shapes < 2);
}

int32_t perp__stays_same(const perp_world *world, const perp__pair *pair)
{
    const int32_t a = pair->body[0], b = pair->body[1];

    return world->settled > 0 && pair->steps == world->coasting &&
           (pair->plain || !pair->changed) && is_settled(world, a, b) && is_settled(world, b, a);
}

void perp__repeat_contact(const perp_world *world, const perp__pair *pair, int32_t k,
                          perp__world_contact *contact)
{
    const perp__world_contact *last = &world->last.contacts[pair->first_last + k];
    const size_t point = offsetof(perp__world_contact, gap);

    if (!world->contacts.stands || contact != &world->contacts.contacts[pair->first_before + k])
        memcpy((char *)contact + point, (const char *)last + point, sizeof *contact - point);
    contact->mode = 0;
    contact->later = -1;
    perp__copy3(contact->warm, last->next); /* what it left to the pair's memory */
    memset(contact->next, 0, sizeof contact->next);
    memset(contact->impulse, 0, sizeof contact->impulse);
    perp__copy3(contact->velocity, contact->free);
    perp__copy3(contact->remembered, contact->warm);
}

/* ---- memories ---- */

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

void perp__find_memories(perp_world *world)
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

/* Where a contact's pair stands among the ordered. */
static uint64_t key_of(const perp__world_contact *contact)
{
    return (uint64_t)contact->shape_a << 32 | (uint64_t)contact->shape_b;
}

/* A contact whose pair ended within the step: it is not to be remembered. */
static void forget(perp_world *world, const perp__world_contact *contact)
{
    world->roles[contact->body_a].repeats = world->roles[contact->body_b].repeats = 0;
}

/* Contacts of the first round are in the order of their pairs; later ones hang on these. */
void perp__remember(perp_world *world)
{
    const perp__world_contact *contacts = world->contacts.contacts;
    const int32_t early = world->contacts.early;
    perp__memory *const memories = world->next_memories;
    int32_t next = 0, count = 0;

    for (int32_t i = early; i < world->contacts.count; i++)
        if (world->pairs[contacts[i].pair].first != contacts[i].shape_a ||
            world->pairs[contacts[i].pair].second != contacts[i].shape_b)
            forget(world, &contacts[i]);
    for (int32_t i = 0; i < world->pair_count; i++) {
        const uint64_t key = world->pair_order[i].key;
        perp__pair *pair = perp__ordered_pair(world, i);

        pair->had_first = pair->first_memory;
        pair->had = pair->memories;
        pair->first_memory = count;
        for (; next < early && key_of(&contacts[next]) < key; next++)
            forget(world, &contacts[next]);
        pair->first_before = pair->same ? pair->first_last : -1;
        pair->first_last = next;
        pair->steps = world->coasting;
        for (; next < early && key_of(&contacts[next]) == key; next++)
            perp__write_memory(&contacts[next], &memories[count++]);
        for (int32_t k = pair->late; k >= 0; k = contacts[k].later)
            perp__write_memory(&contacts[k], &memories[count++]);
        pair->memories = count - pair->first_memory;
        pair->changed = pair->first_kept >= 0 || is_news(world, pair);
        perp__drop_kept(world, pair->first_kept);
        pair->first_kept = -1;
    }
    for (; next < early; next++)
        forget(world, &contacts[next]);
    world->next_memories = world->memories;
    world->memories = memories;
    world->memory_count = count;
    world->memories_restored = 0;
}

/* What a caller reads about the contacts of the last step. */
#include "world/world.h"

#include <string.h>

#include "base/context.h"
#include "world/spatial.h"

/* Room for `count` records of this step beside those of the last. */
static perp_status reserve(perp_world *world, int32_t count)
{
    int32_t capacity = world->contacts.capacity;
    perp_world_contact *next, *last;

    if (count <= world->record_capacity)
        return PERP_OK;
    last = perp__allocate(world->context, (size_t)capacity, sizeof *last);
    next = perp__allocate(world->context, (size_t)capacity, sizeof *next);
    if (!last || !next) {
        perp__release(world->context, last);
        perp__release(world->context, next);
        return perp__fail_memory(world->context, "the contacts");
    }
    if (world->record_count > 0)
        memcpy(last, world->records, (size_t)world->record_count * sizeof *last);
    perp__release(world->context, world->records);
    perp__release(world->context, world->next_records);
    world->records = last;
    world->next_records = next;
    world->record_capacity = capacity;
    return PERP_OK;
}

static int32_t mode_of(const perp__world_contact *contact)
{
    if (!contact->closed)
        return PERP_CONTACT_SEPARATE;
    return contact->velocity[1] == 0.0 && contact->velocity[2] == 0.0 ? PERP_CONTACT_STICK
                                                                      : PERP_CONTACT_SLIP;
}

static void write_record(const perp_world *world, const perp__world_contact *contact,
                         perp_world_contact *record)
{
    memset(record, 0, sizeof *record);
    record->struct_size = sizeof *record;
    record->body_a = perp__id(contact->body_a, world->bodies[contact->body_a].generation);
    record->body_b = perp__id(contact->body_b, world->bodies[contact->body_b].generation);
    record->shape_a = perp__id(contact->shape_a, world->shapes[contact->shape_a].generation);
    record->shape_b = perp__id(contact->shape_b, world->shapes[contact->shape_b].generation);
    perp__copy3(record->position, contact->position);
    perp__copy3(record->normal, contact->axes[0]);
    perp__copy3(record->tangent_1, contact->axes[1]);
    perp__copy3(record->tangent_2, contact->axes[2]);
    record->gap = contact->gap;
    perp__copy3(record->impulse, contact->impulse);
    perp__copy3(record->velocity, contact->velocity);
    record->friction = contact->friction;
    record->restitution = contact->restitution;
    record->mode = mode_of(contact);
}

static int32_t is_finite(const perp_world_contact *record)
{
    return perp__all_finite(record->position, 3) && perp__all_finite(record->normal, 3) &&
           perp__all_finite(&record->gap, 1) && perp__all_finite(record->impulse, 3) &&
           perp__all_finite(record->velocity, 3);
}

/* Of the contacts that took part. Arms and turns near the largest numbers can leave their range. */
perp_status perp__write_records(perp_world *world)
{
    int32_t i, count = 0;
    perp_status status;

    for (i = 0; i < world->contacts.count; i++)
        count += world->contacts.contacts[i].included;
    status = reserve(world, count);
    world->next_record_count = 0;
    for (i = 0; i < world->contacts.count && status == PERP_OK; i++) {
        const perp__world_contact *contact = &world->contacts.contacts[i];
        perp_world_contact *record;

        if (!contact->included)
            continue;
        record = &world->next_records[world->next_record_count];
        write_record(world, contact, record);
        if (!is_finite(record))
            status = perp__fail(world->context, PERP_ERROR_NOT_FINITE,
                                "the step takes contact %d beyond the range of numbers",
                                (int)world->next_record_count);
        world->next_record_count++;
    }
    return status;
}

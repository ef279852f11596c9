/* What a caller reads about the contacts of the last step, made when it is asked for. */
#include "world/step.h"

#include "base/context.h"

void perp__write_record(const perp__contact_set *set, int32_t i, perp_world_contact *record)
{
    const perp__world_contact *contact = &set->contacts[i];
    const perp__response *response = &set->responses[i];
    const double *v = response->velocity;

    memset(record, 0, sizeof *record);
    record->struct_size = sizeof *record;
    record->body_a = perp__id(contact->body_a, contact->generations[0]);
    record->body_b = perp__id(contact->body_b, contact->generations[1]);
    record->shape_a = perp__id(contact->shape_a, contact->generations[2]);
    record->shape_b = perp__id(contact->shape_b, contact->generations[3]);
    perp__copy3(record->position, contact->position);
    perp__copy3(record->normal, contact->axes[0]);
    perp__copy3(record->tangent_1, contact->axes[1]);
    perp__copy3(record->tangent_2, contact->axes[2]);
    record->gap = contact->gap;
    perp__copy3(record->impulse, response->impulse);
    perp__copy3(record->velocity, response->velocity);
    record->friction = contact->friction;
    record->restitution = contact->restitution;
    /* What pressed in the step was closed, whatever it does in the end. What sticks stands still
     * along the normal too, unless it bounced. */
    if (response->mode == PERP_CONTACT_SEPARATE && !(response->impulse[0] > 0.0))
        record->mode = PERP_CONTACT_SEPARATE;
    else if (v[1] == 0.0 && v[2] == 0.0 && (v[0] == 0.0 || contact->restitution > 0.0))
        record->mode = PERP_CONTACT_STICK;
    else
        record->mode = PERP_CONTACT_SLIP;
}

uint64_t perp__contact_order(const perp__world_contact *contact)
{
    return (uint64_t)contact->round << 56 | (uint64_t)contact->shape_a << 28 |
           (uint64_t)contact->shape_b;
}

/* Lists what a pair kept, in its order; returns how many there are now. */
static int32_t list_kept(const perp_world *world, int32_t first, perp__keyed *order, int32_t count)
{
    for (int32_t i = first; i >= 0; i = world->sleep.contacts[i].next)
        if (world->sleep.contacts[i].included) {
            order[count].key = world->sleep.contacts[i].order;
            order[count++].value = -1 - i;
        }
    return count;
}

/* What the last step made of contacts that are asleep, and of the others, in their order. */
static perp_status merge_records(perp_world *world)
{
    const int32_t most = world->sleep.included + world->contacts.last_included;
    perp__keyed *order = perp__allocate(world->context, 2 * (size_t)most, sizeof *order);
    int32_t i, count = 0;

    if (!order)
        return perp__fail_memory(world->context, "the contacts");
    count = list_kept(world, world->sleep.first_orphan, order, count);
    for (i = 0; i < world->pairs.slots; i++)
        if (world->pairs.all[i].first >= 0)
            count = list_kept(world, world->pairs.all[i].first_sleeping, order, count);
    for (i = 0; i < world->contacts.last.count; i++)
        if (world->contacts.last.flags[i].included) {
            order[count].key = perp__contact_order(&world->contacts.last.contacts[i]);
            order[count++].value = i;
        }
    perp__sort(order, order + most, count);
    for (i = 0; i < count; i++)
        if (order[i].value < 0)
            world->results.records[i] = world->sleep.contacts[-1 - order[i].value].record;
        else
            perp__write_record(&world->contacts.last, order[i].value, &world->results.records[i]);
    perp__release(world->context, order);
    world->results.record_count = count;
    return PERP_OK;
}

perp_status perp__write_records(perp_world *world)
{
    const perp__growing array = PERP__GROWING(world->results.records, 0, 1);
    perp_status status = PERP_OK;
    int32_t i, count = 0;

    if (world->results.recorded)
        return PERP_OK;
    status = perp__grow(world->context, "the contacts", &world->results.record_capacity,
                        world->sleep.included + world->contacts.last_included, &array, 1);
    /* what a round brings is listed where its bodies are, which is by islands */
    if (status == PERP_OK &&
        (world->sleep.included > 0 || world->contacts.last.early < world->contacts.last.count)) {
        status = merge_records(world);
    } else if (status == PERP_OK) {
        for (i = 0; i < world->contacts.last.count; i++)
            if (world->contacts.last.flags[i].included)
                perp__write_record(&world->contacts.last, i, &world->results.records[count++]);
        world->results.record_count = count;
    }
    world->results.recorded = status == PERP_OK;
    return status;
}

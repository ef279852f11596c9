/* What the next step reads, as a block of bytes: the states of all bodies, and the impulses of the
 * last step, from which the next one starts, pair by pair. */
#include "world/step.h"

#include "base/check.h"
#include "base/context.h"

#define SNAPSHOT_MAGIC UINT64_C(0x70657270736e6170)

/* Tells which world the states belong to, and in which composition. */
typedef struct snapshot_header {
    uint64_t magic, world, edition, slots, memories;
} snapshot_header;

static snapshot_header header_of(const perp_world *world)
{
    snapshot_header header;

    header.magic = SNAPSHOT_MAGIC;
    header.world = (uint64_t)(uintptr_t)world;
    header.edition = world->bodies.edition;
    header.slots = (uint64_t)world->bodies.slots;
    header.memories =
        (uint64_t)(world->memory.count + world->sleep.contact_count - world->sleep.orphan_count);
    return header;
}

static size_t states_size(const perp_world *world)
{
    return (size_t)world->bodies.slots * sizeof *world->bodies.states;
}

static size_t joints_size(const perp_world *world)
{
    return (size_t)world->joints.slots * sizeof *world->joints.states;
}

static size_t snapshot_size(const perp_world *world, uint64_t memories)
{
    return sizeof(snapshot_header) + states_size(world) + joints_size(world) +
           (size_t)memories * sizeof *world->memory.all;
}

static perp_status check_size(const perp_world *world, size_t size, size_t expected)
{
    if (size == expected)
        return PERP_OK;
    return perp__refuse(world->context, "size is %zu, this snapshot has %zu bytes", size, expected);
}

perp_status perp_world_snapshot_size(const perp_world *world, size_t *size)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(world->context, "size", size);
    if (status == PERP_OK)
        *size = perp__snapshot_bytes(world);
    return perp__leave(world->context, status);
}

size_t perp__snapshot_bytes(const perp_world *world)
{
    return snapshot_size(world, header_of(world).memories);
}

void perp__snapshot_write(const perp_world *world, char *blob)
{
    const snapshot_header header = header_of(world);
    const size_t memories = (size_t)world->memory.count * sizeof *world->memory.all;

    memcpy(blob, &header, sizeof header);
    memcpy(blob + sizeof header, world->bodies.states, states_size(world));
    blob += sizeof header + states_size(world);
    if (world->joints.slots > 0)
        memcpy(blob, world->joints.states, joints_size(world));
    blob += joints_size(world);
    if (memories > 0)
        memcpy(blob, world->memory.all, memories);
    blob += memories;
    for (int32_t i = 0; i < world->pairs.slots; i++)
        for (int32_t k = world->pairs.all[i].first_sleeping;
             world->pairs.all[i].first >= 0 && k >= 0; k = world->sleep.contacts[k].next) {
            memcpy(blob, &world->sleep.contacts[k].memory, sizeof *world->memory.all);
            blob += sizeof *world->memory.all;
        }
}

static perp_status save(const perp_world *world, char *blob, size_t size)
{
    perp_status status = perp__check_pointer(world->context, "blob", blob);

    PERP__THEN(status, check_size(world, size, perp__snapshot_bytes(world)));
    if (status == PERP_OK)
        perp__snapshot_write(world, blob);
    return status;
}

perp_status perp_world_snapshot_save(const perp_world *world, void *blob, size_t size)
{
    return PERP__WORLD_CALL(world, save(world, blob, size));
}

perp_status perp__snapshot_read(perp_world *world, const char *blob)
{
    snapshot_header header;
    perp_status status;

    memcpy(&header, blob, sizeof header);
    status = perp__reserve_memories(world, (int32_t)header.memories);
    if (status != PERP_OK)
        return status;
    blob += sizeof header;
    memcpy(world->bodies.states, blob, states_size(world));
    blob += states_size(world);
    if (world->joints.slots > 0)
        memcpy(world->joints.states, blob, joints_size(world));
    blob += joints_size(world);
    if (header.memories > 0)
        memcpy(world->memory.all, blob, (size_t)header.memories * sizeof *world->memory.all);
    world->memory.count = (int32_t)header.memories;
    world->memory.restored = 1;
    perp__rouse_all(world);
    perp__forget_naps(world);
    world->pairs.planes_changed = world->sleep.some_put = 1;
    return PERP_OK;
}

static perp_status restore(perp_world *world, const char *blob, size_t size)
{
    const snapshot_header expected = header_of(world);
    snapshot_header header;
    perp_status status = perp__check_pointer(world->context, "blob", blob);

    if (status == PERP_OK && size < sizeof header)
        status = check_size(world, size, snapshot_size(world, expected.memories));
    if (status != PERP_OK)
        return status;
    memcpy(&header, blob, sizeof header);
    if (header.magic != expected.magic || header.world != expected.world ||
        header.edition != expected.edition || header.slots != expected.slots ||
        header.memories > INT32_MAX / 4)
        return perp__refuse(world->context,
                            "blob is no snapshot of this world with the bodies it has now");
    status = check_size(world, size, snapshot_size(world, header.memories));
    PERP__THEN(status, perp__write_records(world)); /* which stay */
    return status == PERP_OK ? perp__snapshot_read(world, blob) : status;
}

perp_status perp_world_snapshot_restore(perp_world *world, const void *blob, size_t size)
{
    return PERP__WORLD_CALL(world, restore(world, blob, size));
}

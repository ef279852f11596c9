/* States of all bodies as a block of bytes. */
#include "world/world.h"

#include <string.h>

#include "base/check.h"
#include "base/context.h"

#define SNAPSHOT_MAGIC UINT64_C(0x70657270736e6170)

/* Tells which world the states belong to, and in which composition. */
typedef struct snapshot_header {
    uint64_t magic;
    uint64_t world;
    uint64_t edition;
    uint64_t slots;
} snapshot_header;

static snapshot_header header_of(const perp_world *world)
{
    snapshot_header header;

    header.magic = SNAPSHOT_MAGIC;
    header.world = (uint64_t)(uintptr_t)world;
    header.edition = world->edition;
    header.slots = (uint64_t)world->body_slots;
    return header;
}

static size_t states_size(const perp_world *world)
{
    return (size_t)world->body_slots * sizeof *world->states;
}

static perp_status check_blob(const perp_world *world, const void *blob, size_t size)
{
    size_t expected = sizeof(snapshot_header) + states_size(world);
    perp_status status = perp__check_pointer(world->context, "blob", blob);

    if (status == PERP_OK && size != expected)
        status = perp__fail(world->context, PERP_ERROR_ARGUMENT,
                            "size is %zu, this world's snapshots have %zu bytes", size, expected);
    return status;
}

perp_status perp_world_snapshot_size(const perp_world *world, size_t *size)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = perp__check_pointer(world->context, "size", size);
    if (status == PERP_OK)
        *size = sizeof(snapshot_header) + states_size(world);
    return perp__leave(world->context, status);
}

perp_status perp_world_snapshot_save(const perp_world *world, void *blob, size_t size)
{
    snapshot_header header;
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = check_blob(world, blob, size);
    if (status == PERP_OK) {
        header = header_of(world);
        memcpy(blob, &header, sizeof header);
        memcpy((char *)blob + sizeof header, world->states, states_size(world));
    }
    return perp__leave(world->context, status);
}

perp_status perp_world_snapshot_restore(perp_world *world, const void *blob, size_t size)
{
    snapshot_header header, expected;
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = check_blob(world, blob, size);
    if (status == PERP_OK) {
        expected = header_of(world);
        memcpy(&header, blob, sizeof header);
        if (header.magic != expected.magic || header.world != expected.world ||
            header.edition != expected.edition || header.slots != expected.slots)
            status = perp__fail(world->context, PERP_ERROR_ARGUMENT,
                                "blob is no snapshot of this world with the bodies it has now");
    }
    if (status == PERP_OK) {
        memcpy(world->states, (const char *)blob + sizeof header, states_size(world));
        perp__unsettle_all(world);
    }
    return perp__leave(world->context, status);
}

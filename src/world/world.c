/* The life of a world, ids, and the public calls that ask it something. */
#include "base/check.h"
#include "base/context.h"
#include "contact/contact.h"
#include "world/islands/lanes.h"

#define STANDARD_GRAVITY 9.81

perp_status perp_world_settings_init(perp_world_settings *settings, size_t size, int32_t planar)
{
    const perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_world_settings));

    if (status == PERP_OK) {
        settings->gravity[planar ? 1 : 2] = -STANDARD_GRAVITY;
        settings->planar = planar != 0;
        settings->accuracy = PERP_ACCURACY_STANDARD;
    }
    return status;
}

uint64_t perp__id(int32_t slot, uint32_t generation)
{
    return ((uint64_t)generation << 32) | (uint64_t)(slot + 1);
}

perp_status perp__find_body(const perp_world *world, int32_t *slot, perp_body id)
{
    uint64_t number = id & UINT64_C(0xffffffff);
    const perp__body *body;

    if (id == 0)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "body is 0, the null id");
    if (number == 0 || number > (uint64_t)world->bodies.slots)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "body is not a body of this world");
    body = &world->bodies.all[number - 1];
    if (!body->alive || body->generation != id >> 32)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "body was removed from this world");
    *slot = (int32_t)(number - 1);
    return PERP_OK;
}

static perp_status check_gravity(perp_context *context, const char *name, const double *gravity,
                                 int32_t planar)
{
    perp_status status = perp__check_finite(context, name, gravity, 3);

    if (status == PERP_OK && planar && gravity[2] != 0.0)
        return perp__refuse(context, "%s[2] is %g: a planar world has no z, 0 expected", name,
                            gravity[2]);
    return status;
}

static const perp__field settings_fields[] = {
    PERP__INTEGER(perp_world_settings, planar, 0, 1),
    PERP__INTEGER(perp_world_settings, accuracy, PERP_ACCURACY_FAST, PERP_ACCURACY_EXACT),
    PERP__INTEGER(perp_world_settings, substeps, 0, PERP__MAX_SUBSTEPS),
    PERP__REAL(perp_world_settings, friction, "[)", 0, INFINITY),
    PERP__REAL(perp_world_settings, error, "[)", 0, INFINITY),
    PERP__INTEGER(perp_world_settings, strict, 0, 1),
    PERP__INTEGER(perp_world_settings, wakeful, 0, 1),
    PERP__INTEGER(perp_world_settings, threads, 0, PERP__MOST_THREADS),
};

static perp_status check_settings(perp_context *context, const perp_world_settings *settings)
{
    const int32_t k = settings->cone;
    perp_contact_settings solver, read;
    perp_status status = PERP__CHECK_FIELDS(context, "settings", settings, settings_fields);

    PERP__THEN(status,
               check_gravity(context, "settings.gravity", settings->gravity, settings->planar));
    if (status == PERP_OK && k != 0 && (k < 4 || k > PERP__MAX_DIRECTIONS || k % 2 != 0))
        status =
            perp__refuse(context, "settings.cone is %d, 0 or an even number from 4 to %d expected",
                         (int)k, PERP__MAX_DIRECTIONS);
    /* the others mean what they do for perp_contact, which checks */
    PERP__THEN(status, perp_contact_settings_init(&solver, sizeof solver));
    if (status != PERP_OK)
        return status;
    solver.method = settings->method;
    solver.max_iterations = settings->max_iterations;
    if (settings->tol != 0.0)
        solver.tol = settings->tol;
    solver.time_limit = settings->time_limit;
    return perp__contact_settings_read(context, &read, &solver);
}

static void release(void *object)
{
    perp_world *world = object;
    perp_context *context = world->context;
    perp__arena *const arenas[] = {&world->step.arena, &world->islands.arena, &world->solve.arena};
    void *const arrays[] = {
        world->solve.standing,  world->bodies.all,  world->bodies.states, world->bodies.clusters,
        world->shapes.all,      world->joints.all,  world->joints.states, world->pairs.tree.nodes,
        world->pairs.all,       world->pairs.order, world->pairs.met,     world->memory.all,
        world->memory.next,     world->begun.bytes, world->tried.bytes,   world->whole.bytes,
        world->results.records, world->sleep.awake, world->sleep.naps,    world->sleep.contacts};
    const perp__contact_set *const sets[] = {&world->contacts.now, &world->contacts.overlaps,
                                             &world->contacts.last};

    perp__release_lanes(world);
    perp__release_batch(world);
    for (int32_t i = 0; i < world->shapes.slots; i++)
        perp__release(context, world->shapes.all[i].geometry.hull);
    perp__handle_end(world->solve.solver);
    if (world->solve.standing)
        perp__standing_release(world->solve.standing);
    perp__coloured_release(&world->solve.coloured);
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        perp__release(context, arrays[k]);
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        perp__release(context, sets[k]->contacts);
        perp__release(context, sets[k]->responses);
        perp__release(context, sets[k]->flags);
    }
    for (size_t k = 0; k < sizeof arenas / sizeof *arenas; k++)
        perp__arena_release(arenas[k]);
}

static const perp__kind kind = {"the world", sizeof(perp_world), release};

perp_status perp__world_enter(const perp_world *world)
{
    return perp__handle_enter(world, &kind);
}

static perp_status create(perp_context *context, perp_world **world,
                          const perp_world_settings *caller)
{
    perp_world_settings settings;
    perp_body_settings ground_settings;
    perp_body ground;
    perp_world *made;
    perp_status status = perp__check_pointer(context, "world", world);

    PERP__THEN(status, perp_world_settings_init(&settings, sizeof settings, 0));
    PERP__THEN(status, perp_body_settings_init(&ground_settings, sizeof ground_settings));
    PERP__THEN(status, perp__struct_read(context, "settings", &settings, sizeof settings, caller,
                                         PERP__FIRST(perp_world_settings)));
    PERP__THEN(status, check_settings(context, &settings));
    if (status != PERP_OK)
        return status;
    made = perp__handle_create(context, &kind);
    if (!made)
        return PERP_ERROR_MEMORY;
    made->settings = settings;
    made->bodies.free = made->shapes.free = made->joints.free = made->pairs.free = -1;
    made->sleep.free_nap = made->sleep.free_contact = made->sleep.first_orphan =
        made->pairs.first_plane = -1;
    perp__tree_init(&made->pairs.tree);
    made->dof = made->settings.planar ? 3 : 6;
    perp__coloured_init(&made->solve.coloured, context);
    status = perp__contact_create(context, &made->solve.solver, NULL);
    if (status == PERP_OK) {
        made->solve.standing =
            perp__allocate_zeros(context, 1, sizeof *made->solve.standing, "the islands");
        status = made->solve.standing ? PERP_OK : PERP_ERROR_MEMORY;
    }
    PERP__THEN(status, perp__create_lanes(made));
    ground_settings.kind = PERP_BODY_STATIC;
    PERP__THEN(status, perp__add_body(made, &ground, &ground_settings));
    if (status == PERP_OK)
        *world = made;
    else
        perp__handle_end(made);
    return status;
}

perp_status perp_world_create(perp_context *context, perp_world **world,
                              const perp_world_settings *settings)
{
    return PERP__CALL(perp__enter(context), context, create(context, world, settings));
}

void perp_world_destroy(perp_world *world)
{
    perp__handle_destroy(world, &kind);
}

perp_body perp_world_ground(const perp_world *world)
{
    return perp__handle_is(world, &kind) ? perp__id(0, world->bodies.all[0].generation) : 0;
}

int32_t perp_world_contact_count(const perp_world *world)
{
    if (!perp__handle_is(world, &kind))
        return 0;
    return world->results.recorded ? world->results.record_count
                                   : world->sleep.included + world->contacts.last_included;
}

static perp_status get_contact(perp_world *world, perp_world_contact *contact, int32_t index)
{
    perp_status status = PERP__CHECK(perp_world_contact, world->context, contact);

    PERP__THEN(status, perp__write_records(world));
    if (status != PERP_OK)
        return status;
    if (index < 0 || index >= world->results.record_count)
        return perp__refuse(world->context, "index is %d, the last step had %d contacts",
                            (int)index, (int)world->results.record_count);
    perp__struct_write(contact, &world->results.records[index], sizeof *contact);
    return PERP_OK;
}

perp_status perp_world_get_contact(const perp_world *world, perp_world_contact *contact,
                                   int32_t index)
{
    return PERP__WORLD_CALL(world, get_contact((perp_world *)world, contact, index));
}

perp_status perp_world_get_stats(const perp_world *world, perp_world_stats *stats)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_world_stats, world->context, stats);
    if (status == PERP_OK)
        perp__struct_write(stats, &world->results.stats, sizeof world->results.stats);
    return perp__leave(world->context, status);
}

static perp_status set_gravity(perp_world *world, const double *gravity)
{
    perp_status status = perp__check_pointer(world->context, "gravity", gravity);

    PERP__THEN(status, check_gravity(world->context, "gravity", gravity, world->settings.planar));
    if (status != PERP_OK)
        return status;
    memcpy(world->settings.gravity, gravity, sizeof world->settings.gravity);
    perp__rouse_all(world);
    return PERP_OK;
}

perp_status perp_world_set_gravity(perp_world *world, const double *gravity)
{
    return PERP__WORLD_CALL(world, set_gravity(world, gravity));
}

static perp_status step(perp_world *world, perp_step_result *result, double dt)
{
    perp_step_result copy = {.struct_size = sizeof copy};
    perp_status status = PERP_OK;

    if (result)
        status = PERP__CHECK(perp_step_result, world->context, result);
    PERP__THEN(status, perp__check_finite(world->context, "dt", &dt, 1));
    if (status != PERP_OK)
        return status;
    if (dt <= 0.0)
        return perp__refuse(world->context, "dt is %g, > 0 expected", dt);
    status = perp__advance_world(world, &copy, dt);
    if (status == PERP_OK && result)
        perp__struct_write(result, &copy, sizeof copy);
    return status;
}

perp_status perp_world_step(perp_world *world, perp_step_result *result, double dt)
{
    return PERP__WORLD_CALL(world, step(world, result, dt));
}

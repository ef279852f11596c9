/* The life of a world, ids, and the public calls that ask it something. */
#include "world/world.h"

#include <math.h>
#include <string.h>

#include "base/check.h"
#include "lcp/lcp.h"

#define STANDARD_GRAVITY 9.81

perp_status perp_world_settings_init(perp_world_settings *settings, size_t size, int32_t planar)
{
    perp_status status = perp__struct_init(settings, size, PERP__FIRST(perp_world_settings));

    if (status == PERP_OK) {
        settings->gravity[planar ? 1 : 2] = -STANDARD_GRAVITY;
        settings->planar = planar != 0;
        settings->friction_directions = 8;
        settings->method = PERP_LCP_AUTO;
        settings->tol = 1e-10;
    }
    return status;
}

PERP__INIT(perp_world_contact)
PERP__INIT(perp_step_result)
PERP__INIT(perp_world_stats)

void *perp__grown(perp_context *context, void *old, size_t used, size_t size)
{
    void *block = perp__allocate(context, 1, size);

    if (block && used > 0)
        memcpy(block, old, used);
    if (block)
        perp__release(context, old);
    return block;
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
    if (number == 0 || number > (uint64_t)world->body_slots)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "body is not a body of this world");
    body = &world->bodies[number - 1];
    if (!body->alive || body->generation != id >> 32)
        return perp__fail(world->context, PERP_ERROR_HANDLE, "body was removed from this world");
    *slot = (int32_t)(number - 1);
    return PERP_OK;
}

/* Unit vectors at angles 2 pi j / count. Quarter turns are exact, so that opposite directions are
 * exact negatives of each other. */
static void make_edges(double (*edge)[2], int32_t count)
{
    const double half_pi = 1.57079632679489661923;
    int32_t j;

    for (j = 0; j < count; j++) {
        int32_t quarter = 4 * j / count;
        int32_t rest = 4 * j - quarter * count; /* angle = (quarter + rest / count) pi / 2 */
        double angle = half_pi * ((double)rest / (double)count);
        double c = rest == 0 ? 1.0 : cos(angle);
        double s = rest == 0 ? 0.0 : sin(angle);

        edge[j][0] = quarter == 0 ? c : quarter == 1 ? -s : quarter == 2 ? -c : s;
        edge[j][1] = quarter == 0 ? s : quarter == 1 ? c : quarter == 2 ? -s : -c;
    }
}

static perp_status check_settings(perp_context *context, const perp_world_settings *settings)
{
    int32_t k = settings->friction_directions;
    perp_status status = perp__check_finite(context, "settings.gravity", settings->gravity, 3);

    if (status != PERP_OK)
        return status;
    if (settings->planar != 0 && settings->planar != 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.planar is %d, 0 or 1 expected",
                          (int)settings->planar);
    if (settings->planar && settings->gravity[2] != 0.0)
        return perp__fail(context, PERP_ERROR_ARGUMENT,
                          "settings.gravity[2] is %g: a planar world has no z, 0 expected",
                          settings->gravity[2]);
    if (k < 4 || k > PERP__MAX_DIRECTIONS || k % 2 != 0)
        return perp__fail(
            context, PERP_ERROR_ARGUMENT,
            "settings.friction_directions is %d, an even number from 4 to %d expected", (int)k,
            PERP__MAX_DIRECTIONS);
    if (settings->strict != 0 && settings->strict != 1)
        return perp__fail(context, PERP_ERROR_ARGUMENT, "settings.strict is %d, 0 or 1 expected",
                          (int)settings->strict);
    return PERP_OK;
}

/* method, max_iterations, tol and time_limit are the LCP's, which checks them. */
static perp_status make_solver(perp_world *world)
{
    perp_lcp_settings *settings = &world->solver_settings;
    perp_status status = perp_lcp_settings_init(settings, sizeof *settings);

    if (status != PERP_OK)
        return status;
    settings->method = world->settings.method;
    settings->max_iterations = world->settings.max_iterations;
    settings->tol = world->settings.tol;
    settings->time_limit = world->settings.time_limit;
    status = perp__lcp_create(world->context, &world->solver, settings);
    if (status == PERP_OK)
        status = perp_lcp_result_init(&world->work.result, sizeof world->work.result);
    return status;
}

static perp_status make_ground(perp_world *world)
{
    perp_body_settings settings;
    perp_body ground;
    perp_status status = perp_body_settings_init(&settings, sizeof settings);

    if (status != PERP_OK)
        return status;
    settings.kind = PERP_BODY_STATIC;
    return perp__add_body(world, &ground, &settings);
}

static void set_coordinates(perp_world *world)
{
    static const int32_t planar[3] = {0, 1, 5};
    int32_t i;

    world->dof = world->settings.planar ? 3 : 6;
    for (i = 0; i < world->dof; i++)
        world->coordinate[i] = world->settings.planar ? planar[i] : i;
    world->edges = world->settings.planar ? 2 : world->settings.friction_directions;
    make_edges(world->edge, world->edges);
}

static void release(void *object)
{
    perp_world *world = object;
    perp_context *context = world->context;

    perp__lcp_destroy(world->solver);
    perp__release(context, world->bodies);
    perp__release(context, world->states);
    perp__release(context, world->shapes);
    perp__release(context, world->pairs);
    perp__release(context, world->contacts.contacts);
    perp__release(context, world->overlaps.contacts);
    perp__release(context, world->records);
    perp__release(context, world->next_records);
    perp__arena_release(&world->body_arena);
    perp__arena_release(&world->shape_arena);
    perp__arena_release(&world->link_arena);
    perp__arena_release(&world->island_arena);
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
    perp_world *made;
    perp_status status = perp__check_pointer(context, "world", world);

    if (status == PERP_OK)
        status = perp_world_settings_init(&settings, sizeof settings, 0);
    if (status == PERP_OK)
        status = perp__struct_read(context, "settings", &settings, sizeof settings, caller,
                                   PERP__FIRST(perp_world_settings));
    if (status == PERP_OK)
        status = check_settings(context, &settings);
    if (status != PERP_OK)
        return status;
    made = perp__handle_create(context, &kind);
    if (!made)
        return PERP_ERROR_MEMORY;
    made->settings = settings;
    made->free_body = -1;
    made->free_shape = -1;
    perp__arena_init(&made->body_arena, context);
    perp__arena_init(&made->shape_arena, context);
    perp__arena_init(&made->link_arena, context);
    perp__arena_init(&made->island_arena, context);
    set_coordinates(made);
    status = make_solver(made);
    if (status == PERP_OK)
        status = make_ground(made);
    if (status == PERP_OK)
        *world = made;
    else
        perp__handle_end(made);
    return status;
}

perp_status perp_world_create(perp_context *context, perp_world **world,
                              const perp_world_settings *settings)
{
    perp_status status = perp__enter(context);

    if (status != PERP_OK)
        return status;
    return perp__leave(context, create(context, world, settings));
}

void perp_world_destroy(perp_world *world)
{
    perp__handle_destroy(world, &kind);
}

perp_body perp_world_ground(const perp_world *world)
{
    return perp__handle_is(world, &kind) ? perp__id(0, world->bodies[0].generation) : 0;
}

int32_t perp_world_contact_count(const perp_world *world)
{
    return perp__handle_is(world, &kind) ? world->record_count : 0;
}

static perp_status get_contact(const perp_world *world, perp_world_contact *contact, int32_t index)
{
    perp_status status = PERP__CHECK(perp_world_contact, world->context, contact);

    if (status != PERP_OK)
        return status;
    if (index < 0 || index >= world->record_count)
        return perp__fail(world->context, PERP_ERROR_ARGUMENT,
                          "index is %d, the last step had %d contacts", (int)index,
                          (int)world->record_count);
    perp__struct_write(contact, &world->records[index], sizeof world->records[index]);
    return PERP_OK;
}

perp_status perp_world_get_contact(const perp_world *world, perp_world_contact *contact,
                                   int32_t index)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    return perp__leave(world->context, get_contact(world, contact, index));
}

perp_status perp_world_get_stats(const perp_world *world, perp_world_stats *stats)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    status = PERP__CHECK(perp_world_stats, world->context, stats);
    if (status == PERP_OK)
        perp__struct_write(stats, &world->stats, sizeof world->stats);
    return perp__leave(world->context, status);
}

static perp_status step(perp_world *world, perp_step_result *result, double dt)
{
    perp_step_result own;
    perp_status status = PERP_OK;

    if (result)
        status = PERP__CHECK(perp_step_result, world->context, result);
    if (status == PERP_OK)
        status = perp__check_finite(world->context, "dt", &dt, 1);
    if (status != PERP_OK)
        return status;
    if (dt <= 0.0)
        return perp__fail(world->context, PERP_ERROR_ARGUMENT, "dt is %g, > 0 expected", dt);
    status = perp_step_result_init(&own, sizeof own);
    if (status == PERP_OK)
        status = perp__step(world, &own, dt);
    if (status == PERP_OK && result)
        perp__struct_write(result, &own, sizeof own);
    return status;
}

perp_status perp_world_step(perp_world *world, perp_step_result *result, double dt)
{
    perp_status status = perp__world_enter(world);

    if (status != PERP_OK)
        return status;
    return perp__leave(world->context, step(world, result, dt));
}

/* Islands: dynamic bodies that contacts join, directly or through other dynamic bodies. Static and
 * kinematic bodies join nothing: no impulse passes through them. Islands are numbered by their
 * lowest body slot, bodies and contacts within an island keep their order. */
#include "world/joints/joints.h"

#include "base/groups.h"

static bool joins(const perp__contact_set *set, int32_t i, bool pressing)
{
    const perp__contact_flags *flags = &set->flags[i];

    return flags->included &&
           (!pressing || flags->pushes || !perp__is_zero3(set->responses[i].impulse));
}

/* Numbers islands and lists their bodies; roots come first: one pass counts, the next fills. */
static void order_bodies(perp_world *world)
{
    int32_t count = 0, offset = 0;

    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];
        const int32_t root = perp__root_of(world->islands.parent, body);
        perp__role *role = &world->step.roles[body];

        if (!role->dynamic || !(role->touched || role->jointed))
            continue;
        if (root == body) {
            memset(&world->islands.all[count], 0, sizeof world->islands.all[count]);
            role->island = count++;
        } else {
            role->island = world->step.roles[root].island;
        }
        role->local = world->islands.all[role->island].bodies++;
    }
    world->islands.count = count;
    for (int32_t i = 0; i < count; i++) {
        world->islands.all[i].first_body = offset;
        offset += world->islands.all[i].bodies;
    }
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const perp__role *role = &world->step.roles[world->sleep.awake[i]];

        if (role->island >= 0)
            world->islands.body_order[world->islands.all[role->island].first_body + role->local] =
                world->sleep.awake[i];
    }
}

static int32_t island_of(const perp_world *world, const perp__contact_flags *flags)
{
    const int32_t a = world->step.roles[flags->body[0]].island;

    return a >= 0 ? a : world->step.roles[flags->body[1]].island;
}

static void list_contact(perp_world *world, const perp__contact_set *set, perp__island *island,
                         int32_t i)
{
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = set->flags[i].body[side];
        const perp__role *role = &world->step.roles[body];

        set->flags[i].local[side] = role->dynamic ? role->local : -1;
        if (role->dynamic)
            continue;
        island->ties += island->ties == 0 || island->tied != body;
        island->tied = body;
    }
    world->islands.contact_order[island->first_contact + island->contacts++] = i;
}

/* Lists the contacts of each island. */
static void order_contacts(perp_world *world, const perp__contact_set *set, bool pressing)
{
    int32_t offset = 0;

    for (int32_t i = 0; i < set->count; i++)
        if (joins(set, i, pressing))
            world->islands.all[island_of(world, &set->flags[i])].contacts++;
    for (int32_t i = 0; i < world->islands.count; i++) {
        world->islands.all[i].first_contact = offset;
        offset += world->islands.all[i].contacts;
        world->islands.all[i].contacts = 0;
    }
    for (int32_t i = 0; i < set->count; i++)
        if (joins(set, i, pressing))
            list_contact(world, set, &world->islands.all[island_of(world, &set->flags[i])], i);
}

/* Lists what presses alone, in islands of one body each, which that does not part. */
static void list_pressing(perp_world *world, const perp__contact_set *set)
{
    for (int32_t k = 0; k < world->islands.count; k++) {
        perp__island *island = &world->islands.all[k];
        const int32_t *listed = world->islands.contact_order + island->first_contact;
        const int32_t count = island->contacts;

        island->contacts = island->ties = 0;
        for (int32_t i = 0; i < count; i++)
            if (joins(set, listed[i], 1))
                list_contact(world, set, island, listed[i]);
    }
}

static perp__island *island_of_joint(const perp_world *world, int32_t i)
{
    const int32_t *body = world->joints.all[i].body;
    const int32_t side = perp__is_dynamic(world, body[0]) ? 0 : 1;

    return &world->islands.all[world->step.roles[body[side]].island];
}

static void order_joints(perp_world *world)
{
    int32_t offset = 0;

    for (int32_t i = 0; i < world->joints.slots; i++)
        if (perp__joint_works(world, i))
            island_of_joint(world, i)->joints++;
    for (int32_t i = 0; i < world->islands.count; i++) {
        world->islands.all[i].first_joint = offset;
        offset += world->islands.all[i].joints;
        world->islands.all[i].joints = 0;
    }
    for (int32_t i = 0; i < world->joints.slots; i++)
        if (perp__joint_works(world, i)) {
            perp__island *island = island_of_joint(world, i);

            world->islands.joint_order[island->first_joint + island->joints++] = i;
        }
}

static void lay_out_order(perp__arena *arena, void *object)
{
    perp_world *world = object;
    int32_t most = world->contacts.now.capacity > world->contacts.overlaps.capacity
                       ? world->contacts.now.capacity
                       : world->contacts.overlaps.capacity;

    world->islands.contact_order =
        perp__arena_take(arena, (size_t)most, sizeof *world->islands.contact_order);
    world->islands.joint_order =
        perp__arena_take(arena, (size_t)world->joints.capacity, sizeof *world->islands.joint_order);
}

perp_status perp__build_islands(perp_world *world, const perp__contact_set *set, bool pressing)
{
    const size_t sizes[3] = {(size_t)world->contacts.now.capacity,
                             (size_t)world->contacts.overlaps.capacity,
                             (size_t)world->joints.capacity};
    perp_status status;

    if (pressing && world->islands.count > 0 && world->joints.count == 0 &&
        world->islands.count == perp__count_members(world)) {
        list_pressing(world, set);
        return PERP_OK;
    }
    status = perp__arena_fit_sizes(&world->islands.arena, world->context, lay_out_order, world,
                                   world->islands.fitted, sizes, 3);
    if (status != PERP_OK)
        return status;
    world->islands.set = set;
    /* 1. What joins bodies: contacts, and joints. */
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];

        world->islands.parent[body] = body;
        world->step.roles[body].touched = world->step.roles[body].jointed = 0;
        world->step.roles[body].island = -1;
    }
    for (int32_t i = 0; i < set->count; i++) {
        const int32_t a = set->flags[i].body[0], b = set->flags[i].body[1];

        if (!set->flags[i].included)
            continue;
        world->step.roles[a].touched = world->step.roles[b].touched = 1;
        if (joins(set, i, pressing) && world->step.roles[a].dynamic && world->step.roles[b].dynamic)
            perp__join(world->islands.parent, a, b);
    }
    if (world->joints.count > 0)
        perp__join_joined(world);
    /* 2. Their order. */
    order_bodies(world);
    order_contacts(world, set, pressing);
    if (world->joints.count > 0)
        order_joints(world);
    return PERP_OK;
}

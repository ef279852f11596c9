/* Rest is a fixed point. What a step makes of some bodies depends on their states, the impulses
 * that their contacts remember, the length of the step, and on what is near them: the shapes whose
 * fat boxes overlap theirs. Where bodies joined by such pairs have the same states and memories
 * after a step as before, bit for bit, every further step of that length gives them again. So they
 * fall asleep: steps go through what is awake alone. They wake when one of them, the length of the
 * step or what they rest on is changed, or when something awake comes near; then memories, which
 * lie with the records of their contacts meanwhile, are what they were.
 *
 * Budgets of iterations are shared by a whole step, so that nothing is alone: none sleeps then. */
#include "world/joints/joints.h"

#include "base/groups.h"

enum { NONE = -1 };

/* ---- waking ---- */

static void enlist(perp_world *world, int32_t body)
{
    if (world->bodies.all[body].awake)
        return;
    world->bodies.all[body].awake = 1;
    world->sleep.some_put |= world->bodies.states[body].put != 0;
    world->sleep.awake[world->sleep.awake_count + world->sleep.roused_count++] = body;
    world->sleep.awake_changed = 1;
}

/* Counts a nap in what all of them are together, once more or once less. */
static void count_nap(perp_world *world, const perp__nap *nap, int32_t times)
{
    perp__nap *all = &world->sleep.asleep;

    all->islands += times * nap->islands;
    all->solved += times * nap->solved;
    all->contacts += times * nap->contacts;
    all->tangents += times * nap->tangents;
    all->rounded += times * nap->rounded;
}

void perp__rouse(perp_world *world, int32_t body)
{
    const int32_t i = world->bodies.all[body].nap;

    if (i != NONE) { /* with all that fell asleep beside it */
        perp__nap *nap = &world->sleep.naps[i];
        int32_t next;

        for (int32_t member = nap->first; member != NONE; member = next) {
            next = world->bodies.all[member].next_member;
            world->bodies.all[member].nap = NONE;
            enlist(world, member);
        }
        count_nap(world, nap, -1);
        world->sleep.residual_changed |= nap->residual >= world->sleep.asleep.residual;
        nap->first = NONE;
        nap->next_free = world->sleep.free_nap;
        world->sleep.free_nap = i;
    }
    enlist(world, body);
}

void perp__rouse_all(perp_world *world)
{
    for (int32_t i = 0; i < world->bodies.slots; i++)
        if (world->bodies.all[i].alive) {
            perp__unsettle(world, i);
            perp__rouse(world, i);
        }
}

void perp__disturb(perp_world *world, int32_t body)
{
    perp__unsettle(world, body);
    perp__rouse(world, body);
    perp__rouse_joined(world, body);
    for (int32_t shape = world->bodies.all[body].first_shape; shape != NONE;
         shape = world->shapes.all[shape].next_of_body) {
        for (int32_t link = world->shapes.all[shape].first_link; link != NONE;
             link = world->pairs.all[link / 2].next[link % 2]) {
            const perp__pair *pair = &world->pairs.all[link / 2];
            const int32_t other = world->shapes.all[link % 2 ? pair->first : pair->second].body;

            if (perp__is_dynamic(world, other))
                perp__rouse(world, other);
        }
        if (world->shapes.all[shape].geometry.kind == PERP__PLANE)
            world->pairs.planes_changed = 1;
    }
}

/* ---- the list of those awake ---- */

void perp__list_awake(perp_world *world)
{
    int32_t count = 0;
    const int32_t all = world->sleep.awake_count + world->sleep.roused_count;

    /* the roused move past each of the others, or all slots are gone through */
    if ((int64_t)world->sleep.roused_count * all <= world->bodies.slots) {
        world->sleep.awake_count = all;
        perp__sort_few(world->sleep.awake, all);
    } else {
        world->sleep.awake_count = 0;
        for (int32_t i = 0; i < world->bodies.slots; i++) {
            world->bodies.all[i].awake = world->bodies.all[i].awake && world->bodies.all[i].alive;
            if (world->bodies.all[i].awake)
                world->sleep.awake[world->sleep.awake_count++] = i;
        }
    }
    world->sleep.roused_count = 0;
    /* what sleeps or was removed is left out, and the shapes are listed */
    world->sleep.awake_shape_count = 0;
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];

        if (!world->bodies.all[body].alive)
            world->bodies.all[body].awake = 0;
        if (!world->bodies.all[body].awake)
            continue;
        world->sleep.awake[count++] = body;
        for (int32_t shape = world->bodies.all[body].first_shape; shape != NONE;
             shape = world->shapes.all[shape].next_of_body)
            world->sleep.awake_shapes[world->sleep.awake_shape_count++] = shape;
    }
    world->sleep.awake_count = count;
    world->sleep.awake_changed = 0;
    world->pairs.changed = 2;
}

/* ---- what contacts are kept as ---- */

void perp__drop_sleeping(perp_world *world, int32_t *first)
{
    while (*first != NONE) {
        const int32_t number = *first;
        perp__sleeping_contact *sleeping = &world->sleep.contacts[number];

        *first = sleeping->next;
        sleeping->next = world->sleep.free_contact;
        world->sleep.free_contact = number;
        world->sleep.contact_count--;
        world->sleep.included -= sleeping->included;
    }
}

void perp__forget_naps(perp_world *world)
{
    for (int32_t i = 0; i < world->pairs.slots; i++)
        world->pairs.all[i].first_sleeping = NONE;
    world->sleep.contact_slots = world->sleep.contact_count = world->sleep.included =
        world->sleep.orphan_count = 0;
    world->sleep.free_contact = world->sleep.first_orphan = NONE;
}

/* Keeps contact i of the last step, its pair's memories written, behind what that kept before. */
static void keep_contact(perp_world *world, int32_t i, perp__nap *nap)
{
    const perp__world_contact *contact = &world->contacts.last.contacts[i];
    perp__pair *pair = &world->pairs.all[contact->pair];
    perp__contact_flags *flags = &world->contacts.last.flags[i];
    int32_t *link = &pair->first_sleeping, slot = world->sleep.free_contact;
    perp__sleeping_contact *sleeping;

    if (slot != NONE)
        world->sleep.free_contact = world->sleep.contacts[slot].next;
    else
        slot = world->sleep.contact_slots++;
    while (*link != NONE)
        link = &world->sleep.contacts[*link].next;
    *link = slot;
    sleeping = memset(&world->sleep.contacts[slot], 0, sizeof *sleeping);
    sleeping->next = NONE;
    world->sleep.contact_count++;
    perp__write_memory(&world->contacts.last, i, &sleeping->memory);
    sleeping->order = perp__contact_order(contact);
    sleeping->included = flags->included;
    world->sleep.included += flags->included;
    nap->contacts += flags->included;
    if (flags->included && flags->rubs)
        nap->tangents += world->settings.planar ? 1 : 2;
    perp__write_record(&world->contacts.last, i, &sleeping->record);
    world->contacts.last_included -= flags->included;
    flags->included = 0;
    pair->memories = 0;
}

/* ---- falling asleep ---- */

static bool is_calm(const perp_world *world, int32_t body)
{
    const perp__motion *motion = &world->step.motions[body];

    return world->step.roles[body].repeats && perp__is_good(motion->verdict.outcome) &&
           motion->verdict.impacts == 0;
}

/* Joins bodies by their pairs; a set's root is calm where all of it is. */
static void find_calm(perp_world *world)
{
    for (int32_t i = 0; i < world->sleep.awake_count; i++)
        world->islands.parent[world->sleep.awake[i]] = world->sleep.awake[i];
    for (int32_t i = 0; i < world->pairs.count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);
        const int32_t a = pair->body[0], b = pair->body[1];

        if (perp__is_dynamic(world, a) && perp__is_dynamic(world, b))
            perp__join(world->islands.parent, a, b);
    }
    perp__join_joined(world);
    for (int32_t i = 0; i < world->sleep.awake_count; i++)
        world->step.roles[world->sleep.awake[i]].calm =
            (int8_t)is_calm(world, world->sleep.awake[i]);
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];

        if (!world->step.roles[body].calm)
            world->step.roles[perp__root_of(world->islands.parent, body)].calm = 0;
    }
    perp__upset_joints(world);
    for (int32_t i = 0; i < world->pairs.count; i++) {
        const perp__pair *pair = perp__ordered_pair(world, i);
        const int32_t *bodies = pair->body;

        for (int32_t side = 0; side < 2; side++)
            if (perp__is_dynamic(world, bodies[side]) &&
                (pair->changed || (world->bodies.all[bodies[1 - side]].awake &&
                                   !world->step.roles[bodies[1 - side]].calm)))
                world->step.roles[perp__root_of(world->islands.parent, bodies[side])].calm = 0;
    }
}

/* The body joins the nap of its set's root, which is the first of it. */
static void join_nap(perp_world *world, int32_t body, int32_t root)
{
    const perp__verdict *verdict = &world->step.motions[body].verdict;
    const bool begins = body == root;
    int32_t slot = begins ? world->sleep.free_nap : world->bodies.all[root].nap;
    perp__nap *nap;

    if (begins && slot != NONE)
        world->sleep.free_nap = world->sleep.naps[slot].next_free;
    else if (begins)
        slot = world->sleep.nap_slots++;
    nap = &world->sleep.naps[slot];
    if (begins) {
        memset(nap, 0, sizeof *nap);
        nap->first = nap->last = NONE;
    }
    world->bodies.all[body].nap = slot;
    if (nap->first == NONE)
        nap->first = body;
    else
        world->bodies.all[nap->last].next_member = body;
    nap->last = body;
    world->bodies.all[body].next_member = NONE;
    nap->rounded |= verdict->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
    perp__raise_to(&nap->residual, verdict->residual);
    nap->islands += verdict->is_first;
    nap->solved += verdict->is_first && verdict->stages > 0;
}

void perp__fall_asleep(perp_world *world)
{
    const perp__growing naps = PERP__GROWING(world->sleep.naps, world->sleep.nap_slots, 1);
    const perp__growing sleeping =
        PERP__GROWING(world->sleep.contacts, world->sleep.contact_slots, 1);
    int32_t i, calm = 0, slept = 0;

    /* 1. Not where nothing is calm, or without room. */
    for (i = 0; i < world->step.moving_count; i++)
        calm += is_calm(world, world->step.moving[i]);
    if (calm == 0 || world->settings.max_iterations > 0 || world->settings.wakeful ||
        perp__grow(world->context, NULL, &world->sleep.nap_capacity,
                   (int64_t)world->sleep.nap_slots + calm, &naps, 1) != PERP_OK ||
        perp__grow(world->context, NULL, &world->sleep.kept_capacity,
                   (int64_t)world->sleep.contact_count + world->contacts.last.count, &sleeping,
                   1) != PERP_OK)
        return;
    /* 2. Those whose sets are calm; what does not move by itself sleeps where it is. */
    find_calm(world);
    for (i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i],
                      root = perp__root_of(world->islands.parent, body);

        if (!world->step.roles[root].calm)
            continue;
        if (perp__is_dynamic(world, body))
            join_nap(world, body, root);
        world->bodies.all[body].awake = 0;
        world->step.moved[body] = 0;
        slept++;
    }
    if (slept == 0)
        return;
    /* 3. Their contacts, and what all that sleeps is. */
    for (i = 0; i < world->contacts.last.count; i++) {
        const int32_t *body = world->contacts.last.flags[i].body;
        const int32_t a = world->bodies.all[body[0]].nap;
        const int32_t nap = a != NONE ? a : world->bodies.all[body[1]].nap;

        if (nap != NONE)
            keep_contact(world, i, &world->sleep.naps[nap]);
    }
    for (i = 0; i < world->sleep.awake_count; i++) {
        const int32_t body = world->sleep.awake[i];
        const perp__nap *nap = &world->sleep.naps[world->bodies.all[body].nap];

        if (world->bodies.all[body].nap == NONE || nap->first != body)
            continue;
        count_nap(world, nap, 1);
        perp__raise_to(&world->sleep.asleep.residual, nap->residual);
    }
    perp__list_awake(world);
}

void perp__find_asleep_residual(perp_world *world)
{
    world->sleep.asleep.residual = 0.0;
    for (int32_t i = 0; i < world->sleep.nap_slots; i++)
        if (world->sleep.naps[i].first != NONE)
            perp__raise_to(&world->sleep.asleep.residual, world->sleep.naps[i].residual);
    world->sleep.residual_changed = 0;
}

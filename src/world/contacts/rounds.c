/* What comes to a step's contacts once the motion is known, round by round: points that it closes,
 * pairs that it makes meet, those that it turns deeper into each other, and what lies farther along
 * a half-space. Only bodies whose motion the last round changed are looked at. */
#include "world/islands/lanes.h"

#include "world/collide/collision.h"

/* How often a pair may join; and rounds after which what still meets is left to the next step. */
#define MAX_JOINS 6
#define MAX_ROUNDS 24

/* The point as seen from the start: arms are those of the collision, the gap is what the motion has
 * closed till then. A body that comes from farther than it is long is hit in its mass centre: a
 * step in which it would turn by many radians says nothing about the points beside it, and they let
 * the centre through. */
static void set_back(perp__world_contact *contact, double t, const perp__moving *a,
                     const perp__moving *b)
{
    const double *normal = contact->axes[0];
    double centres[2][3], closed = 0.0;

    perp__along3(centres[0], a->centre, t, a->displacement);
    perp__along3(centres[1], b->centre, t, b->displacement);
    perp__write_arms(contact, centres[0], centres[1]);
    for (int32_t side = 0; side < 2; side++) {
        const perp__moving *moving = side == 0 ? a : b;
        double *arm = contact->arms[side], at[3], along;

        if (t * perp__length3(moving->displacement) > moving->reach) {
            along = perp__dot3(normal, arm);
            for (int32_t k = 0; k < 3; k++)
                arm[k] = along * normal[k];
        }
        perp__cross(at, moving->turn, arm);
        perp__add3(at, 1.0, moving->displacement);
        closed += (side == 0 ? t : -t) * perp__dot3(normal, at);
        perp__add3(contact->position, -0.5 * t, at);
    }
    contact->gap += closed;
}

/* Contact i of the set came after the first round. */
static void list_late(perp__contact_set *set, perp__pair *pair, int32_t i)
{
    set->responses[i].later = -1;
    if (pair->late >= 0)
        set->responses[pair->latest].later = i;
    else
        pair->late = i;
    pair->latest = i;
}

/* Whether some of the pair's are in the set. */
static bool has_points(const perp__pair *pair)
{
    return !pair->open || pair->joined > 0;
}

/* Whether the pair has that point from a round before, to what is near: another row like that one
 * would move nothing. Beside joints arcs and rows that give way leave what is obeyed deeper. */
static bool is_known(const perp__contact_set *set, const perp__pair *pair,
                     const perp__world_contact *contact)
{
    for (int32_t k = pair->late; k >= 0; k = set->responses[k].later) {
        const perp__world_contact *known = &set->contacts[k];
        double apart = fabs(known->gap - contact->gap);

        for (int32_t i = 0; i < 3; i++) {
            for (int32_t side = 0; side < 2; side++)
                perp__raise_to(&apart, fabs(known->arms[side][i] - contact->arms[side][i]));
            perp__raise_to(&apart, contact->size * fabs(known->axes[0][i] - contact->axes[0][i]));
        }
        if (known->round < contact->round && apart <= PERP__NEAR * contact->size)
            return 1;
    }
    return 0;
}

/* Appends the points in which a pair meets; a feature that has one has another, as it lies then. */
static perp_status join_pair(perp_world *world, perp__pair *pair, double h)
{
    const int32_t before = world->contacts.now.count;
    perp__moving a, b;
    perp__point points[PERP__MAX_POINTS];
    int32_t i, made = perp__collision_points(world, pair, h, points);
    perp_status status =
        perp__reserve_contacts(world, &world->contacts.now, world->contacts.now.count + made);

    perp__moving_shape(world, pair->first, h, &a);
    perp__moving_shape(world, pair->second, h, &b);
    for (i = 0; i < made && status == PERP_OK; i++) {
        perp__contact_set *set = &world->contacts.now;
        perp__world_contact *contact =
            perp__append_contact(world, set, pair, &points[i], world->bodies.states);
        const int32_t number = set->count - 1;

        if (has_points(pair)) /* what a feature remembers is the first point's */
            memset(set->responses[number].warm, 0, sizeof set->responses[number].warm);
        set_back(contact, pair->collision.time, &a, &b);
        contact->gap = perp__greater(contact->gap, pair->collision.begun);
        if (is_known(set, pair, contact)) {
            set->count--;
            continue;
        }
        set->flags[number].moved =
            (int8_t)(pair->collision.time == 1.0 ||
                     (pair->collision.time > 0.0 && !(fabs(contact->gap) <= contact->rounding)));
        perp__prepare_contact(world, set, number);
        list_late(set, pair, number);
    }
    if (world->contacts.now.count > before)
        pair->joined++;
    return status;
}

/* Whether the step's velocities break the point's law by more than passes leave of its row, if it
 * turned nothing (contact/coloured): they would not change for less. */
static bool presses(const perp_world *world, const perp__world_contact *contact, double h)
{
    const int32_t body[] = {contact->body_a, contact->body_b};
    const double lack = -fmax(perp__open_gap(contact, contact->gap), 0.0) / h -
                        fmin(perp__normal_velocity(world, contact, PERP__TWIST_AFTER),
                             perp__normal_velocity(world, contact, PERP__TWIST_MOVING));
    double drive = INFINITY, inverse_mass = 0.0;

    for (int32_t side = 0; side < 2; side++)
        if (perp__is_dynamic(world, body[side])) {
            drive = fmin(drive, world->step.motions[body[side]].verdict.drive);
            inverse_mass += 1.0 / world->bodies.all[body[side]].mass;
        }
    return !(lack <= perp__swept_tol(world) * drive * sqrt(inverse_mass));
}

/* ---- arcs ----
 *
 * A point that turns about its mass centre goes on an arc. Its rate may close a gap that the arc
 * leaves open: a rod that spins beside a wall does not touch it because its end goes towards it.
 * What touches, or pressed in the last step, goes by its rates: it stays in contact while it turns.
 * Rows of islands with joints turn with their bodies (islands/along.c), and so know arcs. */

/* Whether the arc of a point comes to a half-space that does not turn, over which it is by
 *
 *   f(t) = gap + t n.v + n.(R(t w) - 1) r = gap + t a + b sin(t |w|) + c (1 - cos(t |w|)),
 *
 * r to the core of the shape. f'' >= -|w|^2 |(b, c)|. */
static bool meets_plane(const perp_world *world, const perp__world_contact *contact,
                        const double ways[2][6])
{
    const int32_t shapes[2] = {contact->shape_a, contact->shape_b};
    const int32_t side = world->shapes.all[contact->shape_a].geometry.kind == PERP__PLANE;
    const double *v = ways[side], *beside = ways[1 - side];
    double n[3] = {0.0, 0.0, 0.0}, core[3], axis[3], rate[3], bend[3], way[3], t = 0.0;

    if (!perp__is_zero3(beside + 3))
        return 1;
    perp__add3(n, side == 1 ? 1.0 : -1.0, contact->axes[0]);
    perp__along3(core, contact->arms[side], world->shapes.all[shapes[side]].geometry.radius, n);
    perp__copy3(axis, v + 3);
    const double angle = perp__normalise3(axis);
    perp__cross(rate, axis, core);
    perp__cross(bend, axis, rate);
    perp__subtract3(way, v, beside);
    const double a = perp__dot3(n, way), b = perp__dot3(n, rate), c = perp__dot3(n, bend);
    const double most = angle * angle * sqrt(b * b + c * c);
    for (int32_t look = 0; look < PERP__MAX_LOOKS; look++) {
        const double s = sin(t * angle), d = cos(t * angle);
        const double apart = contact->gap + t * a + b * s + c * (1.0 - d);
        const double slope = a + angle * (b * d + c * s);

        if (apart <= contact->rounding)
            return 1;
        t += 2.0 * apart / (sqrt(slope * slope + 2.0 * most * apart) - slope);
        if (t > 1.0)
            return 0;
    }
    return 1;
}

bool perp__meets(const perp_world *world, int32_t i, double h, double end)
{
    const perp__world_contact *contact = &world->contacts.now.contacts[i];
    const perp__pair *pair = &world->pairs.all[contact->pair];
    const int32_t body[2] = {contact->body_a, contact->body_b};
    double ways[2][6], way = 0.0, turn = 0.0, aside = 0.0;
    bool jointed = 0;

    /* 1. how far arcs lead aside from the rates, and the normal, which turns with its face */
    for (int32_t side = 0; side < 2; side++) {
        for (int32_t k = 0; k < 6; k++)
            ways[side][k] = h * world->step.motions[body[side]].moving[k];
        const double angle = perp__length3(ways[side] + 3),
                     arm = perp__length3(contact->arms[side]);

        way += perp__length3(ways[side]) + angle * arm;
        aside += 0.5 * angle * angle * arm;
        turn += angle;
        jointed |= world->bodies.all[body[side]].first_joint != 0;
    }
    if (jointed || end < -(aside + turn * way) || turn == 0.0 || pair->first != contact->shape_a ||
        pair->second != contact->shape_b ||
        !perp__is_zero3(world->contacts.now.responses[i].remembered) ||
        contact->gap <= perp__pair_touching(world, pair, contact->rounding) ||
        (pair->plane && contact->round > 0 && pair->joined > 0 && pair->collision.time > 0.0))
        return 1;

    /* 2. on the way */
    return pair->plane ? meets_plane(world, contact, (const double(*)[6])ways)
                       : perp__pair_meets(world, pair, h);
}

/* ---- points that come ---- */

/* Whether the motion at hand closes a point, or another one that goes no farther may, but for those
 * that turn past each other; of what came late, whether it presses, and takes the bodies deeper
 * into each other than that share of their size. */
static bool is_due(const perp_world *world, int32_t i, double h, double deep)
{
    const perp__world_contact *contact = &world->contacts.now.contacts[i];
    const double *a = world->step.motions[contact->body_a].moving;
    const double *b = world->step.motions[contact->body_b].moving;
    const double end = contact->gap + h * perp__normal_velocity(world, contact, PERP__TWIST_MOVING);

    if (deep > 0.0 && (end >= -deep * contact->size || !presses(world, contact, h)))
        return 0;
    if (!(end >= 0.0))
        return perp__meets(world, i, h, end);
    return !(contact->gap > contact->rounding) ||
           contact->gap <=
               h * (perp__length3(a) + perp__length3(a + 3) * perp__length3(contact->arms[0]) +
                    perp__length3(b) + perp__length3(b + 3) * perp__length3(contact->arms[1]));
}

int32_t perp__include_points(perp_world *world, double h, double deep)
{
    perp__contact_set *set = &world->contacts.now;
    const int32_t before = set->included;

    for (int32_t i = 0; i < set->count && set->included < set->count; i++) {
        perp__contact_flags *flags = &set->flags[i];
        /* else what was not due in the round before is not now */
        const bool is_moved = world->contacts.rounds == 0 ||
                              world->step.moved[flags->body[0]] >= world->contacts.rounds ||
                              world->step.moved[flags->body[1]] >= world->contacts.rounds;

        if (flags->included || !is_moved ||
            !((flags->closed && deep == 0.0) || is_due(world, i, h, deep)))
            continue;
        flags->included = flags->fresh = 1;
        set->included++;
        set->rubbing += flags->rubs;
    }
    return set->included - before;
}

/* Points of half-spaces that were left out come after all. */
static perp_status add_spare(perp_world *world, int32_t body)
{
    perp__contact_set *set = &world->contacts.now;
    perp__point points[PERP__MAX_POINTS];
    perp_status status = PERP_OK;

    world->step.motions[body].spare = INFINITY;
    for (int32_t shape = world->bodies.all[body].first_shape; shape >= 0;
         shape = world->shapes.all[shape].next_of_body)
        for (int32_t link = world->shapes.all[shape].first_link; link >= 0 && status == PERP_OK;
             link = world->pairs.all[link / 2].next[link % 2]) {
            perp__pair *pair = &world->pairs.all[link / 2];
            const int32_t made = pair->spare < INFINITY
                                     ? perp__collide(&world->step.placed[pair->first],
                                                     &world->step.placed[pair->second],
                                                     world->settings.planar, INFINITY, points)
                                     : 0;

            status = perp__reserve_contacts(world, set, set->count + made);
            for (int32_t k = 0; k < made && status == PERP_OK; k++)
                if (points[k].gap > pair->spare) {
                    perp__write_touching(world, set->count, NULL, pair, &points[k]);
                    list_late(set, pair, set->count++);
                }
            pair->spare = INFINITY;
        }
    return status;
}

/* Pairs that meet, or sink into each other, of bodies whose motion is not the one that was looked
 * at last: listed from where the share begins. */
static void collision_share(perp_world *world, perp__share *share, double h)
{
    int32_t *met = world->pairs.met + share->first;

    share->count = 0;
    for (int32_t i = share->first; i < share->end; i++) {
        perp__pair *pair = perp__ordered_pair(world, i);
        const double *from = world->step.motions[pair->body[0]].moving;
        const double *to = world->step.motions[pair->body[1]].moving;
        const double *apart = pair->collision.apart;
        double along = 0.0, turning;

        /* what moves as it did, or turns nothing, and what the plane found before keeps apart */
        if ((world->step.moved[pair->body[0]] < world->contacts.rounds &&
             world->step.moved[pair->body[1]] < world->contacts.rounds) ||
            !(pair->open || pair->reach[0] > 0.0 || pair->reach[1] > 0.0))
            continue;
        for (int32_t k = 0; k < 3; k++)
            along += apart[k] * (h * to[k] - h * from[k]);
        turning = perp__turning(world, pair->body[0], pair->reach[0], h) +
                  perp__turning(world, pair->body[1], pair->reach[1], h);
        if (pair->joined >= MAX_JOINS || /* or a plane stays between them, across `apart` */
            pair->collision.clearance + perp__lesser(along, 0.0) - turning > 0.0)
            continue;
        if (has_points(pair) ? perp__pair_sinks(world, pair, h)
                             : perp__pair_collides(world, pair, h))
            met[share->count++] = world->pairs.order[i].value;
    }
}

/* Collisions of pairs. */
static perp_status join_collisions(perp_world *world, double h)
{
    perp_status status =
        perp__enclose(world, world->islands.body_order, perp__count_members(world), h, 0.0);
    int32_t *const met = world->pairs.met;
    perp__share all = {0};

    if (status != PERP_OK || world->pairs.count == 0)
        return status;

    /* 1. those that meet */
    const int32_t lanes = perp__share_out(world, world->pairs.count, collision_share, h, &all);
    for (int32_t k = 0; k < lanes; k++) {
        const perp__share *share = &world->lanes[k].share;

        memmove(met + all.count, met + share->first, (size_t)share->count * sizeof *met);
        all.count += share->count;
    }

    /* 2. they join; the next round looks at them again, whether the motion changes or not */
    for (int32_t i = 0; i < all.count && status == PERP_OK; i++) {
        perp__pair *pair = &world->pairs.all[met[i]];

        status = join_pair(world, pair, h);
        world->step.moved[pair->body[!perp__is_dynamic(world, pair->body[0])]] =
            world->contacts.rounds + 1;
    }
    return status;
}

perp_status perp__join_contacts(perp_world *world, double h, double deep, int32_t *came)
{
    perp_status status = PERP_OK;

    *came = 0;
    if (++world->contacts.rounds > MAX_ROUNDS)
        return PERP_OK;
    /* 1. Motions that the islands changed: all others are what they were. */
    for (int32_t i = perp__count_members(world); i-- > 0 && status == PERP_OK;) {
        const int32_t body = world->islands.body_order[i];
        perp__motion *motion = &world->step.motions[body];

        if (memcmp(motion->tried, motion->moving, sizeof motion->tried) == 0)
            continue;
        memcpy(motion->tried, motion->moving, sizeof motion->tried);
        world->step.moved[body] = world->contacts.rounds;
        const double way = perp__longest_displacement(world, body, h);
        motion->enclosed = way <= motion->room;
        if (!(way < motion->spare))
            status = add_spare(world, body);
    }
    /* 2. What they make meet, and which points are due. */
    PERP__THEN(status, join_collisions(world, h));
    if (status == PERP_OK)
        *came = perp__include_points(world, h, deep);
    return status;
}

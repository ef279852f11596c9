/* Whether contacts of bodies that turn are met on the way.
 *
 * A point that turns about its mass centre goes on an arc. Its rate may close a gap that the arc
 * leaves open: a rod that spins beside a wall does not touch it because its end goes towards it.
 * What touches, or pressed in the last step, goes by its rates: it stays in contact while it turns.
 * Rows of islands with joints turn with their bodies (islands/along.c), and so know arcs. */
#include "world/step.h"

#include <math.h>

#include "linalg/spatial.h"

/* Whether the arc of a point comes to a half-space that does not turn, over which it is by
 *
 *   f(t) = gap + t n.v + n.(R(t w) - 1) r = gap + t a + b sin(t |w|) + c (1 - cos(t |w|)),
 *
 * r to the core of a round shape, which turns below its contact. f'' >= -|w|^2 |(b, c)|. */
static int32_t meets_plane(const perp_world *world, const perp__world_contact *contact,
                           const double ways[2][6])
{
    const int32_t shapes[2] = {contact->shape_a, contact->shape_b};
    const int32_t side = world->shapes[contact->shape_a].geometry.kind == PERP__PLANE;
    const double *v = ways[side], *beside = ways[1 - side];
    double n[3] = {0.0, 0.0, 0.0}, core[3], axis[3], rate[3], bend[3], way[3], t = 0.0;

    if (!perp__is_zero3(beside + 3))
        return 1;
    perp__add3(n, side == 1 ? 1.0 : -1.0, contact->axes[0]);
    perp__along3(core, contact->arms[side], world->shapes[shapes[side]].geometry.radius, n);
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
        t += most > 0.0    ? (slope + sqrt(slope * slope + 2.0 * most * apart)) / most
             : slope < 0.0 ? -apart / slope
                           : INFINITY;
        if (t > 1.0)
            return 0;
    }
    return 1;
}

int32_t perp__meets(const perp_world *world, int32_t i, double h, double end)
{
    const perp__world_contact *contact = &world->contacts.contacts[i];
    const perp__pair *pair = &world->pairs[contact->pair];
    const int32_t body[2] = {contact->body_a, contact->body_b};
    double ways[2][6], way = 0.0, turn = 0.0, aside = 0.0;
    int32_t jointed = 0;

    /* 1. how far arcs lead aside from the rates, and the normal, which turns with its face */
    for (int32_t side = 0; side < 2; side++) {
        for (int32_t k = 0; k < 6; k++)
            ways[side][k] = h * world->motions[body[side]].moving[k];
        const double angle = perp__length3(ways[side] + 3),
                     arm = perp__length3(contact->arms[side]);

        way += perp__length3(ways[side]) + angle * arm;
        aside += 0.5 * angle * angle * arm;
        turn += angle;
        jointed |= world->bodies[body[side]].first_joint != 0;
    }
    if (jointed || end < -(aside + turn * way) || turn == 0.0 || pair->first != contact->shape_a ||
        pair->second != contact->shape_b ||
        !perp__is_zero3(world->contacts.responses[i].remembered) ||
        contact->gap <= perp__pair_touching(world, pair, contact->rounding) ||
        (pair->plane && contact->round > 0 && pair->joined > 0 && pair->collision.time > 0.0))
        return 1;

    /* 2. on the way */
    return pair->plane ? meets_plane(world, contact, (const double(*)[6])ways)
                       : perp__pair_meets(world, pair, h);
}

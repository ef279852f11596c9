/* Islands in which nothing closes: their bodies go as forces alone move them.
 *
 * A point that turns about its mass centre goes on an arc. Its rate may close a gap that the arc
 * leaves open: a rod that spins beside a wall does not touch it because its end goes towards it. */
#include "world/islands/contact_rows.h"
#include "world/islands/lanes.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* Looks along an arc, each as far as it is open for sure, before it counts as closed. */
#define MAX_LOOKS 64

/* Twists by which bodies go, alone, that are no slower towards each other than on their way: those
 * at the end of the step, or their mean. */
static void find_twists(const perp_world *world, const perp__world_contact *contact, double h,
                        double twists[2][6])
{
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        const perp__motion *motion = &world->motions[body];

        for (int32_t k = 0; k < 6; k++)
            twists[side][k] = h * (contact->free < contact->start
                                       ? motion->free[k]
                                       : 0.5 * (motion->start[k] + motion->free[k]));
    }
}

/* Whether the arc of a point comes to a half-space that does not turn, over which it is by
 *
 *   f(t) = gap + t n.v + n.(R(t w) - 1) r = gap + t a + b sin(t |w|) + c (1 - cos(t |w|)),
 *
 * r to the core of a round shape, which turns below its contact. f'' is no less than -|w|^2 |(b, c)|.
 */
static int32_t meets_plane(const perp_world *world, const perp__world_contact *contact,
                           const double twists[2][6])
{
    const int32_t shapes[2] = {contact->shape_a, contact->shape_b};
    const int32_t side = world->shapes[contact->shape_a].geometry.kind == PERP__PLANE;
    const double *v = twists[side], *beside = twists[1 - side];
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
    for (int32_t look = 0; look < MAX_LOOKS; look++) {
        const double s = sin(t * angle), d = cos(t * angle);
        const double apart = contact->gap + t * a + b * s + c * (1.0 - d);
        const double slope = a + angle * (b * d + c * s);

        if (apart <= contact->rounding)
            return 1;
        t += most > 0.0 ? (slope + sqrt(slope * slope + 2.0 * most * apart)) / most
             : slope < 0.0 ? -apart / slope
                           : INFINITY;
        if (t > 1.0)
            return 0;
    }
    return 1;
}

/* Whether a contact closes if nothing acts: by the end of the step, or by its velocities then; where
 * bodies turn, if their shapes meet on the way as well. */
static int32_t closes(const perp_world *world, const perp__world_contact *contact, double h)
{
    const perp__pair *pair = &world->pairs[contact->pair];
    const double gap = perp__open_gap(contact, contact->gap);
    double twists[2][6];

    if (!(gap + h * fmin(contact->free, 0.5 * (contact->start + contact->free)) < 0.0))
        return 0;
    find_twists(world, contact, h, twists);
    if (gap == 0.0 || (perp__is_zero3(twists[0] + 3) && perp__is_zero3(twists[1] + 3)))
        return 1;
    return pair->plane ? meets_plane(world, contact, (const double(*)[6])twists)
                       : perp__pair_meets(world, pair, h, (const double(*)[6])twists);
}

int32_t perp__closes(const perp_world *world, const perp__island *island, double h)
{
    for (int32_t i = 0; i < island->contacts; i++)
        if (closes(world, perp__step_contact(world, island, i), h))
            return 1;
    return 0;
}

void perp__leave_alone(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        for (int32_t k = 0; k < 6; k++)
            motion->moving[k] = 0.5 * (motion->start[k] + motion->free[k]);
        memcpy(motion->after, motion->free, sizeof motion->after);
    }
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        memset(response->impulse, 0, sizeof response->impulse);
        memset(response->next, 0, sizeof response->next);
        perp__relative_velocity(world, perp__step_contact(world, island, i), PERP__TWIST_FREE,
                                response->velocity);
        response->mode = PERP_CONTACT_SEPARATE;
    }
}

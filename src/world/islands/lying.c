/* What begins at rest, and is held by the very impulses of the last step. Velocities of 0.0 obey
 * the laws of all its contacts if these press within their cones, and only where shapes touch; and
 * they are the answer if the forces on each body cancel. So nothing needs to be solved for. */
#include "world/step.h"

#include <math.h>
#include <string.h>

#include "linalg/spatial.h"

/* Beside its own terms, what moves a body as little as methods are asked to leave; and what
 * rounding does not tell apart from 0: from such a ratio of masses on, where the forces on what is
 * light are mostly those of what is heavy. */
#define BALANCED 1e-12
#define ROUNDING (64.0 * PERP__EPSILON)
#define LARGE_RATIO 1e3

/* Contacts between one that is asked of memory and that at hand. */
#define AHEAD 64
#define BODIES_AHEAD 10

/* Forces on a body: their sum, in the frame of the world, and the size of its terms, in the metric
 * of its mass. */
enum { FORCE = 0, MOMENT = 3, TERMS = 6, NUMBERS = 7 };

static int32_t moves(const perp_world *world, int32_t body)
{
    const double *start = world->motions[body].start;

    return world->bodies[body].kind != PERP_BODY_STATIC &&
           !(perp__is_zero3(start) && perp__is_zero3(start + 3));
}

/* Asks memory for a body of those in order. */
PERP__KERNEL static void fetch_body(const perp_world *world, int32_t i)
{
    if (i < perp__count_members(world)) {
        perp__fetch_far(&world->motions[world->body_order[i]], offsetof(perp__motion, trial));
        perp__fetch_far(&world->bodies[world->body_order[i]], offsetof(perp__body, given_mass));
    }
}

static int32_t begins_at_rest(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        fetch_body(world, island->first_body + i + BODIES_AHEAD);
        if (moves(world, world->body_order[island->first_body + i]))
            return 0;
    }
    return 1;
}

/* Whether the contact may press as it did while nothing moves. Sweeps take out what is deep. */
static int32_t obeys(const perp_world *world, const perp__world_contact *contact, const double *r,
                     int32_t swept)
{
    const double most = contact->friction * r[0];

    return r[0] >= 0.0 && r[1] * r[1] + r[2] * r[2] <= most * most &&
           (r[0] == 0.0 || perp__open_gap(contact, contact->gap) == 0.0) &&
           !(swept && perp__is_deep(contact)) && !moves(world, contact->body_a) &&
           !moves(world, contact->body_b);
}

/* Asks memory for a contact that comes soon, of this island or a later one. */
PERP__KERNEL static void fetch_ahead(const perp_world *world, const perp__island *island, int32_t i)
{
    const int32_t at = island->first_contact + i + AHEAD;

    if (at < world->contacts.included) {
        const int32_t number = world->contact_order[at];

        perp__fetch_far(&world->contacts.contacts[number], sizeof *world->contacts.contacts);
        perp__fetch_far(&world->contacts.responses[number], sizeof *world->contacts.responses);
    }
}

static void press(const perp_world *world, const perp__world_contact *contact, const double *r,
                  double *sums)
{
    double force[3], moment[3], size;

    if (r[0] == 0.0)
        return;
    for (int32_t k = 0; k < 3; k++)
        force[k] =
            r[0] * contact->axes[0][k] + r[1] * contact->axes[1][k] + r[2] * contact->axes[2][k];
    size = perp__length3(force);
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = side == 0 ? contact->body_a : contact->body_b;
        double *sum = sums + NUMBERS * world->roles[body].local;

        if (world->bodies[body].kind != PERP_BODY_DYNAMIC)
            continue;
        perp__cross(moment, contact->arms[side], force);
        for (int32_t k = 0; k < 3; k++) {
            sum[FORCE + k] += side == 0 ? -force[k] : force[k];
            sum[MOMENT + k] += side == 0 ? -moment[k] : moment[k];
        }
        sum[TERMS] += size;
    }
}

/* What is left of a body's forces beside the sizes of their terms: of its own, and of what presses
 * on its mass centre at least. */
static double unbalance(const perp_world *world, int32_t i, const double *sum)
{
    const perp__body *body = &world->bodies[i];
    const perp__motion *motion = &world->motions[i];
    const double root = sqrt(body->mass), *gain = motion->free;
    double own[3], turned[3], gained[3], left[6], terms;

    perp__apply_transposed3(own, motion->rotation, gain + 3);
    perp__apply3(gained, body->inverse_factor, own);
    perp__apply_transposed3(own, motion->rotation, sum + MOMENT);
    perp__apply_transposed3(turned, body->factor, own);
    for (int32_t k = 0; k < 3; k++) {
        left[k] = root * gain[k] + sum[FORCE + k] / root;
        left[3 + k] = gained[k] + turned[k];
    }
    terms = root * perp__length3(gain) + perp__length3(gained) + sum[TERMS] / root;
    own[0] = hypot(perp__length3(left), perp__length3(left + 3));
    return own[0] > 0.0 ? own[0] / terms : 0.0;
}

static void lie(perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        perp__motion *motion = perp__island_motion(world, island, i);

        memset(motion->moving, 0, sizeof motion->moving);
        memset(motion->after, 0, sizeof motion->after);
    }
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        perp__copy3(response->impulse, response->remembered);
        perp__copy3(response->next, response->remembered);
        memset(response->velocity, 0, sizeof response->velocity);
        response->mode = response->impulse[0] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
    }
}

int32_t perp__lies_still(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    double *sums = world->work.forces, left = 0.0, tol;
    int32_t swept;

    if ((world->settings.cone != 0 && !world->settings.planar) || !begins_at_rest(world, island))
        return 0;
    swept = !perp__is_worth_exact(world, island);
    for (int32_t i = 0; i < island->contacts; i++) {
        fetch_ahead(world, island, i);
        if (!obeys(world, perp__step_contact(world, island, i),
                   perp__step_response(world, island, i)->remembered, swept))
            return 0;
    }
    tol = perp__mass_ratio(world, island) >= LARGE_RATIO ? ROUNDING
                                                         : fmin(BALANCED, perp__exact_tol(world));
    memset(sums, 0, NUMBERS * (size_t)island->bodies * sizeof *sums);
    for (int32_t i = 0; i < island->contacts; i++)
        press(world, perp__step_contact(world, island, i),
              perp__step_response(world, island, i)->remembered, sums);
    for (int32_t i = 0; i < island->bodies && left <= tol; i++)
        perp__raise_to(
            &left, unbalance(world, world->body_order[island->first_body + i], sums + NUMBERS * i));
    if (!(left <= tol))
        return 0;
    lie(world, island);
    verdict->outcome = PERP_OUTCOME_SOLVED;
    verdict->residual = left;
    verdict->stages = 1;
    verdict->swept = swept;
    return 1;
}

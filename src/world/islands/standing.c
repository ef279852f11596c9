/* The question whether an island stands, put to contact/statics: first to the impulses of the last
 * step as they are, then to what forces changed since it was decided, then anew. */
#include "world/islands/standing.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/outcome.h"
#include "linalg/spatial.h"
#include "world/islands/contact_rows.h"
#include "world/joints/joints.h"

/* Of the impulses of the last step: what they may leave of each body's terms, and what rounding
 * does. */
#define BALANCED 1e-12
#define MOST_ITERATIONS 60

/* Products of a factorisation up to which it is asked whether an island stands: some .4 s, for a
 * heap in space of about 1500 bodies. */
#define MOST_PRODUCTS 2e9
#define MOST_FACTORS 30.0

/* Contacts between one that is asked of memory and that at hand. */
#define AHEAD 64

void perp__standing_release(perp__standing *standing)
{
    for (int32_t i = 0; i < PERP__STANDING_KEPT; i++)
        perp__statics_destroy(standing->statics[i]);
    memset(standing, 0, sizeof *standing);
}

/* ---- what carries an island ---- */

static int32_t takes_in(const perp_world *world, perp__carrying *carrying, int32_t *any,
                        int32_t body)
{
    const double *twist = world->motions[body].start, *other;
    const int32_t moves = world->bodies[body].kind == PERP_BODY_KINEMATIC &&
                          !(perp__is_zero3(twist) && perp__is_zero3(twist + 3));

    if (world->bodies[body].kind == PERP_BODY_DYNAMIC)
        return 1;
    if (!*any) {
        *any = 1;
        carrying->motion = moves ? PERP__CARRIED_ALONG : PERP__CARRIED_AT_REST;
        carrying->body = body;
        return 1;
    }
    if (!moves || carrying->motion == PERP__CARRIED_AT_REST)
        return !moves && carrying->motion == PERP__CARRIED_AT_REST;
    other = world->motions[carrying->body].start;
    return carrying->body == body || (perp__is_zero3(twist + 3) && perp__is_zero3(other + 3) &&
                                      memcmp(twist, other, 3 * sizeof *twist) == 0);
}

int32_t perp__find_carrying(const perp_world *world, const perp__island *island,
                            perp__carrying *carrying)
{
    int32_t any = 0, one = 1;

    carrying->motion = PERP__CARRIED_AT_REST;
    carrying->body = -1;
    for (int32_t i = 0; i < island->contacts && one; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        one = takes_in(world, carrying, &any, contact->body_a) &&
              takes_in(world, carrying, &any, contact->body_b);
    }
    for (int32_t i = 0; i < island->joints && one; i++)
        for (int32_t side = 0; side < 2 && one; side++)
            one = takes_in(world, carrying, &any, perp__island_joint(world, island, i)->body[side]);
    return one;
}

void perp__carried_twist(const perp_world *world, const perp__carrying *carrying, int32_t body,
                         double *twist)
{
    const double *of;
    double arm[3], turned[3];

    if (carrying->motion == PERP__CARRIED_AT_REST) {
        memset(twist, 0, 6 * sizeof *twist);
        return;
    }
    of = world->motions[carrying->motion == PERP__CARRIED_ON ? body : carrying->body].start;
    memcpy(twist, of, 6 * sizeof *twist);
    if (perp__is_zero3(of + 3) || carrying->motion == PERP__CARRIED_ON)
        return;
    perp__subtract3(arm, world->states[body].position, world->states[carrying->body].position);
    perp__cross(turned, of + 3, arm);
    perp__add3(twist, 1.0, turned);
}

/* Whether it stood in the last step: then a contact has what was decided then. */
static int32_t stood(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->contacts; i++)
        if (perp__step_response(world, island, i)->base[0] > 0.0)
            return 1;
    return 0;
}

static int32_t begins_with(const perp_world *world, const perp__island *island,
                           const perp__carrying *carrying)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->body_order[island->first_body + i];
        const double *start = world->motions[body].start;
        double twist[6];

        perp__carried_twist(world, carrying, body, twist);
        for (int32_t k = 0; k < 6; k++)
            if (start[k] != twist[k])
                return 0;
    }
    return 1;
}

/* Whether nothing changes at the contacts if bodies go on as they are: to the last bit, as rounding
 * of a sliding velocity is no rest. */
static int32_t goes_on(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        double u[3];

        perp__relative_velocity(world, contact, PERP__TWIST_START, u);
        if (u[0] != 0.0 || (contact->friction > 0.0 && (u[1] != 0.0 || u[2] != 0.0)))
            return 0;
    }
    return island->joints == 0;
}

int32_t perp__begins_standing(const perp_world *world, const perp__island *island,
                              perp__carrying *carrying)
{
    if (perp__find_carrying(world, island, carrying)) {
        if (begins_with(world, island, carrying))
            return 1;
        if (carrying->motion == PERP__CARRIED_ALONG && stood(world, island))
            return 1;
    }
    carrying->motion = PERP__CARRIED_ON;
    return goes_on(world, island);
}

/* ---- the impulses of the last step ---- */

/* Forces on a body: their sum, in the frame of the world, and the size of its terms, in the metric
 * of its mass. */
enum { FORCE = 0, MOMENT = 3, TERMS = 6, NUMBERS = 7 };

/* Whether the contact may press as it did while nothing moves. Sweeps take out what is deep. */
static int32_t obeys(const perp_world *world, const perp__world_contact *contact, const double *r,
                     int32_t swept)
{
    const double most = contact->friction * r[0];

    (void)world;
    return r[0] >= 0.0 && r[1] * r[1] + r[2] * r[2] <= most * most &&
           (r[0] == 0.0 || perp__open_gap(contact, contact->gap) == 0.0) &&
           !(swept && perp__is_deep(contact));
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

/* The angular impulse that takes a body from the angular velocity `now` to the carried one in a
 * time t, without contacts: not that of the free motion, which turns, and so has gyroscopic terms
 * of its own. */
static void find_turning(const perp_world *world, int32_t body, const double *now,
                         const double *carried, double t, double *L)
{
    const double *R = world->motions[body].rotation, *I = world->bodies[body].inertia;
    double own[3], turned[3], change[3], momentum[3], gyroscopic[3];

    perp__subtract3(change, now, carried);
    perp__apply_transposed3(own, R, change);
    perp__apply3(turned, I, own);
    perp__apply3(L, R, turned);
    perp__apply_transposed3(own, R, carried);
    perp__apply3(turned, I, own);
    perp__apply3(momentum, R, turned);
    perp__cross(gyroscopic, carried, momentum);
    perp__add3(L, t, world->states[body].torque);
    perp__add3(L, -t, gyroscopic);
}

/* What is left of a body's forces beside the sizes of their terms: of its own, and of what presses
 * on its mass centre at least. */
static double unbalance(const perp_world *world, const perp__carrying *carrying, int32_t i,
                        const double *sum)
{
    const perp__body *body = &world->bodies[i];
    const perp__motion *motion = &world->motions[i];
    const double root = sqrt(body->mass);
    double own[3], turned[3], gained[3], left[6], gain[6], L[3], terms;

    perp__carried_twist(world, carrying, i, gain);
    find_turning(world, i, motion->start + 3, gain + 3, world->step_length, L);
    for (int32_t k = 0; k < 3; k++)
        gain[k] = motion->free[k] - gain[k];
    perp__apply_transposed3(own, motion->rotation, L);
    perp__apply_transposed3(gained, body->factor, own);
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

static void lie(perp_world *world, const perp__island *island, const perp__carrying *carrying)
{
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->body_order[island->first_body + i];
        perp__motion *motion = &world->motions[body];

        perp__carried_twist(world, carrying, body, motion->after);
        memcpy(motion->moving, motion->after, sizeof motion->moving);
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
    double *sums = world->work.forces, left = 0.0;
    perp__carrying carrying;
    int32_t swept;

    if ((world->settings.cone != 0 && !world->settings.planar) ||
        !perp__begins_standing(world, island, &carrying))
        return 0;
    swept = !perp__is_worth_exact(world, island);
    for (int32_t i = 0; i < island->contacts; i++) {
        fetch_ahead(world, island, i);
        if (!obeys(world, perp__step_contact(world, island, i),
                   perp__step_response(world, island, i)->remembered, swept))
            return 0;
    }
    memset(sums, 0, NUMBERS * (size_t)island->bodies * sizeof *sums);
    for (int32_t i = 0; i < island->contacts; i++)
        press(world, perp__step_contact(world, island, i),
              perp__step_response(world, island, i)->remembered, sums);
    for (int32_t i = 0; i < island->bodies && left <= BALANCED; i++)
        perp__raise_to(&left, unbalance(world, &carrying, world->body_order[island->first_body + i],
                                        sums + NUMBERS * i));
    if (!(left <= BALANCED))
        return 0;
    lie(world, island, &carrying);
    verdict->outcome = PERP_OUTCOME_SOLVED;
    verdict->residual = left;
    verdict->stages = 1;
    verdict->swept = swept;
    verdict->stands = 1;
    return 1;
}

/* ---- rows ---- */

double perp__body_length(const perp_world *world, int32_t body)
{
    const double *I = world->bodies[body].inertia;

    return sqrt((I[0] + I[4] + I[8]) / world->bodies[body].mass);
}

/* The rows of a unit of work from row `from` on, turns over the bodies' lengths. */
static void link_unit(perp_world *world, const perp__island *island, int32_t i, int32_t from,
                      perp__statics_unit *unit, int32_t *links, size_t *at)
{
    perp__island_work *work = &world->work;
    const perp__rigid_rows *rows = &work->rows[i];
    const int32_t n = world->dof, linear = n == 6 ? 3 : 2;

    unit->link = *links;
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = rows->body[side];
        double *to = work->stand_values + *at, arm;

        if (body < 0 || body >= island->bodies)
            continue;
        arm = 1.0 / perp__body_length(world, work->members[body]);
        work->stand_links[*links].node = body;
        work->stand_links[(*links)++].at = *at;
        for (int32_t k = 0; k < unit->rows; k++)
            for (int32_t j = 0; j < n; j++)
                to[n * k + j] = rows->rows[side][from + k][j] * (j < linear ? 1.0 : arm);
        *at += (size_t)(unit->rows * n);
    }
    unit->links = *links - unit->link;
}

/* The unit of rows i. Returns 0 where it makes the bodies move, whatever the forces. What is open
 * carries nothing, and neither do points that only a motion would bring about. */
static int32_t write_unit(const perp_world *world, const perp__island *island, int32_t i,
                          perp__statics_unit *unit, int32_t *from)
{
    const perp__island_work *work = &world->work;
    const perp__rigid_rows *rows = &work->rows[i];

    *from = 0;
    unit->rows = rows->dim;
    if (i < work->count) {
        unit->kind = PERP__STATICS_CONE;
        unit->mu = rows->mu;
        unit->tangents = rows->dim - 1;
        if (rows->bias[0] > 0.0 || perp__step_tie(world, island, work->chosen[i])->moved)
            unit->rows = unit->tangents = 0;
        return rows->bias[0] >= 0.0;
    }
    if (i >= work->inequalities) {
        unit->kind = PERP__STATICS_FREE;
        for (int32_t k = 0; k < rows->dim; k++)
            if (rows->bias[k] != 0.0)
                return 0;
        return 1;
    }
    unit->kind = PERP__STATICS_INTERVAL;
    unit->rows = 1;
    unit->lower = 0.0;
    unit->upper = INFINITY;
    if (rows->bounded) {
        *from = 1;
        unit->upper = -rows->bias[0] / rows->compliance[0];
        unit->lower = -unit->upper;
        return rows->bias[1] == 0.0;
    }
    if (rows->bias[0] > 0.0)
        unit->rows = 0;
    return rows->bias[0] >= 0.0;
}

int32_t perp__gather_standing(perp_world *world, const perp__island *island, int32_t ignores)
{
    perp__island_work *work = &world->work;
    perp__statics_rows *own = &work->stand_rows;
    int32_t links = 0;
    size_t at = 0;

    own->size = 0;
    for (int32_t i = 0; i < work->units; i++) {
        perp__statics_unit *unit = &work->stand_units[i];
        int32_t from;

        memset(unit, 0, sizeof *unit);
        unit->row = own->size;
        if (!write_unit(world, island, i, unit, &from) && !ignores)
            return 0;
        link_unit(world, island, i, from, unit, &links, &at);
        if (unit->links == 0)
            unit->rows = 0;
        own->size += unit->rows;
    }
    own->width = world->dof;
    own->nodes = island->bodies;
    own->units = work->units;
    own->links = links;
    own->unit = work->stand_units;
    own->link = work->stand_links;
    own->values = work->stand_values;
    return 1;
}

/* Impulses of the forces, and what the change to v_carried takes, of each body, turns over its
 * length; work.still: v_carried. */
static void find_forces(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__body *body = &world->bodies[work->members[i]];
        const double length = perp__body_length(world, work->members[i]);
        double twist[6], carried[6], now[6];

        perp__twist_of(world, work->free + n * i, twist);
        perp__carried_twist(world, carrying, work->members[i], carried);
        perp__coordinates_of(world, carried, work->still + n * i);
        perp__twist_of(world, work->now + n * i, now);
        find_turning(world, work->members[i], now + 3, carried + 3,
                     work->share * world->step_length, twist + 3);
        for (int32_t k = 0; k < 3; k++) {
            twist[k] = body->mass * (twist[k] - carried[k]);
            twist[3 + k] /= length;
        }
        perp__coordinates_of(world, twist, work->stand_forces + n * i);
    }
}

/* ---- factors ---- */

static void mix(uint64_t key[2], const void *data, size_t bytes)
{
    const char *from = data;

    for (size_t at = 0; at + sizeof(uint64_t) <= bytes; at += sizeof(uint64_t)) {
        uint64_t word;

        memcpy(&word, from + at, sizeof word);
        key[0] = (key[0] ^ word) * 0x9E3779B97F4A7C15u;
        key[0] ^= key[0] >> 29;
        key[1] = (key[1] + word) * 0xC2B2AE3D27D4EB4Fu;
        key[1] ^= key[1] >> 31;
    }
}

static void find_key(const perp_world *world, const perp__statics_rows *rows, uint64_t key[2])
{
    const perp__island_work *work = &world->work;
    const perp__statics_unit *last = rows->unit + rows->units - 1;
    const size_t numbers =
        rows->links > 0 ? rows->link[rows->links - 1].at + 6 * (size_t)(rows->width) : 0;

    (void)last;
    key[0] = 0x243F6A8885A308D3u ^ (uint64_t)rows->nodes;
    key[1] = 0x13198A2E03707344u ^ (uint64_t)rows->size;
    for (int32_t i = 0; i < rows->units; i++)
        mix(key, &rows->unit[i], sizeof rows->unit[i]);
    mix(key, rows->link, (size_t)rows->links * sizeof *rows->link);
    mix(key, work->stand_base, (size_t)rows->size * sizeof(double));
    mix(key, rows->values, numbers * sizeof(double));
}

/* The workspace with this key, or the one that was used longest ago. */
static perp__statics *find_statics(perp_world *world, const uint64_t key[2], int32_t *is_known)
{
    perp__standing *standing = world->standing;
    int32_t oldest = 0;

    *is_known = 0;
    for (int32_t i = 0; i < PERP__STANDING_KEPT; i++) {
        if (key && standing->statics[i] && standing->key[i][0] == key[0] &&
            standing->key[i][1] == key[1]) {
            *is_known = 1;
            oldest = i;
            break;
        }
        if (standing->used[i] < standing->used[oldest])
            oldest = i;
    }
    if (!standing->statics[oldest])
        standing->statics[oldest] = perp__statics_create(world->context);
    standing->used[oldest] = ++standing->clock;
    if (!*is_known)
        standing->key[oldest][0] = standing->key[oldest][1] = 0;
    standing->last = oldest;
    return standing->statics[oldest];
}

/* ---- the question ---- */

/* Within what a step may cost: where it has a time limit, decisions of which some thirty
 * factorisations fit in at a product a nanosecond. */
static perp_status set_up(const perp_world *world, perp__statics *statics,
                          const perp__statics_rows *rows)
{
    double most = MOST_PRODUCTS;

    if (world->budget.limited)
        most = fmin(most, 1e9 / MOST_FACTORS * world->settings.time_limit);
    perp__statics_limit(statics, most);
    return perp__statics_set_up(statics, rows);
}

/* What was decided in an earlier step, if all that presses then still touches. */
static int32_t recall_base(const perp_world *world, const perp__island *island)
{
    const perp__island_work *work = &world->work;
    int32_t any = 0;

    for (int32_t i = 0; i < work->count; i++) {
        const double *base = perp__step_response(world, island, work->chosen[i])->base;
        const perp__statics_unit *unit = &work->stand_units[i];

        if (base[0] > 0.0 && unit->rows == 0)
            return 0;
        any |= base[0] > 0.0;
        for (int32_t k = 0; k < unit->rows; k++)
            work->stand_base[unit->row + k] = base[k];
    }
    return any && work->units == work->count;
}

/* Impulses and velocities of an island that stands. */
static void take_answer(perp_world *world, const perp__island *island, int32_t decided)
{
    perp__island_work *work = &world->work;

    for (int32_t i = 0; i < work->units; i++) {
        const perp__statics_unit *unit = &work->stand_units[i];
        const perp__rigid_rows *rows = &work->rows[i];
        double *r = work->impulse + 3 * i;

        memset(r, 0, 3 * sizeof *r);
        memset(work->velocity + 3 * i, 0, 3 * sizeof *r);
        for (int32_t k = 0; k < unit->rows; k++)
            r[k + rows->bounded] = work->stand_r[unit->row + k];
        if (rows->bounded)
            r[0] = unit->upper;
        if (i < work->count || !rows->bounded)
            work->velocity[3 * i] = rows->bias[0];
        if (i >= work->count)
            continue;
        work->modes[i] = r[0] > 0.0 ? PERP_CONTACT_STICK : PERP_CONTACT_SEPARATE;
        if (decided)
            perp__copy3(perp__step_response(world, island, work->chosen[i])->base, r);
    }
    memcpy(work->v, work->still, (size_t)(world->dof * island->bodies) * sizeof(double));
}

perp_status perp__stand(perp_world *world, const perp__island *island,
                        const perp__carrying *carrying, perp__verdict *verdict, int32_t *stands)
{
    perp__island_work *work = &world->work;
    perp__statics_aim aim = {PERP_STATICS_INTERIOR, MOST_ITERATIONS, 0, NULL};
    perp__statics_answer answer = {0};
    perp__statics_rows *rows = &work->stand_rows;
    perp__statics *statics;
    int32_t is_known, decided = 0;
    perp_status status = PERP_OK;

    *stands = 0;
    if ((world->settings.cone != 0 && !world->settings.planar) ||
        !perp__gather_standing(world, island, 0) || rows->size == verdict->asked)
        return PERP_OK;
    find_forces(world, island, carrying);
    answer.r = work->stand_r;
    answer.verdict = PERP_STATICS_INDETERMINATE;
    if (recall_base(world, island)) {
        uint64_t key[2];

        find_key(world, rows, key);
        statics = find_statics(world, key, &is_known);
        if (!statics)
            return PERP_ERROR_MEMORY;
        status = is_known ? PERP_OK : set_up(world, statics, rows);
        if (status == PERP_OK && !perp__statics_is_too_large(statics)) {
            perp__statics_adjust(statics, rows, &answer, work->stand_forces, work->stand_base,
                                 is_known);
            memcpy(world->standing->key[world->standing->last], key, sizeof key);
        }
    }
    if (status == PERP_OK && answer.verdict != PERP_STATICS_STANDS) {
        statics = find_statics(world, NULL, &is_known);
        if (!statics)
            return PERP_ERROR_MEMORY;
        status = set_up(world, statics, rows);
        if (status == PERP_OK && !perp__statics_is_too_large(statics))
            status = perp__statics_decide(statics, &answer, work->stand_forces, &aim);
        decided = 1;
        perp__spend(world, answer.iterations);
    }
    if (status != PERP_OK || answer.verdict != PERP_STATICS_STANDS) {
        verdict->asked = rows->size;
        return status;
    }
    take_answer(world, island, decided);
    verdict->outcome = perp__worse_outcome(verdict->outcome, PERP_OUTCOME_SOLVED);
    perp__raise_to(&verdict->residual, answer.unbalance);
    verdict->stands = *stands = 1;
    return PERP_OK;
}

/* Joints are closed in the next positions by Newton's method: limits that its ways pass and
 * contacts that they take deep take part. */
#include <math.h>
#include <string.h>

#include "contact/coloured/coloured.h"
#include "world/joints/joints.h"

/* A pass more or less doubles the digits; one that has to be shortened to this takes nothing, and
 * after one that leaves more than SLOW all bodies weigh the same: light ones of what is taut would
 * turn to and fro rather than take a heavy one along. With contacts it is so many sweeps over
 * these, joints met after each. */
#define PASSES 32
#define SWEEPS 16
#define SLOW 0.5
#define SHORTEST 0x1p-6

/* Gaps where closing begins, by what t of the motions makes of those of the set; `came` is what
 * ways make of them since. */
static void begin_gaps(perp_world *world, const perp__island *island, double t)
{
    perp__island_work *work = &world->solve.work;

    memset(work->hit, 0, (size_t)island->contacts);
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        work->gap[i] = contact->gap +
                       t * perp__normal_velocity(world, contact, PERP__TWIST_MOVING) +
                       (t == 0.0 ? perp__normal_velocity(world, contact, PERP__TWIST_SHIFT) : 0.0);
        work->came[i] = 0.0;
    }
}

/* Contacts that ways take deep, as heavy bodies pull light ones into an edge, take part when a pass
 * is taken again; not what is out in a step, where something `opens`. Returns how many came. */
static int32_t shut_contacts(perp_world *world, const perp__island *island, bool opens)
{
    perp__island_work *work = &world->solve.work;
    int32_t came = 0;

    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);
        const double deep = perp__deep_overlap(contact), gap = work->gap[i];
        const double way = work->came[i] + perp__normal_velocity(world, contact, PERP__TWIST_SHIFT);

        if (!work->hit[i] && gap + way < -deep &&
            -way > (opens ? fmax(deep, perp__cleared(-gap, 0.5 * deep)) : 0.0)) {
            perp__step_flags(world, island, i)->pushes = 1;
            came += work->hit[i] = 1;
        }
    }
    return came;
}

/* So much of the shift is gone; none takes part but what the next one takes deep. */
static void let_contacts_go(perp_world *world, const perp__island *island, double share)
{
    memset(world->solve.work.hit, 0, (size_t)island->contacts);
    for (int32_t i = 0; i < island->contacts; i++)
        world->solve.work.came[i] +=
            share *
            perp__normal_velocity(world, perp__step_contact(world, island, i), PERP__TWIST_SHIFT);
}

/* Limits that are passed take part now; returns how many came. *allowed: what joints may lack. */
static int32_t shut_limits(perp_world *world, const perp__island *island, double *allowed)
{
    int32_t came = 0;

    *allowed = 0.0;
    for (int32_t i = 0; i < island->joints; i++) {
        perp__joint *joint = perp__island_joint(world, island, i);
        const perp__joint_state *state = perp__state_of(world, joint);

        *allowed += joint->allowed;
        for (int32_t k = 0; k < 2; k++)
            if (!joint->closing[k] && (k == 0 ? joint->end.coordinate < state->lower
                                              : joint->end.coordinate > state->upper))
                came += joint->closing[k] = 1;
    }
    return came;
}

/* So much of the shift that was solved for, from where the island was. */
static void go_there(perp_world *world, const perp__island *island, double share)
{
    const perp__island_work *work = &world->solve.work;

    for (int32_t i = 0; i < island->bodies; i++) {
        perp__state *next = &world->step.next[work->members[i]];
        double *shift = perp__island_motion(world, island, i)->shift, turn[3] = {0.0, 0.0, 0.0};

        *next = work->before[i];
        if (share == 0.0)
            continue;
        perp__twist_of(world, work->v + world->dof * i, shift);
        perp__add3(turn, share, shift + 3);
        perp__add3(next->position, share, shift);
        perp__turn(world, next, 1.0, turn);
    }
}

perp_status perp__close_island(perp_world *world, const perp__island *island, double t,
                               int32_t *changed)
{
    double error = perp__island_errors(world, island), left, allowed;
    int32_t slow, stuck, came, sunk, held = perp__has_put(world, island) ? -1 : 0, far = 0,
                                     equally = 0, keeps = 0, near = 0, moved;

    if (error == 0.0)
        return PERP_OK;
    begin_gaps(world, island, t);
    for (int32_t i = 0; i < island->bodies; i++)
        perp__copy3(world->solve.work.still + world->dof * i,
                    world->step.next[world->islands.body_order[island->first_body + i]].position);
    for (int32_t i = 0; i < island->joints; i++)
        memset(perp__island_joint(world, island, i)->closing, 0, 2 * sizeof(int32_t));
    (void)shut_limits(world, island, &allowed);
    for (int32_t pass = 0; pass < PASSES && error > 0.0; pass++) {
        double share = 1.0;
        perp_status status;

        perp__pose_positions(world, island, PERP__ROWS_OF_CLOSING, equally);
        for (int32_t i = 0; i < island->bodies; i++)
            world->solve.work.before[i] = world->step.next[world->solve.work.members[i]];
        world->solve.coloured.joints.keeps = keeps;
        status = perp__solve_equations(world, island, held > 0 ? SWEEPS : 1, NULL);
        world->solve.coloured.joints.keeps = 0; /* where memory ran out, too */
        if (status == PERP_ERROR_MEMORY)
            return status;
        go_there(world, island, 1.0);
        left = perp__island_errors(world, island);
        sunk = held < 0 ? 0 : shut_contacts(world, island, t > 0.0);
        came = shut_limits(world, island, &allowed);
        while (!(left < error) && came + sunk == 0 && share > SHORTEST) {
            share *= 0.5;
            go_there(world, island, share);
            left = perp__island_errors(world, island);
        }
        slow = came + sunk == 0 && !(left < SLOW * error);
        stuck = slow && equally && held <= 0 && !(left < error);
        equally |= slow;
        /* what is taken back has its factors still; others serve once more where twice the share
         * that they left is, of what is left, no more than joints may lack */
        moved = left < error && sunk == 0;
        keeps = came == 0 && !slow && !near &&
                (!moved || (share == 1.0 && 2.0 * left * left <= error * allowed));
        near = keeps && moved;
        if (moved) {
            let_contacts_go(world, island, share);
            held = held < 0 ? held : 0;
            error = left;
            *changed = 1;
            continue;
        }
        go_there(world, island, 0.0);
        (void)perp__island_errors(world, island);
        if (stuck)
            break;
        far |= sunk > 0;
        held += sunk;
        if (came + sunk == 0 && held > 0) {
            let_contacts_go(world, island, 0.0);
            held = -1;
        }
    }
    /* ways from `still` that may lead deep into others, or do but for contacts that took part: no
     * sweep has seen them */
    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = world->islands.body_order[island->first_body + i];
        double way[3];

        perp__subtract3(way, world->step.next[body].position,
                        world->solve.work.still + world->dof * i);
        if (far ||
            perp__length3(way) > perp__level_of(world)->deep * world->bodies.all[body].radius)
            world->step.roles[body].far = 1;
    }
    return PERP_OK;
}

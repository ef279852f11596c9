/* What an island's velocities may cost: the level of accuracy, and the budget that it gives to
 * islands that are large. */
#include "world/islands/lanes.h"

#include "step/impact.h"
#include "world/joints/joints.h"

/* The heaviest body of an island over its lightest from which on sweeps get nowhere. */
#define LARGE_RATIO 1e3

#define FEW_BODIES 2 /* that are solved exactly at once */

/* The overlap of what is at rest that is not left as it is, in those that are. */
#define TOO_DEEP 2.0

#define CLEAR 2 /* passes that take overlap away */

#define PASSES_OF_A_SUBSTEP 4 /* passes for each of settings.substeps */

/* Rounds of passes at most. From one body to the next, which is as far as a pass goes, n of them
 * with momentum take a ratio of masses of n^2 or so, where a light one bears heavy ones. */
#define ROUNDS 6

/* What moves heavily over what moves lightly: a mass, or where turns count the inertia about some
 * axis beside the body's size. */
static double mass_ratio(const perp_world *world, const perp__island *island, bool turns)
{
    double least = INFINITY, most = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__body *body =
            &world->bodies.all[world->islands.body_order[island->first_body + i]];
        const double square = body->radius * body->radius;

        least = fmin(least, body->mass);
        most = fmax(most, body->mass);
        for (int32_t k = 0; k < 9 && turns && square > 0.0; k += 4)
            if (body->inverse_inertia[k] > 0.0)
                least = fmin(least, 1.0 / (body->inverse_inertia[k] * square));
    }
    return most / least;
}

double perp__swept_tol(const perp_world *world)
{
    const perp_world_settings *settings = &world->settings;

    return (settings->tol > 0.0 || settings->accuracy == PERP_ACCURACY_EXACT) &&
                   !perp__is_sketch(world)
               ? perp__exact_tol(world)
               : perp__level_of(world)->tol;
}

bool perp__is_few(const perp_world *world, const perp__island *island, int32_t most)
{
    return island->contacts + 2 * island->joints <= most * (world->settings.planar ? 4 : 1);
}

bool perp__is_worth_exact(const perp_world *world, const perp__island *island)
{
    const perp_world_settings *settings = &world->settings;
    bool swept = perp__level_of(world)->sweeps_few && island->bodies > 1 && island->joints == 0;

    /* sweeps serve for a few bodies as well where they are cheaper beside others (lanes.h), and no
     * impact has an instant to be found */
    for (int32_t i = 0; i < island->contacts && swept; i++)
        swept = perp__step_contact(world, island, i)->restitution == 0.0;
    return (settings->accuracy == PERP_ACCURACY_EXACT && !world->step.sketches &&
            !perp__is_time_over(world)) ||
           (settings->cone != 0 && !settings->planar) || island->contacts == 0 ||
           ((island->bodies <= FEW_BODIES || perp__is_few(world, island, PERP__FEW_CONTACTS)) &&
            !swept) ||
           (island->joints == 0 && mass_ratio(world, island, 1) >= LARGE_RATIO);
}

/* Contacts with restitution that pressed and had come faster than what the forces make. */
static bool has_impacts(const perp_world *world, const perp__island *island)
{
    const bool lies = perp__lies_on_something(world, island);

    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (contact->restitution > 0.0 && world->solve.work.impulse[3 * i] > 0.0 &&
            perp__is_hit(contact->restitution, contact->start,
                         perp__forced_speed(world, island, i, lies)))
            return 1;
    }
    return 0;
}

/* Velocities after the impacts, by Moreau's law from the same beginning; what moves the positions
 * stays. What presses only when others are hit is hit too, if the level's looks find it. */
static perp_status bounce(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                          const perp__rigid_problem *problem, const perp__passes *step)
{
    perp__island_work *work = &world->solve.work;
    perp__passes passes = *step;
    perp_status status = PERP_OK;
    double share = 1.0;
    int32_t looks = perp__level_of(world)->looks, came = 1;

    passes.clear = 0;
    for (int32_t i = work->count; i < work->inequalities; i++) {
        const perp__joint_unit *unit = &work->joint_units[i - work->count];

        if (unit->slot < PERP__SLOT_MOTOR && /* a limit that is not reached yet */
            world->joints.all[unit->joint].gap[unit->slot - PERP__SLOT_LOWER] > 0.0)
            memset(work->rows[i].rows, 0, sizeof work->rows[i].rows);
    }
    for (; came && looks > 0 && status == PERP_OK; looks--) {
        for (int32_t i = 0; i < island->contacts; i++) {
            const perp__world_contact *contact = perp__step_contact(world, island, i);

            if (work->impulse[3 * i] > 0.0 || contact->gap <= work->guard[i]) {
                work->rows[i].bias[0] =
                    perp__moreau_shift(share * contact->restitution, contact->start);
                work->gap[i] = 0.0;
            }
        }
        status = perp__coloured_step(&world->solve.coloured, answer, NULL, problem, &passes);
        if (status == PERP_OK)
            perp__spend(world, answer->iterations);
        came = 0;
        for (int32_t i = 0; i < island->contacts; i++)
            came |= work->impulse[3 * i] > 0.0 && work->gap[i] > 0.0 &&
                    perp__step_contact(world, island, i)->restitution > 0.0;
        if (!came && island->joints == 0)
            looks += came = perp__lessens(world, island, problem->tol, &share);
    }
    return status;
}

void perp__close_gaps(perp_world *world, const perp__island *island, double h)
{
    for (int32_t i = 0; i < island->contacts; i++)
        world->solve.work.rows[i].bias[0] =
            perp__left_gap(world, perp__step_contact(world, island, i)) / h;
}

/* The rows of the island, joints where its trial motion takes them, and what forces make of it. */
static void pose_rows(perp_world *world, const perp__island *island, double h)
{
    perp__place_joints(world, island, h);
    perp__choose_rows(world, island, NULL);
    perp__force_bodies(world, island, 1.0);
    perp__time_joints(world, h);
}

double perp__deep_overlap(const perp__world_contact *contact)
{
    return TOO_DEEP * PERP__NEAR * contact->size;
}

bool perp__is_deep(const perp__world_contact *contact)
{
    return contact->gap < -perp__deep_overlap(contact);
}

void perp__pose_sweep(perp_world *world, const perp__island *island, double h,
                      perp__sweeping *sweeping)
{
    perp__island_work *work = &world->solve.work;
    perp__passes *step = &sweeping->step;
    const int32_t substeps = world->settings.substeps;
    const double deep = island->joints > 0 ? perp__level_of(world)->deep / PERP__NEAR : 0.0;

    /* 1. The rows, the budget, and what contacts may close. */
    pose_rows(world, island, h);
    *step = (perp__passes){.h = h, .measures = 1, .gap = work->gap, .guard = work->guard};
    step->passes = substeps > 0 ? PASSES_OF_A_SUBSTEP * substeps : PERP__PASSES;
    step->rounds = substeps > 0         ? 1
                   : island->joints > 0 ? ROUNDS
                                        : (int32_t)fmax(ROUNDS, sqrt(mass_ratio(world, island, 0)));
    step->clear = perp__has_put(world, island) ? 0 : CLEAR;      /* the projection's */
    step->deep = sweeping->carried ? 0.0 : fmax(TOO_DEEP, deep); /* what settles sinks no more */
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        work->gap[i] = fmin(contact->gap, perp__left_gap(world, contact));
        work->guard[i] = PERP__NEAR * contact->size;
        work->rows[i].bias[0] = 0.0;
    }
    perp__turn_contacts(world);
    /* 2. The problem. */
    for (int32_t i = island->contacts; i < work->units; i++)
        work->gap[i] = work->guard[i] = 0.0;
    perp__pose_island(world, island, &sweeping->problem);
    sweeping->problem.tol = perp__swept_tol(world);
}

void perp__take_sweep(perp_world *world, const perp__island *island, const perp__sweeping *sweeping)
{
    perp__island_work *work = &world->solve.work;
    double *shift = work->solved;

    perp__spend(world, sweeping->answer.iterations);
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        shift[i] -= work->v[i];
    perp__move_bodies(world, island, sweeping->problem.tol);
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->moving[i] += shift[i];
    for (int32_t i = 0; i < island->contacts; i++)
        perp__copy3(perp__step_response(world, island, i)->warm, work->impulse + 3 * i);
}

/* What the island has come to, for its bodies, contacts and joints. */
static void finish(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    perp__island_work *work = &world->solve.work;
    const size_t numbers = (size_t)(world->dof * island->bodies);

    if (verdict->stands) /* where it is: to lift it would be work */
        memcpy(work->moving, work->v, numbers * sizeof(double));
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        perp__tell_contact(world, island, i, response->impulse);
        perp__copy3(response->next, work->impulse + 3 * i);
        response->mode = work->modes[i];
    }
    memcpy(work->now, work->v, numbers * sizeof(double));
    perp__write_twists(world, island);
    perp__write_velocities(world, island);
    perp__add_joint_impulses(world, work->impulse + 3 * work->count, 1.0);
    verdict->stages = 1;
    verdict->swept = 1;
}

perp_status perp__begin_sweep(perp_world *world, const perp__island *island, double h,
                              perp__verdict *verdict, perp__sweeping *sweeping)
{
    perp__island_work *work = &world->solve.work;
    perp__carrying carrying;
    bool may;
    perp_status status = PERP_OK;

    perp__gather_bodies(world, island);
    perp__find_limits(world, island, h);
    perp__receive(world, &sweeping->answer);
    sweeping->carried = perp__begins_standing(world, island, 0, &carrying) ||
                        perp__begins_standing(world, island, 1, &carrying);
    may = sweeping->carried;
    for (int32_t i = 0; i < island->contacts && may; i++)
        may = perp__step_flags(world, island, i)->moved ||
              !perp__is_deep(perp__step_contact(world, island, i));
    if (!may)
        return PERP_OK;
    for (int32_t i = 0; i < island->bodies; i++)
        perp__carried_twist(world, &carrying, work->members[i], h,
                            perp__island_motion(world, island, i)->trial);
    pose_rows(world, island, h);
    perp__close_gaps(world, island, h);
    status = perp__stand(world, island, &carrying, verdict);
    if (!verdict->stands && island->joints > 0)
        perp__begin_joints(world, island, h, 0);
    return status;
}

perp_status perp__end_sweep(perp_world *world, const perp__island *island, double h,
                            perp__verdict *verdict, perp__sweeping *sweeping)
{
    const perp__rigid_problem *problem = &sweeping->problem;
    perp__rigid_answer *answer = &sweeping->answer;
    perp_status status = PERP_OK;

    if (!verdict->stands) {
        verdict->may_rest = sweeping->carried; /* so near to rest */
        verdict->impacts = has_impacts(world, island);
        if (verdict->impacts)
            status = bounce(world, island, answer, problem, &sweeping->step);
        verdict->residual = answer->tested;
        verdict->drive = answer->drive;
        verdict->outcome = answer->tested <= problem->tol ? PERP_OUTCOME_SOLVED
                           : perp__is_time_over(world)    ? PERP_OUTCOME_TIME_LIMIT
                                                          : PERP_OUTCOME_ITERATION_LIMIT;
        if (verdict->impacts == 0)
            perp__close_gaps(world, island, h);
        if (status == PERP_OK && verdict->impacts == 0)
            status = perp__stand_partly(world, island, 1, &verdict->residual);
    }
    if (status == PERP_OK)
        finish(world, island, verdict);
    return status;
}

perp_status perp__sweep_island(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict)
{
    perp__rounds rounds = {
        .change = INFINITY, .most = 1, .coarse = verdict->coarse, .turn = verdict->turn};
    perp__sweeping sweeping;
    bool again = 1;
    /* 1. the question whether it stands, of what begins so, or came so near in the last step */
    perp_status status = perp__begin_sweep(world, island, h, verdict, &sweeping);

    /* 2. sweeps, with joints where the motion takes them, while that changes it; what turned too
     * far for that in this step has them where they are at once */
    if (rounds.coarse)
        perp__stop_trial(world, island);
    while (status == PERP_OK && !verdict->stands && again) {
        perp__pose_sweep(world, island, h, &sweeping);
        status = perp__coloured_step(&world->solve.coloured, &sweeping.answer,
                                     world->solve.work.solved, &sweeping.problem, &sweeping.step);
        if (status != PERP_OK)
            return status;
        perp__take_sweep(world, island, &sweeping);
        again = island->joints > 0 && perp__goes_round(world, island, h, &rounds);
        if (!again && island->joints > 0 && !rounds.coarse &&
            perp__gives_energy(world, island, world->solve.work.units,
                               perp__swept_tol(world) + rounds.turn * rounds.turn)) {
            /* beyond second order: rows of the beginning give none */
            perp__stop_trial(world, island);
            rounds.coarse = again = 1;
        }
        if (again) {
            verdict->coarse = 1;
            verdict->turn = rounds.turn;
        }
    }
    /* 3. impacts, and what they leave */
    if (status == PERP_OK && !verdict->stands)
        verdict->rough |= island->joints > 0 && perp__is_rough(&rounds);
    return status == PERP_OK ? perp__end_sweep(world, island, h, verdict, &sweeping) : status;
}

/* What an island's velocities may cost: the level of accuracy, and the budget that it gives to
 * islands that are large. */
#include "world/islands/contact_rows.h"

#include <math.h>
#include <string.h>

#include "step/impact.h"
#include "world/islands/standing.h"

/* The heaviest body of an island over its lightest from which on sweeps get nowhere. */
#define LARGE_RATIO 1e3

/* Bodies that are solved exactly whatever the number of their contacts. */
#define FEW_BODIES 2

/* Contacts that are, whenever one comes: more wait until none comes any more. */
#define SMALL 8

/* Beside a contact's size: an overlap that is left as it is; and the overlap, in these, of what is
 * at rest that is not. */
#define GUARD 1e-3
#define TOO_DEEP 2.0

/* Passes that take overlap away. */
#define CLEAR 2

/* Beside what forces make of it in a step: a speed with which something comes from rest; and one
 * that sweeps leave of what comes to rest. */
#define FROM_REST 0.5
#define SETTLING 0.1

/* Passes for each of settings.substeps. */
#define PASSES_OF_A_SUBSTEP 4

typedef struct level {
    int32_t passes;
    int32_t few; /* contacts up to which an island is solved exactly all the same */
    double tol;  /* tested residual that is called solved */
} level;

/* Contacts from which on an island is deep: what a pass does goes on to the next body only, so that
 * such a one gets half as many again. */
#define DEEP_ISLAND 1000

/* From the measured curve, bench/results/world.txt. */
static const level levels[] = {
    {16, 8, 1e-2},  /* fast */
    {32, 40, 1e-3}, /* standard */
    {96, 64, 1e-6}  /* accurate */
};

double perp__mass_ratio(const perp_world *world, const perp__island *island)
{
    double least = INFINITY, most = 0.0;

    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__body *body = &world->bodies[world->body_order[island->first_body + i]];
        const double square = body->radius * body->radius;

        least = fmin(least, body->mass);
        most = fmax(most, body->mass);
        for (int32_t k = 0; k < 9 && square > 0.0; k += 4)
            if (body->inverse_inertia[k] > 0.0)
                least = fmin(least, 1.0 / (body->inverse_inertia[k] * square));
    }
    return most / least;
}

double perp__swept_tol(const perp_world *world)
{
    const perp_world_settings *settings = &world->settings;

    return settings->tol > 0.0 || settings->accuracy == PERP_ACCURACY_EXACT
               ? perp__exact_tol(world)
               : levels[settings->accuracy].tol;
}

static int32_t has_at_most(const perp_world *world, const perp__island *island, int32_t few)
{
    return island->contacts <= few * (world->settings.planar ? 4 : 1) ||
           island->bodies <= FEW_BODIES;
}

int32_t perp__is_small(const perp_world *world, const perp__island *island)
{
    return has_at_most(world, island, SMALL);
}

int32_t perp__is_worth_exact(const perp_world *world, const perp__island *island)
{
    const perp_world_settings *settings = &world->settings;

    if (settings->accuracy == PERP_ACCURACY_EXACT || (settings->cone != 0 && !settings->planar) ||
        perp__is_small(world, island) || perp__mass_ratio(world, island) >= LARGE_RATIO)
        return 1;
    return has_at_most(world, island, levels[settings->accuracy].few);
}

static int32_t count_passes(const perp_world *world, const perp__island *island)
{
    const int32_t exact = world->settings.accuracy == PERP_ACCURACY_EXACT;
    const int32_t passes = levels[exact ? PERP_ACCURACY_ACCURATE : world->settings.accuracy].passes;

    if (world->settings.substeps > 0)
        return PASSES_OF_A_SUBSTEP * world->settings.substeps;
    return island->contacts >= DEEP_ISLAND ? passes + passes / 2 : passes;
}

static void plan(perp_world *world, const perp__island *island, perp__passes *step, double h)
{
    perp__island_work *work = &world->work;

    memset(step, 0, sizeof *step);
    step->h = h;
    step->passes = count_passes(world, island);
    step->clear = CLEAR;
    step->gap = work->gap;
    step->guard = work->guard;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        work->gap[i] = contact->gap > contact->rounding ? contact->gap : fmin(contact->gap, 0.0);
        work->guard[i] = GUARD * contact->size;
        work->rows[i].bias[0] = 0.0;
    }
}

/* Contacts with restitution that pressed and had come faster than what the forces make. */
static int32_t has_impacts(const perp_world *world, const perp__island *island)
{
    const int32_t lies = perp__lies_on_something(world, island);

    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (world->work.impulse[3 * i] > 0.0 &&
            perp__is_hit(contact->restitution, contact->start,
                         perp__forced_speed(world, i, island->bodies, lies)))
            return 1;
    }
    return 0;
}

/* Velocities after the impacts, by Moreau's law from the same beginning; what moves the positions
 * stays. */
static perp_status bounce(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                          const perp__rigid_problem *problem, const perp__passes *step)
{
    perp__island_work *work = &world->work;
    perp__passes passes = *step;

    passes.clear = 0;
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        if (work->impulse[3 * i] > 0.0 || contact->gap <= work->guard[i]) {
            work->rows[i].bias[0] = perp__moreau_shift(contact->restitution, contact->start);
            work->gap[i] = 0.0;
        }
    }
    return perp__coloured_step(&world->coloured, answer, NULL, problem, &passes);
}

static void take_verdict(perp__rigid_answer *answer, perp__verdict *verdict)
{
    if (!perp__is_good(answer->outcome))
        answer->outcome = PERP_OUTCOME_ITERATION_LIMIT;
    verdict->outcome = answer->outcome;
    verdict->residual = answer->tested;
}

/* The answer of the impulses work.warm, as they are: all of it where they are one to `tol`. */
static perp_status look(perp_world *world, perp__rigid_answer *answer, perp__rigid_problem *problem,
                        double tol, perp__verdict *verdict)
{
    perp_status status = PERP_OK;

    problem->max_iterations = -1;
    if (!perp__rigid_refute(answer, problem, tol)) {
        status = perp__rigid_solve(world->solver, answer, problem);
        problem->again = status == PERP_OK; /* the same rows from here on */
    }
    if (status == PERP_OK)
        take_verdict(answer, verdict);
    return status;
}

/* Biases of the step: what gaps leave. */
static void close_gaps(perp_world *world, const perp__island *island, double h)
{
    for (int32_t i = 0; i < island->contacts; i++) {
        const perp__world_contact *contact = perp__step_contact(world, island, i);

        world->work.rows[i].bias[0] = fmax(perp__open_gap(contact, contact->gap), 0.0) / h;
    }
}

/* What the sweeps are worth: the contact layer looks at their point, and goes nowhere from it. */
static perp_status judge(perp_world *world, const perp__island *island, perp__rigid_answer *answer,
                         perp__rigid_problem *problem, double h, perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    const size_t size = 3 * (size_t)island->contacts * sizeof(double);

    if (verdict->impacts == 0)
        close_gaps(world, island, h);
    memcpy(work->warm, work->impulse, size);
    problem->tol = perp__swept_tol(world);
    return look(world, answer, problem, problem->tol, verdict);
}

int32_t perp__comes_from_rest(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < world->work.count; i++) {
        const perp__world_contact *contact =
            perp__step_contact(world, island, world->work.chosen[i]);
        const double pushed = perp__normal_terms(world, i, world->work.gain, island->bodies);
        double u[3];

        perp__relative_velocity(world, contact, PERP__TWIST_START, u);
        if (!(fmax(fabs(u[0]), world->work.rows[i].mu > 0.0 ? hypot(u[1], u[2]) : 0.0) <=
              FROM_REST * pushed))
            return 0;
    }
    return 1;
}

/* The problem of the island, and what its motion needs. */
static void pose(perp_world *world, const perp__island *island, perp__rigid_problem *problem,
                 perp__rigid_answer *answer)
{
    perp__gather_bodies(world, island);
    perp__choose_rows(world, island, NULL);
    perp__force_bodies(world, island, 1.0);
    perp__pose_island(world, island, problem);
    perp__receive(world, answer);
}

int32_t perp__is_deep(const perp__world_contact *contact)
{
    return contact->gap < -TOO_DEEP * GUARD * contact->size;
}

static int32_t has_deep(const perp_world *world, const perp__island *island)
{
    for (int32_t i = 0; i < island->contacts; i++)
        if (perp__is_deep(perp__step_contact(world, island, i)))
            return 1;
    return 0;
}

/* Whether all of it stands with the motion of what carries it; then work has the answer. */
static perp_status stand(perp_world *world, const perp__island *island, double h,
                         const perp__carrying *carrying, perp__verdict *verdict)
{
    verdict->stands = 0;
    if (has_deep(world, island))
        return PERP_OK;
    close_gaps(world, island, h);
    return perp__stand(world, island, carrying, verdict, &verdict->stands);
}

/* Whether the island came to rest, or nearly so: it began slower than forces make in a step, and
 * sweeps took most of that away. Sliding that goes on, and falling, do neither; so the question is
 * put about once each time that a pile settles. */
static int32_t comes_to_rest(const perp_world *world, const perp__island *island,
                             const perp__carrying *carrying)
{
    const perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->bodies; i++) {
        const int32_t body = work->members[i];
        double twist[6], carried[6], before[6], after[6], gain, began, ended;

        perp__carried_twist(world, carrying, body, twist);
        perp__coordinates_of(world, twist, carried);
        for (int32_t k = 0; k < n; k++) {
            before[k] = work->start[n * i + k] - carried[k];
            after[k] = work->v[n * i + k] - carried[k];
        }
        gain = perp__mass_norm(world, body, work->gain + n * i);
        began = perp__mass_norm(world, body, before);
        ended = perp__mass_norm(world, body, after);
        if (!(began <= gain && ended <= SETTLING * gain))
            return 0;
    }
    return 1;
}

/* What the island has come to, for its bodies and contacts. */
static void keep(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;

    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        perp__copy3(response->impulse, work->impulse + 3 * i);
        perp__copy3(response->next, work->impulse + 3 * i);
    }
    memcpy(work->now, work->v, (size_t)(world->dof * island->bodies) * sizeof(double));
    perp__write_twists(world, island);
}

static void finish(perp_world *world, const perp__island *island, perp__verdict *verdict)
{
    keep(world, island);
    perp__write_velocities(world, island);
    for (int32_t i = 0; i < island->contacts; i++)
        perp__step_response(world, island, i)->mode = world->work.modes[i];
    verdict->stages = verdict->swept = 1;
}

perp_status perp__sweep_island(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    perp__carrying carrying;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step;
    perp_status status = PERP_OK;

    pose(world, island, &problem, &answer);
    if (perp__begins_standing(world, island, &carrying))
        status = stand(world, island, h, &carrying, verdict);
    if (status != PERP_OK)
        return status;
    if (verdict->stands) {
        verdict->sweeps = 0;
        memcpy(work->moving, work->v, (size_t)(world->dof * island->bodies) * sizeof(double));
        finish(world, island, verdict);
        return PERP_OK;
    }
    verdict->sweeps++;
    for (int32_t i = 0; i < island->contacts; i++)
        perp__copy3(work->warm + 3 * i, perp__step_response(world, island, i)->warm);
    plan(world, island, &step, h);
    status = perp__coloured_step(&world->coloured, &answer, work->moving, &problem, &step);
    if (status != PERP_OK)
        return status;
    perp__spend(world, answer.iterations);
    keep(world, island);
    for (int32_t i = 0; i < island->contacts; i++) {
        perp__response *response = perp__step_response(world, island, i);

        perp__copy3(response->warm, response->next);
    }
    return PERP_OK;
}

/* What keep() kept. */
static void recall(perp_world *world, const perp__island *island)
{
    perp__island_work *work = &world->work;
    const int32_t n = world->dof;

    for (int32_t i = 0; i < island->contacts; i++)
        perp__copy3(work->impulse + 3 * i, perp__step_response(world, island, i)->impulse);
    for (int32_t i = 0; i < island->bodies; i++) {
        const perp__motion *motion = perp__island_motion(world, island, i);

        perp__coordinates_of(world, motion->moving, work->moving + n * i);
        perp__coordinates_of(world, motion->after, work->v + n * i);
    }
}

/* The true residual is told, and where it is not small enough, that it was a budget which ended
 * the sweeps. */
perp_status perp__finish_swept(perp_world *world, const perp__island *island, double h,
                               perp__verdict *verdict)
{
    perp__island_work *work = &world->work;
    perp__rigid_problem problem;
    perp__rigid_answer answer;
    perp__passes step;
    perp__carrying carrying;
    perp_status status = PERP_OK;

    pose(world, island, &problem, &answer);
    plan(world, island, &step, h);
    recall(world, island);
    for (int32_t i = 0; i < world->dof * island->bodies; i++)
        work->drift[i] = work->moving[i] - work->v[i];
    if (has_impacts(world, island)) {
        verdict->impacts = 1;
        status = bounce(world, island, &answer, &problem, &step);
        perp__spend(world, answer.iterations);
    }
    if (status == PERP_OK && verdict->impacts == 0 &&
        perp__find_carrying(world, island, &carrying) && comes_to_rest(world, island, &carrying))
        status = stand(world, island, h, &carrying, verdict);
    if (status == PERP_OK && verdict->stands) { /* where it is: to lift it would be work */
        memcpy(work->moving, work->v, (size_t)(world->dof * island->bodies) * sizeof(double));
        finish(world, island, verdict);
        return PERP_OK;
    }
    PERP__THEN(status, judge(world, island, &answer, &problem, h, verdict));
    if (status == PERP_OK && work->carriers == 0 && perp__take_energy(world, island, h))
        status = judge(world, island, &answer, &problem, h, verdict);
    if (status == PERP_OK)
        finish(world, island, verdict);
    return status;
}
